//! Wall models to compare with: one file each. Each near particle gathers what it feels from images
//! or frozen particles and writes to itself only, so that sums have one order on any number of
//! threads; the walls get the reaction. Kernel, friction and noise come as functions: these sweeps
//! are compiled once, not for every combination.

mod completion;
mod frozen;
mod own_foot;

use rayon::prelude::*;

use super::wall::cross;
use super::wall_force::Motion;
use super::{Direction, Shared};
use crate::domain::PeriodicBox;
use crate::kernel::Kernel;
use crate::neighbor::Grid;
use crate::physics::{Exchange, FrictionForm, Kick};
use crate::random::{SweepKey, Variate};
use crate::real::Plain;
use crate::state::Particles;
use crate::wall::{Near, OwnImages, Site, TASK, WallModel, Walls, Wrench};

/// Squared distances below this have no direction.
const POINT: f64 = 1e-24;

type PairForce = fn(&Kick, f64, f64, [f64; 3], [f64; 3], [f64; 3], bool) -> [f64; 3];
type PairExchange = fn(&Exchange, f64, f64, [f64; 3], [f64; 3], [f64; 3], bool) -> [f64; 3];

/// The physics of a combination.
#[derive(Clone, Copy)]
pub(super) struct Physics {
    dimension: usize,
    f: fn(f64) -> f64,
    friction: bool,
    central: bool,
    noise: bool,
    force: PairForce,
    exchange: PairExchange,
    draw: fn([u64; 4], f64, usize) -> [f64; 3],
}

impl Physics {
    pub fn of<K: Kernel, F: FrictionForm, V: Variate, const D: usize>() -> Self {
        Self {
            dimension: D,
            f: K::f::<_, D>,
            friction: F::ON,
            central: F::CENTRAL,
            noise: V::ON,
            force: Kick::single_force::<F>,
            exchange: Exchange::one_sided::<F>,
            draw: V::draw::<Plain, f64>,
        }
    }

    /// Variates of an ordered pair of ids: `labels` for a <= b and for a > b.
    fn variates(&self, key: SweepKey, labels: [u8; 2], a: u64, b: u64) -> [f64; 3] {
        let label = labels[usize::from(a > b)];
        let xi = (self.draw)(key.of_image(label).pair_words(a, b), 1.0, self.dimension);
        std::array::from_fn(|k| if k < self.dimension { xi[k] } else { 0.0 })
    }
}

/// What a force sweep is for.
#[derive(Clone, Copy)]
pub(super) struct Request {
    pub physics: Physics,
    pub kick: Kick,
    pub key: SweepKey,
    pub motion: Motion,
    pub conservative: bool,
}

/// The arrays that a force sweep reads.
#[derive(Clone, Copy)]
pub(super) struct Arrays<'a> {
    pub position: &'a [[f64; 4]],
    pub velocity: &'a [[f64; 4]],
    pub id: &'a [u64],
}

impl Arrays<'_> {
    fn velocity(&self, slot: u32) -> [f64; 3] {
        let v = &self.velocity[slot as usize];
        [v[0], v[1], v[2]]
    }
}

/// Separation, and its square, where images may lie beyond the box.
fn separation(
    one: &[f64; 4],
    other: &[f64; 3],
    dimension: usize,
    cell: &PeriodicBox,
) -> ([f64; 3], f64) {
    let mut r = [0.0; 3];
    let mut r2 = 0.0;
    for a in 0..dimension {
        r[a] = cell.separation(a, one[a] - other[a]);
        r2 += r[a] * r[a];
    }
    (r, r2)
}

/// The wall of a site gets -f, a change of momentum of its particle, with its torque.
fn react(site: &Site, f: [f64; 3], tally: &mut [Wrench]) {
    let torque = cross(site.foot.arm, f);
    let wrench = &mut tally[site.wall as usize];
    for a in 0..3 {
        wrench[a] -= f[a];
        wrench[3 + a] -= torque[a];
    }
}

/// Velocity of the wall of a site in a sweep.
fn wall_velocity(site: &Site, motion: Motion) -> [f64; 3] {
    match motion {
        Motion::Actual => site.foot.velocity,
        Motion::Difference => [0.0; 3],
    }
}

/// Calls `work(number of the near particle, particle, sums of its task)` for every near particle.
fn for_each_near(
    near: &[Near],
    tasks: &mut [OwnImages],
    work: &(dyn Fn(usize, &Near, &mut [Wrench]) + Sync),
) {
    near.par_chunks(TASK)
        .enumerate()
        .zip(tasks.par_iter_mut())
        .for_each(|((chunk, near), task)| {
            task.tally.fill([0.0; 6]);
            for (k, particle) in near.iter().enumerate() {
                work(TASK * chunk + k, particle, &mut task.tally);
            }
        });
}

/// Adds the sums of all tasks.
fn collect(total: &mut [Wrench], tasks: &[OwnImages]) {
    super::wall::collect(total, &[], tasks);
}

/// What the walls add to the densities.
pub(super) fn densities<K: Kernel, const D: usize>(
    particles: &mut Particles,
    walls: &mut Walls,
    grid: &Grid,
    cell: &PeriodicBox,
) {
    let w = K::w::<_, D>;
    match walls.model {
        WallModel::SymmetricImages => {}
        WallModel::OwnFootImages { least, .. } => {
            walls.place(particles, cell);
            walls.place_images(particles, least);
            own_foot::densities(particles, walls, w, D, cell);
        }
        WallModel::Completion { exact, .. } => {
            completion::keep_sums(particles, walls);
            if exact {
                walls.place(particles, cell);
            } else {
                super::wall_density::symmetric_densities::<K, D>(particles, walls, grid, cell);
            }
            completion::densities(particles, walls, D);
        }
        WallModel::FrozenParticles { .. } => {
            walls.place(particles, cell);
            frozen::densities(particles, walls, w, D, cell);
        }
    }
}

/// Pressures of what is not a fluid particle; `pressure(d)` in reduced units.
pub fn wall_pressures(walls: &mut Walls, pressure: impl Fn(f64) -> f64) {
    let frozen = &mut walls.state.frozen;
    for (share, &d) in frozen.share.iter_mut().zip(&frozen.density) {
        *share = pressure(d) / (d * d);
    }
}

/// To be called before the sweep over pairs that goes with the next `wall_forces`: P/d^2 becomes what
/// pairs are to take in its place, until then.
pub fn wall_shares(particles: &mut Particles, walls: &mut Walls) {
    if let WallModel::Completion { exact: true, .. } = walls.model {
        completion::lend_shares(particles, walls);
    }
}

/// Adds forces to `force`, and their reaction to `total`.
pub(super) fn forces(
    arrays: Arrays,
    force: Shared<'_, [f64; 4]>,
    walls: &mut Walls,
    total: &mut [Wrench],
    request: Request,
) {
    let Some(cell) = walls.state.cell else { return };
    match walls.model {
        WallModel::SymmetricImages => {}
        WallModel::OwnFootImages { noise, .. } => {
            own_foot::forces(arrays, force, walls, total, request, noise, &cell);
        }
        WallModel::Completion { exact, least } => {
            completion::forces(arrays, force, walls, total, request, exact, least);
        }
        WallModel::FrozenParticles { least } => {
            frozen::forces(arrays, force, walls, total, request, least, &cell);
        }
    }
}

/// Puts back what `wall_shares` lent.
pub(super) fn return_shares(particles: &mut Particles, walls: &Walls) {
    if let WallModel::Completion { exact: true, .. } = walls.model {
        completion::return_shares(particles, walls);
    }
}

/// Friction solved exactly; the walls' impulses get the reaction.
pub(super) fn exchange(
    particles: &mut Particles,
    walls: &mut Walls,
    physics: Physics,
    process: Exchange,
    key: SweepKey,
    direction: Direction,
) {
    let Some(cell) = walls.state.cell else { return };
    match walls.model {
        // Own-foot images are refused with this integrator.
        WallModel::SymmetricImages | WallModel::OwnFootImages { .. } => {}
        WallModel::Completion { least, .. } => {
            completion::exchange(particles, walls, physics, process, key, direction, least);
        }
        WallModel::FrozenParticles { least } => {
            frozen::exchange(
                particles, walls, physics, process, key, direction, least, &cell,
            );
        }
    }
}

/// Sum over particles of g of what walls add to the friction rate.
pub(super) fn friction_weight<K: Kernel, const D: usize>(
    particles: &Particles,
    walls: &Walls,
) -> f64 {
    let Some(cell) = walls.state.cell else {
        return 0.0;
    };
    let f = K::f::<_, D>;
    match walls.model {
        WallModel::SymmetricImages => 0.0,
        WallModel::OwnFootImages { .. } => own_foot::friction_weight(particles, walls, f, D, &cell),
        WallModel::Completion { least, .. } => {
            completion::friction_weight(particles, walls, least, D)
        }
        WallModel::FrozenParticles { least } => {
            frozen::friction_weight(particles, walls, f, D, least, &cell)
        }
    }
}
