//! Caloric equations of state: fluids with an energy, in the user's units.
//!
//! All of them have a constant heat capacity, so pressure and energy are linear in the temperature:
//!     P = p_c(rho) + T p_T(rho),   e = e_c(rho) + c_v T,   s = c_v ln T + s_c(rho),
//! per mass. Thermodynamics asks for de_c/drho = p_c/rho^2 and ds_c/drho = -p_T/rho^2; then
//! E(N, V, S) of a particle exists, and -dE/dV = P, dE/dS = T.
//!
//! To add one: a file with the two parts below, and a row in `build`.

mod ideal_gas;
mod liquid;

pub use ideal_gas::IdealGas;
pub use liquid::Liquid;

use super::expect;
use crate::error::{Error, Result};
use crate::valid::positive;

/// The part of the equation of state without T.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cold {
    /// p_c.
    pub pressure: f64,
    /// dp_c/drho.
    pub slope: f64,
    /// e_c, up to a constant.
    pub energy: f64,
}

/// The part that goes with T.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hot {
    /// p_T = dP/dT at constant density.
    pub pressure: f64,
    /// dp_T/drho.
    pub slope: f64,
    /// s_c.
    pub entropy: f64,
}

/// A fluid with an energy and a constant heat capacity.
pub trait Caloric: Send + Sync {
    /// c_v `[energy/(mass temperature)]`.
    fn heat_capacity(&self) -> f64;
    /// What does not depend on T.
    fn cold(&self, rho: f64) -> Cold;
    /// What goes with T.
    fn hot(&self, rho: f64) -> Hot;

    /// P.
    fn pressure(&self, rho: f64, temperature: f64) -> f64 {
        self.cold(rho).pressure + temperature * self.hot(rho).pressure
    }
    /// Energy per mass.
    fn energy(&self, rho: f64, temperature: f64) -> f64 {
        self.cold(rho).energy + self.heat_capacity() * temperature
    }
    /// Entropy per mass.
    fn entropy(&self, rho: f64, temperature: f64) -> f64 {
        self.heat_capacity() * temperature.ln() + self.hot(rho).entropy
    }
    /// Temperature at which the entropy per mass is `entropy`.
    fn temperature(&self, rho: f64, entropy: f64) -> f64 {
        ((entropy - self.hot(rho).entropy) / self.heat_capacity()).exp()
    }
    /// dP/drho at constant temperature.
    fn isothermal_slope(&self, rho: f64, temperature: f64) -> f64 {
        self.cold(rho).slope + temperature * self.hot(rho).slope
    }
    /// dP/drho at constant entropy, the square of the speed of sound.
    fn adiabatic_slope(&self, rho: f64, temperature: f64) -> f64 {
        let hot = self.hot(rho);
        let work = hot.pressure / rho;
        self.cold(rho).slope + temperature * (hot.slope + work * work / self.heat_capacity())
    }
}

/// Names of all caloric equations of state.
pub const CALORIC: [&str; 2] = ["ideal_gas", "liquid"];

/// The caloric equation of state of a name and its parameters; that of a liquid goes on with those
/// of its isotherm.
pub fn build(kind: &str, parameters: &[f64], isotherm: &str) -> Result<Box<dyn Caloric>> {
    let p = parameters;
    Ok(match kind {
        "ideal_gas" => {
            expect(
                kind,
                p,
                &["gas_constant", "heat_capacity", "entropy_constant"],
            )?;
            Box::new(IdealGas {
                gas_constant: positive("gas_constant", p[0])?,
                heat_capacity: positive("heat_capacity", p[1])?,
                entropy_constant: p[2],
            })
        }
        "liquid" => {
            let names = ["heat_capacity", "pressure_coefficient", "temperature"];
            expect(kind, &p[..p.len().min(3)], &names)?;
            Box::new(Liquid {
                heat_capacity: positive("heat_capacity", p[0])?,
                pressure_coefficient: p[1],
                temperature: positive("temperature", p[2])?,
                isotherm: super::build(isotherm, &p[3..])?,
            })
        }
        other => {
            return Err(Error::Invalid(format!(
                "`caloric` must be one of {CALORIC:?}, got {other:?}"
            )));
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn all() -> Vec<Box<dyn Caloric>> {
        vec![
            build("ideal_gas", &[0.7, 1.75, 0.3], "").unwrap(),
            build("liquid", &[4.0, 0.6, 1.2, 1.0, 3.0, 7.0, 0.4], "tait").unwrap(),
            build(
                "liquid",
                &[4.0, -0.2, 0.9, 1.0, 3.0],
                "artificial_compressibility",
            )
            .unwrap(),
        ]
    }

    /// de = T ds + P/rho^2 drho, by finite differences along both axes; c^2 along an adiabat.
    #[test]
    fn thermodynamics_is_consistent() {
        let step = 1e-5;
        for eos in all() {
            for rho in [0.7, 1.0, 1.4] {
                for t in [0.5, 1.0, 2.3] {
                    let slope =
                        |f: &dyn Fn(f64) -> f64, x: f64| (f(x + step) - f(x - step)) / (2.0 * step);
                    let de = slope(&|t| eos.energy(rho, t), t);
                    let ds = slope(&|t| eos.entropy(rho, t), t);
                    assert!((de - t * ds).abs() < 1e-8 * de);
                    let s = eos.entropy(rho, t);
                    let adiabat = |rho: f64| eos.temperature(rho, s);
                    assert!((adiabat(rho) - t).abs() < 1e-12);
                    let de = slope(&|rho| eos.energy(rho, adiabat(rho)), rho);
                    let p = eos.pressure(rho, t);
                    assert!((de * rho * rho - p).abs() < 1e-7 * (1.0 + p.abs()));
                    let c2 = slope(&|rho| eos.pressure(rho, adiabat(rho)), rho);
                    let exact = eos.adiabatic_slope(rho, t);
                    assert!((c2 - exact).abs() < 1e-6 * exact.abs());
                    let slow = slope(&|rho| eos.pressure(rho, t), rho);
                    let exact = eos.isothermal_slope(rho, t);
                    assert!((slow - exact).abs() < 1e-6 * (1.0 + exact.abs()));
                }
            }
        }
    }

    #[test]
    fn bad_parameters_are_named() {
        let message = |kind: &str, p: &[f64]| build(kind, p, "linear").err().unwrap().to_string();
        assert!(message("ideal_gas", &[1.0, -1.0, 0.0]).contains("`heat_capacity`"));
        assert!(message("liquid", &[1.0]).contains("takes the parameters"));
        assert!(
            message("liquid", &[1.0, 0.1, 1.0, -1.0, 1.0, 0.0]).contains("`reference_density`")
        );
        assert!(message("vinegar", &[]).contains("`caloric` must be one of"));
    }
}
