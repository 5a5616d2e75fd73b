//! Selects a device: abilities of each, reasons against it, and the best one.

use std::path::PathBuf;

use ash::vk;

use super::VkResultExt;
use super::device_files;
use super::instance::Instance;
use super::quirks::MAX_UNUSED_BYTES;
use crate::error::{Error, Result};

/// Bytes of a texel: four words.
const TEXEL_BYTES: u64 = 16;

/// The limits of a device that passes and buffers depend on.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct Limits {
    /// Largest buffer that can be bound, as storage and as texels of four words, in bytes.
    pub storage_range_bytes: u64,
    /// The largest heap of device-local memory, in bytes.
    pub device_memory_bytes: u64,
    /// Push constants, in bytes.
    pub push_bytes: u32,
    /// Buffers bound at once.
    pub storage_buffers: u32,
    /// Shared memory of a workgroup, in bytes.
    pub shared_bytes: u32,
    /// Invocations of a workgroup along each axis.
    pub workgroup_size: [u32; 3],
    /// Invocations of a workgroup in all.
    pub workgroup_invocations: u32,
    /// Invocations that run in lockstep.
    pub subgroup_size: u32,
    /// Workgroups of a dispatch along each axis.
    pub workgroup_count: [u32; 3],
    /// Nanoseconds for each timestamp tick.
    pub timestamp_period_ns: f32,
    /// Valid bits of a timestamp. Zero: the device has no timestamps, and is refused.
    pub timestamp_bits: u32,
}

/// Description of one device for the user.
#[derive(Clone, Debug)]
pub struct DeviceSummary {
    /// Index in the list of devices, as `--device` takes it.
    pub index: usize,
    /// The driver's name for the device.
    pub name: String,
    /// "discrete GPU", "integrated GPU", "virtual GPU", "CPU" or "other".
    pub kind: &'static str,
    /// Driver name and version.
    pub driver: String,
    /// Limits of the device.
    pub limits: Limits,
    /// The reason why the device cannot be used, if there is one.
    pub unmet: Option<String>,
    /// The file of `lightpaths tune`. `None`: nothing is stored.
    pub(super) tuning_path: Option<PathBuf>,
}

/// A device that could be opened.
pub(super) struct Candidate {
    pub(super) handle: vk::PhysicalDevice,
    pub(super) summary: DeviceSummary,
    pub(super) queue_family: u32,
}

/// Kinds of devices, the best first.
const KINDS: [(vk::PhysicalDeviceType, &str); 4] = [
    (vk::PhysicalDeviceType::DISCRETE_GPU, "discrete GPU"),
    (vk::PhysicalDeviceType::INTEGRATED_GPU, "integrated GPU"),
    (vk::PhysicalDeviceType::VIRTUAL_GPU, "virtual GPU"),
    (vk::PhysicalDeviceType::CPU, CPU),
];
pub(super) const CPU: &str = "CPU";

/// Every device of the machine, usable or not.
///
/// `shows`: whether queues of a family of a device can present to the window, if there is one.
pub(super) fn candidates(instance: &Instance, shows: Option<Shows<'_>>) -> Result<Vec<Candidate>> {
    // SAFETY: the queried objects are alive, and the result has the structures that it needs.
    let handles = match unsafe { instance.raw.enumerate_physical_devices() } {
        // The loader returns this if drivers are installed and none finds a device.
        Err(vk::Result::ERROR_INITIALIZATION_FAILED) => Vec::new(),
        other => other.vk("vkEnumeratePhysicalDevices")?,
    };
    handles.into_iter().enumerate().map(|(index, handle)| examine(instance, index, handle, shows)).collect()
}

fn examine(
    instance: &Instance,
    index: usize,
    handle: vk::PhysicalDevice,
    shows: Option<Shows<'_>>,
) -> Result<Candidate> {
    let mut driver = vk::PhysicalDeviceDriverProperties::default();
    let mut push = vk::PhysicalDevicePushDescriptorPropertiesKHR::default();
    let mut subgroup = vk::PhysicalDeviceSubgroupProperties::default();
    let mut properties = vk::PhysicalDeviceProperties2::default()
        .push_next(&mut driver)
        .push_next(&mut push)
        .push_next(&mut subgroup);
    // SAFETY: the queried objects are alive, and the result has the structures that it needs.
    unsafe { instance.raw.get_physical_device_properties2(handle, &mut properties) };
    let properties = properties.properties;
    // SAFETY: the queried objects are alive, and the result has the structures that it needs.
    let memory = unsafe { instance.raw.get_physical_device_memory_properties(handle) };
    // SAFETY: the queried objects are alive, and the result has the structures that it needs.
    let families = unsafe { instance.raw.get_physical_device_queue_family_properties(handle) };
    let computes = |(_, family): &(u32, &vk::QueueFamilyProperties)| {
        family.queue_flags.contains(vk::QueueFlags::COMPUTE)
    };
    let mut family = (0_u32..).zip(&families).find(computes);
    let mut shows_window = true;
    if let Some(shows) = shows {
        let mut drawing = None;
        for (index, properties) in (0_u32..).zip(&families).filter(computes) {
            let draws = properties.queue_flags.contains(vk::QueueFlags::GRAPHICS);
            if drawing.is_none() && draws && shows(handle, index)? {
                drawing = Some((index, properties));
            }
        }
        shows_window = drawing.is_some();
        family = drawing.or(family);
    }

    let heaps = memory.memory_heaps_as_slice().iter();
    let local = heaps.filter(|heap| heap.flags.contains(vk::MemoryHeapFlags::DEVICE_LOCAL));
    let texel_bytes = TEXEL_BYTES * u64::from(properties.limits.max_texel_buffer_elements) - MAX_UNUSED_BYTES;
    let limits = Limits {
        storage_range_bytes: texel_bytes.min(properties.limits.max_storage_buffer_range.into()),
        device_memory_bytes: local.map(|heap| heap.size).max().unwrap_or(0),
        push_bytes: properties.limits.max_push_constants_size,
        storage_buffers: push
            .max_push_descriptors
            .min(properties.limits.max_per_stage_descriptor_storage_buffers),
        shared_bytes: properties.limits.max_compute_shared_memory_size,
        workgroup_size: properties.limits.max_compute_work_group_size,
        workgroup_invocations: properties.limits.max_compute_work_group_invocations,
        subgroup_size: subgroup.subgroup_size,
        workgroup_count: properties.limits.max_compute_work_group_count,
        timestamp_period_ns: properties.limits.timestamp_period,
        timestamp_bits: family.map_or(0, |(_, family)| family.timestamp_valid_bits),
    };
    let text = |name: std::result::Result<&std::ffi::CStr, _>| {
        name.map_or_else(|_| String::from("?"), |name| name.to_string_lossy().into_owned())
    };
    let summary = DeviceSummary {
        index,
        name: text(properties.device_name_as_c_str()),
        kind: KINDS
            .iter()
            .find(|(kind, _)| *kind == properties.device_type)
            .map_or("other", |(_, name)| name),
        driver: format!("{} {}", text(driver.driver_name_as_c_str()), text(driver.driver_info_as_c_str())),
        limits,
        unmet: unmet(instance, handle, properties.api_version, &limits, shows.map(|_| shows_window))?,
        tuning_path: device_files::TUNING.path(&properties),
    };
    Ok(Candidate { handle, summary, queue_family: family.map_or(0, |(index, _)| index) })
}

/// Whether queues of a family of a device can present to the window.
pub(super) type Shows<'a> = &'a dyn Fn(vk::PhysicalDevice, u32) -> Result<bool>;

/// Further device extensions that a window needs.
pub(super) const WINDOW_EXTENSIONS: [&std::ffi::CStr; 2] =
    [ash::khr::swapchain::NAME, ash::khr::dynamic_rendering::NAME];

/// Device extensions that are always needed.
pub(super) const EXTENSIONS: [&std::ffi::CStr; 2] =
    [ash::khr::synchronization2::NAME, ash::khr::push_descriptor::NAME];

/// The first limit that is too low for the shaders, as text. `None` if all are met. Only
/// limits whose minimum in Vulkan is too low are tested; `tests/failures` compares the needs
/// with the binaries.
fn too_low(limits: &Limits) -> Option<String> {
    let rows = [
        ("maxPerStageDescriptorStorageBuffers (or maxPushDescriptors)", limits.storage_buffers, 21),
        ("maxComputeWorkGroupInvocations", limits.workgroup_invocations, 256),
        ("maxComputeWorkGroupSize[0]", limits.workgroup_size[0], 256),
    ];
    let low = rows.iter().filter(|(_, has, needs)| has < needs);
    let words: Vec<_> =
        low.map(|(name, has, needs)| format!("{name} is {has} and must be {needs}")).collect();
    (!words.is_empty())
        .then(|| format!("its {}: no setting needs less, use another device", words.join(", its ")))
}

/// The first requirement that a device does not meet, if there is one.
fn unmet(
    instance: &Instance,
    handle: vk::PhysicalDevice,
    api_version: u32,
    limits: &Limits,
    shows_window: Option<bool>,
) -> Result<Option<String>> {
    if api_version < vk::API_VERSION_1_2 {
        let (major, minor) = (vk::api_version_major(api_version), vk::api_version_minor(api_version));
        return Ok(Some(format!(
            "its driver speaks Vulkan {major}.{minor}, 1.2 is needed: update the driver"
        )));
    }
    // SAFETY: the queried objects are alive, and the result has the structures that it needs.
    let extensions = unsafe { instance.raw.enumerate_device_extension_properties(handle) }
        .vk("vkEnumerateDeviceExtensionProperties")?;
    let for_window: &[_] = if shows_window.is_some() { &WINDOW_EXTENSIONS } else { &[] };
    let mut missing: Vec<String> = EXTENSIONS
        .iter()
        .chain(for_window)
        .filter(|name| !extensions.iter().any(|extension| extension.extension_name_as_c_str() == Ok(**name)))
        .map(|name| name.to_string_lossy().into_owned())
        .collect();

    let mut vulkan12 = vk::PhysicalDeviceVulkan12Features::default();
    let mut sync2 = vk::PhysicalDeviceSynchronization2Features::default();
    let mut features = vk::PhysicalDeviceFeatures2::default().push_next(&mut vulkan12).push_next(&mut sync2);
    // SAFETY: the queried objects are alive, and the result has the structures that it needs.
    unsafe { instance.raw.get_physical_device_features2(handle, &mut features) };
    let needs = [
        ("scalarBlockLayout", vulkan12.scalar_block_layout == vk::TRUE),
        ("bufferDeviceAddress", vulkan12.buffer_device_address == vk::TRUE),
        ("hostQueryReset", vulkan12.host_query_reset == vk::TRUE),
        ("synchronization2", sync2.synchronization2 == vk::TRUE),
        ("a compute queue with timestamps", limits.timestamp_bits > 0),
        ("a queue that can show pictures in this window", shows_window != Some(false)),
    ];
    missing.extend(needs.iter().filter(|(_, has)| !has).map(|(name, _)| (*name).to_owned()));
    let lacks = (!missing.is_empty()).then(|| format!("it lacks {}: update the driver", missing.join(", ")));
    Ok(lacks.or_else(|| too_low(limits)))
}

/// The wanted device (an index, or part of a name in any case), or the best usable one. Returns its
/// index in the list.
pub(super) fn choose(summaries: &[&DeviceSummary], wanted: Option<&str>) -> Result<usize> {
    let list = || {
        let line = |s: &&DeviceSummary| {
            let state = s.unmet.as_ref().map_or_else(String::new, |why| format!(", refused: {why}"));
            format!("{}: {} ({}{state})", s.index, s.name, s.kind)
        };
        summaries.iter().map(line).collect::<Vec<_>>().join("; ")
    };
    if summaries.is_empty() {
        return Err(Error::no_device_found());
    }
    let matches = |s: &DeviceSummary| match wanted {
        None => true,
        Some(wanted) => match wanted.parse::<usize>() {
            Ok(index) => s.index == index,
            Err(_) => s.name.to_lowercase().contains(&wanted.to_lowercase()),
        },
    };
    let rank = |s: &DeviceSummary| KINDS.iter().position(|(_, kind)| *kind == s.kind).unwrap_or(KINDS.len());
    let usable = summaries.iter().enumerate().filter(|(_, s)| matches(s) && s.unmet.is_none());
    usable.min_by_key(|(_, s)| rank(s)).map(|(place, _)| place).ok_or_else(|| {
        Error::NoDevice(match wanted {
            Some(wanted) => format!("none that can be used matches `{wanted}`; found {}", list()),
            None => format!(
                "found {}; the package mesa-vulkan-drivers has one that renders on the processor",
                list()
            ),
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn summary(index: usize, name: &str, kind: &'static str, unmet: Option<&str>) -> DeviceSummary {
        let unmet = unmet.map(str::to_owned);
        DeviceSummary {
            index,
            name: name.into(),
            kind,
            driver: String::new(),
            limits: Limits::default(),
            unmet,
            tuning_path: None,
        }
    }

    #[test]
    fn the_best_usable_device_is_chosen_unless_one_is_named() {
        let all = [
            summary(0, "llvmpipe", CPU, None),
            summary(1, "Old Card", "discrete GPU", Some("it lacks hostQueryReset")),
            summary(2, "Card A", "discrete GPU", None),
            summary(3, "Card B", "discrete GPU", None),
        ];
        let all: Vec<_> = all.iter().collect();
        assert_eq!(choose(&all, None).unwrap(), 2);
        assert_eq!(choose(&all, Some("0")).unwrap(), 0);
        assert_eq!(choose(&all, Some("card b")).unwrap(), 3);
        assert_eq!(choose(&all[..2], None).unwrap(), 0);
    }

    #[test]
    fn an_unusable_device_says_what_was_found_and_why() {
        let old = summary(0, "Old Card", "discrete GPU", Some("it lacks hostQueryReset"));
        let message = choose(&[&old], Some("old")).unwrap_err().to_string();
        assert!(
            message.contains("`old`")
                && message.contains("0: Old Card (discrete GPU, refused: it lacks host")
        );
        let message = choose(&[], None).unwrap_err().to_string();
        assert!(message.contains("mesa-vulkan-drivers"), "{message}");
    }
}
