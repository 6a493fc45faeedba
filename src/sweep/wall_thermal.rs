//! Walls of a fluid with an energy: the work of the images' pressure, and friction, heating and
//! conduction along links to images (physics/thermal). Kinetic energy lost to a wall at rest
//! heats the particles; conduction takes heat out of them, to a bath of the wall's temperature.

use std::marker::PhantomData;

use rayon::prelude::*;

use super::pair_state::Energies;
use super::thermal_exchange::ThermalSweep;
use super::wall::{Scenery, collect, dot, for_each_links, for_each_near};
use super::{Direction, Shared};
use crate::kernel::Kernel;
use crate::neighbor::{Grid, ROUNDS};
use crate::physics::{Exchanges, ThermalExchange};
use crate::random::{SweepKey, Variate, fmix64, pair_counter};
use crate::real::Plain;
use crate::state::Particles;
use crate::thermal::{Thermal, WallHeat, pick};
use crate::wall::{BlockLinks, OwnImages, View, Walls, Wrench};

/// Adds to the field `work` the sums that belong to images: the change of the density of each end
/// along the mean velocities in `scratch`, with the sign of `pair_work`.
pub fn wall_work<K: Kernel, const D: usize>(
    particles: &mut Particles,
    work: usize,
    walls: &mut Walls,
    grid: &Grid,
) {
    if !walls.any() {
        return;
    }
    let mut links = std::mem::take(&mut walls.links);
    let mut tasks = std::mem::take(&mut walls.tasks);
    let scenery = Scenery::of(walls);
    let work = Shared::new(&mut particles.scalars[work].values);
    let mean = &particles.scratch;
    let rate = |view: &View| {
        let [i, j] = view.link.slots.map(|slot| {
            let u = &mean[slot as usize];
            [u[0], u[1], if D == 3 { u[2] } else { 0.0 }]
        });
        let slope = view.weight * K::f::<_, D>(view.distance);
        let value = view.weight * K::w::<_, D>(view.distance);
        let mut rate = slope * dot(view.r, [0, 1, 2].map(|a| i[a] - j[a]));
        for (one, other) in scenery.ends(view) {
            for (here, there, u) in [(one, other, i), (other, one, j)] {
                let push = 2.0 * slope * there.foot.distance - value * here.slope / here.weight;
                rate += push * dot(here.foot.normal, u);
                rate -= value / here.weight * dot(here.climb, u);
            }
        }
        rate
    };
    for_each_links(grid, &mut links, false, true, &|block| {
        for view in &block.views {
            let rate = rate(view);
            // SAFETY: blocks of one colour share no particle, and the two differ.
            unsafe {
                *work.slot(view.link.slots[0]) += rate;
                *work.slot(view.link.slots[1]) += rate;
            }
        }
    });
    for_each_near(&walls.near, &mut tasks, &|_, own| {
        for view in &own.views {
            // SAFETY: every slot occurs once among the near ones.
            unsafe { *work.slot(view.link.slots[0]) += rate(view) };
        }
    });
    (walls.links, walls.tasks) = (links, tasks);
}

/// No wall is colder, whatever its gradient says of a place.
const COLDEST: f64 = 1e-9;

/// How heat crosses an image of some kind.
enum Passage {
    /// Between the two particles, as between neighbours.
    Mirror,
    /// With a bath of that temperature.
    Bath(f64),
}

struct WallTask<'a, X, V, const D: usize> {
    scenery: Scenery<'a>,
    heat: &'a [WallHeat],
    position: &'a [[f64; 4]],
    velocity: Shared<'a, [f64; 4]>,
    energies: Energies<'a>,
    id: &'a [u64],
    slope: fn(f64) -> f64,
    exchange: &'a ThermalExchange,
    key: SweepKey,
    form: PhantomData<(X, V)>,
}

/// What a view did to its walls: momentum as in the isothermal sweep, and energies.
#[derive(Default)]
struct Dealt {
    heat: f64,
    work: f64,
    refused: u64,
}

impl<X: Exchanges, V: Variate, const D: usize> WallTask<'_, X, V, D> {
    fn passage(&self, view: &View) -> Passage {
        let (mut baths, mut sum) = (0, 0.0);
        let mut count = 0.0;
        for (one, other) in self.scenery.ends(view) {
            if let WallHeat::Isothermal {
                temperature,
                gradient,
            } = self.heat[one.wall as usize]
            {
                baths += 1;
                for site in [one, other] {
                    let at = &self.position[site.slot as usize];
                    let foot = [0, 1, 2].map(|a| at[a] - site.foot.distance * site.foot.normal[a]);
                    sum += temperature + dot(gradient, foot);
                    count += 1.0;
                }
            }
        }
        if baths % 2 == 1 {
            Passage::Bath((sum / count).max(COLDEST))
        } else {
            Passage::Mirror
        }
    }

    /// The round of a sweep in which a view has its turn, by the ids of its particles alone.
    fn round(&self, view: &View) -> usize {
        let [p, q] = view.link.slots.map(|slot| self.id[slot as usize]);
        let [low, high] = pair_counter(p, q);
        fmix64(fmix64(low) ^ high) as usize % ROUNDS
    }

    fn g(&self, view: &View) -> f64 {
        let [i, j] = view.link.slots;
        let product = self.position[i as usize][3] * self.position[j as usize][3];
        view.weight * (self.slope)(view.distance) * (product * product)
    }

    fn variates(&self, view: &View, odd: bool) -> [f64; 4] {
        if !V::ON {
            return [0.0; 4];
        }
        let [p, q] = view.link.slots.map(|slot| self.id[slot as usize]);
        let label = self.scenery.image(view).label;
        let xi = V::draw_four::<Plain>(self.key.of_image(label).pair_words(p, q));
        let sign = if odd || p < q { 1.0 } else { -1.0 };
        [sign * xi[0], sign * xi[1], sign * xi[2], xi[3]]
    }

    fn relative(&self, view: &View, odd: bool) -> [f64; 3] {
        let [i, j] = view.link.slots;
        // SAFETY: blocks of one colour share no particle, and the references end here.
        let (v, w) = unsafe { (*self.velocity.slot(i), *self.velocity.slot(j)) };
        let own = i == j;
        let mut u = [0.0; 3];
        for a in 0..D {
            u[a] = match (own, odd) {
                (true, _) => v[a] - view.wall[a],
                (false, true) => v[a] + w[a] - 2.0 * view.wall[a],
                (false, false) => v[a] - w[a],
            };
        }
        u
    }

    fn friction(&self, view: &View, xi: &[f64; 4], tally: &mut [Wrench], dealt: &mut Dealt) {
        let image = self.scenery.image(view);
        let [i, j] = view.link.slots;
        let (own, odd) = (i == j, image.odd());
        if !X::FRICTION || !image.friction || (own && !odd) {
            return;
        }
        let u = self.relative(view, odd);
        // SAFETY: as above.
        let e = unsafe { [*self.energies.heat.slot(i), *self.energies.heat.slot(j)] };
        let mut noise = [xi[0], xi[1], xi[2]];
        for a in D..3 {
            noise[a] = 0.0;
        }
        let mut g = self.g(view);
        if X::VARIABLE {
            g *= self.viscous_factor(view, e, u);
        }
        let ends = self.energies.ends::<X>([i, j], e);
        let xi = V::ON.then_some(noise);
        let change = self.exchange.link::<X>(g, &view.axes, u, &ends, xi, own);
        // u^2/4 is the energy of a link's relative motion, u^2/2 that of one particle.
        let part = if own { 0.5 } else { 0.125 };
        let gain: f64 = -part
            * (0..3)
                .map(|a| change[a] * (2.0 * u[a] + change[a]))
                .sum::<f64>();
        if X::HEATING && !(e[0] + gain > 0.0 && e[1] + gain > 0.0) {
            dealt.refused += 1;
            return;
        }
        let first = if own { change } else { change.map(|x| 0.5 * x) };
        let second = match (own, odd) {
            (true, _) => [0.0; 3],
            (false, true) => first,
            (false, false) => first.map(|x| -x),
        };
        // SAFETY: as above; an own image changes its particle once.
        unsafe {
            for a in 0..D {
                self.velocity.slot(i)[a] += first[a];
                if !own {
                    self.velocity.slot(j)[a] += second[a];
                }
            }
            if X::HEATING {
                *self.energies.heat.slot(i) += gain;
                if !own {
                    *self.energies.heat.slot(j) += gain;
                }
            }
        }
        for a in 0..3 {
            dealt.work += (first[a] + second[a]) * view.wall[a];
        }
        self.scenery.react(view, first, second, tally);
    }

    fn conduction(&self, view: &View, xi: &[f64; 4], dealt: &mut Dealt) {
        if !X::CONDUCTION {
            return;
        }
        let [i, j] = view.link.slots;
        let own = i == j;
        // SAFETY: as above.
        let e = unsafe { [*self.energies.heat.slot(i), *self.energies.heat.slot(j)] };
        let mut gains = match self.passage(view) {
            Passage::Mirror if own => return,
            Passage::Mirror => {
                let gain = self.mirrored(view, e, xi[3]);
                [gain, -gain]
            }
            Passage::Bath(t) => {
                let ends = self.energies.ends::<X>([i, j], e);
                let xi = V::ON.then_some(xi[3]);
                [self.exchange.bath::<X>(self.g(view), &ends, t, xi, own); 2]
            }
        };
        if !(e[0] + gains[0] > 0.0 && e[1] + gains[1] > 0.0) {
            dealt.refused += 1;
            return;
        }
        if own {
            gains[1] = 0.0;
        }
        // What two particles exchange adds up to nothing.
        dealt.heat -= gains[0] + gains[1];
        // SAFETY: as above; an own image changes its particle once.
        unsafe {
            *self.energies.heat.slot(i) += gains[0];
            if !own {
                *self.energies.heat.slot(j) += gains[1];
            }
        }
    }

    /// What the first particle of a link gains by conduction to the image of the second.
    fn mirrored(&self, view: &View, e: [f64; 2], xi: f64) -> f64 {
        let [i, j] = view.link.slots;
        let sign = if self.id[i as usize] < self.id[j as usize] {
            1.0
        } else {
            -1.0
        };
        let mut g = self.g(view);
        if X::VARIABLE {
            g *= self.energies.conductive_factor::<X>([i, j], e);
        }
        let ends = self.energies.ends::<X>([i, j], e);
        let decay = if X::GENERAL {
            self.exchange.heat_at(g, &ends, V::ON)
        } else {
            self.exchange.heat::<Plain>(g, V::ON)
        };
        ends.conduct(&decay, sign * xi, V::ON)
    }

    /// The factor of eta of a link.
    fn viscous_factor(&self, view: &View, e: [f64; 2], u: [f64; 3]) -> f64 {
        let [i, j] = view.link.slots;
        let square = dot(u, u);
        if i == j {
            self.energies
                .own_viscous_factor::<X>(i, e[0], square, V::ON)
        } else {
            self.energies.viscous_factor::<X>([i, j], e, square, V::ON)
        }
    }

    fn view(&self, view: &View, backward: bool, tally: &mut [Wrench], energies: &mut [[f64; 3]]) {
        let xi = self.variates(view, self.scenery.image(view).odd());
        let mut dealt = Dealt::default();
        if backward {
            self.conduction(view, &xi, &mut dealt);
        }
        self.friction(view, &xi, tally, &mut dealt);
        if !backward {
            self.conduction(view, &xi, &mut dealt);
        }
        // Work goes to all walls of the image in equal parts, heat to the baths among them.
        let walls = || self.scenery.ends(view).map(|(one, _)| one.wall as usize);
        let bath = |&wall: &usize| matches!(self.heat[wall], WallHeat::Isothermal { .. });
        let baths = walls().filter(bath).count();
        for wall in walls() {
            let sums = &mut energies[wall];
            if bath(&wall) {
                sums[0] += dealt.heat / baths as f64;
            }
            sums[1] += dealt.work / self.scenery.image(view).order as f64;
        }
        if let Some(first) = walls().next() {
            energies[first][2] += dealt.refused as f64;
        }
    }
}

/// Walls in a sweep over pairs: in every round their turn comes, and at the end their impulses get
/// the reaction, and their accounts heat and work. Dealt out to the rounds like pairs, links to
/// images leave neither slip nor a jump of temperature behind at long steps.
pub(super) struct WallRounds {
    links: Vec<BlockLinks>,
    tasks: Vec<OwnImages>,
}

impl WallRounds {
    /// Takes the links out of the walls; none where there is no wall.
    pub fn begin(walls: &mut Walls) -> Option<Self> {
        if !walls.any() {
            return None;
        }
        let mut links = std::mem::take(&mut walls.links);
        let mut tasks = std::mem::take(&mut walls.tasks);
        for block in &mut links {
            block.tally.fill([0.0; 6]);
            block.energies.fill([0.0; 3]);
        }
        for task in &mut tasks {
            task.tally.fill([0.0; 6]);
            task.energies.fill([0.0; 3]);
        }
        Some(Self { links, tasks })
    }

    /// The links and own images of one round; own images come last, and backward first.
    pub fn round<X: Exchanges, V: Variate, const D: usize>(
        &mut self,
        particles: &mut Particles,
        walls: &Walls,
        thermal: &Thermal,
        sweep: &ThermalSweep<'_>,
        round: usize,
    ) {
        let backward = sweep.direction == Direction::Backward;
        let task = WallTask::<X, V, D> {
            scenery: Scenery::of(walls),
            heat: &thermal.walls,
            position: &particles.position,
            velocity: Shared::new(&mut particles.velocity),
            energies: Energies {
                heat: Shared::new(&mut particles.scalars[thermal.fields.heat].values),
                states: thermal.states(),
                exchange: &sweep.exchange,
            },
            id: &particles.id,
            slope: sweep.slope,
            exchange: &sweep.exchange,
            key: sweep.key,
            form: PhantomData,
        };
        let each = |views: &[View], tally: &mut [Wrench], energies: &mut [[f64; 3]]| {
            let mut one = |view: &View| {
                if task.round(view) == round {
                    task.view(view, backward, tally, energies);
                }
            };
            if backward {
                views.iter().rev().for_each(&mut one);
            } else {
                views.iter().for_each(&mut one);
            }
        };
        let own = |tasks: &mut [OwnImages]| {
            tasks.par_iter_mut().for_each(|own| {
                each(&own.views, &mut own.tally, &mut own.energies);
            });
        };
        if backward {
            own(&mut self.tasks);
        }
        for_each_links(sweep.grid, &mut self.links, backward, false, &|block| {
            each(&block.views, &mut block.tally, &mut block.energies);
        });
        if !backward {
            own(&mut self.tasks);
        }
    }

    /// Adds up, and gives the links back.
    pub fn finish(self, walls: &mut Walls, thermal: &mut Thermal) {
        let blocks = self.links.iter().filter(|block| !block.links.is_empty());
        let energies = blocks
            .map(|block| &block.energies)
            .chain(self.tasks.iter().map(|task| &task.energies));
        for sums in energies {
            for (wall, [heat, work, refused]) in sums.iter().enumerate() {
                thermal.accounts.walls[wall][0] += heat;
                thermal.accounts.walls[wall][1] += work;
                thermal.accounts.refused += *refused as u64;
            }
        }
        let mut impulse = std::mem::take(&mut walls.impulse);
        collect(&mut impulse, &self.links, &self.tasks);
        walls.impulse = impulse;
        (walls.links, walls.tasks) = (self.links, self.tasks);
    }

    /// The given power of a wall goes to the particles next to it, in proportion to what their
    /// images lack to continue a gradient: sum_J g_iJ phi_j, with which a linear temperature is
    /// steady up to the wall.
    pub fn heat_by_flux(
        &self,
        particles: &mut Particles,
        walls: &Walls,
        thermal: &mut Thermal,
        sweep: &ThermalSweep<'_>,
    ) {
        let scenery = Scenery::of(walls);
        let Thermal {
            walls: conditions,
            fields,
            accounts,
            ..
        } = thermal;
        let Particles {
            scalars, position, ..
        } = particles;
        for (wall, condition) in conditions.iter().enumerate() {
            let WallHeat::Flux { power } = *condition else {
                continue;
            };
            let shares = &mut scalars[fields.work].values;
            shares.fill(0.0);
            let blocks = self.links.iter().flat_map(|block| &block.views);
            for view in blocks.chain(self.tasks.iter().flat_map(|task| &task.views)) {
                let [i, j] = view.link.slots.map(|slot| slot as usize);
                if scenery.image(view).order > 1 {
                    continue;
                }
                let product = position[i][3] * position[j][3];
                let g = view.weight * (sweep.slope)(view.distance) * (product * product);
                for (one, other) in scenery.ends(view) {
                    if one.wall as usize == wall {
                        shares[i] += g * other.foot.distance.max(0.0);
                        if i != j {
                            shares[j] += g * one.foot.distance.max(0.0);
                        }
                    }
                }
            }
            let total: f64 = shares.iter().sum();
            if total <= 0.0 {
                accounts.refused += 1;
                continue;
            }
            let scale = power * sweep.time / total;
            let mut given = 0.0;
            let [shares, heat] = pick(scalars, [fields.work, fields.heat]);
            for (heat, share) in heat.iter_mut().zip(shares) {
                // No more is taken than half of what there is.
                let part = (scale * *share).max(-0.5 * *heat);
                accounts.refused += u64::from(part > scale * *share);
                *heat += part;
                given += part;
            }
            accounts.walls[wall][0] -= given;
        }
    }
}
