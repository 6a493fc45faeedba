//! Caloric equations of state: fluids with an energy, in the user's units. Their state is a density and
//! a thermal energy per mass, the "heat" h: the energy is e = e_c(rho) + h.
//!
//! Where the heat capacity is a constant, h = c_v T, and pressure and energy are linear in T:
//!     P = p_c(rho) + T p_T(rho),   e = e_c(rho) + c_v T,   s = c_v ln T + s_c(rho),
//! per mass. Thermodynamics asks for de_c/drho = p_c/rho^2 and ds_c/drho = -p_T/rho^2; then
//! E(N, V, S) of a particle exists, and -dE/dV = P, dE/dS = T. Any other E(N, V, S) is a `Table`.
//!
//! To add one: a file with the two parts below (or all of `Caloric`), and a row in `build`.

mod ideal_gas;
mod liquid;
mod table;

pub use ideal_gas::IdealGas;
pub use liquid::Liquid;
pub use table::Table;

use super::expect;
use crate::error::{Error, Result};
use crate::real::ln;
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
pub trait ConstantCapacity: Send + Sync {
    /// c_v `[energy/(mass temperature)]`.
    fn heat_capacity(&self) -> f64;
    /// What does not depend on T.
    fn cold(&self, rho: f64) -> Cold;
    /// What goes with T.
    fn hot(&self, rho: f64) -> Hot;
}

/// A fluid with an energy.
pub trait Caloric: Send + Sync {
    /// c_v `[energy/(mass temperature)]`, if it is a constant: temperatures are then h/c_v.
    fn constant_heat_capacity(&self) -> Option<f64>;
    /// e_c: energy per mass without heat, up to a constant.
    fn cold_energy(&self, rho: f64) -> f64;
    /// What a density is to `state_at`, which is asked for every pair: itself, if nothing is gained by
    /// another number.
    fn mark(&self, rho: f64) -> f64 {
        rho
    }
    /// T and c_v at a mark.
    fn state_at(&self, mark: f64, heat: f64) -> [f64; 2];
    /// T and c_v.
    fn temperature_and_capacity(&self, rho: f64, heat: f64) -> [f64; 2] {
        self.state_at(self.mark(rho), heat)
    }
    /// The entropy per mass at a mark, up to what depends on the density.
    fn entropy_at(&self, mark: f64, heat: f64) -> f64;
    /// P.
    fn pressure(&self, rho: f64, heat: f64) -> f64;
    /// Entropy per mass.
    fn entropy(&self, rho: f64, heat: f64) -> f64;
    /// Heat of a temperature.
    fn heat(&self, rho: f64, temperature: f64) -> f64;
    /// Heat of an entropy per mass; `guess` is not far from it.
    fn heat_at_entropy(&self, rho: f64, entropy: f64, guess: f64) -> f64;
    /// dP/drho at constant temperature, and at constant entropy, which is the square of the speed of
    /// sound.
    fn slopes(&self, rho: f64, heat: f64) -> [f64; 2];
}

impl<F: ConstantCapacity> Caloric for F {
    fn constant_heat_capacity(&self) -> Option<f64> {
        Some(self.heat_capacity())
    }
    fn cold_energy(&self, rho: f64) -> f64 {
        self.cold(rho).energy
    }
    fn state_at(&self, _: f64, heat: f64) -> [f64; 2] {
        [heat / self.heat_capacity(), self.heat_capacity()]
    }
    fn entropy_at(&self, _: f64, heat: f64) -> f64 {
        self.heat_capacity() * ln(heat)
    }
    fn pressure(&self, rho: f64, heat: f64) -> f64 {
        self.cold(rho).pressure + heat / self.heat_capacity() * self.hot(rho).pressure
    }
    fn entropy(&self, rho: f64, heat: f64) -> f64 {
        self.heat_capacity() * (heat / self.heat_capacity()).ln() + self.hot(rho).entropy
    }
    fn heat(&self, _: f64, temperature: f64) -> f64 {
        self.heat_capacity() * temperature
    }
    fn heat_at_entropy(&self, rho: f64, entropy: f64, _: f64) -> f64 {
        let capacity = self.heat_capacity();
        capacity * ((entropy - self.hot(rho).entropy) / capacity).exp()
    }
    fn slopes(&self, rho: f64, heat: f64) -> [f64; 2] {
        let (capacity, hot) = (self.heat_capacity(), self.hot(rho));
        let (temperature, work) = (heat / capacity, hot.pressure / rho);
        let isothermal = self.cold(rho).slope + temperature * hot.slope;
        [
            isothermal,
            isothermal + temperature * work * work / capacity,
        ]
    }
}

/// Names of all caloric equations of state.
pub const CALORIC: [&str; 3] = ["ideal_gas", "liquid", "table"];

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
        "table" => Box::new(Table::new(p)?),
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
            build("table", &table::tests::sample(), "").unwrap(),
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
                    let heat = eos.heat(rho, t);
                    let [temperature, capacity] = eos.temperature_and_capacity(rho, heat);
                    assert!((temperature - t).abs() < 1e-12);
                    let ds = slope(&|h| eos.entropy(rho, h), heat);
                    assert!((t * ds - 1.0).abs() < 1e-8);
                    let dh = slope(&|t| eos.heat(rho, t), t);
                    assert!((dh - capacity).abs() < 1e-7 * dh);
                    let s = eos.entropy(rho, heat);
                    let adiabat = |rho: f64| eos.heat_at_entropy(rho, s, heat);
                    assert!((adiabat(rho) - heat).abs() < 1e-12 * heat);
                    let energy = |rho: f64| eos.cold_energy(rho) + adiabat(rho);
                    let p = eos.pressure(rho, heat);
                    assert!((slope(&energy, rho) * rho * rho - p).abs() < 1e-7 * (1.0 + p.abs()));
                    let [isothermal, adiabatic] = eos.slopes(rho, heat);
                    let c2 = slope(&|rho| eos.pressure(rho, adiabat(rho)), rho);
                    assert!((c2 - adiabatic).abs() < 1e-6 * adiabatic.abs());
                    let c2 = slope(&|rho| eos.pressure(rho, eos.heat(rho, t)), rho);
                    assert!((c2 - isothermal).abs() < 1e-6 * (1.0 + isothermal.abs()));
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
