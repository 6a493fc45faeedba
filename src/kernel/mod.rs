//! Smoothing kernels W(r) = N_D / h^D f(r/h) with support h, and F(r) = -W'(r)/r >= 0.
//! All lengths here are in units of h, so one file holds nothing but a univariate function.

mod lucy;
mod quintic_spline;
mod wendland_c2;
mod wendland_c4;

use crate::real::Real;

pub use lucy::Lucy;
pub use quintic_spline::QuinticSpline;
pub use wendland_c2::WendlandC2;
pub use wendland_c4::WendlandC4;

/// A smoothing kernel of unit support. Arguments are q = r/h in [0, inf); both functions are 0 for
/// q >= 1 without a branch, so that padding and skin pairs vanish by themselves.
pub trait Kernel: Copy + Send + Sync + 'static {
    /// Name in the registry.
    const NAME: &'static str;
    /// Normalisation N_D for D = 2 and 3.
    const NORM: [f64; 2];
    /// f(q), so that W = N_D h^-D f(q).
    fn shape<R: Real>(q: R) -> R;
    /// -f'(q)/q, so that F = N_D h^-(D+2) times this.
    fn slope<R: Real>(q: R) -> R;
    /// Square root of `slope`, for the noise.
    #[inline(always)]
    fn root_slope<R: Real>(q: R) -> R {
        Self::slope(q).root()
    }
    /// W h^D.
    #[inline(always)]
    fn w<R: Real, const D: usize>(q: R) -> R {
        R::of(Self::NORM[D - 2]) * Self::shape(q)
    }
    /// F h^(D+2).
    #[inline(always)]
    fn f<R: Real, const D: usize>(q: R) -> R {
        R::of(Self::NORM[D - 2]) * Self::slope(q)
    }
    /// Square root of F h^(D+2).
    #[inline(always)]
    fn root_f<R: Real, const D: usize>(q: R) -> R {
        R::of(Self::NORM[D - 2].sqrt()) * Self::root_slope(q)
    }
}

/// max(1 - q, 0).
#[inline(always)]
pub(crate) fn complement<R: Real>(q: R) -> R {
    let x = R::of(1.0) - q;
    if x > R::ZERO { x } else { R::ZERO }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    fn integrate(function: impl Fn(f64) -> f64) -> f64 {
        let n = 6000;
        (0..n)
            .map(|k| {
                let (a, b) = (k as f64 / n as f64, (k + 1) as f64 / n as f64);
                let middle = 0.5 * (a + b);
                let offset = 0.5 * (b - a) / 3.0_f64.sqrt();
                0.5 * (b - a) * (function(middle - offset) + function(middle + offset))
            })
            .sum()
    }

    fn check<K: Kernel>(friction_integral: [f64; 2]) {
        let close = |a: f64, b: f64, tolerance: f64| assert!((a - b).abs() < tolerance, "{a} {b}");
        close(integrate(|q| 2.0 * PI * q * K::w::<_, 2>(q)), 1.0, 1e-12);
        close(
            integrate(|q| 4.0 * PI * q * q * K::w::<_, 3>(q)),
            1.0,
            1e-12,
        );
        // int F r^2 dV = D for every kernel.
        close(
            integrate(|q| 2.0 * PI * q.powi(3) * K::f::<_, 2>(q)),
            2.0,
            1e-11,
        );
        close(
            integrate(|q| 4.0 * PI * q.powi(4) * K::f::<_, 3>(q)),
            3.0,
            1e-11,
        );
        close(
            integrate(|q| 2.0 * PI * q * K::f::<_, 2>(q)),
            friction_integral[0],
            1e-9,
        );
        close(
            integrate(|q| 4.0 * PI * q * q * K::f::<_, 3>(q)),
            friction_integral[1],
            1e-9,
        );
        for k in 1..400 {
            let q = k as f64 * 0.0025;
            let step = 1e-5;
            let slope = -(K::shape(q + step) - K::shape(q - step)) / (2.0 * step) / q;
            close(slope, K::slope(q), 2e-6 * (1.0 + K::slope(0.0)));
        }
        assert!(K::slope(0.0_f64).is_finite() && K::slope(0.0) > 0.0);
        assert_eq!((K::shape(1.0), K::slope(1.0)), (0.0, 0.0));
        assert_eq!((K::shape(1.7), K::slope(1.7)), (0.0, 0.0));
        for k in 0..120 {
            let q = 0.01 * f64::from(k);
            let pairs = [
                (K::w::<_, 3>(q), K::w::<_, 3>(q as f32)),
                (K::f::<_, 2>(q), K::f::<_, 2>(q as f32)),
                (K::root_f::<_, 3>(q), K::root_f::<_, 3>(q as f32)),
            ];
            for (wide, narrow) in pairs {
                close(wide, narrow.double(), 2e-5);
            }
        }
        // Pairs in the skin are computed like others.
        for k in 0..200 {
            let q = 1.0 + 1e-3 * f64::from(k);
            let all = [K::shape(q), K::slope(q), K::root_slope(q)];
            assert_eq!(all, [0.0; 3]);
            let q = q as f32;
            let all = [K::shape(q), K::slope(q), K::root_slope(q)];
            assert_eq!(all, [0.0; 3]);
        }
    }

    #[test]
    fn unit_integrals_slopes_and_limits() {
        check::<Lucy>([10.0, 10.5]);
        check::<QuinticSpline>([4158.0 / 239.0, 18.0]);
        check::<WendlandC2>([14.0, 14.0]);
        check::<WendlandC4>([18.0, 55.0 / 3.0]);
    }
}
