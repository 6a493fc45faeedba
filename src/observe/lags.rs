//! What all correlators share: logarithmically spaced lags, the samples they need, and sums kept
//! apart in blocks of time, so that every mean has a standard error.
//!
//! Level l holds the last `points` of the samples taken every 2^l samples (Ramirez et al., J. Chem.
//! Phys. 133 (2010) 154103, without coarse-graining: every lag is exact). Memory does not grow with
//! the run: when all blocks are full, neighbours join and blocks become twice as long.

/// Blocks held at most; never fewer than half of them once as many samples were taken.
pub const BLOCKS: usize = 64;

/// `count` copies of a value, or nothing where there is no memory for them.
pub fn zeros<T: Clone>(value: T, count: usize) -> Option<Vec<T>> {
    let mut values = Vec::new();
    values.try_reserve_exact(count).ok()?;
    values.resize(count, value);
    Some(values)
}

/// Which lags: 0 .. points - 1 samples on level 0, the upper half of them times 2^l on level l.
#[derive(Debug, Clone, Copy)]
pub struct Lags {
    /// Samples held on a level, >= 2.
    pub points: usize,
    /// Levels, 1 to 62.
    pub levels: usize,
}

impl Lags {
    /// Brings both into their ranges.
    pub fn new(points: usize, levels: usize) -> Self {
        Self {
            points: points.max(2),
            levels: levels.clamp(1, 62),
        }
    }

    /// First lag of a level that lower levels do not have.
    pub fn first(&self, level: usize) -> usize {
        if level == 0 { 0 } else { self.points / 2 }
    }

    /// Row of a lag of a level in a table of all lags.
    pub fn row(&self, level: usize, lag: usize) -> usize {
        let upper = self.points - self.points / 2;
        match level {
            0 => lag,
            _ => self.points + (level - 1) * upper + lag - self.points / 2,
        }
    }

    /// Number of rows.
    pub fn rows(&self) -> Option<usize> {
        let upper = self.points - self.points / 2;
        (self.levels - 1)
            .checked_mul(upper)?
            .checked_add(self.points)
    }

    /// Lag of each row, in samples.
    pub fn all(&self) -> Vec<f64> {
        let level_lags = |level: usize| {
            (self.first(level)..self.points).map(move |lag| lag as f64 * 2.0_f64.powi(level as i32))
        };
        (0..self.levels).flat_map(level_lags).collect()
    }
}

/// Where a ring buffer stands.
#[derive(Debug, Clone, Copy, Default)]
pub struct Ring {
    filled: usize,
    next: usize,
}

impl Ring {
    /// Place for the next sample.
    pub fn advance(&mut self, points: usize) -> usize {
        let place = self.next;
        self.next = (self.next + 1) % points;
        self.filled = (self.filled + 1).min(points);
        place
    }

    /// Samples held.
    pub fn filled(&self) -> usize {
        self.filled
    }

    /// Place of the sample taken `lag` samples before the last one.
    pub fn place(&self, lag: usize, points: usize) -> usize {
        (self.next + points - 1 - lag) % points
    }
}

/// Sums of a table in blocks of time.
#[derive(Debug, Clone)]
pub struct BlockedSums {
    width: usize,
    data: Vec<f64>,
    current: usize,
    filled: u64,
    length: u64,
}

impl BlockedSums {
    /// For tables of `width` numbers; `None` where there is no memory for them.
    pub fn new(width: usize) -> Option<Self> {
        Some(Self {
            width,
            data: zeros(0.0, width.checked_mul(BLOCKS)?)?,
            current: 0,
            filled: 0,
            length: 1,
        })
    }

    /// Becomes what another one is, without allocation; both are of the same width.
    pub fn copy_from(&mut self, other: &Self) {
        self.data.copy_from_slice(&other.data);
        (self.current, self.filled, self.length) = (other.current, other.filled, other.length);
    }

    /// The table of the block under way.
    pub fn current(&mut self) -> &mut [f64] {
        let start = self.current * self.width;
        &mut self.data[start..start + self.width]
    }

    /// One more sample is complete.
    pub fn close_sample(&mut self) {
        self.filled += 1;
        if self.filled < self.length {
            return;
        }
        self.filled = 0;
        self.current += 1;
        if self.current == BLOCKS {
            self.join_neighbours();
        }
    }

    fn join_neighbours(&mut self) {
        let width = self.width;
        for block in 0..BLOCKS / 2 {
            for k in 0..width {
                self.data[block * width + k] =
                    self.data[2 * block * width + k] + self.data[(2 * block + 1) * width + k];
            }
        }
        self.data[BLOCKS / 2 * width..].fill(0.0);
        self.current = BLOCKS / 2;
        self.length *= 2;
    }

    /// Samples in a full block.
    pub fn length(&self) -> u64 {
        self.length
    }

    /// Blocks begun, the last one perhaps not full, one after the other.
    pub fn blocks(&self) -> &[f64] {
        let count = self.current + usize::from(self.filled > 0);
        &self.data[..count * self.width]
    }
}

/// Correlates a few series with their own past: rings of samples of `width` numbers.
#[derive(Debug)]
pub struct Series {
    lags: Lags,
    width: usize,
    history: Vec<f64>,
    rings: Vec<Ring>,
    samples: u64,
}

impl Series {
    /// For samples of `width` numbers; `None` where there is no memory for them.
    pub fn new(lags: Lags, width: usize) -> Option<Self> {
        let size = lags.levels.checked_mul(lags.points)?.checked_mul(width)?;
        Some(Self {
            lags,
            width,
            history: zeros(0.0, size)?,
            rings: vec![Ring::default(); lags.levels],
            samples: 0,
        })
    }

    /// Takes a sample and shows it with each of the earlier ones: `visit(row, lag in samples, earlier)`.
    pub fn push(&mut self, now: &[f64], mut visit: impl FnMut(usize, f64, &[f64])) {
        let (points, width) = (self.lags.points, self.width);
        for (level, ring) in self.rings.iter_mut().enumerate() {
            if !self.samples.is_multiple_of(1 << level) {
                break;
            }
            let base = level * points * width;
            let at = base + ring.advance(points) * width;
            self.history[at..at + width].copy_from_slice(now);
            for lag in self.lags.first(level)..ring.filled() {
                let past = base + ring.place(lag, points) * width;
                visit(
                    self.lags.row(level, lag),
                    lag as f64 * 2.0_f64.powi(level as i32),
                    &self.history[past..past + width],
                );
            }
        }
        self.samples += 1;
    }

    /// Begins anew: no lag spans what lies between.
    pub fn clear(&mut self) {
        self.rings.fill(Ring::default());
        self.samples = 0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_lag_is_met_as_often_as_it_should_be() {
        let lags = Lags::new(6, 4);
        let rows = lags.rows().unwrap();
        assert_eq!(lags.all().len(), rows);
        let mut series = Series::new(lags, 1).unwrap();
        let mut seen = vec![0_u64; rows];
        let samples = 100_u64;
        for t in 0..samples {
            series.push(&[t as f64], |row, lag, past| {
                assert_eq!(t as f64 - past[0], lag);
                assert_eq!(lags.all()[row], lag);
                seen[row] += 1;
            });
        }
        for (row, &count) in seen.iter().enumerate() {
            let lag = lags.all()[row] as u64;
            let stride = if row < 6 { 1 } else { 1 << ((row - 6) / 3 + 1) };
            assert_eq!(count, (samples - lag).div_ceil(stride), "lag {lag}");
        }
    }

    #[test]
    fn blocks_join_and_keep_every_sample() {
        let mut sums = BlockedSums::new(2).unwrap();
        for t in 0..1000_u64 {
            sums.current()[0] += 1.0;
            sums.current()[1] += t as f64;
            sums.close_sample();
        }
        let blocks: Vec<_> = sums.blocks().chunks(2).collect();
        assert!(blocks.len() > BLOCKS / 2 && blocks.len() <= BLOCKS);
        assert_eq!(sums.length(), 16);
        let (last, full) = blocks.split_last().unwrap();
        assert!(full.iter().all(|block| block[0] == 16.0));
        assert_eq!(last[0], 8.0);
        assert_eq!(blocks.iter().map(|b| b[1]).sum::<f64>(), 999.0 * 500.0);
    }
}
