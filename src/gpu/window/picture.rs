//! Pictures that panels show: images with a place in the panels' textures.

use std::sync::Arc;

use ash::vk;
use gpu_allocator::MemoryLocation;
use gpu_allocator::vulkan::{Allocation, AllocationCreateDesc, AllocationScheme};

use super::super::{Buffer, Context, VkResultExt};
use super::swapchain::image_view;
use crate::error::{Error, Result};

/// Bytes of sRGB codes R, G, B and A.
const FORMAT: vk::Format = vk::Format::R8G8B8A8_SRGB;

/// Which picture of a painter.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct PictureId(pub(super) usize);

/// A picture of fixed size.
pub(super) struct Picture {
    context: Arc<Context>,
    pub(super) image: vk::Image,
    pub(super) view: vk::ImageView,
    pub(super) size: [u32; 2],
    /// What it is to show from the next frame on; none where it shows that already.
    pub(super) next: Option<Buffer>,
    /// What it was copied from last: the copy may still be under way.
    pub(super) shown: Option<Buffer>,
    /// None only while it goes.
    allocation: Option<Allocation>,
}

impl Picture {
    pub(super) fn new(context: &Arc<Context>, size: [u32; 2]) -> Result<Self> {
        let info = vk::ImageCreateInfo::default()
            .image_type(vk::ImageType::TYPE_2D)
            .format(FORMAT)
            .extent(vk::Extent3D { width: size[0], height: size[1], depth: 1 })
            .mip_levels(1)
            .array_layers(1)
            .samples(vk::SampleCountFlags::TYPE_1)
            .tiling(vk::ImageTiling::OPTIMAL)
            .usage(vk::ImageUsageFlags::SAMPLED | vk::ImageUsageFlags::TRANSFER_DST)
            .initial_layout(vk::ImageLayout::UNDEFINED);
        let image = unsafe { context.device.create_image(&info, None) }.vk("vkCreateImage")?;
        context.set_name(image, "picture");
        let context = context.clone();
        let mut picture = Self {
            context,
            image,
            view: vk::ImageView::null(),
            size,
            next: None,
            shown: None,
            allocation: None,
        };
        let context = &picture.context;
        let requirements = unsafe { context.device.get_image_memory_requirements(image) };
        let wanted = AllocationCreateDesc {
            name: "picture",
            requirements,
            location: MemoryLocation::GpuOnly,
            linear: false,
            allocation_scheme: AllocationScheme::GpuAllocatorManaged,
        };
        let allocation =
            context.with_allocator(|allocator| allocator.allocate(&wanted)).map_err(|error| {
                Error::OutOfMemory(format!(
                    "a picture of {}x{} pixels ({error}): make the window smaller",
                    size[0], size[1]
                ))
            })?;
        // SAFETY: the memory is the allocator's, fits the requirements, and outlives the image (see `drop`).
        let bound =
            unsafe { context.device.bind_image_memory(image, allocation.memory(), allocation.offset()) };
        picture.allocation = Some(allocation);
        bound.vk("vkBindImageMemory")?;
        picture.view = image_view(&picture.context, image, FORMAT)?;
        Ok(picture)
    }
}

impl Drop for Picture {
    fn drop(&mut self) {
        unsafe {
            self.context.device.destroy_image_view(self.view, None);
            self.context.device.destroy_image(self.image, None);
        }
        if let Some(allocation) = self.allocation.take() {
            // What the allocator could say against it would be a fault of this file; there is nobody to tell.
            let _ = self.context.with_allocator(|allocator| allocator.free(allocation));
        }
    }
}
