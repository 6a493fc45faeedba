//! Drag and noise of links to images, each solved exactly, one after the other, positions frozen: the
//! part of the splitting integrator that belongs to walls. Links go in the order of the pairs they
//! come from, own images come last; a backward sweep is the same from its end.

use std::marker::PhantomData;

use super::wall::{Scenery, View, collect, for_each_links, for_each_near};
use super::{Direction, Shared};
use crate::domain::PeriodicBox;
use crate::kernel::Kernel;
use crate::neighbor::Grid;
use crate::physics::{Exchange, FrictionForm};
use crate::random::{SweepKey, Variate};
use crate::state::Particles;
use crate::wall::{Link, Near, Walls, Wrench};

struct WallExchange<'a, K, F, V, const D: usize> {
    scenery: Scenery<'a>,
    velocity: Shared<'a, [f64; 4]>,
    id: &'a [u64],
    exchange: Exchange,
    key: SweepKey,
    form: PhantomData<(K, F, V)>,
}

impl<K: Kernel, F: FrictionForm, V: Variate, const D: usize> WallExchange<'_, K, F, V, D> {
    /// The change of u, from that of the particles' velocities.
    fn change(&self, view: &View<'_>, [i, j]: [u32; 2], u: [f64; 3], own: bool) -> [f64; 3] {
        let position = self.scenery.position;
        let product = position[i as usize][3] * position[j as usize][3];
        let g = view.weight * K::f::<D>(view.distance) * (product * product);
        let xi = V::ON.then(|| {
            let [p, q] = [self.id[i as usize], self.id[j as usize]];
            let words = self.key.of_image(view.image.label).pair_words(p, q);
            let xi = V::draw(words, D);
            let sign = if view.image.odd() || p < q { 1.0 } else { -1.0 };
            std::array::from_fn(|a| if a < D { sign * xi[a] } else { 0.0 })
        });
        let axes = self.scenery.axes(view);
        self.exchange.link_terms::<F>(g, &axes, xi, own).change(u)
    }

    fn link(&self, link: &Link, tally: &mut [Wrench]) {
        let Some(view) = self.scenery.link::<D>(link) else {
            return;
        };
        let [i, j] = link.slots;
        // SAFETY: blocks of one colour share no particle, and i != j.
        let (v, w) = unsafe { (self.velocity.slot(i), self.velocity.slot(j)) };
        let odd = view.image.odd();
        let mut u = [0.0; 3];
        if odd {
            let wall = self.scenery.wall_velocity(&view);
            for a in 0..D {
                u[a] = v[a] + w[a] - 2.0 * wall[a];
            }
        } else {
            for a in 0..D {
                u[a] = v[a] - w[a];
            }
        }
        let half = self.change(&view, link.slots, u, false).map(|x| 0.5 * x);
        let back = if odd { half } else { half.map(|x| -x) };
        for a in 0..D {
            v[a] += half[a];
            w[a] += back[a];
        }
        self.scenery.react(&view, half, back, tally);
    }

    fn own(&self, walls: &Walls, near: &Near, reverse: bool, tally: &mut [Wrench]) {
        self.scenery.own(walls, near, reverse, |view| {
            if !view.image.odd() {
                return;
            }
            // SAFETY: every slot occurs once among the near ones.
            let v = unsafe { self.velocity.slot(near.slot) };
            let wall = self.scenery.wall_velocity(view);
            let mut u = [0.0; 3];
            for a in 0..D {
                u[a] = v[a] - wall[a];
            }
            let change = self.change(view, [near.slot; 2], u, true);
            for a in 0..D {
                v[a] += change[a];
            }
            self.scenery.react(view, change, [0.0; 3], tally);
        });
    }
}

/// One sweep over all links and own images; the walls' impulses get the reaction.
#[allow(clippy::too_many_arguments)]
pub fn wall_exchange<K: Kernel, F: FrictionForm, V: Variate, const D: usize>(
    particles: &mut Particles,
    walls: &mut Walls,
    grid: &Grid,
    cell: &PeriodicBox,
    exchange: Exchange,
    key: SweepKey,
    direction: Direction,
) {
    if !walls.any() {
        return;
    }
    let mut links = std::mem::take(&mut walls.links);
    let mut tasks = std::mem::take(&mut walls.tasks);
    let mut impulse = std::mem::take(&mut walls.impulse);
    let task = WallExchange::<K, F, V, D> {
        scenery: Scenery {
            images: &walls.images,
            sites: &walls.sites,
            cell,
            position: &particles.position,
        },
        velocity: Shared::new(&mut particles.velocity),
        id: &particles.id,
        exchange,
        key,
        form: PhantomData,
    };
    let backward = direction == Direction::Backward;
    if backward {
        for_each_near(&walls.near, &mut tasks, |near, tally| {
            task.own(walls, near, backward, tally);
        });
    }
    for_each_links(grid, &mut links, backward, |links, tally| {
        if backward {
            links.iter().rev().for_each(|link| task.link(link, tally));
        } else {
            links.iter().for_each(|link| task.link(link, tally));
        }
    });
    if !backward {
        for_each_near(&walls.near, &mut tasks, |near, tally| {
            task.own(walls, near, backward, tally);
        });
    }
    collect(&mut impulse, &links, &tasks);
    walls.impulse = impulse;
    (walls.links, walls.tasks) = (links, tasks);
}
