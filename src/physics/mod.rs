//! The physics of a pair: friction coefficients in, drag and noise out.

mod friction;
mod thermal;

pub use friction::{
    Central, Exchange, FrictionForm, Frictionless, General, Kick, LinkAxes, LinkTerms,
    PairFriction, WallGrip,
};
pub use thermal::{
    Adiabatic, Bath, BathAndConduction, BathAndConductionGeneral, BathGeneral, Conduction,
    ConductionGeneral, ConductionMetropolis, ConductionVariable, Ends, Exchanges, FrictionDecay,
    Full, FullGeneral, FullMetropolis, FullVariable, HeatDecay, Heating, HeatingGeneral,
    HeatingMetropolis, HeatingVariable, PairState, PairThermal, Power, ThermalExchange,
    ThermalRates, friction_odds, heat_odds,
};
