//! Equations of state with a closed form. Numbers Y refer to Yang's dissertation (WPI, 2013).

use super::EquationOfState;

/// Artificial compressibility, Y 2.52: P = rho0 c^2/2 ((rho/rho0)^2 - 1). Negative below rho0.
#[derive(Debug, Clone)]
pub struct ArtificialCompressibility {
    /// rho0 `[mass/length^D]`.
    pub reference_density: f64,
    /// c at rho0 `[velocity]`.
    pub sound_speed: f64,
}

impl EquationOfState for ArtificialCompressibility {
    fn pressure(&self, rho: f64) -> f64 {
        let x = rho / self.reference_density;
        0.5 * self.reference_density * self.sound_speed * self.sound_speed * (x * x - 1.0)
    }
    fn sound_speed_squared(&self, rho: f64) -> f64 {
        self.sound_speed * self.sound_speed * rho / self.reference_density
    }
    fn specific_potential(&self, rho: f64) -> f64 {
        let x = rho / self.reference_density;
        0.5 * self.sound_speed * self.sound_speed * (x + 1.0 / x)
    }
}

/// P = P0 + c^2 (rho - rho0).
#[derive(Debug, Clone)]
pub struct Linear {
    /// rho0 `[mass/length^D]`.
    pub reference_density: f64,
    /// c `[velocity]`.
    pub sound_speed: f64,
    /// P0 `[pressure]`.
    pub reference_pressure: f64,
}

impl EquationOfState for Linear {
    fn pressure(&self, rho: f64) -> f64 {
        self.reference_pressure
            + self.sound_speed * self.sound_speed * (rho - self.reference_density)
    }
    fn sound_speed_squared(&self, _: f64) -> f64 {
        self.sound_speed * self.sound_speed
    }
    fn specific_potential(&self, rho: f64) -> f64 {
        let c2 = self.sound_speed * self.sound_speed;
        c2 * (rho / self.reference_density).ln()
            + (c2 * self.reference_density - self.reference_pressure) / rho
    }
}

/// Tait's equation with a background pressure, P = rho0 c^2/n ((rho/rho0)^n - 1) + Pb.
#[derive(Debug, Clone)]
pub struct Tait {
    /// rho0 `[mass/length^D]`.
    reference_density: f64,
    /// c at rho0 `[velocity]`.
    sound_speed: f64,
    /// n, > 1.
    exponent: f64,
    /// Pb `[pressure]`.
    background_pressure: f64,
    /// rho0 c^2/n `[pressure]`.
    stiffness: f64,
    /// n, where powers are products. It is asked for at every particle and step.
    integer: Option<u32>,
}

/// n as a small integer, if it is one.
fn small_integer(n: f64) -> Option<u32> {
    (n.fract() == 0.0 && (0.0..=64.0).contains(&n)).then_some(n as u32)
}

/// x^n, by products where n is a small integer: a fifth of the time, and the same bits everywhere.
#[inline]
fn power(x: f64, n: f64, integer: Option<u32>) -> f64 {
    let Some(mut left) = integer else {
        return x.powf(n);
    };
    let (mut power, mut square) = (1.0, x);
    while left > 0 {
        if left & 1 == 1 {
            power *= square;
        }
        square *= square;
        left >>= 1;
    }
    power
}

impl Tait {
    /// Of rho0 `[mass/length^D]`, c at rho0 `[velocity]`, n > 1 and Pb `[pressure]`.
    pub fn new(
        reference_density: f64,
        sound_speed: f64,
        exponent: f64,
        background_pressure: f64,
    ) -> Self {
        Self {
            reference_density,
            sound_speed,
            exponent,
            background_pressure,
            stiffness: reference_density * sound_speed * sound_speed / exponent,
            integer: small_integer(exponent),
        }
    }

    /// (rho/rho0)^(n - 1).
    fn slope(&self, rho: f64) -> f64 {
        let n = self.exponent - 1.0;
        power(rho / self.reference_density, n, small_integer(n))
    }
}

impl EquationOfState for Tait {
    fn pressure(&self, rho: f64) -> f64 {
        let x = rho / self.reference_density;
        self.stiffness * (power(x, self.exponent, self.integer) - 1.0) + self.background_pressure
    }
    fn sound_speed_squared(&self, rho: f64) -> f64 {
        self.sound_speed * self.sound_speed * self.slope(rho)
    }
    fn specific_potential(&self, rho: f64) -> f64 {
        self.stiffness / self.reference_density * self.slope(rho) / (self.exponent - 1.0)
            + (self.stiffness - self.background_pressure) / rho
    }
}

/// Isothermal ideal gas, Y 2.53: P = c^2 rho with c^2 = kB T / (mass of a molecule).
#[derive(Debug, Clone)]
pub struct IdealGas {
    /// Isothermal sound speed `[velocity]`.
    pub sound_speed: f64,
}

impl EquationOfState for IdealGas {
    fn pressure(&self, rho: f64) -> f64 {
        self.sound_speed * self.sound_speed * rho
    }
    fn sound_speed_squared(&self, _: f64) -> f64 {
        self.sound_speed * self.sound_speed
    }
    fn specific_potential(&self, rho: f64) -> f64 {
        self.sound_speed * self.sound_speed * rho.ln()
    }
}

/// P = sum_k a_k rho^k.
#[derive(Debug, Clone)]
pub struct Polynomial {
    /// a_0, a_1, ... `[pressure / density^k]`.
    pub coefficients: Vec<f64>,
}

impl EquationOfState for Polynomial {
    fn pressure(&self, rho: f64) -> f64 {
        self.coefficients
            .iter()
            .rev()
            .fold(0.0, |sum, a| sum * rho + a)
    }
    fn sound_speed_squared(&self, rho: f64) -> f64 {
        let terms = self.coefficients.iter().enumerate().skip(1).rev();
        terms.fold(0.0, |sum, (k, a)| sum * rho + k as f64 * a)
    }
    fn specific_potential(&self, rho: f64) -> f64 {
        let terms = self.coefficients.iter().enumerate();
        terms
            .map(|(k, a)| match k {
                1 => a * rho.ln(),
                _ => a * rho.powi(k as i32 - 1) / (k as f64 - 1.0),
            })
            .sum()
    }
}
