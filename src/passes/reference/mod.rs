//! Passes of the reference renderers.

pub mod path_trace;
