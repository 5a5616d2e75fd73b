//! Names of buffers in messages, with the hint for whoever runs out of memory.

use crate::error::Error;

/// Name of a buffer, and the hint that follows if the device lacks memory for it.
#[derive(Clone, Copy, Debug)]
pub struct BufferName<'a> {
    /// As messages and profilers print it.
    pub name: &'a str,
    /// What needs less memory.
    pub hint: &'static str,
}

impl<'a> From<&'a str> for BufferName<'a> {
    fn from(name: &'a str) -> Self {
        Self { name, hint: Error::SMALLER }
    }
}
