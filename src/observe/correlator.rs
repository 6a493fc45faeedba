//! Mean-square displacement and velocity autocorrelation on logarithmically spaced lags, without a
//! trajectory: level l keeps the last `points` samples taken every 2^l samples (Ramirez et al.,
//! J. Chem. Phys. 133 (2010) 154103, without coarse-graining: both functions are exact at every
//! lag). Memory: levels * points * 6 numbers a particle.

use rayon::prelude::*;

use super::{Observer, View};

/// Sums of both functions over all particles and origins.
pub struct Correlator {
    every: u64,
    dimension: usize,
    points: usize,
    levels: Vec<Level>,
    samples: u64,
    now: Vec<[f64; 6]>,
    begun: Vec<[Vec<f64>; 3]>,
}

#[derive(Debug, Clone)]
struct Level {
    /// Ring buffers, particle by particle in row order: `points` x (position, velocity).
    history: Vec<[f64; 6]>,
    filled: usize,
    next: usize,
    /// Sums by lag, of |dr|^2 and v.v', in the user's units.
    square_displacement: Vec<f64>,
    velocity_product: Vec<f64>,
    origins: Vec<f64>,
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
        let (points, levels) = (points.max(2), levels.clamp(1, 62));
        // All of it now, so that no run can fail for want of it later.
        let mut all = Vec::new();
        all.try_reserve_exact(levels).ok()?;
        for _ in 0..levels {
            all.push(Level {
                history: zeros([0.0; 6], n.checked_mul(points)?)?,
                filled: 0,
                next: 0,
                square_displacement: zeros(0.0, points)?,
                velocity_product: zeros(0.0, points)?,
                origins: zeros(0.0, points)?,
            });
        }
        Some(Self {
            every: every.max(1),
            dimension,
            points,
            levels: all,
            samples: 0,
            now: zeros([0.0; 6], n)?,
            begun: Vec::new(),
        })
    }

    /// Lags in samples with the sums at each: (lag, origins, sum |dr|^2, sum v.v'), each origin
    /// already averaged over particles. Level 0 gives lags 0 .. points - 1, level l > 0 the upper
    /// half of its lags.
    pub fn table(&self) -> Vec<[f64; 4]> {
        let mut rows = Vec::new();
        for (index, level) in self.levels.iter().enumerate() {
            let first = if index == 0 { 0 } else { self.points / 2 };
            for lag in first..self.points {
                rows.push([
                    (lag << index) as f64,
                    level.origins[lag],
                    level.square_displacement[lag],
                    level.velocity_product[lag],
                ]);
            }
        }
        rows
    }
}

impl Observer for Correlator {
    fn every(&self) -> u64 {
        self.every
    }

    fn begin(&mut self) {
        let sums = |level: &Level| {
            let [a, b] = [&level.square_displacement, &level.velocity_product];
            [level.origins.clone(), a.clone(), b.clone()]
        };
        self.begun = self.levels.iter().map(sums).collect();
    }

    fn forget(&mut self) {
        for (level, sums) in self.levels.iter_mut().zip(std::mem::take(&mut self.begun)) {
            [
                level.origins,
                level.square_displacement,
                level.velocity_product,
            ] = sums;
            // The rings hold states that did not happen: start with new origins.
            (level.filled, level.next) = (0, 0);
        }
    }

    fn sample(&mut self, view: &View) {
        let (points, dimension) = (self.points, self.dimension);
        self.now = rows_of(view, std::mem::take(&mut self.now));
        for (index, level) in self.levels.iter_mut().enumerate() {
            if !self.samples.is_multiple_of(1 << index) {
                break;
            }
            level.store(&self.now, points);
            level.accumulate(
                &self.now,
                points,
                dimension,
                if index == 0 { 0 } else { points / 2 },
            );
        }
        self.samples += 1;
    }
}

/// `count` copies of a value, or nothing where there is no memory for them.
fn zeros<T: Clone>(value: T, count: usize) -> Option<Vec<T>> {
    let mut values = Vec::new();
    values.try_reserve_exact(count).ok()?;
    values.resize(count, value);
    Some(values)
}

/// Unwrapped positions and velocities by row, in the user's units.
fn rows_of(view: &View, mut rows: Vec<[f64; 6]>) -> Vec<[f64; 6]> {
    let (particles, units) = (view.particles, view.units);
    for slot in 0..particles.len() {
        let row = &mut rows[particles.row[slot] as usize];
        for a in 0..view.dimension {
            let turns = f64::from(particles.image[slot][a]);
            let unwrapped = particles.position[slot][a] + turns * view.cell.edges[a];
            row[a] = unwrapped * units.length;
            row[3 + a] = particles.velocity[slot][a] * units.velocity;
        }
    }
    rows
}

impl Level {
    fn store(&mut self, now: &[[f64; 6]], points: usize) {
        for (row, state) in now.iter().enumerate() {
            self.history[row * points + self.next] = *state;
        }
        self.next = (self.next + 1) % points;
        self.filled = (self.filled + 1).min(points);
    }

    fn accumulate(&mut self, now: &[[f64; 6]], points: usize, dimension: usize, first: usize) {
        /// Rows per partial sum: fixed, so the sum does not depend on the threads.
        const ROWS: usize = 512;
        let (next, filled) = (self.next, self.filled);
        if filled <= first {
            return;
        }
        let partial: Vec<Vec<[f64; 2]>> = now
            .par_chunks(ROWS)
            .zip(self.history.par_chunks(ROWS * points))
            .map(|(now, history)| {
                let mut sums = vec![[0.0; 2]; points];
                for (state, past) in now.iter().zip(history.chunks(points)) {
                    for (lag, sum) in sums.iter_mut().enumerate().take(filled).skip(first) {
                        let old = &past[(next + points - 1 - lag) % points];
                        for a in 0..dimension {
                            let step = state[a] - old[a];
                            sum[0] += step * step;
                            sum[1] += state[3 + a] * old[3 + a];
                        }
                    }
                }
                sums
            })
            .collect();
        let n = now.len() as f64;
        for lag in first..filled {
            self.origins[lag] += 1.0;
            for sums in &partial {
                self.square_displacement[lag] += sums[lag][0] / n;
                self.velocity_product[lag] += sums[lag][1] / n;
            }
        }
    }
}
