//! One simulation as Python sees it: the engine behind a lock, and arrays shared with NumPy.

use std::sync::{Mutex, MutexGuard, TryLockError};

use numpy::ndarray::{Array2, ArrayView1, ArrayView2};
use numpy::{IntoPyArray, PyArray2, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use super::columns::{Columns, check_finite, check_inside, check_temperatures};
use super::errors::to_python;
use super::observers::{
    CorrelatorHandle, CurrentsHandle, HeatCorrelatorHandle, HeatCurrentHandle, ProfileHandle,
    StressCorrelatorHandle, StressHandle, ThermodynamicsHandle, WallForcesHandle,
};
use super::state::{self, Parsed};
use super::thermal::ThermalArguments;
use super::walls::{WallField, rows};
use crate::effect::AccelerationField;
use crate::integrator::Source;
use crate::neighbor::ROUNDS;
use crate::observe::{Coordinate, Profile};
use crate::registry::Combination;
use crate::simulation::{Engine, Settings};
use crate::stopwatch::{PHASES, Stopwatch};
use crate::sweep::Instructions;
use crate::wall::{ModelSettings, WallSettings, Wrench};

/// A simulation. See `sdpd.Simulation`, which is what users make.
#[pyclass(frozen, module = "sdpd._core")]
pub struct Core {
    engine: Mutex<Engine>,
    columns: Columns,
    n: usize,
    dimension: usize,
    /// The process that made it: its threads do not follow a fork.
    process: u32,
}

fn wrong_shape(name: &str, want: [usize; 2], got: &[usize]) -> PyErr {
    PyValueError::new_err(format!(
        "`{name}` must have shape ({}, {}), got {got:?}",
        want[0], want[1]
    ))
}

/// Fastest motion that is not thermal, as far as the initial velocities tell.
fn directed_speed(velocities: &ArrayView2<'_, f64>, thermal_energy: f64, mass: f64) -> f64 {
    let square = |row: ArrayView1<'_, f64>| row.iter().map(|v| v * v).sum::<f64>();
    let largest = velocities
        .rows()
        .into_iter()
        .map(square)
        .fold(0.0, f64::max);
    // Six standard deviations may well be thermal.
    let beyond = largest.sqrt() - 6.0 * (thermal_energy.max(0.0) / mass).sqrt();
    if beyond.is_finite() {
        beyond.max(0.0)
    } else {
        0.0
    }
}

/// Temperatures of the start, by row, where particles have any.
fn set_temperatures(
    engine: &mut Engine,
    values: Option<&PyReadonlyArray1<'_, f64>>,
) -> PyResult<()> {
    let n = engine.particles.len();
    match (&engine.thermal, values) {
        (None, None) => Ok(()),
        (Some(thermal), Some(values)) if values.as_array().len() == n => {
            let values: Vec<f64> = values.as_array().iter().copied().collect();
            check_temperatures(&values)?;
            let rho = n as f64
                / engine.cell.edges[..engine.dimension]
                    .iter()
                    .product::<f64>();
            let particles = &engine.particles;
            let heat = particles.row.iter().zip(&particles.density);
            // Before the first sum there is no density but that of the box.
            let heat = heat
                .map(|(&row, &d)| thermal.heat(if d > 0.0 { d } else { rho }, values[row as usize]))
                .collect();
            let field = thermal.fields.heat;
            engine.particles.scalars[field].values = heat;
            Ok(())
        }
        (Some(_), _) => Err(PyValueError::new_err(format!(
            "`temperatures` must have shape ({n},) where particles have an energy"
        ))),
        (None, Some(_)) => Err(PyValueError::new_err(
            "`temperatures` must be None where particles have no energy",
        )),
    }
}

impl Core {
    fn lock(&self) -> PyResult<MutexGuard<'_, Engine>> {
        if std::process::id() != self.process {
            return Err(PyRuntimeError::new_err(
                "the simulation was made before this process was forked, and its threads stayed behind; make it here, or start processes with \"spawn\"",
            ));
        }
        match self.engine.try_lock() {
            Ok(guard) => Ok(guard),
            Err(TryLockError::Poisoned(_)) => Err(PyRuntimeError::new_err(
                "an internal error during an earlier run left the simulation unusable; its arrays show the state before that run",
            )),
            Err(TryLockError::WouldBlock) => Err(PyRuntimeError::new_err(
                "the simulation is running in another thread; wait until its run() returns",
            )),
        }
    }

    /// Lets arrays and engine agree: shows what has been done, or takes over what the user wrote.
    fn agree(&self, py: Python<'_>, engine: &mut Engine) -> PyResult<()> {
        if !engine.is_ahead() {
            return self.columns.import(py, engine);
        }
        self.columns.export(py, engine);
        engine.accept();
        Ok(())
    }

    fn by_row(&self, py: Python<'_>, engine: &Engine, records: &[[f64; 4]]) -> Py<PyArray2<f64>> {
        let unit = engine.units.force();
        let mut table = Array2::zeros((self.n, self.dimension));
        for (slot, record) in records.iter().enumerate() {
            let row = engine.particles.row[slot] as usize;
            for a in 0..self.dimension {
                table[(row, a)] = record[a] * unit;
            }
        }
        table.into_pyarray(py).unbind()
    }
}

#[pymethods]
impl Core {
    #[new]
    #[pyo3(signature = (positions, velocities, *, r#box, support, mass, thermal_energy, kernel, friction,
        friction_across, friction_along, eos, noise, integrator, iterations, body_force, dt, seed, skin,
        threads, flow_speed=0.0, periodic=Vec::new(), walls=Vec::new(),
        fields=Vec::new(), wall_model=None, frozen=None, exchanges="none", thermal=None,
        temperatures=None, precision="double"))]
    #[allow(clippy::too_many_arguments)]
    fn new(
        py: Python<'_>,
        positions: PyReadonlyArray2<'_, f64>,
        velocities: PyReadonlyArray2<'_, f64>,
        r#box: Vec<f64>,
        support: f64,
        mass: f64,
        thermal_energy: f64,
        kernel: String,
        friction: String,
        friction_across: f64,
        friction_along: f64,
        eos: (String, Vec<f64>),
        noise: String,
        integrator: String,
        iterations: u32,
        body_force: Option<AccelerationField>,
        dt: f64,
        seed: u64,
        skin: Option<f64>,
        threads: usize,
        flow_speed: f64,
        periodic: Vec<bool>,
        walls: Vec<WallSettings>,
        fields: Vec<PyRef<'_, WallField>>,
        wall_model: Option<ModelSettings>,
        frozen: Option<PyReadonlyArray2<'_, f64>>,
        exchanges: &str,
        thermal: Option<ThermalArguments>,
        temperatures: Option<PyReadonlyArray1<'_, f64>>,
        precision: &str,
    ) -> PyResult<Self> {
        let (positions, velocities) = (positions.as_array(), velocities.as_array());
        let n = positions.nrows();
        let dimension = r#box.len();
        let agitation = if noise == "none" { 0.0 } else { thermal_energy };
        let settings = Settings {
            combination: Combination {
                dimension,
                kernel,
                friction,
                noise,
                integrator,
                exchanges: exchanges.to_owned(),
                precision: precision.to_owned(),
            },
            edges: r#box,
            support,
            mass,
            thermal_energy,
            friction_across,
            friction_along,
            eos,
            iterations,
            body_force,
            dt,
            seed,
            skin,
            flow_speed: flow_speed.max(directed_speed(&velocities, agitation, mass)),
            threads,
            periodic,
            walls,
            fields: fields.iter().map(|f| f.field.clone()).collect(),
            wall_model: wall_model.unwrap_or_else(|| ("symmetric_images".into(), Vec::new())),
            frozen: frozen.map_or_else(|| Ok(Vec::new()), |places| rows("frozen", &places, 1.0))?,
            thermal: thermal.map(ThermalArguments::settings),
        };
        let mut engine = Engine::new(n, &settings).map_err(|e| to_python(py, &e))?;
        if positions.ncols() != dimension {
            return Err(wrong_shape("positions", [n, dimension], positions.shape()));
        }
        if velocities.shape() != positions.shape() {
            return Err(wrong_shape(
                "velocities",
                [n, dimension],
                velocities.shape(),
            ));
        }
        let flat: Vec<f64> = positions.iter().copied().collect();
        check_finite("positions", &flat, dimension)?;
        let flat: Vec<f64> = velocities.iter().copied().collect();
        check_finite("velocities", &flat, dimension)?;
        let units = engine.units;
        for row in 0..n {
            let mut position = [0.0; 3];
            let mut velocity = [0.0; 3];
            for a in 0..dimension {
                position[a] = positions[(row, a)] / units.length;
                velocity[a] = velocities[(row, a)] / units.velocity;
            }
            engine.place(row, position, velocity);
        }
        let places: Vec<[f64; 3]> = engine
            .particles
            .position
            .iter()
            .map(|p| [p[0], p[1], p[2]])
            .collect();
        check_inside(py, &engine, &places)?;
        set_temperatures(&mut engine, temperatures.as_ref())?;
        py.detach(|| engine.renew(true))
            .map_err(|e| to_python(py, &e))?;
        if engine
            .thermal
            .as_ref()
            .is_some_and(|it| !it.heat_capacity_is_constant())
        {
            set_temperatures(&mut engine, temperatures.as_ref())?;
            py.detach(|| engine.renew(false))
                .map_err(|e| to_python(py, &e))?;
        }
        let columns = Columns::new(py, &engine)?;
        let core = Self {
            engine: Mutex::new(engine),
            columns,
            n,
            dimension,
            process: std::process::id(),
        };
        core.columns.export(py, &*core.lock()?);
        Ok(core)
    }

    #[getter]
    fn positions(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.columns.positions.view(py)
    }
    #[getter]
    fn velocities(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.columns.velocities.view(py)
    }
    #[getter]
    fn forces(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.columns.forces.view(py)
    }
    #[getter]
    fn number_densities(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.columns.number_densities.view(py)
    }
    #[getter]
    fn densities(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.columns.densities.view(py)
    }
    #[getter]
    fn pressures(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.columns.pressures.view(py)
    }
    /// Temperatures, writable; None where particles have no energy, like the next two.
    #[getter]
    fn temperatures(&self, py: Python<'_>) -> PyResult<Option<Py<PyAny>>> {
        let columns = self.columns.thermal.as_ref();
        columns.map(|it| it.temperatures.view(py)).transpose()
    }
    #[getter]
    fn internal_energies(&self, py: Python<'_>) -> PyResult<Option<Py<PyAny>>> {
        let columns = self.columns.thermal.as_ref();
        columns.map(|it| it.energies.view(py)).transpose()
    }
    #[getter]
    fn entropies(&self, py: Python<'_>) -> PyResult<Option<Py<PyAny>>> {
        let columns = self.columns.thermal.as_ref();
        columns.map(|it| it.entropies.view(py)).transpose()
    }
    #[getter]
    fn ids(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.columns.ids.view(py)
    }
    #[getter]
    fn images(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.columns.images.view(py)
    }

    /// Steps done.
    #[getter]
    fn step(&self) -> PyResult<u64> {
        Ok(self.lock()?.step)
    }

    /// Simulated time.
    #[getter]
    fn time(&self) -> PyResult<f64> {
        Ok(self.lock()?.time())
    }

    /// Advances by `steps` steps of `dt`; if `show`, the arrays show the new state afterwards. If the
    /// run fails, the state is again the one they show.
    #[pyo3(signature = (steps, dt, show=true))]
    fn run(&self, py: Python<'_>, steps: u64, dt: f64, show: bool) -> PyResult<()> {
        if !(dt.is_finite() && dt > 0.0) {
            return Err(PyValueError::new_err(format!(
                "`dt` must be finite and > 0, got {dt}"
            )));
        }
        let mut engine = self.lock()?;
        if !engine.is_ahead() {
            self.columns.import(py, &mut engine)?;
        }
        let result = {
            let engine = &mut *engine;
            py.detach(|| engine.advance(steps, dt))
        };
        match result {
            Ok(()) => {
                if show {
                    self.columns.export(py, &engine);
                    engine.accept();
                }
                Ok(())
            }
            Err(error) => {
                self.columns.go_back(py, &mut engine);
                engine.undo();
                // The exported state was good, so this cannot fail; if it does, the next run says so.
                let _ = engine.renew(true);
                let _ = self.columns.settle(py, &mut engine, &vec![true; self.n]);
                Err(to_python(py, &error))
            }
        }
    }

    /// Shows the state that the last run reached.
    fn show(&self, py: Python<'_>) -> PyResult<()> {
        let mut engine = self.lock()?;
        if engine.is_ahead() {
            self.agree(py, &mut engine)?;
        }
        Ok(())
    }

    /// Other friction coefficients from here on, for fluids without an energy.
    fn set_friction(&self, py: Python<'_>, across: f64, along: f64) -> PyResult<()> {
        let mut engine = self.lock()?;
        engine
            .set_friction(across, along)
            .map_err(|e| to_python(py, &e))
    }

    /// Brings derived arrays up to date with what the user wrote.
    fn refresh(&self, py: Python<'_>) -> PyResult<()> {
        self.agree(py, &mut *self.lock()?)
    }

    /// Gives wall `index` the motion of `wall`, which must have its form; forces follow.
    fn move_wall(&self, py: Python<'_>, index: usize, wall: WallSettings) -> PyResult<()> {
        let mut engine = self.lock()?;
        self.agree(py, &mut engine)?;
        let Engine {
            walls, cell, units, ..
        } = &mut *engine;
        walls
            .set_motion(index, &wall, self.dimension, cell, units)
            .map_err(|e| to_python(py, &e))?;
        engine.renew(false).map_err(|e| to_python(py, &e))?;
        self.columns.export(py, &engine);
        Ok(())
    }

    /// Conservative, dissipative and random force (the last as velocity Verlet draws it at the
    /// step `step`, by default the present one), (N, D) each; if `walls` of what is behind them alone.
    #[pyo3(signature = (step=None, walls=false))]
    fn force_parts<'py>(
        &self,
        py: Python<'py>,
        step: Option<u64>,
        walls: bool,
    ) -> PyResult<Bound<'py, PyDict>> {
        let mut engine = self.lock()?;
        self.agree(py, &mut engine)?;
        let step = step.unwrap_or(engine.step);
        let whose = if walls { Source::Walls } else { Source::All };
        let parts = engine.force_parts(step, whose);
        let result = PyDict::new(py);
        result.set_item(
            "conservative",
            self.by_row(py, &engine, &parts.conservative),
        )?;
        result.set_item("dissipative", self.by_row(py, &engine, &parts.dissipative))?;
        result.set_item("random", self.by_row(py, &engine, &parts.random))?;
        Ok(result)
    }

    /// Rows of the pairs in the order of a forward sweep, (M, 2); pairs in the margin included.
    fn pair_order<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<u32>>> {
        let engine = self.lock()?;
        let row = |slot: u32| engine.particles.row[slot as usize];
        let blocks = &engine.list.blocks;
        let order = engine.grid.schedule.in_order();
        let in_order = || order.iter().map(|&base| &blocks[base as usize]);
        let mut pairs = Vec::new();
        if blocks.iter().all(|block| block.shuffled.is_empty()) {
            for (head, others) in in_order().flat_map(|block| block.rows.iter()) {
                for &other in others {
                    pairs.extend([row(head), row(other)]);
                }
            }
        } else {
            for round in 0..ROUNDS {
                for block in in_order() {
                    let [start, end] = [block.rounds[round], block.rounds[round + 1]];
                    for pair in &block.shuffled[start as usize..end as usize] {
                        pairs.extend(pair.map(|place| row(block.slots[place as usize])));
                    }
                }
            }
        }
        let table = Array2::from_shape_vec((pairs.len() / 2, 2), pairs)
            .map_err(|e| PyRuntimeError::new_err(e.to_string()))?;
        Ok(table.into_pyarray(py))
    }

    /// Number of pairs of `pair_order` in each round of a sweep; all in one where nothing is shuffled.
    fn pairs_by_round(&self) -> PyResult<Vec<usize>> {
        let engine = self.lock()?;
        let blocks = &engine.list.blocks;
        if blocks.iter().all(|block| block.shuffled.is_empty()) {
            return Ok(vec![engine.list.len()]);
        }
        let count = |round: usize| {
            let parts = blocks
                .iter()
                .map(|b| (b.rounds[round + 1] - b.rounds[round]) as usize);
            parts.sum()
        };
        Ok((0..ROUNDS).map(count).collect())
    }

    /// The links to images in the order of a forward sweep, (M, 3): rows of both particles and the
    /// label of the kind of image; links in the margin included.
    fn wall_link_order<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<u32>>> {
        let engine = self.lock()?;
        let row = |slot: u32| engine.particles.row[slot as usize];
        let walls = &engine.walls;
        let mut table = Vec::new();
        for base in engine.grid.schedule.in_order() {
            let links = walls.links.get(base as usize).map_or(&[][..], |b| &b.links);
            for link in links {
                let label = walls.images[link.image as usize].label;
                table.extend([row(link.slots[0]), row(link.slots[1]), u32::from(label)]);
            }
        }
        let table = Array2::from_shape_vec((table.len() / 3, 3), table)
            .map_err(|e| PyRuntimeError::new_err(e.to_string()))?;
        Ok(table.into_pyarray(py))
    }

    /// Force [force] and torque [energy] of the fluid on each wall that go with `forces`, (walls, 6).
    fn wall_forces<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let engine = self.lock()?;
        let units = &engine.units;
        wrenches(py, &engine.walls.force, units.force(), units.energy())
    }

    /// Momentum and angular momentum that each wall has received, (walls, 6).
    fn wall_impulses<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let engine = self.lock()?;
        let units = &engine.units;
        let momentum = units.mass * units.velocity;
        wrenches(py, &engine.walls.impulse, momentum, momentum * units.length)
    }

    /// Energies kept in the books [energy]: what adiabats alone would have added, work of the body
    /// force, heat received by and work done by each wall, (walls, 2); and updates of pairs that were
    /// not made. None where particles have no energy.
    fn energy_accounts<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyDict>>> {
        let engine = self.lock()?;
        let Some(thermal) = &engine.thermal else {
            return Ok(None);
        };
        let unit = engine.units.energy();
        let held = &thermal.accounts;
        let accounts = PyDict::new(py);
        accounts.set_item("discarded", held.discarded * unit)?;
        accounts.set_item("body_work", held.body_work * unit)?;
        accounts.set_item("unbooked", held.unbooked * unit)?;
        accounts.set_item("refused", held.refused)?;
        let walls: Vec<f64> = held.walls.iter().flatten().map(|x| x * unit).collect();
        let table = Array2::from_shape_vec((held.walls.len(), 2), walls)
            .map_err(|e| PyRuntimeError::new_err(e.to_string()))?;
        accounts.set_item("walls", table.into_pyarray(py))?;
        Ok(Some(accounts))
    }

    /// Exact initial slope of the velocity autocorrelation, (1/m) <sum_j g_ij> (a + b/D) [1/time].
    fn friction_rate(&self, py: Python<'_>) -> PyResult<f64> {
        let mut engine = self.lock()?;
        self.agree(py, &mut engine)?;
        let time = engine.units.time();
        Ok(engine.friction_rate() / time)
    }

    /// Sizes and counts: pairs in the lists, bytes, skin and margin [length], how often the grid was renewed and lists pruned.
    fn statistics<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let engine = self.lock()?;
        let (skin, margin) = engine.skin_and_margin();
        let result = PyDict::new(py);
        result.set_item("pairs_in_list", engine.list.len())?;
        result.set_item("pairs_in_skin", engine.list.present_pairs())?;
        result.set_item("list_bytes", engine.list.bytes())?;
        result.set_item("state_bytes", engine.state_bytes() + self.columns.bytes())?;
        result.set_item("skin", skin * engine.units.length)?;
        result.set_item("margin", margin * engine.units.length)?;
        result.set_item("grid_renewals", engine.counters.grid_renewals)?;
        result.set_item("prunings", engine.counters.prunings)?;
        result.set_item("blocks", engine.grid.blocks)?;
        result.set_item("wall_particles", engine.walls.near.len())?;
        result.set_item("wall_links", engine.walls.link_count())?;
        result.set_item("wall_crossings", engine.walls.crossings)?;
        Ok(result)
    }

    /// Wall time in seconds by phase of the step, and the number of steps, since the start or the last
    /// call with `reset`.
    fn profile<'py>(&self, py: Python<'py>, reset: bool) -> PyResult<(Bound<'py, PyDict>, u64)> {
        let mut engine = self.lock()?;
        let result = PyDict::new(py);
        for ((_, name), seconds) in PHASES.iter().zip(engine.stopwatch.seconds()) {
            result.set_item(name, seconds)?;
        }
        let steps = engine.stopwatch.steps;
        if reset {
            engine.stopwatch = Stopwatch::default();
        }
        Ok((result, steps))
    }

    /// Vector instructions of the loops: "avx512", "avx2" or "portable".
    #[staticmethod]
    fn instructions() -> &'static str {
        Instructions::chosen().name()
    }

    /// Samples temperatures, energies, momentum, densities and pressure every `every` steps.
    fn attach_thermodynamics(&self, every: u64) -> PyResult<ThermodynamicsHandle> {
        ThermodynamicsHandle::attach(&mut *self.lock()?, every)
    }

    /// Samples the pressure tensor by part, as means over `every` steps.
    fn attach_stress(&self, every: u64) -> PyResult<StressHandle> {
        StressHandle::attach(&mut *self.lock()?, every)
    }

    /// Correlates positions and velocities every `every` steps on `levels` levels of `points` lags.
    fn attach_correlator(
        &self,
        every: u64,
        points: usize,
        levels: usize,
    ) -> PyResult<CorrelatorHandle> {
        CorrelatorHandle::attach(&mut *self.lock()?, every, points, levels)
    }

    /// Correlates the stress likewise, what pairs exchange by cause or as one.
    fn attach_stress_correlator(
        &self,
        every: u64,
        points: usize,
        levels: usize,
        parts: bool,
    ) -> PyResult<StressCorrelatorHandle> {
        StressCorrelatorHandle::attach(&mut *self.lock()?, every, points, levels, parts)
    }

    /// Correlates density and current at integer wave vectors likewise.
    fn attach_currents(
        &self,
        every: u64,
        wave_vectors: Vec<Vec<i32>>,
        points: usize,
        levels: usize,
    ) -> PyResult<CurrentsHandle> {
        CurrentsHandle::attach(&mut *self.lock()?, every, &wave_vectors, points, levels)
    }

    /// Samples the flux of energy by part, as means over `every` steps.
    fn attach_heat_current(&self, every: u64) -> PyResult<HeatCurrentHandle> {
        HeatCurrentHandle::attach(&mut *self.lock()?, every)
    }

    /// Correlates the current of energy likewise.
    fn attach_heat_correlator(
        &self,
        every: u64,
        points: usize,
        levels: usize,
    ) -> PyResult<HeatCorrelatorHandle> {
        HeatCorrelatorHandle::attach(&mut *self.lock()?, every, points, levels)
    }

    /// Samples mean force and torque on each wall every `every` steps.
    fn attach_wall_forces(&self, every: u64) -> PyResult<WallForcesHandle> {
        Ok(WallForcesHandle::attach(&mut *self.lock()?, every))
    }

    /// Sums over particles in bins along an axis, or the distance from wall `index` where `wall`,
    /// every `every` steps; `block` samples make a row.
    #[allow(clippy::too_many_arguments)]
    fn attach_profile(
        &self,
        every: u64,
        wall: bool,
        index: usize,
        interval: [f64; 2],
        bins: usize,
        block: u64,
    ) -> PyResult<ProfileHandle> {
        let mut engine = self.lock()?;
        let most = if wall {
            engine.walls.surfaces.len()
        } else {
            self.dimension
        };
        if index >= most || bins == 0 || interval[0] >= interval[1] {
            return Err(PyValueError::new_err(format!(
                "a profile needs a coordinate below {most}, bins and an interval, got {index}, {bins}, {interval:?}"
            )));
        }
        let coordinate = if wall {
            Coordinate::Distance(index)
        } else {
            Coordinate::Axis(index)
        };
        let energy = engine.thermal.is_some();
        let profile = Profile::new(
            every,
            self.dimension,
            energy,
            coordinate,
            interval,
            bins,
            block,
        );
        Ok(ProfileHandle::attach(&mut engine, profile))
    }

    /// Detaches all observers; their handles stay readable.
    fn detach_all(&self) -> PyResult<()> {
        self.lock()?.detach_all();
        Ok(())
    }

    /// The exact internal state, for a checkpoint.
    fn state<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let mut engine = self.lock()?;
        self.agree(py, &mut engine)?;
        state::write(py, &engine)
    }

    /// Restores what `state` gave, bit for bit, into a simulation built with the same settings.
    fn set_state(&self, py: Python<'_>, state: &Bound<'_, PyDict>) -> PyResult<()> {
        let mut engine = self.lock()?;
        let parsed = Parsed::read(state, &engine)?;
        let engine_ref = &mut *engine;
        py.detach(|| parsed.restore(engine_ref));
        engine.accept();
        self.columns.export(py, &engine);
        Ok(())
    }
}

fn wrenches<'py>(
    py: Python<'py>,
    values: &[Wrench],
    force: f64,
    torque: f64,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let flat: Vec<f64> = values
        .iter()
        .flat_map(|w| (0..6).map(|a| w[a] * if a < 3 { force } else { torque }))
        .collect();
    let table = Array2::from_shape_vec((values.len(), 6), flat)
        .map_err(|e| PyRuntimeError::new_err(e.to_string()))?;
    Ok(table.into_pyarray(py))
}
