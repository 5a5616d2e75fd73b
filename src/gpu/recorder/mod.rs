//! Recording: barriers, commands, submission. `passes.rs` records passes and their dispatches,
//! `transfers.rs` copies, fills and updates.

mod passes;
mod transfers;

use std::any::Any;
use std::sync::Arc;
use std::time::Instant;

use ash::vk;

use super::Context;
use super::barrier::{Barrier, COMPUTE_TO_HOST, SUBMISSION, TRANSFER_TO_HOST};
use super::hazard::{Hazards, Use};
use super::pipelines::Missing;
use super::program::Handles;
use super::schedule::{Bound, Command, Schedule, Workgroups};
use super::submission::Submission;
use super::timing::{PassTiming, milliseconds};
use crate::error::{Error, Result};

pub use passes::PassScope;

/// Bytes that one `vkCmdUpdateBuffer` takes at most.
const UPDATE_BYTES: usize = 65_536;

/// Name of all passes of a free recording together.
pub(super) const FREE: &str = "all passes";

/// Name of a transfer outside of every pass.
const NO_PASS: &str = "transfer";

/// Records the commands of one submission.
pub struct Recorder {
    pub(super) context: Arc<Context>,
    begun: Instant,
    /// `None` only during drop.
    submission: Option<Submission>,
    pub(super) commands: vk::CommandBuffer,
    /// Times of the end of recording and of the submission, while the device may execute it.
    submitted: Option<[Instant; 2]>,
    passes: Vec<PassTiming>,
    /// Numbers of recorded dispatches and barriers, of passes or not.
    dispatches: u32,
    barriers: u32,
    /// The open pass, or the last.
    pass_name: &'static str,
    /// The passes that are recorded. `None`: all of them.
    only: Option<Vec<&'static str>>,
    /// The open pass is not among `only`.
    leaves_out: bool,
    /// The last pass with a dispatch that no barrier followed.
    unfenced: Option<usize>,
    hazards: Option<Hazards>,
    /// Commands of a free recording. `None`: commands are recorded at once, with the barriers that
    /// the caller records.
    schedule: Option<Schedule>,
    /// Some dispatch may write a host flag.
    writes_host_flags: bool,
    /// Some copy writes a block that the host reads.
    copies_to_host: bool,
    host_copy_bytes: u64,
    /// Objects that the commands use. They live until the commands are done, even if the
    /// caller drops them.
    in_use: Vec<Arc<dyn Any>>,
    /// Variants that a dispatch needs and that are not compiled yet; the recording
    /// is then incomplete.
    missing: Vec<Missing>,
    /// The first failure of a call that returns nothing; reported when the recording ends.
    failure: Option<Error>,
}

impl Recorder {
    /// Begins a recording whose order and barriers are the caller's.
    pub(super) fn begin(context: &Arc<Context>) -> Result<Self> {
        Self::begin_with(context, None)
    }

    /// Begins a recording whose commands wait only for their data. It ignores the caller's
    /// barriers, and has one timing for all passes together.
    pub(super) fn begin_free(context: &Arc<Context>) -> Result<Self> {
        Self::begin_with(context, Some(Schedule::default()))
    }

    fn begin_with(context: &Arc<Context>, schedule: Option<Schedule>) -> Result<Self> {
        let begun_at = Instant::now();
        let mut submission = context.take_submission()?;
        let begun = submission.begin(&context.device);
        let mut recorder = Self {
            context: context.clone(),
            begun: begun_at,
            commands: submission.commands,
            submission: Some(submission),
            submitted: None,
            passes: Vec::new(),
            dispatches: 0,
            barriers: 0,
            pass_name: NO_PASS,
            only: None,
            leaves_out: false,
            unfenced: None,
            hazards: (context.has_hazard_check && schedule.is_none()).then(Hazards::default),
            schedule,
            writes_host_flags: false,
            copies_to_host: false,
            host_copy_bytes: 0,
            in_use: Vec::new(),
            missing: Vec::new(),
            failure: None,
        };
        begun?;
        recorder.pipeline_barrier(SUBMISSION);
        Ok(recorder)
    }

    /// Orders earlier commands before later ones.
    pub fn barrier(&mut self, barrier: Barrier) {
        if self.schedule.is_some() {
            return;
        }
        self.unfenced = None;
        if let Some(hazards) = &mut self.hazards {
            hazards.barrier(barrier, self.pass_name);
        }
        self.pipeline_barrier(barrier);
    }

    /// Ends the recording of passes: everything recorded so far is in the command buffer. Draws may
    /// follow, and no passes.
    pub(super) fn end_passes(&mut self) -> Result<()> {
        if let Some(failure) = self.failure.take() {
            return Err(failure);
        }
        if let Some(schedule) = self.schedule.take() {
            self.emit_levels(&schedule);
        }
        // Not reported to the hazard check, which does not track the host.
        if std::mem::take(&mut self.writes_host_flags) {
            self.pipeline_barrier(COMPUTE_TO_HOST);
        }
        if std::mem::take(&mut self.copies_to_host) {
            self.pipeline_barrier(TRANSFER_TO_HOST);
        }
        Ok(())
    }

    /// Ends the recording and submits it. The device waits for the first list of semaphores and
    /// signals the second.
    pub(super) fn submit_commands(&mut self, semaphores: [&[vk::SemaphoreSubmitInfo<'_>]; 2]) -> Result<()> {
        self.end_passes()?;
        let context = &self.context;
        context.count_commands(|counts| {
            counts.submissions += 1;
            counts.dispatches += u64::from(self.dispatches);
            counts.barriers += u64::from(self.barriers);
            counts.host_copy_bytes += self.host_copy_bytes;
        });
        let submission = self.submission.as_ref().expect("taken only in drop");
        let submitted = submission.submit(&context.device, semaphores, |infos, fence| {
            // SAFETY: no other thread has the queue; commands, semaphores and fence live until the
            // fence is waited for.
            context.with_queue(|queue| unsafe { context.sync2.queue_submit2(queue, infos, fence) })
        });
        self.submitted = Some(submitted.map_err(|error| self.with_pass(error))?);
        Ok(())
    }

    /// Waits for the submission, at most `patience_ns`. Returns whether the device is done.
    pub(super) fn wait(&self, patience_ns: u64) -> Result<bool> {
        let submission = self.submission.as_ref().expect("taken only in drop");
        submission.wait(&self.context.device, patience_ns).map_err(|error| self.with_pass(error))
    }

    /// The timings of passes. The submission must be done.
    pub(super) fn timings(&mut self) -> Result<Vec<PassTiming>> {
        let done = Instant::now();
        let [recorded, submitted] = self.submitted.take().expect("it was submitted");
        let submission = self.submission.as_ref().expect("taken only in drop");
        let ticks = submission.timestamps.read(&self.context.device)?;
        let mut timings = std::mem::take(&mut self.passes);
        for (timing, &[begin, end]) in timings.iter_mut().zip(&ticks) {
            timing.ms = milliseconds(begin, end, self.context.limits());
        }
        let host = [self.begun, recorded, submitted, done, Instant::now()];
        let device = (&self.context.optional, self.context.limits());
        self.context.timeline.note_submission(device, host, &timings, &ticks)?;
        let redundant = self.hazards.as_ref().map_or_else(Vec::new, Hazards::redundant);
        self.context.redundant_barriers.lock().expect("no holder panics").extend(redundant);
        Ok(timings)
    }

    /// Adds the last pass to the error of a lost device.
    fn with_pass(&self, error: Error) -> Error {
        match error {
            Error::Vulkan { call, result: result @ vk::Result::ERROR_DEVICE_LOST, .. } => {
                Error::Vulkan { call, result, pass: Some(self.pass_name.into()) }
            }
            other => other,
        }
    }

    /// Records a barrier, as one of the open pass or of the last.
    pub(super) fn pipeline_barrier(&mut self, barrier: Barrier) {
        self.barriers += 1;
        if let Some(pass) = self.passes.last_mut() {
            pass.barriers += 1;
        }
        let memory = [barrier.memory_barrier()];
        let info = vk::DependencyInfo::default().memory_barriers(&memory);
        // SAFETY: the commands are being recorded, and what they name lives until they have run.
        unsafe { self.context.sync2.cmd_pipeline_barrier2(self.commands, &info) };
    }

    fn timestamp(&mut self) {
        let submission = self.submission.as_mut().expect("taken only in drop");
        let device = (&self.context.device, &self.context.sync2, &self.context.names);
        if let Err(error) = submission.timestamps.write(device, self.commands) {
            self.failure.get_or_insert(error);
        }
        if self.context.delays_timestamps() {
            self.pipeline_barrier(SUBMISSION);
        }
    }

    /// Records a command now, or adds it to a free recording. `uses` are the buffers that it uses.
    fn command(&mut self, command: Command, uses: impl FnOnce(&Context) -> Vec<Use>) {
        if let Some(schedule) = &mut self.schedule {
            return schedule.push(command, &uses(&self.context));
        }
        if let Some(hazards) = &mut self.hazards {
            hazards.command(self.pass_name, &uses(&self.context));
        }
        self.emit(&command);
    }

    /// Records the commands of a free recording, with a barrier between two levels, and a timestamp
    /// before and after all of them.
    fn emit_levels(&mut self, schedule: &Schedule) {
        self.timestamp();
        let all = self.add_pass(FREE, true);
        for (index, level) in schedule.levels().enumerate() {
            if index > 0 {
                self.pipeline_barrier(SUBMISSION);
            }
            for command in level {
                self.passes[all].dispatches += u32::from(matches!(command, Command::Dispatch { .. }));
                self.emit(command);
            }
        }
        self.timestamp();
    }

    /// Adds a pass without commands, and returns its index. The first one has the barriers before.
    fn add_pass(&mut self, name: &'static str, overlapped: bool) -> usize {
        let index = self.passes.len();
        let barriers = if index == 0 { self.barriers } else { 0 };
        self.passes.push(PassTiming { name, ms: 0.0, overlapped, dispatches: 0, barriers });
        index
    }

    fn emit(&mut self, command: &Command) {
        self.dispatches += u32::from(matches!(command, Command::Dispatch { .. }));
        let (device, commands) = (&self.context.device, self.commands);
        // SAFETY: the commands are being recorded, and what they name lives until they have run.
        unsafe {
            match command {
                Command::Fill { buffer, bytes } => device.cmd_fill_buffer(commands, *buffer, 0, *bytes, 0),
                Command::Copy { from, to, region } => {
                    device.cmd_copy_buffer(commands, *from, *to, std::slice::from_ref(region));
                }
                Command::Update { buffer, data } => {
                    for (part, data) in data.chunks(UPDATE_BYTES).enumerate() {
                        device.cmd_update_buffer(commands, *buffer, (part * UPDATE_BYTES) as u64, data);
                    }
                }
                Command::Dispatch { handles, push, bound, workgroups } => {
                    self.emit_dispatch(*handles, push, bound, workgroups);
                }
            }
        }
    }

    fn emit_dispatch(&self, handles: Handles, push: &[u8], bound: &[(u32, Bound)], workgroups: &Workgroups) {
        let writes: Vec<_> = bound
            .iter()
            .map(|(binding, bound)| {
                let write = vk::WriteDescriptorSet::default().dst_binding(*binding);
                match bound {
                    Bound::Storage(info) => write
                        .descriptor_type(vk::DescriptorType::STORAGE_BUFFER)
                        .buffer_info(std::slice::from_ref(info)),
                    Bound::Texels(view) => write
                        .descriptor_type(vk::DescriptorType::UNIFORM_TEXEL_BUFFER)
                        .texel_buffer_view(std::slice::from_ref(view)),
                }
            })
            .collect();
        let (device, point) = (&self.context.device, vk::PipelineBindPoint::COMPUTE);
        // SAFETY: the commands are being recorded, and what they name lives until they have run.
        unsafe {
            device.cmd_bind_pipeline(self.commands, point, handles.pipeline);
            if !writes.is_empty() {
                let push_descriptor = &self.context.push_descriptor;
                push_descriptor.cmd_push_descriptor_set(self.commands, point, handles.layout, 0, &writes);
            }
            if !push.is_empty() {
                let stages = vk::ShaderStageFlags::COMPUTE;
                device.cmd_push_constants(self.commands, handles.layout, stages, 0, push);
            }
            match *workgroups {
                Workgroups::Direct([x, y, z]) => device.cmd_dispatch(self.commands, x, y, z),
                Workgroups::Indirect(counts, offset) => {
                    device.cmd_dispatch_indirect(self.commands, counts, offset);
                }
            }
        }
    }

    /// Variants that must be compiled before this recording can be submitted; each once.
    pub(super) fn take_missing(&mut self) -> Result<Vec<Missing>> {
        self.failure.take().map_or_else(|| Ok(std::mem::take(&mut self.missing)), Err)
    }
}

impl Drop for Recorder {
    fn drop(&mut self) {
        if let Some(submission) = self.submission.take() {
            if self.submitted.is_some() {
                // An error leaves the device idle or lost.
                let _ = submission.wait(&self.context.device, u64::MAX);
            }
            self.context.give_back_submission(submission);
        }
    }
}
