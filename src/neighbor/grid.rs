//! Blocks and cells. A *block* is at least a support plus the margin wide, so the pairs of the
//! 2^D blocks {b, b + 1} around a base block b touch no other block: base blocks of one colour can
//! be swept at once, by any number of threads, in a fixed order each. *Cells* subdivide blocks and
//! serve the search. The order of slots is (block, cell, row): a function of positions only.
//!
//! Grid and lists are renewed when a particle has moved half the `margin` since they were built. Which of their
//! pairs sweeps work on has a skin of its own (at most the margin), so the order of pairs does not depend on it.

use super::schedule::Schedule;
use crate::domain::PeriodicBox;
use crate::state::Particles;

/// Particles expected in the 2^D blocks of one base block, which should stay in a core's cache: most, and as many as
/// blocks are cut for along the first axis.
const REGION_MOST: f64 = 2.0 * REGION_TARGET;
const REGION_TARGET: f64 = 8192.0;
/// Wide blocks are so many supports and margins wide: fewer rows of pairs end at a border.
const WIDE: f64 = 1.9;
/// And so many blocks are left along an axis, for threads to share.
const FEWEST: usize = 8;

/// The block and cell grid of a box, and where its particles were when it was last renewed.
#[derive(Debug)]
pub struct Grid {
    /// Blocks per axis: 1, 3 or more.
    pub blocks: [usize; 3],
    /// Cells per axis in one block.
    pub cells_per_block: [usize; 3],
    /// How many cells away a neighbour can be, per axis.
    pub reach: [usize; 3],
    /// The order of base blocks.
    pub schedule: Schedule,
    /// First slot of each cell, and the number of particles at the end.
    pub cell_start: Vec<u32>,
    /// Positions at the last renewal, in slot order.
    pub reference: Vec<[f64; 3]>,
    /// Support and margin [h]: no particle has a partner in a cell that is farther away from its own.
    pub(super) width: f64,
    /// What each coordinate of a cell adds to its index.
    shares: [Vec<usize>; 3],
    inverse_cell: [f64; 3],
    cell_of_row: Vec<u32>,
    slot_of_row: Vec<u32>,
    order: Vec<u32>,
}

/// Coordinates of a block, of so many along each axis.
pub(super) fn coordinates([nx, ny, _]: [usize; 3], block: usize) -> [usize; 3] {
    [block % nx, block / nx % ny, block / (nx * ny)]
}

fn blocks_along(edge: f64, width: f64) -> usize {
    let most = (edge / width) as usize;
    match most {
        0..=2 => 1,
        3 => 3,
        // An odd number would need a third colour.
        _ => most - most % 2,
    }
}

fn colours_along(blocks: usize) -> usize {
    match blocks {
        1 => 1,
        _ => 2 + blocks % 2,
    }
}

fn colour_along(index: usize, blocks: usize) -> usize {
    if blocks > 1 && blocks % 2 == 1 && index == blocks - 1 {
        2
    } else {
        index % 2
    }
}

impl Grid {
    /// The grid of a box for `n` particles and interactions up to `width` = support + margin [h].
    pub fn new(cell: &PeriodicBox, dimension: usize, n: usize, width: f64) -> Self {
        Self::with_blocks(cell, dimension, n, width, 1.0)
    }

    /// The same with wide blocks in space: quicker to sweep, but the pairs of a block are in another order.
    pub fn with_wide_blocks(cell: &PeriodicBox, dimension: usize, n: usize, width: f64) -> Self {
        let wide = if dimension == 3 { WIDE } else { 1.0 };
        Self::with_blocks(cell, dimension, n, width, wide)
    }

    fn with_blocks(cell: &PeriodicBox, dimension: usize, n: usize, width: f64, wide: f64) -> Self {
        let blocks_of = |wide: f64| {
            let mut blocks = [1; 3];
            for axis in 1..dimension {
                let edge = cell.edges[axis];
                let most = blocks_along(edge, width);
                blocks[axis] = blocks_along(edge, wide * width).max(most.min(FEWEST));
            }
            blocks
        };
        let region_of = |blocks: [usize; 3]| {
            let shares = (1..dimension).map(|axis| (2.0 / blocks[axis] as f64).min(1.0));
            n as f64 * shares.product::<f64>()
        };
        let (mut blocks, mut wide) = (blocks_of(wide), wide);
        while wide > 1.0 && region_of(blocks) > REGION_MOST {
            wide = (0.95 * wide).max(1.0);
            blocks = blocks_of(wide);
        }
        // Long blocks along x make long rows; cut them only where a region outgrows the cache.
        let region = region_of(blocks);
        let at_once: usize = (1..dimension)
            .map(|axis| (blocks[axis] / colours_along(blocks[axis])).max(1))
            .product();
        let mut wanted = 1;
        if region > REGION_MOST {
            wanted = (2.0 * region / REGION_TARGET).ceil() as usize;
        }
        if at_once < 4 {
            // A narrow channel along x: cut it, or one thread would do all the work.
            wanted = wanted.max(16);
        }
        let most = blocks_along(cell.edges[0], width);
        if wanted > 1 && most >= 4 {
            blocks[0] = most.min(wanted + wanted % 2);
        }
        let (mut cells_per_block, mut reach, mut inverse_cell) = ([1; 3], [0; 3], [1.0; 3]);
        for axis in 0..dimension {
            let block_edge = cell.edges[axis] / blocks[axis] as f64;
            cells_per_block[axis] = ((2.0 * block_edge / width) as usize).max(1);
            let cell_edge = block_edge / cells_per_block[axis] as f64;
            reach[axis] = (width / cell_edge).ceil() as usize;
            inverse_cell[axis] = 1.0 / cell_edge;
        }
        let schedule = Schedule::new(blocks, rayon::current_num_threads(), |at| {
            let [x, y, z] = [0, 1, 2].map(|axis| colour_along(at[axis], blocks[axis]));
            x + colours_along(blocks[0]) * (y + colours_along(blocks[1]) * z)
        });
        let n_cells: usize = (0..3).map(|a| blocks[a] * cells_per_block[a]).product();
        // Cells of a block are consecutive; in it, and among blocks, the first axis goes fastest.
        let (mut inside, mut outside): (usize, usize) = (1, cells_per_block.iter().product());
        let shares = [0, 1, 2].map(|axis| {
            let per_block = cells_per_block[axis];
            let shares = (0..blocks[axis] * per_block)
                .map(|at| at / per_block * outside + at % per_block * inside)
                .collect();
            inside *= per_block;
            outside *= blocks[axis];
            shares
        });
        Self {
            blocks,
            cells_per_block,
            reach,
            schedule,
            cell_start: vec![0; n_cells + 1],
            reference: vec![[0.0; 3]; n],
            width,
            shares,
            inverse_cell,
            cell_of_row: vec![0; n],
            slot_of_row: vec![0; n],
            order: vec![0; n],
        }
    }

    /// Total number of blocks.
    pub fn block_count(&self) -> usize {
        self.blocks.iter().product()
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        4 * (self.cell_start.capacity() + self.cell_of_row.capacity())
            + 4 * (self.slot_of_row.capacity() + self.order.capacity())
            + 24 * self.reference.capacity()
            + 8 * self.shares.iter().map(Vec::capacity).sum::<usize>()
            + self.schedule.bytes()
    }

    /// Cells per block, all axes together.
    pub fn cells_in_block(&self) -> usize {
        self.cells_per_block.iter().product()
    }

    /// Index of the cell with the given coordinates in the whole box; cells of a block are
    /// consecutive, and in it the first axis goes fastest.
    #[inline]
    pub fn cell_index(&self, at: [usize; 3]) -> usize {
        self.share(0, at[0]) + self.share(1, at[1]) + self.share(2, at[2])
    }

    /// What the coordinate along an axis adds to the index of a cell.
    #[inline]
    pub fn share(&self, axis: usize, at: usize) -> usize {
        self.shares[axis][at]
    }

    /// What is between two cells along an axis, the shorter way [h].
    pub(super) fn gap(&self, axis: usize, first: usize, second: usize) -> f64 {
        let cells = self.blocks[axis] * self.cells_per_block[axis];
        let apart = first.abs_diff(second);
        let between = apart.min(cells - apart).saturating_sub(1);
        between as f64 / self.inverse_cell[axis]
    }

    /// Slots of a block.
    pub fn block_slots(&self, block: usize) -> std::ops::Range<usize> {
        let per_block = self.cells_in_block();
        self.cell_start[block * per_block] as usize
            ..self.cell_start[(block + 1) * per_block] as usize
    }

    fn cell_at(&self, position: &[f64; 4]) -> usize {
        let mut at = [0; 3];
        for axis in 0..3 {
            let cells = self.blocks[axis] * self.cells_per_block[axis];
            at[axis] = ((position[axis] * self.inverse_cell[axis]) as usize).min(cells - 1);
        }
        self.cell_index(at)
    }

    /// Wraps the particles into the box, sorts them by (block, cell, row), and takes their
    /// positions as the new reference.
    pub fn renew(&mut self, cell: &PeriodicBox, dimension: usize, particles: &mut Particles) {
        let n = particles.len();
        self.cell_start.fill(0);
        for slot in 0..n {
            for axis in 0..dimension {
                let (x, turns) = cell.wrap(axis, particles.position[slot][axis]);
                particles.position[slot][axis] = x;
                particles.image[slot][axis] += turns;
            }
            let index = self.cell_at(&particles.position[slot]);
            let row = particles.row[slot] as usize;
            self.cell_of_row[row] = index as u32;
            self.slot_of_row[row] = slot as u32;
            self.cell_start[index + 1] += 1;
        }
        for index in 1..self.cell_start.len() {
            self.cell_start[index] += self.cell_start[index - 1];
        }
        // Rows in ascending order: within a cell the order is that of rows whatever it was before.
        for row in 0..n {
            let next = &mut self.cell_start[self.cell_of_row[row] as usize];
            self.order[*next as usize] = self.slot_of_row[row];
            *next += 1;
        }
        self.cell_start.rotate_right(1);
        self.cell_start[0] = 0;
        particles.permute(&self.order);
        for (reference, position) in self.reference.iter_mut().zip(&particles.position) {
            *reference = [position[0], position[1], position[2]];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn regions_of_wide_blocks_stay_in_a_cache() {
        let cell = PeriodicBox::new(&[30.0, 30.0, 30.0], 1.0).unwrap();
        for (n, blocks) in [
            (10_000, 14),
            (500_000, 14),
            (1_000_000, 16),
            (4_000_000, 28),
        ] {
            let grid = Grid::with_wide_blocks(&cell, 3, n, 1.1 * 30.0 / 31.5);
            assert_eq!(grid.blocks, [grid.blocks[0], blocks, blocks]);
            let region = n as f64 * (2.0 / blocks as f64).powi(2);
            assert!(
                region < 1.35 * REGION_MOST && (grid.blocks[0] == 1) == (region <= REGION_MOST)
            );
            // Where they need not be narrower they are as wide as ever.
            let narrow = Grid::new(&cell, 3, n, 1.1 * 30.0 / 31.5);
            assert!(narrow.blocks[1] >= grid.blocks[1]);
        }
    }
}
