//! A step allocates nothing: counted by the allocator itself.

use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, OnceLock};

use sdpd::domain::PeriodicBox;
use sdpd::observe::{Correlator, Currents, HeatCorrelator, Parts, StressCorrelator};
use sdpd::registry::Combination;
use sdpd::relax::{normal_velocities, uniform_positions};
use sdpd::simulation::{Engine, Settings};
use sdpd::thermal::ThermalSettings;
use sdpd::wall::{Field, WallSettings};

/// So thin that there is something to prune every few steps.
const SKIN: f64 = 2e-5;

struct Counting;

static COUNT: AtomicUsize = AtomicUsize::new(0);

// SAFETY: every call is passed on to the system's allocator unchanged.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        COUNT.fetch_add(1, Ordering::Relaxed);
        // SAFETY: the caller's promises are passed on.
        unsafe { System.alloc(layout) }
    }
    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: as above.
        unsafe { System.dealloc(pointer, layout) }
    }
}

/// Made once: it takes longer than the steps.
static FIELD: OnceLock<Arc<Field>> = OnceLock::new();

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// What surrounds the fluid.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Around {
    Nothing,
    Planes,
    Field,
    OwnFoot,
    Completion,
    Frozen,
}

impl Around {
    fn model(self) -> (String, Vec<f64>) {
        let (name, numbers) = match self {
            Self::OwnFoot => ("own_foot_images", vec![1.0, 0.0]),
            Self::Completion => ("completion", vec![1.0, 0.1]),
            Self::Frozen => ("frozen_particles", vec![0.1]),
            _ => ("symmetric_images", Vec::new()),
        };
        (name.into(), numbers)
    }
}

fn engine(integrator: &str, threads: usize, around: Around) -> Engine {
    let (n, edge, support) = (729, 9.0, 2.65);
    let open = around == Around::Nothing;
    let (integrator, precision) = integrator.split_once(':').unwrap_or((integrator, "double"));
    let (integrator, exchanges) = integrator.split_once('/').unwrap_or((integrator, "none"));
    let thermal = exchanges != "none";
    let heat = match around {
        Around::Nothing => 0,
        Around::Field => 1,
        _ => 4,
    };
    let settings = Settings {
        combination: Combination {
            precision: precision.into(),
            dimension: 3,
            kernel: "lucy".into(),
            friction: "general".into(),
            noise: "gaussian".into(),
            integrator: integrator.into(),
            exchanges: exchanges.into(),
        },
        edges: vec![edge; 3],
        support,
        mass: 1.0,
        thermal_energy: 1.0,
        friction_across: 33.0,
        friction_along: 33.0,
        eos: ("linear".into(), vec![1.0, 10.0, 100.0]),
        iterations: 1,
        body_force: None,
        dt: 1e-6,
        seed: 1,
        skin: (around == Around::Nothing).then_some(SKIN),
        flow_speed: 0.0,
        threads,
        periodic: vec![true, open, open],
        walls: match around {
            Around::Nothing => Vec::new(),
            Around::Planes | Around::OwnFoot | Around::Completion | Around::Frozen => duct(edge),
            Around::Field => vec![("field".into(), vec![0.0; 11])],
        },
        fields: match around {
            Around::Field => vec![Arc::clone(
                FIELD.get_or_init(|| Arc::new(duct_field(edge / support))),
            )],
            _ => Vec::new(),
        },
        wall_model: around.model(),
        frozen: if around == Around::Frozen {
            behind_the_duct(edge)
        } else {
            Vec::new()
        },
        thermal: thermal.then(|| ThermalSettings {
            eos: if exchanges.ends_with("general") {
                ("table".into(), perfect_gas(), String::new())
            } else {
                ("ideal_gas".into(), vec![100.0, 25.0, 0.0], String::new())
            },
            boltzmann: 1.0,
            conductivity: 500.0,
            exponents: [0.7, 0.7],
            reference: 1.0,
            bookkeeping: true,
            walls: [
                ("isothermal".to_string(), vec![1.1, 0.0, 0.0, 0.0]),
                ("adiabatic".to_string(), Vec::new()),
                ("flux".to_string(), vec![1.0]),
                ("isothermal".to_string(), vec![0.9, 0.0, 0.0, 0.0]),
            ]
            .into_iter()
            .take(heat)
            .collect(),
        }),
    };
    let mut engine = Engine::new(n, &settings).unwrap();
    let positions = uniform_positions(n, 3, 5);
    let velocities = normal_velocities(n, 3, 5);
    for row in 0..n {
        let h = settings.support;
        let position = std::array::from_fn(|a| positions[3 * row + a] * edge / h);
        let velocity = std::array::from_fn(|a| velocities[3 * row + a]);
        engine.place(row, position, velocity);
    }
    if let Some(thermal) = &engine.thermal {
        let (field, heat) = (thermal.fields.heat, thermal.heat(1.0, 1.0));
        engine.particles.scalars[field].values.fill(heat);
    }
    engine.renew(true).unwrap();
    engine.run(20, 1e-6).unwrap();
    engine
}

/// s = 25 ln h - 100 ln rho, from 0.1 to 20 in both.
fn perfect_gas() -> Vec<f64> {
    let (start, step) = (0.1_f64.ln(), 200.0_f64.ln() / 7.0);
    let mut numbers = [[start, step, 8.0]; 2].concat();
    numbers.extend([0.0; 16]);
    for i in 0..8 {
        for j in 0..8 {
            let [x, y] = [i, j].map(|k| start + step * f64::from(k));
            numbers.extend([25.0 * y - 100.0 * x, -100.0, 25.0, 0.0]);
        }
    }
    numbers
}

fn allocations(engine: &mut Engine, steps: u64) -> usize {
    let before = COUNT.load(Ordering::Relaxed);
    engine.run(steps, 1e-6).unwrap();
    COUNT.load(Ordering::Relaxed) - before
}

/// Four planes along x, with corners.
fn duct(edge: f64) -> Vec<WallSettings> {
    let plane = |axis: usize, at: f64, side: f64| {
        let mut numbers = vec![0.0; 10];
        numbers[axis] = at;
        numbers[3 + axis] = side;
        ("plane".to_string(), numbers)
    };
    (1..3)
        .flat_map(|axis| [plane(axis, 0.0, 1.0), plane(axis, edge, -1.0)])
        .collect()
}

/// A lattice behind the planes of the duct.
fn behind_the_duct(edge: f64) -> Vec<[f64; 3]> {
    let axis = || (-5..17).map(|k| f64::from(k) + 0.5);
    (0..12)
        .flat_map(|x| axis().flat_map(move |y| axis().map(move |z| [f64::from(x) + 0.5, y, z])))
        .filter(|p| p[1].min(p[2]).min(edge - p[1]).min(edge - p[2]) < 0.0)
        .collect()
}

/// The same as a wall of any shape; lengths in supports.
fn duct_field(edge: f64) -> Field {
    let cell = PeriodicBox::with_walls(&[edge; 3], 1.0, &[true, false, false]).unwrap();
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(2)
        .build()
        .unwrap();
    let distance = |p: &[f64; 3]| p[1].min(p[2]).min(edge - p[1]).min(edge - p[2]);
    let mut all = |points: &[[f64; 3]]| Ok(points.iter().map(distance).collect::<Vec<f64>>());
    Field::new(&cell, 3, "lucy", Some(0.25), &mut all, &pool).unwrap()
}

/// Everything that measures inside the loop, at every step.
fn attach_correlators(engine: &mut Engine) {
    let n = engine.particles.len();
    let energy = engine.thermal.is_some();
    let vectors = vec![[1, 0, 0], [0, -2, 1]];
    let stress = StressCorrelator::new(1, 3, Parts::All, 8, 4).unwrap();
    let currents = Currents::new(1, 3, energy, vectors, 8, 4, n).unwrap();
    let heat = HeatCorrelator::new(1, 3, 8, 4).unwrap();
    engine.attach(Arc::new(Mutex::new(stress)));
    engine.attach(Arc::new(Mutex::new(currents)));
    engine.attach(Arc::new(Mutex::new(heat)));
    engine.attach(Arc::new(Mutex::new(
        Correlator::new(1, 3, 8, 4, n).unwrap(),
    )));
}

/// One test, so that nothing else allocates at the same time.
#[test]
fn a_step_allocates_nothing() {
    for (integrator, observed) in [
        ("velocity_verlet", false),
        ("pair_splitting", false),
        ("velocity_verlet:mixed", false),
        ("pair_splitting:mixed", true),
        ("velocity_verlet", true),
        ("pair_splitting", true),
        ("pair_splitting/full_variable", false),
        ("pair_splitting/full_variable", true),
        ("pair_splitting/full_general", false),
        ("pair_splitting/full_metropolis", true),
        ("velocity_verlet/full_variable", false),
        ("velocity_verlet/full_general", true),
    ] {
        for threads in [1, 2] {
            for around in [
                Around::Nothing,
                Around::Planes,
                Around::Field,
                Around::OwnFoot,
                Around::Completion,
                Around::Frozen,
            ] {
                let other = around.model().0 != "symmetric_images";
                // Refused: friction that is not symmetric there, heat for all of them.
                let refused = around == Around::OwnFoot && integrator == "pair_splitting"
                    || integrator.contains('/');
                let open_only = integrator.contains("verlet/")
                    || integrator.ends_with("metropolis")
                    || integrator.ends_with("mixed");
                let twice = integrator.contains('/') && threads == 1;
                if twice || open_only && around != Around::Nothing {
                    continue;
                }
                if other && (refused || observed || threads == 1) {
                    continue;
                }
                let mut engine = engine(integrator, threads, around);
                if observed {
                    attach_correlators(&mut engine);
                }
                let few = allocations(&mut engine, 10);
                let pruned = engine.counters.prunings;
                let many = allocations(&mut engine, 60);
                assert!(engine.counters.prunings > pruned + 5 || around != Around::Nothing);
                // Entering the pool may cost a handful per run; 50 more steps must cost nothing.
                assert!(
                    many <= few + 4,
                    "{integrator} on {threads} threads, observed: {observed}, {around:?}: {few} allocations in 10 steps, {many} in 60"
                );
            }
        }
    }
}
