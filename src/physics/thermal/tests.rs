//! The laws of the exchanges of one pair.

use std::sync::Arc;

use super::super::friction::LinkAxes;
use super::*;
use crate::random::{Gaussian, Stream, SweepKey, Variate};
use crate::real::Plain;

fn coefficients(capacity: f64) -> PairThermal {
    PairThermal {
        across: 1.4,
        along: 2.2,
        conductivity: 3.1,
        capacity,
        powers: Arc::new([Power::new(0.7), Power::new(0.7)]),
        inverse_reference: 1.0,
        dimension: 3.0,
    }
}

/// Energies after conduction, or None where one would be left with none.
fn conduct(ends: &Ends, decay: &HeatDecay, xi: f64, noise: bool) -> Option<[f64; 2]> {
    let gain = ends.conduct(decay, xi, noise);
    let after = [ends.e[0] + gain, ends.e[1] - gain];
    (after[0] > 0.0 && after[1] > 0.0).then_some(after)
}

/// Moments of the exact process d x = -th x dt + ... by their own differential equations,
/// integrated in small steps: mean -th x; mean square from the noise 4 kappa Ti Tj.
#[test]
fn conduction_has_the_moments_of_its_equation() {
    let k = 5.0;
    let exchange = coefficients(k).exchange(0.05);
    let e = [7.0, 4.0];
    let g = 0.7;
    let decays = exchange.heat::<Plain>(g, true);
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
        square += dt * (-2.0 * rate * middle + 4.0 * kappa * (0.25 * sum * sum - middle) / (k * k));
    }
    let plus = conduct(&exchange.ends(e), &decays, 1.0, true).unwrap();
    let minus = conduct(&exchange.ends(e), &decays, -1.0, true).unwrap();
    let [a, b] = [plus, minus].map(|e| 0.5 * (e[0] - e[1]));
    assert!((0.5 * (a + b) - x * (-rate * 0.05_f64).exp()).abs() < 1e-12);
    assert!((0.5 * (a * a + b * b) - square).abs() < 1e-8 * square);
    assert!((plus[0] + plus[1] - sum).abs() < 1e-14);
    // Nothing is left to one of them: the step is not made.
    assert_eq!(conduct(&exchange.ends([0.1; 2]), &decays, 50.0, true), None);
    let silent = conduct(
        &exchange.ends(e),
        &exchange.heat::<Plain>(g, false),
        0.0,
        false,
    );
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
            let xi = Gaussian::draw_four::<Plain>(words);
            let decays = exchange.friction::<Full, Plain>(1.0, true);
            let decays =
                exchange.at_energies::<Full, Plain, false>(decays, 1.0, &exchange.ends(e), true);
            let root = |m: f64| (-m * (2.0 + m)).sqrt();
            let width = exchange.ends(e).width::<Full>();
            let square = |u: [f64; 3]| u.iter().map(|x| x * x).sum::<f64>();
            // e along the first axis
            let next = [
                u[0] * (1.0 + decays.along) + width * root(decays.along) * xi[0],
                u[1] * (1.0 + decays.across) + width * root(decays.across) * xi[1],
                u[2] * (1.0 + decays.across) + width * root(decays.across) * xi[2],
            ];
            let gain = 0.125 * (square(u) - square(next));
            if e[0] + gain > 0.0 && e[1] + gain > 0.0 {
                (u, e) = (next, e.map(|x| x + gain));
            }
            let decays = exchange.heat::<Plain>(1.0, true);
            e = conduct(&exchange.ends(e), &decays, xi[3], true).unwrap_or(e);
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
        let xi = Gaussian::draw_four::<Plain>(words);
        let gain = exchange.bath::<Full>(1.0, &exchange.ends(e), t, Some(xi[0]), false);
        if e.iter().all(|x| x + gain > 0.0) {
            e = e.map(|x| x + gain);
        }
        let gain = exchange.bath::<Full>(0.5, &exchange.ends([e[0]; 2]), t, Some(xi[1]), true);
        e[0] += if e[0] + gain > 0.0 { gain } else { 0.0 };
        let decays = exchange.heat::<Plain>(1.0, true);
        e = conduct(&exchange.ends(e), &decays, xi[2], true).unwrap_or(e);
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
        let decays = exchange.heat::<Plain>(1.0, false);
        cold = conduct(&exchange.ends(cold), &decays, 0.0, false).unwrap();
        let gain = exchange.bath::<Full>(1.0, &exchange.ends(cold), t, None, false);
        cold = cold.map(|x| x + gain);
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
            let xi = Gaussian::draw_four::<Plain>(words);
            let energies = if own { [e[0]; 2] } else { e };
            let noise = Some([xi[0], xi[1], xi[2]]);
            let change = exchange.link::<Full>(1.0, &axes, u, &exchange.ends(energies), noise, own);
            let next = [0, 1, 2].map(|a| u[a] + change[a]);
            let gain = part * (square(u) - square(next)) * if own { 1.0 } else { 0.5 };
            if energies.iter().all(|x| x + gain > 0.0) {
                (u, e) = (next, e.map(|x| x + gain));
            }
            if !own {
                let decays = exchange.heat::<Plain>(1.0, true);
                e = conduct(&exchange.ends(e), &decays, xi[3], true).unwrap_or(e);
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

/// What is computed for a chunk and brought up to date is what is computed from scratch.
#[test]
fn decays_brought_up_to_date_are_those_from_scratch() {
    let exchange = coefficients(9.0).exchange(0.2);
    let ends = exchange.ends([11.0, 7.0]);
    for (early, g) in [
        (0.4, 0.41),
        (0.4, 0.33),
        (0.4, 1.9),
        (0.4, 0.01),
        (900.0, 0.1),
        (0.1, 900.0),
    ] {
        let first = exchange.friction::<Full, Plain>(early, true);
        let got = exchange.at_weight::<Full, Plain>(first, early, g, &ends, true);
        let want = exchange.friction_at::<Full>(g, &ends, true);
        assert!((got.across - want.across).abs() < 1e-11 && (got.along - want.along).abs() < 1e-11);
        let warmer = exchange.ends([9.0, 25.0]);
        let got = exchange.at_ends::<Full>(want, g, [&ends, &warmer]);
        let want = exchange.friction_at::<Full>(g, &warmer, true);
        assert!((got.across - want.across).abs() < 1e-11 && (got.along - want.along).abs() < 1e-11);
        let early = early * ends.inverse_capacity;
        let got =
            exchange.heat_at_weight(exchange.heat_early::<Plain>(early), early, g, &ends, true);
        let want = exchange.heat_at(g, &ends, true);
        assert!((got.heat - want.heat).abs() < 1e-11);
        assert!((got.spread - want.spread).abs() < 1e-11 && (got.loss - want.loss).abs() < 1e-11);
    }
}

/// Particles whose capacities follow their temperatures, k = k_0 (1 + T): E = k_0 (T + T^2/2) and
/// S = k_0 (ln T + T).
struct Rising(f64);

impl Rising {
    fn temperature(&self, e: f64) -> f64 {
        (1.0 + 2.0 * e / self.0).sqrt() - 1.0
    }
    fn state(&self, e: f64) -> [f64; 2] {
        let t = self.temperature(e);
        [t, self.0 * (1.0 + t)]
    }
    fn weight(&self, e: f64) -> f64 {
        let t = self.temperature(e);
        self.0 * (t.ln() + t) - t.ln()
    }
}

/// <E_i>, <E_i^2> and <K> of two of them and their relative motion, by quadrature over the shell.
fn moments_on_the_shell(a: &Rising, b: &Rising, total: f64) -> [f64; 3] {
    let n = 700;
    let mut sums = [0.0; 4];
    for i in 0..n {
        for j in 0..n {
            let [x, y] = [i, j].map(|k| total * (f64::from(k) + 0.5) / f64::from(n));
            let motion = total - x - y;
            if motion > 0.0 {
                // exp(S_1 + S_2) dS_1 dS_2 d^3u: sqrt(K) dK at a fixed total.
                let weight = (a.weight(x) + b.weight(y)).exp() * motion.sqrt();
                for (sum, value) in sums.iter_mut().zip([1.0, x, x * x, motion]) {
                    *sum += weight * value;
                }
            }
        }
    }
    [1, 2, 3].map(|k| sums[k] / sums[0])
}

/// With acceptance a pair of unequal particles, whose capacities follow their temperatures, comes to
/// exp(sum S) at steps of several decay times; without it at short ones.
#[test]
fn acceptance_makes_the_equilibrium_of_any_pair_exact() {
    for (metropolis, t, tolerance) in [(true, 1.0, 0.01), (true, 0.1, 0.01), (false, 0.03, 0.01)] {
        let exchange = coefficients(1.0).exchange(t);
        let kinds = [Rising(2.0), Rising(5.0)];
        let square = |u: [f64; 3]| u.iter().map(|x| x * x).sum::<f64>();
        let ends = |e: [f64; 2]| Ends::of_states([kinds[0].state(e[0]), kinds[1].state(e[1])]);
        let weight = |e: [f64; 2]| kinds[0].weight(e[0]) + kinds[1].weight(e[1]);
        let (mut e, mut u) = ([3.0, 6.0], [0.5, -0.2, 0.1]);
        let total = e[0] + e[1] + 0.25 * square(u);
        let (n, axis) = (600_000_u64, [0.6, 0.0, 0.8]);
        let mut sums = [0.0; 3];
        for step in 0..n {
            let key = |draw| SweepKey::new(8, Stream::PairExchange, step, draw).pair_words(0, 1);
            let xi = Gaussian::draw_four::<Plain>(key(0));
            let chance = key(1).map(|word| ((word as f64 + 0.5) / 4_294_967_296.0).ln());
            let here = ends(e);
            let decay = exchange.friction_at::<FullMetropolis>(1.0, &here, true);
            let width = here.width::<FullMetropolis>();
            let root = |m: f64| (-m * (2.0 + m)).sqrt();
            let dot = |v: [f64; 3]| v[0] * axis[0] + v[1] * axis[1] + v[2] * axis[2];
            let mut after = [0.0; 3];
            for a in 0..3 {
                let [along, noise] = [dot(u) * axis[a], dot([xi[0], xi[1], xi[2]]) * axis[a]];
                after[a] = (1.0 + decay.across) * (u[a] - along)
                    + (1.0 + decay.along) * along
                    + width * (root(decay.across) * (xi[a] - noise) + root(decay.along) * noise);
            }
            let gain = 0.125 * (square(u) - square(after));
            let then = e.map(|x| x + gain);
            if then[0] > 0.0 && then[1] > 0.0 {
                let there = (decay, width);
                let new = ends(then);
                let decay = exchange.at_ends::<FullMetropolis>(decay, 1.0, [&here, &new]);
                let back = (decay, new.width::<FullMetropolis>());
                let odds = friction_odds::<3>(axis, [u, after], [there, back]);
                if !metropolis || chance[0] < weight(then) - weight(e) + odds {
                    (u, e) = (after, then);
                }
            }
            let here = ends(e);
            let decay = exchange.heat_at(1.0, &here, true);
            let gain = here.conduct(&decay, xi[3], true);
            let then = [e[0] + gain, e[1] - gain];
            if then[0] > 0.0 && then[1] > 0.0 {
                let new = ends(then);
                let other = exchange.heat_at(1.0, &new, true);
                let odds = heat_odds(gain, (&here, &decay), (&new, &other));
                if !metropolis || chance[1] < weight(then) - weight(e) + odds {
                    e = then;
                }
            }
            for (sum, value) in sums.iter_mut().zip([e[0], e[0] * e[0], 0.25 * square(u)]) {
                *sum += value / n as f64;
            }
        }
        let exact = moments_on_the_shell(&kinds[0], &kinds[1], total);
        for (value, exact) in sums.into_iter().zip(exact) {
            assert!(
                (value / exact - 1.0).abs() < tolerance,
                "{metropolis} {t}: {value} {exact}"
            );
        }
    }
}

/// A bath brings its temperature to a pair of unequal particles whose capacities follow it: the law of
/// each is exp(S - E/t) dS, here by quadrature.
#[test]
fn a_bath_brings_its_temperature_to_any_pair() {
    let t = 1.3;
    let exchange = coefficients(1.0).exchange(0.01);
    let kinds = [Rising(2.0), Rising(5.0)];
    let (mut e, n) = ([4.0, 9.0], 1_500_000_u64);
    let mut sums = [0.0; 4];
    for step in 0..n {
        let words = SweepKey::new(2, Stream::PairExchange, step, 0).pair_words(0, 1);
        let xi = Gaussian::draw_four::<Plain>(words);
        let ends = |e: [f64; 2]| Ends::of_states([kinds[0].state(e[0]), kinds[1].state(e[1])]);
        let gain = exchange.bath::<FullGeneral>(1.0, &ends(e), t, Some(xi[0]), false);
        if e.iter().all(|x| x + gain > 0.0) {
            e = e.map(|x| x + gain);
        }
        let here = ends(e);
        let gain = here.conduct(&exchange.heat_at(1.0, &here, true), xi[1], true);
        if e[0] + gain > 0.0 && e[1] > gain {
            e = [e[0] + gain, e[1] - gain];
        }
        for (sum, value) in sums.iter_mut().zip([e[0], e[0] * e[0], e[1], e[1] * e[1]]) {
            *sum += value / n as f64;
        }
    }
    for (k, kind) in kinds.iter().enumerate() {
        let mut moments = [0.0; 3];
        for cell in 0..60_000 {
            let x = 1e-3 * (f64::from(cell) + 0.5);
            let weight = (kind.weight(x) - x / t).exp();
            for (sum, value) in moments.iter_mut().zip([1.0, x, x * x]) {
                *sum += weight * value;
            }
        }
        // Memory of some 60 steps: errors of .3 and .6 %.
        let (mean, square) = (moments[1] / moments[0], moments[2] / moments[0]);
        assert!(
            (sums[2 * k] / mean - 1.0).abs() < 0.012,
            "{k} {} {mean}",
            sums[2 * k]
        );
        assert!(
            (sums[2 * k + 1] / square - 1.0).abs() < 0.025,
            "{k} {}",
            sums[2 * k + 1] / square
        );
    }
}
