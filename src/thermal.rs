//! What a fluid with an energy has on top of the others: temperatures, the books of the work that
//! pressure does, heat through walls. The state of a particle is its thermal energy C T, in units of
//! m u0^2 like all energies of the loops; kB = 1 there, so temperatures are in units of m u0^2/kB.

use std::sync::Arc;

use rayon::prelude::*;

use crate::eos::caloric::{self, Caloric};
use crate::error::{Error, Result};
use crate::physics::{PairThermal, Power};
use crate::state::Particles;
use crate::sweep::{HeatTally, States};
use crate::units::Units;
use crate::valid::{finite, non_negative, positive};

/// Particles per task of the elementwise loops.
const GRAIN: usize = 512;

/// Heat capacity of a particle, in kB, at which 1 - c of two of them has a zero.
const LEAST_CAPACITY: f64 = 0.5;

/// What the user asks of the energies, in the user's units.
#[derive(Debug, Clone)]
pub struct ThermalSettings {
    /// Caloric equation of state: name, parameters, name of the isotherm (of a liquid).
    pub eos: (String, Vec<f64>, String),
    /// kB.
    pub boltzmann: f64,
    /// kappa `[energy/(time temperature length^(D-2))]`, 0 without conduction.
    pub conductivity: f64,
    /// Exponents of eta ~ T^n and kappa ~ T^n, and the temperature at which they have their values.
    pub exponents: [f64; 2],
    /// See `exponents`.
    pub reference: f64,
    /// Keep the books of the work, so that the total energy holds to rounding?
    pub bookkeeping: bool,
    /// Condition at each wall.
    pub walls: Vec<WallHeatSettings>,
}

/// Heat at a wall: "isothermal" with T and its gradient (D numbers, about the origin), "adiabatic",
/// or "flux" with the heat into the fluid `[energy/time]` and the area it goes through.
pub type WallHeatSettings = (String, Vec<f64>);

/// Heat at a wall, in reduced units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum WallHeat {
    /// A bath of temperature T + G.x, x at the foot.
    Isothermal {
        /// T.
        temperature: f64,
        /// G.
        gradient: [f64; 3],
    },
    /// No heat.
    Adiabatic,
    /// A given power, spread over the particles next to the wall.
    Flux {
        /// Energy per time.
        power: f64,
    },
}

impl WallHeat {
    fn parse(wall: &WallHeatSettings, index: usize, units: &Units, kelvin: f64) -> Result<Self> {
        let (kind, numbers) = wall;
        let name = format!("walls[{index}].heat");
        let d = units.dimension as usize;
        let count = match kind.as_str() {
            "isothermal" => 1 + d,
            "adiabatic" => 0,
            "flux" => 1,
            other => {
                return Err(Error::Invalid(format!(
                    "`{name}` must be \"isothermal\", \"adiabatic\" or \"flux\", got {other:?}"
                )));
            }
        };
        if numbers.len() != count {
            return Err(Error::Invalid(format!(
                "`{name}` {kind:?} takes {count} numbers, got {}",
                numbers.len()
            )));
        }
        Ok(match kind.as_str() {
            "isothermal" => {
                let mut gradient = [0.0; 3];
                for (a, &g) in numbers[1..].iter().enumerate() {
                    gradient[a] = finite(&name, g)? * units.length / kelvin;
                }
                Self::Isothermal {
                    temperature: positive(&name, numbers[0])? / kelvin,
                    gradient,
                }
            }
            "flux" => Self::Flux {
                power: finite(&name, numbers[0])? * units.time() / units.energy(),
            },
            _ => Self::Adiabatic,
        })
    }
}

/// Numbers of the fields among the particles' scalars.
#[derive(Debug, Clone, Copy)]
pub struct Fields {
    /// Thermal energy C T.
    pub heat: usize,
    /// Entropy per mass before the drift; after it, what velocity Verlet wants to keep.
    pub entropy: usize,
    /// Internal energy before the drift, less the work done since.
    pub energy: usize,
    /// Sums of the work sweep; during a drift of velocity Verlet, temperatures of the noise.
    pub work: usize,
}

/// Energy exchanged since the simulation was made.
#[derive(Debug, Clone, Default)]
pub struct Accounts {
    /// What the adiabat alone would have added.
    pub discarded: f64,
    /// Work of the body force.
    pub body_work: f64,
    /// Energy of adiabats that stand, as the books would have left none.
    pub unbooked: f64,
    /// Updates that were not made, as they would have left a particle without energy.
    pub refused: u64,
    /// Of each wall: heat it has received, and work it has done on the fluid.
    pub walls: Vec<[f64; 2]>,
}

/// The thermal part of a simulation.
pub struct Thermal {
    /// Caloric equation of state, in the user's units.
    pub eos: Box<dyn Caloric>,
    /// Coefficients of a pair.
    pub pair: PairThermal,
    /// The unit of temperature.
    pub kelvin: f64,
    /// Is the work kept in the books?
    pub bookkeeping: bool,
    /// Where the energies are.
    pub fields: Fields,
    /// Heat at each wall.
    pub walls: Vec<WallHeat>,
    /// Where energy has come from and gone to.
    pub accounts: Accounts,
    /// The current of energy, where an observer wants it.
    pub current: Option<HeatTally>,
    /// Updates of pairs that were not made in the sweep under way, by block.
    pub refused: Vec<u64>,
    /// Work of the body force in the kick under way, by slot; then what the books discard.
    pub input: Vec<f64>,
    /// Energy of adiabats that stand in the step under way, by slot.
    unbooked: Vec<f64>,
    /// Of each particle at the start of a sweep: the factors of eta, and of kappa over the heat
    /// capacity, and its `Caloric::mark`.
    pub factors: Vec<[f64; 3]>,
    /// Is the heat capacity a constant, so that the thermal energy is C T?
    constant: bool,
    to_density: f64,
    from_pressure: f64,
    from_specific: f64,
}

/// The sum in the order of the slots, on any number of threads.
fn sum(values: &[f64]) -> f64 {
    values.iter().sum()
}

impl Thermal {
    /// Parses what the user asks for; the particles get their fields.
    pub fn new(
        settings: &ThermalSettings,
        units: &Units,
        friction: [f64; 2],
        particles: &mut Particles,
        [blocks, surfaces]: [usize; 2],
    ) -> Result<Self> {
        if settings.walls.len() != surfaces {
            return Err(Error::Invalid(format!(
                "`thermal.walls` must have {surfaces} entries, one for each wall, got {}",
                settings.walls.len()
            )));
        }
        let (kind, parameters, isotherm) = &settings.eos;
        let eos = caloric::build(kind, parameters, isotherm)?;
        let boltzmann = positive("boltzmann_constant", settings.boltzmann)?;
        let kelvin = units.energy() / boltzmann;
        let unit = boltzmann / (units.time() * units.length.powi(units.dimension - 2));
        let conductivity = non_negative("thermal_conductivity", settings.conductivity)? / unit;
        let reference = positive("reference_temperature", settings.reference)? / kelvin;
        for exponent in settings.exponents {
            finite("transport_exponents", exponent)?;
        }
        let constant = eos.constant_heat_capacity();
        let capacity = constant.map_or(f64::INFINITY, |c| c * units.mass / boltzmann);
        if capacity <= LEAST_CAPACITY {
            return Err(Error::Invalid(format!(
                "`heat_capacity` must be above {LEAST_CAPACITY} kB a particle, got {capacity} kB"
            )));
        }
        let walls = settings.walls.iter().enumerate();
        let walls: Vec<_> = walls
            .map(|(index, wall)| WallHeat::parse(wall, index, units, kelvin))
            .collect::<Result<_>>()?;
        let n = particles.len();
        let fields = Fields {
            heat: particles.add_scalar("thermal_energy", true),
            entropy: particles.add_scalar("entropy", false),
            energy: particles.add_scalar("energy", false),
            work: particles.add_scalar("work", false),
        };
        let [across, along] = friction;
        Ok(Self {
            eos,
            pair: PairThermal {
                across,
                along,
                conductivity,
                capacity,
                powers: Arc::new(settings.exponents.map(Power::new)),
                inverse_reference: 1.0 / reference,
                dimension: f64::from(units.dimension),
            },
            kelvin,
            bookkeeping: settings.bookkeeping,
            fields,
            accounts: Accounts {
                walls: vec![[0.0; 2]; walls.len()],
                ..Accounts::default()
            },
            walls,
            current: None,
            refused: vec![0; blocks],
            input: vec![0.0; n],
            unbooked: vec![0.0; n],
            factors: vec![[1.0; 3]; n],
            constant: constant.is_some(),
            to_density: units.mass_density(),
            from_pressure: 1.0 / units.pressure(),
            from_specific: 1.0 / (units.velocity * units.velocity),
        })
    }

    /// Do the exchanges suit the fluid and the walls?
    pub fn check_exchanges(&self, exchanges: &str) -> Result<()> {
        let metropolis = exchanges.ends_with("metropolis");
        let general = metropolis || exchanges.ends_with("general") || exchanges == "adiabatic";
        if !self.constant && !general {
            return Err(Error::Invalid(format!(
                "`exchanges` must be for any heat capacity where that of `thermal.eos` is no constant, got {exchanges:?}"
            )));
        }
        let follows = general || exchanges.ends_with("variable");
        let constant = self.pair.powers.iter().all(|power| power.exponent() == 0.0);
        if !constant && (!follows || exchanges.starts_with("bath")) {
            return Err(Error::Invalid(format!(
                "`transport_exponents` must be 0 with the exchanges {exchanges:?}"
            )));
        }
        if metropolis && !self.walls.is_empty() {
            return Err(Error::Invalid(format!(
                "`exchanges` must not be accepted or rejected where there are walls, got {exchanges:?}"
            )));
        }
        Ok(())
    }

    /// Temperature [user] of a particle of number density d.
    pub fn temperature(&self, d: f64, heat: f64) -> f64 {
        if self.constant {
            return heat / self.pair.capacity * self.kelvin;
        }
        self.eos
            .temperature_and_capacity(d * self.to_density, heat / self.from_specific)[0]
    }

    /// Temperature and heat capacity of a particle, in reduced units.
    pub fn state(&self, d: f64, heat: f64) -> [f64; 2] {
        if self.constant {
            return [heat / self.pair.capacity, self.pair.capacity];
        }
        let mark = self.eos.mark(d * self.to_density);
        self.states().at(mark, heat)
    }

    /// Thermal energy of a temperature [user].
    pub fn heat(&self, d: f64, temperature: f64) -> f64 {
        if self.constant {
            return temperature / self.kelvin * self.pair.capacity;
        }
        self.eos.heat(d * self.to_density, temperature) * self.from_specific
    }

    /// Does a temperature mean the same thermal energy at any density?
    pub fn heat_capacity_is_constant(&self) -> bool {
        self.constant
    }

    /// Internal energy and entropy (in units of kB) of a particle of number density d.
    pub fn energy_and_entropy(&self, d: f64, heat: f64) -> [f64; 2] {
        [
            self.cold(d) + heat,
            self.entropy(d, heat) * self.kelvin * self.from_specific,
        ]
    }

    /// Entropy per mass [user].
    fn entropy(&self, d: f64, heat: f64) -> f64 {
        self.eos
            .entropy(d * self.to_density, heat / self.from_specific)
    }

    /// Internal energy of a particle.
    pub fn internal_energy(&self, d: f64, heat: f64) -> f64 {
        self.cold(d) + heat
    }

    fn cold(&self, d: f64) -> f64 {
        self.eos.cold_energy(d * self.to_density) * self.from_specific
    }

    /// Temperatures and heat capacities of particles, for the exchanges.
    pub fn states(&self) -> States<'_> {
        States {
            eos: &*self.eos,
            factors: &self.factors,
            to_specific: 1.0 / self.from_specific,
            per_kelvin: 1.0 / self.kelvin,
            per_capacity: self.kelvin * self.from_specific,
        }
    }

    /// Writes s = d^(-1/2) and P/d^2 into the particles' records.
    pub fn pressures(&self, particles: &mut Particles) {
        let heat = &particles.scalars[self.fields.heat].values;
        particles
            .position
            .par_iter_mut()
            .zip(particles.velocity.par_iter_mut())
            .zip(particles.density.par_iter())
            .zip(heat.par_iter())
            .with_min_len(GRAIN)
            .for_each(|(((position, velocity), &d), &heat)| {
                position[3] = 1.0 / d.sqrt();
                let pressure = self
                    .eos
                    .pressure(d * self.to_density, heat / self.from_specific);
                velocity[3] = pressure * self.from_pressure / (d * d);
            });
    }

    /// Notes entropies and internal energies of the present densities.
    pub fn open(&self, particles: &mut Particles) {
        let Fields {
            heat,
            entropy,
            energy,
            ..
        } = self.fields;
        let [heat, entropy, energy] = pick(&mut particles.scalars, [heat, entropy, energy]);
        entropy
            .par_iter_mut()
            .zip(energy.par_iter_mut())
            .zip(heat.par_iter())
            .zip(particles.density.par_iter())
            .with_min_len(GRAIN)
            .for_each(|(((entropy, energy), &heat), &d)| {
                *entropy = self.entropy(d, heat);
                *energy = self.cold(d) + heat;
            });
    }

    /// New temperatures at the noted entropies and the present densities.
    pub fn follow_adiabat(&self, particles: &mut Particles) {
        let Fields { heat, entropy, .. } = self.fields;
        let [heat, entropy] = pick(&mut particles.scalars, [heat, entropy]);
        heat.par_iter_mut()
            .zip(entropy.par_iter())
            .zip(particles.density.par_iter())
            .with_min_len(GRAIN)
            .for_each(|((heat, &entropy), &d)| {
                let guess = *heat / self.from_specific;
                let rho = d * self.to_density;
                *heat = self.eos.heat_at_entropy(rho, entropy, guess) * self.from_specific;
            });
    }

    /// Takes the work of a kick of length t, whose sums the work sweep has made, off the energies.
    pub fn book_work(&mut self, particles: &mut Particles, t: f64) {
        if let Some(current) = &mut self.current {
            current.keep(t);
        }
        let Fields { energy, work, .. } = self.fields;
        let [energy, work] = pick(&mut particles.scalars, [energy, work]);
        energy
            .par_iter_mut()
            .zip(work.par_iter())
            .zip(particles.velocity.par_iter())
            .with_min_len(GRAIN)
            .for_each(|((energy, &work), velocity)| *energy -= t * velocity[3] * work);
    }

    /// Adds to the current what particles carry with them in a drift of length t, by their books.
    pub fn carry(&mut self, particles: &Particles, t: f64) {
        if let Some(current) = &mut self.current {
            let energy = &particles.scalars[self.fields.energy].values;
            current.drift(t, &particles.velocity, energy);
        }
    }

    /// Replaces the adiabat's energies by those of the books.
    pub fn close(&mut self, particles: &mut Particles) {
        let mut discarded = std::mem::take(&mut self.input);
        let mut unbooked = std::mem::take(&mut self.unbooked);
        let Fields { heat, energy, .. } = self.fields;
        let [heat, energy] = pick(&mut particles.scalars, [heat, energy]);
        heat.par_iter_mut()
            .zip(energy.par_iter())
            .zip(particles.density.par_iter())
            .zip(discarded.par_iter_mut())
            .zip(unbooked.par_iter_mut())
            .with_min_len(GRAIN)
            .for_each(|((((heat, &energy), &d), discarded), unbooked)| {
                let booked = energy - self.cold(d);
                // Work beyond what a particle has cannot be its own: the adiabat stands.
                (*discarded, *unbooked) = (0.0, 0.0);
                if booked > 0.0 {
                    *discarded = *heat - booked;
                    *heat = booked;
                } else {
                    *unbooked = *heat - booked;
                }
            });
        self.accounts.discarded += sum(&discarded);
        self.accounts.unbooked += sum(&unbooked);
        (self.input, self.unbooked) = (discarded, unbooked);
    }

    /// The body force's work of the kick whose mean velocities were just made.
    pub fn book_input(&mut self) {
        self.accounts.body_work += sum(&self.input);
    }

    /// Brings the factors up to date.
    pub fn renew_factors(&mut self, particles: &Particles) {
        let mut factors = std::mem::take(&mut self.factors);
        let heat = &particles.scalars[self.fields.heat].values;
        let states = self.states();
        factors
            .par_iter_mut()
            .zip(heat.par_iter())
            .zip(particles.density.par_iter())
            .with_min_len(GRAIN)
            .for_each(|((factors, &heat), &d)| {
                let mark = self.eos.mark(d * self.to_density);
                let [t, k] = states.at(mark, heat);
                let [eta, kappa] = self.pair.factors(t, k);
                *factors = [eta, kappa, mark];
            });
        self.factors = factors;
    }

    /// Counts what the sweep just done did not do.
    pub fn count_refused(&mut self) {
        self.accounts.refused += self.refused.iter().sum::<u64>();
        self.refused.fill(0);
    }

    /// Refuses a temperature that is not finite and positive, and a heat capacity that is no constant
    /// and so low that pairs cannot exchange energy any more: the slot.
    pub fn check(&self, particles: &Particles) -> Option<usize> {
        let heat = &particles.scalars[self.fields.heat].values;
        if self.constant {
            return heat.iter().position(|&e| !(e.is_finite() && e > 0.0));
        }
        heat.iter().zip(&particles.density).position(|(&heat, &d)| {
            let [t, k] = self.state(d, heat);
            !(heat > 0.0 && t.is_finite() && t > 0.0 && k > LEAST_CAPACITY)
        })
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        let factors = 3 * self.factors.capacity();
        let current = self.current.as_ref().map_or(0, HeatTally::bytes);
        current
            + 8 * (self.unbooked.capacity()
                + self.input.capacity()
                + self.refused.capacity()
                + factors)
    }
}

/// Some of the fields at once.
pub(crate) fn pick<const N: usize>(
    scalars: &mut [crate::state::Scalar],
    numbers: [usize; N],
) -> [&mut Vec<f64>; N] {
    match scalars.get_disjoint_mut(numbers) {
        Ok(fields) => fields.map(|field| &mut field.values),
        // Fields are numbered once, when the particles get them.
        Err(error) => unreachable!("fields of energies: {error}"),
    }
}
