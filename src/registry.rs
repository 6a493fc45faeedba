//! The one table of what can be combined. It turns names into compiled loops, lists them for tests
//! and docs, and words the error where a combination does not exist.

use crate::error::{Error, Result};
use crate::integrator::{
    Integrator, PairSplitting, ThermalSplitting, ThermalVerlet, VelocityVerlet,
};
use crate::kernel::{Kernel, Lucy, QuinticSpline, WendlandC2, WendlandC4};
use crate::physics::{
    Adiabatic, Bath, BathAndConduction, BathAndConductionGeneral, BathGeneral, Central, Conduction,
    ConductionGeneral, ConductionMetropolis, ConductionVariable, Exchanges, FrictionForm,
    Frictionless, Full, FullGeneral, FullMetropolis, FullVariable, General, Heating,
    HeatingGeneral, HeatingMetropolis, HeatingVariable,
};
use crate::random::{Gaussian, Silent, Uniform, Variate};
use crate::sweep::{Double, Mixed, Precision};

/// Dimensions.
pub const DIMENSIONS: [usize; 2] = [2, 3];
/// Kernels.
pub const KERNELS: [&str; 4] = [
    Lucy::NAME,
    QuinticSpline::NAME,
    WendlandC2::NAME,
    WendlandC4::NAME,
];
/// Forms of friction.
pub const FRICTIONS: [&str; 3] = [Frictionless::NAME, General::NAME, Central::NAME];
/// Noise variates.
pub const NOISES: [&str; 3] = [Silent::NAME, Gaussian::NAME, Uniform::NAME];
/// Integrators.
pub const INTEGRATORS: [&str; 2] = ["velocity_verlet", "pair_splitting"];

/// Precision in which pairs are worked off.
pub const PRECISIONS: [&str; 2] = [Double::NAME, Mixed::NAME];

/// What exchanges energy between the particles of a fluid that is not isothermal; the first: it is.
pub const EXCHANGES: [&str; 18] = [
    "none",
    Adiabatic::NAME,
    Full::NAME,
    FullVariable::NAME,
    FullGeneral::NAME,
    FullMetropolis::NAME,
    Heating::NAME,
    HeatingVariable::NAME,
    HeatingGeneral::NAME,
    HeatingMetropolis::NAME,
    BathAndConduction::NAME,
    BathAndConductionGeneral::NAME,
    Bath::NAME,
    BathGeneral::NAME,
    Conduction::NAME,
    ConductionVariable::NAME,
    ConductionGeneral::NAME,
    ConductionMetropolis::NAME,
];

/// Those without friction.
const WITHOUT_FRICTION: [&str; 5] = [
    Adiabatic::NAME,
    Conduction::NAME,
    ConductionVariable::NAME,
    ConductionGeneral::NAME,
    ConductionMetropolis::NAME,
];

/// One supported combination, or a wish for one.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Combination {
    /// D.
    pub dimension: usize,
    /// One of [`KERNELS`].
    pub kernel: String,
    /// One of [`FRICTIONS`].
    pub friction: String,
    /// One of [`NOISES`].
    pub noise: String,
    /// One of [`INTEGRATORS`].
    pub integrator: String,
    /// What exchanges energy: one of [`EXCHANGES`], "none" for an isothermal fluid.
    pub exchanges: String,
    /// One of [`PRECISIONS`].
    pub precision: String,
}

impl Combination {
    /// Why the combination makes no sense, if it makes none.
    fn objection(&self) -> Option<String> {
        let one_of = |name: &str, value: &str, choices: &[&str]| {
            (!choices.contains(&value))
                .then(|| format!("`{name}` must be one of {choices:?}, got {value:?}"))
        };
        if !DIMENSIONS.contains(&self.dimension) {
            return Some(format!(
                "`dimension` must be one of {DIMENSIONS:?}, got {}",
                self.dimension
            ));
        }
        one_of("kernel", &self.kernel, &KERNELS)
            .or_else(|| one_of("friction", &self.friction, &FRICTIONS))
            .or_else(|| one_of("noise", &self.noise, &NOISES))
            .or_else(|| one_of("integrator", &self.integrator, &INTEGRATORS))
            .or_else(|| one_of("exchanges", &self.exchanges, &EXCHANGES))
            .or_else(|| one_of("precision", &self.precision, &PRECISIONS))
            .or_else(|| self.mismatch())
            .or_else(|| {
                (self.integrator == "pair_splitting" && self.noise == "uniform").then(|| {
                    "`noise` must be \"gaussian\" or \"none\" with the integrator \"pair_splitting\" (uniform variates do not keep a Maxwell distribution at large dt), got \"uniform\"".to_string()
                })
            })
    }

    /// Names that are right each by itself, but not together.
    fn mismatch(&self) -> Option<String> {
        if self.exchanges == "none" {
            return (self.friction == "none" && self.noise != "none").then(|| {
                format!(
                    "`noise` must be \"none\" where `friction` is \"none\" (there is nothing to balance it), got {:?}",
                    self.noise
                )
            });
        }
        if self.precision != Double::NAME {
            return Some(format!(
                "`precision` must be \"double\" for a fluid with an energy (its books close to rounding), got {:?}",
                self.precision
            ));
        }
        let metropolis = self.exchanges.ends_with("metropolis");
        if metropolis && self.integrator != "pair_splitting" {
            return Some(format!(
                "`integrator` must be \"pair_splitting\" where exchanges are accepted or rejected, got {:?}",
                self.integrator
            ));
        }
        let frictionless = WITHOUT_FRICTION.contains(&self.exchanges.as_str());
        if frictionless != (self.friction == "none") {
            return Some(format!(
                "`exchanges` must be one of {WITHOUT_FRICTION:?} where `friction` is \"none\", and only there, got {:?} and {:?}",
                self.exchanges, self.friction
            ));
        }
        if self.exchanges == Adiabatic::NAME && self.noise != "none" {
            return Some("`noise` must be \"none\" where nothing is exchanged".to_string());
        }
        (metropolis && self.noise == "none").then(|| {
            "`exchanges` must not be accepted or rejected where there is no noise".to_string()
        })
    }
}

/// All supported combinations.
pub fn combinations() -> Vec<Combination> {
    let mut all = Vec::new();
    for dimension in DIMENSIONS {
        for kernel in KERNELS {
            for friction in FRICTIONS {
                for noise in NOISES {
                    for integrator in INTEGRATORS {
                        for precision in PRECISIONS {
                            all.extend(EXCHANGES.map(|exchanges| Combination {
                                dimension,
                                kernel: kernel.into(),
                                friction: friction.into(),
                                noise: noise.into(),
                                integrator: integrator.into(),
                                exchanges: exchanges.into(),
                                precision: precision.into(),
                            }));
                        }
                    }
                }
            }
        }
    }
    all.retain(|c| c.objection().is_none());
    all
}

/// The compiled loop of a combination.
pub fn build(wish: &Combination, iterations: u32) -> Result<Box<dyn Integrator>> {
    if let Some(objection) = wish.objection() {
        return Err(Error::Invalid(objection));
    }
    Ok(match (wish.exchanges.as_str(), wish.dimension) {
        ("none", 2) => with_precision::<2>(wish, iterations),
        ("none", _) => with_precision::<3>(wish, iterations),
        (_, 2) => with_exchanges::<2>(wish),
        _ => with_exchanges::<3>(wish),
    })
}

fn with_exchanges<const D: usize>(wish: &Combination) -> Box<dyn Integrator> {
    match wish.exchanges.as_str() {
        Adiabatic::NAME => with_scheme::<Adiabatic, Silent, D>(wish),
        Full::NAME => thermal_with_noise::<Full, D>(wish),
        FullVariable::NAME => thermal_with_noise::<FullVariable, D>(wish),
        FullGeneral::NAME => general::<FullGeneral, FullVariable, D>(wish),
        FullMetropolis::NAME => splitting::<FullMetropolis, Gaussian, D>(wish),
        Heating::NAME => thermal_with_noise::<Heating, D>(wish),
        HeatingVariable::NAME => thermal_with_noise::<HeatingVariable, D>(wish),
        HeatingGeneral::NAME => general::<HeatingGeneral, HeatingVariable, D>(wish),
        HeatingMetropolis::NAME => splitting::<HeatingMetropolis, Gaussian, D>(wish),
        BathAndConduction::NAME => thermal_with_noise::<BathAndConduction, D>(wish),
        BathAndConductionGeneral::NAME => {
            general::<BathAndConductionGeneral, BathAndConduction, D>(wish)
        }
        Bath::NAME => thermal_with_noise::<Bath, D>(wish),
        BathGeneral::NAME => general::<BathGeneral, Bath, D>(wish),
        Conduction::NAME => thermal_with_noise::<Conduction, D>(wish),
        ConductionVariable::NAME => thermal_with_noise::<ConductionVariable, D>(wish),
        ConductionGeneral::NAME => general::<ConductionGeneral, ConductionVariable, D>(wish),
        _ => splitting::<ConductionMetropolis, Gaussian, D>(wish),
    }
}

fn thermal_with_noise<X: Exchanges, const D: usize>(wish: &Combination) -> Box<dyn Integrator> {
    match wish.noise.as_str() {
        Silent::NAME => with_scheme::<X, Silent, D>(wish),
        Gaussian::NAME => with_scheme::<X, Gaussian, D>(wish),
        _ => verlet::<X, Uniform, D>(wish),
    }
}

/// With any heat capacity. Velocity Verlet asks each particle for its own in any case: Y, without
/// that, serves it as well.
fn general<X: Exchanges, Y: Exchanges, const D: usize>(wish: &Combination) -> Box<dyn Integrator> {
    match (wish.integrator.as_str(), wish.noise.as_str()) {
        ("velocity_verlet", _) => thermal_with_noise::<Y, D>(wish),
        (_, Silent::NAME) => splitting::<X, Silent, D>(wish),
        _ => splitting::<X, Gaussian, D>(wish),
    }
}

fn with_scheme<X: Exchanges, V: Variate, const D: usize>(
    wish: &Combination,
) -> Box<dyn Integrator> {
    match wish.integrator.as_str() {
        "velocity_verlet" => verlet::<X, V, D>(wish),
        _ => splitting::<X, V, D>(wish),
    }
}

/// A thermal integrator with the sweeps of a kernel. Kernel and form of friction are no types of its
/// loop: one compiled loop serves all of them.
macro_rules! with_sweeps {
    ($scheme:ident, $wish:expr) => {
        match ($wish.kernel.as_str(), $wish.friction.as_str()) {
            (Lucy::NAME, friction) => with_sweeps!($scheme, Lucy, friction),
            (QuinticSpline::NAME, friction) => with_sweeps!($scheme, QuinticSpline, friction),
            (WendlandC2::NAME, friction) => with_sweeps!($scheme, WendlandC2, friction),
            (_, friction) => with_sweeps!($scheme, WendlandC4, friction),
        }
    };
    ($scheme:ident, $kernel:ident, $friction:ident) => {
        match $friction {
            General::NAME => $scheme::new::<$kernel, General>(),
            Central::NAME => $scheme::new::<$kernel, Central>(),
            _ => $scheme::new::<$kernel, Frictionless>(),
        }
    };
}

fn splitting<X: Exchanges, V: Variate, const D: usize>(wish: &Combination) -> Box<dyn Integrator> {
    let made: ThermalSplitting<X, V, D> = with_sweeps!(ThermalSplitting, wish);
    Box::new(made)
}

fn verlet<X: Exchanges, V: Variate, const D: usize>(wish: &Combination) -> Box<dyn Integrator> {
    let made: ThermalVerlet<X, V, D> = with_sweeps!(ThermalVerlet, wish);
    Box::new(made)
}

fn with_precision<const D: usize>(wish: &Combination, iterations: u32) -> Box<dyn Integrator> {
    match wish.precision.as_str() {
        Double::NAME => with_kernel::<Double, D>(wish, iterations),
        _ => with_kernel::<Mixed, D>(wish, iterations),
    }
}

fn with_kernel<P: Precision, const D: usize>(wish: &Combination, n: u32) -> Box<dyn Integrator> {
    match wish.kernel.as_str() {
        Lucy::NAME => with_pair::<Lucy, P, D>(wish, n),
        QuinticSpline::NAME => with_pair::<QuinticSpline, P, D>(wish, n),
        WendlandC2::NAME => with_pair::<WendlandC2, P, D>(wish, n),
        _ => with_pair::<WendlandC4, P, D>(wish, n),
    }
}

fn with_pair<K: Kernel, P: Precision, const D: usize>(
    wish: &Combination,
    n: u32,
) -> Box<dyn Integrator> {
    match wish.friction.as_str() {
        General::NAME => with_noise::<K, General, P, D>(wish, n),
        Central::NAME => with_noise::<K, Central, P, D>(wish, n),
        _ => with_integrator::<K, Frictionless, Silent, P, D>(wish, n),
    }
}

fn with_noise<K: Kernel, F: FrictionForm, P: Precision, const D: usize>(
    wish: &Combination,
    n: u32,
) -> Box<dyn Integrator> {
    match wish.noise.as_str() {
        Silent::NAME => with_integrator::<K, F, Silent, P, D>(wish, n),
        Gaussian::NAME => with_integrator::<K, F, Gaussian, P, D>(wish, n),
        _ => Box::new(VelocityVerlet::<K, F, Uniform, P, D>::new(n)),
    }
}

fn with_integrator<K: Kernel, F: FrictionForm, V: Variate, P: Precision, const D: usize>(
    wish: &Combination,
    iterations: u32,
) -> Box<dyn Integrator> {
    match wish.integrator.as_str() {
        "velocity_verlet" => Box::new(VelocityVerlet::<K, F, V, P, D>::new(iterations)),
        _ => Box::new(PairSplitting::<K, F, V, P, D>::default()),
    }
}
