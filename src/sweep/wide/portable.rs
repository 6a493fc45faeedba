//! Without any particular instructions.

use super::{KEPT, LANES, Turning, Vector, Wide};
use crate::real::{Plain, Real};

/// As many numbers.
#[derive(Clone, Copy)]
pub struct Portable<R, const N: usize>([R; N]);

impl<R: Real, const N: usize> Portable<R, N> {
    #[inline(always)]
    fn zip(self, other: Self, f: impl Fn(R, R) -> R) -> Self {
        Self(std::array::from_fn(|k| f(self.0[k], other.0[k])))
    }
}

impl<R: Real, const N: usize> Vector for Portable<R, N> {
    type Number = R;
    const LANES: usize = N;
    #[inline(always)]
    fn splat(x: R) -> Self {
        Self([x; N])
    }
    #[inline(always)]
    unsafe fn load(from: *const R) -> Self {
        // SAFETY: promised by the caller.
        Self(unsafe { from.cast::<[R; N]>().read_unaligned() })
    }
    #[inline(always)]
    unsafe fn store(self, to: *mut R) {
        // SAFETY: promised by the caller.
        unsafe { to.cast::<[R; N]>().write_unaligned(self.0) }
    }
    #[inline(always)]
    fn plus(self, other: Self) -> Self {
        self.zip(other, |a, b| a + b)
    }
    #[inline(always)]
    fn minus(self, other: Self) -> Self {
        self.zip(other, |a, b| a - b)
    }
    #[inline(always)]
    fn times(self, other: Self) -> Self {
        self.zip(other, |a, b| a * b)
    }
    #[inline(always)]
    fn less_product(self, a: Self, b: Self) -> Self {
        self.minus(a.times(b))
    }
    #[inline(always)]
    fn plus_product(self, a: Self, b: Self) -> Self {
        self.plus(a.times(b))
    }
    #[inline(always)]
    fn below(self, other: Self) -> u32 {
        (0..N).fold(0, |bits, k| bits | u32::from(self.0[k] < other.0[k]) << k)
    }
    #[inline(always)]
    unsafe fn columns(base: *const [R; 4], slots: *const u32) -> [Self; 4] {
        let mut columns = [Self([R::ZERO; N]); 4];
        for k in 0..N {
            // SAFETY: promised by the caller.
            let record = unsafe { *base.add(*slots.add(k) as usize) };
            for (column, number) in columns.iter_mut().zip(record) {
                column.0[k] = number;
            }
        }
        columns
    }
    #[inline(always)]
    unsafe fn take([x, y, z]: [Self; 3], from: *mut [f64; 4], slots: *const u32) {
        for k in 0..N {
            // SAFETY: promised by the caller.
            let [a, b, c, _] = unsafe { &mut *from.add(*slots.add(k) as usize) };
            *a -= x.0[k].double();
            *b -= y.0[k].double();
            *c -= z.0[k].double();
        }
    }
    #[inline(always)]
    unsafe fn store_kept(self, mut keep: u32, mut to: *mut R) {
        for eight in self.0.chunks_exact(LANES) {
            let byte = keep & 0xff;
            // SAFETY: promised by the caller; what follows the last one kept is overwritten or free.
            unsafe {
                let kept = KEPT[byte as usize].map(|lane| eight[lane as usize]);
                to.cast::<[R; LANES]>().write_unaligned(kept);
                to = to.add(byte.count_ones() as usize);
            }
            keep >>= LANES;
        }
    }
    #[inline(always)]
    fn where_set(self, keep: u32, other: Self) -> Self {
        let lane = |k: usize| if keep >> k & 1 == 1 { self } else { other };
        Self(std::array::from_fn(|k| lane(k).0[k]))
    }
    #[inline(always)]
    unsafe fn store_either(keep: u32, words: [u32; 2], to: *mut u32) {
        for lane in 0..N {
            // SAFETY: promised by the caller.
            unsafe { *to.add(lane) = words[usize::from(keep >> lane & 1 == 0)] };
        }
    }
}

impl Turning for Portable<f32, 16> {
    #[inline(always)]
    unsafe fn quad(from: *const f32) -> Self {
        // SAFETY: promised by the caller.
        let four = unsafe { from.cast::<[f32; 4]>().read() };
        Self(std::array::from_fn(|k| four[k % 4]))
    }
    #[inline(always)]
    unsafe fn each(from: *const f32) -> Self {
        // SAFETY: promised by the caller.
        let four = unsafe { from.cast::<[f32; 4]>().read() };
        Self(std::array::from_fn(|k| four[k / 4]))
    }
    #[inline(always)]
    unsafe fn add_quarters(self, to: *mut f64) {
        let x = self.0;
        for k in 0..4 {
            let sum = (x[k] + x[k + 8]) + (x[k + 4] + x[k + 12]);
            // SAFETY: promised by the caller.
            unsafe { *to.add(k) += f64::from(sum) };
        }
    }
    #[inline(always)]
    fn turned_from(self, other: Self) -> Self {
        self.zip(other, |a, b| {
            a.to_bits().wrapping_sub(b.to_bits()) as i32 as f32
        })
    }
}

impl Wide for Portable<f64, LANES> {
    type Arithmetic = Plain;
    type Single = Portable<f32, 16>;
    #[inline(always)]
    unsafe fn records(columns: [Self; 4], to: *mut [f64; 4]) {
        let [x, y, z, last] = columns.map(|column| column.0);
        for k in 0..LANES {
            // SAFETY: promised by the caller.
            unsafe { *to.add(k) = [x[k], y[k], z[k], last[k]] };
        }
    }
    #[inline(always)]
    unsafe fn widened(from: *const f32) -> Self {
        // SAFETY: promised by the caller.
        let numbers = unsafe { from.cast::<[f32; LANES]>().read_unaligned() };
        Self(numbers.map(f64::from))
    }
    #[inline(always)]
    fn sums(columns: [Self; 4]) -> [f64; 4] {
        columns.map(|Self(x)| ((x[0] + x[1]) + (x[4] + x[5])) + ((x[2] + x[3]) + (x[6] + x[7])))
    }
    #[inline(always)]
    fn kept(numbers: [u32; LANES], keep: u8) -> [u32; LANES] {
        KEPT[keep as usize].map(|lane| numbers[lane as usize])
    }
}
