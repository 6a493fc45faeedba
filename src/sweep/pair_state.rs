//! What the exchanges of a fluid with an energy need of two particles: their temperatures from their
//! thermal energies, with a constant heat capacity or with any.

use super::Shared;
use crate::eos::caloric::Caloric;
use crate::physics::{Ends, Exchanges, ThermalExchange};
use crate::real::ln;

/// Temperature, heat capacity and entropy of a particle, in reduced units.
#[derive(Clone, Copy)]
pub struct States<'a> {
    /// The fluid, in the user's units.
    pub eos: &'a dyn Caloric,
    /// `Thermal::factors`.
    pub factors: &'a [[f64; 3]],
    /// Unit of the energy per mass.
    pub to_specific: f64,
    /// 1 over the unit of the temperature.
    pub per_kelvin: f64,
    /// 1 over kB over the mass of a particle.
    pub per_capacity: f64,
}

impl States<'_> {
    /// T and k at a thermal energy.
    #[inline(always)]
    pub fn of(&self, slot: u32, heat: f64) -> [f64; 2] {
        self.at(self.factors[slot as usize][2], heat)
    }

    /// The same at a mark of the density.
    #[inline(always)]
    pub fn at(&self, mark: f64, heat: f64) -> [f64; 2] {
        let [t, c] = self.eos.state_at(mark, heat * self.to_specific);
        [t * self.per_kelvin, c * self.per_capacity]
    }

    /// S of a thermal energy, up to what depends on the density.
    #[inline(always)]
    pub fn entropy(&self, slot: u32, heat: f64) -> f64 {
        let mark = self.factors[slot as usize][2];
        self.eos.entropy_at(mark, heat * self.to_specific) * self.per_capacity
    }
}

/// The energies of particles and what they mean.
#[derive(Clone, Copy)]
pub struct Energies<'a> {
    /// Thermal energies by slot.
    pub heat: Shared<'a, f64>,
    /// Where the heat capacity is not a constant.
    pub states: States<'a>,
    /// Coefficients of the exchange under way.
    pub exchange: &'a ThermalExchange,
}

impl Energies<'_> {
    /// Temperatures and heat capacity of a pair with the thermal energies `e`.
    #[inline(always)]
    pub fn ends<X: Exchanges>(&self, slots: [u32; 2], e: [f64; 2]) -> Ends {
        if X::GENERAL {
            Ends::of_states([
                self.states.of(slots[0], e[0]),
                self.states.of(slots[1], e[1]),
            ])
        } else {
            self.exchange.ends(e)
        }
    }

    /// The factor of eta for a pair whose relative velocity has the given square, at a temperature
    /// that its friction leaves as it is: see `ThermalExchange::viscous_factor`.
    #[inline(always)]
    pub fn viscous_factor<X: Exchanges>(
        &self,
        slots: [u32; 2],
        e: [f64; 2],
        square: f64,
        noise: bool,
    ) -> f64 {
        if !X::GENERAL {
            return self.exchange.viscous_factor(e, square, noise);
        }
        if self.exchange.constant_viscosity() {
            return 1.0;
        }
        let fluctuating = noise && X::HEATING;
        let [t, s] = [0, 1].map(|n| self.early(slots[n], e[n], 0.125 * square, 0.25, fluctuating));
        self.exchange.viscous_factor_at(0.5 * (t + s))
    }

    /// The same for an own image: u^2/2 is the energy of the motion.
    #[inline(always)]
    pub fn own_viscous_factor<X: Exchanges>(
        &self,
        slot: u32,
        e: f64,
        square: f64,
        noise: bool,
    ) -> f64 {
        if !X::GENERAL {
            return self.exchange.own_viscous_factor(e, square, noise);
        }
        if self.exchange.constant_viscosity() {
            return 1.0;
        }
        let t = self.early(slot, e, 0.5 * square, 0.5, noise && X::HEATING);
        self.exchange.viscous_factor_at(t)
    }

    /// The temperature of a particle with the part of the motion that friction can give it, `motion`,
    /// spread over the `share` of D degrees of freedom that belongs to it.
    #[inline(always)]
    fn early(&self, slot: u32, e: f64, motion: f64, share: f64, noise: bool) -> f64 {
        if !noise {
            return self.states.of(slot, e)[0];
        }
        let [t, k] = self.states.of(slot, e + motion);
        t * k / (k + share * self.exchange.dimension())
    }

    /// The factor of kappa of a pair, at a temperature that its conduction leaves as it is.
    #[inline(always)]
    pub fn conductive_factor<X: Exchanges>(&self, slots: [u32; 2], e: [f64; 2]) -> f64 {
        if !X::GENERAL {
            return self.exchange.conductive_factor(e);
        }
        if self.exchange.constant_conductivity() {
            return 1.0;
        }
        let mean = 0.5 * (e[0] + e[1]);
        let [t, s] = slots.map(|slot| self.states.of(slot, mean)[0]);
        self.exchange.conductive_factor_at(0.5 * (t + s))
    }

    /// ln of the weight of two thermal energies `after` over that of those `before`, exp(S) over T:
    /// the measure is dS. `ends` are the temperatures and heat capacities before and after.
    #[inline(always)]
    pub fn weight(
        &self,
        slots: [u32; 2],
        [before, after]: [[f64; 2]; 2],
        [ends, then]: [&Ends; 2],
    ) -> f64 {
        let entropy =
            |e: [f64; 2]| self.states.entropy(slots[0], e[0]) + self.states.entropy(slots[1], e[1]);
        let product = |ends: &Ends| {
            let inverse = ends.inverse_capacity * ends.inverse_capacity;
            ends.e[0] * ends.e[1] * inverse
        };
        entropy(after) - entropy(before) + ln(product(ends) / product(then))
    }
}
