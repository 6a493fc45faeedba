//! Closed forms in the place of what is missing behind a wall (wall/completion.rs). With S the sum
//! over particles, d = S prod_walls 1/(1 - Delta - K C); friction with a wall (Yang 2013, A.24, with
//! the wall's density that of the particle)
//!     f = -(a psi I + b Psi)(v - v_w) / (d phi),   Psi = psi1 I + psi2 n n^T,
//! and the noise that belongs to it, one draw a particle and wall. Pressure forces are those of the
//! symmetric images, or the gradient of the completed density:
//!     pairs take A_i/(1 - Delta_i) for A_i,   f_i += A_i d_i (psi - K C') / (1 - Delta) n.

use super::{Arrays, Physics, Request, collect, for_each_near, react, wall_velocity};
use crate::physics::{Exchange, WallGrip};
use crate::random::SweepKey;
use crate::state::Particles;
use crate::sweep::{Direction, Shared};
use crate::wall::{Missing, Site, Walls, Wrench};

/// 1 - Delta must not vanish where a wall is as curved as a support.
const LEAST: f64 = 0.05;

/// Remembers the sums over particles of near ones.
pub(super) fn keep_sums(particles: &Particles, walls: &mut Walls) {
    let state = &mut walls.state;
    for (kept, near) in state.kept.iter_mut().zip(&walls.near) {
        *kept = particles.density[near.slot as usize];
    }
}

/// Delta + K C and its slope at a site.
fn missing(walls: &Walls, site: &Site, dimension: usize) -> (f64, f64) {
    let m = Missing::at(site.foot.distance, dimension);
    let k = walls.curvature_of(site.wall);
    let volume = (m.volume + k * m.curved).min(1.0 - LEAST);
    (volume, k * m.curved_slope - m.psi)
}

/// Completes the kept sums.
pub(super) fn densities(particles: &mut Particles, walls: &mut Walls, dimension: usize) {
    let mut state = std::mem::take(&mut walls.state);
    for (number, near) in walls.near.iter().enumerate() {
        let mut factor = 1.0;
        for site in near.first..near.end {
            factor /= 1.0 - missing(walls, &walls.sites[site as usize], dimension).0;
        }
        state.factor[number] = factor;
        particles.density[near.slot as usize] = state.kept[number] * factor;
    }
    walls.state = state;
}

/// P/d^2 becomes P/d^2/(1 - Delta).
pub(super) fn lend_shares(particles: &mut Particles, walls: &mut Walls) {
    let state = &mut walls.state;
    particles.copies.twice_is_present = false;
    for (number, near) in walls.near.iter().enumerate() {
        let share = &mut particles.velocity[near.slot as usize][3];
        state.kept[number] = *share;
        *share *= state.factor[number];
    }
}

/// And back.
pub(super) fn return_shares(particles: &mut Particles, walls: &Walls) {
    for (kept, near) in walls.state.kept.iter().zip(&walls.near) {
        particles.velocity[near.slot as usize][3] = *kept;
    }
}

/// Friction of a particle with a wall; none beyond the support and where the fluid slips.
fn grip(walls: &Walls, site: &Site, s2: f64, least: f64, dimension: usize) -> Option<WallGrip> {
    let height = site.foot.distance.max(least).max(1e-12);
    if height >= 1.0 || !walls.images[site.wall as usize].friction {
        return None;
    }
    let m = Missing::at(height, dimension);
    if m.psi <= 0.0 {
        return None;
    }
    Some(WallGrip {
        weight: m.psi * s2 / height,
        normal: site.foot.normal,
        across: m.across / m.psi,
        along: (m.across + m.along) / m.psi,
    })
}

/// Variates of a particle and a wall.
fn draw(physics: &Physics, walls: &Walls, key: SweepKey, wall: u32, id: u64) -> Option<[f64; 3]> {
    let label = walls.images[wall as usize].label;
    (physics.noise).then(|| physics.variates(key, [label, label], id, id))
}

#[allow(clippy::too_many_arguments)]
pub(super) fn forces(
    arrays: Arrays,
    force: Shared<'_, [f64; 4]>,
    walls: &mut Walls,
    total: &mut [Wrench],
    request: Request,
    exact: bool,
    least: f64,
) {
    let mut tasks = std::mem::take(&mut walls.tasks);
    let Request {
        physics,
        kick,
        key,
        motion,
        conservative,
    } = request;
    for_each_near(&walls.near, &mut tasks, &|number, near, tally| {
        let slot = near.slot as usize;
        let (v, id) = (arrays.velocity(near.slot), arrays.id[slot]);
        let s2 = arrays.position[slot][3].powi(2);
        let mut sum = [0.0; 3];
        for site in &walls.sites[near.first as usize..near.end as usize] {
            let mut f = [0.0; 3];
            if conservative && exact {
                let (volume, slope) = missing(walls, site, physics.dimension);
                let push = -walls.state.kept[number] * slope / ((1.0 - volume) * s2);
                f = site.foot.normal.map(|n| push * n);
            }
            if let Some(grip) = grip(walls, site, s2, least, physics.dimension)
                && physics.friction
            {
                let still = wall_velocity(site, motion);
                let u = [0, 1, 2].map(|a| v[a] - still[a]);
                let xi = draw(&physics, walls, key, site.wall, id);
                let drag = kick.wall_force(&grip, u, xi, physics.central);
                for a in 0..3 {
                    f[a] += drag[a];
                }
            }
            react(site, f, tally);
            for a in 0..3 {
                sum[a] += f[a];
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

pub(super) fn exchange(
    particles: &mut Particles,
    walls: &mut Walls,
    physics: Physics,
    process: Exchange,
    key: SweepKey,
    direction: Direction,
    least: f64,
) {
    let mut tasks = std::mem::take(&mut walls.tasks);
    let velocity = Shared::new(&mut particles.velocity);
    let (position, ids) = (&particles.position, &particles.id);
    for_each_near(&walls.near, &mut tasks, &|_, near, tally| {
        let slot = near.slot as usize;
        let s2 = position[slot][3].powi(2);
        // SAFETY: every slot occurs once among the near ones.
        let v = unsafe { velocity.slot(near.slot) };
        for k in near.first..near.end {
            let index = match direction {
                Direction::Forward => k,
                Direction::Backward => near.first + near.end - 1 - k,
            };
            let site = &walls.sites[index as usize];
            let Some(grip) = grip(walls, site, s2, least, physics.dimension) else {
                continue;
            };
            let u = [0, 1, 2].map(|a| v[a] - site.foot.velocity[a]);
            let xi = draw(&physics, walls, key, site.wall, ids[slot]);
            let change = process.wall_change(&grip, u, xi, physics.central);
            for a in 0..physics.dimension {
                v[a] += change[a];
            }
            react(site, change, tally);
        }
    });
    collect(&mut walls.impulse, &tasks);
    walls.tasks = tasks;
}

pub(super) fn friction_weight(
    particles: &Particles,
    walls: &Walls,
    least: f64,
    dimension: usize,
) -> f64 {
    let of = |site: &Site| {
        let s2 = particles.position[site.slot as usize][3].powi(2);
        grip(walls, site, s2, least, dimension).map_or(0.0, |grip| grip.weight)
    };
    walls.sites.iter().map(of).sum()
}
