//! The renderers of the window: a preview of direct light, then those whose light paths a thread
//! traces, for a draft and for the scene's own settings.

use std::collections::HashSet;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{self, Receiver, Sender};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use glam::Vec3;

use super::dimming::{self, Dimmed, Dimming};
use super::document::{Document, MaterialEdit};
use super::view_request::ViewRequest;
use crate::app::estimate::Estimate;
use crate::app::meters::{self, Found, Goal, Wish};
use crate::error::{Error, Result};
use crate::gpu::{Context, Recorder};
use crate::renderer::{Kept, Preview, Progress, RecordedFrame, Renderer, Store};
use crate::scene::{Material, Scene};

/// Shortest time between progress updates: drawing takes time from the worker.
const BREATH: Duration = Duration::from_millis(100);

/// Called from any thread when there is a new state to show.
pub(super) type Wake = Arc<dyn Fn() + Send + Sync>;

/// What precomputations of a draft and of the scene's own settings leave to the next ones.
pub(super) type SharedKept = Arc<[Mutex<Kept>; 2]>;

/// A cancelled worker leaves it as it was.
fn kept_of(kept: &SharedKept, settings: usize) -> MutexGuard<'_, Kept> {
    kept[settings].lock().unwrap_or_else(PoisonError::into_inner)
}

/// A thread that traces the light paths of a scene: of a draft first, if the scene's settings are
/// finer than a draft's.
pub(super) struct Worker {
    /// `None` once its last result is taken.
    thread: Option<JoinHandle<Result<()>>>,
    /// Renderers in the order of their accuracy.
    made: Receiver<Renderer>,
    shared: Arc<Shared>,
}

/// State that window and worker share.
struct Shared {
    progress: Mutex<Progressed>,
    /// Messages of the precompute cache, one line each.
    said: Mutex<Vec<String>>,
    is_cancelled: AtomicBool,
}

/// Progress of the precomputation.
#[derive(Clone)]
pub(super) struct Progressed {
    pub(super) estimate: Estimate,
    /// The light paths are those of the draft.
    pub(super) is_draft: bool,
}

/// The renderer, and the identifiers of its lights.
pub(super) struct Ready {
    pub(super) renderer: Renderer,
    /// Identifier of each light, in the renderer's order.
    ids: Vec<u64>,
    /// The last frame left work that the next camera movement would wait for.
    is_behind: bool,
    /// The picture is mixed, and no frame's.
    dimming: Option<Dimming>,
}

/// The worker's side of the shared state.
struct Told {
    shared: Arc<Shared>,
    wake: Wake,
    wake_up: Instant,
}

/// The panic payload of a cancelled worker.
struct Cancelled;

impl Told {
    fn tell(&mut self, change: impl FnOnce(&mut Estimate)) {
        if self.shared.is_cancelled.load(Ordering::Relaxed) {
            // Unwinding frees the worker's resources; no thread waits for its result.
            std::panic::resume_unwind(Box::new(Cancelled));
        }
        change(&mut self.shared.progress.lock().expect("no holder panics").estimate);
        if self.wake_up.elapsed() > BREATH {
            self.wake_up = Instant::now();
            (self.wake)();
        }
    }
}

impl Progress for Told {
    fn stage(&mut self, name: &str, total: u64) {
        self.tell(|estimate| estimate.stage(name, total));
    }

    fn advance(&mut self, done: u64) {
        self.tell(|estimate| estimate.advance(done));
    }

    fn finish(&mut self) {
        self.tell(Estimate::finish);
    }
}

impl Worker {
    /// Starts the thread. It reads the light paths from the precompute cache if they are there.
    pub(super) fn start(
        context: &Arc<Context>,
        scene: &Scene,
        store: Option<Store>,
        kept: &SharedKept,
        wake: &Wake,
    ) -> Result<Self> {
        let progress = Mutex::new(Progressed { estimate: Estimate::begin(), is_draft: false });
        let said = Mutex::default();
        let shared = Arc::new(Shared { progress, said, is_cancelled: AtomicBool::new(false) });
        let told = Told { shared: shared.clone(), wake: wake.clone(), wake_up: Instant::now() };
        let (sender, made) = mpsc::channel();
        let work = {
            let (context, scene, kept) = (context.clone(), scene.clone(), kept.clone());
            move || {
                let wake = told.wake.clone();
                let done = trace(&context, scene, (store.as_ref(), &kept), told, &sender);
                wake();
                done
            }
        };
        let thread = std::thread::Builder::new().name("precomputation".into()).spawn(work);
        let thread =
            thread.map_err(|error| Error::Usage(format!("no thread for the precomputation: {error}")))?;
        Ok(Self { thread: Some(thread), made, shared })
    }

    /// Progress of the thread.
    pub(super) fn progress(&self) -> Progressed {
        self.shared.progress.lock().expect("no holder panics").clone()
    }

    /// Takes the messages of the precompute cache.
    pub(super) fn said(&self) -> Vec<String> {
        std::mem::take(&mut self.shared.said.lock().expect("no holder panics"))
    }

    /// The next renderer, if it is ready. `light_count`: number of lights of the loaded scene.
    pub(super) fn next(&mut self, light_count: usize) -> Option<Ready> {
        let renderer = self.made.try_iter().last()?;
        let ids = (0..light_count as u64).collect();
        Some(Ready { renderer, ids, is_behind: true, dimming: None })
    }

    /// Whether the thread has ended and [`Self::next`] has no more renderers.
    pub(super) fn has_ended(&self) -> bool {
        self.thread.as_ref().is_none_or(JoinHandle::is_finished)
    }

    /// Waits for the thread, and returns its error.
    pub(super) fn end(mut self) -> Result<()> {
        let Some(thread) = self.thread.take() else { return Ok(()) };
        thread.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))
    }
}

/// Traces the light paths of the draft, unless those of the scene are stored or no slower; then
/// those of the scene.
fn trace(
    context: &Arc<Context>,
    scene: Scene,
    (store, kept): (Option<&Store>, &SharedKept),
    mut told: Told,
    made: &Sender<Renderer>,
) -> Result<()> {
    let shared = told.shared.clone();
    let is_finer = scene.quality.entry_points > scene.draft.entry_points;
    let is_stored = match store {
        Some(store) if is_finer => store.miss(context, &scene)?.is_none(),
        _ => false,
    };
    let begin = |is_draft| {
        let estimate = Estimate::begin();
        *shared.progress.lock().expect("no holder panics") = Progressed { estimate, is_draft };
    };
    // The window has gone if the renderer has no receiver.
    let send = |renderer| made.send(renderer).map_err(|_| Error::Usage("the window is closed".to_owned()));
    if is_finer && !is_stored {
        begin(true);
        let draft = Scene { quality: scene.draft.clone(), ..scene.clone() };
        send(Renderer::new_keeping(context, draft, &mut kept_of(kept, 0), &mut told)?)?;
        (told.wake)();
    }
    begin(false);
    let mut say = |line: &str| shared.said.lock().expect("no holder panics").push(line.to_owned());
    send(match store {
        None => Renderer::new_keeping(context, scene, &mut kept_of(kept, 1), &mut told)?,
        Some(store) => {
            let stores = (store, Some(&mut *kept_of(kept, 1)));
            Renderer::cached_keeping(context, scene, stores, &mut told, &mut say)?
        }
    })
}

impl Drop for Worker {
    /// The thread uses the device, so it ends before the device is dropped.
    fn drop(&mut self) {
        self.shared.is_cancelled.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            // The thread was cancelled, or failed with an error that no longer matters.
            let _ = thread.join();
        }
    }
}

/// Records a picture of direct light. `materials`: those of the loaded scene.
pub(super) fn record_preview(
    preview: &mut Preview,
    requested: &ViewRequest,
    materials: &[Material],
) -> Result<Recorder> {
    let lights = requested.document.lights.iter().map(|entry| entry.light.clone()).collect::<Vec<_>>();
    let mut materials = materials.to_vec();
    requested.document.apply_materials(&mut materials);
    // The same clamp as in the full renderer.
    for material in &mut materials {
        material.clamp_albedo();
    }
    preview.record(&requested.camera, &lights, &materials, requested.display)
}

impl Ready {
    /// Records the request. Refused material edits are reverted in `document`, with a message each.
    pub(super) fn record(
        &mut self,
        requested: &ViewRequest,
        document: &mut Document,
    ) -> Result<(Recorder, RecordedFrame, Vec<String>)> {
        let refused = self.bring_into_line(requested, document)?;
        let (recorder, frame) = self.renderer.begin_frame()?;
        Ok((recorder, frame, refused))
    }

    /// Records the request as a mix of pictures: lights are dimmed without a frame. The first time,
    /// the frame without these lights is rendered. `None` if anything else differs from the picture
    /// that is shown.
    pub(super) fn record_dimmed(
        &mut self,
        shown: Option<&ViewRequest>,
        requested: &ViewRequest,
    ) -> Result<Option<(Recorder, Option<RecordedFrame>)>> {
        if let Some(dimming) = &self.dimming {
            let Some(gains) = dimming.gains(requested) else { return Ok(None) };
            return Ok(Some((self.renderer.mix(&dimming.mix, gains)?, None)));
        }
        let Some((base, dimmed)) = shown.and_then(|base| Some((base, Dimmed::new(base, requested)?))) else {
            return Ok(None);
        };
        let mix = match self.renderer.begin_mix() {
            Err(error) if error.is_out_of_memory() => return Ok(None),
            mix => mix?,
        };
        let dark = dimming::without(requested, &dimmed.lights);
        self.bring_into_line(&dark, &mut dark.document.clone())?;
        let (recorder, frame) = self.renderer.begin_frame_without(&mix, dimmed.gains)?;
        self.dimming = Some(Dimming { base: base.clone(), lights: dimmed.lights, mix });
        Ok(Some((recorder, Some(frame))))
    }

    /// Searches for powers that give these illuminances; lights that are `kept` stay. Returns the
    /// identifiers of the others. The next record sets the lights right.
    pub(super) fn find_powers(&mut self, goals: &[Goal], kept: &HashSet<u64>) -> Result<(Vec<u64>, Found)> {
        let lights: Vec<usize> = meters::active(self.renderer.scene())
            .into_iter()
            .filter(|light| !kept.contains(&self.ids[*light]))
            .collect();
        if lights.is_empty() {
            return Err(Error::Usage("no light that is on may change".to_owned()));
        }
        let wish = Wish { goals, lights: &lights, max_factor: f64::INFINITY };
        let found = wish.find(&mut self.renderer, (&[], 0.0))?;
        Ok((lights.into_iter().map(|light| self.ids[light]).collect(), found))
    }

    /// Whether the picture is mixed, and no frame's.
    pub(super) fn is_mixed(&self) -> bool {
        self.dimming.is_some()
    }

    /// Edits the renderer. Refused material edits are reverted in `document`, with a message each.
    fn bring_into_line(&mut self, requested: &ViewRequest, document: &mut Document) -> Result<Vec<String>> {
        let renderer = &mut self.renderer;
        if self.dimming.take().is_some() {
            renderer.end_mix();
        }
        if renderer.size() != requested.camera.size {
            renderer.resize(requested.camera.size)?;
        }
        renderer.set_camera(&requested.camera);
        renderer.set_display_transform(requested.display);
        renderer.set_light_weights(requested.weights);
        self.bring_lights_into_line(&requested.document)?;
        let refused = self.bring_materials_into_line(document)?;
        self.is_behind = true;
        Ok(refused)
    }

    /// Does a part of the work that the last frame left: first what the next camera movement would
    /// wait for, then own records, a part each time. Returns the commands if there is a frame to
    /// render. No other frame may be in flight.
    pub(super) fn idle_work(&mut self) -> Result<Option<(Recorder, RecordedFrame)>> {
        if !std::mem::take(&mut self.is_behind) {
            self.renderer.refine_in_part()?;
            if self.renderer.is_current() {
                return Ok(None);
            }
            // The frame with own records gathers what the view needs, as one after an edit does.
            self.is_behind = true;
        }
        self.renderer.begin_frame().map(Some)
    }

    /// Whether [`Self::idle_work`] has work.
    pub(super) fn is_behind(&self) -> bool {
        self.is_behind || self.renderer.may_refine()
    }

    fn bring_lights_into_line(&mut self, document: &Document) -> Result<()> {
        let (renderer, ids) = (&mut self.renderer, &mut self.ids);
        for index in (0..ids.len()).rev() {
            if !document.lights.iter().any(|entry| entry.id == ids[index]) {
                // The light is gone even if a later step fails.
                ids.remove(index);
                renderer.remove_light(index)?;
            }
        }
        for entry in &document.lights {
            let index = match ids.iter().position(|id| *id == entry.id) {
                Some(index) => {
                    renderer.set_light(index, entry.light.kind)?;
                    renderer.set_luminaire(index, entry.light.luminaire.clone())?;
                    index
                }
                None => {
                    renderer.add_light(entry.light.clone())?;
                    ids.push(entry.id);
                    ids.len() - 1
                }
            };
            if renderer.light_is_on(index) != entry.light.is_on {
                renderer.switch_light(index, entry.light.is_on)?;
            }
        }
        Ok(())
    }

    fn bring_materials_into_line(&mut self, document: &mut Document) -> Result<Vec<String>> {
        let mut refused = Vec::new();
        for (index, edit) in document.materials.iter_mut().enumerate() {
            let MaterialEdit { diffuse, specular, exponent, editable } = *edit;
            // A pointer that is still pressed makes it glossy; light paths are traced afterwards.
            let waits = editable && !self.renderer.scene().materials[index].editable;
            let specular = if waits { Vec3::ZERO } else { specular };
            match self.renderer.set_material(index, diffuse, specular, exponent) {
                Ok(()) => (),
                Err(Error::Usage(why)) => {
                    refused.push(why);
                    *edit = MaterialEdit::from_material(&self.renderer.scene().materials[index]);
                }
                Err(error) => return Err(error),
            }
        }
        Ok(refused)
    }
}
