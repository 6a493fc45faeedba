//! Mean-square displacement and velocity autocorrelation of all particles on logarithmically spaced
//! lags (`lags.rs`), without a trajectory. Memory: levels * points * 48 bytes a particle.

use rayon::prelude::*;

use super::lags::{BlockedSums, Lags, Ring, zeros};
use super::{Observer, View};
use crate::sweep::{Task, Wide, run_wide};

/// Rows of a part: fixed, so that no sum depends on the threads.
const PART: usize = 256;
/// Position and velocity, component by component.
type State = [[f64; PART]; 6];
/// Columns of the table of sums: origins, |dr|^2, v.v'.
pub const COLUMNS: usize = 3;

/// Sums of both functions over all particles and origins.
pub struct Correlator {
    every: u64,
    dimension: usize,
    n: usize,
    lags: Lags,
    samples: u64,
    /// Present states; rows beyond the last particle stay zero and add nothing.
    now: Vec<State>,
    levels: Vec<Level>,
    sums: BlockedSums,
    begun: BlockedSums,
}

struct Level {
    /// Ring buffers, part by part: `points` states each.
    history: Vec<State>,
    ring: Ring,
    /// Sums of a part, by lag.
    partial: Vec<[f64; 2]>,
}

impl Correlator {
    /// Sampled every so many steps, with `points` lags on each of `levels` levels, for n particles.
    /// `None` where its memory is not to be had.
    pub fn new(
        every: u64,
        dimension: usize,
        points: usize,
        levels: usize,
        n: usize,
    ) -> Option<Self> {
        let lags = Lags::new(points, levels);
        let parts = n.div_ceil(PART);
        let empty = [[0.0; PART]; 6];
        // All of it now, so that no run can fail for want of it later.
        let mut all = Vec::new();
        all.try_reserve_exact(lags.levels).ok()?;
        for _ in 0..lags.levels {
            all.push(Level {
                history: zeros(empty, parts.checked_mul(lags.points)?)?,
                ring: Ring::default(),
                partial: zeros([0.0; 2], parts.checked_mul(lags.points)?)?,
            });
        }
        Some(Self {
            every: every.max(1),
            dimension,
            n,
            lags,
            samples: 0,
            now: zeros(empty, parts)?,
            levels: all,
            sums: BlockedSums::new(lags.rows()?.checked_mul(COLUMNS)?)?,
            begun: BlockedSums::new(lags.rows()?.checked_mul(COLUMNS)?)?,
        })
    }

    /// The lags.
    pub fn lags(&self) -> Lags {
        self.lags
    }

    /// Sums at each lag, block by block: origins, and the particle averages of |dr|^2 and v.v'.
    pub fn sums(&self) -> &BlockedSums {
        &self.sums
    }
}

impl Observer for Correlator {
    fn every(&self) -> u64 {
        self.every
    }

    fn begin(&mut self) {
        self.begun.copy_from(&self.sums);
    }

    fn forget(&mut self) {
        self.sums.copy_from(&self.begun);
        // The rings hold states that did not happen: start with new origins.
        for level in &mut self.levels {
            level.ring = Ring::default();
        }
        self.samples = 0;
    }

    fn sample(&mut self, view: &View) {
        let points = self.lags.points;
        take_states(view, &mut self.now);
        for (index, level) in self.levels.iter_mut().enumerate() {
            if !self.samples.is_multiple_of(1 << index) {
                break;
            }
            let first = self.lags.first(index);
            level.correlate(&self.now, points, self.dimension, first);
            let table = self.sums.current();
            for lag in first..level.ring.filled() {
                let row = &mut table[COLUMNS * self.lags.row(index, lag)..];
                row[0] += 1.0;
                for partial in level.partial.chunks(points) {
                    row[1] += partial[lag][0] / self.n as f64;
                    row[2] += partial[lag][1] / self.n as f64;
                }
            }
        }
        self.sums.close_sample();
        self.samples += 1;
    }
}

/// Unwrapped positions and velocities by row, in the user's units.
fn take_states(view: &View, now: &mut [State]) {
    let (particles, units) = (view.particles, view.units);
    for slot in 0..particles.len() {
        let row = particles.row[slot] as usize;
        let part = &mut now[row / PART];
        for a in 0..view.dimension {
            let turns = f64::from(particles.image[slot][a]);
            let unwrapped = particles.position[slot][a] + turns * view.cell.edges[a];
            part[a][row % PART] = unwrapped * units.length;
            part[3 + a][row % PART] = particles.velocity[slot][a] * units.velocity;
        }
    }
}

impl Level {
    /// Stores the present states and sums their products with each earlier one, part by part.
    fn correlate(&mut self, now: &[State], points: usize, dimension: usize, first: usize) {
        let place = self.ring.advance(points);
        let ring = self.ring;
        now.par_iter()
            .zip(self.history.par_chunks_mut(points))
            .zip(self.partial.par_chunks_mut(points))
            .with_min_len(4)
            .for_each(|((now, history), partial)| {
                history[place] = *now;
                for lag in first..ring.filled() {
                    let products = Products {
                        now,
                        past: &history[ring.place(lag, points)],
                        dimension,
                        sums: &mut partial[lag],
                    };
                    run_wide(products);
                }
            });
    }
}

struct Products<'a> {
    now: &'a State,
    past: &'a State,
    dimension: usize,
    sums: &'a mut [f64; 2],
}

impl Task for Products<'_> {
    type Output = ();
    #[inline(always)]
    fn run<W: Wide>(self) {
        /// Partial sums side by side, so that the loop is one over vectors.
        const LANES: usize = 8;
        let (mut square, mut product) = ([0.0; LANES], [0.0; LANES]);
        for a in 0..self.dimension {
            let (x, y) = (&self.now[a], &self.past[a]);
            let (v, w) = (&self.now[3 + a], &self.past[3 + a]);
            for k in (0..PART).step_by(LANES) {
                for lane in 0..LANES {
                    let step = x[k + lane] - y[k + lane];
                    square[lane] += step * step;
                    product[lane] += v[k + lane] * w[k + lane];
                }
            }
        }
        *self.sums = [square.iter().sum(), product.iter().sum()];
    }
}
