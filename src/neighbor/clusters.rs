//! Particles four by four, and which fours are near which. Where registers hold sixteen numbers, all pairs
//! of four particles with four others fill one without a look at where each of them is stored; two thirds
//! of these pairs may be too far apart and still it takes less time.

use rayon::prelude::*;

use super::block::BlockList;
use super::{Grid, Rows};

/// Particles of a cluster.
pub const FOUR: usize = 4;

/// Neighbours along a column of cells in one block, four by four, and rows of clusters: those of a row are
/// near the cluster that is its head. Every pair of the pair list is in one of them.
#[derive(Debug, Default, Clone)]
pub struct Clusters {
    /// Slots; the last clusters of columns may have fewer.
    pub members: Vec<Members>,
    /// By base block, slots being numbers of clusters. The head itself comes first in its own block.
    pub rows: Vec<Rows>,
    /// Are they those of the present pair list?
    pub known: bool,
    of_slot: Vec<u32>,
    /// First cluster of each block, and their number at the end.
    first: Vec<u32>,
    scratch: Vec<Scratch>,
}

/// The particles of a cluster.
#[derive(Debug, Clone, Copy)]
pub struct Members {
    /// Their slots; those beyond `count` are the first one's.
    pub slots: [u32; FOUR],
    /// How many there are.
    pub count: u32,
    /// Cells of the first and of the last one.
    cells: [u32; 2],
}

impl Members {
    /// The slots.
    #[inline(always)]
    pub fn present(&self) -> &[u32] {
        &self.slots[..(self.count as usize).min(FOUR)]
    }
}

/// Of a base block.
#[derive(Debug, Default, Clone)]
struct Scratch {
    parts: Vec<Part>,
    /// Where the row of each head begins and ends, by place in the region.
    rows: Vec<[u32; 2]>,
    /// Which clusters of the region are near the head, a bit each.
    near: Vec<u64>,
}

/// One block of a region: slots and clusters, and where these begin in the region.
#[derive(Debug, Default, Clone, Copy)]
struct Part {
    slots: [u32; 2],
    clusters: [u32; 2],
    slot_place: u32,
    cluster_place: u32,
}

impl Clusters {
    /// Takes neighbours together and finds which clusters are near which, from a list of pairs.
    pub fn build(&mut self, grid: &Grid, blocks: &[BlockList]) {
        self.gather(grid);
        self.rows.resize_with(blocks.len(), Rows::default);
        self.scratch.resize_with(blocks.len(), Scratch::default);
        let (members, of_slot, first) = (&self.members[..], &self.of_slot[..], &self.first[..]);
        let all = self.rows.par_iter_mut().zip(&mut self.scratch).zip(blocks);
        all.for_each(|((rows, scratch), block)| {
            scratch.enter(block, of_slot, first);
            scratch.find(block, rows, members, of_slot);
        });
        self.known = true;
    }

    /// Bytes held.
    pub(super) fn bytes(&self) -> usize {
        let scratch = self.scratch.iter().map(Scratch::bytes).sum::<usize>();
        size_of::<Members>() * self.members.capacity()
            + 4 * (self.of_slot.capacity() + self.first.capacity())
            + self.rows.iter().map(Rows::bytes).sum::<usize>()
            + scratch
    }

    /// Takes the particles of each column together, cell by cell and in a cell along the first axis.
    fn gather(&mut self, grid: &Grid) {
        self.members.clear();
        self.first.clear();
        self.of_slot.resize(grid.reference.len(), 0);
        let [along, ..] = grid.cells_per_block;
        let mut inside: Vec<u32> = Vec::new();
        for block in 0..grid.block_count() {
            self.first.push(self.members.len() as u32);
            for column in 0..grid.cells_in_block() / along {
                let begin = block * grid.cells_in_block() + column * along;
                let mut free = 0;
                for cell in begin..begin + along {
                    inside.clear();
                    inside.extend(grid.cell_start[cell]..grid.cell_start[cell + 1]);
                    // Where they were when the grid was renewed: a state that has been saved knows that.
                    let x = |slot: &u32| grid.reference[*slot as usize][0];
                    inside.sort_by(|a, b| x(a).total_cmp(&x(b)));
                    for &slot in &inside {
                        if free == 0 {
                            self.members.push(Members {
                                slots: [slot; FOUR],
                                count: 0,
                                cells: [cell as u32; 2],
                            });
                            free = FOUR;
                        }
                        let last = self.members.len() - 1;
                        let cluster = &mut self.members[last];
                        cluster.slots[cluster.count as usize] = slot;
                        cluster.count += 1;
                        cluster.cells[1] = cell as u32;
                        self.of_slot[slot as usize] = last as u32;
                        free -= 1;
                    }
                }
            }
        }
        self.first.push(self.members.len() as u32);
    }
}

impl Scratch {
    fn bytes(&self) -> usize {
        size_of::<Part>() * self.parts.capacity()
            + 8 * (self.rows.capacity() + self.near.capacity())
    }

    /// Finds slots and clusters of the region, and the rows of its heads.
    fn enter(&mut self, block: &BlockList, of_slot: &[u32], first: &[u32]) {
        self.parts.clear();
        let (mut slot_place, mut cluster_place) = (0, 0);
        for slots in block.region() {
            if slots.is_empty() {
                // The first part stays the block's own.
                self.parts.push(Part::default());
                continue;
            }
            let after = first.partition_point(|&cluster| cluster <= of_slot[slots.start]);
            let clusters = [first[after - 1], first[after]];
            self.parts.push(Part {
                slots: [slots.start as u32, slots.end as u32],
                clusters,
                slot_place,
                cluster_place,
            });
            slot_place += slots.len() as u32;
            cluster_place += clusters[1] - clusters[0];
        }
        self.rows.clear();
        self.rows.resize(slot_place as usize, [0; 2]);
        self.near.clear();
        self.near.resize((cluster_place as usize).div_ceil(64), 0);
        let (mut begin, mut part) = (0, Part::default());
        for &[head, end] in &block.rows.ends {
            part = self.part_of(head, part);
            self.rows[(head - part.slots[0] + part.slot_place) as usize] = [begin, end];
            begin = end;
        }
    }

    /// The part that holds a slot; `last` is likely to be the one.
    #[inline(always)]
    fn part_of(&self, slot: u32, last: Part) -> Part {
        if last.holds(slot) {
            return last;
        }
        let part = self.parts.iter().find(|part| part.holds(slot));
        part.copied().unwrap_or_default()
    }

    /// Fills the rows of clusters of a block.
    fn find(&mut self, block: &BlockList, rows: &mut Rows, members: &[Members], of_slot: &[u32]) {
        rows.clear();
        for number in 0..self.parts.len() {
            let part = self.parts[number];
            for head in part.clusters[0]..part.clusters[1] {
                let cluster = &members[head as usize];
                if number == 0 {
                    // Within a cell, pairs are in the row of either one: those behind the head are
                    // taken as near, and none before it.
                    let behind = members[head as usize..part.clusters[1] as usize].iter();
                    let shared = behind.take_while(|other| other.cells[0] <= cluster.cells[1]);
                    let own = head - part.clusters[0] + part.cluster_place;
                    for k in 0..shared.count() as u32 {
                        self.mark(own + k);
                    }
                }
                let mut last = part;
                for &slot in cluster.present() {
                    let place = slot - part.slots[0] + part.slot_place;
                    let [begin, end] = self.rows[place as usize];
                    for &other in &block.rows.slots[begin as usize..end as usize] {
                        let partner = of_slot[other as usize];
                        if partner > head {
                            last = self.part_of(other, last);
                            self.mark(partner - last.clusters[0] + last.cluster_place);
                        }
                    }
                }
                self.close(head, rows);
            }
        }
    }

    fn mark(&mut self, place: u32) {
        self.near[place as usize / 64] |= 1 << (place % 64);
    }

    /// Ends the row of a head, and forgets what was near it.
    fn close(&mut self, head: u32, rows: &mut Rows) {
        let begin = rows.slots.len();
        let mut parts = self.parts.iter();
        let mut part = Part::default();
        for (word, bits) in self.near.iter_mut().enumerate() {
            while *bits != 0 {
                let place = 64 * word as u32 + bits.trailing_zeros();
                *bits &= *bits - 1;
                // Places are met in ascending order.
                while place >= part.cluster_place + part.clusters[1] - part.clusters[0] {
                    let Some(next) = parts.next() else { return };
                    part = *next;
                }
                rows.slots
                    .push(place - part.cluster_place + part.clusters[0]);
            }
        }
        if rows.slots.len() > begin {
            rows.ends.push([head, rows.slots.len() as u32]);
        }
    }
}

impl Part {
    #[inline(always)]
    fn holds(&self, slot: u32) -> bool {
        (self.slots[0]..self.slots[1]).contains(&slot)
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::super::PairList;
    use super::*;
    use crate::domain::PeriodicBox;
    use crate::random::fmix64;
    use crate::state::Particles;

    /// Every particle is in one cluster, every pair of the list in one row, and no two clusters are
    /// together in two.
    fn check(edges: [f64; 3], n: usize, cutoff: f64, drift: f64) {
        for make in [Grid::new, Grid::with_wide_blocks] {
            check_on(make, edges, n, cutoff, drift);
        }
    }

    fn check_on(
        make: fn(&PeriodicBox, usize, usize, f64) -> Grid,
        edges: [f64; 3],
        n: usize,
        cutoff: f64,
        drift: f64,
    ) {
        let cell = PeriodicBox::new(&edges, 1.0).unwrap();
        let mut particles = Particles::new(n, false);
        let number = |k: usize| (fmix64(k as u64 + 1) >> 11) as f64 / (1_u64 << 53) as f64;
        for (k, x) in particles.position.iter_mut().enumerate() {
            for a in 0..3 {
                x[a] = edges[a] * number(3 * k + a);
            }
        }
        let mut grid = make(&cell, 3, n, cutoff + drift);
        grid.renew(&cell, 3, &mut particles);
        for (k, x) in particles.position.iter_mut().enumerate() {
            x[0] += 0.5 * drift * (2.0 * number(7 * k) - 1.0);
        }
        let mut list = PairList::default();
        list.build::<3>(&grid, &cell, &mut particles, cutoff, false);
        list.know_clusters(&grid);
        let clusters = &list.clusters;
        let mut seen = vec![0; n];
        for members in &clusters.members {
            assert!(members.count >= 1 && members.cells[0] <= members.cells[1]);
            for &slot in members.present() {
                seen[slot as usize] += 1;
            }
        }
        assert!(seen.iter().all(|&times| times == 1));
        let mut found = BTreeSet::new();
        for rows in &clusters.rows {
            for (head, others) in rows.iter() {
                assert!(!others[1..].contains(&head));
                for &other in others {
                    assert!(other >= head && found.insert([head, other]));
                }
            }
        }
        for head in 0..clusters.members.len() as u32 {
            assert!(found.contains(&[head, head]));
        }
        for block in &list.blocks {
            for (head, others) in block.rows.iter() {
                for &other in others {
                    let pair = [head, other].map(|slot| clusters.of_slot[slot as usize]);
                    assert!(found.contains(&[pair[0].min(pair[1]), pair[0].max(pair[1])]));
                }
            }
        }
    }

    #[test]
    fn clusters_hold_all_pairs_once() {
        check([3.5, 3.5, 3.5], 1, 1.02, 0.0);
        check([2.0, 2.4, 3.5], 150, 1.02, 0.0);
        check([3.3, 4.4, 5.7], 900, 1.0, 0.08);
        check([9.0, 3.4, 2.0], 1000, 1.02, 0.08);
        // Crowded cells, whose clusters share them; then hardly any particles.
        check([3.5, 3.5, 3.5], 4000, 1.02, 0.05);
        check([8.0, 8.0, 8.0], 40, 1.02, 0.05);
    }
}
