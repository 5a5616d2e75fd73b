#![doc = include_str!("../docs/library.md")]
#![forbid(unsafe_op_in_unsafe_fn)]

// Hidden modules are for the program and the tests of this repository. They carry no promise.
#[doc(hidden)]
#[forbid(unsafe_code)]
pub mod app;
#[doc(hidden)]
#[forbid(unsafe_code)]
pub mod cache_file;
#[doc(hidden)]
#[forbid(unsafe_code)]
pub mod cpu;
#[doc(hidden)]
#[forbid(unsafe_code)]
pub mod error;
#[forbid(unsafe_code)]
mod files;
#[doc(hidden)]
pub mod gpu;
#[doc(hidden)]
#[forbid(unsafe_code)]
pub mod image;
#[doc(hidden)]
#[forbid(unsafe_code)]
pub mod layout;
#[doc(hidden)]
#[forbid(unsafe_code)]
pub mod metrics;
#[doc(hidden)]
#[forbid(unsafe_code)]
pub mod passes;
#[doc(hidden)]
#[forbid(unsafe_code)]
pub mod reference;
#[doc(hidden)]
#[forbid(unsafe_code)]
pub mod renderer;
#[doc(hidden)]
#[forbid(unsafe_code)]
pub mod scene;
#[doc(hidden)]
#[forbid(unsafe_code)]
pub mod types;

// The public interface: at most thirty items, which `tests/interface.rs` counts.
pub use cache_file::Folder;
pub use error::{Error, Result};
pub use glam;
pub use gpu::{Context, ContextOptions};
pub use renderer::{FrameReport, Layer, LightPicture, Measured, Progress, Reading, Renderer, Silent, Store};
pub use scene::meter::{Meter, MeterShape};
pub use scene::photometry::lux;
pub use scene::{
    Camera, DisplayTransform, Light, LightKind, LoadOptions, Material, Place, Quality, Scene, ToneCurve, Up,
    unit_direction,
};
