//! Surfaces of windows: the targets of a device's draws.

use std::ffi::c_char;
use std::sync::Arc;

use ash::vk;
use raw_window_handle::{HasDisplayHandle, HasWindowHandle};

use super::super::VkResultExt;
use super::super::context::{Context, ContextOptions};
use super::super::instance::Instance;
use crate::error::{Error, Result};

/// A window of the system.
pub trait WindowHandles: HasDisplayHandle + HasWindowHandle {}

impl<W: HasDisplayHandle + HasWindowHandle> WindowHandles for W {}

/// A surface without a device.
pub(in super::super) struct RawSurface {
    pub(super) loader: ash::khr::surface::Instance,
    pub(super) handle: vk::SurfaceKHR,
    _instance: Arc<Instance>,
}

/// The surface of a window on an open device.
pub struct Surface {
    pub(super) raw: RawSurface,
    pub(super) context: Arc<Context>,
}

impl RawSurface {
    /// Extensions of the instance that the window needs.
    pub(in super::super) fn extensions(window: &dyn WindowHandles) -> Result<&'static [*const c_char]> {
        let display = window.display_handle().map_err(|error| no_window(&error.to_string()))?;
        ash_window::enumerate_required_extensions(display.as_raw())
            .map_err(|result| no_window(&result.to_string()))
    }

    /// Creates the surface. The window must outlive it.
    pub(in super::super) fn new(instance: Arc<Instance>, window: &dyn WindowHandles) -> Result<Self> {
        let display = window.display_handle().map_err(|error| no_window(&error.to_string()))?;
        let handle = window.window_handle().map_err(|error| no_window(&error.to_string()))?;
        let (entry, raw) = (instance.entry(), &instance.raw);
        // SAFETY: both handles are alive, and the caller keeps the window until the
        // surface is gone.
        let handle =
            unsafe { ash_window::create_surface(entry, raw, display.as_raw(), handle.as_raw(), None) }
                .vk("vkCreateSurfaceKHR")?;
        Ok(Self { loader: ash::khr::surface::Instance::new(entry, raw), handle, _instance: instance })
    }

    /// Whether queues of this family of the device can present to the surface.
    pub(in super::super) fn takes(&self, device: vk::PhysicalDevice, family: u32) -> Result<bool> {
        // SAFETY: the queried objects are alive, and the result has the structures that it needs.
        unsafe { self.loader.get_physical_device_surface_support(device, family, self.handle) }
            .vk("vkGetPhysicalDeviceSurfaceSupportKHR")
    }
}

impl Drop for RawSurface {
    /// Its swapchains must be gone.
    fn drop(&mut self) {
        // SAFETY: it is ours, and nothing shows anything on it any more.
        unsafe { self.loader.destroy_surface(self.handle, None) };
    }
}

impl Surface {
    pub(in super::super) fn new(raw: RawSurface, context: &Arc<Context>) -> Self {
        Self { raw, context: context.clone() }
    }
}

impl Context {
    /// As [`Self::new`], for a device that can present to the window, with the window's surface.
    /// The window must outlive the surface.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn for_window(options: &ContextOptions, window: &dyn WindowHandles) -> Result<(Arc<Self>, Surface)> {
        let instance = Arc::new(Instance::new(options.validation, RawSurface::extensions(window)?)?);
        let surface = RawSurface::new(instance.clone(), window)?;
        let context = Self::open(instance, options, Some(&|device, family| surface.takes(device, family)))?;
        let surface = Surface::new(surface, &context);
        Ok((context, surface))
    }
}

fn no_window(why: &str) -> Error {
    Error::NoDevice(format!("the window cannot be drawn to by Vulkan: {why}"))
}
