//! The exact pair splitting: O(dt/2) - kick - drift - densities - kick - O(dt/2), where O solves
//! drag and noise of each pair exactly, one pair after the other (Shardlow, SIAM J. Sci. Comput. 24
//! (2003) 1267; exact pair process: Serrano et al. 2006). It conserves momentum and keeps the
//! Maxwell distribution at any step; the second O runs backward, which makes the step symmetric.

use std::marker::PhantomData;

use super::{
    ForceParts, Integrator, Source, conservative_forces, force_parts, kick_and_drift,
    mean_friction_weight, update_densities,
};
use crate::error::Result;
use crate::kernel::Kernel;
use crate::physics::FrictionForm;
use crate::random::{Stream, SweepKey, Variate};
use crate::simulation::Engine;
use crate::stopwatch::Phase;
use crate::sweep::{Direction, Precision, exchange, wall_exchange};

/// The splitting; see the module.
pub struct PairSplitting<K, F, V, P, const D: usize> {
    form: PhantomData<(K, F, V, P)>,
}

impl<K, F, V, P, const D: usize> Default for PairSplitting<K, F, V, P, D> {
    fn default() -> Self {
        Self { form: PhantomData }
    }
}

impl<K: Kernel, F: FrictionForm, V: Variate, P: Precision, const D: usize>
    PairSplitting<K, F, V, P, D>
{
    /// Half a step of drag and noise, in one sweep or several; `started` is the step at whose start
    /// it belongs.
    fn exchange(&self, engine: &mut Engine, t: f64, started: u64, direction: Direction) {
        if !F::ON {
            return;
        }
        let draw = u8::from(direction == Direction::Backward);
        let key = SweepKey::new(engine.seed, Stream::PairExchange, started, draw);
        let sweeps = engine.sweeps;
        for part in 0..sweeps {
            self.sweep(engine, t / f64::from(sweeps), key.of_part(part), direction);
        }
    }

    /// One sweep over all pairs and links to walls.
    fn sweep(&self, engine: &mut Engine, t: f64, key: SweepKey, direction: Direction) {
        let process = engine.friction.exchange(t);
        let Engine {
            particles,
            grid,
            list,
            cell,
            tally,
            walls,
            stopwatch,
            ..
        } = engine;
        // Walls after the pairs, and backward before them: a step is the same from both ends.
        if direction == Direction::Backward {
            wall_exchange::<K, F, V, D>(particles, walls, grid, process, key, direction);
            stopwatch.lap(Phase::Walls);
        }
        exchange::<K, F, V, P, D>(
            particles,
            grid,
            list,
            cell,
            process,
            key,
            direction,
            tally.as_mut(),
        );
        stopwatch.lap(Phase::Exchanges);
        if direction == Direction::Forward {
            wall_exchange::<K, F, V, D>(particles, walls, grid, process, key, direction);
            stopwatch.lap(Phase::Walls);
        }
    }
}

impl<K: Kernel, F: FrictionForm, V: Variate, P: Precision, const D: usize> Integrator
    for PairSplitting<K, F, V, P, D>
{
    fn refresh(&self, engine: &mut Engine, _: f64) -> Result<()> {
        update_densities::<K, P, D>(engine);
        conservative_forces::<K, P, D>(engine);
        Ok(())
    }

    fn run(&self, engine: &mut Engine, steps: u64, dt: f64) -> Result<()> {
        for _ in 0..steps {
            let started = engine.step;
            self.exchange(engine, 0.5 * dt, started, Direction::Forward);
            kick_and_drift::<1, D>(engine, 0.5 * dt, dt, self.shuffles())?;
            engine.step += 1;
            update_densities::<K, P, D>(engine);
            conservative_forces::<K, P, D>(engine);
            engine.kick(0.5 * dt);
            self.exchange(engine, 0.5 * dt, started, Direction::Backward);
            engine.observe(dt);
        }
        Ok(())
    }

    fn rebuild(&self, engine: &mut Engine, renew_grid: bool) -> Result<()> {
        engine.rebuild::<D>(renew_grid, self.shuffles())
    }

    fn force_parts(&self, engine: &mut Engine, dt: f64, step: u64, whose: Source) -> ForceParts {
        force_parts::<K, F, V, D>(engine, dt, step, whose)
    }

    fn mean_friction_weight(&self, engine: &mut Engine) -> f64 {
        mean_friction_weight::<K, D>(engine)
    }

    fn shuffles(&self) -> bool {
        F::ON
    }

    fn needs_drag(&self) -> bool {
        false
    }
}
