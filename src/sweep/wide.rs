//! The widest vector instructions this machine has, chosen at run time. No sum is reordered. AVX2 and
//! AVX-512 give the same bits; without them products are rounded before they are added, so results
//! differ in the last place.
//!
//! Most of a sweep is plain loops over small arrays, which the compiler turns into vector
//! instructions by itself. What it does not find are the moves between records of particles and
//! lanes of pairs: [`Wide`] names these few, eight lanes at a time.

use std::sync::OnceLock;

use crate::error::{Error, Result};
use crate::random::{Arithmetic, Plain};

/// Lanes of a [`Wide`] value.
pub const LANES: usize = 8;

/// A piece of work whose `run` is inlined into a function compiled for wide vectors.
pub trait Task {
    /// What it returns.
    type Output;
    /// Does the work; implementations must be `#[inline(always)]`.
    fn run<W: Wide>(self) -> Self::Output;
}

/// Eight numbers, and how they get in and out of memory.
///
/// # Safety
/// Pointers must be good for the eight numbers or records that are named, `slots` lead to records
/// behind `base`, and the machine must have the instructions.
pub trait Wide: Copy {
    /// Of plain numbers in the same loop.
    type Arithmetic: Arithmetic;
    /// All lanes alike.
    fn splat(x: f64) -> Self;
    /// From eight numbers.
    ///
    /// # Safety
    /// See the trait.
    unsafe fn load(from: *const f64) -> Self;
    /// To eight numbers.
    ///
    /// # Safety
    /// See the trait.
    unsafe fn store(self, to: *mut f64);
    /// Lane by lane.
    fn plus(self, other: Self) -> Self;
    /// Lane by lane.
    fn minus(self, other: Self) -> Self;
    /// Lane by lane.
    fn times(self, other: Self) -> Self;
    /// self - a b.
    fn less_product(self, a: Self, b: Self) -> Self;
    /// self + a b.
    fn plus_product(self, a: Self, b: Self) -> Self;
    /// Bit k is set where lane k is below that of `other`.
    fn below(self, other: Self) -> u8;
    /// The four columns of eight records.
    ///
    /// # Safety
    /// See the trait.
    unsafe fn columns(base: *const [f64; 4], slots: &[u32; LANES]) -> [Self; 4];
    /// The inverse: eight records in a row.
    ///
    /// # Safety
    /// See the trait.
    unsafe fn records(columns: [Self; 4], to: *mut [f64; 4]);
    /// Stores the lanes whose bits are set one behind the other, and then anything: eight in all.
    ///
    /// # Safety
    /// See the trait.
    unsafe fn store_kept(self, keep: u8, to: *mut f64);
    /// Numbers of the lanes whose bits are set, one behind the other; then anything.
    fn kept(numbers: [u16; LANES], keep: u8) -> [u16; LANES];
    /// Bit k is set where number k is one of those before it.
    #[inline(always)]
    fn repeated(numbers: &[u32; 2 * LANES]) -> u32 {
        const N: usize = 2 * LANES;
        let mut padded = [u32::MAX; 2 * N]; // slots are below that
        padded[N..].copy_from_slice(numbers);
        let mut known = [0_u32; N];
        for back in 1..N {
            for n in 0..N {
                known[n] |= u32::from(padded[N + n] == padded[N + n - back]);
            }
        }
        (0..N).fold(0, |bits, n| bits | known[n] << n)
    }
}

/// The lanes whose bits are set, in ascending order; then zeros.
const KEPT: [[u16; LANES]; 256] = {
    let mut table = [[0; LANES]; 256];
    let mut mask = 0;
    while mask < 256 {
        let (mut lane, mut at) = (0, 0);
        while lane < LANES {
            if mask >> lane & 1 == 1 {
                table[mask][at] = lane as u16;
                at += 1;
            }
            lane += 1;
        }
        mask += 1;
    }
    table
};

/// Numbers `first`, `first` + 1 .. of the lanes whose bits are set, one behind the other; then
/// anything.
#[inline(always)]
pub(crate) fn kept_of_range(first: u16, keep: u8) -> [u16; LANES] {
    KEPT[keep as usize].map(|lane| first.wrapping_add(lane))
}

/// Without any particular instructions.
#[derive(Clone, Copy)]
pub struct Portable([f64; LANES]);

impl Portable {
    #[inline(always)]
    fn zip(self, other: Self, f: impl Fn(f64, f64) -> f64) -> Self {
        Self(std::array::from_fn(|k| f(self.0[k], other.0[k])))
    }
}

impl Wide for Portable {
    type Arithmetic = Plain;
    #[inline(always)]
    fn splat(x: f64) -> Self {
        Self([x; LANES])
    }
    #[inline(always)]
    unsafe fn load(from: *const f64) -> Self {
        // SAFETY: promised by the caller.
        Self(unsafe { from.cast::<[f64; LANES]>().read_unaligned() })
    }
    #[inline(always)]
    unsafe fn store(self, to: *mut f64) {
        // SAFETY: promised by the caller.
        unsafe { to.cast::<[f64; LANES]>().write_unaligned(self.0) }
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
    fn below(self, other: Self) -> u8 {
        (0..LANES).fold(0, |bits, k| bits | u8::from(self.0[k] < other.0[k]) << k)
    }
    #[inline(always)]
    unsafe fn columns(base: *const [f64; 4], slots: &[u32; LANES]) -> [Self; 4] {
        // SAFETY: promised by the caller.
        let records = slots.map(|slot| unsafe { *base.add(slot as usize) });
        std::array::from_fn(|a| Self(records.map(|record| record[a])))
    }
    #[inline(always)]
    unsafe fn records(columns: [Self; 4], to: *mut [f64; 4]) {
        let [x, y, z, last] = columns.map(|column| column.0);
        for k in 0..LANES {
            // SAFETY: promised by the caller.
            unsafe { *to.add(k) = [x[k], y[k], z[k], last[k]] };
        }
    }
    #[inline(always)]
    unsafe fn store_kept(self, keep: u8, to: *mut f64) {
        let kept = KEPT[keep as usize].map(|lane| self.0[lane as usize]);
        // SAFETY: promised by the caller.
        unsafe { Self(kept).store(to) }
    }
    #[inline(always)]
    fn kept(numbers: [u16; LANES], keep: u8) -> [u16; LANES] {
        KEPT[keep as usize].map(|lane| numbers[lane as usize])
    }
}

#[cfg(target_arch = "x86_64")]
mod x86 {
    use std::arch::x86_64::*;

    use super::{KEPT, LANES, Wide};
    use crate::random::Fused;

    /// Two halves of four lanes.
    #[derive(Clone, Copy)]
    pub struct Avx2(__m256d, __m256d);

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

    /// Bytes of the 16-bit lanes whose bits are set.
    const BYTES: [[u8; 16]; 256] = {
        let mut table = [[0; 16]; 256];
        let mut mask = 0;
        while mask < 256 {
            let mut at = 0;
            while at < LANES {
                let lane = KEPT[mask][at] as u8;
                table[mask][2 * at] = 2 * lane;
                table[mask][2 * at + 1] = 2 * lane + 1;
                at += 1;
            }
            mask += 1;
        }
        table
    };

    #[inline(always)]
    fn kept(numbers: [u16; LANES], keep: u8) -> [u16; LANES] {
        // SAFETY: the machine has the instructions; 16 bytes are read.
        unsafe {
            let bytes = _mm_loadu_si128(BYTES[keep as usize].as_ptr().cast());
            let numbers = _mm_loadu_si128(numbers.as_ptr().cast());
            std::mem::transmute(_mm_shuffle_epi8(numbers, bytes))
        }
    }

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
    impl Wide for Avx2 {
        type Arithmetic = Fused;
        #[inline(always)]
        fn splat(x: f64) -> Self {
            let half = unsafe { _mm256_set1_pd(x) };
            Self(half, half)
        }
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
        fn plus(self, other: Self) -> Self {
            unsafe {
                Self(
                    _mm256_add_pd(self.0, other.0),
                    _mm256_add_pd(self.1, other.1),
                )
            }
        }
        #[inline(always)]
        fn minus(self, other: Self) -> Self {
            unsafe {
                Self(
                    _mm256_sub_pd(self.0, other.0),
                    _mm256_sub_pd(self.1, other.1),
                )
            }
        }
        #[inline(always)]
        fn times(self, other: Self) -> Self {
            unsafe {
                Self(
                    _mm256_mul_pd(self.0, other.0),
                    _mm256_mul_pd(self.1, other.1),
                )
            }
        }
        #[inline(always)]
        fn less_product(self, a: Self, b: Self) -> Self {
            unsafe {
                Self(
                    _mm256_fnmadd_pd(a.0, b.0, self.0),
                    _mm256_fnmadd_pd(a.1, b.1, self.1),
                )
            }
        }
        #[inline(always)]
        fn plus_product(self, a: Self, b: Self) -> Self {
            unsafe {
                Self(
                    _mm256_fmadd_pd(a.0, b.0, self.0),
                    _mm256_fmadd_pd(a.1, b.1, self.1),
                )
            }
        }
        #[inline(always)]
        fn below(self, other: Self) -> u8 {
            unsafe {
                let low = _mm256_movemask_pd(_mm256_cmp_pd::<_CMP_LT_OQ>(self.0, other.0));
                let high = _mm256_movemask_pd(_mm256_cmp_pd::<_CMP_LT_OQ>(self.1, other.1));
                (low | high << 4) as u8
            }
        }
        #[inline(always)]
        unsafe fn columns(base: *const [f64; 4], slots: &[u32; LANES]) -> [Self; 4] {
            unsafe {
                let at = |k: usize| _mm256_loadu_pd(base.add(slots[k] as usize).cast());
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
        unsafe fn records(columns: [Self; 4], to: *mut [f64; 4]) {
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
        unsafe fn store_kept(self, keep: u8, to: *mut f64) {
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
        fn kept(numbers: [u16; LANES], keep: u8) -> [u16; LANES] {
            kept(numbers, keep)
        }
    }

    /// One register of eight lanes.
    #[derive(Clone, Copy)]
    pub struct Avx512(__m512d);

    // SAFETY of all blocks below: the machine has the instructions, pointers are the caller's.
    #[allow(clippy::undocumented_unsafe_blocks)]
    impl Wide for Avx512 {
        type Arithmetic = Fused;
        #[inline(always)]
        fn splat(x: f64) -> Self {
            unsafe { Self(_mm512_set1_pd(x)) }
        }
        #[inline(always)]
        unsafe fn load(from: *const f64) -> Self {
            unsafe { Self(_mm512_loadu_pd(from)) }
        }
        #[inline(always)]
        unsafe fn store(self, to: *mut f64) {
            unsafe { _mm512_storeu_pd(to, self.0) }
        }
        #[inline(always)]
        fn plus(self, other: Self) -> Self {
            unsafe { Self(_mm512_add_pd(self.0, other.0)) }
        }
        #[inline(always)]
        fn minus(self, other: Self) -> Self {
            unsafe { Self(_mm512_sub_pd(self.0, other.0)) }
        }
        #[inline(always)]
        fn times(self, other: Self) -> Self {
            unsafe { Self(_mm512_mul_pd(self.0, other.0)) }
        }
        #[inline(always)]
        fn less_product(self, a: Self, b: Self) -> Self {
            unsafe { Self(_mm512_fnmadd_pd(a.0, b.0, self.0)) }
        }
        #[inline(always)]
        fn plus_product(self, a: Self, b: Self) -> Self {
            unsafe { Self(_mm512_fmadd_pd(a.0, b.0, self.0)) }
        }
        #[inline(always)]
        fn below(self, other: Self) -> u8 {
            unsafe { _mm512_cmp_pd_mask::<_CMP_LT_OQ>(self.0, other.0) }
        }
        #[inline(always)]
        unsafe fn columns(base: *const [f64; 4], slots: &[u32; LANES]) -> [Self; 4] {
            unsafe {
                let at = |k: usize| _mm256_loadu_pd(base.add(slots[k] as usize).cast());
                let two = |p: usize, q: usize| {
                    _mm512_insertf64x4::<1>(_mm512_castpd256_pd512(at(p)), at(q))
                };
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
        unsafe fn records(columns: [Self; 4], to: *mut [f64; 4]) {
            unsafe {
                let [x, y, z, last] = columns.map(|column| column.0);
                // x0 y0 x2 y2 .. and z0 w0 z2 w2 ..; then the odd ones.
                let (t0, t1) = (_mm512_unpacklo_pd(x, y), _mm512_unpackhi_pd(x, y));
                let (u0, u1) = (_mm512_unpacklo_pd(z, last), _mm512_unpackhi_pd(z, last));
                let low = _mm512_setr_epi64(0, 1, 8, 9, 2, 3, 10, 11);
                let high = _mm512_setr_epi64(4, 5, 12, 13, 6, 7, 14, 15);
                let pairs = [
                    _mm512_permutex2var_pd(t0, low, u0),
                    _mm512_permutex2var_pd(t1, low, u1),
                    _mm512_permutex2var_pd(t0, high, u0),
                    _mm512_permutex2var_pd(t1, high, u1),
                ];
                for (pair, first) in pairs.into_iter().zip([0, 1, 4, 5]) {
                    _mm256_storeu_pd(to.add(first).cast(), _mm512_castpd512_pd256(pair));
                    let second = _mm512_extractf64x4_pd::<1>(pair);
                    _mm256_storeu_pd(to.add(first + 2).cast(), second);
                }
            }
        }
        #[inline(always)]
        unsafe fn store_kept(self, keep: u8, to: *mut f64) {
            unsafe { _mm512_storeu_pd(to, _mm512_maskz_compress_pd(keep, self.0)) }
        }
        #[inline(always)]
        fn repeated(numbers: &[u32; 2 * LANES]) -> u32 {
            unsafe {
                let all = _mm512_loadu_si512(numbers.as_ptr().cast());
                let before = _mm512_conflict_epi32(all);
                u32::from(_mm512_test_epi32_mask(before, before))
            }
        }
        #[inline(always)]
        fn kept(numbers: [u16; LANES], keep: u8) -> [u16; LANES] {
            kept(numbers, keep)
        }
    }
}

/// Vector instructions that the loops are compiled for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Instructions {
    /// What every machine of the kind has.
    Portable,
    /// AVX2 with FMA, BMI2 and POPCNT.
    #[cfg(target_arch = "x86_64")]
    Avx2,
    /// AVX-512 F, VL, DQ, BW, CD.
    #[cfg(target_arch = "x86_64")]
    Avx512,
}

impl Instructions {
    /// Their name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Portable => "portable",
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 => "avx2",
            #[cfg(target_arch = "x86_64")]
            Self::Avx512 => "avx512",
        }
    }

    /// The widest ones of this machine, or less where the environment asks for it:
    /// `SDPD_INSTRUCTIONS` = portable, avx2 or avx512, read once. The widest, too, where it asks for
    /// others: see `check`.
    pub fn chosen() -> Self {
        static CHOSEN: OnceLock<Instructions> = OnceLock::new();
        *CHOSEN.get_or_init(|| {
            let (wish, all) = (wish(), Self::available());
            let wished = all.iter().find(|found| found.name() == wish);
            *wished.unwrap_or(&all[0])
        })
    }

    /// Objects to a wish for instructions that this machine has not.
    pub fn check() -> Result<()> {
        let (wish, all) = (wish(), Self::available());
        let names: Vec<&str> = all.iter().map(|found| found.name()).collect();
        if wish.is_empty() || names.contains(&wish.as_str()) {
            return Ok(());
        }
        Err(Error::Invalid(format!(
            "`SDPD_INSTRUCTIONS` in the environment must be one of {names:?} on this machine, got {wish:?}"
        )))
    }

    /// Those of this machine, widest first.
    pub fn available() -> Vec<Self> {
        #[allow(unused_mut)]
        let mut found = vec![Self::Portable];
        #[cfg(target_arch = "x86_64")]
        {
            let avx2 = std::is_x86_feature_detected!("avx2")
                && std::is_x86_feature_detected!("fma")
                && std::is_x86_feature_detected!("bmi2")
                && std::is_x86_feature_detected!("popcnt");
            let avx512 = std::is_x86_feature_detected!("avx512f")
                && std::is_x86_feature_detected!("avx512vl")
                && std::is_x86_feature_detected!("avx512dq")
                && std::is_x86_feature_detected!("avx512bw")
                && std::is_x86_feature_detected!("avx512cd");
            if avx2 {
                found.insert(0, Self::Avx2);
            }
            if avx2 && avx512 {
                found.insert(0, Self::Avx512);
            }
        }
        found
    }
}

fn wish() -> String {
    std::env::var("SDPD_INSTRUCTIONS").unwrap_or_default()
}

/// Runs a task with the widest instructions there are.
#[inline]
pub fn run_wide<T: Task>(task: T) -> T::Output {
    #[cfg(target_arch = "x86_64")]
    {
        #[target_feature(
            enable = "avx512f,avx512vl,avx512dq,avx512bw,avx512cd,avx2,fma,bmi2,popcnt"
        )]
        fn with_avx512<T: Task>(task: T) -> T::Output {
            task.run::<x86::Avx512>()
        }
        #[target_feature(enable = "avx2,fma,bmi2,popcnt")]
        fn with_avx2<T: Task>(task: T) -> T::Output {
            task.run::<x86::Avx2>()
        }
        match Instructions::chosen() {
            // SAFETY: the features were detected.
            Instructions::Avx512 => return unsafe { with_avx512(task) },
            // SAFETY: the features were detected.
            Instructions::Avx2 => return unsafe { with_avx2(task) },
            Instructions::Portable => {}
        }
    }
    task.run::<Portable>()
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Moves;

    impl Task for Moves {
        type Output = Vec<f64>;
        #[inline(always)]
        fn run<W: Wide>(self) -> Vec<f64> {
            let records: Vec<[f64; 4]> = (0..40)
                .map(|k| std::array::from_fn(|a| f64::from(4 * k + a as i32)))
                .collect();
            let slots = [3_u16, 17, 39, 0, 5, 5, 21, 8];
            let mut out = Vec::new();
            let mut eight = [0.0; LANES];
            // SAFETY: all slots are below 40, all targets hold eight.
            unsafe {
                let columns = W::columns(records.as_ptr(), &slots.map(u32::from));
                for column in columns {
                    column.store(eight.as_mut_ptr());
                    out.extend(eight);
                }
                let mut back = [[9.0; 4]; LANES];
                W::records(columns, back.as_mut_ptr());
                out.extend(back.concat());
                let limit = W::splat(40.0);
                for keep in [columns[0].below(limit), 0, 255, 0b0110_1001, 1, 128] {
                    let kept = W::kept(slots, keep);
                    let range = kept_of_range(7, keep);
                    columns[1].store_kept(keep, eight.as_mut_ptr());
                    let lanes = (0..LANES).filter(|lane| keep >> lane & 1 == 1);
                    for (k, lane) in lanes.enumerate() {
                        assert_eq!(kept[k], slots[lane]);
                        assert_eq!(range[k], 7 + lane as u16);
                        assert_eq!(eight[k], records[slots[lane] as usize][1]);
                    }
                    out.push(f64::from(keep));
                }
                let numbers = [4, 1, 9, 4, 7, 7, 0, 2, 1, 3, 5, 6, 8, 10, 11, 7];
                assert_eq!(W::repeated(&numbers), 0b1000_0001_0010_1000);
                let two = W::load(out.as_ptr());
                let sum = two.times(limit).plus(two).minus(limit);
                // exact in these small integers, fused or not
                let sum = sum.plus_product(two, limit).less_product(two, two);
                sum.store(eight.as_mut_ptr());
                out.extend(eight);
            }
            out
        }
    }

    #[test]
    fn all_instructions_move_alike() {
        let plain = Moves.run::<Portable>();
        assert_eq!(plain[..3], [12.0, 68.0, 156.0]);
        assert_eq!(plain[32..36], [12.0, 13.0, 14.0, 15.0]);
        assert_eq!(run_wide(Moves), plain);
        #[cfg(target_arch = "x86_64")]
        if Instructions::available().contains(&Instructions::Avx2) {
            // SAFETY: the features were detected.
            assert_eq!(Moves.run::<x86::Avx2>(), plain);
        }
        assert!(Instructions::available().contains(&Instructions::chosen()));
    }
}
