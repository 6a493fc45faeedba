//! Points sorted into cells: who may be near a place. For the wall models that look for points other
//! than particles; built when the list is.

use crate::domain::PeriodicBox;

/// Cells at least `reach` wide over a set of points; along axes that are not periodic they span what
/// the points span, which may lie beyond the walls.
#[derive(Debug, Clone)]
pub struct Bins {
    low: [f64; 3],
    inverse: [f64; 3],
    counts: [usize; 3],
    periodic: [bool; 3],
    start: Vec<u32>,
    order: Vec<u32>,
}

impl Bins {
    /// Sorts `points` [h].
    pub fn new(points: &[[f64; 3]], reach: f64, dimension: usize, cell: &PeriodicBox) -> Self {
        let (mut low, mut inverse, mut counts) = ([0.0; 3], [1.0; 3], [1; 3]);
        for a in 0..dimension {
            let mut width = cell.edges[a];
            if !cell.periodic[a] {
                let (mut first, mut last) = (f64::INFINITY, f64::NEG_INFINITY);
                for point in points {
                    (first, last) = (first.min(point[a]), last.max(point[a]));
                }
                low[a] = if first.is_finite() { first } else { 0.0 };
                width = (last - low[a]).max(reach);
            }
            // More cells than that only cost memory.
            counts[a] = ((width / reach) as usize).clamp(1, 512);
            inverse[a] = counts[a] as f64 / width;
        }
        let mut bins = Self {
            low,
            inverse,
            counts,
            periodic: cell.periodic,
            start: vec![0; counts.iter().product::<usize>() + 1],
            order: vec![0; points.len()],
        };
        let index = |bins: &Self, point: &[f64; 3]| {
            let at: [usize; 3] = std::array::from_fn(|a| {
                let k = bins.along(a, cell, point[a]).max(0) as usize;
                k.min(bins.counts[a] - 1)
            });
            at[0] + bins.counts[0] * (at[1] + bins.counts[1] * at[2])
        };
        for point in points {
            let k = index(&bins, point);
            bins.start[k + 1] += 1;
        }
        for k in 1..bins.start.len() {
            bins.start[k] += bins.start[k - 1];
        }
        let mut next = bins.start.clone();
        for (number, point) in points.iter().enumerate() {
            let k = index(&bins, point);
            bins.order[next[k] as usize] = number as u32;
            next[k] += 1;
        }
        bins
    }

    fn along(&self, axis: usize, cell: &PeriodicBox, x: f64) -> isize {
        let inside = if self.periodic[axis] {
            cell.wrap(axis, x).0
        } else {
            x
        };
        ((inside - self.low[axis]) * self.inverse[axis]).floor() as isize
    }

    /// Calls `work` for every point that may be within the reach of a place, and some more.
    pub fn visit(&self, place: [f64; 3], cell: &PeriodicBox, mut work: impl FnMut(u32)) {
        let range = |a: usize| {
            let (n, k) = (self.counts[a] as isize, self.along(a, cell, place[a]));
            let periodic = self.periodic[a];
            // A place beyond the cells is still near the outermost ones.
            let k = if periodic { k } else { k.clamp(-1, n) };
            let cells = if periodic && n <= 3 {
                0..n
            } else {
                k - 1..k + 2
            };
            cells.filter_map(move |c| {
                if periodic {
                    Some(c.rem_euclid(n) as usize)
                } else {
                    (0..n).contains(&c).then_some(c as usize)
                }
            })
        };
        for z in range(2) {
            for y in range(1) {
                for x in range(0) {
                    let k = x + self.counts[0] * (y + self.counts[1] * z);
                    for &number in &self.order[self.start[k] as usize..self.start[k + 1] as usize] {
                        work(number);
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::fmix64;

    #[test]
    fn nobody_within_the_reach_is_missed_or_met_twice() {
        for periodic in [[true; 3], [true, false, true], [false; 3]] {
            let cell = PeriodicBox::with_walls(&[2.5, 4.1, 9.0], 1.0, &periodic).unwrap();
            let random = |k: u64| (fmix64(k + 1) >> 11) as f64 / (1_u64 << 53) as f64;
            let points: Vec<[f64; 3]> = (0..300)
                .map(|k| {
                    std::array::from_fn(|a| {
                        let room = if periodic[a] { 0.0 } else { 0.9 };
                        (cell.edges[a] + room) * random(3 * k + a as u64) - 0.5 * room
                    })
                })
                .collect();
            let reach = 1.1;
            let bins = Bins::new(&points, reach, 3, &cell);
            for &place in &points {
                let mut met = Vec::new();
                bins.visit(place, &cell, |number| met.push(number));
                met.sort_unstable();
                assert!(met.windows(2).all(|pair| pair[0] < pair[1]));
                for (number, point) in points.iter().enumerate() {
                    let r: [f64; 3] =
                        std::array::from_fn(|a| cell.separation(a, place[a] - point[a]));
                    if r.iter().map(|x| x * x).sum::<f64>() < reach * reach {
                        assert!(met.binary_search(&(number as u32)).is_ok());
                    }
                }
            }
        }
    }
}
