//! The session: the shown scene, its edits, and its picture.

mod contributions;
mod metering;
mod meters;
mod models;
mod renderers;
mod snapshots;
mod versions;

use std::collections::VecDeque;
use std::sync::Arc;
use std::time::{Duration, Instant};

use super::document::{Document, History, Parts};
use super::snapshots::Snapshots;
use super::stage::{Progressed, Ready, SharedKept, Wake, Worker, record_preview};
use super::view_request::ViewRequest;
use super::watch::Watch;
use crate::app::exposure::Exposure;
use crate::error::{Error, Result};
use crate::gpu::window::Verdict;
use crate::gpu::{Buffer, Context, InFlight, PassTiming, Recorder};
use crate::renderer::{Columns, FrameReport, Layer, Preview, Reading, RecordedFrame, Renderer, Store};
use crate::scene::save::{PlacedModel, SceneText};
use crate::scene::{Camera, DisplayTransform, LoadOptions, Scene};
pub(super) use contributions::Contribution;
pub(super) use versions::CHANGED;

/// Frames whose times are kept.
pub(super) const FRAMES: usize = 200;

/// Where the scene came from.
#[derive(Clone)]
pub(super) struct Source {
    pub(super) spec: String,
    pub(super) options: LoadOptions,
    /// The precompute cache, if enabled.
    pub(super) store: Option<Store>,
    /// The exposure at the start.
    pub(super) exposure: Exposure,
    /// How radiance is displayed at the start, apart from the exposure.
    pub(super) display: DisplayTransform,
}

/// The cost of a frame.
#[derive(Clone, Copy)]
pub(super) struct Cost {
    /// All zero if passes were not timed one by one.
    pub(super) columns: Columns,
    /// Device time, milliseconds.
    pub(super) device_ms: f64,
    /// Wall-clock time, milliseconds.
    pub(super) frame_ms: f64,
}

/// What renders the picture.
enum Stage {
    Preview(Box<Preview>),
    /// A draft while the worker traces the light paths of the scene's own settings.
    Ready(Box<Ready>),
}

/// A scene, its edits, and its picture.
pub(super) struct Session {
    context: Arc<Context>,
    wake: Wake,
    pub(super) source: Source,
    /// The scene as it was loaded.
    pub(super) scene: Scene,
    /// The models of the scene file, without the user's edits.
    models: Vec<PlacedModel>,
    /// The parts that the scene was loaded with.
    loaded: Parts,
    /// [`Document::editable`] at the start of the last precomputation.
    traced_editable: Vec<bool>,
    /// Its file, to be saved with edits; or the reason why it cannot be saved.
    pub(super) text: std::result::Result<SceneText, String>,
    pub(super) document: Document,
    pub(super) history: History,
    pub(super) snapshots: Snapshots,
    /// The document as a file holds it: the scene's own, or the one saved last.
    saved: Document,
    pub(super) watch: Watch,
    /// The scene with unsaved edits has changed on disk, and the user has not answered yet.
    pub(super) is_asked: bool,
    /// The view and the size of the picture.
    pub(super) camera: Camera,
    pub(super) display: DisplayTransform,
    /// The exposure follows every picture.
    follows_exposure: bool,
    /// The exposure that the next frame's picture replaces. `None` once it is measured.
    unmetered: Option<f32>,
    /// The line about the measured exposure, until it is printed.
    pub(super) metered: Option<String>,
    /// Weights of direct and indirect light.
    pub(super) weights: [f32; 2],
    /// Passes wait for each other, so that the panel can show the time of each.
    pub(super) times_passes: bool,
    /// Notes for the panel, the newest last.
    pub(super) said: Vec<String>,
    /// The latest alarm and its start.
    pub(super) alarm: Option<(String, Instant)>,
    /// Version of the shown picture.
    pub(super) version: u64,
    pub(super) costs: VecDeque<Cost>,
    /// Frames that have ended.
    pub(super) frames: u64,
    pub(super) last: Option<FrameReport>,
    /// Version of the picture that was measured last, and what the meters read.
    readings: Option<(u64, Vec<Reading>)>,
    /// What each light contributes to a picture.
    contributions: Option<(ViewRequest, Vec<Contribution>)>,
    /// A picture size that did not fit the device.
    pub(super) refused_size: Option<[u32; 2]>,
    /// The pointer is pressed: a model that it moves is loaded when it is released.
    pub(super) is_held: bool,
    /// A region is painted: its meter is measured when that ends.
    pub(super) paints: bool,
    /// Nothing reads the picture but the window: lights that a drag dims may be mixed.
    pub(super) may_mix: bool,
    /// The last frame reverted an edit.
    pub(super) has_gone_back: bool,
    /// The last frame needs the light paths of an enclosure.
    needs_precompute: bool,
    stage: Stage,
    /// Direct light of models that the pointer moves, instead of the stage's picture.
    moving: Option<models::Moving>,
    goal: renderers::Goal,
    /// Number of renderers that the stage has had.
    pub(super) generation: u64,
    /// The picture of a new renderer has not been metered.
    is_unmetered: bool,
    /// Traces light paths. `None` once the last renderer is there, or failed.
    worker: Option<Worker>,
    kept: SharedKept,
    shown: Option<ViewRequest>,
    /// The frame that is recorded and not submitted.
    recorded: Option<Recorded>,
    /// Submitted frames that have not ended, the oldest first. `None` for frames of the preview.
    in_flight: VecDeque<(InFlight, Option<RecordedFrame>)>,
}

/// A frame that is recorded and not submitted.
struct Recorded {
    /// `None` for a frame of the preview.
    frame: Option<RecordedFrame>,
    /// What the picture showed before.
    before: Option<ViewRequest>,
}

impl Session {
    /// Starts the direct-light preview and the precomputation. `watch`: the scene's files, taken
    /// before they were read.
    pub(super) fn new(
        context: &Arc<Context>,
        source: Source,
        scene: Scene,
        watch: Watch,
        wake: Wake,
    ) -> Result<Self> {
        let text = SceneText::new(&source.spec, &source.options, &scene);
        let models = text.as_ref().map_or(Vec::new(), SceneText::models);
        let document = Document::from_scene(&scene, models.clone());
        let (exposure_stops, unmetered) = match source.exposure {
            Exposure::Stops(stops) => (stops, None),
            Exposure::Auto => (0.0, Some(0.0)),
        };
        let kept = SharedKept::default();
        Ok(Self {
            history: History::new(&document),
            snapshots: Snapshots::default(),
            saved: document.clone(),
            loaded: document.parts.clone(),
            traced_editable: document.editable(),
            watch,
            is_asked: false,
            document,
            camera: scene.cameras[0].clone(),
            display: DisplayTransform { exposure_stops, ..source.display },
            follows_exposure: false,
            unmetered,
            metered: None,
            weights: [1.0, 1.0],
            times_passes: false,
            said: scene.warnings.clone(),
            alarm: None,
            version: 0,
            costs: VecDeque::new(),
            frames: 0,
            last: None,
            readings: None,
            contributions: None,
            refused_size: None,
            has_gone_back: false,
            is_held: false,
            paints: false,
            may_mix: false,
            needs_precompute: false,
            stage: Stage::Preview(Box::new(Preview::new(context, scene.clone())?)),
            moving: None,
            goal: renderers::Goal::DraftFirst,
            generation: 0,
            is_unmetered: false,
            worker: Some(Worker::start(context, &scene, source.store.clone(), &kept, &wake)?),
            kept,
            shown: None,
            recorded: None,
            in_flight: VecDeque::new(),
            text: text.map_err(|error| error.to_string()),
            models,
            context: context.clone(),
            wake,
            source,
            scene,
        })
    }

    /// The renderer, which may be a draft's. `None` until it has light paths.
    pub(super) fn renderer(&self) -> Option<&Renderer> {
        match &self.stage {
            Stage::Ready(ready) => Some(&ready.renderer),
            Stage::Preview(_) => None,
        }
    }

    /// Progress of the precomputation. `None` if it has ended.
    pub(super) fn progress(&self) -> Option<Progressed> {
        Some(self.worker.as_ref()?.progress())
    }

    /// The picture as sRGB codes R, G, B, 255, row by row from the top; and its size.
    pub(super) fn picture(&self) -> (&Buffer, [u32; 2]) {
        let size = self.shown.as_ref().map_or(self.camera.size, |shown| shown.camera.size);
        let buffer = match (&self.moving, &self.stage) {
            (Some(moving), _) => moving.preview.display(),
            (None, Stage::Preview(preview)) => preview.display(),
            (None, Stage::Ready(ready)) => ready.renderer.display_buffer(),
        };
        (buffer, size)
    }

    /// Records the current document and camera, as a new version of the picture. `None` if the
    /// picture shows them.
    pub(super) fn update(&mut self) -> Result<Option<Recorder>> {
        if std::mem::take(&mut self.needs_precompute) {
            self.open_enclosure()?;
        }
        self.follow_parts();
        self.follow_editable();
        self.take_renderer()?;
        self.follow_moving()?;
        let requested = self.requested();
        if self.shown.as_ref() == Some(&requested) && (self.mixes() || !self.is_mixed()) {
            return Ok(None);
        }
        let before = self.shown.clone();
        let recorder = match (self.record(&requested), before) {
            (Err(error), Some(shown)) if error.is_out_of_memory() => {
                self.go_back(shown);
                self.alarm(format!("taken back: {error}"));
                self.record(&self.requested())?
            }
            (done, _) => done?,
        };
        self.shown = Some(self.requested());
        self.version += 1;
        Ok(Some(recorder))
    }

    /// Whether lights that are dimmed may be mixed: in a drag, if the last recording was submitted.
    fn mixes(&self) -> bool {
        self.may_mix
            && self.is_held
            && !self.times_passes
            && !self.follows_exposure
            && self.recorded.is_none()
    }

    /// Whether the picture is mixed, and no frame's.
    pub(super) fn is_mixed(&self) -> bool {
        matches!(&self.stage, Stage::Ready(ready) if ready.is_mixed())
    }

    /// Records the requested picture.
    fn record(&mut self, requested: &ViewRequest) -> Result<Recorder> {
        let (before, mixes) = (self.shown.clone(), self.mixes());
        if let Some(moving) = &mut self.moving {
            let recorder = record_preview(&mut moving.preview, requested, &self.scene.materials)?;
            self.recorded = Some(Recorded { frame: None, before });
            return Ok(recorder);
        }
        match &mut self.stage {
            Stage::Preview(preview) => {
                let recorder = record_preview(preview, requested, &self.scene.materials)?;
                self.recorded = Some(Recorded { frame: None, before });
                Ok(recorder)
            }
            Stage::Ready(ready) => {
                ready.renderer.set_serialised(self.times_passes);
                if mixes && let Some((recorder, frame)) = ready.record_dimmed(before.as_ref(), requested)? {
                    self.recorded = Some(Recorded { frame, before });
                    return Ok(recorder);
                }
                let (recorder, frame, refused) = ready.record(requested, &mut self.document)?;
                self.needs_precompute = frame.needs_precompute();
                self.said.extend(refused);
                self.recorded = Some(Recorded { frame: Some(frame), before });
                Ok(recorder)
            }
        }
    }

    /// Takes over the submission of what was recorded last. A frame with new lists waits
    /// for the device, because a list that is too short shows wrong light.
    pub(super) fn check(&mut self, in_flight: &InFlight) -> Result<Verdict> {
        let Some(recorded) = self.recorded.take() else { return Ok(Verdict::Present) };
        if let (Stage::Ready(ready), Some(frame)) = (&mut self.stage, &recorded.frame) {
            if frame.has_lists() {
                in_flight.wait()?;
                match ready.renderer.fits(frame) {
                    Ok(true) => (),
                    Ok(false) => {
                        let again = ready.renderer.record_frame(frame)?;
                        self.recorded = Some(recorded);
                        return Ok(Verdict::Again(Box::new(again)));
                    }
                    Err(error) => return self.discard(recorded.before, error),
                }
            }
            ready.renderer.frame_is_valid(frame);
        }
        self.in_flight.push_back((in_flight.clone(), recorded.frame));
        Ok(Verdict::Present)
    }

    /// Returns to the picture before a submitted frame whose lists do not fit the device.
    fn discard(&mut self, before: Option<ViewRequest>, error: Error) -> Result<Verdict> {
        match before {
            Some(before) if error.is_out_of_memory() => {
                self.go_back(before);
                self.shown = None;
                self.alarm(format!("taken back: {error}"));
                Ok(Verdict::Discard)
            }
            _ => Err(error),
        }
    }

    /// Ends frames that are done, and waits until at most `most` are in flight. Returns whether any
    /// frame has ended.
    pub(super) fn end_frames(&mut self, most: usize) -> Result<bool> {
        let before = self.in_flight.len();
        while let Some((in_flight, _)) = self.in_flight.front() {
            if self.in_flight.len() <= most && !in_flight.wait_at_most(Duration::ZERO)? {
                break;
            }
            let timings = in_flight.wait()?;
            if let Some((_, frame)) = self.in_flight.pop_front() {
                self.end_frame(frame, timings)?;
            }
        }
        Ok(self.in_flight.len() < before)
    }

    fn end_frame(&mut self, frame: Option<RecordedFrame>, timings: Vec<PassTiming>) -> Result<()> {
        if let (Some(moving), None) = (&self.moving, &frame) {
            return moving.preview.end_frame();
        }
        match (&mut self.stage, frame) {
            (Stage::Preview(preview), None) => {
                preview.end_frame()?;
                // Once, because an exposure that follows the camera flickers.
                if self.unmetered == Some(0.0) {
                    let pixels = preview.radiance()?;
                    self.meter(&pixels);
                }
                Ok(())
            }
            (Stage::Ready(ready), Some(frame)) => {
                let report = ready.renderer.end_frame(&frame, timings)?;
                let is_first = std::mem::take(&mut self.is_unmetered);
                if self.follows_exposure || is_first && self.unmetered.is_some() {
                    let pixels = ready.renderer.layer(Layer::Beauty)?;
                    self.meter(&pixels);
                    self.unmetered = self.unmetered.filter(|_| self.worker.is_some());
                }
                if self.costs.len() == FRAMES {
                    self.costs.pop_front();
                }
                self.frames += 1;
                let FrameReport { columns, device_ms, frame_ms, .. } = report;
                self.costs.push_back(Cost { columns, device_ms, frame_ms });
                self.last = Some(report);
                Ok(())
            }
            // Another scene or the full renderer has taken the place of the frame's own.
            _ => Ok(()),
        }
    }

    /// Whether the device may still compute a picture.
    pub(super) fn is_computing(&self) -> bool {
        !self.in_flight.is_empty()
    }

    /// Waits until the rest of the newest frame takes the device as long as the host needs to
    /// prepare the next one, `host`. A frame that begins earlier would show older input.
    pub(super) fn wait_for_device(&self, host: Duration) -> Result<()> {
        if let (Some((newest, _)), Some(cost)) = (self.in_flight.back(), self.costs.back()) {
            newest.wait_at_most(Duration::from_secs_f64(1e-3 * cost.device_ms).saturating_sub(host))?;
        }
        Ok(())
    }

    /// Adds a note that the window also shows as an alarm.
    pub(super) fn alarm(&mut self, line: String) {
        self.said.push(line.clone());
        self.alarm = Some((line, Instant::now()));
    }

    /// Restores the last shown state because the device lacks memory for the request.
    fn go_back(&mut self, shown: ViewRequest) {
        self.refuse_size(shown.camera.size);
        (self.document, self.camera) = (shown.document, shown.camera);
        self.history.refuse(&self.document);
        self.has_gone_back = true;
    }

    /// Keeps the picture at a size that fits. If the current size differs, it is
    /// not requested again.
    pub(super) fn refuse_size(&mut self, fitting: [u32; 2]) {
        if self.camera.size != fitting {
            self.refused_size = Some(self.camera.size);
            self.camera.size = fitting;
        }
    }

    /// Does a part of the renderer's idle work. Returns commands if there is a frame to render. A
    /// frame with own records is a new version of the picture.
    pub(super) fn idle_work(&mut self) -> Result<Option<Recorder>> {
        if !self.is_behind() {
            return Ok(None);
        }
        self.end_frames(0)?;
        let Stage::Ready(ready) = &mut self.stage else { return Ok(None) };
        let may_refine = ready.renderer.may_refine();
        let Some((recorder, frame)) = ready.idle_work()? else { return Ok(None) };
        if may_refine && !ready.renderer.may_refine() {
            self.version += 1;
        }
        self.recorded = Some(Recorded { frame: Some(frame), before: self.shown.clone() });
        Ok(Some(recorder))
    }

    /// Whether [`Self::idle_work`] has work. None for a draft, which is soon replaced.
    pub(super) fn is_behind(&self) -> bool {
        self.worker.is_none() && matches!(&self.stage, Stage::Ready(ready) if ready.is_behind())
    }

    /// Whether the lights or materials differ from the file that was loaded or saved last.
    pub(super) fn has_unsaved_edits(&self) -> bool {
        self.document != self.saved
    }

    /// Marks the current document as saved.
    pub(super) fn take_as_saved(&mut self) {
        self.saved = self.document.clone();
    }

    /// The request that the picture shows.
    pub(super) fn shown(&self) -> Option<&ViewRequest> {
        self.shown.as_ref()
    }

    fn requested(&self) -> ViewRequest {
        ViewRequest {
            document: self.document.clone(),
            camera: self.camera.clone(),
            display: self.display,
            weights: self.weights,
        }
    }
}
