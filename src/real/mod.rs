//! Numbers of the pair loops, in double and in single precision, and the few functions they need:
//! branch-free, written so that a loop over them turns into vector instructions, with the same bits on
//! every machine: no call into the platform's mathematical library.

mod double;
mod single;

use std::fmt::Debug;
use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

pub use double::ROUNDER;

/// How a product is added: with one rounding where the loop is compiled for machines that do it at
/// once, with two elsewhere.
pub trait Arithmetic: Copy + Send + Sync + 'static {
    /// a b + c.
    fn fused<R: Real>(a: R, b: R, c: R) -> R;
}

/// Two roundings.
#[derive(Debug, Clone, Copy)]
pub struct Plain;

/// One.
#[derive(Debug, Clone, Copy)]
pub struct Fused;

impl Arithmetic for Plain {
    #[inline(always)]
    fn fused<R: Real>(a: R, b: R, c: R) -> R {
        a * b + c
    }
}

impl Arithmetic for Fused {
    #[inline(always)]
    fn fused<R: Real>(a: R, b: R, c: R) -> R {
        a.multiply_add(b, c)
    }
}

/// A number: f64 or f32.
pub trait Real:
    Copy
    + Debug
    + Default
    + PartialOrd
    + Send
    + Sync
    + Add<Output = Self>
    + AddAssign
    + Sub<Output = Self>
    + SubAssign
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + 'static
{
    /// 0.
    const ZERO: Self;
    /// Squares of distances below that are taken for that: far closer than positions are known.
    const TINY: f64;
    /// Does it take several words to fill a register as wide as the one the words come in?
    const NARROW: bool;
    /// The nearest one.
    fn of(x: f64) -> Self;
    /// The same number in double precision.
    fn double(self) -> f64;
    /// self a + b, rounded once.
    fn multiply_add(self, a: Self, b: Self) -> Self;
    /// Square root.
    fn sqrt(self) -> Self;
    /// The nearest one in single precision.
    fn single(self) -> f32;
    /// 1/sqrt(x) to about 1 ulp, from what single precision knows of it.
    fn inverse_root_from<A: Arithmetic>(self, near: f32) -> Self;
    /// r and 1/r of a square distance, from what [`near_inverse_roots`] finds.
    #[inline(always)]
    fn distance_from<A: Arithmetic>(self, near: f32) -> [Self; 2] {
        let inverse = self.at_least(Self::TINY).inverse_root_from::<A>(near);
        [self * inverse, inverse]
    }
    /// 1/sqrt(x) for 1e-30 <= x <= 1e30, to about 1 ulp. Loops that do much more than this are better
    /// off with [`near_inverse_roots`] before: a machine has too few turns of a long loop in hand to
    /// keep busy.
    #[inline(always)]
    fn inverse_root<A: Arithmetic>(self) -> Self {
        self.inverse_root_from::<A>(1.0 / self.single().sqrt())
    }
    /// Natural logarithm of a positive normal number, to about 1 ulp.
    fn ln<A: Arithmetic>(self) -> Self;
    /// (cos, sin) of 2 pi t for t in [0, 1], to about 1 ulp of 1.
    fn cos_sin_turn<A: Arithmetic>(self) -> (Self, Self);
    /// exp(-x) - 1 for x >= 0, accurate to about 1 ulp also where x is tiny.
    fn expm1_negative<A: Arithmetic>(self) -> Self;
    /// A word below 2^32, less 2^31 and plus 1/2.
    fn centred(word: u64) -> Self;
    /// The number of the lowest ten bits of a word, less its mean of 511.5.
    fn centred_tenth(word: u32) -> Self;
    /// A word below 2^32 plus 1/2, times 2^-32: in (0, 1].
    fn unit_interval(word: u64) -> Self;
    /// A word below 2^32 times 2^-32: in [0, 1].
    fn fraction(word: u64) -> Self;
    /// sqrt(x) for 0 <= x <= 1e30, to about 1 ulp; of numbers below 1e-30 less than it is.
    #[inline(always)]
    fn root(self) -> Self {
        self * self.at_least(1e-30).inverse_root::<Plain>()
    }
    /// The larger one, without a branch.
    #[inline(always)]
    fn at_least(self, least: f64) -> Self {
        let least = Self::of(least);
        if self > least { self } else { least }
    }
}

/// 1/r of squares in lanes, in single precision; see [`Real::TINY`].
#[inline(always)]
pub fn near_inverse_roots<R: Real, const N: usize>(r2: &[R; N], near: &mut [f32; N], count: usize) {
    let count = count.min(N);
    if R::NARROW {
        for k in 0..count {
            near[k] = 1.0 / r2[k].at_least(R::TINY).single().sqrt();
        }
        return;
    }
    for k in 0..count {
        near[k] = r2[k].at_least(R::TINY).single();
    }
    // In a loop of its own, where twice as many fill a register: roots of a full one take no longer than those
    // of half a one.
    for root in &mut near[..count] {
        *root = 1.0 / root.sqrt();
    }
}

/// c0 + z (c1 + z (c2 + ..)).
#[inline(always)]
fn polynomial<A: Arithmetic, R: Real, const N: usize>(z: R, coefficients: &[R; N]) -> R {
    let mut sum = coefficients[N - 1];
    for k in (0..N - 1).rev() {
        sum = A::fused(sum, z, coefficients[k]);
    }
    sum
}

/// cos x and sin x for |x| <= pi/4 by series in x^2, their first terms exact.
#[inline(always)]
fn cos_sin<A: Arithmetic, R: Real, const N: usize>(x: R, sine: &[R; N], cosine: &[R; N]) -> (R, R) {
    let z = x * x;
    let base = A::fused(R::of(-0.5), z, R::of(1.0));
    (
        A::fused(z * z, polynomial::<A, R, N>(z, cosine), base),
        A::fused(x * z, polynomial::<A, R, N>(z, sine), x),
    )
}

/// Natural logarithm of a positive normal number, outside of loops for particular machines.
#[inline(always)]
pub fn ln(x: f64) -> f64 {
    Real::ln::<Plain>(x)
}

/// (cos, sin) of 2 pi t for t in [0, 1], likewise.
#[inline(always)]
pub fn cos_sin_turn(t: f64) -> (f64, f64) {
    t.cos_sin_turn::<Plain>()
}

/// exp(-x) - 1 for x >= 0, likewise.
#[inline(always)]
pub fn expm1_negative(x: f64) -> f64 {
    x.expm1_negative::<Plain>()
}
