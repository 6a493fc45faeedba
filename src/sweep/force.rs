//! Pair forces: conservative (P_i/d_i^2 + P_j/d_j^2) F r_ij, drag and noise (physics/friction.rs).
//!
//! Each stage of a chunk is a task of its own, with no more types than it needs: what moves numbers
//! about is then compiled once for all kernels, and only `Weigh` for each.

use std::marker::PhantomData;

use super::noise::{Noise, ParticleWords, particle_words};
use super::precision::{Copies, Precision, States};
use super::rows::{Companion, Ends, Geometry, Pairs, ROOM, whole};
use super::tally::{BlockSums, Exchanged, PartLanes, Tally, Tensor, Virial, add_outer};
use super::wide::Vector;
use super::{Shared, Task, Wide, fetch, for_each_block_with, run_wide};
use crate::domain::PeriodicBox;
use crate::kernel::Kernel;
use crate::neighbor::{Grid, PairList, Rows};
use crate::physics::{FrictionForm, General, Kick};
use crate::random::{SweepKey, Variate};
use crate::real::{Arithmetic, Real, near_inverse_roots};
use crate::state::Particles;

/// The arrays of one chunk. What takes the place of another number takes its lane: the fewer arrays, the
/// more of the particles' records stay in the first-level cache.
#[repr(align(64))] // vectors must not straddle cache lines
struct Lanes<P: Precision> {
    /// With sqrt(g) where there is noise, else g, in the place of weights once these are of no more use.
    pairs: Pairs<P>,
    /// u_ij, in the end the force.
    u: [[P::Real; ROOM]; 3],
    /// P_i/d_i^2 + P_j/d_j^2, then the factor of r that it makes.
    push: [P::Real; ROOM],
    noise: Noise<3, P::Real>,
    /// 1/r, nearly and well.
    near: [f32; ROOM],
    inverse_r: [P::Real; ROOM],
}

impl<P: Precision> Lanes<P> {
    fn new() -> Self {
        let zero = [P::Real::ZERO; ROOM];
        Self {
            pairs: Pairs::new(),
            u: [zero; 3],
            push: zero,
            noise: Noise::new(),
            near: [0.0; ROOM],
            inverse_r: zero,
        }
    }
}

/// What a sweep reads.
struct Source<'a, R> {
    cell: &'a PeriodicBox,
    states: States<'a, R>,
    /// Words of the particles, where there is noise.
    word: &'a [u32],
}

/// Fills the lanes from the list.
struct Gather<'a, P: Precision, const D: usize, const FRICTION: bool, const NOISE: bool> {
    source: &'a Source<'a, P::Real>,
    near: &'a Rows,
    lanes: &'a mut Lanes<P>,
}

/// Geometry, relative velocities, pressures and words.
struct All<'a, P, W, const D: usize, const FRICTION: bool, const NOISE: bool>
where
    P: Precision,
    W: Wide,
{
    source: &'a Source<'a, P::Real>,
    geometry: Geometry<'a, P, W, D>,
    u: &'a mut [[P::Real; ROOM]; 3],
    pressure: &'a mut [P::Real; ROOM],
    noise: &'a mut Noise<3, P::Real>,
}

impl<P, W, const D: usize, const FRICTION: bool, const NOISE: bool>
    All<'_, P, W, D, FRICTION, NOISE>
where
    P: Precision,
    W: Wide,
{
    /// From the columns of the records of velocities.
    ///
    /// # Safety
    /// There are lanes for a vector.
    #[inline(always)]
    unsafe fn put(&mut self, here: &[P::Vector<W>; 4], there: &[P::Vector<W>; 4], lane: usize) {
        // SAFETY: promised by the caller.
        unsafe {
            if FRICTION {
                for a in 0..D {
                    let u = here[a].minus(there[a]);
                    u.store(self.u[a].as_mut_ptr().add(lane));
                }
            }
            let pressure = here[3].plus(there[3]);
            pressure.store(self.pressure.as_mut_ptr().add(lane));
        }
    }
}

impl<P, W, const D: usize, const FRICTION: bool, const NOISE: bool> Companion<P::Vector<W>>
    for All<'_, P, W, D, FRICTION, NOISE>
where
    P: Precision,
    W: Wide,
{
    #[inline(always)]
    unsafe fn take(&mut self, ends: &Ends<'_>, lane: usize) {
        let states = &self.source.states;
        // SAFETY: promised by the caller.
        unsafe {
            if P::TOGETHER {
                let here = ends.of_heads_twice::<P::Vector<W>>(states.first());
                let there = ends.of_others_twice::<P::Vector<W>>(states.first());
                self.geometry.put(&here[0], &there[0], lane);
                self.put(&here[1], &there[1], lane);
            } else {
                let (here, there) = (ends.of_heads(states.place), ends.of_others(states.place));
                self.geometry.put(&here, &there, lane);
                let (here, there) = (ends.of_heads(states.motion), ends.of_others(states.motion));
                self.put(&here, &there, lane);
            }
            if NOISE {
                self.noise
                    .take::<P::Vector<W>>(self.source.word, ends, lane);
            }
        }
    }
}

impl<P: Precision, const D: usize, const FRICTION: bool, const NOISE: bool> Task
    for Gather<'_, P, D, FRICTION, NOISE>
{
    type Output = ();

    #[inline(always)]
    fn run<W: Wide>(self) {
        let Lanes {
            pairs,
            u,
            push: pressure,
            noise,
            ..
        } = self.lanes;
        let (members, geometry) = pairs.parts::<W, D>(self.source.cell);
        let mut all = All::<P, W, D, FRICTION, NOISE> {
            source: self.source,
            geometry,
            u,
            pressure,
            noise,
        };
        members.fill(self.near, &mut all);
    }
}

/// From distances to what does not depend on directions.
struct Weigh<'a, K, P: Precision, const D: usize, const CONSERVATIVE: bool, const NOISE: bool> {
    lanes: &'a mut Lanes<P>,
    kernel: PhantomData<K>,
}

impl<K, P, const D: usize, const CONSERVATIVE: bool, const NOISE: bool> Task
    for Weigh<'_, K, P, D, CONSERVATIVE, NOISE>
where
    K: Kernel,
    P: Precision,
{
    type Output = ();

    #[inline(always)]
    fn run<W: Wide>(self) {
        let lanes = self.lanes;
        let count = whole::<P::Real>(lanes.pairs.members.count);
        near_inverse_roots(&lanes.pairs.r2, &mut lanes.near, count);
        for k in 0..count {
            let (r2, weight) = (lanes.pairs.r2[k], lanes.pairs.weight[k]);
            let [q, inverse_r] = r2.distance_from::<W::Arithmetic>(lanes.near[k]);
            let slope = K::f::<_, D>(q);
            lanes.push[k] = if CONSERVATIVE {
                lanes.push[k] * slope
            } else {
                P::Real::ZERO
            };
            lanes.pairs.weight[k] = if NOISE {
                K::root_f::<_, D>(q) * weight
            } else {
                slope * (weight * weight)
            };
            lanes.inverse_r[k] = inverse_r;
        }
    }
}

impl<P: Precision> Lanes<P> {
    /// The force of a pair, or parts of it: with `push` or 0, with or without `noise`.
    #[inline(always)]
    fn force_of<F: FrictionForm, A: Arithmetic, const NOISE: bool>(
        &self,
        kick: &Kick,
        push: P::Real,
        u: [P::Real; 3],
        xi: Option<[P::Real; 3]>,
        k: usize,
    ) -> [P::Real; 3] {
        let grip = self.pairs.weight[k];
        let g = if NOISE { grip * grip } else { grip };
        kick.force::<F, A, P::Real>(
            push,
            g,
            grip,
            self.inverse_r[k],
            Self::vector(&self.pairs.r, k),
            u,
            xi.unwrap_or([P::Real::ZERO; 3]),
            xi.is_some(),
        )
    }

    #[inline(always)]
    fn vector(lanes: &[[P::Real; ROOM]; 3], k: usize) -> [P::Real; 3] {
        [lanes[0][k], lanes[1][k], lanes[2][k]]
    }
}

/// From weights, directions, velocities and noise to forces. In a loop of its own: a machine has too few
/// turns of a long one in hand to keep busy.
struct Compute<'a, F, P: Precision, const D: usize, const NOISE: bool> {
    lanes: &'a mut Lanes<P>,
    kick: &'a Kick,
    form: PhantomData<F>,
}

impl<F: FrictionForm, P: Precision, const D: usize, const NOISE: bool> Task
    for Compute<'_, F, P, D, NOISE>
{
    type Output = ();

    #[inline(always)]
    fn run<W: Wide>(self) {
        let lanes = self.lanes;
        for k in 0..whole::<P::Real>(lanes.pairs.members.count) {
            let push = lanes.push[k];
            let f = if F::ON {
                let u = Lanes::<P>::vector(&lanes.u, k);
                let xi = NOISE.then(|| Lanes::<P>::vector(&lanes.noise.xi, k));
                lanes.force_of::<F, W::Arithmetic, NOISE>(self.kick, push, u, xi, k)
            } else {
                Lanes::<P>::vector(&lanes.pairs.r, k).map(|x| push * x)
            };
            for a in 0..D {
                lanes.u[a][k] = f[a];
            }
        }
    }
}

/// Gives the forces to the particles.
struct Scatter<'a, P: Precision> {
    lanes: &'a Lanes<P>,
    near: &'a Rows,
    force: &'a Shared<'a, [f64; 4]>,
}

impl<P: Precision> Task for Scatter<'_, P> {
    type Output = ();

    #[inline(always)]
    fn run<W: Wide>(self) {
        let lanes = self.lanes;
        // SAFETY: blocks of one colour share no particle.
        unsafe {
            lanes.pairs.scatter::<W>(self.near, &lanes.u, self.force);
        }
    }
}

/// Adds r (x) f to the sums.
struct Sum<'a, P: Precision, const D: usize> {
    lanes: &'a mut Lanes<P>,
    sum: &'a mut Tensor,
}

impl<P: Precision, const D: usize> Task for Sum<'_, P, D> {
    type Output = ();

    #[inline(always)]
    fn run<W: Wide>(self) {
        let Lanes { pairs, u, .. } = self.lanes;
        add_outer::<D, ROOM, ROOM, _, _>(self.sum, &pairs.r, u, pairs.members.count);
    }
}

/// Adds r (x) f to the sums by part, before f is computed as a whole.
struct SumParts<'a, F, P: Precision, const D: usize, const CONSERVATIVE: bool, const NOISE: bool> {
    lanes: &'a Lanes<P>,
    sum: &'a mut Exchanged,
    parts: &'a mut PartLanes,
    kick: &'a Kick,
    form: PhantomData<F>,
}

impl<F, P, const D: usize, const CONSERVATIVE: bool, const NOISE: bool>
    SumParts<'_, F, P, D, CONSERVATIVE, NOISE>
where
    F: FrictionForm,
    P: Precision,
{
    #[inline(always)]
    fn split<A: Arithmetic>(lanes: &Lanes<P>, kick: &Kick, parts: &mut PartLanes) {
        let zero = P::Real::ZERO;
        for k in 0..lanes.pairs.members.count.min(super::CHUNK) {
            if CONSERVATIVE {
                let r = Lanes::<P>::vector(&lanes.pairs.r, k);
                for a in 0..D {
                    parts.parts[0][a][k] = (lanes.push[k] * r[a]).double();
                }
            }
            if F::ON {
                let u = Lanes::<P>::vector(&lanes.u, k);
                let drag = lanes.force_of::<F, A, NOISE>(kick, zero, u, None, k);
                for a in 0..D {
                    parts.parts[1][a][k] = drag[a].double();
                }
                if NOISE {
                    let xi = Some(Lanes::<P>::vector(&lanes.noise.xi, k));
                    let noise = lanes.force_of::<F, A, NOISE>(kick, zero, [zero; 3], xi, k);
                    for a in 0..D {
                        parts.parts[2][a][k] = noise[a].double();
                    }
                }
            }
        }
    }
}

impl<F, P, const D: usize, const CONSERVATIVE: bool, const NOISE: bool> Task
    for SumParts<'_, F, P, D, CONSERVATIVE, NOISE>
where
    F: FrictionForm,
    P: Precision,
{
    type Output = ();

    #[inline(always)]
    fn run<W: Wide>(self) {
        let Self {
            lanes, sum, parts, ..
        } = self;
        Self::split::<W::Arithmetic>(lanes, self.kick, parts);
        parts.add_to::<D, ROOM, _>(sum, &lanes.pairs.r, lanes.pairs.members.count);
    }
}

/// One block.
#[allow(clippy::too_many_arguments)]
fn sweep_block<K, F, V, P, const D: usize, const CONSERVATIVE: bool>(
    source: &Source<'_, P::Real>,
    near: &Rows,
    force: &Shared<'_, [f64; 4]>,
    kick: &Kick,
    sums: Option<BlockSums<'_>>,
    number: u32,
    lanes: &mut Lanes<P>,
) where
    K: Kernel,
    F: FrictionForm,
    V: Variate,
    P: Precision,
{
    let mut virial = sums.map(Virial::new);
    lanes.pairs.members.rewind();
    while lanes.pairs.members.has_more(near) {
        match (F::ON, V::ON) {
            (true, true) => gather::<P, D, true, true>(source, near, lanes),
            (true, false) => gather::<P, D, true, false>(source, near, lanes),
            _ => gather::<P, D, false, false>(source, near, lanes),
        }
        if V::ON {
            lanes
                .noise
                .draw::<F, V, D>(ParticleWords, lanes.pairs.members.count);
            finish::<K, F, P, D, CONSERVATIVE, true>(lanes, near, kick, force, &mut virial);
        } else {
            finish::<K, F, P, D, CONSERVATIVE, false>(lanes, near, kick, force, &mut virial);
        }
    }
    if let (Some(sums), Some(virial)) = (sums, virial) {
        // SAFETY: this block's own number.
        unsafe { sums.add(number, &virial.sum) };
    }
}

fn gather<P: Precision, const D: usize, const FRICTION: bool, const NOISE: bool>(
    source: &Source<'_, P::Real>,
    near: &Rows,
    lanes: &mut Lanes<P>,
) {
    run_wide(Gather::<P, D, FRICTION, NOISE> {
        source,
        near,
        lanes,
    });
}

/// From filled lanes to the forces of particles. How noise was drawn is no matter here.
fn finish<K, F, P, const D: usize, const CONSERVATIVE: bool, const NOISE: bool>(
    lanes: &mut Lanes<P>,
    near: &Rows,
    kick: &Kick,
    force: &Shared<'_, [f64; 4]>,
    virial: &mut Option<Virial>,
) where
    K: Kernel,
    F: FrictionForm,
    P: Precision,
{
    run_wide(Weigh::<K, P, D, CONSERVATIVE, NOISE> {
        lanes,
        kernel: PhantomData,
    });
    if let Some(Virial {
        sum,
        parts: Some(parts),
    }) = virial
    {
        run_wide(SumParts::<F, P, D, CONSERVATIVE, NOISE> {
            lanes,
            sum,
            parts,
            kick,
            form: PhantomData,
        });
    }
    run_wide(Compute::<F, P, D, NOISE> {
        lanes,
        kick,
        form: PhantomData,
    });
    run_wide(Scatter { lanes, near, force });
    if let Some(Virial { sum, parts: None }) = virial {
        let sum = &mut sum[0];
        run_wide(Sum::<P, D> { lanes, sum });
    }
}

/// Adds the forces of all pairs to those of the particles, which are 0: of the `velocity` that is given, and of
/// pressures where `CONSERVATIVE`.
#[allow(clippy::too_many_arguments)]
fn sweep<K, F, V, P, const D: usize, const CONSERVATIVE: bool>(
    force: &mut [[f64; 4]],
    [position, velocity]: [&[[f64; 4]]; 2],
    id: &[u64],
    copies: &mut Copies,
    grid: &Grid,
    list: &PairList,
    cell: &PeriodicBox,
    (kick, key): (Kick, SweepKey),
    sums: Option<BlockSums<'_>>,
) where
    K: Kernel,
    F: FrictionForm,
    V: Variate,
    P: Precision,
{
    let force = Shared::new(force);
    let present = std::mem::take(&mut copies.twice_is_present) && CONSERVATIVE;
    let source = Source {
        cell,
        states: P::states([position, velocity], cell, &mut copies.twice, present),
        word: if V::ON {
            particle_words(&key, id, &mut copies.words)
        } else {
            &[]
        },
    };
    for_each_block_with(grid, &list.blocks, false, Lanes::new, |lanes, turn| {
        let States {
            place,
            motion,
            twice,
        } = &source.states;
        fetch(&turn, place.as_ptr(), place.len());
        fetch(&turn, motion.as_ptr(), motion.len());
        fetch(&turn, twice.as_ptr(), twice.len());
        fetch(&turn, force.pointer(), force.length);
        if V::ON {
            fetch(&turn, source.word.as_ptr(), source.word.len());
        }
        sweep_block::<K, F, V, P, D, CONSERVATIVE>(
            &source,
            list.present(turn.number),
            &force,
            &kick,
            sums,
            turn.number,
            lanes,
        );
    });
}

/// Sets `force` to the sum of the conservative force and, where their types are on, drag and noise.
#[allow(clippy::too_many_arguments)]
pub fn pair_forces<K: Kernel, F: FrictionForm, V: Variate, P: Precision, const D: usize>(
    particles: &mut Particles,
    grid: &Grid,
    list: &PairList,
    cell: &PeriodicBox,
    kick: Kick,
    key: SweepKey,
    mut tally: Option<&mut Tally>,
) {
    let sums = tally.as_deref_mut().map(Tally::begin);
    let Particles {
        position,
        velocity,
        force,
        force_is_zero,
        id,
        copies,
        ..
    } = particles;
    if !std::mem::take(force_is_zero) {
        force.fill([0.0; 4]);
    }
    debug_assert!(force.iter().all(|f| *f == [0.0; 4]));
    let state = [&position[..], &velocity[..]];
    let process = (kick, key);
    sweep::<K, F, V, P, D, true>(force, state, id, copies, grid, list, cell, process, sums);
    if let Some(tally) = tally {
        tally.keep_force();
    }
}

/// Sets `drag` to drag and noise alone, where their types are on, with `particles.scratch` in the
/// place of the velocities: the drag is linear in them, so a difference of velocities gives the
/// difference of the forces.
#[allow(clippy::too_many_arguments)]
pub fn drag_forces<K: Kernel, F: FrictionForm, V: Variate, P: Precision, const D: usize>(
    particles: &mut Particles,
    grid: &Grid,
    list: &PairList,
    cell: &PeriodicBox,
    kick: Kick,
    key: SweepKey,
    mut tally: Option<&mut Tally>,
) {
    let sums = tally.as_deref_mut().map(Tally::begin);
    let Particles {
        position,
        drag,
        scratch,
        id,
        copies,
        ..
    } = particles;
    drag.fill([0.0; 4]);
    let state = [&position[..], &scratch[..]];
    let process = (kick, key);
    sweep::<K, F, V, P, D, false>(drag, state, id, copies, grid, list, cell, process, sums);
    if let Some(tally) = tally {
        tally.keep_correction();
    }
}

/// The variates of pairs of ids in a sweep of that key, as they act on the first ones: for checks.
pub fn force_variates<V: Variate>(key: &SweepKey, pairs: &[[u64; 2]]) -> Vec<[f64; 3]> {
    let mut all = Vec::with_capacity(pairs.len());
    let mut noise = Noise::<3>::new();
    for some in pairs.chunks(super::CHUNK) {
        for (lane, ids) in some.iter().enumerate() {
            noise.take_pair(lane, ids.map(|id| key.particle_word(id)));
        }
        noise.draw::<General, V, 3>(ParticleWords, some.len());
        all.extend((0..some.len()).map(|lane| noise.xi.map(|xi| xi[lane])));
    }
    all
}
