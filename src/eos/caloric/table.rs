//! Any E(N, V, S): the entropy s(x, y) per mass on a grid of x = ln rho and y = ln h, bicubic between its
//! points, and the energy without heat e_c(x), cubic. Temperature, heat capacity and pressure are
//! derivatives of these two, so they belong together however coarse the grid is:
//!     T = h/s_y,   c_v = s_y^2/(s_y - s_yy),   P = rho (e_c' - T s_x).
//! An ideal gas is linear in x and y. Beyond the grid both go on as straight lines.

use super::Caloric;
use crate::error::{Error, Result};
use crate::real::ln;
use crate::valid::{finite, positive};

/// Equidistant points.
#[derive(Debug, Clone)]
struct Axis {
    start: f64,
    step: f64,
    count: usize,
}

impl Axis {
    fn new(name: &str, numbers: &[f64]) -> Result<Self> {
        let count = numbers[2];
        if !((2.0..=1e4).contains(&count) && count.fract() == 0.0) {
            return Err(Error::Invalid(format!(
                "`table` must have 2 to 10000 points along {name}, got {count}"
            )));
        }
        Ok(Self {
            start: finite(name, numbers[0])?,
            step: positive(name, numbers[1])?,
            count: count as usize,
        })
    }

    /// The interval of a place, the place within it from 0 to 1, and how far beyond the end it is.
    fn locate(&self, x: f64) -> (usize, f64, f64) {
        let last = (self.count - 1) as f64;
        let at = (x - self.start) / self.step;
        let within = at.clamp(0.0, last);
        let cell = (within as usize).min(self.count - 2);
        (cell, within - cell as f64, (at - within) * self.step)
    }
}

/// Cubic Hermite functions of values at 0 and 1 and slopes at 0 and 1; their derivatives.
fn hermite(t: f64) -> [[f64; 4]; 3] {
    let (t2, t3) = (t * t, t * t * t);
    [
        [
            2.0 * t3 - 3.0 * t2 + 1.0,
            3.0 * t2 - 2.0 * t3,
            t3 - 2.0 * t2 + t,
            t3 - t2,
        ],
        [
            6.0 * (t2 - t),
            6.0 * (t - t2),
            3.0 * t2 - 4.0 * t + 1.0,
            3.0 * t2 - 2.0 * t,
        ],
        [12.0 * t - 6.0, 6.0 - 12.0 * t, 6.0 * t - 4.0, 6.0 * t - 2.0],
    ]
}

/// s and its derivatives.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Entropy {
    s: f64,
    x: f64,
    y: f64,
    xx: f64,
    xy: f64,
    yy: f64,
    xxy: f64,
    xyy: f64,
}

/// A fluid given by its entropy.
#[derive(Debug, Clone)]
pub struct Table {
    densities: Axis,
    heats: Axis,
    /// e_c and de_c/dx times the step.
    cold: Vec<[f64; 2]>,
    /// s, and s_x, s_y and s_xy times the steps; y runs fastest.
    entropy: Vec<[f64; 4]>,
}

impl Table {
    /// From start, step and number of points of x, the same of y, then e_c and de_c/dx for every x,
    /// then s, s_x, s_y and s_xy for every x and y.
    pub fn new(numbers: &[f64]) -> Result<Self> {
        if numbers.len() < 6 {
            return Err(Error::Invalid(format!(
                "`table` must begin with start, step and count of both axes, got {} numbers",
                numbers.len()
            )));
        }
        let densities = Axis::new("ln density", &numbers[..3])?;
        let heats = Axis::new("ln heat", &numbers[3..6])?;
        let (n, m) = (densities.count, heats.count);
        let expected = 6 + 2 * n + 4 * n * m;
        if numbers.len() != expected {
            return Err(Error::Invalid(format!(
                "`table` must hold {expected} numbers for {n} densities and {m} heats, got {}",
                numbers.len()
            )));
        }
        for &number in numbers {
            finite("table", number)?;
        }
        let (cold, entropy) = numbers[6..].split_at(2 * n);
        let (dx, dy) = (densities.step, heats.step);
        let cold = cold.chunks_exact(2).map(|c| [c[0], dx * c[1]]).collect();
        let entropy = entropy
            .chunks_exact(4)
            .map(|s| [s[0], dx * s[1], dy * s[2], dx * dy * s[3]])
            .collect();
        let table = Self {
            densities,
            heats,
            cold,
            entropy,
        };
        table.check_stability()?;
        Ok(table)
    }

    /// T and c_v are positive at both ends and in the middle of every interval.
    fn check_stability(&self) -> Result<()> {
        for i in 0..self.densities.count - 1 {
            for j in 0..self.heats.count - 1 {
                for (t, u) in [0.0, 0.5, 1.0]
                    .into_iter()
                    .flat_map(|t| [0.0, 0.5, 1.0].map(|u| (t, u)))
                {
                    let s = self.within([i, j], [t, u]);
                    if !(s.y > 0.0 && s.y > s.yy) {
                        let [x, y] = [(&self.densities, i as f64 + t), (&self.heats, j as f64 + u)]
                            .map(|(axis, at)| (axis.start + at * axis.step).exp());
                        return Err(Error::Invalid(format!(
                            "`table` must have positive temperatures and heat capacities, got s_y = {} and s_yy = {} at density {x:.6e} and heat {y:.6e}",
                            s.y, s.yy
                        )));
                    }
                }
            }
        }
        Ok(())
    }

    /// s and its derivatives in a cell, at a place from 0 to 1 along both axes.
    fn within(&self, [i, j]: [usize; 2], [t, u]: [f64; 2]) -> Entropy {
        let (along_x, along_y) = (hermite(t), hermite(u));
        let m = self.heats.count;
        let corners = [
            [i * m + j, i * m + j + 1],
            [(i + 1) * m + j, (i + 1) * m + j + 1],
        ];
        let (dx, dy) = (self.densities.step, self.heats.step);
        let value = |p: usize, q: usize| {
            let (v, w) = (along_x[p], along_y[q]);
            let mut sum = 0.0;
            for a in 0..2 {
                for b in 0..2 {
                    let [s, sx, sy, sxy] = self.entropy[corners[a][b]];
                    sum +=
                        v[a] * (w[b] * s + w[2 + b] * sy) + v[2 + a] * (w[b] * sx + w[2 + b] * sxy);
                }
            }
            sum / (dx.powi(p as i32) * dy.powi(q as i32))
        };
        Entropy {
            s: value(0, 0),
            x: value(1, 0),
            y: value(0, 1),
            xx: value(2, 0),
            xy: value(1, 1),
            yy: value(0, 2),
            xxy: value(2, 1),
            xyy: value(1, 2),
        }
    }

    fn at(&self, x: f64, y: f64) -> Entropy {
        let (i, t, beyond_x) = self.densities.locate(x);
        let (j, u, beyond_y) = self.heats.locate(y);
        let s = self.within([i, j], [t, u]);
        // Straight lines beyond the ends.
        let inside = |beyond: f64| if beyond == 0.0 { 1.0 } else { 0.0 };
        Entropy {
            s: s.s + beyond_x * s.x + beyond_y * s.y + beyond_x * beyond_y * s.xy,
            x: s.x + beyond_y * s.xy,
            y: s.y + beyond_x * s.xy,
            xx: inside(beyond_x) * (s.xx + beyond_y * s.xxy),
            yy: inside(beyond_y) * (s.yy + beyond_x * s.xyy),
            ..s
        }
    }

    /// s, s_y and s_yy: what `at` gives, as fast as it goes.
    #[inline]
    fn along_heat(&self, x: f64, y: f64) -> [f64; 3] {
        let (i, t, beyond_x) = self.densities.locate(x);
        let (j, u, beyond_y) = self.heats.locate(y);
        let mut weights = hermite(t)[0];
        if beyond_x != 0.0 {
            let slopes = hermite(t)[1].map(|w| w * beyond_x / self.densities.step);
            for (weight, slope) in weights.iter_mut().zip(slopes) {
                *weight += slope;
            }
        }
        let at = i * self.heats.count + j;
        let low = &self.entropy[at..at + 2];
        let at = at + self.heats.count;
        let high = &self.entropy[at..at + 2];
        // s and its slope along y at both ends of the interval.
        let [v, w, p, q] = weights;
        let ends = [0, 1].map(|b| {
            let ([s, sx, sy, sxy], [z, zx, zy, zxy]) = (low[b], high[b]);
            [
                v * s + w * z + p * sx + q * zx,
                v * sy + w * zy + p * sxy + q * zxy,
            ]
        });
        // s_0 + u (m_0 + u (c + u d))
        let ([s0, m0], [s1, m1]) = (ends[0], ends[1]);
        let rise = s1 - s0;
        let (c, d) = (3.0 * rise - 2.0 * m0 - m1, m0 + m1 - 2.0 * rise);
        let inverse = 1.0 / self.heats.step;
        let slope = (m0 + u * (2.0 * c + u * 3.0 * d)) * inverse;
        let bend = if beyond_y == 0.0 {
            (2.0 * c + u * 6.0 * d) * inverse * inverse
        } else {
            0.0
        };
        [
            s0 + u * (m0 + u * (c + u * d)) + beyond_y * slope,
            slope,
            bend,
        ]
    }

    /// e_c and its first two derivatives by x.
    fn cold_at(&self, x: f64) -> [f64; 3] {
        let (i, t, beyond) = self.densities.locate(x);
        let [[e, slope], [f, other]] = [self.cold[i], self.cold[i + 1]];
        let step = self.densities.step;
        let [v, w, z] = hermite(t).map(|h| h[0] * e + h[1] * f + h[2] * slope + h[3] * other);
        let curvature = if beyond == 0.0 {
            z / (step * step)
        } else {
            0.0
        };
        [v + beyond * w / step, w / step, curvature]
    }

    /// ln h at which `excess`, which gives a value and its slope, has its zero; NaN if none is found.
    fn solve(guess: f64, excess: impl Fn(f64) -> [f64; 2]) -> f64 {
        let (mut y, mut last) = (guess, f64::NAN);
        for _ in 0..60 {
            let [value, slope] = excess(y);
            // Far steps of a curved function are shortened.
            let step = (value / slope).clamp(-2.0, 2.0);
            y -= step;
            if step.abs() < 1e-14 * (1.0 + y.abs()) {
                return y;
            }
            last = step;
        }
        // Rounding may keep it from the last digits.
        if last.abs() < 1e-10 { y } else { f64::NAN }
    }
}

impl Caloric for Table {
    fn constant_heat_capacity(&self) -> Option<f64> {
        None
    }
    fn cold_energy(&self, rho: f64) -> f64 {
        self.cold_at(rho.ln())[0]
    }
    fn mark(&self, rho: f64) -> f64 {
        ln(rho)
    }
    fn state_at(&self, x: f64, heat: f64) -> [f64; 2] {
        let [_, first, second] = self.along_heat(x, ln(heat));
        [heat / first, first * first / (first - second)]
    }
    fn entropy_at(&self, x: f64, heat: f64) -> f64 {
        self.along_heat(x, ln(heat))[0]
    }
    fn pressure(&self, rho: f64, heat: f64) -> f64 {
        let x = rho.ln();
        let s = self.at(x, heat.ln());
        rho * (self.cold_at(x)[1] - heat / s.y * s.x)
    }
    fn entropy(&self, rho: f64, heat: f64) -> f64 {
        self.at(rho.ln(), heat.ln()).s
    }
    fn heat(&self, rho: f64, temperature: f64) -> f64 {
        let x = rho.ln();
        let middle = self.heats.start + 0.5 * self.heats.step * (self.heats.count - 1) as f64;
        let target = temperature.ln();
        let y = Self::solve(target + self.at(x, middle).y.ln(), |y| {
            let s = self.at(x, y);
            [y - s.y.ln() - target, 1.0 - s.yy / s.y]
        });
        y.exp()
    }
    fn heat_at_entropy(&self, rho: f64, entropy: f64, guess: f64) -> f64 {
        let x = rho.ln();
        let y = Self::solve(guess.ln(), |y| {
            let s = self.at(x, y);
            [s.s - entropy, s.y]
        });
        y.exp()
    }
    fn slopes(&self, rho: f64, heat: f64) -> [f64; 2] {
        let x = rho.ln();
        let s = self.at(x, heat.ln());
        let [_, first, second] = self.cold_at(x);
        let t = heat / s.y;
        // P/rho = e_c' - T s_x along a line dy/dx; d ln T = dy - (s_xy dx + s_yy dy)/s_y.
        let along = |line: f64| {
            let warming = line - (s.xy + s.yy * line) / s.y;
            first - t * s.x + second - t * (warming * s.x + s.xx + s.xy * line)
        };
        [along(s.xy / (s.y - s.yy)), along(-s.x / s.y)]
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// A gas with c_v = 2 + T/2 and P = rho T/2 + rho^2: h = 2 T + T^2/4, s = 2 ln T + T/2 - ln(rho)/2.
    fn exact(rho: f64, t: f64) -> [f64; 3] {
        let heat = 2.0 * t + 0.25 * t * t;
        [
            heat,
            2.0 * t.ln() + 0.5 * t - 0.5 * rho.ln(),
            0.5 * rho * t + rho * rho,
        ]
    }

    fn temperature(heat: f64) -> f64 {
        -4.0 + (16.0 + 4.0 * heat).sqrt()
    }

    /// Its table, with exact slopes.
    pub fn sample() -> Vec<f64> {
        let (n, m) = (24, 60);
        let (x0, x1, y0, y1) = (0.5_f64.ln(), 2.0_f64.ln(), 0.3_f64.ln(), 12.0_f64.ln());
        let (dx, dy) = ((x1 - x0) / f64::from(n - 1), (y1 - y0) / f64::from(m - 1));
        let mut numbers = vec![x0, dx, f64::from(n), y0, dy, f64::from(m)];
        for i in 0..n {
            let rho = (x0 + dx * f64::from(i)).exp();
            numbers.extend([rho, rho]);
        }
        for i in 0..n {
            let rho = (x0 + dx * f64::from(i)).exp();
            for j in 0..m {
                let heat = (y0 + dy * f64::from(j)).exp();
                let t = temperature(heat);
                numbers.extend([exact(rho, t)[1], -0.5, heat / t, 0.0]);
            }
        }
        numbers
    }

    #[test]
    fn a_table_gives_back_its_fluid() {
        let table = Table::new(&sample()).unwrap();
        for rho in [0.6, 1.0, 1.7] {
            for t in [0.4, 1.0, 3.0] {
                let [heat, entropy, pressure] = exact(rho, t);
                let s = table.at(rho.ln(), heat.ln());
                for (x, y) in table
                    .along_heat(rho.ln(), heat.ln())
                    .into_iter()
                    .zip([s.s, s.y, s.yy])
                {
                    assert!((x - y).abs() < 1e-11 * (1.0 + y.abs()));
                }
                let [found, capacity] = table.temperature_and_capacity(rho, heat);
                assert!((found / t - 1.0).abs() < 3e-6, "{found} {t}");
                assert!(
                    (capacity / (2.0 + 0.5 * t) - 1.0).abs() < 1e-3,
                    "{capacity}"
                );
                assert!((table.entropy(rho, heat) - entropy).abs() < 1e-6);
                assert!((table.pressure(rho, heat) / pressure - 1.0).abs() < 1e-5);
                assert!((table.heat(rho, t) / heat - 1.0).abs() < 1e-5);
            }
        }
    }

    #[test]
    fn beyond_its_ends_a_table_goes_on_without_a_jump() {
        let table = Table::new(&sample()).unwrap();
        let corner = (0.5_f64, 0.3_f64);
        for (rho, heat) in [(corner.0, 1.0), (1.0, corner.1), (1.0, 12.0), (2.0, 1.0)] {
            for (a, b) in [(0.9999, 1.0), (1.0001, 1.0), (1.0, 0.9999), (1.0, 1.0001)] {
                let [here, there] = [(rho, heat), (rho * a, heat * b)].map(|(r, h)| {
                    [
                        table.pressure(r, h),
                        table.entropy(r, h),
                        table.temperature_and_capacity(r, h)[0],
                    ]
                });
                for (x, y) in here.into_iter().zip(there) {
                    assert!((x - y).abs() < 1e-3 * (1.0 + x.abs()));
                }
            }
        }
        // All eight regions around the grid.
        for (rho, t) in [
            (0.3, 1.0),
            (3.0, 1.0),
            (1.0, 0.05),
            (1.0, 9.0),
            (0.3, 0.05),
            (0.3, 9.0),
            (3.0, 0.05),
            (3.0, 9.0),
        ] {
            let heat = table.heat(rho, t);
            let s = table.at(rho.ln(), heat.ln());
            for (x, y) in table
                .along_heat(rho.ln(), heat.ln())
                .into_iter()
                .zip([s.s, s.y, s.yy])
            {
                assert!(
                    (x - y).abs() < 1e-11 * (1.0 + y.abs()),
                    "{rho} {t}: {x} {y}"
                );
            }
            let step = 1e-5;
            let slope = |f: &dyn Fn(f64) -> f64| (f(rho + step) - f(rho - step)) / (2.0 * step);
            let entropy = table.entropy(rho, heat);
            let adiabat = |rho: f64| table.heat_at_entropy(rho, entropy, heat);
            let exact = [
                slope(&|rho| table.pressure(rho, table.heat(rho, t))),
                slope(&|rho| table.pressure(rho, adiabat(rho))),
            ];
            for (x, y) in table.slopes(rho, heat).into_iter().zip(exact) {
                assert!((x - y).abs() < 1e-6 * (1.0 + y.abs()), "{rho} {t}: {x} {y}");
            }
        }
        // A heat below the table has the heat capacity of its end.
        let [t, capacity] = table.temperature_and_capacity(1.0, 0.01);
        assert!((0.01 / t / capacity - 1.0).abs() < 1e-12);
    }

    #[test]
    fn bad_tables_are_refused() {
        let message = |numbers: &[f64]| Table::new(numbers).err().unwrap().to_string();
        assert!(message(&[1.0]).contains("must begin with"));
        let mut numbers = sample();
        numbers.pop();
        assert!(message(&numbers).contains("numbers for 24 densities and 60 heats"));
        let mut numbers = sample();
        numbers[2] = 1.0;
        assert!(message(&numbers).contains("2 to 10000 points"));
        // Stable at the points and half way, but not just before a point.
        let mut numbers = vec![0.0, 0.5, 8.0, 0.0, 0.5, 8.0];
        numbers.extend([0.0; 16]);
        for _ in 0..8 {
            for k in 0..8 {
                numbers.extend([
                    0.5 * f64::from(k),
                    0.0,
                    if k == 4 { 1.22 } else { 1.0 },
                    0.0,
                ]);
            }
        }
        assert!(message(&numbers).contains("positive temperatures"));
        let mut numbers = sample();
        for k in 0..24 * 60 {
            numbers[6 + 48 + 4 * k + 2] *= -1.0;
        }
        assert!(message(&numbers).contains("positive temperatures"));
    }
}
