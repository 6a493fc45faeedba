//! The physics of a pair: friction coefficients in, drag and noise out.

mod friction;

pub use friction::{
    Central, Exchange, FrictionForm, Frictionless, General, Kick, LinkAxes, LinkTerms,
    PairFriction, WallGrip,
};
