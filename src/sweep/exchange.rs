//! The pair sweep of the splitting integrator: each pair's drag and noise solved exactly, one pair
//! after the other, positions frozen. What does not depend on velocities is computed for a whole
//! chunk at once; only the short velocity update runs in sequence.

use std::marker::PhantomData;

use super::rows::{Noise, ROOM, Wrap, first_lanes, whole};
use super::tally::{BlockSums, PartLanes, Tally, Virial, add_outer};
use super::wide::LANES;
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

/// The arrays of one chunk: pairs within the support, in the order of the sweep.
#[repr(align(64))] // vectors must not straddle cache lines
struct Lanes {
    count: usize,
    slots: [[u32; 2]; ROOM],
    r: [[f64; ROOM]; 3],
    r2: [f64; ROOM],
    weight: [f64; ROOM],
    across: [f64; ROOM],
    along: [f64; ROOM],
    noise: Noise<3>,
}

/// The pairs of a block that are still to come, in the order of the sweep.
struct Rest<'a> {
    pairs: &'a [[u16; 2]],
    direction: Direction,
}

impl<'a> Rest<'a> {
    /// The next ones: at most so many.
    fn next(&mut self, count: usize) -> &'a [[u16; 2]] {
        let count = count.min(self.pairs.len());
        let (now, later) = match self.direction {
            Direction::Forward => self.pairs.split_at(count),
            Direction::Backward => {
                let (later, now) = self.pairs.split_at(self.pairs.len() - count);
                (now, later)
            }
        };
        self.pairs = later;
        now
    }
}

/// Fills the lanes with pairs within the support.
struct Gather<'a, 'r, const D: usize, const NOISE: bool> {
    block: &'a BlockList,
    cell: &'a PeriodicBox,
    position: &'a [[f64; 4]],
    id: &'a [u64],
    rest: &'a mut Rest<'r>,
    lanes: &'a mut Lanes,
}

impl<const D: usize, const NOISE: bool> Gather<'_, '_, D, NOISE> {
    /// Eight pairs, of which `there` are some; returns how many have got lanes.
    ///
    /// # Safety
    /// The pairs are of this block, and there are eight lanes from `at` on.
    #[inline(always)]
    unsafe fn eight<W: Wide>(
        &mut self,
        wrap: &Wrap<W>,
        pairs: &[[u16; 2]; LANES],
        there: u8,
        at: usize,
    ) -> usize {
        let mut slots = [[0; 2]; LANES];
        // SAFETY: places of a list lead to slots of particles.
        unsafe {
            for (slots, pair) in slots.iter_mut().zip(pairs) {
                for (slot, &place) in slots.iter_mut().zip(pair) {
                    *slot = *self.block.slots.get_unchecked(place as usize);
                }
            }
            let [s0, s1, s2, s3, s4, s5, s6, s7] = slots;
            let first = [s0[0], s1[0], s2[0], s3[0], s4[0], s5[0], s6[0], s7[0]];
            let second = [s0[1], s1[1], s2[1], s3[1], s4[1], s5[1], s6[1], s7[1]];
            let i = W::columns(self.position.as_ptr(), &first);
            let j = W::columns(self.position.as_ptr(), &second);
            let (x, y) = (
                wrap.along(0, i[0].minus(j[0])),
                wrap.along(1, i[1].minus(j[1])),
            );
            let z = wrap.along(2, i[2].minus(j[2]));
            let mut r2 = x.times(x).plus_product(y, y);
            if D == 3 {
                r2 = r2.plus_product(z, z);
            }
            let keep = r2.below(W::splat(1.0)) & there;
            let lanes = &mut *self.lanes;
            x.store_kept(keep, lanes.r[0].as_mut_ptr().add(at));
            y.store_kept(keep, lanes.r[1].as_mut_ptr().add(at));
            if D == 3 {
                z.store_kept(keep, lanes.r[2].as_mut_ptr().add(at));
            }
            r2.store_kept(keep, lanes.r2.as_mut_ptr().add(at));
            let weight = i[3].times(j[3]);
            weight.store_kept(keep, lanes.weight.as_mut_ptr().add(at));
            let mut lane = at;
            for (k, pair) in slots.iter().enumerate() {
                *lanes.slots.get_unchecked_mut(lane) = *pair;
                lane += usize::from(keep >> k & 1);
            }
            lane - at
        }
    }
}

impl<const D: usize, const NOISE: bool> Task for Gather<'_, '_, D, NOISE> {
    type Output = ();

    #[inline(always)]
    fn run<W: Wide>(mut self) {
        let wrap = Wrap::<W>::new(self.cell);
        let mut count = 0;
        // Stop before the free lanes become too few to be worth a pass.
        while CHUNK - count >= 2 * LANES {
            let pairs = self.rest.next(CHUNK - count);
            if pairs.is_empty() {
                break;
            }
            let backward = self.rest.direction == Direction::Backward;
            for k in (0..pairs.len()).step_by(LANES) {
                let there = first_lanes(pairs.len() - k);
                let mut eight = [pairs[0]; LANES];
                for (lane, pair) in eight.iter_mut().enumerate() {
                    let n = (k + lane).min(pairs.len() - 1);
                    *pair = pairs[if backward { pairs.len() - 1 - n } else { n }];
                }
                // SAFETY: pairs of this block; no more than free lanes, and eight behind them.
                count += unsafe { self.eight(&wrap, &eight, there, count) };
            }
        }
        let lanes = self.lanes;
        lanes.count = count;
        if NOISE {
            for lane in 0..count.min(ROOM) {
                // SAFETY: slots of particles.
                let ids =
                    lanes.slots[lane].map(|slot| unsafe { *self.id.get_unchecked(slot as usize) });
                lanes.noise.name_one(ids, lane);
            }
        }
    }
}

/// Draws the noise.
struct Draw<'a, V, const COUNT: usize, const SIGNED: bool> {
    lanes: &'a mut Lanes,
    key: &'a SweepKey,
    form: PhantomData<V>,
}

impl<V: Variate, const COUNT: usize, const SIGNED: bool> Task for Draw<'_, V, COUNT, SIGNED> {
    type Output = ();

    #[inline(always)]
    fn run<W: Wide>(self) {
        let Lanes { noise, count, .. } = self.lanes;
        noise.draw::<V, W::Arithmetic>(self.key, *count, COUNT, SIGNED);
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
        for k in 0..whole(lanes.count) {
            let r = [lanes.r[0][k], lanes.r[1][k], lanes.r[2][k]];
            let r2 = lanes.r2[k];
            let inverse_r = inverse_root_with::<W::Arithmetic>(if r2 > 1e-30 { r2 } else { 1e-30 });
            let weight = lanes.weight[k];
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
        let [i, j] = lanes.slots[k];
        // SAFETY: blocks of one colour share no particle, and i != j.
        let (v, w) = unsafe { (velocity.slot(i), velocity.slot(j)) };
        let mut approach = 0.0;
        for a in 0..D {
            approach += lanes.r[a][k] * (v[a] - w[a]);
        }
        let mut along = lanes.along[k] * approach;
        if CENTRAL {
            along += lanes.noise.xi[0][k];
        }
        let mut change = [0.0; 3];
        for a in 0..D {
            let mut dv = along * lanes.r[a][k];
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
                lanes.noise.xi[0][k] * lanes.r[a][k]
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
        let count = lanes.count.min(CHUNK);
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
                parts.add_to::<D, ROOM>(sum, &lanes.r, count);
            }
            Some(Virial { sum, parts: None }) => {
                for k in 0..count {
                    let change = Self::pair(lanes, velocity, k);
                    // The noise of this pair has done its work and lends its place.
                    for a in 0..D {
                        lanes.noise.xi[a][k] = change[a];
                    }
                }
                add_outer::<D, ROOM, ROOM>(&mut sum[1], &lanes.r, &mut lanes.noise.xi, count);
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
            count: 0,
            slots: [[0; 2]; ROOM],
            r: [[0.0; ROOM]; 3],
            r2: [0.0; ROOM],
            weight: [0.0; ROOM],
            across: [0.0; ROOM],
            along: [0.0; ROOM],
            noise: Noise::new(),
        };
        let range = block.rounds[round] as usize..block.rounds[round + 1] as usize;
        let mut rest = Rest {
            pairs: &block.shuffled[range],
            direction: self.direction,
        };
        let mut virial = self.tally.map(Virial::new);
        while !rest.pairs.is_empty() {
            if V::ON {
                self.gather::<D, true>(block, &mut rest, lanes);
                self.draw::<F, V, D>(lanes);
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
            block,
            cell: self.cell,
            position: self.position,
            id: self.id,
            rest,
            lanes,
        });
    }

    fn draw<F: FrictionForm, V: Variate, const D: usize>(&self, lanes: &mut Lanes) {
        let (key, form) = (&self.key, PhantomData::<V>);
        if F::CENTRAL {
            run_wide(Draw::<V, 1, false> { lanes, key, form });
        } else {
            run_wide(Draw::<V, D, true> { lanes, key, form });
        }
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
