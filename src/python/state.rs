//! The exact internal state as a dictionary of bytes, for checkpoints, and back.

use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};

use crate::simulation::{Clock, Engine};
use crate::thermal::Accounts;

/// Writes the state of an engine.
pub fn write<'py>(py: Python<'py>, engine: &Engine) -> PyResult<Bound<'py, PyDict>> {
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
    state.set_item("list_travel", engine.list.travel)?;
    let (skin, margin) = engine.skin_and_margin();
    state.set_item("list_widths", vec![skin, margin])?;
    state.set_item("wall_force", engine.walls.force.concat())?;
    for (_, scalar) in particles.saved_scalars() {
        state.set_item(scalar.name, bytes_of(py, &scalar.values))?;
    }
    state.set_item("wall_impulse", engine.walls.impulse.concat())?;
    state.set_item("wall_crossings", engine.walls.crossings)?;
    if let Some(thermal) = &engine.thermal {
        let held = &thermal.accounts;
        let mut accounts = vec![held.discarded, held.body_work, held.unbooked];
        accounts.push(held.refused as f64);
        accounts.extend(held.walls.iter().flatten());
        state.set_item("accounts", accounts)?;
    }
    Ok(state)
}

/// A state that has been read and checked, but not yet taken over.
pub struct Parsed {
    position: Vec<[f64; 4]>,
    velocity: Vec<[f64; 4]>,
    force: Vec<[f64; 4]>,
    id: Vec<u64>,
    row: Vec<u32>,
    image: Vec<[i32; 3]>,
    grid: Vec<[f64; 3]>,
    list: Option<(Vec<[f64; 3]>, f64)>,
    wall_force: Vec<f64>,
    wall_impulse: Vec<f64>,
    wall_crossings: u64,
    scalars: Vec<(usize, Vec<f64>)>,
    accounts: Vec<f64>,
    step: u64,
    clock: Clock,
}

fn finite(what: &str, ok: bool) -> PyResult<()> {
    if ok {
        Ok(())
    } else {
        Err(PyValueError::new_err(format!("`{what}` must be finite")))
    }
}

fn check_rows(rows: &[u32]) -> PyResult<()> {
    let mut seen = vec![false; rows.len()];
    for &row in rows {
        match seen.get_mut(row as usize) {
            Some(once) if !*once => *once = true,
            _ => {
                return Err(PyValueError::new_err(format!(
                    "`row` must be a permutation of the rows, got {row} out of range or twice"
                )));
            }
        }
    }
    Ok(())
}

fn read_clock(state: &Bound<'_, PyDict>) -> PyResult<(u64, Clock)> {
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
    Ok((step, clock))
}

/// Numbers that a state may lack: none, or so many.
fn numbers_of(state: &Bound<'_, PyDict>, key: &str, count: usize) -> PyResult<Vec<f64>> {
    let values: Vec<f64> = match state.get_item(key)? {
        Some(values) => values.extract()?,
        None => Vec::new(),
    };
    if !values.is_empty() && values.len() != count {
        return Err(PyValueError::new_err(format!(
            "`{key}` must hold {count} numbers, got {}",
            values.len()
        )));
    }
    finite(key, values.iter().all(|x| x.is_finite()))?;
    Ok(values)
}

impl Parsed {
    /// Reads what `write` wrote, for an engine built with the same settings.
    pub fn read(state: &Bound<'_, PyDict>, engine: &Engine) -> PyResult<Self> {
        let n = engine.particles.len();
        let (skin, margin) = engine.skin_and_margin();
        let listed = if skin < margin { n } else { 0 };
        let (step, clock) = read_clock(state)?;
        let mut scalars = Vec::new();
        for (number, scalar) in engine.particles.saved_scalars() {
            let values: Vec<f64> = values_of(state, scalar.name, n)?;
            if !values.iter().all(|x| x.is_finite() && *x > 0.0) {
                return Err(PyValueError::new_err(format!(
                    "`{}` must be finite and > 0",
                    scalar.name
                )));
            }
            scalars.push((number, values));
        }
        let accounts = engine
            .thermal
            .as_ref()
            .map_or(0, |thermal| 4 + 2 * thermal.accounts.walls.len());
        let parsed = Self {
            position: values_of(state, "position", n)?,
            velocity: values_of(state, "velocity", n)?,
            force: values_of(state, "force", n)?,
            id: values_of(state, "id", n)?,
            row: values_of(state, "row", n)?,
            image: values_of(state, "image", n)?,
            grid: values_of(state, "grid_reference", n)?,
            // A file of an earlier version may say nothing of that, or have had other widths.
            list: if numbers_of(state, "list_widths", 2)? == [skin, margin] {
                let travel: f64 = item(state, "list_travel")?.extract()?;
                Some((values_of(state, "list_reference", listed)?, travel))
            } else {
                None
            },
            wall_force: numbers_of(state, "wall_force", 6 * engine.walls.force.len())?,
            wall_impulse: numbers_of(state, "wall_impulse", 6 * engine.walls.force.len())?,
            wall_crossings: match state.get_item("wall_crossings")? {
                Some(count) => count.extract()?,
                None => 0,
            },
            scalars,
            accounts: numbers_of(state, "accounts", accounts)?,
            step,
            clock,
        };
        check_rows(&parsed.row)?;
        let all3 = |v: &[[f64; 4]]| v.iter().all(|r| r[..3].iter().all(|x| x.is_finite()));
        finite("position", all3(&parsed.position))?;
        finite("velocity", all3(&parsed.velocity))?;
        finite("force", all3(&parsed.force))?;
        let none = (Vec::new(), 0.0);
        let (list, travel) = parsed.list.as_ref().unwrap_or(&none);
        finite("list_travel", travel.is_finite())?;
        if *travel < 0.0 {
            return Err(PyValueError::new_err(format!(
                "`list_travel` must be >= 0, got {travel}"
            )));
        }
        for (what, reference) in [("grid_reference", &parsed.grid), ("list_reference", list)] {
            finite(what, reference.iter().flatten().all(|x| x.is_finite()))?;
        }
        Ok(parsed)
    }

    /// The engine takes over the state, bit for bit.
    pub fn restore(self, engine: &mut Engine) {
        let particles = &mut engine.particles;
        particles.velocity.copy_from_slice(&self.velocity);
        particles.id = self.id;
        particles.row = self.row;
        particles.image = self.image;
        for (number, values) in self.scalars {
            particles.scalars[number].values = values;
        }
        if let (Some(thermal), [discarded, body_work, unbooked, refused, walls @ ..]) =
            (&mut engine.thermal, &self.accounts[..])
        {
            let walls = walls.chunks_exact(2).map(|pair| [pair[0], pair[1]]);
            thermal.accounts = Accounts {
                discarded: *discarded,
                body_work: *body_work,
                unbooked: *unbooked,
                refused: *refused as u64,
                walls: walls.collect(),
            };
        }
        let impulses = engine.walls.impulse.iter_mut();
        for (impulse, values) in impulses.zip(self.wall_impulse.chunks_exact(6)) {
            impulse.copy_from_slice(values);
        }
        engine.walls.crossings = self.wall_crossings;
        engine.set_clock(self.clock, self.step);
        let list = self.list.as_ref().map(|(at, travel)| (&at[..], *travel));
        engine.restore(&self.grid, list, &self.position, &self.force);
        // Like the particles' forces, those on walls may be of velocities between two steps.
        let wrenches = engine.walls.force.iter_mut();
        for (wrench, values) in wrenches.zip(self.wall_force.chunks_exact(6)) {
            wrench.copy_from_slice(values);
        }
    }
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
