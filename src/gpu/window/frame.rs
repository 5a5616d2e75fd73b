//! Frames of the window: commands of passes and draws in one submission, presented in order.

use std::sync::Arc;

use ash::vk;

use super::super::barrier::SUBMISSION;
use super::super::{Context, InFlight, Recorder, VkResultExt};
use super::image::COLOUR;
use super::picture::Picture;
use super::swapchain::{Swapchain, SwapchainImage};
use crate::error::Result;

/// Number of frames in flight: the host records one while the device executes the other.
pub const FRAMES: usize = 2;

/// Maximum wait for an image of the swapchain, nanoseconds: a hidden window may never get one.
const PATIENCE_NS: u64 = 500_000_000;

/// The whole of a colour image.
const LAYER: vk::ImageSubresourceLayers = vk::ImageSubresourceLayers {
    aspect_mask: vk::ImageAspectFlags::COLOR,
    mip_level: 0,
    base_array_layer: 0,
    layer_count: 1,
};

/// The objects of frames in flight.
pub(super) struct Frames {
    context: Arc<Context>,
    rendering: ash::khr::dynamic_rendering::Device,
    /// Pool of the commands that upload the panels' textures.
    pub(super) pool: vk::CommandPool,
    slots: [Slot; FRAMES],
    /// Slot of the frame that is being recorded.
    current: usize,
}

/// The objects of every second frame.
#[derive(Default)]
struct Slot {
    /// Signalled when the acquired image may be drawn to.
    is_lent: vk::Semaphore,
    /// The last frame of the slot. `None` if it was not drawn, or is done.
    in_flight: Option<InFlight>,
    /// Textures of panels that no later frame uses.
    unused: Vec<egui::TextureId>,
}

/// Target and content of a frame.
pub(super) struct Drawing<'a> {
    pub(super) swapchain: &'a Swapchain,
    /// Index of the acquired image.
    pub(super) index: u32,
    pub(super) background: [f32; 4],
    /// The image was drawn before and not presented: the picture was computed again.
    pub(super) is_again: bool,
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

impl Frames {
    pub(super) fn new(context: &Arc<Context>) -> Result<Self> {
        let device = &context.device;
        let info = vk::CommandPoolCreateInfo::default().queue_family_index(context.queue_family);
        // SAFETY: the device and every object in the description are alive.
        let pool = unsafe { device.create_command_pool(&info, None) }.vk("vkCreateCommandPool")?;
        context.set_name(pool, "window");
        let mut frames = Self {
            rendering: ash::khr::dynamic_rendering::Device::new(context.instance(), device),
            context: context.clone(),
            pool,
            slots: Default::default(),
            current: 0,
        };
        for slot in &mut frames.slots {
            // SAFETY: the device and every object in the description are alive.
            slot.is_lent = unsafe { device.create_semaphore(&vk::SemaphoreCreateInfo::default(), None) }
                .vk("vkCreateSemaphore")?;
            context.set_name(slot.is_lent, "image is lent");
        }
        Ok(frames)
    }

    /// Begins the next frame: waits until the frame before the last is done. Returns the textures
    /// that no frame uses any more.
    pub(super) fn begin(&mut self) -> Result<Vec<egui::TextureId>> {
        self.current = (self.current + 1) % FRAMES;
        let slot = &mut self.slots[self.current];
        if let Some(in_flight) = slot.in_flight.take() {
            in_flight.wait()?;
        }
        Ok(std::mem::take(&mut slot.unused))
    }

    /// Frees these textures when the current frame is done.
    pub(super) fn free_later(&mut self, textures: impl Iterator<Item = egui::TextureId>) {
        self.slots[self.current].unused.extend(textures);
    }

    /// Acquires an image to draw to.
    pub(super) fn acquire(&self, swapchain: &Swapchain) -> Result<Answer<u32>> {
        // SAFETY: swapchain and semaphore are alive, and no other code uses them.
        let lent = unsafe {
            swapchain.loader.acquire_next_image(
                swapchain.handle,
                PATIENCE_NS,
                self.slots[self.current].is_lent,
                vk::Fence::null(),
            )
        };
        match lent {
            Ok((index, is_suboptimal)) => Ok(Answer::Granted(index, !is_suboptimal)),
            Err(vk::Result::TIMEOUT | vk::Result::NOT_READY) => Ok(Answer::Busy),
            Err(result) => refused(result, "vkAcquireNextImageKHR"),
        }
    }

    /// Updates the pictures and draws, behind the recorded passes and in one submission with them.
    pub(super) fn draw<'a>(
        &mut self,
        mut recorder: Recorder,
        drawing: &Drawing<'_>,
        pictures: impl Iterator<Item = &'a Picture>,
        panels: impl FnOnce(vk::CommandBuffer) -> Result<()>,
    ) -> Result<InFlight> {
        let &Drawing { swapchain, index, background, is_again } = drawing;
        let image = &swapchain.images[index as usize];
        recorder.end_passes()?;
        recorder.pipeline_barrier(SUBMISSION);
        for picture in pictures {
            self.upload(&mut recorder, picture);
        }
        let commands = recorder.commands;
        let canvas = swapchain.canvas.as_ref().map(|canvas| (canvas.handle, canvas.view));
        let (target, view) = canvas.unwrap_or((image.image, image.view));
        let drawn = vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL;
        self.move_image(commands, target, vk::ImageLayout::UNDEFINED, drawn);
        self.begin_rendering(commands, view, swapchain.extent, background);
        panels(commands)?;
        // SAFETY: the commands are being recorded, and what they name lives until they have run.
        unsafe { self.rendering.cmd_end_rendering(commands) };
        let mut last = drawn;
        if target != image.image {
            self.move_image(commands, target, drawn, vk::ImageLayout::TRANSFER_SRC_OPTIMAL);
            last = vk::ImageLayout::TRANSFER_DST_OPTIMAL;
            self.move_image(commands, image.image, vk::ImageLayout::UNDEFINED, last);
            self.copy(commands, target, image.image, swapchain.extent);
        }
        self.move_image(commands, image.image, last, vk::ImageLayout::PRESENT_SRC_KHR);
        let in_flight = self.submit(recorder, image, swapchain.canvas.is_some(), is_again)?;
        self.slots[self.current].in_flight = Some(in_flight.clone());
        Ok(in_flight)
    }

    /// Submits a frame. Its passes do not wait for the image.
    fn submit(
        &self,
        recorder: Recorder,
        image: &SwapchainImage,
        has_canvas: bool,
        is_again: bool,
    ) -> Result<InFlight> {
        let at =
            |semaphore, stages| vk::SemaphoreSubmitInfo::default().semaphore(semaphore).stage_mask(stages);
        let all = vk::PipelineStageFlags2::ALL_COMMANDS;
        let wait = match (is_again, has_canvas) {
            (true, _) => at(image.is_drawn, all),
            (false, true) => at(self.slots[self.current].is_lent, vk::PipelineStageFlags2::BLIT),
            (false, false) => {
                at(self.slots[self.current].is_lent, vk::PipelineStageFlags2::COLOR_ATTACHMENT_OUTPUT)
            }
        };
        recorder.submit_with([&[wait], &[at(image.is_drawn, all)]])
    }

    /// Presents the image that was drawn last.
    pub(super) fn present(&self, swapchain: &Swapchain, index: u32) -> Result<Answer<()>> {
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
    fn upload(&self, recorder: &mut Recorder, picture: &Picture) {
        let Some(pixels) = &picture.next else { return };
        recorder.keep(pixels);
        let commands = recorder.commands;
        let region = [vk::BufferImageCopy::default().image_subresource(LAYER).image_extent(vk::Extent3D {
            width: picture.size[0],
            height: picture.size[1],
            depth: 1,
        })];
        let written = vk::ImageLayout::TRANSFER_DST_OPTIMAL;
        // The copy writes the whole image, so its old content may be discarded.
        self.move_image(commands, picture.image.handle, vk::ImageLayout::UNDEFINED, written);
        let (from, to) = (pixels.allocated.handle, picture.image.handle);
        // SAFETY: the commands are being recorded, and what they name lives until they have run.
        unsafe {
            self.context.device.cmd_copy_buffer_to_image(commands, from, to, written, &region);
        }
        self.move_image(commands, picture.image.handle, written, vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL);
    }

    /// Copies an image to another, channel by channel, whatever the order of their channels.
    fn copy(&self, commands: vk::CommandBuffer, from: vk::Image, to: vk::Image, extent: vk::Extent2D) {
        let end = vk::Offset3D { x: extent.width as i32, y: extent.height as i32, z: 1 };
        let region = [vk::ImageBlit::default()
            .src_subresource(LAYER)
            .src_offsets([vk::Offset3D::default(), end])
            .dst_subresource(LAYER)
            .dst_offsets([vk::Offset3D::default(), end])];
        let layouts = (vk::ImageLayout::TRANSFER_SRC_OPTIMAL, vk::ImageLayout::TRANSFER_DST_OPTIMAL);
        let (device, nearest) = (&self.context.device, vk::Filter::NEAREST);
        // SAFETY: the commands are being recorded, and what they name lives until they have run.
        unsafe { device.cmd_blit_image(commands, from, layouts.0, to, layouts.1, &region, nearest) };
    }

    fn begin_rendering(
        &self,
        commands: vk::CommandBuffer,
        view: vk::ImageView,
        extent: vk::Extent2D,
        background: [f32; 4],
    ) {
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
        unsafe { self.rendering.cmd_begin_rendering(commands, &info) };
    }

    /// Changes the layout of an image. Earlier commands are done and visible to later ones.
    fn move_image(
        &self,
        commands: vk::CommandBuffer,
        image: vk::Image,
        from: vk::ImageLayout,
        to: vk::ImageLayout,
    ) {
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
        unsafe { self.context.sync2.cmd_pipeline_barrier2(commands, &info) };
    }
}

impl Drop for Frames {
    fn drop(&mut self) {
        let _ = self.context.wait_idle();
        for slot in &self.slots {
            // SAFETY: it is ours, made by this device, and no submission uses it any more.
            unsafe { self.context.device.destroy_semaphore(slot.is_lent, None) };
        }
        // SAFETY: as above.
        unsafe { self.context.device.destroy_command_pool(self.pool, None) };
    }
}

fn refused<T>(result: vk::Result, call: &'static str) -> Result<Answer<T>> {
    match result {
        vk::Result::ERROR_OUT_OF_DATE_KHR => Ok(Answer::OutOfDate),
        vk::Result::ERROR_SURFACE_LOST_KHR => Ok(Answer::SurfaceLost),
        result => Err(result).vk(call),
    }
}
