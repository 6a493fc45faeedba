//! Number density by summation, d_i = W(0) + sum_j W(r_ij), and the site pressures that follow.

use rayon::prelude::*;

use super::precision::{Copies, Precision};
use super::rows::{ROOM, near_partners, whole};
use super::{CHUNK, Shared, Task, Wide, for_each_block, run_wide};
use crate::domain::PeriodicBox;
use crate::kernel::Kernel;
use crate::neighbor::{BlockList, Grid, PairList, Rows};
use crate::real::Real;
use crate::state::Particles;

struct DensityTask<'a, K, P: Precision, const D: usize> {
    block: &'a BlockList,
    near: &'a mut Rows,
    cell: &'a PeriodicBox,
    place: &'a [[P::Real; 4]],
    /// Where the sums go, if they are wanted.
    density: Option<Shared<'a, f64>>,
    kernel: std::marker::PhantomData<K>,
}

impl<K: Kernel, P: Precision, const D: usize> Task for DensityTask<'_, K, P, D> {
    type Output = ();

    #[inline(always)]
    fn run<W: Wide>(self) {
        let (block, near) = (self.block, self.near);
        near.ends.clear();
        let mut weight = [P::Real::ZERO; ROOM];
        let (mut begin, mut length) = (0, 0);
        for &[head, end] in &block.rows {
            let row = begin..end as usize;
            begin = row.end;
            let (mut own, before) = (0.0, length);
            for first in row.clone().step_by(CHUNK) {
                let count = (row.end - first).min(CHUNK);
                // SAFETY: a row of this block.
                let found = unsafe {
                    near_partners::<P, W, D>(
                        block,
                        self.cell,
                        self.place,
                        head,
                        first,
                        count,
                        &mut weight,
                        near,
                        length,
                    )
                };
                let partners = length..length + found;
                length = partners.end;
                let Some(density) = self.density else {
                    continue;
                };
                for x in &mut weight[..whole::<P::Real>(found)] {
                    let r2 = *x;
                    *x = K::w::<_, D>(
                        r2 * r2.at_least(P::Real::TINY).inverse_root::<W::Arithmetic>(),
                    );
                }
                for (w, &place) in weight.iter().zip(&near.places[partners]) {
                    let w = w.double();
                    own += w;
                    // SAFETY: blocks of one colour share no particle, and other != head.
                    unsafe {
                        let other = *block.slots.get_unchecked(place as usize);
                        *density.slot(other) += w;
                    }
                }
            }
            if length > before {
                near.ends.push([head, length as u32]);
            }
            if let Some(density) = self.density {
                // SAFETY: as above.
                unsafe { *density.slot(head) += own };
            }
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
    for_each_block(grid, &list.blocks, false, &|number, block| {
        run_wide(DensityTask::<K, P, D> {
            block,
            // SAFETY: each block once.
            near: unsafe { near.slot(number) },
            cell,
            place,
            density,
            kernel: std::marker::PhantomData,
        });
    });
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
