//! The pair splitting of a fluid with an energy: exchange(dt/2) - kick - drift - densities - kick -
//! exchange(dt/2). An exchange solves friction, heating and conduction pair by pair (physics/
//! thermal). In between particles move on adiabats; the work of both kicks, summed pair by pair
//! with the mean velocities of each kick, then replaces the adiabat's energies, so that the total
//! energy holds to rounding. Without these books it would drift upward.

use std::marker::PhantomData;

use super::thermal_sweeps::KernelSweeps;
use super::{ForceParts, Integrator, Source, drift};
use crate::error::Result;
use crate::kernel::Kernel;
use crate::physics::{Exchanges, FrictionForm};
use crate::random::{Stream, SweepKey, Variate};
use crate::simulation::Engine;
use crate::stopwatch::Phase;
use crate::sweep::{Direction, ThermalSweep, thermal_exchange};

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
        engine.stopwatch.lap(Phase::Exchanges);
    }

    /// v += t f, with the books.
    fn kick(&self, engine: &mut Engine, t: f64) {
        if engine.thermal.as_ref().is_some_and(|it| it.bookkeeping) {
            engine.mean_velocities(t);
            (self.sweeps.work)(engine);
            engine.stopwatch.lap(Phase::Forces);
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
        self.sweeps.pressure_forces(engine);
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
        self.sweeps.pressure_forces(engine);
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
