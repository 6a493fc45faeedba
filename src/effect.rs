//! Body forces: acceleration fields that act on every particle.

use crate::domain::PeriodicBox;

/// An acceleration field in the user's units: amplitude by component, and (axis, whole waves) if it
/// varies as a sine along an axis.
pub type AccelerationField = (Vec<f64>, Option<(usize, u32)>);

/// An acceleration field, in reduced units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum BodyForce {
    /// None: costs nothing.
    None,
    /// The same acceleration everywhere.
    Uniform([f64; 3]),
    /// amplitude * sin(2 pi waves x_axis / L_axis): the driving of Kolmogorov flow.
    Sinusoidal {
        /// Acceleration at the crests.
        amplitude: [f64; 3],
        /// Axis along which it varies.
        axis: usize,
        /// Whole waves in the box.
        waves: u32,
    },
}

impl BodyForce {
    /// Acceleration at a position.
    pub fn at(&self, position: &[f64; 4], cell: &PeriodicBox) -> [f64; 3] {
        match *self {
            Self::None => [0.0; 3],
            Self::Uniform(acceleration) => acceleration,
            Self::Sinusoidal {
                amplitude,
                axis,
                waves,
            } => {
                let phase = position[axis] * cell.inverse[axis] * f64::from(waves);
                let sine = (std::f64::consts::TAU * phase).sin();
                amplitude.map(|a| a * sine)
            }
        }
    }
}
