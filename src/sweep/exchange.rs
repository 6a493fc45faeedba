//! The pair sweep of the splitting integrator: each pair's drag and noise solved exactly, one pair
//! after the other, positions frozen. What does not depend on velocities is computed for a whole
//! chunk at once; only the short velocity update runs in sequence.

use std::marker::PhantomData;

use super::couples::{Couples, Rest};
use super::noise::Noise;
use super::precision::Precision;
use super::rows::{ROOM, whole};
use super::tally::{BlockSums, PartLanes, Tally, Virial, add_outer};
use super::{CHUNK, Shared, Task, Wide, fetch, for_each_block_with, run_wide};
use crate::domain::PeriodicBox;
use crate::kernel::Kernel;
use crate::neighbor::{BlockList, Grid, PairList, ROUNDS};
use crate::physics::{Exchange, FrictionForm};
use crate::random::{SweepKey, Variate};
use crate::real::{Real, near_inverse_roots};
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
struct Lanes<P: Precision> {
    pairs: Couples<P>,
    /// Decays across and along the line of centres, then factors of the change; `along` holds g before.
    across: [P::Real; ROOM],
    along: [P::Real; ROOM],
    noise: Noise<3, P::Real>,
    /// 1/r, nearly and well.
    near: [f32; ROOM],
    inverse_r: [P::Real; ROOM],
}

impl<P: Precision> Lanes<P> {
    fn new() -> Self {
        let zero = [P::Real::ZERO; ROOM];
        Self {
            pairs: Couples::new(),
            across: zero,
            along: zero,
            noise: Noise::new(),
            near: [0.0; ROOM],
            inverse_r: zero,
        }
    }
}

/// Fills the lanes.
struct Gather<'a, 'r, P: Precision, const D: usize, const NOISE: bool> {
    sweep: &'a Sweep<'a, P>,
    block: &'a BlockList,
    rest: &'a mut Rest<'r>,
    lanes: &'a mut Lanes<P>,
}

impl<P: Precision, const D: usize, const NOISE: bool> Task for Gather<'_, '_, P, D, NOISE> {
    type Output = ();

    #[inline(always)]
    fn run<W: Wide>(self) {
        let Lanes { pairs, noise, .. } = self.lanes;
        let Sweep { cell, place, .. } = self.sweep;
        pairs.fill::<W, D>(self.block, cell, place, self.rest);
        if NOISE {
            noise.name_pairs(&pairs.slots, pairs.count, self.sweep.id);
        }
    }
}

/// All that does not depend on the velocities.
struct Terms<'a, K, F, P: Precision, const D: usize, const NOISE: bool> {
    lanes: &'a mut Lanes<P>,
    exchange: &'a Exchange,
    form: PhantomData<(K, F)>,
}

impl<K: Kernel, F: FrictionForm, P: Precision, const D: usize, const NOISE: bool> Task
    for Terms<'_, K, F, P, D, NOISE>
{
    type Output = ();

    #[inline(always)]
    fn run<W: Wide>(self) {
        let lanes = self.lanes;
        let count = whole::<P::Real>(lanes.pairs.count);
        near_inverse_roots(&lanes.pairs.r2, &mut lanes.near, count);
        // Loop by loop: a machine has too few turns of a long one in hand to keep busy.
        for k in 0..count {
            let (r2, weight) = (lanes.pairs.r2[k], lanes.pairs.weight[k]);
            let [q, inverse_r] = r2.distance_from::<W::Arithmetic>(lanes.near[k]);
            lanes.along[k] = K::f::<_, D>(q) * (weight * weight);
            lanes.inverse_r[k] = inverse_r;
        }
        for k in 0..count {
            let g = lanes.along[k];
            let decays = self.exchange.decays::<F, W::Arithmetic, P::Real>(g);
            [lanes.across[k], lanes.along[k]] = decays;
        }
        for k in 0..count {
            let axis = |lanes: &[[P::Real; ROOM]; 3]| [lanes[0][k], lanes[1][k], lanes[2][k]];
            let terms = self.exchange.terms::<F, W::Arithmetic, P::Real>(
                [lanes.across[k], lanes.along[k]],
                lanes.inverse_r[k],
                axis(&lanes.pairs.r),
                axis(&lanes.noise.xi),
                NOISE,
            );
            lanes.across[k] = terms.half_across;
            lanes.along[k] = terms.half_along;
            for a in 0..D {
                lanes.noise.xi[a][k] = terms.noise[a];
            }
        }
    }
}

/// Changes the velocities, one pair after the other.
struct Update<'a, 'v, P: Precision, const D: usize, const CENTRAL: bool> {
    lanes: &'a mut Lanes<P>,
    velocity: &'a Shared<'v, [f64; 4]>,
    virial: Option<&'a mut Virial>,
}

impl<P: Precision, const D: usize, const CENTRAL: bool> Update<'_, '_, P, D, CENTRAL> {
    /// v_i += dv, v_j -= dv for one lane; returns dv.
    #[inline(always)]
    fn pair(lanes: &Lanes<P>, velocity: &Shared<'_, [f64; 4]>, k: usize) -> [P::Real; 3] {
        let [i, j] = lanes.pairs.slots[k];
        // SAFETY: blocks of one colour share no particle, and i != j.
        let (v, w) = unsafe { (velocity.slot(i), velocity.slot(j)) };
        let mut u = [P::Real::ZERO; 3];
        let mut approach = P::Real::ZERO;
        for a in 0..D {
            u[a] = P::Real::of(v[a] - w[a]);
            approach += lanes.pairs.r[a][k] * u[a];
        }
        let mut along = lanes.along[k] * approach;
        if CENTRAL {
            along += lanes.noise.xi[0][k];
        }
        let mut change = [P::Real::ZERO; 3];
        for a in 0..D {
            let mut dv = along * lanes.pairs.r[a][k];
            if !CENTRAL {
                dv += lanes.across[k] * u[a] + lanes.noise.xi[a][k];
            }
            v[a] += dv.double();
            w[a] -= dv.double();
            change[a] = dv;
        }
        change
    }

    /// The drag and the random part of a change of velocity (unit mass: of momentum).
    #[inline(always)]
    fn keep(lanes: &Lanes<P>, k: usize, change: [P::Real; 3], parts: &mut PartLanes) {
        for a in 0..D {
            let random = if CENTRAL {
                lanes.noise.xi[0][k] * lanes.pairs.r[a][k]
            } else {
                lanes.noise.xi[a][k]
            };
            parts.parts[1][a][k] = (change[a] - random).double();
            parts.parts[2][a][k] = random.double();
        }
    }
}

impl<P: Precision, const D: usize, const CENTRAL: bool> Task for Update<'_, '_, P, D, CENTRAL> {
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
                parts.add_to::<D, ROOM, _>(sum, &lanes.pairs.r, count);
            }
            Some(Virial { sum, parts: None }) => {
                for k in 0..count {
                    let change = Self::pair(lanes, velocity, k);
                    // The noise of this pair has done its work and lends its place.
                    for a in 0..D {
                        lanes.noise.xi[a][k] = change[a];
                    }
                }
                add_outer::<D, ROOM, ROOM, _, _>(
                    &mut sum[1],
                    &lanes.pairs.r,
                    &mut lanes.noise.xi,
                    count,
                );
            }
        }
    }
}

/// What a sweep works on.
struct Sweep<'a, P: Precision> {
    cell: &'a PeriodicBox,
    place: &'a [[P::Real; 4]],
    velocity: Shared<'a, [f64; 4]>,
    id: &'a [u64],
    exchange: Exchange,
    key: SweepKey,
    direction: Direction,
    tally: Option<BlockSums<'a>>,
}

impl<P: Precision> Sweep<'_, P> {
    /// One round of one block.
    fn round<K: Kernel, F: FrictionForm, V: Variate, const D: usize>(
        &self,
        block: &BlockList,
        number: u32,
        round: usize,
        lanes: &mut Lanes<P>,
    ) {
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
                run_wide(Update::<P, D, true> {
                    lanes,
                    velocity,
                    virial,
                });
            } else {
                run_wide(Update::<P, D, false> {
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
        lanes: &mut Lanes<P>,
    ) {
        run_wide(Gather::<P, D, NOISE> {
            sweep: self,
            block,
            rest,
            lanes,
        });
    }

    fn terms<K: Kernel, F: FrictionForm, const D: usize, const NOISE: bool>(
        &self,
        lanes: &mut Lanes<P>,
    ) {
        run_wide(Terms::<K, F, P, D, NOISE> {
            lanes,
            exchange: &self.exchange,
            form: PhantomData,
        });
    }
}

/// One sweep over all pairs: round by round, colour by colour, block by block.
#[allow(clippy::too_many_arguments)]
pub fn exchange<K: Kernel, F: FrictionForm, V: Variate, P: Precision, const D: usize>(
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
    let Particles {
        position,
        velocity,
        id,
        copies,
        ..
    } = particles;
    let place = P::places(position, cell, &mut copies.place);
    let sweep = Sweep::<P> {
        cell,
        place,
        velocity: Shared::new(velocity),
        id,
        exchange,
        key,
        direction,
        tally: sums,
    };
    let backward = direction == Direction::Backward;
    for k in 0..ROUNDS {
        let round = if backward { ROUNDS - 1 - k } else { k };
        for_each_block_with(grid, &list.blocks, backward, Lanes::new, |lanes, turn| {
            fetch(&turn, sweep.place.as_ptr(), sweep.place.len());
            fetch(&turn, sweep.velocity.pointer(), sweep.velocity.length);
            fetch(&turn, sweep.id.as_ptr(), sweep.id.len());
            sweep.round::<K, F, V, D>(turn.block, turn.number, round, lanes);
        });
    }
    if let Some(tally) = tally {
        tally.keep_exchange();
    }
}
