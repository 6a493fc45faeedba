//! Equations of state P(rho) of the isothermal fluid, in the user's units. They are evaluated once
//! per particle and step, so they are objects, not types: a virtual call per block of particles.

mod analytic;
pub mod caloric;
mod table;

pub use analytic::{ArtificialCompressibility, IdealGas, Linear, Polynomial, Tait};
pub use table::Table;

use crate::error::{Error, Result};
use crate::valid::{finite, positive};

/// A barotropic equation of state.
pub trait EquationOfState: Send + Sync {
    /// Pressure at mass density `rho`.
    fn pressure(&self, rho: f64) -> f64;
    /// dP/d rho, the isothermal sound speed squared.
    fn sound_speed_squared(&self, rho: f64) -> f64;
    /// e(rho) = int P/rho^2 d rho, potential energy per mass up to a constant: the conservative
    /// force of SDPD is minus the gradient of sum m e(rho_i).
    fn specific_potential(&self, rho: f64) -> f64;
}

fn expect(kind: &str, parameters: &[f64], names: &[&str]) -> Result<()> {
    if parameters.len() != names.len() {
        return Err(Error::Invalid(format!(
            "`eos` {kind:?} takes the parameters {names:?}, got {} numbers",
            parameters.len()
        )));
    }
    for (name, &value) in names.iter().zip(parameters) {
        finite(name, value)?;
    }
    Ok(())
}

/// Names of all equations of state.
pub const KINDS: [&str; 6] = [
    "artificial_compressibility",
    "linear",
    "tait",
    "ideal_gas",
    "polynomial",
    "table",
];

/// The equation of state of a name and its parameters.
pub fn build(kind: &str, parameters: &[f64]) -> Result<Box<dyn EquationOfState>> {
    let p = parameters;
    Ok(match kind {
        "artificial_compressibility" => {
            expect(kind, p, &["reference_density", "sound_speed"])?;
            Box::new(ArtificialCompressibility {
                reference_density: positive("reference_density", p[0])?,
                sound_speed: positive("sound_speed", p[1])?,
            })
        }
        "linear" => {
            expect(
                kind,
                p,
                &["reference_density", "sound_speed", "reference_pressure"],
            )?;
            Box::new(Linear {
                reference_density: positive("reference_density", p[0])?,
                sound_speed: positive("sound_speed", p[1])?,
                reference_pressure: p[2],
            })
        }
        "tait" => {
            expect(
                kind,
                p,
                &[
                    "reference_density",
                    "sound_speed",
                    "exponent",
                    "background_pressure",
                ],
            )?;
            if p[2] <= 1.0 {
                return Err(Error::Invalid(format!(
                    "`exponent` must be > 1, got {}",
                    p[2]
                )));
            }
            Box::new(Tait::new(
                positive("reference_density", p[0])?,
                positive("sound_speed", p[1])?,
                p[2],
                p[3],
            ))
        }
        "ideal_gas" => {
            expect(kind, p, &["sound_speed"])?;
            Box::new(IdealGas {
                sound_speed: positive("sound_speed", p[0])?,
            })
        }
        "polynomial" => {
            if p.is_empty() {
                return Err(Error::Invalid(
                    "`coefficients` must hold at least one number, got none".into(),
                ));
            }
            for &value in p {
                finite("coefficients", value)?;
            }
            Box::new(Polynomial {
                coefficients: p.to_vec(),
            })
        }
        "table" => Box::new(Table::new(p)?),
        other => {
            return Err(Error::Invalid(format!(
                "`eos` must be one of {KINDS:?}, got {other:?}"
            )));
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn all() -> Vec<Box<dyn EquationOfState>> {
        [
            ("artificial_compressibility", vec![1.0, 3.0]),
            ("linear", vec![1.0, 3.0, 0.5]),
            ("tait", vec![1.0, 3.0, 7.0, 0.4]),
            ("ideal_gas", vec![3.0]),
            ("polynomial", vec![0.1, 1.0, -0.3, 2.0]),
            (
                "table",
                vec![0.5, 0.8, 1.0, 1.3, 2.0, 0.1, 0.7, 1.0, 1.1, 4.0],
            ),
        ]
        .iter()
        .map(|(kind, p)| build(kind, p).unwrap())
        .collect()
    }

    #[test]
    fn derivatives_agree_with_finite_differences() {
        for eos in all() {
            for k in 0..60 {
                let rho = 0.42 + 0.03 * k as f64;
                let step = 1e-5;
                let slope = (eos.pressure(rho + step) - eos.pressure(rho - step)) / (2.0 * step);
                let c2 = eos.sound_speed_squared(rho);
                assert!((slope - c2).abs() < 3e-4 * (1.0 + c2), "{rho} {slope} {c2}");
                let pull = (eos.specific_potential(rho + step)
                    - eos.specific_potential(rho - step))
                    / (2.0 * step);
                assert!((pull * rho * rho - eos.pressure(rho)).abs() < 1e-6 * (1.0 + c2));
            }
        }
    }

    #[test]
    fn a_table_is_met_at_its_points_and_stays_monotone() {
        let eos = &all()[5];
        assert_eq!(eos.pressure(1.3), 1.1);
        let mut last = f64::MIN;
        for k in 0..2000 {
            let p = eos.pressure(0.4 + 0.001 * k as f64);
            assert!(p >= last);
            last = p;
        }
    }

    #[test]
    fn bad_parameters_are_named() {
        let message = |kind: &str, p: &[f64]| build(kind, p).err().unwrap().to_string();
        assert!(message("tait", &[1.0, 1.0, 1.0, 0.0]).contains("`exponent`"));
        assert!(message("linear", &[-1.0, 1.0, 0.0]).contains("`reference_density`"));
        assert!(message("vinegar", &[]).contains("`eos` must be one of"));
        assert!(message("table", &[1.0, 1.0, 2.0, 3.0]).contains("increase"));
        assert!(message("ideal_gas", &[1.0, 2.0]).contains("takes the parameters"));
    }
}
