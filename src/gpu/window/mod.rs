//! Pictures in a window of the system: a surface, its swapchain, and the panels over it.
//!
//! A [`WindowPainter`] owns what is shown. Pictures are copied from the buffers that compute passes
//! wrote into images that the panels' triangles sample, so that one draw shows both. What is drawn
//! to encodes sRGB, so that a picture's bytes reach the screen unchanged: the swapchain's images,
//! or a canvas that is copied to those where they do not. One frame is under way at a time: the
//! picture that is shown is the one that was asked for last.

mod frame;
mod image;
mod painter;
mod picture;
mod surface;
mod swapchain;

pub use painter::{Painting, Shown, WindowPainter};
pub use picture::PictureId;
pub(super) use surface::RawSurface;
pub use surface::{Surface, WindowHandles};
