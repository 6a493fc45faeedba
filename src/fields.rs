//! Kernel sums over particles at given points: the fields of Yang (2013), eq. 2.80, before any
//! division. The kernel and its support belong to the average, not to the simulation.
//!
//! Each point adds up its particles in a fixed order (bucket, row), so threads change no bit.

use rayon::prelude::*;

use crate::kernel::{Kernel, Lucy, QuinticSpline, WendlandC2, WendlandC4};

/// Columns before those of the values: the sum of the weights and the sum of their squares.
pub const LEADING: usize = 2;

/// Buckets per particle at most: where the fluid is thin, buckets grow beyond the support.
const BUCKETS_PER_PARTICLE: usize = 4;
/// Points that one task takes.
const TASK: usize = 16;

/// W h^D of a kernel as a function of q = r/h; `None` for an unknown kernel.
pub fn weight(kernel: &str, dimension: usize) -> Option<fn(f64) -> f64> {
    fn of<K: Kernel>(dimension: usize) -> fn(f64) -> f64 {
        match dimension {
            2 => K::w::<_, 2>,
            _ => K::w::<_, 3>,
        }
    }
    match kernel {
        Lucy::NAME => Some(of::<Lucy>(dimension)),
        QuinticSpline::NAME => Some(of::<QuinticSpline>(dimension)),
        WendlandC2::NAME => Some(of::<WendlandC2>(dimension)),
        WendlandC4::NAME => Some(of::<WendlandC4>(dimension)),
        _ => None,
    }
}

/// One axis of the buckets, all lengths in supports of the averaging kernel.
#[derive(Debug, Clone, Copy)]
struct Axis {
    origin: f64,
    edge: f64,
    periodic: bool,
    cells: usize,
    width: f64,
}

impl Axis {
    /// Cells at least a support wide over a period, or over what the particles span.
    fn new(edge: Option<f64>, coordinates: impl Iterator<Item = f64>) -> Self {
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        if edge.is_none() {
            for x in coordinates {
                (low, high) = (low.min(x), high.max(x));
            }
        }
        let (origin, edge, periodic) = match edge {
            Some(edge) => (0.0, edge, true),
            None if low <= high => (low, high - low, false),
            None => (0.0, 0.0, false),
        };
        // Far more cells than particles are of no use; `coarsen` does the rest.
        let cells = (edge.min(1e6) as usize).max(1);
        let width = (edge / cells as f64).max(1.0);
        Self {
            origin,
            edge,
            periodic,
            cells,
            width,
        }
    }

    fn coarsen(&mut self) {
        self.cells = self.cells.div_ceil(2);
        self.width = (self.edge / self.cells as f64).max(1.0);
    }

    /// The coordinate in the period, if there is one, else as it is.
    fn fold(&self, x: f64) -> f64 {
        if !self.periodic {
            return x;
        }
        let inside = x - self.edge * (x / self.edge).floor();
        if inside < self.edge { inside } else { 0.0 }
    }

    /// Cell of a particle.
    fn cell(&self, x: f64) -> usize {
        (((x - self.origin) / self.width) as usize).min(self.cells - 1)
    }

    /// Cells around a point with the shift of the image in them. A period of one or two cells shows
    /// the same cell more than once, each time as another image.
    fn around(&self, x: f64) -> impl Iterator<Item = (usize, f64)> {
        let (cells, edge, periodic) = (self.cells as i64, self.edge, self.periodic);
        let cell = ((x - self.origin) / self.width).floor();
        let own = cell.clamp(-2.0, cells as f64 + 1.0) as i64;
        let own = if periodic { own.min(cells - 1) } else { own };
        (own - 1..=own + 1).filter_map(move |index| {
            if periodic {
                let turns = index.div_euclid(cells);
                Some((index.rem_euclid(cells) as usize, edge * turns as f64))
            } else {
                (0..cells).contains(&index).then_some((index as usize, 0.0))
            }
        })
    }
}

/// Particles in buckets, with what they carry.
pub struct Cloud {
    axes: [Axis; 3],
    start: Vec<usize>,
    place: Vec<[f64; 3]>,
    values: Vec<f64>,
    width: usize,
}

impl Cloud {
    /// Sorts particles into buckets.
    ///
    /// Lengths are in supports; an edge belongs to a periodic axis, at least one support long.
    /// `values` has `width` numbers a particle.
    pub fn new(
        positions: &[[f64; 3]],
        values: &[f64],
        width: usize,
        edges: [Option<f64>; 3],
    ) -> Self {
        let n = positions.len();
        let mut axes: [Axis; 3] =
            std::array::from_fn(|a| Axis::new(edges[a], positions.iter().map(|p| p[a])));
        let count = |axes: &[Axis; 3]| axes.iter().fold(1_usize, |n, a| n.saturating_mul(a.cells));
        while count(&axes) > (BUCKETS_PER_PARTICLE * n).max(64) {
            let longest = (0..3).max_by_key(|&a| axes[a].cells).unwrap_or(0);
            axes[longest].coarsen();
        }
        let mut cloud = Self {
            axes,
            start: vec![0; count(&axes) + 1],
            place: vec![[0.0; 3]; n],
            values: vec![0.0; n * width],
            width,
        };
        let folded: Vec<[f64; 3]> = positions
            .iter()
            .map(|p| std::array::from_fn(|a| axes[a].fold(p[a])))
            .collect();
        let bucket: Vec<usize> = folded
            .iter()
            .map(|p| cloud.bucket(std::array::from_fn(|a| axes[a].cell(p[a]))))
            .collect();
        for &b in &bucket {
            cloud.start[b + 1] += 1;
        }
        for b in 1..cloud.start.len() {
            cloud.start[b] += cloud.start[b - 1];
        }
        let mut next = cloud.start.clone();
        for (row, &b) in bucket.iter().enumerate() {
            let slot = next[b];
            next[b] += 1;
            cloud.place[slot] = folded[row];
            cloud.values[slot * width..(slot + 1) * width]
                .copy_from_slice(&values[row * width..(row + 1) * width]);
        }
        cloud
    }

    fn bucket(&self, cell: [usize; 3]) -> usize {
        cell[0] + self.axes[0].cells * (cell[1] + self.axes[1].cells * cell[2])
    }

    /// Adds the sums of one point to `row`: of W, of W^2 and of W times each value.
    fn add(&self, point: &[f64; 3], weight: fn(f64) -> f64, row: &mut [f64]) {
        let point: [f64; 3] = std::array::from_fn(|a| self.axes[a].fold(point[a]));
        for (k, turn_z) in self.axes[2].around(point[2]) {
            for (j, turn_y) in self.axes[1].around(point[1]) {
                for (i, turn_x) in self.axes[0].around(point[0]) {
                    let image = [point[0] - turn_x, point[1] - turn_y, point[2] - turn_z];
                    let bucket = self.bucket([i, j, k]);
                    for slot in self.start[bucket]..self.start[bucket + 1] {
                        let place = &self.place[slot];
                        let square: f64 = (0..3).map(|a| (image[a] - place[a]).powi(2)).sum();
                        if square >= 1.0 {
                            continue;
                        }
                        let w = weight(square.sqrt());
                        row[0] += w;
                        row[1] += w * w;
                        let values = &self.values[slot * self.width..(slot + 1) * self.width];
                        for (sum, value) in row[LEADING..].iter_mut().zip(values) {
                            *sum += w * value;
                        }
                    }
                }
            }
        }
    }

    /// The sums at all points, `LEADING + width` numbers each.
    pub fn sums(&self, points: &[[f64; 3]], weight: fn(f64) -> f64) -> Vec<f64> {
        let mut table = vec![0.0; points.len() * self.columns()];
        self.fill(&mut table, points, weight);
        table
    }

    /// The same on the current pool's threads.
    pub fn sums_on_threads(&self, points: &[[f64; 3]], weight: fn(f64) -> f64) -> Vec<f64> {
        let mut table = vec![0.0; points.len() * self.columns()];
        table
            .par_chunks_mut(self.columns() * TASK)
            .zip(points.par_chunks(TASK))
            .for_each(|(rows, points)| self.fill(rows, points, weight));
        table
    }

    fn columns(&self) -> usize {
        LEADING + self.width
    }

    fn fill(&self, rows: &mut [f64], points: &[[f64; 3]], weight: fn(f64) -> f64) {
        for (row, point) in rows.chunks_mut(self.columns()).zip(points) {
            self.add(point, weight, row);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Numbers in [0, 1) without a generator.
    fn scattered(n: usize, seed: u64) -> Vec<[f64; 3]> {
        let mut x = seed;
        let mut next = || {
            x = x
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (x >> 11) as f64 / (1_u64 << 53) as f64
        };
        (0..n).map(|_| [next(), next(), next()]).collect()
    }

    /// All pairs and all images within two edges.
    fn plain(
        point: [f64; 3],
        positions: &[[f64; 3]],
        edges: [Option<f64>; 3],
        weight: fn(f64) -> f64,
    ) -> (f64, f64) {
        let turns = |a: usize| if edges[a].is_some() { -2..=2 } else { 0..=0 };
        let (mut sum, mut first) = (0.0, 0.0);
        for (row, place) in positions.iter().enumerate() {
            for i in turns(0) {
                for j in turns(1) {
                    for k in turns(2) {
                        let shift = [i, j, k];
                        let square: f64 = (0..3)
                            .map(|a| {
                                let image = f64::from(shift[a]) * edges[a].unwrap_or(0.0);
                                (point[a] - place[a] + image).powi(2)
                            })
                            .sum();
                        let w = weight(square.sqrt());
                        sum += w;
                        first += w * row as f64;
                    }
                }
            }
        }
        (sum, first)
    }

    #[test]
    fn sums_equal_those_over_all_images() {
        let weight = weight("lucy", 3).unwrap();
        for edges in [
            [Some(1.0), Some(2.5), Some(4.3)],
            [Some(1.7), None, Some(3.0)],
            [None, None, None],
        ] {
            let scale: [f64; 3] = std::array::from_fn(|a| edges[a].unwrap_or(3.3));
            let place = |p: [f64; 3]| std::array::from_fn(|a| p[a] * scale[a]);
            let positions: Vec<[f64; 3]> = scattered(300, 1).into_iter().map(place).collect();
            let points: Vec<[f64; 3]> = scattered(60, 2).into_iter().map(place).collect();
            let values: Vec<f64> = (0..300).map(f64::from).collect();
            let cloud = Cloud::new(&positions, &values, 1, edges);
            for (row, &point) in cloud.sums(&points, weight).chunks(3).zip(&points) {
                let (sum, first) = plain(point, &positions, edges, weight);
                assert!((row[0] - sum).abs() < 1e-11 * (1.0 + sum), "{row:?} {sum}");
                assert!((row[2] - first).abs() < 1e-11 * (1.0 + first));
            }
        }
    }

    #[test]
    fn empty_places_and_no_particles_give_zero() {
        let weight = weight("wendland_c2", 2).unwrap();
        let far = [[1e9, -1e9, 0.0], [0.5, 0.5, 0.0]];
        let one = Cloud::new(&[[0.5, 0.5, 0.0]], &[], 0, [None; 3]);
        let sums = one.sums(&far, weight);
        assert_eq!((sums[0], sums[1]), (0.0, 0.0));
        assert_eq!(sums[2], weight(0.0));
        let none = Cloud::new(&[], &[], 0, [Some(2.0), None, None]);
        assert_eq!(none.sums(&far, weight), vec![0.0; 4]);
        assert!(super::weight("gauss", 2).is_none());
    }
}
