//! Sweeps over pairs: the only hot loops. Each goes block by block in colour order; the blocks of a
//! colour touch disjoint particles, so they may run on any number of threads, and within a block the
//! order is that of the list. Sums therefore have the same order, and the same bits, always.
//!
//! A block is worked through in chunks of pairs: gather into small arrays, compute on all lanes
//! (this part turns into vector instructions), scatter.

mod clusters;
mod couples;
mod density;
mod exchange;
mod force;
mod heat_tally;
mod noise;
mod pair_state;
mod precision;
mod prune;
mod rows;
mod tally;
mod thermal_exchange;
mod thermal_force;
mod wall;
mod wall_density;
mod wall_exchange;
mod wall_force;
mod wall_model;
mod wall_thermal;
mod wide;
mod work;

pub use density::{number_densities, site_pressures};
pub use exchange::{Direction, exchange};
pub use force::{drag_forces, force_variates, pair_forces};
pub use heat_tally::{HeatMoment, HeatTally};
pub use pair_state::States;
pub use precision::{Copies, Double, Mixed, Precision};
pub(crate) use prune::Prune;
pub(crate) use rows::{MOST, Separation, first_lanes};
pub use tally::{Tally, Tensor};
pub use thermal_exchange::{Slopes, ThermalSweep, slopes, thermal_exchange};
pub use thermal_force::{ThermalForceSweep, thermal_forces};
pub use wall_density::wall_densities;
pub use wall_exchange::wall_exchange;
pub use wall_force::{Motion, wall_drag, wall_forces, wall_friction_weight};
pub use wall_model::{wall_pressures, wall_shares};
pub use wall_thermal::wall_work;
pub use wide::{Instructions, Task, Vector, Wide, run_wide};
pub(crate) use wide::{LANES, kept_of_range};
pub use work::pair_work;

use std::marker::PhantomData;
use std::ops::Range;

use crate::neighbor::{BlockList, Grid, Rows};

/// Pairs per chunk: what a stage reads and writes stays in the first-level cache, or near it.
pub(crate) const CHUNK: usize = 256;

/// An array that blocks of one colour write to at disjoint places.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Shared<'a, T> {
    data: *mut T,
    length: usize,
    lifetime: PhantomData<&'a mut [T]>,
}

// SAFETY: access goes through `slot` or `pointer`, whose callers promise that no two threads use the same
// slot.
unsafe impl<T: Send> Send for Shared<'_, T> {}
// SAFETY: as above.
unsafe impl<T: Send> Sync for Shared<'_, T> {}

impl<'a, T> Shared<'a, T> {
    pub(crate) fn new(slice: &'a mut [T]) -> Self {
        Self {
            data: slice.as_mut_ptr(),
            length: slice.len(),
            lifetime: PhantomData,
        }
    }

    /// The first element, to be written to by who promises what the caller of `slot` does.
    #[inline(always)]
    pub(crate) fn pointer(&self) -> *mut T {
        self.data
    }

    /// The element of a slot.
    ///
    /// # Safety
    /// `slot` is within the array, and no other thread, nor another reference of this one, uses the
    /// same slot while the reference lives.
    #[inline(always)]
    #[allow(clippy::mut_from_ref)]
    pub(crate) unsafe fn slot(&self, slot: u32) -> &mut T {
        debug_assert!((slot as usize) < self.length);
        // SAFETY: promised by the caller.
        unsafe { &mut *self.data.add(slot as usize) }
    }
}

/// Arrays of fewer bytes stay in a core's own cache anyway.
const KEPT: usize = 1 << 19;

/// Tells the machine that a block will be worked on: what its particles have in a large array is then
/// on its way to the core while the first pairs are. Rows jump about among a block's particles, in a
/// way no machine foresees.
pub(crate) fn fetch<T>(turn: &Turn<'_>, array: *const T, length: usize) {
    if length * size_of::<T>() < KEPT {
        return;
    }
    for part in turn.next.region() {
        ask_for(array.wrapping_add(part.start), part.len());
    }
}

/// Tells the machine that so many elements will be read.
#[inline(always)]
pub(crate) fn ask_for<T>(first: *const T, count: usize) {
    #[cfg(target_arch = "x86_64")]
    {
        let end = first.wrapping_add(count);
        let mut at = first.wrapping_byte_sub(first.addr() % 64);
        while at < end {
            // SAFETY: no more than a hint, of no effect where nothing can be read.
            unsafe {
                use std::arch::x86_64::{_MM_HINT_T1, _mm_prefetch};
                _mm_prefetch::<_MM_HINT_T1>(at.cast());
            }
            at = at.wrapping_byte_add(64);
        }
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = (first, count);
}

/// Calls `work` for the number of every block, colour by colour; in parallel where the pool has
/// threads.
pub(crate) fn for_each_block(grid: &Grid, reverse: bool, work: &(dyn Fn(u32) + Sync)) {
    grid.schedule.run(reverse, work);
}

/// A block whose turn it is.
pub(crate) struct Turn<'a> {
    pub number: u32,
    pub block: &'a BlockList,
    /// The one that is likely to follow.
    next: &'a BlockList,
}

/// The same with arrays that each thread makes once, and not for every block.
pub(crate) fn for_each_block_with<S>(
    grid: &Grid,
    blocks: &[BlockList],
    reverse: bool,
    new: impl Fn() -> S + Sync,
    work: impl Fn(&mut S, Turn<'_>) + Sync,
) {
    grid.schedule.share(reverse, &|each| {
        let mut arrays = new();
        each(&mut |number, next| {
            let turn = Turn {
                number,
                block: &blocks[number as usize],
                next: &blocks[next as usize],
            };
            work(&mut arrays, turn);
        });
    });
}

/// A walk along the rows of a block, chunk by chunk.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Walk {
    row: usize,
    pair: u32,
}

impl Walk {
    /// The end of the next at most `count` pairs.
    #[inline(always)]
    pub(crate) fn stop(&self, rows: &[[u32; 2]], count: usize) -> u32 {
        (self.pair + count as u32).min(rows.last().map_or(0, |row| row[1]))
    }

    /// The next row, or what is left of it, up to that end: its head, and its pairs as a range of the
    /// list.
    #[inline(always)]
    pub(crate) fn next_row(&mut self, rows: &[[u32; 2]], stop: u32) -> Option<(u32, Range<usize>)> {
        if self.pair >= stop {
            return None;
        }
        let [head, end] = rows[self.row];
        let until = end.min(stop);
        let pairs = self.pair as usize..until as usize;
        self.pair = until;
        self.row += usize::from(until == end);
        Some((head, pairs))
    }

    /// Visits the next at most `count` pairs, row by row: `visit(head, first lane, partners)`. Returns
    /// the number of pairs.
    #[inline(always)]
    pub(crate) fn next_pairs(
        &mut self,
        rows: &Rows,
        count: usize,
        mut visit: impl FnMut(u32, usize, &[u32]),
    ) -> usize {
        let begin = self.pair;
        let stop = self.stop(&rows.ends, count);
        while let Some((head, pairs)) = self.next_row(&rows.ends, stop) {
            let lane = pairs.start - begin as usize;
            visit(head, lane, &rows.slots[pairs]);
        }
        (stop - begin) as usize
    }

    /// Fills the lanes of a chunk: `row(lanes in use, head, partners)` puts the pairs of a row into
    /// lanes and returns how many are then in use. Returns that at the end of the chunk.
    #[inline(always)]
    pub(crate) fn fill(
        &mut self,
        rows: &Rows,
        mut row: impl FnMut(usize, u32, &[u32]) -> usize,
    ) -> usize {
        let mut count = 0;
        // Stop before the free lanes become too few to be worth a pass.
        while CHUNK - count >= 16 {
            let free = CHUNK - count;
            let taken = self.next_pairs(rows, free, |head, _, partners| {
                count = row(count, head, partners);
            });
            if taken < free {
                break;
            }
        }
        count
    }

    /// Have all pairs been visited?
    #[inline(always)]
    pub(crate) fn at_end(&self, rows: &[[u32; 2]]) -> bool {
        self.row == rows.len()
    }
}

/// Lanes to compute for `count` pairs: whole vectors, the rest of the last one being leftovers.
#[inline(always)]
pub(crate) fn padded(count: usize) -> usize {
    count.next_multiple_of(8).min(CHUNK)
}
