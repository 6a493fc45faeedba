//! Observers: what is measured inside the loop, without a step of Python.

mod correlator;
mod profile;
mod thermodynamics;
mod wall_forces;

pub use correlator::Correlator;
pub use profile::{Coordinate, Profile};
pub use thermodynamics::Thermodynamics;
pub use wall_forces::WallForces;

use crate::domain::PeriodicBox;
use crate::eos::EquationOfState;
use crate::state::Particles;
use crate::units::Units;
use crate::wall::Walls;

/// What an observer sees after a step.
pub struct View<'a> {
    /// Steps done.
    pub step: u64,
    /// Simulated time in the user's units.
    pub time: f64,
    /// D.
    pub dimension: usize,
    /// Reduced units.
    pub units: &'a Units,
    /// The box.
    pub cell: &'a PeriodicBox,
    /// State in slot order.
    pub particles: &'a Particles,
    /// Walls and what they have received.
    pub walls: &'a Walls,
    /// Equation of state, in the user's units.
    pub eos: &'a dyn EquationOfState,
}

/// Something that samples the state every so many steps.
pub trait Observer: Send {
    /// Steps between samples, >= 1.
    fn every(&self) -> u64;
    /// Takes one sample.
    fn sample(&mut self, view: &View);
    /// Remembers where it stands: a run begins.
    fn begin(&mut self);
    /// Forgets what it saw since `begin`: the run failed and its steps did not happen.
    fn forget(&mut self);
}
