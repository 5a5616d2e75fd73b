//! Monte Carlo beside ours: a path tracer that refines in a thread of its own for as long as it
//! is looked at.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::Duration;

use super::session::{Session, ViewRequest};
use super::stage::Wake;
use crate::cpu::tonemap::dithered;
use crate::error::{Error, Result};
use crate::gpu::Context;
use crate::passes::precompute::Silent;
use crate::reference::{PathTracer, Progressive};
use crate::scene::Scene;

/// How often the thread asks whether it is still requested when it has nothing to do.
const PATIENCE: Duration = Duration::from_millis(200);
/// Samples after which it has refined enough.
const MAX_SAMPLES: u32 = 4096;

/// The thread, and what it has found.
pub(super) struct Reference {
    worker: Option<JoinHandle<()>>,
    orders: Option<Sender<(u64, Box<Scene>)>>,
    /// Number of the last order; answers to earlier ones are dropped.
    epoch: u64,
    shared: Arc<Shared>,
    /// What was ordered last.
    requested: Option<ViewRequest>,
}

struct Shared {
    found: Mutex<Result<Option<Found>>>,
    is_cancelled: AtomicBool,
}

/// The picture so far.
#[derive(Clone, Default)]
pub(super) struct Found {
    pub(super) size: [u32; 2],
    /// Of the order that it answers.
    epoch: u64,
    pub(super) samples: u32,
    /// Each half by itself, W/m²/sr.
    pub(super) halves: [Vec<[f32; 3]>; 2],
}

impl Found {
    /// For eyes: sRGB codes R, G, B, 255, as bright as the picture beside it.
    pub(super) fn display(&self, exposure_stops: f32) -> Vec<[u8; 4]> {
        let scale = 0.5 * exposure_stops.exp2();
        let both = self.halves[0].iter().zip(&self.halves[1]);
        let linear = both.map(|(a, b)| [0, 1, 2].map(|channel| scale * (a[channel] + b[channel])));
        (0..).zip(linear).map(|(pixel, linear)| dithered(pixel, linear)).collect()
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
            // To be let go of.
            wake();
        };
        let worker = std::thread::Builder::new().name("Monte Carlo".into()).spawn(work);
        let worker = worker.map_err(|error| Error::Usage(format!("no thread for Monte Carlo: {error}")))?;
        Ok(Self { worker: Some(worker), orders: Some(orders), shared, epoch: 0, requested: None })
    }

    /// Begins anew where what is shown has changed. True where it has.
    pub(super) fn follow(&mut self, session: &Session) -> bool {
        let Some(requested) = session.shown() else { return false };
        let is_same =
            |known: &ViewRequest| known.document == requested.document && known.camera == requested.camera;
        if self.requested.as_ref().is_some_and(is_same) {
            return false;
        }
        self.requested = Some(requested.clone());
        self.epoch += 1;
        if let Ok(found) = &mut *self.shared.found.lock().expect("no holder panics") {
            *found = None;
        }
        let mut scene = session.scene.clone();
        scene.cameras[0] = requested.camera.clone();
        scene.lights = requested.document.lights.iter().map(|entry| entry.light.clone()).collect();
        requested.document.apply_materials(&mut scene.materials);
        for material in &mut scene.materials {
            material.conserve_energy();
            material.bound_albedo();
        }
        if let Some(orders) = &self.orders {
            // Where the thread has failed, what it found says so.
            let _ = orders.send((self.epoch, Box::new(scene)));
        }
        true
    }

    /// The picture so far, once there are two samples of each pixel.
    ///
    /// # Errors
    /// The device lacks memory or failed.
    pub(super) fn found(&self) -> Result<Option<Found>> {
        let mut found = self.shared.found.lock().expect("no holder panics");
        let found = std::mem::replace(&mut *found, Ok(None))?;
        // What was under way when the scene changed shows what it was.
        Ok(found.filter(|found| found.epoch == self.epoch))
    }
}

impl Reference {
    /// Tells the thread to end, which it does when the samples under way are done.
    pub(super) fn stop(&mut self) {
        self.shared.is_cancelled.store(true, Ordering::Relaxed);
        self.orders = None;
    }

    /// Whether it has ended: nobody who lets go of it has to wait.
    pub(super) fn has_ended(&self) -> bool {
        self.worker.as_ref().is_none_or(JoinHandle::is_finished)
    }
}

impl Drop for Reference {
    /// The thread uses the device, which must not go before it.
    fn drop(&mut self) {
        self.stop();
        if let Some(worker) = self.worker.take() {
            let _ = worker.join();
        }
    }
}

/// The thread: the newest scene, two samples at a time.
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
            // One at a time: both may not fit the device.
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
