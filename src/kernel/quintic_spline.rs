//! The quintic B-spline (Morris, Fox and Zhu 1997; Bian et al. 2015, eq. A1) with s = 3q:
//! f = (3-s)^5 - 6 (2-s)^5 + 15 (1-s)^5, each bracket cut off at 0.

use super::{Kernel, complement};

/// The quintic spline.
#[derive(Debug, Clone, Copy)]
pub struct QuinticSpline;

#[inline(always)]
fn fourth(x: f64) -> f64 {
    (x * x) * (x * x)
}

impl Kernel for QuinticSpline {
    const NAME: &'static str = "quintic_spline";
    const NORM: [f64; 2] = [
        63.0 / (478.0 * std::f64::consts::PI),
        9.0 / (40.0 * std::f64::consts::PI),
    ];

    #[inline(always)]
    fn shape(q: f64) -> f64 {
        let a = 3.0 * complement(q);
        let b = 2.0 * complement(1.5 * q);
        let c = complement(3.0 * q);
        fourth(a) * a - 6.0 * (fourth(b) * b) + 15.0 * (fourth(c) * c)
    }

    #[inline(always)]
    fn slope(q: f64) -> f64 {
        let s = 3.0 * q;
        let a = 3.0 * complement(q);
        let b = 2.0 * complement(1.5 * q);
        let outer = (fourth(a) - 6.0 * fourth(b)) / s;
        // For s < 1 the bracket is s (24 - 24 s^2 + 10 s^3): no cancellation, no division by 0.
        let inner = 24.0 + s * s * (10.0 * s - 24.0);
        45.0 * if s < 1.0 { inner } else { outer }
    }
}
