//! Simulates other devices. `vkEnumeratePhysicalDevices:1+:TWO` lists each twice, `NONE` lists
//! none. `vkGetPhysicalDeviceProperties2:2:deviceName=B;maxPushConstantsSize=128` changes the
//! properties in the second call. A function with a result can also fail like the others.

use std::ffi::c_char;

use ash::vk;

use crate::{chain, faults};

type Enumerate = unsafe extern "system" fn(vk::Instance, *mut u32, *mut vk::PhysicalDevice) -> vk::Result;
type Properties = unsafe extern "system" fn(vk::PhysicalDevice, *mut vk::PhysicalDeviceProperties2<'_>);

pub(crate) unsafe extern "system" fn enumerate(
    instance: vk::Instance,
    count: *mut u32,
    devices: *mut vk::PhysicalDevice,
) -> vk::Result {
    const NAME: &str = "vkEnumeratePhysicalDevices";
    let asked = faults::asked(NAME);
    // SAFETY: parameters are the caller's, and the name that of a function that takes them.
    let next =
        unsafe { std::mem::transmute::<vk::PFN_vkVoidFunction, Enumerate>(chain::next(instance, NAME)) };
    let times = match asked.as_deref() {
        // SAFETY: the caller's own parameters.
        None => return unsafe { next(instance, count, devices) },
        Some("NONE") => 0,
        Some("TWO") => 2,
        Some(code) => return faults::code(code),
    };
    let mut all = [vk::PhysicalDevice::null(); 16];
    let mut known = all.len() as u32;
    // SAFETY: there is room for as many as are said to be known.
    let result = unsafe { next(instance, &raw mut known, all.as_mut_ptr()) };
    if result != vk::Result::SUCCESS {
        return result;
    }
    let listed = all[..known as usize].repeat(times);
    // SAFETY: the caller gives a number, and room for as many devices if any.
    unsafe {
        if devices.is_null() {
            *count = listed.len() as u32;
            return vk::Result::SUCCESS;
        }
        let room = (*count as usize).min(listed.len());
        std::ptr::copy_nonoverlapping(listed.as_ptr(), devices, room);
        *count = room as u32;
        if room < listed.len() { vk::Result::INCOMPLETE } else { vk::Result::SUCCESS }
    }
}

pub(crate) unsafe extern "system" fn properties(
    device: vk::PhysicalDevice,
    properties: *mut vk::PhysicalDeviceProperties2<'_>,
) {
    const NAME: &str = "vkGetPhysicalDeviceProperties2";
    let asked = faults::asked(NAME);
    // SAFETY: as above.
    unsafe {
        let next = chain::next(device, NAME);
        std::mem::transmute::<vk::PFN_vkVoidFunction, Properties>(next)(device, properties);
        for change in asked.iter().flat_map(|changes| changes.split(';')) {
            let (name, value) =
                change.split_once('=').unwrap_or_else(|| panic!("faults: not NAME=VALUE: {change}"));
            set(&mut *properties, name, value);
        }
    }
}

/// Sets one of the properties.
unsafe fn set(properties: &mut vk::PhysicalDeviceProperties2<'_>, name: &str, value: &str) {
    let number = || value.parse::<u32>().unwrap_or_else(|_| panic!("faults: no number: {value}"));
    let limits = &mut properties.properties.limits;
    match name {
        "apiVersion" => properties.properties.api_version = vk::make_api_version(0, 1, number(), 0),
        "deviceName" => {
            let name = &mut properties.properties.device_name;
            name.fill(0);
            name.iter_mut().zip(value.bytes()).for_each(|(to, byte)| *to = byte as c_char);
        }
        "deviceType" => properties.properties.device_type = vk::PhysicalDeviceType::from_raw(number() as i32),
        "maxComputeSharedMemorySize" => limits.max_compute_shared_memory_size = number(),
        "maxComputeWorkGroupCount" => limits.max_compute_work_group_count = [number(); 3],
        "maxComputeWorkGroupInvocations" => limits.max_compute_work_group_invocations = number(),
        "maxComputeWorkGroupSize" => limits.max_compute_work_group_size[0] = number(),
        "maxPerStageDescriptorStorageBuffers" => limits.max_per_stage_descriptor_storage_buffers = number(),
        "maxPerStageResources" => limits.max_per_stage_resources = number(),
        "maxPushConstantsSize" => limits.max_push_constants_size = number(),
        "maxPushDescriptors" => {
            let mut next = properties.p_next.cast::<vk::BaseOutStructure<'_>>();
            // SAFETY: the caller's chain, which ends in null; the kind says what a link is.
            unsafe {
                while !next.is_null() {
                    if (*next).s_type == vk::StructureType::PHYSICAL_DEVICE_PUSH_DESCRIPTOR_PROPERTIES_KHR {
                        let push = next.cast::<vk::PhysicalDevicePushDescriptorPropertiesKHR<'_>>();
                        (*push).max_push_descriptors = number();
                    }
                    next = (*next).p_next;
                }
            }
        }
        "maxTexelBufferElements" => limits.max_texel_buffer_elements = number(),
        "maxStorageBufferRange" => limits.max_storage_buffer_range = number(),
        _ => panic!("faults: no such property: {name}"),
    }
}
