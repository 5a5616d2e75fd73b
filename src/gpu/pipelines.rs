//! All programs of a context: created once, and shared by all users of the same
//! shader and constants.

use std::collections::HashMap;
use std::sync::atomic::{AtomicU32, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use ash::vk;
use rayon::prelude::*;

use super::Tuning;
use super::device::Limits;
use super::names::Names;
use super::optional::Optional;
use super::pipeline_store::PipelineStore;
use super::program::{Maker, Program};
use crate::error::Result;

/// Key of a program: shader and specialisation constants.
type Key = (&'static str, Vec<(String, u32)>);

/// Programs by shader and constants, with the driver's pipeline cache.
pub(super) struct Pipelines {
    programs: Mutex<HashMap<Key, Arc<Program>>>,
    cache: vk::PipelineCache,
    store: PipelineStore,
    /// Number of compiled variants.
    made: AtomicU32,
    /// Wall-clock time of compiling, nanoseconds.
    compile_ns: AtomicU64,
}

/// A variant of a program that a recording needs and the driver has not compiled yet.
pub(super) type Missing = (Arc<Program>, bool);

impl Pipelines {
    /// No programs yet; the driver's cache starts with the stored pipelines.
    pub(super) fn new(device: &ash::Device, names: &Names, mut store: PipelineStore) -> Self {
        let cache = store.open(device, names);
        Self {
            programs: Mutex::default(),
            cache,
            store,
            made: AtomicU32::new(0),
            compile_ns: AtomicU64::new(0),
        }
    }

    /// The program with this shader and these constants: the existing one, or a new one.
    pub(super) fn program(
        &self,
        stem: &'static str,
        constants: &[(&str, u32)],
        tuning: &Tuning,
        limits: &Limits,
    ) -> Result<Arc<Program>> {
        let mut sorted: Vec<_> = constants.iter().map(|&(name, value)| (name.to_owned(), value)).collect();
        sorted.sort_unstable();
        // A panic about a wrong constant leaves the table as it was.
        let mut programs = self.programs.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(program) = programs.get(&(stem, sorted.clone())) {
            return Ok(program.clone());
        }
        let program = Arc::new(Program::new(stem, constants, tuning, limits)?);
        programs.insert((stem, sorted), program.clone());
        Ok(program)
    }

    /// Compiles the missing variants on all cores: drivers compile one pipeline on one thread.
    ///
    /// # Errors
    /// The first error in the order of `missing`; the other variants are still compiled.
    pub(super) fn make(
        &self,
        (device, names, optional): (&ash::Device, &Names, &Optional),
        missing: &[Missing],
    ) -> Result<()> {
        let maker = Maker { device, names, optional, cache: self.cache };
        let start = Instant::now();
        let one_at_a_time = missing.par_iter().with_max_len(1);
        let made = one_at_a_time
            .map(|(program, uses_buffer_device_address)| program.make(maker, *uses_buffer_device_address));
        let made: Vec<_> = made.collect();
        self.made.fetch_add(missing.len() as u32, Ordering::Relaxed);
        self.compile_ns.fetch_add(start.elapsed().as_nanos() as u64, Ordering::Relaxed);
        made.into_iter().collect()
    }

    /// Number of variants compiled so far.
    pub(super) fn made(&self) -> u32 {
        self.made.load(Ordering::Relaxed)
    }

    /// Wall-clock time of compiling so far.
    pub(super) fn compile_time(&self) -> Duration {
        Duration::from_nanos(self.compile_ns.load(Ordering::Relaxed))
    }

    /// Destroys all programs and the cache. No submission may use them any more.
    pub(super) fn destroy(&mut self, device: &ash::Device) {
        let programs = self.programs.get_mut().unwrap_or_else(PoisonError::into_inner);
        if *self.made.get_mut() > 0 {
            self.store.save(device, self.cache);
        }
        programs.drain().for_each(|(_, program)| program.destroy(device));
        // SAFETY: it is ours, made by this device, and nothing is compiled any more.
        unsafe { device.destroy_pipeline_cache(self.cache, None) };
    }
}
