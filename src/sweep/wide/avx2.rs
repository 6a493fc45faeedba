//! AVX2 with FMA: two halves of four or eight lanes.

use std::arch::x86_64::*;

use super::{KEPT, LANES, Turning, Vector, Wide, slot};
use crate::real::Fused;

/// Two halves of four lanes.
#[derive(Clone, Copy)]
pub struct Avx2(__m256d, __m256d);

/// Two halves of eight lanes in single precision.
#[derive(Clone, Copy)]
pub struct Single(__m256, __m256);

/// 32-bit places of the 64-bit lanes whose bits are set, in one half.
const HALVES: [[i32; 8]; 16] = {
    let mut table = [[0; 8]; 16];
    let mut mask = 0;
    while mask < 16 {
        let mut at = 0;
        while at < 4 {
            let lane = KEPT[mask][at] as i32;
            table[mask][2 * at] = 2 * lane;
            table[mask][2 * at + 1] = 2 * lane + 1;
            at += 1;
        }
        mask += 1;
    }
    table
};

#[inline(always)]
unsafe fn transpose(rows: [__m256d; 4]) -> [__m256d; 4] {
    let [a, b, c, d] = rows;
    // SAFETY: the machine has the instructions.
    unsafe {
        let (t0, t1) = (_mm256_unpacklo_pd(a, b), _mm256_unpackhi_pd(a, b));
        let (t2, t3) = (_mm256_unpacklo_pd(c, d), _mm256_unpackhi_pd(c, d));
        [
            _mm256_permute2f128_pd::<0x20>(t0, t2),
            _mm256_permute2f128_pd::<0x20>(t1, t3),
            _mm256_permute2f128_pd::<0x31>(t0, t2),
            _mm256_permute2f128_pd::<0x31>(t1, t3),
        ]
    }
}

// SAFETY of all blocks below: the machine has the instructions, pointers are the caller's.
#[allow(clippy::undocumented_unsafe_blocks)]
impl Vector for Avx2 {
    type Number = f64;
    const LANES: usize = 8;
    lane_by_lane!(
        _mm256_set1_pd,
        _mm256_add_pd,
        _mm256_sub_pd,
        _mm256_mul_pd,
        _mm256_fnmadd_pd,
        _mm256_fmadd_pd,
        [0, 1]
    );
    #[inline(always)]
    unsafe fn load(from: *const f64) -> Self {
        unsafe { Self(_mm256_loadu_pd(from), _mm256_loadu_pd(from.add(4))) }
    }
    #[inline(always)]
    unsafe fn store(self, to: *mut f64) {
        unsafe {
            _mm256_storeu_pd(to, self.0);
            _mm256_storeu_pd(to.add(4), self.1);
        }
    }
    #[inline(always)]
    fn below(self, other: Self) -> u32 {
        unsafe {
            let low = _mm256_movemask_pd(_mm256_cmp_pd::<_CMP_LT_OQ>(self.0, other.0));
            let high = _mm256_movemask_pd(_mm256_cmp_pd::<_CMP_LT_OQ>(self.1, other.1));
            (low | high << 4) as u32
        }
    }
    #[inline(always)]
    unsafe fn columns(base: *const [f64; 4], slots: *const u32) -> [Self; 4] {
        unsafe {
            let at = |k: usize| _mm256_loadu_pd(base.add(slot(slots, k)).cast());
            let low = transpose([at(0), at(1), at(2), at(3)]);
            let high = transpose([at(4), at(5), at(6), at(7)]);
            [
                Self(low[0], high[0]),
                Self(low[1], high[1]),
                Self(low[2], high[2]),
                Self(low[3], high[3]),
            ]
        }
    }
    #[inline(always)]
    unsafe fn take([x, y, z]: [Self; 3], from: *mut [f64; 4], slots: *const u32) {
        unsafe {
            let zero = _mm256_setzero_pd();
            let halves = [
                transpose([x.0, y.0, z.0, zero]),
                transpose([x.1, y.1, z.1, zero]),
            ];
            for (half, records) in halves.into_iter().enumerate() {
                for (k, record) in records.into_iter().enumerate() {
                    take(record, from, slots.add(4 * half + k));
                }
            }
        }
    }
    #[inline(always)]
    unsafe fn store_kept(self, keep: u32, to: *mut f64) {
        unsafe {
            let (low, high) = (keep & 15, keep >> 4);
            let places = _mm256_loadu_si256(HALVES[low as usize].as_ptr().cast());
            let first = _mm256_permutevar8x32_epi32(_mm256_castpd_si256(self.0), places);
            let places = _mm256_loadu_si256(HALVES[high as usize].as_ptr().cast());
            let second = _mm256_permutevar8x32_epi32(_mm256_castpd_si256(self.1), places);
            // The second half goes where the first ends.
            _mm256_storeu_pd(to, _mm256_castsi256_pd(first));
            let to = to.add(low.count_ones() as usize);
            _mm256_storeu_pd(to, _mm256_castsi256_pd(second));
        }
    }
    #[inline(always)]
    fn where_set(self, keep: u32, other: Self) -> Self {
        unsafe {
            let bits = _mm256_set1_epi64x(keep.into());
            let (low, high) = (
                _mm256_setr_epi64x(1, 2, 4, 8),
                _mm256_setr_epi64x(16, 32, 64, 128),
            );
            let low = _mm256_cmpeq_epi64(_mm256_and_si256(bits, low), low);
            let high = _mm256_cmpeq_epi64(_mm256_and_si256(bits, high), high);
            Self(
                _mm256_blendv_pd(other.0, self.0, _mm256_castsi256_pd(low)),
                _mm256_blendv_pd(other.1, self.1, _mm256_castsi256_pd(high)),
            )
        }
    }
    #[inline(always)]
    unsafe fn store_either(keep: u32, words: [u32; 2], to: *mut u32) {
        unsafe { _mm256_storeu_si256(to.cast(), either(keep, words)) }
    }
}

/// All bits of the lanes whose bits are set.
#[inline(always)]
unsafe fn set_lanes(bits: u32) -> __m256i {
    // SAFETY: the machine has the instructions.
    unsafe {
        let places = _mm256_setr_epi32(1, 2, 4, 8, 16, 32, 64, 128);
        let bits = _mm256_and_si256(_mm256_set1_epi32(bits as i32), places);
        _mm256_cmpeq_epi32(bits, places)
    }
}

/// Eight words, the first of the two where the bits are set.
#[inline(always)]
unsafe fn either(keep: u32, [set, unset]: [u32; 2]) -> __m256i {
    // SAFETY: the machine has the instructions.
    unsafe {
        let (set, unset) = (
            _mm256_set1_epi32(set as i32),
            _mm256_set1_epi32(unset as i32),
        );
        _mm256_blendv_epi8(unset, set, set_lanes(keep))
    }
}

/// That half of each register.
#[inline(always)]
unsafe fn half_of<const N: i32>([a, b, c, d]: [__m256; 4]) -> [__m128; 4] {
    // SAFETY: the machine has the instructions.
    unsafe {
        [
            _mm256_extractf128_ps::<N>(a),
            _mm256_extractf128_ps::<N>(b),
            _mm256_extractf128_ps::<N>(c),
            _mm256_extractf128_ps::<N>(d),
        ]
    }
}

/// Takes a record from that of a slot.
#[inline(always)]
pub(super) unsafe fn take(record: __m256d, from: *mut [f64; 4], slots: *const u32) {
    // SAFETY: the machine has the instructions, pointers are the caller's.
    unsafe {
        let to = from.add(slot(slots, 0)).cast();
        _mm256_storeu_pd(to, _mm256_sub_pd(_mm256_loadu_pd(to), record));
    }
}

/// Adds the lower half of a register, added to the upper one, to four numbers.
#[inline(always)]
pub(super) unsafe fn add_halves(both: __m256, to: *mut f64) {
    // SAFETY: the machine has the instructions, pointers are the caller's.
    unsafe {
        let sum = _mm_add_ps(
            _mm256_castps256_ps128(both),
            _mm256_extractf128_ps::<1>(both),
        );
        _mm256_storeu_pd(to, _mm256_add_pd(_mm256_loadu_pd(to), _mm256_cvtps_pd(sum)));
    }
}

/// The same for four records in single precision, one after the other.
#[inline(always)]
pub(super) unsafe fn take_four(records: [__m128; 4], from: *mut [f64; 4], slots: *const u32) {
    for (k, record) in records.into_iter().enumerate() {
        // SAFETY: the machine has the instructions, pointers are the caller's.
        unsafe { take(_mm256_cvtps_pd(record), from, slots.add(k)) };
    }
}

/// x0 + x1, y0 + y1, x2 + x3, y2 + y3.
#[inline(always)]
unsafe fn neighbours(x: __m256d, y: __m256d) -> __m256d {
    // SAFETY: the machine has the instructions.
    unsafe { _mm256_add_pd(_mm256_unpacklo_pd(x, y), _mm256_unpackhi_pd(x, y)) }
}

/// The last sums of four columns whose neighbours have been added: of the lower and upper half of
/// x01 y01 x23 y23 .. and of z01 w01 ..
#[inline(always)]
pub(super) unsafe fn folded(t: [__m256d; 2], u: [__m256d; 2]) -> [f64; 4] {
    // SAFETY: the machine has the instructions.
    unsafe {
        let (t, u) = (_mm256_add_pd(t[0], t[1]), _mm256_add_pd(u[0], u[1]));
        let first = _mm256_permute2f128_pd::<0x20>(t, u);
        let second = _mm256_permute2f128_pd::<0x31>(t, u);
        std::mem::transmute(_mm256_add_pd(first, second))
    }
}

impl Wide for Avx2 {
    type Arithmetic = Fused;
    type Single = Single;
    #[inline(always)]
    unsafe fn records(columns: [Self; 4], to: *mut [f64; 4]) {
        // SAFETY: the machine has the instructions, pointers are the caller's.
        unsafe {
            let [x, y, z, last] = columns;
            let low = transpose([x.0, y.0, z.0, last.0]);
            let high = transpose([x.1, y.1, z.1, last.1]);
            for k in 0..4 {
                _mm256_storeu_pd(to.add(k).cast(), low[k]);
                _mm256_storeu_pd(to.add(4 + k).cast(), high[k]);
            }
        }
    }
    #[inline(always)]
    unsafe fn widened(from: *const f32) -> Self {
        // SAFETY: as above.
        unsafe {
            let (low, high) = (_mm_loadu_ps(from), _mm_loadu_ps(from.add(4)));
            Self(_mm256_cvtps_pd(low), _mm256_cvtps_pd(high))
        }
    }
    #[inline(always)]
    fn sums([x, y, z, last]: [Self; 4]) -> [f64; 4] {
        // SAFETY: the machine has the instructions.
        unsafe {
            folded(
                [neighbours(x.0, y.0), neighbours(x.1, y.1)],
                [neighbours(z.0, last.0), neighbours(z.1, last.1)],
            )
        }
    }
    #[inline(always)]
    fn kept(numbers: [u32; LANES], keep: u8) -> [u32; LANES] {
        // SAFETY: the machine has the instructions; numbers of 32 bits are moved.
        unsafe {
            let numbers = std::mem::transmute::<[u32; LANES], __m256>(numbers);
            std::mem::transmute(in_front(numbers, keep.into()))
        }
    }
}

/// Four by four numbers within each half of the registers.
#[inline(always)]
unsafe fn transposed(rows: [__m256; 4]) -> [__m256; 4] {
    let [a, b, c, d] = rows;
    // SAFETY: the machine has the instructions.
    unsafe {
        let t0 = _mm256_castps_pd(_mm256_unpacklo_ps(a, b));
        let t1 = _mm256_castps_pd(_mm256_unpackhi_ps(a, b));
        let t2 = _mm256_castps_pd(_mm256_unpacklo_ps(c, d));
        let t3 = _mm256_castps_pd(_mm256_unpackhi_ps(c, d));
        [
            _mm256_castpd_ps(_mm256_unpacklo_pd(t0, t2)),
            _mm256_castpd_ps(_mm256_unpackhi_pd(t0, t2)),
            _mm256_castpd_ps(_mm256_unpacklo_pd(t1, t3)),
            _mm256_castpd_ps(_mm256_unpackhi_pd(t1, t3)),
        ]
    }
}

/// The record of the first of some slots.
#[inline(always)]
pub(super) unsafe fn record(base: *const [f32; 4], slots: *const u32) -> __m128 {
    // SAFETY: the machine has the instructions, pointers are the caller's.
    unsafe { _mm_loadu_ps(base.add(slot(slots, 0)).cast()) }
}

/// The records of a slot and the fourth behind it.
#[inline(always)]
unsafe fn two(base: *const [f32; 4], slots: *const u32) -> __m256 {
    // SAFETY: the machine has the instructions, pointers are the caller's.
    unsafe {
        let low = _mm256_castps128_ps256(record(base, slots));
        _mm256_insertf128_ps::<1>(low, record(base, slots.add(4)))
    }
}

/// The four columns of eight records.
#[inline(always)]
unsafe fn eight(base: *const [f32; 4], slots: *const u32) -> [__m256; 4] {
    // SAFETY: the machine has the instructions, pointers are the caller's.
    unsafe {
        transposed([
            two(base, slots),
            two(base, slots.add(1)),
            two(base, slots.add(2)),
            two(base, slots.add(3)),
        ])
    }
}

/// The columns of eight pairs of records.
#[inline(always)]
unsafe fn eight_twice(base: *const [[f32; 4]; 2], slots: *const u32) -> [[__m256; 4]; 2] {
    // SAFETY: the machine has the instructions, pointers are the caller's.
    unsafe {
        let at = |k: usize| _mm256_loadu_ps(base.add(slot(slots, k)).cast());
        let low = transposed([at(0), at(1), at(2), at(3)]);
        let high = transposed([at(4), at(5), at(6), at(7)]);
        let mut columns = [low; 2];
        for a in 0..4 {
            columns[0][a] = _mm256_permute2f128_ps::<0x20>(low[a], high[a]);
            columns[1][a] = _mm256_permute2f128_ps::<0x31>(low[a], high[a]);
        }
        columns
    }
}

/// The eight lanes whose bits are set, in front.
#[inline(always)]
unsafe fn in_front(numbers: __m256, keep: u32) -> __m256 {
    // SAFETY: the machine has the instructions; 16 bytes are read.
    unsafe {
        let places = _mm_loadu_si128(KEPT[keep as usize].as_ptr().cast());
        _mm256_permutevar8x32_ps(numbers, _mm256_cvtepu16_epi32(places))
    }
}

#[allow(clippy::undocumented_unsafe_blocks)]
impl Vector for Single {
    type Number = f32;
    const LANES: usize = 16;
    lane_by_lane!(
        _mm256_set1_ps,
        _mm256_add_ps,
        _mm256_sub_ps,
        _mm256_mul_ps,
        _mm256_fnmadd_ps,
        _mm256_fmadd_ps,
        [0, 1]
    );
    #[inline(always)]
    unsafe fn load(from: *const f32) -> Self {
        unsafe { Self(_mm256_loadu_ps(from), _mm256_loadu_ps(from.add(8))) }
    }
    #[inline(always)]
    unsafe fn store(self, to: *mut f32) {
        unsafe {
            _mm256_storeu_ps(to, self.0);
            _mm256_storeu_ps(to.add(8), self.1);
        }
    }
    #[inline(always)]
    fn below(self, other: Self) -> u32 {
        unsafe {
            let low = _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LT_OQ>(self.0, other.0));
            let high = _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LT_OQ>(self.1, other.1));
            (low | high << 8) as u32
        }
    }
    #[inline(always)]
    unsafe fn columns(base: *const [f32; 4], slots: *const u32) -> [Self; 4] {
        unsafe {
            let (low, high) = (eight(base, slots), eight(base, slots.add(LANES)));
            [
                Self(low[0], high[0]),
                Self(low[1], high[1]),
                Self(low[2], high[2]),
                Self(low[3], high[3]),
            ]
        }
    }
    #[inline(always)]
    unsafe fn columns_twice(base: *const [[f32; 4]; 2], slots: *const u32) -> [[Self; 4]; 2] {
        unsafe {
            let (low, high) = (
                eight_twice(base, slots),
                eight_twice(base, slots.add(LANES)),
            );
            let mut columns = [[Self(low[0][0], high[0][0]); 4]; 2];
            for half in 0..2 {
                for a in 0..4 {
                    columns[half][a] = Self(low[half][a], high[half][a]);
                }
            }
            columns
        }
    }
    #[inline(always)]
    unsafe fn take([x, y, z]: [Self; 3], from: *mut [f64; 4], slots: *const u32) {
        unsafe {
            let zero = _mm256_setzero_ps();
            let halves = [
                transposed([x.0, y.0, z.0, zero]),
                transposed([x.1, y.1, z.1, zero]),
            ];
            for (half, fours) in halves.into_iter().enumerate() {
                let slots = slots.add(8 * half);
                take_four(half_of::<0>(fours), from, slots);
                take_four(half_of::<1>(fours), from, slots.add(4));
            }
        }
    }
    #[inline(always)]
    unsafe fn store_kept(self, keep: u32, to: *mut f32) {
        unsafe {
            let (low, high) = (keep & 0xff, keep >> 8);
            // The second half goes where the first ends.
            _mm256_storeu_ps(to, in_front(self.0, low));
            _mm256_storeu_ps(to.add(low.count_ones() as usize), in_front(self.1, high));
        }
    }
    #[inline(always)]
    fn where_set(self, keep: u32, other: Self) -> Self {
        unsafe {
            let (low, high) = (set_lanes(keep), set_lanes(keep >> LANES));
            Self(
                _mm256_blendv_ps(other.0, self.0, _mm256_castsi256_ps(low)),
                _mm256_blendv_ps(other.1, self.1, _mm256_castsi256_ps(high)),
            )
        }
    }
    #[inline(always)]
    unsafe fn store_either(keep: u32, words: [u32; 2], to: *mut u32) {
        unsafe {
            Avx2::store_either(keep, words, to);
            Avx2::store_either(keep >> LANES, words, to.add(LANES));
        }
    }
}

#[allow(clippy::undocumented_unsafe_blocks)]
impl Turning for Single {
    #[inline(always)]
    unsafe fn quad(from: *const f32) -> Self {
        unsafe {
            let four = _mm256_broadcast_ps(&*from.cast());
            Self(four, four)
        }
    }
    #[inline(always)]
    unsafe fn each(from: *const f32) -> Self {
        unsafe {
            let four = _mm256_broadcast_ps(&*from.cast());
            let (low, high) = (
                _mm256_setr_epi32(0, 0, 0, 0, 1, 1, 1, 1),
                _mm256_setr_epi32(2, 2, 2, 2, 3, 3, 3, 3),
            );
            Self(
                _mm256_permutevar8x32_ps(four, low),
                _mm256_permutevar8x32_ps(four, high),
            )
        }
    }
    #[inline(always)]
    unsafe fn add_quarters(self, to: *mut f64) {
        unsafe { add_halves(_mm256_add_ps(self.0, self.1), to) }
    }
    #[inline(always)]
    fn turned_from(self, other: Self) -> Self {
        unsafe {
            let low = _mm256_sub_epi32(_mm256_castps_si256(self.0), _mm256_castps_si256(other.0));
            let high = _mm256_sub_epi32(_mm256_castps_si256(self.1), _mm256_castps_si256(other.1));
            Self(_mm256_cvtepi32_ps(low), _mm256_cvtepi32_ps(high))
        }
    }
}
