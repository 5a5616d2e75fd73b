//! Finds functions of the layers below and of the driver.

use std::collections::HashMap;
use std::ffi::{CStr, CString, c_char};
use std::sync::{LazyLock, Mutex};

use ash::vk;
use ash::vk::Handle;

use crate::{Any, faults};

/// The way to find functions of an instance or device below this layer.
#[derive(Clone, Copy)]
enum Next {
    Instance(vk::PFN_vkGetInstanceProcAddr, vk::Instance),
    Device(vk::PFN_vkGetDeviceProcAddr, vk::Device),
}

/// By the loader's pointer in each object of an instance or device.
static NEXT: LazyLock<Mutex<HashMap<usize, Next>>> = LazyLock::new(Mutex::default);

/// Functions of instances that must be queried during the creation of the instance: later, the
/// loader's end of the chain returns its top.
const EARLY: [&CStr; 6] = [
    c"vkDestroyInstance",
    c"vkEnumerateDeviceExtensionProperties",
    c"vkEnumeratePhysicalDevices",
    c"vkCreateDebugUtilsMessengerEXT",
    c"vkGetPhysicalDeviceCalibrateableTimeDomainsEXT",
    c"vkGetPhysicalDeviceProperties2",
];

/// Functions that were found.
static FOUND: LazyLock<Mutex<HashMap<(usize, &CStr), vk::PFN_vkVoidFunction>>> =
    LazyLock::new(Mutex::default);

/// The loader's data for a layer that creates an instance or a
/// device (`VkLayerInstanceCreateInfo`, `VkLayerDeviceCreateInfo`).
#[repr(C)]
struct Link {
    kind: vk::StructureType,
    next: *mut Self,
    /// 0: `below` is valid.
    function: i32,
    below: *mut Below,
}

/// The layer below, and the way to find its functions.
#[repr(C)]
struct Below {
    next: *mut Self,
    get_instance_proc_addr: vk::PFN_vkGetInstanceProcAddr,
    /// For a device. When an instance is created: for physical devices, which is not used.
    get_device_proc_addr: Option<vk::PFN_vkGetDeviceProcAddr>,
}

/// A function of the layer below. `None` if there is none.
pub(crate) unsafe fn next<H: Handle + Copy>(handle: H, name: &str) -> vk::PFN_vkVoidFunction {
    let name = CString::new(name.trim_end_matches('\0')).expect("names have no NUL");
    // SAFETY: the caller's handle, which the loader has made.
    let key = unsafe { key(handle) };
    if let Some(found) = FOUND.lock().expect("no holder panics").get(&(key, &*name)) {
        return *found;
    }
    let next = NEXT.lock().expect("no holder panics").get(&key).copied();
    match next.expect("handles belong to what was made") {
        // SAFETY: the layer below has given us this function for this instance.
        Next::Instance(find, instance) => unsafe { find(instance, name.as_ptr()) },
        // SAFETY: the same for a device.
        Next::Device(find, device) => unsafe { find(device, name.as_ptr()) },
    }
}

/// The same for an instance, or without one.
pub(crate) unsafe fn next_of_instance(instance: vk::Instance, name: *const c_char) -> vk::PFN_vkVoidFunction {
    if instance.is_null() {
        return None;
    }
    // SAFETY: the caller's handle, which the loader has made.
    let next = NEXT.lock().expect("no holder panics").get(&unsafe { key(instance) }).copied();
    match next {
        // SAFETY: the layer below has given us this function for this instance.
        Some(Next::Instance(find, instance)) => unsafe { find(instance, name) },
        _ => None,
    }
}

unsafe fn key<H: Handle + Copy>(handle: H) -> usize {
    // SAFETY: a dispatchable handle points at what the loader wrote first.
    unsafe { *(handle.as_raw() as *const usize) }
}

/// The loader's data for this layer in the chain of a structure; the layer below reads the next.
unsafe fn below(info: Any, kind: vk::StructureType) -> &'static Below {
    // SAFETY: the loader puts such a word into the chain.
    unsafe {
        let mut link = (*info.cast::<Link>()).next;
        while !((*link).kind == kind && (*link).function == 0) {
            link = (*link).next;
        }
        let below = &*(*link).below;
        (*link).below = below.next;
        below
    }
}

pub(crate) unsafe extern "system" fn create_instance(
    info: Any,
    allocator: Any,
    made: *mut vk::Instance,
) -> vk::Result {
    if let Some(result) = faults::due("vkCreateInstance") {
        return result;
    }
    // SAFETY: the loader's own parameters, handed on to a function of that name.
    unsafe {
        let find = below(info, vk::StructureType::LOADER_INSTANCE_CREATE_INFO).get_instance_proc_addr;
        let create = find(vk::Instance::null(), c"vkCreateInstance".as_ptr());
        let create = std::mem::transmute::<
            vk::PFN_vkVoidFunction,
            unsafe extern "system" fn(Any, Any, *mut vk::Instance) -> vk::Result,
        >(create);
        let result = create(info, allocator, made);
        if result == vk::Result::SUCCESS {
            let key = key(*made);
            NEXT.lock().expect("no holder panics").insert(key, Next::Instance(find, *made));
            let found = EARLY.map(|name| ((key, name), find(*made, name.as_ptr())));
            FOUND.lock().expect("no holder panics").extend(found);
        }
        result
    }
}

pub(crate) unsafe extern "system" fn create_device(
    physical: vk::PhysicalDevice,
    info: Any,
    allocator: Any,
    made: *mut vk::Device,
) -> vk::Result {
    if let Some(result) = faults::due("vkCreateDevice") {
        return result;
    }
    // SAFETY: the loader's own parameters, handed on to a function of that name.
    unsafe {
        let find = below(info, vk::StructureType::LOADER_DEVICE_CREATE_INFO)
            .get_device_proc_addr
            .expect("the loader says how");
        let create = std::mem::transmute::<
            vk::PFN_vkVoidFunction,
            unsafe extern "system" fn(vk::PhysicalDevice, Any, Any, *mut vk::Device) -> vk::Result,
        >(next(physical, "vkCreateDevice"));
        let result = create(physical, info, allocator, made);
        if result == vk::Result::SUCCESS {
            NEXT.lock().expect("no holder panics").insert(key(*made), Next::Device(find, *made));
        }
        result
    }
}

pub(crate) unsafe extern "system" fn destroy_instance(instance: vk::Instance, allocator: Any) {
    // SAFETY: as above.
    unsafe {
        let destroy = next(instance, "vkDestroyInstance");
        let destroy = std::mem::transmute::<
            vk::PFN_vkVoidFunction,
            unsafe extern "system" fn(vk::Instance, Any),
        >(destroy);
        destroy(instance, allocator);
    }
    faults::write_calls();
}
