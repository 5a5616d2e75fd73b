//! What light meters show.

use lightpaths::{Measured, Meter, lux};
use numpy::{PyArray2, PyArray3};
use pyo3::prelude::*;

use crate::arrays::{picture, plane};

/// What a light meter shows. Arrays have a row for each step along the meter's second edge.
#[pyclass(frozen, get_all, module = "lightpaths")]
pub(crate) struct Reading {
    /// Illuminance of each point, lx; NaN in solids.
    lux: Py<PyArray2<f64>>,
    /// Irradiance of each point, W/m², linear Rec.709.
    irradiance: Py<PyArray3<f32>>,
    /// The part of it that comes straight from lights.
    direct: Py<PyArray3<f32>>,
    /// Mean illuminance outside of solids, lx.
    mean: f64,
    min: f64,
    max: f64,
    /// Minimum over mean.
    uniformity: f64,
}

impl Reading {
    pub(crate) fn new(py: Python<'_>, meter: &Meter, points: &[Measured]) -> Self {
        let size = meter.grid();
        let illuminance = |point: &Measured| match point.is_in_solid {
            true => f64::NAN,
            false => lux(point.irradiance()),
        };
        let reading = lightpaths::Reading::new(points);
        Self {
            lux: plane(py, size, points.iter().map(illuminance).collect()).unbind(),
            irradiance: picture(py, size, points.iter().map(|point| point.irradiance().into()).collect())
                .unbind(),
            direct: picture(py, size, points.iter().map(|point| point.direct.into()).collect()).unbind(),
            mean: reading.mean,
            min: reading.min,
            max: reading.max,
            uniformity: reading.uniformity(),
        }
    }
}

#[pymethods]
impl Reading {
    fn __repr__(&self) -> String {
        format!("<lightpaths.Reading: mean {:.1} lx, {:.1} to {:.1} lx>", self.mean, self.min, self.max)
    }
}
