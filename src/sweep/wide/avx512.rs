//! AVX-512: one register of eight or sixteen lanes.

use std::arch::x86_64::*;

use super::avx2::{add_halves, folded, record, take, take_four};
use super::{LANES, Turning, Vector, Wide, slot};
use crate::random::{MULTIPLIER_0, MULTIPLIER_1, ROUNDS, WEYL_0, WEYL_1};
use crate::real::Fused;

/// Eight numbers.
#[derive(Clone, Copy)]
pub struct Avx512(__m512d);

/// Sixteen numbers in single precision.
#[derive(Clone, Copy)]
pub struct Single(__m512);

// SAFETY of all blocks below: the machine has the instructions, pointers are the caller's.
#[allow(clippy::undocumented_unsafe_blocks)]
impl Vector for Avx512 {
    type Number = f64;
    const LANES: usize = 8;
    lane_by_lane!(
        _mm512_set1_pd,
        _mm512_add_pd,
        _mm512_sub_pd,
        _mm512_mul_pd,
        _mm512_fnmadd_pd,
        _mm512_fmadd_pd,
        [0]
    );
    #[inline(always)]
    unsafe fn load(from: *const f64) -> Self {
        unsafe { Self(_mm512_loadu_pd(from)) }
    }
    #[inline(always)]
    unsafe fn store(self, to: *mut f64) {
        unsafe { _mm512_storeu_pd(to, self.0) }
    }
    #[inline(always)]
    fn below(self, other: Self) -> u32 {
        unsafe { u32::from(_mm512_cmp_pd_mask::<_CMP_LT_OQ>(self.0, other.0)) }
    }
    #[inline(always)]
    unsafe fn columns(base: *const [f64; 4], slots: *const u32) -> [Self; 4] {
        unsafe {
            let at = |k: usize| _mm256_loadu_pd(base.add(slot(slots, k)).cast());
            let two =
                |p: usize, q: usize| _mm512_insertf64x4::<1>(_mm512_castpd256_pd512(at(p)), at(q));
            // Paired so that the halves of the results come out in order.
            let (a, b, c, d) = (two(0, 2), two(1, 3), two(4, 6), two(5, 7));
            let (t0, t1) = (_mm512_unpacklo_pd(a, b), _mm512_unpackhi_pd(a, b));
            let (t2, t3) = (_mm512_unpacklo_pd(c, d), _mm512_unpackhi_pd(c, d));
            [
                Self(_mm512_shuffle_f64x2::<0x88>(t0, t2)),
                Self(_mm512_shuffle_f64x2::<0x88>(t1, t3)),
                Self(_mm512_shuffle_f64x2::<0xDD>(t0, t2)),
                Self(_mm512_shuffle_f64x2::<0xDD>(t1, t3)),
            ]
        }
    }
    #[inline(always)]
    unsafe fn take([x, y, z]: [Self; 3], from: *mut [f64; 4], slots: *const u32) {
        unsafe {
            let [a, b, c, d] = twos([x, y, z, Self::splat(0.0)]);
            take(_mm512_castpd512_pd256(a), from, slots);
            take(_mm512_castpd512_pd256(b), from, slots.add(1));
            take(_mm512_extractf64x4_pd::<1>(a), from, slots.add(2));
            take(_mm512_extractf64x4_pd::<1>(b), from, slots.add(3));
            take(_mm512_castpd512_pd256(c), from, slots.add(4));
            take(_mm512_castpd512_pd256(d), from, slots.add(5));
            take(_mm512_extractf64x4_pd::<1>(c), from, slots.add(6));
            take(_mm512_extractf64x4_pd::<1>(d), from, slots.add(7));
        }
    }
    #[inline(always)]
    unsafe fn store_kept(self, keep: u32, to: *mut f64) {
        unsafe { _mm512_storeu_pd(to, _mm512_maskz_compress_pd(keep as u8, self.0)) }
    }
    #[inline(always)]
    fn where_set(self, keep: u32, other: Self) -> Self {
        unsafe { Self(_mm512_mask_mov_pd(other.0, keep as u8, self.0)) }
    }
    #[inline(always)]
    unsafe fn store_either(keep: u32, [set, unset]: [u32; 2], to: *mut u32) {
        unsafe {
            let (set, unset) = (
                _mm256_set1_epi32(set as i32),
                _mm256_set1_epi32(unset as i32),
            );
            let words = _mm256_mask_mov_epi32(unset, keep as u8, set);
            _mm256_storeu_si256(to.cast(), words);
        }
    }
    #[inline(always)]
    unsafe fn of_two([set, unset]: [*const [f64; 4]; 2], keep: u32) -> [Self; 4] {
        unsafe {
            let both = _mm512_insertf64x4::<1>(
                _mm512_castpd256_pd512(_mm256_loadu_pd(unset.cast())),
                _mm256_loadu_pd(set.cast()),
            );
            let mut place = _mm512_maskz_mov_epi64(keep as u8, _mm512_set1_epi64(4));
            let mut columns = [Self(both); 4];
            for column in &mut columns {
                *column = Self(_mm512_permutexvar_pd(place, both));
                place = _mm512_add_epi64(place, _mm512_set1_epi64(1));
            }
            columns
        }
    }
}

#[allow(clippy::undocumented_unsafe_blocks)]
impl Wide for Avx512 {
    type Arithmetic = Fused;
    type Single = Single;
    #[inline(always)]
    unsafe fn records(columns: [Self; 4], to: *mut [f64; 4]) {
        unsafe {
            let pairs = twos(columns);
            for (pair, first) in pairs.into_iter().zip([0, 1, 4, 5]) {
                _mm256_storeu_pd(to.add(first).cast(), _mm512_castpd512_pd256(pair));
                let second = _mm512_extractf64x4_pd::<1>(pair);
                _mm256_storeu_pd(to.add(first + 2).cast(), second);
            }
        }
    }
    #[inline(always)]
    unsafe fn widened(from: *const f32) -> Self {
        unsafe { Self(_mm512_cvtps_pd(_mm256_loadu_ps(from))) }
    }
    #[inline(always)]
    fn sums(columns: [Self; 4]) -> [f64; 4] {
        let [x, y, z, last] = columns.map(|column| column.0);
        // SAFETY: the machine has the instructions.
        unsafe {
            // Neighbours: x01 y01 x23 y23 ..
            let t = _mm512_add_pd(_mm512_unpacklo_pd(x, y), _mm512_unpackhi_pd(x, y));
            let u = _mm512_add_pd(_mm512_unpacklo_pd(z, last), _mm512_unpackhi_pd(z, last));
            folded(
                [_mm512_castpd512_pd256(t), _mm512_extractf64x4_pd::<1>(t)],
                [_mm512_castpd512_pd256(u), _mm512_extractf64x4_pd::<1>(u)],
            )
        }
    }
    #[inline(always)]
    fn kept(numbers: [u32; LANES], keep: u8) -> [u32; LANES] {
        // SAFETY: the machine has the instructions; numbers of 32 bits are moved.
        unsafe {
            let numbers = std::mem::transmute::<[u32; LANES], __m256i>(numbers);
            std::mem::transmute(_mm256_maskz_compress_epi32(keep, numbers))
        }
    }
    /// The upper halves are brought down by shuffles: shifts would wait for the unit that multiplies.
    #[inline(always)]
    fn philox<const N: usize>(
        counters: &[[u64; N]; 2],
        tail: [u64; 2],
        key: [u32; 2],
        words: &mut [[u32; N]; 4],
        count: usize,
    ) {
        for lane in (0..count.min(N - N % LANES)).step_by(LANES) {
            unsafe {
                let mut c0 = _mm512_loadu_si512(counters[0].as_ptr().add(lane).cast());
                let mut c1 = _mm512_loadu_si512(counters[1].as_ptr().add(lane).cast());
                let mut c2 = _mm512_set1_epi64(tail[0] as i64);
                let mut c3 = _mm512_set1_epi64(tail[1] as i64);
                let m0 = _mm512_set1_epi64(MULTIPLIER_0 as i64);
                let m1 = _mm512_set1_epi64(MULTIPLIER_1 as i64);
                let [mut k0, mut k1] = key;
                for _ in 0..ROUNDS {
                    let (p0, p1) = (_mm512_mul_epu32(c0, m0), _mm512_mul_epu32(c2, m1));
                    let h0 = _mm512_shuffle_epi32::<0xF5>(p0);
                    let h1 = _mm512_shuffle_epi32::<0xF5>(p1);
                    let (s0, s1) = (_mm512_set1_epi64(k0.into()), _mm512_set1_epi64(k1.into()));
                    c0 = _mm512_ternarylogic_epi64::<0x96>(h1, c1, s0);
                    c2 = _mm512_ternarylogic_epi64::<0x96>(h0, c3, s1);
                    (c1, c3) = (p1, p0);
                    k0 = k0.wrapping_add(WEYL_0);
                    k1 = k1.wrapping_add(WEYL_1);
                }
                for (words, drawn) in words.iter_mut().zip([c0, c1, c2, c3]) {
                    let to = words.as_mut_ptr().add(lane).cast();
                    _mm256_storeu_si256(to, _mm512_cvtepi64_epi32(drawn));
                }
            }
        }
    }
    #[inline(always)]
    fn repeated(numbers: &[u32; 2 * LANES]) -> u32 {
        unsafe {
            let all = _mm512_loadu_si512(numbers.as_ptr().cast());
            let before = _mm512_conflict_epi32(all);
            u32::from(_mm512_test_epi32_mask(before, before))
        }
    }
}

/// That quarter of each register.
#[inline(always)]
unsafe fn quarter<const N: i32>([a, b, c, d]: [__m512; 4]) -> [__m128; 4] {
    // SAFETY: the machine has the instructions.
    unsafe {
        [
            _mm512_extractf32x4_ps::<N>(a),
            _mm512_extractf32x4_ps::<N>(b),
            _mm512_extractf32x4_ps::<N>(c),
            _mm512_extractf32x4_ps::<N>(d),
        ]
    }
}

/// Two records in each register: 0 and 2, 1 and 3, 4 and 6, 5 and 7.
#[inline(always)]
unsafe fn twos(columns: [Avx512; 4]) -> [__m512d; 4] {
    let [x, y, z, last] = columns.map(|column| column.0);
    // SAFETY: the machine has the instructions.
    unsafe {
        // x0 y0 x2 y2 .. and z0 w0 z2 w2 ..; then the odd ones.
        let (t0, t1) = (_mm512_unpacklo_pd(x, y), _mm512_unpackhi_pd(x, y));
        let (u0, u1) = (_mm512_unpacklo_pd(z, last), _mm512_unpackhi_pd(z, last));
        let low = _mm512_setr_epi64(0, 1, 8, 9, 2, 3, 10, 11);
        let high = _mm512_setr_epi64(4, 5, 12, 13, 6, 7, 14, 15);
        [
            _mm512_permutex2var_pd(t0, low, u0),
            _mm512_permutex2var_pd(t1, low, u1),
            _mm512_permutex2var_pd(t0, high, u0),
            _mm512_permutex2var_pd(t1, high, u1),
        ]
    }
}

/// The records of every fourth slot from that one on, so that their columns come out in order.
#[inline(always)]
unsafe fn four(base: *const [f32; 4], slots: *const u32, first: usize) -> __m512 {
    // SAFETY: the machine has the instructions, pointers are the caller's.
    unsafe {
        let all = _mm512_castps128_ps512(record(base, slots.add(first)));
        let all = _mm512_insertf32x4::<1>(all, record(base, slots.add(first + 4)));
        let all = _mm512_insertf32x4::<2>(all, record(base, slots.add(first + 8)));
        _mm512_insertf32x4::<3>(all, record(base, slots.add(first + 12)))
    }
}

/// Both records of a slot and of the fourth behind it.
#[inline(always)]
unsafe fn eights(base: *const [[f32; 4]; 2], slots: *const u32) -> __m512 {
    // SAFETY: the machine has the instructions, pointers are the caller's.
    unsafe {
        let at = |k: usize| _mm256_loadu_ps(base.add(slot(slots, k)).cast());
        let low = _mm512_castps_pd(_mm512_castps256_ps512(at(0)));
        _mm512_castpd_ps(_mm512_insertf64x4::<1>(low, _mm256_castps_pd(at(4))))
    }
}

/// The columns of eight pairs of records: x0 .. x3, those of the second records, x4 .. x7, and so on.
#[inline(always)]
unsafe fn eight_twice(base: *const [[f32; 4]; 2], slots: *const u32) -> [__m512; 4] {
    // SAFETY: the machine has the instructions, pointers are the caller's.
    unsafe {
        transposed([
            eights(base, slots),
            eights(base, slots.add(1)),
            eights(base, slots.add(2)),
            eights(base, slots.add(3)),
        ])
    }
}

/// The second N numbers of a register where the bits are set, the first ones elsewhere.
#[inline(always)]
unsafe fn spread<const N: usize>(both: __m512, keep: u32) -> [Single; N] {
    // SAFETY: the machine has the instructions.
    unsafe {
        let mut place = _mm512_maskz_mov_epi32(keep as u16, _mm512_set1_epi32(N as i32));
        let mut columns = [Single(both); N];
        for column in &mut columns {
            *column = Single(_mm512_permutexvar_ps(place, both));
            place = _mm512_add_epi32(place, _mm512_set1_epi32(1));
        }
        columns
    }
}

/// Four by four numbers within each quarter of the registers.
#[inline(always)]
unsafe fn transposed(rows: [__m512; 4]) -> [__m512; 4] {
    let [a, b, c, d] = rows;
    // SAFETY: the machine has the instructions.
    unsafe {
        let t0 = _mm512_castps_pd(_mm512_unpacklo_ps(a, b));
        let t1 = _mm512_castps_pd(_mm512_unpackhi_ps(a, b));
        let t2 = _mm512_castps_pd(_mm512_unpacklo_ps(c, d));
        let t3 = _mm512_castps_pd(_mm512_unpackhi_ps(c, d));
        [
            _mm512_castpd_ps(_mm512_unpacklo_pd(t0, t2)),
            _mm512_castpd_ps(_mm512_unpackhi_pd(t0, t2)),
            _mm512_castpd_ps(_mm512_unpacklo_pd(t1, t3)),
            _mm512_castpd_ps(_mm512_unpackhi_pd(t1, t3)),
        ]
    }
}

#[allow(clippy::undocumented_unsafe_blocks)]
impl Vector for Single {
    type Number = f32;
    const LANES: usize = 16;
    lane_by_lane!(
        _mm512_set1_ps,
        _mm512_add_ps,
        _mm512_sub_ps,
        _mm512_mul_ps,
        _mm512_fnmadd_ps,
        _mm512_fmadd_ps,
        [0]
    );
    #[inline(always)]
    unsafe fn load(from: *const f32) -> Self {
        unsafe { Self(_mm512_loadu_ps(from)) }
    }
    #[inline(always)]
    unsafe fn store(self, to: *mut f32) {
        unsafe { _mm512_storeu_ps(to, self.0) }
    }
    #[inline(always)]
    fn below(self, other: Self) -> u32 {
        unsafe { u32::from(_mm512_cmp_ps_mask::<_CMP_LT_OQ>(self.0, other.0)) }
    }
    #[inline(always)]
    unsafe fn columns(base: *const [f32; 4], slots: *const u32) -> [Self; 4] {
        unsafe {
            let fours = [
                four(base, slots, 0),
                four(base, slots, 1),
                four(base, slots, 2),
                four(base, slots, 3),
            ];
            let [x, y, z, last] = transposed(fours);
            [Self(x), Self(y), Self(z), Self(last)]
        }
    }
    #[inline(always)]
    unsafe fn columns_twice(base: *const [[f32; 4]; 2], slots: *const u32) -> [[Self; 4]; 2] {
        unsafe {
            let (low, high) = (
                eight_twice(base, slots),
                eight_twice(base, slots.add(LANES)),
            );
            let mut columns = [[Self(low[0]); 4]; 2];
            for a in 0..4 {
                columns[0][a] = Self(_mm512_shuffle_f32x4::<0x88>(low[a], high[a]));
                columns[1][a] = Self(_mm512_shuffle_f32x4::<0xDD>(low[a], high[a]));
            }
            columns
        }
    }
    #[inline(always)]
    unsafe fn of_two_twice([set, unset]: [*const [[f32; 4]; 2]; 2], keep: u32) -> [[Self; 4]; 2] {
        unsafe {
            let both = _mm512_castps_pd(_mm512_castps256_ps512(_mm256_loadu_ps(unset.cast())));
            let set = _mm256_castps_pd(_mm256_loadu_ps(set.cast()));
            let both = _mm512_castpd_ps(_mm512_insertf64x4::<1>(both, set));
            let [a, b, c, d, e, f, g, h] = spread(both, keep);
            [[a, b, c, d], [e, f, g, h]]
        }
    }
    #[inline(always)]
    unsafe fn take(columns: [Self; 3], from: *mut [f64; 4], slots: *const u32) {
        unsafe {
            let [x, y, z] = columns.map(|column| column.0);
            let fours = transposed([x, y, z, _mm512_setzero_ps()]);
            take_four(quarter::<0>(fours), from, slots);
            take_four(quarter::<1>(fours), from, slots.add(4));
            take_four(quarter::<2>(fours), from, slots.add(8));
            take_four(quarter::<3>(fours), from, slots.add(12));
        }
    }
    #[inline(always)]
    unsafe fn store_kept(self, keep: u32, to: *mut f32) {
        unsafe { _mm512_storeu_ps(to, _mm512_maskz_compress_ps(keep as u16, self.0)) }
    }
    #[inline(always)]
    fn where_set(self, keep: u32, other: Self) -> Self {
        unsafe { Self(_mm512_mask_mov_ps(other.0, keep as u16, self.0)) }
    }
    #[inline(always)]
    unsafe fn store_either(keep: u32, [set, unset]: [u32; 2], to: *mut u32) {
        unsafe {
            let (set, unset) = (
                _mm512_set1_epi32(set as i32),
                _mm512_set1_epi32(unset as i32),
            );
            let words = _mm512_mask_mov_epi32(unset, keep as u16, set);
            _mm512_storeu_si512(to.cast(), words);
        }
    }
    #[inline(always)]
    unsafe fn of_two([set, unset]: [*const [f32; 4]; 2], keep: u32) -> [Self; 4] {
        unsafe {
            let both = _mm512_castps256_ps512(_mm256_set_m128(
                _mm_loadu_ps(set.cast()),
                _mm_loadu_ps(unset.cast()),
            ));
            spread(both, keep)
        }
    }
}

#[allow(clippy::undocumented_unsafe_blocks)]
impl Turning for Single {
    #[inline(always)]
    unsafe fn quad(from: *const f32) -> Self {
        unsafe { Self(_mm512_broadcast_f32x4(_mm_loadu_ps(from))) }
    }
    #[inline(always)]
    unsafe fn each(from: *const f32) -> Self {
        unsafe {
            let places = _mm512_setr_epi32(0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3);
            Self(_mm512_permutexvar_ps(places, Self::quad(from).0))
        }
    }
    #[inline(always)]
    unsafe fn add_quarters(self, to: *mut f64) {
        unsafe {
            let low = _mm512_castps512_ps256(self.0);
            add_halves(_mm256_add_ps(low, _mm512_extractf32x8_ps::<1>(self.0)), to);
        }
    }
    #[inline(always)]
    fn turned_from(self, other: Self) -> Self {
        unsafe {
            let (to, from) = (_mm512_castps_si512(self.0), _mm512_castps_si512(other.0));
            Self(_mm512_cvtepi32_ps(_mm512_sub_epi32(to, from)))
        }
    }
}
