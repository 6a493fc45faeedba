//! The curvature weight psi = 1 + K h p(phi/h) of an image: with it the density that a round wall's
//! images complete is uniform to first order in the curvature K (sum of principal curvatures).
//!
//! p is universal for a kernel and a dimension. With w1(z) = int W(sqrt(z^2 + q^2)) over the plane
//! (the line, in 2D) at distance z and M(s) = int_0 w1(s + s') ds', in units of the support,
//!     p(s) M(s) + int_0 w1(s + s') p(s') ds' = int_0 s' w1(s + s') ds'.
//! Solved by collocation at Chebyshev points; p and p' are then those of one and the same
//! polynomial, so that forces are exact derivatives.

use nalgebra::{DMatrix, DVector};

use crate::kernel::{Kernel, Lucy, QuinticSpline, WendlandC2, WendlandC4};

const TERMS: usize = 24;
const NODES: usize = 40;

/// p(s) on [0, 1] as a Chebyshev series; constant beyond.
#[derive(Debug, Clone, Copy)]
pub struct CurvatureWeight {
    coefficients: [f64; TERMS],
}

/// Nodes and weights of Gauss and Legendre on [0, 1], by Newton's method.
fn gauss_legendre() -> Vec<(f64, f64)> {
    let n = NODES as f64;
    (0..NODES)
        .map(|k| {
            let mut x = (std::f64::consts::PI * (k as f64 + 0.75) / (n + 0.5)).cos();
            let mut slope = 1.0;
            for _ in 0..60 {
                let (mut now, mut before) = (1.0, 0.0);
                for j in 0..NODES {
                    let j = j as f64;
                    (now, before) = (((2.0 * j + 1.0) * x * now - j * before) / (j + 1.0), now);
                }
                slope = n * (x * now - before) / (x * x - 1.0);
                x -= now / slope;
            }
            (0.5 * (1.0 - x), 1.0 / ((1.0 - x * x) * slope * slope))
        })
        .collect()
}

/// w1(z): the kernel integrated over a plane at distance z.
fn over_plane<K: Kernel, const D: usize>(z: f64, rule: &[(f64, f64)]) -> f64 {
    if z >= 1.0 {
        return 0.0;
    }
    if D == 3 {
        let length = 1.0 - z;
        let part = |&(x, weight): &(f64, f64)| {
            let r = z + length * x;
            weight * K::w::<_, 3>(r) * r
        };
        std::f64::consts::TAU * length * rule.iter().map(part).sum::<f64>()
    } else {
        let length = (1.0 - z * z).sqrt();
        let part = |&(x, weight): &(f64, f64)| {
            let q = length * x;
            weight * K::w::<_, 2>((z * z + q * q).sqrt())
        };
        2.0 * length * rule.iter().map(part).sum::<f64>()
    }
}

/// Chebyshev polynomials T_0.. and their derivatives at x in [-1, 1].
fn chebyshev(x: f64) -> ([f64; TERMS], [f64; TERMS]) {
    let (mut t, mut slope) = ([1.0; TERMS], [0.0; TERMS]);
    t[1] = x;
    slope[1] = 1.0;
    for k in 2..TERMS {
        t[k] = 2.0 * x * t[k - 1] - t[k - 2];
        slope[k] = 2.0 * t[k - 1] + 2.0 * x * slope[k - 1] - slope[k - 2];
    }
    (t, slope)
}

impl CurvatureWeight {
    /// Solves the integral equation for a kernel.
    pub fn solve<K: Kernel, const D: usize>() -> Self {
        let rule = gauss_legendre();
        let mut matrix = DMatrix::zeros(TERMS, TERMS);
        let mut right = DVector::zeros(TERMS);
        for row in 0..TERMS {
            // Inner points only: at s = 1 all integrals vanish.
            let x = (std::f64::consts::PI * (row as f64 + 0.5) / TERMS as f64).cos();
            let s = 0.5 * (1.0 + x);
            let (mut mass, mut first) = (0.0, 0.0);
            let mut mean = [0.0; TERMS];
            for &(node, weight) in &rule {
                let other = (1.0 - s) * node;
                let share = weight * over_plane::<K, D>(s + other, &rule);
                mass += share;
                first += share * other;
                let (t, _) = chebyshev(2.0 * other - 1.0);
                for k in 0..TERMS {
                    mean[k] += share * t[k];
                }
            }
            let (t, _) = chebyshev(x);
            for k in 0..TERMS {
                matrix[(row, k)] = t[k] + mean[k] / mass;
            }
            right[row] = first / mass;
        }
        let solution = matrix.lu().solve(&right);
        let mut coefficients = [0.0; TERMS];
        if let Some(solution) = solution {
            coefficients.copy_from_slice(solution.as_slice());
        }
        Self { coefficients }
    }

    /// Of the kernel of a name; `None` if there is no such kernel.
    pub fn named(kernel: &str, dimension: usize) -> Option<Self> {
        fn of<K: Kernel>(dimension: usize) -> CurvatureWeight {
            match dimension {
                2 => CurvatureWeight::solve::<K, 2>(),
                _ => CurvatureWeight::solve::<K, 3>(),
            }
        }
        Some(match kernel {
            Lucy::NAME => of::<Lucy>(dimension),
            QuinticSpline::NAME => of::<QuinticSpline>(dimension),
            WendlandC2::NAME => of::<WendlandC2>(dimension),
            WendlandC4::NAME => of::<WendlandC4>(dimension),
            _ => return None,
        })
    }

    /// p and its derivative at s = phi/h.
    pub fn at(&self, s: f64) -> (f64, f64) {
        let inside = s.clamp(0.0, 1.0);
        let (t, slope) = chebyshev(2.0 * inside - 1.0);
        let (mut p, mut derivative) = (0.0, 0.0);
        for k in 0..TERMS {
            p += self.coefficients[k] * t[k];
            derivative += self.coefficients[k] * slope[k];
        }
        (p, if inside == s { 2.0 * derivative } else { 0.0 })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn polynomial(coefficients: &[f64], x: f64) -> f64 {
        coefficients.iter().rev().fold(0.0, |sum, c| sum * x + c)
    }

    /// Two published fits, with errors of 1.1e-3 and 1.3e-3.
    #[test]
    fn two_known_fits() {
        let lucy = [
            0.167_096, -0.525_967, 0.396_435, -0.339_768, 0.177_088, -0.039_540, -0.002_606,
        ];
        let wendland = [
            0.145_077, -0.499_915, 0.486_357, -0.510_275, 0.341_345, -0.121_430, 0.013_513,
        ];
        let worst = |weight: CurvatureWeight, fit: &[f64]| {
            (0..=100)
                .map(|k| {
                    let s = 0.01 * f64::from(k);
                    (weight.at(s).0 - polynomial(fit, s)).abs()
                })
                .fold(0.0, f64::max)
        };
        let errors = [
            worst(CurvatureWeight::solve::<Lucy, 3>(), &lucy),
            worst(CurvatureWeight::solve::<WendlandC2, 3>(), &wendland),
        ];
        assert!(errors[0] < 1.3e-3 && errors[1] < 1.5e-3, "{errors:?}");
    }

    /// The equation itself, by another quadrature, at points between the nodes.
    fn residual<K: Kernel, const D: usize>() -> f64 {
        let weight = CurvatureWeight::solve::<K, D>();
        let rule = gauss_legendre();
        let mut worst: f64 = 0.0;
        for k in 0..20 {
            let s = 0.02 + 0.045 * f64::from(k);
            let n = 2000;
            let (mut mass, mut sum) = (0.0, 0.0);
            for j in 0..n {
                let other = (1.0 - s) * (f64::from(j) + 0.5) / f64::from(n);
                let w1 = over_plane::<K, D>(s + other, &rule);
                mass += w1;
                sum += w1 * (other - weight.at(other).0);
            }
            worst = worst.max((weight.at(s).0 - sum / mass).abs());
        }
        worst
    }

    #[test]
    fn the_equation_is_solved_for_every_kernel() {
        let worst = [
            residual::<Lucy, 2>(),
            residual::<Lucy, 3>(),
            residual::<QuinticSpline, 2>(),
            residual::<QuinticSpline, 3>(),
            residual::<WendlandC2, 2>(),
            residual::<WendlandC2, 3>(),
            residual::<WendlandC4, 2>(),
            residual::<WendlandC4, 3>(),
        ];
        assert!(worst.iter().all(|&w| w < 2e-5), "{worst:?}");
    }

    #[test]
    fn the_slope_is_that_of_the_function() {
        let weight = CurvatureWeight::named("wendland_c2", 3).unwrap();
        assert!(CurvatureWeight::named("gauss", 3).is_none());
        for k in 1..100 {
            let s = 0.01 * f64::from(k);
            let step = 1e-6;
            let slope = (weight.at(s + step).0 - weight.at(s - step).0) / (2.0 * step);
            assert!((slope - weight.at(s).1).abs() < 1e-7);
        }
        assert_eq!(weight.at(1.2).0, weight.at(1.0).0);
    }
}
