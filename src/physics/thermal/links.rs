//! Links to images behind walls.

use super::super::friction::LinkAxes;
use super::{Ends, Exchanges, ThermalExchange};
use crate::real::expm1_negative;

impl ThermalExchange {
    /// The change of the relative velocity u of a link (of v_i - v_w, where it is `own`); g with the
    /// factor of eta.
    #[inline]
    pub fn link<X: Exchanges>(
        &self,
        g: f64,
        axes: &LinkAxes,
        u: [f64; 3],
        ends: &Ends,
        xi: Option<[f64; 3]>,
        own: bool,
    ) -> [f64; 3] {
        let mut weight = g;
        // The noise of an own image has the temperature of its particle, whatever it does to it.
        if xi.is_some() && X::HEATING && !own {
            weight *= 1.0 - ends.share();
        }
        let excess = self.rate_along - self.rate_across;
        let rates = [0.0, axes.normal2, axes.tangent2].map(|x| self.rate_across + excess * x);
        let decay = rates.map(|rate| expm1_negative((rate * weight).max(0.0)));
        let mut change = axes.apply(decay[0], decay[1], decay[2], u);
        if let Some(xi) = xi {
            let width = if own {
                (ends.e[0] * ends.inverse_capacity).sqrt()
            } else {
                ends.width::<X>()
            };
            let root = decay.map(|m| (-m * (2.0 + m)).sqrt());
            let noise = axes.apply(root[0], root[1], root[2], xi);
            for a in 0..3 {
                change[a] += width * noise[a];
            }
        }
        change
    }

    /// eta over its value at the reference for an own image: see `viscous_factor`; u^2/2 is the energy
    /// of its motion.
    #[inline]
    pub fn own_viscous_factor(&self, e: f64, square: f64, noise: bool) -> f64 {
        let (motion, freedom) = if noise {
            (0.5 * square, self.constant.capacity + 0.5 * self.dimension)
        } else {
            (0.0, self.constant.capacity)
        };
        self.viscous_factor_at((e + motion) / freedom)
    }

    /// What conduction to a bath of temperature t behind the wall adds to the energy of both
    /// particles. The image of j has 2 t - T_j: heat goes as t - Tm, linear in t however far
    /// away it is, and the noise is the one that leaves exp(S - E/t):
    ///     dE_i = dE_j = 4 kappa g (t (1 - c) - Tm) dt + sqrt(4 kappa g t Tm) dW,
    ///     own image: dE = 4 kappa g (t - T) dt + sqrt(8 kappa g t T) dW.
    /// Both have exact moments, the first with Tm/(E_i + E_j) as it is before.
    #[inline]
    pub fn bath<X: Exchanges>(
        &self,
        g: f64,
        ends: &Ends,
        t: f64,
        xi: Option<f64>,
        own: bool,
    ) -> f64 {
        let (k, e) = (ends.capacity, ends.e);
        let mut th = self.heat * g * ends.inverse_capacity;
        if X::VARIABLE {
            th *= self.conductive_factor_at(t);
        }
        if own {
            return relax(e[0], k * t, th, t, xi) - e[0];
        }
        let sum = e[0] + e[1];
        let fraction = 4.0 * e[0] * e[1] / (sum * sum);
        let mut target = 2.0 * k * t / fraction;
        if xi.is_some() {
            target -= t;
        }
        0.5 * (relax(sum, target, th * fraction, t, xi) - sum)
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
