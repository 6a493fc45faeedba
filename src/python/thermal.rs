//! Fluids with an energy as Python describes them: the settings, and the caloric equation of state
//! by itself.

use numpy::{IntoPyArray, PyArray1, PyReadonlyArray1};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use super::errors::to_python;
use crate::eos::caloric;
use crate::thermal::{ThermalSettings, WallHeatSettings};

/// The argument `thermal` of a simulation: a dictionary.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct ThermalArguments {
    eos: (String, Vec<f64>, String),
    boltzmann_constant: f64,
    conductivity: f64,
    exponents: [f64; 2],
    reference_temperature: f64,
    bookkeeping: bool,
    walls: Vec<WallHeatSettings>,
}

impl ThermalArguments {
    /// The same for the engine.
    pub fn settings(self) -> ThermalSettings {
        ThermalSettings {
            eos: self.eos,
            boltzmann: self.boltzmann_constant,
            conductivity: self.conductivity,
            exponents: self.exponents,
            reference: self.reference_temperature,
            bookkeeping: self.bookkeeping,
            walls: self.walls,
        }
    }
}

type Values<'py> = Bound<'py, PyArray1<f64>>;

/// Pressure, energy and entropy per mass, the squares of the isothermal and the adiabatic speed of
/// sound, and the heat capacity per mass, at densities and temperatures of equal length.
#[pyfunction]
#[allow(clippy::type_complexity)]
fn caloric_evaluate<'py>(
    py: Python<'py>,
    eos: (String, Vec<f64>, String),
    densities: PyReadonlyArray1<'py, f64>,
    temperatures: PyReadonlyArray1<'py, f64>,
) -> PyResult<(
    Values<'py>,
    Values<'py>,
    Values<'py>,
    Values<'py>,
    Values<'py>,
    Values<'py>,
)> {
    let law = caloric::build(&eos.0, &eos.1, &eos.2).map_err(|e| to_python(py, &e))?;
    let (rho, t) = (densities.as_array(), temperatures.as_array());
    if rho.len() != t.len() {
        return Err(PyValueError::new_err(format!(
            "`densities` and `temperatures` must be of equal length, got {} and {}",
            rho.len(),
            t.len()
        )));
    }
    let each = |f: &dyn Fn(f64, f64) -> f64| {
        let values: Vec<f64> = rho
            .iter()
            .zip(t.iter())
            .map(|(&rho, &t)| f(rho, law.heat(rho, t)))
            .collect();
        values.into_pyarray(py)
    };
    Ok((
        each(&|rho, heat| law.pressure(rho, heat)),
        each(&|rho, heat| law.cold_energy(rho) + heat),
        each(&|rho, heat| law.entropy(rho, heat)),
        each(&|rho, heat| law.slopes(rho, heat)[0]),
        each(&|rho, heat| law.slopes(rho, heat)[1]),
        each(&|rho, heat| law.temperature_and_capacity(rho, heat)[1]),
    ))
}

/// Adds what is here to the module.
pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(caloric_evaluate, module)?)
}
