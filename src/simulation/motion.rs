//! How particles move: kicks, drifts, reflections at walls, and how the lists follow.

use rayon::prelude::*;

use super::{Engine, GRAIN};
use crate::effect::BodyForce;
use crate::error::{Error, Result};
use crate::stopwatch::Phase;

/// A displacement per step, in supports, beyond which a run has gone wrong.
const RUNAWAY: f64 = 1.0;

/// Squared displacements and speed found while moving the particles.
#[derive(Debug, Clone, Copy, Default)]
pub struct Moved {
    from_grid: f64,
    speed: f64,
}

/// v += t f.
#[inline(always)]
fn kick_by(v: &mut [f64; 4], f: &[f64; 4], t: f64) {
    for a in 0..3 {
        v[a] += t * f[a];
    }
}

/// v += t (f + more).
#[inline(always)]
fn kick_both(v: &mut [f64; 4], f: &[f64; 4], more: &[f64; 3], t: f64) {
    for a in 0..3 {
        v[a] += t * (f[a] + more[a]);
    }
}

/// The square of a vector. A NaN must win every comparison, or nobody would see it.
#[inline(always)]
fn visible_square([x, y, z]: [f64; 3]) -> f64 {
    let square = x * x + y * y + z * z;
    if square < f64::INFINITY {
        square
    } else {
        f64::INFINITY
    }
}

#[inline(always)]
fn square_from(position: &[f64; 4], origin: &[f64; 3]) -> f64 {
    visible_square(std::array::from_fn(|a| position[a] - origin[a]))
}

impl Moved {
    /// r += v dt of one particle.
    #[inline(always)]
    fn new(position: &mut [f64; 4], v: &[f64; 4], grid: &[f64; 3], dt: f64) -> Self {
        for a in 0..3 {
            position[a] += dt * v[a];
        }
        Self {
            from_grid: square_from(position, grid),
            speed: visible_square([v[0], v[1], v[2]]),
        }
    }

    /// How far the fastest particle has come in this step.
    pub(crate) fn way(&self, dt: f64) -> f64 {
        self.speed.sqrt() * dt.abs()
    }

    fn most(self, other: Self) -> Self {
        Self {
            from_grid: self.from_grid.max(other.from_grid),
            speed: self.speed.max(other.speed),
        }
    }
}

impl Engine {
    /// Puts back what has crossed a wall.
    pub(crate) fn bounce(&mut self) -> Result<()> {
        if !self.walls.any() {
            return Ok(());
        }
        match self.walls.bounce(&mut self.particles, &self.cell) {
            None => Ok(()),
            Some(slot) => {
                self.check_finite()?;
                Err(self.escape(slot as usize))
            }
        }
    }

    fn find_runaway(&self, dt: f64) -> Error {
        if let Err(error) = self.check_finite() {
            return error;
        }
        let squares = |v: &[f64; 4]| v[..3].iter().map(|x| x * x).sum::<f64>();
        let (slot, speed2) = self
            .particles
            .velocity
            .iter()
            .map(squares)
            .enumerate()
            .fold(
                (0, 0.0),
                |best, now| if now.1 > best.1 { now } else { best },
            );
        Error::Runaway {
            step: self.step,
            id: self.particles.id[slot],
            displacement: speed2.sqrt() * dt,
            limit: RUNAWAY,
        }
    }

    /// v += t f, body force included.
    pub(crate) fn kick(&mut self, t: f64) {
        self.note_kick(t);
        let (cell, body) = (self.cell, self.body_force);
        let particles = &mut self.particles;
        let velocity = particles.velocity.par_iter_mut().with_min_len(GRAIN);
        let records = velocity.zip(&particles.force).zip(&particles.position);
        match body {
            BodyForce::None => records.for_each(|((v, f), _)| kick_by(v, f, t)),
            _ => records.for_each(|((v, f), position)| {
                kick_both(v, f, &body.at(position, &cell), t);
            }),
        }
        self.stopwatch.lap(Phase::Motion);
    }

    /// Walls and observers' sums of a kick.
    fn note_kick(&mut self, t: f64) {
        self.walls.kick(t);
        if let Some(tally) = &mut self.tally {
            tally.kick(t);
        }
    }

    /// r += v dt; how far the particles are from where the grid was built.
    pub(crate) fn move_particles(&mut self, dt: f64) -> Result<Moved> {
        self.move_each(dt, |_, _, _| ())
    }

    /// v += t f, body force included, then r += v dt.
    pub(crate) fn kick_and_move(&mut self, t: f64, dt: f64) -> Result<Moved> {
        self.note_kick(t);
        let (cell, body) = (self.cell, self.body_force);
        match body {
            BodyForce::None => self.move_each(dt, |v, f, _| kick_by(v, f, t)),
            _ => self.move_each(dt, |v, f, position| {
                kick_both(v, f, &body.at(position, &cell), t);
            }),
        }
    }

    /// Moves the particles, after `first` has been done to each: to its velocity, by force and position.
    #[inline(always)]
    fn move_each(
        &mut self,
        dt: f64,
        first: impl Fn(&mut [f64; 4], &[f64; 4], &[f64; 4]) + Sync + Send,
    ) -> Result<Moved> {
        let particles = &mut self.particles;
        let moved = particles
            .position
            .par_iter_mut()
            .with_min_len(GRAIN)
            .zip(particles.velocity.par_iter_mut())
            .zip(&particles.force)
            .zip(&self.grid.reference)
            .map(|(((position, v), f), grid)| {
                first(v, f, position);
                Moved::new(position, v, grid, dt)
            })
            .reduce(Moved::default, Moved::most);
        if moved.speed * dt * dt > RUNAWAY * RUNAWAY {
            return Err(self.find_runaway(dt));
        }
        // No farther than the fastest ones of each step: that spares a look at where they were.
        self.list.travel += moved.way(dt);
        Ok(moved)
    }

    /// Renews grid and lists where a particle has left its margin, and prunes the lists where one may have left the skin.
    pub(crate) fn keep_lists<const D: usize>(&mut self, moved: Moved, shuffle: bool) -> Result<()> {
        let beyond = |square: f64, width: f64| 4.0 * square > width * width;
        let result = if beyond(moved.from_grid, self.margin) {
            self.rebuild::<D>(true, shuffle)
        } else {
            if 2.0 * self.list.travel > self.skin {
                self.prune::<D>();
            }
            Ok(())
        };
        self.stopwatch.lap(Phase::Lists);
        result
    }
}
