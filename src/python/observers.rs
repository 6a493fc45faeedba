//! Handles on observers that run inside the loop, and how they get there.

use std::sync::{Arc, Mutex, MutexGuard};

use numpy::ndarray::{Array2, Array3};
use numpy::{IntoPyArray, PyArray1, PyArray2, PyArray3};
use pyo3::exceptions::{PyMemoryError, PyRuntimeError, PyValueError};
use pyo3::prelude::*;

use crate::observe::{
    BlockedSums, CORRELATOR_COLUMNS, Correlator, Currents, HEAT_COLUMNS, HeatCorrelator,
    HeatCurrent, Lags, Observer, Parts, Profile, STRESS_COLUMNS, Stress, StressCorrelator,
    Thermodynamics, WallForces,
};
use crate::simulation::Engine;

fn lock<T>(shared: &Mutex<T>) -> MutexGuard<'_, T> {
    match shared.lock() {
        Ok(guard) => guard,
        Err(poisoned) => poisoned.into_inner(),
    }
}

fn table_of<'py>(
    py: Python<'py>,
    rows: Vec<f64>,
    width: usize,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let table = Array2::from_shape_vec((rows.len() / width, width), rows)
        .map_err(|e| PyRuntimeError::new_err(e.to_string()))?;
    Ok(table.into_pyarray(py))
}

/// Sums block by block, (blocks, lags, columns).
fn blocks_of<'py>(
    py: Python<'py>,
    sums: &BlockedSums,
    columns: usize,
    lags: Lags,
) -> PyResult<Bound<'py, PyArray3<f64>>> {
    let data = sums.blocks().to_vec();
    let rows = lags.rows().unwrap_or(0);
    let shape = (data.len() / (rows * columns).max(1), rows, columns);
    let table =
        Array3::from_shape_vec(shape, data).map_err(|e| PyRuntimeError::new_err(e.to_string()))?;
    Ok(table.into_pyarray(py))
}

/// Puts an observer into the loop; words the error where its memory is not to be had.
fn attach<T: Observer + 'static>(
    engine: &mut Engine,
    made: Option<T>,
    what: &str,
) -> PyResult<Arc<Mutex<T>>> {
    let observer = made.ok_or_else(|| {
        PyMemoryError::new_err(format!(
            "{what} for {} particles does not fit in memory",
            engine.particles.len()
        ))
    })?;
    let shared = Arc::new(Mutex::new(observer));
    engine.attach(shared.clone());
    Ok(shared)
}

/// Time series of temperatures, energies, momentum, densities and pressure.
#[pyclass(frozen, name = "Thermodynamics", module = "sdpd._core")]
pub struct ThermodynamicsHandle {
    shared: Arc<Mutex<Thermodynamics>>,
    dimension: usize,
    energy: bool,
}

impl ThermodynamicsHandle {
    pub(super) fn attach(engine: &mut Engine, every: u64) -> PyResult<Self> {
        let dimension = engine.dimension;
        let energy = engine.thermal.is_some();
        let made = Some(Thermodynamics::new(every, dimension, energy));
        Ok(Self {
            shared: attach(engine, made, "a time series")?,
            dimension,
            energy,
        })
    }
}

#[pymethods]
impl ThermodynamicsHandle {
    /// Names of the columns.
    #[getter]
    fn columns(&self) -> Vec<String> {
        Thermodynamics::columns(self.dimension, self.energy)
    }

    /// All samples so far, (samples, columns).
    fn table<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let width = Thermodynamics::columns(self.dimension, self.energy).len();
        let rows = lock(&self.shared).rows().to_vec();
        table_of(py, rows, width)
    }
}

/// Time series of the pressure tensor.
#[pyclass(frozen, name = "Stress", module = "sdpd._core")]
pub struct StressHandle {
    shared: Arc<Mutex<Stress>>,
    dimension: usize,
}

impl StressHandle {
    pub(super) fn attach(engine: &mut Engine, every: u64) -> PyResult<Self> {
        let dimension = engine.dimension;
        let made = Some(Stress::new(every, dimension));
        Ok(Self {
            shared: attach(engine, made, "a time series")?,
            dimension,
        })
    }
}

#[pymethods]
impl StressHandle {
    /// All intervals so far, (intervals, 2 + 4 D^2): step and time of the end, then the mean
    /// kinetic, conservative, drag and random part, row-major.
    fn table<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let rows = lock(&self.shared).rows().to_vec();
        table_of(py, rows, Stress::width(self.dimension))
    }
}

/// Refuses a fluid that has no current of energy: one whose step does not conserve it, or that hands
/// it over in other ways than those which are counted.
fn conserving(engine: &Engine) -> PyResult<()> {
    let what = match &engine.thermal {
        None => "particles with an energy, got an isothermal fluid",
        Some(thermal) if !thermal.bookkeeping => {
            "the books of the work: `energy_bookkeeping` must be True"
        }
        Some(thermal) if !thermal.walls.is_empty() => "a box without walls",
        Some(_) if !engine.keeps_heat_current() => {
            "the exchanges of the pair splitting, viscous heating and no acceptance"
        }
        Some(_) => return Ok(()),
    };
    Err(PyValueError::new_err(format!(
        "a current of energy needs {what}"
    )))
}

/// Time series of the flux of energy.
#[pyclass(frozen, name = "HeatCurrent", module = "sdpd._core")]
pub struct HeatCurrentHandle {
    shared: Arc<Mutex<HeatCurrent>>,
    dimension: usize,
}

impl HeatCurrentHandle {
    pub(super) fn attach(engine: &mut Engine, every: u64) -> PyResult<Self> {
        conserving(engine)?;
        let dimension = engine.dimension;
        let made = Some(HeatCurrent::new(every, dimension));
        Ok(Self {
            shared: attach(engine, made, "a time series")?,
            dimension,
        })
    }
}

#[pymethods]
impl HeatCurrentHandle {
    /// All intervals so far, (intervals, 2 + 6 D): step and time of the end, then the mean flux by
    /// conduction, friction, pressure, convection, noise of conduction and noise of friction.
    fn table<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let rows = lock(&self.shared).rows().to_vec();
        table_of(py, rows, HeatCurrent::width(self.dimension))
    }
}

/// What the handles of the correlators have in common.
macro_rules! correlator_handle {
    ($handle:ident, $name:literal, $observer:ty, $columns:expr, $what:literal) => {
        #[doc = $what]
        #[pyclass(frozen, name = $name, module = "sdpd._core")]
        pub struct $handle {
            shared: Arc<Mutex<$observer>>,
            energy: f64,
            time: f64,
        }

        #[pymethods]
        impl $handle {
            /// Lag of each row in samples, (lags,).
            fn lags<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
                lock(&self.shared).lags().all().into_pyarray(py)
            }

            /// Sums in blocks of time, (blocks, lags, columns); the first column counts origins.
            fn blocks<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray3<f64>>> {
                let observer = lock(&self.shared);
                blocks_of(py, observer.sums(), ($columns)(&observer), observer.lags())
            }

            /// Energy and time that are 1 in reduced units.
            fn units(&self) -> (f64, f64) {
                (self.energy, self.time)
            }

            /// Samples in a full block.
            fn block_length(&self) -> u64 {
                lock(&self.shared).sums().length()
            }
        }
    };
}

correlator_handle!(
    CorrelatorHandle,
    "Correlator",
    Correlator,
    |_: &Correlator| CORRELATOR_COLUMNS,
    "Columns: origins, then sums over them of the particle means of |r(t) - r(0)|^2 and v(t).v(0), in the user's units."
);
correlator_handle!(
    StressCorrelatorHandle,
    "StressCorrelator",
    StressCorrelator,
    |_: &StressCorrelator| STRESS_COLUMNS,
    "Columns: see `src/observe/stress_correlator.rs`, in reduced units."
);
correlator_handle!(
    HeatCorrelatorHandle,
    "HeatCorrelator",
    HeatCorrelator,
    |_: &HeatCorrelator| HEAT_COLUMNS,
    "Columns: see `src/observe/heat_correlator.rs`, in reduced units."
);
correlator_handle!(
    CurrentsHandle,
    "Currents",
    Currents,
    |observer: &Currents| observer.columns(),
    "Columns: origins, then for each wave vector density, longitudinal, transverse and both cross correlations, in the user's units."
);

impl CorrelatorHandle {
    pub(super) fn attach(
        engine: &mut Engine,
        every: u64,
        points: usize,
        levels: usize,
    ) -> PyResult<Self> {
        let (d, n) = (engine.dimension, engine.particles.len());
        let made = Correlator::new(every, d, points, levels, n);
        let what = format!("a correlator of {points} points on {levels} levels (48 bytes each)");
        Ok(Self {
            shared: attach(engine, made, &what)?,
            energy: engine.units.energy(),
            time: engine.units.time(),
        })
    }
}

impl StressCorrelatorHandle {
    pub(super) fn attach(
        engine: &mut Engine,
        every: u64,
        points: usize,
        levels: usize,
        parts: bool,
    ) -> PyResult<Self> {
        let parts = if parts { Parts::All } else { Parts::Two };
        let made = StressCorrelator::new(every, engine.dimension, parts, points, levels);
        let what = format!("a stress correlator of {points} points on {levels} levels");
        Ok(Self {
            shared: attach(engine, made, &what)?,
            energy: engine.units.energy(),
            time: engine.units.time(),
        })
    }
}

impl HeatCorrelatorHandle {
    pub(super) fn attach(
        engine: &mut Engine,
        every: u64,
        points: usize,
        levels: usize,
    ) -> PyResult<Self> {
        conserving(engine)?;
        let made = HeatCorrelator::new(every, engine.dimension, points, levels);
        let what = format!("a heat correlator of {points} points on {levels} levels");
        Ok(Self {
            shared: attach(engine, made, &what)?,
            energy: engine.units.energy(),
            time: engine.units.time(),
        })
    }
}

impl CurrentsHandle {
    pub(super) fn attach(
        engine: &mut Engine,
        every: u64,
        vectors: &[Vec<i32>],
        points: usize,
        levels: usize,
    ) -> PyResult<Self> {
        let (d, n) = (engine.dimension, engine.particles.len());
        let energy = engine.thermal.is_some();
        let mut frames = Vec::with_capacity(vectors.len());
        for vector in vectors {
            if vector.len() != d || vector.iter().all(|&n| n == 0) {
                return Err(PyValueError::new_err(format!(
                    "`wave_vectors` must hold vectors of {d} integers, not all 0, got {vector:?}"
                )));
            }
            frames.push(std::array::from_fn(|a| vector.get(a).copied().unwrap_or(0)));
        }
        let what = format!("a correlator of {} wave vectors", vectors.len());
        let made = Currents::new(every, d, energy, frames, points, levels, n);
        Ok(Self {
            shared: attach(engine, made, &what)?,
            energy: engine.units.energy(),
            time: engine.units.time(),
        })
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
    shared: Arc<Mutex<WallForces>>,
}

#[pymethods]
impl WallForcesHandle {
    /// (samples, 2 + 6 walls): step, time, force and torque on each wall, in the user's units; two
    /// more for each wall of a fluid with an energy, heat received and work done per time.
    fn table<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        rows_of(py, lock(&self.shared).rows())
    }
}

/// Sums over particles in bins.
#[pyclass(frozen, name = "Profile", module = "sdpd._core")]
pub struct ProfileHandle {
    shared: Arc<Mutex<Profile>>,
}

#[pymethods]
impl ProfileHandle {
    /// (blocks, 2 + bins (3 + 2 D)): time, samples, and for each bin the number of particles and
    /// their sums of v, v^2, density and pressure, in the user's units.
    fn table<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        rows_of(py, lock(&self.shared).rows())
    }
}

impl WallForcesHandle {
    pub(super) fn attach(engine: &mut Engine, every: u64) -> Self {
        let energy = engine
            .thermal
            .as_ref()
            .map_or(&[][..], |it| &it.accounts.walls);
        let observer = WallForces::new(every, engine.time(), &engine.walls.impulse, energy);
        let shared = Arc::new(Mutex::new(observer));
        engine.attach(shared.clone());
        Self { shared }
    }
}

impl ProfileHandle {
    pub(super) fn attach(engine: &mut Engine, profile: Profile) -> Self {
        let shared = Arc::new(Mutex::new(profile));
        engine.attach(shared.clone());
        Self { shared }
    }
}
