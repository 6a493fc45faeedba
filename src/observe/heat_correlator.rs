//! Increments and autocorrelation of the current of energy on logarithmically spaced lags, without a
//! series: the Einstein-Helfand and the Green-Kubo route to the conductivity. Numbers are kept in
//! reduced units: the current J (not over the volume) and its time integral G.

use super::lags::{BlockedSums, Lags, Series};
use super::{Observer, View};
use crate::sweep::HeatMoment;

/// Columns of the table of sums: origins; the 21 products of the increments of the six parts
/// (conduction, friction, pressure, convection, noise of conduction, noise of friction); the
/// increments of the variation of both noises; products of the interval means of the whole current,
/// and of its noise. All are means over the axes.
pub const COLUMNS: usize = 26;

const PARTS: usize = 6;
/// Places in a sample: moments by part, then variations, then interval means of all and of the noise.
const VARIATION: usize = 3 * PARTS;
const TOTAL: usize = VARIATION + 2;
const NOISE: usize = TOTAL + 3;
const WIDTH: usize = NOISE + 3;

/// Sums over time origins.
pub struct HeatCorrelator {
    every: u64,
    dimension: usize,
    lags: Lags,
    series: Series,
    sums: BlockedSums,
    last: Option<(u64, HeatMoment)>,
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
            let step: [f64; PARTS] = std::array::from_fn(|p| now[3 * p + a] - past[3 * p + a]);
            let mut column = 1;
            for p in 0..PARTS {
                for q in p..PARTS {
                    row[column] += share * step[p] * step[q];
                    column += 1;
                }
            }
            row[24] += share * now[TOTAL + a] * past[TOTAL + a];
            row[25] += share * now[NOISE + a] * past[NOISE + a];
        }
        for part in 0..2 {
            row[22 + part] += share * (now[VARIATION + part] - past[VARIATION + part]);
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
            for p in 0..PARTS {
                for a in 0..3 {
                    let mean = (moments.flows[p][a] - past.flows[p][a]) / interval;
                    now[3 * p + a] = moments.flows[p][a];
                    now[TOTAL + a] += mean;
                    now[NOISE + a] += if p < 4 { 0.0 } else { mean };
                }
            }
            now[VARIATION..TOTAL].copy_from_slice(&moments.variation);
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
