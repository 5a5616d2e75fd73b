//! Simulates less memory: `vkAllocateMemory:1+:MAX=BYTES` fails if more than that would be
//! allocated. It can also fail like the others.

use std::collections::HashMap;
use std::sync::{LazyLock, Mutex};

use ash::vk;

use crate::{Any, chain, faults};

type Allocate = unsafe extern "system" fn(
    vk::Device,
    *const vk::MemoryAllocateInfo<'_>,
    Any,
    *mut vk::DeviceMemory,
) -> vk::Result;
type Free = unsafe extern "system" fn(vk::Device, vk::DeviceMemory, Any);

/// Bytes of each allocation.
static HELD: LazyLock<Mutex<HashMap<vk::DeviceMemory, u64>>> = LazyLock::new(Mutex::default);

pub(crate) unsafe extern "system" fn allocate(
    device: vk::Device,
    info: *const vk::MemoryAllocateInfo<'_>,
    allocator: Any,
    memory: *mut vk::DeviceMemory,
) -> vk::Result {
    const NAME: &str = "vkAllocateMemory";
    let asked = faults::asked(NAME);
    let mut held = HELD.lock().expect("no holder panics");
    // SAFETY: parameters are the caller's, and the name that of a function that takes them.
    unsafe {
        let bytes = (*info).allocation_size;
        match asked.as_deref().map(|what| (what, what.strip_prefix("MAX="))) {
            Some((_, Some(most))) => {
                let most: u64 = most.parse().unwrap_or_else(|_| panic!("faults: no number: {most}"));
                if held.values().sum::<u64>() + bytes > most {
                    return vk::Result::ERROR_OUT_OF_DEVICE_MEMORY;
                }
            }
            Some((code, None)) => return faults::code(code),
            None => {}
        }
        let next = std::mem::transmute::<vk::PFN_vkVoidFunction, Allocate>(chain::next(device, NAME));
        let result = next(device, info, allocator, memory);
        if result == vk::Result::SUCCESS {
            held.insert(*memory, bytes);
        }
        result
    }
}

pub(crate) unsafe extern "system" fn free(device: vk::Device, memory: vk::DeviceMemory, allocator: Any) {
    HELD.lock().expect("no holder panics").remove(&memory);
    if memory != vk::DeviceMemory::null() {
        faults::asked("vkFreeMemory");
    }
    // SAFETY: as above.
    unsafe {
        let next = chain::next(device, "vkFreeMemory");
        std::mem::transmute::<vk::PFN_vkVoidFunction, Free>(next)(device, memory, allocator);
    }
}
