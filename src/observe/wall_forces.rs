//! Force and torque of the fluid on each wall, as means over the time between samples: momentum that
//! walls have received, all of it, so that the momentum of the fluid changes by just that. Of a fluid
//! with an energy also the heat that each wall receives, and the work that it does.

use super::{Observer, View};
use crate::wall::Wrench;

/// What walls have received up to a time: momenta, and heat and work where there are any.
#[derive(Clone)]
struct Received {
    time: f64,
    impulse: Vec<Wrench>,
    energy: Vec<[f64; 2]>,
}

/// One row per sample: step, time, and six numbers for each wall, eight where there is an energy.
pub struct WallForces {
    every: u64,
    width: usize,
    rows: Vec<f64>,
    since: Received,
    begun: (usize, Received),
}

impl WallForces {
    /// Sampled every so many steps, from a time [user], impulses and energies [reduced] on; no
    /// energies where the fluid has none.
    pub fn new(every: u64, time: f64, impulse: &[Wrench], energy: &[[f64; 2]]) -> Self {
        let since = Received {
            time,
            impulse: impulse.to_vec(),
            energy: energy.to_vec(),
        };
        Self {
            every: every.max(1),
            width: 2 + 6 * impulse.len() + 2 * energy.len(),
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
        let elapsed = (view.time - self.since.time) / units.time();
        self.rows.extend([view.step as f64, view.time]);
        for (wall, now) in view.walls.impulse.iter().enumerate() {
            let before = &self.since.impulse[wall];
            for a in 0..6 {
                let unit = if a < 3 { units.force() } else { units.energy() };
                self.rows.push((now[a] - before[a]) / elapsed * unit);
            }
            if let (Some(thermal), Some(before)) = (view.thermal, self.since.energy.get(wall)) {
                let unit = units.energy() / units.time();
                for (now, before) in thermal.accounts.walls[wall].iter().zip(before) {
                    self.rows.push((now - before) / elapsed * unit);
                }
            }
        }
        self.since.time = view.time;
        self.since.impulse.copy_from_slice(&view.walls.impulse);
        if let Some(thermal) = view.thermal {
            self.since.energy.copy_from_slice(&thermal.accounts.walls);
        }
    }
}
