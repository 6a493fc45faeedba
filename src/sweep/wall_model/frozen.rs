//! Particles that do not move behind the walls (Bian et al. 2015, appendix G; G1 has the wrong sign).
//! They have density and pressure like particles; with d_f and d_b the distances of a fluid particle
//! and of a frozen one to the wall, v_b - v_w = -(d_b/d_f)(v_f - v_w), so that friction is that with
//! something at rest to the wall times alpha = 1 + d_b/d_f, and noise gets alpha^(1/2). Only the fluid
//! particle feels the force; the wall gets the reaction.

use super::{
    Arrays, POINT, Physics, Request, collect, for_each_near, react, separation, wall_velocity,
};
use crate::domain::PeriodicBox;
use crate::physics::Exchange;
use crate::random::SweepKey;
use crate::state::Particles;
use crate::sweep::{Direction, Shared};
use crate::wall::{FROZEN_LABELS, Site, Walls, Wrench};
use rayon::prelude::*;

/// A frozen particle within the support.
struct Seen {
    number: usize,
    r: [f64; 3],
    distance: f64,
    inverse_r2: f64,
}

fn look(
    walls: &Walls,
    number: u32,
    position: &[f64; 4],
    dimension: usize,
    cell: &PeriodicBox,
) -> Option<Seen> {
    let number = number as usize;
    let (r, r2) = separation(
        position,
        &walls.state.frozen.points[number],
        dimension,
        cell,
    );
    (r2 < 1.0).then(|| Seen {
        number,
        r,
        distance: r2.sqrt(),
        inverse_r2: 1.0 / r2.max(POINT),
    })
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
        let record = &position[near.slot as usize];
        let mut sum = 0.0;
        for site in near.first..near.end {
            for &number in walls.state.partners(site) {
                if let Some(seen) = look(walls, number, record, dimension, cell) {
                    sum += w(seen.distance);
                }
            }
        }
        // SAFETY: every slot occurs once among the near ones.
        unsafe { *density.slot(near.slot) += sum };
    });
    walls.tasks = tasks;
    let mut of_frozen = std::mem::take(&mut walls.state.frozen.density);
    let state = &walls.state;
    of_frozen
        .par_iter_mut()
        .enumerate()
        .with_min_len(64)
        .for_each(|(number, density)| {
            *density = state.frozen.constant[number];
            let range = state.first_back[number] as usize..state.first_back[number + 1] as usize;
            for &slot in &state.back[range] {
                let record = &position[slot as usize];
                if let Some(seen) = look(walls, number as u32, record, dimension, cell) {
                    *density += w(seen.distance);
                }
            }
        });
    walls.state.frozen.density = of_frozen;
}

/// g alpha of a link.
fn weight(walls: &Walls, site: &Site, seen: &Seen, slope: f64, s2: f64, least: f64) -> f64 {
    let frozen = &walls.state.frozen;
    let height = site.foot.distance.max(least).max(1e-12);
    let alpha = 1.0 + frozen.depth[seen.number] / height;
    alpha * slope * s2 / frozen.density[seen.number]
}

#[allow(clippy::too_many_arguments)]
pub(super) fn forces(
    arrays: Arrays,
    force: Shared<'_, [f64; 4]>,
    walls: &mut Walls,
    total: &mut [Wrench],
    request: Request,
    least: f64,
    cell: &PeriodicBox,
) {
    let mut tasks = std::mem::take(&mut walls.tasks);
    let Request {
        physics,
        kick,
        key,
        motion,
        conservative,
    } = request;
    for_each_near(&walls.near, &mut tasks, &|_, near, tally| {
        let slot = near.slot as usize;
        let record = &arrays.position[slot];
        let (v, id) = (arrays.velocity(near.slot), arrays.id[slot]);
        let (share, s2) = (arrays.velocity[slot][3], record[3].powi(2));
        let mut sum = [0.0; 3];
        for index in near.first..near.end {
            let site = &walls.sites[index as usize];
            let still = wall_velocity(site, motion);
            let u = [0, 1, 2].map(|a| v[a] - still[a]);
            let friction = physics.friction && walls.images[site.wall as usize].friction;
            for &number in walls.state.partners(index) {
                let Some(seen) = look(walls, number, record, physics.dimension, cell) else {
                    continue;
                };
                let slope = (physics.f)(seen.distance);
                let mut f = [0.0; 3];
                if conservative {
                    let pressure = (share + walls.state.frozen.share[seen.number]) * slope;
                    f = seen.r.map(|x| pressure * x);
                }
                if friction {
                    let g = weight(walls, site, &seen, slope, s2, least);
                    let xi = draw(&physics, key, id, number);
                    let drag =
                        (physics.force)(&kick, g, seen.inverse_r2, seen.r, u, xi, physics.noise);
                    for a in 0..3 {
                        f[a] += drag[a];
                    }
                }
                react(site, f, tally);
                for a in 0..3 {
                    sum[a] += f[a];
                }
            }
        }
        // SAFETY: every slot occurs once among the near ones.
        let target = unsafe { force.slot(near.slot) };
        for a in 0..physics.dimension {
            target[a] += sum[a];
        }
    });
    collect(total, &tasks);
    walls.tasks = tasks;
}

fn draw(physics: &Physics, key: SweepKey, id: u64, number: u32) -> [f64; 3] {
    if physics.noise {
        physics.variates(key, FROZEN_LABELS, id, u64::from(number))
    } else {
        [0.0; 3]
    }
}

#[allow(clippy::too_many_arguments)]
pub(super) fn exchange(
    particles: &mut Particles,
    walls: &mut Walls,
    physics: Physics,
    process: Exchange,
    key: SweepKey,
    direction: Direction,
    least: f64,
    cell: &PeriodicBox,
) {
    let mut tasks = std::mem::take(&mut walls.tasks);
    let velocity = Shared::new(&mut particles.velocity);
    let (position, ids) = (&particles.position, &particles.id);
    for_each_near(&walls.near, &mut tasks, &|_, near, tally| {
        let slot = near.slot as usize;
        let record = &position[slot];
        let s2 = record[3].powi(2);
        // SAFETY: every slot occurs once among the near ones.
        let v = unsafe { velocity.slot(near.slot) };
        let mut one = |index: u32, number: u32| {
            let site = &walls.sites[index as usize];
            if !walls.images[site.wall as usize].friction {
                return;
            }
            let Some(seen) = look(walls, number, record, physics.dimension, cell) else {
                return;
            };
            let g = weight(walls, site, &seen, (physics.f)(seen.distance), s2, least);
            let u = [0, 1, 2].map(|a| v[a] - site.foot.velocity[a]);
            let xi = draw(&physics, key, ids[slot], number);
            let change =
                (physics.exchange)(&process, g, seen.inverse_r2, seen.r, u, xi, physics.noise);
            for a in 0..physics.dimension {
                v[a] += change[a];
            }
            react(site, change, tally);
        };
        if direction == Direction::Forward {
            for index in near.first..near.end {
                for &number in walls.state.partners(index) {
                    one(index, number);
                }
            }
        } else {
            for index in (near.first..near.end).rev() {
                for &number in walls.state.partners(index).iter().rev() {
                    one(index, number);
                }
            }
        }
    });
    collect(&mut walls.impulse, &tasks);
    walls.tasks = tasks;
}

pub(super) fn friction_weight(
    particles: &Particles,
    walls: &Walls,
    f: fn(f64) -> f64,
    dimension: usize,
    least: f64,
    cell: &PeriodicBox,
) -> f64 {
    let mut sum = 0.0;
    for (index, site) in walls.sites.iter().enumerate() {
        if !walls.images[site.wall as usize].friction {
            continue;
        }
        let record = &particles.position[site.slot as usize];
        for &number in walls.state.partners(index as u32) {
            if let Some(seen) = look(walls, number, record, dimension, cell) {
                let s2 = record[3].powi(2);
                sum += weight(walls, site, &seen, f(seen.distance), s2, least);
            }
        }
    }
    sum
}
