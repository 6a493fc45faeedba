//! From the four words of a pair to the variates of its random force. Each kind has mean 0,
//! variance 1 and independent components; only their higher moments and their cost differ.

use super::blend;
use crate::real::{Arithmetic, Plain, Real};

const SCALE: f64 = 1.0 / 4_294_967_296.0;
const SQRT_12: f64 = 3.464_101_615_137_754_6;
/// The same for 0, 1 .. 1023: sqrt(12 / (1024^2 - 1)).
const SQRT_12_OF_TENTHS: f64 = 3.464_103_266_951_306 / 1024.0;

/// How the random force of a pair is distributed.
pub trait Variate: Copy + Send + Sync + 'static {
    /// Name in the registry.
    const NAME: &'static str;
    /// False where there is no noise: its code is then not compiled.
    const ON: bool;
    /// Three variates from four words (2D uses the first two, the central form the first), times
    /// `sign`, which is 1 or -1.
    fn draw<A: Arithmetic, R: Real>(words: [u64; 4], sign: R, count: usize) -> [R; 3];
    /// The first `COUNT` of these variates, without the sign, of words in lanes.
    fn draw_lanes<A: Arithmetic, R: Real, const N: usize, const COUNT: usize>(
        words: &[[u32; N]; 4],
        count: usize,
        xi: &mut [[R; N]; 3],
    );
    /// The first `COUNT` variates of pairs in lanes from the words of their particles ([`blend`]);
    /// where `SIGNED`, those of (a, b) are those of (b, a) with the other sign.
    fn between<R: Real, const N: usize, const COUNT: usize, const SIGNED: bool>(
        words: [&[u32; N]; 2],
        count: usize,
        xi: &mut [[R; N]; 3],
    );
    /// Four variates from four words; the first ones are those of `draw`.
    fn draw_four<A: Arithmetic>(words: [u64; 4]) -> [f64; 4];
}

/// No fluctuations.
#[derive(Debug, Clone, Copy)]
pub struct Silent;

impl Variate for Silent {
    const NAME: &'static str = "none";
    const ON: bool = false;
    #[inline(always)]
    fn draw<A: Arithmetic, R: Real>(_: [u64; 4], _: R, _: usize) -> [R; 3] {
        [R::ZERO; 3]
    }
    #[inline(always)]
    fn draw_lanes<A: Arithmetic, R: Real, const N: usize, const COUNT: usize>(
        _: &[[u32; N]; 4],
        _: usize,
        _: &mut [[R; N]; 3],
    ) {
    }
    #[inline(always)]
    fn between<R: Real, const N: usize, const COUNT: usize, const SIGNED: bool>(
        _: [&[u32; N]; 2],
        _: usize,
        _: &mut [[R; N]; 3],
    ) {
    }
    #[inline(always)]
    fn draw_four<A: Arithmetic>(_: [u64; 4]) -> [f64; 4] {
        [0.0; 4]
    }
}

/// Normal variates by the transformation of Box and Muller (1958) on 32-bit uniforms: |xi| < 6.8.
#[derive(Debug, Clone, Copy)]
pub struct Gaussian;

#[inline(always)]
fn sign<R: Real, const SIGNED: bool>(head: u32, other: u32) -> R {
    R::of(if SIGNED && head > other { -1.0 } else { 1.0 })
}

#[inline(always)]
fn radius<A: Arithmetic, R: Real>(word: u64) -> R {
    (R::of(-2.0) * R::unit_interval(word).ln::<A>()).sqrt()
}

#[inline(always)]
fn box_muller<A: Arithmetic, R: Real>(a: u64, b: u64) -> (R, R) {
    let radius: R = radius::<A, R>(a);
    let (c, s) = R::fraction(b).cos_sin_turn::<A>();
    (radius * c, radius * s)
}

impl Variate for Gaussian {
    const NAME: &'static str = "gaussian";
    const ON: bool = true;
    #[inline(always)]
    fn draw<A: Arithmetic, R: Real>(words: [u64; 4], sign: R, count: usize) -> [R; 3] {
        let (x, y) = box_muller::<A, R>(words[0], words[1]);
        let z = if count > 2 {
            box_muller::<A, R>(words[2], words[3]).0
        } else {
            R::ZERO
        };
        [x, y, z].map(|variate| sign * variate)
    }
    #[inline(always)]
    fn draw_lanes<A: Arithmetic, R: Real, const N: usize, const COUNT: usize>(
        [a, b, c, d]: &[[u32; N]; 4],
        count: usize,
        [x, y, z]: &mut [[R; N]; 3],
    ) {
        // Loop by loop: a machine has too few turns of a long one in hand to keep busy.
        let count = count.min(N);
        for lane in 0..count {
            x[lane] = radius::<A, R>(a[lane].into());
        }
        for lane in 0..count {
            let (cosine, sine) = R::fraction(b[lane].into()).cos_sin_turn::<A>();
            let radius = x[lane];
            x[lane] = radius * cosine;
            if COUNT > 1 {
                y[lane] = radius * sine;
            }
        }
        if COUNT > 2 {
            for lane in 0..count {
                z[lane] = radius::<A, R>(c[lane].into());
            }
            for lane in 0..count {
                let (cosine, _) = R::fraction(d[lane].into()).cos_sin_turn::<A>();
                z[lane] = z[lane] * cosine;
            }
        }
    }
    #[inline(always)]
    fn between<R: Real, const N: usize, const COUNT: usize, const SIGNED: bool>(
        [head, other]: [&[u32; N]; 2],
        count: usize,
        xi: &mut [[R; N]; 3],
    ) {
        let count = count.min(N);
        let mut words = [[0_u32; N]; 4];
        for (turn, words) in words.iter_mut().enumerate() {
            if turn < 2 || COUNT > 2 {
                for lane in 0..count {
                    words[lane] = blend(head[lane], other[lane], turn as u32);
                }
            }
        }
        // Single precision is good enough, and twice as many lanes. Its rounding would be seen where
        // products are not fused, so that they are nowhere.
        let mut narrow = [[0.0_f32; N]; 3];
        for lane in 0..count {
            let [a, b, c, d] = &words;
            let four = [a[lane], b[lane], c[lane], d[lane]].map(u64::from);
            let [x, y, z] = Self::draw::<Plain, f32>(four, 1.0, COUNT);
            narrow[0][lane] = x;
            narrow[1][lane] = y;
            narrow[2][lane] = z;
        }
        for lane in 0..count {
            let sign = sign::<R, SIGNED>(head[lane], other[lane]);
            for n in 0..COUNT {
                xi[n][lane] = sign * R::of(narrow[n][lane].double());
            }
        }
    }
    #[inline(always)]
    fn draw_four<A: Arithmetic>(words: [u64; 4]) -> [f64; 4] {
        let (x, y) = box_muller::<A, f64>(words[0], words[1]);
        let (z, last) = box_muller::<A, f64>(words[2], words[3]);
        [x, y, z, last]
    }
}

/// Uniform variates of unit variance: the same first two moments, no transcendental functions.
/// Good for the weak kicks of velocity Verlet; an exact exchange over dt >> tau needs normal ones.
#[derive(Debug, Clone, Copy)]
pub struct Uniform;

impl Variate for Uniform {
    const NAME: &'static str = "uniform";
    const ON: bool = true;
    #[inline(always)]
    fn draw<A: Arithmetic, R: Real>(words: [u64; 4], sign: R, _: usize) -> [R; 3] {
        // sqrt(12) (u - 1/2) of a uniform u: a power of two moves into the factor.
        let factor = sign * R::of(SQRT_12 * SCALE);
        [
            R::centred(words[0]) * factor,
            R::centred(words[1]) * factor,
            R::centred(words[2]) * factor,
        ]
    }
    #[inline(always)]
    fn draw_lanes<A: Arithmetic, R: Real, const N: usize, const COUNT: usize>(
        words: &[[u32; N]; 4],
        count: usize,
        xi: &mut [[R; N]; 3],
    ) {
        for n in 0..COUNT {
            for lane in 0..count.min(N) {
                xi[n][lane] = R::centred(words[n][lane].into()) * R::of(SQRT_12 * SCALE);
            }
        }
    }
    #[inline(always)]
    fn between<R: Real, const N: usize, const COUNT: usize, const SIGNED: bool>(
        [head, other]: [&[u32; N]; 2],
        count: usize,
        xi: &mut [[R; N]; 3],
    ) {
        for lane in 0..count.min(N) {
            let (a, b) = (head[lane], other[lane]);
            let factor = sign::<R, SIGNED>(a, b) * R::of(SQRT_12_OF_TENTHS);
            // Three times ten bits.
            let bits = blend(a, b, 0);
            for n in 0..COUNT {
                xi[n][lane] = R::centred_tenth(bits >> (2 + 10 * n)) * factor;
            }
        }
    }
    #[inline(always)]
    fn draw_four<A: Arithmetic>(words: [u64; 4]) -> [f64; 4] {
        words.map(|word| f64::centred(word) * (SQRT_12 * SCALE))
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Stream, SweepKey};
    use super::*;

    fn moments<V: Variate, R: Real>() -> ([f64; 3], [f64; 3], [f64; 3]) {
        let n = 400_000_u64;
        let key = SweepKey::new(20_13, Stream::PairForce, 5, 0);
        let (mut mean, mut square, mut fourth) = ([0.0; 3], [0.0; 3], [0.0; 3]);
        for id in 0..n {
            let x = V::draw::<Plain, R>(key.pair_words(id, id + 1), R::of(1.0), 3);
            for a in 0..3 {
                let x = x[a].double();
                mean[a] += x / n as f64;
                square[a] += x * x / n as f64;
                fourth[a] += x.powi(4) / n as f64;
            }
        }
        (mean, square, fourth)
    }

    /// Variates in lanes are those drawn one by one.
    fn check_lanes<V: Variate, R: Real, const COUNT: usize>() {
        let key = SweepKey::new(20_13, Stream::PairForce, 6, 0);
        let mut words = [[0; 40]; 4];
        for lane in 0..40 {
            let drawn = key.pair_words(lane as u64, 77);
            for n in 0..4 {
                words[n][lane] = drawn[n] as u32;
            }
        }
        let mut xi = [[R::ZERO; 40]; 3];
        V::draw_lanes::<Plain, R, 40, COUNT>(&words, 40, &mut xi);
        for lane in 0..40 {
            let four = [0, 1, 2, 3].map(|n: usize| u64::from(words[n][lane]));
            let one = V::draw::<Plain, R>(four, R::of(1.0), COUNT);
            for n in 0..COUNT {
                assert_eq!(xi[n][lane], one[n]);
            }
        }
    }

    #[test]
    fn variates_in_lanes_are_those_drawn_one_by_one() {
        check_lanes::<Gaussian, f64, 1>();
        check_lanes::<Gaussian, f64, 2>();
        check_lanes::<Gaussian, f64, 3>();
        check_lanes::<Gaussian, f32, 3>();
        check_lanes::<Uniform, f64, 3>();
        check_lanes::<Uniform, f32, 2>();
    }

    fn check<R: Real>() {
        let root = (400_000_f64).sqrt();
        let (mean, square, fourth) = moments::<Gaussian, R>();
        for a in 0..3 {
            assert!(mean[a].abs() < 4.0 / root);
            assert!((square[a] - 1.0).abs() < 4.0 * 2.0_f64.sqrt() / root);
            assert!((fourth[a] - 3.0).abs() < 4.0 * 96.0_f64.sqrt() / root);
        }
        let (mean, square, fourth) = moments::<Uniform, R>();
        for a in 0..3 {
            assert!(mean[a].abs() < 4.0 / root);
            assert!((square[a] - 1.0).abs() < 4.0 * 0.8_f64.sqrt() / root);
            assert!((fourth[a] - 1.8).abs() < 4.0 * 5.76_f64.sqrt() / root);
        }
    }

    #[test]
    fn moments_are_right_within_four_standard_errors() {
        check::<f64>();
        check::<f32>();
    }

    /// Variates between the words of particles `first` to `first` + N and those behind them.
    fn between<V: Variate, R: Real, const COUNT: usize>(first: u64, back: bool) -> [[R; 64]; 3] {
        let key = SweepKey::new(20_14, Stream::PairForce, 5, 0);
        let word = |n: usize| key.particle_word(first + n as u64);
        let mut words = [
            std::array::from_fn(word),
            std::array::from_fn(|n| word(n + 1)),
        ];
        if back {
            words.reverse();
        }
        let mut xi = [[R::ZERO; 64]; 3];
        V::between::<R, 64, COUNT, true>([&words[0], &words[1]], 64, &mut xi);
        xi
    }

    fn check_between<V: Variate>(fourth: f64) {
        let (n, mut sums) = (400_000, [0.0; 3]);
        for first in (0..n / 3).step_by(64) {
            let (xi, back) = (
                between::<V, f64, 3>(first, false),
                between::<V, f64, 3>(first, true),
            );
            assert_eq!(xi.map(|row| row.map(|x| -x)), back);
            let narrow = between::<V, f32, 3>(first, false);
            let few = between::<V, f64, 2>(first, false);
            for lane in 0..64 {
                for a in 0..3 {
                    let x = xi[a][lane];
                    assert!((x - narrow[a][lane].double()).abs() < 4e-7);
                    assert_eq!(few[a][lane], if a < 2 { x } else { 0.0 });
                    sums = [sums[0] + x, sums[1] + x * x, sums[2] + x.powi(4)];
                }
            }
        }
        let samples = ((n / 3).next_multiple_of(64) * 3) as f64;
        let [mean, square, fourth_found] = sums.map(|sum| sum / samples);
        let root = samples.sqrt();
        assert!(mean.abs() < 4.0 / root);
        assert!((square - 1.0).abs() < 4.0 * (fourth - 1.0).sqrt() / root);
        assert!((fourth_found - fourth).abs() < 4.0 * 10.0 / root);
    }

    #[test]
    fn variates_between_particles_change_sign_with_their_order_and_have_the_moments() {
        check_between::<Gaussian>(3.0);
        check_between::<Uniform>(1.8);
        assert_eq!(between::<Silent, f64, 3>(0, false), [[0.0; 64]; 3]);
    }

    #[test]
    fn single_precision_rounds_the_variates_of_double_precision() {
        let key = SweepKey::new(5, Stream::PairExchange, 1, 0);
        let mut square = 0.0;
        for id in 0..20_000_u64 {
            let words = key.pair_words(id, id + 1);
            let wide: [[f64; 3]; 2] = [
                Gaussian::draw::<Plain, _>(words, -1.0, 3),
                Uniform::draw::<Plain, _>(words, -1.0, 3),
            ];
            let narrow: [[f32; 3]; 2] = [
                Gaussian::draw::<Plain, _>(words, -1.0, 3),
                Uniform::draw::<Plain, _>(words, -1.0, 3),
            ];
            for (wide, narrow) in wide.concat().iter().zip(narrow.concat()) {
                square += (wide - narrow.double()).powi(2);
                // Close to u = 1 a radius is the root of the rounding of u.
                assert!((wide - narrow.double()).abs() < 4e-4, "{wide} {narrow}");
            }
        }
        assert!((square / 120_000.0).sqrt() < 3e-6);
    }
}
