//! Interactive relighting with full global illumination from precomputed light paths.
#![forbid(unsafe_op_in_unsafe_fn)]

pub mod error;
pub mod layout;
pub mod scene;
pub mod types;

pub use error::{Error, Result};
