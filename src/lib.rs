//! Interactive relighting with full global illumination from precomputed light paths.
#![forbid(unsafe_op_in_unsafe_fn)]

#[forbid(unsafe_code)]
pub mod app;
#[forbid(unsafe_code)]
pub mod cache_file;
#[forbid(unsafe_code)]
pub mod cpu;
#[forbid(unsafe_code)]
pub mod error;
#[forbid(unsafe_code)]
mod files;
pub mod gpu;
#[forbid(unsafe_code)]
pub mod image;
#[forbid(unsafe_code)]
pub mod layout;
#[forbid(unsafe_code)]
pub mod metrics;
#[forbid(unsafe_code)]
pub mod passes;
#[forbid(unsafe_code)]
pub mod reference;
#[forbid(unsafe_code)]
pub mod renderer;
#[forbid(unsafe_code)]
pub mod scene;
#[forbid(unsafe_code)]
pub mod types;

pub use error::{Error, Result};
