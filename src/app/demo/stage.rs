//! The renderers of the window: a preview of direct light, then the full renderer once a thread has
//! traced the light paths.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use super::document::{Document, MaterialEdit};
use super::view_request::ViewRequest;
use crate::error::{Error, Result};
use crate::gpu::{Context, Recorder};
use crate::renderer::{Preview, Progress, RecordedFrame, Renderer, Store};
use crate::scene::{Material, Scene};

/// Shortest time between progress updates: drawing takes time from the worker.
const BREATH: Duration = Duration::from_millis(100);

/// Called from any thread when there is a new state to show.
pub(super) type Wake = Arc<dyn Fn() + Send + Sync>;

/// Progress of the precomputation.
#[derive(Clone, Default)]
pub(super) struct Progressed {
    pub(super) stage: String,
    pub(super) done: u64,
    pub(super) total: u64,
}

/// The stage while a worker traces the light paths.
pub(super) struct Preparing {
    /// `None` once its result is taken.
    worker: Option<JoinHandle<Result<Renderer>>>,
    shared: Arc<Shared>,
    pub(super) preview: Preview,
    pub(super) since: Instant,
}

/// State that window and worker share.
struct Shared {
    progress: Mutex<Progressed>,
    /// Messages of the precompute cache, one line each.
    said: Mutex<Vec<String>>,
    is_cancelled: AtomicBool,
}

/// The renderer, and the identifiers of its lights.
pub(super) struct Ready {
    pub(super) renderer: Renderer,
    /// Identifier of each light, in the renderer's order.
    ids: Vec<u64>,
    /// The last frame left work that the next camera movement would wait for.
    is_behind: bool,
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
    fn tell(&mut self, change: impl FnOnce(&mut Progressed)) {
        if self.shared.is_cancelled.load(Ordering::Relaxed) {
            // Unwinding frees the worker's resources; no thread waits for its result.
            std::panic::resume_unwind(Box::new(Cancelled));
        }
        change(&mut self.shared.progress.lock().expect("no holder panics"));
        if self.wake_up.elapsed() > BREATH {
            self.wake_up = Instant::now();
            (self.wake)();
        }
    }
}

impl Progress for Told {
    fn stage(&mut self, name: &str, total: u64) {
        self.tell(|progress| *progress = Progressed { stage: name.to_owned(), done: 0, total });
    }

    fn advance(&mut self, done: u64) {
        self.tell(|progress| progress.done = done);
    }

    fn finish(&mut self) {
        self.tell(|progress| progress.done = progress.total);
    }
}

impl Preparing {
    /// Prepares direct light, and starts a thread that traces the light paths or reads them from
    /// the precompute cache.
    pub(super) fn new(
        context: &Arc<Context>,
        scene: &Scene,
        store: Option<Store>,
        wake: &Wake,
    ) -> Result<Self> {
        let preview = Preview::new(context, scene.clone())?;
        let shared = Arc::new(Shared {
            progress: Mutex::default(),
            said: Mutex::default(),
            is_cancelled: AtomicBool::new(false),
        });
        let mut told = Told { shared: shared.clone(), wake: wake.clone(), wake_up: Instant::now() };
        let (context, scene) = (context.clone(), scene.clone());
        let work = move || {
            let shared = told.shared.clone();
            let mut say = |line: &str| shared.said.lock().expect("no holder panics").push(line.to_owned());
            let made = match &store {
                None => Renderer::new(&context, scene, &mut told),
                Some(store) => Renderer::cached(&context, scene, store, &mut told, &mut say),
            };
            (told.wake)();
            made
        };
        let worker = std::thread::Builder::new().name("precomputation".into()).spawn(work);
        let worker =
            worker.map_err(|error| Error::Usage(format!("no thread for the precomputation: {error}")))?;
        Ok(Self { worker: Some(worker), shared, preview, since: Instant::now() })
    }

    /// Progress of the worker. `None` if it has ended.
    pub(super) fn progress(&self) -> Option<Progressed> {
        self.worker.as_ref()?;
        Some(self.shared.progress.lock().expect("no holder panics").clone())
    }

    /// Takes the messages of the precompute cache.
    pub(super) fn said(&self) -> Vec<String> {
        std::mem::take(&mut self.shared.said.lock().expect("no holder panics"))
    }

    /// The renderer, once it is ready. `light_count`: number of lights of the loaded scene.
    pub(super) fn finished(&mut self, light_count: usize) -> Result<Option<Ready>> {
        if self.worker.as_ref().is_none_or(|worker| !worker.is_finished()) {
            return Ok(None);
        }
        let Some(worker) = self.worker.take() else { return Ok(None) };
        let made = worker.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic));
        Ok(Some(Ready { renderer: made?, ids: (0..light_count as u64).collect(), is_behind: true }))
    }

    /// Records a picture of direct light.
    pub(super) fn record(&mut self, requested: &ViewRequest, materials: &[Material]) -> Result<Recorder> {
        let lights = requested.document.lights.iter().map(|entry| entry.light.clone()).collect::<Vec<_>>();
        let mut materials = materials.to_vec();
        requested.document.apply_materials(&mut materials);
        // The same clamp as in the full renderer.
        for material in &mut materials {
            material.clamp_albedo();
        }
        self.preview.record(&requested.camera, &lights, &materials, requested.exposure_stops)
    }
}

impl Drop for Preparing {
    /// The worker uses the device, so it ends before the device is dropped.
    fn drop(&mut self) {
        self.shared.is_cancelled.store(true, Ordering::Relaxed);
        if let Some(worker) = self.worker.take() {
            // The worker was cancelled, or failed with an error that no longer matters.
            let _ = worker.join();
        }
    }
}

impl Ready {
    /// Records the request. Refused material edits are reverted in `document`, with a message each.
    pub(super) fn record(
        &mut self,
        requested: &ViewRequest,
        document: &mut Document,
    ) -> Result<(Recorder, RecordedFrame, Vec<String>)> {
        let renderer = &mut self.renderer;
        if renderer.size() != requested.camera.size {
            renderer.resize(requested.camera.size)?;
        }
        renderer.set_camera(&requested.camera);
        renderer.set_exposure(requested.exposure_stops);
        renderer.set_light_weights(requested.weights);
        self.bring_lights_into_line(&requested.document)?;
        let refused = self.bring_materials_into_line(document)?;
        self.is_behind = true;
        let (recorder, frame) = self.renderer.begin_frame()?;
        Ok((recorder, frame, refused))
    }

    /// Records the work that the last frame left, so that the next camera movement does not wait.
    pub(super) fn record_idle_work(&mut self) -> Result<(Recorder, RecordedFrame)> {
        self.is_behind = false;
        self.renderer.begin_frame()
    }

    /// Whether [`Self::record_idle_work`] has work.
    pub(super) fn is_behind(&self) -> bool {
        self.is_behind
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
            let MaterialEdit { diffuse, specular, exponent } = *edit;
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
