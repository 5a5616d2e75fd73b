//! The device as everything else sees it.

use std::ffi::{CStr, CString};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use ash::vk;
use gpu_allocator::vulkan::{Allocator, AllocatorCreateDesc};
use gpu_allocator::{AllocationSizes, AllocatorDebugSettings};

use super::VkResultExt;
use super::device::{self, CPU, DeviceSummary, Limits, Shows};
use super::instance::Instance;
use super::optional::{Offers, Optional, PipelineStatistics};
use super::pipeline_store::PipelineStore;
use super::pipelines::Pipelines;
use super::recorder::Recorder;
use super::submission::Submission;
use super::timeline::Timeline;
use super::timing::PassTiming;
use super::tuning::Tuning;
use crate::error::{Error, Result};

/// Memory is taken from the device in blocks that grow from the first size to the second, in bytes.
const BLOCK_BYTES: [u64; 2] = [16 << 20, 128 << 20];

/// How to open a device.
#[derive(Clone, Debug)]
pub struct ContextOptions {
    /// An index as `lightpaths info` lists them, or part of a name in any case. None:
    /// the best device.
    pub device: Option<String>,
    /// Turn on the validation layer with its synchronisation checks; it must be installed.
    pub validation: bool,
    /// Panic where two passes use a buffer with no barrier between them that orders it.
    pub hazard_check: bool,
    /// Ask pipelines for the driver's statistics, where it
    /// has any: [`Context::pipeline_statistics`].
    pub statistics: bool,
}

#[allow(clippy::derivable_impls, reason = "derivable only where debug assertions are off")]
impl Default for ContextOptions {
    fn default() -> Self {
        Self { device: None, validation: false, hazard_check: cfg!(debug_assertions), statistics: false }
    }
}

/// Bytes of all live [`Buffer`](super::Buffer)s of a context, as asked for: what the allocator
/// rounds up is not counted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct MemoryUse {
    /// Storage on the device, now.
    pub current_bytes: u64,
    /// Storage on the device, at most.
    pub peak_bytes: u64,
    /// Host memory that transfers pass through, at most.
    pub peak_staging_bytes: u64,
    /// The largest buffer ever made on the device, which is the largest binding.
    pub largest_binding_bytes: u64,
    pub(super) staging_bytes: u64,
}

/// An open device with its queue and memory.
pub struct Context {
    pub(super) device: ash::Device,
    pub(super) sync2: ash::khr::synchronization2::Device,
    pub(super) push_descriptor: ash::khr::push_descriptor::Device,
    pub(super) names: Names,
    pub(super) pipelines: Pipelines,
    pub(super) memory: Mutex<MemoryUse>,
    pub(super) has_hazard_check: bool,
    pub(super) timeline: Timeline,
    pub(super) optional: Optional,
    has_window: bool,
    pub(super) queue_family: u32,
    queue: Mutex<vk::Queue>,
    /// None only while the context goes.
    allocator: Mutex<Option<Allocator>>,
    /// Finished submissions, to be used again.
    submissions: Mutex<Vec<Submission>>,
    redundant_barriers: Mutex<Vec<String>>,
    summary: DeviceSummary,
    tuning: Tuning,
    #[cfg(feature = "window")]
    physical_device: vk::PhysicalDevice,
    instance: Arc<Instance>,
}

impl Context {
    /// Opens a device: the one asked for, or the best: discrete before integrated before
    /// virtual before CPU.
    ///
    /// # Errors
    /// [`Error::NoDevice`] says what was found, why it was refused, and what to install.
    pub fn new(options: &ContextOptions) -> Result<Arc<Self>> {
        Self::open(Arc::new(Instance::new(options.validation, &[])?), options, None)
    }

    /// As [`Self::new`], a device that can show pictures in that window, and the surface to show
    /// them on. The window must live as long as the surface.
    ///
    /// # Errors
    /// As [`Self::new`].
    #[cfg(feature = "window")]
    pub fn for_window(
        options: &ContextOptions,
        window: &dyn super::window::WindowHandles,
    ) -> Result<(Arc<Self>, super::window::Surface)> {
        use super::window::{RawSurface, Surface};
        let instance = Arc::new(Instance::new(options.validation, RawSurface::extensions(window)?)?);
        let surface = RawSurface::new(instance.clone(), window)?;
        let context = Self::open(instance, options, Some(&|device, family| surface.takes(device, family)))?;
        let surface = Surface::new(surface, &context);
        Ok((context, surface))
    }

    fn open(
        instance: Arc<Instance>,
        options: &ContextOptions,
        shows: Option<Shows<'_>>,
    ) -> Result<Arc<Self>> {
        let mut candidates = device::candidates(&instance, shows)?;
        let summaries: Vec<_> = candidates.iter().map(|candidate| &candidate.summary).collect();
        let chosen = device::choose(&summaries, options.device.as_deref())?;
        let device::Candidate { handle, summary, queue_family } = candidates.swap_remove(chosen);

        let offers = Offers::of(&instance, handle, options.statistics)?;
        let device = create_device(&instance.raw, handle, queue_family, shows.is_some(), &offers)?;
        let allocator = Allocator::new(&AllocatorCreateDesc {
            instance: instance.raw.clone(),
            device: device.clone(),
            physical_device: handle,
            debug_settings: AllocatorDebugSettings::default(),
            buffer_device_address: true,
            allocation_sizes: AllocationSizes::new(BLOCK_BYTES[0], BLOCK_BYTES[0])
                .with_max_device_memblock_size(BLOCK_BYTES[1]),
        })
        .map_err(|error| Error::NoDevice(format!("{}: {error}", summary.name)))?;
        // SAFETY: the device is one of the instance's.
        let properties = unsafe { instance.raw.get_physical_device_properties(handle) };
        let debug_utils = || ash::ext::debug_utils::Device::new(&instance.raw, &device);
        let names = Names(instance.has_debug_utils.then(debug_utils));
        let context = Self {
            sync2: ash::khr::synchronization2::Device::new(&instance.raw, &device),
            push_descriptor: ash::khr::push_descriptor::Device::new(&instance.raw, &device),
            pipelines: Pipelines::new(&device, &names, PipelineStore::new(&properties)),
            names,
            memory: Mutex::default(),
            has_hazard_check: options.hazard_check,
            timeline: Timeline::default(),
            optional: offers.load(&instance, &device),
            has_window: shows.is_some(),
            // SAFETY: the device was made with a queue of that family.
            queue: Mutex::new(unsafe { device.get_device_queue(queue_family, 0) }),
            queue_family,
            allocator: Mutex::new(Some(allocator)),
            submissions: Mutex::default(),
            redundant_barriers: Mutex::default(),
            tuning: Tuning::of(summary.kind, &summary.limits, Tuning::cores()),
            summary,
            #[cfg(feature = "window")]
            physical_device: handle,
            device,
            instance,
        };
        context.set_name(context.device.handle(), "lightpaths");
        context.with_queue(|queue| context.set_name(queue, "compute"));
        Ok(Arc::new(context))
    }

    /// Every device of this machine, with the reason where one cannot be used.
    ///
    /// # Errors
    /// [`Error::NoDevice`] where not even the loader or a driver is there.
    pub fn devices() -> Result<Vec<DeviceSummary>> {
        let instance = Instance::new(false, &[])?;
        Ok(device::candidates(&instance, None)?.into_iter().map(|candidate| candidate.summary).collect())
    }

    /// The driver's name for the device.
    pub fn name(&self) -> &str {
        &self.summary.name
    }

    /// Name and version of the driver.
    pub fn driver(&self) -> &str {
        &self.summary.driver
    }

    /// Whether the device is the processor: its timings say nothing about a GPU.
    pub fn is_cpu(&self) -> bool {
        self.summary.kind == CPU
    }

    /// The device's limits that matter here.
    pub fn limits(&self) -> &Limits {
        &self.summary.limits
    }

    /// What is tuned for devices of its class.
    pub fn tuning(&self) -> &Tuning {
        &self.tuning
    }

    /// Whether timestamps wait for a barrier before they are taken: lavapipe puts them in line with
    /// what it draws, once it has drawn to a window.
    pub(super) fn delays_timestamps(&self) -> bool {
        self.has_window && self.is_cpu()
    }

    /// Memory in use by buffers, and its peak.
    pub fn memory(&self) -> MemoryUse {
        *self.memory.lock().expect("no holder panics")
    }

    /// Lets the peaks of [`Self::memory`] begin anew with what is in use.
    pub fn reset_memory_peak(&self) {
        let mut memory = self.memory.lock().expect("no holder panics");
        memory.peak_bytes = memory.current_bytes;
        memory.peak_staging_bytes = 0;
    }

    /// Warnings and errors of the validation layer since the last call. Empty when
    /// validation is off.
    pub fn take_validation_messages(&self) -> Vec<String> {
        self.instance.take_messages()
    }

    /// Barriers that ordered no two conflicting uses, in the recordings since the last call, in
    /// words. Empty when the hazard check is off.
    pub fn take_redundant_barriers(&self) -> Vec<String> {
        std::mem::take(&mut self.redundant_barriers.lock().expect("no holder panics"))
    }

    /// Records commands, submits them, waits, and returns what `record` returned with the time of
    /// each pass in order. A recording that meets pipelines which are not compiled yet is not
    /// submitted: they are compiled in parallel, and `record` is called again.
    ///
    /// # Errors
    /// A Vulkan call failed; after the loss of the device the error names the last pass recorded.
    pub fn run<T>(self: &Arc<Self>, record: impl Fn(&mut Recorder) -> T) -> Result<(T, Vec<PassTiming>)> {
        let mut recorder = Recorder::begin(self)?;
        let mut value = record(&mut recorder);
        let missing = recorder.take_missing()?;
        if !missing.is_empty() {
            drop(recorder);
            self.pipelines.make(self, &missing)?;
            recorder = Recorder::begin(self)?;
            value = record(&mut recorder);
        }
        let (timings, redundant) = recorder.submit_and_wait()?;
        self.redundant_barriers.lock().expect("no holder panics").extend(redundant);
        Ok((value, timings))
    }

    /// How many pipelines the driver has compiled for this context.
    pub fn pipelines_made(&self) -> u32 {
        self.pipelines.made()
    }

    /// Time on the clock that compiling these pipelines took.
    pub fn compile_time(&self) -> Duration {
        self.pipelines.compile_time()
    }

    /// What the driver tells of the pipelines made since the last call, in the order
    /// in which they were made; none where it tells nothing of pipelines, or was not
    /// to be asked ([`ContextOptions::statistics`]).
    pub fn pipeline_statistics(&self) -> Option<Vec<PipelineStatistics>> {
        self.optional.reports_executables().then(|| self.optional.take_statistics())
    }

    pub(super) fn take_submission(&self) -> Result<Submission> {
        let idle = self.submissions.lock().expect("no holder panics").pop();
        idle.map_or_else(|| Submission::new(self), Ok)
    }

    pub(super) fn give_back_submission(&self, submission: Submission) {
        self.submissions.lock().expect("no holder panics").push(submission);
    }

    #[cfg(feature = "window")]
    pub(super) fn instance(&self) -> &ash::Instance {
        &self.instance.raw
    }

    #[cfg(feature = "window")]
    pub(super) fn vulkan_instance(&self) -> &Arc<Instance> {
        &self.instance
    }

    #[cfg(feature = "window")]
    pub(super) fn physical_device(&self) -> vk::PhysicalDevice {
        self.physical_device
    }

    /// Waits until the device has nothing to do.
    #[cfg(feature = "window")]
    pub(super) fn wait_idle(&self) -> Result<()> {
        // SAFETY: the device is alive; whoever holds the queue waits for it.
        self.with_queue(|_| unsafe { self.device.device_wait_idle() }).vk("vkDeviceWaitIdle")
    }

    /// Calls `submit` with the queue, which takes one caller at a time.
    pub(super) fn with_queue<T>(&self, submit: impl FnOnce(vk::Queue) -> T) -> T {
        submit(*self.queue.lock().expect("no holder panics"))
    }

    /// Calls `work` with the allocator, which takes one caller at a time.
    pub(super) fn with_allocator<T>(&self, work: impl FnOnce(&mut Allocator) -> T) -> T {
        let mut allocator = self.allocator.lock().expect("no holder panics");
        work(allocator.as_mut().expect("the allocator lives as long as the context"))
    }

    /// Names an object for validation messages and debuggers.
    pub(super) fn set_name<H: vk::Handle>(&self, handle: H, name: &str) {
        self.names.set_name(handle, name);
    }
}

/// Names of Vulkan objects for validation messages and debuggers. `None`: there is nothing that
/// would show them.
pub(super) struct Names(pub(super) Option<ash::ext::debug_utils::Device>);

impl Names {
    pub(super) fn set_name<H: vk::Handle>(&self, handle: H, name: &str) {
        let Some(debug_utils) = &self.0 else { return };
        let name = CString::new(name).expect("names hold no NUL");
        let info = vk::DebugUtilsObjectNameInfoEXT::default().object_handle(handle).object_name(&name);
        // A debug name that cannot be set is no reason to stop.
        // SAFETY: the object is alive, and its name outlives the call.
        let _ = unsafe { debug_utils.set_debug_utils_object_name(&info) };
    }
}

impl Drop for Context {
    fn drop(&mut self) {
        // After a lost device this fails, and everything is to be destroyed all the same.
        // SAFETY: the device is alive; whoever holds the queue waits for it.
        let _ = unsafe { self.device.device_wait_idle() };
        for submission in self.submissions.get_mut().expect("no holder panics").drain(..) {
            submission.destroy(&self.device);
        }
        self.pipelines.destroy(&self.device);
        drop(self.allocator.get_mut().expect("no holder panics").take());
        // SAFETY: all that was made from the device is gone, and it does nothing any more.
        unsafe { self.device.destroy_device(None) };
    }
}

fn create_device(
    instance: &ash::Instance,
    handle: vk::PhysicalDevice,
    queue_family: u32,
    for_window: bool,
    offers: &Offers,
) -> Result<ash::Device> {
    let queues =
        [vk::DeviceQueueCreateInfo::default().queue_family_index(queue_family).queue_priorities(&[1.0])];
    let more: &[_] = if for_window { &device::WINDOW_EXTENSIONS } else { &[] };
    let names = device::EXTENSIONS.iter().chain(more).copied().chain(offers.extensions());
    let extensions: Vec<_> = names.map(CStr::as_ptr).collect();
    let mut executables = offers.feature();
    let mut rendering = vk::PhysicalDeviceDynamicRenderingFeatures::default().dynamic_rendering(true);
    let mut vulkan12 = vk::PhysicalDeviceVulkan12Features::default()
        .scalar_block_layout(true)
        .host_query_reset(true)
        .buffer_device_address(true);
    let mut sync2 = vk::PhysicalDeviceSynchronization2Features::default().synchronization2(true);
    let mut info = vk::DeviceCreateInfo::default()
        .queue_create_infos(&queues)
        .enabled_extension_names(&extensions)
        .push_next(&mut vulkan12)
        .push_next(&mut sync2);
    if for_window {
        info = info.push_next(&mut rendering);
    }
    if offers.reports_executables() {
        info = info.push_next(&mut executables);
    }
    // SAFETY: the device offers what is asked for, and all lists outlive the call.
    unsafe { instance.create_device(handle, &info, None) }.vk("vkCreateDevice")
}
