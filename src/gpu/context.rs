//! The device, as the other modules use it.

use std::ffi::CStr;
use std::path::Path;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use ash::vk;
use gpu_allocator::vulkan::{Allocator, AllocatorCreateDesc};
use gpu_allocator::{AllocationSizes, AllocatorDebugSettings};

use super::VkResultExt;
use super::command_counts::CommandCounts;
use super::device::{self, CPU, DeviceSummary, Limits, Shows};
use super::instance::Instance;
use super::names::Names;
use super::optional::{Offers, Optional, PipelineStatistics};
use super::pipeline_store::PipelineStore;
use super::pipelines::Pipelines;
use super::quirks;
use super::submission::Submission;
use super::timeline::Timeline;
use super::tuning::{Tuned, Tuning, TuningChange};
use super::tuning_store;
use crate::error::{Error, Result};

/// Sizes of the first and of later memory blocks, bytes.
const BLOCK_BYTES: [u64; 2] = [16 << 20, 128 << 20];

/// Options for opening a device.
#[derive(Clone, Debug)]
pub struct ContextOptions {
    /// An index in the list of `lightpaths info`, or part of a name in any case. `None`:
    /// the best device.
    pub device: Option<String>,
    /// Enables the validation layer with its synchronisation checks; it must be installed.
    pub validation: bool,
    /// Panics if two passes use a buffer and no barrier between them orders it.
    pub hazard_check: bool,
    /// Queries the driver's statistics of pipelines, if there
    /// are any: [`Context::pipeline_statistics`].
    pub statistics: bool,
    /// Applies what `lightpaths tune` has stored for the device. Off, so that results do not
    /// depend on the user's folder; the command line turns it on.
    pub stored_tuning: bool,
    /// Replaces values of the tuning, also stored ones.
    pub tuning: Vec<TuningChange>,
}

#[allow(clippy::derivable_impls, reason = "derivable only where debug assertions are off")]
impl Default for ContextOptions {
    fn default() -> Self {
        Self {
            device: None,
            validation: false,
            hazard_check: cfg!(debug_assertions),
            statistics: false,
            stored_tuning: false,
            tuning: Vec::new(),
        }
    }
}

/// Bytes of all live [`Buffer`](super::Buffer)s of a context, as requested: rounding by the
/// allocator does not count.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct MemoryUse {
    /// Storage on the device, now.
    pub current_bytes: u64,
    /// Storage on the device, at most.
    pub peak_bytes: u64,
    /// Host memory of staging buffers, at most.
    pub peak_staging_bytes: u64,
    /// The largest buffer ever created on the device, which is the largest binding.
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
    /// `None` only during drop.
    allocator: Mutex<Option<Allocator>>,
    /// Finished submissions, for reuse.
    submissions: Mutex<Vec<Submission>>,
    pub(super) redundant_barriers: Mutex<Vec<String>>,
    command_counts: Mutex<CommandCounts>,
    summary: DeviceSummary,
    tuned: Tuned,
    #[cfg(feature = "window")]
    physical_device: vk::PhysicalDevice,
    instance: Arc<Instance>,
}

impl Context {
    /// Opens the requested device, or else the best: discrete before integrated before
    /// virtual before CPU.
    ///
    /// # Errors
    /// [`Error::NoDevice`] with the devices found, the reasons against each, and the
    /// driver to install.
    pub fn new(options: &ContextOptions) -> Result<Arc<Self>> {
        Self::open(Arc::new(Instance::new(options.validation, &[])?), options, None)
    }

    pub(super) fn open(
        instance: Arc<Instance>,
        options: &ContextOptions,
        shows: Option<Shows<'_>>,
    ) -> Result<Arc<Self>> {
        let mut candidates = device::candidates(&instance, shows)?;
        let summaries: Vec<_> = candidates.iter().map(|candidate| &candidate.summary).collect();
        let chosen = device::choose(&summaries, options.device.as_deref())?;
        let device::Candidate { handle, summary, queue_family } = candidates.swap_remove(chosen);
        let tuned = summary.tuning(options.stored_tuning, &options.tuning)?;

        let offers = Offers::from_device(&instance, handle, options.statistics)?;
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
            command_counts: Mutex::default(),
            tuned,
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

    /// Every device of this machine, with the reason if it cannot be used.
    ///
    /// # Errors
    /// [`Error::NoDevice`] if there is no loader or no driver.
    #[doc(hidden)]
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

    /// Whether the device is the CPU; its timings do not predict those of a GPU.
    pub fn is_cpu(&self) -> bool {
        self.summary.kind == CPU
    }

    /// The limits of the device.
    #[doc(hidden)]
    pub fn limits(&self) -> &Limits {
        &self.summary.limits
    }

    /// Tuning values in force.
    #[doc(hidden)]
    pub fn tuning(&self) -> &Tuning {
        &self.tuned.tuning
    }

    /// The tuning with the source of each value.
    #[doc(hidden)]
    pub fn tuned(&self) -> &Tuned {
        &self.tuned
    }

    /// The file with the device's stored tuning, which may not exist.
    ///
    /// # Errors
    /// [`Error::Usage`] if nothing can be stored.
    #[doc(hidden)]
    pub fn tuning_path(&self) -> Result<&Path> {
        tuning_store::path(&self.summary)
    }

    /// Stores changes of the class's values for this device and driver, in place of those before.
    /// Without any, deletes the file.
    ///
    /// # Errors
    /// [`Error::Output`]; [`Error::Usage`] if nothing can be stored.
    #[doc(hidden)]
    pub fn store_tuning(&self, changes: &[TuningChange]) -> Result<&Path> {
        tuning_store::write(&self.summary, changes)
    }

    /// Whether timestamps wait for a barrier first.
    pub(super) fn delays_timestamps(&self) -> bool {
        quirks::delays_timestamps(self.has_window, self.is_cpu())
    }

    /// Memory in use by buffers, and its peak.
    #[doc(hidden)]
    pub fn memory(&self) -> MemoryUse {
        *self.memory.lock().expect("no holder panics")
    }

    /// Resets the peaks of [`Self::memory`] to the current use.
    #[doc(hidden)]
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

    /// Redundant barriers in the recordings since the last call, as text: they ordered no two
    /// conflicting uses. Empty when the hazard check is off.
    #[doc(hidden)]
    pub fn take_redundant_barriers(&self) -> Vec<String> {
        std::mem::take(&mut self.redundant_barriers.lock().expect("no holder panics"))
    }

    /// Counts of submitted commands and of read-backs so far.
    #[doc(hidden)]
    pub fn command_counts(&self) -> CommandCounts {
        *self.command_counts.lock().expect("no holder panics")
    }

    /// Number of submissions so far.
    #[doc(hidden)]
    pub fn submission_count(&self) -> u64 {
        self.command_counts().submissions
    }

    /// Bytes that the host has read back from buffers so far.
    #[doc(hidden)]
    pub fn read_back_bytes(&self) -> u64 {
        self.command_counts().read_back_bytes
    }

    /// Calls `count` with the counts, which one caller changes at a time.
    pub(super) fn count_commands(&self, count: impl FnOnce(&mut CommandCounts)) {
        count(&mut self.command_counts.lock().expect("no holder panics"));
    }

    /// Number of pipelines that the driver has compiled for this context.
    #[doc(hidden)]
    pub fn pipelines_made(&self) -> u32 {
        self.pipelines.made()
    }

    /// Wall-clock time of compiling these pipelines.
    #[doc(hidden)]
    pub fn compile_time(&self) -> Duration {
        self.pipelines.compile_time()
    }

    /// The driver's statistics of pipelines created since the last call, in order of creation.
    /// `None` if the driver has no statistics, or if [`ContextOptions::statistics`] is off.
    #[doc(hidden)]
    pub fn pipeline_statistics(&self) -> Option<Vec<PipelineStatistics>> {
        self.optional.reports_executables().then(|| self.optional.take_statistics())
    }

    pub(super) fn take_submission(&self) -> Result<Submission> {
        let idle = self.submissions.lock().expect("no holder panics").pop();
        idle.map_or_else(|| Submission::new(&self.device, &self.names, self.queue_family), Ok)
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

    /// Waits until the device is idle.
    #[cfg(feature = "window")]
    pub(super) fn wait_idle(&self) -> Result<()> {
        // SAFETY: the device is alive; whoever holds the queue waits for it.
        self.with_queue(|_| unsafe { self.device.device_wait_idle() }).vk("vkDeviceWaitIdle")
    }

    /// Calls `submit` with the queue, which one caller uses at a time.
    pub(super) fn with_queue<T>(&self, submit: impl FnOnce(vk::Queue) -> T) -> T {
        submit(*self.queue.lock().expect("no holder panics"))
    }

    /// Calls `work` with the allocator, which one caller uses at a time.
    pub(super) fn with_allocator<T>(&self, work: impl FnOnce(&mut Allocator) -> T) -> T {
        let mut allocator = self.allocator.lock().expect("no holder panics");
        work(allocator.as_mut().expect("the allocator lives as long as the context"))
    }

    /// Names an object for validation messages and debuggers.
    pub(super) fn set_name<H: vk::Handle>(&self, handle: H, name: &str) {
        self.names.set_name(handle, name);
    }
}

impl Drop for Context {
    fn drop(&mut self) {
        // This fails on a lost device; everything is destroyed nevertheless.
        // SAFETY: the device is alive; whoever holds the queue waits for it.
        let _ = unsafe { self.device.device_wait_idle() };
        for submission in self.submissions.get_mut().expect("no holder panics").drain(..) {
            submission.destroy(&self.device);
        }
        self.pipelines.destroy(&self.device);
        drop(self.allocator.get_mut().expect("no holder panics").take());
        // SAFETY: every object that was created from the device is destroyed, and the
        // device is idle.
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
