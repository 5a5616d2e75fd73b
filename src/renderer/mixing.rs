//! Dimming without a frame. Light adds up: the picture of lights of any strength is a weighted sum
//! of a picture with them and one without.

use super::{RecordedFrame, Renderer};
use crate::error::Result;
use crate::gpu::barrier::{COMPUTE_TO_TRANSFER, TRANSFER_TO_COMPUTE};
use crate::gpu::{Buffer, Recorder};
use crate::passes::GrowsWith;
use crate::passes::frame::tonemap::Curves;
use glam::Vec3;

/// A picture with some lights, and one without them.
pub struct Mix {
    with: Buffer,
    without: Buffer,
    curves: Curves,
}

#[doc(hidden)]
impl Renderer {
    /// Keeps the picture of the last frame, which shows the lights that will be dimmed.
    ///
    /// # Errors
    /// The device lacks memory or failed.
    pub fn begin_mix(&self) -> Result<Mix> {
        let radiance = &self.image.compose.radiance;
        let picture = |name| Buffer::storage(&self.context, GrowsWith::Pixels.named(name), radiance.bytes());
        let mix = Mix {
            with: picture("picture with dimmed lights")?,
            without: picture("picture without dimmed lights")?,
            curves: Curves::new(&self.context, true)?,
        };
        self.context.run(|rec| rec.copy(radiance, &mix.with))?;
        Ok(mix)
    }

    /// Records the next frame, as [`Self::begin_frame`] does, keeps its picture, and displays the
    /// mixed one. The lights must be dark.
    ///
    /// # Errors
    /// The device lacks memory or failed.
    pub fn begin_frame_without(&mut self, mix: &Mix, gains: Vec3) -> Result<(Recorder, RecordedFrame)> {
        self.begin_frame_then(|renderer, rec| {
            rec.barrier(COMPUTE_TO_TRANSFER);
            rec.copy(&renderer.image.compose.radiance, &mix.without);
            rec.barrier(TRANSFER_TO_COMPUTE);
            renderer.display_mix(rec, mix, gains);
        })
    }

    /// Records the display of the picture whose lights have `gains` times their emission, in each
    /// channel. At 0 and 1 it is that of a frame. Other pictures differ from frames by the clamps
    /// of extrapolated records, as [`Self::light_pictures`] describes. [`Self::layer`] still
    /// returns the last frame's picture, without the lights.
    ///
    /// # Errors
    /// The device failed.
    pub fn mix(&self, mix: &Mix, gains: Vec3) -> Result<Recorder> {
        self.context.record(false, |rec| self.display_mix(rec, mix, gains))
    }

    fn display_mix(&self, rec: &mut Recorder, mix: &Mix, gains: Vec3) {
        let pictures = [&mix.with, &mix.without];
        self.image.tonemap.record_mix(rec, &mix.curves, pictures, gains, &self.image.display_transform);
    }

    /// Ends the mix: the next frame displays its picture, whatever has changed.
    pub fn end_mix(&mut self) {
        self.dirty.changes.display_transform = true;
    }
}
