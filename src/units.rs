//! Reduced units of the loops: the support is the length, the particle the mass, and a typical speed
//! of the scene the velocity. SI magnitudes never reach the inner loops.

/// The size of each reduced unit in the user's units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Units {
    /// Support h.
    pub length: f64,
    /// Particle mass.
    pub mass: f64,
    /// Thermal speed, or sound speed where there is no thermal motion.
    pub velocity: f64,
    /// D.
    pub dimension: i32,
}

impl Units {
    /// h / u0.
    pub fn time(&self) -> f64 {
        self.length / self.velocity
    }
    /// h^-D.
    pub fn number_density(&self) -> f64 {
        self.length.powi(-self.dimension)
    }
    /// m h^-D.
    pub fn mass_density(&self) -> f64 {
        self.mass * self.number_density()
    }
    /// m u0^2.
    pub fn energy(&self) -> f64 {
        self.mass * self.velocity * self.velocity
    }
    /// m u0^2 / h^D.
    pub fn pressure(&self) -> f64 {
        self.energy() * self.number_density()
    }
    /// m u0^2 / h.
    pub fn force(&self) -> f64 {
        self.energy() / self.length
    }
    /// u0^2 / h.
    pub fn acceleration(&self) -> f64 {
        self.velocity * self.velocity / self.length
    }
    /// Pressure times time.
    pub fn viscosity(&self) -> f64 {
        self.pressure() * self.time()
    }
}
