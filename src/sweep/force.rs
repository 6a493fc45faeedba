//! Pair forces: conservative (P_i/d_i^2 + P_j/d_j^2) F r_ij, drag and noise (physics/friction.rs).
//!
//! Each stage of a chunk is a task of its own, with no more types than it needs: what moves numbers
//! about is then compiled once for all kernels, and only `Compute` for each.

use std::marker::PhantomData;

use super::density::know_near;
use super::rows::{Companion, Noise, Pairs, ROOM, whole};
use super::tally::{BlockSums, PartLanes, Tally, Virial, add_outer};
use super::wide::LANES;
use super::{Shared, Task, Walk, Wide, for_each_block, run_wide};
use crate::domain::PeriodicBox;
use crate::kernel::Kernel;
use crate::neighbor::{BlockList, Grid, PairList, Rows};
use crate::physics::{FrictionForm, Kick};
use crate::random::{Arithmetic, SweepKey, Variate, inverse_root_with};
use crate::state::Particles;

/// The arrays of one chunk.
#[repr(align(64))] // vectors must not straddle cache lines
struct Lanes {
    pairs: Pairs,
    u: [[f64; ROOM]; 3],
    pressure: [f64; ROOM],
    noise: Noise<3>,
    force: [[f64; ROOM]; 3],
    records: [[f64; 4]; ROOM],
}

/// What a sweep reads.
struct Source<'a> {
    cell: &'a PeriodicBox,
    position: &'a [[f64; 4]],
    velocity: &'a [[f64; 4]],
    id: &'a [u64],
}

/// Fills the lanes from the list.
struct Gather<'a, const D: usize, const FRICTION: bool, const NOISE: bool> {
    source: &'a Source<'a>,
    near: &'a Rows,
    block: &'a BlockList,
    walk: &'a mut Walk,
    lanes: &'a mut Lanes,
}

/// Relative velocities, pressures and ids.
struct Motion<'a, W, const D: usize, const FRICTION: bool, const NOISE: bool> {
    source: &'a Source<'a>,
    head: [W; 4],
    id: u64,
    u: &'a mut [[f64; ROOM]; 3],
    pressure: &'a mut [f64; ROOM],
    noise: &'a mut Noise<3>,
}

impl<W: Wide, const D: usize, const FRICTION: bool, const NOISE: bool> Companion<W>
    for Motion<'_, W, D, FRICTION, NOISE>
{
    #[inline(always)]
    fn begin(&mut self, head: u32) {
        let [x, y, z, p] = self.source.velocity[head as usize];
        self.head = [W::splat(x), W::splat(y), W::splat(z), W::splat(p)];
        if NOISE {
            self.id = self.source.id[head as usize];
        }
    }

    #[inline(always)]
    unsafe fn take(&mut self, slots: &[u32; LANES], lane: usize) {
        // SAFETY: promised by the caller.
        unsafe {
            let other = W::columns(self.source.velocity.as_ptr(), slots);
            if FRICTION {
                for a in 0..D {
                    let u = self.head[a].minus(other[a]);
                    u.store(self.u[a].as_mut_ptr().add(lane));
                }
            }
            let pressure = self.head[3].plus(other[3]);
            pressure.store(self.pressure.as_mut_ptr().add(lane));
            if NOISE {
                let id = |n: usize| *self.source.id.get_unchecked(slots[n] as usize);
                let others = [id(0), id(1), id(2), id(3), id(4), id(5), id(6), id(7)];
                self.noise.name(self.id, others, lane);
            }
        }
    }
}

impl<const D: usize, const FRICTION: bool, const NOISE: bool> Task
    for Gather<'_, D, FRICTION, NOISE>
{
    type Output = ();

    #[inline(always)]
    fn run<W: Wide>(self) {
        let Lanes {
            pairs,
            u,
            pressure,
            noise,
            ..
        } = self.lanes;
        let mut motion = Motion::<W, D, FRICTION, NOISE> {
            source: self.source,
            head: [W::splat(0.0); 4],
            id: 0,
            u,
            pressure,
            noise,
        };
        let Source { cell, position, .. } = self.source;
        let near = (self.near, &self.block.slots[..]);
        pairs.fill::<W, D>(near, cell, position, self.walk, &mut motion);
    }
}

/// From separations, velocities and noise to forces.
struct Compute<'a, K, F, V, const D: usize, const CONSERVATIVE: bool> {
    lanes: &'a mut Lanes,
    kick: &'a Kick,
    form: PhantomData<(K, F, V)>,
}

/// F, its root, sqrt(g), g and 1/r of a pair.
struct Weights {
    slope: f64,
    root_g: f64,
    g: f64,
    inverse_r: f64,
}

impl Lanes {
    #[inline(always)]
    fn weights<K: Kernel, A: Arithmetic, const D: usize>(&self, k: usize) -> Weights {
        let r2 = self.pairs.r2[k];
        let inverse_r = inverse_root_with::<A>(if r2 > 1e-30 { r2 } else { 1e-30 });
        let (q, weight) = (r2 * inverse_r, self.pairs.weight[k]);
        let slope = K::f::<D>(q);
        Weights {
            slope,
            root_g: K::root_f::<D>(q) * weight,
            g: slope * (weight * weight),
            inverse_r,
        }
    }

    #[inline(always)]
    fn vector(lanes: &[[f64; ROOM]; 3], k: usize) -> [f64; 3] {
        [lanes[0][k], lanes[1][k], lanes[2][k]]
    }
}

impl<K: Kernel, F: FrictionForm, V: Variate, const D: usize, const CONSERVATIVE: bool> Task
    for Compute<'_, K, F, V, D, CONSERVATIVE>
{
    type Output = ();

    #[inline(always)]
    fn run<W: Wide>(self) {
        let lanes = self.lanes;
        let count = whole(lanes.pairs.count);
        for k in 0..count {
            let w = lanes.weights::<K, W::Arithmetic, D>(k);
            let r = Lanes::vector(&lanes.pairs.r, k);
            let mut f = [0.0; 3];
            if CONSERVATIVE {
                let push = lanes.pressure[k] * w.slope;
                f = r.map(|x| push * x);
            }
            if F::ON {
                let (u, xi) = (
                    Lanes::vector(&lanes.u, k),
                    Lanes::vector(&lanes.noise.xi, k),
                );
                let pair = self.kick.force::<F, W::Arithmetic>(
                    w.g,
                    w.root_g,
                    w.inverse_r,
                    r,
                    u,
                    xi,
                    V::ON,
                );
                for a in 0..D {
                    f[a] += pair[a];
                }
            }
            for a in 0..D {
                lanes.force[a][k] = f[a];
            }
        }
        for k in (0..count).step_by(LANES) {
            // SAFETY: both arrays hold eight from k on.
            unsafe {
                let x = W::load(lanes.force[0].as_ptr().add(k));
                let y = W::load(lanes.force[1].as_ptr().add(k));
                let z = W::load(lanes.force[2].as_ptr().add(k));
                W::records([x, y, z, W::splat(0.0)], lanes.records.as_mut_ptr().add(k));
            }
        }
    }
}

/// Gives the forces to the particles.
struct Scatter<'a> {
    lanes: &'a Lanes,
    force: &'a Shared<'a, [f64; 4]>,
}

impl Task for Scatter<'_> {
    type Output = ();

    #[inline(always)]
    fn run<W: Wide>(self) {
        // SAFETY: blocks of one colour share no particle.
        unsafe { self.lanes.pairs.scatter(&self.lanes.records, self.force) }
    }
}

/// Adds r (x) f to the sums: in all, or by part.
struct Sum<'a, K, F, V, const D: usize, const CONSERVATIVE: bool> {
    lanes: &'a mut Lanes,
    virial: &'a mut Virial,
    kick: &'a Kick,
    form: PhantomData<(K, F, V)>,
}

impl<K: Kernel, F: FrictionForm, V: Variate, const D: usize, const CONSERVATIVE: bool>
    Sum<'_, K, F, V, D, CONSERVATIVE>
{
    /// Forces once more, by part; those of all together are left as they are.
    #[inline(always)]
    fn split<A: Arithmetic>(lanes: &Lanes, kick: &Kick, parts: &mut PartLanes) {
        for k in 0..lanes.pairs.count.min(super::CHUNK) {
            let w = lanes.weights::<K, A, D>(k);
            let r = Lanes::vector(&lanes.pairs.r, k);
            if CONSERVATIVE {
                for a in 0..D {
                    parts.parts[0][a][k] = lanes.pressure[k] * w.slope * r[a];
                }
            }
            if F::ON {
                let (none, u) = ([0.0; 3], Lanes::vector(&lanes.u, k));
                let drag = kick.force::<F, A>(w.g, w.root_g, w.inverse_r, r, u, none, false);
                for a in 0..D {
                    parts.parts[1][a][k] = drag[a];
                }
                if V::ON {
                    let xi = Lanes::vector(&lanes.noise.xi, k);
                    let noise = kick.force::<F, A>(w.g, w.root_g, w.inverse_r, r, none, xi, true);
                    for a in 0..D {
                        parts.parts[2][a][k] = noise[a];
                    }
                }
            }
        }
    }
}

impl<K: Kernel, F: FrictionForm, V: Variate, const D: usize, const CONSERVATIVE: bool> Task
    for Sum<'_, K, F, V, D, CONSERVATIVE>
{
    type Output = ();

    #[inline(always)]
    fn run<W: Wide>(self) {
        let Lanes { pairs, force, .. } = self.lanes;
        let Virial { sum, parts } = self.virial;
        match parts {
            Some(parts) => {
                Self::split::<W::Arithmetic>(self.lanes, self.kick, parts);
                parts.add_to::<D, ROOM>(sum, &self.lanes.pairs.r, self.lanes.pairs.count);
            }
            None => add_outer::<D, ROOM, ROOM>(&mut sum[0], &pairs.r, force, pairs.count),
        }
    }
}

/// One block.
#[allow(clippy::too_many_arguments)]
fn sweep_block<K: Kernel, F: FrictionForm, V: Variate, const D: usize, const CONSERVATIVE: bool>(
    source: &Source<'_>,
    near: &Rows,
    block: &BlockList,
    force: &Shared<'_, [f64; 4]>,
    kick: &Kick,
    key: &SweepKey,
    sums: Option<BlockSums<'_>>,
    number: u32,
) {
    let zero = [[0.0; ROOM]; 3];
    let lanes = &mut Lanes {
        pairs: Pairs::new(),
        u: zero,
        pressure: [0.0; ROOM],
        noise: Noise::new(),
        force: zero,
        records: [[0.0; 4]; ROOM],
    };
    let walk = &mut Walk::default();
    let mut virial = sums.map(Virial::new);
    while !walk.at_end(&near.ends) {
        match (F::ON, V::ON) {
            (true, true) => gather::<D, true, true>(source, near, block, walk, lanes),
            (true, false) => gather::<D, true, false>(source, near, block, walk, lanes),
            _ => gather::<D, false, false>(source, near, block, walk, lanes),
        }
        if V::ON {
            lanes.noise.draw::<F, V, D>(key, lanes.pairs.count);
        }
        run_wide(Compute::<K, F, V, D, CONSERVATIVE> {
            lanes,
            kick,
            form: PhantomData,
        });
        run_wide(Scatter { lanes, force });
        if let Some(virial) = &mut virial {
            run_wide(Sum::<K, F, V, D, CONSERVATIVE> {
                lanes,
                virial,
                kick,
                form: PhantomData,
            });
        }
    }
    if let (Some(sums), Some(virial)) = (sums, virial) {
        // SAFETY: this block's own number.
        unsafe { sums.add(number, &virial.sum) };
    }
}

fn gather<const D: usize, const FRICTION: bool, const NOISE: bool>(
    source: &Source<'_>,
    near: &Rows,
    block: &BlockList,
    walk: &mut Walk,
    lanes: &mut Lanes,
) {
    run_wide(Gather::<D, FRICTION, NOISE> {
        source,
        near,
        block,
        walk,
        lanes,
    });
}

/// Sets `force` to the sum of the conservative force and, where their types are on, drag and noise.
#[allow(clippy::too_many_arguments)]
pub fn pair_forces<K: Kernel, F: FrictionForm, V: Variate, const D: usize>(
    particles: &mut Particles,
    grid: &Grid,
    list: &mut PairList,
    cell: &PeriodicBox,
    kick: Kick,
    key: SweepKey,
    mut tally: Option<&mut Tally>,
) {
    know_near::<K, D>(particles, grid, list, cell);
    let sums = tally.as_deref_mut().map(Tally::begin);
    particles.force.fill([0.0; 4]);
    let force = Shared::new(&mut particles.force);
    let source = Source {
        cell,
        position: &particles.position,
        velocity: &particles.velocity,
        id: &particles.id,
    };
    for_each_block(grid, &list.blocks, false, &|number, block| {
        let near = &list.near[number as usize];
        sweep_block::<K, F, V, D, true>(&source, near, block, &force, &kick, &key, sums, number);
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
    list: &mut PairList,
    cell: &PeriodicBox,
    kick: Kick,
    key: SweepKey,
    mut tally: Option<&mut Tally>,
) {
    know_near::<K, D>(particles, grid, list, cell);
    let sums = tally.as_deref_mut().map(Tally::begin);
    particles.drag.fill([0.0; 4]);
    let force = Shared::new(&mut particles.drag);
    let source = Source {
        cell,
        position: &particles.position,
        velocity: &particles.scratch,
        id: &particles.id,
    };
    for_each_block(grid, &list.blocks, false, &|number, block| {
        let near = &list.near[number as usize];
        sweep_block::<K, F, V, D, false>(&source, near, block, &force, &kick, &key, sums, number);
    });
    if let Some(tally) = tally {
        tally.keep_correction();
    }
}
