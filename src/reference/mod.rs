//! Reference renderers: other methods on the same scene, acceleration structure and
//! device, for comparison.

mod irradiance_points;
mod path_tracer;
mod photon_mapper;
mod traced_scene;

pub use path_tracer::PathTracer;
pub use photon_mapper::PhotonMapper;
pub use traced_scene::{FirstHits, TracedScene};

use crate::error::Result;
use std::time::Instant;

/// Estimate of a reference renderer so far: mean radiance of each pixel, W/m²/sr, row by row from
/// the top, linear Rec.709.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// All light: direct and indirect.
    pub beauty: Vec<[f32; 3]>,
    /// Light that was reflected once, without the smooth part of a sky.
    pub direct: Vec<[f32; 3]>,
    /// Light that was reflected more than once, and that of the smooth part of a sky.
    pub indirect: Vec<[f32; 3]>,
}

/// A renderer whose picture improves with every sample.
pub trait Progressive {
    /// Takes `per_pixel` more samples of each pixel.
    ///
    /// # Errors
    /// The device lacks memory or failed.
    fn add_samples(&mut self, per_pixel: u32) -> Result<()>;
    /// Sets the time after which [`Self::add_samples`] takes at most one truncated sample of each
    /// pixel, and none if a pixel has one. `None`: never.
    fn set_deadline(&mut self, deadline: Option<Instant>);
    /// Samples of each pixel so far, the minimum of all pixels.
    fn samples(&self) -> u32;
    /// Granularity of samples: any number up to the next multiple takes about as long.
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
    /// There are too few samples; the device failed.
    fn variance(&self) -> Result<Vec<[f32; 3]>>;
    /// Noise of [`Picture::beauty`]: the expected relMSE of its mean against a picture without
    /// noise. `None` if there are too few samples.
    ///
    /// # Errors
    /// The device failed.
    fn noise(&self) -> Result<Option<f64>>;
    /// Number of rays so far. `None` if rays are not counted.
    ///
    /// # Errors
    /// The device failed.
    fn rays(&self) -> Result<Option<u64>>;
    /// The scene on the device.
    fn traced_scene(&self) -> &TracedScene;
}
