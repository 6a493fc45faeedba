//! The functions in double precision. Coefficients: fdlibm (Sun Microsystems, 1993).

use super::{Arithmetic, Real, cos_sin, polynomial};

/// 1.5 * 2^52: adding and subtracting it rounds to the nearest integer.
pub const ROUNDER: f64 = 6_755_399_441_055_744.0;
const TWO_52: f64 = 4_503_599_627_370_496.0;
/// 2^-32.
const WORD: f64 = 1.0 / 4_294_967_296.0;
const LN2_HI: f64 = 6.931_471_803_691_238e-1;
const LN2_LO: f64 = 1.908_214_929_270_587_7e-10;

/// An integer below 2^52 as a float, exactly.
#[inline(always)]
fn from_integer(word: u64) -> f64 {
    f64::from_bits(word | 0x4330_0000_0000_0000) - TWO_52
}

impl Real for f64 {
    const ZERO: Self = 0.0;
    const TINY: f64 = 1e-30;
    const NARROW: bool = false;
    #[inline(always)]
    fn of(x: f64) -> Self {
        x
    }
    #[inline(always)]
    fn double(self) -> f64 {
        self
    }
    #[inline(always)]
    fn multiply_add(self, a: Self, b: Self) -> Self {
        self.mul_add(a, b)
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        f64::sqrt(self)
    }
    #[inline(always)]
    fn single(self) -> f32 {
        self as f32
    }
    #[inline(always)]
    fn inverse_root_from<A: Arithmetic>(self, near: f32) -> Self {
        let y = f64::from(near);
        // One step of third order from single precision, where root and division take a fraction of
        // the time.
        let e = A::fused(-self, y * y, 1.0);
        A::fused(y, e * A::fused(0.375, e, 0.5), y)
    }
    #[inline(always)]
    fn ln<A: Arithmetic>(self) -> Self {
        const L: [f64; 7] = [
            6.666_666_666_666_735e-1,
            3.999_999_999_940_942e-1,
            2.857_142_874_366_239e-1,
            2.222_219_843_214_978_4e-1,
            1.818_357_216_161_805e-1,
            1.531_383_769_920_937_3e-1,
            1.479_819_860_511_658_6e-1,
        ];
        // x = 2^k (1 + f) with sqrt(1/2) <= 1 + f < sqrt(2).
        let bits = self
            .to_bits()
            .wrapping_add(0x3ff0_0000_0000_0000 - 0x3fe6_a09e_667f_3bcd);
        let k = from_integer(bits >> 52) - 1023.0;
        let f = f64::from_bits((bits & 0x000f_ffff_ffff_ffff) + 0x3fe6_a09e_667f_3bcd) - 1.0;
        let s = f / (2.0 + f);
        let z = s * s;
        let w = z * z;
        let even = w * polynomial::<A, _, 3>(w, &[L[1], L[3], L[5]]);
        let odd = polynomial::<A, _, 4>(w, &[L[0], L[2], L[4], L[6]]);
        let half_square = 0.5 * f * f;
        let sum = half_square + A::fused(z, odd, even);
        let low = A::fused(s, sum, k * LN2_LO);
        A::fused(k, LN2_HI, -((half_square - low) - f))
    }
    #[inline(always)]
    fn cos_sin_turn<A: Arithmetic>(self) -> (Self, Self) {
        const S: [f64; 6] = [
            -1.666_666_666_666_663_2e-1,
            8.333_333_333_322_49e-3,
            -1.984_126_982_985_795e-4,
            2.755_731_370_707_006_8e-6,
            -2.505_076_025_340_686_3e-8,
            1.589_690_995_211_55e-10,
        ];
        const C: [f64; 6] = [
            4.166_666_666_666_66e-2,
            -1.388_888_888_887_411e-3,
            2.480_158_728_947_673e-5,
            -2.755_731_435_139_066_3e-7,
            2.087_572_321_298_175e-9,
            -1.135_964_755_778_819_5e-11,
        ];
        let quarters = 4.0 * self;
        let shifted = quarters + ROUNDER;
        let x = (quarters - (shifted - ROUNDER)) * std::f64::consts::FRAC_PI_2;
        let (cosine, sine) = cos_sin::<A, _, 6>(x, &S, &C);
        // Quadrant k = 0..4 (4 wraps to 0) sits in the low bits of `shifted`.
        let k = shifted.to_bits();
        let swap = (k & 1).wrapping_neg();
        let a = (cosine.to_bits() & !swap) | (sine.to_bits() & swap);
        let b = (sine.to_bits() & !swap) | (cosine.to_bits() & swap);
        let sign_cos = (k.wrapping_add(1) & 2) << 62;
        let sign_sin = (k & 2) << 62;
        (f64::from_bits(a ^ sign_cos), f64::from_bits(b ^ sign_sin))
    }
    #[inline(always)]
    fn expm1_negative<A: Arithmetic>(self) -> Self {
        const LOG2_E: f64 = std::f64::consts::LOG2_E;
        const P: [f64; 12] = [
            0.5,
            1.0 / 6.0,
            1.0 / 24.0,
            1.0 / 120.0,
            1.0 / 720.0,
            1.0 / 5_040.0,
            1.0 / 40_320.0,
            1.0 / 362_880.0,
            1.0 / 3_628_800.0,
            1.0 / 39_916_800.0,
            1.0 / 479_001_600.0,
            1.0 / 6_227_020_800.0,
        ];
        // Below exp(-40) the result is -1 to rounding.
        let y = -(if self < 40.0 { self } else { 40.0 });
        let shifted = A::fused(y, LOG2_E, ROUNDER);
        let n = shifted - ROUNDER;
        let r = A::fused(-n, LN2_LO, A::fused(-n, LN2_HI, y));
        let p = A::fused(r * r, polynomial::<A, _, 12>(r, &P), r);
        let scale = f64::from_bits((shifted.to_bits() << 52).wrapping_add(0x3ff0_0000_0000_0000));
        A::fused(scale, p, scale - 1.0)
    }
    #[inline(always)]
    fn centred(word: u64) -> Self {
        // The difference is exact.
        (from_integer(word) - 2_147_483_648.0) + 0.5
    }
    #[inline(always)]
    fn centred_tenth(word: u32) -> Self {
        f64::from((word & 1023) as i32) - 511.5
    }
    #[inline(always)]
    fn unit_interval(word: u64) -> Self {
        (from_integer(word) + 0.5) * WORD
    }
    #[inline(always)]
    fn fraction(word: u64) -> Self {
        from_integer(word) * WORD
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Fused, Plain, cos_sin_turn, expm1_negative, ln};
    use super::*;

    #[test]
    fn roots_logarithm_sine_cosine_and_expm1_agree_with_the_platform() {
        for k in 0..200_000_u64 {
            let u = (k as f64 + 0.5) / 200_000.0;
            for found in [ln(u), Real::ln::<Fused>(u)] {
                assert!((found - u.ln()).abs() <= 3e-16 * (1.0 + u.ln().abs()));
            }
            let angle = std::f64::consts::TAU * u;
            for (c, s) in [cos_sin_turn(u), u.cos_sin_turn::<Fused>()] {
                assert!((c - angle.cos()).abs() < 2e-15 && (s - angle.sin()).abs() < 2e-15);
            }
            let x = 50.0 * u * u * u;
            let exact = (-x).exp_m1();
            for found in [expm1_negative(x), x.expm1_negative::<Fused>()] {
                assert!((found - exact).abs() <= 4e-16 * exact.abs().max(1e-300));
            }
        }
        for x in [1e-300_f64, 0.7, 1.5, 3.0, 1e5, 1e300] {
            assert!((ln(x) - x.ln()).abs() <= 3e-16 * x.ln().abs());
        }
        for k in -600..=600 {
            let x = 10.0_f64.powf(0.05 * f64::from(k));
            let y = x.inverse_root::<Plain>();
            assert!((y * y * x - 1.0).abs() < 8e-16, "{x}");
            assert!((x.root() / x.sqrt() - 1.0).abs() < 5e-16, "{x}");
        }
        assert_eq!(0.0_f64.root(), 0.0);
        let tiny = (0.5_f64) * 2.0_f64.powi(-32);
        assert!((ln(tiny) - tiny.ln()).abs() < 1e-14);
        assert_eq!(ln(1.0), 0.0);
        assert_eq!(expm1_negative(0.0), 0.0);
        assert!((expm1_negative(1e-12) + 1e-12).abs() < 1e-24);
        assert!((expm1_negative(1e6) + 1.0).abs() < 1e-15);
        assert_eq!(from_integer(4_294_967_295), 4_294_967_295.0);
    }
}
