//! Velocity Verlet of a fluid with an energy: positions and momenta by Verlet, energies by a
//! Runge-Kutta method of second order (Yang 2013, Table 4, corrected). For comparison with the
//! splitting. With R for forces and rates of heat (sweep/thermal_force.rs) a step is
//!     (v, E) += R dt/2;  drift, along adiabats;
//!     R' at the predictor (v, E) + R dt/2;  (v, E) += R' dt/2.
//! Without noise it is of second order. Noise is drawn once a step, at the temperatures of its start,
//! as Ito's equations want it. The heat -f.u/2 of a pair has the velocities of its stage, half those
//! at the start and half those at the end: the mean of this product is the loss of energy to the
//! noise, and no further term is due. (Table 4 has the velocities after half a kick, where that mean
//! is half of the loss.)
//!
//! The books: work of pressure is summed with the velocities of the stages too. What the forces do
//! with the mean velocities of the half kicks, which is what kinetic energy changes by, differs from
//! that by m dt^2 (f - f')^2/8, and each particle pays for itself. Then the total energy holds to
//! rounding; without books the adiabat stands, and the energy rises by that sum.
//! Heat that would leave a particle with none is not given: counted as refused, and as unbooked.

use std::marker::PhantomData;

use rayon::prelude::*;

use super::thermal_sweeps::KernelSweeps;
use super::{ForceParts, Integrator, Source, drift};
use crate::error::Result;
use crate::kernel::Kernel;
use crate::physics::{Exchanges, FrictionForm};
use crate::random::{Stream, SweepKey, Variate};
use crate::simulation::Engine;
use crate::state::Particles;
use crate::stopwatch::Phase;
use crate::sweep::{ThermalForceSweep, thermal_forces};
use crate::thermal::{Thermal, pick};

/// Particles per task of the elementwise loops.
const GRAIN: usize = 512;

/// The two evaluations of a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Stage {
    /// At its start.
    Start,
    /// At the predictor of its end.
    Predictor,
}

/// What pairs read of each particle: velocity and P/d^2 into `scratch`, temperature, that of the
/// noise and 1/k into `drag`. The noise keeps the temperatures at the start of the step.
fn prepare(particles: &mut Particles, thermal: &Thermal, stage: Stage) {
    thermal.pressures(particles);
    let fields = thermal.fields;
    let [heat, noise] = pick(&mut particles.scalars, [fields.heat, fields.work]);
    particles
        .scratch
        .par_iter_mut()
        .zip(&mut particles.drag)
        .zip(&particles.velocity)
        .zip(&particles.carried)
        .zip(heat)
        .zip(noise)
        .zip(&particles.density)
        .with_min_len(GRAIN)
        .for_each(
            |((((((velocity, state), &v), carried), &mut heat), &mut noise), &d)| {
                let [now, capacity] = thermal.state(d, heat);
                *velocity = v;
                let start = match stage {
                    Stage::Start => now,
                    Stage::Predictor => {
                        for a in 0..3 {
                            velocity[a] += carried[a];
                        }
                        noise
                    }
                };
                *state = [now, start, 1.0 / capacity, 0.0];
            },
        );
}

/// Gives the heat of half a step of length t whose kick was just made, with its mean velocities in
/// `scratch`. Into the field `work` goes what the books take off: work of pressure, and what the
/// forces do with the mean velocities beyond what they do with those of the stage. `carried` becomes
/// what the first half has changed, which is the second half's predictor.
fn give_heat(particles: &mut Particles, thermal: &mut Thermal, t: f64, stage: Stage, heated: bool) {
    let mut unbooked = std::mem::take(&mut thermal.input);
    let fields = thermal.fields;
    let [heat, work] = pick(&mut particles.scalars, [fields.heat, fields.work]);
    let refused = heat
        .par_iter_mut()
        .zip(work)
        .zip(&mut particles.carried)
        .zip(&particles.force)
        .zip(&particles.velocity)
        .zip(&particles.scratch)
        .zip(&mut unbooked)
        .with_min_len(GRAIN)
        .map(|((((((heat, work), carried), rate), v), mean), unbooked)| {
            let mut given = t * rate[3];
            *unbooked = 0.0;
            let refused = *heat + given <= 0.0;
            if refused {
                *unbooked = -given;
                given = 0.0;
            }
            *heat += given;
            let mut beyond = 0.0;
            for a in 0..3 {
                let gain = v[a] - mean[a];
                let lag = match stage {
                    Stage::Start => gain,
                    Stage::Predictor => gain - carried[a],
                };
                beyond += rate[a] * lag;
                carried[a] = 2.0 * gain;
            }
            carried[3] = given;
            *work = t * (v[3] * *work + if heated { beyond } else { 0.0 });
            u64::from(refused)
        })
        .sum::<u64>();
    thermal.accounts.refused += refused;
    thermal.accounts.unbooked += unbooked.iter().sum::<f64>();
    thermal.input = unbooked;
}

/// Takes what half a step has done off the energies: of the first half heat is in them already.
/// After it, `work` keeps the temperatures of the noise over the drift.
fn book(particles: &mut Particles, thermal: &Thermal, stage: Stage) {
    let fields = thermal.fields;
    let [energy, work] = pick(&mut particles.scalars, [fields.energy, fields.work]);
    energy
        .par_iter_mut()
        .zip(work)
        .zip(&particles.carried)
        .zip(&particles.drag)
        .with_min_len(GRAIN)
        .for_each(|(((energy, work), carried), state)| match stage {
            Stage::Start => {
                *energy -= *work;
                *work = state[1];
            }
            Stage::Predictor => *energy += carried[3] - *work,
        });
}

/// Sets energies to those of the predictor, and keeps what they were in the field `entropy`.
fn predict_heat(particles: &mut Particles, thermal: &Thermal) {
    let fields = thermal.fields;
    let [heat, base] = pick(&mut particles.scalars, [fields.heat, fields.entropy]);
    heat.par_iter_mut()
        .zip(base)
        .zip(&particles.carried)
        .with_min_len(GRAIN)
        .for_each(|((heat, base), carried)| {
            *base = *heat;
            if *heat + carried[3] > 0.0 {
                *heat += carried[3];
            }
        });
}

/// Puts the energies back that `predict_heat` has kept.
fn forget_prediction(particles: &mut Particles, thermal: &Thermal) {
    let fields = thermal.fields;
    let [heat, base] = pick(&mut particles.scalars, [fields.heat, fields.entropy]);
    heat.copy_from_slice(base);
}

/// Velocity Verlet with energies; see the module.
pub struct ThermalVerlet<X, V, const D: usize> {
    sweeps: KernelSweeps,
    form: PhantomData<(X, V)>,
}

impl<X: Exchanges, V: Variate, const D: usize> ThermalVerlet<X, V, D> {
    /// With the sweeps of a kernel; the form of the friction serves `force_parts` alone.
    pub fn new<K: Kernel, F: FrictionForm>() -> Self {
        Self {
            sweeps: KernelSweeps::of::<K, F, D>(),
            form: PhantomData,
        }
    }

    /// Forces and rates of heat; `started` is the step whose noise acts over dt.
    fn rates(&self, engine: &mut Engine, dt: f64, started: u64, stage: Stage) {
        let Engine {
            particles,
            grid,
            list,
            cell,
            tally,
            thermal,
            ..
        } = engine;
        let Some(thermal) = thermal else {
            return;
        };
        prepare(particles, thermal, stage);
        let sweep = ThermalForceSweep {
            grid,
            list,
            cell,
            slopes: self.sweeps.slopes,
            rates: thermal.pair.rates(dt),
            key: SweepKey::new(engine.seed, Stream::PairThermalForce, started, 0),
        };
        thermal_forces::<X, V, D>(particles, thermal.fields.work, &sweep, tally.as_mut());
        engine.stopwatch.lap(Phase::Forces);
    }

    /// Half a step with the rates at hand.
    fn half_step(engine: &mut Engine, t: f64, stage: Stage) {
        engine.mean_velocities(t);
        if let Some(thermal) = &mut engine.thermal {
            thermal.book_input();
        }
        engine.kick(t);
        let Engine {
            particles, thermal, ..
        } = engine;
        if let Some(thermal) = thermal {
            // What friction does against a bath is in nobody's energy.
            let heated = X::HEATING || !X::FRICTION;
            give_heat(particles, thermal, t, stage, heated);
            if stage == Stage::Start {
                thermal.open(particles);
            }
            book(particles, thermal, stage);
        }
    }

    fn advance(&self, engine: &mut Engine, dt: f64) -> Result<()> {
        let started = engine.step;
        self.rates(engine, dt, started, Stage::Start);
        Self::half_step(engine, 0.5 * dt, Stage::Start);
        drift::<D>(engine, dt, self.shuffles())?;
        engine.step += 1;
        (self.sweeps.densities)(engine);
        if let Some(thermal) = &engine.thermal {
            thermal.follow_adiabat(&mut engine.particles);
            predict_heat(&mut engine.particles, thermal);
        }
        self.rates(engine, dt, started, Stage::Predictor);
        if let Some(thermal) = &engine.thermal {
            forget_prediction(&mut engine.particles, thermal);
        }
        Self::half_step(engine, 0.5 * dt, Stage::Predictor);
        match &mut engine.thermal {
            Some(thermal) if thermal.bookkeeping => thermal.close(&mut engine.particles),
            _ => {}
        }
        Ok(())
    }
}

impl<X: Exchanges, V: Variate, const D: usize> Integrator for ThermalVerlet<X, V, D> {
    fn refresh(&self, engine: &mut Engine, _: f64) -> Result<()> {
        self.sweeps.refresh(engine);
        Ok(())
    }

    fn run(&self, engine: &mut Engine, steps: u64, dt: f64) -> Result<()> {
        self.sweeps
            .run(engine, steps, dt, |engine| self.advance(engine, dt))
    }

    fn rebuild(&self, engine: &mut Engine, renew_grid: bool) -> Result<()> {
        engine.rebuild::<D>(renew_grid, self.shuffles())
    }

    fn force_parts(&self, engine: &mut Engine, dt: f64, step: u64, whose: Source) -> ForceParts {
        (self.sweeps.parts)(engine, dt, step, whose)
    }

    fn mean_friction_weight(&self, engine: &mut Engine) -> f64 {
        (self.sweeps.weight)(engine)
    }

    fn shuffles(&self) -> bool {
        false
    }

    fn needs_drag(&self) -> bool {
        true
    }

    fn carries(&self) -> bool {
        true
    }
}
