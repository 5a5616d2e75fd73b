//! The images that the system shows in turn.

use std::sync::Arc;

use ash::vk;

use super::super::{Context, VkResultExt};
use super::surface::Surface;
use crate::error::Result;

/// Formats to show pictures in, the best first. Where the hardware encodes sRGB, the bytes of a picture come out as they went in.
const FORMATS: [vk::Format; 4] = [
    vk::Format::B8G8R8A8_SRGB,
    vk::Format::R8G8B8A8_SRGB,
    vk::Format::B8G8R8A8_UNORM,
    vk::Format::R8G8B8A8_UNORM,
];

/// The swapchain of a surface, for as long as neither changes its size.
pub(super) struct Swapchain {
    context: Arc<Context>,
    pub(super) loader: ash::khr::swapchain::Device,
    pub(super) handle: vk::SwapchainKHR,
    pub(super) images: Vec<SwapchainImage>,
    pub(super) extent: vk::Extent2D,
}

/// One image of it.
pub(super) struct SwapchainImage {
    pub(super) image: vk::Image,
    pub(super) view: vk::ImageView,
    /// Signalled when the image may be shown.
    pub(super) is_drawn: vk::Semaphore,
}

/// The format in which a surface shows pictures.
pub(super) fn format(surface: &Surface) -> Result<vk::SurfaceFormatKHR> {
    let device = surface.context.physical_device();
    let formats =
        unsafe { surface.raw.loader.get_physical_device_surface_formats(device, surface.raw.handle) }
            .vk("vkGetPhysicalDeviceSurfaceFormatsKHR")?;
    let is_srgb = |format: &&vk::SurfaceFormatKHR| format.color_space == vk::ColorSpaceKHR::SRGB_NONLINEAR;
    let rank = |format: &&vk::SurfaceFormatKHR| {
        FORMATS.iter().position(|&known| known == format.format).unwrap_or(FORMATS.len())
    };
    let best = formats.iter().filter(is_srgb).min_by_key(rank).or(formats.first());
    Ok(*best.expect("a surface has a format"))
}

/// Whether images of that format encode what is drawn to them.
pub(super) fn encodes_srgb(format: vk::Format) -> bool {
    matches!(format, vk::Format::B8G8R8A8_SRGB | vk::Format::R8G8B8A8_SRGB)
}

impl Swapchain {
    /// Makes the images for a window of that size in pixels; none while it has no area.
    pub(super) fn new(
        surface: &Surface,
        format: vk::SurfaceFormatKHR,
        size: [u32; 2],
        vsync: bool,
        old: Option<Self>,
    ) -> Result<Option<Self>> {
        let context = &surface.context;
        let (loader, handle, device) = (&surface.raw.loader, surface.raw.handle, context.physical_device());
        let limits = unsafe { loader.get_physical_device_surface_capabilities(device, handle) }
            .vk("vkGetPhysicalDeviceSurfaceCapabilitiesKHR")?;
        let extent = match limits.current_extent {
            // The surface takes the size that it is given.
            vk::Extent2D { width: u32::MAX, .. } => vk::Extent2D {
                width: size[0].clamp(limits.min_image_extent.width, limits.max_image_extent.width),
                height: size[1].clamp(limits.min_image_extent.height, limits.max_image_extent.height),
            },
            extent => extent,
        };
        if extent.width == 0 || extent.height == 0 || size.contains(&0) {
            return Ok(None);
        }
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
        let info = vk::SwapchainCreateInfoKHR::default()
            .surface(handle)
            .min_image_count((limits.min_image_count + 1).min(most))
            .image_format(format.format)
            .image_color_space(format.color_space)
            .image_extent(extent)
            .image_array_layers(1)
            .image_usage(vk::ImageUsageFlags::COLOR_ATTACHMENT)
            .image_sharing_mode(vk::SharingMode::EXCLUSIVE)
            .pre_transform(limits.current_transform)
            .composite_alpha(alpha.unwrap_or(vk::CompositeAlphaFlagsKHR::OPAQUE))
            .present_mode(mode)
            .clipped(true)
            .old_swapchain(old.as_ref().map_or(vk::SwapchainKHR::null(), |old| old.handle));
        let loader = ash::khr::swapchain::Device::new(context.instance(), &context.device);
        let handle = unsafe { loader.create_swapchain(&info, None) }.vk("vkCreateSwapchainKHR")?;
        drop(old);
        let mut made = Self { context: context.clone(), loader, handle, images: Vec::new(), extent };
        let images = unsafe { made.loader.get_swapchain_images(handle) }.vk("vkGetSwapchainImagesKHR")?;
        for image in images {
            made.images.push(SwapchainImage::new(context, image, format.format)?);
        }
        Ok(Some(made))
    }
}

impl SwapchainImage {
    fn new(context: &Context, image: vk::Image, format: vk::Format) -> Result<Self> {
        let view = image_view(context, image, format)?;
        let semaphore = unsafe { context.device.create_semaphore(&vk::SemaphoreCreateInfo::default(), None) };
        match semaphore.vk("vkCreateSemaphore") {
            Ok(is_drawn) => Ok(Self { image, view, is_drawn }),
            Err(error) => {
                unsafe { context.device.destroy_image_view(view, None) };
                Err(error)
            }
        }
    }
}

impl Drop for Swapchain {
    fn drop(&mut self) {
        // The presentation engine tells nobody when it is done with a semaphore; an idle device has none waiting.
        let _ = self.context.wait_idle();
        for SwapchainImage { view, is_drawn, .. } in self.images.drain(..) {
            unsafe {
                self.context.device.destroy_image_view(view, None);
                self.context.device.destroy_semaphore(is_drawn, None);
            }
        }
        unsafe { self.loader.destroy_swapchain(self.handle, None) };
    }
}

/// A view of a colour image.
pub(super) fn image_view(context: &Context, image: vk::Image, format: vk::Format) -> Result<vk::ImageView> {
    let info = vk::ImageViewCreateInfo::default()
        .image(image)
        .view_type(vk::ImageViewType::TYPE_2D)
        .format(format)
        .subresource_range(COLOUR);
    unsafe { context.device.create_image_view(&info, None) }.vk("vkCreateImageView")
}

/// All of a colour image.
pub(super) const COLOUR: vk::ImageSubresourceRange = vk::ImageSubresourceRange {
    aspect_mask: vk::ImageAspectFlags::COLOR,
    base_mip_level: 0,
    level_count: 1,
    base_array_layer: 0,
    layer_count: 1,
};
