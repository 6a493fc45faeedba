//! Number density by summation, d_i = W(0) + sum_j W(r_ij), and the site pressures that follow.

use std::marker::PhantomData;

use rayon::prelude::*;

use super::precision::{Copies, Precision};
use super::rows::{MOST, STRIDE, near_partners, row_sums};
use super::{Shared, Task, Wide, fetch, for_each_block_with, run_wide};
use crate::domain::PeriodicBox;
use crate::kernel::Kernel;
use crate::neighbor::{BlockList, Grid, PairList, Rows};
use crate::real::{Real, near_inverse_roots};
use crate::state::Particles;

/// Pairs whose weights are computed at once: those of many rows, so that a machine need not know where
/// one ends, nor how many of its pairs are within the support, to begin with the next.
const BATCH: usize = 1024;

/// Square distances of some pairs, then their weights.
#[repr(align(64))] // vectors must not straddle cache lines
struct Batch<R> {
    lanes: [R; BATCH + STRIDE],
    /// 1/r, as precise as single precision.
    inverse_r: [R; BATCH + STRIDE],
    /// Their first row among the near ones, and where they begin among the slots.
    row: usize,
    begin: usize,
}

impl<R: Real> Batch<R> {
    fn new() -> Self {
        Self {
            lanes: [R::ZERO; BATCH + STRIDE],
            inverse_r: [R::ZERO; BATCH + STRIDE],
            row: 0,
            begin: 0,
        }
    }
}

struct DensityTask<'a, K, P: Precision, const D: usize> {
    block: &'a BlockList,
    near: &'a mut Rows,
    cell: &'a PeriodicBox,
    place: &'a [[P::Real; 4]],
    /// Where the sums go, if they are wanted.
    density: Option<Shared<'a, f64>>,
    batch: &'a mut Batch<P::Real>,
    kernel: PhantomData<K>,
}

impl<K: Kernel, P: Precision, const D: usize> Task for DensityTask<'_, K, P, D> {
    type Output = ();

    #[inline(always)]
    fn run<W: Wide>(mut self) {
        let block = self.block;
        self.near.ends.clear();
        (self.batch.row, self.batch.begin) = (0, 0);
        let (mut first, mut length) = (0, 0);
        for &[head, end] in &block.rows {
            let (end, before) = (end as usize, length);
            // Its end is known when all of it has been searched.
            self.near.ends.push([head, u32::MAX]);
            while first < end {
                if length == self.batch.begin + BATCH {
                    // Nowhere else: the order of sums must not depend on the skin.
                    self.give::<W>(length);
                    self.batch.row = self.near.ends.len() - 1;
                }
                let begin = self.batch.begin;
                let count = (end - first).min(begin + BATCH - length);
                // SAFETY: pairs of a row of this block, for which there are lanes, and a vector more.
                length += unsafe {
                    near_partners::<P, W, D>(
                        block,
                        self.cell,
                        self.place,
                        head,
                        first,
                        count,
                        self.batch.lanes.as_mut_ptr().add(length - begin),
                        self.near,
                        length,
                    )
                };
                first += count;
            }
            self.near.ends.pop();
            if length > before {
                self.near.ends.push([head, length as u32]);
            }
        }
        self.give::<W>(length);
    }
}

impl<K: Kernel, P: Precision, const D: usize> DensityTask<'_, K, P, D> {
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
        near_inverse_roots(&batch.lanes, &mut batch.inverse_r, whole);
        for (x, &near) in batch.lanes[..whole].iter_mut().zip(&batch.inverse_r) {
            let [q, _] = x.distance_from::<W::Arithmetic>(near);
            *x = K::w::<_, D>(q);
        }
        for (w, &slot) in batch.lanes[..count]
            .iter()
            .zip(&self.near.slots[begin..end])
        {
            // SAFETY: blocks of one colour share no particle.
            unsafe { *density.slot(slot) += w.double() };
        }
        let mut weights = batch.lanes.as_ptr();
        for &[head, until] in &self.near.ends[batch.row..] {
            let until = (until as usize).min(end);
            // SAFETY: as above; the row's lanes, and a stride more.
            unsafe {
                let [sum, ..] = row_sums::<P, W, 1>([weights], until - begin);
                *density.slot(head) += sum;
                weights = weights.add(until - begin);
            }
            begin = until;
        }
    }
}

/// Number densities of all particles, in units of h^-D; notes which pairs are within the support.
pub fn number_densities<K: Kernel, P: Precision, const D: usize>(
    particles: &mut Particles,
    grid: &Grid,
    list: &mut PairList,
    cell: &PeriodicBox,
) {
    let Particles {
        position,
        density,
        copies,
        ..
    } = particles;
    density.fill(K::w::<_, D>(0.0));
    let density = Some(Shared::new(density));
    sweep::<K, P, D>(density, position, copies, grid, list, cell);
}

fn sweep<K: Kernel, P: Precision, const D: usize>(
    density: Option<Shared<'_, f64>>,
    position: &[[f64; 4]],
    copies: &mut Copies,
    grid: &Grid,
    list: &mut PairList,
    cell: &PeriodicBox,
) {
    let place = P::places(position, cell, &mut copies.place);
    let near = Shared::new(&mut list.near);
    for_each_block_with(
        grid,
        &list.blocks,
        false,
        Batch::new,
        |batch, number, block| {
            fetch(block, place.as_ptr(), place.len());
            if let Some(density) = density {
                fetch(block, density.pointer(), density.length);
            }
            run_wide(DensityTask::<K, P, D> {
                block,
                // SAFETY: each block once.
                near: unsafe { near.slot(number) },
                cell,
                place,
                density,
                batch,
                kernel: PhantomData,
            });
        },
    );
    list.near_is_known = true;
}

/// Finds the pairs within the support, unless they are known.
pub(super) fn know_near<K: Kernel, P: Precision, const D: usize>(
    particles: &mut Particles,
    grid: &Grid,
    list: &mut PairList,
    cell: &PeriodicBox,
) {
    if !list.near_is_known {
        let Particles {
            position, copies, ..
        } = particles;
        sweep::<K, P, D>(None, position, copies, grid, list, cell);
    }
}

/// Writes s = d^(-1/2) and P/d^2 into the particles' records; `pressure(d)` is P in reduced units.
pub fn site_pressures(particles: &mut Particles, pressure: impl Fn(f64) -> f64 + Sync) {
    particles
        .position
        .par_iter_mut()
        .zip(particles.velocity.par_iter_mut())
        .zip(particles.density.par_iter())
        .with_min_len(512)
        .for_each(|((position, velocity), &d)| {
            position[3] = 1.0 / d.sqrt();
            velocity[3] = pressure(d) / (d * d);
        });
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernel::Lucy;
    use crate::random::fmix64;
    use crate::sweep::{Double, Mixed};

    /// Densities of n particles in a ball of that radius are those of a direct sum.
    fn check<P: Precision>(n: usize, radius: f64, tolerance: f64) {
        let cell = PeriodicBox::new(&[3.5, 3.5, 3.5], 1.0).unwrap();
        let mut particles = Particles::new(n, false);
        for (k, x) in particles.position.iter_mut().enumerate() {
            for a in 0..3 {
                let word = fmix64((3 * k + a + 1) as u64) >> 11;
                let u = 2.0 * word as f64 / (1_u64 << 53) as f64 - 1.0;
                x[a] = 1.7 + radius * u / 3.0_f64.sqrt();
            }
        }
        let mut grid = Grid::new(&cell, 3, n, 1.1);
        grid.renew(&cell, 3, &mut particles);
        let mut list = PairList::default();
        list.build::<3>(&grid, &cell, &mut particles, 1.1, false);
        number_densities::<Lucy, P, 3>(&mut particles, &grid, &mut list, &cell);
        let longest = |ends: &[[u32; 2]]| {
            let begins = std::iter::once(0).chain(ends.iter().map(|row| row[1]));
            ends.iter()
                .zip(begins)
                .map(|(row, begin)| row[1] - begin)
                .max()
        };
        let row = list
            .near
            .iter()
            .filter_map(|near| longest(&near.ends))
            .max();
        assert_eq!(row.unwrap_or(0) as usize > BATCH, n > 2 * BATCH);
        let mut pairs = 0;
        for i in 0..n {
            let mut sum = Lucy::w::<f64, 3>(0.0);
            for j in (0..n).filter(|&j| j != i) {
                let (x, y) = (particles.position[i], particles.position[j]);
                let r = cell.nearest::<3>([x[0] - y[0], x[1] - y[1], x[2] - y[2]]);
                let q = (r[0] * r[0] + r[1] * r[1] + r[2] * r[2]).sqrt();
                sum += Lucy::w::<f64, 3>(q);
                pairs += usize::from(q < 1.0 && j > i);
            }
            assert!((particles.density[i] / sum - 1.0).abs() < tolerance);
        }
        let near: usize = list.near.iter().map(Rows::pairs).sum();
        assert!(near.abs_diff(pairs) <= pairs / 100_000);
    }

    #[test]
    fn rows_longer_than_a_batch_and_shorter_ones_give_direct_sums() {
        check::<Double>(2500, 0.49, 1e-13);
        check::<Double>(1500, 1.4, 1e-13);
        check::<Double>(1, 0.3, 1e-13);
        check::<Mixed>(2500, 0.49, 1e-5);
        check::<Mixed>(1500, 1.4, 1e-5);
    }
}
