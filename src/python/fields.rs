//! Kernel sums at points, for `sdpd.fields`.

use numpy::ndarray::{Array2, ArrayView2};
use numpy::{IntoPyArray, PyArray2, PyReadonlyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use super::errors::to_python;
use crate::fields::{Cloud, LEADING, weight};
use crate::{registry, valid};

fn invalid(text: String) -> PyErr {
    PyValueError::new_err(text)
}

/// Rows of finite coordinates in supports, padded to three.
fn scaled(
    name: &str,
    view: ArrayView2<'_, f64>,
    dimension: usize,
    support: f64,
) -> PyResult<Vec<[f64; 3]>> {
    if view.ncols() != dimension {
        return Err(invalid(format!(
            "`{name}` must have {dimension} columns, got {}",
            view.ncols()
        )));
    }
    let mut rows = Vec::with_capacity(view.nrows());
    for row in view.rows() {
        let mut place = [0.0; 3];
        for (axis, x) in row.iter().enumerate() {
            place[axis] = x / support;
            if !place[axis].is_finite() {
                return Err(invalid(format!("`{name}` must be finite, got {x}")));
            }
        }
        rows.push(place);
    }
    Ok(rows)
}

/// Sums over particles at each point, (P, 2 + C): of W, of W^2, of W times each of C values.
/// W is the kernel of that support times support^D; an edge of 0 means that the axis is not periodic.
#[pyfunction]
#[pyo3(signature = (points, positions, values, *, edges, support, kernel, threads=1))]
#[allow(clippy::too_many_arguments)]
fn kernel_sums<'py>(
    py: Python<'py>,
    points: PyReadonlyArray2<'py, f64>,
    positions: PyReadonlyArray2<'py, f64>,
    values: PyReadonlyArray2<'py, f64>,
    edges: Vec<f64>,
    support: f64,
    kernel: &str,
    threads: usize,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let dimension = edges.len();
    if !registry::DIMENSIONS.contains(&dimension) {
        return Err(invalid(format!("`edges` must be 2 or 3, got {dimension}")));
    }
    let Some(weight) = weight(kernel, dimension) else {
        return Err(invalid(format!(
            "`kernel` must be one of {:?}, got {kernel:?}",
            registry::KERNELS
        )));
    };
    valid::positive("support", support).map_err(|e| to_python(py, &e))?;
    let mut periods = [None; 3];
    for (axis, &edge) in edges.iter().enumerate() {
        valid::non_negative("edges", edge).map_err(|e| to_python(py, &e))?;
        // A few ulp of room, so that "exactly one support" survives the division.
        if edge > 0.0 && edge / support < 1.0 - 1e-12 {
            return Err(invalid(format!(
                "`support` must be at most the edge of each periodic axis, {edge} on axis {axis}, got {support}"
            )));
        }
        periods[axis] = (edge > 0.0).then_some((edge / support).max(1.0));
    }
    let places = scaled("positions", positions.as_array(), dimension, support)?;
    let targets = scaled("points", points.as_array(), dimension, support)?;
    let table = values.as_array();
    if table.nrows() != places.len() {
        return Err(invalid(format!(
            "`values` must have a row for each of {} positions, got {}",
            places.len(),
            table.nrows()
        )));
    }
    let width = table.ncols();
    let carried: Vec<f64> = table.iter().copied().collect();
    let cloud = py.detach(|| Cloud::new(&places, &carried, width, periods));
    let sums = if threads <= 1 {
        py.detach(|| cloud.sums(&targets, weight))
    } else {
        // A pool of its own: the global one would not survive a fork.
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .map_err(|e| invalid(format!("`threads` = {threads}: {e}")))?;
        py.detach(|| pool.install(|| cloud.sums_on_threads(&targets, weight)))
    };
    Array2::from_shape_vec((targets.len(), LEADING + width), sums)
        .map(|sums| sums.into_pyarray(py))
        .map_err(|e| invalid(e.to_string()))
}

/// Adds the functions to the module.
pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(kernel_sums, module)?)
}
