//! How a step is made. Every integrator is generic over kernel, friction, noise and dimension; the
//! registry turns names into one of these types, and a run makes one virtual call.

mod pair_splitting;
mod thermal_splitting;
mod thermal_sweeps;
mod thermal_verlet;
mod velocity_verlet;

pub use pair_splitting::PairSplitting;
pub use thermal_splitting::ThermalSplitting;
pub use thermal_verlet::ThermalVerlet;
pub use velocity_verlet::VelocityVerlet;

use crate::error::Result;
use crate::kernel::Kernel;
use crate::physics::{FrictionForm, Frictionless};
use crate::random::{Silent, Stream, SweepKey, Variate};
use crate::simulation::Engine;
use crate::state::Records;
use crate::stopwatch::Phase;
use crate::sweep::{
    Double, Motion, Precision, drag_forces, number_densities, pair_forces, site_pressures,
    wall_densities, wall_drag, wall_forces, wall_friction_weight, wall_pressures, wall_shares,
};

/// What a force comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Source {
    /// Particles, and what is behind walls.
    All,
    /// What is behind walls: images, a completion, frozen particles.
    Walls,
}

/// The three parts of the force on every slot, for tests and analysis.
#[derive(Debug, Default)]
pub struct ForceParts {
    /// From the pressures.
    pub conservative: Records,
    /// Drag at the present velocities.
    pub dissipative: Records,
    /// Noise of velocity Verlet at the given step.
    pub random: Records,
}

/// A compiled step loop.
pub trait Integrator: Send + Sync {
    /// Makes densities, pressures and forces those of the present positions and velocities.
    fn refresh(&self, engine: &mut Engine, dt: f64) -> Result<()>;
    /// Advances by `steps` steps of `dt`; observers are called inside.
    fn run(&self, engine: &mut Engine, steps: u64, dt: f64) -> Result<()>;
    /// Rebuilds the pair lists from the present positions (and the grid, if asked).
    fn rebuild(&self, engine: &mut Engine, renew_grid: bool) -> Result<()>;
    /// The parts of the force, in slot order: of all, or of what is behind walls alone.
    fn force_parts(&self, engine: &mut Engine, dt: f64, step: u64, whose: Source) -> ForceParts;
    /// Mean over particles of sum_j g_ij.
    fn mean_friction_weight(&self, engine: &mut Engine) -> f64;
    /// Are pairs wanted in shuffled order?
    fn shuffles(&self) -> bool;
    /// Does it need a second force array?
    fn needs_drag(&self) -> bool;
    /// Does it carry rates over the drift?
    fn carries(&self) -> bool {
        false
    }
    /// Does its step count all energy that pairs hand over?
    fn keeps_heat_current(&self) -> bool {
        false
    }
}

/// Number densities of the present positions, walls included.
pub(crate) fn densities<K: Kernel, P: Precision, const D: usize>(engine: &mut Engine) {
    let Engine {
        particles,
        grid,
        list,
        cell,
        walls,
        stopwatch,
        ..
    } = engine;
    number_densities::<K, P, D>(particles, grid, list, cell);
    stopwatch.lap(Phase::Densities);
    wall_densities::<K, D>(particles, walls, grid, cell);
    stopwatch.lap(Phase::Walls);
}

/// Densities, then pressures, of the present positions.
pub(crate) fn update_densities<K: Kernel, P: Precision, const D: usize>(engine: &mut Engine) {
    densities::<K, P, D>(engine);
    let Engine {
        particles,
        cell,
        eos,
        units,
        walls,
        stopwatch,
        ..
    } = engine;
    let (to_mass_density, from_pressure) = (units.mass_density(), 1.0 / units.pressure());
    let pressure = |d| eos.pressure(d * to_mass_density) * from_pressure;
    site_pressures::<P>(particles, cell, pressure);
    wall_pressures(walls, pressure);
    stopwatch.lap(Phase::Densities);
}

/// Forces of pairs and walls, from the present pressures; drag and noise are those of a kick of dt.
pub(crate) fn forces<K: Kernel, F: FrictionForm, V: Variate, P: Precision, const D: usize>(
    engine: &mut Engine,
    dt: f64,
) {
    let kick = engine.friction.kick(dt);
    let key = SweepKey::new(engine.seed, Stream::PairForce, engine.step, 0);
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
    wall_shares(particles, walls);
    pair_forces::<K, F, V, P, D>(particles, grid, list, cell, kick, key, tally.as_mut());
    stopwatch.lap(Phase::Forces);
    wall_forces::<K, F, V, D>(particles, walls, grid, kick, key);
    stopwatch.lap(Phase::Walls);
}

/// Forces of the pressures alone.
pub(crate) fn conservative_forces<K: Kernel, P: Precision, const D: usize>(engine: &mut Engine) {
    // Of a kick without friction and noise, the duration does not matter.
    forces::<K, Frictionless, Silent, P, D>(engine, 1.0);
}

/// In double precision always: they are compared, not followed.
pub(crate) fn force_parts<K: Kernel, F: FrictionForm, V: Variate, const D: usize>(
    engine: &mut Engine,
    dt: f64,
    step: u64,
    whose: Source,
) -> ForceParts {
    let kick = engine.friction.kick(dt);
    let key = SweepKey::new(engine.seed, Stream::PairForce, step, 0);
    let all = whose == Source::All;
    let Engine {
        particles,
        grid,
        list,
        cell,
        walls,
        ..
    } = engine;
    let saved = (
        particles.force.clone(),
        particles.drag.clone(),
        particles.scratch.clone(),
    );
    let saved_walls = (walls.force.clone(), walls.drag.clone());
    let mut parts = ForceParts::default();
    wall_shares(particles, walls);
    if all {
        pair_forces::<K, Frictionless, Silent, Double, D>(
            particles, grid, list, cell, kick, key, None,
        );
    } else {
        particles.force.fill([0.0; 4]);
    }
    wall_forces::<K, Frictionless, Silent, D>(particles, walls, grid, kick, key);
    parts.conservative = particles.force.clone();
    particles.drag = Records::new(particles.len());
    particles.scratch = particles.velocity.clone();
    if F::ON {
        if all {
            drag_forces::<K, F, Silent, Double, D>(particles, grid, list, cell, kick, key, None);
        }
        let motion = Motion::Actual;
        wall_drag::<K, F, Silent, D>(particles, walls, grid, kick, key, motion);
    }
    parts.dissipative = particles.drag.clone();
    particles.scratch.fill([0.0; 4]);
    particles.drag.fill([0.0; 4]);
    if V::ON {
        if all {
            drag_forces::<K, F, V, Double, D>(particles, grid, list, cell, kick, key, None);
        }
        let motion = Motion::Difference;
        wall_drag::<K, F, V, D>(particles, walls, grid, kick, key, motion);
    }
    parts.random = particles.drag.clone();
    (particles.force, particles.drag, particles.scratch) = saved;
    (walls.force, walls.drag) = saved_walls;
    parts
}

/// Mean over particles of sum_j g_ij, by the conservative sweep's geometry.
pub(crate) fn mean_friction_weight<K: Kernel, const D: usize>(engine: &Engine) -> f64 {
    let position = &engine.particles.position;
    let mut sum = 0.0;
    for block in 0..engine.list.blocks.len() as u32 {
        for (head, others) in engine.list.present(block).iter() {
            let i = position[head as usize];
            for &other in others {
                let j = position[other as usize];
                let r = engine
                    .cell
                    .nearest::<D>([i[0] - j[0], i[1] - j[1], i[2] - j[2]]);
                let r2: f64 = r[..D].iter().map(|x| x * x).sum();
                let weight = i[3] * j[3];
                sum += 2.0 * K::f::<_, D>(r2.sqrt()) * weight * weight;
            }
        }
    }
    sum += wall_friction_weight::<K, D>(&engine.particles, &engine.walls);
    sum / engine.particles.len() as f64
}

/// Moves the particles and brings the lists up to date.
pub(crate) fn drift<const D: usize>(engine: &mut Engine, dt: f64, shuffle: bool) -> Result<()> {
    let way = engine.move_particles(dt)?;
    follow::<D>(engine, dt, way, shuffle)
}

/// So many kicks of t before, in one go through the particles.
pub(crate) fn kick_and_drift<const KICKS: u32, const D: usize>(
    engine: &mut Engine,
    t: f64,
    dt: f64,
    shuffle: bool,
) -> Result<()> {
    let way = engine.kick_and_move::<KICKS>(t, dt)?;
    follow::<D>(engine, dt, way, shuffle)
}

/// Lists and observers' sums after particles have been moved, none farther than `way`.
fn follow<const D: usize>(engine: &mut Engine, dt: f64, way: f64, shuffle: bool) -> Result<()> {
    if let Some(tally) = &mut engine.tally {
        tally.drift(dt, &engine.particles.velocity);
    }
    engine.stopwatch.lap(Phase::Motion);
    let beyond = engine.is_beyond_margin();
    engine.stopwatch.lap(Phase::Lists);
    let crossings = engine.walls.crossings;
    engine.bounce()?;
    if engine.walls.crossings > crossings {
        // Back from a bent wall a particle may have come farther than it flew.
        engine.list.travel += 2.0 * way;
        engine.lose_track();
    }
    engine.stopwatch.lap(Phase::Walls);
    engine.keep_lists::<D>(beyond, shuffle)
}
