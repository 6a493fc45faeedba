//! Pairs in lanes: the rows of a block's list, as many at a time as a chunk takes, and of these the
//! pairs within the support.

use std::marker::PhantomData;
use std::ops::Range;

use super::wide::LANES;
use super::{CHUNK, Shared, Task, Walk, Wide, run_wide};
use crate::domain::PeriodicBox;
use crate::neighbor::{BlockList, Rows};
use crate::physics::FrictionForm;
use crate::random::{
    Arithmetic, ROUNDER, SweepKey, Variate, ln, pair_counter, philox4x32_lanes, unit_interval,
};

/// Lanes of a chunk, with room for what the last eight leave over.
pub(super) const ROOM: usize = CHUNK + 2 * LANES;

/// Number of lanes to compute for `count` pairs: whole vectors, the rest being leftovers.
#[inline(always)]
pub(super) fn whole(count: usize) -> usize {
    count.next_multiple_of(LANES).min(ROOM)
}

/// Places of eight partners, from the `first` in a list on, and their slots. Behind the end of a row
/// they are those of the next one, or stand for none.
///
/// # Safety
/// The list has eight places from `first` on, all of which lead to slots.
#[inline(always)]
unsafe fn eight(places: &[u16], slots: &[u32], first: usize) -> ([u16; LANES], [u32; LANES]) {
    // SAFETY: promised by the caller. The volatile reads keep the compiler from gathering the slots,
    // whose elements it would then have to take out one by one.
    unsafe {
        let places = places.as_ptr().add(first);
        let slot =
            |lane: usize| *slots.get_unchecked(std::ptr::read_volatile(places.add(lane)) as usize);
        (
            places.cast::<[u16; LANES]>().read_unaligned(),
            [
                slot(0),
                slot(1),
                slot(2),
                slot(3),
                slot(4),
                slot(5),
                slot(6),
                slot(7),
            ],
        )
    }
}

/// The bits of the first `count` of eight lanes.
#[inline(always)]
pub(crate) fn first_lanes(count: usize) -> u8 {
    if count < LANES {
        (1 << count) - 1
    } else {
        0xff
    }
}

/// Closures must not touch a [`Wide`]: they would be compiled without its instructions.
#[inline(always)]
fn three<W: Wide>(numbers: &[f64; 3]) -> [W; 3] {
    [
        W::splat(numbers[0]),
        W::splat(numbers[1]),
        W::splat(numbers[2]),
    ]
}

/// Separations to the nearest image, eight at a time.
#[derive(Clone, Copy)]
pub(super) struct Wrap<W> {
    edges: [W; 3],
    inverse: [W; 3],
    rounder: W,
}

impl<W: Wide> Wrap<W> {
    #[inline(always)]
    pub(super) fn new(cell: &PeriodicBox) -> Self {
        Self {
            edges: three(&cell.edges),
            inverse: three(&cell.inverse),
            rounder: W::splat(ROUNDER),
        }
    }

    #[inline(always)]
    fn along(&self, axis: usize, r: W) -> W {
        let turns = self.rounder.plus_product(r, self.inverse[axis]);
        let turns = turns.minus(self.rounder);
        r.less_product(self.edges[axis], turns)
    }

    /// From the second ends to the first, and the squares; the third component of two is 0.
    #[inline(always)]
    pub(super) fn between<const D: usize>(&self, first: &[W; 4], second: &[W; 4]) -> ([W; 3], W) {
        let x = self.along(0, first[0].minus(second[0]));
        let y = self.along(1, first[1].minus(second[1]));
        let plane = x.times(x).plus_product(y, y);
        if D == 2 {
            return ([x, y, W::splat(0.0)], plane);
        }
        let z = self.along(2, first[2].minus(second[2]));
        ([x, y, z], plane.plus_product(z, z))
    }
}

/// Separations from a head to others.
pub(crate) struct Separation<W> {
    head: [W; 4],
    wrap: Wrap<W>,
}

impl<W: Wide> Separation<W> {
    #[inline(always)]
    pub(crate) fn new(head: &[f64; 4], cell: &PeriodicBox) -> Self {
        let [x, y, z, s] = *head;
        Self {
            head: [W::splat(x), W::splat(y), W::splat(z), W::splat(s)],
            wrap: Wrap::new(cell),
        }
    }

    /// The head's less the others' positions, and the squares.
    #[inline(always)]
    pub(crate) fn from<const D: usize>(&self, others: &[W; 4]) -> ([W; 3], W) {
        self.wrap.between::<D>(&self.head, others)
    }
}

/// Square distances of a head and `count` partners, from the `first` of the list on; what is within
/// the support is put into `near` from `length` on.
///
/// # Safety
/// The partners are pairs of `block`, whose slots are those of `position`; at most [`CHUNK`] of them;
/// `near` has room for as many places as the list of the block.
#[inline(always)]
#[allow(clippy::too_many_arguments)]
pub(super) unsafe fn square_distances<W: Wide, const D: usize>(
    block: &BlockList,
    cell: &PeriodicBox,
    position: &[[f64; 4]],
    head: u32,
    first: usize,
    count: usize,
    r2: &mut [f64; ROOM],
    near: &mut Rows,
    length: &mut usize,
) {
    let head_at = Separation::<W>::new(&position[head as usize], cell);
    let support = W::splat(1.0);
    for k in (0..count).step_by(LANES) {
        // SAFETY: slots of particles; a list has room for eight more than its pairs.
        unsafe {
            let (places, slots) = eight(&block.neighbours, &block.slots, first + k);
            let other = W::columns(position.as_ptr(), &slots);
            let (_, square) = head_at.from::<D>(&other);
            square.store(r2.as_mut_ptr().add(k));
            let keep = square.below(support) & first_lanes(count - k);
            let to = near.places.as_mut_ptr().add(*length);
            to.cast::<[u16; LANES]>()
                .write_unaligned(W::kept(places, keep));
            *length += keep.count_ones() as usize;
        }
    }
}

/// What a sweep wants to know of pairs beside their geometry.
pub(super) trait Companion<W: Wide> {
    /// A row begins.
    fn begin(&mut self, head: u32);
    /// Eight partners, whose lanes begin at `lane`.
    ///
    /// # Safety
    /// They are slots of particles, and there are eight lanes.
    unsafe fn take(&mut self, slots: &[u32; LANES], lane: usize);
}

/// The geometry of the pairs of a chunk.
#[repr(align(64))]
pub(super) struct Pairs {
    /// Pairs in use.
    pub count: usize,
    /// Heads, each with the lane where its row ends.
    rows: [[u32; 2]; CHUNK],
    row_count: usize,
    /// Slots of the partners.
    other: [u32; ROOM],
    pub r: [[f64; ROOM]; 3],
    pub r2: [f64; ROOM],
    /// s_i s_j.
    pub weight: [f64; ROOM],
}

impl Pairs {
    pub(super) fn new() -> Self {
        Self {
            count: 0,
            rows: [[0; 2]; CHUNK],
            row_count: 0,
            other: [0; ROOM],
            r: [[0.0; ROOM]; 3],
            r2: [0.0; ROOM],
            weight: [0.0; ROOM],
        }
    }

    /// Takes the next pairs of a block. The lanes behind them hold other pairs, or none.
    #[inline(always)]
    pub(super) fn fill<W: Wide, const D: usize>(
        &mut self,
        (near, slots): (&Rows, &[u32]),
        cell: &PeriodicBox,
        position: &[[f64; 4]],
        walk: &mut Walk,
        companion: &mut impl Companion<W>,
    ) {
        (self.row_count, self.count) = (0, 0);
        let stop = walk.stop(&near.ends, CHUNK);
        while let Some((head, pairs)) = walk.next_row(&near.ends, stop) {
            let lane = self.count;
            self.count += pairs.len();
            self.rows[self.row_count] = [head, self.count as u32];
            self.row_count += 1;
            // SAFETY: a row of this block; CHUNK lanes and eight more.
            unsafe {
                self.row::<W, D>((near, slots), cell, position, head, lane, pairs, companion);
            }
        }
    }

    #[inline(always)]
    #[allow(clippy::too_many_arguments)]
    unsafe fn row<W: Wide, const D: usize>(
        &mut self,
        (near, slots): (&Rows, &[u32]),
        cell: &PeriodicBox,
        position: &[[f64; 4]],
        head: u32,
        mut lane: usize,
        pairs: Range<usize>,
        companion: &mut impl Companion<W>,
    ) {
        let head_at = Separation::<W>::new(&position[head as usize], cell);
        companion.begin(head);
        for k in pairs.step_by(LANES) {
            // SAFETY: slots of particles; free lanes for all partners and seven more.
            unsafe {
                let (_, slots) = eight(&near.places, slots, k);
                let other = W::columns(position.as_ptr(), &slots);
                let (r, r2) = head_at.from::<D>(&other);
                for a in 0..D {
                    r[a].store(self.r[a].as_mut_ptr().add(lane));
                }
                r2.store(self.r2.as_mut_ptr().add(lane));
                let weight = head_at.head[3].times(other[3]);
                weight.store(self.weight.as_mut_ptr().add(lane));
                let to = self.other.as_mut_ptr().add(lane);
                for n in 0..LANES {
                    // One by one: the slots are in as many registers.
                    std::ptr::write_volatile(to.add(n), slots[n]);
                }
                companion.take(&slots, lane);
            }
            lane += LANES;
        }
    }

    /// Number of rows.
    #[inline(always)]
    pub(super) fn row_count(&self) -> usize {
        self.row_count.min(CHUNK)
    }

    /// Head and lanes of a row. (No callbacks: they would be compiled without wide instructions.)
    #[inline(always)]
    pub(super) fn row_at(&self, n: usize) -> (u32, Range<usize>) {
        let begin = if n == 0 { 0 } else { self.rows[n - 1][1] };
        let [head, end] = self.rows[n];
        (head, begin as usize..end as usize)
    }

    /// Slot of the partner in a lane in use.
    #[inline(always)]
    pub(super) fn other(&self, lane: usize) -> u32 {
        self.other[lane]
    }

    /// Adds what is in the lanes to the heads and takes it from the partners.
    ///
    /// # Safety
    /// No other thread uses the slots of this block.
    #[inline(always)]
    pub(super) unsafe fn scatter(&self, records: &[[f64; 4]; ROOM], target: &Shared<'_, [f64; 4]>) {
        for n in 0..self.row_count() {
            let (head, lanes) = self.row_at(n);
            // Two sums, so that an addition need not wait for the one before.
            let (mut even, mut odd) = ([0.0; 4], [0.0; 4]);
            let (mut lane, end) = (lanes.start, lanes.end);
            // SAFETY: promised by the caller; a partner is never the head itself.
            unsafe {
                while lane + 1 < end {
                    self.take(records, target, lane, &mut even);
                    self.take(records, target, lane + 1, &mut odd);
                    lane += 2;
                }
                if lane < end {
                    self.take(records, target, lane, &mut even);
                }
                let own = target.slot(head);
                for a in 0..4 {
                    own[a] += even[a] + odd[a];
                }
            }
        }
    }

    #[inline(always)]
    unsafe fn take(
        &self,
        records: &[[f64; 4]; ROOM],
        target: &Shared<'_, [f64; 4]>,
        lane: usize,
        sum: &mut [f64; 4],
    ) {
        // SAFETY: promised by the caller.
        let (record, other) = unsafe {
            (
                records.get_unchecked(lane),
                target.slot(*self.other.get_unchecked(lane)),
            )
        };
        for a in 0..4 {
            sum[a] += record[a];
            other[a] -= record[a];
        }
    }
}

/// The random numbers of the pairs of a chunk.
#[repr(align(64))]
pub(super) struct Noise<const N: usize> {
    /// Ids of heads and partners; after `draw` the counters made of them.
    names: [[u64; ROOM]; 2],
    sign: [f64; ROOM],
    /// Variates.
    pub xi: [[f64; ROOM]; N],
}

impl<const N: usize> Noise<N> {
    pub(super) fn new() -> Self {
        Self {
            names: [[0; ROOM]; 2],
            sign: [1.0; ROOM],
            xi: [[0.0; ROOM]; N],
        }
    }

    /// Takes the ids of eight pairs.
    #[inline(always)]
    pub(super) fn name(&mut self, head: u64, others: [u64; LANES], lane: usize) {
        self.names[0][lane..lane + LANES].fill(head);
        self.names[1][lane..lane + LANES].copy_from_slice(&others);
    }

    /// Takes the ids of pairs of slots.
    #[inline(always)]
    pub(super) fn name_pairs(&mut self, slots: &[[u32; 2]; ROOM], count: usize, ids: &[u64]) {
        for lane in 0..count.min(ROOM) {
            for (names, slot) in self.names.iter_mut().zip(slots[lane]) {
                // SAFETY: lanes in use hold slots of particles.
                names[lane] = unsafe { *ids.get_unchecked(slot as usize) };
            }
        }
    }

    /// Counters of the pairs and the sign of the order of their ids.
    #[inline(always)]
    fn count(&mut self, count: usize, signed: bool) {
        let [low, high] = &mut self.names;
        let mut all = 0;
        for lane in 0..count {
            let (head, other) = (low[lane], high[lane]);
            if signed {
                self.sign[lane] = if head < other { 1.0 } else { -1.0 };
            }
            low[lane] = head.min(other);
            high[lane] = head.max(other);
            all |= head | other;
        }
        if all >> 32 != 0 {
            // Ids are counted from 0: hardly ever.
            for lane in 0..count {
                [low[lane], high[lane]] = pair_counter(low[lane], high[lane]);
            }
        }
    }

    /// The words of a lane, once the pairs are counted.
    #[inline(always)]
    fn words(&self, key: &SweepKey, lane: usize) -> [u64; 4] {
        let [low, high] = [self.names[0][lane], self.names[1][lane]];
        philox4x32_lanes([low, high, key.tail[0], key.tail[1]], key.key)
    }
}

/// Draws the noise of friction.
struct Draw<'a, V, const COUNT: usize, const SIGNED: bool> {
    noise: &'a mut Noise<3>,
    key: &'a SweepKey,
    count: usize,
    form: PhantomData<V>,
}

impl<V: Variate, const COUNT: usize, const SIGNED: bool> Task for Draw<'_, V, COUNT, SIGNED> {
    type Output = ();

    #[inline(always)]
    fn run<W: Wide>(self) {
        let (noise, count) = (self.noise, whole(self.count));
        noise.count(count, SIGNED);
        for lane in 0..count {
            let words = noise.words(self.key, lane);
            let xi = V::draw::<W::Arithmetic>(words, noise.sign[lane], COUNT);
            for a in 0..COUNT {
                noise.xi[a][lane] = xi[a];
            }
        }
    }
}

impl Noise<3> {
    /// Draws what the form of friction wants of each pair: one number, or D of them, those of (i, j)
    /// being those of (j, i) with the other sign.
    pub(super) fn draw<F: FrictionForm, V: Variate, const D: usize>(
        &mut self,
        key: &SweepKey,
        count: usize,
    ) {
        let (noise, form) = (self, PhantomData::<V>);
        if F::CENTRAL {
            run_wide(Draw::<V, 1, false> {
                noise,
                key,
                count,
                form,
            });
        } else {
            run_wide(Draw::<V, D, true> {
                noise,
                key,
                count,
                form,
            });
        }
    }
}

impl Noise<4> {
    /// Draws four variates for each pair, with the sign of the order of ids.
    #[inline(always)]
    pub(super) fn draw_four<V: Variate, A: Arithmetic>(&mut self, key: &SweepKey, count: usize) {
        let count = whole(count);
        self.count(count, true);
        for lane in 0..count {
            let xi = V::draw_four::<A>(self.words(key, lane));
            for a in 0..4 {
                self.xi[a][lane] = self.sign[lane] * xi[a];
            }
        }
    }

    /// Logarithms of two numbers in (0, 1) for each pair that has been drawn for.
    #[inline(always)]
    pub(super) fn logarithms(&self, key: &SweepKey, count: usize, chance: &mut [[f64; ROOM]; 2]) {
        for lane in 0..whole(count) {
            let words = self.words(key, lane);
            for n in 0..2 {
                chance[n][lane] = ln(unit_interval(words[n]));
            }
        }
    }
}
