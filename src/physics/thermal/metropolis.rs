//! Acceptance of updates: with the ratio of the weights of both states and of the densities of the
//! proposals there and back, exp(sum S) with the measure dr dp dS is exact at any step. Here is the
//! second one.

use super::{Ends, FrictionDecay, HeatDecay};
use crate::real::ln;

/// ln of the density with which friction proposes u for u' over that with which it proposes u' for u,
/// each from its decay and its width; `axis` is a unit vector.
#[inline(always)]
pub fn friction_odds<const D: usize>(
    axis: [f64; 3],
    [u, after]: [[f64; 3]; 2],
    [there, back]: [(FrictionDecay, f64); 2],
) -> f64 {
    let dot = |v: [f64; 3]| axis[0] * v[0] + axis[1] * v[1] + axis[2] * v[2];
    let leap = |from: [f64; 3], to: [f64; 3], (decay, width): (FrictionDecay, f64)| {
        let [start, end] = [from, to].map(dot);
        let along = end - (1.0 + decay.along) * start;
        let mut across = 0.0;
        for a in 0..D {
            let [x, y] = [from[a] - start * axis[a], to[a] - end * axis[a]];
            across += (y - (1.0 + decay.across) * x).powi(2);
        }
        let variance = |m: f64| width * width * -m * (2.0 + m);
        let [wide, deep] = [variance(decay.across), variance(decay.along)];
        // Central friction proposes nothing across.
        if wide > 0.0 {
            (
                along * along / deep + across / wide,
                deep * wide.powi(D as i32 - 1),
            )
        } else {
            (along * along / deep, deep)
        }
    };
    let (there, width) = leap(u, after, there);
    let (back, other) = leap(after, u, back);
    0.5 * (there - back + ln(width / other))
}

/// ln of the density with which conduction proposes to take `gain` back over that with which it
/// proposes it, each from the energies and the decay.
#[inline(always)]
pub fn heat_odds(gain: f64, there: (&Ends, &HeatDecay), back: (&Ends, &HeatDecay)) -> f64 {
    let leap = |gain: f64, (ends, decay): (&Ends, &HeatDecay)| {
        let [mean, variance] = ends.conducted(decay, true);
        ((gain - mean).powi(2) / variance, variance)
    };
    let (there, width) = leap(gain, there);
    let (back, other) = leap(-gain, back);
    0.5 * (there - back + ln(width / other))
}
