//! The pair sweep of the splitting integrator: each pair's drag and noise solved exactly, one pair
//! after the other, positions frozen. What does not depend on velocities is computed for a whole
//! chunk at once; only the short velocity update runs in sequence.

use std::marker::PhantomData;

use super::couples::{Couples, Rest};
use super::rows::{Noise, ROOM, whole};
use super::tally::{BlockSums, PartLanes, Tally, Virial, add_outer};
use super::{CHUNK, Shared, Task, Wide, for_each_block, run_wide};
use crate::domain::PeriodicBox;
use crate::kernel::Kernel;
use crate::neighbor::{BlockList, Grid, PairList, ROUNDS};
use crate::physics::{Exchange, FrictionForm};
use crate::random::{SweepKey, Variate, inverse_root_with};
use crate::state::Particles;

/// Order of the sweep: the second half of a step runs backward, which makes the step symmetric.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Direction {
    /// First colour, first pair, onward.
    Forward,
    /// The same order from its end.
    Backward,
}

/// The arrays of one chunk.
#[repr(align(64))] // vectors must not straddle cache lines
struct Lanes {
    pairs: Couples,
    across: [f64; ROOM],
    along: [f64; ROOM],
    noise: Noise<3>,
}

/// Fills the lanes.
struct Gather<'a, 'r, const D: usize, const NOISE: bool> {
    sweep: &'a Sweep<'a>,
    block: &'a BlockList,
    rest: &'a mut Rest<'r>,
    lanes: &'a mut Lanes,
}

impl<const D: usize, const NOISE: bool> Task for Gather<'_, '_, D, NOISE> {
    type Output = ();

    #[inline(always)]
    fn run<W: Wide>(self) {
        let Lanes { pairs, noise, .. } = self.lanes;
        let Sweep { cell, position, .. } = self.sweep;
        pairs.fill::<W, D>(self.block, cell, position, self.rest);
        if NOISE {
            noise.name_pairs(&pairs.slots, pairs.count, self.sweep.id);
        }
    }
}

/// All that does not depend on the velocities.
struct Terms<'a, K, F, const D: usize, const NOISE: bool> {
    lanes: &'a mut Lanes,
    exchange: &'a Exchange,
    form: PhantomData<(K, F)>,
}

impl<K: Kernel, F: FrictionForm, const D: usize, const NOISE: bool> Task
    for Terms<'_, K, F, D, NOISE>
{
    type Output = ();

    #[inline(always)]
    fn run<W: Wide>(self) {
        let lanes = self.lanes;
        for k in 0..whole(lanes.pairs.count) {
            let r = [
                lanes.pairs.r[0][k],
                lanes.pairs.r[1][k],
                lanes.pairs.r[2][k],
            ];
            let r2 = lanes.pairs.r2[k];
            let inverse_r = inverse_root_with::<W::Arithmetic>(if r2 > 1e-30 { r2 } else { 1e-30 });
            let weight = lanes.pairs.weight[k];
            let g = K::f::<D>(r2 * inverse_r) * (weight * weight);
            let mut xi = [0.0; 3];
            if NOISE {
                xi = [
                    lanes.noise.xi[0][k],
                    lanes.noise.xi[1][k],
                    lanes.noise.xi[2][k],
                ];
            }
            let terms = self
                .exchange
                .terms::<F, W::Arithmetic>(g, inverse_r, r, xi, NOISE);
            lanes.across[k] = terms.half_across;
            lanes.along[k] = terms.half_along;
            for a in 0..D {
                lanes.noise.xi[a][k] = terms.noise[a];
            }
        }
    }
}

/// Changes the velocities, one pair after the other.
struct Update<'a, 'v, const D: usize, const CENTRAL: bool> {
    lanes: &'a mut Lanes,
    velocity: &'a Shared<'v, [f64; 4]>,
    virial: Option<&'a mut Virial>,
}

impl<const D: usize, const CENTRAL: bool> Update<'_, '_, D, CENTRAL> {
    /// v_i += dv, v_j -= dv for one lane; returns dv.
    #[inline(always)]
    fn pair(lanes: &Lanes, velocity: &Shared<'_, [f64; 4]>, k: usize) -> [f64; 3] {
        let [i, j] = lanes.pairs.slots[k];
        // SAFETY: blocks of one colour share no particle, and i != j.
        let (v, w) = unsafe { (velocity.slot(i), velocity.slot(j)) };
        let mut approach = 0.0;
        for a in 0..D {
            approach += lanes.pairs.r[a][k] * (v[a] - w[a]);
        }
        let mut along = lanes.along[k] * approach;
        if CENTRAL {
            along += lanes.noise.xi[0][k];
        }
        let mut change = [0.0; 3];
        for a in 0..D {
            let mut dv = along * lanes.pairs.r[a][k];
            if !CENTRAL {
                dv += lanes.across[k] * (v[a] - w[a]) + lanes.noise.xi[a][k];
            }
            v[a] += dv;
            w[a] -= dv;
            change[a] = dv;
        }
        change
    }

    /// The drag and the random part of a change of velocity (unit mass: of momentum).
    #[inline(always)]
    fn keep(lanes: &Lanes, k: usize, change: [f64; 3], parts: &mut PartLanes) {
        for a in 0..D {
            let random = if CENTRAL {
                lanes.noise.xi[0][k] * lanes.pairs.r[a][k]
            } else {
                lanes.noise.xi[a][k]
            };
            parts.parts[1][a][k] = change[a] - random;
            parts.parts[2][a][k] = random;
        }
    }
}

impl<const D: usize, const CENTRAL: bool> Task for Update<'_, '_, D, CENTRAL> {
    type Output = ();

    #[inline(always)]
    fn run<W: Wide>(self) {
        let (lanes, velocity) = (self.lanes, self.velocity);
        let count = lanes.pairs.count.min(CHUNK);
        match self.virial {
            None => {
                for k in 0..count {
                    Self::pair(lanes, velocity, k);
                }
            }
            Some(Virial {
                sum,
                parts: Some(parts),
            }) => {
                for k in 0..count {
                    let change = Self::pair(lanes, velocity, k);
                    Self::keep(lanes, k, change, parts);
                }
                parts.add_to::<D, ROOM>(sum, &lanes.pairs.r, count);
            }
            Some(Virial { sum, parts: None }) => {
                for k in 0..count {
                    let change = Self::pair(lanes, velocity, k);
                    // The noise of this pair has done its work and lends its place.
                    for a in 0..D {
                        lanes.noise.xi[a][k] = change[a];
                    }
                }
                add_outer::<D, ROOM, ROOM>(&mut sum[1], &lanes.pairs.r, &mut lanes.noise.xi, count);
            }
        }
    }
}

/// What a sweep works on.
struct Sweep<'a> {
    cell: &'a PeriodicBox,
    position: &'a [[f64; 4]],
    velocity: Shared<'a, [f64; 4]>,
    id: &'a [u64],
    exchange: Exchange,
    key: SweepKey,
    direction: Direction,
    tally: Option<BlockSums<'a>>,
}

impl Sweep<'_> {
    /// One round of one block.
    fn round<K: Kernel, F: FrictionForm, V: Variate, const D: usize>(
        &self,
        block: &BlockList,
        number: u32,
        round: usize,
    ) {
        let lanes = &mut Lanes {
            pairs: Couples::new(),
            across: [0.0; ROOM],
            along: [0.0; ROOM],
            noise: Noise::new(),
        };
        let mut rest = Rest::of(block, round, self.direction);
        let mut virial = self.tally.map(Virial::new);
        while !rest.is_empty() {
            if V::ON {
                self.gather::<D, true>(block, &mut rest, lanes);
                lanes.noise.draw::<F, V, D>(&self.key, lanes.pairs.count);
                self.terms::<K, F, D, true>(lanes);
            } else {
                self.gather::<D, false>(block, &mut rest, lanes);
                self.terms::<K, F, D, false>(lanes);
            }
            let (velocity, virial) = (&self.velocity, virial.as_mut());
            if F::CENTRAL {
                run_wide(Update::<D, true> {
                    lanes,
                    velocity,
                    virial,
                });
            } else {
                run_wide(Update::<D, false> {
                    lanes,
                    velocity,
                    virial,
                });
            }
        }
        if let (Some(sums), Some(virial)) = (self.tally, virial) {
            // SAFETY: this block's own number.
            unsafe { sums.add(number, &virial.sum) };
        }
    }

    fn gather<const D: usize, const NOISE: bool>(
        &self,
        block: &BlockList,
        rest: &mut Rest<'_>,
        lanes: &mut Lanes,
    ) {
        run_wide(Gather::<D, NOISE> {
            sweep: self,
            block,
            rest,
            lanes,
        });
    }

    fn terms<K: Kernel, F: FrictionForm, const D: usize, const NOISE: bool>(
        &self,
        lanes: &mut Lanes,
    ) {
        run_wide(Terms::<K, F, D, NOISE> {
            lanes,
            exchange: &self.exchange,
            form: PhantomData,
        });
    }
}

/// One sweep over all pairs: round by round, colour by colour, block by block.
#[allow(clippy::too_many_arguments)]
pub fn exchange<K: Kernel, F: FrictionForm, V: Variate, const D: usize>(
    particles: &mut Particles,
    grid: &Grid,
    list: &PairList,
    cell: &PeriodicBox,
    exchange: Exchange,
    key: SweepKey,
    direction: Direction,
    mut tally: Option<&mut Tally>,
) {
    let sums = tally.as_deref_mut().map(Tally::begin);
    let sweep = Sweep {
        cell,
        position: &particles.position,
        velocity: Shared::new(&mut particles.velocity),
        id: &particles.id,
        exchange,
        key,
        direction,
        tally: sums,
    };
    let backward = direction == Direction::Backward;
    for k in 0..ROUNDS {
        let round = if backward { ROUNDS - 1 - k } else { k };
        for_each_block(grid, &list.blocks, backward, &|number, block| {
            sweep.round::<K, F, V, D>(block, number, round);
        });
    }
    if let Some(tally) = tally {
        tally.keep_exchange();
    }
}
