//! A tabulated equation of state: monotone piecewise cubic through the given points (Fritsch and
//! Butland, SIAM J. Sci. Stat. Comput. 5 (1984) 300, the "pchip" of SLATEC and SciPy), continued
//! linearly beyond both ends.

use super::EquationOfState;
use crate::error::{Error, Result};
use crate::valid::{finite, positive};

/// P(rho) = a + b rho + c rho^2 + d rho^3 on one interval, and what makes e(rho) continuous.
#[derive(Debug, Clone)]
struct Piece {
    start: f64,
    polynomial: [f64; 4],
    offset: f64,
}

impl Piece {
    fn potential(&self, rho: f64) -> f64 {
        let [a, b, c, d] = self.polynomial;
        -a / rho + b * rho.ln() + c * rho + 0.5 * d * rho * rho
    }
}

/// The interpolated table.
#[derive(Debug, Clone)]
pub struct Table {
    pieces: Vec<Piece>,
}

impl Table {
    /// From n densities followed by n pressures; n >= 2, densities > 0 and increasing, pressures
    /// not decreasing.
    pub fn new(parameters: &[f64]) -> Result<Self> {
        let n = parameters.len() / 2;
        if n < 2 || parameters.len() != 2 * n {
            return Err(Error::Invalid(format!(
                "`table` must hold n >= 2 densities and as many pressures, got {} numbers",
                parameters.len()
            )));
        }
        let (rho, p) = parameters.split_at(n);
        positive("table density", rho[0])?;
        for k in 0..n {
            finite("table density", rho[k])?;
            finite("table pressure", p[k])?;
            if k > 0 && (rho[k] <= rho[k - 1] || p[k] < p[k - 1]) {
                return Err(Error::Invalid(format!(
                    "`table` densities must increase and pressures must not decrease, got ({}, {}) after ({}, {})",
                    rho[k],
                    p[k],
                    rho[k - 1],
                    p[k - 1]
                )));
            }
        }
        let slopes = monotone_slopes(rho, p);
        let mut pieces = vec![linear_piece(0.0, rho[0], p[0], slopes[0])];
        for k in 0..n - 1 {
            pieces.push(cubic_piece(
                [rho[k], rho[k + 1]],
                [p[k], p[k + 1]],
                [slopes[k], slopes[k + 1]],
            ));
        }
        pieces.push(linear_piece(
            rho[n - 1],
            rho[n - 1],
            p[n - 1],
            slopes[n - 1],
        ));
        for k in 1..pieces.len() {
            let at = pieces[k].start;
            pieces[k].offset =
                pieces[k - 1].offset + pieces[k - 1].potential(at) - pieces[k].potential(at);
        }
        Ok(Self { pieces })
    }

    fn piece(&self, rho: f64) -> &Piece {
        let after = self.pieces.partition_point(|piece| piece.start <= rho);
        &self.pieces[after.max(1) - 1]
    }
}

fn monotone_slopes(rho: &[f64], p: &[f64]) -> Vec<f64> {
    let n = rho.len();
    let secant: Vec<f64> = (0..n - 1)
        .map(|k| (p[k + 1] - p[k]) / (rho[k + 1] - rho[k]))
        .collect();
    let mut slopes = vec![secant[0]; n];
    if n > 2 {
        let width = |k: usize| rho[k + 1] - rho[k];
        slopes[0] = end_slope([width(0), width(1)], [secant[0], secant[1]]);
        slopes[n - 1] = end_slope([width(n - 2), width(n - 3)], [secant[n - 2], secant[n - 3]]);
    }
    for k in 1..n - 1 {
        slopes[k] = 0.0;
        // Weighted harmonic mean: never more than three times either secant, hence monotone.
        if secant[k - 1] * secant[k] > 0.0 {
            let (left, right) = (rho[k] - rho[k - 1], rho[k + 1] - rho[k]);
            let (w0, w1) = (2.0 * right + left, right + 2.0 * left);
            slopes[k] = (w0 + w1) / (w0 / secant[k - 1] + w1 / secant[k]);
        }
    }
    slopes
}

/// Three-point formula at an end, kept monotone; index 0 is the interval at the end.
fn end_slope(width: [f64; 2], secant: [f64; 2]) -> f64 {
    let slope =
        ((2.0 * width[0] + width[1]) * secant[0] - width[0] * secant[1]) / (width[0] + width[1]);
    if slope * secant[0] <= 0.0 {
        0.0
    } else if secant[0] * secant[1] <= 0.0 && slope > 3.0 * secant[0] {
        3.0 * secant[0]
    } else {
        slope
    }
}

fn linear_piece(start: f64, rho: f64, p: f64, slope: f64) -> Piece {
    Piece {
        start,
        polynomial: [p - slope * rho, slope, 0.0, 0.0],
        offset: 0.0,
    }
}

fn cubic_piece(rho: [f64; 2], p: [f64; 2], slope: [f64; 2]) -> Piece {
    let width = rho[1] - rho[0];
    let secant = (p[1] - p[0]) / width;
    let c = (3.0 * secant - 2.0 * slope[0] - slope[1]) / width;
    let d = (slope[0] + slope[1] - 2.0 * secant) / (width * width);
    // From powers of (rho - rho_k) to powers of rho.
    let r = rho[0];
    Piece {
        start: r,
        polynomial: [
            p[0] - slope[0] * r + c * r * r - d * r * r * r,
            slope[0] - 2.0 * c * r + 3.0 * d * r * r,
            c - 3.0 * d * r,
            d,
        ],
        offset: 0.0,
    }
}

impl EquationOfState for Table {
    fn pressure(&self, rho: f64) -> f64 {
        let [a, b, c, d] = self.piece(rho).polynomial;
        a + rho * (b + rho * (c + rho * d))
    }
    fn sound_speed_squared(&self, rho: f64) -> f64 {
        let [_, b, c, d] = self.piece(rho).polynomial;
        b + rho * (2.0 * c + 3.0 * rho * d)
    }
    fn specific_potential(&self, rho: f64) -> f64 {
        let piece = self.piece(rho);
        piece.potential(rho) + piece.offset
    }
}
