//! Velocity Verlet of a fluid with an energy: positions and momenta by Verlet, energies by a
//! Runge-Kutta method of second order (Yang 2013, Table 4, corrected). For comparison with the
//! splitting. R are forces and rates of heat (sweep/thermal_force.rs):
//!     (v, E) += R dt/2 at the start of the step; drift along adiabats;
//!     predictor (v, E) + R dt/2;  (v, E) += R' dt/2 at the predictor.
//! Between the halves entropies stay, so the work of pressure needs no sum. Without noise the step is
//! of second order. Both halves have the same draw. Its width is that of the temperatures at the
//! start, as Ito's equations want it, while the work -f.u/2 of a pair's force is half and half that
//! with the velocities at the start and at the end: its mean is the loss of energy to the noise, and
//! to stage 1 and 2 alike no further term belongs (with the velocities of Table 4, after half a kick,
//! it would be half of the loss). Energy is conserved to the order of the step only.
//! Heat that would leave a particle with none is not given: counted as refused, and as unbooked.

use std::marker::PhantomData;

use rayon::prelude::*;

use super::thermal_splitting::{KernelSweeps, cold};
use super::{ForceParts, Integrator, Source, drift};
use crate::error::Result;
use crate::kernel::Kernel;
use crate::physics::{Exchanges, FrictionForm};
use crate::random::{Stream, SweepKey, Variate};
use crate::simulation::Engine;
use crate::state::Particles;
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

/// Temperature and 1/k of a particle of the given thermal energy.
fn temperature_and_capacity(thermal: &Thermal, heat: f64) -> [f64; 2] {
    let inverse = 1.0 / thermal.pair.capacity;
    [heat * inverse, inverse]
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
        .with_min_len(GRAIN)
        .for_each(|(((((velocity, state), &v), carried), &mut heat), noise)| {
            let [temperature, inverse_capacity] = temperature_and_capacity(thermal, heat);
            *velocity = v;
            match stage {
                Stage::Start => *noise = temperature,
                Stage::Predictor => {
                    for a in 0..3 {
                        velocity[a] += carried[a];
                    }
                }
            }
            *state = [temperature, *noise, inverse_capacity, 0.0];
        });
}

/// Gives the heat of half a step, and notes in `carried` what it and the kick just made have changed
/// (`scratch` holds the mean velocities of the kick).
fn give_heat(particles: &mut Particles, thermal: &mut Thermal, t: f64) {
    let mut unbooked = std::mem::take(&mut thermal.input);
    let heat = &mut particles.scalars[thermal.fields.heat].values;
    let refused = heat
        .par_iter_mut()
        .zip(&mut particles.carried)
        .zip(&particles.force)
        .zip(&particles.velocity)
        .zip(&particles.scratch)
        .zip(&mut unbooked)
        .with_min_len(GRAIN)
        .map(|(((((heat, carried), rate), v), mean), unbooked)| {
            let mut given = t * rate[3];
            *unbooked = 0.0;
            let refused = *heat + given <= 0.0;
            if refused {
                *unbooked = -given;
                given = 0.0;
            }
            *heat += given;
            for a in 0..3 {
                carried[a] = 2.0 * (v[a] - mean[a]);
            }
            carried[3] = given;
            u64::from(refused)
        })
        .sum::<u64>();
    thermal.accounts.refused += refused;
    thermal.accounts.unbooked += unbooked.iter().sum::<f64>();
    thermal.input = unbooked;
}

/// Sets energies to those of the predictor, and keeps what they were in the field `energy`.
fn predict_heat(particles: &mut Particles, thermal: &Thermal) {
    let fields = thermal.fields;
    let [heat, base] = pick(&mut particles.scalars, [fields.heat, fields.energy]);
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
    let [heat, base] = pick(&mut particles.scalars, [fields.heat, fields.energy]);
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
        thermal_forces::<X, V, D>(particles, &sweep, tally.as_mut());
    }

    /// Half a step with the rates at hand.
    fn half_step(engine: &mut Engine, t: f64) {
        engine.mean_velocities(t);
        if let Some(thermal) = &mut engine.thermal {
            thermal.book_input();
        }
        engine.kick(t);
        if let Some(thermal) = &mut engine.thermal {
            give_heat(&mut engine.particles, thermal, t);
        }
    }

    fn advance(&self, engine: &mut Engine, dt: f64) -> Result<()> {
        let started = engine.step;
        self.rates(engine, dt, started, Stage::Start);
        Self::half_step(engine, 0.5 * dt);
        if let Some(thermal) = &engine.thermal {
            thermal.open(&mut engine.particles);
        }
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
        Self::half_step(engine, 0.5 * dt);
        Ok(())
    }

    /// Pressures of the present temperatures, and their forces.
    fn pressure_forces(&self, engine: &mut Engine) {
        if let Some(thermal) = &engine.thermal {
            thermal.pressures(&mut engine.particles);
        }
        (self.sweeps.forces)(engine);
    }
}

impl<X: Exchanges, V: Variate, const D: usize> Integrator for ThermalVerlet<X, V, D> {
    fn refresh(&self, engine: &mut Engine, _: f64) -> Result<()> {
        (self.sweeps.densities)(engine);
        self.pressure_forces(engine);
        Ok(())
    }

    fn run(&self, engine: &mut Engine, steps: u64, dt: f64) -> Result<()> {
        for _ in 0..steps {
            if let Err(error) = self.advance(engine, dt) {
                return Err(cold(engine).unwrap_or(error));
            }
            if let Some(error) = cold(engine) {
                return Err(error);
            }
            engine.observe_thermal(dt);
        }
        // What the arrays show belongs together: forces are those of the pressures alone.
        self.pressure_forces(engine);
        Ok(())
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
