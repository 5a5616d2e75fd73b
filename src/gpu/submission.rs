//! One command buffer, with the objects to submit it and to wait for it.

use std::time::Instant;

use ash::prelude::VkResult;
use ash::vk;

use super::VkResultExt;
use super::names::Names;
use super::timing::Timestamps;
use crate::error::Result;

/// One recording at a time uses it; later ones reuse it.
pub(super) struct Submission {
    pool: vk::CommandPool,
    pub(super) commands: vk::CommandBuffer,
    fence: vk::Fence,
    pub(super) timestamps: Timestamps,
}

impl Submission {
    pub(super) fn new(device: &ash::Device, names: &Names, queue_family: u32) -> Result<Self> {
        let info = vk::CommandPoolCreateInfo::default()
            .flags(vk::CommandPoolCreateFlags::TRANSIENT)
            .queue_family_index(queue_family);
        // SAFETY: the device and every object in the description are alive.
        let pool = unsafe { device.create_command_pool(&info, None) }.vk("vkCreateCommandPool")?;
        let rest = Self::commands_and_fence(device, pool);
        if rest.is_err() {
            // SAFETY: nothing was recorded yet; its command buffer goes with it.
            unsafe { device.destroy_command_pool(pool, None) };
        }
        let (commands, fence) = rest?;
        names.set_name(pool, "recording");
        names.set_name(commands, "recording");
        names.set_name(fence, "recording is done");
        Ok(Self { pool, commands, fence, timestamps: Timestamps::default() })
    }

    fn commands_and_fence(
        device: &ash::Device,
        pool: vk::CommandPool,
    ) -> Result<(vk::CommandBuffer, vk::Fence)> {
        let info = vk::CommandBufferAllocateInfo::default().command_pool(pool).command_buffer_count(1);
        // SAFETY: the device and every object in the description are alive.
        let commands = unsafe { device.allocate_command_buffers(&info) };
        let commands = commands.vk("vkAllocateCommandBuffers")?[0];
        // SAFETY: the device and every object in the description are alive.
        let fence = unsafe { device.create_fence(&vk::FenceCreateInfo::default(), None) };
        Ok((commands, fence.vk("vkCreateFence")?))
    }

    /// Begins a new recording. The submission before must be done.
    pub(super) fn begin(&mut self, device: &ash::Device) -> Result<()> {
        self.timestamps.reset(device);
        // SAFETY: no submission uses them any more.
        unsafe {
            device
                .reset_command_pool(self.pool, vk::CommandPoolResetFlags::empty())
                .vk("vkResetCommandPool")?;
            device.reset_fences(&[self.fence]).vk("vkResetFences")?;
        }
        let info = vk::CommandBufferBeginInfo::default().flags(vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT);
        // SAFETY: the commands are ours, and no submission uses them any more.
        unsafe { device.begin_command_buffer(self.commands, &info) }.vk("vkBeginCommandBuffer")
    }

    /// Ends the recording and submits it. The device waits for the first list of semaphores and
    /// signals the second. Returns the times of the end of recording and of the submission.
    /// `submit` gives the commands to the queue.
    pub(super) fn submit(
        &self,
        device: &ash::Device,
        [wait, signal]: [&[vk::SemaphoreSubmitInfo<'_>]; 2],
        submit: impl FnOnce(&[vk::SubmitInfo2<'_>], vk::Fence) -> VkResult<()>,
    ) -> Result<[Instant; 2]> {
        // SAFETY: the commands are ours, and are being recorded.
        unsafe { device.end_command_buffer(self.commands) }.vk("vkEndCommandBuffer")?;
        let recorded = Instant::now();
        let commands = [vk::CommandBufferSubmitInfo::default().command_buffer(self.commands)];
        let infos = [vk::SubmitInfo2::default()
            .wait_semaphore_infos(wait)
            .command_buffer_infos(&commands)
            .signal_semaphore_infos(signal)];
        submit(&infos, self.fence).vk("vkQueueSubmit2")?;
        Ok([recorded, Instant::now()])
    }

    /// Waits until the device is done with the submission, at most `patience_ns`. Returns false if
    /// the time is over.
    pub(super) fn wait(&self, device: &ash::Device, patience_ns: u64) -> Result<bool> {
        // SAFETY: the device is alive; whoever holds the queue waits for it.
        match unsafe { device.wait_for_fences(&[self.fence], true, patience_ns) } {
            Ok(()) => Ok(true),
            Err(vk::Result::TIMEOUT) => Ok(false),
            Err(result) => {
                // Objects may be reused or destroyed only after the device is done with them, or
                // lost.
                // SAFETY: the device is alive; whoever holds the queue waits for it.
                let _ = unsafe { device.device_wait_idle() };
                Err(result).vk("vkWaitForFences")
            }
        }
    }

    /// Destroys the objects. The device must be done with them.
    pub(super) fn destroy(mut self, device: &ash::Device) {
        self.timestamps.destroy(device);
        // SAFETY: it is ours, made by this device, and no submission uses it any more.
        unsafe {
            device.destroy_fence(self.fence, None);
            device.destroy_command_pool(self.pool, None);
        }
    }
}
