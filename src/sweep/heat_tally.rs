//! The current of energy as the step makes it: what pairs hand over across their separation,
//! r_ij dE_ij, by conduction, friction and pressure, and what particles carry.
//!
//! With e_i = K_i + E_i, a conduction hands over dE_i; friction the half difference of the changes
//! of e_i and e_j, which is dp.(v_i + v_j)/2; and a kick of length t whose work is kept in the books
//! t F r_ij.(A_j u_i + A_i u_j), A = P/d^2 and u the mean velocity of the kick: the force
//! (A_i + A_j) F r_ij does its work on i, less what A_i takes from E_i by its own books. Each is
//! antisymmetric, so the time integral changes by just what the step did to sum e_i r_i of unwrapped
//! positions: the Helfand moment of heat conduction, exact at any time step, up to what a body force
//! does and to energy that stays unbooked. Without books energy is not conserved, and there is no
//! such current.
//!
//! Noise is kept apart: the energy that it hands over has no mean, whatever came before (but for
//! updates that are refused, which are rare unless heat capacities are a few kB), so that the
//! mean square of its integral is that of the sum of r_ij^2 dE_ij^2 over all exchanges, a sum of very
//! many terms that is known much better than the square (`variation`).

use rayon::prelude::*;

use super::Shared;

/// A vector in a frame of three.
pub type Flow = [f64; 3];
/// Conduction, friction, pressure, convection; noise of conduction and of friction.
pub type Flows = [Flow; 6];

/// Places of what pressure hands over, of what particles carry, and of the noise.
const PRESSURE: usize = 2;
const CONVECTION: usize = 3;
const NOISE: usize = 4;

/// Particles of a partial sum of what they carry.
const GRAIN: usize = 1024;

/// The integral of the current in reduced units, or a part of it.
#[derive(Debug, Clone, Copy, Default)]
pub struct HeatMoment {
    /// By part.
    pub flows: Flows,
    /// Sums of r_ij^2 dE_ij^2 over what the noise of conduction and of friction hands over.
    pub variation: [f64; 2],
}

/// Energy that one of a pair got from the other by conduction and by friction.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Given {
    /// Without the noise.
    pub mean: [f64; 2],
    /// By the noise.
    pub noise: [f64; 2],
}

impl HeatMoment {
    /// Adds an exchange across r.
    #[inline(always)]
    pub(super) fn exchange<const D: usize>(&mut self, r: [f64; 3], given: &Given) {
        for part in 0..2 {
            let noise = given.noise[part];
            for a in 0..D {
                self.flows[part][a] += r[a] * given.mean[part];
                self.flows[NOISE + part][a] += r[a] * noise;
                self.variation[part] += (r[a] * noise) * (r[a] * noise);
            }
        }
    }

    /// Where to add what pressure hands over.
    pub(super) fn pressure(&mut self) -> &mut Flow {
        &mut self.flows[PRESSURE]
    }

    fn add(&mut self, scale: f64, other: &Self) {
        for (sum, term) in self.flows.iter_mut().zip(&other.flows) {
            for (s, t) in sum.iter_mut().zip(term) {
                *s += scale * t;
            }
        }
        for (s, t) in self.variation.iter_mut().zip(other.variation) {
            *s += scale * t;
        }
    }
}

/// Pair sums of the sweeps and the integral they add up to.
#[derive(Debug, Clone, Default)]
pub struct HeatTally {
    /// Since an observer asked for it.
    pub moment: HeatMoment,
    /// One partial sum a block: same order of summation on any number of threads.
    blocks: Vec<HeatMoment>,
    carried: Vec<Flow>,
}

/// Where the blocks of a sweep put their sums.
#[derive(Debug, Clone, Copy)]
pub(super) struct HeatSums<'a>(Shared<'a, HeatMoment>);

impl HeatSums<'_> {
    /// Adds the sums of a block.
    ///
    /// # Safety
    /// No other thread adds to the same block at the same time.
    pub(super) unsafe fn add(&self, block: u32, terms: &HeatMoment) {
        // SAFETY: promised by the caller.
        unsafe { self.0.slot(block) }.add(1.0, terms);
    }
}

impl HeatTally {
    /// For so many particles and blocks.
    pub fn new(particles: usize, blocks: usize) -> Self {
        Self {
            moment: HeatMoment::default(),
            blocks: vec![HeatMoment::default(); blocks],
            carried: vec![Flow::default(); particles.div_ceil(GRAIN)],
        }
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        size_of::<HeatMoment>() * self.blocks.capacity()
            + size_of::<Flow>() * self.carried.capacity()
    }

    /// A sweep begins.
    pub(super) fn begin(&mut self) {
        self.blocks.fill(HeatMoment::default());
    }

    /// Where the blocks of the sweep may write.
    pub(super) fn sums(&mut self) -> HeatSums<'_> {
        HeatSums(Shared::new(&mut self.blocks))
    }

    /// The sums of the sweep just done are energies handed over, or powers that act for the time t.
    pub fn keep(&mut self, t: f64) {
        for block in &self.blocks {
            self.moment.add(t, block);
        }
    }

    /// Particles move with their velocities over the time t; `energy` is what each has inside.
    pub fn drift(&mut self, t: f64, velocity: &[[f64; 4]], energy: &[f64]) {
        self.carried
            .par_iter_mut()
            .zip(velocity.par_chunks(GRAIN))
            .zip(energy.par_chunks(GRAIN))
            .for_each(|((sum, velocity), energy)| {
                *sum = Flow::default();
                for (v, e) in velocity.iter().zip(energy) {
                    let whole = e + 0.5 * (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
                    for a in 0..3 {
                        sum[a] += whole * v[a];
                    }
                }
            });
        for sum in &self.carried {
            for (s, x) in self.moment.flows[CONVECTION].iter_mut().zip(sum) {
                *s += t * x;
            }
        }
    }
}
