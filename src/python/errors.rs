//! Core errors as Python exceptions.

use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;

use crate::error::Error;

/// `ValueError` for bad arguments, `sdpd.SimulationError` (with `step` and `particle`) for a run
/// that went wrong.
pub fn to_python(py: Python<'_>, error: &Error) -> PyErr {
    let (step, id) = match error {
        Error::Invalid(text) => return PyValueError::new_err(text.clone()),
        Error::NotFinite { step, id, .. }
        | Error::Runaway { step, id, .. }
        | Error::Escaped { step, id, .. } => (*step, *id),
    };
    let build = || -> PyResult<PyErr> {
        let class = py.import("sdpd.errors")?.getattr("SimulationError")?;
        let exception = class.call1((error.to_string(),))?;
        exception.setattr("step", step)?;
        exception.setattr("particle", id)?;
        Ok(PyErr::from_value(exception))
    };
    build().unwrap_or_else(|_| PyRuntimeError::new_err(error.to_string()))
}
