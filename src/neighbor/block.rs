//! The pairs of one base block. A base block b owns the pairs between its block and the
//! blocks at {0,1}^D from it whose smaller coordinate is b's on every axis: every pair of
//! neighbouring particles belongs to exactly one base block. These 2^D blocks are its *region*;
//! shuffled pairs are stored as two 16-bit places in it, which halves their memory.

use super::grid::coordinates;
use super::{Grid, Rows};
use crate::domain::PeriodicBox;
use crate::random::{GOLDEN, fmix64};
use crate::sweep::{
    LANES, MOST, Mixed, Separation, Task, Vector, Wide, first_lanes, kept_of_range, run_wide,
};

/// Places within a region are 16-bit numbers.
pub const REGION_MAX: usize = 1 << 16;
const BUCKETS: usize = 256;
/// A pair sweep goes through all colours this many times, each time with another share of the pairs.
/// Colour by colour alone is nearly a natural order: it delivers too little viscosity.
pub const ROUNDS: usize = 8;

/// The pairs of one base block.
#[derive(Debug, Default, Clone)]
pub struct BlockList {
    /// All of them.
    pub rows: Rows,
    /// The same pairs in shuffled order, as places in the region; only if asked for.
    pub shuffled: Vec<[u16; 2]>,
    /// Where each round begins in `shuffled`, and where the last one ends.
    pub rounds: [u32; ROUNDS + 1],
    /// Slot of each place of the region, where there are shuffled pairs.
    pub slots: Vec<u32>,
    region: [Part; 8],
    /// Of the cell at hand: its neighbours along each axis.
    spans: [Vec<Neighbours>; 3],
    runs: Vec<Run>,
    counts: Vec<u32>,
}

/// One block of a region: its slots and where they begin among the places.
#[derive(Debug, Default, Clone, Copy)]
struct Part {
    start: u32,
    end: u32,
    place: u32,
}

impl Part {
    fn holds(&self, slot: u32) -> bool {
        (self.start..self.end).contains(&slot)
    }

    /// Place of one of its slots.
    fn place_of(&self, slot: u32) -> u16 {
        (slot - self.start + self.place) as u16
    }
}

/// Cells beside one along an axis.
#[derive(Debug, Clone, Copy)]
struct Neighbours {
    /// What they add to the index of a cell, from one number to another.
    shares: [usize; 2],
    /// The square of the gap between, [h^2], of an only one.
    gap2: f64,
}

/// Slots that may hold partners.
#[derive(Debug, Clone, Copy)]
struct Run {
    start: u32,
    end: u32,
}

/// The block at `corner` (a bit an axis) of the region of the block at `at`, if the axis has one.
fn corner_block(grid: &Grid, at: [usize; 3], corner: usize) -> Option<usize> {
    let mut block = 0;
    for axis in (0..3).rev() {
        let bit = corner >> axis & 1;
        if bit == 1 && grid.blocks[axis] == 1 {
            return None;
        }
        block = block * grid.blocks[axis] + (at[axis] + bit) % grid.blocks[axis];
    }
    Some(block)
}

impl BlockList {
    /// Number of pairs.
    #[inline]
    pub fn pairs(&self) -> usize {
        self.rows.pairs()
    }

    /// Slots of the region, block by block.
    pub fn region(&self) -> impl Iterator<Item = std::ops::Range<usize>> + '_ {
        self.region
            .iter()
            .map(|part| part.start as usize..part.end as usize)
    }

    /// Finds the pairs of base block `base`, and shuffles them where there are ids, unless it overflows.
    pub(super) fn build<const D: usize>(
        &mut self,
        base: usize,
        grid: &Grid,
        cell: &PeriodicBox,
        columns: &[Vec<f32>; 3],
        cutoff2: f32,
        id: Option<&[u64]>,
    ) {
        self.clear();
        self.enter_region::<D>(base, grid, id.is_some());
        if self.overflows() {
            return;
        }
        run_wide(Search::<D> {
            block: &mut *self,
            base,
            grid,
            cell,
            columns,
            cutoff2,
        });
        if let Some(id) = id {
            self.shuffle(id);
        }
    }

    /// Are there more places in the region than 16-bit numbers?
    pub(super) fn overflows(&self) -> bool {
        self.slots.len() > REGION_MAX
    }

    /// Bytes held.
    pub(super) fn bytes(&self) -> usize {
        self.rows.bytes()
            + 8 * self.runs.capacity()
            + size_of::<Neighbours>() * self.spans.iter().map(Vec::capacity).sum::<usize>()
            + 4 * (self.shuffled.capacity() + self.slots.capacity() + self.counts.capacity())
    }

    fn clear(&mut self) {
        self.region = Default::default();
        self.rows.clear();
        self.shuffled.clear();
        self.slots.clear();
    }

    /// Finds the parts of the region, and gives a place to every slot of it if wanted.
    fn enter_region<const D: usize>(&mut self, base: usize, grid: &Grid, places: bool) {
        let at = coordinates(grid.blocks, base);
        for corner in 0..1_usize << D {
            if let Some(block) = corner_block(grid, at, corner) {
                let range = grid.block_slots(block);
                self.region[corner] = Part {
                    start: range.start as u32,
                    end: range.end as u32,
                    place: self.slots.len() as u32,
                };
                if places {
                    self.slots.extend(range.start as u32..range.end as u32);
                }
            }
        }
    }

    /// Finds the rows of base block `base`.
    #[inline(always)]
    fn search<W: Wide, const D: usize>(
        &mut self,
        base: usize,
        grid: &Grid,
        cell: &PeriodicBox,
        columns: &[Vec<f32>; 3],
        cutoff2: f32,
    ) {
        let at = coordinates(grid.blocks, base);
        let inside = grid.cells_per_block;
        for corner in 0..1_usize << D {
            let Some(block) = corner_block(grid, at, corner) else {
                continue;
            };
            let head_block = coordinates(grid.blocks, block);
            let mut before = None;
            for local in 0..grid.cells_in_block() {
                let index = block * grid.cells_in_block() + local;
                let (first, last) = (grid.cell_start[index], grid.cell_start[index + 1]);
                if first == last {
                    continue;
                }
                let here = [
                    head_block[0] * inside[0] + local % inside[0],
                    head_block[1] * inside[1] + local / inside[0] % inside[1],
                    head_block[2] * inside[2] + local / (inside[0] * inside[1]),
                ];
                self.collect_runs(grid, at, corner, (here, before), first);
                before = Some(here);
                for head in first..last {
                    self.scan_row::<W, D>(head, cell, columns, cutoff2);
                }
            }
        }
        // What follows the last pair must lead to slots as well.
        self.rows.slots.truncate(self.pairs());
        self.rows.slots.resize(self.pairs() + MOST, 0);
        self.rows.mark_starts();
    }

    /// Slot ranges that may hold partners of the heads in cell `here`, which lies in the block at
    /// `corner` of the region of the base block `at`; the cell `before` had its turn last.
    fn collect_runs(
        &mut self,
        grid: &Grid,
        at: [usize; 3],
        corner: usize,
        (here, before): ([usize; 3], Option<[usize; 3]>),
        first: u32,
    ) {
        self.runs.clear();
        for (axis, spans) in self.spans.iter_mut().enumerate() {
            if before.is_some_and(|before| before[axis] == here[axis]) {
                continue;
            }
            spans.clear();
            for cell in Span::new(grid, axis, here[axis]).cells() {
                // A partner's block and the head's must not both lie on the far side of any axis.
                if side(grid, at, axis, cell).is_none_or(|bit| corner >> axis & bit == 1) {
                    continue;
                }
                let share = grid.share(axis, cell);
                match spans.last_mut() {
                    Some(last) if axis == 0 && last.shares[1] == share => last.shares[1] += 1,
                    _ => spans.push(Neighbours {
                        shares: [share, share + 1],
                        gap2: grid.gap(axis, here[axis], cell).powi(2),
                    }),
                }
            }
        }
        let [xs, ys, zs] = &self.spans;
        for z in zs {
            for y in ys {
                // Diagonal neighbours are farther away than those along either axis.
                if y.gap2 + z.gap2 > grid.width * grid.width {
                    continue;
                }
                let column = y.shares[0] + z.shares[0];
                for x in xs {
                    let start = grid.cell_start[column + x.shares[0]];
                    let end = grid.cell_start[column + x.shares[1]];
                    if end <= first || start == end {
                        continue;
                    }
                    match self.runs.last_mut() {
                        Some(run) if run.end == start => run.end = end,
                        _ => self.runs.push(Run { start, end }),
                    }
                }
            }
        }
    }

    /// Appends the partners of one head: all slots after its own in the runs and within the cutoff.
    #[inline(always)]
    fn scan_row<W: Wide, const D: usize>(
        &mut self,
        head: u32,
        cell: &PeriodicBox,
        columns: &[Vec<f32>; 3],
        cutoff2: f32,
    ) {
        let begin = self.pairs();
        let mut length = begin;
        let head_at = Separation::<Mixed, W>::new(
            &[
                columns[0][head as usize],
                columns[1][head as usize],
                columns[2][head as usize],
                0.0,
            ],
            cell,
        );
        let near = W::Single::splat(cutoff2);
        for run in &self.runs {
            let start = run.start.max(head + 1);
            if start >= run.end {
                continue;
            }
            // Room for all candidates, then keep what is near: no branch per candidate.
            let room = length + (run.end - start) as usize + MOST;
            if self.rows.slots.len() < room {
                if self.rows.slots.capacity() < room {
                    // Doubling would waste what the particles themselves take.
                    self.rows.slots.reserve_exact(room / 16 + 256);
                }
                self.rows.slots.resize(room, 0);
            }
            for slot in (start..run.end).step_by(MOST) {
                let there = first_lanes::<W::Single>((run.end - slot) as usize);
                // SAFETY: columns hold a vector behind each particle, slots have room for one.
                unsafe {
                    let other = [
                        W::Single::load(columns[0].as_ptr().add(slot as usize)),
                        W::Single::load(columns[1].as_ptr().add(slot as usize)),
                        W::Single::load(columns[2].as_ptr().add(slot as usize)),
                        near,
                    ];
                    let keep = head_at.from::<D>(&other).1.below(near) & there;
                    let to = self.rows.slots.as_mut_ptr().add(length);
                    let (low, high) = (keep as u8, (keep >> LANES) as u8);
                    let kept = kept_of_range(slot, low);
                    to.cast::<[u32; LANES]>().write_unaligned(kept);
                    let to = to.add(low.count_ones() as usize);
                    let kept = kept_of_range(slot + LANES as u32, high);
                    to.cast::<[u32; LANES]>().write_unaligned(kept);
                    length += keep.count_ones() as usize;
                }
            }
        }
        if length > begin {
            self.rows.ends.push([head, length as u32]);
        }
    }

    /// The part of the region that holds one of its slots.
    fn part(&self, slot: u32) -> Part {
        let part = self.region.iter().find(|part| part.holds(slot));
        part.copied().unwrap_or_default()
    }

    /// Brings the pairs into an order that depends on ids only, block by block: counting sort by a
    /// hash of the two ids. A pair update passes momentum along at once, so in a natural order it
    /// runs ahead along the rows and the fluid comes out too thin at large steps; shuffled, less so.
    /// The hash also deals the pairs out to the rounds of a sweep.
    fn shuffle(&mut self, id: &[u64]) {
        let hash = |slot: u32| fmix64(id[slot as usize].wrapping_add(GOLDEN));
        let bucket = |a: u64, b: u64| {
            ((a ^ b).wrapping_mul(GOLDEN) >> (64 - BUCKETS.trailing_zeros())) as usize
        };
        self.counts.clear();
        self.counts.resize(BUCKETS + 1, 0);
        for (head, others) in self.rows.iter() {
            let own = hash(head);
            for &other in others {
                self.counts[bucket(own, hash(other)) + 1] += 1;
            }
        }
        for k in 1..=BUCKETS {
            self.counts[k] += self.counts[k - 1];
        }
        for (round, start) in self.rounds.iter_mut().enumerate() {
            *start = self.counts[round * BUCKETS / ROUNDS];
        }
        if self.shuffled.capacity() < self.pairs() {
            self.shuffled.reserve_exact(self.pairs() * 17 / 16);
        }
        self.shuffled.resize(self.pairs(), [0; 2]);
        let (mut begin, mut part) = (0, Part::default());
        for row in 0..self.rows.ends.len() {
            let [head, end] = self.rows.ends[row];
            let (own, head_place) = (hash(head), self.part(head).place_of(head));
            for &other in &self.rows.slots[begin..end as usize] {
                if !part.holds(other) {
                    part = self.part(other);
                }
                let next = &mut self.counts[bucket(own, hash(other))];
                self.shuffled[*next as usize] = [head_place, part.place_of(other)];
                *next += 1;
            }
            begin = end as usize;
        }
    }
}

/// The search for the pairs of one base block.
struct Search<'a, const D: usize> {
    block: &'a mut BlockList,
    base: usize,
    grid: &'a Grid,
    cell: &'a PeriodicBox,
    columns: &'a [Vec<f32>; 3],
    cutoff2: f32,
}

impl<const D: usize> Task for Search<'_, D> {
    type Output = ();

    #[inline(always)]
    fn run<W: Wide>(self) {
        let (grid, cell) = (self.grid, self.cell);
        self.block
            .search::<W, D>(self.base, grid, cell, self.columns, self.cutoff2);
    }
}

/// The cells along one axis that may hold neighbours of a cell, each once.
struct Span {
    first: usize,
    count: usize,
    cells: usize,
}

impl Span {
    fn new(grid: &Grid, axis: usize, here: usize) -> Self {
        let cells = grid.blocks[axis] * grid.cells_per_block[axis];
        let reach = grid.reach[axis];
        if 2 * reach + 1 >= cells {
            return Self {
                first: 0,
                count: cells,
                cells,
            };
        }
        Self {
            first: (here + cells - reach) % cells,
            count: 2 * reach + 1,
            cells,
        }
    }

    fn cells(&self) -> impl Iterator<Item = usize> + '_ {
        (0..self.count).map(|k| {
            let x = self.first + k;
            if x >= self.cells { x - self.cells } else { x }
        })
    }
}

/// 0 or 1: on which side of the region of base block `at` the cell lies; `None` outside of it.
fn side(grid: &Grid, at: [usize; 3], axis: usize, cell: usize) -> Option<usize> {
    let block = cell / grid.cells_per_block[axis];
    if block == at[axis] {
        Some(0)
    } else if block == (at[axis] + 1) % grid.blocks[axis] {
        Some(1)
    } else {
        None
    }
}
