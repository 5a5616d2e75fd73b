//! All programs of a context: created once, and shared by all users of the same
//! shader and constants.

use std::collections::HashMap;
use std::sync::atomic::{AtomicU32, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError, RwLock};
use std::time::{Duration, Instant};

use ash::vk;
use rayon::prelude::*;

use super::Tuning;
use super::device::Limits;
use super::names::Names;
use super::optional::Optional;
use super::pipeline_store::PipelineStore;
use super::program::{Handles, Maker, Program, Variant};
use super::shaders::Shader;
use crate::error::Result;

/// Key of a program: shader and specialisation constants.
type Key = (&'static str, Vec<(String, u32)>);

/// Programs by shader and constants, with the driver's pipeline cache.
pub(super) struct Pipelines {
    programs: Mutex<HashMap<Key, Arc<Program>>>,
    replaced: RwLock<Replaced>,
    /// Vulkan objects of replaced shaders, which recordings and submissions may still use.
    retired: Mutex<Vec<Arc<Handles>>>,
    cache: vk::PipelineCache,
    store: PipelineStore,
    /// Number of compiled variants.
    made: AtomicU32,
    /// Wall-clock time of compiling, nanoseconds.
    compile_ns: AtomicU64,
}

/// The shaders that have replaced embedded ones, by stem. Locked before the programs.
#[derive(Default)]
struct Replaced {
    shaders: HashMap<&'static str, Shader>,
    /// Number of replacements so far.
    count: u32,
}

impl Replaced {
    fn shader(&self, stem: &str) -> &Shader {
        self.shaders.get(stem).unwrap_or_else(|| Shader::named(stem))
    }
}

/// A variant of a program that a recording needs and the driver has not compiled yet.
pub(super) type Missing = (Arc<Program>, Variant);

impl Pipelines {
    /// No programs yet; the driver's cache starts with the stored pipelines.
    pub(super) fn new(device: &ash::Device, names: &Names, mut store: PipelineStore) -> Self {
        let cache = store.open(device, names);
        Self {
            programs: Mutex::default(),
            replaced: RwLock::default(),
            retired: Mutex::default(),
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
        let replaced = self.replaced.read().unwrap_or_else(PoisonError::into_inner);
        // A panic about a wrong constant leaves the table as it was.
        let mut programs = self.programs.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(program) = programs.get(&(stem, sorted.clone())) {
            return Ok(program.clone());
        }
        let program = Arc::new(Program::new(replaced.shader(stem), constants, tuning, limits)?);
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
        let replaced = self.replaced.read().unwrap_or_else(PoisonError::into_inner);
        let made = self.in_parallel(missing, |program, variant| {
            program.make(maker, replaced.shader(program.stem), variant)
        });
        made.into_iter().collect()
    }

    /// Compiles variants on all cores. Results are in the order of `variants`.
    fn in_parallel<T: Send>(
        &self,
        variants: &[Missing],
        compile: impl Fn(&Program, Variant) -> Result<T> + Sync,
    ) -> Vec<Result<T>> {
        let start = Instant::now();
        let one_at_a_time = variants.par_iter().with_max_len(1);
        let made: Vec<_> = one_at_a_time.map(|(program, variant)| compile(program, *variant)).collect();
        self.made.fetch_add(variants.len() as u32, Ordering::Relaxed);
        self.compile_ns.fetch_add(start.elapsed().as_nanos() as u64, Ordering::Relaxed);
        made
    }

    /// The shader with this stem that programs are compiled from.
    pub(super) fn shader(&self, stem: &str) -> Shader {
        self.replaced.read().unwrap_or_else(PoisonError::into_inner).shader(stem).clone()
    }

    /// Number of replacements of shaders so far.
    pub(super) fn replacement_count(&self) -> u32 {
        self.replaced.read().unwrap_or_else(PoisonError::into_inner).count
    }

    /// Replaces shaders by others with the same interface, in all programs or, on an error, in
    /// none of them.
    pub(super) fn replace(
        &self,
        (device, names, optional): (&ash::Device, &Names, &Optional),
        shaders: Vec<Shader>,
    ) -> Result<()> {
        let maker = Maker { device, names, optional, cache: self.cache };
        // Locked to the end: no other thread compiles the old code meanwhile.
        let mut replaced = self.replaced.write().unwrap_or_else(PoisonError::into_inner);
        let shaders: HashMap<_, _> = shaders.into_iter().map(|shader| (shader.stem, shader)).collect();
        let programs = self.programs.lock().unwrap_or_else(PoisonError::into_inner);
        let variants: Vec<Missing> = programs
            .values()
            .filter(|program| shaders.contains_key(program.stem))
            .flat_map(|program| Variant::all().map(|variant| (program.clone(), variant)))
            .filter(|(program, variant)| program.handles(*variant).is_some())
            .collect();
        let made = self.in_parallel(&variants, |program, variant| {
            program.compile(maker, &shaders[program.stem], variant)
        });
        if made.iter().any(Result::is_err) {
            let (made, failed): (Vec<_>, Vec<_>) = made.into_iter().partition(Result::is_ok);
            made.into_iter().flatten().for_each(|handles| handles.destroy(device));
            return failed.into_iter().try_for_each(|failure| failure.map(|_| ()));
        }
        let mut retired = self.retired.lock().unwrap_or_else(PoisonError::into_inner);
        for ((program, variant), handles) in variants.iter().zip(made.into_iter().flatten()) {
            retired.extend(program.replace(handles, *variant));
        }
        // A recording holds what it uses until its submission is done.
        for unused in retired.extract_if(.., |handles| Arc::strong_count(handles) == 1) {
            unused.destroy(device);
        }
        replaced.shaders.extend(shaders);
        replaced.count += 1;
        Ok(())
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
        let retired = self.retired.get_mut().unwrap_or_else(PoisonError::into_inner);
        retired.drain(..).for_each(|handles| handles.destroy(device));
        // SAFETY: it is ours, made by this device, and nothing is compiled any more.
        unsafe { device.destroy_pipeline_cache(self.cache, None) };
    }
}
