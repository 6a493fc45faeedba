//! The engine: it owns particles, lists, units and the compiled loop, and advances them.

mod motion;

use motion::Gone;

use std::sync::{Arc, Mutex};

use rayon::prelude::*;

use crate::domain::PeriodicBox;
use crate::effect::{AccelerationField, BodyForce};
use crate::eos::{self, EquationOfState};
use crate::error::{Error, Result};
use crate::integrator::{ForceParts, Integrator, Source};
use crate::neighbor::{Grid, PairList, SkinModel, margin_and_skin};
use crate::observe::{Observer, Parts, View};
use crate::physics::PairFriction;
use crate::registry::{self, Combination};
use crate::state::{Particles, Records};
use crate::stopwatch::{Phase, Stopwatch};
use crate::sweep::{HeatMoment, HeatTally, Instructions, Tally, Tensor};
use crate::thermal::{Accounts, Thermal, ThermalSettings};
use crate::units::Units;
use crate::valid::{finite, non_negative, positive};
use crate::wall::{Field, ModelSettings, WallModel, WallSettings, Walls, Wrench};

/// Particles per task of the elementwise loops.
const GRAIN: usize = 1024;

/// Everything that defines a run, in the user's units.
#[derive(Debug, Clone)]
pub struct Settings {
    /// Which loop.
    pub combination: Combination,
    /// Box edges `[length]`.
    pub edges: Vec<f64>,
    /// Support h `[length]`.
    pub support: f64,
    /// Particle mass.
    pub mass: f64,
    /// kB T `[energy]`.
    pub thermal_energy: f64,
    /// a `[viscosity]`.
    pub friction_across: f64,
    /// b `[viscosity]`.
    pub friction_along: f64,
    /// Equation of state: name and parameters.
    pub eos: (String, Vec<f64>),
    /// Re-evaluations of the drag per Verlet step; sweeps of exchanges per half step of the
    /// isothermal splitting, 0 and 1 being one.
    pub iterations: u32,
    /// Acceleration field: amplitude `[acceleration]`, and (axis, waves) if it is sinusoidal.
    pub body_force: Option<AccelerationField>,
    /// Time step the scene was planned for `[time]`.
    pub dt: f64,
    /// Seed of all noise.
    pub seed: u64,
    /// Skin of the pairs that sweeps work on `[length]`; `None`: what should cost least.
    pub skin: Option<f64>,
    /// Speed of flow to expect `[velocity]`: a hint for how long lists last.
    pub flow_speed: f64,
    /// Threads.
    pub threads: usize,
    /// Is each axis periodic? Empty: all are.
    pub periodic: Vec<bool>,
    /// Walls.
    pub walls: Vec<WallSettings>,
    /// Fields of the walls of any shape.
    pub fields: Vec<Arc<Field>>,
    /// Model of the walls.
    pub wall_model: ModelSettings,
    /// Places of frozen particles `[length]`, for the model that has them.
    pub frozen: Vec<[f64; 3]>,
    /// Energies; `None`: the fluid is isothermal.
    pub thermal: Option<ThermalSettings>,
}

/// How often lists were renewed.
#[derive(Debug, Clone, Copy, Default)]
pub struct Counters {
    /// Grid renewals.
    pub grid_renewals: u64,
    /// How often it was found out anew which pairs sweeps work on.
    pub prunings: u64,
}

/// A running simulation.
pub struct Engine {
    /// Reduced units.
    pub units: Units,
    /// D.
    pub dimension: usize,
    /// The box.
    pub cell: PeriodicBox,
    /// State in slot order.
    pub particles: Particles,
    /// Blocks and cells.
    pub grid: Grid,
    /// Pairs.
    pub list: PairList,
    /// Walls and what is near them.
    pub walls: Walls,
    /// Equation of state in the user's units.
    pub eos: Box<dyn EquationOfState>,
    /// Friction coefficients and kB T.
    pub friction: PairFriction,
    /// Sweeps of exchanges in half a step of the splitting.
    pub sweeps: u8,
    /// Seed.
    pub seed: u64,
    /// Steps done.
    pub step: u64,
    /// How often lists were renewed.
    pub counters: Counters,
    /// Where the time goes.
    pub stopwatch: Stopwatch,
    /// Stress of the particles, where an observer wants it.
    pub tally: Option<Tally>,
    /// Energies, where particles have some.
    pub thermal: Option<Thermal>,
    observers: Vec<Arc<Mutex<dyn Observer>>>,
    body_force: BodyForce,
    skin: f64,
    margin: f64,
    gone: Gone,
    clock: Clock,
    before: Option<Before>,
    /// dt [user] that the forces at hand were computed for.
    forces_for: Option<f64>,
    integrator: Arc<dyn Integrator>,
    pool: Arc<rayon::ThreadPool>,
}

/// Simulated time: a multiple of dt since dt last changed, so that cutting a run changes no bit.
#[derive(Debug, Clone, Copy)]
pub struct Clock {
    /// Time when the present dt began `[time, user]`.
    pub base_time: f64,
    /// Step when the present dt began.
    pub base_step: u64,
    /// The present dt `[time, user]`.
    pub dt: f64,
}

/// What a failed run returns to.
struct Before {
    clock: Clock,
    step: u64,
    impulse: Vec<Wrench>,
    crossings: u64,
    accounts: Option<Accounts>,
    current: Option<HeatMoment>,
    stress: Option<[Tensor; 4]>,
}

impl Clock {
    fn at(&self, step: u64) -> f64 {
        self.base_time + (step - self.base_step) as f64 * self.dt
    }
}

fn build_body_force(settings: &Settings, units: &Units) -> Result<BodyForce> {
    let Some((amplitude, wave)) = &settings.body_force else {
        return Ok(BodyForce::None);
    };
    let dimension = settings.combination.dimension;
    if amplitude.len() != dimension {
        return Err(Error::Invalid(format!(
            "`body_force` must have {dimension} components, got {}",
            amplitude.len()
        )));
    }
    let mut scaled = [0.0; 3];
    for (axis, &a) in amplitude.iter().enumerate() {
        scaled[axis] = finite("body_force", a)? / units.acceleration();
    }
    Ok(match wave {
        None => BodyForce::Uniform(scaled),
        Some((axis, _)) if settings.periodic.get(*axis) == Some(&false) => {
            return Err(Error::Invalid(format!(
                "`body_force` must vary along a periodic axis, got axis {axis}"
            )));
        }
        Some((axis, waves)) if *axis < dimension && *waves > 0 => BodyForce::Sinusoidal {
            amplitude: scaled,
            axis: *axis,
            waves: *waves,
        },
        Some(other) => {
            return Err(Error::Invalid(format!(
                "`body_force` must vary along an axis below {dimension} with at least one wave, got {other:?}"
            )));
        }
    })
}

impl Engine {
    /// A simulation of `n` particles at rest at the origin: set positions and velocities next.
    pub fn new(n: usize, settings: &Settings) -> Result<Self> {
        if n == 0 {
            return Err(Error::Invalid(
                "`positions` must hold at least one particle, got none".into(),
            ));
        }
        if n >= u32::MAX as usize {
            return Err(Error::Invalid(format!(
                "`positions` must hold fewer than 2^32 - 1 particles, got {n}"
            )));
        }
        Instructions::check()?;
        let dimension = settings.combination.dimension;
        let integrator = registry::build(&settings.combination, settings.iterations)?;
        if settings.edges.len() != dimension {
            return Err(Error::Invalid(format!(
                "`box` must have {dimension} edges, got {}",
                settings.edges.len()
            )));
        }
        for &edge in &settings.edges {
            positive("box", edge)?;
        }
        let support = positive("support", settings.support)?;
        let mass = positive("mass", settings.mass)?;
        let kt = non_negative("thermal_energy", settings.thermal_energy)?;
        let across = non_negative("friction_across", settings.friction_across)?;
        let along = finite("friction_along", settings.friction_along)?;
        if across + along < 0.0 {
            return Err(Error::Invalid(format!(
                "`friction_across` + `friction_along` must be >= 0, got {}",
                across + along
            )));
        }
        let dt = positive("dt", settings.dt)?;
        let mut periodic = settings.periodic.clone();
        periodic.resize(dimension, true);
        let cell = PeriodicBox::with_walls(&settings.edges, support, &periodic)?;
        let eos = eos::build(&settings.eos.0, &settings.eos.1)?;
        let volume: f64 = settings.edges.iter().product();
        let rho = mass * n as f64 / volume;
        let sound = eos.sound_speed_squared(rho).max(0.0).sqrt();
        let velocity = [(kt / mass).sqrt(), sound, support / dt]
            .into_iter()
            .find(|&v| v > 0.0)
            .unwrap_or(1.0);
        let units = Units {
            length: support,
            mass,
            velocity,
            dimension: dimension as i32,
        };
        let friction = PairFriction {
            across: across / units.viscosity(),
            along: along / units.viscosity(),
            thermal_energy: kt / units.energy(),
        };
        let density = n as f64 / volume / units.number_density();
        let model = SkinModel {
            dt: dt / units.time(),
            speed: if settings.combination.noise == "none" {
                0.0
            } else {
                friction.thermal_energy.sqrt()
            },
            drift: non_negative("flow_speed", settings.flow_speed)? / units.velocity,
            friction_time: friction_time(&friction, density, dimension),
            n,
            dimension,
            shuffles: integrator.shuffles(),
            edge: cell.edges[1..dimension]
                .iter()
                .copied()
                .fold(f64::INFINITY, f64::min),
        };
        let (margin, best) = margin_and_skin(&model);
        let skin = match settings.skin {
            None => best,
            Some(skin) => (positive("skin", skin)? / support).min(margin),
        };
        let threads = settings.threads.max(1);
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .map_err(|e| Error::Invalid(format!("`threads` = {threads}: {e}")))?;
        let drag = integrator.needs_drag();
        let kernel = &settings.combination.kernel;
        let mut walls = Walls::new(
            &settings.walls,
            &settings.fields,
            kernel,
            dimension,
            &cell,
            &units,
        )?;
        let frozen: Vec<[f64; 3]> = (settings.frozen.iter())
            .map(|place| place.map(|x| x / support))
            .collect();
        let friction_on = settings.combination.friction != "none";
        let splitting = friction_on.then(|| integrator.shuffles());
        let model = &settings.wall_model;
        walls.set_model(model, &frozen, kernel, splitting, dimension, &cell, &units)?;
        if settings.thermal.is_some() && walls.model != WallModel::SymmetricImages {
            return Err(Error::Invalid(
                "`wall_model` must be \"symmetric_images\" where the fluid has an energy".into(),
            ));
        }
        // The splitting goes through the pairs of a block in an order of its own, which wide blocks would change.
        let width = 1.0 + margin;
        let grid = pool.install(|| {
            if integrator.shuffles() {
                Grid::new(&cell, dimension, n, width)
            } else {
                Grid::with_wide_blocks(&cell, dimension, n, width)
            }
        });
        let mut particles = Particles::new(n, drag);
        if integrator.carries() {
            particles.carried = Records::new(n);
        }
        let splits = settings.combination.integrator == "pair_splitting";
        if settings.thermal.is_some() && !splits && !walls.surfaces.is_empty() {
            return Err(Error::Invalid(format!(
                "`integrator` must be \"pair_splitting\" where a fluid with an energy has walls, got {:?}",
                settings.combination.integrator
            )));
        }
        let coefficients = [friction.across, friction.along];
        let counts = [grid.block_count(), walls.surfaces.len()];
        let exchanges = &settings.combination.exchanges;
        if settings.thermal.is_some() != (exchanges != "none") {
            return Err(Error::Invalid(format!(
                "`thermal` must be given where `exchanges` is not \"none\", and only there, got {exchanges:?}"
            )));
        }
        let thermal = match &settings.thermal {
            None => None,
            Some(wish) => Some(Thermal::new(
                wish,
                &units,
                coefficients,
                &mut particles,
                counts,
            )?),
        };
        if let Some(thermal) = &thermal {
            thermal.check_exchanges(exchanges)?;
        }
        Ok(Self {
            walls,
            body_force: build_body_force(settings, &units)?,
            units,
            dimension,
            cell,
            particles,
            thermal,
            grid,
            list: PairList::default(),
            eos,
            friction,
            sweeps: settings.iterations.clamp(1, 255) as u8,
            seed: settings.seed,
            step: 0,
            counters: Counters::default(),
            stopwatch: Stopwatch::default(),
            tally: None,
            observers: Vec::new(),
            skin,
            margin,
            gone: Gone::ANYWHERE,
            clock: Clock {
                base_time: 0.0,
                base_step: 0,
                dt,
            },
            before: None,
            forces_for: None,
            integrator: Arc::from(integrator),
            pool: Arc::new(pool),
        })
    }

    /// Skin of the pairs that sweeps work on and margin of the lists, in units of the support.
    pub fn skin_and_margin(&self) -> (f64, f64) {
        (self.skin, self.margin)
    }

    /// Simulated time in the user's units.
    pub fn time(&self) -> f64 {
        self.clock.at(self.step)
    }

    /// The clock, for checkpoints.
    pub fn clock(&self) -> Clock {
        self.clock
    }

    /// Sets the clock and the step, for checkpoints.
    pub fn set_clock(&mut self, clock: Clock, step: u64) {
        self.clock = clock;
        self.step = step;
    }

    /// Attaches an observer.
    pub fn attach(&mut self, observer: Arc<Mutex<dyn Observer>>) {
        self.observers.push(observer);
        let (mut stress, mut parts) = (false, false);
        self.each_observer(|observer| {
            stress |= observer.needs_stress().is_some();
            parts |= observer.needs_stress() == Some(Parts::All);
        });
        if stress {
            let (n, blocks) = (self.particles.len(), self.grid.block_count());
            let tally = self.tally.get_or_insert_with(|| Tally::new(n, blocks));
            tally.parts = parts;
        }
        let mut current = false;
        self.each_observer(|observer| current |= observer.needs_heat_current());
        if let (true, Some(thermal)) = (current, &mut self.thermal) {
            let (n, blocks) = (self.particles.len(), self.grid.block_count());
            thermal
                .current
                .get_or_insert_with(|| HeatTally::new(n, blocks));
        }
    }

    /// Does a step count all energy that pairs hand over?
    pub fn keeps_heat_current(&self) -> bool {
        self.integrator.keeps_heat_current()
    }

    /// Detaches all observers.
    pub fn detach_all(&mut self) {
        self.observers.clear();
        self.tally = None;
        if let Some(thermal) = &mut self.thermal {
            thermal.current = None;
        }
    }

    /// Puts particle of row `row` somewhere else: position and velocity in reduced units. Call
    /// `renew` before the next run.
    pub fn place(&mut self, slot: usize, position: [f64; 3], velocity: [f64; 3]) {
        self.lose_track();
        let particles = &mut self.particles;
        particles.position[slot][..3].copy_from_slice(&position);
        particles.velocity[slot][..3].copy_from_slice(&velocity);
    }

    /// Gives drag and noise of an isothermal fluid other coefficients [user]; forces that hold them
    /// are renewed by the next run.
    pub fn set_friction(&mut self, across: f64, along: f64) -> Result<()> {
        let across = non_negative("friction_across", across)?;
        let along = finite("friction_along", along)?;
        if across + along < 0.0 || self.thermal.is_some() {
            return Err(Error::Invalid(
                "`friction` must be positive, and constant where particles have an energy".into(),
            ));
        }
        self.friction.across = across / self.units.viscosity();
        self.friction.along = along / self.units.viscosity();
        self.forces_for = None;
        Ok(())
    }

    /// New lists, densities, pressures and forces for changed positions or velocities.
    pub fn renew(&mut self, lists: bool) -> Result<()> {
        let integrator = Arc::clone(&self.integrator);
        let pool = Arc::clone(&self.pool);
        let dt = self.clock.dt;
        pool.install(|| {
            if lists {
                integrator.rebuild(self, true)?;
            }
            integrator.refresh(self, dt / self.units.time())
        })?;
        self.forces_for = Some(dt);
        Ok(())
    }

    /// Last part of restoring a state whose particles are in place except for positions and forces:
    /// grid and list become those of the references; since that of the list no particle has gone farther than
    /// `travel`. A state of an earlier version may know neither, and have had another grid: its lists are
    /// built anew.
    pub fn restore(
        &mut self,
        grid: &[[f64; 3]],
        list: Option<(&[[f64; 3]], f64)>,
        position: &[[f64; 4]],
        force: &[[f64; 4]],
    ) {
        let integrator = Arc::clone(&self.integrator);
        let pool = Arc::clone(&self.pool);
        let dt = self.clock.dt / self.units.time();
        let rows = self.particles.row.clone();
        // Sorting again what is sorted changes nothing, images included: references are in the box.
        self.place_at(grid);
        self.grid
            .renew(&self.cell, self.dimension, &mut self.particles);
        let list = list.filter(|_| self.particles.row == rows);
        pool.install(|| {
            // What could fail is an oversized region, which the next run reports, or a particle outside of the
            // box, which was none before.
            let force = if let Some((reference, travel)) = list {
                let _ = integrator.rebuild(self, false);
                self.place_at(reference);
                self.prune_anew();
                self.list.travel = travel;
                self.particles.position.copy_from_slice(position);
                force.to_vec()
            } else {
                let position = self.particles.in_slots(&rows, position);
                self.particles.position.copy_from_slice(&position);
                let _ = integrator.rebuild(self, true);
                self.particles.in_slots(&rows, force)
            };
            let _ = integrator.refresh(self, dt);
            self.particles.force.copy_from_slice(&force);
        });
        self.lose_track();
        self.forces_for = Some(self.clock.dt);
    }

    fn prune_anew(&mut self) {
        match self.dimension {
            2 => self.prune::<2>(),
            _ => self.prune::<3>(),
        }
    }

    fn place_at(&mut self, reference: &[[f64; 3]]) {
        for (position, at) in self.particles.position.iter_mut().zip(reference) {
            position[..3].copy_from_slice(at);
        }
    }

    /// Bytes of the particles and of grid and reference arrays.
    pub fn state_bytes(&self) -> usize {
        let particles = &self.particles;
        32 * (particles.position.len()
            + particles.velocity.len()
            + particles.force.len()
            + particles.drag.len()
            + particles.scratch.len()
            + particles.carried.len())
            + particles.copies.bytes()
            + 8 * (particles.density.capacity() + particles.id.capacity())
            + 4 * particles.row.capacity()
            + 12 * particles.image.capacity()
            + self.grid.bytes()
            + self.walls.bytes()
            + particles
                .scalars
                .iter()
                .map(|s| 8 * s.values.capacity())
                .sum::<usize>()
            + self.thermal.as_ref().map_or(0, Thermal::bytes)
    }

    /// Advances by `steps` steps of `dt` [user]; if that fails, see `undo`.
    pub fn run(&mut self, steps: u64, dt: f64) -> Result<()> {
        let result = self.advance(steps, dt);
        match result {
            Ok(()) => self.accept(),
            Err(_) => self.undo(),
        }
        result
    }

    /// The same, but what was done can still be undone, together with what other calls do before
    /// `accept`.
    pub fn advance(&mut self, steps: u64, dt: f64) -> Result<()> {
        let dt = positive("dt", dt)?;
        if self.list.overflow {
            return Err(self.list.overflow_error());
        }
        if self.before.is_none() {
            self.mark();
        }
        if dt != self.clock.dt {
            self.clock = Clock {
                base_time: self.time(),
                base_step: self.step,
                dt,
            };
        }
        if self.forces_for != Some(dt) {
            self.renew(false)?;
        }
        let integrator = Arc::clone(&self.integrator);
        let pool = Arc::clone(&self.pool);
        let scaled = dt / self.units.time();
        self.stopwatch.begin();
        let begun = self.step;
        let result = pool
            .install(|| integrator.run(self, steps, scaled))
            // The last kick of a run is followed by no drift that would notice.
            .and_then(|()| self.check_finite());
        self.stopwatch.end(self.step - begun);
        result
    }

    /// Remembers clock, sums and samples, to which `undo` returns. Particles are remembered by whoever
    /// shows them.
    fn mark(&mut self) {
        self.each_observer(|observer| observer.begin());
        let thermal = self.thermal.as_ref();
        self.before = Some(Before {
            clock: self.clock,
            step: self.step,
            impulse: self.walls.impulse.clone(),
            crossings: self.walls.crossings,
            accounts: thermal.map(|it| it.accounts.clone()),
            current: thermal
                .and_then(|it| it.current.as_ref())
                .map(|it| it.moment),
            stress: self.tally.as_ref().map(|it| it.moment),
        });
    }

    /// Has anything been done since the last `accept`?
    pub fn is_ahead(&self) -> bool {
        self.before.is_some()
    }

    /// What has been done since the last call is good.
    pub fn accept(&mut self) {
        self.before = None;
    }

    /// Returns to clock, sums and samples of the last `accept`; particles are left as they are.
    pub fn undo(&mut self) {
        let Some(before) = self.before.take() else {
            return;
        };
        self.each_observer(|observer| observer.forget());
        // Forces may have been emptied.
        self.forces_for = None;
        (self.clock, self.step) = (before.clock, before.step);
        self.walls.impulse = before.impulse;
        self.walls.crossings = before.crossings;
        if let (Some(thermal), Some(accounts)) = (&mut self.thermal, before.accounts) {
            thermal.accounts = accounts;
            if let (Some(tally), Some(moment)) = (&mut thermal.current, before.current) {
                tally.moment = moment;
            }
        }
        if let (Some(tally), Some(moment)) = (&mut self.tally, before.stress) {
            tally.moment = moment;
        }
    }

    fn each_observer(&self, mut call: impl FnMut(&mut dyn Observer)) {
        for observer in &self.observers {
            match observer.lock() {
                Ok(mut guard) => call(&mut *guard),
                Err(poisoned) => call(&mut *poisoned.into_inner()),
            }
        }
    }

    /// The parts of the force in slot order, reduced units; the noise is that of step `step`.
    pub fn force_parts(&mut self, step: u64, whose: Source) -> ForceParts {
        let integrator = Arc::clone(&self.integrator);
        let pool = Arc::clone(&self.pool);
        let dt = self.clock.dt / self.units.time();
        pool.install(|| integrator.force_parts(self, dt, step, whose))
    }

    /// Mean friction rate (1/m) <sum_j g_ij> (a + b/D) of a particle's velocity, reduced units.
    pub fn friction_rate(&mut self) -> f64 {
        let integrator = Arc::clone(&self.integrator);
        let weight = integrator.mean_friction_weight(self);
        weight * (self.friction.across + self.friction.along / self.dimension as f64)
    }

    /// Sorts (if asked) and searches the pairs anew.
    pub(crate) fn rebuild<const D: usize>(
        &mut self,
        renew_grid: bool,
        shuffle: bool,
    ) -> Result<()> {
        if renew_grid {
            self.check_finite()?;
            self.check_limits()?;
            self.grid.renew(&self.cell, D, &mut self.particles);
            self.gone = Gone::NOWHERE;
            self.counters.grid_renewals += 1;
        }
        let cutoff = 1.0 + self.margin;
        self.list
            .build::<D>(&self.grid, &self.cell, &mut self.particles, cutoff, shuffle);
        if self.list.overflow {
            return Err(self.list.overflow_error());
        }
        self.walls.rebuild::<D>(
            &self.particles,
            &self.grid,
            &self.list,
            &self.cell,
            self.margin,
        );
        self.prune::<D>();
        Ok(())
    }

    /// Finds out anew which pairs of the list sweeps should work on, if not all.
    fn prune<const D: usize>(&mut self) {
        if self.skin < self.margin {
            self.counters.prunings += 1;
            let cutoff = 1.0 + self.skin;
            self.list
                .prune::<D>(&self.cell, &mut self.particles, cutoff);
        }
    }

    /// Nothing may have left through an axis that is not periodic.
    fn check_limits(&self) -> Result<()> {
        let room = self.walls.rounding();
        if self.cell.periodic[..self.dimension].iter().all(|&p| p) {
            return Ok(());
        }
        let outside = |position: &[f64; 4]| {
            (0..self.dimension).any(|a| {
                !self.cell.periodic[a]
                    && !(-room..=self.cell.limits[a] + room).contains(&position[a])
            })
        };
        match self.particles.position.iter().position(outside) {
            None => Ok(()),
            Some(slot) => Err(self.escape(slot)),
        }
    }

    fn escape(&self, slot: usize) -> Error {
        let record = &self.particles.position[slot];
        let at = [record[0], record[1], record[2]];
        let place: Vec<String> = at[..self.dimension]
            .iter()
            .map(|x| format!("{:.6e}", x * self.units.length))
            .collect();
        let (distance, wall) = self.walls.nearest(at, &self.cell);
        Error::Escaped {
            step: self.step,
            id: self.particles.id[slot],
            place: place.join(", "),
            wall: if distance < 0.0 {
                format!("{:.3e} behind wall {wall}", -distance * self.units.length)
            } else {
                "outside of the box".into()
            },
        }
    }

    fn check_finite(&self) -> Result<()> {
        for slot in 0..self.particles.len() {
            for (quantity, record) in [
                ("velocity", &self.particles.velocity[slot]),
                ("position", &self.particles.position[slot]),
            ] {
                if !record[..3].iter().all(|x| x.is_finite()) {
                    return Err(Error::NotFinite {
                        step: self.step,
                        id: self.particles.id[slot],
                        quantity,
                    });
                }
            }
        }
        Ok(())
    }

    /// scratch = v + t (f + body force)/2, the mean of the velocities before and after a kick of
    /// length t, and the body force's work in it.
    pub(crate) fn mean_velocities(&mut self, t: f64) {
        let (cell, body) = (self.cell, self.body_force);
        let Self {
            particles, thermal, ..
        } = self;
        let Some(thermal) = thermal else {
            return;
        };
        particles
            .scratch
            .par_iter_mut()
            .with_min_len(GRAIN)
            .zip(&particles.velocity)
            .zip(&particles.force)
            .zip(&particles.position)
            .zip(&mut thermal.input)
            .for_each(|((((mean, v), f), position), input)| {
                let extra = body.at(position, &cell);
                let mut work = 0.0;
                for a in 0..3 {
                    mean[a] = v[a] + 0.5 * t * (f[a] + extra[a]);
                    work += extra[a] * mean[a];
                }
                *input = t * work;
            });
    }

    /// Shows the state after a step of the thermal splitting, with pressures that go with it.
    pub(crate) fn observe_thermal(&mut self, dt: f64) {
        if self.observers.is_empty() {
            return;
        }
        if let Some(thermal) = &self.thermal {
            thermal.pressures(&mut self.particles);
        }
        self.observe(dt);
    }

    /// scratch = t f: the change of velocity that half a kick just made (drag part included; a body
    /// force is the same for all near particles only if uniform, so it is part of it).
    pub(crate) fn start_difference(&mut self, t: f64) {
        let (cell, body) = (self.cell, self.body_force);
        let particles = &mut self.particles;
        particles
            .scratch
            .par_iter_mut()
            .with_min_len(GRAIN)
            .zip(&particles.force)
            .zip(&particles.position)
            .for_each(|((difference, f), position)| {
                let extra = body.at(position, &cell);
                for a in 0..3 {
                    difference[a] = t * (f[a] + extra[a]);
                }
            });
    }

    /// force += drag; if `again`, the velocities follow and the next difference is prepared.
    pub(crate) fn add_drag(&mut self, t: f64, again: bool) {
        self.walls.add_drag(t, again);
        if let Some(tally) = &mut self.tally {
            tally.correct(if again { t } else { 0.0 });
        }
        let particles = &mut self.particles;
        particles
            .force
            .par_iter_mut()
            .with_min_len(GRAIN)
            .zip(&particles.drag)
            .zip(particles.velocity.par_iter_mut())
            .zip(particles.scratch.par_iter_mut())
            .for_each(|(((f, drag), v), difference)| {
                for a in 0..3 {
                    f[a] += drag[a];
                    if again {
                        difference[a] = t * drag[a];
                        v[a] += difference[a];
                    }
                }
            });
    }

    /// Is it some observer's turn?
    pub(crate) fn is_observed(&self) -> bool {
        let mut observed = false;
        self.each_observer(|observer| observed |= observer.is_due(self.step));
        observed
    }

    /// Shows the state after a step to the observers whose turn it is.
    pub(crate) fn observe(&mut self, dt: f64) {
        if self.observers.is_empty() {
            return;
        }
        let view = View {
            step: self.step,
            time: self.time(),
            dt,
            dimension: self.dimension,
            units: &self.units,
            cell: &self.cell,
            particles: &self.particles,
            walls: &self.walls,
            eos: self.eos.as_ref(),
            tally: self.tally.as_ref(),
            thermal: self.thermal.as_ref(),
        };
        self.each_observer(|observer| {
            if observer.is_due(self.step) {
                observer.sample(&view);
            }
        });
        self.stopwatch.lap(Phase::Observers);
    }
}

/// Mean-field friction time of a particle, 1 / (n int F dV (a + b/D)/ n^2).
fn friction_time(friction: &PairFriction, density: f64, dimension: usize) -> f64 {
    // int F dV = 10.5/h^2 for Lucy in 3D, 10 to 18 for all: good enough to choose a skin.
    let rate = 12.0 / density * (friction.across + friction.along / dimension as f64);
    if rate > 0.0 {
        1.0 / rate
    } else {
        f64::INFINITY
    }
}
