//! Changes the size of the picture. Results of the precomputation do not depend on pixels and stay.

use super::Renderer;
use crate::error::{Error, Result};
use crate::passes::frame::{
    antialias::Antialias, compose::Compose, direct::Direct, gloss_pixels::GlossPixels,
    pixel_colours::PixelColours, primary::Primary, splat::Splat, tonemap::Tonemap,
};
use crate::scene::camera;
use crate::types::View;

impl Renderer {
    /// Sets the size of the picture, width and height in pixels. The next frame computes the same
    /// as after a camera movement, and has the bits of a cold start at that size. Until then, the
    /// outputs of the picture are empty.
    ///
    /// # Errors
    /// A camera cannot have this size; the device lacks memory for the old and the new buffers, or
    /// failed. The renderer then stays as it was.
    pub fn resize(&mut self, size: [u32; 2]) -> Result<()> {
        if size == self.size() {
            return Ok(());
        }
        let [width, height] = size;
        if !size.iter().all(|pixels| camera::SIZE.contains(pixels)) {
            let (least, most) = camera::SIZE.into_inner();
            return Err(Error::Usage(format!(
                "a picture of {width}×{height} pixels; each must be from {least} to {most}"
            )));
        }
        let (context, buffers, pixel_count) = (&self.context, &self.buffers, width * height);
        let antialias = Antialias::new(context, size, self.scene.quality.edge_samples)?;
        let slots = antialias.capacity.slots;
        let direct = Direct::new(context, size, slots)?;
        let primary = Primary::new(context, pixel_count)?;
        let pixel_colours = PixelColours::new(context, buffers, pixel_count, slots)?;
        let splat = Splat::new(context, self.gather.point_count(), size)?;
        let compose = Compose::new(context, buffers, size, self.gloss.is_some())?;
        let tonemap = Tonemap::new(context, pixel_count)?;
        let quality = &self.scene.quality;
        let paths = (self.gather.packing.cluster_bits, quality.entry_points > 0);
        let of_gloss = |_| GlossPixels::new(context, buffers, pixel_count, quality.gloss_rays, paths);
        let of_gloss = self.gloss.as_ref().map(of_gloss).transpose()?;
        let capacity = of_gloss.as_ref().map(|pixels| pixels.capacity);
        let irradiances = self.lights.new_irradiances(direct.point_count(), capacity)?;

        // The rest cannot fail, so the renderer stays consistent.
        self.lights.take_irradiances(irradiances);
        if let (Some(gloss), Some(pixels)) = (&mut self.gloss, of_gloss) {
            gloss.pixels = pixels;
        }
        (self.antialias, self.direct, self.primary) = (antialias, direct, primary);
        (self.pixel_colours, self.splat) = (pixel_colours, splat);
        (self.compose, self.tonemap) = (compose, tonemap);
        self.edge_count = 0;
        self.scene.cameras[0].size = size;
        self.view = View::from(&self.scene.cameras[0]);
        self.changes.size = true;
        self.view_changed();
        Ok(())
    }
}
