//! Images on the device, with their memory.

use std::sync::Arc;

use ash::vk;
use gpu_allocator::MemoryLocation;
use gpu_allocator::vulkan::{Allocation, AllocationCreateDesc, AllocationScheme};

use super::super::{Context, VkResultExt};
use crate::error::{Error, Result};

/// The use of an image.
pub(super) struct Purpose {
    pub(super) name: &'static str,
    pub(super) format: vk::Format,
    /// Format of the image's view.
    pub(super) seen_as: vk::Format,
    pub(super) usage: vk::ImageUsageFlags,
}

/// A colour image of fixed size, and a view of it.
pub(super) struct Image {
    context: Arc<Context>,
    pub(super) handle: vk::Image,
    pub(super) view: vk::ImageView,
    /// `None` only during creation and drop.
    allocation: Option<Allocation>,
}

impl Image {
    pub(super) fn new(context: &Arc<Context>, size: [u32; 2], purpose: &Purpose) -> Result<Self> {
        let Purpose { name, format, seen_as, usage } = *purpose;
        let flags = match seen_as == format {
            true => vk::ImageCreateFlags::empty(),
            false => vk::ImageCreateFlags::MUTABLE_FORMAT,
        };
        let info = vk::ImageCreateInfo::default()
            .flags(flags)
            .image_type(vk::ImageType::TYPE_2D)
            .format(format)
            .extent(vk::Extent3D { width: size[0], height: size[1], depth: 1 })
            .mip_levels(1)
            .array_layers(1)
            .samples(vk::SampleCountFlags::TYPE_1)
            .tiling(vk::ImageTiling::OPTIMAL)
            .usage(usage)
            .initial_layout(vk::ImageLayout::UNDEFINED);
        // SAFETY: the device and every object in the description are alive.
        let handle = unsafe { context.device.create_image(&info, None) }.vk("vkCreateImage")?;
        context.set_name(handle, name);
        let mut image =
            Self { context: context.clone(), handle, view: vk::ImageView::null(), allocation: None };
        // SAFETY: it is alive, and made by this device.
        let requirements = unsafe { context.device.get_image_memory_requirements(handle) };
        let wanted = AllocationCreateDesc {
            name,
            requirements,
            location: MemoryLocation::GpuOnly,
            linear: false,
            allocation_scheme: AllocationScheme::GpuAllocatorManaged,
        };
        let allocation =
            context.with_allocator(|allocator| allocator.allocate(&wanted)).map_err(|error| {
                Error::OutOfMemory(format!(
                    "a {name} of {}x{} pixels ({error}): make the window smaller",
                    size[0], size[1]
                ))
            })?;
        // SAFETY: the memory is the allocator's, fits the requirements, and outlives the
        // image (see `drop`).
        let bound =
            unsafe { context.device.bind_image_memory(handle, allocation.memory(), allocation.offset()) };
        image.allocation = Some(allocation);
        bound.vk("vkBindImageMemory")?;
        image.view = image_view(context, handle, seen_as)?;
        Ok(image)
    }
}

impl Drop for Image {
    fn drop(&mut self) {
        // SAFETY: it is ours, made by this device, and no submission uses it any more.
        unsafe {
            self.context.device.destroy_image_view(self.view, None);
            self.context.device.destroy_image(self.handle, None);
        }
        if let Some(allocation) = self.allocation.take() {
            // An error of the allocator would be a bug in this file, and `drop` cannot return it.
            let _ = self.context.with_allocator(|allocator| allocator.free(allocation));
        }
    }
}

/// A view of a colour image.
pub(super) fn image_view(context: &Context, image: vk::Image, format: vk::Format) -> Result<vk::ImageView> {
    let info = vk::ImageViewCreateInfo::default()
        .image(image)
        .view_type(vk::ImageViewType::TYPE_2D)
        .format(format)
        .subresource_range(COLOUR);
    // SAFETY: the device and every object in the description are alive.
    let view = unsafe { context.device.create_image_view(&info, None) }.vk("vkCreateImageView")?;
    context.set_name(view, "whole image");
    Ok(view)
}

/// The whole of a colour image.
pub(super) const COLOUR: vk::ImageSubresourceRange = vk::ImageSubresourceRange {
    aspect_mask: vk::ImageAspectFlags::COLOR,
    base_mip_level: 0,
    level_count: 1,
    base_array_layer: 0,
    layer_count: 1,
};
