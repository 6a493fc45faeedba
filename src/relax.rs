//! Initial states: Maxwellian velocities, and random positions relaxed into a fluid-like packing.
//!
//! Relaxation is steepest descent in the potential of a linear repulsion, u(d) = d (so P/d^2 = 1
//! for every particle), with the longest displacement of an iteration capped: it spreads any start,
//! coincident particles included, and leaves no lattice.

use rand_distr::{Distribution, StandardNormal, StandardUniform};

use crate::domain::PeriodicBox;
use crate::error::Result;
use crate::kernel::WendlandC2;
use crate::neighbor::{Grid, PairList};
use crate::physics::{Frictionless, PairFriction};
use crate::random::{Sequence, Silent, Stream, SweepKey};
use crate::state::Particles;
use crate::sweep::{Double, number_densities, pair_forces, wall_densities, wall_forces};
use crate::wall::Walls;

/// Normal velocities of unit variance by row, (n, D), before any momentum is taken off.
pub fn normal_velocities(n: usize, dimension: usize, seed: u64) -> Vec<f64> {
    (0..n as u64)
        .flat_map(|id| {
            let mut sequence = Sequence::new(seed, Stream::InitialVelocity, id);
            (0..dimension)
                .map(move |_| StandardNormal.sample(&mut sequence))
                .collect::<Vec<f64>>()
        })
        .collect()
}

/// Uniform positions in the unit box by row, (n, D).
pub fn uniform_positions(n: usize, dimension: usize, seed: u64) -> Vec<f64> {
    (0..n as u64)
        .flat_map(|id| {
            let mut sequence = Sequence::new(seed, Stream::InitialPosition, id);
            (0..dimension)
                .map(move |_| StandardUniform.sample(&mut sequence))
                .collect::<Vec<f64>>()
        })
        .collect()
}

/// Relaxes positions [h], row by row, in place: iterations `slice` of `total`, which a caller may do
/// in several calls. `volume` [h^D] is that of the fluid; `walls` are those for Wendland C2. Returns
/// the relative standard deviation of the kernel density at the end.
pub fn relax<const D: usize>(
    positions: &mut [[f64; 3]],
    cell: &PeriodicBox,
    walls: &mut Walls,
    volume: f64,
    slice: std::ops::Range<u32>,
    total: u32,
) -> Result<f64> {
    let n = positions.len();
    let spacing = (volume / n as f64).powf(1.0 / D as f64);
    let skin = (0.3 * spacing).clamp(0.02, 0.3);
    let mut particles = Particles::new(n, false);
    for (record, position) in particles.position.iter_mut().zip(positions.iter()) {
        *record = [position[0], position[1], position[2], 0.0];
    }
    let mut grid = Grid::new(cell, D, n, 1.0 + skin);
    let mut list = PairList::default();
    let silent = PairFriction {
        across: 0.0,
        along: 0.0,
        thermal_energy: 0.0,
    }
    .kick(1.0);
    let key = SweepKey::new(0, Stream::InitialPosition, 0, 0);
    let mut stale = true;
    for iteration in slice {
        if stale {
            grid.renew(cell, D, &mut particles);
            list.build::<D>(&grid, cell, &mut particles, 1.0 + skin, false);
            if list.overflow {
                return Err(list.overflow_error());
            }
            walls.rebuild::<D>(&particles, &grid, &list, cell, skin);
        }
        wall_densities::<WendlandC2, D>(&mut particles, walls, &grid, cell);
        for record in &mut particles.velocity {
            record[3] = 1.0;
        }
        pair_forces::<WendlandC2, Frictionless, Silent, Double, D>(
            &mut particles,
            &grid,
            &list,
            cell,
            silent,
            key,
            None,
        );
        wall_forces::<WendlandC2, Frictionless, Silent, D>(
            &mut particles,
            walls,
            &grid,
            silent,
            key,
        );
        let square = |f: &[f64; 4]| f[..D].iter().map(|x| x * x).sum::<f64>();
        let largest = particles
            .force
            .iter()
            .map(square)
            .fold(0.0, f64::max)
            .sqrt();
        if largest <= 0.0 {
            break;
        }
        // Step: limited for the worst particle, and falling so that the packing settles.
        let progress = f64::from(iteration) / f64::from(total);
        let step = 0.2 * spacing * (1.0 - 0.9 * progress) / largest;
        stale = false;
        for slot in 0..n {
            let force = particles.force[slot];
            let position = &mut particles.position[slot];
            for a in 0..D {
                position[a] += step * force[a];
            }
        }
        walls.bounce(&mut particles, cell);
        for slot in 0..n {
            let position = &particles.position[slot];
            let moved: f64 = (0..D)
                .map(|a| (position[a] - grid.reference[slot][a]).powi(2))
                .sum();
            stale |= 4.0 * moved > skin * skin;
        }
    }
    grid.renew(cell, D, &mut particles);
    list.build::<D>(&grid, cell, &mut particles, 1.0, false);
    walls.rebuild::<D>(&particles, &grid, &list, cell, 0.0);
    number_densities::<WendlandC2, Double, D>(&mut particles, &grid, &mut list, cell);
    wall_densities::<WendlandC2, D>(&mut particles, walls, &grid, cell);
    for slot in 0..n {
        let position = particles.position[slot];
        positions[particles.row[slot] as usize] = [position[0], position[1], position[2]];
    }
    let mean = particles.density.iter().sum::<f64>() / n as f64;
    let variance: f64 = particles.density.iter().map(|d| (d - mean).powi(2)).sum();
    Ok((variance / n as f64).sqrt() / mean)
}
