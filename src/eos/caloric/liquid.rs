//! A liquid around its rest state: P = P_0(rho) + (alpha/kappa_T)(T - T_0) with the isotherm P_0 of
//! any barotropic equation of state. To second order in volume and entropy it is the expansion of
//! E(N, V, S) with given c_v, kappa_T and alpha; beyond that T stays positive and c_v constant.

use super::super::EquationOfState;
use super::{Cold, ConstantCapacity, Hot};

/// A liquid.
pub struct Liquid {
    /// c_v.
    pub heat_capacity: f64,
    /// alpha/kappa_T = dP/dT at constant volume `[pressure/temperature]`; 0: P is that of the
    /// isotherm at every temperature.
    pub pressure_coefficient: f64,
    /// T_0 of the isotherm.
    pub temperature: f64,
    /// P at T_0.
    pub isotherm: Box<dyn EquationOfState>,
}

impl ConstantCapacity for Liquid {
    fn heat_capacity(&self) -> f64 {
        self.heat_capacity
    }
    fn cold(&self, rho: f64) -> Cold {
        let shift = self.pressure_coefficient * self.temperature;
        Cold {
            pressure: self.isotherm.pressure(rho) - shift,
            slope: self.isotherm.sound_speed_squared(rho),
            energy: self.isotherm.specific_potential(rho) + shift / rho,
        }
    }
    fn hot(&self, rho: f64) -> Hot {
        Hot {
            pressure: self.pressure_coefficient,
            slope: 0.0,
            entropy: self.pressure_coefficient / rho,
        }
    }
}
