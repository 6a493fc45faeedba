//! From the four words of a pair to the variates of its random force. Each kind has mean 0,
//! variance 1 and independent components; only their higher moments and their cost differ.

use super::elementary::{Arithmetic, cos_sin_turn_with, from_integer, ln_with};

const SCALE: f64 = 1.0 / 4_294_967_296.0;
const SQRT_12: f64 = 3.464_101_615_137_754_6;

/// A number in (0, 1) from a word.
#[inline(always)]
pub fn unit_interval(word: u64) -> f64 {
    (from_integer(word) + 0.5) * SCALE
}

/// How the random force of a pair is distributed.
pub trait Variate: Copy + Send + Sync + 'static {
    /// Name in the registry.
    const NAME: &'static str;
    /// False where there is no noise: its code is then not compiled.
    const ON: bool;
    /// Three variates from four words (2D uses the first two, the central form the first), times
    /// `sign`, which is 1 or -1.
    fn draw<A: Arithmetic>(words: [u64; 4], sign: f64, count: usize) -> [f64; 3];
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
    fn draw<A: Arithmetic>(_: [u64; 4], _: f64, _: usize) -> [f64; 3] {
        [0.0; 3]
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
fn box_muller<A: Arithmetic>(a: u64, b: u64) -> (f64, f64) {
    let radius = (-2.0 * ln_with::<A>(unit_interval(a))).sqrt();
    let (c, s) = cos_sin_turn_with::<A>(from_integer(b) * SCALE);
    (radius * c, radius * s)
}

impl Variate for Gaussian {
    const NAME: &'static str = "gaussian";
    const ON: bool = true;
    #[inline(always)]
    fn draw<A: Arithmetic>(words: [u64; 4], sign: f64, count: usize) -> [f64; 3] {
        let (x, y) = box_muller::<A>(words[0], words[1]);
        let z = if count > 2 {
            box_muller::<A>(words[2], words[3]).0
        } else {
            0.0
        };
        [x, y, z].map(|variate| sign * variate)
    }
    #[inline(always)]
    fn draw_four<A: Arithmetic>(words: [u64; 4]) -> [f64; 4] {
        let (x, y) = box_muller::<A>(words[0], words[1]);
        let (z, last) = box_muller::<A>(words[2], words[3]);
        [x, y, z, last]
    }
}

/// Uniform variates of unit variance: the same first two moments, no transcendental functions.
/// Good for the weak kicks of velocity Verlet; an exact exchange over dt >> tau needs normal ones.
#[derive(Debug, Clone, Copy)]
pub struct Uniform;

/// sqrt(12) (u - 1/2) of the uniform u in (0, 1) of a word: the difference is exact, and a power of
/// two moves into the factor.
#[inline(always)]
fn centred(word: u64, factor: f64) -> f64 {
    const HALF: f64 = 2_147_483_648.0;
    ((from_integer(word) - HALF) + 0.5) * factor
}

impl Variate for Uniform {
    const NAME: &'static str = "uniform";
    const ON: bool = true;
    #[inline(always)]
    fn draw<A: Arithmetic>(words: [u64; 4], sign: f64, _: usize) -> [f64; 3] {
        let factor = sign * (SQRT_12 * SCALE);
        [
            centred(words[0], factor),
            centred(words[1], factor),
            centred(words[2], factor),
        ]
    }
    #[inline(always)]
    fn draw_four<A: Arithmetic>(words: [u64; 4]) -> [f64; 4] {
        words.map(|word| centred(word, SQRT_12 * SCALE))
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Stream, SweepKey};
    use super::*;

    fn moments<V: Variate>() -> ([f64; 3], [f64; 3], [f64; 3]) {
        let n = 400_000_u64;
        let key = SweepKey::new(20_13, Stream::PairForce, 5, 0);
        let (mut mean, mut square, mut fourth) = ([0.0; 3], [0.0; 3], [0.0; 3]);
        for id in 0..n {
            let x = V::draw::<super::super::Plain>(key.pair_words(id, id + 1), 1.0, 3);
            for a in 0..3 {
                mean[a] += x[a] / n as f64;
                square[a] += x[a] * x[a] / n as f64;
                fourth[a] += x[a].powi(4) / n as f64;
            }
        }
        (mean, square, fourth)
    }

    #[test]
    fn moments_are_right_within_four_standard_errors() {
        let root = (400_000_f64).sqrt();
        let (mean, square, fourth) = moments::<Gaussian>();
        for a in 0..3 {
            assert!(mean[a].abs() < 4.0 / root);
            assert!((square[a] - 1.0).abs() < 4.0 * 2.0_f64.sqrt() / root);
            assert!((fourth[a] - 3.0).abs() < 4.0 * 96.0_f64.sqrt() / root);
        }
        let (mean, square, fourth) = moments::<Uniform>();
        for a in 0..3 {
            assert!(mean[a].abs() < 4.0 / root);
            assert!((square[a] - 1.0).abs() < 4.0 * 0.8_f64.sqrt() / root);
            assert!((fourth[a] - 1.8).abs() < 4.0 * 5.76_f64.sqrt() / root);
        }
    }
}
