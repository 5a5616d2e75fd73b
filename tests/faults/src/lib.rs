//! A Vulkan layer that makes calls fail. The driver does not receive these calls, so they
//! have no effect.
//!
//! `LIGHTPATHS_FAULTS` lists the faults, separated by commas.
//! `vkAcquireNextImageKHR:5:VK_ERROR_SURFACE_LOST_KHR` makes the fifth call fail,
//! `vkAllocateMemory:3+:VK_ERROR_OUT_OF_DEVICE_MEMORY` the third and all later ones. With `@FILE`,
//! a file holds the list, and calls count from its last change. Each fault is printed on stderr.
//! The layer can also change surface formats (`formats.rs`), devices (`devices.rs`) and the
//! available memory (`memory.rs`).
//!
//! `LIGHTPATHS_CALLS` names a file. When the instance is destroyed, the layer writes the number of
//! calls of each function there.

mod chain;
mod devices;
mod faults;
mod formats;
mod memory;

use std::ffi::{CStr, c_char, c_void};

use ash::vk;

/// A pointer that is passed on unchanged.
type Any = *mut c_void;

/// Declares functions that return a `VkResult` and can fail, and finds them by name. Their first
/// parameter is dispatchable.
macro_rules! can_fail {
    ($($name:ident($handle:ident: $of:ty $(, $parameter:ident: $kind:ty)*);)*) => {
        $(
            /// As in Vulkan.
            #[allow(non_snake_case, reason = "the name is Vulkan's")]
            unsafe extern "system" fn $name($handle: $of $(, $parameter: $kind)*) -> vk::Result {
                if let Some(result) = faults::due(stringify!($name)) {
                    return result;
                }
                type Function = unsafe extern "system" fn($of $(, $kind)*) -> vk::Result;
                // SAFETY: the name is that of a function with these parameters.
                unsafe {
                    let next = chain::next($handle, concat!(stringify!($name), "\0"));
                    std::mem::transmute::<vk::PFN_vkVoidFunction, Function>(next)($handle $(, $parameter)*)
                }
            }
        )*

        /// The function with this name, if it can fail.
        fn wrapped(name: &CStr) -> vk::PFN_vkVoidFunction {
            $(
                if name.to_bytes() == stringify!($name).as_bytes() {
                    // SAFETY: whoever asks for it by name knows its type.
                    return unsafe { std::mem::transmute::<*const (), vk::PFN_vkVoidFunction>($name as *const ()) };
                }
            )*
            None
        }
    };
}

can_fail! {
    vkAcquireNextImageKHR(device: vk::Device, swapchain: vk::SwapchainKHR, timeout: u64, semaphore: vk::Semaphore, fence: vk::Fence, index: Any);
    vkAllocateCommandBuffers(device: vk::Device, info: Any, buffers: Any);
    vkAllocateDescriptorSets(device: vk::Device, info: Any, sets: Any);
    vkBeginCommandBuffer(commands: vk::CommandBuffer, info: Any);
    vkBindBufferMemory(device: vk::Device, buffer: vk::Buffer, memory: vk::DeviceMemory, offset: u64);
    vkBindImageMemory(device: vk::Device, image: vk::Image, memory: vk::DeviceMemory, offset: u64);
    vkCreateBuffer(device: vk::Device, info: Any, allocator: Any, buffer: Any);
    vkCreateBufferView(device: vk::Device, info: Any, allocator: Any, view: Any);
    vkCreateCommandPool(device: vk::Device, info: Any, allocator: Any, pool: Any);
    vkCreateComputePipelines(device: vk::Device, cache: vk::PipelineCache, count: u32, infos: Any, allocator: Any, pipelines: Any);
    vkCreateDebugUtilsMessengerEXT(instance: vk::Instance, info: Any, allocator: Any, messenger: Any);
    vkCreateDescriptorPool(device: vk::Device, info: Any, allocator: Any, pool: Any);
    vkCreateDescriptorSetLayout(device: vk::Device, info: Any, allocator: Any, layout: Any);
    vkCreateFence(device: vk::Device, info: Any, allocator: Any, fence: Any);
    vkCreateGraphicsPipelines(device: vk::Device, cache: vk::PipelineCache, count: u32, infos: Any, allocator: Any, pipelines: Any);
    vkCreateImage(device: vk::Device, info: Any, allocator: Any, image: Any);
    vkCreateImageView(device: vk::Device, info: Any, allocator: Any, view: Any);
    vkCreatePipelineCache(device: vk::Device, info: Any, allocator: Any, cache: Any);
    vkCreatePipelineLayout(device: vk::Device, info: Any, allocator: Any, layout: Any);
    vkCreateQueryPool(device: vk::Device, info: Any, allocator: Any, pool: Any);
    vkCreateSampler(device: vk::Device, info: Any, allocator: Any, sampler: Any);
    vkCreateSemaphore(device: vk::Device, info: Any, allocator: Any, semaphore: Any);
    vkCreateShaderModule(device: vk::Device, info: Any, allocator: Any, module: Any);
    vkCreateSwapchainKHR(device: vk::Device, info: Any, allocator: Any, swapchain: Any);
    vkDeviceWaitIdle(device: vk::Device);
    vkEndCommandBuffer(commands: vk::CommandBuffer);
    vkEnumerateDeviceExtensionProperties(device: vk::PhysicalDevice, layer: Any, count: Any, extensions: Any);
    vkGetCalibratedTimestampsEXT(device: vk::Device, count: u32, infos: Any, ticks: Any, deviation: Any);
    vkGetPhysicalDeviceCalibrateableTimeDomainsEXT(device: vk::PhysicalDevice, count: Any, domains: Any);
    vkGetPhysicalDeviceSurfaceCapabilitiesKHR(device: vk::PhysicalDevice, surface: vk::SurfaceKHR, capabilities: Any);
    vkGetPhysicalDeviceSurfacePresentModesKHR(device: vk::PhysicalDevice, surface: vk::SurfaceKHR, count: Any, modes: Any);
    vkGetPhysicalDeviceSurfaceSupportKHR(device: vk::PhysicalDevice, family: u32, surface: vk::SurfaceKHR, is_supported: Any);
    vkGetPipelineCacheData(device: vk::Device, cache: vk::PipelineCache, size: Any, data: Any);
    vkGetPipelineExecutablePropertiesKHR(device: vk::Device, info: Any, count: Any, executables: Any);
    vkGetPipelineExecutableStatisticsKHR(device: vk::Device, info: Any, count: Any, statistics: Any);
    vkGetQueryPoolResults(device: vk::Device, pool: vk::QueryPool, first: u32, count: u32, size: usize, data: Any, stride: u64, flags: u32);
    vkGetSwapchainImagesKHR(device: vk::Device, swapchain: vk::SwapchainKHR, count: Any, images: Any);
    vkMapMemory(device: vk::Device, memory: vk::DeviceMemory, offset: u64, size: u64, flags: vk::MemoryMapFlags, data: Any);
    vkQueuePresentKHR(queue: vk::Queue, info: Any);
    vkQueueSubmit(queue: vk::Queue, count: u32, submits: Any, fence: vk::Fence);
    vkQueueSubmit2(queue: vk::Queue, count: u32, submits: Any, fence: vk::Fence);
    vkQueueSubmit2KHR(queue: vk::Queue, count: u32, submits: Any, fence: vk::Fence);
    vkResetCommandPool(device: vk::Device, pool: vk::CommandPool, flags: u32);
    vkResetFences(device: vk::Device, count: u32, fences: Any);
    vkSetDebugUtilsObjectNameEXT(device: vk::Device, info: Any);
    vkWaitForFences(device: vk::Device, count: u32, fences: Any, all: vk::Bool32, timeout: u64);
}

/// Declares functions that destroy an object of a device and are counted, and finds them by name.
macro_rules! destroys {
    ($($name:ident)*) => {
        $(
            /// As in Vulkan.
            #[allow(non_snake_case, reason = "the name is Vulkan's")]
            unsafe extern "system" fn $name(device: vk::Device, object: u64, allocator: Any) {
                if object != 0 {
                    faults::asked(stringify!($name));
                }
                type Function = unsafe extern "system" fn(vk::Device, u64, Any);
                // SAFETY: the name is that of a function with these parameters.
                unsafe {
                    let next = chain::next(device, concat!(stringify!($name), "\0"));
                    std::mem::transmute::<vk::PFN_vkVoidFunction, Function>(next)(device, object, allocator);
                }
            }
        )*

        /// The function with this name, if it destroys an object.
        fn destroying(name: &CStr) -> vk::PFN_vkVoidFunction {
            $(
                if name.to_bytes() == stringify!($name).as_bytes() {
                    // SAFETY: whoever asks for it by name knows its type.
                    return unsafe { std::mem::transmute::<*const (), vk::PFN_vkVoidFunction>($name as *const ()) };
                }
            )*
            None
        }
    };
}

destroys! {
    vkDestroyBuffer
    vkDestroyBufferView
    vkDestroyCommandPool
    vkDestroyDescriptorPool
    vkDestroyDescriptorSetLayout
    vkDestroyFence
    vkDestroyImage
    vkDestroyImageView
    vkDestroyPipeline
    vkDestroyPipelineCache
    vkDestroyPipelineLayout
    vkDestroyQueryPool
    vkDestroySampler
    vkDestroySemaphore
    vkDestroyShaderModule
    vkDestroySwapchainKHR
}

/// The structure that the loader fills in and reads (`VkNegotiateLayerInterface`).
#[repr(C)]
pub struct Negotiation {
    kind: i32,
    next: Any,
    version: u32,
    get_instance_proc_addr: Option<vk::PFN_vkGetInstanceProcAddr>,
    get_device_proc_addr: Option<vk::PFN_vkGetDeviceProcAddr>,
    get_physical_device_proc_addr: Any,
}

/// Entry point for the loader.
///
/// # Safety
/// As the loader calls it.
#[unsafe(no_mangle)]
#[allow(non_snake_case, reason = "the name is the loader's")]
pub unsafe extern "system" fn vkNegotiateLoaderLayerInterfaceVersion(asked: *mut Negotiation) -> vk::Result {
    // SAFETY: the loader passes a valid structure.
    let asked = unsafe { &mut *asked };
    asked.version = asked.version.min(2);
    asked.get_instance_proc_addr = Some(get_instance_proc_addr);
    asked.get_device_proc_addr = Some(get_device_proc_addr);
    asked.get_physical_device_proc_addr = std::ptr::null_mut();
    vk::Result::SUCCESS
}

unsafe extern "system" fn get_instance_proc_addr(
    instance: vk::Instance,
    name: *const c_char,
) -> vk::PFN_vkVoidFunction {
    // SAFETY: names end in NUL; whoever asks for a function by name knows its type.
    unsafe {
        let found = match CStr::from_ptr(name).to_bytes() {
            b"vkGetInstanceProcAddr" => get_instance_proc_addr as *const (),
            b"vkGetDeviceProcAddr" => get_device_proc_addr as *const (),
            b"vkCreateInstance" => chain::create_instance as *const (),
            b"vkCreateDevice" => chain::create_device as *const (),
            b"vkDestroyInstance" => chain::destroy_instance as *const (),
            b"vkEnumeratePhysicalDevices" => devices::enumerate as *const (),
            b"vkGetPhysicalDeviceProperties2" => devices::properties as *const (),
            b"vkGetPhysicalDeviceSurfaceFormatsKHR" => formats::surface_formats as *const (),
            _ => {
                let next = chain::next_of_instance(instance, name)?;
                return ours(CStr::from_ptr(name)).or(Some(next));
            }
        };
        std::mem::transmute::<*const (), vk::PFN_vkVoidFunction>(found)
    }
}

unsafe extern "system" fn get_device_proc_addr(
    device: vk::Device,
    name: *const c_char,
) -> vk::PFN_vkVoidFunction {
    // SAFETY: names end in NUL.
    unsafe {
        // The layer adds no functions to a device.
        let next = chain::next(device, CStr::from_ptr(name).to_str().ok()?)?;
        ours(CStr::from_ptr(name)).or(Some(next))
    }
}

/// A function of devices that this layer implements.
fn ours(name: &CStr) -> vk::PFN_vkVoidFunction {
    let found = match name.to_bytes() {
        b"vkAllocateMemory" => memory::allocate as *const (),
        b"vkFreeMemory" => memory::free as *const (),
        _ => return wrapped(name).or_else(|| destroying(name)),
    };
    // SAFETY: whoever asks for it by name knows its type.
    unsafe { std::mem::transmute::<*const (), vk::PFN_vkVoidFunction>(found) }
}
