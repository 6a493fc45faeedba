//! Half lists of pairs, one per base block (`block.rs`).

use rayon::prelude::*;

use super::block::{BlockList, REGION_MAX};
use super::{Clusters, Grid, Rows};
use crate::domain::PeriodicBox;
use crate::error::Error;
use crate::state::Particles;
use crate::sweep::{Mixed, Precision, Prune, run_wide};

/// All pairs closer than the support plus the margin, and those of them that sweeps work on.
#[derive(Debug, Default, Clone)]
pub struct PairList {
    /// By block index.
    pub blocks: Vec<BlockList>,
    /// Support and margin [h].
    pub cutoff: f64,
    /// Those closer than the support plus the skin, where that is less.
    near: Vec<Rows>,
    /// Positions when it was pruned; none before.
    pub reference: Vec<[f64; 3]>,
    /// At most so far has any particle gone since [h].
    pub travel: f64,
    /// The same pairs four by four with four, where somebody wants them.
    pub clusters: Clusters,
    /// Some region was too large for 16-bit numbers; the list is then of no use.
    pub overflow: bool,
}

/// The square of a cutoff for distances in single precision, which is good enough to say who may come
/// near: a little more than the cutoff makes up for its rounding, and that of positions as fractions of
/// the box.
fn square_for_single(cutoff: f64, cell: &PeriodicBox) -> f32 {
    let longest = cell.edges.iter().copied().fold(0.0, f64::max);
    let far = cutoff * (1.0 + 5e-6) + 8.0 * longest / 4_294_967_296.0;
    (far * far) as f32
}

impl PairList {
    /// Builds the lists from the particles' present positions. All pairs are worked on, until `prune`.
    pub fn build<const D: usize>(
        &mut self,
        grid: &Grid,
        cell: &PeriodicBox,
        particles: &mut Particles,
        cutoff: f64,
        shuffle: bool,
    ) {
        self.cutoff = cutoff;
        self.reference.clear();
        self.travel = 0.0;
        self.clusters.known = false;
        let cutoff2 = square_for_single(cutoff, cell);
        let columns = particles.copies.columns(&particles.position, cell);
        let id = shuffle.then_some(&particles.id[..]);
        self.blocks
            .resize_with(grid.block_count(), BlockList::default);
        self.blocks
            .par_iter_mut()
            .enumerate()
            .for_each(|(base, block)| block.build::<D>(base, grid, cell, columns, cutoff2, id));
        self.overflow = self.blocks.iter().any(BlockList::overflows);
    }

    /// Sweeps work on those pairs only that are closer than `cutoff` at present: until a particle has gone
    /// half as far as that is beyond the support.
    pub fn prune<const D: usize>(
        &mut self,
        cell: &PeriodicBox,
        particles: &mut Particles,
        cutoff: f64,
    ) {
        self.travel = 0.0;
        self.reference.resize(particles.len(), [0.0; 3]);
        let all = self.reference.par_iter_mut().zip(&particles.position[..]);
        all.with_min_len(2048)
            .for_each(|(to, x)| *to = [x[0], x[1], x[2]]);
        let square = square_for_single(cutoff, cell);
        let place = Mixed::places(&particles.position, cell, &mut particles.copies.place);
        self.near.resize_with(self.blocks.len(), Rows::default);
        let all = self.near.par_iter_mut().zip(&self.blocks);
        all.for_each(|(kept, block)| {
            run_wide(Prune::<D> {
                rows: &block.rows,
                kept,
                cell,
                place,
                square,
            });
        });
    }

    /// The pairs of a block that sweeps work on: those within the support, and some that are not yet or not
    /// any more, which come to nothing.
    pub fn present(&self, block: u32) -> &Rows {
        if self.reference.is_empty() {
            &self.blocks[block as usize].rows
        } else {
            &self.near[block as usize]
        }
    }

    /// Finds the clusters, unless they are known.
    pub(crate) fn know_clusters(&mut self, grid: &Grid) {
        if !self.clusters.known {
            self.clusters.build(grid, &self.blocks);
        }
    }

    /// What to tell the user about an overflow.
    pub fn overflow_error(&self) -> Error {
        Error::Invalid(format!(
            "`support` must leave at most {REGION_MAX} particles within reach of one block of the box; a smaller ratio of support to spacing is needed"
        ))
    }

    /// Number of pairs, those in the margin included.
    pub fn len(&self) -> usize {
        self.blocks.iter().map(BlockList::pairs).sum()
    }

    /// Number of those that sweeps work on.
    pub fn present_pairs(&self) -> usize {
        let blocks = 0..self.blocks.len() as u32;
        blocks.map(|block| self.present(block).pairs()).sum()
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
        list.build::<D>(&grid, &cell, &mut particles, cutoff, true);
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
    fn sweeps_work_on_what_is_near_until_somebody_has_gone_half_the_skin() {
        let cell = PeriodicBox::new(&[3.5, 4.0, 4.5], 1.0).unwrap();
        let n = 900;
        let number = |k: usize| (fmix64(k as u64 + 1) >> 11) as f64 / (1_u64 << 53) as f64;
        let mut particles = Particles::new(n, false);
        for (k, x) in particles.position.iter_mut().enumerate() {
            for a in 0..3 {
                x[a] = cell.edges[a] * number(3 * k + a);
            }
        }
        let (margin, skin) = (0.3, 0.1);
        let mut grid = Grid::new(&cell, 3, n, 1.0 + margin);
        grid.renew(&cell, 3, &mut particles);
        let mut list = PairList::default();
        list.build::<3>(&grid, &cell, &mut particles, 1.0 + margin, false);
        assert_eq!(list.present_pairs(), list.len());
        // Near ones at the start, and after a walk.
        for _ in 0..2 {
            list.prune::<3>(&cell, &mut particles, 1.0 + skin);
            assert_eq!(list.travel, 0.0);
            let share = list.present_pairs() as f64 / list.len() as f64;
            assert!((share - (1.1_f64 / 1.3).powi(3)).abs() < 0.02, "{share}");
            for (k, x) in particles.position.iter_mut().enumerate() {
                x[k % 3] += if k / 3 % 2 == 0 { 0.05 } else { -0.05 };
            }
            let mut found = BTreeSet::new();
            for block in 0..list.blocks.len() as u32 {
                for (head, others) in list.present(block).iter() {
                    for &other in others {
                        assert!(found.insert([head.min(other), head.max(other)]));
                    }
                }
            }
            for i in 0..n {
                for j in i + 1..n {
                    let (x, y) = (particles.position[i], particles.position[j]);
                    let r = cell.nearest::<3>([x[0] - y[0], x[1] - y[1], x[2] - y[2]]);
                    let square: f64 = r.iter().map(|x| x * x).sum();
                    assert!(square > 1.0 || found.contains(&[i as u32, j as u32]));
                }
            }
        }
        list.build::<3>(&grid, &cell, &mut particles, 1.0 + margin, false);
        assert_eq!(list.present_pairs(), list.len());
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
        list.build::<2>(&grid, &cell, &mut particles, 1.2, false);
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
