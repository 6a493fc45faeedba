//! How particles move: kicks, drifts, reflections at walls, and how the lists follow.

use rayon::prelude::*;

use super::{Engine, GRAIN};
use crate::effect::BodyForce;
use crate::error::{Error, Result};
use crate::stopwatch::Phase;

/// A displacement per step, in supports, beyond which a run has gone wrong.
const RUNAWAY: f64 = 1.0;

/// How far particles may be from where the grid was renewed [h].
#[derive(Debug, Clone, Copy)]
pub(super) struct Gone {
    /// The farthest one, when somebody looked.
    known: f64,
    /// At most so far has any gone since.
    since: f64,
}

impl Gone {
    /// Nowhere, just after a renewal.
    pub(super) const NOWHERE: Self = Self {
        known: 0.0,
        since: 0.0,
    };
    /// Nobody knows.
    pub(super) const ANYWHERE: Self = Self {
        known: f64::INFINITY,
        since: 0.0,
    };
    /// More than positions and sums of ways are rounded by, as a share of the margin.
    const HAIR: f64 = 1e-3;

    /// Has one perhaps left a margin?
    fn may_be_beyond(&self, margin: f64) -> bool {
        2.0 * (self.known + self.since) > (1.0 - Self::HAIR) * margin
    }
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

    /// r += v dt; returns the way of the fastest one.
    pub(crate) fn move_particles(&mut self, dt: f64) -> Result<f64> {
        self.move_each::<false>(dt, |v, _, _| v)
    }

    /// v += t f, body force included, so many times, then r += v dt; returns the way of the fastest
    /// one. Forces are 0 afterwards: they are to be summed anew.
    pub(crate) fn kick_and_move<const KICKS: u32>(&mut self, t: f64, dt: f64) -> Result<f64> {
        for _ in 0..KICKS {
            self.note_kick(t);
        }
        let (cell, body) = (self.cell, self.body_force);
        self.particles.force_is_zero = true;
        match body {
            BodyForce::None => self.move_each::<true>(dt, |mut v, f, _| {
                for _ in 0..KICKS {
                    kick_by(&mut v, &f, t);
                }
                v
            }),
            _ => self.move_each::<true>(dt, |mut v, f, position| {
                let more = body.at(&position, &cell);
                for _ in 0..KICKS {
                    kick_both(&mut v, &f, &more, t);
                }
                v
            }),
        }
    }

    /// Moves the particles, after velocities have become what `kicked` makes of velocity, force and position.
    #[inline(always)]
    fn move_each<const USES_UP: bool>(
        &mut self,
        dt: f64,
        kicked: impl Fn([f64; 4], [f64; 4], [f64; 4]) -> [f64; 4] + Sync + Send,
    ) -> Result<f64> {
        let particles = &mut self.particles;
        let speed2 = particles
            .position
            .par_iter_mut()
            .with_min_len(GRAIN)
            .zip(particles.velocity.par_iter_mut())
            .zip(particles.force.par_iter_mut())
            .map(|((position, velocity), force)| {
                // Read before anything is written: parts of what has just been written are slow to read.
                let (mut x, v, f) = (*position, *velocity, *force);
                let v = kicked(v, f, x);
                for a in 0..3 {
                    x[a] += dt * v[a];
                }
                (*position, *velocity) = (x, v);
                if USES_UP {
                    *force = [0.0; 4];
                }
                visible_square([v[0], v[1], v[2]])
            })
            .reduce(|| 0.0, f64::max);
        if speed2 * dt * dt > RUNAWAY * RUNAWAY {
            return Err(self.find_runaway(dt));
        }
        // No farther than the fastest ones of each step: that spares a look at where they were.
        let way = speed2.sqrt() * dt.abs();
        self.list.travel += way;
        self.gone.since += way;
        Ok(way)
    }

    /// Particles may be anywhere.
    pub(crate) fn lose_track(&mut self) {
        self.gone = Gone::ANYWHERE;
    }

    /// Has a particle left its margin? Seldom does anybody have to look where the grid was renewed.
    pub(crate) fn is_beyond_margin(&mut self) -> bool {
        if !self.gone.may_be_beyond(self.margin) {
            return false;
        }
        let farthest = self
            .particles
            .position
            .par_iter()
            .with_min_len(GRAIN)
            .zip(&self.grid.reference)
            .map(|(position, grid)| square_from(position, grid))
            .reduce(|| 0.0, f64::max);
        self.gone = Gone {
            known: farthest.sqrt(),
            since: 0.0,
        };
        4.0 * farthest > self.margin * self.margin
    }

    /// Renews grid and lists where a particle has left its margin, and prunes the lists where one may have left the skin.
    pub(crate) fn keep_lists<const D: usize>(&mut self, beyond: bool, shuffle: bool) -> Result<()> {
        let result = if beyond {
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
