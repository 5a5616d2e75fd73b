//! Errors of the library as exceptions. Their classes are in `lightpaths/errors.py`.

use lightpaths::Error;
use pyo3::PyErr;

mod classes {
    pyo3::import_exception!(lightpaths.errors, DeviceError);
    pyo3::import_exception!(lightpaths.errors, FileError);
    pyo3::import_exception!(lightpaths.errors, UnknownNameError);
    pyo3::import_exception!(lightpaths.errors, UsageError);
}

/// The exception of an error, with its one line.
pub(crate) fn raised(error: Error) -> PyErr {
    let line = error.to_string();
    match error {
        Error::Input { .. } | Error::Output { .. } => classes::FileError::new_err(line),
        Error::NoDevice(_) | Error::OutOfMemory(_) | Error::Vulkan { .. } | Error::NotFinite { .. } => {
            classes::DeviceError::new_err(line)
        }
        _ => classes::UsageError::new_err(line),
    }
}

/// The exception of a name that a mapping does not have.
pub(crate) fn unknown_name(error: &Error) -> PyErr {
    classes::UnknownNameError::new_err(error.to_string())
}
