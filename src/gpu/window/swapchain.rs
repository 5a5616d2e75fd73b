//! The swapchain: images that the system shows one after another.

use std::sync::Arc;

use ash::vk;

use super::super::{Context, VkResultExt};
use super::image::{Image, Purpose, image_view};
use super::surface::Surface;
use crate::error::{Error, Result};

/// Formats of swapchain images, the best first. Images that encode sRGB are drawn to directly; the
/// others need a canvas.
const FORMATS: [vk::Format; 5] = [
    vk::Format::B8G8R8A8_SRGB,
    vk::Format::R8G8B8A8_SRGB,
    vk::Format::A8B8G8R8_SRGB_PACK32,
    vk::Format::B8G8R8A8_UNORM,
    vk::Format::R8G8B8A8_UNORM,
];

/// Format of a canvas.
const CANVAS: vk::Format = vk::Format::R8G8B8A8_SRGB;

/// The swapchain of a surface. It is valid while the size of the surface stays.
pub(super) struct Swapchain {
    context: Arc<Context>,
    pub(super) loader: ash::khr::swapchain::Device,
    pub(super) handle: vk::SwapchainKHR,
    pub(super) images: Vec<SwapchainImage>,
    pub(super) extent: vk::Extent2D,
    /// Target of the draw if the images do not encode sRGB; its bytes are copied.
    pub(super) canvas: Option<Image>,
}

/// One image of a swapchain.
pub(super) struct SwapchainImage {
    pub(super) image: vk::Image,
    /// Null if a canvas is drawn to instead.
    pub(super) view: vk::ImageView,
    /// Signalled when the image may be shown.
    pub(super) is_drawn: vk::Semaphore,
}

/// The best image format of a surface.
pub(super) fn format(surface: &Surface) -> Result<vk::SurfaceFormatKHR> {
    let device = surface.context.physical_device();
    let formats =
        // SAFETY: the queried objects are alive, and the result has the structures that it needs.
        unsafe { surface.raw.loader.get_physical_device_surface_formats(device, surface.raw.handle) }
            .vk("vkGetPhysicalDeviceSurfaceFormatsKHR")?;
    let is_srgb = |format: &&vk::SurfaceFormatKHR| format.color_space == vk::ColorSpaceKHR::SRGB_NONLINEAR;
    let rank = |format: &&vk::SurfaceFormatKHR| {
        FORMATS.iter().position(|&known| known == format.format).unwrap_or(FORMATS.len())
    };
    let best = formats.iter().filter(is_srgb).min_by_key(rank).or(formats.first());
    Ok(*best.expect("a surface has a format"))
}

/// Whether images of this format encode sRGB.
fn encodes_srgb(format: vk::Format) -> bool {
    FORMATS[..3].contains(&format)
}

/// The format of the draw's target, for a surface of this format. It always encodes sRGB: a
/// picture's bytes then stay unchanged, and translucent panels look the same on every screen.
pub(super) fn drawn_format(format: vk::Format) -> vk::Format {
    if encodes_srgb(format) { format } else { CANVAS }
}

impl Swapchain {
    /// Creates the images for a window of `size` pixels. `None` if the window has no area.
    pub(super) fn new(
        surface: &Surface,
        format: vk::SurfaceFormatKHR,
        size: [u32; 2],
        vsync: bool,
        old: Option<Self>,
    ) -> Result<Option<Self>> {
        let context = &surface.context;
        let (loader, handle, device) = (&surface.raw.loader, surface.raw.handle, context.physical_device());
        // SAFETY: the queried objects are alive, and the result has the structures that it needs.
        let limits = unsafe { loader.get_physical_device_surface_capabilities(device, handle) }
            .vk("vkGetPhysicalDeviceSurfaceCapabilitiesKHR")?;
        let extent = match limits.current_extent {
            // The surface accepts any size.
            vk::Extent2D { width: u32::MAX, .. } => vk::Extent2D {
                width: size[0].clamp(limits.min_image_extent.width, limits.max_image_extent.width),
                height: size[1].clamp(limits.min_image_extent.height, limits.max_image_extent.height),
            },
            extent => extent,
        };
        if extent.width == 0 || extent.height == 0 || size.contains(&0) {
            return Ok(None);
        }
        // SAFETY: the queried objects are alive, and the result has the structures that it needs.
        let modes = unsafe { loader.get_physical_device_surface_present_modes(device, handle) }
            .vk("vkGetPhysicalDeviceSurfacePresentModesKHR")?;
        let wanted: &[_] = if vsync {
            &[vk::PresentModeKHR::FIFO]
        } else {
            &[vk::PresentModeKHR::IMMEDIATE, vk::PresentModeKHR::MAILBOX]
        };
        // Every surface has FIFO.
        let mode =
            wanted.iter().find(|mode| modes.contains(mode)).copied().unwrap_or(vk::PresentModeKHR::FIFO);
        let most = if limits.max_image_count == 0 { u32::MAX } else { limits.max_image_count };
        let alphas = [vk::CompositeAlphaFlagsKHR::OPAQUE, vk::CompositeAlphaFlagsKHR::INHERIT];
        let alpha = alphas.into_iter().find(|&alpha| limits.supported_composite_alpha.contains(alpha));
        let needs_canvas = !encodes_srgb(format.format);
        let usage = match needs_canvas {
            true => vk::ImageUsageFlags::TRANSFER_DST,
            false => vk::ImageUsageFlags::COLOR_ATTACHMENT,
        };
        if !limits.supported_usage_flags.contains(usage) {
            let what = format!("the screen's images ({:?}) take no copies", format.format);
            return Err(Error::NoDevice(format!("the window cannot be drawn to by Vulkan: {what}")));
        }
        let info = vk::SwapchainCreateInfoKHR::default()
            .surface(handle)
            .min_image_count((limits.min_image_count + 1).min(most))
            .image_format(format.format)
            .image_color_space(format.color_space)
            .image_extent(extent)
            .image_array_layers(1)
            .image_usage(usage)
            .image_sharing_mode(vk::SharingMode::EXCLUSIVE)
            .pre_transform(limits.current_transform)
            .composite_alpha(alpha.unwrap_or(vk::CompositeAlphaFlagsKHR::OPAQUE))
            .present_mode(mode)
            .clipped(true)
            .old_swapchain(old.as_ref().map_or(vk::SwapchainKHR::null(), |old| old.handle));
        let loader = ash::khr::swapchain::Device::new(context.instance(), &context.device);
        // SAFETY: the device and every object in the description are alive.
        let handle = unsafe { loader.create_swapchain(&info, None) }.vk("vkCreateSwapchainKHR")?;
        context.set_name(handle, "window");
        drop(old);
        let mut made =
            Self { context: context.clone(), loader, handle, images: Vec::new(), extent, canvas: None };
        // SAFETY: it is alive, and made by this device.
        let images = unsafe { made.loader.get_swapchain_images(handle) }.vk("vkGetSwapchainImagesKHR")?;
        for image in images {
            let view = (!needs_canvas).then_some(format.format);
            made.images.push(SwapchainImage::new(context, image, view)?);
        }
        if needs_canvas {
            let purpose = Purpose {
                name: "canvas",
                format: vk::Format::R8G8B8A8_UNORM,
                seen_as: CANVAS,
                usage: vk::ImageUsageFlags::COLOR_ATTACHMENT | vk::ImageUsageFlags::TRANSFER_SRC,
            };
            made.canvas = Some(Image::new(context, [extent.width, extent.height], &purpose)?);
        }
        Ok(Some(made))
    }
}

impl SwapchainImage {
    fn new(context: &Context, image: vk::Image, format: Option<vk::Format>) -> Result<Self> {
        let view = format.map_or(Ok(vk::ImageView::null()), |format| image_view(context, image, format))?;
        // SAFETY: the device and every object in the description are alive.
        let semaphore = unsafe { context.device.create_semaphore(&vk::SemaphoreCreateInfo::default(), None) };
        match semaphore.vk("vkCreateSemaphore") {
            Ok(is_drawn) => {
                context.set_name(image, "window");
                context.set_name(is_drawn, "image is drawn");
                Ok(Self { image, view, is_drawn })
            }
            Err(error) => {
                // SAFETY: it is ours, made by this device, and no submission uses it any more.
                unsafe { context.device.destroy_image_view(view, None) };
                Err(error)
            }
        }
    }
}

impl Drop for Swapchain {
    fn drop(&mut self) {
        // The presentation engine does not report when it is done with a semaphore; an idle device
        // has none waiting.
        let _ = self.context.wait_idle();
        for SwapchainImage { view, is_drawn, .. } in self.images.drain(..) {
            // SAFETY: it is ours, made by this device, and no submission uses it any more.
            unsafe {
                self.context.device.destroy_image_view(view, None);
                self.context.device.destroy_semaphore(is_drawn, None);
            }
        }
        // SAFETY: it is ours, and nothing shows anything on it any more.
        unsafe { self.loader.destroy_swapchain(self.handle, None) };
    }
}
