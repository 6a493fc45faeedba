//! Density and current correlations at chosen wave vectors of the box on logarithmically spaced lags,
//! without a trajectory: rho_k = sum exp(i k.r) and j_k = sum v exp(i k.r), per root of N. Where the
//! particles have an energy also its wave, eps_k = sum (e - <e>) exp(i k.r) with e = C T + m v^2/2: what
//! heat changes, without the cold part of the equation of state.

use rayon::prelude::*;

use super::lags::{BlockedSums, Lags, Series, zeros};
use super::{Observer, View};
use crate::domain::PeriodicBox;
use crate::real::cos_sin_turn;
use crate::sweep::{Task, Wide, run_wide};

/// Columns of the table of sums, per wave vector: rho*(0) rho(t), longitudinal and transverse
/// j*(0) j(t) (real parts), rho*(0) j_l(t) and j_l*(0) rho(t) (imaginary parts).
pub const COLUMNS: usize = 5;
/// More of them with an energy: eps*(0) eps(t), rho and eps (real), eps and j_l (imaginary part), the
/// last two the mean over both orders, which are one function in equilibrium.
pub const ENERGY_COLUMNS: usize = 3;

/// Particles of a part: fixed, so that no sum depends on the threads.
const PART: usize = 256;
const CHUNK: usize = 64;
/// Numbers of a sample, per wave vector: rho, the components of j, j along k, as complex numbers.
const WIDTH: usize = 10;
/// The same with eps.
const ENERGY_WIDTH: usize = 12;
/// Sums of a wave vector: over weights 1, three components of v, and e.
const SUMS: usize = 10;
/// The place of e among the weights.
const ENERGY: usize = 4;

type Lanes = [f64; CHUNK];

/// Sums over time origins.
pub struct Currents {
    every: u64,
    dimension: usize,
    energy: bool,
    n: usize,
    vectors: Vec<[i32; 3]>,
    highest: [usize; 3],
    lags: Lags,
    parts: Vec<Part>,
    now: Vec<f64>,
    series: Series,
    sums: BlockedSums,
    begun: BlockedSums,
}

/// Work space of some particles: powers of exp(2 pi i x/L) by axis, and sums by wave vector.
struct Part {
    powers: [Vec<[Lanes; 2]>; 3],
    sums: Vec<[f64; SUMS]>,
}

impl Part {
    /// `None` where there is no memory for it.
    fn new(highest: &[usize], vectors: usize) -> Option<Self> {
        let mut powers = [Vec::new(), Vec::new(), Vec::new()];
        for (powers, &top) in powers.iter_mut().zip(highest) {
            *powers = zeros([[0.0; CHUNK]; 2], top.checked_add(1)?)?;
        }
        Some(Self {
            powers,
            sums: zeros([0.0; SUMS], vectors)?,
        })
    }
}

/// Columns of the table of sums, per wave vector.
fn columns(energy: bool) -> usize {
    COLUMNS + if energy { ENERGY_COLUMNS } else { 0 }
}

/// Numbers of a sample, per wave vector.
fn numbers(energy: bool) -> usize {
    if energy { ENERGY_WIDTH } else { WIDTH }
}

/// Energy of a particle in reduced units: thermal and kinetic.
fn energy_of(heat: f64, velocity: &[f64; 4], dimension: usize) -> f64 {
    heat + 0.5 * velocity[..dimension].iter().map(|v| v * v).sum::<f64>()
}

impl Currents {
    /// Sampled every so many steps at integer wave vectors, with the wave of the `energy` where the
    /// particles have one; `None` where its memory is not to be had.
    pub fn new(
        every: u64,
        dimension: usize,
        energy: bool,
        vectors: Vec<[i32; 3]>,
        points: usize,
        levels: usize,
        n: usize,
    ) -> Option<Self> {
        let lags = Lags::new(points, levels);
        let mut highest = [0; 3];
        for vector in &vectors {
            for (axis, top) in highest.iter_mut().enumerate() {
                *top = (*top).max(vector[axis].unsigned_abs() as usize);
            }
        }
        let mut parts = Vec::new();
        parts.try_reserve_exact(n.div_ceil(PART)).ok()?;
        for _ in 0..n.div_ceil(PART) {
            parts.push(Part::new(&highest[..dimension], vectors.len())?);
        }
        let width = lags
            .rows()?
            .checked_mul(1 + columns(energy) * vectors.len())?;
        let numbers = numbers(energy) * vectors.len();
        Some(Self {
            every: every.max(1),
            dimension,
            energy,
            n,
            highest,
            lags,
            parts,
            now: vec![0.0; numbers],
            series: Series::new(lags, numbers)?,
            sums: BlockedSums::new(width)?,
            begun: BlockedSums::new(width)?,
            vectors,
        })
    }

    /// The lags.
    pub fn lags(&self) -> Lags {
        self.lags
    }

    /// Sums at each lag, block by block: origins, then the columns of each wave vector, in the
    /// user's units.
    pub fn sums(&self) -> &BlockedSums {
        &self.sums
    }

    /// Numbers in a row of the table.
    pub fn columns(&self) -> usize {
        1 + columns(self.energy) * self.vectors.len()
    }

    /// Fills `now` with the modes of the present state.
    fn take_modes(&mut self, view: &View) {
        let (particles, cell) = (view.particles, view.cell);
        let (vectors, highest, dimension) = (&self.vectors, self.highest, self.dimension);
        let heat = view
            .thermal
            .filter(|_| self.energy)
            .map(|thermal| &particles.scalars[thermal.fields.heat].values[..]);
        let mean = heat.map_or(0.0, |heat| {
            let each = heat.iter().zip(&particles.velocity);
            each.map(|(&heat, v)| energy_of(heat, v, dimension))
                .sum::<f64>()
                / self.n as f64
        });
        self.parts
            .par_iter_mut()
            .zip(particles.position.par_chunks(PART))
            .zip(particles.velocity.par_chunks(PART))
            .enumerate()
            .for_each(|(index, ((part, position), velocity))| {
                let first = PART * index;
                run_wide(Modes {
                    part,
                    position,
                    velocity,
                    heat: heat.map(|heat| &heat[first..first + position.len()]),
                    mean,
                    cell,
                    vectors,
                    highest,
                    dimension,
                });
            });
        let unit = view.units.velocity;
        let root = (self.n as f64).sqrt();
        let numbers = numbers(self.energy);
        for (k, vector) in self.vectors.iter().enumerate() {
            let mut sum = [0.0; SUMS];
            for part in &self.parts {
                for (s, term) in sum.iter_mut().zip(&part.sums[k]) {
                    *s += term;
                }
            }
            let now = &mut self.now[numbers * k..numbers * (k + 1)];
            let wave: [f64; 3] =
                std::array::from_fn(|a| f64::from(vector[a]) * view.cell.inverse[a]);
            let length = wave.iter().map(|x| x * x).sum::<f64>().sqrt();
            for c in 0..2 {
                now[c] = sum[c] / root;
                now[8 + c] = 0.0;
                for a in 0..dimension {
                    let current = sum[2 + 2 * a + c] * unit / root;
                    now[2 + 2 * a + c] = current;
                    now[8 + c] += wave[a] / length * current;
                }
                if self.energy {
                    now[10 + c] = sum[2 * ENERGY + c] * view.units.energy() / root;
                }
            }
        }
    }
}

/// Real part of a* b.
fn real(a: &[f64], b: &[f64]) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

/// Imaginary part of a* b.
fn imaginary(a: &[f64], b: &[f64]) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}

impl Observer for Currents {
    fn every(&self) -> u64 {
        self.every
    }

    fn begin(&mut self) {
        self.begun.copy_from(&self.sums);
    }

    fn forget(&mut self) {
        self.sums.copy_from(&self.begun);
        self.series.clear();
    }

    fn sample(&mut self, view: &View) {
        self.take_modes(view);
        let columns = self.columns();
        let (now, dimension, energy) = (&self.now, self.dimension, self.energy);
        let (numbers, each) = (numbers(energy), self::columns(energy));
        let table = self.sums.current();
        self.series.push(now, |row, _, past| {
            let row = &mut table[columns * row..columns * (row + 1)];
            row[0] += 1.0;
            let modes = now.chunks(numbers).zip(past.chunks(numbers));
            for ((now, past), row) in modes.zip(row[1..].chunks_mut(each)) {
                let whole: f64 = (1..=dimension)
                    .map(|a| real(&past[2 * a..], &now[2 * a..]))
                    .sum();
                let along = real(&past[8..], &now[8..]);
                row[0] += real(past, now);
                row[1] += along;
                row[2] += (whole - along) / (dimension - 1) as f64;
                row[3] += imaginary(past, &now[8..]);
                row[4] += imaginary(&past[8..], now);
                if energy {
                    let (now_energy, past_energy) = (&now[10..], &past[10..]);
                    row[5] += real(past_energy, now_energy);
                    row[6] += 0.5 * (real(past, now_energy) + real(past_energy, now));
                    row[7] += 0.5
                        * (imaginary(past_energy, &now[8..]) + imaginary(&past[8..], now_energy));
                }
            }
        });
        self.sums.close_sample();
    }
}

struct Modes<'a> {
    part: &'a mut Part,
    position: &'a [[f64; 4]],
    velocity: &'a [[f64; 4]],
    heat: Option<&'a [f64]>,
    mean: f64,
    cell: &'a PeriodicBox,
    vectors: &'a [[i32; 3]],
    highest: [usize; 3],
    dimension: usize,
}

impl Modes<'_> {
    /// exp(2 pi i n x/L) for n = 0 .. highest, one chunk.
    #[inline(always)]
    fn powers(&mut self, position: &[[f64; 4]]) {
        for a in 0..self.dimension {
            let mut turns = [0.0; CHUNK];
            for (turn, place) in turns.iter_mut().zip(position) {
                *turn = place[a] * self.cell.inverse[a];
            }
            let powers = &mut self.part.powers[a];
            let mut first = [[0.0; CHUNK]; 2];
            for k in 0..CHUNK {
                // Positions may have left the box since the lists were renewed.
                let turn = turns[k] - turns[k].floor();
                let (cosine, sine) = cos_sin_turn(if turn < 1.0 { turn } else { 0.0 });
                (first[0][k], first[1][k]) = (cosine, sine);
            }
            powers[0] = [[1.0; CHUNK], [0.0; CHUNK]];
            for n in 1..=self.highest[a] {
                let last = powers[n - 1];
                let next = &mut powers[n];
                for k in 0..CHUNK {
                    next[0][k] = last[0][k] * first[0][k] - last[1][k] * first[1][k];
                    next[1][k] = last[0][k] * first[1][k] + last[1][k] * first[0][k];
                }
            }
        }
    }

    /// Adds the particles of a chunk, weights 1, v and e, to the sums of one wave vector.
    #[inline(always)]
    fn add(&mut self, index: usize, weights: &[Lanes; 5]) {
        const LANES: usize = 8;
        let vector = self.vectors[index];
        let mut wave = [[1.0; CHUNK], [0.0; CHUNK]];
        for a in 0..self.dimension {
            let n = vector[a];
            if n == 0 {
                continue;
            }
            let power = &self.part.powers[a][n.unsigned_abs() as usize];
            let sign = if n < 0 { -1.0 } else { 1.0 };
            for k in 0..CHUNK {
                let (c, s) = (power[0][k], sign * power[1][k]);
                let (x, y) = (wave[0][k], wave[1][k]);
                wave[0][k] = x * c - y * s;
                wave[1][k] = x * s + y * c;
            }
        }
        let energy = self.heat.map(|_| ENERGY);
        for w in (0..=self.dimension).chain(energy) {
            for c in 0..2 {
                let mut lanes = [0.0; LANES];
                for k in (0..CHUNK).step_by(LANES) {
                    for lane in 0..LANES {
                        lanes[lane] += weights[w][k + lane] * wave[c][k + lane];
                    }
                }
                self.part.sums[index][2 * w + c] += lanes.iter().sum::<f64>();
            }
        }
    }
}

impl Task for Modes<'_> {
    type Output = ();
    #[inline(always)]
    fn run<W: Wide>(mut self) {
        self.part.sums.fill([0.0; SUMS]);
        let (position, velocity) = (self.position, self.velocity);
        let chunks = position.chunks(CHUNK).zip(velocity.chunks(CHUNK));
        for (chunk, (position, velocity)) in chunks.enumerate() {
            let mut weights = [[0.0; CHUNK]; 5];
            if let Some(heat) = self.heat {
                for (k, v) in velocity.iter().enumerate() {
                    let energy = energy_of(heat[CHUNK * chunk + k], v, self.dimension);
                    weights[ENERGY][k] = energy - self.mean;
                }
            }
            for (k, v) in velocity.iter().enumerate() {
                weights[0][k] = 1.0;
                for a in 0..self.dimension {
                    weights[1 + a][k] = v[a];
                }
            }
            self.powers(position);
            for index in 0..self.vectors.len() {
                self.add(index, &weights);
            }
        }
    }
}
