//! Forces and heat of all pairs of a fluid with energies at one instant: pressure, drag and noise,
//! conduction and its noise (physics/thermal/rates.rs). Kernel and form of friction are no types of
//! this sweep, as in that of the exchanges.

use std::marker::PhantomData;

use super::tally::{BlockSums, PartLanes, Tally, Virial, add_outer};
use super::thermal_exchange::Slopes;
use super::{CHUNK, Shared, Task, Walk, Wide, for_each_block, padded, run_wide};
use crate::domain::PeriodicBox;
use crate::neighbor::{Grid, PairList, Rows};
use crate::physics::{Exchanges, PairState, ThermalRates};
use crate::random::{SweepKey, Variate, pair_counter, philox4x32_lanes};
use crate::real::Arithmetic;
use crate::state::Particles;

/// The arrays of one chunk. Only pairs within the support get a lane.
#[repr(align(64))]
struct Lanes {
    head: [u32; CHUNK],
    other: [u32; CHUNK],
    r: [[f64; CHUNK]; 3],
    r2: [f64; CHUNK],
    slope: [f64; CHUNK],
    u: [[f64; CHUNK]; 3],
    weight: [f64; CHUNK],
    pressure: [f64; CHUNK],
    /// Temperatures, those of the noise, and 1/k of both particles.
    state: [[[f64; CHUNK]; 2]; 3],
    low: [u64; CHUNK],
    high: [u64; CHUNK],
    sign: [f64; CHUNK],
    xi: [[f64; CHUNK]; 4],
    force: [[f64; CHUNK]; 3],
    /// Heat that both get, heat from j to i, and the work F r.u of unit pressures.
    heat: [[f64; CHUNK]; 3],
    /// Momentum by part, where the tally keeps parts apart.
    drag: [[f64; CHUNK]; 3],
    random: [[f64; CHUNK]; 3],
}

struct ForceTask<'a, X, V, const D: usize> {
    rows: &'a Rows,
    cell: &'a PeriodicBox,
    position: &'a [[f64; 4]],
    velocity: &'a [[f64; 4]],
    state: &'a [[f64; 4]],
    id: &'a [u64],
    force: Shared<'a, [f64; 4]>,
    work: Shared<'a, f64>,
    slopes: Slopes,
    rates: &'a ThermalRates,
    key: SweepKey,
    number: u32,
    tally: Option<BlockSums<'a>>,
    form: PhantomData<(X, V)>,
}

impl<X: Exchanges, V: Variate, const D: usize> ForceTask<'_, X, V, D> {
    /// Fills the lanes from the list; returns how many are in use.
    #[inline(always)]
    fn gather(&self, lanes: &mut Lanes, walk: &mut Walk) -> usize {
        walk.fill(self.rows, |count, head, partners| {
            self.gather_row(lanes, count, head, partners)
        })
    }

    #[inline(always)]
    fn gather_row(&self, lanes: &mut Lanes, first: usize, head: u32, partners: &[u32]) -> usize {
        let (i, v, s) = (
            self.position[head as usize],
            self.velocity[head as usize],
            self.state[head as usize],
        );
        let id = if V::ON { self.id[head as usize] } else { 0 };
        let mut at = first;
        for &other in partners {
            // SAFETY: list entries lead to slots of particles.
            let (j, w, t) = unsafe {
                (
                    self.position.get_unchecked(other as usize),
                    self.velocity.get_unchecked(other as usize),
                    self.state.get_unchecked(other as usize),
                )
            };
            let r = self
                .cell
                .nearest::<D>([i[0] - j[0], i[1] - j[1], i[2] - j[2]]);
            let mut r2 = r[0] * r[0] + r[1] * r[1];
            if D == 3 {
                r2 += r[2] * r[2];
            }
            // Callers leave room for all partners; the mask only tells the compiler so.
            let lane = at & (CHUNK - 1);
            lanes.head[lane] = head;
            lanes.other[lane] = other;
            for a in 0..D {
                lanes.r[a][lane] = r[a];
                lanes.u[a][lane] = v[a] - w[a];
            }
            lanes.r2[lane] = r2;
            lanes.weight[lane] = i[3] * j[3];
            lanes.pressure[lane] = v[3] + w[3];
            if X::FRICTION || X::CONDUCTION {
                for part in 0..3 {
                    lanes.state[part][0][lane] = s[part];
                    lanes.state[part][1][lane] = t[part];
                }
            }
            if V::ON {
                // SAFETY: as above.
                let other_id = unsafe { *self.id.get_unchecked(other as usize) };
                [lanes.low[lane], lanes.high[lane]] = pair_counter(id, other_id);
                lanes.sign[lane] = if id < other_id { 1.0 } else { -1.0 };
            }
            at += usize::from(r2 < 1.0);
        }
        at
    }

    #[inline(always)]
    fn draw<A: Arithmetic>(&self, lanes: &mut Lanes, count: usize) {
        for k in 0..padded(count) {
            let counter = [
                lanes.low[k],
                lanes.high[k],
                self.key.tail[0],
                self.key.tail[1],
            ];
            let xi = V::draw_four::<A>(philox4x32_lanes(counter, self.key.key));
            for (lane, x) in lanes.xi.iter_mut().zip(xi) {
                lane[k] = lanes.sign[k] * x;
            }
            if D == 2 {
                lanes.xi[2][k] = 0.0;
            }
        }
    }

    #[inline(always)]
    fn compute(&self, lanes: &mut Lanes, count: usize) {
        (self.slopes)(&lanes.r2, &mut lanes.slope);
        for k in 0..padded(count) {
            let (slope, weight, r2) = (lanes.slope[k], lanes.weight[k], lanes.r2[k]);
            let r = [lanes.r[0][k], lanes.r[1][k], lanes.r[2][k]];
            let u = [lanes.u[0][k], lanes.u[1][k], lanes.u[2][k]];
            let g = slope * (weight * weight);
            let both = |part: &[[f64; CHUNK]; 2]| [part[0][k], part[1][k]];
            let state = PairState {
                now: both(&lanes.state[0]),
                start: both(&lanes.state[1]),
                inverse_capacity: both(&lanes.state[2]),
            };
            let push = lanes.pressure[k] * slope;
            let mut force = r.map(|x| push * x);
            if X::FRICTION {
                let inverse_r2 = 1.0 / if r2 > 1e-60 { r2 } else { 1e-60 };
                let xi = [lanes.xi[0][k], lanes.xi[1][k], lanes.xi[2][k]];
                let xi = V::ON.then_some(xi);
                let pair = self.rates.force::<X>(g, inverse_r2, r, u, &state, xi);
                let mut power = 0.0;
                for a in 0..D {
                    let f = pair.drag[a] + pair.random[a];
                    force[a] += f;
                    power += f * u[a];
                    lanes.drag[a][k] = pair.drag[a];
                    lanes.random[a][k] = pair.random[a];
                }
                lanes.heat[0][k] = if X::HEATING { -0.5 * power } else { 0.0 };
            }
            if X::CONDUCTION {
                let xi = V::ON.then_some(lanes.xi[3][k]);
                lanes.heat[1][k] = self.rates.conduction::<X>(g, &state, xi);
            }
            let mut approach = 0.0;
            for a in 0..D {
                lanes.force[a][k] = force[a];
                approach += r[a] * u[a];
            }
            lanes.heat[2][k] = slope * approach;
        }
    }

    #[inline(always)]
    fn scatter(&self, lanes: &Lanes, count: usize) {
        let mut k = 0;
        while k < count {
            let head = lanes.head[k];
            let (mut sum, mut work) = ([0.0; 4], 0.0);
            while k < count && lanes.head[k] == head {
                let other = lanes.other[k];
                // SAFETY: blocks of one colour share no particle, and other != head.
                let target = unsafe { self.force.slot(other) };
                for a in 0..D {
                    let f = lanes.force[a][k];
                    sum[a] += f;
                    target[a] -= f;
                }
                let (both, across) = (lanes.heat[0][k], lanes.heat[1][k]);
                let approach = lanes.heat[2][k];
                sum[3] += both + across;
                target[3] += both - across;
                work += approach;
                // SAFETY: as above.
                unsafe { *self.work.slot(other) += approach };
                k += 1;
            }
            // SAFETY: as above.
            unsafe {
                let target = self.force.slot(head);
                for a in 0..4 {
                    target[a] += sum[a];
                }
                *self.work.slot(head) += work;
            }
        }
    }

    /// Adds r (x) f by part to the sums.
    #[inline(always)]
    fn add_parts(&self, lanes: &Lanes, count: usize, parts: &mut PartLanes) {
        for k in 0..padded(count) {
            for a in 0..D {
                let push = lanes.pressure[k] * lanes.slope[k];
                parts.parts[0][a][k] = push * lanes.r[a][k];
                parts.parts[1][a][k] = lanes.drag[a][k];
                parts.parts[2][a][k] = lanes.random[a][k];
            }
        }
    }
}

impl<X: Exchanges, V: Variate, const D: usize> Task for ForceTask<'_, X, V, D> {
    type Output = ();
    #[inline(always)]
    fn run<W: Wide>(self) {
        let (zero, zeros) = ([0.0; CHUNK], [[0.0; CHUNK]; 3]);
        // Leftover lanes are computed as well: temperatures of 1 keep them finite.
        let mut lanes = Lanes {
            head: [0; CHUNK],
            other: [0; CHUNK],
            r: zeros,
            r2: zero,
            slope: zero,
            u: zeros,
            weight: zero,
            pressure: zero,
            state: [[[1.0; CHUNK]; 2]; 3],
            low: [0; CHUNK],
            high: [0; CHUNK],
            sign: zero,
            xi: [zero; 4],
            force: zeros,
            heat: [zero; 3],
            drag: zeros,
            random: zeros,
        };
        let mut walk = Walk::default();
        let mut virial = self.tally.map(Virial::new);
        loop {
            let count = self.gather(&mut lanes, &mut walk);
            if V::ON {
                self.draw::<W::Arithmetic>(&mut lanes, count);
            }
            self.compute(&mut lanes, count);
            self.scatter(&lanes, count);
            if let Some(Virial { sum, parts }) = &mut virial {
                match parts {
                    Some(parts) => {
                        self.add_parts(&lanes, count, parts);
                        parts.add_to::<D, CHUNK, _>(sum, &lanes.r, count);
                    }
                    None => add_outer::<D, CHUNK, CHUNK, _, _>(
                        &mut sum[0],
                        &lanes.r,
                        &mut lanes.force,
                        count,
                    ),
                }
            }
            if walk.at_end(&self.rows.ends) {
                break;
            }
        }
        if let (Some(sums), Some(virial)) = (self.tally, virial) {
            // SAFETY: this block's own number.
            unsafe { sums.add(self.number, &virial.sum) };
        }
    }
}

/// What the sweep works on, beside the particles.
pub struct ThermalForceSweep<'a> {
    /// Blocks and their colours.
    pub grid: &'a Grid,
    /// Pairs.
    pub list: &'a PairList,
    /// The box.
    pub cell: &'a PeriodicBox,
    /// F of the kernel, for the distances of a chunk.
    pub slopes: Slopes,
    /// Coefficients, and the time over which the noise acts.
    pub rates: ThermalRates,
    /// Of the noise.
    pub key: SweepKey,
}

/// Sets `force` to forces and, in the last lane, rates of heat, and the field `work` to the sums of
/// `pair_work`; velocities and P/d^2 are those in `scratch`, and `drag` holds temperatures, those of
/// the noise, and 1/k.
pub fn thermal_forces<X: Exchanges, V: Variate, const D: usize>(
    particles: &mut Particles,
    work: usize,
    sweep: &ThermalForceSweep<'_>,
    mut tally: Option<&mut Tally>,
) {
    let sums = tally.as_deref_mut().map(Tally::begin);
    particles.force.fill([0.0; 4]);
    let force = Shared::new(&mut particles.force);
    let work = &mut particles.scalars[work].values;
    work.fill(0.0);
    let work = Shared::new(work);
    let (position, id) = (&particles.position, &particles.id);
    let (velocity, state) = (&particles.scratch, &particles.drag);
    for_each_block(sweep.grid, false, &|number| {
        run_wide(ForceTask::<X, V, D> {
            rows: sweep.list.present(number),
            cell: sweep.cell,
            position,
            velocity,
            state,
            id,
            force,
            work,
            slopes: sweep.slopes,
            rates: &sweep.rates,
            key: sweep.key,
            number,
            tally: sums,
            form: PhantomData,
        });
    });
    if let Some(tally) = tally {
        tally.keep_force();
    }
}
