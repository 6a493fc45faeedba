//! Fluctuating hydrodynamics with particles: the core of the Python package `sdpd`.
//!
//! | module | what it holds |
//! |---|---|
//! | `kernel`, `eos`, `physics`, `random` | the physics of a site and of a pair, as functions |
//! | `real` | numbers of either precision and the functions that loops need of them |
//! | `domain`, `neighbor`, `state`, `units` | where particles are, who is near whom, in which units |
//! | `sweep` | the hot loops over pairs |
//! | `integrator`, `registry` | how a step is made; which combinations exist |
//! | `simulation`, `observe`, `effect` | the engine, what it measures, what acts on it |
//! | `wall` | walls: their geometry and the images of particles near them |
//! | `thermal` | fluids with an energy: temperatures, the books of the work, heat through walls |
//! | `stopwatch`, `peak` | where the time of a run goes; what the machine can do at best |
//! | `digest` | whether an array has been written to |
//! | `relax` | fluid-like starts from random positions |
//! | `fields` | kernel sums over particles at given points |
//! | `python` | the binding, the only module that knows PyO3 |

pub mod digest;
pub mod domain;
pub mod effect;
pub mod eos;
pub mod error;
pub mod fields;
pub mod integrator;
pub mod kernel;
pub mod neighbor;
pub mod observe;
pub mod peak;
pub mod physics;
#[cfg(feature = "python")]
mod python;
pub mod random;
pub mod real;
pub mod registry;
pub mod relax;
pub mod simulation;
pub mod state;
pub mod stopwatch;
pub mod sweep;
pub mod thermal;
pub mod units;
pub mod valid;
pub mod wall;
