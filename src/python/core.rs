//! One simulation as Python sees it: the engine behind a lock, and arrays shared with NumPy.

use std::sync::{Mutex, MutexGuard, TryLockError};

use numpy::ndarray::{Array2, ArrayView1, ArrayView2};
use numpy::{IntoPyArray, PyArray2, PyReadonlyArray2};
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};

use super::arrays::Column;
use super::errors::to_python;
use super::observers::{
    CorrelatorHandle, CurrentsHandle, ProfileHandle, StressCorrelatorHandle, StressHandle,
    ThermodynamicsHandle, WallForcesHandle,
};
use super::walls::{WallField, rows};
use crate::effect::AccelerationField;
use crate::neighbor::ROUNDS;
use crate::observe::{Coordinate, Profile};
use crate::registry::Combination;
use crate::simulation::{Clock, Engine, Settings};
use crate::wall::{ModelSettings, WallSettings, Wrench};

/// Arrays in the user's units and row order.
struct Columns {
    positions: Column<f64>,
    velocities: Column<f64>,
    forces: Column<f64>,
    number_densities: Column<f64>,
    densities: Column<f64>,
    pressures: Column<f64>,
    ids: Column<u64>,
    images: Column<i32>,
}

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

fn check_finite(name: &str, values: &[f64], width: usize) -> PyResult<()> {
    match values.iter().position(|x| !x.is_finite()) {
        None => Ok(()),
        Some(at) => Err(PyValueError::new_err(format!(
            "`{name}` must be finite, got {} in row {}",
            values[at],
            at / width
        ))),
    }
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

/// Positions must be countable in edges of the box, and no two of them may coincide: nothing would
/// ever part such a pair.
fn check_places(engine: &Engine, positions: &[f64]) -> PyResult<()> {
    const FARTHEST: f64 = 1e9;
    let d = engine.dimension;
    let mut places = Vec::with_capacity(positions.len() / d);
    for (row, position) in positions.chunks_exact(d).enumerate() {
        let mut place = [0; 3];
        for axis in 0..d {
            let x = position[axis] / engine.units.length;
            if (x * engine.cell.inverse[axis]).abs() > FARTHEST {
                return Err(PyValueError::new_err(format!(
                    "`positions` must lie within {FARTHEST:e} edges of the box, got {} in row {row}",
                    position[axis]
                )));
            }
            place[axis] = engine.cell.wrap(axis, x).0.to_bits();
        }
        places.push((place, row));
    }
    places.sort_unstable();
    match places.windows(2).find(|pair| pair[0].0 == pair[1].0) {
        None => Ok(()),
        Some(pair) => Err(PyValueError::new_err(format!(
            "`positions` must all differ, got the same in rows {} and {}",
            pair[0].1, pair[1].1
        ))),
    }
}

/// Positions [h], by row, must lie in the fluid: before the walls, and within the box along axes that
/// are not periodic.
fn check_inside(py: Python<'_>, engine: &Engine, places: &[[f64; 3]]) -> PyResult<()> {
    let room = engine.walls.rounding();
    let cell = &engine.cell;
    engine
        .walls
        .check_inside(places, cell)
        .map_err(|e| to_python(py, &e))?;
    let outside = |place: &[f64; 3]| {
        (0..engine.dimension)
            .any(|a| !cell.periodic[a] && !(-room..=cell.limits[a] + room).contains(&place[a]))
    };
    match places.iter().position(outside) {
        None => Ok(()),
        Some(row) => Err(PyValueError::new_err(format!(
            "`positions` must lie in the box along axes that are not periodic, got {:?} in row {row}",
            places[row].map(|x| x * engine.units.length)
        ))),
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

    /// Writes the engine's state into the arrays.
    fn export(&self, py: Python<'_>, engine: &Engine) {
        let d = self.dimension;
        let columns = &self.columns;
        let (positions, velocities) = (
            columns.positions.elements(py),
            columns.velocities.elements(py),
        );
        let forces = columns.forces.elements(py);
        let (numbers, densities) = (
            columns.number_densities.elements(py),
            columns.densities.elements(py),
        );
        let (pressures, ids) = (columns.pressures.elements(py), columns.ids.elements(py));
        let images = columns.images.elements(py);
        let (particles, units) = (&engine.particles, &engine.units);
        let (force_unit, pressure_unit) = (units.force(), units.pressure());
        let (number_unit, mass_unit) = (units.number_density(), units.mass_density());
        for slot in 0..self.n {
            let row = particles.row[slot] as usize;
            let (position, image) = exported_position(engine, slot);
            for a in 0..d {
                positions[row * d + a] = position[a];
                images[row * d + a] = image[a];
                velocities[row * d + a] = particles.velocity[slot][a] * units.velocity;
                forces[row * d + a] = particles.force[slot][a] * force_unit;
            }
            let density = particles.density[slot];
            numbers[row] = density * number_unit;
            densities[row] = density * mass_unit;
            pressures[row] = particles.velocity[slot][3] * density * density * pressure_unit;
            ids[row] = particles.id[slot];
        }
    }

    /// Takes over what the user wrote into positions and velocities since the last export, and
    /// brings the derived arrays up to date with it.
    fn import(&self, py: Python<'_>, engine: &mut Engine) -> PyResult<()> {
        let d = self.dimension;
        let positions = self.columns.positions.elements(py);
        let velocities = self.columns.velocities.elements(py);
        let mut changes = Vec::new();
        let mut lists = false;
        for slot in 0..self.n {
            let row = engine.particles.row[slot] as usize;
            let at = row * d..(row + 1) * d;
            let (position, _) = exported_position(engine, slot);
            let velocity = &engine.particles.velocity[slot];
            let moved = positions[at.clone()] != position[..d];
            let pushed =
                (0..d).any(|a| velocities[row * d + a] != velocity[a] * engine.units.velocity);
            if moved || pushed {
                changes.push((slot, row, moved, pushed));
                lists |= moved;
            }
        }
        if changes.is_empty() {
            return Ok(());
        }
        check_finite("positions", positions, d)?;
        check_finite("velocities", velocities, d)?;
        if lists {
            check_places(engine, positions)?;
            let mut places = vec![[0.0; 3]; self.n];
            for (k, x) in positions.iter().enumerate() {
                places[k / d][k % d] = x / engine.units.length;
            }
            check_inside(py, engine, &places)?;
        }
        for (slot, row, moved, pushed) in changes {
            let units = engine.units;
            let record = &engine.particles.position[slot];
            let mut position = [record[0], record[1], record[2]];
            let record = &engine.particles.velocity[slot];
            let mut velocity = [record[0], record[1], record[2]];
            if moved {
                // The user's position lies in the image that the arrays show.
                engine.particles.image[slot] = exported_position(engine, slot).1;
            }
            for a in 0..d {
                if moved {
                    position[a] = positions[row * d + a] / units.length;
                }
                if pushed {
                    velocity[a] = velocities[row * d + a] / units.velocity;
                }
            }
            engine.place(slot, position, velocity);
        }
        engine.renew(lists).map_err(|e| to_python(py, &e))?;
        self.export(py, engine);
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

/// Position inside the box in the user's units, and the image it is in.
fn exported_position(engine: &Engine, slot: usize) -> ([f64; 3], [i32; 3]) {
    let mut position = [0.0; 3];
    let mut image = engine.particles.image[slot];
    for axis in 0..engine.dimension {
        let (x, turns) = engine
            .cell
            .wrap(axis, engine.particles.position[slot][axis]);
        position[axis] = x * engine.units.length;
        image[axis] += turns;
    }
    (position, image)
}

#[pymethods]
impl Core {
    #[new]
    #[pyo3(signature = (positions, velocities, *, r#box, support, mass, thermal_energy, kernel, friction,
        friction_across, friction_along, eos, noise, integrator, iterations, body_force, dt, seed, skin,
        threads, flow_speed=0.0, periodic=Vec::new(), walls=Vec::new(),
        fields=Vec::new(), wall_model=None, frozen=None))]
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
    ) -> PyResult<Self> {
        let (positions, velocities) = (positions.as_array(), velocities.as_array());
        let n = positions.nrows();
        let dimension = r#box.len();
        let thermal = if noise == "none" { 0.0 } else { thermal_energy };
        let settings = Settings {
            combination: Combination {
                dimension,
                kernel,
                friction,
                noise,
                integrator,
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
            flow_speed: flow_speed.max(directed_speed(&velocities, thermal, mass)),
            threads,
            periodic,
            walls,
            fields: fields.iter().map(|f| f.field.clone()).collect(),
            wall_model: wall_model.unwrap_or_else(|| ("symmetric_images".into(), Vec::new())),
            frozen: frozen.map_or_else(|| Ok(Vec::new()), |places| rows("frozen", &places, 1.0))?,
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
        py.detach(|| engine.renew(true))
            .map_err(|e| to_python(py, &e))?;
        let columns = Columns {
            positions: Column::new(py, n, dimension, true)?,
            velocities: Column::new(py, n, dimension, true)?,
            forces: Column::new(py, n, dimension, false)?,
            number_densities: Column::new(py, n, 0, false)?,
            densities: Column::new(py, n, 0, false)?,
            pressures: Column::new(py, n, 0, false)?,
            ids: Column::new(py, n, 0, false)?,
            images: Column::new(py, n, dimension, false)?,
        };
        let core = Self {
            engine: Mutex::new(engine),
            columns,
            n,
            dimension,
            process: std::process::id(),
        };
        core.export(py, &*core.lock()?);
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

    /// Advances by `steps` steps of `dt`; the arrays show the new state afterwards, or the old one
    /// if the run failed.
    fn run(&self, py: Python<'_>, steps: u64, dt: f64) -> PyResult<()> {
        if !(dt.is_finite() && dt > 0.0) {
            return Err(PyValueError::new_err(format!(
                "`dt` must be finite and > 0, got {dt}"
            )));
        }
        let mut engine = self.lock()?;
        self.import(py, &mut engine)?;
        let (step, clock) = (engine.step, engine.clock());
        let result = {
            let engine = &mut *engine;
            py.detach(|| engine.run(steps, dt))
        };
        match result {
            Ok(()) => {
                self.export(py, &engine);
                Ok(())
            }
            Err(error) => {
                self.go_back(py, &mut engine, step, clock);
                Err(to_python(py, &error))
            }
        }
    }

    /// Brings derived arrays up to date with what the user wrote.
    fn refresh(&self, py: Python<'_>) -> PyResult<()> {
        self.import(py, &mut *self.lock()?)
    }

    /// Gives wall `index` the motion of `wall`, which must have its form; forces follow.
    fn move_wall(&self, py: Python<'_>, index: usize, wall: WallSettings) -> PyResult<()> {
        let mut engine = self.lock()?;
        self.import(py, &mut engine)?;
        let Engine {
            walls, cell, units, ..
        } = &mut *engine;
        walls
            .set_motion(index, &wall, self.dimension, cell, units)
            .map_err(|e| to_python(py, &e))?;
        engine.renew(false).map_err(|e| to_python(py, &e))?;
        self.export(py, &engine);
        Ok(())
    }

    /// Conservative, dissipative and random force (the last as velocity Verlet draws it at the
    /// step `step`, by default the present one), (N, D) each.
    #[pyo3(signature = (step=None))]
    fn force_parts<'py>(&self, py: Python<'py>, step: Option<u64>) -> PyResult<Bound<'py, PyDict>> {
        let mut engine = self.lock()?;
        self.import(py, &mut engine)?;
        let step = step.unwrap_or(engine.step);
        let parts = engine.force_parts(step);
        let result = PyDict::new(py);
        result.set_item(
            "conservative",
            self.by_row(py, &engine, &parts.conservative),
        )?;
        result.set_item("dissipative", self.by_row(py, &engine, &parts.dissipative))?;
        result.set_item("random", self.by_row(py, &engine, &parts.random))?;
        Ok(result)
    }

    /// Rows of the pairs in the order of a forward sweep, (M, 2); pairs in the skin included.
    fn pair_order<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<u32>>> {
        let engine = self.lock()?;
        let row = |slot: u32| engine.particles.row[slot as usize];
        let blocks = &engine.list.blocks;
        let order = || {
            engine
                .grid
                .colours
                .iter()
                .flatten()
                .map(|&b| &blocks[b as usize])
        };
        let mut pairs = Vec::new();
        if blocks.iter().all(|block| block.shuffled.is_empty()) {
            for block in order() {
                let mut begin = 0;
                for &[head, end] in &block.rows {
                    for &place in &block.neighbours[begin..end as usize] {
                        pairs.extend([row(head), row(block.slots[place as usize])]);
                    }
                    begin = end as usize;
                }
            }
        } else {
            for round in 0..ROUNDS {
                for block in order() {
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

    /// The links to images in the order of a forward sweep, (M, 3): rows of both particles and the
    /// label of the kind of image; links in the skin included.
    fn wall_link_order<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<u32>>> {
        let engine = self.lock()?;
        let row = |slot: u32| engine.particles.row[slot as usize];
        let walls = &engine.walls;
        let mut table = Vec::new();
        for &base in engine.grid.colours.iter().flatten() {
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

    /// Exact initial slope of the velocity autocorrelation, (1/m) <sum_j g_ij> (a + b/D) [1/time].
    fn friction_rate(&self, py: Python<'_>) -> PyResult<f64> {
        let mut engine = self.lock()?;
        self.import(py, &mut engine)?;
        let time = engine.units.time();
        Ok(engine.friction_rate() / time)
    }

    /// Sizes and counts: pairs in the lists, bytes, skin and margin [length], renewals.
    fn statistics<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let engine = self.lock()?;
        let (skin, margin) = engine.skin_and_margin();
        let result = PyDict::new(py);
        result.set_item("pairs_in_list", engine.list.len())?;
        result.set_item("list_bytes", engine.list.bytes())?;
        result.set_item("state_bytes", engine.state_bytes() + self.column_bytes())?;
        result.set_item("skin", skin * engine.units.length)?;
        result.set_item("margin", margin * engine.units.length)?;
        result.set_item("grid_renewals", engine.counters.grid_renewals)?;
        result.set_item("list_builds", engine.counters.list_builds)?;
        result.set_item("blocks", engine.grid.blocks)?;
        result.set_item("wall_particles", engine.walls.near.len())?;
        result.set_item("wall_links", engine.walls.link_count())?;
        result.set_item("wall_crossings", engine.walls.crossings)?;
        Ok(result)
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
        let profile = Profile::new(every, self.dimension, coordinate, interval, bins, block);
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
        self.import(py, &mut engine)?;
        let state = PyDict::new(py);
        let particles = &engine.particles;
        let clock = engine.clock();
        state.set_item("step", engine.step)?;
        state.set_item("base_step", clock.base_step)?;
        state.set_item("base_time", clock.base_time)?;
        state.set_item("dt", clock.dt)?;
        state.set_item("position", bytes_of(py, &particles.position))?;
        state.set_item("velocity", bytes_of(py, &particles.velocity))?;
        state.set_item("force", bytes_of(py, &particles.force))?;
        state.set_item("id", bytes_of(py, &particles.id))?;
        state.set_item("row", bytes_of(py, &particles.row))?;
        state.set_item("image", bytes_of(py, &particles.image))?;
        state.set_item("grid_reference", bytes_of(py, &engine.grid.reference))?;
        state.set_item("list_reference", bytes_of(py, &engine.list.reference))?;
        state.set_item("wall_force", engine.walls.force.concat())?;
        Ok(state)
    }

    /// Restores what `state` gave, bit for bit, into a simulation built with the same settings.
    fn set_state(&self, py: Python<'_>, state: &Bound<'_, PyDict>) -> PyResult<()> {
        let mut engine = self.lock()?;
        let n = self.n;
        let position: Vec<[f64; 4]> = values_of(state, "position", n)?;
        let velocity: Vec<[f64; 4]> = values_of(state, "velocity", n)?;
        let force: Vec<[f64; 4]> = values_of(state, "force", n)?;
        let id: Vec<u64> = values_of(state, "id", n)?;
        let row: Vec<u32> = values_of(state, "row", n)?;
        let image: Vec<[i32; 3]> = values_of(state, "image", n)?;
        let grid: Vec<[f64; 3]> = values_of(state, "grid_reference", n)?;
        let (skin, margin) = engine.skin_and_margin();
        let listed = if skin < margin { n } else { 0 };
        let list: Vec<[f64; 3]> = values_of(state, "list_reference", listed)?;
        let mut seen = vec![false; n];
        for &row in &row {
            match seen.get_mut(row as usize) {
                Some(once) if !*once => *once = true,
                _ => {
                    return Err(PyValueError::new_err(format!(
                        "`row` must be a permutation of the rows, got {row} out of range or twice"
                    )));
                }
            }
        }
        let finite = |what: &str, ok: bool| {
            if ok {
                Ok(())
            } else {
                Err(PyValueError::new_err(format!("`{what}` must be finite")))
            }
        };
        let all3 = |v: &[[f64; 4]]| v.iter().all(|r| r[..3].iter().all(|x| x.is_finite()));
        finite("position", all3(&position))?;
        finite("velocity", all3(&velocity))?;
        finite("force", all3(&force))?;
        for (what, reference) in [("grid_reference", &grid), ("list_reference", &list)] {
            finite(what, reference.iter().flatten().all(|x| x.is_finite()))?;
        }
        let step: u64 = item(state, "step")?.extract()?;
        let clock = Clock {
            base_time: item(state, "base_time")?.extract()?,
            base_step: item(state, "base_step")?.extract()?,
            dt: item(state, "dt")?.extract()?,
        };
        if clock.base_step > step
            || clock.dt.is_nan()
            || clock.dt <= 0.0
            || !clock.base_time.is_finite()
        {
            return Err(PyValueError::new_err(format!(
                "`base_step` must be at most `step`, and `dt` > 0, got {clock:?} at step {step}"
            )));
        }
        let walls = engine.walls.force.len();
        let wall_force: Vec<f64> = match state.get_item("wall_force")? {
            Some(values) => values.extract()?,
            None => Vec::new(),
        };
        if !wall_force.is_empty() {
            if wall_force.len() != 6 * walls {
                return Err(PyValueError::new_err(format!(
                    "`wall_force` must hold {} numbers, got {}",
                    6 * walls,
                    wall_force.len()
                )));
            }
            finite("wall_force", wall_force.iter().all(|x| x.is_finite()))?;
        }
        let particles = &mut engine.particles;
        particles.velocity = velocity;
        particles.id = id;
        particles.row = row;
        particles.image = image;
        engine.set_clock(clock, step);
        let engine_ref = &mut *engine;
        py.detach(|| engine_ref.restore(&grid, &list, &position, &force));
        // Like the particles' forces, those on walls may be of velocities between two steps.
        let wrenches = engine.walls.force.iter_mut();
        for (wrench, values) in wrenches.zip(wall_force.chunks_exact(6)) {
            wrench.copy_from_slice(values);
        }
        self.export(py, &engine);
        Ok(())
    }
}

impl Core {
    fn column_bytes(&self) -> usize {
        self.n * (8 * (3 * self.dimension + 4) + 4 * self.dimension)
    }

    /// After a failed run: the engine returns to what the arrays still show.
    fn go_back(&self, py: Python<'_>, engine: &mut Engine, step: u64, clock: Clock) {
        let d = self.dimension;
        let positions = self.columns.positions.elements(py);
        let velocities = self.columns.velocities.elements(py);
        let images = self.columns.images.elements(py);
        let units = engine.units;
        for slot in 0..self.n {
            let row = engine.particles.row[slot] as usize;
            let (mut position, mut velocity) = ([0.0; 3], [0.0; 3]);
            for a in 0..d {
                position[a] = positions[row * d + a] / units.length;
                velocity[a] = velocities[row * d + a] / units.velocity;
                engine.particles.image[slot][a] = images[row * d + a];
            }
            engine.place(slot, position, velocity);
        }
        engine.set_clock(clock, step);
        // The exported state was good, so this cannot fail; if it does, the next run says so.
        let _ = engine.renew(true);
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

fn item<'py>(state: &Bound<'py, PyDict>, key: &str) -> PyResult<Bound<'py, PyAny>> {
    state
        .get_item(key)?
        .ok_or_else(|| PyValueError::new_err(format!("`{key}` is missing from the state")))
}

/// Plain values as bytes.
fn bytes_of<'py, T: Plain>(py: Python<'py>, values: &[T]) -> Bound<'py, PyBytes> {
    let mut bytes = Vec::with_capacity(std::mem::size_of_val(values));
    for value in values {
        value.write(&mut bytes);
    }
    PyBytes::new(py, &bytes)
}

fn values_of<T: Plain>(state: &Bound<'_, PyDict>, key: &str, n: usize) -> PyResult<Vec<T>> {
    let any = item(state, key)?;
    let bytes = any.cast::<PyBytes>()?.as_bytes();
    let size = std::mem::size_of::<T>();
    if bytes.len() != n * size {
        return Err(PyValueError::new_err(format!(
            "`{key}` must hold {} bytes, got {}",
            n * size,
            bytes.len()
        )));
    }
    Ok(bytes.chunks_exact(size).map(T::read).collect())
}

/// A value with a fixed little-endian form.
trait Plain: Copy {
    fn write(&self, bytes: &mut Vec<u8>);
    fn read(bytes: &[u8]) -> Self;
}

macro_rules! plain {
    ($kind:ty) => {
        impl Plain for $kind {
            fn write(&self, bytes: &mut Vec<u8>) {
                bytes.extend(self.to_le_bytes());
            }
            fn read(bytes: &[u8]) -> Self {
                let mut buffer = [0; std::mem::size_of::<$kind>()];
                buffer.copy_from_slice(bytes);
                <$kind>::from_le_bytes(buffer)
            }
        }
    };
}
plain!(f64);
plain!(u64);
plain!(u32);
plain!(i32);

impl<T: Plain, const K: usize> Plain for [T; K] {
    fn write(&self, bytes: &mut Vec<u8>) {
        for value in self {
            value.write(bytes);
        }
    }
    fn read(bytes: &[u8]) -> Self {
        let size = std::mem::size_of::<T>();
        std::array::from_fn(|k| T::read(&bytes[k * size..(k + 1) * size]))
    }
}
