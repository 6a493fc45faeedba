//! Walls of any shape, as Python sees them: a surface with its distances, and a field made of it.

use std::sync::Arc;

use numpy::{IntoPyArray, PyArray1, PyArray2, PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use super::errors::to_python;
use super::functions::to_table;
use crate::domain::PeriodicBox;
use crate::error::Error;
use crate::wall::{Field, Local, Solid};

type Sampled<'py> = (
    Bound<'py, PyArray1<f64>>,
    Bound<'py, PyArray2<f64>>,
    Bound<'py, PyArray1<f64>>,
    Bound<'py, PyArray2<f64>>,
);

type Tables<'py> = (Bound<'py, PyArray2<f64>>, Bound<'py, PyArray2<f64>>);

/// Rows of up to three numbers.
pub(super) fn rows(
    name: &str,
    array: &PyReadonlyArray2<'_, f64>,
    scale: f64,
) -> PyResult<Vec<[f64; 3]>> {
    let columns = array.shape()[1];
    if !(2..=3).contains(&columns) {
        return Err(PyValueError::new_err(format!(
            "`{name}` must have 2 or 3 columns, got {columns}"
        )));
    }
    let view = array.as_array();
    let row = |row: numpy::ndarray::ArrayView1<'_, f64>| {
        std::array::from_fn(|a| if a < columns { row[a] * scale } else { 0.0 })
    };
    Ok(view.rows().into_iter().map(row).collect())
}

/// A triangulated surface.
#[pyclass(frozen, name = "Solid", module = "sdpd._core")]
pub struct SolidHandle {
    solid: Solid,
    pool: rayon::ThreadPool,
}

#[pymethods]
impl SolidHandle {
    #[new]
    fn new(
        py: Python<'_>,
        points: PyReadonlyArray2<'_, f64>,
        triangles: PyReadonlyArray2<'_, u32>,
        threads: usize,
    ) -> PyResult<Self> {
        let points = rows("points", &points, 1.0)?;
        let view = triangles.as_array();
        if view.ncols() != 3 {
            return Err(PyValueError::new_err(format!(
                "`triangles` must have 3 columns, got {}",
                view.ncols()
            )));
        }
        let triangles: Vec<[u32; 3]> = view
            .rows()
            .into_iter()
            .map(|t| [t[0], t[1], t[2]])
            .collect();
        Ok(Self {
            solid: Solid::new(&points, &triangles).map_err(|e| to_python(py, &e))?,
            pool: pool(threads)?,
        })
    }

    /// Signed distances of points (n, 3), > 0 outside.
    fn distances<'py>(
        &self,
        py: Python<'py>,
        points: PyReadonlyArray2<'py, f64>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let points = rows("points", &points, 1.0)?;
        let result = py.detach(|| self.pool.install(|| self.solid.distances(&points)));
        Ok(result.into_pyarray(py))
    }

    /// Two triangles that cross, or None.
    fn crossing(&self, py: Python<'_>) -> Option<[u32; 2]> {
        py.detach(|| self.pool.install(|| self.solid.crossing()))
    }
}

/// Threads of its own: the global ones would not survive a fork.
fn pool(threads: usize) -> PyResult<rayon::ThreadPool> {
    rayon::ThreadPoolBuilder::new()
        .num_threads(threads.max(1))
        .build()
        .map_err(|e| PyValueError::new_err(format!("`threads` = {threads}: {e}")))
}

/// Distances and weights of a wall of any shape, for one box, support and kernel.
#[pyclass(frozen, name = "WallField", module = "sdpd._core")]
pub struct WallField {
    pub(super) field: Arc<Field>,
    support: f64,
    dimension: usize,
}

#[pymethods]
impl WallField {
    /// `distance` is a function of points (n, D) that returns (n,) signed distances.
    #[new]
    #[pyo3(signature = (distance, edges, periodic, support, kernel, threads, spacing=None))]
    #[allow(clippy::too_many_arguments)]
    fn new(
        py: Python<'_>,
        distance: Bound<'_, PyAny>,
        edges: Vec<f64>,
        periodic: Vec<bool>,
        support: f64,
        kernel: &str,
        threads: usize,
        spacing: Option<f64>,
    ) -> PyResult<Self> {
        let dimension = edges.len();
        if !(2..=3).contains(&dimension) || periodic.len() != dimension {
            return Err(PyValueError::new_err(format!(
                "`edges` and `periodic` must have 2 or 3 entries each, got {dimension} and {}",
                periodic.len()
            )));
        }
        let cell =
            PeriodicBox::with_walls(&edges, support, &periodic).map_err(|e| to_python(py, &e))?;
        let mut raised = None;
        let mut distances = |points: &[[f64; 3]]| {
            call(py, &distance, points, dimension, support).map_err(|error| {
                raised = Some(error);
                Error::Invalid("the distance of a wall failed".into())
            })
        };
        let made = Field::new(
            &cell,
            dimension,
            kernel,
            spacing.map(|s| s / support),
            &mut distances,
            &pool(threads)?,
        );
        match made {
            Ok(field) => Ok(Self {
                field: Arc::new(field),
                support,
                dimension,
            }),
            Err(error) => Err(raised.unwrap_or_else(|| to_python(py, &error))),
        }
    }

    /// phi [length], its gradient, psi, and its gradient [1/length] at points (n, D).
    fn evaluate<'py>(
        &self,
        py: Python<'py>,
        points: PyReadonlyArray2<'py, f64>,
    ) -> PyResult<Sampled<'py>> {
        let points = rows("points", &points, 1.0 / self.support)?;
        let all: Vec<Local> = points.iter().map(|&p| self.field.at(p)).collect();
        let table = |of: &dyn Fn(&Local) -> [f64; 3], scale: f64| {
            let flat = all.iter().flat_map(|local| {
                let vector = of(local);
                (0..self.dimension).map(move |a| vector[a] * scale)
            });
            to_table(py, flat.collect(), self.dimension)
        };
        let phi: Vec<f64> = all.iter().map(|l| l.distance * self.support).collect();
        let psi: Vec<f64> = all.iter().map(|l| l.weight).collect();
        Ok((
            phi.into_pyarray(py),
            table(&|l| l.gradient, 1.0)?,
            psi.into_pyarray(py),
            table(&|l| l.climb, 1.0 / self.support)?,
        ))
    }

    /// Points of the surface and unit normals into the fluid, (n, D) each [length].
    fn surface<'py>(&self, py: Python<'py>) -> PyResult<Tables<'py>> {
        let facets = &self.field.report.surface;
        let d = self.dimension;
        let at = facets
            .iter()
            .flat_map(|f| f.position[..d].iter().map(|x| x * self.support));
        let normal = facets.iter().flat_map(|f| f.normal[..d].iter().copied());
        Ok((
            to_table(py, at.collect(), d)?,
            to_table(py, normal.collect(), d)?,
        ))
    }

    /// Size of the grid, range and convergence of the weight, and the thinnest blade of the solid.
    fn report<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let report = &self.field.report;
        let result = PyDict::new(py);
        let thinnest = report.thinnest.map(|(t, at)| {
            let place: Vec<f64> = at[..self.dimension]
                .iter()
                .map(|x| x * self.support)
                .collect();
            (t * self.support, place)
        });
        result.set_item("bytes", self.field.bytes())?;
        result.set_item("iterations", report.iterations)?;
        result.set_item("residual", report.residual)?;
        result.set_item("weights", report.weights)?;
        result.set_item("spacing", report.spacing[0] * self.support)?;
        result.set_item("thinnest", thinnest)?;
        Ok(result)
    }
}

/// Distances [h] by the Python function.
fn call(
    py: Python<'_>,
    distance: &Bound<'_, PyAny>,
    points: &[[f64; 3]],
    dimension: usize,
    support: f64,
) -> PyResult<Vec<f64>> {
    let flat = points
        .iter()
        .flat_map(|p| p[..dimension].iter().map(|x| x * support));
    let table = to_table(py, flat.collect(), dimension)?;
    let values: Vec<f64> = distance.call1((table,))?.extract()?;
    if values.len() != points.len() {
        return Err(PyValueError::new_err(format!(
            "distances must be as many as the points, {}, got {}",
            points.len(),
            values.len()
        )));
    }
    Ok(values.into_iter().map(|x| x / support).collect())
}
