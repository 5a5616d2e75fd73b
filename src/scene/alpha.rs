//! Alpha channels of images.

use std::sync::Arc;

use image::DynamicImage;

/// Opacity in texels.
pub(super) struct Alpha {
    /// Width and height in texels.
    pub(super) size: [u32; 2],
    /// Row by row from the top; 255 is opaque.
    pub(super) values: Vec<u8>,
}

impl Alpha {
    /// The alpha channel of an image. `None` if all of it is opaque.
    pub(super) fn of(image: &DynamicImage) -> Option<Arc<Self>> {
        if !image.color().has_alpha() {
            return None;
        }
        let values: Vec<u8> = match image {
            DynamicImage::ImageLumaA8(image) => image.pixels().map(|pixel| pixel.0[1]).collect(),
            DynamicImage::ImageRgba8(image) => image.pixels().map(|pixel| pixel.0[3]).collect(),
            other => other.to_rgba8().pixels().map(|pixel| pixel.0[3]).collect(),
        };
        let is_opaque = values.iter().all(|&value| value == u8::MAX);
        (!is_opaque).then(|| Arc::new(Self { size: [image.width(), image.height()], values }))
    }

    /// Whether many texels are neither nearly opaque nor nearly open.
    pub(super) fn is_grey(&self) -> bool {
        let grey = self.values.iter().filter(|&&value| (64..192).contains(&value)).count();
        10 * grey > self.values.len()
    }
}
