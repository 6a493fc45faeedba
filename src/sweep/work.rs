//! The work that pressure does on particles: sum_j F(r_ij) r_ij.(u_i - u_j), with u the mean of the
//! velocities before and after a kick. Times P_i/d_i^2 and the time of the kick it is what particle i
//! loses of its internal energy, to rounding the part that the kick added to the kinetic energy.

use std::marker::PhantomData;

use super::heat_tally::{Flow, HeatMoment, HeatSums, HeatTally};
use super::{CHUNK, Shared, Task, Walk, Wide, for_each_block, run_wide};
use crate::domain::PeriodicBox;
use crate::kernel::Kernel;
use crate::neighbor::{BlockList, Grid, PairList};
use crate::state::Particles;

struct WorkTask<'a, K, const D: usize> {
    block: &'a BlockList,
    cell: &'a PeriodicBox,
    position: &'a [[f64; 4]],
    velocity: &'a [[f64; 4]],
    mean: &'a [[f64; 4]],
    work: Shared<'a, f64>,
    number: u32,
    current: Option<HeatSums<'a>>,
    kernel: PhantomData<K>,
}

impl<K: Kernel, const D: usize> WorkTask<'_, K, D> {
    /// r_ij F r_ij.(A_j u_i + A_i u_j), summed over the pairs of a chunk with the given F.
    fn hand_over(&self, mut walk: Walk, slope: &[f64; CHUNK], sum: &mut Flow) {
        let slots = &self.block.slots[..];
        walk.next_pairs(self.block, CHUNK, |head, lane, partners| {
            let i = head as usize;
            for (k, &place) in partners.iter().enumerate() {
                let j = slots[place as usize] as usize;
                let [p, q] = [i, j].map(|slot| &self.position[slot]);
                let [u, w] = [i, j].map(|slot| &self.mean[slot]);
                let [a_i, a_j] = [i, j].map(|slot| self.velocity[slot][3]);
                let r = self
                    .cell
                    .nearest::<D>([p[0] - q[0], p[1] - q[1], p[2] - q[2]]);
                let mut power = 0.0;
                for a in 0..D {
                    power += r[a] * (a_j * u[a] + a_i * w[a]);
                }
                for a in 0..D {
                    sum[a] += r[a] * slope[lane + k] * power;
                }
            }
        });
    }
}

impl<K: Kernel, const D: usize> Task for WorkTask<'_, K, D> {
    type Output = ();
    #[inline(always)]
    fn run<W: Wide>(self) {
        let slots = &self.block.slots[..];
        let mut walk = Walk::default();
        let mut r2 = [0.0; CHUNK];
        let (mut approach, mut slope) = ([0.0; CHUNK], [0.0; CHUNK]);
        let mut handed = HeatMoment::default();
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
                break;
            }
            for k in 0..CHUNK {
                slope[k] = K::f::<D>(r2[k].sqrt());
                approach[k] *= slope[k];
            }
            if self.current.is_some() {
                self.hand_over(back, &slope, handed.pressure());
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
        if let Some(sums) = self.current {
            // SAFETY: this block's own number.
            unsafe { sums.add(self.number, &handed) };
        }
    }
}

/// Sets the field `work` to the sums above for the mean velocities in `scratch`; `current` gets the
/// power that pairs hand over.
pub fn pair_work<K: Kernel, const D: usize>(
    particles: &mut Particles,
    work: usize,
    grid: &Grid,
    list: &PairList,
    cell: &PeriodicBox,
    current: Option<&mut HeatTally>,
) {
    let current = current.map(|it| {
        it.begin();
        it.sums()
    });
    let work = &mut particles.scalars[work].values;
    work.fill(0.0);
    let work = Shared::new(work);
    let (position, velocity) = (&particles.position, &particles.velocity);
    let mean = &particles.scratch;
    for_each_block(grid, &list.blocks, false, &|number, block| {
        run_wide(WorkTask::<K, D> {
            block,
            cell,
            position,
            velocity,
            mean,
            work,
            number,
            current,
            kernel: PhantomData,
        });
    });
}
