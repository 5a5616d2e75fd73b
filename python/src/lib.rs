//! The Python module `lightpaths._lightpaths`: scenes, and renderers whose pictures are numpy
//! arrays. All logic is the library's. See docs/python.md.
#![forbid(unsafe_op_in_unsafe_fn)]

mod arrays;
mod camera;
mod errors;
mod lights;
mod materials;
mod progress;
mod readings;
mod renderer;
mod scene;
mod shared;

use pyo3::prelude::*;

#[pymodule]
mod _lightpaths {
    #[pymodule_export]
    use super::camera::Camera;
    #[pymodule_export]
    use super::lights::{Light, Lights};
    #[pymodule_export]
    use super::materials::{Material, Materials};
    #[pymodule_export]
    use super::readings::Reading;
    #[pymodule_export]
    use super::renderer::Renderer;
    #[pymodule_export]
    use super::scene::Scene;
    #[pymodule_export]
    #[expect(non_upper_case_globals, reason = "Python's name for it")]
    const __version__: &str = env!("CARGO_PKG_VERSION");
}
