//! Where the time of a run goes. The clock is read a few times a step, whatever the number of
//! particles; nothing that a run computes depends on it.

use std::time::{Duration, Instant};

/// A part of the step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Phase {
    /// Grid and lists, which of their pairs to work on, and who is near a wall.
    Lists,
    /// Densities, pressures and temperatures of the particles.
    Densities,
    /// Forces between particles.
    Forces,
    /// Exchanges of momentum and heat between particles.
    Exchanges,
    /// Densities, forces and exchanges at walls, and collisions with them.
    Walls,
    /// Kicks, drifts and the books of energies.
    Motion,
    /// Observers, their own sums inside the sweeps not included.
    Observers,
}

/// All phases and their names.
pub const PHASES: [(Phase, &str); 7] = [
    (Phase::Lists, "lists"),
    (Phase::Densities, "densities"),
    (Phase::Forces, "forces"),
    (Phase::Exchanges, "exchanges"),
    (Phase::Walls, "walls"),
    (Phase::Motion, "motion"),
    (Phase::Observers, "observers"),
];

/// Wall time by phase.
#[derive(Debug, Clone)]
pub struct Stopwatch {
    spent: [Duration; PHASES.len()],
    since: Instant,
    running: bool,
    /// Steps done meanwhile.
    pub steps: u64,
}

impl Default for Stopwatch {
    fn default() -> Self {
        Self {
            spent: [Duration::ZERO; PHASES.len()],
            since: Instant::now(),
            running: false,
            steps: 0,
        }
    }
}

impl Stopwatch {
    /// A run begins: the time since the last one is nobody's.
    pub fn begin(&mut self) {
        self.since = Instant::now();
        self.running = true;
    }

    /// It ends after so many steps: what is brought up to date between runs does not count.
    pub fn end(&mut self, steps: u64) {
        self.running = false;
        self.steps += steps;
    }

    /// What has been done since the last call belongs to a phase.
    #[inline]
    pub fn lap(&mut self, phase: Phase) {
        if !self.running {
            return;
        }
        let now = Instant::now();
        self.spent[phase as usize] += now - self.since;
        self.since = now;
    }

    /// Seconds by phase.
    pub fn seconds(&self) -> [f64; PHASES.len()] {
        self.spent.map(|time| time.as_secs_f64())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn time_goes_to_the_phase_that_ends() {
        let mut stopwatch = Stopwatch::default();
        std::thread::sleep(Duration::from_millis(20));
        stopwatch.begin();
        std::thread::sleep(Duration::from_millis(5));
        stopwatch.lap(Phase::Forces);
        stopwatch.lap(Phase::Motion);
        stopwatch.end(3);
        stopwatch.lap(Phase::Lists);
        assert_eq!(stopwatch.steps, 3);
        assert_eq!(stopwatch.seconds()[Phase::Lists as usize], 0.0);
        let seconds = stopwatch.seconds();
        assert!(seconds[Phase::Forces as usize] >= 0.005);
        assert!(seconds.iter().sum::<f64>() < 0.02);
        for (k, (phase, _)) in PHASES.iter().enumerate() {
            assert_eq!(*phase as usize, k);
        }
    }
}
