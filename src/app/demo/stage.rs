//! What makes pictures of the scene: first direct light alone, then, when a thread has traced the
//! light paths, all light.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use super::document::{Document, MaterialEdit};
use super::session::ViewRequest;
use crate::error::{Error, Result};
use crate::gpu::Context;
use crate::renderer::{FrameReport, Preview, Progress, Renderer, Store};
use crate::scene::{Material, Scene};

/// How often the window shows how far the worker is, at most: drawing takes time from the work.
const BREATH: Duration = Duration::from_millis(100);

/// Called, from any thread, when there is something new to show.
pub(super) type Wake = Arc<dyn Fn() + Send + Sync>;

/// How far the precomputation is.
#[derive(Clone, Default)]
pub(super) struct Progressed {
    pub(super) stage: String,
    pub(super) done: u64,
    pub(super) total: u64,
}

/// Light paths are being traced.
pub(super) struct Preparing {
    /// None once it was asked for its result.
    worker: Option<JoinHandle<Result<Renderer>>>,
    shared: Arc<Shared>,
    pub(super) preview: Preview,
    pub(super) since: Instant,
}

/// What window and worker have in common.
struct Shared {
    progress: Mutex<Progressed>,
    /// Of the light paths that are kept: a line each.
    said: Mutex<Vec<String>>,
    is_cancelled: AtomicBool,
}

/// The renderer, and which of its lights is which.
pub(super) struct Ready {
    pub(super) renderer: Renderer,
    /// Of each of its lights, in its order.
    ids: Vec<u64>,
    /// The last frame left something undone that the next camera would wait for.
    is_behind: bool,
}

/// The worker's end.
struct Told {
    shared: Arc<Shared>,
    wake: Wake,
    wake_up: Instant,
}

/// What a worker that is not needed any more ends with.
struct Cancelled;

impl Told {
    fn tell(&mut self, change: impl FnOnce(&mut Progressed)) {
        if self.shared.is_cancelled.load(Ordering::Relaxed) {
            // Everything on the way up gives back what it holds; nobody waits for a result.
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
    /// Makes direct light ready to be seen, and sets out to trace the light paths, or to take them
    /// from where they are kept.
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
                Some(store) => Renderer::stored(&context, scene, store, &mut told, &mut say),
            };
            (told.wake)();
            made
        };
        let worker = std::thread::Builder::new().name("precomputation".into()).spawn(work);
        let worker =
            worker.map_err(|error| Error::Usage(format!("no thread for the precomputation: {error}")))?;
        Ok(Self { worker: Some(worker), shared, preview, since: Instant::now() })
    }

    /// How far the worker is; none when it has ended.
    pub(super) fn progress(&self) -> Option<Progressed> {
        self.worker.as_ref()?;
        Some(self.shared.progress.lock().expect("no holder panics").clone())
    }

    /// What there is to be told of light paths that are kept.
    pub(super) fn said(&self) -> Vec<String> {
        std::mem::take(&mut self.shared.said.lock().expect("no holder panics"))
    }

    /// The renderer, once it is ready. `light_count`: lights that the scene was loaded with.
    pub(super) fn finished(&mut self, light_count: usize) -> Result<Option<Ready>> {
        if self.worker.as_ref().is_none_or(|worker| !worker.is_finished()) {
            return Ok(None);
        }
        let Some(worker) = self.worker.take() else { return Ok(None) };
        let made = worker.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic));
        Ok(Some(Ready { renderer: made?, ids: (0..light_count as u64).collect(), is_behind: true }))
    }

    /// A picture of direct light.
    pub(super) fn frame(&mut self, requested: &ViewRequest, materials: &[Material]) -> Result<()> {
        let lights = requested.document.lights.iter().map(|entry| entry.light.clone()).collect::<Vec<_>>();
        let mut materials = materials.to_vec();
        requested.document.apply_materials(&mut materials);
        // As the renderer that is to come will have them.
        for material in &mut materials {
            material.bound_albedo();
        }
        self.preview.frame(&requested.camera, &lights, &materials, requested.exposure_stops)
    }
}

impl Drop for Preparing {
    /// The worker uses the device, which must not go before it.
    fn drop(&mut self) {
        self.shared.is_cancelled.store(true, Ordering::Relaxed);
        if let Some(worker) = self.worker.take() {
            // It ends because it was told to, or with a failure that concerns nobody any more.
            let _ = worker.join();
        }
    }
}

impl Ready {
    /// A picture of what is requested. What cannot be had is taken out of `document`, and said.
    pub(super) fn frame(
        &mut self,
        requested: &ViewRequest,
        document: &mut Document,
    ) -> Result<(FrameReport, Vec<String>)> {
        let renderer = &mut self.renderer;
        if renderer.size() != requested.camera.size {
            renderer.resize(requested.camera.size)?;
        }
        renderer.set_camera(&requested.camera);
        renderer.set_exposure(requested.exposure_stops);
        renderer.set_shares(requested.shares);
        self.bring_lights_into_line(&requested.document)?;
        let refused = self.bring_materials_into_line(document)?;
        self.is_behind = true;
        Ok((self.renderer.frame()?, refused))
    }

    /// Does what the last frame left undone, for the camera to find it when it moves.
    pub(super) fn run_idle_work(&mut self) -> Result<()> {
        if std::mem::take(&mut self.is_behind) {
            self.renderer.frame()?;
        }
        Ok(())
    }

    /// Whether [`Self::run_idle_work`] has something to do.
    pub(super) fn is_behind(&self) -> bool {
        self.is_behind
    }

    fn bring_lights_into_line(&mut self, document: &Document) -> Result<()> {
        let (renderer, ids) = (&mut self.renderer, &mut self.ids);
        for index in (0..ids.len()).rev() {
            if !document.lights.iter().any(|entry| entry.id == ids[index]) {
                // Gone whatever else fails.
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
