//! Pairs in lanes: rows of pairs within support and skin, as many at a time as a chunk takes.

use std::ops::Range;

use super::precision::{Double, Precision};
use super::wide::{LANES, Vector};
use super::{CHUNK, Shared, Walk, Wide, ask_for};
use crate::domain::PeriodicBox;
use crate::neighbor::Rows;
use crate::real::{ROUNDER, Real};

/// Lanes of the widest registers.
pub(crate) const MOST: usize = 2 * LANES;

/// Lanes of a row that are worked off without a look at where it ends, which no machine foresees.
pub(super) const STRIDE: usize = 4 * LANES;

/// Lanes of a chunk, with room for what the last ones leave over.
pub(super) const ROOM: usize = CHUNK + STRIDE;

// A bit for each vector of a chunk, and one more.
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
    pub heads: &'a [u32; MOST],
    pub others: &'a [u32; MOST],
    /// Is it taken for granted that there are no heads but those of the first and the last lane?
    pub two: bool,
}

impl Ends<'_> {
    /// The heads of the first and of the last lane.
    #[inline(always)]
    pub(super) fn two_heads<V: Vector>(&self) -> [u32; 2] {
        [self.heads[0], self.heads[V::LANES - 1]]
    }

    /// Bits of the lanes whose head is that of the first one.
    #[inline(always)]
    pub(super) fn first<V: Vector>(&self) -> u32 {
        V::equal(self.heads, self.heads[0])
    }

    /// The columns of the heads' records.
    ///
    /// # Safety
    /// `base` has a record for every slot.
    #[inline(always)]
    pub(super) unsafe fn of_heads<V: Vector>(&self, base: &[[V::Number; 4]]) -> [V; 4] {
        // SAFETY: promised by the caller.
        unsafe {
            if !self.two {
                return V::columns(base.as_ptr(), self.heads.as_ptr());
            }
            let [first, last] = self.two_heads::<V>();
            let record = |slot: u32| base.as_ptr().add(slot as usize);
            V::of_two([record(first), record(last)], self.first::<V>())
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
            if !self.two {
                return V::columns_twice(base, self.heads.as_ptr());
            }
            let two = self.two_heads::<V>().map(|slot| base.add(slot as usize));
            V::of_two_twice(two, self.first::<V>())
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

/// Whose pairs are in the lanes of a chunk.
pub(super) struct Members {
    /// Pairs in use.
    pub count: usize,
    /// Heads, each with the lane where its row ends.
    rows: [[u32; 2]; CHUNK],
    row_count: usize,
    /// Slots of the heads, lane by lane.
    heads: [u32; ROOM],
    /// Where the partners begin among the slots of the pairs.
    first: usize,
}

impl Members {
    pub(super) fn new() -> Self {
        Self {
            count: 0,
            rows: [[0; 2]; CHUNK],
            row_count: 0,
            heads: [0; ROOM],
            first: 0,
        }
    }

    /// Takes the next pairs of a block, a vector at a time. The lanes behind them hold other pairs, or none.
    #[inline(always)]
    pub(super) fn fill<V: Vector>(
        &mut self,
        near: &Rows,
        walk: &mut Walk,
        companion: &mut impl Companion<V>,
    ) {
        let several = self.enter::<V>(near, walk);
        // The chunk after the next: what a machine foresees by itself ends with a page of memory.
        let next = self.first + self.count + CHUNK;
        ask_for(near.slots.as_ptr().wrapping_add(next), CHUNK);
        let vectors = self.count.div_ceil(V::LANES);
        let mut left = (1 << vectors) - 1;
        // Rows may be short, as in a plane.
        if 2 * several.count_ones() as usize <= vectors {
            // Vectors take no notice of where rows end: hardly any has more than two heads, and those
            // that have are gathered again.
            for lane in (0..self.count).step_by(V::LANES) {
                // SAFETY: slots of particles, for all pairs and a vector more.
                unsafe { companion.take(&self.ends(near, lane, true), lane) };
            }
            left = several;
        }
        while left != 0 {
            let lane = V::LANES * left.trailing_zeros() as usize;
            // SAFETY: as above.
            unsafe { companion.take(&self.ends(near, lane, false), lane) };
            left &= left - 1;
        }
    }

    /// Notes the rows and heads of the next pairs. Bit k of what it returns is set where vector k may have
    /// more than two heads.
    #[inline(always)]
    fn enter<V: Vector>(&mut self, near: &Rows, walk: &mut Walk) -> u64 {
        (self.row_count, self.count) = (0, 0);
        let mut several = 0;
        self.first = walk.pair as usize;
        let stop = walk.stop(&near.ends, CHUNK);
        while let Some((head, pairs)) = walk.next_row(&near.ends, stop) {
            let (lane, end) = (self.count, self.count + pairs.len());
            self.count = end;
            self.rows[self.row_count] = [head, end as u32];
            self.row_count += 1;
            // The next row overwrites what is behind this one.
            for k in (lane..end).step_by(STRIDE) {
                self.heads[k..k + STRIDE].fill(head);
            }
            // A row inside a vector: it has three heads, or more, or is the last one of the chunk.
            let inside = lane % V::LANES != 0 && lane / V::LANES == end / V::LANES;
            several |= u64::from(inside) << (lane / V::LANES);
        }
        // What the last vector holds beyond, whatever it holds: slots of particles.
        let last = self.heads[self.count.max(1) - 1];
        self.heads[self.count..self.count + MOST].fill(last);
        several
    }

    /// The ends of as many pairs as a vector has lanes, from that lane on.
    ///
    /// # Safety
    /// There are as many, or slots behind the last.
    #[inline(always)]
    unsafe fn ends<'a>(&'a self, near: &'a Rows, lane: usize, two: bool) -> Ends<'a> {
        // SAFETY: promised by the caller.
        unsafe {
            Ends {
                heads: &*self.heads.as_ptr().add(lane).cast(),
                others: &*near.slots.as_ptr().add(self.first + lane).cast(),
                two,
            }
        }
    }

    /// Slots of the partners, lane by lane.
    #[inline(always)]
    pub(super) fn others<'a>(&self, near: &'a Rows) -> &'a [u32] {
        &near.slots[self.first..self.first + self.count]
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
            members: Members::new(),
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
        walk: &mut Walk,
        companion: &mut impl Companion<P::Vector<W>>,
    ) {
        let (members, geometry) = self.parts(cell);
        let mut all = Accompanied::<P, W, _, D> {
            geometry,
            place,
            companion,
        };
        members.fill(near, walk, &mut all);
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
            let (head, lanes) = self.members.row_at(n);
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
