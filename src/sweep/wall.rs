//! Sweeps over the images of particles near walls. Links go block by block in colour order like
//! pairs, own images particle by particle; sums over walls are formed block by block and task by
//! task and added in their order. So the bits do not depend on threads here either.
//!
//! The density sweep looks at every link and keeps a `View` of those within the support; the other
//! sweeps of a step go along these.

use rayon::prelude::*;

use super::Shared;
use crate::domain::PeriodicBox;
use crate::neighbor::Grid;
use crate::physics::LinkAxes;
use crate::wall::{BlockLinks, Image, Link, Near, OwnImages, Site, TASK, View, Walls, Wrench};

/// Squared lengths below this have no direction.
const POINT: f64 = 1e-24;

/// What sweeps read of the walls.
#[derive(Clone, Copy)]
pub(super) struct Scenery<'a> {
    pub images: &'a [Image],
    pub sites: &'a [Site],
}

impl<'a> Scenery<'a> {
    pub fn of(walls: &'a Walls) -> Self {
        Self {
            images: &walls.images,
            sites: &walls.sites,
        }
    }

    /// The view along a link; none if the image is too far.
    pub fn link<const D: usize>(
        &self,
        link: &Link,
        position: &[[f64; 4]],
        cell: &PeriodicBox,
    ) -> Option<View> {
        let [i, j] = link.slots.map(|slot| &position[slot as usize]);
        let mut r = cell.nearest::<D>([i[0] - j[0], i[1] - j[1], i[2] - j[2]]);
        if D == 2 {
            r[2] = 0.0;
        }
        self.view(link, r)
    }

    /// Calls `work` for each image of a particle near enough to it.
    pub fn own(&self, walls: &Walls, near: &Near, mut work: impl FnMut(View)) {
        for (index, image) in self.images.iter().enumerate() {
            if let Some(sites) = walls.own_sites(near, image.walls()) {
                let link = Link {
                    slots: [near.slot; 2],
                    sites,
                    others: sites,
                    image: index as u32,
                };
                if let Some(view) = self.view(&link, [0.0; 3]) {
                    work(view);
                }
            }
        }
    }

    fn view(&self, link: &Link, r: [f64; 3]) -> Option<View> {
        let Image { order, shaped, .. } = self.images[link.image as usize];
        let own = link.slots[0] == link.slots[1];
        let mut r2 = r[0] * r[0] + r[1] * r[1] + r[2] * r[2];
        let mut weight = 1.0;
        for k in 0..order {
            let (one, other) = self.pair(link, k);
            r2 += 4.0 * one.foot.distance * other.foot.distance;
            weight *= one.weight * other.weight;
        }
        if r2 >= 1.0 {
            return None;
        }
        // A particle may be behind the wall by rounding.
        let distance = r2.max(0.0).sqrt();
        let mut wall = [0.0; 3];
        let (mut across, mut tangent) = ([0.0; 3], r);
        for k in 0..order {
            let (one, other) = self.pair(link, k);
            let sum = [0, 1, 2].map(|a| one.foot.normal[a] + other.foot.normal[a]);
            // Where a wall of any shape faces itself both gradients cancel, and no direction is left.
            let normal = if shaped && !own {
                sum.map(|x| 0.5 * x)
            } else {
                unit(sum)
            };
            let height = one.foot.distance + other.foot.distance;
            let along = dot(r, normal);
            for a in 0..3 {
                across[a] += height * normal[a];
                tangent[a] -= along * normal[a];
                wall[a] += one.foot.velocity[a] + other.foot.velocity[a];
            }
        }
        let normal = unit(across);
        let rest = dot(tangent, normal);
        let tangent = unit([0, 1, 2].map(|a| tangent[a] - rest * normal[a]));
        let normal2 = (dot(across, across) / r2.max(POINT)).min(1.0);
        Some(View {
            link: *link,
            r,
            distance,
            weight,
            axes: LinkAxes {
                normal,
                normal2,
                tangent,
                tangent2: 1.0 - normal2,
            },
            wall: wall.map(|x| x / (2 * order) as f64),
        })
    }

    fn pair(&self, link: &Link, k: usize) -> (&'a Site, &'a Site) {
        (
            &self.sites[link.sites[k] as usize],
            &self.sites[link.others[k] as usize],
        )
    }

    pub fn image(&self, view: &View) -> &'a Image {
        &self.images[view.link.image as usize]
    }

    /// Sites of the walls of a view at both ends, wall by wall.
    pub fn ends(&self, view: &View) -> impl Iterator<Item = (&'a Site, &'a Site)> + use<'a, '_> {
        let link = view.link;
        (0..self.image(view).order).map(move |k| self.pair(&link, k))
    }

    /// The walls of a view get -(first + second), changes of momentum at its ends, in equal parts,
    /// with their torques.
    pub fn react(&self, view: &View, first: [f64; 3], second: [f64; 3], tally: &mut [Wrench]) {
        let part = 1.0 / self.image(view).order as f64;
        for (one, other) in self.ends(view) {
            let wrench = &mut tally[one.wall as usize];
            let torques = [cross(one.foot.arm, first), cross(other.foot.arm, second)];
            for a in 0..3 {
                wrench[a] -= part * (first[a] + second[a]);
                wrench[3 + a] -= part * (torques[0][a] + torques[1][a]);
            }
        }
    }
}

pub(super) fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

pub(super) fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

fn unit(x: [f64; 3]) -> [f64; 3] {
    let square = dot(x, x);
    if square < POINT {
        return [0.0; 3];
    }
    let scale = 1.0 / square.sqrt();
    x.map(|x| x * scale)
}

/// Calls `work` for every block that has links, colour by colour, its sums set to 0 if they are to
/// be `fresh`.
pub(super) fn for_each_links(
    grid: &Grid,
    links: &mut [BlockLinks],
    reverse: bool,
    fresh: bool,
    work: &(dyn Fn(&mut BlockLinks) + Sync),
) {
    let shared = Shared::new(links);
    grid.schedule.run(reverse, &|base| {
        // SAFETY: every base block has one turn.
        let block = unsafe { shared.slot(base) };
        if !block.links.is_empty() {
            if fresh {
                block.tally.fill([0.0; 6]);
            }
            work(block);
        }
    });
}

/// Calls `work` for every task of near particles, its sums set to 0.
pub(super) fn for_each_near(
    near: &[Near],
    tasks: &mut [OwnImages],
    work: &(dyn Fn(&[Near], &mut OwnImages) + Sync),
) {
    near.par_chunks(TASK)
        .zip(tasks.par_iter_mut())
        .for_each(|(near, task)| {
            task.tally.fill([0.0; 6]);
            work(near, task);
        });
}

/// Adds the sums of all blocks and tasks.
pub(super) fn collect(total: &mut [Wrench], links: &[BlockLinks], tasks: &[OwnImages]) {
    let blocks = links.iter().filter(|block| !block.links.is_empty());
    let tallies = blocks
        .map(|block| &block.tally)
        .chain(tasks.iter().map(|task| &task.tally));
    for tally in tallies {
        for (sum, part) in total.iter_mut().zip(tally) {
            for a in 0..6 {
                sum[a] += part[a];
            }
        }
    }
}
