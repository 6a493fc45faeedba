//! The functions in single precision. Coefficients: Cephes (Moshier, 1989), `logf`, `sinf`, `cosf`.

use super::{Arithmetic, Real, cos_sin, polynomial};

/// 1.5 * 2^23: adding and subtracting it rounds to the nearest integer.
const ROUNDER: f32 = 12_582_912.0;
/// 2^-31.
const HALF_WORD: f32 = 1.0 / 2_147_483_648.0;
const LN2_HI: f32 = 0.693_359_4;
const LN2_LO: f32 = -2.121_944_4e-4;

/// The upper 31 bits of a word: as an integer with a sign they are converted by one instruction.
#[inline(always)]
fn upper(word: u64) -> f32 {
    (word as u32 >> 1) as i32 as f32
}

impl Real for f32 {
    const ZERO: Self = 0.0;
    const TINY: f64 = 1e-24;
    const NARROW: bool = true;
    #[inline(always)]
    fn of(x: f64) -> Self {
        x as f32
    }
    #[inline(always)]
    fn double(self) -> f64 {
        f64::from(self)
    }
    #[inline(always)]
    fn multiply_add(self, a: Self, b: Self) -> Self {
        self.mul_add(a, b)
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        f32::sqrt(self)
    }
    #[inline(always)]
    fn root(self) -> Self {
        self.sqrt()
    }
    #[inline(always)]
    fn single(self) -> f32 {
        self
    }
    #[inline(always)]
    fn inverse_root_from<A: Arithmetic>(self, near: f32) -> Self {
        near
    }
    #[inline(always)]
    fn ln<A: Arithmetic>(self) -> Self {
        const L: [f32; 9] = [
            3.333_333e-1,
            -2.499_999_4e-1,
            2.000_071_5e-1,
            -1.666_805_8e-1,
            1.424_932_3e-1,
            -1.242_014_1e-1,
            1.167_699_9e-1,
            -1.151_461e-1,
            7.037_683_6e-2,
        ];
        // x = 2^k (1 + f) with sqrt(1/2) <= 1 + f < sqrt(2).
        let bits = self.to_bits().wrapping_add(0x3f80_0000 - 0x3f35_04f3);
        let k = (bits >> 23) as i32 as f32 - 127.0;
        let f = f32::from_bits((bits & 0x007f_ffff) + 0x3f35_04f3) - 1.0;
        let z = f * f;
        let low = A::fused(f * z, polynomial::<A, _, 9>(f, &L), k * LN2_LO);
        A::fused(k, LN2_HI, f + A::fused(-0.5, z, low))
    }
    #[inline(always)]
    fn cos_sin_turn<A: Arithmetic>(self) -> (Self, Self) {
        const S: [f32; 3] = [-1.666_665_5e-1, 8.332_161e-3, -1.951_529_6e-4];
        const C: [f32; 3] = [4.166_664_6e-2, -1.388_731_6e-3, 2.443_315_7e-5];
        let quarters = 4.0 * self;
        let shifted = quarters + ROUNDER;
        let x = (quarters - (shifted - ROUNDER)) * std::f32::consts::FRAC_PI_2;
        let (cosine, sine) = cos_sin::<A, _, 3>(x, &S, &C);
        // Quadrant k = 0..4 (4 wraps to 0) sits in the low bits of `shifted`.
        let k = shifted.to_bits();
        let swap = (k & 1).wrapping_neg();
        let a = (cosine.to_bits() & !swap) | (sine.to_bits() & swap);
        let b = (sine.to_bits() & !swap) | (cosine.to_bits() & swap);
        let sign_cos = (k.wrapping_add(1) & 2) << 30;
        let sign_sin = (k & 2) << 30;
        (f32::from_bits(a ^ sign_cos), f32::from_bits(b ^ sign_sin))
    }
    #[inline(always)]
    fn expm1_negative<A: Arithmetic>(self) -> Self {
        const P: [f32; 6] = [
            0.5,
            1.0 / 6.0,
            1.0 / 24.0,
            1.0 / 120.0,
            1.0 / 720.0,
            1.0 / 5_040.0,
        ];
        // Below exp(-20) the result is -1 to rounding.
        let y = -(if self < 20.0 { self } else { 20.0 });
        let shifted = A::fused(y, std::f32::consts::LOG2_E, ROUNDER);
        let n = shifted - ROUNDER;
        let r = A::fused(-n, LN2_LO, A::fused(-n, LN2_HI, y));
        let p = A::fused(r * r, polynomial::<A, _, 6>(r, &P), r);
        let scale = f32::from_bits((shifted.to_bits() << 23).wrapping_add(0x3f80_0000));
        A::fused(scale, p, scale - 1.0)
    }
    #[inline(always)]
    fn centred(word: u64) -> Self {
        (word as u32 ^ 0x8000_0000) as i32 as f32 + 0.5
    }
    #[inline(always)]
    fn centred_tenth(word: u32) -> Self {
        // As the upper bits behind the leading one of a number from 1024 on; the difference is exact.
        f32::from_bits((word << 13 & 0x007f_e000) | 0x4480_0000) - (1_024.0 + 511.5)
    }
    #[inline(always)]
    fn unit_interval(word: u64) -> Self {
        (upper(word) + 0.5) * HALF_WORD
    }
    #[inline(always)]
    fn fraction(word: u64) -> Self {
        upper(word) * HALF_WORD
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Fused, Plain};
    use super::*;

    fn check<A: Arithmetic>() {
        for k in 0..200_000_u64 {
            let u = (k as f32 + 0.5) / 200_000.0;
            let exact = f64::from(u).ln();
            assert!(
                (Real::ln::<A>(u).double() - exact).abs() < 1.5e-7 * exact.abs().max(0.1),
                "{u}"
            );
            let (c, s) = u.cos_sin_turn::<A>();
            let angle = std::f64::consts::TAU * f64::from(u);
            assert!((c.double() - angle.cos()).abs() < 1.6e-7, "{u}");
            assert!((s.double() - angle.sin()).abs() < 1.6e-7, "{u}");
            let x = 30.0 * u * u * u;
            let exact = (-f64::from(x)).exp_m1();
            let found = x.expm1_negative::<A>().double();
            assert!((found - exact).abs() <= 1.5e-7 * exact.abs(), "{x}");
        }
    }

    #[test]
    fn functions_agree_with_double_precision() {
        check::<Plain>();
        check::<Fused>();
        assert_eq!(Real::ln::<Fused>(1.0_f32), 0.0);
        assert_eq!(0.0_f32.expm1_negative::<Fused>(), 0.0);
        assert_eq!(1e6_f32.expm1_negative::<Fused>(), -1.0);
        assert_eq!(0.0_f32.root(), 0.0);
        assert_eq!(f32::unit_interval(u64::from(u32::MAX)), 1.0);
        assert!(f32::unit_interval(0) > 0.0);
        for word in [0, 1, 77, 1 << 31, u64::from(u32::MAX)] {
            assert!((f32::centred(word).double() - f64::centred(word)).abs() <= 128.0);
            let (narrow, wide) = (f32::fraction(word).double(), f64::fraction(word));
            assert!((narrow - wide).abs() < 1e-7);
        }
    }
}
