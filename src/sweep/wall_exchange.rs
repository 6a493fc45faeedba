//! Drag and noise of links to images, each solved exactly, one after the other, positions frozen: the
//! part of the splitting integrator that belongs to walls. Links go in the order of the pairs they
//! come from, own images come last; a backward sweep is the same from its end.

use std::marker::PhantomData;

use super::wall::{Scenery, collect, for_each_links, for_each_near};
use super::wall_model::{self, Physics};
use super::{Direction, Shared};
use crate::kernel::Kernel;
use crate::neighbor::Grid;
use crate::physics::{Exchange, FrictionForm};
use crate::random::{SweepKey, Variate};
use crate::real::Plain;
use crate::state::Particles;
use crate::wall::{View, WallModel, Walls, Wrench};

struct WallExchange<'a, K, F, V, const D: usize> {
    scenery: Scenery<'a>,
    position: &'a [[f64; 4]],
    velocity: Shared<'a, [f64; 4]>,
    id: &'a [u64],
    exchange: Exchange,
    key: SweepKey,
    form: PhantomData<(K, F, V)>,
}

impl<K: Kernel, F: FrictionForm, V: Variate, const D: usize> WallExchange<'_, K, F, V, D> {
    /// The change of u.
    fn change(&self, view: &View, odd: bool, u: [f64; 3], own: bool) -> [f64; 3] {
        let [i, j] = view.link.slots;
        let product = self.position[i as usize][3] * self.position[j as usize][3];
        let g = view.weight * K::f::<_, D>(view.distance) * (product * product);
        let xi = V::ON.then(|| {
            let [p, q] = [self.id[i as usize], self.id[j as usize]];
            let key = self.key.of_image(self.scenery.image(view).label);
            let sign = if odd || p < q { 1.0 } else { -1.0 };
            let xi = V::draw::<Plain, f64>(key.pair_words(p, q), sign, D);
            std::array::from_fn(|a| if a < D { xi[a] } else { 0.0 })
        });
        let terms = self.exchange.link_terms::<F>(g, &view.axes, xi, own);
        terms.change(u)
    }

    fn link(&self, view: &View, tally: &mut [Wrench]) {
        let image = self.scenery.image(view);
        if !image.friction {
            return;
        }
        let [i, j] = view.link.slots;
        // SAFETY: blocks of one colour share no particle, and i != j.
        let (v, w) = unsafe { (self.velocity.slot(i), self.velocity.slot(j)) };
        let odd = image.odd();
        let mut u = [0.0; 3];
        for a in 0..D {
            u[a] = if odd {
                v[a] + w[a] - 2.0 * view.wall[a]
            } else {
                v[a] - w[a]
            };
        }
        let half = self.change(view, odd, u, false).map(|x| 0.5 * x);
        let back = if odd { half } else { half.map(|x| -x) };
        for a in 0..D {
            v[a] += half[a];
            w[a] += back[a];
        }
        self.scenery.react(view, half, back, tally);
    }

    fn own(&self, view: &View, tally: &mut [Wrench]) {
        let image = self.scenery.image(view);
        if !image.friction || !image.odd() {
            return;
        }
        // SAFETY: every slot occurs once among the near ones.
        let v = unsafe { self.velocity.slot(view.link.slots[0]) };
        let mut u = [0.0; 3];
        for a in 0..D {
            u[a] = v[a] - view.wall[a];
        }
        let change = self.change(view, true, u, true);
        for a in 0..D {
            v[a] += change[a];
        }
        self.scenery.react(view, change, [0.0; 3], tally);
    }
}

/// One sweep over all links and own images; the walls' impulses get the reaction.
#[allow(clippy::too_many_arguments)]
pub fn wall_exchange<K: Kernel, F: FrictionForm, V: Variate, const D: usize>(
    particles: &mut Particles,
    walls: &mut Walls,
    grid: &Grid,
    exchange: Exchange,
    key: SweepKey,
    direction: Direction,
) {
    if !walls.any() {
        return;
    }
    if walls.model != WallModel::SymmetricImages {
        let physics = Physics::of::<K, F, V, D>();
        wall_model::exchange(particles, walls, physics, exchange, key, direction);
        return;
    }
    let mut links = std::mem::take(&mut walls.links);
    let mut tasks = std::mem::take(&mut walls.tasks);
    let mut impulse = std::mem::take(&mut walls.impulse);
    let task = WallExchange::<K, F, V, D> {
        scenery: Scenery::of(walls),
        position: &particles.position,
        velocity: Shared::new(&mut particles.velocity),
        id: &particles.id,
        exchange,
        key,
        form: PhantomData,
    };
    let backward = direction == Direction::Backward;
    if backward {
        for_each_near(&walls.near, &mut tasks, &|_, own| {
            for view in own.views.iter().rev() {
                task.own(view, &mut own.tally);
            }
        });
    }
    for_each_links(grid, &mut links, backward, true, &|block| {
        if backward {
            for view in block.views.iter().rev() {
                task.link(view, &mut block.tally);
            }
        } else {
            for view in &block.views {
                task.link(view, &mut block.tally);
            }
        }
    });
    if !backward {
        for_each_near(&walls.near, &mut tasks, &|_, own| {
            for view in &own.views {
                task.own(view, &mut own.tally);
            }
        });
    }
    collect(&mut impulse, &links, &tasks);
    walls.impulse = impulse;
    (walls.links, walls.tasks) = (links, tasks);
}
