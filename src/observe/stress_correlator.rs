//! Increments and autocorrelation of the stress on logarithmically spaced lags, without a series:
//! the Einstein-Helfand and the Green-Kubo route to the viscosities. Numbers are kept in reduced
//! units: V P and its time integral G.

use super::lags::{BlockedSums, Lags, Series};
use super::stress::Moments;
use super::{Observer, Parts, View};

/// Columns of the table of sums: origins; the ten products of the increments of the four parts
/// (kinetic, conservative, drag, random; only sums of the last three where parts are not told apart)
/// averaged over the off-diagonal elements; square and value of the increment of tr G/D; the square
/// of those on the diagonal, averaged, and the value of each. Then products of the interval means of
/// V P: those off the diagonal; of tr P/D, with the mean of both values; of those on the diagonal,
/// with that mean of each.
pub const COLUMNS: usize = 24;

/// Numbers of a sample: moments by part, then the interval means of the total.
const WIDTH: usize = 36 + 9;

/// Sums over time origins.
pub struct StressCorrelator {
    every: u64,
    dimension: usize,
    parts: Parts,
    lags: Lags,
    series: Series,
    sums: BlockedSums,
    last: Option<(u64, Moments)>,
    /// First interval's tr P/D, taken off: squares of small differences keep their digits.
    reference: Option<f64>,
    begun: BlockedSums,
}

impl StressCorrelator {
    /// Sampled every so many steps; `None` where its memory is not to be had.
    pub fn new(
        every: u64,
        dimension: usize,
        parts: Parts,
        points: usize,
        levels: usize,
    ) -> Option<Self> {
        let lags = Lags::new(points, levels);
        Some(Self {
            every: every.max(1),
            dimension,
            parts,
            lags,
            series: Series::new(lags, WIDTH)?,
            sums: BlockedSums::new(lags.rows()?.checked_mul(COLUMNS)?)?,
            last: None,
            reference: None,
            begun: BlockedSums::new(lags.rows()?.checked_mul(COLUMNS)?)?,
        })
    }

    /// The lags.
    pub fn lags(&self) -> Lags {
        self.lags
    }

    /// Sums at each lag, block by block.
    pub fn sums(&self) -> &BlockedSums {
        &self.sums
    }

    /// Adds the products of one pair of samples to a row.
    fn add(row: &mut [f64], now: &[f64], past: &[f64], time: f64, reference: f64, d: usize) {
        let (off, share) = (1.0 / (d * (d - 1)) as f64, 1.0 / d as f64);
        row[0] += 1.0;
        let (mut trace, mut trace_now, mut trace_past) = (0.0, 0.0, 0.0);
        for a in 0..d {
            for b in 0..d {
                let k = 3 * a + b;
                let step: [f64; 4] = std::array::from_fn(|p| now[9 * p + k] - past[9 * p + k]);
                let (mean, earlier) = (now[36 + k], past[36 + k]);
                if a == b {
                    let whole = step.iter().sum::<f64>() - reference * time;
                    let (mean, earlier) = (mean - reference, earlier - reference);
                    trace += whole;
                    trace_now += mean;
                    trace_past += earlier;
                    row[13] += share * whole * whole;
                    row[14 + a] += whole;
                    row[20] += share * mean * earlier;
                    row[21 + a] += 0.5 * (mean + earlier);
                    continue;
                }
                let mut column = 1;
                for p in 0..4 {
                    for q in p..4 {
                        row[column] += off * step[p] * step[q];
                        column += 1;
                    }
                }
                row[17] += off * mean * earlier;
            }
        }
        row[11] += (trace * share).powi(2);
        row[12] += trace * share;
        row[18] += trace_now * trace_past * share * share;
        row[19] += 0.5 * (trace_now + trace_past) * share;
    }
}

impl Observer for StressCorrelator {
    fn every(&self) -> u64 {
        self.every
    }

    fn needs_stress(&self) -> Option<Parts> {
        Some(self.parts)
    }

    fn begin(&mut self) {
        self.begun.copy_from(&self.sums);
    }

    fn forget(&mut self) {
        self.sums.copy_from(&self.begun);
        self.series.clear();
        self.last = None;
    }

    fn sample(&mut self, view: &View) {
        let Some(tally) = view.tally else { return };
        let d = self.dimension;
        if let Some((step, moments)) = self.last {
            let interval = (view.step - step) as f64 * view.dt;
            let mut now = [0.0; WIDTH];
            for p in 0..4 {
                for k in 0..9 {
                    now[9 * p + k] = tally.moment[p][k];
                    now[36 + k] += (tally.moment[p][k] - moments[p][k]) / interval;
                }
            }
            let trace = (0..d).map(|a| now[36 + 4 * a]).sum::<f64>() / d as f64;
            let reference = *self.reference.get_or_insert(trace);
            let (sums, series) = (&mut self.sums, &mut self.series);
            let table = sums.current();
            series.push(&now, |row, lag, past| {
                let row = &mut table[COLUMNS * row..COLUMNS * (row + 1)];
                Self::add(row, &now, past, lag * interval, reference, d);
            });
            sums.close_sample();
        }
        self.last = Some((view.step, tally.moment));
    }
}
