//! The work that pressure does on particles: sum_j F(r_ij) r_ij.(u_i - u_j), with u the mean of the
//! velocities before and after a kick. Times P_i/d_i^2 and the time of the kick it is what particle i
//! loses of its internal energy, to rounding the part that the kick added to the kinetic energy.

use std::marker::PhantomData;

use super::heat_tally::{Flow, HeatMoment, HeatSums, HeatTally};
use super::precision::Double;
use super::rows::{Companion, Ends, Pairs, ROOM, whole};
use super::{Shared, Task, Wide, for_each_block, run_wide};
use crate::domain::PeriodicBox;
use crate::kernel::Kernel;
use crate::neighbor::{Grid, PairList, Rows};
use crate::real::{Real, near_inverse_roots};
use crate::state::Particles;

struct WorkTask<'a, K, const D: usize> {
    near: &'a Rows,
    cell: &'a PeriodicBox,
    position: &'a [[f64; 4]],
    velocity: &'a [[f64; 4]],
    mean: &'a [[f64; 4]],
    work: Shared<'a, f64>,
    number: u32,
    current: Option<HeatSums<'a>>,
    kernel: PhantomData<K>,
}

/// Relative mean velocities.
struct Approach<'a> {
    mean: &'a [[f64; 4]],
    u: &'a mut [[f64; ROOM]; 3],
}

impl<W: Wide> Companion<W> for Approach<'_> {
    #[inline(always)]
    unsafe fn take(&mut self, ends: &Ends<'_>, lane: usize) {
        // SAFETY: promised by the caller.
        unsafe {
            let here: [W; 4] = ends.of_heads(self.mean);
            let there: [W; 4] = ends.of_others(self.mean);
            for a in 0..3 {
                let u = here[a].minus(there[a]);
                u.store(self.u[a].as_mut_ptr().add(lane));
            }
        }
    }
}

impl<K: Kernel, const D: usize> WorkTask<'_, K, D> {
    /// r_ij F r_ij.(A_j u_i + A_i u_j), summed over the pairs of a chunk with the given F.
    fn hand_over(&self, pairs: &Pairs, slope: &[f64; ROOM], sum: &mut Flow) {
        let others = pairs.members.others(self.near);
        for n in 0..pairs.members.row_count() {
            let (head, lanes) = pairs.members.row_at(self.near, n);
            for lane in lanes {
                let (i, j) = (head as usize, others[lane] as usize);
                let [u, w] = [i, j].map(|slot| &self.mean[slot]);
                let [a_i, a_j] = [i, j].map(|slot| self.velocity[slot][3]);
                let mut power = 0.0;
                for a in 0..D {
                    power += pairs.r[a][lane] * (a_j * u[a] + a_i * w[a]);
                }
                for a in 0..D {
                    sum[a] += pairs.r[a][lane] * slope[lane] * power;
                }
            }
        }
    }
}

impl<K: Kernel, const D: usize> Task for WorkTask<'_, K, D> {
    type Output = ();

    #[inline(always)]
    fn run<W: Wide>(self) {
        let mut pairs = Pairs::<Double>::new();
        let (mut u, mut near) = ([[0.0; ROOM]; 3], [0.0; ROOM]);
        let (mut approach, mut slope) = ([0.0; ROOM], [0.0; ROOM]);
        let mut handed = HeatMoment::default();
        while pairs.members.has_more(self.near) {
            let mut companion = Approach {
                mean: self.mean,
                u: &mut u,
            };
            pairs.fill::<W, D>(self.near, self.cell, self.position, &mut companion);
            let count = whole::<f64>(pairs.members.count);
            near_inverse_roots(&pairs.r2, &mut near, count);
            for k in 0..count {
                let [q, _] = pairs.r2[k].distance_from::<W::Arithmetic>(near[k]);
                let mut along = 0.0;
                for a in 0..D {
                    along += pairs.r[a][k] * u[a][k];
                }
                slope[k] = K::f::<_, D>(q);
                approach[k] = slope[k] * along;
            }
            if self.current.is_some() {
                self.hand_over(&pairs, &slope, handed.pressure());
            }
            let others = pairs.members.others(self.near);
            for n in 0..pairs.members.row_count() {
                let (head, lanes) = pairs.members.row_at(self.near, n);
                let mut sum = 0.0;
                for lane in lanes {
                    sum += approach[lane];
                    // SAFETY: blocks of one colour share no particle, and other != head.
                    unsafe { *self.work.slot(others[lane]) += approach[lane] };
                }
                // SAFETY: as above.
                unsafe { *self.work.slot(head) += sum };
            }
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
    for_each_block(grid, false, &|number| {
        run_wide(WorkTask::<K, D> {
            near: list.present(number),
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
