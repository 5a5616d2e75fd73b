//! The camera of a renderer, in the coordinates of the file.

use lightpaths::glam::DVec3;
use lightpaths::unit_direction;
use pyo3::prelude::*;

use crate::arrays::{Triple, triple, triple_f32};
use crate::shared::Shared;

/// The camera of a renderer.
#[pyclass(frozen, module = "lightpaths")]
pub(crate) struct Camera(pub(crate) Shared);

impl Camera {
    fn get<T: Send>(
        &self,
        py: Python<'_>,
        read: impl FnOnce(&lightpaths::Scene, &lightpaths::Camera) -> T + Send,
    ) -> PyResult<T> {
        self.0.with(py, |state| {
            let scene = state.renderer.scene();
            Ok(read(scene, &scene.cameras[0]))
        })
    }

    fn edit(
        &self,
        py: Python<'_>,
        edit: impl FnOnce(&lightpaths::Scene, &mut lightpaths::Camera) + Send,
    ) -> PyResult<()> {
        self.0.with(py, |state| {
            let scene = state.renderer.scene();
            let mut camera = scene.cameras[0].clone();
            edit(scene, &mut camera);
            camera.check()?;
            state.renderer.set_camera(&camera);
            Ok(())
        })
    }
}

#[pymethods]
impl Camera {
    #[getter]
    fn name(&self, py: Python<'_>) -> PyResult<String> {
        self.get(py, |_, camera| camera.name.clone())
    }

    #[getter]
    fn position(&self, py: Python<'_>) -> PyResult<Triple> {
        self.get(py, |scene, camera| triple(scene.in_file(camera.position)))
    }

    #[setter]
    fn set_position(&self, py: Python<'_>, to: [f64; 3]) -> PyResult<()> {
        self.edit(py, |scene, camera| camera.position = scene.recentred(DVec3::from(to)))
    }

    #[getter]
    fn target(&self, py: Python<'_>) -> PyResult<Triple> {
        self.get(py, |scene, camera| triple(scene.in_file(camera.target)))
    }

    #[setter]
    fn set_target(&self, py: Python<'_>, to: [f64; 3]) -> PyResult<()> {
        self.edit(py, |scene, camera| camera.target = scene.recentred(DVec3::from(to)))
    }

    #[getter]
    fn up(&self, py: Python<'_>) -> PyResult<Triple> {
        self.get(py, |_, camera| triple_f32(camera.up))
    }

    #[setter]
    fn set_up(&self, py: Python<'_>, up: [f64; 3]) -> PyResult<()> {
        // As a scene file's: a zero vector stays, and is refused.
        let up = DVec3::from(up);
        self.edit(py, |_, camera| camera.up = unit_direction(up).unwrap_or_default())
    }

    #[getter]
    fn fov_y(&self, py: Python<'_>) -> PyResult<f64> {
        self.get(py, |_, camera| camera.fov_y_degrees.into())
    }

    #[setter]
    fn set_fov_y(&self, py: Python<'_>, degrees: f64) -> PyResult<()> {
        self.edit(py, |_, camera| camera.fov_y_degrees = degrees as f32)
    }

    /// Sets position and target at once.
    fn look(&self, py: Python<'_>, position: [f64; 3], target: [f64; 3]) -> PyResult<()> {
        self.edit(py, |scene, camera| {
            camera.position = scene.recentred(DVec3::from(position));
            camera.target = scene.recentred(DVec3::from(target));
        })
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        let (position, target) = (self.position(py)?, self.target(py)?);
        Ok(format!("<lightpaths.Camera at {position:?}, target {target:?}>"))
    }
}
