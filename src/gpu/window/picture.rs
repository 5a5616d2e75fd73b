//! Pictures that panels show: images with a place in the panels' textures.

use std::sync::Arc;

use ash::vk;

use super::super::{Buffer, Context};
use super::image::{Image, Purpose};
use crate::error::Result;

/// Bytes of sRGB codes R, G, B and A.
const FORMAT: vk::Format = vk::Format::R8G8B8A8_SRGB;

/// Which picture of a painter.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct PictureId(pub(super) usize);

/// A picture of fixed size.
pub(super) struct Picture {
    pub(super) image: Image,
    pub(super) size: [u32; 2],
    /// What it is to show from the next frame on; none where it shows that already.
    pub(super) next: Option<Buffer>,
    /// What it was copied from last: the copy may still be under way.
    pub(super) shown: Option<Buffer>,
}

impl Picture {
    pub(super) fn new(context: &Arc<Context>, size: [u32; 2]) -> Result<Self> {
        let purpose = Purpose {
            name: "picture",
            format: FORMAT,
            seen_as: FORMAT,
            usage: vk::ImageUsageFlags::SAMPLED | vk::ImageUsageFlags::TRANSFER_DST,
        };
        Ok(Self { image: Image::new(context, size, &purpose)?, size, next: None, shown: None })
    }
}
