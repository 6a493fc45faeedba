//! What images add to the number density: psi_i psi_j W(r_iJ), own image included.

use super::wall::{Scenery, for_each_links, for_each_near};
use super::{Shared, wall_model};
use crate::domain::PeriodicBox;
use crate::kernel::Kernel;
use crate::neighbor::Grid;
use crate::state::Particles;
use crate::wall::{WallModel, Walls};

/// Brings the walls' sites and views up to date and adds the walls' part to the densities [h^-D].
pub fn wall_densities<K: Kernel, const D: usize>(
    particles: &mut Particles,
    walls: &mut Walls,
    grid: &Grid,
    cell: &PeriodicBox,
) {
    if walls.model == WallModel::SymmetricImages {
        symmetric_densities::<K, D>(particles, walls, grid, cell);
    } else {
        wall_model::densities::<K, D>(particles, walls, grid, cell);
    }
}

/// The same for symmetric images.
pub(super) fn symmetric_densities<K: Kernel, const D: usize>(
    particles: &mut Particles,
    walls: &mut Walls,
    grid: &Grid,
    cell: &PeriodicBox,
) {
    if !walls.any() {
        return;
    }
    walls.place(particles, cell);
    let mut links = std::mem::take(&mut walls.links);
    let mut tasks = std::mem::take(&mut walls.tasks);
    let density = Shared::new(&mut particles.density);
    let position = &particles.position;
    let scenery = Scenery::of(walls);
    for_each_links(grid, &mut links, false, true, &|block| {
        block.views.clear();
        for link in &block.links {
            if let Some(view) = scenery.link::<D>(link, position, cell) {
                let share = view.weight * K::w::<_, D>(view.distance);
                block.views.push(view);
                // SAFETY: blocks of one colour share no particle, and the two differ.
                unsafe {
                    *density.slot(link.slots[0]) += share;
                    *density.slot(link.slots[1]) += share;
                }
            }
        }
    });
    for_each_near(&walls.near, &mut tasks, &|near, task| {
        task.views.clear();
        for particle in near {
            scenery.own(walls, particle, |view| {
                let share = view.weight * K::w::<_, D>(view.distance);
                task.views.push(view);
                // SAFETY: every slot occurs once among the near ones.
                unsafe { *density.slot(particle.slot) += share };
            });
        }
    });
    (walls.links, walls.tasks) = (links, tasks);
}
