//! The arrays that users see, in their units and row order, and what they may write into them.

use std::sync::atomic::{AtomicU64, Ordering};

use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use super::arrays::Column;
use super::errors::to_python;
use crate::digest::digest;
use crate::error::Result;
use crate::simulation::Engine;
use crate::thermal::Thermal;

/// All arrays of one simulation.
pub struct Columns {
    /// (N, D), writable.
    pub positions: Column<f64>,
    /// (N, D), writable.
    pub velocities: Column<f64>,
    /// (N, D).
    pub forces: Column<f64>,
    /// (N,).
    pub number_densities: Column<f64>,
    /// (N,).
    pub densities: Column<f64>,
    /// (N,).
    pub pressures: Column<f64>,
    /// (N,).
    pub ids: Column<u64>,
    /// (N, D).
    pub images: Column<i32>,
    /// Of particles with an energy.
    pub thermal: Option<ThermalColumns>,
    /// Digest of what the user may write into, as it was shown last.
    shown: AtomicU64,
    n: usize,
    dimension: usize,
}

/// Arrays of particles with an energy, (N,) each.
pub struct ThermalColumns {
    /// Writable.
    pub temperatures: Column<f64>,
    /// Of the caloric equation of state.
    pub energies: Column<f64>,
    /// The same.
    pub entropies: Column<f64>,
}

/// What the user has changed of a particle.
struct Changed {
    slot: usize,
    row: usize,
    moved: bool,
    pushed: bool,
    heated: bool,
}

pub fn check_finite(name: &str, values: &[f64], width: usize) -> PyResult<()> {
    match values.iter().position(|x| !x.is_finite()) {
        None => Ok(()),
        Some(at) => Err(PyValueError::new_err(format!(
            "`{name}` must be finite, got {} in row {}",
            values[at],
            at / width
        ))),
    }
}

/// Temperatures must be those of something.
pub fn check_temperatures(values: &[f64]) -> PyResult<()> {
    match values.iter().position(|x| !(x.is_finite() && *x > 0.0)) {
        None => Ok(()),
        Some(row) => Err(PyValueError::new_err(format!(
            "`temperatures` must be finite and > 0, got {} in row {row}",
            values[row]
        ))),
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
pub fn check_inside(py: Python<'_>, engine: &Engine, places: &[[f64; 3]]) -> PyResult<()> {
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

fn heat_of(engine: &Engine, thermal: &Thermal, slot: usize) -> f64 {
    engine.particles.scalars[thermal.fields.heat].values[slot]
}

impl Columns {
    /// For all particles of an engine.
    pub fn new(py: Python<'_>, engine: &Engine) -> PyResult<Self> {
        let (n, d) = (engine.particles.len(), engine.dimension);
        let thermal = match engine.thermal {
            None => None,
            Some(_) => Some(ThermalColumns {
                temperatures: Column::new(py, n, 0, true)?,
                energies: Column::new(py, n, 0, false)?,
                entropies: Column::new(py, n, 0, false)?,
            }),
        };
        Ok(Self {
            positions: Column::new(py, n, d, true)?,
            velocities: Column::new(py, n, d, true)?,
            forces: Column::new(py, n, d, false)?,
            number_densities: Column::new(py, n, 0, false)?,
            densities: Column::new(py, n, 0, false)?,
            pressures: Column::new(py, n, 0, false)?,
            ids: Column::new(py, n, 0, false)?,
            images: Column::new(py, n, d, false)?,
            thermal,
            shown: AtomicU64::new(0),
            n,
            dimension: d,
        })
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        let thermal = if self.thermal.is_some() { 3 } else { 0 };
        self.n * (8 * (3 * self.dimension + 4 + thermal) + 4 * self.dimension)
    }

    /// Writes the engine's state into the arrays.
    pub fn export(&self, py: Python<'_>, engine: &Engine) {
        let d = self.dimension;
        let (positions, velocities) = (self.positions.elements(py), self.velocities.elements(py));
        let forces = self.forces.elements(py);
        let (numbers, densities) = (
            self.number_densities.elements(py),
            self.densities.elements(py),
        );
        let (pressures, ids) = (self.pressures.elements(py), self.ids.elements(py));
        let images = self.images.elements(py);
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
        if let (Some(columns), Some(thermal)) = (&self.thermal, &engine.thermal) {
            let (temperatures, energies) = (
                columns.temperatures.elements(py),
                columns.energies.elements(py),
            );
            let entropies = columns.entropies.elements(py);
            let boltzmann = units.energy() / thermal.kelvin;
            for slot in 0..self.n {
                let row = particles.row[slot] as usize;
                let heat = heat_of(engine, thermal, slot);
                let [energy, entropy] = thermal.energy_and_entropy(particles.density[slot], heat);
                temperatures[row] = thermal.temperature(particles.density[slot], heat);
                energies[row] = energy * units.energy();
                entropies[row] = entropy * boltzmann;
            }
        }
        self.shown.store(self.digest(py), Ordering::Relaxed);
    }

    /// Takes over what the user wrote since the last export, and brings the derived arrays up to date.
    pub fn import(&self, py: Python<'_>, engine: &mut Engine) -> PyResult<()> {
        let changes = self.changes(py, engine);
        if changes.is_empty() {
            return Ok(());
        }
        let d = self.dimension;
        let positions = self.positions.elements(py);
        let velocities = self.velocities.elements(py);
        check_finite("positions", positions, d)?;
        check_finite("velocities", velocities, d)?;
        if let Some(columns) = &self.thermal {
            check_temperatures(columns.temperatures.elements(py))?;
        }
        let lists = changes.iter().any(|change| change.moved);
        if lists {
            check_places(engine, positions)?;
            let mut places = vec![[0.0; 3]; self.n];
            for (k, x) in positions.iter().enumerate() {
                places[k / d][k % d] = x / engine.units.length;
            }
            check_inside(py, engine, &places)?;
        }
        // Where it follows the density, temperatures are what stays as positions change.
        let mut heated = vec![lists; self.n];
        for change in changes {
            self.take_over(py, engine, &change);
            heated[change.row] |= change.heated;
        }
        engine.renew(lists).map_err(|e| to_python(py, &e))?;
        self.settle(py, engine, &heated)
            .map_err(|e| to_python(py, &e))?;
        self.export(py, engine);
        Ok(())
    }

    /// Digest of what the user may write into.
    fn digest(&self, py: Python<'_>) -> u64 {
        let mut sum = digest(self.positions.elements(py), 0);
        sum = digest(self.velocities.elements(py), sum);
        match &self.thermal {
            None => sum,
            Some(columns) => digest(columns.temperatures.elements(py), sum),
        }
    }

    fn changes(&self, py: Python<'_>, engine: &Engine) -> Vec<Changed> {
        if self.digest(py) == self.shown.load(Ordering::Relaxed) {
            return Vec::new();
        }
        let d = self.dimension;
        let positions = self.positions.elements(py);
        let velocities = self.velocities.elements(py);
        let thermal = self.thermal.as_ref().zip(engine.thermal.as_ref());
        let mut changes = Vec::new();
        for slot in 0..self.n {
            let row = engine.particles.row[slot] as usize;
            let (position, _) = exported_position(engine, slot);
            let velocity = &engine.particles.velocity[slot];
            let moved = (0..d).any(|a| positions[row * d + a] != position[a]);
            let pushed =
                (0..d).any(|a| velocities[row * d + a] != velocity[a] * engine.units.velocity);
            let heated = thermal.is_some_and(|(columns, thermal)| {
                let density = engine.particles.density[slot];
                let exported = thermal.temperature(density, heat_of(engine, thermal, slot));
                columns.temperatures.elements(py)[row] != exported
            });
            if moved || pushed || heated {
                changes.push(Changed {
                    slot,
                    row,
                    moved,
                    pushed,
                    heated,
                });
            }
        }
        changes
    }

    fn take_over(&self, py: Python<'_>, engine: &mut Engine, change: &Changed) {
        let Changed { slot, row, .. } = *change;
        let d = self.dimension;
        let units = engine.units;
        let record = &engine.particles.position[slot];
        let mut position = [record[0], record[1], record[2]];
        let record = &engine.particles.velocity[slot];
        let mut velocity = [record[0], record[1], record[2]];
        if change.moved {
            // The user's position lies in the image that the arrays show.
            engine.particles.image[slot] = exported_position(engine, slot).1;
        }
        for a in 0..d {
            if change.moved {
                position[a] = self.positions.elements(py)[row * d + a] / units.length;
            }
            if change.pushed {
                velocity[a] = self.velocities.elements(py)[row * d + a] / units.velocity;
            }
        }
        engine.place(slot, position, velocity);
        if change.heated {
            self.take_temperature(py, engine, slot, row);
        }
    }

    /// Where the heat capacity follows the density, temperatures of the user (by row) mean thermal
    /// energies only once the densities are those of his positions.
    pub fn settle(&self, py: Python<'_>, engine: &mut Engine, heated: &[bool]) -> Result<()> {
        match &engine.thermal {
            Some(thermal) if !thermal.heat_capacity_is_constant() => {}
            _ => return Ok(()),
        }
        if !heated.contains(&true) {
            return Ok(());
        }
        for slot in 0..self.n {
            let row = engine.particles.row[slot] as usize;
            if heated[row] {
                self.take_temperature(py, engine, slot, row);
            }
        }
        engine.renew(false)
    }

    fn take_temperature(&self, py: Python<'_>, engine: &mut Engine, slot: usize, row: usize) {
        if let (Some(columns), Some(thermal)) = (&self.thermal, &engine.thermal) {
            let d = engine.particles.density[slot];
            let heat = thermal.heat(d, columns.temperatures.elements(py)[row]);
            engine.particles.scalars[thermal.fields.heat].values[slot] = heat;
        }
    }

    /// The engine returns to what the arrays show.
    pub fn go_back(&self, py: Python<'_>, engine: &mut Engine) {
        let d = self.dimension;
        let images = self.images.elements(py);
        for slot in 0..self.n {
            let row = engine.particles.row[slot] as usize;
            let change = Changed {
                slot,
                row,
                moved: true,
                pushed: true,
                heated: true,
            };
            self.take_over(py, engine, &change);
            engine.particles.image[slot][..d].copy_from_slice(&images[row * d..(row + 1) * d]);
        }
    }
}
