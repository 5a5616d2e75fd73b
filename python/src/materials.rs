//! Materials of a renderer.

use pyo3::prelude::*;

use crate::arrays::{Colour, Triple, triple_f32};
use crate::errors::unknown_name;
use crate::shared::Shared;

/// The materials of a renderer, by name.
#[pyclass(frozen, mapping, module = "lightpaths")]
pub(crate) struct Materials(pub(crate) Shared);

impl Materials {
    fn names(&self, py: Python<'_>) -> PyResult<Vec<String>> {
        self.0.with(py, |state| {
            Ok(state.renderer.scene().materials.iter().map(|material| material.name.clone()).collect())
        })
    }
}

#[pymethods]
impl Materials {
    fn __getitem__(&self, py: Python<'_>, name: String) -> PyResult<Material> {
        let found = self.0.with(py, |state| Ok(state.renderer.scene().material_named(&name)))?;
        found.map_err(|error| unknown_name(&error))?;
        Ok(Material { shared: self.0.clone(), name })
    }

    fn __len__(&self, py: Python<'_>) -> PyResult<usize> {
        Ok(self.names(py)?.len())
    }

    fn __contains__(&self, py: Python<'_>, name: &str) -> PyResult<bool> {
        Ok(self.names(py)?.iter().any(|known| known == name))
    }

    fn __iter__(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        Ok(self.keys(py)?.into_pyobject(py)?.try_iter()?.into_any().unbind())
    }

    fn keys(&self, py: Python<'_>) -> PyResult<Vec<String>> {
        self.names(py)
    }

    fn values(&self, py: Python<'_>) -> PyResult<Vec<Material>> {
        self.names(py)?.into_iter().map(|name| self.__getitem__(py, name)).collect()
    }

    fn items(&self, py: Python<'_>) -> PyResult<Vec<(String, Material)>> {
        Ok(self.names(py)?.into_iter().zip(self.values(py)?).collect())
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        Ok(format!("<lightpaths.Materials {:?}>", self.names(py)?))
    }
}

/// A material of a renderer.
#[pyclass(frozen, module = "lightpaths")]
pub(crate) struct Material {
    shared: Shared,
    name: String,
}

impl Material {
    fn get<T: Send>(
        &self,
        py: Python<'_>,
        read: impl FnOnce(&lightpaths::Material) -> T + Send,
    ) -> PyResult<T> {
        self.shared.with(py, |state| {
            let scene = state.renderer.scene();
            Ok(read(&scene.materials[scene.material_named(&self.name)?]))
        })
    }

    fn edit(&self, py: Python<'_>, edit: impl FnOnce(&mut lightpaths::Material) + Send) -> PyResult<()> {
        self.shared.with(py, |state| {
            let scene = state.renderer.scene();
            let index = scene.material_named(&self.name)?;
            let mut material = scene.materials[index].clone();
            edit(&mut material);
            material.check()?;
            let lightpaths::Material { diffuse, specular, exponent, .. } = material;
            state.renderer.set_material(index, diffuse, specular, exponent)
        })
    }
}

#[pymethods]
impl Material {
    #[getter]
    fn name(&self) -> &str {
        &self.name
    }

    #[getter]
    fn editable(&self, py: Python<'_>) -> PyResult<bool> {
        self.get(py, |material| material.editable)
    }

    #[getter]
    fn diffuse(&self, py: Python<'_>) -> PyResult<Triple> {
        self.get(py, |material| triple_f32(material.diffuse))
    }

    #[setter]
    fn set_diffuse(&self, py: Python<'_>, albedo: Colour) -> PyResult<()> {
        self.edit(py, |material| material.diffuse = albedo.vector())
    }

    #[getter]
    fn specular(&self, py: Python<'_>) -> PyResult<Triple> {
        self.get(py, |material| triple_f32(material.specular))
    }

    #[setter]
    fn set_specular(&self, py: Python<'_>, albedo: Colour) -> PyResult<()> {
        self.edit(py, |material| material.specular = albedo.vector())
    }

    #[getter]
    fn exponent(&self, py: Python<'_>) -> PyResult<f64> {
        self.get(py, |material| material.exponent.into())
    }

    #[setter]
    fn set_exponent(&self, py: Python<'_>, exponent: f64) -> PyResult<()> {
        self.edit(py, |material| material.exponent = exponent as f32)
    }

    fn __repr__(&self) -> String {
        format!("<lightpaths.Material {:?}>", self.name)
    }
}
