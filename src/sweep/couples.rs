//! Pairs in lanes, in the order in which a sweep of exchanges goes: shuffled, forward or backward, and
//! of the list those within the support.

use super::precision::{Double, Precision};
use super::rows::{MOST, ROOM, Wrap, first_lanes};
use super::wide::Vector;
use super::{CHUNK, Direction, Wide};
use crate::domain::PeriodicBox;
use crate::neighbor::BlockList;
use crate::real::Real;

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
pub(super) struct Couples<P: Precision = Double> {
    /// Pairs in use.
    pub count: usize,
    pub slots: [[u32; 2]; ROOM],
    pub r: [[P::Real; ROOM]; 3],
    pub r2: [P::Real; ROOM],
    /// s_i s_j.
    pub weight: [P::Real; ROOM],
}

impl<P: Precision> Couples<P> {
    pub(super) fn new() -> Self {
        Self {
            count: 0,
            slots: [[0; 2]; ROOM],
            r: [[P::Real::ZERO; ROOM]; 3],
            r2: [P::Real::ZERO; ROOM],
            weight: [P::Real::ZERO; ROOM],
        }
    }

    /// Takes the next pairs.
    #[inline(always)]
    pub(super) fn fill<W: Wide, const D: usize>(
        &mut self,
        block: &BlockList,
        cell: &PeriodicBox,
        place: &[[P::Real; 4]],
        rest: &mut Rest<'_>,
    ) {
        let wrap = Wrap::<P, W>::new(cell);
        let lanes = P::Vector::<W>::LANES;
        let mut count = 0;
        // Stop before the free lanes become too few to be worth a pass.
        while CHUNK - count >= MOST {
            let pairs = rest.next(CHUNK - count);
            if pairs.is_empty() {
                break;
            }
            let backward = rest.direction == Direction::Backward;
            for k in (0..pairs.len()).step_by(lanes) {
                let there = first_lanes::<P::Vector<W>>(pairs.len() - k);
                let mut some = [pairs[0]; MOST];
                for (lane, pair) in some[..lanes].iter_mut().enumerate() {
                    let n = (k + lane).min(pairs.len() - 1);
                    *pair = pairs[if backward { pairs.len() - 1 - n } else { n }];
                }
                // SAFETY: pairs of this block; no more than free lanes, and a vector behind them.
                count += unsafe { self.some::<W, D>(block, place, &wrap, &some, there, count) };
            }
        }
        self.count = count;
    }

    /// As many pairs as a vector has lanes, of which `there` are some; returns how many have got lanes.
    ///
    /// # Safety
    /// The pairs are of this block, and there are as many lanes from `at` on.
    #[inline(always)]
    unsafe fn some<W: Wide, const D: usize>(
        &mut self,
        block: &BlockList,
        place: &[[P::Real; 4]],
        wrap: &Wrap<P, W>,
        pairs: &[[u16; 2]; MOST],
        there: u32,
        at: usize,
    ) -> usize {
        let (mut first, mut second) = ([0; MOST], [0; MOST]);
        // SAFETY: places of a list lead to slots of particles.
        unsafe {
            for lane in 0..P::Vector::<W>::LANES {
                first[lane] = *block.slots.get_unchecked(pairs[lane][0] as usize);
                second[lane] = *block.slots.get_unchecked(pairs[lane][1] as usize);
            }
            let i = P::Vector::<W>::columns(place.as_ptr(), first.as_ptr());
            let j = P::Vector::<W>::columns(place.as_ptr(), second.as_ptr());
            let (r, r2) = wrap.between::<D>(&i, &j);
            let keep = r2.below(P::Vector::<W>::splat(P::Real::of(1.0))) & there;
            for a in 0..D {
                r[a].store_kept(keep, self.r[a].as_mut_ptr().add(at));
            }
            r2.store_kept(keep, self.r2.as_mut_ptr().add(at));
            let weight = i[3].times(j[3]);
            weight.store_kept(keep, self.weight.as_mut_ptr().add(at));
            let mut lane = at;
            for k in 0..P::Vector::<W>::LANES {
                *self.slots.get_unchecked_mut(lane) = [first[k], second[k]];
                lane += (keep >> k & 1) as usize;
            }
            lane - at
        }
    }
}
