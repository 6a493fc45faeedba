//! Drag, viscous heating, heat conduction and the noise of each, for a pair of particles with
//! energies: the only place where they are formed. Positions are frozen, masses are 1, kB = 1; the
//! thermal energy of a particle is E = k T with its heat capacity k.
//!
//! Friction conserves momentum and energy: u = v_i - v_j relaxes exactly,
//!     u' = exp(-lam t) u + sqrt(s2 (1 - exp(-2 lam t))) xi,   lam = 2 g (1 - c)(a + b along e),
//!     s2 = 2 Tm/(1 - c),   Tm = 2 Ti Tj/(Ti + Tj),   c = 2 Ti Tj/(Ti + Tj)^2 / k,
//! and both take half of the kinetic energy lost. c is what keeps equipartition where k is small.
//! Heat: the first two moments of x = (E_i - E_j)/2 over the time t are exact, at any t:
//!     x' = r x + sqrt(s (1 - q) + x^2 (q - r^2)) xi,   r = exp(-th),   q = r^2 exp(-th/k),
//!     th = 4 kappa g t/k,   s = (E_i + E_j)^2/(4 (2 k + 1)).
//! A step that would leave no energy to one of them is not made: that happens at k of a few only.

use super::friction::LinkAxes;
use crate::random::expm1_negative;

/// Which exchanges there are; chosen by type, so absent ones leave no code behind.
pub trait Exchanges: Copy + Send + Sync + 'static {
    /// Name in the registry.
    const NAME: &'static str;
    /// Friction and its noise.
    const FRICTION: bool;
    /// Does friction heat, and its noise cool?
    const HEATING: bool;
    /// Conduction and its noise.
    const CONDUCTION: bool;
    /// Do the coefficients depend on the temperature?
    const VARIABLE: bool;
}

macro_rules! exchanges {
    ($($(#[$doc:meta])* $name:ident $key:literal $friction:literal $heating:literal $conduction:literal $variable:literal;)*) => {
        $($(#[$doc])*
        #[derive(Debug, Clone, Copy)]
        pub struct $name;
        impl Exchanges for $name {
            const NAME: &'static str = $key;
            const FRICTION: bool = $friction;
            const HEATING: bool = $heating;
            const CONDUCTION: bool = $conduction;
            const VARIABLE: bool = $variable;
        })*
    };
}
exchanges! {
    /// None: particles move on adiabats.
    Adiabatic "adiabatic" false false false false;
    /// Friction that heats, and conduction.
    Full "full" true true true false;
    /// The same with coefficients that depend on the temperature.
    FullVariable "full_variable" true true true true;
    /// Friction that heats.
    Heating "heating" true true false false;
    /// The same with coefficients that depend on the temperature.
    HeatingVariable "heating_variable" true true false true;
    /// Friction against a bath at the local temperature, and conduction.
    BathAndConduction "bath_conduction" true false true false;
    /// Friction against a bath at the local temperature.
    Bath "bath" true false false false;
    /// Conduction alone.
    Conduction "conduction" false false true false;
    /// The same with a conductivity that depends on the temperature.
    ConductionVariable "conduction_variable" false false true true;
}

/// Coefficients of a fluid with an energy.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PairThermal {
    /// a: friction across the line of centres.
    pub across: f64,
    /// b: along it, on top of a.
    pub along: f64,
    /// kappa/kB.
    pub conductivity: f64,
    /// k = C/kB of a particle.
    pub capacity: f64,
    /// Exponents of eta ~ T^n and kappa ~ T^n.
    pub exponents: [f64; 2],
    /// 1/T at which the coefficients have the values above.
    pub inverse_reference: f64,
    /// D.
    pub dimension: f64,
}

/// What an exchange over a time needs; fixed during a run.
#[derive(Debug, Clone, Copy)]
pub struct ThermalExchange {
    rate_across: f64,
    rate_along: f64,
    rate_heat: f64,
    capacity: f64,
    inverse_capacity: f64,
    /// 1/(4 (2 k + 1)).
    spread: f64,
    exponents: [f64; 2],
    /// 1/T_0, for the temperature at which coefficients are taken.
    inverse_reference: f64,
    dimension: f64,
}

/// Decay of the relative velocity of one pair: what may be computed for many at once.
#[derive(Debug, Clone, Copy, Default)]
pub struct FrictionDecay {
    /// exp(-lam t) - 1 across the line of centres.
    pub across: f64,
    /// The same along it.
    pub along: f64,
    /// sqrt(1 - exp(-2 lam t)) across.
    pub spread_across: f64,
    /// The same along.
    pub spread_along: f64,
}

/// Decay of the difference of energies of one pair.
#[derive(Debug, Clone, Copy, Default)]
pub struct HeatDecay {
    /// exp(-th) - 1.
    pub heat: f64,
    /// 1 - q.
    pub spread: f64,
}

impl PairThermal {
    /// Exchange over the time `t`.
    pub fn exchange(&self, t: f64) -> ThermalExchange {
        let k = self.capacity;
        ThermalExchange {
            rate_across: 2.0 * self.across * t,
            rate_along: 2.0 * (self.across + self.along) * t,
            rate_heat: 4.0 * self.conductivity * t / k,
            capacity: k,
            inverse_capacity: 1.0 / k,
            spread: 0.25 / (2.0 * k + 1.0),
            exponents: self.exponents,
            inverse_reference: self.inverse_reference,
            dimension: self.dimension,
        }
    }
}

/// c of the pair; 0 without noise, where kB plays no part.
#[inline(always)]
fn share(e: [f64; 2], inverse_capacity: f64) -> f64 {
    let sum = e[0] + e[1];
    2.0 * e[0] * e[1] / (sum * sum) * inverse_capacity
}

impl ThermalExchange {
    /// Decay by friction of a pair of weight g. Of the energies `e` only c depends, which is
    /// stationary at equal temperatures: they need not be the latest.
    #[inline(always)]
    pub fn friction<X: Exchanges>(&self, g: f64, e: [f64; 2], noise: bool) -> FrictionDecay {
        let c = if noise && X::HEATING {
            share(e, self.inverse_capacity)
        } else {
            0.0
        };
        let weight = g * (1.0 - c);
        let across = expm1_negative(self.rate_across * weight);
        let along = expm1_negative(self.rate_along * weight);
        let root = |m: f64| if noise { (-m * (2.0 + m)).sqrt() } else { 0.0 };
        FrictionDecay {
            across,
            along,
            spread_across: root(across),
            spread_along: root(along),
        }
    }

    /// Decay by conduction.
    #[inline(always)]
    pub fn heat(&self, g: f64, noise: bool) -> HeatDecay {
        let th = self.rate_heat * g;
        HeatDecay {
            heat: expm1_negative(th),
            spread: if noise {
                -expm1_negative(th * (2.0 + self.inverse_capacity))
            } else {
                0.0
            },
        }
    }

    /// eta over its value at the reference, for a pair whose relative velocity has the given square:
    /// at the mean of the temperatures, from what the pair's friction leaves as it is, E_i + E_j +
    /// K (K = u^2/4). With the factor of such an invariant no drift term is due.
    #[inline(always)]
    pub fn viscous_factor(&self, e: [f64; 2], square: f64) -> f64 {
        let freedom = self.capacity + 0.25 * self.dimension;
        let mean = (0.5 * (e[0] + e[1]) + 0.125 * square) * self.inverse_reference / freedom;
        mean.powf(self.exponents[0])
    }

    /// kappa over its value at the reference, at the mean temperature, which conduction leaves.
    #[inline(always)]
    pub fn conductive_factor(&self, e: [f64; 2]) -> f64 {
        let mean = 0.5 * (e[0] + e[1]) * self.inverse_reference * self.inverse_capacity;
        mean.powf(self.exponents[1])
    }

    /// sqrt(s2), the width of u.
    #[inline(always)]
    pub fn width<X: Exchanges>(&self, e: [f64; 2]) -> f64 {
        let (sum, product) = (e[0] + e[1], e[0] * e[1]);
        let reduced = if X::HEATING {
            self.capacity * sum * sum - 2.0 * product
        } else {
            self.capacity * sum * sum
        };
        (4.0 * product * sum / reduced).sqrt()
    }

    /// The energies after conduction, or as they are where one would be left with none.
    #[inline(always)]
    pub fn conduct(
        &self,
        e: [f64; 2],
        decay: &HeatDecay,
        xi: f64,
        noise: bool,
    ) -> Option<[f64; 2]> {
        let sum = e[0] + e[1];
        let x = 0.5 * (e[0] - e[1]);
        let r = 1.0 + decay.heat;
        let mut after = r * x;
        if noise {
            let q = 1.0 - decay.spread;
            let variance = sum * sum * self.spread * decay.spread + x * x * (q - r * r);
            after += variance.max(0.0).sqrt() * xi;
        }
        let half = 0.5 * sum;
        (after.abs() < half).then_some([half + after, half - after])
    }
}

/// Links to images behind walls.
impl ThermalExchange {
    /// The change of the relative velocity u of a link (of v_i - v_w, where it is `own`).
    #[inline]
    pub fn link<X: Exchanges>(
        &self,
        g: f64,
        axes: &LinkAxes,
        u: [f64; 3],
        e: [f64; 2],
        xi: Option<[f64; 3]>,
        own: bool,
    ) -> [f64; 3] {
        let mut weight = g;
        if X::VARIABLE {
            let square: f64 = u.iter().map(|x| x * x).sum();
            weight *= if own {
                let freedom = self.capacity + 0.5 * self.dimension;
                let t = (e[0] + 0.5 * square) * self.inverse_reference / freedom;
                t.powf(self.exponents[0])
            } else {
                self.viscous_factor(e, square)
            };
        }
        // The noise of an own image has the temperature of its particle, whatever it does to it.
        if xi.is_some() && X::HEATING && !own {
            weight *= 1.0 - share(e, self.inverse_capacity);
        }
        let excess = self.rate_along - self.rate_across;
        let rates = [0.0, axes.normal2, axes.tangent2].map(|x| self.rate_across + excess * x);
        let decay = rates.map(|rate| expm1_negative((rate * weight).max(0.0)));
        let mut change = axes.apply(decay[0], decay[1], decay[2], u);
        if let Some(xi) = xi {
            let width = if own {
                (e[0] * self.inverse_capacity).sqrt()
            } else {
                self.width::<X>(e)
            };
            let root = decay.map(|m| (-m * (2.0 + m)).sqrt());
            let noise = axes.apply(root[0], root[1], root[2], xi);
            for a in 0..3 {
                change[a] += width * noise[a];
            }
        }
        change
    }

    /// Energies after conduction to a bath of temperature t behind the wall, or None where one would
    /// be left with none. The image of j has 2 t - T_j: heat goes as t - Tm, linear in t however far
    /// away it is, and the noise is the one that leaves exp(S - E/t):
    ///     dE_i = dE_j = 4 kappa g (t (1 - c) - Tm) dt + sqrt(4 kappa g t Tm) dW,
    ///     own image: dE = 4 kappa g (t - T) dt + sqrt(8 kappa g t T) dW.
    /// Both have exact moments, the first with Tm/(E_i + E_j) as it is before.
    #[inline]
    pub fn bath<X: Exchanges>(
        &self,
        g: f64,
        e: [f64; 2],
        t: f64,
        xi: Option<f64>,
        own: bool,
    ) -> Option<[f64; 2]> {
        let mut th = self.rate_heat * g;
        if X::VARIABLE {
            th *= (t * self.inverse_reference).powf(self.exponents[1]);
        }
        let k = self.capacity;
        if own {
            let after = relax(e[0], k * t, th, t, xi);
            return (after > 0.0).then_some([after; 2]);
        }
        let sum = e[0] + e[1];
        let fraction = 4.0 * e[0] * e[1] / (sum * sum);
        let mut target = 2.0 * k * t / fraction;
        if xi.is_some() {
            target -= t;
        }
        let gain = 0.5 * (relax(sum, target, th * fraction, t, xi) - sum);
        let after = e.map(|x| x + gain);
        (after[0] > 0.0 && after[1] > 0.0).then_some(after)
    }
}

/// dE = r (target - E) dt + sqrt(2 r t E) dW after the time th/r, by its first two moments.
#[inline]
fn relax(e: f64, target: f64, th: f64, t: f64, xi: Option<f64>) -> f64 {
    let lost = -expm1_negative(th);
    let mut after = e + lost * (target - e);
    if let Some(xi) = xi {
        let kept = 1.0 - lost;
        let variance = t * (2.0 * e * kept * lost + target * lost * lost);
        after += variance.max(0.0).sqrt() * xi;
    }
    after
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::{Gaussian, Stream, SweepKey, Variate};

    fn coefficients(capacity: f64) -> PairThermal {
        PairThermal {
            across: 1.4,
            along: 2.2,
            conductivity: 3.1,
            capacity,
            exponents: [0.7, 0.7],
            inverse_reference: 1.0,
            dimension: 3.0,
        }
    }

    /// Moments of the exact process d x = -th x dt + ... by their own differential equations,
    /// integrated in small steps: mean -th x; mean square from the noise 4 kappa Ti Tj.
    #[test]
    fn conduction_has_the_moments_of_its_equation() {
        let k = 5.0;
        let exchange = coefficients(k).exchange(0.05);
        let e = [7.0, 4.0];
        let g = 0.7;
        let decays = exchange.heat(g, true);
        let [sum, x] = [e[0] + e[1], 0.5 * (e[0] - e[1])];
        // d<x^2>/dt = -2 th' <x^2> + 4 kappa g <Ti Tj>, Ti Tj = (M^2/4 - x^2)/k^2, th' per time;
        // the drift of x is -2 kappa g (2 x)/k.
        let kappa = 3.1 * g;
        let rate = 4.0 * kappa / k;
        let (mut square, steps) = (x * x, 200_000);
        let dt = 0.05 / f64::from(steps);
        for _ in 0..steps {
            let middle = square
                + 0.5
                    * dt
                    * (-2.0 * rate * square + 4.0 * kappa * (0.25 * sum * sum - square) / (k * k));
            square +=
                dt * (-2.0 * rate * middle + 4.0 * kappa * (0.25 * sum * sum - middle) / (k * k));
        }
        let plus = exchange.conduct(e, &decays, 1.0, true).unwrap();
        let minus = exchange.conduct(e, &decays, -1.0, true).unwrap();
        let [a, b] = [plus, minus].map(|e| 0.5 * (e[0] - e[1]));
        assert!((0.5 * (a + b) - x * (-rate * 0.05_f64).exp()).abs() < 1e-12);
        assert!((0.5 * (a * a + b * b) - square).abs() < 1e-8 * square);
        assert!((plus[0] + plus[1] - sum).abs() < 1e-14);
        // Nothing is left to one of them: the step is not made.
        assert_eq!(exchange.conduct([0.1, 0.1], &decays, 50.0, true), None);
        let silent = exchange.conduct(e, &exchange.heat(g, false), 0.0, false);
        assert!(
            (0.5 * (silent.unwrap()[0] - silent.unwrap()[1]) - x * (-rate * 0.05_f64).exp()).abs()
                < 1e-12
        );
    }

    /// One pair in a box of its own: E_1, E_2 and u^2/4 share an energy by the Dirichlet law of
    /// exp(sum S) with k, k and D/2, at long steps and for few degrees of freedom as well.
    #[test]
    fn a_pair_comes_to_its_equilibrium() {
        for (k, t) in [(4.0, 0.05), (4.0, 2.0), (25.0, 0.3)] {
            let exchange = coefficients(k).exchange(t);
            let mut e = [1.5 * k, 0.7 * k];
            let mut u = [0.5, -0.2, 0.1];
            let total = e[0] + e[1] + 0.25 * u.iter().map(|x| x * x).sum::<f64>();
            let n = 400_000_u64;
            let (mut first, mut second, mut motion) = (0.0, 0.0, 0.0);
            for step in 0..n {
                let words = SweepKey::new(5, Stream::PairExchange, step, 0).pair_words(0, 1);
                let xi = Gaussian::draw_four(words);
                let decays = exchange.friction::<Full>(1.0, e, true);
                let width = exchange.width::<Full>(e);
                let square = |u: [f64; 3]| u.iter().map(|x| x * x).sum::<f64>();
                // e along the first axis
                let next = [
                    u[0] * (1.0 + decays.along) + width * decays.spread_along * xi[0],
                    u[1] * (1.0 + decays.across) + width * decays.spread_across * xi[1],
                    u[2] * (1.0 + decays.across) + width * decays.spread_across * xi[2],
                ];
                let gain = 0.125 * (square(u) - square(next));
                if e[0] + gain > 0.0 && e[1] + gain > 0.0 {
                    (u, e) = (next, e.map(|x| x + gain));
                }
                let decays = exchange.heat(1.0, true);
                e = exchange.conduct(e, &decays, xi[3], true).unwrap_or(e);
                first += e[0] / total;
                second += (e[0] / total).powi(2);
                motion += 0.25 * square(u) / total;
            }
            let held = e[0] + e[1] + 0.25 * u.iter().map(|x| x * x).sum::<f64>();
            assert!((held - total).abs() < 1e-9 * total);
            let all = 2.0 * k + 1.5;
            let [mean, square, kinetic] = [first, second, motion].map(|x| x / n as f64);
            let exact = [k / all, k * (k + 1.0) / (all * (all + 1.0)), 1.5 / all];
            // 4 standard errors with some 10 steps of memory, and the time-step error of the split
            for (value, exact) in [mean, square, kinetic].into_iter().zip(exact) {
                assert!(
                    (value / exact - 1.0).abs() < 0.015,
                    "{k} {t}: {value} {exact}"
                );
            }
        }
    }

    /// Two particles, a bath and a conductor between them: E_i ~ Gamma(k) at the bath's temperature,
    /// independent of each other; and without noise the bath's temperature is reached.
    #[test]
    fn a_bath_brings_its_temperature() {
        let (k, t) = (6.0, 1.3);
        let exchange = coefficients(k).exchange(0.04);
        let mut e = [3.0, 9.0];
        let n = 600_000_u64;
        let mut sums = [0.0; 4];
        for step in 0..n {
            let words = SweepKey::new(9, Stream::PairExchange, step, 0).pair_words(0, 1);
            let xi = Gaussian::draw_four(words);
            e = exchange
                .bath::<Full>(1.0, e, t, Some(xi[0]), false)
                .unwrap_or(e);
            if let Some(own) = exchange.bath::<Full>(0.5, [e[0]; 2], t, Some(xi[1]), true) {
                e[0] = own[0];
            }
            let decays = exchange.heat(1.0, true);
            e = exchange.conduct(e, &decays, xi[2], true).unwrap_or(e);
            let [a, b] = e.map(|x| x / (k * t) - 1.0);
            for (sum, value) in sums.iter_mut().zip([a, a * a, b, a * b]) {
                *sum += value / n as f64;
            }
        }
        // Memory of some 20 steps: standard errors of .0024, .0015; of the time step less.
        let [mean, square, other, product] = sums;
        assert!(mean.abs() < 0.01 && other.abs() < 0.01, "{sums:?}");
        assert!((square * k - 1.0).abs() < 0.04, "{sums:?}");
        assert!(product.abs() < 0.006, "{sums:?}");
        let mut cold = [0.01 * k * t, 0.05 * k * t];
        for _ in 0..4000 {
            let decays = exchange.heat(1.0, false);
            cold = exchange.conduct(cold, &decays, 0.0, false).unwrap();
            cold = exchange.bath::<Full>(1.0, cold, t, None, false).unwrap();
        }
        assert!(cold.iter().all(|x| (x / (k * t) - 1.0).abs() < 1e-9));
    }

    /// A link with heating keeps the energy that it shares out, and u and the energies have the
    /// law of exp(sum S) on their energy shell; the same for an own image (whose one particle takes
    /// all of the energy: at k = 5 and a long step 2 % of the updates would leave it none).
    #[test]
    fn links_keep_energy_and_equilibrium() {
        let axes = LinkAxes {
            normal: [0.6, 0.0, 0.8],
            normal2: 0.3,
            tangent: [0.0, 1.0, 0.0],
            tangent2: 0.7,
        };
        for (own, k) in [(false, 5.0), (true, 15.0)] {
            let exchange = coefficients(k).exchange(0.3);
            let part = if own { 0.5 } else { 0.25 };
            let (mut e, mut u) = ([1.1 * k, 0.8 * k], [0.3, 0.2, -0.4]);
            let square = |u: [f64; 3]| u.iter().map(|x| x * x).sum::<f64>();
            let all = |e: [f64; 2], u| part * square(u) + if own { e[0] } else { e[0] + e[1] };
            let total = all(e, u);
            let n = 400_000_u64;
            let (mut heat, mut motion) = (0.0, 0.0);
            for step in 0..n {
                let words = SweepKey::new(3, Stream::PairExchange, step, 0).pair_words(0, 1);
                let xi = Gaussian::draw_four(words);
                let energies = if own { [e[0]; 2] } else { e };
                let noise = Some([xi[0], xi[1], xi[2]]);
                let change = exchange.link::<Full>(1.0, &axes, u, energies, noise, own);
                let next = [0, 1, 2].map(|a| u[a] + change[a]);
                let gain = part * (square(u) - square(next)) * if own { 1.0 } else { 0.5 };
                if energies.iter().all(|x| x + gain > 0.0) {
                    (u, e) = (next, e.map(|x| x + gain));
                }
                if !own {
                    let decays = exchange.heat(1.0, true);
                    e = exchange.conduct(e, &decays, xi[3], true).unwrap_or(e);
                }
                heat += e[0] / total / n as f64;
                motion += part * square(u) / total / n as f64;
            }
            assert!((all(e, u) - total).abs() < 1e-9 * total);
            let freedom = if own { k + 1.5 } else { 2.0 * k + 1.5 };
            assert!((heat * freedom / k - 1.0).abs() < 0.01, "{own} {heat}");
            assert!(
                (motion * freedom / 1.5 - 1.0).abs() < 0.015,
                "{own} {motion}"
            );
        }
    }
}
