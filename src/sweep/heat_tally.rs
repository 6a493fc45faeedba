//! The current of energy as the step makes it: what pairs hand over across their separation,
//! r_ij dE_ij, by conduction, friction and pressure, and what particles carry.
//!
//! With e_i = K_i + E_i, a conduction hands over dE_i; friction the half difference of the changes
//! of e_i and e_j, which is dp.(v_i + v_j)/2; and a kick of length t whose work is kept in the books
//! t F r_ij.(A_j u_i + A_i u_j), A = P/d^2 and u the mean velocity of the kick: the force
//! (A_i + A_j) F r_ij does its work on i, less what A_i takes from E_i by its own books. Each is
//! antisymmetric, so the time integral changes by just what the step did to sum e_i r_i of unwrapped
//! positions: the Helfand moment of heat conduction, exact at any time step. Without books energy is
//! not conserved, and there is no such current.

use rayon::prelude::*;

use super::Shared;

/// A vector in a frame of three.
pub type Flow = [f64; 3];
/// Conduction, friction, pressure: r_ij dE_ij summed over pairs.
pub(super) type Handed = [Flow; 3];

/// Place of what pressure hands over.
pub(super) const PRESSURE: usize = 2;

/// Particles of a partial sum of what they carry.
const GRAIN: usize = 1024;

/// Pair sums of the sweeps and the integral they add up to.
#[derive(Debug, Clone, Default)]
pub struct HeatTally {
    /// Integral of the current in reduced units: conduction, friction, pressure, convection.
    pub moment: [Flow; 4],
    /// One partial sum a block: same order of summation on any number of threads.
    blocks: Vec<Handed>,
    carried: Vec<Flow>,
}

/// Where the blocks of a sweep put their sums.
#[derive(Debug, Clone, Copy)]
pub(super) struct HeatSums<'a>(Shared<'a, Handed>);

impl HeatSums<'_> {
    /// Adds the sums of a block.
    ///
    /// # Safety
    /// No other thread adds to the same block at the same time.
    pub(super) unsafe fn add(&self, block: u32, terms: &Handed) {
        // SAFETY: promised by the caller.
        add(unsafe { self.0.slot(block) }, 1.0, terms);
    }
}

fn add(sums: &mut [Flow], scale: f64, terms: &[Flow]) {
    for (sum, term) in sums.iter_mut().zip(terms) {
        for (s, t) in sum.iter_mut().zip(term) {
            *s += scale * t;
        }
    }
}

impl HeatTally {
    /// For so many particles and blocks.
    pub fn new(particles: usize, blocks: usize) -> Self {
        Self {
            moment: [Flow::default(); 4],
            blocks: vec![Handed::default(); blocks],
            carried: vec![Flow::default(); particles.div_ceil(GRAIN)],
        }
    }

    /// A sweep begins.
    pub(super) fn begin(&mut self) {
        self.blocks.fill(Handed::default());
    }

    /// Where the blocks of the sweep may write.
    pub(super) fn sums(&mut self) -> HeatSums<'_> {
        HeatSums(Shared::new(&mut self.blocks))
    }

    /// The sums of the sweep just done are energies handed over, or powers that act for the time t.
    pub fn keep(&mut self, t: f64) {
        for block in &self.blocks {
            add(&mut self.moment, t, block);
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
            add(&mut self.moment[3..], t, std::slice::from_ref(sum));
        }
    }
}
