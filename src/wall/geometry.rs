//! Walls: signed distance, normal into the fluid, curvature, and how the surface moves.
//! Lengths in supports, velocities in units of the scene's speed.

use std::sync::Arc;

use super::field::{Facet, Field, Local};
use crate::domain::PeriodicBox;
use crate::error::{Error, Result};
use crate::units::Units;
use crate::valid::{finite, positive};

/// A wall as the user gives it: its name ("plane", "cylinder", "sphere", "field") and its numbers, in
/// the user's units. Plane: point, normal, velocity (3 each). Cylinder: centre (3), axis (0, 1, 2),
/// radius, +1 for fluid outside and -1 inside, velocity (3), spin (3). Sphere: the same without
/// axis. Field: centre, velocity, spin, and the index of its field. Last of all 1 for a wall on which
/// the fluid slips, else 0.
pub type WallSettings = (String, Vec<f64>);

/// Largest part of a field wall's velocity across its surface: grid and facets are not exact.
const ALONG: f64 = 0.05;

/// The form of a wall.
#[derive(Debug, Clone, PartialEq)]
pub enum Shape {
    /// A plane through a point, with the unit normal into the fluid.
    Plane {
        /// A point of it.
        point: [f64; 3],
        /// Unit normal.
        normal: [f64; 3],
    },
    /// A cylinder along an axis of the box (a circle in two dimensions), or a sphere.
    Round {
        /// A point of the axis, or the centre.
        centre: [f64; 3],
        /// Axis of a cylinder.
        axis: Option<usize>,
        /// Radius.
        radius: f64,
        /// +1 with the fluid outside, -1 with the fluid inside.
        side: f64,
    },
    /// Any form.
    Field {
        /// Its distances and weights.
        field: Arc<Field>,
        /// What it turns about, and torques are taken about.
        centre: [f64; 3],
    },
}

/// A wall: its form and its motion, which never changes its place.
#[derive(Debug, Clone)]
pub struct Surface {
    /// Form.
    pub shape: Shape,
    /// Velocity of translation along itself.
    pub velocity: [f64; 3],
    /// Angular velocity about the centre.
    pub spin: [f64; 3],
    /// Does the fluid slip, without any friction?
    pub slip: bool,
}

/// Where a particle stands to a wall.
#[derive(Debug, Clone, Copy, Default)]
pub struct Foot {
    /// Signed distance, > 0 in the fluid.
    pub distance: f64,
    /// Its gradient: the normal into the fluid; of a field wall of length 1 to its accuracy only.
    pub normal: [f64; 3],
    /// Velocity of the wall at the foot of the perpendicular.
    pub velocity: [f64; 3],
    /// From the centre of the wall to the particle; 0 for a plane.
    pub arm: [f64; 3],
}

pub(crate) fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

pub(crate) fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

impl Foot {
    /// The same with a normal of length 1 and the distance along it, which a spline has to first order
    /// only.
    pub fn straightened(self) -> Self {
        let length = dot(self.normal, self.normal).sqrt().max(1e-3);
        Self {
            distance: self.distance / length,
            normal: self.normal.map(|x| x / length),
            ..self
        }
    }
}

impl Surface {
    /// Checks and scales what the user gave.
    pub fn parse(
        wall: &WallSettings,
        index: usize,
        d: usize,
        units: &Units,
        fields: &[Arc<Field>],
    ) -> Result<Self> {
        let (kind, numbers) = wall;
        let name = format!("walls[{index}]");
        let count = match kind.as_str() {
            "plane" => 10,
            "cylinder" => 13,
            "sphere" => 12,
            "field" => 11,
            other => {
                return Err(Error::Invalid(format!(
                    "`{name}` must be a \"plane\", a \"cylinder\", a \"sphere\" or a \"field\", got {other:?}"
                )));
            }
        };
        if numbers.len() != count {
            return Err(Error::Invalid(format!(
                "`{name}` must have {count} numbers, got {}",
                numbers.len()
            )));
        }
        for &number in numbers {
            finite(&name, number)?;
        }
        let triple = |first: usize, unit: f64| -> [f64; 3] {
            std::array::from_fn(|a| {
                if a < d {
                    numbers[first + a] / unit
                } else {
                    0.0
                }
            })
        };
        let slip = numbers[count - 1] != 0.0;
        let surface = if kind == "field" {
            let Some(field) = fields.get(numbers[9] as usize) else {
                return Err(Error::Invalid(format!(
                    "`{name}` must name one of {} fields, got {}",
                    fields.len(),
                    numbers[9]
                )));
            };
            Self {
                shape: Shape::Field {
                    field: Arc::clone(field),
                    centre: triple(0, units.length),
                },
                velocity: triple(3, units.velocity),
                spin: std::array::from_fn(|a| numbers[6 + a] * units.time()),
                slip,
            }
        } else if kind == "plane" {
            let normal = triple(3, 1.0);
            let length = positive(&name, dot(normal, normal).sqrt())?;
            Self {
                shape: Shape::Plane {
                    point: triple(0, units.length),
                    normal: normal.map(|x| x / length),
                },
                velocity: triple(6, units.velocity),
                spin: [0.0; 3],
                slip,
            }
        } else {
            let cylinder = kind == "cylinder";
            let (axis, rest) = if cylinder {
                (Some(numbers[3] as usize), 4)
            } else {
                (None, 3)
            };
            let spin = std::array::from_fn(|a| numbers[rest + 5 + a] * units.time());
            Self {
                shape: Shape::Round {
                    centre: triple(0, units.length),
                    axis,
                    radius: positive(&name, numbers[rest] / units.length)?,
                    side: if numbers[rest + 1] > 0.0 { 1.0 } else { -1.0 },
                },
                velocity: triple(rest + 2, units.velocity),
                spin,
                slip,
            }
        };
        surface.check(&name, d)?;
        Ok(surface)
    }

    /// A wall may slide and turn, but not leave its place.
    fn check(&self, name: &str, d: usize) -> Result<()> {
        let complain = |what: &str| Err(Error::Invalid(format!("`{name}` must {what}")));
        let speed = dot(self.velocity, self.velocity).sqrt();
        match self.shape {
            Shape::Plane { normal, .. } => {
                if dot(self.velocity, normal).abs() > 1e-9 * speed {
                    return complain("move along itself: its velocity has a part along its normal");
                }
            }
            Shape::Round { axis, radius, .. } => {
                if d == 2 && axis != Some(2) {
                    return complain("be a circle in two dimensions: a cylinder along z");
                }
                if axis.is_some_and(|axis| axis > 2) {
                    return complain("have an axis among 0, 1, 2");
                }
                let across = (0..3).any(|a| Some(a) != axis && self.velocity[a] != 0.0);
                if across {
                    return complain("stay in its place: a round wall slides along its axis only");
                }
                if let Some(axis) = axis
                    && (0..3).any(|a| a != axis && self.spin[a] != 0.0)
                {
                    return complain("turn about its own axis");
                }
                if radius < 1.0 {
                    return complain(&format!(
                        "have a radius of at least one support, got {radius:.4} supports"
                    ));
                }
            }
            Shape::Field { .. } => {
                if d == 2 && (self.spin[0] != 0.0 || self.spin[1] != 0.0) {
                    return complain("turn about z in two dimensions");
                }
            }
        }
        Ok(())
    }

    /// Bytes held by a field.
    pub fn bytes(&self) -> usize {
        match &self.shape {
            Shape::Field { field, .. } => field.bytes(),
            _ => 0,
        }
    }

    /// How far behind the wall a start may lie [h]: the spline of a field wall rounds off edges and
    /// vertices, and a particle next to one comes back in the first step.
    pub fn rounding(&self) -> f64 {
        match &self.shape {
            Shape::Field { field, .. } => field.rounding(),
            _ => 1e-9,
        }
    }

    /// Sum of the principal curvatures, > 0 where the fluid is inside.
    pub fn curvature(&self) -> f64 {
        match self.shape {
            Shape::Plane { .. } | Shape::Field { .. } => 0.0,
            Shape::Round {
                axis, radius, side, ..
            } => -side * if axis.is_some() { 1.0 } else { 2.0 } / radius,
        }
    }

    /// From the centre to the nearest image of a position; without its part along an axis.
    fn radial(&self, position: [f64; 3], cell: &PeriodicBox) -> [f64; 3] {
        let Shape::Round { centre, axis, .. } = self.shape else {
            return [0.0; 3];
        };
        std::array::from_fn(|a| {
            if Some(a) == axis {
                0.0
            } else {
                cell.separation(a, position[a] - centre[a])
            }
        })
    }

    /// Distance alone.
    pub fn distance(&self, position: [f64; 3], cell: &PeriodicBox) -> f64 {
        match self.shape {
            Shape::Plane { point, normal } => {
                let from = [0, 1, 2].map(|a| position[a] - point[a]);
                dot(from, normal)
            }
            Shape::Round { radius, side, .. } => {
                let radial = self.radial(position, cell);
                side * (dot(radial, radial).sqrt() - radius)
            }
            Shape::Field { ref field, .. } => field.distance(position),
        }
    }

    /// Refuses a field wall whose motion would carry it out of its place.
    pub fn check_motion(&self, index: usize, cell: &PeriodicBox, units: &Units) -> Result<()> {
        let Shape::Field { ref field, centre } = self.shape else {
            return Ok(());
        };
        if self.velocity == [0.0; 3] && self.spin == [0.0; 3] {
            return Ok(());
        }
        let velocity = |facet: &Facet| {
            let arm = [0, 1, 2].map(|a| cell.separation(a, facet.position[a] - centre[a]));
            let turning = cross(self.spin, arm);
            [0, 1, 2].map(|a| self.velocity[a] + turning[a])
        };
        let facets = field.report.surface.iter();
        let speed = facets.clone().map(|f| dot(velocity(f), velocity(f)).sqrt());
        let limit = ALONG * speed.fold(0.0, f64::max);
        let across = |facet: &Facet| dot(velocity(facet), facet.normal);
        match facets.max_by(|f, g| across(f).abs().total_cmp(&across(g).abs())) {
            Some(worst) if across(worst).abs() > limit => Err(Error::Invalid(format!(
                "`walls[{index}]` must stay in its place: each part of it may move along the surface only, got {:.4} across it at {:?}",
                across(worst) * units.velocity,
                worst.position.map(|x| x * units.length)
            ))),
            _ => Ok(()),
        }
    }

    /// Foot of a field wall, where it is known what phi is there.
    pub(super) fn field_foot(
        &self,
        centre: [f64; 3],
        local: &Local,
        position: [f64; 3],
        cell: &PeriodicBox,
    ) -> Foot {
        let arm = [0, 1, 2].map(|a| cell.separation(a, position[a] - centre[a]));
        let slope = dot(local.gradient, local.gradient).max(1e-12);
        let foot = [0, 1, 2].map(|a| arm[a] - local.distance * local.gradient[a] / slope);
        let turning = cross(self.spin, foot);
        Foot {
            distance: local.distance,
            normal: local.gradient,
            velocity: [0, 1, 2].map(|a| self.velocity[a] + turning[a]),
            arm,
        }
    }

    /// Distance, normal, velocity and arm.
    pub fn foot(&self, position: [f64; 3], cell: &PeriodicBox) -> Foot {
        match self.shape {
            Shape::Plane { normal, .. } => Foot {
                distance: self.distance(position, cell),
                normal,
                velocity: self.velocity,
                arm: [0.0; 3],
            },
            Shape::Round { radius, side, .. } => {
                let arm = self.radial(position, cell);
                let length = dot(arm, arm).sqrt();
                // The centre of a pipe has no normal, and needs none: no wall is near.
                let outward = arm.map(|x| x / length.max(1e-30));
                let turning = cross(self.spin, outward.map(|x| radius * x));
                Foot {
                    distance: side * (length - radius),
                    normal: outward.map(|x| side * x),
                    velocity: [0, 1, 2].map(|a| self.velocity[a] + turning[a]),
                    arm,
                }
            }
            Shape::Field { ref field, centre } => {
                self.field_foot(centre, &field.at(position), position, cell)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn units() -> Units {
        Units {
            length: 2.0,
            mass: 1.0,
            velocity: 4.0,
            dimension: 3,
        }
    }

    fn parse(kind: &str, numbers: &[f64]) -> Result<Surface> {
        Surface::parse(&(kind.into(), numbers.to_vec()), 0, 3, &units(), &[])
    }

    fn close(a: [f64; 3], b: [f64; 3]) {
        for k in 0..3 {
            assert!((a[k] - b[k]).abs() < 1e-12, "{a:?} {b:?}");
        }
    }

    #[test]
    fn distances_normals_and_velocities_of_the_three_forms() {
        let cell = PeriodicBox::new(&[20.0, 20.0, 20.0], 2.0).unwrap();
        let plane = parse("plane", &[0., 0., 4., 0., 3., 4., 8., 4., -3., 0.]).unwrap();
        let foot = plane.foot([1.0, 1.0, 3.0], &cell);
        assert!((foot.distance - 1.4).abs() < 1e-12 && plane.curvature() == 0.0);
        close(foot.normal, [0.0, 0.6, 0.8]);
        close(foot.velocity, [2.0, 1.0, -0.75]);
        // A pipe along y, radius 3, sliding and turning.
        let pipe = [10., 0., 10., 1., 6., -1., 0., 8., 0., 0., 2., 0., 0.];
        let pipe = parse("cylinder", &pipe).unwrap();
        let foot = pipe.foot([5.0, 2.0, 7.0], &cell);
        assert!((foot.distance - 1.0).abs() < 1e-12);
        close(foot.normal, [0.0, 0.0, -1.0]);
        // w x r = (0, 1, 0) x (0, 0, 3)
        close(foot.velocity, [3.0, 2.0, 0.0]);
        assert!((pipe.curvature() - 1.0 / 3.0).abs() < 1e-15);
        let ball = [2., 2., 2., 3.0, 1., 0., 0., 0., 0., 0., 1., 0.];
        let ball = parse("sphere", &ball).unwrap();
        assert!((ball.curvature() + 2.0 / 1.5).abs() < 1e-15);
        // Through the periodic face, and by differences: n = grad phi.
        let at = [9.0, 9.5, 2.5];
        let foot = ball.foot(at, &cell);
        for a in 0..3 {
            let step = 1e-6;
            let shifted = |s: f64| {
                let mut p = at;
                p[a] += s;
                ball.distance(p, &cell)
            };
            let slope = (shifted(step) - shifted(-step)) / (2.0 * step);
            assert!((slope - foot.normal[a]).abs() < 1e-8);
        }
    }

    #[test]
    fn walls_that_leave_their_place_are_refused() {
        let text = |kind: &str, numbers: &[f64]| parse(kind, numbers).unwrap_err().to_string();
        assert!(text("plane", &[0., 0., 0., 0., 0., 1., 0., 0., 1., 0.]).contains("along itself"));
        let mut ball = [2., 2., 2., 4.0, 1., 1., 0., 0., 0., 0., 1., 0.];
        assert!(text("sphere", &ball).contains("stay in its place"));
        (ball[3], ball[5]) = (1.0, 0.0);
        assert!(text("sphere", &ball).contains("at least one support"));
        assert!(text("cone", &[]).contains("\"cone\""));
        assert!(text("plane", &[1.0]).contains("10 numbers"));
    }
}
