//! Number density by summation, d_i = W(0) + sum_j W(r_ij), and the site pressures that follow.

use std::marker::PhantomData;

use rayon::prelude::*;

use super::precision::{Precision, Turns, Twice};
use super::rows::{Companion, Ends, Members, ROOM, Wrap, row_sums, whole};
use super::wide::Vector;
use super::{Shared, Task, Wide, fetch, for_each_block_with, run_wide};
use crate::domain::PeriodicBox;
use crate::kernel::Kernel;
use crate::neighbor::{Grid, PairList, Rows};
use crate::real::{Real, near_inverse_roots};
use crate::state::Particles;

/// Adds up the weights of all pairs of a block.
struct DensityTask<'a, K, P: Precision, const D: usize> {
    rows: &'a Rows,
    cell: &'a PeriodicBox,
    place: &'a [[P::Real; 4]],
    density: Shared<'a, f64>,
    lanes: &'a mut Lanes<P::Real>,
    kernel: PhantomData<K>,
}

/// Square distances of the pairs of a chunk, then their weights.
#[repr(align(64))]
struct Lanes<R> {
    members: Members,
    weights: [R; ROOM],
    /// 1/r, nearly.
    near: [f32; ROOM],
}

impl<R: Real> Lanes<R> {
    fn new() -> Self {
        Self {
            members: Members::default(),
            weights: [R::ZERO; ROOM],
            near: [0.0; ROOM],
        }
    }
}

/// Fills the lanes with square distances.
struct Squares<'a, P: Precision, W: Wide, const D: usize> {
    wrap: Wrap<P, W>,
    place: &'a [[P::Real; 4]],
    squares: &'a mut [P::Real; ROOM],
}

impl<P: Precision, W: Wide, const D: usize> Companion<P::Vector<W>> for Squares<'_, P, W, D> {
    #[inline(always)]
    unsafe fn take(&mut self, ends: &Ends<'_>, lane: usize) {
        // SAFETY: promised by the caller.
        unsafe {
            let (here, there) = (ends.of_heads(self.place), ends.of_others(self.place));
            let (_, square) = self.wrap.between::<D>(&here, &there);
            square.store(self.squares.as_mut_ptr().add(lane));
        }
    }
}

impl<K: Kernel, P: Precision, const D: usize> Task for DensityTask<'_, K, P, D> {
    type Output = ();

    #[inline(always)]
    fn run<W: Wide>(self) {
        let Lanes {
            members,
            weights,
            near,
        } = self.lanes;
        members.rewind();
        while members.has_more(self.rows) {
            let mut squares = Squares::<P, W, D> {
                wrap: Wrap::new(self.cell),
                place: self.place,
                squares: &mut *weights,
            };
            members.fill(self.rows, &mut squares);
            weigh::<K, P::Real, W, D, _>(weights, near, whole::<P::Real>(members.count));
            for (w, &slot) in weights.iter().zip(members.others(self.rows)) {
                // SAFETY: blocks of one colour share no particle.
                unsafe { *self.density.slot(slot) += w.double() };
            }
            for n in 0..members.row_count() {
                let (head, lanes) = members.row_at(self.rows, n);
                // SAFETY: as above; the row's lanes, and a stride more.
                unsafe {
                    let first = weights.as_ptr().add(lanes.start);
                    let [sum, ..] = row_sums::<P, W, 1>([first], lanes.len());
                    *self.density.slot(head) += sum;
                }
            }
        }
    }
}

/// From the square distances of so many pairs to their weights.
#[inline(always)]
fn weigh<K: Kernel, R: Real, W: Wide, const D: usize, const N: usize>(
    lanes: &mut [R; N],
    near: &mut [f32; N],
    count: usize,
) {
    if R::NARROW {
        weigh_by_roots::<K, R, D>(&mut lanes[..count]);
        return;
    }
    near_inverse_roots(lanes, near, count);
    for (x, &near) in lanes[..count].iter_mut().zip(&*near) {
        let [q, _] = x.distance_from::<W::Arithmetic>(near);
        *x = K::w::<_, D>(q);
    }
}

/// The same in single precision: no more than a root is needed, and it takes half as long as an inverse one.
#[inline(always)]
pub(super) fn weigh_by_roots<K: Kernel, R: Real, const D: usize>(lanes: &mut [R]) {
    for x in lanes {
        *x = K::w::<_, D>(x.sqrt());
    }
}

/// Number densities of all particles, in units of h^-D.
pub fn number_densities<K: Kernel, P: Precision, const D: usize>(
    particles: &mut Particles,
    grid: &Grid,
    list: &mut PairList,
    cell: &PeriodicBox,
) {
    if P::densities_of_clusters::<K, D>(particles, grid, list, cell) {
        return;
    }
    let Particles {
        position,
        density,
        copies,
        ..
    } = particles;
    density.fill(K::w::<_, D>(0.0));
    let density = Shared::new(density);
    let place = P::places(position, cell, &mut copies.place);
    for_each_block_with(grid, &list.blocks, false, Lanes::new, |lanes, turn| {
        fetch(&turn, place.as_ptr(), place.len());
        fetch(&turn, density.pointer(), density.length);
        run_wide(DensityTask::<K, P, D> {
            rows: list.present(turn.number),
            cell,
            place,
            density,
            lanes,
            kernel: PhantomData,
        });
    });
}

/// Writes s = d^(-1/2) and P/d^2 into the particles' records; `pressure(d)` is P in reduced units. Copies of these
/// records for the forces are made on the way.
pub fn site_pressures<P: Precision>(
    particles: &mut Particles,
    cell: &PeriodicBox,
    pressure: impl Fn(f64) -> f64 + Sync,
) {
    let Particles {
        position,
        velocity,
        density,
        copies,
        ..
    } = particles;
    let number = position.len();
    let records = position
        .par_chunks_mut(GRAIN)
        .zip(velocity.par_chunks_mut(GRAIN))
        .zip(density.par_chunks(GRAIN));
    let scale = |position: &mut [[f64; 4]], velocity: &mut [[f64; 4]], density: &[f64]| {
        let mut scalars = [[0.0; GRAIN]; 2];
        for (k, &d) in density.iter().enumerate() {
            scalars[1][k] = pressure(d);
        }
        run_wide(Scale {
            density,
            scalars: &mut scalars,
        });
        for (k, (position, velocity)) in position.iter_mut().zip(velocity).enumerate() {
            position[3] = scalars[0][k];
            velocity[3] = scalars[1][k];
        }
    };
    copies.twice_is_present = P::TOGETHER;
    if !P::TOGETHER {
        records.for_each(|((x, v), d)| scale(x, v, d));
        return;
    }
    let turns = Turns::of(cell);
    copies.twice.resize(number, Twice::default());
    records
        .zip(copies.twice.par_chunks_mut(GRAIN))
        .for_each(|(((x, v), d), copy)| {
            scale(x, v, d);
            for ((to, x), v) in copy.iter_mut().zip(x).zip(v) {
                *to = turns.with_velocity(x, v);
            }
        });
}

/// Particles at a time.
const GRAIN: usize = 512;

/// From densities and pressures to s and P/d^2.
struct Scale<'a> {
    density: &'a [f64],
    scalars: &'a mut [[f64; GRAIN]; 2],
}

impl Task for Scale<'_> {
    type Output = ();

    #[inline(always)]
    fn run<W: Wide>(self) {
        let [size, pressure] = self.scalars;
        for (k, &d) in self.density.iter().enumerate().take(GRAIN) {
            size[k] = 1.0 / d.sqrt();
            pressure[k] /= d * d;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernel::Lucy;
    use crate::random::fmix64;
    use crate::sweep::{CHUNK, Double, Mixed};

    /// Densities of n particles in a ball of that radius are those of a direct sum.
    fn check<P: Precision>(
        n: usize,
        radius: f64,
        (cutoff, skin): (f64, Option<f64>),
        tolerance: f64,
    ) {
        let cell = PeriodicBox::new(&[3.5, 3.5, 3.5], 1.0).unwrap();
        let mut particles = Particles::new(n, false);
        for (k, x) in particles.position.iter_mut().enumerate() {
            for a in 0..3 {
                let word = fmix64((3 * k + a + 1) as u64) >> 11;
                let u = 2.0 * word as f64 / (1_u64 << 53) as f64 - 1.0;
                x[a] = 1.7 + radius * u / 3.0_f64.sqrt();
            }
        }
        let mut grid = Grid::new(&cell, 3, n, cutoff);
        grid.renew(&cell, 3, &mut particles);
        let mut list = PairList::default();
        list.build::<3>(&grid, &cell, &mut particles, cutoff, false);
        if let Some(skin) = skin {
            list.prune::<3>(&cell, &mut particles, 1.0 + skin);
        }
        number_densities::<Lucy, P, 3>(&mut particles, &grid, &mut list, &cell);
        let mut pairs = 0;
        for i in 0..n {
            let mut sum = Lucy::w::<f64, 3>(0.0);
            for j in (0..n).filter(|&j| j != i) {
                let (x, y) = (particles.position[i], particles.position[j]);
                let r = cell.nearest::<3>([x[0] - y[0], x[1] - y[1], x[2] - y[2]]);
                let q = (r[0] * r[0] + r[1] * r[1] + r[2] * r[2]).sqrt();
                sum += Lucy::w::<f64, 3>(q);
                pairs += usize::from(q < 1.0 && j > i);
            }
            assert!((particles.density[i] / sum - 1.0).abs() < tolerance);
        }
        let rows = || (0..list.blocks.len() as u32).map(|block| list.present(block));
        let row = rows().flat_map(Rows::iter).map(|(_, row)| row.len()).max();
        assert_eq!(row.unwrap_or(0) > CHUNK, n > CHUNK);
        let present = list.present_pairs();
        assert!(present >= pairs);
        if skin == Some(0.0) {
            // The hair that makes up for rounding: three times 5e-6 of a volume.
            assert!(present - pairs <= pairs / 30_000);
        }
    }

    #[test]
    fn rows_longer_than_a_chunk_and_shorter_ones_give_direct_sums() {
        for reach in [
            (1.03, None),
            (1.1, Some(0.0)),
            (1.1, Some(0.05)),
            (1.3, Some(0.03)),
        ] {
            check::<Double>(2500, 0.49, reach, 1e-13);
            check::<Double>(1500, 1.4, reach, 1e-13);
            check::<Double>(1, 0.3, reach, 1e-13);
            check::<Mixed>(2500, 0.49, reach, 1e-5);
            check::<Mixed>(1500, 1.4, reach, 1e-5);
        }
    }
}
