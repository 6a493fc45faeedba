//! Half lists of pairs, one per base block. A base block b owns the pairs between its block and the
//! blocks at {0,1}^D from it whose smaller coordinate is b's on every axis: every pair of
//! neighbouring particles belongs to exactly one base block.

use rayon::prelude::*;

use super::Grid;
use crate::domain::PeriodicBox;
use crate::random::fmix64;
use crate::state::Particles;

/// Slots within a region are 16-bit numbers.
pub const REGION_MAX: usize = 1 << 16;
const BUCKETS: usize = 1024;
/// A pair sweep goes through all colours this many times, each time with another share of the pairs.
/// Colour by colour alone is nearly a natural order: it delivers too little viscosity.
pub const ROUNDS: usize = 8;

/// The pairs of one base block.
#[derive(Debug, Default, Clone)]
pub struct BlockList {
    /// (slot of the row's head, end of the row in `neighbours`).
    pub rows: Vec<[u32; 2]>,
    /// Slots of the partners, row after row.
    pub neighbours: Vec<u32>,
    /// The same pairs in shuffled order, as positions in `region`; only if asked for.
    pub shuffled: Vec<[u16; 2]>,
    /// Where each round begins in `shuffled`, and where the last one ends.
    pub rounds: [u32; ROUNDS + 1],
    /// Slots of the blocks around the base block, in the order of `shuffled`'s numbers.
    pub region_slots: Vec<u32>,
    region: Vec<[u32; 2]>,
    runs: Vec<[u32; 2]>,
    counts: Vec<u32>,
}

/// All pairs closer than the support plus the skin.
#[derive(Debug, Default, Clone)]
pub struct PairList {
    /// By block index.
    pub blocks: Vec<BlockList>,
    /// Positions when the list was built, if that was after the grid was renewed.
    pub reference: Vec<[f64; 3]>,
    /// Largest region seen was too large for 16-bit numbers.
    pub overflow: bool,
}

impl PairList {
    /// Builds the lists from the particles' present positions.
    pub fn build<const D: usize>(
        &mut self,
        grid: &Grid,
        cell: &PeriodicBox,
        particles: &Particles,
        cutoff: f64,
        shuffle: bool,
    ) {
        self.blocks
            .resize_with(grid.block_count(), BlockList::default);
        self.blocks
            .par_iter_mut()
            .enumerate()
            .for_each(|(base, block)| {
                block.search::<D>(base, grid, cell, particles, cutoff * cutoff);
                block.shuffled.clear();
                if shuffle {
                    block.shuffle(particles);
                }
            });
        self.overflow = shuffle && self.blocks.iter().any(|b| b.region_size() > REGION_MAX);
    }

    /// Number of pairs within the cutoff, skin included.
    pub fn len(&self) -> usize {
        self.blocks.iter().map(|block| block.neighbours.len()).sum()
    }

    /// True where no two particles are near each other.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Bytes held by the lists.
    pub fn bytes(&self) -> usize {
        let block_bytes = |b: &BlockList| {
            8 * (b.rows.capacity() + b.region.capacity() + b.runs.capacity())
                + 4 * (b.neighbours.capacity() + b.shuffled.capacity())
                + 4 * (b.region_slots.capacity() + b.counts.capacity())
        };
        self.blocks.iter().map(block_bytes).sum::<usize>() + 24 * self.reference.capacity()
    }
}

impl BlockList {
    fn region_size(&self) -> usize {
        self.region.iter().map(|r| (r[1] - r[0]) as usize).sum()
    }

    /// Finds the rows of base block `base`.
    fn search<const D: usize>(
        &mut self,
        base: usize,
        grid: &Grid,
        cell: &PeriodicBox,
        particles: &Particles,
        cutoff2: f64,
    ) {
        self.rows.clear();
        self.neighbours.clear();
        self.region.clear();
        let [bx, by, _] = grid.blocks;
        let at = [base % bx, base / bx % by, base / (bx * by)];
        for corner in 0..1_usize << D {
            let mut head_block = at;
            if (0..3).any(|a| corner >> a & 1 == 1 && grid.blocks[a] == 1) {
                continue;
            }
            for a in 0..D {
                head_block[a] = (at[a] + (corner >> a & 1)) % grid.blocks[a];
            }
            let index = head_block[0] + bx * (head_block[1] + by * head_block[2]);
            let slots = grid.block_slots(index);
            self.region.push([slots.start as u32, slots.end as u32]);
            let inside = grid.cells_per_block;
            for local in 0..grid.cells_in_block() {
                let here = [
                    head_block[0] * inside[0] + local % inside[0],
                    head_block[1] * inside[1] + local / inside[0] % inside[1],
                    head_block[2] * inside[2] + local / (inside[0] * inside[1]),
                ];
                let heads = index * grid.cells_in_block() + local;
                let (first, last) = (grid.cell_start[heads], grid.cell_start[heads + 1]);
                if first < last {
                    self.collect_runs(grid, at, corner, here, first);
                    for head in first..last {
                        self.scan_row::<D>(head, cell, particles, cutoff2);
                    }
                }
            }
        }
    }

    /// Slot ranges that may hold partners of the heads in cell `here`, which lies in the block at
    /// `corner` of the region of the base block `at`.
    fn collect_runs(
        &mut self,
        grid: &Grid,
        at: [usize; 3],
        corner: usize,
        here: [usize; 3],
        first: u32,
    ) {
        self.runs.clear();
        let [xs, ys, zs] = [0, 1, 2].map(|axis| Span::new(grid, axis, here[axis]));
        for z in zs.cells() {
            let Some(bit_z) = side(grid, at, 2, z) else {
                continue;
            };
            if corner >> 2 & bit_z == 1 {
                continue;
            }
            for y in ys.cells() {
                let Some(bit_y) = side(grid, at, 1, y) else {
                    continue;
                };
                if corner >> 1 & bit_y == 1 {
                    continue;
                }
                for x in xs.cells() {
                    let Some(bit_x) = side(grid, at, 0, x) else {
                        continue;
                    };
                    if corner & bit_x == 1 {
                        continue;
                    }
                    let index = grid.cell_index([x, y, z]);
                    let (start, end) = (grid.cell_start[index], grid.cell_start[index + 1]);
                    if end <= first || start == end {
                        continue;
                    }
                    match self.runs.last_mut() {
                        Some(run) if run[1] == start => run[1] = end,
                        _ => self.runs.push([start, end]),
                    }
                }
            }
        }
    }

    /// Appends the partners of one head: all slots after its own in the runs and within the cutoff.
    fn scan_row<const D: usize>(
        &mut self,
        head: u32,
        cell: &PeriodicBox,
        particles: &Particles,
        cutoff2: f64,
    ) {
        let position = &particles.position;
        let [x, y, z, _] = position[head as usize];
        let begin = self.neighbours.len();
        let mut length = begin;
        for run in &self.runs {
            let start = run[0].max(head + 1);
            if start >= run[1] {
                continue;
            }
            // Room for all candidates, then keep what is near: no branch per candidate.
            let room = length + (run[1] - start) as usize;
            if self.neighbours.len() < room {
                if self.neighbours.capacity() < room {
                    // Doubling would waste what the particles themselves take.
                    self.neighbours.reserve_exact(room / 16 + 256);
                }
                self.neighbours.resize(room, 0);
            }
            for slot in start..run[1] {
                let other = &position[slot as usize];
                let r = cell.nearest::<D>([x - other[0], y - other[1], z - other[2]]);
                let mut r2 = r[0] * r[0] + r[1] * r[1];
                if D == 3 {
                    r2 += r[2] * r[2];
                }
                self.neighbours[length] = slot;
                length += usize::from(r2 < cutoff2);
            }
        }
        self.neighbours.truncate(length);
        if length > begin {
            self.rows.push([head, length as u32]);
        }
    }

    /// Brings the pairs into an order that depends on ids only, block by block: counting sort by a
    /// hash of the two ids. A pair update passes momentum along at once, so in a natural order it
    /// runs ahead along the rows and the fluid comes out too thin at large steps; shuffled, less so.
    /// The hash also deals the pairs out to the rounds of a sweep.
    fn shuffle(&mut self, particles: &Particles) {
        if self.region_size() > REGION_MAX {
            return;
        }
        self.region_slots.clear();
        for range in &self.region {
            self.region_slots.extend(range[0]..range[1]);
        }
        self.counts.clear();
        self.counts.resize(BUCKETS + 1, 0);
        if self.shuffled.capacity() < self.neighbours.len() {
            self.shuffled.reserve_exact(self.neighbours.len() * 17 / 16);
        }
        self.shuffled.resize(self.neighbours.len(), [0; 2]);
        let bucket = |i: u32, j: u32| {
            let (a, b) = (particles.id[i as usize], particles.id[j as usize]);
            let (low, high) = if a < b { (a, b) } else { (b, a) };
            (fmix64(low.wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ fmix64(high)) >> 54) as usize
        };
        let mut begin = 0;
        for &[head, end] in &self.rows {
            for &other in &self.neighbours[begin..end as usize] {
                self.counts[bucket(head, other) + 1] += 1;
            }
            begin = end as usize;
        }
        for k in 1..=BUCKETS {
            self.counts[k] += self.counts[k - 1];
        }
        for (round, start) in self.rounds.iter_mut().enumerate() {
            *start = self.counts[round * BUCKETS / ROUNDS];
        }
        let region = &self.region;
        let place = |slot: u32| {
            let mut offset = 0;
            for range in region {
                if slot >= range[0] && slot < range[1] {
                    return (offset + slot - range[0]) as u16;
                }
                offset += range[1] - range[0];
            }
            0
        };
        let mut begin = 0;
        for &[head, end] in &self.rows {
            let head_place = place(head);
            for &other in &self.neighbours[begin..end as usize] {
                let next = &mut self.counts[bucket(head, other)];
                self.shuffled[*next as usize] = [head_place, place(other)];
                *next += 1;
            }
            begin = end as usize;
        }
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
