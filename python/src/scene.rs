//! Scenes, as they are loaded.

use std::path::PathBuf;

use lightpaths::glam::Vec3;
use lightpaths::{Error, LoadOptions, Place, Up};
use pyo3::prelude::*;

use crate::arrays::{Triple, triple};
use crate::errors::raised;

/// A scene: a file, a model, or a built-in scene.
#[pyclass(frozen, module = "lightpaths")]
pub(crate) struct Scene {
    pub(crate) scene: lightpaths::Scene,
}

fn one_of<T: Copy>(what: &str, choices: [(&str, T); 2], word: Option<&str>) -> lightpaths::Result<Option<T>> {
    let Some(word) = word else { return Ok(None) };
    let found = choices.iter().find(|(known, _)| *known == word);
    let [(first, _), (second, _)] = choices;
    let refusal = || Error::Usage(format!("{what} must be `{first}` or `{second}`, found `{word}`"));
    found.map(|(_, choice)| Some(*choice)).ok_or_else(refusal)
}

#[pymethods]
impl Scene {
    #[new]
    #[pyo3(signature = (source, *, preset=None, size=None, camera=None, set=Vec::new(), place=None, up=None, allow_outside=false))]
    #[expect(clippy::too_many_arguments, reason = "each is a keyword")]
    fn new(
        py: Python<'_>,
        source: PathBuf,
        preset: Option<String>,
        size: Option<[u32; 2]>,
        camera: Option<String>,
        set: Vec<String>,
        place: Option<&str>,
        up: Option<&str>,
        allow_outside: bool,
    ) -> PyResult<Self> {
        let place = one_of("place", [("inside", Place::Inside), ("outside", Place::Outside)], place);
        let up = one_of("up", [("y", Up::Y), ("z", Up::Z)], up).map_err(raised)?;
        let place = place.map_err(raised)?;
        let options = LoadOptions { set, preset, size, camera, allow_outside, place, up, memory: None };
        let source = source.to_string_lossy();
        let scene = py.detach(|| lightpaths::Scene::load(&source, &options)).map_err(raised)?;
        Ok(Self { scene })
    }

    #[getter]
    fn name(&self) -> &str {
        &self.scene.name
    }

    #[getter]
    fn lights(&self) -> Vec<&str> {
        self.scene.lights.iter().map(|light| light.name.as_str()).collect()
    }

    #[getter]
    fn materials(&self) -> Vec<&str> {
        self.scene.materials.iter().map(|material| material.name.as_str()).collect()
    }

    #[getter]
    fn cameras(&self) -> Vec<&str> {
        self.scene.cameras.iter().map(|camera| camera.name.as_str()).collect()
    }

    #[getter]
    fn meters(&self) -> Vec<&str> {
        self.scene.meters.iter().map(|meter| meter.name.as_str()).collect()
    }

    #[getter]
    fn size(&self) -> (u32, u32) {
        self.scene.cameras[0].size.into()
    }

    #[getter]
    fn triangle_count(&self) -> usize {
        self.scene.triangles.len()
    }

    /// Smallest and largest corner, in the coordinates of the file.
    #[getter]
    fn bounds(&self) -> (Triple, Triple) {
        let in_file = |corner: Vec3| triple(self.scene.in_file(corner));
        let (low, high) = self.scene.bounds();
        (in_file(low), in_file(high))
    }

    #[getter]
    fn warnings(&self) -> Vec<&str> {
        self.scene.warnings.iter().map(String::as_str).collect()
    }

    fn __repr__(&self) -> String {
        format!("<lightpaths.Scene {:?}: {} triangles>", self.scene.name, self.scene.triangles.len())
    }
}
