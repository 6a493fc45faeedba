//! The pair sweep of the thermal splitting: friction, heating and conduction of each pair solved one
//! after the other, positions frozen (physics/thermal). Forward: friction, then conduction; a
//! backward sweep is the same from its end. What depends on positions alone is computed for a chunk
//! at once, and so are the decays; where coefficients follow the temperature those are brought up to
//! date from what they were at the start of the sweep.

use std::marker::PhantomData;

use super::heat_tally::{Given, HeatMoment, HeatSums, HeatTally};
use super::pair_state::Energies;
use super::tally::{BlockSums, PartLanes, Tally, Virial, add_outer};
use super::wall_thermal::WallRounds;
use super::{CHUNK, Direction, Shared, Task, Wide, for_each_block, padded, run_wide};
use crate::domain::PeriodicBox;
use crate::kernel::Kernel;
use crate::neighbor::{BlockList, Grid, PairList, ROUNDS};
use crate::physics::{
    Ends, Exchanges, FrictionDecay, HeatDecay, ThermalExchange, friction_odds, heat_odds,
};
use crate::random::{
    Arithmetic, SweepKey, Variate, ln, pair_counter, philox4x32_lanes, unit_interval,
};
use crate::state::Particles;
use crate::thermal::Thermal;
use crate::wall::Walls;

/// F of the squared distances of a chunk: the kernel enters this sweep as a function, not as a type,
/// which keeps the number of loops to compile small.
pub type Slopes = fn(&[f64; CHUNK], &mut [f64; CHUNK]);

struct SlopeTask<'a, K, const D: usize> {
    r2: &'a [f64; CHUNK],
    slope: &'a mut [f64; CHUNK],
    kernel: PhantomData<K>,
}

impl<K: Kernel, const D: usize> Task for SlopeTask<'_, K, D> {
    type Output = ();
    #[inline(always)]
    fn run<W: Wide>(self) {
        for (slope, r2) in self.slope.iter_mut().zip(self.r2) {
            *slope = K::f::<D>(r2.sqrt());
        }
    }
}

/// The `Slopes` of a kernel.
pub fn slopes<K: Kernel, const D: usize>(r2: &[f64; CHUNK], slope: &mut [f64; CHUNK]) {
    run_wide(SlopeTask::<K, D> {
        r2,
        slope,
        kernel: PhantomData,
    });
}

/// The arrays of one chunk: pairs within the support, in the order of the sweep.
#[repr(align(64))]
struct Lanes {
    slots: [[u32; 2]; CHUNK],
    r: [[f64; CHUNK]; 3],
    r2: [f64; CHUNK],
    inverse_r2: [f64; CHUNK],
    weight: [f64; CHUNK],
    /// Factors of eta and kappa at the start of the sweep, then the weights with them.
    early: [[f64; CHUNK]; 2],
    low: [u64; CHUNK],
    high: [u64; CHUNK],
    sign: [f64; CHUNK],
    friction: [[f64; CHUNK]; 2],
    heat: [[f64; CHUNK]; 3],
    /// Normal variates, and where the momentum exchanged is kept for the tally.
    xi: [[f64; CHUNK]; 4],
    change: [[f64; CHUNK]; 3],
    /// Logarithms of the numbers that decide about acceptance.
    chance: [[f64; CHUNK]; 2],
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
    /// Puts the pairs within the support into lanes, in the order of the sweep.
    #[inline(always)]
    fn gather<'p>(
        &self,
        lanes: &mut Lanes,
        first: usize,
        pairs: impl Iterator<Item = &'p [u16; 2]>,
    ) -> usize {
        let slots = &self.block.slots[..];
        let mut at = first;
        for pair in pairs {
            let [i, j] = pair.map(|place| slots[place as usize]);
            let (a, b) = (&self.position[i as usize], &self.position[j as usize]);
            let r = self
                .cell
                .nearest::<D>([a[0] - b[0], a[1] - b[1], a[2] - b[2]]);
            let mut r2 = r[0] * r[0] + r[1] * r[1];
            if D == 3 {
                r2 += r[2] * r[2];
            }
            // Callers leave room for all pairs; the mask only tells the compiler so.
            let lane = at & (CHUNK - 1);
            lanes.slots[lane] = [i, j];
            for axis in 0..D {
                lanes.r[axis][lane] = r[axis];
            }
            lanes.r2[lane] = r2;
            lanes.weight[lane] = a[3] * b[3];
            if X::VARIABLE {
                let (f, g) = (&self.factors[i as usize], &self.factors[j as usize]);
                for n in 0..2 {
                    lanes.early[n][lane] = 0.5 * (f[n] + g[n]);
                }
            }
            if V::ON {
                let (p, q) = (self.id[i as usize], self.id[j as usize]);
                [lanes.low[lane], lanes.high[lane]] = pair_counter(p, q);
                lanes.sign[lane] = if p < q { 1.0 } else { -1.0 };
            }
            at += usize::from(r2 < 1.0);
        }
        at
    }

    #[inline(always)]
    fn compute<A: Arithmetic>(&self, lanes: &mut Lanes, count: usize) {
        if V::ON {
            for k in 0..padded(count) {
                let [low, high] = [lanes.low[k], lanes.high[k]];
                let counter = [low, high, self.key.tail[0], self.key.tail[1]];
                let xi = V::draw_four::<A>(philox4x32_lanes(counter, self.key.key));
                for (lane, x) in lanes.xi.iter_mut().zip(xi) {
                    lane[k] = lanes.sign[k] * x;
                }
            }
        }
        if X::METROPOLIS {
            for k in 0..padded(count) {
                let tail = self.chances.tail;
                let counter = [lanes.low[k], lanes.high[k], tail[0], tail[1]];
                let words = philox4x32_lanes(counter, self.chances.key);
                for n in 0..2 {
                    lanes.chance[n][k] = ln(unit_interval(words[n]));
                }
            }
        }
        let mut slope = [0.0; CHUNK];
        (self.slopes)(&lanes.r2, &mut slope);
        for k in 0..padded(count) {
            let weight = lanes.weight[k];
            let r2 = lanes.r2[k];
            lanes.inverse_r2[k] = 1.0 / if r2 > 1e-60 { r2 } else { 1e-60 };
            lanes.weight[k] = slope[k] * (weight * weight);
        }
        if X::VARIABLE {
            for k in 0..padded(count) {
                for n in 0..2 {
                    lanes.early[n][k] *= lanes.weight[k];
                }
            }
        }
        if X::FRICTION {
            for k in 0..padded(count) {
                let weight = if X::VARIABLE {
                    lanes.early[0][k]
                } else {
                    lanes.weight[k]
                };
                let d = self.exchange.friction::<X>(weight, V::ON);
                lanes.friction[0][k] = d.across;
                lanes.friction[1][k] = d.along;
            }
        }
        if X::CONDUCTION && X::VARIABLE {
            for k in 0..padded(count) {
                lanes.heat[0][k] = self.exchange.heat_early(lanes.early[1][k]);
            }
        }
        if X::CONDUCTION && !X::VARIABLE {
            for k in 0..padded(count) {
                let d = self.exchange.heat(lanes.weight[k], V::ON);
                lanes.heat[0][k] = d.heat;
                lanes.heat[1][k] = d.spread;
                lanes.heat[2][k] = d.loss;
            }
        }
    }

    /// The weight of a pair's friction with the factor of eta.
    #[inline(always)]
    fn friction_weight(&self, lanes: &Lanes, k: usize, e: [f64; 2], square: f64) -> f64 {
        let g = lanes.weight[k];
        if X::VARIABLE {
            let slots = lanes.slots[k];
            g * self.energies.viscous_factor::<X>(slots, e, square, V::ON)
        } else {
            g
        }
    }

    #[inline(always)]
    fn friction_decay(&self, lanes: &Lanes, k: usize, g: f64, ends: &Ends) -> FrictionDecay {
        let decay = FrictionDecay {
            across: lanes.friction[0][k],
            along: lanes.friction[1][k],
        };
        if X::VARIABLE {
            let early = lanes.early[0][k];
            return self.exchange.at_weight::<X>(decay, early, g, ends, V::ON);
        }
        self.exchange.at_energies::<X>(decay, g, ends, V::ON)
    }

    /// The weight of a pair's conduction with the factor of kappa.
    #[inline(always)]
    fn heat_weight(&self, lanes: &Lanes, k: usize, e: [f64; 2]) -> f64 {
        let g = lanes.weight[k];
        if X::VARIABLE {
            g * self.energies.conductive_factor::<X>(lanes.slots[k], e)
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
    fn friction(&self, lanes: &Lanes, k: usize, change: &mut Change) {
        let [i, j] = lanes.slots[k];
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
            approach += lanes.r[a][k] * u[a];
            square += u[a] * u[a];
        }
        let ends = self.energies.ends::<X>([i, j], e);
        let g = self.friction_weight(lanes, k, e, square);
        let d = self.friction_decay(lanes, k, g, &ends);
        let inverse = lanes.inverse_r2[k];
        let along = 0.5 * (d.along - d.across) * inverse * approach;
        let (mut strength, mut excess) = (0.0, 0.0);
        if V::ON {
            let width = 0.5 * ends.width::<X>();
            let root = |m: f64| (-m * (2.0 + m)).sqrt();
            let [spread_across, spread_along] = [root(d.across), root(d.along)];
            strength = width * spread_across;
            let mut projected = 0.0;
            for a in 0..D {
                projected += lanes.r[a][k] * lanes.xi[a][k];
            }
            excess = width * (spread_along - spread_across) * inverse * projected;
        }
        let (mut dv, mut work) = ([0.0; 3], 0.0);
        for a in 0..D {
            let random = strength * lanes.xi[a][k] + excess * lanes.r[a][k];
            dv[a] = 0.5 * d.across * u[a] + along * lanes.r[a][k] + random;
            change.random[a] = random;
            work += dv[a] * (u[a] + dv[a]);
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
                let axis = [0, 1, 2].map(|a| lanes.r[a][k] * inverse.sqrt());
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
        let [i, j] = lanes.slots[k];
        // SAFETY: blocks of one colour share no particle, and i != j.
        let (ei, ej) = unsafe { (self.energies.heat.slot(i), self.energies.heat.slot(j)) };
        let e = [*ei, *ej];
        let ends = self.energies.ends::<X>([i, j], e);
        let g = self.heat_weight(lanes, k, e);
        let d = self.heat_decay(lanes, k, g, &ends);
        let gain = ends.conduct(&d, lanes.xi[3][k], V::ON);
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
    fn update(&self, lanes: &Lanes, k: usize) -> Change {
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
            self.friction(lanes, k, &mut change);
        }
        if X::CONDUCTION && self.direction == Direction::Forward {
            self.conduction(lanes, k, &mut change);
        }
        change
    }

    /// One chunk after the other: `next(n)` gives the next at most n pairs.
    #[inline(always)]
    fn sweep<'p, A: Arithmetic, I: ExactSizeIterator<Item = &'p [u16; 2]>>(
        &self,
        lanes: &mut Lanes,
        mut next: impl FnMut(usize) -> I,
    ) {
        let mut virial = self.tally.map(Virial::new);
        let mut handed = self.current.map(|_| HeatMoment::default());
        let mut refused = 0;
        loop {
            let (mut count, mut finished) = (0, false);
            while CHUNK - count >= 16 && !finished {
                let pairs = next(CHUNK - count);
                finished = pairs.len() < CHUNK - count;
                count = self.gather(lanes, count, pairs);
            }
            self.compute::<A>(lanes, count);
            if virial.is_none() && handed.is_none() {
                for k in 0..count {
                    refused += self.update(lanes, k).refused;
                }
            } else {
                refused += self.update_and_add(lanes, count, &mut virial, &mut handed);
            }
            if finished {
                break;
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
    fn update_and_add(
        &self,
        lanes: &mut Lanes,
        count: usize,
        virial: &mut Option<Virial>,
        handed: &mut Option<HeatMoment>,
    ) -> u64 {
        let mut refused = 0;
        for k in 0..count {
            let change = self.update(lanes, k);
            refused += change.refused;
            if let Some(handed) = handed {
                let r = [lanes.r[0][k], lanes.r[1][k], lanes.r[2][k]];
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
            }) => parts.add_to::<D, CHUNK>(sum, &lanes.r, count),
            Some(Virial { sum, parts: None }) => {
                add_outer::<D, CHUNK, CHUNK>(&mut sum[1], &lanes.r, &mut lanes.change, count);
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
        let zero = [0.0; CHUNK];
        let mut lanes = Lanes {
            slots: [[0; 2]; CHUNK],
            r: [zero; 3],
            r2: zero,
            inverse_r2: zero,
            weight: zero,
            early: [zero; 2],
            low: [0; CHUNK],
            high: [0; CHUNK],
            sign: zero,
            friction: [zero; 2],
            heat: [zero; 3],
            xi: [zero; 4],
            change: [zero; 3],
            chance: [zero; 2],
        };
        let rounds = &self.block.rounds;
        let mut rest =
            &self.block.shuffled[rounds[self.round] as usize..rounds[self.round + 1] as usize];
        match self.direction {
            Direction::Forward => self.sweep::<W::Arithmetic, _>(&mut lanes, |n| {
                let (now, later) = rest.split_at(n.min(rest.len()));
                rest = later;
                now.iter()
            }),
            Direction::Backward => self.sweep::<W::Arithmetic, _>(&mut lanes, |n| {
                let (later, now) = rest.split_at(rest.len() - n.min(rest.len()));
                rest = later;
                now.iter().rev()
            }),
        }
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
        for_each_block(
            sweep.grid,
            &sweep.list.blocks,
            backward,
            &|number, block| {
                run_wide(ThermalTask::<X, V, D> {
                    block,
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
            },
        );
    }
    (thermal.refused, thermal.current) = (refused, current);
}
