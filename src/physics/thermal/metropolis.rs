//! Acceptance of updates: with the ratio of the weights of both states and of the densities of the
//! proposals there and back, exp(sum S) with the measure dr dp dS is exact at any step.

use super::{Ends, Exchanges, ThermalExchange};

/// -2 ln of a normal density, up to a constant; without a width there is nothing to propose.
#[inline]
fn surprise(square: f64, variance: f64, count: f64) -> f64 {
    if variance > 0.0 {
        square / variance + count * variance.ln()
    } else {
        0.0
    }
}

impl ThermalExchange {
    /// ln of the density with which friction at the energies of `ends` proposes u' for u. `g` comes
    /// with the factor of eta, `axis` is a unit vector.
    pub fn friction_proposal<X: Exchanges>(
        &self,
        g: f64,
        ends: &Ends,
        axis: [f64; 3],
        u: [f64; 3],
        after: [f64; 3],
    ) -> f64 {
        let decay = self.friction_at::<X>(g, ends, true);
        let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
        let [before_along, after_along] = [u, after].map(|x| dot(axis, x));
        let along = after_along - (1.0 + decay.along) * before_along;
        let mut across = 0.0;
        for a in 0..3 {
            let [before, then] = [
                u[a] - before_along * axis[a],
                after[a] - after_along * axis[a],
            ];
            across += (then - (1.0 + decay.across) * before).powi(2);
        }
        let width = ends.width::<X>();
        let variance = |m: f64| width * width * -m * (2.0 + m);
        -0.5 * (surprise(along * along, variance(decay.along), 1.0)
            + surprise(across, variance(decay.across), self.dimension - 1.0))
    }

    /// ln of the density with which conduction at the energies of `ends` proposes to add `gain` to the
    /// first and to take it from the second. `g` comes with the factor of kappa.
    pub fn heat_proposal(&self, g: f64, ends: &Ends, gain: f64) -> f64 {
        let [mean, variance] = ends.conducted(&self.heat_at(g, ends, true), true);
        -0.5 * surprise((gain - mean).powi(2), variance, 1.0)
    }
}
