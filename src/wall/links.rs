//! Who has images near whom: found when the list is built. Every step brings the sites up to date.

use rayon::prelude::*;

use super::{Foot, Shape, TASK, Walls, Wrench};
use crate::domain::PeriodicBox;
use crate::neighbor::{BlockList, Grid, PairList, ROUNDS};
use crate::physics::LinkAxes;
use crate::state::Particles;

/// A particle that may be within a support of a wall before the list is built anew.
#[derive(Debug, Clone, Copy)]
pub struct Near {
    /// Its slot.
    pub slot: u32,
    /// Its sites.
    pub first: u32,
    /// End of its sites.
    pub end: u32,
}

/// A particle and one wall.
#[derive(Debug, Clone, Copy, Default)]
pub struct Site {
    /// Slot of the particle.
    pub slot: u32,
    /// The wall.
    pub wall: u32,
    /// phi, normal, velocity of the wall, arm of the torque.
    pub foot: Foot,
    /// psi.
    pub weight: f64,
    /// d psi/d phi.
    pub slope: f64,
    /// Gradient of psi at a field wall, in place of `slope`.
    pub climb: [f64; 3],
}

/// A pair whose image distance may be below the support.
#[derive(Debug, Clone, Copy)]
pub struct Link {
    /// Slots.
    pub slots: [u32; 2],
    /// Sites of the first particle, one for each wall of the image.
    pub sites: [u32; 3],
    /// Sites of the second.
    pub others: [u32; 3],
    /// Index of the kind of image.
    pub image: u32,
}

/// A link within the support at the present positions, with what all sweeps of a step need of it.
#[derive(Debug, Clone, Copy)]
pub struct View {
    /// The link; that of an own image has one particle at both ends.
    pub link: Link,
    /// r_ij.
    pub r: [f64; 3],
    /// Distance to the image.
    pub distance: f64,
    /// w_ij: product of psi of all walls at both ends.
    pub weight: f64,
    /// Directions of friction.
    pub axes: LinkAxes,
    /// Mean velocity of the walls at both feet.
    pub wall: [f64; 3],
}

/// The own images of the particles of one task.
#[derive(Debug, Default, Clone)]
pub struct OwnImages {
    /// Those within the support.
    pub views: Vec<View>,
    /// Sums by wall, of the sweep under way.
    pub(crate) tally: Vec<Wrench>,
    /// Particles put back in the last step.
    pub(crate) crossings: u64,
    /// The same of heat received, work done and updates refused, where there is heat.
    pub(crate) energies: Vec<[f64; 3]>,
}

/// The links of one base block, in the order of its pairs.
#[derive(Debug, Default, Clone)]
pub struct BlockLinks {
    /// The links.
    pub links: Vec<Link>,
    /// Those within the support.
    pub views: Vec<View>,
    /// Sums over the links by wall, of the sweep under way.
    pub(crate) tally: Vec<Wrench>,
    /// The same of heat received, work done and updates refused, where there is heat.
    pub(crate) energies: Vec<[f64; 3]>,
}

impl BlockLinks {
    pub(super) fn bytes(&self) -> usize {
        size_of::<Link>() * self.links.capacity() + size_of::<View>() * self.views.capacity()
    }
}

impl Walls {
    /// Finds near particles and links from the present positions and the pairs of a fresh list;
    /// `margin` as that of the list.
    pub fn rebuild<const D: usize>(
        &mut self,
        particles: &Particles,
        grid: &Grid,
        list: &PairList,
        cell: &PeriodicBox,
        margin: f64,
    ) {
        if !self.any() {
            return;
        }
        self.find_near(particles, cell, 1.0 + 0.5 * margin);
        let walls = self.surfaces.len();
        self.tasks
            .resize_with(self.near.len().div_ceil(TASK), OwnImages::default);
        let kinds = self.images.len();
        for task in &mut self.tasks {
            task.tally.resize(walls, [0.0; 6]);
            task.energies.resize(walls, [0.0; 3]);
            task.views.clear();
            // No step is to allocate; at corners a particle has a few own images.
            task.views.reserve(TASK * kinds.min(7));
        }
        self.rebuild_model(particles, D, cell, margin);
        if !self.model.has_links() {
            return;
        }
        let mut links = std::mem::take(&mut self.links);
        links.resize_with(grid.block_count(), BlockLinks::default);
        links
            .par_iter_mut()
            .zip(&list.blocks)
            .for_each(|(block, pairs)| {
                block.links.clear();
                block.tally.resize(walls, [0.0; 6]);
                block.energies.resize(walls, [0.0; 3]);
                self.find_links::<D>(block, pairs, particles, cell, margin);
                block.views.clear();
                block.views.reserve(block.links.len());
            });
        self.links = links;
    }

    fn find_near(&mut self, particles: &Particles, cell: &PeriodicBox, reach: f64) {
        self.near.clear();
        self.sites.clear();
        self.first_site.clear();
        for (slot, record) in particles.position.iter().enumerate() {
            let first = self.sites.len() as u32;
            self.first_site.push(first);
            let position = [record[0], record[1], record[2]];
            for (wall, surface) in self.surfaces.iter().enumerate() {
                if surface.distance(position, cell) < reach {
                    self.sites.push(Site {
                        slot: slot as u32,
                        wall: wall as u32,
                        ..Site::default()
                    });
                }
            }
            let end = self.sites.len() as u32;
            if end > first {
                self.near.push(Near {
                    slot: slot as u32,
                    first,
                    end,
                });
            }
        }
        self.first_site.push(self.sites.len() as u32);
        self.place(particles, cell);
    }

    /// Brings the sites up to date with the positions.
    pub fn place(&mut self, particles: &Particles, cell: &PeriodicBox) {
        let (surfaces, curvature, weight) = (&self.surfaces, &self.curvature, &self.weight);
        self.sites
            .par_iter_mut()
            .with_min_len(TASK)
            .for_each(|site| {
                let record = &particles.position[site.slot as usize];
                let wall = site.wall as usize;
                let position = [record[0], record[1], record[2]];
                let surface = &surfaces[wall];
                if let Shape::Field { field, centre } = &surface.shape {
                    let local = field.at(position);
                    site.foot = surface.field_foot(*centre, &local, position, cell);
                    (site.weight, site.climb) = (local.weight, local.climb);
                    return;
                }
                site.foot = surface.foot(position, cell);
                (site.weight, site.slope) = match weight {
                    Some(weight) if curvature[wall] != 0.0 => {
                        let (p, slope) = weight.at(site.foot.distance);
                        (1.0 + curvature[wall] * p, curvature[wall] * slope)
                    }
                    _ => (1.0, 0.0),
                };
            });
    }

    /// Site of a slot at a wall.
    fn site(&self, slot: u32, wall: u32) -> Option<u32> {
        let range = self.first_site[slot as usize]..self.first_site[slot as usize + 1];
        range
            .into_iter()
            .find(|&s| self.sites[s as usize].wall == wall)
    }

    /// The site of the own image of a near particle over `walls`, one for each.
    pub fn own_sites(&self, near: &Near, walls: &[u32]) -> Option<[u32; 3]> {
        let mut sites = [0; 3];
        for (k, &wall) in walls.iter().enumerate() {
            sites[k] = self.site(near.slot, wall)?;
        }
        Some(sites)
    }

    fn find_links<const D: usize>(
        &self,
        block: &mut BlockLinks,
        pairs: &BlockList,
        particles: &Particles,
        cell: &PeriodicBox,
        margin: f64,
    ) {
        let has_site =
            |slot: u32| self.first_site[slot as usize] < self.first_site[slot as usize + 1];
        let mut region = pairs.region().flatten();
        if !region.any(|slot| has_site(slot as u32)) {
            return;
        }
        let mut visit = |i: u32, j: u32| {
            if has_site(i) && has_site(j) {
                self.link_pair::<D>(&mut block.links, [i, j], particles, cell, margin);
            }
        };
        if pairs.shuffled.is_empty() {
            for (head, others) in pairs.rows.iter() {
                others.iter().for_each(|&other| visit(head, other));
            }
        } else {
            for pair in &pairs.shuffled[..pairs.rounds[ROUNDS] as usize] {
                let [i, j] = pair.map(|place| pairs.slots[place as usize]);
                visit(i, j);
            }
        }
    }

    fn link_pair<const D: usize>(
        &self,
        links: &mut Vec<Link>,
        slots: [u32; 2],
        particles: &Particles,
        cell: &PeriodicBox,
        margin: f64,
    ) {
        let [i, j] = slots.map(|slot| particles.position[slot as usize]);
        let r = cell.nearest::<D>([i[0] - j[0], i[1] - j[1], i[2] - j[2]]);
        let r2: f64 = r[..D].iter().map(|x| x * x).sum();
        // What it can shrink to before the list is built anew.
        let nearest = (r2.sqrt() - margin).max(0.0).powi(2);
        let height = |site: u32| (self.sites[site as usize].foot.distance - 0.5 * margin).max(0.0);
        for (index, image) in self.images.iter().enumerate() {
            let (mut sites, mut others, mut sum) = ([0; 3], [0; 3], nearest);
            let found = image.walls().iter().enumerate().all(|(k, &wall)| {
                match (self.site(slots[0], wall), self.site(slots[1], wall)) {
                    (Some(a), Some(b)) => {
                        (sites[k], others[k]) = (a, b);
                        sum += 4.0 * height(a) * height(b);
                        true
                    }
                    _ => false,
                }
            });
            if found && sum < 1.0 {
                links.push(Link {
                    slots,
                    sites,
                    others,
                    image: index as u32,
                });
            }
        }
    }
}
