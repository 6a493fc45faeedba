//! Pairs in lanes, in the order in which a sweep of exchanges goes: shuffled, forward or backward, and
//! of the list those within the support.

use super::rows::{ROOM, Wrap, first_lanes};
use super::wide::LANES;
use super::{CHUNK, Direction, Wide};
use crate::domain::PeriodicBox;
use crate::neighbor::BlockList;

/// The pairs of a block that are still to come, in the order of the sweep.
pub(super) struct Rest<'a> {
    pairs: &'a [[u16; 2]],
    direction: Direction,
}

impl<'a> Rest<'a> {
    /// All of a round.
    pub(super) fn of(block: &'a BlockList, round: usize, direction: Direction) -> Self {
        let range = block.rounds[round] as usize..block.rounds[round + 1] as usize;
        Self {
            pairs: &block.shuffled[range],
            direction,
        }
    }

    /// None left?
    pub(super) fn is_empty(&self) -> bool {
        self.pairs.is_empty()
    }

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

/// The geometry of the pairs of a chunk.
#[repr(align(64))]
pub(super) struct Couples {
    /// Pairs in use.
    pub count: usize,
    pub slots: [[u32; 2]; ROOM],
    pub r: [[f64; ROOM]; 3],
    pub r2: [f64; ROOM],
    /// s_i s_j.
    pub weight: [f64; ROOM],
}

impl Couples {
    pub(super) fn new() -> Self {
        Self {
            count: 0,
            slots: [[0; 2]; ROOM],
            r: [[0.0; ROOM]; 3],
            r2: [0.0; ROOM],
            weight: [0.0; ROOM],
        }
    }

    /// Takes the next pairs.
    #[inline(always)]
    pub(super) fn fill<W: Wide, const D: usize>(
        &mut self,
        block: &BlockList,
        cell: &PeriodicBox,
        position: &[[f64; 4]],
        rest: &mut Rest<'_>,
    ) {
        let wrap = Wrap::<W>::new(cell);
        let mut count = 0;
        // Stop before the free lanes become too few to be worth a pass.
        while CHUNK - count >= 2 * LANES {
            let pairs = rest.next(CHUNK - count);
            if pairs.is_empty() {
                break;
            }
            let backward = rest.direction == Direction::Backward;
            for k in (0..pairs.len()).step_by(LANES) {
                let there = first_lanes(pairs.len() - k);
                let mut eight = [pairs[0]; LANES];
                for (lane, pair) in eight.iter_mut().enumerate() {
                    let n = (k + lane).min(pairs.len() - 1);
                    *pair = pairs[if backward { pairs.len() - 1 - n } else { n }];
                }
                // SAFETY: pairs of this block; no more than free lanes, and eight behind them.
                count +=
                    unsafe { self.eight::<W, D>(block, position, &wrap, &eight, there, count) };
            }
        }
        self.count = count;
    }

    /// Eight pairs, of which `there` are some; returns how many have got lanes.
    ///
    /// # Safety
    /// The pairs are of this block, and there are eight lanes from `at` on.
    #[inline(always)]
    unsafe fn eight<W: Wide, const D: usize>(
        &mut self,
        block: &BlockList,
        position: &[[f64; 4]],
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
                    *slot = *block.slots.get_unchecked(place as usize);
                }
            }
            let [s0, s1, s2, s3, s4, s5, s6, s7] = slots;
            let first = [s0[0], s1[0], s2[0], s3[0], s4[0], s5[0], s6[0], s7[0]];
            let second = [s0[1], s1[1], s2[1], s3[1], s4[1], s5[1], s6[1], s7[1]];
            let i = W::columns(position.as_ptr(), &first);
            let j = W::columns(position.as_ptr(), &second);
            let (r, r2) = wrap.between::<D>(&i, &j);
            let keep = r2.below(W::splat(1.0)) & there;
            for a in 0..D {
                r[a].store_kept(keep, self.r[a].as_mut_ptr().add(at));
            }
            r2.store_kept(keep, self.r2.as_mut_ptr().add(at));
            let weight = i[3].times(j[3]);
            weight.store_kept(keep, self.weight.as_mut_ptr().add(at));
            let mut lane = at;
            for (k, pair) in slots.iter().enumerate() {
                *self.slots.get_unchecked_mut(lane) = *pair;
                lane += usize::from(keep >> k & 1);
            }
            lane - at
        }
    }
}
