//! Simulates another screen. `vkGetPhysicalDeviceSurfaceFormatsKHR:1+:UNORM` leaves only formats
//! that do not encode sRGB, `SRGB` only formats that encode it, and `REVERSED` reverses their
//! order. The function can also fail like the others.

use ash::vk;

use crate::{chain, faults};

type Function = unsafe extern "system" fn(
    vk::PhysicalDevice,
    vk::SurfaceKHR,
    *mut u32,
    *mut vk::SurfaceFormatKHR,
) -> vk::Result;

pub(crate) unsafe extern "system" fn surface_formats(
    device: vk::PhysicalDevice,
    surface: vk::SurfaceKHR,
    count: *mut u32,
    formats: *mut vk::SurfaceFormatKHR,
) -> vk::Result {
    const NAME: &str = "vkGetPhysicalDeviceSurfaceFormatsKHR";
    let asked = faults::asked(NAME);
    // SAFETY: parameters are the caller's, and the name that of a function that takes them.
    let next = unsafe { std::mem::transmute::<vk::PFN_vkVoidFunction, Function>(chain::next(device, NAME)) };
    let keeps: fn(vk::Format) -> bool = match asked.as_deref() {
        // SAFETY: parameters are the caller's.
        None => return unsafe { next(device, surface, count, formats) },
        Some("UNORM") => |format: vk::Format| !encodes(format),
        Some("SRGB") => encodes,
        Some("REVERSED") => |_| true,
        Some(code) => return faults::code(code),
    };
    let mut all = [vk::SurfaceFormatKHR::default(); 64];
    let mut known = all.len() as u32;
    // SAFETY: the caller's device and surface, and room for as many formats as it says.
    let result = unsafe { next(device, surface, &raw mut known, all.as_mut_ptr()) };
    if result != vk::Result::SUCCESS {
        return result;
    }
    let mut kept: Vec<_> = all[..known as usize].iter().filter(|one| keeps(one.format)).copied().collect();
    if asked.as_deref() == Some("REVERSED") {
        kept.reverse();
    }
    // SAFETY: the caller gives a number, and room for as many formats if any.
    unsafe {
        if !formats.is_null() {
            let room = (*count as usize).min(kept.len());
            std::ptr::copy_nonoverlapping(kept.as_ptr(), formats, room);
            *count = room as u32;
            return if room < kept.len() { vk::Result::INCOMPLETE } else { vk::Result::SUCCESS };
        }
        *count = kept.len() as u32;
    }
    vk::Result::SUCCESS
}

fn encodes(format: vk::Format) -> bool {
    matches!(format, vk::Format::B8G8R8A8_SRGB | vk::Format::R8G8B8A8_SRGB | vk::Format::A8B8G8R8_SRGB_PACK32)
}
