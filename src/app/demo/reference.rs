//! Monte Carlo beside the renderer's picture: a path tracer that refines in its own thread while
//! it is shown.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::Duration;

use super::session::Session;
use super::stage::Wake;
use super::view_request::ViewRequest;
use crate::cpu::tonemap::dithered;
use crate::error::{Error, Result};
use crate::gpu::Context;
use crate::passes::precompute::Silent;
use crate::reference::{PathTracer, Progressive};
use crate::scene::{DisplayTransform, Scene};

/// Polling period of the idle thread.
const PATIENCE: Duration = Duration::from_millis(200);
/// Samples per pixel at which refinement stops.
const MAX_SAMPLES: u32 = 4096;

/// The tracer's thread and its result.
pub(super) struct Reference {
    worker: Option<JoinHandle<()>>,
    orders: Option<Sender<(u64, Box<Scene>)>>,
    /// Number of the last order; results of earlier orders are dropped.
    epoch: u64,
    shared: Arc<Shared>,
    /// The newest answer to it.
    newest: Option<Found>,
    /// The request of the last order.
    requested: Option<ViewRequest>,
}

struct Shared {
    found: Mutex<Result<Option<Found>>>,
    is_cancelled: AtomicBool,
}

/// The picture so far.
#[derive(Default)]
pub(super) struct Found {
    pub(super) size: [u32; 2],
    /// Number of the order that it answers.
    epoch: u64,
    pub(super) samples: u32,
    /// Each half by itself, W/m²/sr.
    pub(super) halves: [Vec<[f32; 3]>; 2],
}

impl Found {
    /// sRGB codes R, G, B, 255, displayed as the picture beside it.
    pub(super) fn display(&self, display: &DisplayTransform) -> Vec<[u8; 4]> {
        let display = display.constants();
        let both = self.halves[0].iter().zip(&self.halves[1]);
        let radiance = both.map(|(a, b)| [0, 1, 2].map(|channel| 0.5 * (a[channel] + b[channel])));
        (0..).zip(radiance).map(|(pixel, radiance)| dithered(pixel, &display, radiance)).collect()
    }
}

impl Reference {
    pub(super) fn new(context: &Arc<Context>, wake: &Wake) -> Result<Self> {
        let (orders, ordered) = channel();
        let shared = Arc::new(Shared { found: Mutex::new(Ok(None)), is_cancelled: AtomicBool::new(false) });
        let (context, wake, told) = (context.clone(), wake.clone(), shared.clone());
        let work = move || {
            if let Err(error) = refine(&context, &ordered, &told, &wake) {
                *told.found.lock().expect("no holder panics") = Err(error);
            }
            // The window drops the ended thread.
            wake();
        };
        let worker = std::thread::Builder::new().name("Monte Carlo".into()).spawn(work);
        let worker = worker.map_err(|error| Error::Usage(format!("no thread for Monte Carlo: {error}")))?;
        Ok(Self {
            worker: Some(worker),
            orders: Some(orders),
            shared,
            epoch: 0,
            newest: None,
            requested: None,
        })
    }

    /// Restarts if the shown picture has changed. Returns whether it has.
    pub(super) fn follow(&mut self, session: &Session) -> bool {
        let Some(requested) = session.shown() else { return false };
        let is_same =
            |known: &ViewRequest| known.document == requested.document && known.camera == requested.camera;
        if self.requested.as_ref().is_some_and(is_same) {
            return false;
        }
        self.requested = Some(requested.clone());
        self.epoch += 1;
        self.newest = None;
        if let Ok(found) = &mut *self.shared.found.lock().expect("no holder panics") {
            *found = None;
        }
        let mut scene = session.scene.clone();
        scene.cameras[0] = requested.camera.clone();
        scene.lights = requested.document.lights.iter().map(|entry| entry.light.clone()).collect();
        requested.document.apply_materials(&mut scene.materials);
        for material in &mut scene.materials {
            material.conserve_energy();
            material.clamp_albedo();
        }
        if let Some(orders) = &self.orders {
            // If the thread has failed, the result holds its error.
            let _ = orders.send((self.epoch, Box::new(scene)));
        }
        true
    }

    /// Takes the newest samples. Returns whether there are any since the last call.
    ///
    /// # Errors
    /// The device lacks memory or failed.
    pub(super) fn advance(&mut self) -> Result<bool> {
        let mut found = self.shared.found.lock().expect("no holder panics");
        let found = std::mem::replace(&mut *found, Ok(None))?;
        // Samples of an earlier scene are dropped.
        let Some(found) = found.filter(|found| found.epoch == self.epoch) else { return Ok(false) };
        self.newest = Some(found);
        Ok(true)
    }

    /// The picture so far, once there are two samples of each pixel.
    pub(super) fn newest(&self) -> Option<&Found> {
        self.newest.as_ref()
    }
}

impl Reference {
    /// Stops the thread after the samples under way.
    pub(super) fn stop(&mut self) {
        self.shared.is_cancelled.store(true, Ordering::Relaxed);
        self.orders = None;
    }

    /// Whether the thread has ended: dropping it then takes no time.
    pub(super) fn has_ended(&self) -> bool {
        self.worker.as_ref().is_none_or(JoinHandle::is_finished)
    }
}

impl Drop for Reference {
    /// The thread uses the device, so it ends before the device is dropped.
    fn drop(&mut self) {
        self.stop();
        if let Some(worker) = self.worker.take() {
            let _ = worker.join();
        }
    }
}

/// The thread's loop: traces the newest scene, two samples at a time.
fn refine(
    context: &Arc<Context>,
    ordered: &Receiver<(u64, Box<Scene>)>,
    shared: &Shared,
    wake: &Wake,
) -> Result<()> {
    let mut tracer: Option<PathTracer> = None;
    let mut epoch = 0;
    while !shared.is_cancelled.load(Ordering::Relaxed) {
        let is_done = tracer.as_ref().is_none_or(|tracer| tracer.samples() >= MAX_SAMPLES);
        let first = match ordered.recv_timeout(if is_done { PATIENCE } else { Duration::ZERO }) {
            Ok(order) => Some(order),
            Err(RecvTimeoutError::Timeout) => None,
            Err(RecvTimeoutError::Disconnected) => return Ok(()),
        };
        if let Some((number, scene)) = ordered.try_iter().last().or(first) {
            epoch = number;
            // One tracer at a time: the device may lack memory for two.
            drop(tracer.take());
            tracer = Some(PathTracer::new(context, *scene, &mut Silent)?);
        } else if is_done {
            continue;
        }
        let Some(tracer) = &mut tracer else { continue };
        tracer.add_samples(2)?;
        let size = tracer.traced_scene().size();
        let found = Found { size, epoch, samples: tracer.samples(), halves: tracer.halves()? };
        *shared.found.lock().expect("no holder panics") = Ok(Some(found));
        wake();
    }
    Ok(())
}
