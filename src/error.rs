//! The one error type of the core. Failure is a value: nothing here panics on bad input.

use thiserror::Error;

/// Everything that can go wrong between building a simulation and finishing a run.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum Error {
    /// An argument is out of range; the text names it, what was expected and what came.
    #[error("{0}")]
    Invalid(String),
    /// A particle's state is no longer a number.
    #[error("step {step}: {quantity} of particle {id} is not finite")]
    NotFinite {
        /// Step in which it was seen.
        step: u64,
        /// Persistent id of the particle.
        id: u64,
        /// Which quantity.
        quantity: &'static str,
    },
    /// A particle moved so far in one step that the neighbour lists mean nothing.
    #[error(
        "step {step}: particle {id} moved {displacement:.3} supports in one step (at most {limit} make sense)"
    )]
    Runaway {
        /// Step in which it was seen.
        step: u64,
        /// Persistent id of the particle.
        id: u64,
        /// Displacement in one step, in units of the support.
        displacement: f64,
        /// The limit, in units of the support.
        limit: f64,
    },
    /// A particle is behind a wall, or outside of a box that is not periodic.
    #[error("step {step}: particle {id} at ({place}) has left the fluid: {wall}")]
    Escaped {
        /// Step in which it was seen.
        step: u64,
        /// Persistent id of the particle.
        id: u64,
        /// Where it is, in the user's units.
        place: String,
        /// Behind which wall, and how far.
        wall: String,
    },
}

/// Result with the core's error.
pub type Result<T> = std::result::Result<T, Error>;
