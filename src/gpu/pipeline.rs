//! Compute pipelines: handles to programs, which the whole context shares.

use std::sync::Arc;

use super::program::Program;
use super::spirv::USE_BUFFER_DEVICE_ADDRESS;
use super::{Buffer, Context};
use crate::error::Result;

/// A compute pipeline. Clones, and pipelines of the same shader and constants, share one program.
#[derive(Clone)]
pub struct Pipeline(Arc<Program>);

impl Pipeline {
    /// The embedded shader `stem` with a value for each of its specialisation constants, by name;
    /// floats are passed as bits. Constants of [`super::Tuning`] may be left out. Panics if others
    /// are missing or any is unknown.
    ///
    /// # Errors
    /// The shader exceeds the device's limits.
    pub fn new(context: &Context, stem: &'static str, constants: &[(&str, u32)]) -> Result<Self> {
        context.pipelines.program(stem, constants, context.tuning(), context.limits()).map(Self)
    }

    /// Invocations of a workgroup along each axis.
    pub fn local_size(&self) -> [u32; 3] {
        self.0.module.local_size
    }

    pub(super) fn program(&self) -> &Arc<Program> {
        &self.0
    }
}

/// Whether these bindings need the variant of a program that reads lists through addresses. Panics
/// if the shader has no such variant.
pub(super) fn uses_buffer_device_address(program: &Program, bindings: &[(&str, &Buffer)]) -> bool {
    let follows = bindings.iter().any(|(_, buffer)| buffer.holds_address());
    let constants = &program.module.constants;
    let knows = || constants.iter().any(|constant| constant.name == USE_BUFFER_DEVICE_ADDRESS);
    assert!(!follows || knows(), "`{}` does not follow addresses", program.stem);
    follows
}
