//! Increments and autocorrelation of the current of energy on logarithmically spaced lags, without a
//! series: the Einstein-Helfand and the Green-Kubo route to the conductivity. Numbers are kept in
//! reduced units: the current J (not over the volume) and its time integral G.

use super::heat_current::Moments;
use super::lags::{BlockedSums, Lags, Series};
use super::{Observer, View};

/// Columns of the table of sums: origins; the ten products of the increments of the four parts
/// (conduction, friction, pressure, convection); the product of the interval means of the whole
/// current. All are means over the axes.
pub const COLUMNS: usize = 12;

/// Numbers of a sample: moments by part, then the interval mean of the total.
const WIDTH: usize = 4 * 3 + 3;

/// Sums over time origins.
pub struct HeatCorrelator {
    every: u64,
    dimension: usize,
    lags: Lags,
    series: Series,
    sums: BlockedSums,
    last: Option<(u64, Moments)>,
    begun: BlockedSums,
}

impl HeatCorrelator {
    /// Sampled every so many steps; `None` where its memory is not to be had.
    pub fn new(every: u64, dimension: usize, points: usize, levels: usize) -> Option<Self> {
        let lags = Lags::new(points, levels);
        let width = lags.rows()?.checked_mul(COLUMNS)?;
        Some(Self {
            every: every.max(1),
            dimension,
            lags,
            series: Series::new(lags, WIDTH)?,
            sums: BlockedSums::new(width)?,
            last: None,
            begun: BlockedSums::new(width)?,
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
    fn add(row: &mut [f64], now: &[f64], past: &[f64], d: usize) {
        let share = 1.0 / d as f64;
        row[0] += 1.0;
        for a in 0..d {
            let step: [f64; 4] = std::array::from_fn(|p| now[3 * p + a] - past[3 * p + a]);
            let mut column = 1;
            for p in 0..4 {
                for q in p..4 {
                    row[column] += share * step[p] * step[q];
                    column += 1;
                }
            }
            row[11] += share * now[12 + a] * past[12 + a];
        }
    }
}

impl Observer for HeatCorrelator {
    fn every(&self) -> u64 {
        self.every
    }

    fn needs_heat_current(&self) -> bool {
        true
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
        let Some(moments) = view.heat_moment() else {
            return;
        };
        let d = self.dimension;
        if let Some((step, past)) = self.last {
            let interval = (view.step - step) as f64 * view.dt;
            let mut now = [0.0; WIDTH];
            for p in 0..4 {
                for a in 0..3 {
                    now[3 * p + a] = moments[p][a];
                    now[12 + a] += (moments[p][a] - past[p][a]) / interval;
                }
            }
            let (sums, series) = (&mut self.sums, &mut self.series);
            let table = sums.current();
            series.push(&now, |row, _, past| {
                Self::add(
                    &mut table[COLUMNS * row..COLUMNS * (row + 1)],
                    &now,
                    past,
                    d,
                );
            });
            sums.close_sample();
        }
        self.last = Some((view.step, moments));
    }
}
