//! Which model a scene's walls follow: symmetric images, or one of the models of the literature that
//! they are compared with (sweep/wall_model/). A model is chosen once for all walls.

use super::bins::Bins;
use super::{Shape, Site, Walls};
use crate::domain::PeriodicBox;
use crate::error::{Error, Result};
use crate::kernel::{Kernel, Lucy, QuinticSpline, WendlandC2, WendlandC4};
use crate::state::Particles;
use crate::units::Units;
use crate::valid::non_negative;

/// A model as the user gives it: its name and its numbers, in the user's units. "symmetric_images":
/// none. "own_foot_images": 1 for noise, else 0; least distance. "completion": 1 if the pressure is
/// the gradient of the completed density, else 0; least distance. "frozen_particles": least distance.
pub type ModelSettings = (String, Vec<f64>);

/// Labels of noise keys that the model of frozen particles takes: by the order of the two ids.
pub const FROZEN_LABELS: [u8; 2] = [126, 127];
/// Most walls whose own-foot images have noise: two labels each.
const MOST_NOISY: usize = 63;

/// The model of all walls of a scene, lengths in supports.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum WallModel {
    /// r_iJ^2 = r_ij^2 + 4 phi_i phi_j, weights psi_i psi_j: the model of sweep/wall_*.rs.
    #[default]
    SymmetricImages,
    /// Yang (2013), 2.2.4 to 2.2.6: each particle mirrored at the foot of its own perpendicular.
    OwnFootImages {
        /// Has the friction with images noise?
        noise: bool,
        /// No image of a particle nearer to the wall than that.
        least: f64,
    },
    /// Yang (2013), appendix B: density and friction completed in closed form.
    Completion {
        /// Is the pressure force the gradient of the completed density, not that of images?
        exact: bool,
        /// Distances below that count as that in the friction.
        least: f64,
    },
    /// Bian et al. (2015), appendix G: particles that do not move, behind the wall.
    FrozenParticles {
        /// Distances of fluid particles below that count as that in the friction.
        least: f64,
    },
}

impl WallModel {
    /// Does it visit the links of symmetric images?
    pub fn has_links(self) -> bool {
        matches!(
            self,
            Self::SymmetricImages | Self::Completion { exact: false, .. }
        )
    }

    /// Checks and scales what the user gave.
    pub fn parse(settings: &ModelSettings, units: &Units) -> Result<Self> {
        let (name, numbers) = settings;
        let count = match name.as_str() {
            "symmetric_images" => 0,
            "own_foot_images" | "completion" => 2,
            "frozen_particles" => 1,
            other => {
                return Err(Error::Invalid(format!(
                    "`wall_model` must be \"symmetric_images\", \"own_foot_images\", \"completion\" or \"frozen_particles\", got {other:?}"
                )));
            }
        };
        if numbers.len() != count {
            return Err(Error::Invalid(format!(
                "`wall_model` must have {count} numbers, got {}",
                numbers.len()
            )));
        }
        let Some(&last) = numbers.last() else {
            return Ok(Self::SymmetricImages);
        };
        let least = non_negative("wall_model", last)? / units.length;
        let first = numbers[0] != 0.0;
        Ok(match name.as_str() {
            "own_foot_images" => Self::OwnFootImages {
                noise: first,
                least,
            },
            "completion" => Self::Completion {
                exact: first,
                least,
            },
            _ => Self::FrozenParticles { least },
        })
    }
}

/// Particles that do not move, behind the walls.
#[derive(Debug, Clone, Default)]
pub struct Frozen {
    /// Where they are [h].
    pub points: Vec<[f64; 3]>,
    /// The wall each is behind.
    pub wall: Vec<u32>,
    /// How far.
    pub depth: Vec<f64>,
    /// Sum of W over the frozen ones, itself included.
    pub constant: Vec<f64>,
    /// Number density.
    pub density: Vec<f64>,
    /// P/d^2.
    pub share: Vec<f64>,
}

/// What a model keeps besides the sites.
#[derive(Debug, Clone, Default)]
pub struct ModelState {
    /// The box, once a model is chosen.
    pub cell: Option<PeriodicBox>,
    /// Own-foot images by site; infinite where there is none.
    pub images: Vec<[f64; 3]>,
    /// First partner of each site, and the number of them at the end.
    pub first: Vec<u32>,
    /// Sites whose images, or frozen particles that, may come within the support.
    pub partners: Vec<u32>,
    /// First slot in `back` of each frozen particle, and the number of them at the end.
    pub first_back: Vec<u32>,
    /// Slots that have a frozen particle as a partner.
    pub back: Vec<u32>,
    /// The frozen particles.
    pub frozen: Frozen,
    /// 1/(1 - Delta) by near particle.
    pub factor: Vec<f64>,
    /// What a near particle's record had in the place of something else, for the time of a sweep.
    pub kept: Vec<f64>,
}

impl ModelState {
    /// Partners of a site.
    pub fn partners(&self, site: u32) -> &[u32] {
        let site = site as usize;
        &self.partners[self.first[site] as usize..self.first[site + 1] as usize]
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        24 * (self.images.capacity() + self.frozen.points.capacity())
            + 4 * (self.first.capacity() + self.partners.capacity())
            + 4 * (self.first_back.capacity() + self.back.capacity())
            + 32 * self.frozen.depth.capacity()
            + 8 * (self.factor.capacity() + self.kept.capacity())
    }
}

fn refuse<T>(text: &str) -> Result<T> {
    Err(Error::Invalid(format!("`wall_model` {text}")))
}

impl Walls {
    /// Reads and chooses the model, for the kernel of a name.
    #[allow(clippy::too_many_arguments)]
    pub fn set_model(
        &mut self,
        settings: &ModelSettings,
        frozen: &[[f64; 3]],
        kernel: &str,
        splitting: Option<bool>,
        dimension: usize,
        cell: &PeriodicBox,
        units: &Units,
    ) -> Result<()> {
        let model = WallModel::parse(settings, units)?;
        if !self.any() {
            return Ok(());
        }
        match kernel {
            Lucy::NAME => self.choose_model::<Lucy>(model, frozen, splitting, dimension, cell),
            QuinticSpline::NAME => {
                self.choose_model::<QuinticSpline>(model, frozen, splitting, dimension, cell)
            }
            WendlandC2::NAME => {
                self.choose_model::<WendlandC2>(model, frozen, splitting, dimension, cell)
            }
            _ => self.choose_model::<WendlandC4>(model, frozen, splitting, dimension, cell),
        }
    }

    /// Chooses the model; `frozen` [h] are places behind the walls up to twice the support deep, of
    /// which the nearer half is taken: the others complete its density. `splitting` says whether
    /// friction is solved exactly, link by link; none without friction.
    fn choose_model<K: Kernel>(
        &mut self,
        model: WallModel,
        frozen: &[[f64; 3]],
        splitting: Option<bool>,
        dimension: usize,
        cell: &PeriodicBox,
    ) -> Result<()> {
        self.model = model;
        self.state.cell = Some(*cell);
        let shaped = (self.surfaces.iter()).any(|s| matches!(s.shape, Shape::Field { .. }));
        match model {
            WallModel::SymmetricImages => {}
            WallModel::OwnFootImages { noise, .. } => {
                if splitting == Some(true) {
                    return refuse(
                        "\"own_foot_images\" needs the integrator \"velocity_verlet\": its friction is not symmetric",
                    );
                }
                if noise && self.surfaces.len() > MOST_NOISY {
                    return refuse(&format!(
                        "\"own_foot_images\" with noise must have at most {MOST_NOISY} walls, got {}",
                        self.surfaces.len()
                    ));
                }
            }
            WallModel::Completion { least, .. } => {
                if K::NAME != Lucy::NAME {
                    return refuse(&format!(
                        "\"completion\" needs the kernel \"lucy\", got {:?}",
                        K::NAME
                    ));
                }
                if shaped {
                    return refuse(
                        "\"completion\" needs walls that are planes, cylinders or spheres",
                    );
                }
                needs_distance(least, splitting)?;
            }
            WallModel::FrozenParticles { least } => {
                if shaped {
                    return refuse(
                        "\"frozen_particles\" needs walls that are planes, cylinders or spheres",
                    );
                }
                needs_distance(least, splitting)?;
                self.freeze::<K>(frozen, dimension, cell)?;
            }
        }
        Ok(())
    }

    fn freeze<K: Kernel>(
        &mut self,
        points: &[[f64; 3]],
        dimension: usize,
        cell: &PeriodicBox,
    ) -> Result<()> {
        let mut frozen = Frozen::default();
        let bins = Bins::new(points, 1.0, dimension, cell);
        for &point in points {
            // Behind two walls: the one it lies deeper behind, through which it is seen.
            let (distance, wall) = self.nearest(point, cell);
            if distance.is_nan() || distance >= 0.0 {
                return Err(Error::Invalid(format!(
                    "`frozen` must lie behind the walls, got {point:?} supports"
                )));
            }
            if distance <= -1.0 {
                continue;
            }
            let mut sum = 0.0;
            bins.visit(point, cell, |other| {
                let r2: f64 = (0..dimension)
                    .map(|a| {
                        cell.separation(a, point[a] - points[other as usize][a])
                            .powi(2)
                    })
                    .sum();
                sum += if dimension == 2 {
                    K::w::<_, 2>(r2.sqrt())
                } else {
                    K::w::<_, 3>(r2.sqrt())
                };
            });
            frozen.points.push(point);
            frozen.wall.push(wall as u32);
            frozen.depth.push(-distance);
            frozen.constant.push(sum);
        }
        if frozen.points.is_empty() {
            return Err(Error::Invalid(
                "`frozen` must hold places behind the walls, got none within a support".into(),
            ));
        }
        frozen.density.clone_from(&frozen.constant);
        frozen.share = vec![0.0; frozen.points.len()];
        self.state.frozen = frozen;
        Ok(())
    }

    /// Finds partners when the list is built anew; `margin` as that of the list.
    pub(super) fn rebuild_model(
        &mut self,
        particles: &Particles,
        dimension: usize,
        cell: &PeriodicBox,
        margin: f64,
    ) {
        match self.model {
            WallModel::SymmetricImages => {}
            WallModel::OwnFootImages { least, .. } => {
                self.state.images.resize(self.sites.len(), [0.0; 3]);
                self.place_images(particles, least);
                self.find_images(particles, dimension, cell, margin);
            }
            WallModel::Completion { .. } => {
                self.state.factor.resize(self.near.len(), 1.0);
                self.state.kept.resize(self.near.len(), 0.0);
            }
            WallModel::FrozenParticles { .. } => {
                self.find_frozen(particles, dimension, cell, margin);
            }
        }
    }

    /// Brings the own-foot images up to date with the sites.
    pub(crate) fn place_images(&mut self, particles: &Particles, least: f64) {
        let shaped = |site: &Site| {
            let shape = &self.surfaces[site.wall as usize].shape;
            matches!(shape, Shape::Field { .. })
        };
        for (image, site) in self.state.images.iter_mut().zip(&self.sites) {
            let foot = if shaped(site) {
                site.foot.straightened()
            } else {
                site.foot
            };
            let position = &particles.position[site.slot as usize];
            // From farther away than a support it would lie beyond the centre of a round wall.
            *image = if foot.distance < least || foot.distance >= 1.0 {
                [f64::INFINITY; 3]
            } else {
                [0, 1, 2].map(|a| position[a] - 2.0 * foot.distance * foot.normal[a])
            };
        }
    }

    /// Whose images may come within the support of whom. An image moves as far as its particle at a
    /// plane and outside of a round wall. Inside it moves farther, but is never nearer than the
    /// particle itself; and no image is farther from its particle than twice the support.
    fn find_images(
        &mut self,
        particles: &Particles,
        dimension: usize,
        cell: &PeriodicBox,
        margin: f64,
    ) {
        let walls = self.surfaces.len();
        let mut searches = Vec::with_capacity(walls);
        for (wall, surface) in self.surfaces.iter().enumerate() {
            let (images, reach) = match surface.shape {
                Shape::Round { side, .. } if side < 0.0 => (false, 1.0 + margin),
                Shape::Field { .. } => (false, 3.0 + 3.0 * margin),
                _ => (true, 1.0 + margin),
            };
            let members: Vec<u32> = (0..self.sites.len() as u32)
                .filter(|&s| self.sites[s as usize].wall == wall as u32)
                .collect();
            let points: Vec<[f64; 3]> = members
                .iter()
                .map(|&s| {
                    let site = &self.sites[s as usize];
                    let position = &particles.position[site.slot as usize];
                    let back = if images {
                        2.0 * site.foot.distance
                    } else {
                        0.0
                    };
                    [0, 1, 2].map(|a| position[a] - back * site.foot.normal[a])
                })
                .collect();
            let bins = Bins::new(&points, reach, dimension, cell);
            searches.push((members, points, bins, reach));
        }
        let ModelState {
            first, partners, ..
        } = &mut self.state;
        first.clear();
        partners.clear();
        for site in &self.sites {
            first.push(partners.len() as u32);
            let (members, points, bins, reach) = &searches[site.wall as usize];
            let record = &particles.position[site.slot as usize];
            let position = [record[0], record[1], record[2]];
            bins.visit(position, cell, |number| {
                let point = &points[number as usize];
                if square(position, point, dimension, cell) < reach * reach {
                    partners.push(members[number as usize]);
                }
            });
        }
        first.push(partners.len() as u32);
    }

    /// Which frozen particles may come within the support of whom.
    fn find_frozen(
        &mut self,
        particles: &Particles,
        dimension: usize,
        cell: &PeriodicBox,
        margin: f64,
    ) {
        let reach = 1.0 + 0.5 * margin;
        let ModelState {
            first,
            partners,
            first_back,
            back,
            frozen,
            ..
        } = &mut self.state;
        let bins = Bins::new(&frozen.points, reach, dimension, cell);
        first.clear();
        partners.clear();
        let mut counts = vec![0_u32; frozen.points.len() + 1];
        for site in &self.sites {
            first.push(partners.len() as u32);
            let record = &particles.position[site.slot as usize];
            let position = [record[0], record[1], record[2]];
            bins.visit(position, cell, |number| {
                let k = number as usize;
                let near = square(position, &frozen.points[k], dimension, cell) < reach * reach;
                if near && frozen.wall[k] == site.wall {
                    partners.push(number);
                    counts[k + 1] += 1;
                }
            });
        }
        first.push(partners.len() as u32);
        for k in 1..counts.len() {
            counts[k] += counts[k - 1];
        }
        first_back.clone_from(&counts);
        back.resize(partners.len(), 0);
        for (index, site) in self.sites.iter().enumerate() {
            for &k in &partners[first[index] as usize..first[index + 1] as usize] {
                let next = &mut counts[k as usize];
                back[*next as usize] = site.slot;
                *next += 1;
            }
        }
    }
}

fn square(one: [f64; 3], other: &[f64; 3], dimension: usize, cell: &PeriodicBox) -> f64 {
    (0..dimension)
        .map(|a| cell.separation(a, one[a] - other[a]).powi(2))
        .sum()
}

/// Friction that grows as 1/phi is for the exact exchange; an explicit step needs a bound.
fn needs_distance(least: f64, splitting: Option<bool>) -> Result<()> {
    if least > 0.0 || splitting != Some(false) {
        return Ok(());
    }
    refuse(
        "needs the integrator \"pair_splitting\", or a least distance > 0: its friction has no bound at the wall",
    )
}
