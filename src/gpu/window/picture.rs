//! Pictures that panels show: images with an entry in the panels' textures.

use std::sync::Arc;

use ash::vk;

use super::super::{Buffer, Context};
use super::image::{Image, Purpose};
use crate::error::Result;

/// Bytes of sRGB codes R, G, B and A.
const FORMAT: vk::Format = vk::Format::R8G8B8A8_SRGB;

/// Index of a picture of a painter.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct PictureId(pub(super) usize);

/// A picture of fixed size.
pub(super) struct Picture {
    pub(super) image: Image,
    pub(super) size: [u32; 2],
    /// New content, shown from the next frame on. `None` if the image holds it.
    pub(super) next: Option<Buffer>,
}

impl Picture {
    pub(super) fn new(context: &Arc<Context>, size: [u32; 2]) -> Result<Self> {
        let purpose = Purpose {
            name: "picture",
            format: FORMAT,
            seen_as: FORMAT,
            usage: vk::ImageUsageFlags::SAMPLED | vk::ImageUsageFlags::TRANSFER_DST,
        };
        Ok(Self { image: Image::new(context, size, &purpose)?, size, next: None })
    }
}
