//! Handles on observers that run inside the loop.

use std::sync::{Arc, Mutex, MutexGuard};

use numpy::ndarray::Array2;
use numpy::{IntoPyArray, PyArray2};
use pyo3::prelude::*;

use crate::observe::{Correlator, Profile, Thermodynamics, WallForces};

fn lock<T>(shared: &Mutex<T>) -> MutexGuard<'_, T> {
    match shared.lock() {
        Ok(guard) => guard,
        Err(poisoned) => poisoned.into_inner(),
    }
}

/// Time series of temperatures, energies, momentum, densities and pressure.
#[pyclass(frozen, name = "Thermodynamics", module = "sdpd._core")]
pub struct ThermodynamicsHandle {
    /// Shared with the engine.
    pub shared: Arc<Mutex<Thermodynamics>>,
    /// D.
    pub dimension: usize,
}

#[pymethods]
impl ThermodynamicsHandle {
    /// Names of the columns.
    #[getter]
    fn columns(&self) -> Vec<String> {
        Thermodynamics::columns(self.dimension)
    }

    /// All samples so far, (samples, columns).
    fn table<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let width = Thermodynamics::columns(self.dimension).len();
        let rows = lock(&self.shared).rows().to_vec();
        let table = Array2::from_shape_vec((rows.len() / width, width), rows)
            .map_err(|e| pyo3::exceptions::PyRuntimeError::new_err(e.to_string()))?;
        Ok(table.into_pyarray(py))
    }
}

/// Mean-square displacement and velocity autocorrelation on logarithmic lags.
#[pyclass(frozen, name = "Correlator", module = "sdpd._core")]
pub struct CorrelatorHandle {
    /// Shared with the engine.
    pub shared: Arc<Mutex<Correlator>>,
}

#[pymethods]
impl CorrelatorHandle {
    /// (lags, 4): lag in samples, number of origins, sum over origins of the particle-averaged
    /// |r(t) - r(0)|^2 and v(t).v(0), in the user's units.
    fn table<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let rows = lock(&self.shared).table();
        let n = rows.len();
        let table = Array2::from_shape_vec((n, 4), rows.into_iter().flatten().collect())
            .map_err(|e| pyo3::exceptions::PyRuntimeError::new_err(e.to_string()))?;
        Ok(table.into_pyarray(py))
    }
}

fn rows_of<'py>(
    py: Python<'py>,
    (rows, width): (&[f64], usize),
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let table = Array2::from_shape_vec((rows.len() / width, width), rows.to_vec())
        .map_err(|e| pyo3::exceptions::PyRuntimeError::new_err(e.to_string()))?;
    Ok(table.into_pyarray(py))
}

/// Mean force and torque on each wall between samples.
#[pyclass(frozen, name = "WallForces", module = "sdpd._core")]
pub struct WallForcesHandle {
    /// Shared with the engine.
    pub shared: Arc<Mutex<WallForces>>,
}

#[pymethods]
impl WallForcesHandle {
    /// (samples, 2 + 6 walls): step, time, force and torque on each wall, in the user's units.
    fn table<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        rows_of(py, lock(&self.shared).rows())
    }
}

/// Sums over particles in bins.
#[pyclass(frozen, name = "Profile", module = "sdpd._core")]
pub struct ProfileHandle {
    /// Shared with the engine.
    pub shared: Arc<Mutex<Profile>>,
}

#[pymethods]
impl ProfileHandle {
    /// (blocks, 2 + bins (3 + 2 D)): time, samples, and for each bin the number of particles and
    /// their sums of v, v^2, density and pressure, in the user's units.
    fn table<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        rows_of(py, lock(&self.shared).rows())
    }
}
