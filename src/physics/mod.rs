//! The physics of a pair: friction coefficients in, drag and noise out.

mod friction;
mod thermal;
mod thermal_rates;

pub use friction::{
    Central, Exchange, FrictionForm, Frictionless, General, Kick, LinkAxes, LinkTerms,
    PairFriction, WallGrip,
};
pub use thermal::{
    Adiabatic, Bath, BathAndConduction, Conduction, ConductionVariable, Exchanges, FrictionDecay,
    Full, FullVariable, HeatDecay, Heating, HeatingVariable, PairThermal, ThermalExchange,
};
pub use thermal_rates::{PairState, ThermalRates};
