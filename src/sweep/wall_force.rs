//! Forces by images. Conservative: the exact gradient of U = sum u(d_i) with the images in d_i; with
//! A = P/d^2, w = psi_i psi_j and a prime for d/dphi (one wall)
//!     f_i = (A_i + A_j) [w F(r_iJ) (r_ij + 2 phi_j n_i) - W(r_iJ) psi'_i psi_j n_i],
//!     own: f_i = A_i [psi_i^2 F 4 phi_i - 2 psi_i psi'_i W] n_i;
//! at a field wall the gradients of phi and psi take the place of n and psi' n.
//! Drag and noise: physics/friction.rs.

use std::marker::PhantomData;

use super::Shared;
use super::wall::{Scenery, collect, cross, for_each_links, for_each_near};
use super::wall_model::{self, Arrays, Physics, Request};
use crate::kernel::Kernel;
use crate::neighbor::Grid;
use crate::physics::{FrictionForm, Frictionless, Kick};
use crate::random::{Silent, SweepKey, Variate};
use crate::real::Plain;
use crate::state::Particles;
use crate::wall::{View, WallModel, Walls, Wrench};

/// Whose velocities the drag is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Motion {
    /// Those of the particles, to walls that move.
    Actual,
    /// Differences of velocities: the walls' motion is not in them.
    Difference,
}

struct WallForce<'a, K, F, V, const D: usize, const CONSERVATIVE: bool> {
    scenery: Scenery<'a>,
    position: &'a [[f64; 4]],
    velocity: &'a [[f64; 4]],
    id: &'a [u64],
    force: Shared<'a, [f64; 4]>,
    kick: Kick,
    key: SweepKey,
    motion: Motion,
    form: PhantomData<(K, F, V)>,
}

impl<K: Kernel, F: FrictionForm, V: Variate, const D: usize, const CONSERVATIVE: bool>
    WallForce<'_, K, F, V, D, CONSERVATIVE>
{
    /// Adds a force at a slot.
    ///
    /// # Safety
    /// No other thread uses the slot.
    unsafe fn add(&self, slot: u32, f: [f64; 3]) {
        // SAFETY: promised by the caller.
        let target = unsafe { self.force.slot(slot) };
        for a in 0..D {
            target[a] += f[a];
        }
    }

    /// Force of the images' pressure on both ends, without what acts along r_ij; `pressure` is
    /// A_i + A_j.
    fn pressure(&self, view: &View, pressure: f64, tally: &mut [Wrench]) -> [[f64; 3]; 2] {
        let slope = pressure * view.weight * K::f::<_, D>(view.distance);
        let value = pressure * view.weight * K::w::<_, D>(view.distance);
        let mut forces = [[0.0; 3]; 2];
        for (one, other) in self.scenery.ends(view) {
            for (force, (here, there)) in forces.iter_mut().zip([(one, other), (other, one)]) {
                let push = 2.0 * slope * there.foot.distance - value * here.slope / here.weight;
                let wrench = &mut tally[here.wall as usize];
                let climb = -value / here.weight;
                let f = [0, 1, 2].map(|a| push * here.foot.normal[a] + climb * here.climb[a]);
                // At a round wall along the arm: no torque.
                let torque = cross(here.foot.arm, f);
                for a in 0..3 {
                    force[a] += f[a];
                    wrench[a] -= f[a];
                    wrench[3 + a] -= torque[a];
                }
            }
        }
        for a in 0..3 {
            let central = slope * view.r[a];
            forces[0][a] += central;
            forces[1][a] -= central;
        }
        forces
    }

    /// g of a link.
    fn weight(&self, view: &View) -> f64 {
        let [i, j] = view.link.slots;
        let product = self.position[i as usize][3] * self.position[j as usize][3];
        view.weight * K::f::<_, D>(view.distance) * (product * product)
    }

    fn variates(&self, view: &View, odd: bool) -> Option<[f64; 3]> {
        if !V::ON {
            return None;
        }
        let [p, q] = view.link.slots.map(|slot| self.id[slot as usize]);
        let label = self.scenery.image(view).label;
        let sign = if odd || p < q { 1.0 } else { -1.0 };
        let xi = V::draw::<Plain, f64>(self.key.of_image(label).pair_words(p, q), sign, D);
        Some(std::array::from_fn(|a| if a < D { xi[a] } else { 0.0 }))
    }

    fn velocity(&self, slot: u32) -> [f64; 3] {
        let v = &self.velocity[slot as usize];
        std::array::from_fn(|a| if a < D { v[a] } else { 0.0 })
    }

    fn wall_velocity(&self, view: &View) -> [f64; 3] {
        match self.motion {
            Motion::Actual => view.wall,
            Motion::Difference => [0.0; 3],
        }
    }

    fn link(&self, view: &View, tally: &mut [Wrench]) {
        let [i, j] = view.link.slots;
        let mut forces = [[0.0; 3]; 2];
        if CONSERVATIVE {
            let sum = self.velocity[i as usize][3] + self.velocity[j as usize][3];
            forces = self.pressure(view, sum, tally);
        }
        let image = self.scenery.image(view);
        if F::ON && image.friction {
            let odd = image.odd();
            let (v, w) = (self.velocity(i), self.velocity(j));
            let u = if odd {
                let wall = self.wall_velocity(view);
                [0, 1, 2].map(|a| v[a] + w[a] - 2.0 * wall[a])
            } else {
                [0, 1, 2].map(|a| v[a] - w[a])
            };
            let xi = self.variates(view, odd);
            let g = self.weight(view);
            let f = self.kick.link_force::<F>(g, &view.axes, u, xi, false);
            let back = if odd { f } else { f.map(|x| -x) };
            self.scenery.react(view, f, back, tally);
            for a in 0..3 {
                forces[0][a] += f[a];
                forces[1][a] += back[a];
            }
        }
        // SAFETY: blocks of one colour share no particle.
        unsafe {
            self.add(i, forces[0]);
            self.add(j, forces[1]);
        }
    }

    fn own(&self, view: &View, tally: &mut [Wrench]) {
        let slot = view.link.slots[0];
        let mut force = [0.0; 3];
        if CONSERVATIVE {
            // Both ends are the particle: the sum over them with A_i is the gradient.
            let [one, other] = self.pressure(view, self.velocity[slot as usize][3], tally);
            force = [0, 1, 2].map(|a| one[a] + other[a]);
        }
        let image = self.scenery.image(view);
        if F::ON && image.friction && image.odd() {
            let (v, wall) = (self.velocity(slot), self.wall_velocity(view));
            let u = [0, 1, 2].map(|a| v[a] - wall[a]);
            let xi = self.variates(view, true);
            let g = self.weight(view);
            let f = self.kick.link_force::<F>(g, &view.axes, u, xi, true);
            self.scenery.react(view, f, [0.0; 3], tally);
            for a in 0..3 {
                force[a] += f[a];
            }
        }
        // SAFETY: every slot occurs once among the near ones.
        unsafe { self.add(slot, force) };
    }
}

/// Adds the forces by images to `force`, and sets the walls' `force` to the reaction.
pub fn wall_forces<K: Kernel, F: FrictionForm, V: Variate, const D: usize>(
    particles: &mut Particles,
    walls: &mut Walls,
    grid: &Grid,
    kick: Kick,
    key: SweepKey,
) {
    if !walls.any() {
        return;
    }
    if walls.model != WallModel::SymmetricImages {
        let physics = Physics::of::<K, F, V, D>();
        model_forces::<K, D>(particles, walls, grid, physics, kick, key);
        return;
    }
    let mut total = std::mem::take(&mut walls.force);
    let force = Shared::new(&mut particles.force);
    let arrays = (
        &particles.position[..],
        &particles.velocity[..],
        &particles.id[..],
    );
    sweep::<K, F, V, D, true>(
        arrays,
        force,
        walls,
        &mut total,
        grid,
        kick,
        key,
        Motion::Actual,
    );
    walls.force = total;
}

/// The same by another model; pressure forces may be those of symmetric images.
fn model_forces<K: Kernel, const D: usize>(
    particles: &mut Particles,
    walls: &mut Walls,
    grid: &Grid,
    physics: Physics,
    kick: Kick,
    key: SweepKey,
) {
    wall_model::return_shares(particles, walls);
    let mut total = std::mem::take(&mut walls.force);
    total.fill([0.0; 6]);
    let force = Shared::new(&mut particles.force);
    if walls.model.has_links() {
        let arrays = (
            &particles.position[..],
            &particles.velocity[..],
            &particles.id[..],
        );
        let motion = Motion::Actual;
        sweep::<K, Frictionless, Silent, D, true>(
            arrays, force, walls, &mut total, grid, kick, key, motion,
        );
    }
    let arrays = Arrays {
        position: &particles.position,
        velocity: &particles.velocity,
        id: &particles.id,
    };
    let request = Request {
        physics,
        kick,
        key,
        motion: Motion::Actual,
        conservative: true,
    };
    wall_model::forces(arrays, force, walls, &mut total, request);
    walls.force = total;
}

/// Adds drag and noise by images alone to `drag`, with `scratch` in the place of the velocities, and
/// sets the walls' `drag` to the reaction.
#[allow(clippy::too_many_arguments)]
pub fn wall_drag<K: Kernel, F: FrictionForm, V: Variate, const D: usize>(
    particles: &mut Particles,
    walls: &mut Walls,
    grid: &Grid,
    kick: Kick,
    key: SweepKey,
    motion: Motion,
) {
    if !walls.any() {
        return;
    }
    let mut total = std::mem::take(&mut walls.drag);
    let force = Shared::new(&mut particles.drag);
    if walls.model != WallModel::SymmetricImages {
        let arrays = Arrays {
            position: &particles.position,
            velocity: &particles.scratch,
            id: &particles.id,
        };
        let request = Request {
            physics: Physics::of::<K, F, V, D>(),
            kick,
            key,
            motion,
            conservative: false,
        };
        total.fill([0.0; 6]);
        wall_model::forces(arrays, force, walls, &mut total, request);
        walls.drag = total;
        return;
    }
    let arrays = (
        &particles.position[..],
        &particles.scratch[..],
        &particles.id[..],
    );
    sweep::<K, F, V, D, false>(arrays, force, walls, &mut total, grid, kick, key, motion);
    walls.drag = total;
}

/// Sum over particles of g of all links and own images that slow a particle down: what walls add to
/// the friction rate.
pub fn wall_friction_weight<K: Kernel, const D: usize>(
    particles: &Particles,
    walls: &Walls,
) -> f64 {
    if walls.model != WallModel::SymmetricImages {
        return wall_model::friction_weight::<K, D>(particles, walls);
    }
    let blocks = walls.links.iter().flat_map(|block| &block.views);
    let own = walls.tasks.iter().flat_map(|task| &task.views);
    // An own image of even order is at rest to its particle.
    let slows = |view: &&View| {
        let [i, j] = view.link.slots;
        let image = &walls.images[view.link.image as usize];
        image.friction && (i != j || image.odd())
    };
    let g = |view: &View| {
        let [i, j] = view.link.slots;
        let product = particles.position[i as usize][3] * particles.position[j as usize][3];
        view.weight * K::f::<_, D>(view.distance) * (product * product)
    };
    2.0 * blocks.chain(own).filter(slows).map(g).sum::<f64>()
}

#[allow(clippy::too_many_arguments)]
fn sweep<K: Kernel, F: FrictionForm, V: Variate, const D: usize, const CONSERVATIVE: bool>(
    (position, velocity, id): (&[[f64; 4]], &[[f64; 4]], &[u64]),
    force: Shared<'_, [f64; 4]>,
    walls: &mut Walls,
    total: &mut [Wrench],
    grid: &Grid,
    kick: Kick,
    key: SweepKey,
    motion: Motion,
) {
    let mut links = std::mem::take(&mut walls.links);
    let mut tasks = std::mem::take(&mut walls.tasks);
    let task = WallForce::<K, F, V, D, CONSERVATIVE> {
        scenery: Scenery::of(walls),
        position,
        velocity,
        id,
        force,
        kick,
        key,
        motion,
        form: PhantomData,
    };
    for_each_links(grid, &mut links, false, true, &|block| {
        for view in &block.views {
            task.link(view, &mut block.tally);
        }
    });
    for_each_near(&walls.near, &mut tasks, &|_, own| {
        for view in &own.views {
            task.own(view, &mut own.tally);
        }
    });
    total.fill([0.0; 6]);
    collect(total, &links, &tasks);
    (walls.links, walls.tasks) = (links, tasks);
}
