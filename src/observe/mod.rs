//! Observers: what is measured inside the loop, without a step of Python.

mod correlator;
mod currents;
mod heat_correlator;
mod heat_current;
mod lags;
mod profile;
mod stress;
mod stress_correlator;
mod thermodynamics;
mod wall_forces;

pub use correlator::{COLUMNS as CORRELATOR_COLUMNS, Correlator};
pub use currents::{COLUMNS as CURRENT_COLUMNS, Currents};
pub use heat_correlator::{COLUMNS as HEAT_COLUMNS, HeatCorrelator};
pub use heat_current::HeatCurrent;
pub use lags::{BlockedSums, Lags};
pub use profile::{Coordinate, Profile};
pub use stress::Stress;
pub use stress_correlator::{COLUMNS as STRESS_COLUMNS, StressCorrelator};
pub use thermodynamics::Thermodynamics;
pub use wall_forces::WallForces;

use crate::domain::PeriodicBox;
use crate::eos::EquationOfState;
use crate::state::Particles;
use crate::sweep::{HeatMoment, Tally};
use crate::thermal::Thermal;
use crate::units::Units;
use crate::wall::Walls;

/// Which parts of the stress an observer tells apart.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Parts {
    /// What particles carry, and what pairs exchange.
    Two,
    /// The latter by cause: pressure, drag, noise.
    All,
}

/// What an observer sees after a step.
pub struct View<'a> {
    /// Steps done.
    pub step: u64,
    /// Simulated time in the user's units.
    pub time: f64,
    /// The time step in reduced units.
    pub dt: f64,
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
    /// Stress, if an observer asked for it.
    pub tally: Option<&'a Tally>,
    /// Energies, where particles have some.
    pub thermal: Option<&'a Thermal>,
}

impl View<'_> {
    /// Temperature of a particle [user], where it has one.
    pub fn temperature(&self, slot: usize) -> Option<f64> {
        let thermal = self.thermal?;
        let heat = self.particles.scalars[thermal.fields.heat].values[slot];
        Some(thermal.temperature(self.particles.density[slot], heat))
    }

    /// Integral of the current of energy by part, if an observer asked for it.
    pub fn heat_moment(&self) -> Option<HeatMoment> {
        Some(self.thermal?.current.as_ref()?.moment)
    }

    /// Volume of the box in reduced units.
    pub fn volume(&self) -> f64 {
        self.cell.edges[..self.dimension].iter().product()
    }
}

/// Something that samples the state every so many steps.
pub trait Observer: Send {
    /// Steps between samples, >= 1.
    fn every(&self) -> u64;
    /// Is it its turn after that step?
    fn is_due(&self, step: u64) -> bool {
        step.is_multiple_of(self.every())
    }
    /// Must the loop keep the stress, and its parts apart?
    fn needs_stress(&self) -> Option<Parts> {
        None
    }
    /// Must the loop keep the current of energy?
    fn needs_heat_current(&self) -> bool {
        false
    }
    /// Takes one sample.
    fn sample(&mut self, view: &View);
    /// Remembers where it stands: a run begins.
    fn begin(&mut self);
    /// Forgets what it saw since `begin`: the run failed and its steps did not happen.
    fn forget(&mut self);
}
