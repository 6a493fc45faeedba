//! The particles as the loops see them: packed four-lane records in spatial order, lengths in units
//! of the support, masses in units of the particle mass. Users never see this order: `row` leads
//! from a slot to the user's row, which never changes.

use std::ops::{Deref, DerefMut};

use rayon::prelude::*;

use crate::sweep::Copies;

/// A cache line.
#[derive(Debug, Default, Clone, Copy)]
#[repr(align(64))]
struct Line(#[allow(dead_code)] [[f64; 4]; 2]); // read as records

/// Records of four numbers, as a slice of them. None straddles two cache lines, as half of those of a
/// `Vec` may: slots are read in no particular order, and each line takes its time.
#[derive(Debug, Default, Clone)]
pub struct Records {
    lines: Vec<Line>,
    length: usize,
}

impl Records {
    /// `n` records of zeros.
    pub fn new(n: usize) -> Self {
        Self {
            lines: vec![Line::default(); n.div_ceil(2)],
            length: n,
        }
    }
}

impl Deref for Records {
    type Target = [[f64; 4]];
    #[inline]
    fn deref(&self) -> &Self::Target {
        // SAFETY: a line holds two records and nothing else, and there are `length` of them.
        unsafe { std::slice::from_raw_parts(self.lines.as_ptr().cast(), self.length) }
    }
}

impl DerefMut for Records {
    #[inline]
    fn deref_mut(&mut self) -> &mut Self::Target {
        // SAFETY: as above.
        unsafe { std::slice::from_raw_parts_mut(self.lines.as_mut_ptr().cast(), self.length) }
    }
}

impl<'a> IntoIterator for &'a Records {
    type Item = &'a [f64; 4];
    type IntoIter = std::slice::Iter<'a, [f64; 4]>;
    fn into_iter(self) -> Self::IntoIter {
        self.iter()
    }
}

impl<'a> IntoIterator for &'a mut Records {
    type Item = &'a mut [f64; 4];
    type IntoIter = std::slice::IterMut<'a, [f64; 4]>;
    fn into_iter(self) -> Self::IntoIter {
        self.iter_mut()
    }
}

impl<'a> IntoParallelIterator for &'a Records {
    type Item = &'a [f64; 4];
    type Iter = rayon::slice::Iter<'a, [f64; 4]>;
    fn into_par_iter(self) -> Self::Iter {
        (**self).par_iter()
    }
}

impl<'a> IntoParallelIterator for &'a mut Records {
    type Item = &'a mut [f64; 4];
    type Iter = rayon::slice::IterMut<'a, [f64; 4]>;
    fn into_par_iter(self) -> Self::Iter {
        (**self).par_iter_mut()
    }
}

/// A field that not every scene has: one number per particle, sorted with the others. Fields of the
/// state are saved and shown to the user; the rest is of use within a step only.
#[derive(Debug, Clone)]
pub struct Scalar {
    /// Its name, in checkpoints as well.
    pub name: &'static str,
    /// Does it belong to the state?
    pub saved: bool,
    /// By slot.
    pub values: Vec<f64>,
}

/// Structure of arrays in slot order. Lane 3 of a record carries the scalar its neighbours need.
#[derive(Debug, Default, Clone)]
pub struct Particles {
    /// x, y, z, s with s = d^(-1/2), so that g = F s_i^2 s_j^2.
    pub position: Records,
    /// vx, vy, vz, P/d^2.
    pub velocity: Records,
    /// fx, fy, fz, and the heat of an integrator that makes both at once.
    pub force: Records,
    /// Is it all 0, for sums to begin with?
    pub(crate) force_is_zero: bool,
    /// Dissipative force where an integrator evaluates it anew; empty otherwise.
    pub drag: Records,
    /// Number density d.
    pub density: Vec<f64>,
    /// Persistent ids: the only names that noise keys know.
    pub id: Vec<u64>,
    /// The user's row of each slot.
    pub row: Vec<u32>,
    /// Times each particle has left the box through either face of each axis.
    pub image: Vec<[i32; 3]>,
    /// Differences of velocities, where there is `drag`; empty otherwise.
    pub scratch: Records,
    /// Changes of velocity and energy that an integrator carries over a drift; empty otherwise.
    pub carried: Records,
    /// Fields by the number that `add_scalar` gave them.
    pub scalars: Vec<Scalar>,
    /// What sweeps in single precision read.
    pub copies: Copies,
}

impl Particles {
    /// `n` particles at rest at the origin, in the order of their rows.
    pub fn new(n: usize, with_drag: bool) -> Self {
        Self {
            position: Records::new(n),
            velocity: Records::new(n),
            force: Records::new(n),
            force_is_zero: false,
            drag: Records::new(if with_drag { n } else { 0 }),
            density: vec![0.0; n],
            id: (0..n as u64).collect(),
            row: (0..n as u32).collect(),
            image: vec![[0; 3]; n],
            scratch: Records::new(if with_drag { n } else { 0 }),
            carried: Records::default(),
            scalars: Vec::new(),
            copies: Copies::default(),
        }
    }

    /// A new field of zeros; returns its number.
    pub fn add_scalar(&mut self, name: &'static str, saved: bool) -> usize {
        self.scalars.push(Scalar {
            name,
            saved,
            values: vec![0.0; self.len()],
        });
        self.scalars.len() - 1
    }

    /// Numbers of the fields of the state.
    pub fn saved_scalars(&self) -> impl Iterator<Item = (usize, &Scalar)> {
        self.scalars.iter().enumerate().filter(|(_, s)| s.saved)
    }

    /// Number of particles.
    pub fn len(&self) -> usize {
        self.position.len()
    }

    /// True where there is no particle.
    pub fn is_empty(&self) -> bool {
        self.position.is_empty()
    }

    /// Records of slots that were those of `rows`, as slots are now.
    pub fn in_slots(&self, rows: &[u32], records: &[[f64; 4]]) -> Vec<[f64; 4]> {
        let mut by_row = vec![[0.0; 4]; rows.len()];
        for (&row, record) in rows.iter().zip(records) {
            by_row[row as usize] = *record;
        }
        self.row.iter().map(|&row| by_row[row as usize]).collect()
    }

    /// Moves the particle of slot `order[k]` to slot k, without allocation: the forces, which are
    /// always computed anew after that, lend their memory and are lost.
    pub fn permute(&mut self, order: &[u32]) {
        self.force_is_zero = false;
        for records in [&mut self.position, &mut self.velocity, &mut self.carried] {
            if records.is_empty() {
                continue;
            }
            for (to, &from) in self.force.iter_mut().zip(order) {
                *to = records[from as usize];
            }
            std::mem::swap(records, &mut self.force);
        }
        // The narrow arrays go through the same memory, several at a time.
        for (to, &from) in self.force.iter_mut().zip(order) {
            let k = from as usize;
            let [a, b, c] = self.image[k].map(|turns| f64::from_bits(u64::from(turns as u32)));
            *to = [a, b, c, self.density[k]];
        }
        for (k, from) in self.force.iter().enumerate() {
            for a in 0..3 {
                self.image[k][a] = from[a].to_bits() as u32 as i32;
            }
            self.density[k] = from[3];
        }
        for (to, &from) in self.force.iter_mut().zip(order) {
            let k = from as usize;
            to[0] = f64::from_bits(self.id[k]);
            to[1] = f64::from_bits(u64::from(self.row[k]));
        }
        for (k, from) in self.force.iter().enumerate() {
            self.id[k] = from[0].to_bits();
            self.row[k] = from[1].to_bits() as u32;
        }
        for Scalar { values, .. } in &mut self.scalars {
            for (to, &from) in self.force.iter_mut().zip(order) {
                to[0] = values[from as usize];
            }
            for (value, from) in values.iter_mut().zip(&self.force) {
                *value = from[0];
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn permuting_moves_everything_together() {
        let n = 5;
        let mut particles = Particles::new(n, false);
        for k in 0..n {
            particles.position[k] = [k as f64; 4];
            particles.velocity[k] = [10.0 + k as f64; 4];
            particles.density[k] = 20.0 + k as f64;
            particles.image[k] = [-(k as i32), k as i32, 7];
            particles.id[k] = u64::MAX - k as u64;
        }
        particles.carried = Records::new(n);
        for k in 0..n {
            particles.carried[k] = [40.0 + k as f64; 4];
        }
        let heat = particles.add_scalar("heat", true);
        particles.scalars[heat].values = (0..n).map(|k| 30.0 + k as f64).collect();
        let order = [3, 1, 4, 0, 2];
        particles.force_is_zero = true;
        particles.permute(&order);
        assert!(!particles.force_is_zero);
        for (k, &from) in order.iter().enumerate() {
            assert_eq!(particles.position[k][0], f64::from(from));
            assert_eq!(particles.velocity[k][1], 10.0 + f64::from(from));
            assert_eq!(particles.density[k], 20.0 + f64::from(from));
            assert_eq!(particles.carried[k], [40.0 + f64::from(from); 4]);
            assert_eq!(particles.image[k], [-(from as i32), from as i32, 7]);
            assert_eq!(particles.id[k], u64::MAX - u64::from(from));
            assert_eq!(particles.row[k], from);
            assert_eq!(particles.scalars[heat].values[k], 30.0 + f64::from(from));
        }
    }
}
