//! Bounce-forward (Yang 2013, Table 5), relative to the wall: a particle that has crossed a wall is
//! put back to where its mirror image is, and its velocity towards the wall changes sign. The table
//! is for walls at rest; here v - v_w takes the place of v.

use rayon::prelude::*;

use super::geometry::{cross, dot};
use super::{OwnImages, Shape, TASK, Walls, Wrench};
use crate::domain::PeriodicBox;
use crate::state::Particles;
use crate::sweep::Shared;

/// Reflections in one step; a corner takes as many as it has walls.
const PASSES: usize = 8;
/// A distance behind a wall that is rounding.
const ROUNDING: f64 = 1e-11;

impl Walls {
    /// Reflects what has crossed a wall; the slot of a particle that is outside even then.
    pub fn bounce(&mut self, particles: &mut Particles, cell: &PeriodicBox) -> Option<u32> {
        let mut tasks = std::mem::take(&mut self.tasks);
        let position = Shared::new(&mut particles.position);
        let velocity = Shared::new(&mut particles.velocity);
        let escaped = self
            .near
            .par_chunks(TASK)
            .zip(tasks.par_iter_mut())
            .filter_map(|(near, task)| {
                let OwnImages {
                    tally, crossings, ..
                } = task;
                tally.fill([0.0; 6]);
                *crossings = 0;
                let mut escaped = None;
                for particle in near {
                    // SAFETY: every slot occurs once among the near ones.
                    let (x, v) =
                        unsafe { (position.slot(particle.slot), velocity.slot(particle.slot)) };
                    let walls = particle.first as usize..particle.end as usize;
                    let inside = self.bounce_one(walls, x, v, cell, tally, crossings);
                    if !inside && escaped.is_none() {
                        escaped = Some(particle.slot);
                    }
                }
                escaped
            })
            .min();
        for task in &tasks {
            self.crossings += task.crossings;
            for (total, part) in self.impulse.iter_mut().zip(&task.tally) {
                for a in 0..6 {
                    total[a] += part[a];
                }
            }
        }
        self.tasks = tasks;
        escaped
    }

    fn bounce_one(
        &self,
        sites: std::ops::Range<usize>,
        x: &mut [f64; 4],
        v: &mut [f64; 4],
        cell: &PeriodicBox,
        tally: &mut [Wrench],
        crossings: &mut u64,
    ) -> bool {
        for _ in 0..PASSES {
            let mut crossed = false;
            for site in &self.sites[sites.clone()] {
                let wall = site.wall as usize;
                let at = [x[0], x[1], x[2]];
                let surface = &self.surfaces[wall];
                if surface.distance(at, cell) >= 0.0 {
                    continue;
                }
                let mut foot = surface.foot(at, cell);
                if let Shape::Field { .. } = surface.shape {
                    foot = foot.straightened();
                }
                let distance = foot.distance;
                crossed |= distance < -ROUNDING;
                *crossings += 1;
                let relative = [0, 1, 2].map(|a| v[a] - foot.velocity[a]);
                let turn = -2.0 * dot(relative, foot.normal).min(0.0);
                let change = foot.normal.map(|n| turn * n);
                for a in 0..3 {
                    x[a] -= 2.0 * distance * foot.normal[a];
                    v[a] += change[a];
                }
                let torque = cross(foot.arm, change);
                for a in 0..3 {
                    tally[wall][a] -= change[a];
                    tally[wall][3 + a] -= torque[a];
                }
            }
            if !crossed {
                // Not a number is not inside.
                let at = [x[0], x[1], x[2]];
                return self.sites[sites]
                    .iter()
                    .all(|site| self.surfaces[site.wall as usize].distance(at, cell) >= -ROUNDING);
            }
        }
        false
    }
}
