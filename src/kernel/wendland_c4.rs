//! Wendland's C4 function (Wendland 1995; Dehnen and Aly 2012), f = (1 - q)^6 (1 + 6q + 35/3 q^2):
//! smoother than C2, positive Fourier transform, wants more neighbours.

use super::{Kernel, complement};
use crate::real::Real;

/// Wendland C4.
#[derive(Debug, Clone, Copy)]
pub struct WendlandC4;

impl Kernel for WendlandC4 {
    const NAME: &'static str = "wendland_c4";
    const NORM: [f64; 2] = [
        9.0 / std::f64::consts::PI,
        495.0 / (32.0 * std::f64::consts::PI),
    ];

    #[inline(always)]
    fn shape<R: Real>(q: R) -> R {
        let x = complement(q);
        let cube = x * x * x;
        (R::of(1.0) + q * (R::of(6.0) + R::of(35.0 / 3.0) * q)) * (cube * cube)
    }

    #[inline(always)]
    fn slope<R: Real>(q: R) -> R {
        let x = complement(q);
        let square = x * x;
        R::of(56.0 / 3.0) * (square * square * x) * (R::of(1.0) + R::of(5.0) * q)
    }
}
