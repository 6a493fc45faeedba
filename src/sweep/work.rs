//! The work that pressure does on particles: sum_j F(r_ij) r_ij.(u_i - u_j), with u the mean of the
//! velocities before and after a kick. Times P_i/d_i^2 and the time of the kick it is what particle i
//! loses of its internal energy, to rounding the part that the kick added to the kinetic energy.

use std::marker::PhantomData;

use super::{CHUNK, Shared, Task, Walk, for_each_block, run_wide};
use crate::domain::PeriodicBox;
use crate::kernel::Kernel;
use crate::neighbor::{BlockList, Grid, PairList};
use crate::state::Particles;

struct WorkTask<'a, K, const D: usize> {
    block: &'a BlockList,
    cell: &'a PeriodicBox,
    position: &'a [[f64; 4]],
    mean: &'a [[f64; 4]],
    work: Shared<'a, f64>,
    kernel: PhantomData<K>,
}

impl<K: Kernel, const D: usize> Task for WorkTask<'_, K, D> {
    #[inline(always)]
    fn run(self) {
        let slots = &self.block.slots[..];
        let mut walk = Walk::default();
        let mut r2 = [0.0; CHUNK];
        let mut approach = [0.0; CHUNK];
        loop {
            let mut back = walk;
            let count = walk.next_pairs(self.block, CHUNK, |head, lane, partners| {
                let (i, u) = (self.position[head as usize], self.mean[head as usize]);
                for (k, &place) in partners.iter().enumerate() {
                    let other = slots[place as usize] as usize;
                    // SAFETY: list entries lead to slots of particles.
                    let (j, w) = unsafe {
                        (
                            self.position.get_unchecked(other),
                            self.mean.get_unchecked(other),
                        )
                    };
                    let r = self
                        .cell
                        .nearest::<D>([i[0] - j[0], i[1] - j[1], i[2] - j[2]]);
                    let (mut square, mut along) = (0.0, 0.0);
                    for a in 0..D {
                        square += r[a] * r[a];
                        along += r[a] * (u[a] - w[a]);
                    }
                    r2[lane + k] = square;
                    approach[lane + k] = along;
                }
            });
            if count == 0 {
                return;
            }
            for k in 0..CHUNK {
                approach[k] *= K::f::<D>(r2[k].sqrt());
            }
            back.next_pairs(self.block, CHUNK, |head, lane, partners| {
                let mut sum = 0.0;
                for (k, &place) in partners.iter().enumerate() {
                    let other = slots[place as usize];
                    sum += approach[lane + k];
                    // SAFETY: blocks of one colour share no particle, and other != head.
                    unsafe { *self.work.slot(other) += approach[lane + k] };
                }
                // SAFETY: as above.
                unsafe { *self.work.slot(head) += sum };
            });
        }
    }
}

/// Sets the field `work` to the sums above for the mean velocities in `scratch`.
pub fn pair_work<K: Kernel, const D: usize>(
    particles: &mut Particles,
    work: usize,
    grid: &Grid,
    list: &PairList,
    cell: &PeriodicBox,
) {
    let work = &mut particles.scalars[work].values;
    work.fill(0.0);
    let work = Shared::new(work);
    let (position, mean) = (&particles.position, &particles.scratch);
    for_each_block(grid, list, false, &|_, block| {
        run_wide(WorkTask::<K, D> {
            block,
            cell,
            position,
            mean,
            work,
            kernel: PhantomData,
        });
    });
}
