//! A tabulated equation of state: monotone piecewise cubic through the given points (Fritsch and
//! Butland, SIAM J. Sci. Stat. Comput. 5 (1984) 300, the "pchip" of SLATEC and SciPy), continued
//! linearly beyond both ends.

use super::EquationOfState;
use crate::error::{Error, Result};
use crate::valid::{finite, positive};

/// Nodes and weights of Gauss-Legendre quadrature on [-1, 1], positive half of eight points.
const GAUSS: [[f64; 2]; 4] = [
    [0.183_434_642_495_649_8, 0.362_683_783_378_362],
    [0.525_532_409_916_329, 0.313_706_645_877_887_3],
    [0.796_666_477_413_626_7, 0.222_381_034_453_374_5],
    [0.960_289_856_497_536_3, 0.101_228_536_290_376_26],
];

/// P = p + x (s + x (c + x d)) with x = rho - anchor, for densities from `start` on. Powers of x,
/// not of rho: a fine table far from zero would lose its digits.
#[derive(Debug, Clone)]
struct Piece {
    start: f64,
    anchor: f64,
    cubic: [f64; 4],
    potential_at_anchor: f64,
}

impl Piece {
    fn pressure(&self, rho: f64) -> f64 {
        let [p, s, c, d] = self.cubic;
        let x = rho - self.anchor;
        p + x * (s + x * (c + x * d))
    }

    /// int P/rho^2 d rho from the anchor.
    fn rise(&self, rho: f64) -> f64 {
        let [p, s, c, d] = self.cubic;
        let r = self.anchor;
        if c == 0.0 && d == 0.0 {
            return (p - s * r) * (1.0 / r - 1.0 / rho) + s * (rho / r).ln();
        }
        let (middle, half) = (0.5 * (rho + r), 0.5 * (rho - r));
        let value = |at: f64| self.pressure(at) / (at * at);
        let sum = |[node, weight]: [f64; 2]| {
            weight * (value(middle - half * node) + value(middle + half * node))
        };
        half * GAUSS.map(sum).iter().sum::<f64>()
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
        let piece = |start: f64, k: usize, curvature: [f64; 2]| Piece {
            start,
            anchor: rho[k],
            cubic: [p[k], slopes[k], curvature[0], curvature[1]],
            potential_at_anchor: 0.0,
        };
        let mut pieces = vec![piece(0.0, 0, [0.0; 2])];
        for k in 0..n - 1 {
            let width = rho[k + 1] - rho[k];
            let secant = (p[k + 1] - p[k]) / width;
            let c = (3.0 * secant - 2.0 * slopes[k] - slopes[k + 1]) / width;
            let d = (slopes[k] + slopes[k + 1] - 2.0 * secant) / (width * width);
            pieces.push(piece(rho[k], k, [c, d]));
        }
        pieces.push(piece(rho[n - 1], n - 1, [0.0; 2]));
        for k in 1..pieces.len() {
            let before = &pieces[k - 1];
            pieces[k].potential_at_anchor =
                before.potential_at_anchor + before.rise(pieces[k].anchor);
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

impl EquationOfState for Table {
    fn pressure(&self, rho: f64) -> f64 {
        self.piece(rho).pressure(rho)
    }
    fn sound_speed_squared(&self, rho: f64) -> f64 {
        let piece = self.piece(rho);
        let ([_, s, c, d], x) = (piece.cubic, rho - piece.anchor);
        s + x * (2.0 * c + 3.0 * x * d)
    }
    fn specific_potential(&self, rho: f64) -> f64 {
        let piece = self.piece(rho);
        piece.potential_at_anchor + piece.rise(rho)
    }
}
