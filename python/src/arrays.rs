//! Pictures as numpy arrays, and numbers that Python code passes.

use lightpaths::glam::{DVec3, Vec3};
use numpy::ndarray::{Array2, Array3};
use numpy::{Element, IntoPyArray, PyArray2, PyArray3};
use pyo3::prelude::*;

/// Three numbers: a position, a direction or a colour.
pub(crate) type Triple = (f64, f64, f64);

pub(crate) fn triple(vector: DVec3) -> Triple {
    vector.into()
}

pub(crate) fn triple_f32(vector: Vec3) -> Triple {
    triple(vector.as_dvec3())
}

/// A colour, or one number for all channels.
#[derive(FromPyObject)]
pub(crate) enum Colour {
    Rgb([f64; 3]),
    Grey(f64),
}

impl Colour {
    pub(crate) fn vector(self) -> Vec3 {
        match self {
            Self::Rgb(rgb) => DVec3::from(rgb).as_vec3(),
            Self::Grey(value) => DVec3::splat(value).as_vec3(),
        }
    }
}

/// An array of rows, columns and channels.
pub(crate) fn picture<'py, T: Element + Clone>(
    py: Python<'py>,
    [width, height]: [u32; 2],
    pixels: Vec<[T; 3]>,
) -> Bound<'py, PyArray3<T>> {
    let shape = (height as usize, width as usize, 3);
    let array = Array3::from_shape_vec(shape, pixels.into_flattened());
    array.expect("a pixel for each place").into_pyarray(py)
}

/// An array of rows and columns.
pub(crate) fn plane<'py, T: Element>(
    py: Python<'py>,
    [width, height]: [u32; 2],
    values: Vec<T>,
) -> Bound<'py, PyArray2<T>> {
    let array = Array2::from_shape_vec((height as usize, width as usize), values);
    array.expect("a value for each place").into_pyarray(py)
}
