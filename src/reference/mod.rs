//! Reference renderers: other methods on the same scene, acceleration structure and device, to
//! judge ours by.

mod irradiance_points;
mod path_tracer;
mod photon_mapper;
mod traced_scene;

pub use path_tracer::PathTracer;
pub use photon_mapper::PhotonMapper;
pub use traced_scene::{FirstHits, TracedScene};

use crate::error::Result;
use std::time::Instant;

/// What a reference renderer has found so far: mean radiance of each pixel, W/m²/sr, row by row
/// from the top, linear Rec.709.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// All light: direct and indirect.
    pub beauty: Vec<[f32; 3]>,
    /// Light that was reflected once.
    pub direct: Vec<[f32; 3]>,
    /// Light that was reflected more than once.
    pub indirect: Vec<[f32; 3]>,
}

/// A renderer whose picture gets better with every sample.
pub trait Progressive {
    /// Takes so many more samples of each pixel.
    ///
    /// # Errors
    /// The device lacks memory or failed.
    fn add_samples(&mut self, per_pixel: u32) -> Result<()>;
    /// When the time is up: [`Self::add_samples`] then takes no more than one sample of each pixel,
    /// truncated, and none where there is one already. `None`: never.
    fn set_deadline(&mut self, deadline: Option<Instant>);
    /// Samples of each pixel so far, at the least.
    fn samples(&self) -> u32;
    /// Samples that share a cost: any number up to the next multiple takes about as long.
    fn round(&self) -> u32 {
        1
    }
    /// Device time so far, milliseconds.
    fn device_ms(&self) -> f64;
    /// The picture so far.
    ///
    /// # Errors
    /// The device failed.
    fn picture(&self) -> Result<Picture>;
    /// Variance of [`Picture::beauty`], pixel by pixel and channel by channel, (W/m²/sr)².
    ///
    /// # Errors
    /// There are too few samples to tell; the device failed.
    fn variance(&self) -> Result<Vec<[f32; 3]>>;
    /// Noise of [`Picture::beauty`]: the relMSE by which its mean would differ from one without
    /// noise; none where there are too few samples to tell.
    ///
    /// # Errors
    /// The device failed.
    fn noise(&self) -> Result<Option<f64>>;
    /// Rays so far, if they are counted.
    ///
    /// # Errors
    /// The device failed.
    fn rays(&self) -> Result<Option<u64>>;
    /// The scene on the device.
    fn traced_scene(&self) -> &TracedScene;
}
