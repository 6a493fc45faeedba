//! Half lists of pairs, one per base block (`block.rs`).

use rayon::prelude::*;

use super::block::{BlockList, REGION_MAX};
use super::{Clusters, Grid, Rows};
use crate::domain::PeriodicBox;
use crate::error::Error;
use crate::state::Particles;

/// Up to this skin [h] all pairs are worked on, those in the skin included, unless somebody knows better.
pub const THIN: f64 = 0.035;

/// All pairs closer than the support plus the skin.
#[derive(Debug, Default, Clone)]
pub struct PairList {
    /// By block index.
    pub blocks: Vec<BlockList>,
    /// Positions when the list was built, if that was after the grid was renewed.
    pub reference: Vec<[f64; 3]>,
    /// Is the skin so thin that to find the pairs within the support takes longer than to work on all?
    pub is_thin: bool,
    /// Those of them that are within the support, as the last sweep for densities found them, unless
    /// the skin is thin.
    pub near: Vec<Rows>,
    /// Are the pairs in `near` those of the present positions?
    pub near_is_known: bool,
    /// The same pairs four by four with four, where somebody wants them.
    pub clusters: Clusters,
    /// Some region was too large for 16-bit numbers; the list is then of no use.
    pub overflow: bool,
}

impl PairList {
    /// Builds the lists from the particles' present positions; skins up to `thin` [h] are thin.
    pub fn build<const D: usize>(
        &mut self,
        grid: &Grid,
        cell: &PeriodicBox,
        particles: &mut Particles,
        (cutoff, thin): (f64, f64),
        shuffle: bool,
    ) {
        self.near_is_known = false;
        self.clusters.known = false;
        self.is_thin = cutoff <= 1.0 + thin;
        let octets = !self.is_thin;
        // Single precision is good enough to say who may come near; a little more than the cutoff
        // makes up for its rounding, and that of positions as fractions of the box.
        let longest = cell.edges.iter().copied().fold(0.0, f64::max);
        let far = cutoff * (1.0 + 5e-6) + 8.0 * longest / 4_294_967_296.0;
        let cutoff2 = (far * far) as f32;
        let columns = particles.copies.columns(&particles.position, cell);
        let id = shuffle.then_some(&particles.id[..]);
        self.blocks
            .resize_with(grid.block_count(), BlockList::default);
        self.blocks
            .par_iter_mut()
            .enumerate()
            .for_each(|(base, block)| {
                block.build::<D>(base, grid, cell, columns, cutoff2, (octets, id))
            });
        self.near.resize_with(self.blocks.len(), Rows::default);
        for (near, block) in self.near.iter_mut().zip(&self.blocks) {
            if octets {
                near.fit(block.rows.ends.len(), block.rows.slots.len());
            } else {
                near.clear();
            }
        }
        self.overflow = self.blocks.iter().any(BlockList::overflows);
    }

    /// The pairs of a block that sweeps work on: those within the support, and where the skin is thin
    /// those in the skin, which come to nothing.
    pub fn present(&self, block: u32) -> &Rows {
        if self.is_thin {
            &self.blocks[block as usize].rows
        } else {
            &self.near[block as usize]
        }
    }

    /// Finds the clusters, unless they are known.
    pub(crate) fn know_clusters(&mut self, grid: &Grid, position: &[[f64; 4]]) {
        if !self.clusters.known {
            self.clusters.build(grid, &self.blocks, position);
        }
    }

    /// What to tell the user about an overflow.
    pub fn overflow_error(&self) -> Error {
        Error::Invalid(format!(
            "`support` must leave at most {REGION_MAX} particles within reach of one block of the box; a smaller ratio of support to spacing is needed"
        ))
    }

    /// Number of pairs within the cutoff, skin included.
    pub fn len(&self) -> usize {
        self.blocks.iter().map(BlockList::pairs).sum()
    }

    /// True where no two particles are near each other.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Bytes held by the lists.
    pub fn bytes(&self) -> usize {
        self.blocks.iter().map(BlockList::bytes).sum::<usize>()
            + self.near.iter().map(Rows::bytes).sum::<usize>()
            + self.clusters.bytes()
            + 24 * self.reference.capacity()
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;
    use crate::random::fmix64;
    use crate::sweep::MOST;

    /// All pairs within the cutoff once, none far beyond it, and slots behind every last pair.
    fn check<const D: usize>(edges: &[f64], n: usize, cutoff: f64) {
        let cell = PeriodicBox::new(edges, 1.0).unwrap();
        let mut particles = Particles::new(n, false);
        for (k, x) in particles.position.iter_mut().enumerate() {
            for a in 0..D {
                let word = fmix64((k * 3 + a + 1) as u64) >> 11;
                x[a] = cell.edges[a] * word as f64 / (1_u64 << 53) as f64;
            }
        }
        let mut grid = Grid::new(&cell, D, n, cutoff);
        grid.renew(&cell, D, &mut particles);
        let mut list = PairList::default();
        list.build::<D>(&grid, &cell, &mut particles, (cutoff, THIN), true);
        let mut found = BTreeSet::new();
        for block in &list.blocks {
            for (head, others) in block.rows.iter() {
                for &other in others {
                    assert!(found.insert([head.min(other), head.max(other)]));
                }
            }
            assert_eq!(block.rows.slots.len(), block.pairs() + MOST);
            assert!(block.rows.slots.iter().all(|&slot| (slot as usize) < n));
            let mut pairs = BTreeSet::new();
            for pair in &block.shuffled {
                let [i, j] = pair.map(|place| block.slots[place as usize]);
                assert!(found.contains(&[i.min(j), i.max(j)]) && pairs.insert([i, j]));
            }
            assert_eq!(pairs.len(), block.pairs());
        }
        assert_eq!(found.len(), list.len());
        for i in 0..n {
            for j in i + 1..n {
                let (x, y) = (particles.position[i], particles.position[j]);
                let r = cell.nearest::<D>([x[0] - y[0], x[1] - y[1], x[2] - y[2]]);
                let distance = r[..D].iter().map(|x| x * x).sum::<f64>().sqrt();
                let listed = found.contains(&[i as u32, j as u32]);
                assert!(listed || distance > cutoff);
                assert!(!listed || distance < cutoff * (1.0 + 1e-5));
            }
        }
    }

    #[test]
    fn a_long_box_misses_none_at_the_cutoff() {
        let cell = PeriodicBox::new(&[1e5, 3.0], 1.0).unwrap();
        let n = 400;
        let mut particles = Particles::new(n, false);
        for (k, x) in particles.position.iter_mut().enumerate() {
            // Partners just within the cutoff, all along the box.
            let first = (k / 2) as f64 * 499.123_456_789;
            x[0] = first + (k % 2) as f64 * 1.2 * (1.0 - 1e-9);
        }
        let mut grid = Grid::new(&cell, 2, n, 1.2);
        grid.renew(&cell, 2, &mut particles);
        let mut list = PairList::default();
        list.build::<2>(&grid, &cell, &mut particles, (1.2, THIN), false);
        assert_eq!(list.len(), n / 2);
    }

    #[test]
    fn lists_hold_all_pairs_once() {
        for cutoff in [1.0, 1.03, 1.25] {
            check::<3>(&[2.0, 2.4, 3.5], 150, cutoff);
            check::<3>(&[5.0, 5.5, 6.1], 900, cutoff);
            check::<2>(&[2.0, 9.7], 173, cutoff);
            check::<2>(&[40.0, 6.0], 1200, cutoff);
        }
    }
}
