//! Number density by summation, d_i = W(0) + sum_j W(r_ij), and the site pressures that follow.

use rayon::prelude::*;

use super::{CHUNK, Shared, Task, Walk, for_each_block, run_wide};
use crate::domain::PeriodicBox;
use crate::kernel::Kernel;
use crate::neighbor::{BlockList, Grid, PairList};
use crate::state::Particles;

struct DensityTask<'a, K, const D: usize> {
    block: &'a BlockList,
    cell: &'a PeriodicBox,
    position: &'a [[f64; 4]],
    density: Shared<'a, f64>,
    kernel: std::marker::PhantomData<K>,
}

impl<K: Kernel, const D: usize> Task for DensityTask<'_, K, D> {
    #[inline(always)]
    fn run(self) {
        let slots = &self.block.slots[..];
        let mut walk = Walk::default();
        let mut r2 = [0.0; CHUNK];
        let mut weight = [0.0; CHUNK];
        loop {
            let mut back = walk;
            let count = walk.next_pairs(self.block, CHUNK, |head, lane, partners| {
                let i = self.position[head as usize];
                for (k, &place) in partners.iter().enumerate() {
                    let other = slots[place as usize];
                    // SAFETY: list entries lead to slots of particles.
                    let j = unsafe { self.position.get_unchecked(other as usize) };
                    let r = self
                        .cell
                        .nearest::<D>([i[0] - j[0], i[1] - j[1], i[2] - j[2]]);
                    let mut sum = r[0] * r[0] + r[1] * r[1];
                    if D == 3 {
                        sum += r[2] * r[2];
                    }
                    r2[lane + k] = sum;
                }
            });
            if count == 0 {
                return;
            }
            for k in 0..CHUNK {
                weight[k] = K::w::<D>(r2[k].sqrt());
            }
            back.next_pairs(self.block, CHUNK, |head, lane, partners| {
                let mut sum = 0.0;
                for (k, &place) in partners.iter().enumerate() {
                    let other = slots[place as usize];
                    sum += weight[lane + k];
                    // SAFETY: blocks of one colour share no particle, and other != head.
                    unsafe { *self.density.slot(other) += weight[lane + k] };
                }
                // SAFETY: as above.
                unsafe { *self.density.slot(head) += sum };
            });
        }
    }
}

/// Number densities of all particles, in units of h^-D.
pub fn number_densities<K: Kernel, const D: usize>(
    particles: &mut Particles,
    grid: &Grid,
    list: &PairList,
    cell: &PeriodicBox,
) {
    particles.density.fill(K::w::<D>(0.0));
    let density = Shared::new(&mut particles.density);
    let position = &particles.position;
    for_each_block(grid, list, false, &|_, block| {
        run_wide(DensityTask::<K, D> {
            block,
            cell,
            position,
            density,
            kernel: std::marker::PhantomData,
        });
    });
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
