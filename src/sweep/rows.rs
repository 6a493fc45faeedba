//! Pairs in lanes: the rows of a block's list, as many at a time as a chunk takes, and of these the
//! pairs within the support.

use std::marker::PhantomData;
use std::ops::Range;

use rayon::prelude::*;

use super::precision::{Double, Precision};
use super::wide::{LANES, Vector};
use super::{CHUNK, Shared, Task, Walk, Wide, run_wide};
use crate::domain::PeriodicBox;
use crate::neighbor::{BlockList, Rows};
use crate::physics::FrictionForm;
use crate::random::{SweepKey, Variate, pair_counter};
use crate::real::{ROUNDER, Real, ln};

/// Lanes of the widest registers.
pub(crate) const MOST: usize = 2 * LANES;

/// Lanes of a chunk, with room for what the last ones leave over.
pub(super) const ROOM: usize = CHUNK + MOST;

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
fn four<V: Vector>(numbers: &[V::Number; 4]) -> [V; 4] {
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
    fn along(&self, axis: usize, first: P::Vector<W>, second: P::Vector<W>) -> P::Vector<W> {
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

/// Finds which of `count` partners of a head, from the `first` of the list on, are within the support:
/// their square distances go to the front of `r2`, their slots into `near` from `length` on. Returns
/// how many they are.
///
/// # Safety
/// The partners are pairs of `block`, whose slots are those of `place`; `r2` is good for as
/// many numbers and a vector more; `near` has room for as many slots as the list of the block.
#[inline(always)]
#[allow(clippy::too_many_arguments)]
pub(super) unsafe fn near_partners<P: Precision, W: Wide, const D: usize>(
    block: &BlockList,
    cell: &PeriodicBox,
    place: &[[P::Real; 4]],
    head: u32,
    first: usize,
    count: usize,
    r2: *mut P::Real,
    near: &mut Rows,
    length: usize,
) -> usize {
    let head_at = Separation::<P, W>::new(&place[head as usize], cell);
    let support = P::Vector::<W>::splat(P::Real::of(1.0));
    let mut found = 0;
    for k in (0..count).step_by(P::Vector::<W>::LANES) {
        // SAFETY: slots of particles; a list has room for a vector more than its pairs.
        unsafe {
            let mut from = block.neighbours.as_ptr().add(first + k);
            let other = P::Vector::<W>::columns(place.as_ptr(), from);
            let (_, square) = head_at.from::<D>(&other);
            let mut keep = square.below(support) & first_lanes::<P::Vector<W>>(count - k);
            square.store_kept(keep, r2.add(found));
            for _ in (0..P::Vector::<W>::LANES).step_by(LANES) {
                let kept = W::kept(from.cast::<[u32; LANES]>().read_unaligned(), keep as u8);
                let to = near.slots.as_mut_ptr().add(length + found);
                to.cast::<[u32; LANES]>().write_unaligned(kept);
                found += (keep & 0xff).count_ones() as usize;
                from = from.add(LANES);
                keep >>= LANES;
            }
        }
    }
    found
}

/// Slots of both ends of as many pairs as a vector has lanes.
pub(super) struct Ends<'a> {
    heads: &'a [u32; MOST],
    /// Have all of them the same head?
    one: bool,
    others: &'a [u32; MOST],
}

impl Ends<'_> {
    /// The columns of the heads' records.
    ///
    /// # Safety
    /// `base` has a record for every slot.
    #[inline(always)]
    pub(super) unsafe fn of_heads<V: Vector>(&self, base: &[[V::Number; 4]]) -> [V; 4] {
        if self.one {
            // SAFETY: promised by the caller.
            four(unsafe { base.get_unchecked(self.heads[0] as usize) })
        } else {
            // SAFETY: as above.
            unsafe { V::columns(base.as_ptr(), self.heads.as_ptr()) }
        }
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

/// What a sweep wants to know of pairs beside their geometry.
pub(super) trait Companion<V: Vector> {
    /// As many pairs as a vector has lanes; theirs begin at `lane`.
    ///
    /// # Safety
    /// The ends are slots of particles, and there are as many lanes.
    unsafe fn take(&mut self, ends: &Ends<'_>, lane: usize);
}

/// The geometry of the pairs of a chunk.
#[repr(align(64))]
pub(super) struct Pairs<P: Precision = Double> {
    /// Pairs in use.
    pub count: usize,
    /// Heads, each with the lane where its row ends.
    rows: [[u32; 2]; CHUNK],
    row_count: usize,
    /// Slots of the heads, lane by lane.
    heads: [u32; ROOM],
    /// Where the partners begin among the slots of the near pairs.
    pub first: usize,
    pub r: [[P::Real; ROOM]; 3],
    pub r2: [P::Real; ROOM],
    /// s_i s_j.
    pub weight: [P::Real; ROOM],
}

impl<P: Precision> Pairs<P> {
    pub(super) fn new() -> Self {
        Self {
            count: 0,
            rows: [[0; 2]; CHUNK],
            row_count: 0,
            heads: [0; ROOM],
            first: 0,
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
        (self.row_count, self.count) = (0, 0);
        let stop = walk.stop(&near.ends, CHUNK);
        let mut end = stop as usize;
        while let Some((head, pairs)) = walk.next_row(&near.ends, stop) {
            let lane = self.count;
            end = pairs.end;
            self.count += pairs.len();
            self.rows[self.row_count] = [head, self.count as u32];
            self.row_count += 1;
            // A vector at a time: the next row overwrites what is behind this one.
            for k in (lane..self.count).step_by(MOST) {
                self.heads[k..k + MOST].fill(head);
            }
        }
        // What the last vector holds beyond, whatever it holds: slots of particles.
        let last = self.heads[self.count.max(1) - 1];
        self.heads[self.count..self.count + MOST].fill(last);
        let wrap = Wrap::<P, W>::new(cell);
        self.first = end - self.count;
        // Vectors take no notice of where rows end: most have one head, the others gather theirs.
        for lane in (0..self.count).step_by(P::Vector::<W>::LANES) {
            // SAFETY: slots of particles; lanes for all pairs and a vector more.
            unsafe {
                let heads = &*self.heads.as_ptr().add(lane).cast::<[u32; MOST]>();
                let ends = Ends {
                    heads,
                    one: heads[0] == heads[P::Vector::<W>::LANES - 1],
                    others: &*near.slots.as_ptr().add(self.first + lane).cast(),
                };
                let (here, there) = (ends.of_heads(place), ends.of_others(place));
                let (r, r2) = wrap.between::<D>(&here, &there);
                for a in 0..D {
                    r[a].store(self.r[a].as_mut_ptr().add(lane));
                }
                r2.store(self.r2.as_mut_ptr().add(lane));
                let weight = P::Vector::<W>::times(here[3], there[3]);
                weight.store(self.weight.as_mut_ptr().add(lane));
                companion.take(&ends, lane);
            }
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

    /// Adds what is in the lanes to the heads and takes it from the partners.
    ///
    /// # Safety
    /// The pairs are those of `near`; no other thread uses the slots of this block.
    #[inline(always)]
    pub(super) unsafe fn scatter(
        &self,
        near: &Rows,
        records: &[[P::Real; 4]; ROOM],
        target: &Shared<'_, [f64; 4]>,
    ) {
        let others = &near.slots[self.first..self.first + self.count];
        for n in 0..self.row_count() {
            let (head, lanes) = self.row_at(n);
            // Two sums, so that an addition need not wait for the one before.
            let (mut even, mut odd) = ([0.0; 4], [0.0; 4]);
            let (mut lane, end) = (lanes.start, lanes.end);
            // SAFETY: promised by the caller; a partner is never the head itself.
            unsafe {
                while lane + 1 < end {
                    Self::take(records, others, target, lane, &mut even);
                    Self::take(records, others, target, lane + 1, &mut odd);
                    lane += 2;
                }
                if lane < end {
                    Self::take(records, others, target, lane, &mut even);
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
        records: &[[P::Real; 4]; ROOM],
        others: &[u32],
        target: &Shared<'_, [f64; 4]>,
        lane: usize,
        sum: &mut [f64; 4],
    ) {
        // SAFETY: promised by the caller.
        let (record, other) = unsafe {
            (
                records.get_unchecked(lane),
                target.slot(*others.get_unchecked(lane)),
            )
        };
        for a in 0..4 {
            let number = record[a].double();
            sum[a] += number;
            other[a] -= number;
        }
    }
}

/// The random numbers of the pairs of a chunk.
#[repr(align(64))]
pub(super) struct Noise<const N: usize, R: Real = f64> {
    /// Ids of heads and partners, after `draw` the counters made of them; or words of particles.
    names: [[u64; ROOM]; 2],
    sign: [R; ROOM],
    words: [[u32; ROOM]; 4],
    /// Variates.
    pub xi: [[R; ROOM]; N],
}

impl<const N: usize, R: Real> Noise<N, R> {
    pub(super) fn new() -> Self {
        Self {
            names: [[0; ROOM]; 2],
            sign: [R::of(1.0); ROOM],
            words: [[0; ROOM]; 4],
            xi: [[R::ZERO; ROOM]; N],
        }
    }

    /// Takes the names of as many pairs as a vector has lanes.
    ///
    /// # Safety
    /// `of` has one for every slot, and there are as many lanes from `lane` on.
    #[inline(always)]
    pub(super) unsafe fn name<V: Vector>(&mut self, of: &[u64], ends: &Ends<'_>, lane: usize) {
        // SAFETY: promised by the caller. Written one by one: a register would be put together by
        // as many shuffles.
        unsafe {
            let to = [0, 1].map(|n: usize| self.names[n].as_mut_ptr().add(lane));
            if ends.one {
                let head = *of.get_unchecked(ends.heads[0] as usize);
                std::slice::from_raw_parts_mut(to[0], V::LANES).fill(head);
            } else {
                for n in 0..V::LANES {
                    let head = *of.get_unchecked(ends.heads[n] as usize);
                    std::ptr::write_volatile(to[0].add(n), head);
                }
            }
            for n in 0..V::LANES {
                let other = *of.get_unchecked(ends.others[n] as usize);
                std::ptr::write_volatile(to[1].add(n), other);
            }
        }
    }

    /// Takes the names of one pair.
    pub(super) fn name_pair(&mut self, lane: usize, names: [u64; 2]) {
        for n in 0..2 {
            self.names[n][lane] = names[n];
        }
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
                self.sign[lane] = R::of(if head < other { 1.0 } else { -1.0 });
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

    /// Draws the words of all lanes, once the pairs are counted.
    #[inline(always)]
    fn words<W: Wide>(&mut self, key: &SweepKey, count: usize) {
        W::philox(&self.names, key.tail, key.key, &mut self.words, count);
    }

    /// The words of a lane.
    #[inline(always)]
    fn drawn(&self, lane: usize) -> [u64; 4] {
        let [a, b, c, d] = &self.words;
        [a[lane], b[lane], c[lane], d[lane]].map(u64::from)
    }
}

/// Draws the noise of friction.
struct Draw<'a, V, R: Real, const COUNT: usize, const SIGNED: bool> {
    noise: &'a mut Noise<3, R>,
    key: &'a SweepKey,
    count: usize,
    form: PhantomData<V>,
}

impl<V: Variate, R: Real, const COUNT: usize, const SIGNED: bool> Task
    for Draw<'_, V, R, COUNT, SIGNED>
{
    type Output = ();

    #[inline(always)]
    fn run<W: Wide>(self) {
        let (noise, count) = (self.noise, whole::<R>(self.count));
        noise.count(count, SIGNED);
        noise.words::<W>(self.key, count);
        for lane in 0..count {
            let words = noise.drawn(lane);
            let xi = V::draw::<W::Arithmetic, R>(words, noise.sign[lane], COUNT);
            for a in 0..COUNT {
                noise.xi[a][lane] = xi[a];
            }
        }
    }
}

impl<R: Real> Noise<3, R> {
    /// Draws what the form of friction wants of each pair: one number, or D of them, those of (i, j)
    /// being those of (j, i) with the other sign.
    pub(super) fn draw<F: FrictionForm, V: Variate, const D: usize>(
        &mut self,
        key: &SweepKey,
        count: usize,
    ) {
        let (noise, form) = (self, PhantomData::<V>);
        if F::CENTRAL {
            run_wide(Draw::<V, R, 1, false> {
                noise,
                key,
                count,
                form,
            });
        } else {
            run_wide(Draw::<V, R, D, true> {
                noise,
                key,
                count,
                form,
            });
        }
    }
}

/// Draws the noise of forces, where the names are the words of the particles.
struct DrawBetween<'a, V, R: Real, const COUNT: usize, const SIGNED: bool> {
    noise: &'a mut Noise<3, R>,
    count: usize,
    form: PhantomData<V>,
}

impl<V: Variate, R: Real, const COUNT: usize, const SIGNED: bool> Task
    for DrawBetween<'_, V, R, COUNT, SIGNED>
{
    type Output = ();

    #[inline(always)]
    fn run<W: Wide>(self) {
        let count = whole::<R>(self.count);
        let Noise { names, xi, .. } = self.noise;
        V::between::<R, ROOM, COUNT, SIGNED>(names, count, xi);
    }
}

impl<R: Real> Noise<3, R> {
    /// The same as `draw` where the names are the words of the particles ([`particle_words`]); the
    /// order of these words is that of the signs.
    pub(super) fn draw_between<F: FrictionForm, V: Variate, const D: usize>(
        &mut self,
        count: usize,
    ) {
        let (noise, form) = (self, PhantomData::<V>);
        if F::CENTRAL {
            run_wide(DrawBetween::<V, R, 1, false> { noise, count, form });
        } else {
            run_wide(DrawBetween::<V, R, D, true> { noise, count, form });
        }
    }
}

struct ParticleWords<'a> {
    key: &'a SweepKey,
    ids: &'a [u64],
    words: &'a mut [u64],
}

impl Task for ParticleWords<'_> {
    type Output = ();

    #[inline(always)]
    fn run<W: Wide>(self) {
        let mut names = [[0; CHUNK]; 2];
        let mut drawn = [[0; CHUNK]; 4];
        for (ids, words) in self.ids.chunks(CHUNK).zip(self.words.chunks_mut(CHUNK)) {
            for (lane, &id) in ids.iter().enumerate() {
                [names[0][lane], names[1][lane]] = pair_counter(id, id);
            }
            let count = ids.len().next_multiple_of(LANES);
            W::philox(&names, self.key.tail, self.key.key, &mut drawn, count);
            for (lane, word) in words.iter_mut().enumerate() {
                *word = u64::from(drawn[0][lane]) | u64::from(drawn[1][lane]) << 32;
            }
        }
    }
}

/// The word of each particle in a sweep ([`SweepKey::particle_word`]).
pub(super) fn particle_words<'a>(
    key: &SweepKey,
    ids: &[u64],
    words: &'a mut Vec<u64>,
) -> &'a [u64] {
    words.resize(ids.len(), 0);
    let parts = words
        .par_chunks_mut(16 * CHUNK)
        .zip(ids.par_chunks(16 * CHUNK));
    parts.for_each(|(words, ids)| run_wide(ParticleWords { key, ids, words }));
    words
}

impl Noise<4> {
    /// Draws four variates for each pair, with the sign of the order of ids.
    #[inline(always)]
    pub(super) fn draw_four<V: Variate, W: Wide>(&mut self, key: &SweepKey, count: usize) {
        let count = whole::<f64>(count);
        self.count(count, true);
        self.words::<W>(key, count);
        for lane in 0..count {
            let xi = V::draw_four::<W::Arithmetic>(self.drawn(lane));
            for a in 0..4 {
                self.xi[a][lane] = self.sign[lane] * xi[a];
            }
        }
    }

    /// Logarithms of two numbers in (0, 1) for each pair that has been drawn for.
    #[inline(always)]
    pub(super) fn logarithms<W: Wide>(
        &mut self,
        key: &SweepKey,
        count: usize,
        chance: &mut [[f64; ROOM]; 2],
    ) {
        let count = whole::<f64>(count);
        self.words::<W>(key, count);
        for lane in 0..count {
            let words = self.drawn(lane);
            for n in 0..2 {
                chance[n][lane] = ln(f64::unit_interval(words[n]));
            }
        }
    }
}
