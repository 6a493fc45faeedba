//! What is missing of the kernel's support behind a wall, in closed form, for Lucy's kernel: the
//! completion of Vazquez-Quesada (2009) and of Yang (2013), appendix B, at the distance s = phi/h:
//!     Delta = int_solid W dV,                       d = S / (1 - Delta);
//!     psi   = int_solid F (r - r_i).n dV = -dDelta/ds,
//!     Psi   = int_solid F e e^T (r - r_i).n dV = psi1 I + psi2 n n^T,   D psi1 + psi2 = psi.
//! psi2 in two dimensions has 3/4 where the dissertation has 1/2 before h^4 ln(...).
//! A wall of curvature K (sum of principal curvatures) adds K C to Delta,
//!     C = (pi/2) int_s^1 W (r^2 - s^2) r dr in 3D,   int_s^1 W (r^2 - s^2)^(1/2) r dr in 2D.

use std::f64::consts::PI;

/// The functions of one distance, in supports.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Missing {
    /// Delta.
    pub volume: f64,
    /// -dDelta/ds.
    pub psi: f64,
    /// psi1.
    pub across: f64,
    /// psi2.
    pub along: f64,
    /// C.
    pub curved: f64,
    /// dC/ds.
    pub curved_slope: f64,
}

impl Missing {
    /// At the distance `s` >= 0; all 0 from a support on.
    pub fn at(s: f64, dimension: usize) -> Self {
        // Logarithms of 0 are multiplied by powers of it.
        let s = s.max(1e-30);
        if s >= 1.0 {
            Self::default()
        } else if dimension == 2 {
            Self::plane(s)
        } else {
            Self::space(s)
        }
    }

    fn space(s: f64) -> Self {
        let (s2, s3, s4) = (s * s, s * s * s, s * s * s * s);
        let (s5, s6, s7) = (s4 * s, s4 * s2, s4 * s3);
        let s4_log = s4 * s.ln();
        // Moments int_s^1 r^n f dr of f = 1 - 6 r^2 + 8 r^3 - 3 r^4.
        let moment = |n: f64| {
            let term = |c: f64, k: f64| c * (1.0 - s.powf(n + k + 1.0)) / (n + k + 1.0);
            term(1.0, 0.0) + term(-6.0, 2.0) + term(8.0, 3.0) + term(-3.0, 4.0)
        };
        let norm = 105.0 / (16.0 * PI);
        Self {
            volume: 0.5 - (21.0 * s - 35.0 * s3 + 63.0 * s5 + 15.0 * s7) / 16.0 + 3.5 * s6,
            psi: (21.0 - 105.0 * s2 + 315.0 * s4 + 105.0 * s6) / 16.0 - 21.0 * s5,
            across: 78.75
                * (1.0 / 240.0 - s2 / 24.0 - 3.0 * s4 / 16.0 + 4.0 * s5 / 15.0
                    - s6 / 24.0
                    - 0.25 * s4_log),
            along: 157.5
                * (1.0 / 480.0 + s2 / 48.0 + 13.0 * s4 / 32.0 - 8.0 * s5 / 15.0
                    + 5.0 * s6 / 48.0
                    + 0.375 * s4_log),
            curved: 0.5 * PI * norm * (moment(3.0) - s2 * moment(1.0)),
            curved_slope: -PI * s * norm * moment(1.0),
        }
    }

    fn plane(s: f64) -> Self {
        let (s2, s3, s4) = (s * s, s * s * s, s * s * s * s);
        let s5 = s4 * s;
        let c = (1.0 - s2).sqrt();
        let log = ((1.0 + c) / s).ln();
        let angle = s.acos();
        // J_n = int_s^1 r^n (r^2 - s^2)^(1/2) dr, and their slopes.
        let (c3, c5, c7) = (c * c * c, c.powi(5), c.powi(7));
        let j0 = 0.5 * (c - s2 * log);
        let (j1, j3) = (c3 / 3.0, c5 / 5.0 + s2 * c3 / 3.0);
        let j5 = c7 / 7.0 + 2.0 * s2 * c5 / 5.0 + s4 * c3 / 3.0;
        let j2 = 0.25 * (c3 + s2 * j0);
        let j4 = c3 / 6.0 + 0.5 * s2 * j2;
        let j2_slope = -0.75 * s * c + 0.5 * s * j0 - 0.25 * s3 * log;
        let j4_slope = -0.5 * s * c + s * j2 + 0.5 * s2 * j2_slope;
        let (j1_slope, j3_slope) = (-s * c, -s * c3 / 3.0 - s3 * c);
        let j5_slope = -s * c5 / 5.0 - 2.0 * s3 * c3 / 3.0 - s5 * c;
        let norm = 5.0 / PI;
        Self {
            volume: (6.0 * angle + c * (-18.0 * s + 32.0 * s3 + 16.0 * s5) - 36.0 * s5 * log)
                / (6.0 * PI),
            psi: 120.0 / PI
                * (c / 30.0 - 3.0 * s2 * c / 20.0 - 2.0 * s4 * c / 15.0 + 0.25 * s4 * log),
            across: 120.0 / PI
                * (s3 * angle / 3.0 + c / 90.0 - 29.0 * s2 * c / 180.0 + s4 * c / 15.0
                    - 0.25 * s4 * log),
            along: 120.0 / PI
                * (-2.0 * s3 * angle / 3.0 + c / 90.0 + 31.0 * s2 * c / 180.0
                    - 4.0 * s4 * c / 15.0
                    + 0.75 * s4 * log),
            curved: norm * (j1 - 6.0 * j3 + 8.0 * j4 - 3.0 * j5),
            curved_slope: norm * (j1_slope - 6.0 * j3_slope + 8.0 * j4_slope - 3.0 * j5_slope),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_parts_of_psi_add_up_and_slopes_are_slopes() {
        for dimension in [2, 3] {
            for k in 1..100 {
                let s = 0.01 * f64::from(k);
                let m = Missing::at(s, dimension);
                let sum = dimension as f64 * m.across + m.along;
                assert!((sum - m.psi).abs() < 1e-13, "{dimension} {s}");
                let step = 1e-5;
                let [up, down] = [s + step, s - step].map(|s| Missing::at(s, dimension));
                let slope = |f: fn(&Missing) -> f64| (f(&up) - f(&down)) / (2.0 * step);
                assert!((slope(|m| m.volume) + m.psi).abs() < 1e-8);
                assert!((slope(|m| m.curved) - m.curved_slope).abs() < 1e-8);
            }
            let wall = Missing::at(0.0, dimension);
            assert!((wall.volume - 0.5).abs() < 1e-14);
            assert_eq!(Missing::at(1.0, dimension), Missing::default());
        }
    }
}
