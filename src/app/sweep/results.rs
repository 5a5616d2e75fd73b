//! What a sweep found: the document `sweep.json`, and what the report is made of.

use serde::Serialize;

use crate::metrics;
use crate::scene::Quality;

/// The whole of it.
#[derive(Debug, Serialize)]
pub(super) struct Results {
    pub(super) version: &'static str,
    pub(super) debug_build: bool,
    pub(super) machine: Machine,
    /// As typed, then those that make single images of it.
    pub(super) commands: Vec<String>,
    pub(super) scene: SceneFacts,
    pub(super) reference: ReferenceFacts,
    /// The preset itself first.
    pub(super) settings: Vec<Setting>,
    // Scripts read the JSON by this key.
    #[serde(rename = "rivals")]
    pub(super) baselines: Vec<Baseline>,
    /// Which stage errs.
    pub(super) stages: Vec<StageError>,
}

/// Where it ran.
#[derive(Debug, Serialize)]
pub(super) struct Machine {
    pub(super) device: String,
    pub(super) driver: String,
    pub(super) cpu: String,
    pub(super) cores: usize,
}

/// What was rendered.
#[derive(Debug, Serialize)]
pub(super) struct SceneFacts {
    pub(super) name: String,
    pub(super) triangles: usize,
    pub(super) lights: usize,
    pub(super) size: [u32; 2],
    pub(super) preset: &'static str,
}

/// What it is held against.
#[derive(Clone, Debug, Serialize)]
pub(super) struct ReferenceFacts {
    pub(super) method: &'static str,
    pub(super) spp: u32,
    pub(super) seconds: f64,
    /// Its own error, from the difference of its halves, as relMSE.
    pub(super) noise_relmse: f64,
    pub(super) from_cache: bool,
}

/// How far a picture is from the reference.
#[derive(Clone, Copy, Debug, Serialize)]
pub(super) struct ErrorFigures {
    /// Against the mean of the reference's halves: the reference's own noise is part of it.
    pub(super) relmse: f64,
    /// Without that noise, which can make a good picture's figure negative; relative to our picture
    /// at the preset, which has none.
    pub(super) relmse_debiased: f64,
    /// How far the reference's noise may put that off: its standard deviation.
    pub(super) relmse_standard_error: f64,
    /// Of indirect light alone, the reference's noise included; none for a picture that holds
    /// no indirect light.
    pub(super) relmse_indirect: Option<f64>,
    pub(super) rmse: f64,
    pub(super) smape: f64,
    pub(super) flip: f64,
    pub(super) energy_ratio: f64,
}

impl ErrorFigures {
    /// Standard errors below which a debiased figure means nothing.
    const TRUSTED: f64 = 3.0;

    /// The error without the reference's noise, but not below what that noise allows to be told.
    pub(super) fn told(&self) -> f64 {
        self.relmse_debiased.max(Self::TRUSTED * self.relmse_standard_error).max(1e-12)
    }
}

/// One setting of our method.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Setting {
    /// What was varied: `preset`, a quantity's name, or `front`.
    pub(super) series: &'static str,
    /// By how much, relative to the preset; along the front, of entry points.
    pub(super) factor: f64,
    pub(super) quality: Quality,
    pub(super) precompute_s: f64,
    /// Wall-clock time of the first frame, after the precomputation.
    pub(super) first_frame_ms: f64,
    /// Wall-clock time of a frame after a light moved, median.
    pub(super) relit_frame_ms: f64,
    /// Device time of whole frames, medians, under the paper's names.
    pub(super) ms: FrameTimes,
    /// Most device memory in use.
    pub(super) memory_mb: f64,
    pub(super) error: ErrorFigures,
    /// No other setting is both more accurate and faster to relight.
    pub(super) is_on_pareto_front: bool,
}

impl Setting {
    /// Until the first picture stands, seconds.
    pub(super) fn first_picture_s(&self) -> f64 {
        self.precompute_s + 1e-3 * self.first_frame_ms
    }

    /// One relit frame, seconds.
    pub(super) fn relit_s(&self) -> f64 {
        1e-3 * self.relit_frame_ms
    }
}

/// Device time of frames after edits, milliseconds.
#[derive(Clone, Copy, Debug, Serialize)]
#[expect(non_snake_case, reason = "the paper's names, which scripts rely on")]
pub(super) struct FrameTimes {
    pub(super) Tdi: f64,
    pub(super) Ttot: f64,
    pub(super) Tlight: f64,
    pub(super) Tview: f64,
}

/// Another method at our time or our error.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Baseline {
    pub(super) method: &'static str,
    pub(super) at: Occasion,
    /// Samples of each pixel.
    pub(super) spp: u32,
    /// Wall-clock time of these samples, without compilation and acceleration structure.
    pub(super) seconds: f64,
    /// Times as long as ours takes for what stands in `at`.
    pub(super) times_ours: f64,
    /// Where it was rendered.
    pub(super) error: Option<ErrorFigures>,
    /// Not rendered, but reckoned from fewer samples by their error's fall with 1/spp.
    pub(super) is_extrapolated: bool,
}

/// What two methods have in common where they are compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub(super) enum Occasion {
    /// The time of one frame after a light moved.
    #[serde(rename = "equal_time_relit")]
    RelitFrameTime,
    /// The time of the precomputation and the first frame.
    #[serde(rename = "equal_time_first")]
    FirstPictureTime,
    /// The error of our preset.
    #[serde(rename = "equal_error")]
    Error,
}

impl Occasion {
    pub(super) fn label(self) -> &'static str {
        match self {
            Self::RelitFrameTime => "equal time, one relit frame",
            Self::FirstPictureTime => "equal time, precompute and first frame",
            Self::Error => "equal error",
        }
    }
}

/// The picture with one stage replaced by its exact reference; first of all, with none.
#[derive(Clone, Debug, Serialize)]
pub(super) struct StageError {
    pub(super) name: String,
    /// What is left of the error, without the noise of the reference and of the reference.
    pub(super) relmse: f64,
    /// The reference's noise as relMSE, from its halves; already taken off.
    pub(super) noise_relmse: f64,
    /// What has gone, as a share of the whole; below 0 where the stage's error made
    /// up for another's.
    pub(super) share: f64,
}

/// Marks the settings that no other beats in both relighting time and error.
pub(super) fn mark_pareto_front(settings: &mut [Setting]) {
    let places: Vec<[f64; 2]> = settings.iter().map(|s| [s.relit_frame_ms, s.error.told()]).collect();
    let beats = |a: &[f64; 2], b: &[f64; 2]| a[0] <= b[0] && a[1] <= b[1] && a != b;
    for (setting, place) in settings.iter_mut().zip(&places) {
        setting.is_on_pareto_front = !places.iter().any(|other| beats(other, place));
    }
}

/// What a picture is judged by.
pub(super) struct Judge<'a> {
    pub(super) flip: &'a metrics::Flip,
    pub(super) halves: [&'a [[f32; 3]]; 2],
    pub(super) mean: &'a [[f32; 3]],
    /// What errors are relative to, if not to the picture itself.
    pub(super) scale: Option<&'a [[f32; 3]]>,
    pub(super) indirect: &'a [[f32; 3]],
}

impl Judge<'_> {
    /// Without the reference's noise.
    pub(super) fn debiased_relmse(&self, picture: &[[f32; 3]]) -> metrics::Estimate {
        metrics::debiased_relmse_at(picture, self.halves, self.scale.unwrap_or(picture))
    }

    /// The figures, and the FLIP error of each pixel. All values must be finite.
    pub(super) fn judge(
        &self,
        picture: &[[f32; 3]],
        indirect: Option<&[[f32; 3]]>,
    ) -> (ErrorFigures, Vec<f64>) {
        let flip = self.flip.map(&crate::app::compare::displayed(picture, 0.0));
        let debiased = self.debiased_relmse(picture);
        let figures = ErrorFigures {
            relmse: metrics::relmse(picture, self.mean),
            relmse_debiased: debiased.mean,
            relmse_standard_error: debiased.standard_error,
            relmse_indirect: indirect.map(|indirect| metrics::relmse(indirect, self.indirect)),
            rmse: metrics::rmse(picture, self.mean),
            smape: metrics::smape(picture, self.mean),
            flip: flip.iter().sum::<f64>() / flip.len() as f64,
            energy_ratio: metrics::energy_ratio(picture, self.mean),
        };
        (figures, flip)
    }
}
