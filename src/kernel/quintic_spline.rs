//! The quintic B-spline (Morris, Fox and Zhu 1997; Bian et al. 2015, eq. A1) with s = 3q:
//! f = (3-s)^5 - 6 (2-s)^5 + 15 (1-s)^5, each bracket cut off at 0.

use super::{Kernel, complement};
use crate::real::Real;

/// The quintic spline.
#[derive(Debug, Clone, Copy)]
pub struct QuinticSpline;

#[inline(always)]
fn fourth<R: Real>(x: R) -> R {
    (x * x) * (x * x)
}

/// 3 - s and 2 - s, cut off at 0.
#[inline(always)]
fn outer<R: Real>(q: R) -> [R; 2] {
    [
        R::of(3.0) * complement(q),
        R::of(2.0) * complement(R::of(1.5) * q),
    ]
}

impl Kernel for QuinticSpline {
    const NAME: &'static str = "quintic_spline";
    const NORM: [f64; 2] = [
        63.0 / (478.0 * std::f64::consts::PI),
        9.0 / (40.0 * std::f64::consts::PI),
    ];

    #[inline(always)]
    fn shape<R: Real>(q: R) -> R {
        let [a, b] = outer(q);
        let c = complement(R::of(3.0) * q);
        fourth(a) * a - R::of(6.0) * (fourth(b) * b) + R::of(15.0) * (fourth(c) * c)
    }

    #[inline(always)]
    fn slope<R: Real>(q: R) -> R {
        let s = R::of(3.0) * q;
        let [a, b] = outer(q);
        let outer = (fourth(a) - R::of(6.0) * fourth(b)) / s;
        // For s < 1 the bracket is s (24 - 24 s^2 + 10 s^3): no cancellation, no division by 0.
        let inner = R::of(24.0) + s * s * (R::of(10.0) * s - R::of(24.0));
        R::of(45.0) * if s < R::of(1.0) { inner } else { outer }
    }
}
