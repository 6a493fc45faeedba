//! The pair sweep of the thermal splitting: friction, heating and conduction of each pair solved one
//! after the other, positions frozen (physics/thermal). Forward: friction, then conduction; a
//! backward sweep is the same from its end. What depends on positions alone is computed for a chunk
//! at once, and so are the decays; where coefficients follow the temperature those are brought up to
//! date from what they were at the start of the sweep.

use std::marker::PhantomData;

use super::couples::{Couples, Rest};
use super::heat_tally::{Given, HeatMoment, HeatSums, HeatTally};
use super::noise::Noise;
use super::pair_state::Energies;
use super::rows::{ROOM, whole};
use super::tally::{BlockSums, PartLanes, Tally, Virial, add_outer};
use super::wall_thermal::WallRounds;
use super::wide::LANES;
use super::{CHUNK, Direction, Shared, Task, Wide, for_each_block, run_wide};
use crate::domain::PeriodicBox;
use crate::kernel::Kernel;
use crate::neighbor::{BlockList, Grid, PairList, ROUNDS};
use crate::physics::{
    Ends, Exchanges, FrictionDecay, HeatDecay, ThermalExchange, friction_odds, heat_odds,
};
use crate::random::{SweepKey, Variate};
use crate::real::Arithmetic;
use crate::state::Particles;
use crate::thermal::Thermal;
use crate::wall::Walls;

/// F of the squared distances of a chunk: the kernel enters this sweep as a function, not as a type,
/// which keeps the number of loops to compile small.
pub type Slopes = fn(&[f64], &mut [f64]);

struct SlopeTask<'a, K, const D: usize> {
    r2: &'a [f64],
    slope: &'a mut [f64],
    kernel: PhantomData<K>,
}

impl<K: Kernel, const D: usize> Task for SlopeTask<'_, K, D> {
    type Output = ();
    #[inline(always)]
    fn run<W: Wide>(self) {
        for (slope, r2) in self.slope.iter_mut().zip(self.r2) {
            *slope = K::f::<_, D>(r2.sqrt());
        }
    }
}

/// The `Slopes` of a kernel.
pub fn slopes<K: Kernel, const D: usize>(r2: &[f64], slope: &mut [f64]) {
    run_wide(SlopeTask::<K, D> {
        r2,
        slope,
        kernel: PhantomData,
    });
}

/// The arrays of one chunk.
#[repr(align(64))]
struct Lanes {
    pairs: Couples,
    inverse_r2: [f64; ROOM],
    /// Factors of eta and kappa at the start of the sweep, then the weights with them.
    early: [[f64; ROOM]; 2],
    friction: [[f64; ROOM]; 2],
    heat: [[f64; ROOM]; 3],
    noise: Noise<4>,
    /// r.xi/r^2.
    projected: [f64; ROOM],
    /// Momentum exchanged, for the tally.
    change: [[f64; ROOM]; 3],
    /// Logarithms of the numbers that decide about acceptance.
    chance: [[f64; ROOM]; 2],
}

struct ThermalTask<'a, X, V, const D: usize> {
    block: &'a BlockList,
    cell: &'a PeriodicBox,
    position: &'a [[f64; 4]],
    velocity: Shared<'a, [f64; 4]>,
    energies: Energies<'a>,
    factors: &'a [[f64; 3]],
    refused: Shared<'a, u64>,
    id: &'a [u64],
    slopes: Slopes,
    exchange: &'a ThermalExchange,
    key: SweepKey,
    /// Of the numbers that decide about acceptance.
    chances: SweepKey,
    direction: Direction,
    round: usize,
    number: u32,
    tally: Option<BlockSums<'a>>,
    current: Option<HeatSums<'a>>,
    form: PhantomData<(X, V)>,
}

/// Fewer pairs than that are updated one by one.
const LEAST: usize = 3;

/// Velocities (with what lane 3 carries) and thermal energies of both ends of eight pairs.
#[derive(Default)]
#[repr(align(64))]
struct Eight {
    v: [[[f64; LANES]; 4]; 2],
    e: [[f64; LANES]; 2],
}

/// How many of the first pairs share no particle with one before them.
#[inline(always)]
fn disjoint<W: Wide>(pairs: &[[u32; 2]; LANES]) -> usize {
    let mut slots = [0; 2 * LANES];
    slots.copy_from_slice(pairs.as_flattened());
    (W::repeated(&slots).trailing_zeros() as usize / 2).min(LANES)
}

/// What happened to a pair.
struct Change {
    momentum: [f64; 3],
    random: [f64; 3],
    /// Energy that i got from j, the kinetic one included.
    energy: Given,
    refused: u64,
}

/// Is an update of that ln of the ratio accepted? What is no number is no reason to.
#[inline(always)]
fn accepts(chance: f64, ratio: f64) -> bool {
    chance < ratio
}

impl<X: Exchanges, V: Variate, const D: usize> ThermalTask<'_, X, V, D> {
    #[inline(always)]
    fn gather<W: Wide>(&self, lanes: &mut Lanes, rest: &mut Rest<'_>) {
        let pairs = &mut lanes.pairs;
        pairs.fill::<W, D>(self.block, self.cell, self.position, rest);
        if X::VARIABLE {
            for (k, &[i, j]) in pairs.slots.iter().enumerate().take(pairs.count) {
                let (f, g) = (&self.factors[i as usize], &self.factors[j as usize]);
                for n in 0..2 {
                    lanes.early[n][k] = 0.5 * (f[n] + g[n]);
                }
            }
        }
        if V::ON {
            lanes.noise.name_pairs(&pairs.slots, pairs.count, self.id);
        }
    }

    #[inline(always)]
    fn compute<W: Wide>(&self, lanes: &mut Lanes) {
        let count = whole::<f64>(lanes.pairs.count);
        if V::ON {
            lanes.noise.draw_four::<V, W>(&self.key, count);
        }
        if X::METROPOLIS {
            lanes
                .noise
                .logarithms::<W>(&self.chances, count, &mut lanes.chance);
        }
        let mut slope = [0.0; ROOM];
        (self.slopes)(&lanes.pairs.r2[..count], &mut slope[..count]);
        for k in 0..count {
            let weight = lanes.pairs.weight[k];
            let r2 = lanes.pairs.r2[k];
            lanes.inverse_r2[k] = 1.0 / if r2 > 1e-60 { r2 } else { 1e-60 };
            lanes.pairs.weight[k] = slope[k] * (weight * weight);
        }
        if X::FRICTION && V::ON {
            for k in 0..count {
                let mut projected = 0.0;
                for a in 0..D {
                    projected += lanes.pairs.r[a][k] * lanes.noise.xi[a][k];
                }
                lanes.projected[k] = lanes.inverse_r2[k] * projected;
            }
        }
        if X::VARIABLE {
            for k in 0..count {
                for n in 0..2 {
                    lanes.early[n][k] *= lanes.pairs.weight[k];
                }
            }
        }
        if X::FRICTION {
            for k in 0..count {
                let weight = if X::VARIABLE {
                    lanes.early[0][k]
                } else {
                    lanes.pairs.weight[k]
                };
                let d = self.exchange.friction::<X, W::Arithmetic>(weight, V::ON);
                lanes.friction[0][k] = d.across;
                lanes.friction[1][k] = d.along;
            }
        }
        if X::CONDUCTION && X::VARIABLE {
            for k in 0..count {
                lanes.heat[0][k] = self.exchange.heat_early::<W::Arithmetic>(lanes.early[1][k]);
            }
        }
        if X::CONDUCTION && !X::VARIABLE {
            for k in 0..count {
                let d = self
                    .exchange
                    .heat::<W::Arithmetic>(lanes.pairs.weight[k], V::ON);
                lanes.heat[0][k] = d.heat;
                lanes.heat[1][k] = d.spread;
                lanes.heat[2][k] = d.loss;
            }
        }
    }

    /// The weight of a pair's friction with the factor of eta.
    #[inline(always)]
    fn friction_weight(&self, lanes: &Lanes, k: usize, e: [f64; 2], square: f64) -> f64 {
        let g = lanes.pairs.weight[k];
        if X::VARIABLE {
            let slots = lanes.pairs.slots[k];
            g * self.energies.viscous_factor::<X>(slots, e, square, V::ON)
        } else {
            g
        }
    }

    #[inline(always)]
    fn friction_decay<A: Arithmetic>(
        &self,
        lanes: &Lanes,
        k: usize,
        g: f64,
        ends: &Ends,
    ) -> FrictionDecay {
        let decay = FrictionDecay {
            across: lanes.friction[0][k],
            along: lanes.friction[1][k],
        };
        if X::VARIABLE {
            let early = lanes.early[0][k];
            return self
                .exchange
                .at_weight::<X, A>(decay, early, g, ends, V::ON);
        }
        self.exchange
            .at_energies::<X, A, false>(decay, g, ends, V::ON)
    }

    /// The weight of a pair's conduction with the factor of kappa.
    #[inline(always)]
    fn heat_weight(&self, lanes: &Lanes, k: usize, e: [f64; 2]) -> f64 {
        let g = lanes.pairs.weight[k];
        if X::VARIABLE {
            g * self
                .energies
                .conductive_factor::<X>(lanes.pairs.slots[k], e)
        } else {
            g
        }
    }

    #[inline(always)]
    fn heat_decay(&self, lanes: &Lanes, k: usize, g: f64, ends: &Ends) -> HeatDecay {
        if X::VARIABLE {
            let (decay, early) = (lanes.heat[0][k], lanes.early[1][k]);
            return self.exchange.heat_at_weight(decay, early, g, ends, V::ON);
        }
        HeatDecay {
            heat: lanes.heat[0][k],
            spread: lanes.heat[1][k],
            loss: lanes.heat[2][k],
        }
    }

    #[inline(always)]
    fn friction<A: Arithmetic>(&self, lanes: &Lanes, k: usize, change: &mut Change) {
        let [i, j] = lanes.pairs.slots[k];
        // SAFETY: blocks of one colour share no particle, and i != j.
        let (v, w, ei, ej) = unsafe {
            (
                self.velocity.slot(i),
                self.velocity.slot(j),
                self.energies.heat.slot(i),
                self.energies.heat.slot(j),
            )
        };
        let e = [*ei, *ej];
        let (mut u, mut approach, mut square) = ([0.0; 3], 0.0, 0.0);
        for a in 0..D {
            u[a] = v[a] - w[a];
            approach = A::fused(lanes.pairs.r[a][k], u[a], approach);
            square = A::fused(u[a], u[a], square);
        }
        let ends = self.energies.ends::<X>([i, j], e);
        let g = self.friction_weight(lanes, k, e, square);
        let d = self.friction_decay::<A>(lanes, k, g, &ends);
        let inverse = lanes.inverse_r2[k];
        let half_across = 0.5 * d.across;
        let along = 0.5 * (d.along - d.across) * inverse * approach;
        let (mut strength, mut excess) = (0.0, 0.0);
        if V::ON {
            let square = 0.25 * ends.square_width::<X>();
            let spread = |m: f64| (square * (-m * (2.0 + m))).sqrt();
            strength = spread(d.across);
            excess = (spread(d.along) - strength) * lanes.projected[k];
        }
        let (mut dv, mut work) = ([0.0; 3], 0.0);
        for a in 0..D {
            let (r, xi) = (lanes.pairs.r[a][k], lanes.noise.xi[a][k]);
            let random = A::fused(strength, xi, excess * r);
            dv[a] = A::fused(half_across, u[a], A::fused(along, r, random));
            change.random[a] = random;
            work = A::fused(dv[a], u[a] + dv[a], work);
        }
        if X::HEATING {
            // Half of the kinetic energy lost goes to each.
            let gain = -0.5 * work;
            if !(e[0] + gain > 0.0 && e[1] + gain > 0.0) {
                change.refused += 1;
                change.random = [0.0; 3];
                return;
            }
            if X::METROPOLIS {
                let after = [e[0] + gain, e[1] + gain];
                let then = self.energies.ends::<X>([i, j], after);
                let axis = [0, 1, 2].map(|a| lanes.pairs.r[a][k] * inverse.sqrt());
                let moved = [0, 1, 2].map(|a| u[a] + 2.0 * dv[a]);
                let back = self.exchange.at_ends::<X>(d, g, [&ends, &then]);
                let proposals = [(d, ends.width::<X>()), (back, then.width::<X>())];
                let odds = friction_odds::<D>(axis, [u, moved], proposals);
                let weight = self.energies.weight([i, j], [e, after], [&ends, &then]);
                if !accepts(lanes.chance[0][k], weight + odds) {
                    change.refused += 1;
                    change.random = [0.0; 3];
                    return;
                }
            }
            *ei = e[0] + gain;
            *ej = e[1] + gain;
        }
        for a in 0..D {
            let mean = 0.5 * (v[a] + w[a]);
            change.energy.mean[1] += (dv[a] - change.random[a]) * mean;
            change.energy.noise[1] += change.random[a] * mean;
            v[a] += dv[a];
            w[a] -= dv[a];
        }
        change.momentum = dv;
    }

    #[inline(always)]
    fn conduction(&self, lanes: &Lanes, k: usize, change: &mut Change) {
        let [i, j] = lanes.pairs.slots[k];
        // SAFETY: blocks of one colour share no particle, and i != j.
        let (ei, ej) = unsafe { (self.energies.heat.slot(i), self.energies.heat.slot(j)) };
        let e = [*ei, *ej];
        let ends = self.energies.ends::<X>([i, j], e);
        let g = self.heat_weight(lanes, k, e);
        let d = self.heat_decay(lanes, k, g, &ends);
        let gain = ends.conduct(&d, lanes.noise.xi[3][k], V::ON);
        let after = [e[0] + gain, e[1] - gain];
        if !(after[0] > 0.0 && after[1] > 0.0) {
            change.refused += 1;
            return;
        }
        if X::METROPOLIS {
            let then = self.energies.ends::<X>([i, j], after);
            let from = g * ends.inverse_capacity;
            let back = self.exchange.heat_at_weight(d.heat, from, g, &then, V::ON);
            let odds = heat_odds(gain, (&ends, &d), (&then, &back));
            let weight = self.energies.weight([i, j], [e, after], [&ends, &then]);
            if !accepts(lanes.chance[1][k], weight + odds) {
                change.refused += 1;
                return;
            }
        }
        let mean = 0.5 * d.heat * (ends.e[0] - ends.e[1]);
        change.energy.mean[0] = mean;
        change.energy.noise[0] = gain - mean;
        [*ei, *ej] = after;
    }

    /// One pair.
    #[inline(always)]
    fn update<A: Arithmetic>(&self, lanes: &Lanes, k: usize) -> Change {
        let mut change = Change {
            momentum: [0.0; 3],
            random: [0.0; 3],
            energy: Given::default(),
            refused: 0,
        };
        if X::CONDUCTION && self.direction == Direction::Backward {
            self.conduction(lanes, k, &mut change);
        }
        if X::FRICTION {
            self.friction::<A>(lanes, k, &mut change);
        }
        if X::CONDUCTION && self.direction == Direction::Forward {
            self.conduction(lanes, k, &mut change);
        }
        change
    }

    /// Updates up to eight pairs at once: as many as share no particle, so that what one of them does
    /// does not depend on the others. Returns how many; 0, and nothing is done, where few are or one
    /// of them needs a branch.
    #[inline(always)]
    fn update_several<W: Wide>(&self, lanes: &Lanes, k: usize) -> usize {
        if X::VARIABLE || X::GENERAL || X::METROPOLIS {
            return 0;
        }
        let (pairs, _) = lanes.pairs.slots[k..].as_chunks::<LANES>();
        let mut pairs = pairs[0];
        // Behind the last pair the first again, which ends what is disjoint: no slot of another
        // block may be read.
        let left = (lanes.pairs.count - k).min(LANES);
        for lane in left..LANES {
            pairs[lane] = pairs[0];
        }
        let several = disjoint::<W>(&pairs);
        if several < LEAST {
            return 0;
        }
        let [p0, p1, p2, p3, p4, p5, p6, p7] = pairs;
        let slots = [
            [p0[0], p1[0], p2[0], p3[0], p4[0], p5[0], p6[0], p7[0]],
            [p0[1], p1[1], p2[1], p3[1], p4[1], p5[1], p6[1], p7[1]],
        ];
        let mut state = Eight::default();
        for end in 0..2 {
            // SAFETY: slots of particles; blocks of one colour share none.
            unsafe {
                let columns = W::columns(self.velocity.pointer(), slots[end].as_ptr());
                for (column, to) in columns.iter().zip(&mut state.v[end]) {
                    column.store(to.as_mut_ptr());
                }
                for lane in 0..LANES {
                    state.e[end][lane] = *self.energies.heat.slot(slots[end][lane]);
                }
            }
        }
        let forward = self.direction == Direction::Forward;
        let mut fine = true;
        if X::CONDUCTION && !forward {
            fine &= self.conduct_eight(lanes, k, &mut state, several);
        }
        if X::FRICTION {
            fine &= self.rub_eight::<W::Arithmetic>(lanes, k, &mut state, several);
        }
        if X::CONDUCTION && forward {
            fine &= self.conduct_eight(lanes, k, &mut state, several);
        }
        if !fine {
            return 0;
        }
        for end in 0..2 {
            let mut records = [[0.0; 4]; LANES];
            // SAFETY: as above.
            unsafe {
                let v = &state.v[end];
                let columns = [
                    W::load(v[0].as_ptr()),
                    W::load(v[1].as_ptr()),
                    W::load(v[2].as_ptr()),
                    W::load(v[3].as_ptr()),
                ];
                W::records(columns, records.as_mut_ptr());
                for lane in 0..several {
                    *self.velocity.slot(slots[end][lane]) = records[lane];
                    *self.energies.heat.slot(slots[end][lane]) = state.e[end][lane];
                }
            }
        }
        several
    }

    /// `friction` of eight pairs; false if one of the first `several` needs more care.
    #[inline(always)]
    fn rub_eight<A: Arithmetic>(
        &self,
        lanes: &Lanes,
        k: usize,
        state: &mut Eight,
        several: usize,
    ) -> bool {
        let (mut nearby, mut least) = ([0_u32; LANES], [0.0; LANES]);
        for l in 0..LANES {
            let ends = self.exchange.ends([state.e[0][l], state.e[1][l]]);
            let g = lanes.pairs.weight[k + l];
            nearby[l] = u32::from(self.exchange.is_nearby::<X>(g, &ends, V::ON));
        }
        if nearby[..several].contains(&0) {
            return false;
        }
        for l in 0..LANES {
            let n = k + l;
            let e = [state.e[0][l], state.e[1][l]];
            let ends = self.exchange.ends(e);
            let (mut u, mut approach) = ([0.0; 3], 0.0);
            for a in 0..D {
                u[a] = state.v[0][a][l] - state.v[1][a][l];
                approach = A::fused(lanes.pairs.r[a][n], u[a], approach);
            }
            let decay = FrictionDecay {
                across: lanes.friction[0][n],
                along: lanes.friction[1][n],
            };
            let g = lanes.pairs.weight[n];
            let d = self
                .exchange
                .at_energies::<X, A, true>(decay, g, &ends, V::ON);
            let half_across = 0.5 * d.across;
            let along = 0.5 * (d.along - d.across) * lanes.inverse_r2[n] * approach;
            let (mut strength, mut excess) = (0.0, 0.0);
            if V::ON {
                let square = 0.25 * ends.square_width::<X>();
                let spread = |m: f64| (square * (-m * (2.0 + m))).sqrt();
                strength = spread(d.across);
                excess = (spread(d.along) - strength) * lanes.projected[n];
            }
            let mut work = 0.0;
            for a in 0..D {
                let (r, xi) = (lanes.pairs.r[a][n], lanes.noise.xi[a][n]);
                let random = A::fused(strength, xi, excess * r);
                let dv = A::fused(half_across, u[a], A::fused(along, r, random));
                work = A::fused(dv, u[a] + dv, work);
                state.v[0][a][l] += dv;
                state.v[1][a][l] -= dv;
            }
            if X::HEATING {
                let gain = -0.5 * work;
                state.e[0][l] = e[0] + gain;
                state.e[1][l] = e[1] + gain;
                least[l] = if e[0] < e[1] { e[0] } else { e[1] } + gain;
            } else {
                least[l] = 1.0;
            }
        }
        least[..several].iter().all(|&energy| energy > 0.0)
    }

    /// `conduction` of eight pairs; false if one of the first `several` were to be refused.
    #[inline(always)]
    fn conduct_eight(&self, lanes: &Lanes, k: usize, state: &mut Eight, several: usize) -> bool {
        let mut least = [0.0; LANES];
        for l in 0..LANES {
            let n = k + l;
            let e = [state.e[0][l], state.e[1][l]];
            let d = HeatDecay {
                heat: lanes.heat[0][n],
                spread: lanes.heat[1][n],
                loss: lanes.heat[2][n],
            };
            let gain = self
                .exchange
                .ends(e)
                .conduct(&d, lanes.noise.xi[3][n], V::ON);
            let after = [e[0] + gain, e[1] - gain];
            state.e[0][l] = after[0];
            state.e[1][l] = after[1];
            least[l] = if after[0] < after[1] {
                after[0]
            } else {
                after[1]
            };
        }
        least[..several].iter().all(|&energy| energy > 0.0)
    }

    /// One chunk after the other.
    #[inline(always)]
    fn sweep<W: Wide>(&self, lanes: &mut Lanes, mut rest: Rest<'_>) {
        let mut virial = self.tally.map(Virial::new);
        let mut handed = self.current.map(|_| HeatMoment::default());
        let mut refused = 0;
        while !rest.is_empty() {
            self.gather::<W>(lanes, &mut rest);
            self.compute::<W>(lanes);
            let count = lanes.pairs.count.min(CHUNK);
            if virial.is_none() && handed.is_none() {
                let mut k = 0;
                while k < count {
                    let several = self.update_several::<W>(lanes, k);
                    if several == 0 {
                        refused += self.update::<W::Arithmetic>(lanes, k).refused;
                    }
                    k += several.max(1);
                }
            } else {
                refused +=
                    self.update_and_add::<W::Arithmetic>(lanes, count, &mut virial, &mut handed);
            }
        }
        // SAFETY: this block's own number.
        unsafe {
            *self.refused.slot(self.number) += refused;
            if let (Some(sums), Some(virial)) = (self.tally, virial) {
                sums.add(self.number, &virial.sum);
            }
            if let (Some(sums), Some(handed)) = (self.current, handed) {
                sums.add(self.number, &handed);
            }
        }
    }

    #[inline(always)]
    fn update_and_add<A: Arithmetic>(
        &self,
        lanes: &mut Lanes,
        count: usize,
        virial: &mut Option<Virial>,
        handed: &mut Option<HeatMoment>,
    ) -> u64 {
        let mut refused = 0;
        for k in 0..count {
            let change = self.update::<A>(lanes, k);
            refused += change.refused;
            if let Some(handed) = handed {
                let r = [
                    lanes.pairs.r[0][k],
                    lanes.pairs.r[1][k],
                    lanes.pairs.r[2][k],
                ];
                handed.exchange::<D>(r, &change.energy);
            }
            for a in 0..D {
                lanes.change[a][k] = change.momentum[a];
                if let Some(Virial {
                    parts: Some(PartLanes { parts }),
                    ..
                }) = virial
                {
                    parts[1][a][k] = change.momentum[a] - change.random[a];
                    parts[2][a][k] = change.random[a];
                }
            }
        }
        match virial {
            Some(Virial {
                sum,
                parts: Some(parts),
            }) => parts.add_to::<D, ROOM, _>(sum, &lanes.pairs.r, count),
            Some(Virial { sum, parts: None }) => {
                add_outer::<D, ROOM, ROOM, _, _>(
                    &mut sum[1],
                    &lanes.pairs.r,
                    &mut lanes.change,
                    count,
                );
            }
            None => {}
        }
        refused
    }
}

impl<X: Exchanges, V: Variate, const D: usize> Task for ThermalTask<'_, X, V, D> {
    type Output = ();
    #[inline(always)]
    fn run<W: Wide>(self) {
        let zero = [0.0; ROOM];
        let mut lanes = Lanes {
            pairs: Couples::new(),
            inverse_r2: zero,
            early: [zero; 2],
            friction: [zero; 2],
            heat: [zero; 3],
            noise: Noise::new(),
            projected: zero,
            change: [zero; 3],
            chance: [zero; 2],
        };
        let rest = Rest::of(self.block, self.round, self.direction);
        self.sweep::<W>(&mut lanes, rest);
    }
}

/// What a thermal sweep works on, beside the particles.
pub struct ThermalSweep<'a> {
    /// Blocks and their colours.
    pub grid: &'a Grid,
    /// Pairs.
    pub list: &'a PairList,
    /// The box.
    pub cell: &'a PeriodicBox,
    /// F of the kernel, for the distances of a chunk.
    pub slopes: Slopes,
    /// The same for one distance.
    pub slope: fn(f64) -> f64,
    /// The exchange of half a step.
    pub exchange: ThermalExchange,
    /// How long that is.
    pub time: f64,
    /// Of the noise.
    pub key: SweepKey,
    /// Of the numbers that decide about acceptance.
    pub chances: SweepKey,
    /// Order of the sweep.
    pub direction: Direction,
}

/// One sweep over all pairs and over links to images: round by round, colour by colour, block by
/// block. Updates that would leave a particle without energy are not made, and counted.
pub fn thermal_exchange<X: Exchanges, V: Variate, const D: usize>(
    particles: &mut Particles,
    walls: &mut Walls,
    thermal: &mut Thermal,
    sweep: &ThermalSweep<'_>,
    mut tally: Option<&mut Tally>,
) {
    let sums = tally.as_deref_mut().map(Tally::begin);
    if X::VARIABLE {
        thermal.renew_factors(particles);
    }
    if let Some(current) = &mut thermal.current {
        current.begin();
    }
    let mut along = WallRounds::begin(walls);
    let backward = sweep.direction == Direction::Backward;
    // Given heat comes last, and backward first.
    if let (true, Some(along)) = (backward, &along) {
        along.heat_by_flux(particles, walls, thermal, sweep);
    }
    for k in 0..ROUNDS {
        let round = if backward { ROUNDS - 1 - k } else { k };
        // Walls after the pairs, and backward before them: a step is the same from both ends.
        if let (true, Some(along)) = (backward, &mut along) {
            along.round::<X, V, D>(particles, walls, thermal, sweep, round);
        }
        if X::FRICTION || X::CONDUCTION {
            pairs::<X, V, D>(particles, thermal, sweep, round, sums);
        }
        if let (false, Some(along)) = (backward, &mut along) {
            along.round::<X, V, D>(particles, walls, thermal, sweep, round);
        }
    }
    if let Some(along) = along {
        if !backward {
            along.heat_by_flux(particles, walls, thermal, sweep);
        }
        along.finish(walls, thermal);
    }
    thermal.count_refused();
    if let Some(current) = &mut thermal.current {
        current.keep(1.0);
    }
    if let Some(tally) = tally {
        tally.keep_exchange();
    }
}

fn pairs<X: Exchanges, V: Variate, const D: usize>(
    particles: &mut Particles,
    thermal: &mut Thermal,
    sweep: &ThermalSweep<'_>,
    round: usize,
    tally: Option<BlockSums<'_>>,
) {
    let mut refused = std::mem::take(&mut thermal.refused);
    let mut current = thermal.current.take();
    {
        let current = current.as_mut().map(HeatTally::sums);
        let counts = Shared::new(&mut refused);
        let velocity = Shared::new(&mut particles.velocity);
        let energies = Energies {
            heat: Shared::new(&mut particles.scalars[thermal.fields.heat].values),
            states: thermal.states(),
            exchange: &sweep.exchange,
        };
        let (position, id) = (&particles.position, &particles.id);
        let backward = sweep.direction == Direction::Backward;
        for_each_block(sweep.grid, backward, &|number| {
            run_wide(ThermalTask::<X, V, D> {
                block: &sweep.list.blocks[number as usize],
                cell: sweep.cell,
                position,
                velocity,
                energies,
                factors: &thermal.factors,
                refused: counts,
                id,
                slopes: sweep.slopes,
                exchange: &sweep.exchange,
                key: sweep.key,
                chances: sweep.chances,
                direction: sweep.direction,
                round,
                number,
                tally,
                current,
                form: PhantomData,
            });
        });
    }
    (thermal.refused, thermal.current) = (refused, current);
}
