//! The pair splitting of a fluid with an energy: exchange(dt/2) - kick - drift - densities - kick -
//! exchange(dt/2). An exchange solves friction, heating and conduction pair by pair (physics/
//! thermal). In between particles move on adiabats; the work of both kicks, summed pair by pair
//! with the mean velocities of each kick, then replaces the adiabat's energies, so that the total
//! energy holds to rounding. Without these books it would drift upward.

use std::marker::PhantomData;

use super::{
    ForceParts, Integrator, Source, conservative_forces, densities, drift, force_parts,
    mean_friction_weight,
};
use crate::error::{Error, Result};
use crate::kernel::Kernel;
use crate::physics::{Exchanges, FrictionForm};
use crate::random::{Silent, Stream, SweepKey, Variate};
use crate::simulation::Engine;
use crate::sweep::{
    Direction, Slopes, ThermalSweep, pair_work, slopes, thermal_exchange, wall_work,
};

/// The sweeps of one kernel: they are the same for every exchange, and every thermal integrator.
#[derive(Clone, Copy)]
pub(super) struct KernelSweeps {
    pub densities: fn(&mut Engine),
    pub forces: fn(&mut Engine),
    pub work: fn(&mut Engine),
    pub parts: fn(&mut Engine, f64, u64, Source) -> ForceParts,
    pub weight: fn(&Engine) -> f64,
    pub slopes: Slopes,
    pub slope: fn(f64) -> f64,
}

fn work<K: Kernel, const D: usize>(engine: &mut Engine) {
    let Engine {
        particles,
        grid,
        list,
        cell,
        walls,
        thermal,
        ..
    } = engine;
    if let Some(thermal) = thermal {
        let current = thermal.current.as_mut();
        pair_work::<K, D>(particles, thermal.fields.work, grid, list, cell, current);
        wall_work::<K, D>(particles, thermal.fields.work, walls, grid);
    }
}

/// The error of a particle whose temperature is not finite and positive, if there is one.
pub(super) fn cold(engine: &Engine) -> Option<Error> {
    let thermal = engine.thermal.as_ref()?;
    let slot = thermal.check(&engine.particles)?;
    Some(Error::NotFinite {
        step: engine.step,
        id: engine.particles.id[slot],
        quantity: "temperature",
    })
}

impl KernelSweeps {
    pub fn of<K: Kernel, F: FrictionForm, const D: usize>() -> Self {
        Self {
            densities: densities::<K, D>,
            forces: conservative_forces::<K, D>,
            work: work::<K, D>,
            parts: force_parts::<K, F, Silent, D>,
            weight: mean_friction_weight::<K, D>,
            slopes: slopes::<K, D>,
            slope: K::f::<D>,
        }
    }
}

/// The thermal splitting; see the module.
pub struct ThermalSplitting<X, V, const D: usize> {
    sweeps: KernelSweeps,
    form: PhantomData<(X, V)>,
}

impl<X: Exchanges, V: Variate, const D: usize> ThermalSplitting<X, V, D> {
    /// With the sweeps of a kernel; the form of the friction serves `force_parts` alone.
    pub fn new<K: Kernel, F: FrictionForm>() -> Self {
        Self {
            sweeps: KernelSweeps::of::<K, F, D>(),
            form: PhantomData,
        }
    }

    /// Half a step of all exchanges; `started` is the step at whose start it belongs.
    fn exchange(&self, engine: &mut Engine, t: f64, started: u64, direction: Direction) {
        let draw = u8::from(direction == Direction::Backward);
        let key = SweepKey::new(engine.seed, Stream::PairThermal, started, draw);
        let chances = SweepKey::new(engine.seed, Stream::PairAcceptance, started, draw);
        let Engine {
            particles,
            grid,
            list,
            cell,
            tally,
            walls,
            thermal,
            ..
        } = engine;
        let Some(thermal) = thermal else {
            return;
        };
        let sweep = ThermalSweep {
            grid,
            list,
            cell,
            slopes: self.sweeps.slopes,
            slope: self.sweeps.slope,
            exchange: thermal.pair.exchange(t),
            time: t,
            key,
            chances,
            direction,
        };
        thermal_exchange::<X, V, D>(particles, walls, thermal, &sweep, tally.as_mut());
    }

    /// Pressures of the present temperatures, and forces.
    fn forces(&self, engine: &mut Engine) {
        if let Some(thermal) = &engine.thermal {
            thermal.pressures(&mut engine.particles);
        }
        (self.sweeps.forces)(engine);
    }

    /// v += t f, with the books.
    fn kick(&self, engine: &mut Engine, t: f64) {
        if engine.thermal.as_ref().is_some_and(|it| it.bookkeeping) {
            engine.mean_velocities(t);
            (self.sweeps.work)(engine);
            if let Some(thermal) = &mut engine.thermal {
                thermal.book_input();
                thermal.book_work(&mut engine.particles, t);
            }
        }
        engine.kick(t);
    }

    fn advance(&self, engine: &mut Engine, dt: f64) -> Result<()> {
        let started = engine.step;
        self.exchange(engine, 0.5 * dt, started, Direction::Forward);
        self.forces(engine);
        if let Some(thermal) = &engine.thermal {
            thermal.open(&mut engine.particles);
        }
        self.kick(engine, 0.5 * dt);
        if let Some(thermal) = &mut engine.thermal {
            thermal.carry(&engine.particles, dt);
        }
        drift::<D>(engine, dt, self.shuffles())?;
        engine.step += 1;
        (self.sweeps.densities)(engine);
        if let Some(thermal) = &engine.thermal {
            thermal.follow_adiabat(&mut engine.particles);
        }
        self.forces(engine);
        self.kick(engine, 0.5 * dt);
        match &mut engine.thermal {
            Some(thermal) if thermal.bookkeeping => thermal.close(&mut engine.particles),
            _ => {}
        }
        self.exchange(engine, 0.5 * dt, started, Direction::Backward);
        Ok(())
    }
}

impl<X: Exchanges, V: Variate, const D: usize> Integrator for ThermalSplitting<X, V, D> {
    fn refresh(&self, engine: &mut Engine, _: f64) -> Result<()> {
        (self.sweeps.densities)(engine);
        self.forces(engine);
        Ok(())
    }

    fn run(&self, engine: &mut Engine, steps: u64, dt: f64) -> Result<()> {
        for _ in 0..steps {
            // A particle without energy makes velocities that are no numbers: say what came first.
            if let Err(error) = self.advance(engine, dt) {
                return Err(cold(engine).unwrap_or(error));
            }
            if let Some(error) = cold(engine) {
                return Err(error);
            }
            engine.observe_thermal(dt);
        }
        // What the arrays show belongs together: pressures and forces are those of the energies.
        self.forces(engine);
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
        X::FRICTION || X::CONDUCTION
    }

    fn needs_drag(&self) -> bool {
        true
    }

    fn keeps_heat_current(&self) -> bool {
        // Friction against a bath hands nothing over; what is refused at random has a mean.
        (X::HEATING || !X::FRICTION) && !X::METROPOLIS
    }
}
