//! The pair sweep of the splitting integrator: each pair's drag and noise solved exactly, one pair
//! after the other, positions frozen. What does not depend on velocities is computed for a whole
//! chunk at once; only the short velocity update runs in sequence.

use std::marker::PhantomData;

use super::tally::{BlockSums, PartLanes, Tally, Virial, add_outer};
use super::{CHUNK, Shared, Task, Wide, for_each_block, padded, run_wide};
use crate::domain::PeriodicBox;
use crate::kernel::Kernel;
use crate::neighbor::{BlockList, Grid, PairList, ROUNDS};
use crate::physics::{Exchange, FrictionForm};
use crate::random::{SweepKey, Variate, pair_counter, philox4x32_lanes};
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
    slots: [[u32; 2]; CHUNK],
    r: [[f64; CHUNK]; 3],
    r2: [f64; CHUNK],
    weight: [f64; CHUNK],
    low: [u64; CHUNK],
    high: [u64; CHUNK],
    sign: [f64; CHUNK],
    across: [f64; CHUNK],
    along: [f64; CHUNK],
    noise: [[f64; CHUNK]; 3],
}

struct ExchangeTask<'a, K, F, V, const D: usize> {
    block: &'a BlockList,
    cell: &'a PeriodicBox,
    position: &'a [[f64; 4]],
    velocity: Shared<'a, [f64; 4]>,
    id: &'a [u64],
    exchange: Exchange,
    key: SweepKey,
    direction: Direction,
    round: usize,
    number: u32,
    tally: Option<BlockSums<'a>>,
    form: PhantomData<(K, F, V)>,
}

impl<K: Kernel, F: FrictionForm, V: Variate, const D: usize> ExchangeTask<'_, K, F, V, D> {
    /// Puts the pairs within the support into lanes, in the order of the sweep.
    #[inline(always)]
    fn gather<'p>(
        &self,
        lanes: &mut Lanes,
        first: usize,
        pairs: impl Iterator<Item = &'p [u16; 2]>,
    ) -> usize {
        let slots = &self.block.slots[..];
        let mut at = first;
        for pair in pairs {
            let [i, j] = pair.map(|place| slots[place as usize]);
            // SAFETY: list entries lead to slots of particles.
            let (a, b) = unsafe {
                (
                    self.position.get_unchecked(i as usize),
                    self.position.get_unchecked(j as usize),
                )
            };
            let r = self
                .cell
                .nearest::<D>([a[0] - b[0], a[1] - b[1], a[2] - b[2]]);
            let mut r2 = r[0] * r[0] + r[1] * r[1];
            if D == 3 {
                r2 += r[2] * r[2];
            }
            // Callers leave room for all pairs; the mask only tells the compiler so.
            let lane = at & (CHUNK - 1);
            lanes.slots[lane] = [i, j];
            for axis in 0..D {
                lanes.r[axis][lane] = r[axis];
            }
            lanes.r2[lane] = r2;
            lanes.weight[lane] = a[3] * b[3];
            if V::ON {
                // SAFETY: as above.
                let (p, q) = unsafe {
                    (
                        *self.id.get_unchecked(i as usize),
                        *self.id.get_unchecked(j as usize),
                    )
                };
                let [low, high] = pair_counter(p, q);
                lanes.low[lane] = low;
                lanes.high[lane] = high;
                lanes.sign[lane] = if p < q { 1.0 } else { -1.0 };
            }
            at += usize::from(r2 < 1.0);
        }
        at
    }

    /// One chunk after the other: `next(n)` gives the next at most n pairs.
    #[inline(always)]
    fn sweep<'p, I: ExactSizeIterator<Item = &'p [u16; 2]>>(
        &self,
        lanes: &mut Lanes,
        mut next: impl FnMut(usize) -> I,
    ) {
        let mut virial = self.tally.map(Virial::new);
        loop {
            let (mut count, mut finished) = (0, false);
            while CHUNK - count >= 16 && !finished {
                let pairs = next(CHUNK - count);
                finished = pairs.len() < CHUNK - count;
                count = self.gather(lanes, count, pairs);
            }
            self.compute(lanes, count);
            match &mut virial {
                None => {
                    for k in 0..count {
                        self.update(lanes, k);
                    }
                }
                Some(Virial {
                    sum,
                    parts: Some(parts),
                }) => {
                    for k in 0..count {
                        let change = self.update(lanes, k);
                        Self::keep(lanes, k, change, parts);
                    }
                    parts.add_to::<D, CHUNK>(sum, &lanes.r, count);
                }
                Some(Virial { sum, parts: None }) => {
                    for k in 0..count {
                        let change = self.update(lanes, k);
                        // The noise of this pair has done its work and lends its place.
                        for a in 0..D {
                            lanes.noise[a][k] = change[a];
                        }
                    }
                    add_outer::<D, CHUNK, CHUNK>(&mut sum[1], &lanes.r, &mut lanes.noise, count);
                }
            }
            if finished {
                break;
            }
        }
        if let (Some(sums), Some(virial)) = (self.tally, virial) {
            // SAFETY: this block's own number.
            unsafe { sums.add(self.number, &virial.sum) };
        }
    }

    /// The drag and the random part of a change of velocity (unit mass: of momentum).
    #[inline(always)]
    fn keep(lanes: &Lanes, k: usize, change: [f64; 3], parts: &mut PartLanes) {
        for a in 0..D {
            let random = if F::CENTRAL {
                lanes.noise[0][k] * lanes.r[a][k]
            } else {
                lanes.noise[a][k]
            };
            parts.parts[1][a][k] = change[a] - random;
            parts.parts[2][a][k] = random;
        }
    }

    #[inline(always)]
    fn compute(&self, lanes: &mut Lanes, count: usize) {
        for k in 0..padded(count) {
            let mut xi = [0.0; 3];
            if V::ON {
                let counter = [
                    lanes.low[k],
                    lanes.high[k],
                    self.key.tail[0],
                    self.key.tail[1],
                ];
                let words = philox4x32_lanes(counter, self.key.key);
                xi = if F::CENTRAL {
                    V::draw(words, 1.0, 1)
                } else {
                    V::draw(words, lanes.sign[k], D)
                };
            }
            for a in 0..D {
                lanes.noise[a][k] = xi[a];
            }
        }
        for k in 0..padded(count) {
            let r = [lanes.r[0][k], lanes.r[1][k], lanes.r[2][k]];
            let r2 = lanes.r2[k];
            let weight = lanes.weight[k];
            let g = K::f::<D>(r2.sqrt()) * (weight * weight);
            let inverse_r2 = 1.0 / if r2 > 1e-60 { r2 } else { 1e-60 };
            let xi = [lanes.noise[0][k], lanes.noise[1][k], lanes.noise[2][k]];
            let terms = self.exchange.terms::<F>(g, inverse_r2, r, xi, V::ON);
            lanes.across[k] = terms.half_across;
            lanes.along[k] = terms.half_along;
            for a in 0..D {
                lanes.noise[a][k] = terms.noise[a];
            }
        }
    }

    /// v_i += dv, v_j -= dv for one lane; returns dv.
    #[inline(always)]
    fn update(&self, lanes: &Lanes, k: usize) -> [f64; 3] {
        let [i, j] = lanes.slots[k];
        // SAFETY: blocks of one colour share no particle, and i != j.
        let (v, w) = unsafe { (self.velocity.slot(i), self.velocity.slot(j)) };
        let mut approach = 0.0;
        for a in 0..D {
            approach += lanes.r[a][k] * (v[a] - w[a]);
        }
        let mut along = lanes.along[k] * approach;
        if F::CENTRAL {
            along += lanes.noise[0][k];
        }
        let mut change = [0.0; 3];
        for a in 0..D {
            let mut dv = along * lanes.r[a][k];
            if !F::CENTRAL {
                dv += lanes.across[k] * (v[a] - w[a]) + lanes.noise[a][k];
            }
            v[a] += dv;
            w[a] -= dv;
            change[a] = dv;
        }
        change
    }
}

impl<K: Kernel, F: FrictionForm, V: Variate, const D: usize> Task for ExchangeTask<'_, K, F, V, D> {
    type Output = ();
    #[inline(always)]
    fn run<W: Wide>(self) {
        let zero = [[0.0; CHUNK]; 3];
        let mut lanes = Lanes {
            slots: [[0; 2]; CHUNK],
            r: zero,
            r2: [0.0; CHUNK],
            weight: [0.0; CHUNK],
            low: [0; CHUNK],
            high: [0; CHUNK],
            sign: [0.0; CHUNK],
            across: [0.0; CHUNK],
            along: [0.0; CHUNK],
            noise: zero,
        };
        let rounds = &self.block.rounds;
        let pairs =
            &self.block.shuffled[rounds[self.round] as usize..rounds[self.round + 1] as usize];
        match self.direction {
            Direction::Forward => {
                let mut rest = pairs;
                self.sweep(&mut lanes, |n| {
                    let (now, later) = rest.split_at(n.min(rest.len()));
                    rest = later;
                    now.iter()
                });
            }
            Direction::Backward => {
                let mut rest = pairs;
                self.sweep(&mut lanes, |n| {
                    let (later, now) = rest.split_at(rest.len() - n.min(rest.len()));
                    rest = later;
                    now.iter().rev()
                });
            }
        }
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
    let velocity = Shared::new(&mut particles.velocity);
    let (position, id) = (&particles.position, &particles.id);
    let backward = direction == Direction::Backward;
    for k in 0..ROUNDS {
        let round = if backward { ROUNDS - 1 - k } else { k };
        for_each_block(grid, &list.blocks, backward, &|number, block| {
            run_wide(ExchangeTask::<K, F, V, D> {
                block,
                cell,
                position,
                velocity,
                id,
                exchange,
                key,
                direction,
                round,
                number,
                tally: sums,
                form: PhantomData,
            });
        });
    }
    if let Some(tally) = tally {
        tally.keep_exchange();
    }
}
