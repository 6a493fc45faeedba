//! Time series of the pressure tensor by part, each value the exact mean over the interval since the
//! sample before (`sweep/tally.rs`).

use super::{Observer, Parts, View};
use crate::sweep::Tensor;

/// Moments of all parts at one sample.
pub(super) type Moments = [Tensor; 4];

/// Pressure tensors of the intervals between samples.
pub struct Stress {
    every: u64,
    dimension: usize,
    last: Option<(u64, Moments)>,
    rows: Vec<f64>,
    begun: (usize, Option<(u64, Moments)>),
}

impl Stress {
    /// One row every `every` steps; the first sample only opens the first interval.
    pub fn new(every: u64, dimension: usize) -> Self {
        Self {
            every: every.max(1),
            dimension,
            last: None,
            rows: Vec::new(),
            begun: (0, None),
        }
    }

    /// Numbers a row: step, time, then D x D of kinetic, conservative, drag and random part.
    pub fn width(dimension: usize) -> usize {
        2 + 4 * dimension * dimension
    }

    /// All rows, one after the other, in the user's units.
    pub fn rows(&self) -> &[f64] {
        &self.rows
    }
}

impl Observer for Stress {
    fn every(&self) -> u64 {
        self.every
    }

    fn needs_stress(&self) -> Option<Parts> {
        Some(Parts::All)
    }

    fn begin(&mut self) {
        self.begun = (self.rows.len(), self.last);
    }

    fn forget(&mut self) {
        self.rows.truncate(self.begun.0);
        self.last = None;
    }

    fn sample(&mut self, view: &View) {
        let Some(tally) = view.tally else { return };
        if let Some((step, moments)) = self.last {
            let interval = (view.step - step) as f64 * view.dt;
            let scale = view.units.pressure() / (view.volume() * interval);
            self.rows.extend([view.step as f64, view.time]);
            for (now, past) in tally.moment.iter().zip(&moments) {
                for a in 0..self.dimension {
                    for b in 0..self.dimension {
                        let k = 3 * a + b;
                        self.rows.push((now[k] - past[k]) * scale);
                    }
                }
            }
        }
        self.last = Some((view.step, tally.moment));
    }
}
