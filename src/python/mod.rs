//! The binding. Everything that Python can see of the core is listed here; nothing below panics.

mod arrays;
mod columns;
mod core;
mod errors;
mod fields;
mod functions;
mod observers;
mod state;
mod thermal;
mod walls;

use pyo3::prelude::*;

/// The compiled core of `sdpd`; use the package, not this module.
#[pymodule]
fn _core(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add_class::<core::Core>()?;
    module.add_class::<observers::CorrelatorHandle>()?;
    module.add_class::<observers::CurrentsHandle>()?;
    module.add_class::<observers::StressCorrelatorHandle>()?;
    module.add_class::<observers::StressHandle>()?;
    module.add_class::<observers::HeatCurrentHandle>()?;
    module.add_class::<observers::HeatCorrelatorHandle>()?;
    module.add_class::<observers::ThermodynamicsHandle>()?;
    fields::register(module)?;
    module.add_class::<observers::WallForcesHandle>()?;
    module.add_class::<observers::ProfileHandle>()?;
    module.add_class::<walls::SolidHandle>()?;
    module.add_class::<walls::WallField>()?;
    thermal::register(module)?;
    functions::register(module)
}
