//! The results of a sweep: the document `sweep.json`, which the report also shows.

use serde::Serialize;

use crate::metrics;
use crate::scene::{DisplayTransform, Quality};

/// All results of a sweep.
#[derive(Debug, Serialize)]
pub(super) struct Results {
    pub(super) version: &'static str,
    pub(super) debug_build: bool,
    pub(super) machine: Machine,
    /// The command as typed, then the commands that render its single images.
    pub(super) commands: Vec<String>,
    pub(super) scene: SceneFacts,
    pub(super) reference: ReferenceFacts,
    /// All settings, the preset first.
    pub(super) settings: Vec<Setting>,
    // Scripts read the JSON by this key.
    #[serde(rename = "rivals")]
    pub(super) baselines: Vec<Baseline>,
    /// The error of each stage.
    pub(super) stages: Vec<StageError>,
}

/// The machine of the measurement.
#[derive(Debug, Serialize)]
pub(super) struct Machine {
    pub(super) device: String,
    pub(super) driver: String,
    pub(super) cpu: String,
    pub(super) cores: usize,
}

/// The rendered scene.
#[derive(Debug, Serialize)]
pub(super) struct SceneFacts {
    pub(super) name: String,
    pub(super) triangles: usize,
    pub(super) lights: usize,
    pub(super) size: [u32; 2],
    pub(super) preset: &'static str,
}

/// The reference of all errors.
#[derive(Clone, Debug, Serialize)]
pub(super) struct ReferenceFacts {
    pub(super) method: &'static str,
    pub(super) spp: u32,
    pub(super) seconds: f64,
    /// Its own error, from the difference of its halves, as relMSE.
    pub(super) noise_relmse: f64,
    pub(super) from_cache: bool,
}

/// Errors of a picture against the reference.
#[derive(Clone, Copy, Debug, Serialize)]
pub(super) struct ErrorFigures {
    /// Against the mean of the reference's halves; it contains the reference's noise.
    pub(super) relmse: f64,
    /// Without the reference's noise, which can make the figure of a good picture negative. It is
    /// relative to our picture at the preset, which has no noise.
    pub(super) relmse_debiased: f64,
    /// Standard deviation of the debiased figure, from the reference's noise.
    pub(super) relmse_standard_error: f64,
    /// Error of indirect light alone, with the reference's noise. `None` for a picture
    /// without indirect light.
    pub(super) relmse_indirect: Option<f64>,
    pub(super) rmse: f64,
    pub(super) smape: f64,
    pub(super) flip: f64,
    pub(super) energy_ratio: f64,
}

impl ErrorFigures {
    /// Standard errors below which a debiased figure is not significant.
    const TRUSTED: f64 = 3.0;

    /// The error without the reference's noise, but at least the smallest significant value.
    pub(super) fn told(&self) -> f64 {
        self.relmse_debiased.max(Self::TRUSTED * self.relmse_standard_error).max(1e-12)
    }
}

/// A setting of our method with its results.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Setting {
    /// The varied quantity: `preset`, a quantity's name, or `front`.
    pub(super) series: &'static str,
    /// Factor relative to the preset; on the front, that of entry points.
    pub(super) factor: f64,
    pub(super) quality: Quality,
    pub(super) precompute_s: f64,
    /// Wall-clock time from the precomputation to the first frame with own records.
    pub(super) first_frame_ms: f64,
    /// Wall-clock time of a frame after a light moved, median.
    pub(super) relit_frame_ms: f64,
    /// Device time of whole frames, medians, with the paper's names.
    pub(super) ms: FrameTimes,
    /// Peak device memory in use.
    pub(super) memory_mb: f64,
    pub(super) error: ErrorFigures,
    /// Whether no other setting is both more accurate and faster to relight.
    pub(super) is_on_pareto_front: bool,
}

impl Setting {
    /// Time until the first picture, seconds.
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

/// A baseline at our time or our error.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Baseline {
    pub(super) method: &'static str,
    pub(super) at: Occasion,
    /// Samples of each pixel.
    pub(super) spp: u32,
    /// Wall-clock time of these samples, without compilation and the BVH.
    pub(super) seconds: f64,
    /// Time relative to ours for the quantity in `at`.
    pub(super) times_ours: f64,
    /// The error. `None` if it was not rendered.
    pub(super) error: Option<ErrorFigures>,
    /// Not rendered, but extrapolated from fewer samples by the 1/spp law.
    pub(super) is_extrapolated: bool,
}

/// The equal quantity of a comparison.
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

/// The picture's error with one stage replaced by its exact reference. The first
/// entry replaces none.
#[derive(Clone, Debug, Serialize)]
pub(super) struct StageError {
    pub(super) name: String,
    /// The remaining error, without the noise of the path-traced reference and of
    /// the stage's reference.
    pub(super) relmse: f64,
    /// The noise of the stage's reference as relMSE, from its halves; already subtracted.
    pub(super) noise_relmse: f64,
    /// The removed fraction of the whole error. Below 0 if the stage's error compensated another's.
    pub(super) share: f64,
}

/// Marks the settings that no other setting beats in both relighting time and error.
pub(super) fn mark_pareto_front(settings: &mut [Setting]) {
    let places: Vec<[f64; 2]> = settings.iter().map(|s| [s.relit_frame_ms, s.error.told()]).collect();
    let beats = |a: &[f64; 2], b: &[f64; 2]| a[0] <= b[0] && a[1] <= b[1] && a != b;
    for (setting, place) in settings.iter_mut().zip(&places) {
        setting.is_on_pareto_front = !places.iter().any(|other| beats(other, place));
    }
}

/// The data that a picture is compared with.
pub(super) struct Judge<'a> {
    pub(super) flip: &'a metrics::Flip,
    pub(super) halves: [&'a [[f32; 3]]; 2],
    pub(super) mean: &'a [[f32; 3]],
    /// The picture that errors are relative to. `None`: the compared picture itself.
    pub(super) scale: Option<&'a [[f32; 3]]>,
    pub(super) indirect: &'a [[f32; 3]],
}

impl Judge<'_> {
    /// relMSE without the reference's noise.
    pub(super) fn debiased_relmse(&self, picture: &[[f32; 3]]) -> metrics::Estimate {
        metrics::debiased_relmse_at(picture, self.halves, self.scale.unwrap_or(picture))
    }

    /// The error figures, and the FLIP error of each pixel. All values must be finite.
    pub(super) fn judge(
        &self,
        picture: &[[f32; 3]],
        indirect: Option<&[[f32; 3]]>,
    ) -> (ErrorFigures, Vec<f64>) {
        let flip = self.flip.map(&crate::app::compare::displayed(picture, &DisplayTransform::default()));
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
