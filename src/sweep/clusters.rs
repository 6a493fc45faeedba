//! Number densities in single precision over clusters: all pairs of four particles with four others in one
//! vector, none gathered by itself. Pairs beyond the support come to nothing by themselves; so do those that
//! are none (a particle with itself, one with no particle, the same pair once more), which are set apart
//! as if far away.

use std::marker::PhantomData;

use rayon::prelude::*;

use super::density::weigh_by_roots;
use super::precision::{Mixed, Turns};
use super::rows::Wrap;
use super::wide::{Turning, Vector};
use super::{CHUNK, Shared, Task, Walk, Wide, for_each_block_with, run_wide};
use crate::domain::PeriodicBox;
use crate::kernel::Kernel;
use crate::neighbor::{Clusters, FOUR, Grid, Members, PairList, Rows};
use crate::state::Particles;

/// Lanes of a pair of clusters.
const LANES: usize = FOUR * FOUR;
/// Pairs of clusters in a chunk.
const ENTRIES: usize = CHUNK / LANES;
/// Added to the square of a distance: beyond every support.
const FAR: f32 = 4.0;

/// Four numbers of each of four kinds, in a cache line.
#[derive(Debug, Default, Clone, Copy)]
#[repr(C, align(64))]
pub struct Fours([[f32; FOUR]; 4]);

impl Fours {
    #[inline(always)]
    fn of(&self, kind: usize) -> *const f32 {
        self.0[kind].as_ptr()
    }
}

/// Particles by cluster, and what the sweeps find for them.
#[derive(Debug, Default, Clone)]
pub struct Packed {
    /// x, y, z, and 0 or what sets an absent particle apart.
    place: Vec<Fours>,
    density: Vec<[f64; FOUR]>,
}

impl Packed {
    /// Bytes held.
    pub(super) fn bytes(&self) -> usize {
        size_of::<Fours>() * self.place.capacity() + 8 * FOUR * self.density.capacity()
    }

    /// Takes the positions.
    fn take_places(&mut self, clusters: &Clusters, position: &[[f64; 4]], cell: &PeriodicBox) {
        let turns = Turns::of(cell);
        self.place.resize(clusters.members.len(), Fours::default());
        let places = self.place.par_chunks_mut(CHUNK);
        let all = places.zip(clusters.members.par_chunks(CHUNK));
        all.for_each(|(places, members)| {
            run_wide(Place {
                places,
                members,
                position,
                turns,
            });
        });
    }
}

/// Takes positions to where clusters have them.
struct Place<'a> {
    places: &'a mut [Fours],
    members: &'a [Members],
    position: &'a [[f64; 4]],
    turns: Turns,
}

impl Task for Place<'_> {
    type Output = ();

    #[inline(always)]
    fn run<W: Wide>(self) {
        for (place, members) in self.places.iter_mut().zip(self.members) {
            let mut records = [[0.0; FOUR]; FOUR];
            for (record, &slot) in records.iter_mut().zip(&members.slots) {
                // SAFETY: slots of particles.
                *record = self
                    .turns
                    .of_record(unsafe { self.position.get_unchecked(slot as usize) });
            }
            for (lane, [x, y, z, _]) in records.into_iter().enumerate() {
                place.0[0][lane] = x;
                place.0[1][lane] = y;
                place.0[2][lane] = z;
                let there = lane < members.count as usize;
                place.0[3][lane] = if there { 0.0 } else { FAR };
            }
        }
    }
}

/// What sets pairs of a cluster with itself apart, and others not.
#[repr(align(64))]
struct Apart([[f32; LANES]; 2]);

static APART: Apart = Apart({
    let mut own = [[0.0; LANES]; 2];
    let mut lane = 0;
    while lane < LANES {
        if lane % FOUR <= lane / FOUR {
            own[1][lane] = FAR;
        }
        lane += 1;
    }
    own
});

/// Positions of the head of a row, each as often as it has partners in a vector.
struct Head<V> {
    number: u32,
    place: [V; 3],
    apart: V,
}

impl<V: Turning<Number = f32>> Head<V> {
    /// # Safety
    /// The machine has the instructions.
    #[inline(always)]
    unsafe fn new(number: u32, place: &Fours) -> Self {
        // SAFETY: promised by the caller.
        unsafe {
            Self {
                number,
                place: [
                    V::each(place.of(0)),
                    V::each(place.of(1)),
                    V::each(place.of(2)),
                ],
                apart: V::each(place.of(3)),
            }
        }
    }

    /// Square distances of the particles of another cluster from those of this one.
    ///
    /// # Safety
    /// The machine has the instructions.
    #[inline(always)]
    unsafe fn squares<W: Wide<Single = V>>(
        &self,
        wrap: &Wrap<Mixed, W>,
        number: u32,
        place: &Fours,
    ) -> V {
        let own = &APART.0[usize::from(number == self.number)];
        // SAFETY: promised by the caller.
        unsafe {
            let x = wrap.along(0, self.place[0], V::quad(place.of(0)));
            let y = wrap.along(1, self.place[1], V::quad(place.of(1)));
            let z = wrap.along(2, self.place[2], V::quad(place.of(2)));
            let apart = self.apart.plus(V::quad(place.of(3)));
            let apart = apart.plus(V::load(own.as_ptr()));
            let plane = apart.plus_product(x, x).plus_product(y, y);
            plane.plus_product(z, z)
        }
    }
}

/// Adds up the weights of all pairs of a block.
struct DensityTask<'a, K> {
    rows: &'a Rows,
    cell: &'a PeriodicBox,
    place: &'a [Fours],
    density: Shared<'a, [f64; FOUR]>,
    lanes: &'a mut DensityLanes,
    kernel: PhantomData<K>,
}

/// Square distances of the pairs of a chunk, then their weights.
#[repr(align(64))]
struct DensityLanes([f32; CHUNK]);

impl<K: Kernel> Task for DensityTask<'_, K> {
    type Output = ();

    #[inline(always)]
    fn run<W: Wide>(self) {
        let DensityLanes(weights) = self.lanes;
        let wrap = Wrap::<Mixed, W>::new(self.cell);
        let mut walk = Walk::default();
        while !walk.at_end(&self.rows.ends) {
            let (begin, stop) = (walk, walk.stop(&self.rows.ends, ENTRIES));
            let mut count = 0;
            while let Some((head, entries)) = walk.next_row(&self.rows.ends, stop) {
                // SAFETY: numbers of clusters; a chunk has lanes for so many.
                unsafe {
                    let place = self.place.get_unchecked(head as usize);
                    let head = Head::<W::Single>::new(head, place);
                    for &other in self.rows.slots.get_unchecked(entries) {
                        let place = self.place.get_unchecked(other as usize);
                        let square = head.squares::<W>(&wrap, other, place);
                        square.store(weights.as_mut_ptr().add(count));
                        count += LANES;
                    }
                }
            }
            weigh_by_roots::<K, f32, 3>(&mut weights[..count.min(CHUNK)]);
            let (mut walk, mut lane) = (begin, 0);
            while let Some((head, entries)) = walk.next_row(&self.rows.ends, stop) {
                let mut sum = W::Single::splat(0.0);
                // SAFETY: as above; blocks of one colour share no cluster.
                unsafe {
                    for &other in self.rows.slots.get_unchecked(entries) {
                        let weight = W::Single::load(weights.as_ptr().add(lane));
                        weight.add_quarters(self.density.slot(other).as_mut_ptr());
                        sum = sum.plus(weight);
                        lane += LANES;
                    }
                    let mut sums = [0.0_f32; LANES];
                    sum.store(sums.as_mut_ptr());
                    let own = self.density.slot(head);
                    for (own, [a, b, c, d]) in own.iter_mut().zip(sums.as_chunks().0) {
                        *own += f64::from((a + b) + (c + d));
                    }
                }
            }
        }
    }
}

/// Number densities of all particles, in units of h^-D.
pub(super) fn densities<K: Kernel>(
    particles: &mut Particles,
    grid: &Grid,
    list: &mut PairList,
    cell: &PeriodicBox,
) {
    let Particles {
        position,
        density,
        copies,
        ..
    } = particles;
    list.know_clusters(grid);
    let clusters = &list.clusters;
    let packed = &mut copies.packed;
    packed.take_places(clusters, position, cell);
    packed.density.resize(clusters.members.len(), [0.0; FOUR]);
    packed.density.fill([K::w::<f64, 3>(0.0); FOUR]);
    let sums = Shared::new(&mut packed.density);
    let place = &packed.place[..];
    for_each_block_with(
        grid,
        &list.blocks,
        false,
        || DensityLanes([0.0; CHUNK]),
        |lanes, turn| {
            run_wide(DensityTask::<K> {
                rows: &clusters.rows[turn.number as usize],
                cell,
                place,
                density: sums,
                lanes,
                kernel: PhantomData,
            });
        },
    );
    let density = Shared::new(density);
    let all = clusters.members.par_iter().zip(&packed.density);
    all.with_min_len(512).for_each(|(members, sums)| {
        for (&slot, &sum) in members.present().iter().zip(sums) {
            // SAFETY: a particle is in one cluster.
            unsafe { *density.slot(slot) = sum };
        }
    });
}
