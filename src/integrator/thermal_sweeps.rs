//! What the integrators of fluids with an energy share: the sweeps of a kernel, and a run of steps.

use super::{
    ForceParts, Source, conservative_forces, densities, force_parts, mean_friction_weight,
};
use crate::error::{Error, Result};
use crate::kernel::Kernel;
use crate::physics::FrictionForm;
use crate::random::Silent;
use crate::simulation::Engine;
use crate::sweep::{Double, Slopes, pair_work, slopes, wall_work};

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
fn cold(engine: &Engine) -> Option<Error> {
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
            densities: densities::<K, Double, D>,
            forces: conservative_forces::<K, Double, D>,
            work: work::<K, D>,
            parts: force_parts::<K, F, Silent, D>,
            weight: mean_friction_weight::<K, D>,
            slopes: slopes::<K, D>,
            slope: K::f::<_, D>,
        }
    }

    /// Pressures of the present temperatures, and their forces.
    pub fn pressure_forces(&self, engine: &mut Engine) {
        if let Some(thermal) = &engine.thermal {
            thermal.pressures(&mut engine.particles);
        }
        (self.forces)(engine);
    }

    /// Densities, pressures and their forces.
    pub fn refresh(&self, engine: &mut Engine) {
        (self.densities)(engine);
        self.pressure_forces(engine);
    }

    /// So many steps, each made by `advance`.
    pub fn run(
        &self,
        engine: &mut Engine,
        steps: u64,
        dt: f64,
        mut advance: impl FnMut(&mut Engine) -> Result<()>,
    ) -> Result<()> {
        for _ in 0..steps {
            // A particle without energy makes velocities that are no numbers: say what came first.
            if let Err(error) = advance(engine) {
                return Err(cold(engine).unwrap_or(error));
            }
            if let Some(error) = cold(engine) {
                return Err(error);
            }
            engine.observe_thermal(dt);
        }
        // What the arrays show belongs together: pressures and forces are those of the energies.
        self.pressure_forces(engine);
        Ok(())
    }
}
