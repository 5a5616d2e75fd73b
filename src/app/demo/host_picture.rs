//! Pictures that the host computes and panels draw.

use std::sync::Arc;

use crate::error::Result;
use crate::gpu::window::{PictureId, WindowPainter};
use crate::gpu::{Buffer, Context};

/// A host picture with its content, if it exists.
pub(super) struct HostPicture<Of> {
    picture: Option<PictureId>,
    /// What the picture shows; `None` if it is hidden.
    pub(super) of: Option<Of>,
}

impl<Of> HostPicture<Of> {
    pub(super) fn new() -> Self {
        Self { picture: None, of: None }
    }

    /// The texture for panels. `None` if the picture is hidden.
    pub(super) fn texture(&self, painter: &WindowPainter) -> Option<egui::TextureId> {
        self.of.as_ref().and(self.picture).map(|picture| painter.texture(picture))
    }

    /// Uploads sRGB codes R, G, B, A, row by row from the top, and shows them.
    pub(super) fn show(
        &mut self,
        context: &Arc<Context>,
        painter: &mut WindowPainter,
        of: Of,
        size: [u32; 2],
        pixels: &[[u8; 4]],
    ) -> Result<()> {
        let picture = match self.picture {
            Some(picture) => picture,
            None => painter.add_picture(size)?,
        };
        // Kept even if a later step fails.
        self.picture = Some(picture);
        painter.resize_picture(picture, size)?;
        painter.show(picture, &Buffer::from_slice(context, "picture from the host", pixels)?);
        self.of = Some(of);
        Ok(())
    }
}
