//! One pair: the decay of its relative velocity and of the difference of its energies.

use super::{Exchanges, ThermalExchange};
use crate::real::{Arithmetic, Plain, Real, expm1_negative};

/// Two particles as their exchange sees them: energies k T with one heat capacity k for both.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ends {
    /// k T_i and k T_j.
    pub e: [f64; 2],
    /// k.
    pub capacity: f64,
    /// 1/k.
    pub inverse_capacity: f64,
    /// 1/(4 (2 k + 1)).
    spread: f64,
}

/// Decay of the relative velocity of one pair, exp(-lam t) - 1.
#[derive(Debug, Clone, Copy, Default)]
pub struct FrictionDecay {
    /// Across the line of centres.
    pub across: f64,
    /// Along it.
    pub along: f64,
}

/// Decay of the difference of energies of one pair.
#[derive(Debug, Clone, Copy, Default)]
pub struct HeatDecay {
    /// exp(-th) - 1.
    pub heat: f64,
    /// 1 - q.
    pub spread: f64,
    /// q - r^2.
    pub loss: f64,
}

impl Ends {
    /// With the energies `e` at the heat capacity k.
    #[inline(always)]
    pub fn new(e: [f64; 2], capacity: f64) -> Self {
        Self {
            e,
            capacity,
            inverse_capacity: 1.0 / capacity,
            spread: 0.25 / (2.0 * capacity + 1.0),
        }
    }

    /// Of particles with temperatures and heat capacities of their own.
    #[inline(always)]
    pub fn of_states(states: [[f64; 2]; 2]) -> Self {
        let [[t, k], [s, l]] = states;
        let capacity = 2.0 * k * l / (k + l);
        Self::new([capacity * t, capacity * s], capacity)
    }

    /// y^2, y = (T_i - T_j)/(T_i + T_j).
    #[inline(always)]
    pub(super) fn spread_of(&self) -> f64 {
        let y = (self.e[0] - self.e[1]) / (self.e[0] + self.e[1]);
        y * y
    }

    /// Weight g times 1/(2 k) - c.
    #[inline(always)]
    fn excess(&self, g: f64) -> f64 {
        0.5 * self.inverse_capacity * self.spread_of() * g
    }

    /// c, the share of the fluctuations in the friction.
    #[inline(always)]
    pub(super) fn share(&self) -> f64 {
        0.5 * self.inverse_capacity * (1.0 - self.spread_of())
    }

    /// sqrt(s2), the width of u.
    #[inline(always)]
    pub fn width<X: Exchanges>(&self) -> f64 {
        self.square_width::<X>().sqrt()
    }

    /// s2.
    #[inline(always)]
    pub fn square_width<X: Exchanges>(&self) -> f64 {
        let (sum, product) = (self.e[0] + self.e[1], self.e[0] * self.e[1]);
        let reduced = if X::HEATING {
            self.capacity * sum * sum - 2.0 * product
        } else {
            self.capacity * sum * sum
        };
        4.0 * product * sum / reduced
    }

    /// What conduction adds to the first energy and takes from the second: mean and variance.
    #[inline(always)]
    pub(super) fn conducted(&self, decay: &HeatDecay, noise: bool) -> [f64; 2] {
        let sum = self.e[0] + self.e[1];
        let x = 0.5 * (self.e[0] - self.e[1]);
        let variance = if noise {
            (sum * sum * self.spread * decay.spread + x * x * decay.loss).max(0.0)
        } else {
            0.0
        };
        [decay.heat * x, variance]
    }

    /// What conduction adds to the first energy and takes from the second.
    #[inline(always)]
    pub fn conduct(&self, decay: &HeatDecay, xi: f64, noise: bool) -> f64 {
        let [mean, variance] = self.conducted(decay, noise);
        if noise {
            mean + variance.sqrt() * xi
        } else {
            mean
        }
    }
}

/// Below that exp(-x) - 1 is a short series.
const SMALL: f64 = 0.03;

/// exp(-x) - 1 for |x| < SMALL.
#[inline(always)]
fn expm1_series<A: Arithmetic>(x: f64) -> f64 {
    // In pairs of terms: none waits for more than two others.
    let square = x * x;
    let low = A::fused(-0.5, x, 1.0);
    let middle = A::fused(-1.0 / 24.0, x, 1.0 / 6.0);
    let high = A::fused(-1.0 / 720.0, x, 1.0 / 120.0);
    -x * A::fused(square, A::fused(square, high, middle), low)
}

/// exp(-x) - 1 for x >= 0 that is small nearly always.
#[inline(always)]
fn expm1_small(x: f64) -> f64 {
    if x < SMALL {
        expm1_series::<Plain>(x)
    } else {
        expm1_negative(x)
    }
}

/// exp(-whole) - 1 from exp(-(whole - more)) - 1, where `more`, of any sign, is small: nearly always,
/// or known to be.
#[inline(always)]
fn further<A: Arithmetic, const NEARBY: bool>(decay: f64, more: f64, whole: f64) -> f64 {
    if NEARBY || more.abs() < SMALL {
        A::fused(1.0 + decay, expm1_series::<A>(more), decay)
    } else {
        expm1_negative(whole)
    }
}

impl ThermalExchange {
    /// A pair of particles with the constant heat capacity.
    #[inline(always)]
    pub fn ends(&self, e: [f64; 2]) -> Ends {
        Ends { e, ..self.constant }
    }

    /// Decay by friction of a pair of weight g at equal temperatures, where c is 1/(2 k): all that
    /// may be computed before the energies are known.
    #[inline(always)]
    pub fn friction<X: Exchanges, A: Arithmetic>(&self, g: f64, noise: bool) -> FrictionDecay {
        let weight = if noise && X::HEATING {
            g * (1.0 - 0.5 * self.constant.inverse_capacity)
        } else {
            g
        };
        self.relaxed::<A>(weight)
    }

    /// The same at the present energies: c = (1 - y^2)/(2 k) is smaller where they differ. `NEARBY`
    /// where `is_nearby` is known: the same bits without a branch.
    #[inline(always)]
    pub fn at_energies<X: Exchanges, A: Arithmetic, const NEARBY: bool>(
        &self,
        decay: FrictionDecay,
        g: f64,
        ends: &Ends,
        noise: bool,
    ) -> FrictionDecay {
        if !(noise && X::HEATING) {
            return decay;
        }
        let whole = g * (1.0 - ends.share());
        self.relaxed_further::<A, NEARBY>(decay, ends.excess(g), whole)
    }

    /// Is what `at_energies` adds small for both rates? Then it needs no branch.
    #[inline(always)]
    pub fn is_nearby<X: Exchanges>(&self, g: f64, ends: &Ends, noise: bool) -> bool {
        if !(noise && X::HEATING) {
            return true;
        }
        let rate = if self.rate_along > self.rate_across {
            self.rate_along
        } else {
            self.rate_across
        };
        rate * ends.excess(g) < SMALL
    }

    /// The same for a weight that has become `g` since: `early` is that of the decay.
    #[inline(always)]
    pub fn at_weight<X: Exchanges, A: Arithmetic>(
        &self,
        decay: FrictionDecay,
        early: f64,
        g: f64,
        ends: &Ends,
        noise: bool,
    ) -> FrictionDecay {
        let (mut more, mut whole) = (g - early, g);
        if noise && X::HEATING {
            more += 0.5 * self.constant.inverse_capacity * early - ends.share() * g;
            whole -= ends.share() * g;
        }
        self.relaxed_further::<A, false>(decay, more, whole)
    }

    /// Decay by friction of a pair at its present energies, from scratch.
    #[cfg(test)]
    pub fn friction_at<X: Exchanges>(&self, g: f64, ends: &Ends, noise: bool) -> FrictionDecay {
        if noise && X::HEATING {
            self.relaxed::<Plain>(g * (1.0 - ends.share()))
        } else {
            self.relaxed::<Plain>(g)
        }
    }

    /// Decay by friction of a weight g between `then` from that between `ends`.
    #[inline(always)]
    pub fn at_ends<X: Exchanges>(
        &self,
        decay: FrictionDecay,
        g: f64,
        [ends, then]: [&Ends; 2],
    ) -> FrictionDecay {
        if X::HEATING {
            let more = (ends.share() - then.share()) * g;
            self.relaxed_further::<Plain, false>(decay, more, g * (1.0 - then.share()))
        } else {
            decay
        }
    }

    #[inline(always)]
    fn relaxed<A: Arithmetic>(&self, weight: f64) -> FrictionDecay {
        FrictionDecay {
            across: (self.rate_across * weight).expm1_negative::<A>(),
            along: (self.rate_along * weight).expm1_negative::<A>(),
        }
    }

    #[inline(always)]
    fn relaxed_further<A: Arithmetic, const NEARBY: bool>(
        &self,
        decay: FrictionDecay,
        more: f64,
        whole: f64,
    ) -> FrictionDecay {
        let further = |decay, rate: f64| further::<A, NEARBY>(decay, rate * more, rate * whole);
        FrictionDecay {
            across: further(decay.across, self.rate_across),
            along: further(decay.along, self.rate_along),
        }
    }

    /// Decay by conduction with the constant heat capacity.
    #[inline(always)]
    pub fn heat<A: Arithmetic>(&self, g: f64, noise: bool) -> HeatDecay {
        self.heat_of::<A>(self.rate_heat * g, self.constant.inverse_capacity, noise)
    }

    /// Decay by conduction of a weight over a heat capacity, all that may be computed before the
    /// energies are known: exp(-th) - 1.
    #[inline(always)]
    pub fn heat_early<A: Arithmetic>(&self, g_over_capacity: f64) -> f64 {
        (self.heat * g_over_capacity).expm1_negative::<A>()
    }

    /// The decay for a weight that has become `g` since: `early` is that of `heat_early`.
    #[inline(always)]
    pub fn heat_at_weight(
        &self,
        decay: f64,
        early: f64,
        g: f64,
        ends: &Ends,
        noise: bool,
    ) -> HeatDecay {
        let now = g * ends.inverse_capacity;
        let heat = further::<Plain, false>(decay, self.heat * (now - early), self.heat * now);
        let (mut spread, mut loss) = (0.0, 0.0);
        if noise {
            let kept = 1.0 + heat;
            loss = kept * kept * expm1_small(self.heat * now * ends.inverse_capacity);
            spread = -(heat * (2.0 + heat) + loss);
        }
        HeatDecay { heat, spread, loss }
    }

    /// Decay by conduction at the heat capacity of the pair.
    #[inline(always)]
    pub fn heat_at(&self, g: f64, ends: &Ends, noise: bool) -> HeatDecay {
        self.heat_of::<Plain>(
            self.heat * g * ends.inverse_capacity,
            ends.inverse_capacity,
            noise,
        )
    }

    #[inline(always)]
    fn heat_of<A: Arithmetic>(&self, th: f64, inverse_capacity: f64, noise: bool) -> HeatDecay {
        let heat = th.expm1_negative::<A>();
        let (mut spread, mut loss) = (0.0, 0.0);
        if noise {
            let kept = 1.0 + heat;
            loss = kept * kept * (th * inverse_capacity).expm1_negative::<A>();
            spread = -(heat * (2.0 + heat) + loss);
        }
        HeatDecay { heat, spread, loss }
    }

    /// eta over its value at the reference, for a pair whose relative velocity has the given square:
    /// at the mean of the temperatures, from what the pair's friction leaves as it is, E_i + E_j +
    /// K (K = u^2/4). With the factor of such an invariant no drift term is due. Without noise there
    /// is none to cancel, and it is the temperature itself.
    #[inline(always)]
    pub fn viscous_factor(&self, e: [f64; 2], square: f64, noise: bool) -> f64 {
        let (motion, freedom) = if noise {
            (
                0.125 * square,
                self.constant.capacity + 0.25 * self.dimension,
            )
        } else {
            (0.0, self.constant.capacity)
        };
        self.viscous_factor_at((0.5 * (e[0] + e[1]) + motion) / freedom)
    }

    /// eta of a temperature over its value at the reference.
    #[inline(always)]
    pub fn viscous_factor_at(&self, temperature: f64) -> f64 {
        self.powers[0].of(temperature * self.inverse_reference)
    }

    /// kappa over its value at the reference, at the mean temperature, which conduction leaves.
    #[inline(always)]
    pub fn conductive_factor(&self, e: [f64; 2]) -> f64 {
        self.conductive_factor_at(0.5 * (e[0] + e[1]) * self.constant.inverse_capacity)
    }

    /// kappa of a temperature over its value at the reference.
    #[inline(always)]
    pub fn conductive_factor_at(&self, temperature: f64) -> f64 {
        self.powers[1].of(temperature * self.inverse_reference)
    }

    /// Is eta the same at every temperature?
    #[inline(always)]
    pub fn constant_viscosity(&self) -> bool {
        self.powers[0].exponent() == 0.0
    }

    /// Is kappa the same at every temperature?
    #[inline(always)]
    pub fn constant_conductivity(&self) -> bool {
        self.powers[1].exponent() == 0.0
    }

    /// D.
    pub fn dimension(&self) -> f64 {
        self.dimension
    }
}
