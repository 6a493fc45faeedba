//! Lucy's kernel (Lucy 1977), f = (1 + 3q)(1 - q)^3: the fewest operations and the smallest
//! discretisation error per neighbour, but its Fourier transform has negative lobes: see `docs`.

use super::{Kernel, complement};
use crate::real::Real;

/// Lucy's quartic.
#[derive(Debug, Clone, Copy)]
pub struct Lucy;

impl Kernel for Lucy {
    const NAME: &'static str = "lucy";
    const NORM: [f64; 2] = [
        5.0 / std::f64::consts::PI,
        105.0 / (16.0 * std::f64::consts::PI),
    ];

    #[inline(always)]
    fn shape<R: Real>(q: R) -> R {
        let x = complement(q);
        (R::of(1.0) + R::of(3.0) * q) * (x * x * x)
    }

    #[inline(always)]
    fn slope<R: Real>(q: R) -> R {
        let x = complement(q);
        R::of(12.0) * (x * x)
    }

    #[inline(always)]
    fn root_slope<R: Real>(q: R) -> R {
        const SQRT_12: f64 = 3.464_101_615_137_754_6;
        R::of(SQRT_12) * complement(q)
    }
}
