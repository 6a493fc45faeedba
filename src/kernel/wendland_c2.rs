//! Wendland's C2 function (Wendland 1995; Dehnen and Aly 2012), f = (1 - q)^4 (1 + 4q): positive
//! Fourier transform, so it does not pair particles at any sound speed.

use super::{Kernel, complement};
use crate::real::Real;

/// Wendland C2.
#[derive(Debug, Clone, Copy)]
pub struct WendlandC2;

impl Kernel for WendlandC2 {
    const NAME: &'static str = "wendland_c2";
    const NORM: [f64; 2] = [
        7.0 / std::f64::consts::PI,
        21.0 / (2.0 * std::f64::consts::PI),
    ];

    #[inline(always)]
    fn shape<R: Real>(q: R) -> R {
        let x = complement(q);
        let square = x * x;
        (R::of(1.0) + R::of(4.0) * q) * (square * square)
    }

    #[inline(always)]
    fn slope<R: Real>(q: R) -> R {
        let x = complement(q);
        R::of(20.0) * (x * x * x)
    }
}
