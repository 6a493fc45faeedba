//! Free functions: the physics of a site or a pair, for the Python side and for tests.

use numpy::ndarray::Array2;
use numpy::{IntoPyArray, PyArray1, PyArray2, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};

use super::errors::to_python;
use super::walls::WallField;
use crate::domain::PeriodicBox;
use crate::kernel::{Kernel, Lucy, QuinticSpline, WendlandC2, WendlandC4};
use crate::neighbor::{SkinModel, margin_and_skin};
use crate::random::{Gaussian, Stream, SweepKey, Uniform, Variate};
use crate::real::Plain;
use crate::sweep::force_variates as force_variates_of;
use crate::units::Units;
use crate::wall::{CurvatureWeight, Missing, WallSettings, Walls};
use crate::{eos, random, registry, relax};

fn invalid(text: String) -> PyErr {
    PyValueError::new_err(text)
}

fn check_dimension(dimension: usize) -> PyResult<()> {
    if registry::DIMENSIONS.contains(&dimension) {
        Ok(())
    } else {
        Err(invalid(format!(
            "`dimension` must be 2 or 3, got {dimension}"
        )))
    }
}

/// Floating-point operations and bytes a second that so many threads reach at best, by loops of
/// nothing else.
#[pyfunction]
fn peak(py: Python<'_>, threads: usize) -> PyResult<(f64, f64)> {
    let [flops, bytes] = py
        .detach(|| crate::peak::peak(threads.max(1)))
        .map_err(|e| to_python(py, &e))?;
    Ok((flops, bytes))
}

/// Names of the kernels.
#[pyfunction]
fn kernel_names() -> Vec<&'static str> {
    registry::KERNELS.to_vec()
}

fn profile<K: Kernel>(dimension: usize, q: &[f64]) -> (Vec<f64>, Vec<f64>) {
    let both = |q: f64| match dimension {
        2 => (K::w::<_, 2>(q), K::f::<_, 2>(q)),
        _ => (K::w::<_, 3>(q), K::f::<_, 3>(q)),
    };
    q.iter().map(|&q| both(q)).unzip()
}

type Pair1<'py> = (Bound<'py, PyArray1<f64>>, Bound<'py, PyArray1<f64>>);

/// W h^D and F h^(D+2) at q = r/h.
#[pyfunction]
fn kernel_profile<'py>(
    py: Python<'py>,
    kernel: &str,
    dimension: usize,
    q: PyReadonlyArray1<'py, f64>,
) -> PyResult<Pair1<'py>> {
    check_dimension(dimension)?;
    let view = q.as_array();
    if let Some(bad) = view.iter().find(|q| q.is_nan() || **q < 0.0) {
        return Err(invalid(format!("`q` must be >= 0, got {bad}")));
    }
    let q = view.to_vec();
    let (w, f) = match kernel {
        Lucy::NAME => profile::<Lucy>(dimension, &q),
        QuinticSpline::NAME => profile::<QuinticSpline>(dimension, &q),
        WendlandC2::NAME => profile::<WendlandC2>(dimension, &q),
        WendlandC4::NAME => profile::<WendlandC4>(dimension, &q),
        other => {
            return Err(invalid(format!(
                "`kernel` must be one of {:?}, got {other:?}",
                registry::KERNELS
            )));
        }
    };
    Ok((w.into_pyarray(py), f.into_pyarray(py)))
}

type Triple1<'py> = (
    Bound<'py, PyArray1<f64>>,
    Bound<'py, PyArray1<f64>>,
    Bound<'py, PyArray1<f64>>,
);

/// Pressure, sound speed squared and specific potential at mass densities.
#[pyfunction]
fn eos_evaluate<'py>(
    py: Python<'py>,
    kind: &str,
    parameters: Vec<f64>,
    density: PyReadonlyArray1<'py, f64>,
) -> PyResult<Triple1<'py>> {
    let eos = eos::build(kind, &parameters).map_err(|e| to_python(py, &e))?;
    let rho = density.as_array().to_vec();
    let map = |f: &dyn Fn(f64) -> f64| rho.iter().map(|&r| f(r)).collect::<Vec<f64>>();
    Ok((
        map(&|r| eos.pressure(r)).into_pyarray(py),
        map(&|r| eos.sound_speed_squared(r)).into_pyarray(py),
        map(&|r| eos.specific_potential(r)).into_pyarray(py),
    ))
}

/// Philox4x32-10.
#[pyfunction]
fn philox4x32(counter: [u32; 4], key: [u32; 2]) -> [u32; 4] {
    random::philox4x32(counter, key)
}

/// The variates of pairs, (n, D), as they act on the particle with the smaller id.
#[pyfunction]
#[allow(clippy::too_many_arguments)]
fn pair_variates<'py>(
    py: Python<'py>,
    seed: u64,
    stream: &str,
    step: u64,
    draw: u8,
    id_a: PyReadonlyArray1<'py, u64>,
    id_b: PyReadonlyArray1<'py, u64>,
    variate: &str,
    dimension: usize,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    check_dimension(dimension)?;
    let Some(stream) = Stream::parse(stream) else {
        return Err(invalid(format!(
            "`stream` must name a random stream, got {stream:?}"
        )));
    };
    let key = SweepKey::new(seed, stream, step, draw);
    let pairs = partners(&id_a, &id_b)?;
    let mut table = Array2::zeros((pairs.len(), dimension));
    for (k, &[a, b]) in pairs.iter().enumerate() {
        let words = key.pair_words(a, b);
        let xi = match variate {
            "gaussian" => Gaussian::draw::<Plain, f64>(words, 1.0, dimension),
            "uniform" => Uniform::draw::<Plain, f64>(words, 1.0, dimension),
            other => return Err(no_variate(other)),
        };
        for axis in 0..dimension {
            table[(k, axis)] = xi[axis];
        }
    }
    Ok(table.into_pyarray(py))
}

/// The variates of the random forces of velocity Verlet, (n, D), as they act on the first particles.
#[pyfunction]
fn force_variates<'py>(
    py: Python<'py>,
    seed: u64,
    step: u64,
    id_a: PyReadonlyArray1<'py, u64>,
    id_b: PyReadonlyArray1<'py, u64>,
    variate: &str,
    dimension: usize,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    check_dimension(dimension)?;
    let pairs = partners(&id_a, &id_b)?;
    let key = SweepKey::new(seed, Stream::PairForce, step, 0);
    let drawn = match variate {
        "gaussian" => force_variates_of::<Gaussian>(&key, &pairs),
        "uniform" => force_variates_of::<Uniform>(&key, &pairs),
        other => return Err(no_variate(other)),
    };
    let table = Array2::from_shape_fn((pairs.len(), dimension), |(k, axis)| drawn[k][axis]);
    Ok(table.into_pyarray(py))
}

/// Pairs of ids from their first and second ends.
fn partners(
    id_a: &PyReadonlyArray1<'_, u64>,
    id_b: &PyReadonlyArray1<'_, u64>,
) -> PyResult<Vec<[u64; 2]>> {
    let (a, b) = (id_a.as_array(), id_b.as_array());
    if a.len() != b.len() {
        return Err(invalid(format!(
            "`id_b` must have the length of `id_a`, {}, got {}",
            a.len(),
            b.len()
        )));
    }
    Ok(a.iter().zip(b.iter()).map(|(&a, &b)| [a, b]).collect())
}

fn no_variate(name: &str) -> PyErr {
    invalid(format!(
        "`variate` must be \"gaussian\" or \"uniform\", got {name:?}"
    ))
}

/// Supported combinations, a dict each.
#[pyfunction]
fn registry_table(py: Python<'_>) -> PyResult<Bound<'_, PyList>> {
    let rows = PyList::empty(py);
    for combination in registry::combinations() {
        let row = PyDict::new(py);
        row.set_item("dimension", combination.dimension)?;
        row.set_item("kernel", combination.kernel)?;
        row.set_item("friction", combination.friction)?;
        row.set_item("noise", combination.noise)?;
        row.set_item("integrator", combination.integrator)?;
        row.set_item("exchanges", combination.exchanges)?;
        row.set_item("precision", combination.precision)?;
        rows.append(row)?;
    }
    Ok(rows)
}

pub(super) fn to_table(
    py: Python<'_>,
    values: Vec<f64>,
    dimension: usize,
) -> PyResult<Bound<'_, PyArray2<f64>>> {
    let n = values.len() / dimension;
    let table =
        Array2::from_shape_vec((n, dimension), values).map_err(|e| invalid(e.to_string()))?;
    Ok(table.into_pyarray(py))
}

/// Normal velocities of unit variance, (n, D), keyed by seed and row.
#[pyfunction]
fn normal_velocities(
    py: Python<'_>,
    n: usize,
    dimension: usize,
    seed: u64,
) -> PyResult<Bound<'_, PyArray2<f64>>> {
    check_dimension(dimension)?;
    to_table(py, relax::normal_velocities(n, dimension, seed), dimension)
}

/// Positions uniform in the unit box, (n, D), keyed by seed and row.
#[pyfunction]
fn uniform_positions(
    py: Python<'_>,
    n: usize,
    dimension: usize,
    seed: u64,
) -> PyResult<Bound<'_, PyArray2<f64>>> {
    check_dimension(dimension)?;
    to_table(py, relax::uniform_positions(n, dimension, seed), dimension)
}

/// Positions relaxed by iterations `first` to `last` of `iterations` of steepest descent, and the
/// relative spread of their density.
#[pyfunction]
#[pyo3(signature = (positions, edges, support, iterations, first=0, last=None, threads=1,
    periodic=Vec::new(), walls=Vec::new(), fields=Vec::new(), volume=None))]
#[allow(clippy::too_many_arguments)]
fn relax_positions<'py>(
    py: Python<'py>,
    positions: PyReadonlyArray2<'py, f64>,
    edges: Vec<f64>,
    support: f64,
    iterations: u32,
    first: u32,
    last: Option<u32>,
    threads: usize,
    mut periodic: Vec<bool>,
    walls: Vec<WallSettings>,
    fields: Vec<PyRef<'py, WallField>>,
    volume: Option<f64>,
) -> PyResult<(Bound<'py, PyArray2<f64>>, f64)> {
    let dimension = edges.len();
    check_dimension(dimension)?;
    let view = positions.as_array();
    if view.ncols() != dimension {
        return Err(invalid(format!(
            "`positions` must have {dimension} columns, got {}",
            view.ncols()
        )));
    }
    periodic.resize(dimension, true);
    let cell =
        PeriodicBox::with_walls(&edges, support, &periodic).map_err(|e| to_python(py, &e))?;
    let units = Units {
        length: support,
        mass: 1.0,
        velocity: 1.0,
        dimension: dimension as i32,
    };
    let fields: Vec<_> = fields.iter().map(|f| f.field.clone()).collect();
    let mut walls = Walls::new(&walls, &fields, WendlandC2::NAME, dimension, &cell, &units)
        .map_err(|e| to_python(py, &e))?;
    let volume = volume.map_or_else(
        || cell.edges[..dimension].iter().product(),
        |v| v * units.number_density(),
    );
    let mut scaled = Vec::with_capacity(view.nrows());
    for row in view.rows() {
        let mut position = [0.0; 3];
        for (axis, x) in row.iter().enumerate() {
            if !x.is_finite() {
                return Err(invalid(format!("`positions` must be finite, got {x}")));
            }
            position[axis] = x / support;
        }
        scaled.push(position);
    }
    if scaled.is_empty() {
        return Err(invalid(
            "`positions` must hold at least one row, got none".into(),
        ));
    }
    walls
        .check_inside(&scaled, &cell)
        .map_err(|e| to_python(py, &e))?;
    let slice = first..last.unwrap_or(iterations).min(iterations);
    // A pool of its own: the global one would not survive a fork.
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads.max(1))
        .build()
        .map_err(|e| invalid(format!("`threads` = {threads}: {e}")))?;
    let spread = py
        .detach(|| {
            pool.install(|| match dimension {
                2 => relax::relax::<2>(&mut scaled, &cell, &mut walls, volume, slice, iterations),
                _ => relax::relax::<3>(&mut scaled, &cell, &mut walls, volume, slice, iterations),
            })
        })
        .map_err(|e| to_python(py, &e))?;
    let flat = scaled
        .iter()
        .flat_map(|p| p[..dimension].iter().map(|x| x * support))
        .collect();
    Ok((to_table(py, flat, dimension)?, spread))
}

/// Margin and skin that a simulation will choose, in supports; lengths in supports, one unit of time.
#[pyfunction]
#[pyo3(signature = (*, particles, dimension, shortest_edge, dt, thermal_speed, flow_speed,
    friction_time, shuffles))]
#[allow(clippy::too_many_arguments)]
fn list_margins(
    particles: usize,
    dimension: usize,
    shortest_edge: f64,
    dt: f64,
    thermal_speed: f64,
    flow_speed: f64,
    friction_time: f64,
    shuffles: bool,
) -> (f64, f64) {
    margin_and_skin(&SkinModel {
        dt,
        speed: thermal_speed,
        drift: flow_speed,
        friction_time,
        n: particles,
        dimension,
        shuffles,
        edge: shortest_edge,
    })
}

/// p(q) and p'(q) of the curvature weight psi = 1 + K h p(phi/h) of images at round walls.
#[pyfunction]
fn curvature_weight<'py>(
    py: Python<'py>,
    kernel: &str,
    dimension: usize,
    q: PyReadonlyArray1<'py, f64>,
) -> PyResult<Pair1<'py>> {
    check_dimension(dimension)?;
    let weight = CurvatureWeight::named(kernel, dimension)
        .ok_or_else(|| invalid(format!("`kernel` must be a kernel, got {kernel:?}")))?;
    let (p, slope): (Vec<f64>, Vec<f64>) = q.as_array().iter().map(|&q| weight.at(q)).unzip();
    Ok((p.into_pyarray(py), slope.into_pyarray(py)))
}

/// Delta, psi, psi1, psi2, C and C' of Lucy's kernel at distances s = phi/h, (n, 6).
#[pyfunction]
fn wall_completion<'py>(
    py: Python<'py>,
    dimension: usize,
    s: PyReadonlyArray1<'py, f64>,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    check_dimension(dimension)?;
    let mut table = Vec::new();
    for &s in s.as_array() {
        let m = Missing::at(s, dimension);
        table.extend([m.volume, m.psi, m.across, m.along, m.curved, m.curved_slope]);
    }
    let table =
        Array2::from_shape_vec((table.len() / 6, 6), table).map_err(|e| invalid(e.to_string()))?;
    Ok(table.into_pyarray(py))
}

/// Raises `ValueError` if the walls do not go together, or not with the box.
#[pyfunction]
#[pyo3(signature = (edges, support, periodic, walls, fields=Vec::new()))]
fn check_walls(
    py: Python<'_>,
    edges: Vec<f64>,
    support: f64,
    periodic: Vec<bool>,
    walls: Vec<WallSettings>,
    fields: Vec<PyRef<'_, WallField>>,
) -> PyResult<()> {
    let dimension = edges.len();
    check_dimension(dimension)?;
    if periodic.len() != dimension {
        return Err(invalid(format!(
            "`periodic` must have {dimension} entries, got {}",
            periodic.len()
        )));
    }
    let cell =
        PeriodicBox::with_walls(&edges, support, &periodic).map_err(|e| to_python(py, &e))?;
    let units = Units {
        length: support,
        mass: 1.0,
        velocity: 1.0,
        dimension: dimension as i32,
    };
    let fields: Vec<_> = fields.iter().map(|f| f.field.clone()).collect();
    Walls::new(&walls, &fields, WendlandC2::NAME, dimension, &cell, &units)
        .map(|_| ())
        .map_err(|e| to_python(py, &e))
}

/// Adds all functions to the module.
pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(kernel_names, module)?)?;
    module.add_function(wrap_pyfunction!(peak, module)?)?;
    module.add_function(wrap_pyfunction!(kernel_profile, module)?)?;
    module.add_function(wrap_pyfunction!(eos_evaluate, module)?)?;
    module.add_function(wrap_pyfunction!(philox4x32, module)?)?;
    module.add_function(wrap_pyfunction!(pair_variates, module)?)?;
    module.add_function(wrap_pyfunction!(force_variates, module)?)?;
    module.add_function(wrap_pyfunction!(registry_table, module)?)?;
    module.add_function(wrap_pyfunction!(normal_velocities, module)?)?;
    module.add_function(wrap_pyfunction!(uniform_positions, module)?)?;
    module.add_function(wrap_pyfunction!(list_margins, module)?)?;
    module.add_function(wrap_pyfunction!(curvature_weight, module)?)?;
    module.add_function(wrap_pyfunction!(wall_completion, module)?)?;
    module.add_function(wrap_pyfunction!(check_walls, module)?)?;
    module.add_function(wrap_pyfunction!(relax_positions, module)?)
}
