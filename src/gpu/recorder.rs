//! Recording: passes, dispatches, barriers, transfers.

use std::any::Any;
use std::ffi::CString;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Instant;

use ash::vk;
use bytemuck::Pod;

use super::barrier::{Barrier, COMPUTE_TO_HOST, Places, SUBMISSION, TRANSFER_TO_HOST};
use super::hazard::{Hazards, Use};
use super::pipeline::uses_buffer_device_address;
use super::pipelines::Missing;
use super::program::{Handles, Program};
use super::schedule::{Bound, Command, Schedule, Workgroups};
use super::spirv::Access;
use super::submission::Submission;
use super::timing::{PassTiming, milliseconds};
use super::{Buffer, Context, HostBlock, HostUpload, Pipeline};
use crate::error::{Error, Result};

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
    /// Objects that the commands use. They live until the commands are done, even if the
    /// caller drops them.
    in_use: Vec<Arc<dyn Any>>,
    /// Variants that a dispatch needs and that are not compiled yet; the recording
    /// is then incomplete.
    missing: Vec<Missing>,
    /// The first failure of a call that returns nothing; reported when the recording ends.
    failure: Option<Error>,
}

/// An open pass. Everything recorded through it is timed; it ends when dropped.
pub struct PassScope<'a> {
    recorder: &'a mut Recorder,
    index: usize,
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
        let recorder = Self {
            context: context.clone(),
            begun: begun_at,
            commands: submission.commands,
            submission: Some(submission),
            submitted: None,
            passes: Vec::new(),
            pass_name: NO_PASS,
            only: None,
            leaves_out: false,
            unfenced: None,
            hazards: (context.has_hazard_check && schedule.is_none()).then(Hazards::default),
            schedule,
            writes_host_flags: false,
            copies_to_host: false,
            in_use: Vec::new(),
            missing: Vec::new(),
            failure: None,
        };
        begun?;
        recorder.pipeline_barrier(SUBMISSION);
        Ok(recorder)
    }

    /// Records only commands of these passes from here on. Barriers of all other passes stay, so
    /// that the order is the same.
    pub fn only(&mut self, passes: &[&'static str]) {
        (self.only, self.leaves_out) = (Some(passes.to_vec()), true);
    }

    /// Opens a pass: a debug label, a timestamp before and one after, a row in the timings. `name`
    /// is the pass's stem.
    pub fn pass(&mut self, name: &'static str) -> PassScope<'_> {
        self.pass_name = name;
        self.leaves_out = self.only.as_ref().is_some_and(|only| !only.contains(&name));
        if self.leaves_out {
            return PassScope { recorder: self, index: usize::MAX };
        }
        if self.schedule.is_some() {
            return PassScope { recorder: self, index: usize::MAX };
        }
        if let Some(debug_utils) = &self.context.names.0 {
            let label = CString::new(name).expect("names hold no NUL");
            let info = vk::DebugUtilsLabelEXT::default().label_name(&label);
            // SAFETY: the commands are being recorded, and what they name lives until
            // they have run.
            unsafe { debug_utils.cmd_begin_debug_utils_label(self.commands, &info) };
        }
        self.timestamp();
        let index = self.passes.len();
        self.passes.push(PassTiming { name, ms: 0.0, overlapped: false, dispatches: 0 });
        PassScope { recorder: self, index }
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

    /// Sets every byte of the buffer to zero. A transfer.
    pub fn fill_zero(&mut self, buffer: &Buffer) {
        if self.leaves_out {
            return;
        }
        self.in_use.push(buffer.allocated.clone());
        let (buffer_handle, bytes) = (buffer.allocated.handle, buffer.allocated.bound_bytes);
        self.command(Command::Fill { buffer: buffer_handle, bytes }, |_| vec![transfer(buffer, true)]);
    }

    /// Copies the whole of `from` to the start of `to`. A transfer. Panics if `to` is smaller.
    pub fn copy(&mut self, from: &Buffer, to: &Buffer) {
        self.copy_bytes(from, 0, to, 0, from.bytes());
    }

    pub(super) fn copy_bytes(&mut self, from: &Buffer, first: u64, to: &Buffer, to_first: u64, bytes: u64) {
        let uses = |_: &Context| vec![transfer(from, false), transfer(to, true)];
        self.copy_range(from, first, to, to_first, bytes, uses);
    }

    fn copy_range(
        &mut self,
        from: &Buffer,
        first: u64,
        to: &Buffer,
        to_first: u64,
        bytes: u64,
        uses: impl FnOnce(&Context) -> Vec<Use>,
    ) {
        assert!(
            first + bytes <= from.bytes() && to_first + bytes <= to.bytes(),
            "cannot copy {bytes} bytes from `{}` to `{}`",
            from.allocated.name,
            to.allocated.name
        );
        if bytes == 0 || self.leaves_out {
            return;
        }
        self.in_use.extend([from, to].map(|buffer| buffer.allocated.clone() as Arc<dyn Any>));
        let region = vk::BufferCopy { src_offset: first, dst_offset: to_first, size: bytes };
        let (from, to) = (from.allocated.handle, to.allocated.handle);
        self.command(Command::Copy { from, to, region }, uses);
    }

    /// Overwrites the start of the buffer with `data`, which travels within the commands. For small
    /// data: edits, not scenes. A transfer. Panics if the data are longer than the buffer.
    pub fn upload<T: Pod>(&mut self, buffer: &Buffer, data: &[T]) {
        let (bytes, name) = (bytemuck::cast_slice::<T, u8>(data), &buffer.allocated.name);
        assert!(bytes.len() as u64 <= buffer.bytes(), "`{name}` is shorter than {} bytes", bytes.len());
        assert!(bytes.len().is_multiple_of(4), "`{name}`: the device updates whole words");
        if bytes.is_empty() || self.leaves_out {
            return;
        }
        self.in_use.push(buffer.allocated.clone());
        for (index, update) in bytes.chunks(UPDATE_BYTES).enumerate() {
            let (handle, offset) = (buffer.allocated.handle, (index * UPDATE_BYTES) as u64);
            // The check does not track parts of a buffer: these are different ones.
            let uses = if index == 0 { vec![transfer(buffer, true)] } else { Vec::new() };
            self.command(Command::Update { buffer: handle, offset, data: update.to_vec() }, |_| uses);
        }
    }

    /// Copies the first bytes of a list that the host has written to the start of `to`. A transfer.
    /// Panics if one of them is too short.
    pub fn copy_from_host(&mut self, from: &HostUpload, to: &Buffer, bytes: u64) {
        self.copy_bytes(&from.buffer, 0, to, 0, bytes);
    }

    /// Copies `words` words from a byte offset of `from` to word `to` of a block that the host
    /// reads. A transfer. Panics if one of them is too short.
    pub fn copy_to_host(&mut self, from: &Buffer, offset: u64, block: &HostBlock, to: u32, words: u32) {
        // The check tracks neither the host nor words of a buffer: copies go to different words.
        let uses = |_: &Context| vec![transfer(from, false)];
        self.copy_range(from, offset, &block.buffer, 4 * u64::from(to), 4 * u64::from(words), uses);
        self.copies_to_host |= !self.leaves_out;
    }

    /// Keeps a buffer until the commands are done.
    #[cfg(feature = "window")]
    pub(super) fn keep(&mut self, buffer: &Buffer) {
        self.in_use.push(buffer.allocated.clone());
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
        context.submission_count.fetch_add(1, Ordering::Relaxed);
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

    pub(super) fn pipeline_barrier(&self, barrier: Barrier) {
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
        self.passes.push(PassTiming { name: FREE, ms: 0.0, overlapped: true, dispatches: 0 });
        for (index, level) in schedule.levels().enumerate() {
            if index > 0 {
                self.pipeline_barrier(SUBMISSION);
            }
            for command in level {
                self.passes[0].dispatches += u32::from(matches!(command, Command::Dispatch { .. }));
                self.emit(command);
            }
        }
        self.timestamp();
    }

    fn emit(&self, command: &Command) {
        let (device, commands) = (&self.context.device, self.commands);
        // SAFETY: the commands are being recorded, and what they name lives until they have run.
        unsafe {
            match command {
                Command::Fill { buffer, bytes } => device.cmd_fill_buffer(commands, *buffer, 0, *bytes, 0),
                Command::Copy { from, to, region } => {
                    device.cmd_copy_buffer(commands, *from, *to, std::slice::from_ref(region));
                }
                Command::Update { buffer, offset, data } => {
                    device.cmd_update_buffer(commands, *buffer, *offset, data);
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

    /// Records a dispatch. Returns false if the program is not compiled yet, or if its pass is left
    /// out. Panics if push constants and buffers do not match the shader's declarations.
    fn dispatch(
        &mut self,
        program: &Arc<Program>,
        push: &[u8],
        bindings: &[(&str, &Buffer)],
        size: Size<'_>,
    ) -> bool {
        check_bindings(self.pass_name, program, push, bindings);
        if self.leaves_out {
            return false;
        }
        let by_address = uses_buffer_device_address(program, bindings);
        let Some(handles) = program.handles(by_address) else {
            let is_known = |(other, follows): &Missing| Arc::ptr_eq(other, program) && *follows == by_address;
            if !self.missing.iter().any(is_known) {
                self.missing.push((program.clone(), by_address));
            }
            return false;
        };
        let (workgroups, counts) = match size {
            Size::Threads(threads) => (
                Workgroups::Direct(program.workgroups(self.context.tuning(), self.context.limits(), threads)),
                None,
            ),
            Size::Indirect(counts, offset) => {
                (Workgroups::Indirect(counts.allocated.handle, offset), Some(counts))
            }
        };
        self.writes_host_flags |= bindings.iter().any(|(_, buffer)| buffer.is_host_flag());
        self.in_use.push(handles.clone());
        let buffers = bindings.iter().map(|(_, buffer)| *buffer).chain(counts);
        self.in_use.extend(buffers.map(|buffer| buffer.allocated.clone() as Arc<dyn Any>));
        let declared = &program.module.bindings;
        let bound = declared.iter().zip(bindings).map(|(declared, (_, buffer))| {
            let buffer = &buffer.allocated;
            let bound = if declared.is_texels {
                Bound::Texels(buffer.texels()?)
            } else {
                let info = vk::DescriptorBufferInfo::default().buffer(buffer.handle);
                Bound::Storage(info.range(buffer.bound_bytes))
            };
            Ok((declared.binding, bound))
        });
        let bound: Vec<_> = match bound.collect::<Result<_>>() {
            Ok(bound) => bound,
            Err(error) => {
                self.failure.get_or_insert(error);
                return false;
            }
        };
        let (handles, is_free) = (*handles, self.schedule.is_some());
        self.command(Command::Dispatch { handles, push: push.to_vec(), bound, workgroups }, |_| {
            let declared = declared.iter().zip(bindings);
            let mut uses: Vec<Use> = declared
                // Kernels write one value to a host flag, so free recordings do not order them.
                .filter(|(_, (_, buffer))| !is_free || !buffer.is_host_flag())
                .map(|(declared, (name, buffer))| dispatch_use(name, buffer, declared.access))
                .collect();
            uses.extend(counts.map(|buffer| Use { place: Places::INDIRECT, ..transfer(buffer, false) }));
            uses
        });
        true
    }
}

/// Size of a dispatch.
enum Size<'a> {
    Threads([u32; 3]),
    /// Workgroup counts: three words at a byte offset of a buffer.
    Indirect(&'a Buffer, u64),
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

impl PassScope<'_> {
    /// Dispatches the pipeline over `threads` along each axis. If an axis has none, nothing is
    /// recorded. Bindings are listed in the shader's order, with the shader's names. Panics on a
    /// hazard, and if push constants, bindings or the number of workgroups do not fit the shader
    /// or the device.
    pub fn dispatch<P: Pod>(
        &mut self,
        pipeline: &Pipeline,
        threads: [u32; 3],
        push: &P,
        bindings: &[(&str, &Buffer)],
    ) -> &mut Self {
        if threads.contains(&0) {
            check_bindings(self.recorder.pass_name, pipeline.program(), bytemuck::bytes_of(push), bindings);
            return self;
        }
        let push = bytemuck::bytes_of(push);
        if self.recorder.dispatch(pipeline.program(), push, bindings, Size::Threads(threads)) {
            self.count_dispatch();
        }
        self
    }

    /// As [`Self::dispatch`], but the device reads the number of *workgroups* along each axis:
    /// three words at a byte offset of a buffer.
    pub fn dispatch_indirect<P: Pod>(
        &mut self,
        pipeline: &Pipeline,
        (counts, offset): (&Buffer, u64),
        push: &P,
        bindings: &[(&str, &Buffer)],
    ) -> &mut Self {
        let is_inside = offset.is_multiple_of(4) && offset + 12 <= counts.bytes();
        assert!(
            is_inside,
            "`{}`: no workgroup counts at byte {offset} of `{}`",
            pipeline.program().stem,
            counts.allocated.name
        );
        let size = Size::Indirect(counts, offset);
        if self.recorder.dispatch(pipeline.program(), bytemuck::bytes_of(push), bindings, size) {
            self.count_dispatch();
        }
        self
    }

    /// Orders this pass's earlier dispatches before its later ones.
    pub fn barrier(&mut self, barrier: Barrier) -> &mut Self {
        self.recorder.barrier(barrier);
        self
    }

    /// As [`Recorder::fill_zero`], within this pass.
    pub fn fill_zero(&mut self, buffer: &Buffer) -> &mut Self {
        self.recorder.fill_zero(buffer);
        self
    }

    /// As [`Recorder::upload`], within this pass.
    pub fn upload<T: Pod>(&mut self, buffer: &Buffer, data: &[T]) -> &mut Self {
        self.recorder.upload(buffer, data);
        self
    }

    /// As [`Recorder::copy`], within this pass.
    pub fn copy(&mut self, from: &Buffer, to: &Buffer) -> &mut Self {
        self.recorder.copy(from, to);
        self
    }

    fn count_dispatch(&mut self) {
        let recorder = &mut *self.recorder;
        if recorder.schedule.is_some() {
            return;
        }
        recorder.passes[self.index].dispatches += 1;
        if let Some(neighbour) = recorder.unfenced.replace(self.index).filter(|&other| other != self.index) {
            recorder.passes[neighbour].overlapped = true;
            recorder.passes[self.index].overlapped = true;
        }
    }
}

impl Drop for PassScope<'_> {
    fn drop(&mut self) {
        if self.recorder.leaves_out || self.recorder.schedule.is_some() {
            return;
        }
        self.recorder.leaves_out = self.recorder.only.is_some();
        self.recorder.timestamp();
        if let Some(debug_utils) = &self.recorder.context.names.0 {
            // SAFETY: the commands are being recorded, and what they name lives until
            // they have run.
            unsafe { debug_utils.cmd_end_debug_utils_label(self.recorder.commands) };
        }
    }
}

fn check_bindings(pass: &str, program: &Program, push: &[u8], bindings: &[(&str, &Buffer)]) {
    let (stem, module) = (program.stem, &program.module);
    let push_size = module.push.as_ref().map_or(0, |push| push.size as usize);
    assert_eq!(push.len(), push_size, "`{pass}`: bytes of push constants given, and declared by `{stem}`");
    let declared: Vec<&str> = module.bindings.iter().map(|binding| binding.name.as_str()).collect();
    let is_same = declared.len() == bindings.len()
        && declared.iter().zip(bindings).all(|(declared, (given, _))| declared == given);
    assert!(
        is_same,
        "`{pass}`: `{stem}` binds {declared:?}, given {:?}",
        bindings.iter().map(|(name, _)| *name).collect::<Vec<_>>()
    );
}

fn dispatch_use(name: &str, buffer: &Buffer, access: Access) -> Use {
    Use {
        buffer: vk::Handle::as_raw(buffer.allocated.handle),
        name: name.into(),
        place: Places::COMPUTE,
        reads: access != Access::Write,
        writes: access != Access::Read,
    }
}

fn transfer(buffer: &Buffer, writes: bool) -> Use {
    Use {
        buffer: vk::Handle::as_raw(buffer.allocated.handle),
        name: buffer.allocated.name.clone(),
        place: Places::TRANSFER,
        reads: !writes,
        writes,
    }
}
