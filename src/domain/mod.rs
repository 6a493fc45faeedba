//! The periodic box, in units of the support h, and the one answer to "how far is j from i".

use crate::error::{Error, Result};
use crate::real::ROUNDER;

/// Room beyond the walls of an axis that is not periodic, in supports: more than a support and any
/// margin, so that no two particles are neighbours across it.
const BEYOND: f64 = 1.7;

/// A box, periodic along some axes or all. In two dimensions the third edge is 1 and nothing ever
/// moves along it.
#[derive(Debug, Clone, Copy)]
pub struct PeriodicBox {
    /// Edges in units of h; along an axis that is not periodic, with room beyond the walls.
    pub edges: [f64; 3],
    /// 1/edges.
    pub inverse: [f64; 3],
    /// Is the axis periodic? The third axis of two dimensions is not.
    pub periodic: [bool; 3],
    /// Where the fluid ends along axes that are not periodic; infinite along the others.
    pub limits: [f64; 3],
}

impl PeriodicBox {
    /// A box of the given edges [h]; an edge shorter than two supports has no unique minimum image.
    pub fn new(edges: &[f64], support: f64) -> Result<Self> {
        Self::with_walls(edges, support, &[true; 3])
    }

    /// The same with walls on the axes that are not `periodic`.
    pub fn with_walls(edges: &[f64], support: f64, periodic: &[bool]) -> Result<Self> {
        let mut scaled = [1.0; 3];
        let mut limits = [f64::INFINITY; 3];
        let mut turns = [false; 3];
        for (axis, &edge) in edges.iter().enumerate() {
            turns[axis] = periodic[axis];
            if !periodic[axis] {
                limits[axis] = edge / support;
                scaled[axis] = limits[axis] + BEYOND;
                continue;
            }
            // A few ulp of room, so that "exactly two supports" survives the division.
            if edge / support < 2.0 * (1.0 - 1e-12) {
                return Err(Error::Invalid(format!(
                    "`box` must be at least two supports long on every periodic axis, {} here; got {edge} on axis {axis}",
                    2.0 * support
                )));
            }
            scaled[axis] = edge / support;
        }
        Ok(Self {
            edges: scaled,
            inverse: scaled.map(|edge| 1.0 / edge),
            periodic: turns,
            limits,
        })
    }

    /// Separation along one axis: to the nearest image where the axis is periodic.
    #[inline]
    pub fn separation(&self, axis: usize, r: f64) -> f64 {
        if self.periodic[axis] {
            let turns = r * self.inverse[axis];
            r - self.edges[axis] * ((turns + ROUNDER) - ROUNDER)
        } else {
            r
        }
    }

    /// Separation to the nearest image; only the first D components are touched.
    #[inline(always)]
    pub fn nearest<const D: usize>(&self, mut r: [f64; 3]) -> [f64; 3] {
        for a in 0..D {
            let turns = r[a] * self.inverse[a];
            r[a] -= self.edges[a] * ((turns + ROUNDER) - ROUNDER);
        }
        r
    }

    /// The position inside [0, edge) and the number of edges taken off, for one axis.
    #[inline]
    pub fn wrap(&self, axis: usize, x: f64) -> (f64, i32) {
        // What is inside already, as nearly all are, needs no quotient.
        if !self.periodic[axis] || (0.0 < x && x < self.edges[axis]) {
            return (x, 0);
        }
        let turns = (x * self.inverse[axis]).floor();
        let mut inside = x - turns * self.edges[axis];
        let mut image = turns as i32;
        // Rounding can leave x at either border.
        if inside < 0.0 {
            inside += self.edges[axis];
            image -= 1;
        }
        if inside >= self.edges[axis] {
            inside -= self.edges[axis];
            image += 1;
        }
        (inside.max(0.0), image)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wrapping_keeps_the_unwrapped_position() {
        let cell = PeriodicBox::new(&[3.0, 5.5], 1.0).unwrap();
        for k in -4000..4000 {
            let x = 0.013 * k as f64;
            for axis in 0..2 {
                let (inside, image) = cell.wrap(axis, x);
                assert!((0.0..cell.edges[axis]).contains(&inside));
                assert!((inside + f64::from(image) * cell.edges[axis] - x).abs() < 1e-13);
            }
        }
        assert_eq!(cell.wrap(0, -1e-18).0, 0.0);
        assert_eq!(cell.nearest::<2>([2.9, -5.0, 7.0]), [2.9 - 3.0, 0.5, 7.0]);
    }

    #[test]
    fn an_axis_with_walls_has_no_image() {
        let cell = PeriodicBox::with_walls(&[3.0, 0.8], 1.0, &[true, false]).unwrap();
        assert_eq!(cell.wrap(1, -1e-3), (-1e-3, 0));
        assert_eq!(cell.separation(0, 2.9), 2.9 - 3.0);
        assert_eq!(cell.separation(1, 0.8), 0.8);
        // Nothing across the walls is nearer than the support and the largest margin.
        for k in 0..=80 {
            let r = cell.nearest::<2>([0.0, 0.01 * f64::from(k), 0.0])[1].abs();
            assert!((r - 0.01 * f64::from(k)).abs() < 1e-15 || r >= 1.6);
        }
    }

    #[test]
    fn short_boxes_are_refused() {
        let text = PeriodicBox::new(&[3.0, 1.9], 1.0).unwrap_err().to_string();
        assert!(
            text.contains("two supports") && text.contains("axis 1"),
            "{text}"
        );
        assert!(PeriodicBox::new(&[2.0e-9, 2.0e-9], 1e-9).is_ok());
    }
}
