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
use crate::real::Real;

/// Row-major D x D in a 3 x 3 frame.
pub type Tensor = [f64; 9];
/// Conservative, drag, random: r_ij (x) dp_ij summed over pairs.
pub type Exchanged = [Tensor; 3];

/// Particles of a partial sum of the kinetic part.
const GRAIN: usize = 1024;

/// Pair sums of the sweeps and the integral they add up to.
#[derive(Debug, Clone, Default)]
pub struct Tally {
    /// Keep the parts of the exchanged momentum apart? Otherwise what one sweep exchanges goes into
    /// one of them, at a third of the price: only their sum is meant to be read.
    pub parts: bool,
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

/// Where the blocks of a sweep put their sums.
#[derive(Debug, Clone, Copy)]
pub(super) struct BlockSums<'a> {
    /// Are parts kept apart?
    pub parts: bool,
    sums: Shared<'a, Exchanged>,
}

impl BlockSums<'_> {
    /// Adds the sums of a block.
    ///
    /// # Safety
    /// No other thread adds to the same block at the same time.
    pub(super) unsafe fn add(&self, block: u32, terms: &Exchanged) {
        // SAFETY: promised by the caller.
        let all = unsafe { self.sums.slot(block) };
        for (sum, term) in all.iter_mut().zip(terms) {
            add(sum, 1.0, term);
        }
    }
}

/// The sums of one block under way.
pub(super) struct Virial {
    pub sum: Exchanged,
    /// Work space, where parts are kept apart.
    pub parts: Option<PartLanes>,
}

impl Virial {
    #[inline(always)]
    pub(super) fn new(sums: BlockSums<'_>) -> Self {
        Self {
            sum: Exchanged::default(),
            parts: sums.parts.then(PartLanes::new),
        }
    }
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
    pub(super) fn begin(&mut self) -> BlockSums<'_> {
        self.blocks.fill(Exchanged::default());
        BlockSums {
            parts: self.parts,
            sums: Shared::new(&mut self.blocks),
        }
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

/// Adds r (x) dp over the first `count` lanes; what other lanes of dp hold is cleared.
#[inline(always)]
pub(super) fn add_outer<const D: usize, const N: usize, const M: usize, R: Real, S: Real>(
    sum: &mut Tensor,
    r: &[[R; N]; 3],
    dp: &mut [[S; M]; 3],
    count: usize,
) {
    /// Partial sums side by side: four vectors, so that no addition waits for the one before.
    const LANES: usize = 16;
    let end = count.next_multiple_of(LANES).min(CHUNK);
    for b in 0..D {
        dp[b][count..end].fill(S::ZERO);
        for a in 0..D {
            let (r, dp) = (r[a].as_chunks::<LANES>().0, dp[b].as_chunks::<LANES>().0);
            let mut lanes = [0.0; LANES];
            for (r, dp) in r.iter().zip(dp).take(end / LANES) {
                for lane in 0..LANES {
                    lanes[lane] += r[lane].double() * dp[lane].double();
                }
            }
            sum[3 * a + b] += lanes.iter().sum::<f64>();
        }
    }
}

/// Momentum exchanged by the pairs of a chunk, by part and component.
#[derive(Debug)]
#[repr(align(64))]
pub(super) struct PartLanes {
    pub parts: [[[f64; CHUNK]; 3]; 3],
}

impl PartLanes {
    pub(super) fn new() -> Self {
        Self {
            parts: [[[0.0; CHUNK]; 3]; 3],
        }
    }

    /// Adds r (x) dp of each part over the first `count` lanes.
    #[inline(always)]
    pub(super) fn add_to<const D: usize, const N: usize, R: Real>(
        &mut self,
        sum: &mut Exchanged,
        r: &[[R; N]; 3],
        count: usize,
    ) {
        for (sum, part) in sum.iter_mut().zip(&mut self.parts) {
            add_outer::<D, N, CHUNK, R, f64>(sum, r, part, count);
        }
    }
}
