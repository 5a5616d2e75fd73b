//! Changes the size of the picture. Results of the precomputation do not depend on pixels and stay.

use super::Renderer;
use super::gloss::{GlossPasses, may_trace};
use super::image::Image;
use crate::error::{Error, Result};
use crate::passes::frame::{gloss_pixels::GlossPixels, splat::Splat};
use crate::scene::{Camera, camera};
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
        let camera = Camera { size, ..self.world.scene.cameras[0].clone() };
        self.replace_image(View::from(&camera))?;
        self.world.scene.cameras[0] = camera;
        Ok(())
    }

    /// Allocates the picture of a view anew. If it fails, the renderer stays as it was.
    pub(super) fn replace_image(&mut self, view: View) -> Result<()> {
        let (context, buffers, quality) = (&self.context, &self.world.buffers, &self.world.scene.quality);
        let mut image = Image {
            display_transform: self.image.display_transform,
            light_weights: self.image.light_weights,
            ..Image::new(context, buffers, view, quality.edge_samples, self.transport.gloss.is_some())?
        };
        image.antialias.smooth_m = self.image.antialias.smooth_m;
        let splat =
            Splat::new(context, self.splat.tree.clone(), image.size(), image.antialias.capacity.points)?;
        let bits = self.transport.gather.packing.cluster_bits;
        let pixel_count = view.width * view.height;
        let of_gloss = |gloss: &GlossPasses| {
            let may_trace = may_trace(&self.world.scene.materials, gloss.pixels.broad);
            let traces = [quality.entry_points > 0, may_trace];
            GlossPixels::new(context, buffers, pixel_count, quality.gloss_rays, bits, traces)
        };
        let of_gloss = self.transport.gloss.as_ref().map(of_gloss).transpose()?;
        let capacity = of_gloss.as_ref().map(|pixels| pixels.capacity);
        let irradiances = self.lights.new_irradiances(image.direct.point_count(), capacity)?;

        // The rest cannot fail, so the renderer stays consistent.
        self.lights.take_irradiances(irradiances);
        if let (Some(gloss), Some(pixels)) = (&mut self.transport.gloss, of_gloss) {
            gloss.pixels = pixels;
            gloss.edited(&self.world.scene.materials);
        }
        (self.image, self.splat) = (image, splat);
        self.dirty.changes.size = true;
        self.dirty.view_changed();
        Ok(())
    }
}
