//! Profiles: velocity, its square, density and pressure of particles in bins along an axis or along
//! the distance from a wall, summed over blocks of samples.

use super::{Observer, View};

/// What the bins divide.
#[derive(Debug, Clone, Copy)]
pub enum Coordinate {
    /// Position along an axis.
    Axis(usize),
    /// Distance from a wall.
    Distance(usize),
}

/// One row per block of samples: time of its last sample, number of samples, and for each bin the
/// number of particles and the sums over them of v (D), v^2 (D), density and pressure, and of the
/// temperature where particles have one.
pub struct Profile {
    every: u64,
    dimension: usize,
    energy: bool,
    coordinate: Coordinate,
    range: [f64; 2],
    bins: usize,
    block: u64,
    rows: Vec<f64>,
    present: Vec<f64>,
    begun: (usize, Vec<f64>),
}

impl Profile {
    /// Bins of equal width over `range` [user]; rows are sums over `block` samples.
    pub fn new(
        every: u64,
        dimension: usize,
        energy: bool,
        coordinate: Coordinate,
        range: [f64; 2],
        bins: usize,
        block: u64,
    ) -> Self {
        let width = 2 + bins * Self::sums(dimension, energy);
        Self {
            every: every.max(1),
            dimension,
            energy,
            coordinate,
            range,
            bins,
            block: block.max(1),
            rows: Vec::new(),
            present: vec![0.0; width],
            begun: (0, vec![0.0; width]),
        }
    }

    fn sums(dimension: usize, energy: bool) -> usize {
        3 + 2 * dimension + usize::from(energy)
    }

    /// All rows so far, one after the other, and their width.
    pub fn rows(&self) -> (&[f64], usize) {
        (&self.rows, self.present.len())
    }

    fn bin(&self, view: &View, slot: usize) -> Option<usize> {
        let record = &view.particles.position[slot];
        let x = match self.coordinate {
            Coordinate::Axis(axis) => view.cell.wrap(axis, record[axis]).0,
            Coordinate::Distance(wall) => {
                let at = [record[0], record[1], record[2]];
                view.walls.surfaces[wall].distance(at, view.cell)
            }
        };
        let place = (x * view.units.length - self.range[0]) / (self.range[1] - self.range[0]);
        let bin = (place * self.bins as f64).floor();
        (bin >= 0.0 && bin < self.bins as f64).then_some(bin as usize)
    }
}

impl Observer for Profile {
    fn every(&self) -> u64 {
        self.every
    }

    fn begin(&mut self) {
        self.begun.0 = self.rows.len();
        self.begun.1.copy_from_slice(&self.present);
    }

    fn forget(&mut self) {
        self.rows.truncate(self.begun.0);
        self.present.copy_from_slice(&self.begun.1);
    }

    fn sample(&mut self, view: &View) {
        let (d, units) = (self.dimension, view.units);
        let sums = Self::sums(d, self.energy);
        for slot in 0..view.particles.len() {
            let Some(bin) = self.bin(view, slot) else {
                continue;
            };
            let v = &view.particles.velocity[slot];
            let density = view.particles.density[slot];
            let into = &mut self.present[2 + bin * sums..2 + (bin + 1) * sums];
            into[0] += 1.0;
            for a in 0..d {
                let speed = v[a] * units.velocity;
                into[1 + a] += speed;
                into[1 + d + a] += speed * speed;
            }
            into[1 + 2 * d] += density * units.mass_density();
            into[2 + 2 * d] += v[3] * density * density * units.pressure();
            if let (true, Some(temperature)) = (self.energy, view.temperature(slot)) {
                into[3 + 2 * d] += temperature;
            }
        }
        self.present[0] = view.time;
        self.present[1] += 1.0;
        if self.present[1] >= self.block as f64 {
            self.rows.extend_from_slice(&self.present);
            self.present.fill(0.0);
        }
    }
}
