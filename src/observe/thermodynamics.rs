//! Time series of the box: kinetic temperature by component, energies, momentum, mean densities,
//! mean pressure. All in the user's units.

use super::{Observer, View};

/// One row per sample; see `columns`.
pub struct Thermodynamics {
    every: u64,
    dimension: usize,
    energy: bool,
    rows: Vec<f64>,
    begun: usize,
}

impl Thermodynamics {
    /// Sampled every so many steps; `energy`: particles have one.
    pub fn new(every: u64, dimension: usize, energy: bool) -> Self {
        Self {
            every: every.max(1),
            dimension,
            energy,
            rows: Vec::new(),
            begun: 0,
        }
    }

    /// Names of the columns.
    pub fn columns(dimension: usize, energy: bool) -> Vec<String> {
        let axes = ["x", "y", "z"];
        let mut names = vec!["step".to_string(), "time".to_string()];
        names.extend(
            axes[..dimension]
                .iter()
                .map(|a| format!("thermal_energy_{a}")),
        );
        let potential = if energy {
            "internal_energy"
        } else {
            "potential_energy"
        };
        names.extend(["kinetic_energy".into(), potential.into()]);
        names.extend(axes[..dimension].iter().map(|a| format!("momentum_{a}")));
        names.extend(["mean_density", "mean_square_density", "mean_pressure"].map(String::from));
        if energy {
            names.extend(["internal_temperature", "square_internal_temperature"].map(String::from));
        }
        names
    }

    /// All rows so far, one after the other.
    pub fn rows(&self) -> &[f64] {
        &self.rows
    }
}

impl Observer for Thermodynamics {
    fn every(&self) -> u64 {
        self.every
    }

    fn begin(&mut self) {
        self.begun = self.rows.len();
    }

    fn forget(&mut self) {
        self.rows.truncate(self.begun);
    }

    fn sample(&mut self, view: &View) {
        let (particles, units) = (view.particles, view.units);
        let n = particles.len() as f64;
        let d = self.dimension;
        let (mut momentum, mut square) = ([0.0; 3], [0.0; 3]);
        let (mut rho_sum, mut rho_square, mut pressure, mut potential) = (0.0, 0.0, 0.0, 0.0);
        let (mut warmth, mut warmth_square) = (0.0, 0.0);
        for slot in 0..particles.len() {
            let v = &particles.velocity[slot];
            for a in 0..d {
                momentum[a] += v[a];
                square[a] += v[a] * v[a];
            }
            let density = particles.density[slot];
            let rho = density * units.mass_density();
            rho_sum += rho;
            rho_square += rho * rho;
            pressure += v[3] * density * density;
            match view.thermal {
                None => potential += view.eos.specific_potential(rho),
                Some(thermal) => {
                    let heat = particles.scalars[thermal.fields.heat].values[slot];
                    potential += thermal.internal_energy(density, heat);
                    let t = thermal.temperature(density, heat);
                    warmth += t;
                    warmth_square += t * t;
                }
            }
        }
        self.rows.extend([view.step as f64, view.time]);
        // Motion of the whole box is not thermal; with N particles it takes one degree of freedom.
        let thermal = |a: usize| {
            let peculiar = square[a] - momentum[a] * momentum[a] / n;
            if n > 1.0 { peculiar / (n - 1.0) } else { 0.0 }
        };
        self.rows
            .extend((0..d).map(|a| thermal(a) * units.energy()));
        let kinetic = 0.5 * square[..d].iter().sum::<f64>() * units.energy();
        // Specific potentials are those of the user, internal energies in reduced units.
        let unit = if self.energy {
            units.energy()
        } else {
            units.mass
        };
        self.rows.extend([kinetic, potential * unit]);
        self.rows
            .extend((0..d).map(|a| momentum[a] * units.mass * units.velocity));
        self.rows
            .extend([rho_sum / n, rho_square / n, pressure / n * units.pressure()]);
        if self.energy {
            self.rows.extend([warmth / n, warmth_square / n]);
        }
    }
}
