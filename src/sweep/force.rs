//! Pair forces: conservative (P_i/d_i^2 + P_j/d_j^2) F r_ij, drag and noise (physics/friction.rs).

use std::marker::PhantomData;

use super::tally::{BlockSums, Exchanged, PartLanes, Tally, Virial, add_outer};
use super::{CHUNK, Shared, Task, Walk, for_each_block, padded, run_wide};
use crate::domain::PeriodicBox;
use crate::kernel::Kernel;
use crate::neighbor::{BlockList, Grid, PairList};
use crate::physics::{FrictionForm, Kick};
use crate::random::{SweepKey, Variate, pair_counter, philox4x32_lanes};
use crate::state::Particles;

/// The arrays of one chunk. Only pairs within the support get a lane; pairs in the skin do not.
#[repr(align(64))] // vectors must not straddle cache lines
struct Lanes {
    head: [u32; CHUNK],
    other: [u32; CHUNK],
    r: [[f64; CHUNK]; 3],
    r2: [f64; CHUNK],
    u: [[f64; CHUNK]; 3],
    weight: [f64; CHUNK],
    pressure: [f64; CHUNK],
    low: [u64; CHUNK],
    high: [u64; CHUNK],
    sign: [f64; CHUNK],
    xi: [[f64; CHUNK]; 3],
    force: [[f64; CHUNK]; 3],
}

struct ForceTask<'a, K, F, V, const D: usize, const CONSERVATIVE: bool> {
    block: &'a BlockList,
    cell: &'a PeriodicBox,
    position: &'a [[f64; 4]],
    velocity: &'a [[f64; 4]],
    id: &'a [u64],
    force: Shared<'a, [f64; 4]>,
    kick: Kick,
    key: SweepKey,
    number: u32,
    tally: Option<BlockSums<'a>>,
    form: PhantomData<(K, F, V)>,
}

impl<K: Kernel, F: FrictionForm, V: Variate, const D: usize, const CONSERVATIVE: bool>
    ForceTask<'_, K, F, V, D, CONSERVATIVE>
{
    /// Fills the lanes from the list; returns how many are in use, 0 at the end of the list.
    #[inline(always)]
    fn gather(&self, lanes: &mut Lanes, walk: &mut Walk) -> usize {
        walk.fill(self.block, |count, head, partners| {
            self.gather_row(lanes, count, head, partners)
        })
    }

    #[inline(always)]
    fn gather_row(&self, lanes: &mut Lanes, first: usize, head: u32, partners: &[u16]) -> usize {
        let slots = &self.block.slots[..];
        let i = self.position[head as usize];
        let v = self.velocity[head as usize];
        let id = if V::ON { self.id[head as usize] } else { 0 };
        let mut at = first;
        for &place in partners {
            let other = slots[place as usize];
            // SAFETY: list entries lead to slots of particles.
            let (j, w) = unsafe {
                (
                    self.position.get_unchecked(other as usize),
                    self.velocity.get_unchecked(other as usize),
                )
            };
            let r = self
                .cell
                .nearest::<D>([i[0] - j[0], i[1] - j[1], i[2] - j[2]]);
            let mut r2 = r[0] * r[0] + r[1] * r[1];
            if D == 3 {
                r2 += r[2] * r[2];
            }
            // Callers leave room for all partners, so `at` stays within the arrays; the mask only
            // tells the compiler so.
            let lane = at & (CHUNK - 1);
            lanes.head[lane] = head;
            lanes.other[lane] = other;
            for a in 0..D {
                lanes.r[a][lane] = r[a];
            }
            lanes.r2[lane] = r2;
            if F::ON {
                for a in 0..D {
                    lanes.u[a][lane] = v[a] - w[a];
                }
                lanes.weight[lane] = i[3] * j[3];
            }
            if CONSERVATIVE {
                lanes.pressure[lane] = v[3] + w[3];
            }
            if V::ON {
                // SAFETY: as above.
                let other_id = unsafe { *self.id.get_unchecked(other as usize) };
                let [low, high] = pair_counter(id, other_id);
                lanes.low[lane] = low;
                lanes.high[lane] = high;
                lanes.sign[lane] = if id < other_id { 1.0 } else { -1.0 };
            }
            at += usize::from(r2 < 1.0);
        }
        at
    }

    #[inline(always)]
    fn draw(&self, lanes: &mut Lanes, count: usize) {
        for k in 0..padded(count) {
            let counter = [
                lanes.low[k],
                lanes.high[k],
                self.key.tail[0],
                self.key.tail[1],
            ];
            let words = philox4x32_lanes(counter, self.key.key);
            let xi = V::draw(words, if F::CENTRAL { 1 } else { D });
            let sign = if F::CENTRAL { 1.0 } else { lanes.sign[k] };
            for a in 0..if F::CENTRAL { 1 } else { D } {
                lanes.xi[a][k] = sign * xi[a];
            }
        }
    }

    #[inline(always)]
    fn compute(&self, lanes: &mut Lanes, count: usize) {
        for k in 0..padded(count) {
            let r = [lanes.r[0][k], lanes.r[1][k], lanes.r[2][k]];
            let r2 = lanes.r2[k];
            let slope = K::f::<D>(r2.sqrt());
            let mut f = [0.0; 3];
            if CONSERVATIVE {
                f = r.map(|x| lanes.pressure[k] * slope * x);
            }
            if F::ON {
                let weight = lanes.weight[k];
                let inverse_r2 = 1.0 / if r2 > 1e-60 { r2 } else { 1e-60 };
                let u = [lanes.u[0][k], lanes.u[1][k], lanes.u[2][k]];
                let xi = [lanes.xi[0][k], lanes.xi[1][k], lanes.xi[2][k]];
                let g = slope * (weight * weight);
                let pair = self.kick.force::<F>(g, inverse_r2, r, u, xi, V::ON);
                for a in 0..D {
                    f[a] += pair[a];
                }
            }
            for a in 0..D {
                lanes.force[a][k] = f[a];
            }
        }
    }

    /// Adds r (x) f by part to `sum`; the forces themselves are left as they are.
    #[inline(always)]
    fn add_virial(&self, lanes: &Lanes, count: usize, parts: &mut PartLanes, sum: &mut Exchanged) {
        for k in 0..padded(count) {
            let r = [lanes.r[0][k], lanes.r[1][k], lanes.r[2][k]];
            let r2 = lanes.r2[k];
            let slope = K::f::<D>(r2.sqrt());
            if CONSERVATIVE {
                for a in 0..D {
                    parts.parts[0][a][k] = lanes.pressure[k] * slope * r[a];
                }
            }
            if F::ON {
                let weight = lanes.weight[k];
                let inverse_r2 = 1.0 / if r2 > 1e-60 { r2 } else { 1e-60 };
                let g = slope * (weight * weight);
                let u = [lanes.u[0][k], lanes.u[1][k], lanes.u[2][k]];
                let drag = self.kick.force::<F>(g, inverse_r2, r, u, [0.0; 3], false);
                for a in 0..D {
                    parts.parts[1][a][k] = drag[a];
                }
                if V::ON {
                    let xi = [lanes.xi[0][k], lanes.xi[1][k], lanes.xi[2][k]];
                    let noise = self.kick.force::<F>(g, inverse_r2, r, [0.0; 3], xi, true);
                    for a in 0..D {
                        parts.parts[2][a][k] = noise[a];
                    }
                }
            }
        }
        parts.add_to::<D>(sum, &lanes.r, count);
    }

    #[inline(always)]
    fn scatter(&self, lanes: &Lanes, count: usize) {
        let mut k = 0;
        while k < count {
            let head = lanes.head[k];
            let mut sum = [0.0; D];
            while k < count && lanes.head[k] == head {
                // SAFETY: blocks of one colour share no particle, and other != head.
                let target = unsafe { self.force.slot(lanes.other[k]) };
                for a in 0..D {
                    let f = lanes.force[a][k];
                    sum[a] += f;
                    target[a] -= f;
                }
                k += 1;
            }
            // SAFETY: as above.
            let target = unsafe { self.force.slot(head) };
            for a in 0..D {
                target[a] += sum[a];
            }
        }
    }
}

impl<K: Kernel, F: FrictionForm, V: Variate, const D: usize, const CONSERVATIVE: bool> Task
    for ForceTask<'_, K, F, V, D, CONSERVATIVE>
{
    #[inline(always)]
    fn run(self) {
        let zero = [[0.0; CHUNK]; 3];
        let mut lanes = Lanes {
            head: [0; CHUNK],
            other: [0; CHUNK],
            r: zero,
            r2: [0.0; CHUNK],
            u: zero,
            weight: [0.0; CHUNK],
            pressure: [0.0; CHUNK],
            low: [0; CHUNK],
            high: [0; CHUNK],
            sign: [0.0; CHUNK],
            xi: zero,
            force: zero,
        };
        let mut walk = Walk::default();
        let mut virial = self.tally.map(Virial::new);
        loop {
            let count = self.gather(&mut lanes, &mut walk);
            if V::ON {
                self.draw(&mut lanes, count);
            }
            self.compute(&mut lanes, count);
            self.scatter(&lanes, count);
            if let Some(Virial { sum, parts }) = &mut virial {
                match parts {
                    Some(parts) => self.add_virial(&lanes, count, parts, sum),
                    None => add_outer::<D>(&mut sum[0], &lanes.r, &mut lanes.force, count),
                }
            }
            if walk.at_end(self.block) {
                break;
            }
        }
        if let (Some(sums), Some(virial)) = (self.tally, virial) {
            // SAFETY: this block's own number.
            unsafe { sums.add(self.number, &virial.sum) };
        }
    }
}

/// Sets `force` to the sum of the conservative force and, where their types are on, drag and noise.
#[allow(clippy::too_many_arguments)]
pub fn pair_forces<K: Kernel, F: FrictionForm, V: Variate, const D: usize>(
    particles: &mut Particles,
    grid: &Grid,
    list: &PairList,
    cell: &PeriodicBox,
    kick: Kick,
    key: SweepKey,
    mut tally: Option<&mut Tally>,
) {
    let sums = tally.as_deref_mut().map(Tally::begin);
    particles.force.fill([0.0; 4]);
    let force = Shared::new(&mut particles.force);
    let (position, velocity, id) = (&particles.position, &particles.velocity, &particles.id);
    for_each_block(grid, list, false, &|number, block| {
        run_wide(ForceTask::<K, F, V, D, true> {
            block,
            cell,
            position,
            velocity,
            id,
            force,
            kick,
            key,
            number,
            tally: sums,
            form: PhantomData,
        });
    });
    if let Some(tally) = tally {
        tally.keep_force();
    }
}

/// Sets `drag` to drag and noise alone, where their types are on, with `particles.scratch` in the
/// place of the velocities: the drag is linear in them, so a difference of velocities gives the
/// difference of the forces.
#[allow(clippy::too_many_arguments)]
pub fn drag_forces<K: Kernel, F: FrictionForm, V: Variate, const D: usize>(
    particles: &mut Particles,
    grid: &Grid,
    list: &PairList,
    cell: &PeriodicBox,
    kick: Kick,
    key: SweepKey,
    mut tally: Option<&mut Tally>,
) {
    let sums = tally.as_deref_mut().map(Tally::begin);
    particles.drag.fill([0.0; 4]);
    let force = Shared::new(&mut particles.drag);
    let (position, velocity, id) = (&particles.position, &particles.scratch, &particles.id);
    for_each_block(grid, list, false, &|number, block| {
        run_wide(ForceTask::<K, F, V, D, false> {
            block,
            cell,
            position,
            velocity,
            id,
            force,
            kick,
            key,
            number,
            tally: sums,
            form: PhantomData,
        });
    });
    if let Some(tally) = tally {
        tally.keep_correction();
    }
}
