//! Images at the foot of each particle's own perpendicular (Yang 2013, Table 3 and 2.59 to 2.64):
//! r_J = r_j - 2 phi_j n_j, the particle's own image included, with d_J = d_j, P_J = P_j and
//! v_J = 2 v_w - v_j. What i feels from J is not what j feels from I: at curved walls the distances
//! differ, and the friction matrix is not symmetric. It has noise only if asked for, drawn for each
//! ordered pair (i, J) on its own.

use super::{Arrays, POINT, Request, collect, for_each_near, react, separation, wall_velocity};
use crate::domain::PeriodicBox;
use crate::state::Particles;
use crate::sweep::Shared;
use crate::wall::{Near, Site, Walls, Wrench};

/// From a particle to an image within the support.
struct Seen<'a> {
    /// Site of the particle.
    here: &'a Site,
    /// Site of the particle that is mirrored.
    there: &'a Site,
    r: [f64; 3],
    distance: f64,
    inverse_r2: f64,
}

/// Calls `work` for each image that a near particle sees.
fn see(
    walls: &Walls,
    near: &Near,
    position: &[[f64; 4]],
    dimension: usize,
    cell: &PeriodicBox,
    mut work: impl FnMut(&Seen),
) {
    for site in near.first..near.end {
        let here = &walls.sites[site as usize];
        for &partner in walls.state.partners(site) {
            let there = &walls.sites[partner as usize];
            let image = &walls.state.images[partner as usize];
            let (mut r, r2) = separation(&position[near.slot as usize], image, dimension, cell);
            // Not a number: there is no image.
            if r2.is_nan() || r2 >= 1.0 {
                continue;
            }
            let mut inverse_r2 = 1.0 / r2.max(POINT);
            if r2 < POINT {
                // A particle on the wall and its own image: e is the normal.
                r = here.foot.normal.map(|x| 1e-12 * x);
                inverse_r2 = 1.0 / POINT;
            }
            work(&Seen {
                here,
                there,
                r,
                distance: r2.sqrt(),
                inverse_r2,
            });
        }
    }
}

pub(super) fn densities(
    particles: &mut Particles,
    walls: &mut Walls,
    w: fn(f64) -> f64,
    dimension: usize,
    cell: &PeriodicBox,
) {
    let mut tasks = std::mem::take(&mut walls.tasks);
    let density = Shared::new(&mut particles.density);
    let position = &particles.position;
    for_each_near(&walls.near, &mut tasks, &|_, near, _| {
        let mut sum = 0.0;
        see(walls, near, position, dimension, cell, |seen| {
            sum += w(seen.distance);
        });
        // SAFETY: every slot occurs once among the near ones.
        unsafe { *density.slot(near.slot) += sum };
    });
    walls.tasks = tasks;
}

pub(super) fn forces(
    arrays: Arrays,
    force: Shared<'_, [f64; 4]>,
    walls: &mut Walls,
    total: &mut [Wrench],
    request: Request,
    noise: bool,
    cell: &PeriodicBox,
) {
    let mut tasks = std::mem::take(&mut walls.tasks);
    let Request { physics, .. } = request;
    let noise = noise && physics.noise;
    for_each_near(&walls.near, &mut tasks, &|_, near, tally| {
        let mut sum = [0.0; 3];
        let at = near.slot as usize;
        see(
            walls,
            near,
            arrays.position,
            physics.dimension,
            cell,
            |seen| {
                let f = link_force(&arrays, near.slot, seen, walls, &request, noise);
                react(seen.here, f, tally);
                for a in 0..3 {
                    sum[a] += f[a];
                }
            },
        );
        // SAFETY: every slot occurs once among the near ones.
        let target = unsafe { force.slot(at as u32) };
        for a in 0..physics.dimension {
            target[a] += sum[a];
        }
    });
    collect(total, &tasks);
    walls.tasks = tasks;
}

fn link_force(
    arrays: &Arrays,
    i: u32,
    seen: &Seen,
    walls: &Walls,
    request: &Request,
    noise: bool,
) -> [f64; 3] {
    let Request {
        physics,
        kick,
        key,
        motion,
        conservative,
    } = *request;
    let j = seen.there.slot;
    let slope = (physics.f)(seen.distance);
    let mut force = [0.0; 3];
    if conservative {
        let pressure = arrays.velocity[i as usize][3] + arrays.velocity[j as usize][3];
        force = seen.r.map(|x| pressure * slope * x);
    }
    let wall = seen.here.wall;
    if !physics.friction || !walls.images[wall as usize].friction {
        return force;
    }
    let (v, w) = (arrays.velocity(i), arrays.velocity(j));
    let still = wall_velocity(seen.there, motion);
    let u = [0, 1, 2].map(|a| v[a] + w[a] - 2.0 * still[a]);
    let product = arrays.position[i as usize][3] * arrays.position[j as usize][3];
    let g = slope * (product * product);
    let mut xi = [0.0; 3];
    if noise {
        let label = 2 * wall as u8 + 1;
        let ids = [i, j].map(|slot| arrays.id[slot as usize]);
        // As with a particle, for the own image, too: its friction, with 2 (v - v_w), would take twice
        // the variance, and nothing balances what v_j has in common with v_i.
        xi = physics.variates(key, [label, label + 1], ids[0], ids[1]);
    }
    let extra = (physics.force)(&kick, g, seen.inverse_r2, seen.r, u, xi, noise);
    [0, 1, 2].map(|a| force[a] + extra[a])
}

pub(super) fn friction_weight(
    particles: &Particles,
    walls: &Walls,
    f: fn(f64) -> f64,
    dimension: usize,
    cell: &PeriodicBox,
) -> f64 {
    let mut sum = 0.0;
    for near in &walls.near {
        see(walls, near, &particles.position, dimension, cell, |seen| {
            if walls.images[seen.here.wall as usize].friction {
                let [i, j] = [near.slot, seen.there.slot]
                    .map(|slot| particles.position[slot as usize][3].powi(2));
                let links = if near.slot == seen.there.slot {
                    2.0
                } else {
                    1.0
                };
                sum += links * f(seen.distance) * i * j;
            }
        });
    }
    sum
}
