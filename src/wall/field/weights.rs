//! The weight psi of images at a wall of any shape: that with which images complete the density.
//!
//! In a uniform fluid of density 1 a particle at x lacks M(x) = int_solid W(|x - y|) dy, and images
//! give it psi(x) int_fluid psi(y) W(sqrt(|x - y|^2 + 4 phi(x) phi(y))) dy. That both are equal
//! everywhere is an equation for psi: the symmetric scaling of a positive kernel to given sums
//! (Sinkhorn and Knopp, Pac. J. Math. 21 (1967) 343), solved by psi <- sqrt(psi M/(K psi)), which
//! halves what is left of the error, or better, in each iteration. Corners of any angle, edges that
//! stick out, curvature and narrow gaps are all in it. For a plane psi = 1.

use super::quadrature::{Bins, Sample};
use crate::kernel::Kernel;

/// Where next to nothing is missing, a support from the wall, psi tends to 1: the equation is
/// psi (K psi + FLOOR) = M + FLOOR.
const FLOOR: f64 = 1e-3;
const MOST_ITERATIONS: usize = 60;
const TOLERANCE: f64 = 1e-4;

/// A solution at the points of the fluid.
pub(super) struct Weights<'a> {
    solid: &'a Bins,
    fluid: &'a Bins,
    solid_volume: Vec<f64>,
    weighted: Vec<f64>,
    /// Iterations made.
    pub iterations: usize,
    /// Largest relative change in the last of them.
    pub residual: f64,
}

type Target = ([f64; 3], f64);

impl<'a> Weights<'a> {
    /// Solves the equation at the points of the fluid within a support of the wall.
    pub fn solve<K: Kernel, const D: usize>(
        points: &[Sample],
        fluid: &'a Bins,
        solid: &'a Bins,
    ) -> Self {
        let targets: Vec<Target> = points.iter().map(|p| (p.position, p.phi)).collect();
        let direct: Vec<Target> = points.iter().map(|p| (p.position, 0.0)).collect();
        let solid_volume = solid.volumes();
        let missing = solid.sums::<K, D>(&direct, &solid_volume);
        let mut psi = vec![1.0; points.len()];
        let (mut iterations, mut residual) = (0, f64::INFINITY);
        while iterations < MOST_ITERATIONS && residual > TOLERANCE {
            let image = fluid.sums::<K, D>(&targets, &fluid.weighted(&psi));
            residual = 0.0;
            for k in 0..psi.len() {
                let ratio = (missing[k] + FLOOR) / (psi[k] * (image[k] + FLOOR));
                residual = f64::max(residual, (ratio - 1.0).abs());
                psi[k] *= ratio.sqrt();
            }
            iterations += 1;
        }
        Self {
            solid,
            fluid,
            solid_volume,
            weighted: fluid.weighted(&psi),
            iterations,
            residual,
        }
    }

    /// psi anywhere near the wall, behind it as well: the equation itself, solved for psi(x).
    pub fn at<K: Kernel, const D: usize>(&self, targets: &[Target]) -> Vec<f64> {
        let direct: Vec<Target> = targets.iter().map(|&(x, _)| (x, 0.0)).collect();
        let missing = self.solid.sums::<K, D>(&direct, &self.solid_volume);
        let image = self.fluid.sums::<K, D>(targets, &self.weighted);
        let both = missing.iter().zip(&image);
        both.map(|(m, k)| (m + FLOOR) / (k + FLOOR)).collect()
    }
}
