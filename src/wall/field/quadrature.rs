//! Points that stand for the fluid and for the solid near a wall, and kernel sums over them.

use rayon::prelude::*;

use super::lattice::{BRICK, Lattice};
use crate::kernel::Kernel;
use crate::sweep::{Task, Wide, run_wide};

/// Parts along each edge of a cell that the surface cuts.
const PARTS: usize = 4;
/// Edge of a bin, in supports; sums reach two bins.
const BIN: f64 = 0.5;
const REACH: i64 = 2;
const LANES: usize = 8;

/// A point with its share of the volume [h^D].
#[derive(Debug, Clone, Copy)]
pub(super) struct Sample {
    pub position: [f64; 3],
    pub phi: f64,
    pub volume: f64,
}

/// Fluid and solid part of a cell: each its centroid, with its volume. `phi` gives the distance at a
/// place within the cell (in units of cells from its corner).
pub(super) fn split(
    lattice: &Lattice,
    corner: [f64; 3],
    phi: impl Fn([f64; 3]) -> f64,
) -> [Option<Sample>; 2] {
    let flat = lattice.dimension == 2;
    let at = |fraction: [f64; 3]| lattice.position([0, 1, 2].map(|a| corner[a] + fraction[a]));
    let middle = [0.5, 0.5, if flat { 0.0 } else { 0.5 }];
    let centre = phi(middle);
    let volume = lattice.volume();
    let whole = |value| {
        Some(Sample {
            position: at(middle),
            phi: value,
            volume,
        })
    };
    // Half a diagonal, and what a spline may be steeper than a distance.
    if centre.abs() > lattice.largest_step() {
        return if centre > 0.0 {
            [whole(centre), None]
        } else {
            [None, whole(centre)]
        };
    }
    let width = lattice.largest_step() / PARTS as f64;
    let layers = if flat { 1 } else { PARTS };
    let mut sums = [[0.0; 4]; 2];
    for i in 0..PARTS {
        for j in 0..PARTS {
            for k in 0..layers {
                let part = |n: usize| (n as f64 + 0.5) / PARTS as f64;
                let fraction = [part(i), part(j), if flat { 0.0 } else { part(k) }];
                let share = (phi(fraction) / width + 0.5).clamp(0.0, 1.0);
                for (sum, share) in sums.iter_mut().zip([share, 1.0 - share]) {
                    sum[3] += share;
                    for a in 0..3 {
                        sum[a] += share * fraction[a];
                    }
                }
            }
        }
    }
    let parts = (PARTS * PARTS * layers) as f64;
    sums.map(|[x, y, z, share]| {
        (share > 1e-9).then(|| {
            let place = [x, y, z].map(|x| x / share);
            Sample {
                position: at(place),
                phi: phi(place),
                volume: volume * share / parts,
            }
        })
    })
}

/// Points sorted into bins; sums over them do not depend on threads.
pub(super) struct Bins {
    dimension: usize,
    periodic: [bool; 3],
    origin: [f64; 3],
    width: [f64; 3],
    counts: [usize; 3],
    start: Vec<u32>,
    /// Smallest phi of each bin.
    lowest: Vec<f64>,
    /// Coordinates, distance to the wall and volume, each in its array; bins are padded to whole
    /// lanes with points far away.
    columns: [Vec<f64>; 5],
    /// Place of each point.
    place: Vec<u32>,
}

impl Bins {
    pub fn new(lattice: &Lattice, points: &[Sample]) -> Self {
        let dimension = lattice.dimension;
        let (mut counts, mut width) = ([1; 3], [1.0; 3]);
        for a in 0..dimension {
            let length = lattice.length(a);
            counts[a] = ((length / BIN) as usize).max(1);
            width[a] = length / counts[a] as f64;
        }
        let mut bins = Self {
            dimension,
            periodic: lattice.periodic,
            origin: lattice.origin,
            width,
            counts,
            start: Vec::new(),
            lowest: vec![f64::INFINITY; counts.iter().product()],
            columns: Default::default(),
            place: vec![0; points.len()],
        };
        let owner: Vec<usize> = points.iter().map(|p| bins.bin_of(p.position)).collect();
        let mut number = vec![0u32; counts.iter().product::<usize>() + 1];
        for &bin in &owner {
            number[bin + 1] += 1;
        }
        for k in 1..number.len() {
            number[k] = number[k - 1] + number[k].next_multiple_of(LANES as u32);
        }
        let total = number[number.len() - 1] as usize;
        bins.columns = [0.0, 0.0, 0.0, 1.0, 0.0].map(|rest| vec![rest; total]);
        bins.columns[0].fill(1e6);
        let mut next = number.clone();
        for (k, point) in points.iter().enumerate() {
            let at = next[owner[k]] as usize;
            next[owner[k]] += 1;
            bins.place[k] = at as u32;
            bins.lowest[owner[k]] = bins.lowest[owner[k]].min(point.phi);
            let [x, y, z] = point.position;
            for (column, value) in bins
                .columns
                .iter_mut()
                .zip([x, y, z, point.phi, point.volume])
            {
                column[at] = value;
            }
        }
        bins.start = number;
        bins
    }

    fn coordinate(&self, axis: usize, x: f64) -> i64 {
        let count = self.counts[axis] as i64;
        let index = ((x - self.origin[axis]) / self.width[axis]).floor() as i64;
        if self.periodic[axis] {
            index.rem_euclid(count)
        } else {
            index.clamp(0, count - 1)
        }
    }

    fn bin_of(&self, position: [f64; 3]) -> usize {
        let [x, y, z] = std::array::from_fn(|a| {
            if a < self.dimension {
                self.coordinate(a, position[a]) as usize
            } else {
                0
            }
        });
        (x * self.counts[1] + y) * self.counts[2] + z
    }

    /// Volumes times `weight`, in the order of the columns.
    pub fn weighted(&self, weight: &[f64]) -> Vec<f64> {
        let mut result = vec![0.0; self.columns[4].len()];
        for (&place, &weight) in self.place.iter().zip(weight) {
            result[place as usize] = self.columns[4][place as usize] * weight;
        }
        result
    }

    /// The volumes themselves.
    pub fn volumes(&self) -> Vec<f64> {
        self.columns[4].clone()
    }

    /// Sums of `value` W(sqrt(r^2 + 4 phi phi')) over all points, from each target (position, phi);
    /// with phi = 0 the kernel of the direct distance.
    pub fn sums<K: Kernel, const D: usize>(
        &self,
        targets: &[([f64; 3], f64)],
        value: &[f64],
    ) -> Vec<f64> {
        targets
            .par_chunks(64)
            .flat_map_iter(|chunk| {
                let mut result = vec![0.0; chunk.len()];
                run_wide(Sums::<K, D> {
                    bins: self,
                    targets: chunk,
                    value,
                    result: &mut result,
                    kernel: std::marker::PhantomData,
                });
                result
            })
            .collect()
    }

    /// Bins along an axis that a target reaches: number, the target as seen from there, and the
    /// square of the gap between both.
    #[inline(always)]
    fn reached(&self, axis: usize, x: f64) -> ([(usize, f64, f64); 5], usize) {
        let mut found = [(0, x, 0.0); 5];
        if axis >= self.dimension {
            return (found, 1);
        }
        let count = self.counts[axis] as i64;
        let mut n = 0;
        let raw = ((x - self.origin[axis]) / self.width[axis]).floor() as i64;
        for offset in -REACH..=REACH {
            let bin = raw + offset;
            let turns = bin.div_euclid(count);
            if turns != 0 && !self.periodic[axis] {
                continue;
            }
            let shifted = x - turns as f64 * count as f64 * self.width[axis];
            let low = self.origin[axis] + bin as f64 * self.width[axis];
            let gap = (low - x).max(x - low - self.width[axis]).max(0.0);
            if gap < 1.0 {
                found[n] = ((bin - turns * count) as usize, shifted, gap * gap);
                n += 1;
            }
        }
        (found, n)
    }
}

struct Sums<'a, K, const D: usize> {
    bins: &'a Bins,
    targets: &'a [([f64; 3], f64)],
    value: &'a [f64],
    result: &'a mut [f64],
    kernel: std::marker::PhantomData<K>,
}

impl<K: Kernel, const D: usize> Task for Sums<'_, K, D> {
    type Output = ();
    #[inline(always)]
    fn run<W: Wide>(self) {
        let bins = self.bins;
        for (result, (position, phi)) in self.result.iter_mut().zip(self.targets) {
            let axes: [_; 3] = std::array::from_fn(|a| bins.reached(a, position[a]));
            let four = 4.0 * phi;
            let mut sum = [0.0; LANES];
            for &(x_bin, x, x_gap) in &axes[0].0[..axes[0].1] {
                for &(y_bin, y, y_gap) in &axes[1].0[..axes[1].1] {
                    for &(z_bin, z, z_gap) in &axes[2].0[..axes[2].1] {
                        let bin = (x_bin * bins.counts[1] + y_bin) * bins.counts[2] + z_bin;
                        // No point of the bin is nearer than that; phi = 0 asks for the direct
                        // distance, and behind a wall images may be nearer than their particles.
                        let nearest =
                            x_gap + y_gap + z_gap + four.max(0.0) * bins.lowest[bin].max(0.0);
                        if *phi >= 0.0 && nearest >= 1.0 {
                            continue;
                        }
                        let (begin, end) = (bins.start[bin] as usize, bins.start[bin + 1] as usize);
                        let [xs, ys, zs, phis] = [0, 1, 2, 3]
                            .map(|c| bins.columns[c][begin..end].as_chunks::<LANES>().0);
                        let values = self.value[begin..end].as_chunks::<LANES>().0;
                        for k in 0..xs.len() {
                            for l in 0..LANES {
                                let (dx, dy) = (x - xs[k][l], y - ys[k][l]);
                                let mut r2 = dx * dx + dy * dy;
                                if D == 3 {
                                    r2 += (z - zs[k][l]) * (z - zs[k][l]);
                                }
                                // A point may be behind the wall.
                                let q = (r2 + four * phis[k][l]).max(0.0).sqrt();
                                sum[l] += values[k][l] * K::w::<_, D>(q);
                            }
                        }
                    }
                }
            }
            *result = sum.iter().sum();
        }
    }
}

/// All cells of a brick: fluid and solid parts.
pub(super) fn cells(
    lattice: &Lattice,
    brick: usize,
    phi: impl Fn([usize; 3], [f64; 3]) -> f64,
) -> Vec<[Option<Sample>; 2]> {
    let corner = lattice.brick(brick);
    lattice
        .indices(BRICK)
        .map(|cell| {
            let at = [0, 1, 2].map(|a| (corner[a] * BRICK + cell[a]) as f64);
            split(lattice, at, |fraction| phi(cell, fraction))
        })
        .collect()
}
