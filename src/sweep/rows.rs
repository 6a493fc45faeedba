//! Pairs in lanes: rows of pairs within support and skin, as many at a time as a chunk takes.

use std::marker::PhantomData;
use std::ops::Range;

use super::precision::{Double, Precision};
use super::wide::{LANES, Vector};
use super::{CHUNK, Shared, Wide, ask_for};
use crate::domain::PeriodicBox;
use crate::neighbor::Rows;
use crate::real::{ROUNDER, Real};

/// Lanes of the widest registers.
pub(crate) const MOST: usize = 2 * LANES;

/// Lanes of a row that are worked off without a look at where it ends, which no machine foresees.
pub(super) const STRIDE: usize = 4 * LANES;

/// Lanes of a chunk, with room for what the last ones leave over.
pub(super) const ROOM: usize = CHUNK + STRIDE;

// A bit for each vector of a chunk, and room for one more.
const _: () = assert!(CHUNK / LANES < 64);

/// Number of lanes to compute for `count` pairs: whole vectors, the rest being leftovers.
#[inline(always)]
pub(super) fn whole<R: Real>(count: usize) -> usize {
    let lanes = if R::NARROW { MOST } else { LANES };
    count.next_multiple_of(lanes).min(ROOM)
}

/// The bits of the first `count` lanes of a vector.
#[inline(always)]
pub(crate) fn first_lanes<V: Vector>(count: usize) -> u32 {
    (1 << count.min(V::LANES)) - 1
}

/// Closures must not touch a [`Vector`]: they would be compiled without its instructions.
#[inline(always)]
pub(super) fn four<V: Vector>(numbers: &[V::Number; 4]) -> [V; 4] {
    [
        V::splat(numbers[0]),
        V::splat(numbers[1]),
        V::splat(numbers[2]),
        V::splat(numbers[3]),
    ]
}

/// Separations to the nearest image, a vector at a time.
pub(super) struct Wrap<P: Precision, W: Wide> {
    edges: [P::Vector<W>; 4],
    inverse: [P::Vector<W>; 4],
    rounder: P::Vector<W>,
}

impl<P: Precision, W: Wide> Wrap<P, W> {
    #[inline(always)]
    pub(super) fn new(cell: &PeriodicBox) -> Self {
        let ([x, y, z], [u, v, w]) = (cell.edges, cell.inverse);
        let zero = P::Real::ZERO;
        Self {
            edges: four(&[P::edge(x), P::edge(y), P::edge(z), zero]),
            inverse: four(&[P::Real::of(u), P::Real::of(v), P::Real::of(w), zero]),
            rounder: P::Vector::<W>::splat(P::Real::of(ROUNDER)),
        }
    }

    #[inline(always)]
    pub(super) fn along(
        &self,
        axis: usize,
        first: P::Vector<W>,
        second: P::Vector<W>,
    ) -> P::Vector<W> {
        let (edge, inverse) = (self.edges[axis], self.inverse[axis]);
        P::separation::<W>(first, second, edge, inverse, self.rounder)
    }

    /// From the second ends to the first, and the squares; the third component of two is 0.
    #[inline(always)]
    #[allow(clippy::type_complexity)]
    pub(super) fn between<const D: usize>(
        &self,
        first: &[P::Vector<W>; 4],
        second: &[P::Vector<W>; 4],
    ) -> ([P::Vector<W>; 3], P::Vector<W>) {
        let x = self.along(0, first[0], second[0]);
        let y = self.along(1, first[1], second[1]);
        let plane = x.times(x).plus_product(y, y);
        if D == 2 {
            return ([x, y, P::Vector::<W>::splat(P::Real::ZERO)], plane);
        }
        let z = self.along(2, first[2], second[2]);
        ([x, y, z], plane.plus_product(z, z))
    }
}

/// Separations from a head to others.
pub(crate) struct Separation<P: Precision, W: Wide> {
    head: [P::Vector<W>; 4],
    wrap: Wrap<P, W>,
}

impl<P: Precision, W: Wide> Separation<P, W> {
    #[inline(always)]
    pub(crate) fn new(head: &[P::Real; 4], cell: &PeriodicBox) -> Self {
        Self {
            head: four(head),
            wrap: Wrap::new(cell),
        }
    }

    /// The head's less the others' positions, and the squares.
    #[inline(always)]
    #[allow(clippy::type_complexity)]
    pub(crate) fn from<const D: usize>(
        &self,
        others: &[P::Vector<W>; 4],
    ) -> ([P::Vector<W>; 3], P::Vector<W>) {
        self.wrap.between::<D>(&self.head, others)
    }
}

/// Slots of both ends of as many pairs as a vector has lanes.
pub(super) struct Ends<'a> {
    pub heads: Heads<'a>,
    pub others: &'a [u32; MOST],
}

/// Slots of the heads.
pub(super) enum Heads<'a> {
    /// Those of the last and of the first lane; and bits of the lanes whose head is that of the last one, if it is
    /// not that of the first. There are no others, or these lanes come again.
    Two([u32; 2], u32),
    /// Lane by lane.
    Each(&'a [u32; MOST]),
}

impl Ends<'_> {
    /// The columns of the heads' records.
    ///
    /// # Safety
    /// `base` has a record for every slot.
    #[inline(always)]
    pub(super) unsafe fn of_heads<V: Vector>(&self, base: &[[V::Number; 4]]) -> [V; 4] {
        // SAFETY: promised by the caller.
        unsafe {
            match self.heads {
                Heads::Two(two, last) => {
                    V::of_two(two.map(|slot| base.as_ptr().add(slot as usize)), last)
                }
                Heads::Each(heads) => V::columns(base.as_ptr(), heads.as_ptr()),
            }
        }
    }

    /// The columns of both records of the heads, where a particle has two side by side.
    ///
    /// # Safety
    /// `base` has two records for every slot.
    #[inline(always)]
    pub(super) unsafe fn of_heads_twice<V: Vector>(
        &self,
        base: *const [[V::Number; 4]; 2],
    ) -> [[V; 4]; 2] {
        // SAFETY: promised by the caller.
        unsafe {
            match self.heads {
                Heads::Two(two, last) => {
                    V::of_two_twice(two.map(|slot| base.add(slot as usize)), last)
                }
                Heads::Each(heads) => V::columns_twice(base, heads.as_ptr()),
            }
        }
    }

    /// The columns of both records of the partners.
    ///
    /// # Safety
    /// `base` has two records for every slot.
    #[inline(always)]
    pub(super) unsafe fn of_others_twice<V: Vector>(
        &self,
        base: *const [[V::Number; 4]; 2],
    ) -> [[V; 4]; 2] {
        // SAFETY: promised by the caller.
        unsafe { V::columns_twice(base, self.others.as_ptr()) }
    }

    /// Those of the partners' records.
    ///
    /// # Safety
    /// `base` has a record for every slot.
    #[inline(always)]
    pub(super) unsafe fn of_others<V: Vector>(&self, base: &[[V::Number; 4]]) -> [V; 4] {
        // SAFETY: promised by the caller.
        unsafe { V::columns(base.as_ptr(), self.others.as_ptr()) }
    }
}

/// Sums over the `count` lanes of a row, in double precision, of up to four arrays from its lane on.
///
/// # Safety
/// The arrays hold that many numbers and [`STRIDE`] more.
#[inline(always)]
pub(super) unsafe fn row_sums<P: Precision, W: Wide, const N: usize>(
    arrays: [*const P::Real; N],
    count: usize,
) -> [f64; 4] {
    let zero = W::splat(0.0);
    let mut sums = [zero; 4];
    for k in (0..count).step_by(STRIDE) {
        let keep = ((1_u64 << (count - k).min(STRIDE)) - 1) as u32;
        for n in 0..N {
            let mut eights = [zero; STRIDE / LANES];
            for (part, eight) in eights.iter_mut().enumerate() {
                let lane = LANES * part;
                // SAFETY: promised by the caller.
                let numbers = unsafe { P::eight::<W>(arrays[n].add(k + lane)) };
                *eight = numbers.where_set(keep >> lane, zero);
            }
            let [a, b, c, d] = eights;
            sums[n] = sums[n].plus(a.plus(b).plus(c.plus(d)));
        }
    }
    W::sums(sums)
}

/// What a sweep wants to know of pairs.
pub(super) trait Companion<V: Vector> {
    /// As many pairs as a vector has lanes; theirs begin at `lane`. Of several calls for the same lanes the
    /// last one counts.
    ///
    /// # Safety
    /// The ends are slots of particles, and there are as many lanes.
    unsafe fn take(&mut self, ends: &Ends<'_>, lane: usize);
}

/// Where to read of the pairs of a chunk, vector by vector.
struct Chunk<'a, V> {
    slots: *const u32,
    starts: *const u8,
    rows: *const [u32; 2],
    near: PhantomData<(&'a Rows, V)>,
}

impl<'a, V: Vector> Chunk<'a, V> {
    /// That begins at a pair.
    #[inline(always)]
    fn new(near: &'a Rows, first: usize) -> Self {
        Self {
            slots: near.slots.as_ptr().wrapping_add(first),
            starts: near.starts.as_ptr().wrapping_add(first / 8),
            rows: near.ends.as_ptr(),
            near: PhantomData,
        }
    }

    /// Bits of those lanes behind the first one of a vector that rows start with; does one start behind the
    /// last one?
    ///
    /// # Safety
    /// It is one of the chunk's.
    #[inline(always)]
    unsafe fn starts(&self, vector: usize) -> (u32, usize) {
        // SAFETY: promised by the caller; there are bits enough behind the last pair.
        let bytes = unsafe {
            self.starts
                .add(V::LANES / 8 * vector)
                .cast::<[u8; 4]>()
                .read()
        };
        let bits = u32::from_le_bytes(bytes);
        let inner = bits & (first_lanes::<V>(V::LANES) & !1);
        (inner, (bits >> V::LANES & 1) as usize)
    }

    /// Bit k is set where more than one row starts behind the first lane of vector k.
    #[inline(always)]
    fn several(&self) -> u64 {
        // A part for each vector of a word: its highest and its lowest bit.
        let low = u64::MAX / u64::from(u32::MAX >> (32 - V::LANES));
        let high = low << (V::LANES - 1);
        let mut several = 0;
        for (n, bytes) in self.bits().as_chunks::<8>().0.iter().enumerate() {
            let inner = u64::from_le_bytes(*bytes) >> 1 & !high;
            // More than one bit: some are left without the lowest; a part of more than 0 then gets its highest.
            let more = inner & ((inner | high) - low);
            let set = ((more + !high) & high) >> (V::LANES - 1);
            for part in 0..64 / V::LANES {
                several |= (set >> (V::LANES * part) & 1) << (64 / V::LANES * n + part);
            }
        }
        several
    }

    /// Bits of the pairs that rows start with.
    #[inline(always)]
    fn bits(&self) -> &'a [u8; CHUNK / 8] {
        // SAFETY: there are as many behind the last pair.
        unsafe { &*self.starts.cast() }
    }

    /// Head of a row.
    ///
    /// # Safety
    /// There is such a row.
    #[inline(always)]
    unsafe fn head(&self, row: usize) -> u32 {
        // SAFETY: promised by the caller.
        unsafe { (*self.rows.add(row))[0] }
    }

    /// Heads of the lanes of a vector that begins in a row, where others start at those bits.
    ///
    /// # Safety
    /// There are as many rows.
    #[inline(always)]
    unsafe fn heads(&self, mut row: usize, starts: u32) -> [u32; MOST] {
        let mut heads = [0; MOST];
        for (lane, head) in heads.iter_mut().enumerate() {
            row += (starts >> lane & 1) as usize;
            // SAFETY: promised by the caller.
            *head = unsafe { self.head(row) };
        }
        heads
    }

    /// Slots of the partners of a vector.
    ///
    /// # Safety
    /// It is one of the chunk's.
    #[inline(always)]
    unsafe fn others(&self, vector: usize) -> &'a [u32; MOST] {
        // SAFETY: promised by the caller; slots, too, follow the last pair.
        unsafe { &*self.slots.add(V::LANES * vector).cast() }
    }
}

/// Whose pairs are in the lanes of a chunk, and how far a walk along the rows of a block has come.
#[derive(Default)]
pub(super) struct Members {
    /// Pairs in use.
    pub count: usize,
    /// Where they begin among all pairs.
    pub first: usize,
    /// The row of the first one.
    row: usize,
    /// Rows that they belong to.
    row_count: usize,
}

impl Members {
    /// Back to the first pairs of a block.
    #[inline(always)]
    pub(super) fn rewind(&mut self) {
        *self = Self::default();
    }

    /// Are there pairs behind those in the lanes?
    #[inline(always)]
    pub(super) fn has_more(&self, near: &Rows) -> bool {
        self.first + self.count < near.pairs()
    }

    /// Takes the next pairs of a block, a vector at a time. The lanes behind them hold other pairs, or none.
    #[inline(always)]
    pub(super) fn fill<V: Vector>(&mut self, near: &Rows, companion: &mut impl Companion<V>) {
        let at = self.enter::<V>(near);
        // The chunk after the next: what a machine foresees by itself ends with a page of memory.
        let next = self.first + self.count + CHUNK;
        ask_for(near.slots.as_ptr().wrapping_add(next), CHUNK);
        let vectors = self.count.div_ceil(V::LANES);
        // Rows may be short, as in a plane.
        let all = self.row_count > vectors;
        let mut left = if all {
            (1 << vectors) - 1
        } else {
            at.several()
        };
        if !all {
            // Vectors take no notice of where rows end: hardly any has more than two heads, and those
            // that have are gathered again.
            let mut row = self.row;
            for vector in 0..vectors {
                // SAFETY: slots of particles, for all pairs and a vector more, and bits likewise.
                unsafe {
                    let (starts, next) = at.starts(vector);
                    let last = row + starts.count_ones() as usize;
                    // The lowest one and those above.
                    let of_last = starts | starts.wrapping_neg();
                    let ends = Ends {
                        heads: Heads::Two([at.head(last), at.head(row)], of_last),
                        others: at.others(vector),
                    };
                    companion.take(&ends, V::LANES * vector);
                    row = last + next;
                }
            }
        }
        let (mut row, mut known) = (self.row, 0);
        while left != 0 {
            let vector = left.trailing_zeros() as usize;
            // SAFETY: as above.
            unsafe {
                while known < vector {
                    let (starts, next) = at.starts(known);
                    row += starts.count_ones() as usize + next;
                    known += 1;
                }
                let ends = Ends {
                    heads: Heads::Each(&at.heads(row, at.starts(vector).0)),
                    others: at.others(vector),
                };
                companion.take(&ends, V::LANES * vector);
            }
            left &= left - 1;
        }
    }

    /// Goes on to the next pairs.
    #[inline(always)]
    fn enter<'a, V: Vector>(&mut self, near: &'a Rows) -> Chunk<'a, V> {
        self.row += self.row_count;
        self.first += self.count;
        self.count = CHUNK.min(near.pairs() - self.first);
        debug_assert!(
            8 * near.starts.len() >= near.pairs() + CHUNK,
            "starts are marked"
        );
        let at = Chunk::new(near, self.first);
        let bits = at.bits();
        let starts: u32 = bits
            .as_chunks::<8>()
            .0
            .iter()
            .map(|&byte| u64::from_ne_bytes(byte).count_ones())
            .sum();
        // A row that goes on has started before.
        let goes_on = usize::from(bits[0] & 1 == 0);
        self.row -= goes_on;
        self.row_count = starts as usize + goes_on;
        at
    }

    /// Slots of the partners, lane by lane.
    #[inline(always)]
    pub(super) fn others<'a>(&self, near: &'a Rows) -> &'a [u32] {
        &near.slots[self.first..self.first + self.count]
    }

    /// Number of rows.
    #[inline(always)]
    pub(super) fn row_count(&self) -> usize {
        self.row_count
    }

    /// Head and lanes of a row. (No callbacks: they would be compiled without wide instructions.)
    #[inline(always)]
    pub(super) fn row_at(&self, near: &Rows, n: usize) -> (u32, Range<usize>) {
        let lane = |end: u32| (end as usize - self.first).min(self.count);
        let begin = if n == 0 {
            0
        } else {
            lane(near.ends[self.row + n - 1][1])
        };
        let [head, end] = near.ends[self.row + n];
        (head, begin..lane(end))
    }
}

/// The pairs of a chunk and their geometry.
#[repr(align(64))]
pub(super) struct Pairs<P: Precision = Double> {
    pub members: Members,
    pub r: [[P::Real; ROOM]; 3],
    pub r2: [P::Real; ROOM],
    /// s_i s_j.
    pub weight: [P::Real; ROOM],
}

/// Fills the lanes of the geometry.
pub(super) struct Geometry<'a, P: Precision, W: Wide, const D: usize> {
    wrap: Wrap<P, W>,
    r: &'a mut [[P::Real; ROOM]; 3],
    r2: &'a mut [P::Real; ROOM],
    weight: &'a mut [P::Real; ROOM],
}

impl<P: Precision, W: Wide, const D: usize> Geometry<'_, P, W, D> {
    /// From the columns of the records of both ends.
    ///
    /// # Safety
    /// There are lanes for a vector.
    #[inline(always)]
    pub(super) unsafe fn put(
        &mut self,
        here: &[P::Vector<W>; 4],
        there: &[P::Vector<W>; 4],
        lane: usize,
    ) {
        // SAFETY: promised by the caller.
        unsafe {
            let (r, r2) = self.wrap.between::<D>(here, there);
            for a in 0..D {
                r[a].store(self.r[a].as_mut_ptr().add(lane));
            }
            r2.store(self.r2.as_mut_ptr().add(lane));
            let weight = P::Vector::<W>::times(here[3], there[3]);
            weight.store(self.weight.as_mut_ptr().add(lane));
        }
    }
}

/// Fills the lanes of the geometry, and what the sweep wants to know beside it.
struct Accompanied<'a, P: Precision, W: Wide, C, const D: usize> {
    geometry: Geometry<'a, P, W, D>,
    place: &'a [[P::Real; 4]],
    companion: &'a mut C,
}

impl<P, W, C, const D: usize> Companion<P::Vector<W>> for Accompanied<'_, P, W, C, D>
where
    P: Precision,
    W: Wide,
    C: Companion<P::Vector<W>>,
{
    #[inline(always)]
    unsafe fn take(&mut self, ends: &Ends<'_>, lane: usize) {
        // SAFETY: promised by the caller.
        unsafe {
            let (here, there) = (ends.of_heads(self.place), ends.of_others(self.place));
            self.geometry.put(&here, &there, lane);
            self.companion.take(ends, lane);
        }
    }
}

impl<P: Precision> Pairs<P> {
    pub(super) fn new() -> Self {
        Self {
            members: Members::default(),
            r: [[P::Real::ZERO; ROOM]; 3],
            r2: [P::Real::ZERO; ROOM],
            weight: [P::Real::ZERO; ROOM],
        }
    }

    /// Takes the next pairs of a block. The lanes behind them hold other pairs, or none.
    #[inline(always)]
    pub(super) fn fill<W: Wide, const D: usize>(
        &mut self,
        near: &Rows,
        cell: &PeriodicBox,
        place: &[[P::Real; 4]],
        companion: &mut impl Companion<P::Vector<W>>,
    ) {
        let (members, geometry) = self.parts(cell);
        let mut all = Accompanied::<P, W, _, D> {
            geometry,
            place,
            companion,
        };
        members.fill(near, &mut all);
    }

    /// For who fills the lanes otherwise.
    #[inline(always)]
    pub(super) fn parts<W: Wide, const D: usize>(
        &mut self,
        cell: &PeriodicBox,
    ) -> (&mut Members, Geometry<'_, P, W, D>) {
        let geometry = Geometry {
            wrap: Wrap::new(cell),
            r: &mut self.r,
            r2: &mut self.r2,
            weight: &mut self.weight,
        };
        (&mut self.members, geometry)
    }

    /// Adds what is in the lanes of three arrays to the records of the heads and takes it from those of
    /// the partners.
    ///
    /// # Safety
    /// The pairs are those of `near`; no other thread uses the slots of this block.
    #[inline(always)]
    pub(super) unsafe fn scatter<W: Wide>(
        &self,
        near: &Rows,
        columns: &[[P::Real; ROOM]; 3],
        target: &Shared<'_, [f64; 4]>,
    ) {
        let vector = P::Vector::<W>::LANES;
        let vectors = self.members.count - self.members.count % vector;
        for lane in (0..vectors).step_by(vector) {
            let [x, y, z] = columns;
            // SAFETY: promised by the caller; lanes of a whole vector are in use.
            unsafe {
                let axes = [
                    P::Vector::<W>::load(x.as_ptr().add(lane)),
                    P::Vector::<W>::load(y.as_ptr().add(lane)),
                    P::Vector::<W>::load(z.as_ptr().add(lane)),
                ];
                let slots = near.slots.as_ptr().add(self.members.first + lane);
                P::Vector::<W>::take(axes, target.pointer(), slots);
            }
        }
        // What is behind the last pair are slots of other blocks, of which other threads make use.
        for (lane, &slot) in self.members.others(near).iter().enumerate().skip(vectors) {
            // SAFETY: promised by the caller.
            let other = unsafe { target.slot(slot) };
            for (number, column) in other.iter_mut().zip(columns) {
                *number -= column[lane].double();
            }
        }
        for n in 0..self.members.row_count() {
            let (head, lanes) = self.members.row_at(near, n);
            // SAFETY: promised by the caller; rows begin within the chunk.
            unsafe {
                let [x, y, z] = columns;
                let arrays = [
                    x.as_ptr().add(lanes.start),
                    y.as_ptr().add(lanes.start),
                    z.as_ptr().add(lanes.start),
                ];
                let sums = row_sums::<P, W, 3>(arrays, lanes.len());
                let own = target.slot(head);
                for a in 0..4 {
                    own[a] += sums[a];
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Task, run_wide};
    use super::*;
    use crate::random::fmix64;

    /// Writes down both ends of each lane.
    struct Seen([[u32; 2]; ROOM]);

    impl<V: Vector> Companion<V> for Seen {
        #[inline(always)]
        unsafe fn take(&mut self, ends: &Ends<'_>, lane: usize) {
            for k in 0..V::LANES {
                let head = match ends.heads {
                    Heads::Two(two, last) => two[usize::from(last >> k & 1 == 0)],
                    Heads::Each(heads) => heads[k],
                };
                self.0[lane + k] = [head, ends.others[k]];
            }
        }
    }

    struct Check<'a>(&'a Rows);

    impl Check<'_> {
        #[inline(always)]
        fn with<V: Vector>(&self) {
            let mut all = self
                .0
                .iter()
                .flat_map(|(head, row)| row.iter().map(move |&other| [head, other]));
            let (mut members, mut seen) = (Members::default(), Seen([[0; 2]; ROOM]));
            // Again, as for the next block.
            members.count = 7;
            members.rewind();
            while members.has_more(self.0) {
                members.fill::<V>(self.0, &mut seen);
                let mut lanes = 0..members.count;
                for n in 0..members.row_count() {
                    let (head, row) = members.row_at(self.0, n);
                    assert!(!row.is_empty());
                    for lane in row {
                        assert_eq!(Some(lane), lanes.next());
                        assert_eq!(seen.0[lane], [head, members.others(self.0)[lane]]);
                        assert_eq!(Some(seen.0[lane]), all.next());
                    }
                }
                assert_eq!(lanes.next(), None);
            }
            assert_eq!(all.next(), None);
        }
    }

    impl Task for Check<'_> {
        type Output = ();
        #[inline(always)]
        fn run<W: Wide>(self) {
            self.with::<W>();
            self.with::<W::Single>();
        }
    }

    #[test]
    fn lanes_have_the_ends_of_the_pairs_of_rows_of_any_length() {
        for longest in [1, 2, 5, 9, 20, 40, 300, 1000] {
            for count in [0, 1, 2, 40, 300] {
                let mut rows = Rows::default();
                for head in 0..count {
                    let length = 1 + fmix64(u64::from(longest * 1000 + head)) as u32 % longest;
                    rows.slots.extend((0..length).map(|k| 7 * k + head));
                    rows.ends.push([1_000_000 + head, rows.slots.len() as u32]);
                }
                rows.slots.extend([0; MOST]);
                rows.mark_starts();
                run_wide(Check(&rows));
            }
        }
    }
}
