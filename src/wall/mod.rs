//! Walls by virtual particles: every particle near a wall has an image behind it, and images enter
//! density, pressure force, drag and noise like particles (Yang 2013, 2.2.4 to 2.2.7), in a form
//! that is symmetric and the gradient of a potential for curved walls, too:
//!
//! - distance to the image: r_iJ^2 = r_ij^2 + 4 phi_i phi_j, with phi the distance to the wall;
//! - weight of the image: w_ij = psi_i psi_j, psi = 1 + K h p(phi/h) (curvature.rs);
//! - where walls meet at right angles, images of images: 4 phi_i phi_j and psi_i psi_j of each wall;
//! - at walls of any other shape psi is solved for in space, so that one image of each particle
//!   completes the density at edges, in corners and in gaps as well (field/).
//!
//! As r_iJ >= r_ij, links to images are among the pairs of the neighbour list: they are found when
//! the list is built, and a step visits nothing but particles near walls.
//!
//! Other models of walls, to compare with, are chosen for all walls at once (model.rs).

mod bins;
mod bounce;
mod completion;
mod curvature;
mod field;
mod geometry;
mod images;
mod links;
mod model;
mod solid;

pub use completion::Missing;
pub use curvature::CurvatureWeight;
pub use field::{Facet, Field, Local, Report};
pub use geometry::{Foot, Shape, Surface, WallSettings};
pub use images::{Image, images};
pub use links::{BlockLinks, Link, Near, OwnImages, Site, View};
pub use model::{FROZEN_LABELS, ModelSettings, ModelState, WallModel};
pub use solid::Solid;

use std::sync::Arc;

use crate::domain::PeriodicBox;
use crate::error::{Error, Result};
use crate::units::Units;

/// Force and torque, or their integrals over time: on one wall.
pub type Wrench = [f64; 6];

/// Particles near walls per task; sums over walls are formed task by task.
pub(crate) const TASK: usize = 128;

/// The walls of a scene and what is near them; empty where there are none.
#[derive(Debug, Clone, Default)]
pub struct Walls {
    /// The walls.
    pub surfaces: Vec<Surface>,
    /// Kinds of images.
    pub images: Vec<Image>,
    /// Particles near a wall, by slot.
    pub near: Vec<Near>,
    /// Where each of them stands to each wall it is near to.
    pub sites: Vec<Site>,
    /// First site of each slot, and the number of sites at the end.
    pub first_site: Vec<u32>,
    /// Links to images by base block.
    pub links: Vec<BlockLinks>,
    /// Own images by task of near particles.
    pub tasks: Vec<OwnImages>,
    /// Force and torque of the fluid on each wall that go with the particles' `force`.
    pub force: Vec<Wrench>,
    /// The same of `drag`.
    pub drag: Vec<Wrench>,
    /// Momentum and angular momentum each wall has received since the simulation was made.
    pub impulse: Vec<Wrench>,
    /// Reflections of particles that had crossed a wall, since the simulation was made.
    pub crossings: u64,
    /// The model they follow.
    pub model: WallModel,
    /// What other models than that of symmetric images keep.
    pub state: ModelState,
    weight: Option<CurvatureWeight>,
    curvature: Vec<f64>,
}

impl Walls {
    /// Parses and checks the walls of a scene; "field" walls name one of the `fields`.
    pub fn new(
        settings: &[WallSettings],
        fields: &[Arc<Field>],
        kernel: &str,
        dimension: usize,
        cell: &PeriodicBox,
        units: &Units,
    ) -> Result<Self> {
        let mut surfaces = Vec::with_capacity(settings.len());
        for (index, wall) in settings.iter().enumerate() {
            let surface = Surface::parse(wall, index, dimension, units, fields)?;
            surface.check_motion(index, cell, units)?;
            surfaces.push(surface);
        }
        Self::of(surfaces, kernel, dimension, cell)
    }

    /// Gives a wall the motion of another of the same form.
    pub fn set_motion(
        &mut self,
        index: usize,
        wall: &WallSettings,
        dimension: usize,
        cell: &PeriodicBox,
        units: &Units,
    ) -> Result<()> {
        let old = self.surfaces.get(index);
        let field = match old.map(|surface| &surface.shape) {
            Some(Shape::Field { field, .. }) => vec![Arc::clone(field)],
            _ => Vec::new(),
        };
        let new = Surface::parse(wall, index, dimension, units, &field)?;
        new.check_motion(index, cell, units)?;
        if !old.is_some_and(|old| old.shape == new.shape && old.slip == new.slip) {
            return Err(Error::Invalid(format!(
                "`walls[{index}]` must be a wall of the scene and keep its form"
            )));
        }
        self.surfaces[index] = new;
        Ok(())
    }

    /// From surfaces in reduced units.
    pub fn of(
        surfaces: Vec<Surface>,
        kernel: &str,
        dimension: usize,
        cell: &PeriodicBox,
    ) -> Result<Self> {
        let images = images(&surfaces, cell)?;
        let curvature: Vec<f64> = surfaces.iter().map(Surface::curvature).collect();
        let curved = curvature.iter().any(|&k| k != 0.0);
        let n = surfaces.len();
        Ok(Self {
            surfaces,
            images,
            force: vec![[0.0; 6]; n],
            drag: vec![[0.0; 6]; n],
            impulse: vec![[0.0; 6]; n],
            weight: if curved {
                CurvatureWeight::named(kernel, dimension)
            } else {
                None
            },
            curvature,
            ..Self::default()
        })
    }

    /// Is there any wall?
    #[inline]
    pub fn any(&self) -> bool {
        !self.surfaces.is_empty()
    }

    /// How far beyond the walls a particle may be by rounding [h].
    pub fn rounding(&self) -> f64 {
        self.surfaces
            .iter()
            .map(Surface::rounding)
            .fold(1e-9, f64::max)
    }

    /// Smallest distance to a wall, and which: negative outside of the fluid.
    pub fn nearest(&self, position: [f64; 3], cell: &PeriodicBox) -> (f64, usize) {
        let mut best = (f64::INFINITY, 0);
        for (index, surface) in self.surfaces.iter().enumerate() {
            let distance = surface.distance(position, cell);
            // Not a number must not pass for far away.
            if distance < best.0 || distance.is_nan() {
                best = (distance, index);
            }
        }
        best
    }

    /// Adds t times the force to the impulse: the particles' velocities changed by so much.
    pub fn kick(&mut self, t: f64) {
        for (impulse, force) in self.impulse.iter_mut().zip(&self.force) {
            for a in 0..6 {
                impulse[a] += t * force[a];
            }
        }
    }

    /// The force gets the drag; if `again`, velocities have followed for the time t.
    pub fn add_drag(&mut self, t: f64, again: bool) {
        for ((impulse, force), drag) in self.impulse.iter_mut().zip(&mut self.force).zip(&self.drag)
        {
            for a in 0..6 {
                force[a] += drag[a];
                if again {
                    impulse[a] += t * drag[a];
                }
            }
        }
    }

    /// Sum of the principal curvatures of a wall.
    pub(crate) fn curvature_of(&self, wall: u32) -> f64 {
        self.curvature[wall as usize]
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        let links: usize = self.links.iter().map(BlockLinks::bytes).sum();
        let own: usize = self.tasks.iter().map(|task| task.views.capacity()).sum();
        let fields: usize = self.surfaces.iter().map(Surface::bytes).sum();
        links
            + fields
            + size_of::<View>() * own
            + size_of::<Near>() * self.near.capacity()
            + size_of::<Site>() * self.sites.capacity()
            + 4 * self.first_site.capacity()
            + self.state.bytes()
    }

    /// Number of links to images of other particles, or partners in other models.
    pub fn link_count(&self) -> usize {
        let symmetric: usize = self.links.iter().map(|block| block.links.len()).sum();
        symmetric + self.state.partners.len()
    }

    /// Refuses positions [h] outside of the fluid: the first of them, by row.
    pub fn check_inside(&self, positions: &[[f64; 3]], cell: &PeriodicBox) -> Result<()> {
        for (row, &position) in positions.iter().enumerate() {
            let (distance, wall) = self.nearest(position, cell);
            if distance.is_nan() || distance < -self.rounding() {
                return Err(Error::Invalid(format!(
                    "`positions` must lie in the fluid, got row {row} at {:.4} supports behind wall {wall}",
                    -distance
                )));
            }
        }
        Ok(())
    }
}
