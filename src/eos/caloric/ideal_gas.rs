//! An ideal gas of any gamma: P = rho R T, e = c_v T, gamma = 1 + R/c_v. With c_v = 3 R/2 and the
//! constant of Sackur and Tetrode it is the monatomic gas of Yang 2.45 to 2.49.

use super::{Cold, ConstantCapacity, Hot};

/// An ideal gas.
#[derive(Debug, Clone)]
pub struct IdealGas {
    /// R `[energy/(mass temperature)]`: kB over the mass of a molecule.
    pub gas_constant: f64,
    /// c_v.
    pub heat_capacity: f64,
    /// Entropy per mass at T = 1 and rho = 1.
    pub entropy_constant: f64,
}

impl ConstantCapacity for IdealGas {
    fn heat_capacity(&self) -> f64 {
        self.heat_capacity
    }
    fn cold(&self, _: f64) -> Cold {
        Cold {
            pressure: 0.0,
            slope: 0.0,
            energy: 0.0,
        }
    }
    fn hot(&self, rho: f64) -> Hot {
        Hot {
            pressure: self.gas_constant * rho,
            slope: self.gas_constant,
            entropy: self.entropy_constant - self.gas_constant * rho.ln(),
        }
    }
}
