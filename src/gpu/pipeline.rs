//! Compute pipelines: handles to programs, which the whole context shares.

use std::sync::Arc;

use super::program::{Program, Variant};
use super::spirv::{FROM_BINDINGS, USE_BUFFER_DEVICE_ADDRESS};
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

/// The variant of a program that these bindings need. Panics if a list is behind an address and the
/// shader has no variant for it.
pub(super) fn variant(program: &Program, bindings: &[(&str, &Buffer)]) -> Variant {
    let constants = &program.module.constants;
    let knows = |name: &str| constants.iter().any(|constant| constant.name == name);
    let asks = |name: &str| bindings.iter().any(|(_, buffer)| buffer.needs_constant(name));
    let (follows, stem) = (asks(USE_BUFFER_DEVICE_ADDRESS), program.stem);
    assert!(!follows || knows(USE_BUFFER_DEVICE_ADDRESS), "`{stem}` does not follow addresses");
    Variant(FROM_BINDINGS.map(|name| asks(name) && knows(name)))
}
