//! Passes and their dispatches.

use std::any::Any;
use std::ffi::CString;
use std::sync::Arc;

use ash::vk;
use bytemuck::Pod;

use super::super::barrier::{Barrier, Places};
use super::super::hazard::Use;
use super::super::pipeline::variant;
use super::super::pipelines::Missing;
use super::super::program::Program;
use super::super::schedule::{Bound, Command, Workgroups};
use super::super::spirv::Access;
use super::super::{Buffer, Pipeline};
use super::Recorder;
use super::transfers::transfer;
use crate::error::Result;

/// An open pass. Everything recorded through it is timed; it ends when dropped.
pub struct PassScope<'a> {
    recorder: &'a mut Recorder,
    index: usize,
}

/// Size of a dispatch.
enum Size<'a> {
    Threads([u32; 3]),
    /// Workgroup counts: three words at a byte offset of a buffer.
    Indirect(&'a Buffer, u64),
}

impl Recorder {
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
        let index = self.add_pass(name, false);
        PassScope { recorder: self, index }
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
        let variant = variant(program, bindings);
        let Some(handles) = program.handles(variant) else {
            let is_known = |(other, known): &Missing| Arc::ptr_eq(other, program) && *known == variant;
            if !self.missing.iter().any(is_known) {
                self.missing.push((program.clone(), variant));
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
