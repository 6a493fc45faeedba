//! Sweeps over the images of particles near walls. Links go block by block in colour order like
//! pairs, own images particle by particle; sums over walls are formed block by block and task by
//! task and added in their order. So the bits do not depend on threads here either.

use rayon::prelude::*;

use super::Shared;
use crate::domain::PeriodicBox;
use crate::neighbor::Grid;
use crate::physics::LinkAxes;
use crate::wall::{BlockLinks, Image, Link, Near, Site, TASK, Walls, Wrench};

/// Squared lengths below this have no direction.
const POINT: f64 = 1e-24;

/// What sweeps read of the walls.
#[derive(Clone, Copy)]
pub(super) struct Scenery<'a> {
    pub images: &'a [Image],
    pub sites: &'a [Site],
    pub cell: &'a PeriodicBox,
    pub position: &'a [[f64; 4]],
}

/// Where the image of one particle stands to another, or to the particle itself.
pub(super) struct View<'a> {
    pub image: &'a Image,
    /// r_ij.
    pub r: [f64; 3],
    /// Distance to the image.
    pub distance: f64,
    /// w_ij: product of psi of all walls at both ends.
    pub weight: f64,
    /// Sites at both ends, the same for an own image.
    pub ends: [&'a [u32]; 2],
}

impl<'a> Scenery<'a> {
    fn view(&self, image: &'a Image, r: [f64; 3], ends: [&'a [u32]; 2]) -> Option<View<'a>> {
        let mut r2 = r[0] * r[0] + r[1] * r[1] + r[2] * r[2];
        let mut weight = 1.0;
        for (&a, &b) in ends[0].iter().zip(ends[1]) {
            let (one, other) = (&self.sites[a as usize], &self.sites[b as usize]);
            r2 += 4.0 * one.foot.distance * other.foot.distance;
            weight *= one.weight * other.weight;
        }
        // A particle may be behind the wall by rounding.
        (r2 < 1.0).then(|| View {
            image,
            r,
            distance: r2.max(0.0).sqrt(),
            weight,
            ends,
        })
    }

    /// The view along a link; none if the image is too far.
    pub fn link<const D: usize>(&self, link: &'a Link) -> Option<View<'a>> {
        let image = &self.images[link.image as usize];
        let [i, j] = link.slots.map(|slot| &self.position[slot as usize]);
        let mut r = self
            .cell
            .nearest::<D>([i[0] - j[0], i[1] - j[1], i[2] - j[2]]);
        if D == 2 {
            r[2] = 0.0;
        }
        let ends = [&link.sites[..image.order], &link.others[..image.order]];
        self.view(image, r, ends)
    }

    /// Calls `work` for each image of a particle near enough to it, in the order of the images or
    /// from their end.
    pub fn own(&self, walls: &Walls, near: &Near, reverse: bool, mut work: impl FnMut(&View<'_>)) {
        for k in 0..self.images.len() {
            let image = &self.images[if reverse {
                self.images.len() - 1 - k
            } else {
                k
            }];
            if let Some(sites) = walls.own_sites(near, image.walls()) {
                let ends = &sites[..image.order];
                if let Some(view) = self.view(image, [0.0; 3], [ends, ends]) {
                    work(&view);
                }
            }
        }
    }

    /// Sites of wall k of a view at both ends.
    pub fn ends(&self, view: &View<'_>, k: usize) -> (&'a Site, &'a Site) {
        (
            &self.sites[view.ends[0][k] as usize],
            &self.sites[view.ends[1][k] as usize],
        )
    }

    /// The directions of friction.
    pub fn axes(&self, view: &View<'_>) -> LinkAxes {
        let (mut across, mut tangent) = ([0.0; 3], view.r);
        for k in 0..view.image.order {
            let (one, other) = self.ends(view, k);
            let sum: [f64; 3] = std::array::from_fn(|a| one.foot.normal[a] + other.foot.normal[a]);
            let normal = unit(sum);
            let height = one.foot.distance + other.foot.distance;
            let along = dot(view.r, normal);
            for a in 0..3 {
                across[a] += height * normal[a];
                tangent[a] -= along * normal[a];
            }
        }
        let normal = unit(across);
        let rest = dot(tangent, normal);
        let tangent = unit(std::array::from_fn(|a| tangent[a] - rest * normal[a]));
        let r2 = view.distance * view.distance;
        let normal2 = (dot(across, across) / r2.max(POINT)).min(1.0);
        LinkAxes {
            normal,
            normal2,
            tangent,
            tangent2: 1.0 - normal2,
        }
    }

    /// Mean velocity of the walls of a view at both feet.
    pub fn wall_velocity(&self, view: &View<'_>) -> [f64; 3] {
        let mut sum = [0.0; 3];
        for k in 0..view.image.order {
            let (one, other) = self.ends(view, k);
            for a in 0..3 {
                sum[a] += one.foot.velocity[a] + other.foot.velocity[a];
            }
        }
        sum.map(|x| x / (2 * view.image.order) as f64)
    }

    /// The walls of a view get -(first + second), changes of momentum at its ends, in equal parts,
    /// with their torques.
    pub fn react(&self, view: &View<'_>, first: [f64; 3], second: [f64; 3], tally: &mut [Wrench]) {
        let part = 1.0 / view.image.order as f64;
        for k in 0..view.image.order {
            let (one, other) = self.ends(view, k);
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

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
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

/// Calls `work` for the links of every block with its sums, colour by colour.
pub(super) fn for_each_links(
    grid: &Grid,
    links: &mut [BlockLinks],
    reverse: bool,
    work: impl Fn(&[Link], &mut [Wrench]) + Sync,
) {
    let parallel = rayon::current_num_threads() > 1;
    let shared = Shared::new(links);
    let one = |&base: &u32| {
        // SAFETY: every base block occurs once among the colours.
        let block = unsafe { shared.slot(base) };
        block.tally.fill([0.0; 6]);
        if !block.links.is_empty() {
            work(&block.links, &mut block.tally);
        }
    };
    let colour_work = |colour: &Vec<u32>| {
        if parallel && colour.len() > 1 {
            colour.par_iter().for_each(one);
        } else {
            colour.iter().for_each(one);
        }
    };
    if reverse {
        grid.colours.iter().rev().for_each(colour_work);
    } else {
        grid.colours.iter().for_each(colour_work);
    }
}

/// Calls `work` for every near particle with the sums of its task.
pub(super) fn for_each_near(
    near: &[Near],
    tasks: &mut [Vec<Wrench>],
    work: impl Fn(&Near, &mut [Wrench]) + Sync,
) {
    near.par_chunks(TASK)
        .zip(tasks.par_iter_mut())
        .for_each(|(near, tally)| {
            tally.fill([0.0; 6]);
            for particle in near {
                work(particle, tally);
            }
        });
}

/// Adds the sums of all blocks and tasks.
pub(super) fn collect(total: &mut [Wrench], links: &[BlockLinks], tasks: &[Vec<Wrench>]) {
    let tallies = links.iter().map(|block| &block.tally).chain(tasks);
    for tally in tallies {
        for (sum, part) in total.iter_mut().zip(tally) {
            for a in 0..6 {
                sum[a] += part[a];
            }
        }
    }
}
