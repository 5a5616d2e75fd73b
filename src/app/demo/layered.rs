//! Pictures that are made on the host.

use std::sync::Arc;

use crate::error::Result;
use crate::gpu::window::{PictureId, WindowPainter};
use crate::gpu::{Buffer, Context};

/// A picture that is made on the host, when there is one.
pub(super) struct Layered<Of> {
    picture: Option<PictureId>,
    /// What it shows; none where it is not to be seen.
    pub(super) of: Option<Of>,
}

impl<Of> Layered<Of> {
    pub(super) fn new() -> Self {
        Self { picture: None, of: None }
    }

    /// How panels draw it, if it is to be seen.
    pub(super) fn texture(&self, painter: &WindowPainter) -> Option<egui::TextureId> {
        self.of.as_ref().and(self.picture).map(|picture| painter.texture(picture))
    }

    /// Lets it show that: sRGB codes R, G, B, A, row by row from the top.
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
        // It is there even if what follows fails.
        self.picture = Some(picture);
        painter.resize_picture(picture, size)?;
        painter.show(picture, &Buffer::from_slice(context, "picture from the host", pixels)?);
        self.of = Some(of);
        Ok(())
    }
}
