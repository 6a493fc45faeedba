//! The stress of the particles as the step makes it: momentum carried by the particles themselves
//! and momentum exchanged over the separation of every pair, r_ij (x) dp_ij, by conservative, drag
//! and random part. Nothing is symmetrised: element (a, b) is the flux of momentum b through a plane
//! across a (drag and noise are not central, so the tensor of the particles is not symmetric).
//!
//! Its time integral G = int V P dt changes with every kick, exchange and drift by just what that did
//! to sum m r_a v_b of unwrapped positions, so G needs no noise term of order dt^(-1/2) and is exact
//! at any time step: the moment of the Einstein-Helfand relations.

use rayon::prelude::*;

use super::{CHUNK, Shared};

/// Row-major D x D in a 3 x 3 frame.
pub type Tensor = [f64; 9];
/// Conservative, drag, random: r_ij (x) dp_ij summed over pairs.
pub type Exchanged = [Tensor; 3];

/// Particles of a partial sum of the kinetic part.
const GRAIN: usize = 1024;

/// Pair sums of the sweeps and the integral they add up to.
#[derive(Debug, Clone, Default)]
pub struct Tally {
    /// G by part in reduced units: kinetic, conservative, drag, random.
    pub moment: [Tensor; 4],
    /// Sums over pairs of the forces at hand.
    force: Exchanged,
    /// Sums over pairs of the last sweep that changed nothing but the drag.
    correction: Exchanged,
    /// One partial sum a block: same order of summation on any number of threads.
    blocks: Vec<Exchanged>,
    kinetic: Vec<Tensor>,
}

fn add(sum: &mut Tensor, scale: f64, term: &Tensor) {
    for (s, t) in sum.iter_mut().zip(term) {
        *s += scale * t;
    }
}

impl Tally {
    /// For so many particles and blocks.
    pub fn new(particles: usize, blocks: usize) -> Self {
        Self {
            blocks: vec![Exchanged::default(); blocks],
            kinetic: vec![Tensor::default(); particles.div_ceil(GRAIN)],
            ..Self::default()
        }
    }

    /// A sweep begins: where its blocks may write.
    pub(super) fn begin(&mut self) -> Shared<'_, Exchanged> {
        self.blocks.fill(Exchanged::default());
        Shared::new(&mut self.blocks)
    }

    fn total(&self) -> Exchanged {
        let mut sum = Exchanged::default();
        for block in &self.blocks {
            for (s, part) in sum.iter_mut().zip(block) {
                add(s, 1.0, part);
            }
        }
        sum
    }

    /// The sweep just done gave the forces.
    pub(super) fn keep_force(&mut self) {
        self.force = self.total();
    }

    /// The sweep just done gave a change of the drag.
    pub(super) fn keep_correction(&mut self) {
        self.correction = self.total();
    }

    /// The sweep just done changed momenta.
    pub(super) fn keep_exchange(&mut self) {
        let sum = self.total();
        self.apply(1.0, &sum);
    }

    /// The forces at hand act over the time t.
    pub fn kick(&mut self, t: f64) {
        let force = self.force;
        self.apply(t, &force);
    }

    /// The forces change by the correction, which has acted over the time t already.
    pub fn correct(&mut self, t: f64) {
        let correction = self.correction;
        for (force, change) in self.force.iter_mut().zip(&correction) {
            add(force, 1.0, change);
        }
        self.apply(t, &correction);
    }

    /// The particles move with their velocities over the time t.
    pub fn drift(&mut self, t: f64, velocity: &[[f64; 4]]) {
        self.kinetic
            .par_iter_mut()
            .zip(velocity.par_chunks(GRAIN))
            .for_each(|(sum, velocity)| {
                *sum = Tensor::default();
                for v in velocity {
                    for a in 0..3 {
                        for b in 0..3 {
                            sum[3 * a + b] += v[a] * v[b];
                        }
                    }
                }
            });
        for sum in &self.kinetic {
            add(&mut self.moment[0], t, sum);
        }
    }

    fn apply(&mut self, t: f64, exchanged: &Exchanged) {
        for (moment, part) in self.moment[1..].iter_mut().zip(exchanged) {
            add(moment, t, part);
        }
    }
}

/// Momentum exchanged by the pairs of a chunk, by part and component.
#[derive(Debug)]
pub(super) struct PartLanes {
    pub parts: [[[f64; CHUNK]; 3]; 3],
}

impl PartLanes {
    pub(super) fn new() -> Self {
        Self {
            parts: [[[0.0; CHUNK]; 3]; 3],
        }
    }

    /// Adds r (x) dp over the first `count` lanes.
    #[inline(always)]
    pub(super) fn add_to<const D: usize>(
        &mut self,
        sum: &mut Exchanged,
        r: &[[f64; CHUNK]; 3],
        count: usize,
    ) {
        const LANES: usize = 8;
        for part in 0..3 {
            for b in 0..D {
                let dp = &mut self.parts[part][b];
                // Lanes that are not in use hold leftovers.
                dp[count..].fill(0.0);
                for a in 0..D {
                    let mut lanes = [0.0; LANES];
                    for k in (0..CHUNK).step_by(LANES) {
                        for lane in 0..LANES {
                            lanes[lane] += r[a][k + lane] * dp[k + lane];
                        }
                    }
                    sum[part][3 * a + b] += lanes.iter().sum::<f64>();
                }
            }
        }
    }
}
