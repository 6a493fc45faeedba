//! Walls of any shape: signed distance phi and weight psi of images on a grid around the surface, as
//! cubic B-splines. What particles feel is the spline: it *is* the wall, so that forces are exact
//! gradients however fine the grid.
//!
//! Kept are bricks of 8 cells along each axis that the surface, or the layers of a support on both
//! sides of it, pass through. Further away the distance is interpolated between centres of bricks.

mod lattice;
mod quadrature;
mod spline;
mod weights;

use rayon::prelude::*;

use crate::domain::PeriodicBox;
use crate::error::{Error, Result};
use crate::kernel::{Kernel, Lucy, QuinticSpline, WendlandC2, WendlandC4};
use lattice::{HALO, Lattice, Node};
use quadrature::{Bins, Sample};
use weights::Weights;

/// Signed distances [h] of positions [h] to the surface, > 0 in the fluid.
pub type Distances<'a> = dyn FnMut(&[[f64; 3]]) -> Result<Vec<f64>> + 'a;

/// Distances that are kept exactly: in the solid as far as a kernel reaches, in the fluid as far as
/// a list of neighbours with any skin.
const DEEPEST: f64 = 1.05;
const HIGHEST: f64 = 1.4;
/// Cells per support where nothing else is asked for.
const FINENESS: [f64; 2] = [16.0, 6.0];
/// Two faces closer than a support are those of a blade if their normals are as opposite as that.
const OPPOSITE: f64 = -0.7;

/// phi and psi of one wall.
#[derive(Debug)]
pub struct Field {
    lattice: Lattice,
    /// Coefficients of each brick, by its number plus one; 0: none.
    table: Vec<u32>,
    far: Vec<f64>,
    coefficients: Vec<[f64; 2]>,
    /// What was made of the surface.
    pub report: Report,
}

/// A point of the surface.
#[derive(Debug, Clone, Copy)]
pub struct Facet {
    /// Where [h].
    pub position: [f64; 3],
    /// Unit normal into the fluid.
    pub normal: [f64; 3],
}

/// What was made of a surface.
#[derive(Debug, Clone, Default)]
pub struct Report {
    /// Points of the surface, one in each cell that it cuts.
    pub surface: Vec<Facet>,
    /// Thinnest blade of the solid [h] and where, if thinner than a support.
    pub thinnest: Option<(f64, [f64; 3])>,
    /// Smallest and largest weight in the fluid.
    pub weights: [f64; 2],
    /// Iterations for the weight, and the largest relative change in the last.
    pub iterations: usize,
    /// See `iterations`.
    pub residual: f64,
    /// Edges of a cell [h].
    pub spacing: [f64; 3],
}

/// phi, psi and their gradients at a position.
#[derive(Debug, Clone, Copy, Default)]
pub struct Local {
    /// phi [h].
    pub distance: f64,
    /// Gradient of phi; of length 1 to the accuracy of the grid.
    pub gradient: [f64; 3],
    /// psi.
    pub weight: f64,
    /// Gradient of psi [1/h].
    pub climb: [f64; 3],
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Whether it is the same one: they are shared.
impl PartialEq for Field {
    fn eq(&self, other: &Self) -> bool {
        std::ptr::eq(self, other)
    }
}

impl Field {
    /// Of a surface in a box, for a kernel; `spacing` of the grid [h]. `distances` is called on the
    /// thread of the caller, all the rest is work of the `pool`.
    pub fn new(
        cell: &PeriodicBox,
        dimension: usize,
        kernel: &str,
        spacing: Option<f64>,
        distances: &mut Distances<'_>,
        pool: &rayon::ThreadPool,
    ) -> Result<Self> {
        let spacing = spacing.unwrap_or(1.0 / FINENESS[dimension - 2]);
        let lattice = Lattice::new(cell, dimension, spacing);
        let (mut field, nodes) = Self::distances_of(lattice, distances, pool)?;
        pool.install(|| {
            match kernel {
                Lucy::NAME => field.weigh_in::<Lucy>(&nodes),
                QuinticSpline::NAME => field.weigh_in::<QuinticSpline>(&nodes),
                WendlandC2::NAME => field.weigh_in::<WendlandC2>(&nodes),
                WendlandC4::NAME => field.weigh_in::<WendlandC4>(&nodes),
                _ => {
                    return Err(Error::Invalid(format!(
                        "`kernel` must be a kernel, got {kernel:?}"
                    )));
                }
            }
            Ok(())
        })?;
        Ok(field)
    }

    /// phi of all bricks near the surface, psi = 1.
    fn distances_of(
        lattice: Lattice,
        distances: &mut Distances<'_>,
        pool: &rayon::ThreadPool,
    ) -> Result<(Self, Vec<Node>)> {
        let count = lattice.brick_count();
        let centres: Vec<[f64; 3]> = (0..count).map(|b| lattice.centre(b)).collect();
        let far = distances(&centres)?;
        let reach = lattice.half_diagonal();
        let active: Vec<usize> = (0..count)
            .filter(|&b| (-DEEPEST - reach..=HIGHEST + reach).contains(&far[b]))
            .collect();
        if active.is_empty() {
            return Err(Error::Invalid(
                "the surface must pass through the box, got none of it there".into(),
            ));
        }
        let nodes = pool.install(|| {
            let halos = active.par_iter().flat_map_iter(|&b| lattice.halo(b));
            let mut nodes: Vec<Node> = halos.collect();
            nodes.par_sort_unstable();
            nodes.dedup();
            nodes
        });
        let places: Vec<[f64; 3]> = nodes.iter().map(|&n| lattice.node_position(n)).collect();
        let values = distances(&places)?;
        if let Some(k) = values.iter().position(|x| !x.is_finite()) {
            return Err(Error::Invalid(format!(
                "distances must be finite, got {} at {:?} supports",
                values[k], places[k]
            )));
        }
        let mut table = vec![0; count];
        for (number, &brick) in active.iter().enumerate() {
            table[brick] = number as u32 + 1;
        }
        let spacing = lattice.step;
        let mut field = Self {
            lattice,
            table,
            far,
            coefficients: Vec::new(),
            report: Report {
                spacing,
                ..Report::default()
            },
        };
        field.coefficients = pool
            .install(|| field.fitted(&nodes, &values))
            .into_iter()
            .map(|c| [c, 1.0])
            .collect();
        Ok((field, nodes))
    }

    fn active(&self) -> Vec<usize> {
        (0..self.table.len())
            .filter(|&b| self.table[b] > 0)
            .collect()
    }

    /// Coefficients of all kept bricks, one after the other, from values at nodes.
    fn fitted(&self, nodes: &[Node], values: &[f64]) -> Vec<f64> {
        let lattice = &self.lattice;
        self.active()
            .par_iter()
            .flat_map_iter(|&brick| {
                let mut halo = Vec::with_capacity(lattice.block(HALO));
                for node in lattice.halo(brick) {
                    // Sorted, and made of these very halos.
                    let index = nodes.binary_search(&node).unwrap_or_default();
                    halo.push(values[index]);
                }
                spline::coefficients(lattice, &halo)
            })
            .collect()
    }

    fn brick(&self, brick: usize) -> Option<&[[f64; 2]]> {
        let number = self.table[brick] as usize;
        let size = self.lattice.block(lattice::SPAN);
        (number > 0).then(|| &self.coefficients[(number - 1) * size..number * size])
    }

    /// phi, psi and their gradients.
    pub fn at(&self, position: [f64; 3]) -> Local {
        let place = self.lattice.place(position);
        match self.brick(place.brick) {
            Some(brick) => {
                let ([distance, weight], [gradient, climb]) =
                    spline::evaluate(&self.lattice, brick, place.cell, place.fraction);
                Local {
                    distance,
                    gradient,
                    weight,
                    climb,
                }
            }
            None => {
                let (distance, gradient) = self.lattice.between_centres(&self.far, position);
                Local {
                    distance,
                    gradient,
                    weight: 1.0,
                    climb: [0.0; 3],
                }
            }
        }
    }

    /// phi alone.
    pub fn distance(&self, position: [f64; 3]) -> f64 {
        self.at(position).distance
    }

    /// How much further inside the spline may be at edges and vertices [h].
    pub fn rounding(&self) -> f64 {
        0.5 * self.lattice.largest_step()
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        size_of::<[f64; 2]>() * self.coefficients.len()
            + size_of::<Facet>() * self.report.surface.len()
            + (4 + 8) * self.table.len()
    }

    fn weigh_in<K: Kernel>(&mut self, nodes: &[Node]) {
        match self.lattice.dimension {
            2 => self.weigh::<K, 2>(nodes),
            _ => self.weigh::<K, 3>(nodes),
        }
    }

    /// Solves for psi and puts it beside phi.
    fn weigh<K: Kernel, const D: usize>(&mut self, nodes: &[Node]) {
        let (fluid, solid) = self.samples();
        let near: Vec<Sample> = fluid.into_iter().filter(|p| p.phi < 1.0).collect();
        let (fluid_bins, solid_bins) = (
            Bins::new(&self.lattice, &near),
            Bins::new(&self.lattice, &solid),
        );
        let weights = Weights::solve::<K, D>(&near, &fluid_bins, &solid_bins);
        (self.report.iterations, self.report.residual) = (weights.iterations, weights.residual);
        let values = self.nodal_weights::<K, D>(nodes, &weights);
        let fitted = self.fitted(nodes, &values);
        for (pair, psi) in self.coefficients.iter_mut().zip(fitted) {
            pair[1] = psi;
        }
        let range = near.par_iter().map(|p| {
            let psi = self.at(p.position).weight;
            [psi, psi]
        });
        self.report.weights = range.reduce(
            || [f64::INFINITY, f64::NEG_INFINITY],
            |a, b| [a[0].min(b[0]), a[1].max(b[1])],
        );
        self.report.thinnest = self.thinnest();
    }

    /// Points of fluid and solid in all kept bricks, and with them the points of the surface.
    fn samples(&mut self) -> (Vec<Sample>, Vec<Sample>) {
        let active = self.active();
        let parts: Vec<[Option<Sample>; 2]> = active
            .par_iter()
            .flat_map_iter(|&brick| {
                let coefficients = self.brick(brick).unwrap_or_default();
                quadrature::cells(&self.lattice, brick, |cell, fraction| {
                    spline::evaluate(&self.lattice, coefficients, cell, fraction).0[0]
                })
            })
            .collect();
        let step = self.lattice.step;
        let surface = parts.par_iter().filter_map(|[fluid, solid]| {
            let fluid = fluid.as_ref()?;
            let Some(solid) = solid.as_ref() else {
                // A surface that coincides with faces of cells cuts none of them.
                let facet = (fluid.phi < self.lattice.largest_step())
                    .then(|| self.facet(fluid.position))??;
                let inside = (0..self.lattice.dimension).all(|a| {
                    (facet.position[a] - fluid.position[a]).abs() <= (0.5 + 1e-6) * step[a]
                });
                return inside.then_some(facet);
            };
            let [f, s] = [fluid, solid].map(|p| p.volume / (fluid.volume + solid.volume));
            self.facet([0, 1, 2].map(|a| f * fluid.position[a] + s * solid.position[a]))
        });
        self.report.surface = surface.collect();
        let pick = |side: usize| parts.iter().filter_map(move |p| p[side]).collect();
        (pick(0), pick(1))
    }

    /// The point of the surface next to a position; none where phi has no slope.
    fn facet(&self, mut position: [f64; 3]) -> Option<Facet> {
        let mut normal = [0.0; 3];
        for _ in 0..3 {
            let local = self.at(position);
            let square = dot(local.gradient, local.gradient);
            if square < 0.04 {
                return None;
            }
            normal = local.gradient.map(|x| x / square.sqrt());
            for a in 0..3 {
                position[a] -= local.distance * local.gradient[a] / square;
            }
        }
        Some(Facet { position, normal })
    }

    /// psi at the nodes: from the equation as far as two cells behind the surface, further back as
    /// the mean of the neighbours that have one.
    fn nodal_weights<K: Kernel, const D: usize>(
        &self,
        nodes: &[Node],
        weights: &Weights<'_>,
    ) -> Vec<f64> {
        let step = self.lattice.largest_step();
        let places: Vec<([f64; 3], f64)> = nodes
            .par_iter()
            .map(|&node| {
                let position = self.lattice.node_position(node);
                (position, self.distance(position))
            })
            .collect();
        let known = |phi: f64| (-2.0 * step..=1.0 + 2.0 * step).contains(&phi);
        let targets: Vec<_> = places.iter().copied().filter(|p| known(p.1)).collect();
        let mut solved = weights.at::<K, D>(&targets).into_iter();
        let mut values: Vec<Option<f64>> = places
            .iter()
            .map(|&(_, phi)| match known(phi) {
                true => solved.next(),
                false => (phi > 0.0).then_some(1.0),
            })
            .collect();
        for _ in 0..3 {
            values = nodes
                .par_iter()
                .zip(&values)
                .map(|(node, value)| {
                    value.or_else(|| self.mean_of_neighbours(*node, nodes, &values))
                })
                .collect();
        }
        values
            .into_iter()
            .map(|value| value.unwrap_or(1.0))
            .collect()
    }

    fn mean_of_neighbours(
        &self,
        node: Node,
        nodes: &[Node],
        values: &[Option<f64>],
    ) -> Option<f64> {
        let (mut sum, mut count) = (0.0, 0.0);
        for a in 0..self.lattice.dimension {
            for side in [-1, 1] {
                let mut next = node;
                next[a] += side;
                let found = nodes.binary_search(&self.lattice.wrapped(next)).ok();
                if let Some(value) = found.and_then(|k| values[k]) {
                    sum += value;
                    count += 1.0;
                }
            }
        }
        (count > 0.0).then(|| sum / count)
    }

    /// The thinnest place of the solid, from one face to an opposite one, if below a support.
    fn thinnest(&self) -> Option<(f64, [f64; 3])> {
        let step = 0.5 * self.lattice.largest_step();
        let thickness = |facet: &Facet| {
            let mut depth = 2.0 * step;
            while depth < 1.0 {
                let at = [0, 1, 2].map(|a| facet.position[a] - depth * facet.normal[a]);
                let local = self.at(at);
                if local.distance > 0.0 {
                    let length = dot(local.gradient, local.gradient).sqrt().max(1e-12);
                    let cosine = dot(local.gradient, facet.normal) / length;
                    return (cosine < OPPOSITE).then_some((depth, facet.position));
                }
                // phi is a distance: nothing is nearer.
                depth += local.distance.abs().max(step);
            }
            None
        };
        let thin = self.report.surface.iter().filter_map(thickness);
        thin.min_by(|a, b| a.0.total_cmp(&b.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pool() -> rayon::ThreadPool {
        rayon::ThreadPoolBuilder::new()
            .num_threads(2)
            .build()
            .unwrap()
    }

    fn made(periodic: &[bool], phi: impl Fn([f64; 3]) -> f64) -> Field {
        let cell = PeriodicBox::with_walls(&vec![4.0; periodic.len()], 1.0, periodic).unwrap();
        let mut distances =
            |points: &[[f64; 3]]| Ok(points.iter().map(|&p| phi(p)).collect::<Vec<f64>>());
        Field::new(&cell, periodic.len(), "lucy", None, &mut distances, &pool()).unwrap()
    }

    #[test]
    fn cubics_are_their_own_splines() {
        let cubic =
            |[x, y, z]: [f64; 3]| 0.1 * (x - 2.0).powi(3) + 0.5 * (y - 1.7) * z - 0.2 * z * z;
        let field = made(&[false; 3], cubic);
        for k in 0..40 {
            let x = [0.4 + 0.08 * f64::from(k), 1.9, 2.6 - 0.03 * f64::from(k)];
            let local = field.at(x);
            assert!((local.distance - cubic(x)).abs() < 1e-12);
            let slope = 0.3 * (x[0] - 2.0) * (x[0] - 2.0);
            assert!((local.gradient[0] - slope).abs() < 1e-11);
        }
    }

    #[test]
    fn gradients_are_those_of_the_values_across_cells_bricks_and_periodic_faces() {
        let field = made(&[true, false], |[x, y, _]| {
            y - 1.3 - 0.2 * (std::f64::consts::FRAC_PI_2 * x).sin()
        });
        for k in 0..200 {
            let at = [0.0201 * f64::from(k), 1.1 + 0.0047 * f64::from(k), 0.0];
            let local = field.at(at);
            for a in 0..2 {
                let shifted = |s: f64| {
                    let mut p = at;
                    p[a] += s;
                    field.at(p)
                };
                let (up, down) = (shifted(1e-5), shifted(-1e-5));
                let phi = (up.distance - down.distance) / 2e-5;
                let psi = (up.weight - down.weight) / 2e-5;
                assert!((phi - local.gradient[a]).abs() < 1e-8);
                assert!(
                    (psi - local.climb[a]).abs() < 1e-7,
                    "{psi} {}",
                    local.climb[a]
                );
            }
        }
    }

    #[test]
    fn a_plane_needs_no_weight() {
        for tilt in [0.0, 0.6] {
            let level = (1.0_f64 - tilt * tilt).sqrt();
            let field = made(&[false; 2], |[x, y, _]| {
                tilt * (x - 2.0) + level * (y - 1.9)
            });
            for k in 0..100 {
                let s = 0.006 * f64::from(k);
                let along = 0.01 * f64::from(k) - 0.5;
                let at = [
                    2.0 + tilt * s + level * along,
                    1.9 + level * s - tilt * along,
                    0.0,
                ];
                let local = field.at(at);
                assert!((local.distance - s).abs() < 1e-12);
                assert!((local.weight - 1.0).abs() < 3e-3, "{s}: {}", local.weight);
            }
        }
    }

    #[test]
    fn blades_are_found_and_missing_surfaces_refused() {
        let blade = made(&[true; 2], |[x, _, _]| (x - 2.0).abs() - 0.2);
        let (thickness, place) = blade.report.thinnest.unwrap();
        assert!((thickness - 0.4).abs() < 0.1 && (place[0] - 2.0).abs() < 0.25);
        let cell = PeriodicBox::new(&[4.0, 4.0], 1.0).unwrap();
        let mut far = |points: &[[f64; 3]]| Ok(vec![9.0; points.len()]);
        let text = Field::new(&cell, 2, "lucy", None, &mut far, &pool())
            .unwrap_err()
            .to_string();
        assert!(text.contains("pass through the box"), "{text}");
    }
}
