//! Forces by images. Conservative: the exact gradient of U = sum u(d_i) with the images in d_i; with
//! A = P/d^2, w = psi_i psi_j and a prime for d/dphi (one wall)
//!     f_i = (A_i + A_j) [w F(r_iJ) (r_ij + 2 phi_j n_i) - W(r_iJ) psi'_i psi_j n_i],
//!     own: f_i = A_i [psi_i^2 F 4 phi_i - 2 psi_i psi'_i W] n_i.
//! Drag and noise: physics/friction.rs.

use std::marker::PhantomData;

use super::Shared;
use super::wall::{Scenery, View, collect, for_each_links, for_each_near};
use crate::domain::PeriodicBox;
use crate::kernel::Kernel;
use crate::neighbor::Grid;
use crate::physics::{FrictionForm, Kick};
use crate::random::{SweepKey, Variate};
use crate::state::Particles;
use crate::wall::{Link, Near, Walls, Wrench};

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
    fn pressure(&self, view: &View<'_>, pressure: f64, tally: &mut [Wrench]) -> [[f64; 3]; 2] {
        let slope = pressure * view.weight * K::f::<D>(view.distance);
        let value = pressure * view.weight * K::w::<D>(view.distance);
        let mut forces = [[0.0; 3]; 2];
        for k in 0..view.image.order {
            let (one, other) = self.scenery.ends(view, k);
            for (force, (here, there)) in forces.iter_mut().zip([(one, other), (other, one)]) {
                let push = 2.0 * slope * there.foot.distance - value * here.slope / here.weight;
                let wrench = &mut tally[here.wall as usize];
                for a in 0..3 {
                    let f = push * here.foot.normal[a];
                    force[a] += f;
                    wrench[a] -= f; // along the arm: no torque
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

    fn weight(&self, view: &View<'_>, [i, j]: [u32; 2]) -> f64 {
        let position = self.scenery.position;
        let product = position[i as usize][3] * position[j as usize][3];
        view.weight * K::f::<D>(view.distance) * (product * product)
    }

    fn variates(&self, view: &View<'_>, [i, j]: [u32; 2]) -> Option<[f64; 3]> {
        if !V::ON {
            return None;
        }
        let [p, q] = [self.id[i as usize], self.id[j as usize]];
        let words = self.key.of_image(view.image.label).pair_words(p, q);
        let xi = V::draw(words, D);
        let sign = if view.image.odd() || p < q { 1.0 } else { -1.0 };
        Some(std::array::from_fn(
            |a| if a < D { sign * xi[a] } else { 0.0 },
        ))
    }

    fn velocity(&self, slot: u32) -> [f64; 3] {
        let v = &self.velocity[slot as usize];
        std::array::from_fn(|a| if a < D { v[a] } else { 0.0 })
    }

    fn wall_velocity(&self, view: &View<'_>) -> [f64; 3] {
        match self.motion {
            Motion::Actual => self.scenery.wall_velocity(view),
            Motion::Difference => [0.0; 3],
        }
    }

    fn link(&self, link: &Link, tally: &mut [Wrench]) {
        let Some(view) = self.scenery.link::<D>(link) else {
            return;
        };
        let [i, j] = link.slots;
        let mut forces = [[0.0; 3]; 2];
        if CONSERVATIVE {
            let sum = self.velocity[i as usize][3] + self.velocity[j as usize][3];
            forces = self.pressure(&view, sum, tally);
        }
        if F::ON {
            let (v, w) = (self.velocity(i), self.velocity(j));
            let odd = view.image.odd();
            let wall = if odd {
                self.wall_velocity(&view)
            } else {
                [0.0; 3]
            };
            let u = std::array::from_fn(|a| {
                if odd {
                    v[a] + w[a] - 2.0 * wall[a]
                } else {
                    v[a] - w[a]
                }
            });
            let f = self.kick.link_force::<F>(
                self.weight(&view, link.slots),
                &self.scenery.axes(&view),
                u,
                self.variates(&view, link.slots),
                false,
            );
            let back = if odd { f } else { f.map(|x| -x) };
            self.scenery.react(&view, f, back, tally);
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

    fn own(&self, walls: &Walls, near: &Near, tally: &mut [Wrench]) {
        let slots = [near.slot; 2];
        self.scenery.own(walls, near, false, |view| {
            let mut force = [0.0; 3];
            if CONSERVATIVE {
                // Both ends are the particle: the sum over them with A_i is the gradient.
                let share = self.velocity[near.slot as usize][3];
                let [one, other] = self.pressure(view, share, tally);
                force = std::array::from_fn(|a| one[a] + other[a]);
            }
            if F::ON && view.image.odd() {
                let (v, wall) = (self.velocity(near.slot), self.wall_velocity(view));
                let f = self.kick.link_force::<F>(
                    self.weight(view, slots),
                    &self.scenery.axes(view),
                    std::array::from_fn(|a| v[a] - wall[a]),
                    self.variates(view, slots),
                    true,
                );
                self.scenery.react(view, f, [0.0; 3], tally);
                for a in 0..3 {
                    force[a] += f[a];
                }
            }
            // SAFETY: every slot occurs once among the near ones.
            unsafe { self.add(near.slot, force) };
        });
    }
}

/// Adds the forces by images to `force`, and sets the walls' `force` to the reaction.
pub fn wall_forces<K: Kernel, F: FrictionForm, V: Variate, const D: usize>(
    particles: &mut Particles,
    walls: &mut Walls,
    grid: &Grid,
    cell: &PeriodicBox,
    kick: Kick,
    key: SweepKey,
) {
    if !walls.any() {
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
        cell,
        kick,
        key,
        Motion::Actual,
    );
    walls.force = total;
}

/// Adds drag and noise by images alone to `drag`, with `scratch` in the place of the velocities, and
/// sets the walls' `drag` to the reaction.
#[allow(clippy::too_many_arguments)]
pub fn wall_drag<K: Kernel, F: FrictionForm, V: Variate, const D: usize>(
    particles: &mut Particles,
    walls: &mut Walls,
    grid: &Grid,
    cell: &PeriodicBox,
    kick: Kick,
    key: SweepKey,
    motion: Motion,
) {
    if !walls.any() {
        return;
    }
    let mut total = std::mem::take(&mut walls.drag);
    let force = Shared::new(&mut particles.drag);
    let arrays = (
        &particles.position[..],
        &particles.scratch[..],
        &particles.id[..],
    );
    sweep::<K, F, V, D, false>(
        arrays, force, walls, &mut total, grid, cell, kick, key, motion,
    );
    walls.drag = total;
}

/// Sum over particles of g of all links and own images that slow a particle down: what walls add to
/// the friction rate.
pub fn wall_friction_weight<K: Kernel, const D: usize>(
    particles: &Particles,
    walls: &Walls,
    cell: &PeriodicBox,
) -> f64 {
    let scenery = Scenery {
        images: &walls.images,
        sites: &walls.sites,
        cell,
        position: &particles.position,
    };
    let g = |view: &View<'_>, [i, j]: [u32; 2]| {
        let product = particles.position[i as usize][3] * particles.position[j as usize][3];
        view.weight * K::f::<D>(view.distance) * (product * product)
    };
    let mut sum = 0.0;
    for link in walls.links.iter().flat_map(|block| &block.links) {
        if let Some(view) = scenery.link::<D>(link) {
            sum += 2.0 * g(&view, link.slots);
        }
    }
    for near in &walls.near {
        scenery.own(walls, near, false, |view| {
            if view.image.odd() {
                sum += 2.0 * g(view, [near.slot; 2]);
            }
        });
    }
    sum
}

#[allow(clippy::too_many_arguments)]
fn sweep<K: Kernel, F: FrictionForm, V: Variate, const D: usize, const CONSERVATIVE: bool>(
    (position, velocity, id): (&[[f64; 4]], &[[f64; 4]], &[u64]),
    force: Shared<'_, [f64; 4]>,
    walls: &mut Walls,
    total: &mut [Wrench],
    grid: &Grid,
    cell: &PeriodicBox,
    kick: Kick,
    key: SweepKey,
    motion: Motion,
) {
    let mut links = std::mem::take(&mut walls.links);
    let mut tasks = std::mem::take(&mut walls.tasks);
    let task = WallForce::<K, F, V, D, CONSERVATIVE> {
        scenery: Scenery {
            images: &walls.images,
            sites: &walls.sites,
            cell,
            position,
        },
        velocity,
        id,
        force,
        kick,
        key,
        motion,
        form: PhantomData,
    };
    for_each_links(grid, &mut links, false, |links, tally| {
        for link in links {
            task.link(link, tally);
        }
    });
    for_each_near(&walls.near, &mut tasks, |near, tally| {
        task.own(walls, near, tally);
    });
    total.fill([0.0; 6]);
    collect(total, &links, &tasks);
    (walls.links, walls.tasks) = (links, tasks);
}
