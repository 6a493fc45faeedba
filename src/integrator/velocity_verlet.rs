//! Velocity Verlet with forces that depend on velocities (Nikunen et al. 2003; Bian et al. 2015,
//! appendix B; Yang 2013, table 4 without its entropy part).
//!
//! One sweep evaluates conservative force, drag and noise with the velocities after the first half
//! kick. With `iterations` > 0 the drag is then brought up to the new velocities: as it is linear,
//! the correction is the drag of the velocities' change, without a new draw of noise.

use std::marker::PhantomData;

use super::{
    ForceParts, Integrator, Source, force_parts, forces, kick_and_drift, mean_friction_weight,
    update_densities,
};
use crate::error::Result;
use crate::kernel::Kernel;
use crate::physics::FrictionForm;
use crate::random::{Silent, Stream, SweepKey, Variate};
use crate::simulation::Engine;
use crate::stopwatch::Phase;
use crate::sweep::{Motion, Precision, drag_forces, wall_drag};

/// Velocity Verlet; see the module.
pub struct VelocityVerlet<K, F, V, P, const D: usize> {
    iterations: u32,
    form: PhantomData<(K, F, V, P)>,
}

impl<K, F, V, P, const D: usize> VelocityVerlet<K, F, V, P, D> {
    /// With so many re-evaluations of the drag at the end of each step.
    pub fn new(iterations: u32) -> Self {
        Self {
            iterations,
            form: PhantomData,
        }
    }
}

impl<K: Kernel, F: FrictionForm, V: Variate, P: Precision, const D: usize>
    VelocityVerlet<K, F, V, P, D>
{
    /// Velocities have just been changed by half a kick: lets the drag follow.
    fn correct_drag(&self, engine: &mut Engine, dt: f64) {
        if !F::ON || self.iterations == 0 {
            return;
        }
        let kick = engine.friction.kick(dt);
        let key = SweepKey::new(engine.seed, Stream::PairForce, engine.step, 0);
        engine.start_difference(0.5 * dt);
        engine.stopwatch.lap(Phase::Motion);
        for pass in 0..self.iterations {
            let Engine {
                particles,
                grid,
                list,
                cell,
                tally,
                walls,
                ..
            } = engine;
            drag_forces::<K, F, Silent, P, D>(
                particles,
                grid,
                list,
                cell,
                kick,
                key,
                tally.as_mut(),
            );
            let motion = Motion::Difference;
            wall_drag::<K, F, Silent, D>(particles, walls, grid, kick, key, motion);
            engine.stopwatch.lap(Phase::Forces);
            let last = pass + 1 == self.iterations;
            engine.add_drag(0.5 * dt, !last);
        }
    }
}

impl<K: Kernel, F: FrictionForm, V: Variate, P: Precision, const D: usize> Integrator
    for VelocityVerlet<K, F, V, P, D>
{
    fn refresh(&self, engine: &mut Engine, dt: f64) -> Result<()> {
        update_densities::<K, P, D>(engine);
        forces::<K, F, V, P, D>(engine, dt);
        Ok(())
    }

    fn run(&self, engine: &mut Engine, steps: u64, dt: f64) -> Result<()> {
        // The last kick of a step that nobody looks at is made together with the first one of the next.
        let waits = !F::ON || self.iterations == 0;
        let mut owed = false;
        for left in (0..steps).rev() {
            if owed {
                kick_and_drift::<2, D>(engine, 0.5 * dt, dt, false)?;
            } else {
                kick_and_drift::<1, D>(engine, 0.5 * dt, dt, false)?;
            }
            engine.step += 1;
            update_densities::<K, P, D>(engine);
            forces::<K, F, V, P, D>(engine, dt);
            owed = waits && left > 0 && !engine.is_observed();
            if owed {
                continue;
            }
            engine.kick(0.5 * dt);
            self.correct_drag(engine, dt);
            engine.observe(dt);
        }
        Ok(())
    }

    fn rebuild(&self, engine: &mut Engine, renew_grid: bool) -> Result<()> {
        engine.rebuild::<D>(renew_grid, false)
    }

    fn force_parts(&self, engine: &mut Engine, dt: f64, step: u64, whose: Source) -> ForceParts {
        force_parts::<K, F, V, D>(engine, dt, step, whose)
    }

    fn mean_friction_weight(&self, engine: &mut Engine) -> f64 {
        mean_friction_weight::<K, D>(engine)
    }

    fn shuffles(&self) -> bool {
        false
    }

    fn needs_drag(&self) -> bool {
        F::ON && self.iterations > 0
    }
}
