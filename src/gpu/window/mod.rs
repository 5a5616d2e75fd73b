//! Pictures in a window of the system: a surface, its swapchain, and the panels over it.
//!
//! A [`WindowPainter`] owns the pictures and panels. It copies pictures from the buffers of compute
//! passes into images that the panels' triangles sample, so one draw shows both. The target of the
//! draw encodes sRGB, so that a picture's bytes reach the screen unchanged. The target is the
//! swapchain's image, or a canvas that is copied to it if the image does not encode sRGB. Passes,
//! copies and draws of a frame are one submission, and two frames may be in flight.

mod frame;
mod image;
mod painter;
mod picture;
mod surface;
mod swapchain;

pub use frame::FRAMES;
pub use painter::{Check, Painting, Shown, Verdict, WindowPainter};
pub use picture::PictureId;
pub use surface::{Surface, WindowHandles};
