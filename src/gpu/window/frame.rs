//! One frame of the window in flight: recorded, submitted, and awaited before the next.

use std::sync::Arc;

use ash::vk;

use super::super::barrier::SUBMISSION;
use super::super::{Context, VkResultExt};
use super::image::COLOUR;
use super::picture::Picture;
use super::swapchain::{Swapchain, SwapchainImage};
use crate::error::Result;

/// Maximum wait for an image of the swapchain, nanoseconds: a hidden window may never get one.
const PATIENCE_NS: u64 = 500_000_000;

/// The whole of a colour image.
const LAYER: vk::ImageSubresourceLayers = vk::ImageSubresourceLayers {
    aspect_mask: vk::ImageAspectFlags::COLOR,
    mip_level: 0,
    base_array_layer: 0,
    layer_count: 1,
};

/// Commands of a frame, with the objects that signal their end.
pub(super) struct Frame {
    context: Arc<Context>,
    rendering: ash::khr::dynamic_rendering::Device,
    pub(super) pool: vk::CommandPool,
    commands: vk::CommandBuffer,
    fence: vk::Fence,
    /// Signalled when the acquired image may be drawn to.
    is_lent: vk::Semaphore,
}

/// Result of a request to the presentation engine.
pub(super) enum Answer<T> {
    /// Success; `false`: the swapchain no longer fits the window.
    Granted(T, bool),
    /// The swapchain must be created anew first.
    OutOfDate,
    /// The surface must be created anew first.
    SurfaceLost,
    /// The device still works on earlier frames.
    Busy,
}

impl Frame {
    pub(super) fn new(context: &Arc<Context>) -> Result<Self> {
        let device = &context.device;
        let info = vk::CommandPoolCreateInfo::default()
            .flags(vk::CommandPoolCreateFlags::RESET_COMMAND_BUFFER)
            .queue_family_index(context.queue_family);
        // SAFETY: the device and every object in the description are alive.
        let pool = unsafe { device.create_command_pool(&info, None) }.vk("vkCreateCommandPool")?;
        context.set_name(pool, "window");
        let mut frame = Self {
            rendering: ash::khr::dynamic_rendering::Device::new(context.instance(), device),
            context: context.clone(),
            pool,
            commands: vk::CommandBuffer::null(),
            fence: vk::Fence::null(),
            is_lent: vk::Semaphore::null(),
        };
        let info = vk::CommandBufferAllocateInfo::default().command_pool(pool).command_buffer_count(1);
        // SAFETY: the device and every object in the description are alive.
        frame.commands = unsafe { device.allocate_command_buffers(&info) }.vk("vkAllocateCommandBuffers")?[0];
        context.set_name(frame.commands, "window");
        let signalled = vk::FenceCreateInfo::default().flags(vk::FenceCreateFlags::SIGNALED);
        // SAFETY: the device and every object in the description are alive.
        frame.fence = unsafe { device.create_fence(&signalled, None) }.vk("vkCreateFence")?;
        context.set_name(frame.fence, "window is drawn");
        // SAFETY: the device and every object in the description are alive.
        frame.is_lent = unsafe { device.create_semaphore(&vk::SemaphoreCreateInfo::default(), None) }
            .vk("vkCreateSemaphore")?;
        context.set_name(frame.is_lent, "image is lent");
        Ok(frame)
    }

    /// Waits until the device is done with the frame before.
    pub(super) fn wait(&self) -> Result<()> {
        // SAFETY: the device is alive; whoever holds the queue waits for it.
        unsafe { self.context.device.wait_for_fences(&[self.fence], true, u64::MAX) }.vk("vkWaitForFences")
    }

    /// Acquires an image to draw to. The frame before must be done.
    pub(super) fn acquire(&self, swapchain: &Swapchain) -> Result<Answer<u32>> {
        // SAFETY: swapchain and semaphore are alive, and no other code uses them.
        let lent = unsafe {
            swapchain.loader.acquire_next_image(
                swapchain.handle,
                PATIENCE_NS,
                self.is_lent,
                vk::Fence::null(),
            )
        };
        match lent {
            Ok((index, is_suboptimal)) => Ok(Answer::Granted(index, !is_suboptimal)),
            Err(vk::Result::TIMEOUT | vk::Result::NOT_READY) => Ok(Answer::Busy),
            Err(result) => refused(result, "vkAcquireNextImageKHR"),
        }
    }

    /// Updates the pictures, draws, and presents the image.
    pub(super) fn draw<'a>(
        &self,
        swapchain: &Swapchain,
        index: u32,
        pictures: impl Iterator<Item = &'a mut Picture>,
        background: [f32; 4],
        panels: impl FnOnce(vk::CommandBuffer) -> Result<()>,
    ) -> Result<Answer<()>> {
        let (device, image) = (&self.context.device, &swapchain.images[index as usize]);
        let info = vk::CommandBufferBeginInfo::default().flags(vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT);
        // SAFETY: the commands are ours, and no submission uses them any more.
        unsafe { device.begin_command_buffer(self.commands, &info) }.vk("vkBeginCommandBuffer")?;
        self.memory_barrier();
        for picture in pictures {
            self.upload(picture);
        }
        let canvas = swapchain.canvas.as_ref().map(|canvas| (canvas.handle, canvas.view));
        let (target, view) = canvas.unwrap_or((image.image, image.view));
        let drawn = vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL;
        self.move_image(target, vk::ImageLayout::UNDEFINED, drawn);
        self.begin_rendering(view, swapchain.extent, background);
        panels(self.commands)?;
        // SAFETY: the commands are being recorded, and what they name lives until they have run.
        unsafe { self.rendering.cmd_end_rendering(self.commands) };
        let mut last = drawn;
        if target != image.image {
            self.move_image(target, drawn, vk::ImageLayout::TRANSFER_SRC_OPTIMAL);
            last = vk::ImageLayout::TRANSFER_DST_OPTIMAL;
            self.move_image(image.image, vk::ImageLayout::UNDEFINED, last);
            self.copy(target, image.image, swapchain.extent);
        }
        self.move_image(image.image, last, vk::ImageLayout::PRESENT_SRC_KHR);
        // SAFETY: the commands are ours, and are being recorded.
        unsafe { device.end_command_buffer(self.commands) }.vk("vkEndCommandBuffer")?;
        self.submit(image)?;
        self.present(swapchain, index)
    }

    fn submit(&self, image: &SwapchainImage) -> Result<()> {
        let at = |semaphore| {
            vk::SemaphoreSubmitInfo::default()
                .semaphore(semaphore)
                .stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS)
        };
        let (wait, signal) = ([at(self.is_lent)], [at(image.is_drawn)]);
        let commands = [vk::CommandBufferSubmitInfo::default().command_buffer(self.commands)];
        let submit = [vk::SubmitInfo2::default()
            .wait_semaphore_infos(&wait)
            .command_buffer_infos(&commands)
            .signal_semaphore_infos(&signal)];
        // SAFETY: no submission uses them any more.
        unsafe { self.context.device.reset_fences(&[self.fence]) }.vk("vkResetFences")?;
        let context = &self.context;
        context
            // SAFETY: no other thread has the queue; commands, semaphores and fence live until the
            // fence is waited for.
            .with_queue(|queue| unsafe { context.sync2.queue_submit2(queue, &submit, self.fence) })
            .vk("vkQueueSubmit2")
    }

    fn present(&self, swapchain: &Swapchain, index: u32) -> Result<Answer<()>> {
        let wait = [swapchain.images[index as usize].is_drawn];
        let (swapchains, indices) = ([swapchain.handle], [index]);
        let info = vk::PresentInfoKHR::default()
            .wait_semaphores(&wait)
            .swapchains(&swapchains)
            .image_indices(&indices);
        // SAFETY: swapchain and semaphore are alive, and no other code uses them.
        let shown = self.context.with_queue(|queue| unsafe { swapchain.loader.queue_present(queue, &info) });
        match shown {
            Ok(is_suboptimal) => Ok(Answer::Granted((), !is_suboptimal)),
            Err(result) => refused(result, "vkQueuePresentKHR"),
        }
    }

    /// Copies the new content of a picture, if there is any.
    fn upload(&self, picture: &mut Picture) {
        let Some(pixels) = picture.next.take() else { return };
        let region = [vk::BufferImageCopy::default().image_subresource(LAYER).image_extent(vk::Extent3D {
            width: picture.size[0],
            height: picture.size[1],
            depth: 1,
        })];
        let written = vk::ImageLayout::TRANSFER_DST_OPTIMAL;
        // The copy writes the whole image, so its old content may be discarded.
        self.move_image(picture.image.handle, vk::ImageLayout::UNDEFINED, written);
        let (from, to) = (pixels.allocated.handle, picture.image.handle);
        // SAFETY: the commands are being recorded, and what they name lives until they have run.
        unsafe {
            self.context.device.cmd_copy_buffer_to_image(self.commands, from, to, written, &region);
        }
        self.move_image(picture.image.handle, written, vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL);
        picture.shown = Some(pixels);
    }

    /// Copies an image to another, channel by channel, whatever the order of their channels.
    fn copy(&self, from: vk::Image, to: vk::Image, extent: vk::Extent2D) {
        let end = vk::Offset3D { x: extent.width as i32, y: extent.height as i32, z: 1 };
        let region = [vk::ImageBlit::default()
            .src_subresource(LAYER)
            .src_offsets([vk::Offset3D::default(), end])
            .dst_subresource(LAYER)
            .dst_offsets([vk::Offset3D::default(), end])];
        let layouts = (vk::ImageLayout::TRANSFER_SRC_OPTIMAL, vk::ImageLayout::TRANSFER_DST_OPTIMAL);
        let (device, nearest) = (&self.context.device, vk::Filter::NEAREST);
        // SAFETY: the commands are being recorded, and what they name lives until they have run.
        unsafe { device.cmd_blit_image(self.commands, from, layouts.0, to, layouts.1, &region, nearest) };
    }

    fn begin_rendering(&self, view: vk::ImageView, extent: vk::Extent2D, background: [f32; 4]) {
        let attachment = [vk::RenderingAttachmentInfo::default()
            .image_view(view)
            .image_layout(vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL)
            .load_op(vk::AttachmentLoadOp::CLEAR)
            .store_op(vk::AttachmentStoreOp::STORE)
            .clear_value(vk::ClearValue { color: vk::ClearColorValue { float32: background } })];
        let info = vk::RenderingInfo::default()
            .render_area(extent.into())
            .layer_count(1)
            .color_attachments(&attachment);
        // SAFETY: the commands are being recorded, and what they name lives until they have run.
        unsafe { self.rendering.cmd_begin_rendering(self.commands, &info) };
    }

    /// Makes writes of other submissions visible to this one.
    fn memory_barrier(&self) {
        let memory = [SUBMISSION.memory_barrier()];
        let info = vk::DependencyInfo::default().memory_barriers(&memory);
        // SAFETY: the commands are being recorded, and what they name lives until they have run.
        unsafe { self.context.sync2.cmd_pipeline_barrier2(self.commands, &info) };
    }

    /// Changes the layout of an image. Earlier commands are done and visible to later ones.
    fn move_image(&self, image: vk::Image, from: vk::ImageLayout, to: vk::ImageLayout) {
        let all = vk::PipelineStageFlags2::ALL_COMMANDS;
        let barrier = [vk::ImageMemoryBarrier2::default()
            .src_stage_mask(all)
            .src_access_mask(vk::AccessFlags2::MEMORY_WRITE)
            .dst_stage_mask(all)
            .dst_access_mask(vk::AccessFlags2::MEMORY_READ | vk::AccessFlags2::MEMORY_WRITE)
            .old_layout(from)
            .new_layout(to)
            .src_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
            .dst_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
            .image(image)
            .subresource_range(COLOUR)];
        let info = vk::DependencyInfo::default().image_memory_barriers(&barrier);
        // SAFETY: the commands are being recorded, and what they name lives until they have run.
        unsafe { self.context.sync2.cmd_pipeline_barrier2(self.commands, &info) };
    }
}

impl Drop for Frame {
    fn drop(&mut self) {
        let _ = self.context.wait_idle();
        // SAFETY: it is ours, made by this device, and no submission uses it any more.
        unsafe {
            self.context.device.destroy_semaphore(self.is_lent, None);
            self.context.device.destroy_fence(self.fence, None);
            self.context.device.destroy_command_pool(self.pool, None);
        }
    }
}

fn refused<T>(result: vk::Result, call: &'static str) -> Result<Answer<T>> {
    match result {
        vk::Result::ERROR_OUT_OF_DATE_KHR => Ok(Answer::OutOfDate),
        vk::Result::ERROR_SURFACE_LOST_KHR => Ok(Answer::SurfaceLost),
        result => Err(result).vk(call),
    }
}
