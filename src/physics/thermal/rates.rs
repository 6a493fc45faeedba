//! The same physics as forces and rates of heat at one instant, for an integrator
//! that adds them up; the only place where they are formed. Masses are 1, kB = 1.
//!
//! Force on i and heat to i of one pair, u = v_i - v_j, Tm = 2 Ti Tj/(Ti + Tj), k = C/kB:
//!     f = -(1 - c) phi g (a u + b e (e.u)) + noise of covariance 2 Tm phi g (a I + b e e^T),
//!     heat = -f.u/2 - 2 kappa chi g (Ti - Tj) + noise of variance 4 kappa chi g Ti Tj,
//!     c = Ti Tj/(Ti + Tj)^2 (1/ki + 1/kj).
//! j gets -f, and as heat -f.u/2 and the rest with the other sign. phi and chi, the factors of the
//! power laws, are taken at the mean temperature; what they then add to the drift is
//!     c n phi of friction, 2 n kappa chi g Ti Tj (1/ki - 1/kj)/(Ti + Tj) of heat.
//! The noise has the temperatures at the start of a step (Ito). The product f.u is meant as that of
//! both ends of a step, half and half (Stratonovich): then its mean holds the loss Tm tr G to the
//! noise, and no such term appears here.

use std::sync::Arc;

use super::{Exchanges, PairThermal, Power};

/// What a pair knows of its two particles.
#[derive(Debug, Clone, Copy)]
pub struct PairState {
    /// Temperatures.
    pub now: [f64; 2],
    /// Temperatures at the start of the step, which the noise has.
    pub start: [f64; 2],
    /// 1/k of both.
    pub inverse_capacity: [f64; 2],
}

/// What the rates of a step need; fixed during a run.
#[derive(Debug, Clone)]
pub struct ThermalRates {
    across: f64,
    along: f64,
    /// sqrt(a) and sqrt(a + b) - sqrt(a).
    roots: [f64; 2],
    conduction: f64,
    inverse_time: f64,
    powers: Arc<[Power; 2]>,
    inverse_reference: f64,
}

/// Drag and noise of one pair.
#[derive(Debug, Clone, Copy, Default)]
pub struct PairForce {
    /// Drag on i.
    pub drag: [f64; 3],
    /// Random force on i.
    pub random: [f64; 3],
}

impl PairThermal {
    /// Rates whose noise acts over the time `t`.
    pub fn rates(&self, t: f64) -> ThermalRates {
        let root = self.across.max(0.0).sqrt();
        ThermalRates {
            across: self.across,
            along: self.along,
            roots: [root, (self.across + self.along).max(0.0).sqrt() - root],
            conduction: 2.0 * self.conductivity,
            inverse_time: 1.0 / t,
            powers: Arc::clone(&self.powers),
            inverse_reference: self.inverse_reference,
        }
    }
}

/// Ti Tj/(Ti + Tj).
#[inline(always)]
fn reduced(t: [f64; 2]) -> f64 {
    t[0] * t[1] / (t[0] + t[1])
}

impl ThermalRates {
    /// A power law at the mean of two temperatures.
    #[inline(always)]
    fn factor<X: Exchanges>(&self, t: [f64; 2], power: &Power) -> f64 {
        if X::VARIABLE {
            power.of(0.5 * (t[0] + t[1]) * self.inverse_reference)
        } else {
            1.0
        }
    }

    /// (1 - c) phi and what phi adds to the drift. Without noise kB plays no part.
    #[inline(always)]
    fn drag_factor<X: Exchanges>(&self, state: &PairState, noise: bool) -> f64 {
        let phi = self.factor::<X>(state.now, &self.powers[0]);
        if !(noise && X::HEATING) {
            return phi;
        }
        let [ki, kj] = state.inverse_capacity;
        let c = reduced(state.now) / (state.now[0] + state.now[1]) * (ki + kj);
        let share = if X::VARIABLE {
            c * (1.0 - self.powers[0].exponent())
        } else {
            c
        };
        phi * (1.0 - share)
    }

    /// Drag and noise on i: r = r_ij, xi with the sign of the order of ids.
    #[inline(always)]
    pub fn force<X: Exchanges>(
        &self,
        g: f64,
        inverse_r2: f64,
        r: [f64; 3],
        u: [f64; 3],
        state: &PairState,
        xi: Option<[f64; 3]>,
    ) -> PairForce {
        let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
        let weight = -g * self.drag_factor::<X>(state, xi.is_some());
        let across = weight * self.across;
        let along = weight * self.along * inverse_r2 * dot(r, u);
        let mut force = PairForce {
            drag: std::array::from_fn(|a| across * u[a] + along * r[a]),
            random: [0.0; 3],
        };
        if let Some(xi) = xi {
            let phi = self.factor::<X>(state.start, &self.powers[0]);
            let width = (4.0 * reduced(state.start) * phi * g * self.inverse_time).sqrt();
            let across = width * self.roots[0];
            let along = width * self.roots[1] * inverse_r2 * dot(r, xi);
            force.random = std::array::from_fn(|a| across * xi[a] + along * r[a]);
        }
        force
    }

    /// Heat per time that conduction brings from j to i; xi with the sign of the order of ids.
    #[inline(always)]
    pub fn conduction<X: Exchanges>(&self, g: f64, state: &PairState, xi: Option<f64>) -> f64 {
        let t = state.now;
        let weight = self.conduction * g * self.factor::<X>(t, &self.powers[1]);
        let mut heat = weight * (t[1] - t[0]);
        if let Some(xi) = xi {
            if X::VARIABLE {
                let [ki, kj] = state.inverse_capacity;
                heat += weight * self.powers[1].exponent() * reduced(t) * (ki - kj);
            }
            let s = state.start;
            let strength = self.conduction * g * self.factor::<X>(s, &self.powers[1]);
            heat += (2.0 * strength * s[0] * s[1] * self.inverse_time).sqrt() * xi;
        }
        heat
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Bath, Full, FullVariable};
    use super::*;
    use crate::random::{Gaussian, Stream, SweepKey, Variate};
    use crate::real::Plain;

    const STATE: PairState = PairState {
        now: [0.7, 1.6],
        start: [0.8, 1.5],
        inverse_capacity: [0.2, 0.125],
    };

    fn rates() -> ThermalRates {
        let pair = PairThermal {
            across: 1.4,
            along: 2.2,
            conductivity: 3.1,
            capacity: 5.0,
            powers: Arc::new([Power::new(0.7), Power::new(0.9)]),
            inverse_reference: 0.9,
            dimension: 3.0,
        };
        pair.rates(0.01)
    }

    /// The drift of a mobility M(x) with coefficients that depend on the state is that of the
    /// derivatives: (1 - c) phi + X (phi_i/k_i + phi_j/k_j), by differences of phi.
    #[test]
    fn the_drift_is_that_of_the_derivatives() {
        let rates = rates();
        let [ti, tj] = STATE.now;
        let [ki, kj] = STATE.inverse_capacity;
        let law = |ti: f64, tj: f64, n: f64| (0.45 * (ti + tj)).powf(n);
        let slopes = |n: f64| {
            let h = 1e-5;
            [
                (law(ti + h, tj, n) - law(ti - h, tj, n)) / (2.0 * h),
                (law(ti, tj + h, n) - law(ti, tj - h, n)) / (2.0 * h),
            ]
        };
        let x = ti * tj / (ti + tj);
        let c = x / (ti + tj) * (ki + kj);
        let [pi, pj] = slopes(0.7);
        let expected = (1.0 - c) * law(ti, tj, 0.7) + x * (pi * ki + pj * kj);
        let got = rates.drag_factor::<FullVariable>(&STATE, true);
        assert!((got - expected).abs() < 1e-9, "{got} {expected}");
        assert_eq!(rates.drag_factor::<Full>(&STATE, true), 1.0 - c);
        assert_eq!(rates.drag_factor::<Full>(&STATE, false), 1.0);
        assert_eq!(rates.drag_factor::<Bath>(&STATE, true), 1.0);
        let [pi, pj] = slopes(0.9);
        let kappa = 3.1 * 0.6;
        let expected = -2.0 * kappa * law(ti, tj, 0.9) * (ti - tj)
            + 2.0 * kappa * ti * tj * (pi * ki - pj * kj);
        let got = rates.conduction::<FullVariable>(0.6, &STATE, Some(0.0));
        assert!((got - expected).abs() < 1e-8, "{got} {expected}");
    }

    /// Covariance of the noise by the drawn variates; four standard errors of each entry.
    #[test]
    fn the_noise_has_its_covariance() {
        let (rates, n) = (rates(), 200_000_u64);
        let (g, r) = (0.6, [0.3, -0.2, 0.4]);
        let inverse_r2 = 1.0 / 0.29;
        let key = SweepKey::new(3, Stream::PairThermalForce, 0, 0);
        let (mut sum, mut heat) = ([[0.0; 3]; 3], 0.0);
        for id in 0..n {
            let [x, y, z, w] = Gaussian::draw_four::<Plain>(key.pair_words(id, id + 1));
            let xi = Some([x, y, z]);
            let f = rates.force::<FullVariable>(g, inverse_r2, r, [0.0; 3], &STATE, xi);
            let q = rates.conduction::<FullVariable>(g, &STATE, Some(w))
                - rates.conduction::<FullVariable>(g, &STATE, Some(0.0));
            heat += q * q;
            for a in 0..3 {
                for b in 0..3 {
                    sum[a][b] += f.random[a] * f.random[b];
                }
            }
        }
        let [ti, tj] = STATE.start;
        let phi = (0.45 * (ti + tj)).powf(0.7);
        let strength = 2.0 * (2.0 * ti * tj / (ti + tj)) * phi * g / 0.01;
        let exact = |a: usize, b: usize| {
            let along = 2.2 * r[a] * r[b] * inverse_r2;
            strength * (if a == b { 1.4 } else { 0.0 } + along)
        };
        for a in 0..3 {
            for b in 0..3 {
                let error = ((exact(a, a) * exact(b, b) + exact(a, b).powi(2)) / n as f64).sqrt();
                let got = sum[a][b] / n as f64;
                assert!((got - exact(a, b)).abs() < 4.0 * error, "{a} {b} {got}");
            }
        }
        let chi = (0.45 * (ti + tj)).powf(0.9);
        let exact = 4.0 * 3.1 * chi * g * ti * tj / 0.01;
        let error = exact * (2.0 / n as f64).sqrt();
        assert!((heat / n as f64 - exact).abs() < 4.0 * error);
    }
}
