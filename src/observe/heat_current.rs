//! Time series of the flux of energy by part, each value the exact mean over the interval since the
//! sample before (`sweep/heat_tally.rs`).

use super::{Observer, View};
use crate::sweep::HeatMoment;

/// Fluxes of the intervals between samples.
pub struct HeatCurrent {
    every: u64,
    dimension: usize,
    last: Option<(u64, HeatMoment)>,
    rows: Vec<f64>,
    begun: usize,
}

impl HeatCurrent {
    /// One row every `every` steps; the first sample only opens the first interval.
    pub fn new(every: u64, dimension: usize) -> Self {
        Self {
            every: every.max(1),
            dimension,
            last: None,
            rows: Vec::new(),
            begun: 0,
        }
    }

    /// Numbers a row: step, time, then D of conduction, friction, pressure, convection, noise of
    /// conduction and noise of friction.
    pub fn width(dimension: usize) -> usize {
        2 + 6 * dimension
    }

    /// All rows, one after the other, in the user's units.
    pub fn rows(&self) -> &[f64] {
        &self.rows
    }
}

impl Observer for HeatCurrent {
    fn every(&self) -> u64 {
        self.every
    }

    fn needs_heat_current(&self) -> bool {
        true
    }

    fn begin(&mut self) {
        self.begun = self.rows.len();
    }

    fn forget(&mut self) {
        self.rows.truncate(self.begun);
        self.last = None;
    }

    fn sample(&mut self, view: &View) {
        let Some(moment) = view.heat_moment() else {
            return;
        };
        if let Some((step, past)) = self.last {
            let interval = (view.step - step) as f64 * view.dt;
            let flux = view.units.pressure() * view.units.velocity;
            let scale = flux / (view.volume() * interval);
            self.rows.extend([view.step as f64, view.time]);
            for (now, past) in moment.flows.iter().zip(&past.flows) {
                for a in 0..self.dimension {
                    self.rows.push((now[a] - past[a]) * scale);
                }
            }
        }
        self.last = Some((view.step, moment));
    }
}
