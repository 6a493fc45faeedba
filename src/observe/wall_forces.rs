//! Force and torque of the fluid on each wall, as means over the time between samples: momentum that
//! walls have received, all of it, so that the momentum of the fluid changes by just that.

use super::{Observer, View};
use crate::wall::Wrench;

/// One row per sample: step, time, and six numbers for each wall.
pub struct WallForces {
    every: u64,
    width: usize,
    rows: Vec<f64>,
    since: (f64, Vec<Wrench>),
    begun: (usize, (f64, Vec<Wrench>)),
}

impl WallForces {
    /// Sampled every so many steps, from a time [user] and impulses [reduced] on.
    pub fn new(every: u64, time: f64, impulse: &[Wrench]) -> Self {
        let since = (time, impulse.to_vec());
        Self {
            every: every.max(1),
            width: 2 + 6 * impulse.len(),
            rows: Vec::new(),
            begun: (0, since.clone()),
            since,
        }
    }

    /// All rows so far, one after the other, and their width.
    pub fn rows(&self) -> (&[f64], usize) {
        (&self.rows, self.width)
    }
}

impl Observer for WallForces {
    fn every(&self) -> u64 {
        self.every
    }

    fn begin(&mut self) {
        self.begun = (self.rows.len(), self.since.clone());
    }

    fn forget(&mut self) {
        self.rows.truncate(self.begun.0);
        self.since = self.begun.1.clone();
    }

    fn sample(&mut self, view: &View) {
        let units = view.units;
        let elapsed = (view.time - self.since.0) / units.time();
        self.rows.extend([view.step as f64, view.time]);
        for (now, before) in view.walls.impulse.iter().zip(&self.since.1) {
            for a in 0..6 {
                let unit = if a < 3 { units.force() } else { units.energy() };
                self.rows.push((now[a] - before[a]) / elapsed * unit);
            }
        }
        self.since.0 = view.time;
        self.since.1.copy_from_slice(&view.walls.impulse);
    }
}
