//! Random numbers of the pairs of a chunk: what they are made of, and how they are drawn in lanes.

use std::marker::PhantomData;

use rayon::prelude::*;

use super::rows::{Ends, Heads, ROOM, whole};
use super::wide::{LANES, Vector};
use super::{CHUNK, Task, Wide, run_wide};
use crate::physics::FrictionForm;
use crate::random::{SweepKey, Variate, pair_counter};
use crate::real::{Real, ln};

/// The random numbers of the pairs of a chunk.
#[repr(align(64))]
pub(super) struct Noise<const N: usize, R: Real = f64> {
    /// Ids of heads and partners, after `draw` the counters made of them.
    names: [[u64; ROOM]; 2],
    sign: [R; ROOM],
    /// Words of pairs; or in the first two those of heads and partners.
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

    /// Takes the words of the particles of as many pairs as a vector has lanes.
    ///
    /// # Safety
    /// `of` has one for every slot, and there are as many lanes from `lane` on.
    #[inline(always)]
    pub(super) unsafe fn take<V: Vector>(&mut self, of: &[u32], ends: &Ends<'_>, lane: usize) {
        // SAFETY: promised by the caller. Those of partners are written one by one: a register would
        // be put together by as many shuffles.
        unsafe {
            let to = [0, 1].map(|n: usize| self.words[n].as_mut_ptr().add(lane));
            let of = |slot: u32| *of.get_unchecked(slot as usize);
            match ends.heads {
                Heads::Two(two, last) => V::store_either(last, two.map(of), to[0]),
                Heads::Each(heads) => {
                    for n in 0..V::LANES {
                        std::ptr::write_volatile(to[0].add(n), of(heads[n]));
                    }
                }
            }
            for n in 0..V::LANES {
                std::ptr::write_volatile(to[1].add(n), of(ends.others[n]));
            }
        }
    }

    /// Takes the words of the particles of one pair.
    pub(super) fn take_pair(&mut self, lane: usize, words: [u32; 2]) {
        for n in 0..2 {
            self.words[n][lane] = words[n];
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

/// What the noise of friction is made of.
pub(super) trait Origin: Copy {
    /// Fills the first `COUNT` rows of variates of so many lanes; where `SIGNED`, those of (i, j) are
    /// those of (j, i) with the other sign.
    fn draw<V: Variate, R: Real, W: Wide, const COUNT: usize, const SIGNED: bool>(
        self,
        noise: &mut Noise<3, R>,
        count: usize,
    );
}

/// Words of each pair, of the ids that are its names; the sign is that of the order of ids.
impl Origin for &SweepKey {
    #[inline(always)]
    fn draw<V: Variate, R: Real, W: Wide, const COUNT: usize, const SIGNED: bool>(
        self,
        noise: &mut Noise<3, R>,
        count: usize,
    ) {
        noise.count(count, SIGNED);
        noise.words::<W>(self, count);
        let Noise {
            words, xi, sign, ..
        } = noise;
        V::draw_lanes::<W::Arithmetic, R, ROOM, COUNT>(words, count, xi);
        if SIGNED {
            for variates in &mut xi[..COUNT] {
                for lane in 0..count.min(ROOM) {
                    variates[lane] = sign[lane] * variates[lane];
                }
            }
        }
    }
}

/// Words of the particles; the sign is that of their order.
#[derive(Clone, Copy)]
pub(super) struct ParticleWords;

impl Origin for ParticleWords {
    #[inline(always)]
    fn draw<V: Variate, R: Real, W: Wide, const COUNT: usize, const SIGNED: bool>(
        self,
        noise: &mut Noise<3, R>,
        count: usize,
    ) {
        let [head, other, ..] = &noise.words;
        V::between::<R, ROOM, COUNT, SIGNED>([head, other], count, &mut noise.xi);
    }
}

/// Draws the noise of friction.
struct Draw<'a, O, V, R: Real, const COUNT: usize, const SIGNED: bool> {
    noise: &'a mut Noise<3, R>,
    origin: O,
    count: usize,
    form: PhantomData<V>,
}

impl<O: Origin, V: Variate, R: Real, const COUNT: usize, const SIGNED: bool> Task
    for Draw<'_, O, V, R, COUNT, SIGNED>
{
    type Output = ();

    #[inline(always)]
    fn run<W: Wide>(self) {
        let count = whole::<R>(self.count);
        let origin = self.origin;
        origin.draw::<V, R, W, COUNT, SIGNED>(self.noise, count);
    }
}

impl<R: Real> Noise<3, R> {
    /// Draws what the form of friction wants of each pair: one number, or D of them, those of (i, j)
    /// being those of (j, i) with the other sign.
    pub(super) fn draw<F: FrictionForm, V: Variate, const D: usize>(
        &mut self,
        origin: impl Origin,
        count: usize,
    ) {
        let (noise, form) = (self, PhantomData::<V>);
        if F::CENTRAL {
            run_wide(Draw::<_, V, R, 1, false> {
                noise,
                origin,
                count,
                form,
            });
        } else {
            run_wide(Draw::<_, V, R, D, true> {
                noise,
                origin,
                count,
                form,
            });
        }
    }
}

/// Draws the words of particles.
struct DrawWords<'a> {
    key: &'a SweepKey,
    ids: &'a [u64],
    words: &'a mut [u32],
}

impl Task for DrawWords<'_> {
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
            words.copy_from_slice(&drawn[0][..words.len()]);
        }
    }
}

/// The word of each particle in a sweep ([`SweepKey::particle_word`]).
pub(super) fn particle_words<'a>(
    key: &SweepKey,
    ids: &[u64],
    words: &'a mut Vec<u32>,
) -> &'a [u32] {
    words.resize(ids.len(), 0);
    let parts = words
        .par_chunks_mut(16 * CHUNK)
        .zip(ids.par_chunks(16 * CHUNK));
    parts.for_each(|(words, ids)| run_wide(DrawWords { key, ids, words }));
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
