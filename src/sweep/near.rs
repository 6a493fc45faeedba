//! Which pairs of the list are within the support, and the densities on the way: where the skin is not
//! thin, forces of the same positions skip it.

use std::marker::PhantomData;

use super::density::weigh;
use super::precision::Precision;
use super::rows::{MOST, STRIDE, Wrap, four, row_sums};
use super::wide::{LANES, Vector};
use super::{Shared, Task, Wide};
use crate::domain::PeriodicBox;
use crate::kernel::Kernel;
use crate::neighbor::{BlockList, Octet, Rows};
use crate::real::Real;

/// Pairs whose weights are computed at once: those of many rows, so that a machine need not know where
/// one ends, nor how many of its pairs are within the support, to begin with the next.
pub(super) const BATCH: usize = 1024;

/// Octets whose distances are computed at once, before those within the support are found among them.
const GROUP: usize = 32;

// Groups fill whole vectors, add no more than a batch, and batches are whole vectors.
const _: () = assert!(
    (LANES * GROUP).is_multiple_of(MOST) && LANES * GROUP <= BATCH && BATCH.is_multiple_of(MOST)
);

/// Square distances of some pairs, then their weights.
#[repr(align(64))] // vectors must not straddle cache lines
pub(super) struct Batch<R> {
    /// Of a group of octets.
    squares: [R; LANES * GROUP],
    /// Pairs within the support up to the end of each of them.
    until: [u32; GROUP],
    /// Of those within the support: of a batch, and what the last group adds.
    lanes: [R; BATCH + LANES * GROUP + STRIDE],
    /// 1/r, as precise as single precision.
    inverse_r: [R; BATCH + LANES * GROUP + STRIDE],
    /// Their first row among the near ones, or that before it, and where they begin among the slots.
    row: usize,
    begin: usize,
}

impl<R: Real> Batch<R> {
    pub(super) fn new() -> Self {
        Self {
            squares: [R::ZERO; LANES * GROUP],
            until: [0; GROUP],
            lanes: [R::ZERO; BATCH + LANES * GROUP + STRIDE],
            inverse_r: [R::ZERO; BATCH + LANES * GROUP + STRIDE],
            row: 0,
            begin: 0,
        }
    }
}

/// How far the search of a block has come.
#[derive(Default)]
struct Found {
    /// Pairs of the list that have been looked at.
    listed: usize,
    /// Rows of the list that have been looked through, and the octets up to their ends.
    searched: usize,
    octets: usize,
    /// Rows with pairs within the support, and these pairs.
    rows: usize,
    pairs: usize,
}

pub(super) struct NearTask<'a, K, P: Precision, const D: usize> {
    pub block: &'a BlockList,
    pub near: &'a mut Rows,
    pub cell: &'a PeriodicBox,
    pub place: &'a [[P::Real; 4]],
    /// Where the sums go, if they are wanted.
    pub density: Option<Shared<'a, f64>>,
    pub batch: &'a mut Batch<P::Real>,
    pub kernel: PhantomData<K>,
}

impl<K: Kernel, P: Precision, const D: usize> Task for NearTask<'_, K, P, D> {
    type Output = ();

    #[inline(always)]
    fn run<W: Wide>(mut self) {
        let wrap = Wrap::<P, W>::new(self.cell);
        let mut found = Found::default();
        (self.batch.row, self.batch.begin) = (0, 0);
        self.near.ends.resize(self.block.rows.ends.len(), [0; 2]);
        for (n, group) in self.block.octets.chunks(GROUP).enumerate() {
            // SAFETY: these are the octets of the block, each group once.
            unsafe {
                self.measure::<W>(&wrap, group, &found);
                self.keep::<W>(group, &mut found);
            }
            self.end_rows(GROUP * n, group.len(), &mut found);
            if found.pairs >= self.batch.begin + BATCH {
                // Nowhere else: the order of sums must not depend on the skin.
                self.give::<W>(self.batch.begin + BATCH);
                self.batch
                    .lanes
                    .copy_within(BATCH..BATCH + LANES * GROUP, 0);
            }
        }
        self.give::<W>(found.pairs);
        self.near.ends.truncate(found.rows);
    }
}

impl<K: Kernel, P: Precision, const D: usize> NearTask<'_, K, P, D> {
    /// Square distances of a group of octets. No turn needs to know what another one finds.
    ///
    /// # Safety
    /// They are the next octets of the block, and fill whole vectors.
    #[inline(always)]
    unsafe fn measure<W: Wide>(&mut self, wrap: &Wrap<P, W>, group: &[Octet], found: &Found) {
        let (rows, place) = (&self.block.rows.ends, self.place.as_ptr());
        let neighbours = self.block.rows.slots.as_ptr();
        let (mut row, mut pair) = (found.searched, found.listed);
        let together = P::Vector::<W>::LANES / LANES;
        for (turn, octets) in group.chunks_exact(together).enumerate() {
            let (mut records, mut slots) = ([place; 2], [neighbours; 2]);
            for (k, octet) in octets.iter().enumerate() {
                // SAFETY: promised by the caller. An empty octet behind the last row has any head.
                unsafe {
                    let [head, _] = *rows.get_unchecked(row.min(rows.len() - 1));
                    records[k] = place.add(head as usize);
                    slots[k] = neighbours.add(pair);
                }
                pair += octet.count();
                row += usize::from(octet.is_last());
            }
            // SAFETY: heads and neighbours are slots of particles, and there is a vector of
            // neighbours more than pairs.
            unsafe {
                let heads = if together == 1 {
                    four::<P::Vector<W>>(&*records[0])
                } else {
                    P::Vector::<W>::of_two(records, 0xff)
                };
                let others = P::Vector::<W>::columns_of(place, slots);
                let (_, square) = wrap.between::<D>(&heads, &others);
                let lane = turn * P::Vector::<W>::LANES;
                square.store(self.batch.squares.as_mut_ptr().add(lane));
            }
        }
    }

    /// Puts those within the support one behind the other: their square distances, and the slots of
    /// partners.
    ///
    /// # Safety
    /// As for `measure`, which has been there before.
    #[inline(always)]
    unsafe fn keep<W: Wide>(&mut self, group: &[Octet], found: &mut Found) {
        let batch = &mut *self.batch;
        let neighbours = self.block.rows.slots.as_ptr();
        let slots = self.near.slots.as_mut_ptr();
        let together = P::Vector::<W>::LANES / LANES;
        let support = P::Vector::<W>::splat(P::Real::of(1.0));
        let (mut pair, mut pairs) = (found.listed, found.pairs);
        let turns = group.chunks_exact(together);
        for (turn, (octets, until)) in turns
            .zip(batch.until.chunks_exact_mut(together))
            .enumerate()
        {
            let lane = turn * P::Vector::<W>::LANES;
            let mut listed = 0;
            for (k, octet) in octets.iter().enumerate() {
                listed |= ((1 << octet.count()) - 1) << (LANES * k);
            }
            // SAFETY: promised by the caller; there is room for all pairs of the list, and a vector more.
            unsafe {
                let square = P::Vector::<W>::load(batch.squares.as_ptr().add(lane));
                let keep = square.below(support) & listed;
                square.store_kept(keep, batch.lanes.as_mut_ptr().add(pairs - batch.begin));
                for (k, octet) in octets.iter().enumerate() {
                    let keep = (keep >> (LANES * k)) as u8;
                    let from = neighbours.add(pair).cast::<[u32; LANES]>();
                    let to = slots.add(pairs).cast::<[u32; LANES]>();
                    to.write_unaligned(W::kept(from.read_unaligned(), keep));
                    pairs += keep.count_ones() as usize;
                    pair += octet.count();
                    until[k] = pairs as u32;
                }
            }
        }
        (found.listed, found.pairs) = (pair, pairs);
    }

    /// Notes the rows that end within so many octets from the `first` on, and the one at hand.
    #[inline(always)]
    fn end_rows(&mut self, first: usize, count: usize, found: &mut Found) {
        let (rows, ends) = (&self.block.rows.ends, &mut self.near.ends);
        let mut begin = if found.searched == 0 {
            0
        } else {
            rows[found.searched - 1][1]
        };
        let mut known = if found.rows == 0 {
            0
        } else {
            ends[found.rows - 1][1]
        };
        while let Some(&[head, end]) = rows.get(found.searched) {
            let octets = found.octets + (end - begin).div_ceil(LANES as u32) as usize;
            if octets > first + count {
                ends[found.rows] = [head, u32::MAX];
                break;
            }
            let until = self.batch.until[octets - 1 - first];
            ends[found.rows] = [head, until];
            // A row without any is none.
            found.rows += usize::from(until > known);
            (begin, known) = (end, until);
            (found.searched, found.octets) = (found.searched + 1, octets);
        }
    }

    /// Gives the weights of the batch, which ends there among the slots, to both ends of its pairs.
    #[inline(always)]
    fn give<W: Wide>(&mut self, end: usize) {
        let batch = &mut *self.batch;
        let mut begin = std::mem::replace(&mut batch.begin, end);
        let Some(density) = self.density else {
            return;
        };
        let count = end - begin;
        let whole = count.next_multiple_of(MOST);
        weigh::<K, P::Real, W, D, _>(&mut batch.lanes, &mut batch.inverse_r, whole);
        for (w, &slot) in batch.lanes[..count]
            .iter()
            .zip(&self.near.slots[begin..end])
        {
            // SAFETY: blocks of one colour share no particle.
            unsafe { *density.slot(slot) += w.double() };
        }
        let mut weights = batch.lanes.as_ptr();
        while begin < end {
            let [head, until] = self.near.ends[batch.row];
            let until = (until as usize).min(end);
            // SAFETY: as above; the row's lanes, and a stride more.
            unsafe {
                let [sum, ..] = row_sums::<P, W, 1>([weights], until - begin);
                *density.slot(head) += sum;
                weights = weights.add(until - begin);
            }
            begin = until;
            batch.row += usize::from(begin < end);
        }
    }
}
