//! Drag, viscous heating, heat conduction and the noise of each, for a pair of particles with
//! energies: the only place where they are formed. Positions are frozen, masses are 1, kB = 1; the
//! thermal energy of a particle is E = k T with its heat capacity k.
//!
//! Friction conserves momentum and energy: u = v_i - v_j relaxes exactly,
//!     u' = exp(-lam t) u + sqrt(s2 (1 - exp(-2 lam t))) xi,   lam = 2 g (1 - c)(a + b along e),
//!     s2 = 2 Tm/(1 - c),   Tm = 2 Ti Tj/(Ti + Tj),   c = 2 Ti Tj/(Ti + Tj)^2 / k,
//! and both take half of the kinetic energy lost. c is what keeps equipartition where k is small.
//! Heat: the first two moments of x = (E_i - E_j)/2 over the time t are exact, at any t:
//!     x' = r x + sqrt(s (1 - q) + x^2 (q - r^2)) xi,   r = exp(-th),   q = r^2 exp(-th/k),
//!     th = 4 kappa g t/k,   s = (E_i + E_j)^2/(4 (2 k + 1)).
//! A step that would leave no energy to one of them is not made: that happens at k of a few only.
//!
//! Heat capacities that differ enter by their harmonic mean alone: 2/k = 1/k_i + 1/k_j, and k T_i,
//! k T_j in the place of the energies, for an equation linear about the present temperatures.

mod links;
mod metropolis;
mod pair;
mod power;
mod rates;
#[cfg(test)]
mod tests;

use std::sync::Arc;

pub use metropolis::{friction_odds, heat_odds};
pub use pair::{Ends, FrictionDecay, HeatDecay};
pub use power::Power;
pub use rates::{PairState, ThermalRates};

/// Which exchanges there are; chosen by type, so absent ones leave no code behind.
pub trait Exchanges: Copy + Send + Sync + 'static {
    /// Name in the registry.
    const NAME: &'static str;
    /// Friction and its noise.
    const FRICTION: bool;
    /// Does friction heat, and its noise cool?
    const HEATING: bool;
    /// Conduction and its noise.
    const CONDUCTION: bool;
    /// Do the coefficients depend on the temperature?
    const VARIABLE: bool;
    /// Does the heat capacity depend on temperature and density?
    const GENERAL: bool;
    /// Are updates accepted or rejected, so that the equilibrium is exact at any step?
    const METROPOLIS: bool;
}

macro_rules! exchanges {
    ($($(#[$doc:meta])* $name:ident $key:literal: $($flag:ident)*;)*) => {
        $($(#[$doc])*
        #[derive(Debug, Clone, Copy)]
        pub struct $name;
        impl Exchanges for $name {
            const NAME: &'static str = $key;
            const FRICTION: bool = exchanges!(@has friction $($flag)*);
            const HEATING: bool = exchanges!(@has heating $($flag)*);
            const CONDUCTION: bool = exchanges!(@has conduction $($flag)*);
            const VARIABLE: bool = exchanges!(@has variable $($flag)*);
            const GENERAL: bool = exchanges!(@has general $($flag)*);
            const METROPOLIS: bool = exchanges!(@has metropolis $($flag)*);
        })*
    };
    (@has friction friction $($rest:ident)*) => { true };
    (@has heating heating $($rest:ident)*) => { true };
    (@has conduction conduction $($rest:ident)*) => { true };
    (@has variable variable $($rest:ident)*) => { true };
    (@has general general $($rest:ident)*) => { true };
    (@has metropolis metropolis $($rest:ident)*) => { true };
    (@has $flag:ident $other:ident $($rest:ident)*) => { exchanges!(@has $flag $($rest)*) };
    (@has $flag:ident) => { false };
}
exchanges! {
    /// None: particles move on adiabats.
    Adiabatic "adiabatic": ;
    /// Friction that heats, and conduction.
    Full "full": friction heating conduction;
    /// The same with coefficients that depend on the temperature.
    FullVariable "full_variable": friction heating conduction variable;
    /// The same, and with any heat capacity.
    FullGeneral "full_general": friction heating conduction variable general;
    /// The same with acceptance and rejection.
    FullMetropolis "full_metropolis": friction heating conduction variable general metropolis;
    /// Friction that heats.
    Heating "heating": friction heating;
    /// The same with coefficients that depend on the temperature.
    HeatingVariable "heating_variable": friction heating variable;
    /// The same, and with any heat capacity.
    HeatingGeneral "heating_general": friction heating variable general;
    /// The same with acceptance and rejection.
    HeatingMetropolis "heating_metropolis": friction heating variable general metropolis;
    /// Friction against a bath at the local temperature, and conduction.
    BathAndConduction "bath_conduction": friction conduction;
    /// The same with any heat capacity.
    BathAndConductionGeneral "bath_conduction_general": friction conduction variable general;
    /// Friction against a bath at the local temperature.
    Bath "bath": friction;
    /// The same with any heat capacity.
    BathGeneral "bath_general": friction variable general;
    /// Conduction alone.
    Conduction "conduction": conduction;
    /// The same with a conductivity that depends on the temperature.
    ConductionVariable "conduction_variable": conduction variable;
    /// The same, and with any heat capacity.
    ConductionGeneral "conduction_general": conduction variable general;
    /// The same with acceptance and rejection.
    ConductionMetropolis "conduction_metropolis": conduction variable general metropolis;
}

/// Coefficients of a fluid with an energy.
#[derive(Debug, Clone, PartialEq)]
pub struct PairThermal {
    /// a: friction across the line of centres.
    pub across: f64,
    /// b: along it, on top of a.
    pub along: f64,
    /// kappa/kB.
    pub conductivity: f64,
    /// k = C/kB of a particle, infinite where it is no constant.
    pub capacity: f64,
    /// (T/T_0)^n of eta and of kappa.
    pub powers: Arc<[Power; 2]>,
    /// 1/T_0 at which the coefficients have the values above.
    pub inverse_reference: f64,
    /// D.
    pub dimension: f64,
}

/// What an exchange over a time needs; fixed during a run.
#[derive(Debug, Clone)]
pub struct ThermalExchange {
    rate_across: f64,
    rate_along: f64,
    /// 4 kappa t: over a heat capacity a rate.
    heat: f64,
    /// The rate with the constant heat capacity.
    rate_heat: f64,
    /// The constant heat capacity, and what follows from it.
    constant: Ends,
    powers: Arc<[Power; 2]>,
    inverse_reference: f64,
    dimension: f64,
}

impl PairThermal {
    /// Exchange over the time `t`.
    pub fn exchange(&self, t: f64) -> ThermalExchange {
        ThermalExchange {
            rate_across: 2.0 * self.across * t,
            rate_along: 2.0 * (self.across + self.along) * t,
            heat: 4.0 * self.conductivity * t,
            rate_heat: 4.0 * self.conductivity * t / self.capacity,
            constant: Ends::new([0.0; 2], self.capacity),
            powers: Arc::clone(&self.powers),
            inverse_reference: self.inverse_reference,
            dimension: self.dimension,
        }
    }

    /// eta of a temperature over its value at the reference, and kappa of it over that and over the
    /// heat capacity.
    pub fn factors(&self, temperature: f64, capacity: f64) -> [f64; 2] {
        let relative = temperature * self.inverse_reference;
        let [eta, kappa] = [0, 1].map(|n| self.powers[n].of(relative));
        [eta, kappa / capacity]
    }
}
