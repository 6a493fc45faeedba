//! The widest vector instructions this machine has, chosen at run time. No sum is reordered. AVX2 and
//! AVX-512 give the same bits; without them products are rounded before they are added, so results
//! differ in the last place.
//!
//! Most of a sweep is plain loops over small arrays, which the compiler turns into vector
//! instructions by itself. What it does not find are the moves between records of particles and
//! lanes of pairs: [`Vector`] names these few, eight lanes at a time in double and sixteen in single
//! precision.

/// The operations lane by lane, by the intrinsics of a register; of all the fields of a type.
#[cfg(target_arch = "x86_64")]
macro_rules! lane_by_lane {
    ($set:ident, $add:ident, $sub:ident, $mul:ident, $less:ident, $more:ident, [$($field:tt),+]) => {
        #[inline(always)]
        fn splat(x: Self::Number) -> Self {
            let all = unsafe { $set(x) };
            Self($({ let _ = $field; all }),+)
        }
        lane_by_lane!(@two plus $add [$($field),+]);
        lane_by_lane!(@two minus $sub [$($field),+]);
        lane_by_lane!(@two times $mul [$($field),+]);
        lane_by_lane!(@three less_product $less [$($field),+]);
        lane_by_lane!(@three plus_product $more [$($field),+]);
    };
    (@two $name:ident $intrinsic:ident [$($field:tt),+]) => {
        #[inline(always)]
        fn $name(self, other: Self) -> Self {
            unsafe { Self($($intrinsic(self.$field, other.$field)),+) }
        }
    };
    (@three $name:ident $intrinsic:ident [$($field:tt),+]) => {
        #[inline(always)]
        fn $name(self, a: Self, b: Self) -> Self {
            unsafe { Self($($intrinsic(a.$field, b.$field, self.$field)),+) }
        }
    };
}

#[cfg(target_arch = "x86_64")]
mod avx2;
#[cfg(target_arch = "x86_64")]
mod avx512;
mod portable;

use std::sync::OnceLock;

use crate::error::{Error, Result};
use crate::random::philox4x32_lanes;
use crate::real::Arithmetic;

#[cfg(target_arch = "x86_64")]
use avx2::Avx2;
#[cfg(target_arch = "x86_64")]
use avx512::Avx512;
use portable::Portable;

/// Lanes of a [`Wide`] value.
pub const LANES: usize = 8;

/// A piece of work whose `run` is inlined into a function compiled for wide vectors.
pub trait Task {
    /// What it returns.
    type Output;
    /// Does the work; implementations must be `#[inline(always)]`.
    fn run<W: Wide>(self) -> Self::Output;
}

/// Numbers in a register or two, and how they get in and out of memory.
///
/// # Safety
/// Pointers must be good for as many numbers, records or slots as there are lanes, `slots` lead to
/// records behind `base`, and the machine must have the instructions.
pub trait Vector: Copy {
    /// What is in a lane.
    type Number: Copy;
    /// Number of lanes, a multiple of [`LANES`].
    const LANES: usize;
    /// All lanes alike.
    fn splat(x: Self::Number) -> Self;
    /// From numbers in a row.
    ///
    /// # Safety
    /// See the trait.
    unsafe fn load(from: *const Self::Number) -> Self;
    /// To numbers in a row.
    ///
    /// # Safety
    /// See the trait.
    unsafe fn store(self, to: *mut Self::Number);
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
    fn below(self, other: Self) -> u32;
    /// The four columns of the records of some slots.
    ///
    /// # Safety
    /// See the trait.
    unsafe fn columns(base: *const [Self::Number; 4], slots: *const u32) -> [Self; 4];
    /// The columns of the records of some slots, of which each has two side by side.
    ///
    /// # Safety
    /// See the trait.
    #[inline(always)]
    unsafe fn columns_twice(
        base: *const [[Self::Number; 4]; 2],
        slots: *const u32,
    ) -> [[Self; 4]; 2] {
        const ALL: [u32; 2 * LANES] = [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15];
        // SAFETY: promised by the caller.
        unsafe {
            let mut halves = [[*base.cast(); 2 * LANES]; 2];
            for lane in 0..Self::LANES {
                let [first, second] = *base.add(*slots.add(lane) as usize);
                (halves[0][lane], halves[1][lane]) = (first, second);
            }
            halves.map(|records| Self::columns(records.as_ptr(), ALL.as_ptr()))
        }
    }
    /// Takes the lanes of three columns from the first three numbers of the records of some slots, in
    /// double precision and one lane after the other: two may have the same slot. The fourth number may be
    /// written as well, as it is.
    ///
    /// # Safety
    /// See the trait.
    unsafe fn take(columns: [Self; 3], from: *mut [f64; 4], slots: *const u32);
    /// Stores the lanes whose bits are set one behind the other, and then anything: as many in all as
    /// there are lanes.
    ///
    /// # Safety
    /// See the trait.
    unsafe fn store_kept(self, keep: u32, to: *mut Self::Number);
    /// These lanes where the bits are set, those of `other` elsewhere.
    fn where_set(self, keep: u32, other: Self) -> Self;
    /// Stores a word for each lane, the first of the two where the bits are set.
    ///
    /// # Safety
    /// See the trait.
    unsafe fn store_either(keep: u32, words: [u32; 2], to: *mut u32);
    /// The four columns of the first record where the bits are set, of the second one elsewhere.
    ///
    /// # Safety
    /// There are two records; for the rest see the trait.
    #[inline(always)]
    unsafe fn of_two(records: [*const [Self::Number; 4]; 2], keep: u32) -> [Self; 4] {
        // SAFETY: promised by the caller.
        let [set, unset] = unsafe { [*records[0], *records[1]] };
        let mut columns = [Self::splat(set[0]); 4];
        for a in 0..4 {
            columns[a] = Self::splat(set[a]).where_set(keep, Self::splat(unset[a]));
        }
        columns
    }
    /// The same of two records side by side.
    ///
    /// # Safety
    /// See `of_two`.
    #[inline(always)]
    unsafe fn of_two_twice(
        records: [*const [[Self::Number; 4]; 2]; 2],
        keep: u32,
    ) -> [[Self; 4]; 2] {
        let [set, unset] = records.map(|record| record.cast::<[Self::Number; 4]>());
        // SAFETY: promised by the caller.
        unsafe {
            [
                Self::of_two([set, unset], keep),
                Self::of_two([set.add(1), unset.add(1)], keep),
            ]
        }
    }
}

/// Numbers that may as well be fractions of a turn, in units of 2^-32.
pub trait Turning: Vector {
    /// The shortest way from the angles `other` to these, as numbers.
    fn turned_from(self, other: Self) -> Self;
    /// Four numbers, and again, four times.
    ///
    /// # Safety
    /// There are four.
    unsafe fn quad(from: *const f32) -> Self;
    /// Each of four numbers four times.
    ///
    /// # Safety
    /// There are four.
    unsafe fn each(from: *const f32) -> Self;
    /// Adds to number k of four the sum of lanes k, k + 4, k + 8 and k + 12, which is (k + (k + 8)) +
    /// ((k + 4) + (k + 12)) in single precision.
    ///
    /// # Safety
    /// There are four.
    unsafe fn add_quarters(self, to: *mut f64);
}

/// Instructions, named by their eight numbers in double precision.
pub trait Wide: Vector<Number = f64> {
    /// Of plain numbers in the same loop.
    type Arithmetic: Arithmetic;
    /// Sixteen numbers in single precision.
    type Single: Turning<Number = f32>;
    /// The inverse of `columns`: records in a row.
    ///
    /// # Safety
    /// See the trait [`Vector`].
    unsafe fn records(columns: [Self; 4], to: *mut [f64; 4]);
    /// From as many numbers in single precision in a row.
    ///
    /// # Safety
    /// See the trait [`Vector`].
    unsafe fn widened(from: *const f32) -> Self;
    /// The sums of the lanes of four columns, ((0 + 1) + (4 + 5)) + ((2 + 3) + (6 + 7)) each.
    fn sums(columns: [Self; 4]) -> [f64; 4];
    /// Numbers of the lanes whose bits are set, one behind the other; then others of them, or 0.
    fn kept(numbers: [u32; LANES], keep: u8) -> [u32; LANES];
    /// Four words each for counters whose last two words are `tail`: Philox4x32-10. The number of
    /// counters is a multiple of [`LANES`].
    #[inline(always)]
    fn philox<const N: usize>(
        counters: &[[u64; N]; 2],
        tail: [u64; 2],
        key: [u32; 2],
        words: &mut [[u32; N]; 4],
        count: usize,
    ) {
        for lane in 0..count.min(N) {
            let counter = [counters[0][lane], counters[1][lane], tail[0], tail[1]];
            let drawn = philox4x32_lanes(counter, key);
            for n in 0..4 {
                words[n][lane] = drawn[n] as u32;
            }
        }
    }
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

/// The slot of a lane. The volatile read keeps the compiler from loading all slots at once, whose
/// elements it would then have to take out one by one.
///
/// # Safety
/// There is one.
#[cfg(target_arch = "x86_64")]
#[inline(always)]
unsafe fn slot(slots: *const u32, lane: usize) -> usize {
    // SAFETY: promised by the caller.
    unsafe { slots.add(lane).read_volatile() as usize }
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
pub(crate) fn kept_of_range(first: u32, keep: u8) -> [u32; LANES] {
    KEPT[keep as usize].map(|lane| first + u32::from(lane))
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
            task.run::<Avx512>()
        }
        #[target_feature(enable = "avx2,fma,bmi2,popcnt")]
        fn with_avx2<T: Task>(task: T) -> T::Output {
            task.run::<Avx2>()
        }
        match Instructions::chosen() {
            // SAFETY: the features were detected.
            Instructions::Avx512 => return unsafe { with_avx512(task) },
            // SAFETY: the features were detected.
            Instructions::Avx2 => return unsafe { with_avx2(task) },
            Instructions::Portable => {}
        }
    }
    task.run::<Portable<f64, LANES>>()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::real::Real;

    /// Numbers that have been through every move.
    #[inline(always)]
    fn moved<V: Vector<Number = R>, R: Real>() -> Vec<R> {
        let records: Vec<[R; 4]> = (0..40)
            .map(|k| std::array::from_fn(|a| R::of(f64::from(4 * k + a as i32))))
            .collect();
        let slots = [3_u32, 17, 39, 0, 5, 5, 21, 8, 2, 31, 30, 1, 13, 38, 22, 7];
        let mut out = Vec::new();
        let mut lanes = vec![R::ZERO; V::LANES];
        // SAFETY: all slots are below 40, all targets hold a vector.
        unsafe {
            let columns = V::columns(records.as_ptr(), slots.as_ptr());
            for column in columns {
                column.store(lanes.as_mut_ptr());
                out.extend(&lanes);
            }
            let mut back = vec![[1e3; 4]; 40];
            V::take(
                [columns[0], columns[1], columns[2]],
                back.as_mut_ptr(),
                slots.as_ptr(),
            );
            for number in back.concat() {
                out.push(R::of(number));
            }
            let all = (1 << V::LANES) - 1;
            let limit = V::splat(R::of(40.0));
            let below = columns[0].below(limit);
            for keep in [below, 0, all, 0b0101_1010_0110_1001 & all, 1, 128] {
                columns[1].store_kept(keep, lanes.as_mut_ptr());
                let kept = (0..V::LANES).filter(|lane| keep >> lane & 1 == 1);
                for (k, lane) in kept.enumerate() {
                    assert_eq!(lanes[k], records[slots[lane] as usize][1]);
                }
                out.push(R::of(f64::from(keep)));
            }
            let two = V::load(out.as_ptr());
            let sum = two.times(limit).plus(two).minus(limit);
            // exact in these small integers, fused or not
            let sum = sum.plus_product(two, limit).less_product(two, two);
            sum.store(lanes.as_mut_ptr());
            out.extend(&lanes);
            columns[0]
                .where_set(0b0101_1010_0110_1001, sum)
                .store(lanes.as_mut_ptr());
            out.extend(&lanes);
            for column in V::of_two([&records[4], &records[9]], 0b0101_1010_0110_1001) {
                column.store(lanes.as_mut_ptr());
                out.extend(&lanes);
            }
            let twice: Vec<[[R; 4]; 2]> = records
                .iter()
                .map(|&record| [record, record.map(|x| R::of(1000.0) + x)])
                .collect();
            let two = V::of_two_twice([&twice[4], &twice[9]], 0b0101_1010_0110_1001);
            for column in two.concat() {
                column.store(lanes.as_mut_ptr());
                out.extend(&lanes);
            }
            for (half, of_half) in V::columns_twice(twice.as_ptr(), slots.as_ptr())
                .iter()
                .enumerate()
            {
                for (a, column) in of_half.iter().enumerate() {
                    column.store(lanes.as_mut_ptr());
                    for (lane, &slot) in lanes.iter().zip(&slots) {
                        assert_eq!(*lane, twice[slot as usize][half][a]);
                    }
                }
            }
            let mut words = [0; 2 * LANES];
            V::store_either(0b0101_1010_0110_1001, [3, 1 << 30], words.as_mut_ptr());
            out.extend(words.map(|word| R::of(word.into())));
        }
        out
    }

    fn counters() -> [[u64; 24]; 2] {
        [1, 2].map(|n| std::array::from_fn(|k| (n * 77_777 + 1_234_567 * k as u64) & 0xffff_ffff))
    }

    struct Moves;

    impl Task for Moves {
        type Output = (Vec<f64>, Vec<f32>, [[u32; 24]; 4]);
        #[inline(always)]
        fn run<W: Wide>(self) -> Self::Output {
            let numbers = [3_u32, 17, 39, 0, 5, 5, 21, 8];
            for keep in [0, 255, 0b0110_1001, 1, 128] {
                let (kept, range) = (W::kept(numbers, keep), kept_of_range(7, keep));
                let lanes = (0..LANES).filter(|lane| keep >> lane & 1 == 1);
                for (k, lane) in lanes.enumerate() {
                    assert_eq!(kept[k], numbers[lane]);
                    assert_eq!(range[k], 7 + lane as u32);
                }
            }
            let numbers = [4, 1, 9, 4, 7, 7, 0, 2, 1, 3, 5, 6, 8, 10, 11, 7];
            assert_eq!(W::repeated(&numbers), 0b1000_0001_0010_1000);
            let mut turns = [0.0_f32; 16];
            let here = W::Single::splat(f32::from_bits(5));
            let there = W::Single::splat(f32::from_bits(u32::MAX - 6));
            // SAFETY: sixteen lanes.
            unsafe { here.turned_from(there).store(turns.as_mut_ptr()) };
            assert_eq!(turns, [12.0; 16]);
            let four = [0.1_f32, 2.0, 30.0, 4e-3];
            let (mut quad, mut each) = ([0.0_f32; 16], [0.0_f32; 16]);
            let mut sums = [7.0, 8.0, 9.0, 10.0];
            // SAFETY: four numbers, sixteen lanes.
            unsafe {
                W::Single::quad(four.as_ptr()).store(quad.as_mut_ptr());
                let column = W::Single::each(four.as_ptr());
                column.store(each.as_mut_ptr());
                column.add_quarters(sums.as_mut_ptr());
            }
            for lane in 0..16 {
                assert_eq!([quad[lane], each[lane]], [four[lane % 4], four[lane / 4]]);
            }
            let sum = (four[0] + four[2]) + (four[1] + four[3]);
            let all = [7.0, 8.0, 9.0, 10.0].map(|first: f64| first + f64::from(sum));
            assert_eq!(sums, all);
            let narrow: [f32; LANES] = std::array::from_fn(|k| 1.0 / (k as f32 + 3.0));
            // SAFETY: eight numbers.
            let wide = unsafe { W::widened(narrow.as_ptr()) };
            let mut records = [[0.0; 4]; LANES];
            // SAFETY: eight records.
            unsafe { W::records([wide, wide.plus(wide), wide, wide], records.as_mut_ptr()) };
            let sums = W::sums([wide, wide.times(wide), wide.plus(wide), W::splat(0.1)]);
            let x = narrow.map(f64::from);
            assert_eq!(records, x.map(|x| [x, 2.0 * x, x, x]));
            let tree =
                |x: [f64; LANES]| ((x[0] + x[1]) + (x[4] + x[5])) + ((x[2] + x[3]) + (x[6] + x[7]));
            assert_eq!(
                sums,
                [
                    tree(x),
                    tree(x.map(|x| x * x)),
                    2.0 * tree(x),
                    tree([0.1; 8])
                ]
            );
            let mut words = [[0; 24]; 4];
            W::philox(&counters(), [9, 1 << 24], [7, 8], &mut words, 24);
            (moved::<W, f64>(), moved::<W::Single, f32>(), words)
        }
    }

    #[test]
    fn all_instructions_move_alike() {
        let plain = Moves.run::<Portable<f64, LANES>>();
        assert_eq!(plain.0[..3], [12.0, 68.0, 156.0]);
        // Taken from the record of slot 3 once, and from that of slot 5 twice.
        assert_eq!(plain.0[32 + 12..][..4], [988.0, 987.0, 986.0, 1e3]);
        assert_eq!(plain.0[32 + 20..][..4], [960.0, 958.0, 956.0, 1e3]);
        assert_eq!(plain.1[..3], [12.0, 68.0, 156.0]);
        for lane in 0..24 {
            let [low, high] = counters().map(|n| n[lane]);
            let words = philox4x32_lanes([low, high, 9, 1 << 24], [7, 8]);
            assert_eq!(plain.2.map(|n| u64::from(n[lane])), words);
        }
        assert_eq!(run_wide(Moves), plain);
        #[cfg(target_arch = "x86_64")]
        if Instructions::available().contains(&Instructions::Avx2) {
            // SAFETY: the features were detected.
            assert_eq!(Moves.run::<Avx2>(), plain);
        }
        assert!(Instructions::available().contains(&Instructions::chosen()));
    }
}
