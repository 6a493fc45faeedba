//! Who may work on which block when. Base blocks next to each other touch the same particles; their
//! colours say which goes first, and that alone fixes the order of all sums, on any number of threads.
//!
//! Within this freedom a thread works on blocks near each other one after the other, so that particles
//! are still in its cache when the next block wants them: along layers of blocks, each odd layer as soon
//! as the even ones beside it are done. Each thread has a stack of layers of its own, always the same
//! one. Where there are too few layers for that, threads take blocks colour by colour, each from another
//! place on.
//!
//! Before a thread works on a block it sees to those next to it that come first: it takes those that
//! nobody has taken, and waits for the others; and it does not go to sleep for that, since to wake it
//! takes as long as hundreds of pairs. Nobody ever waits for a thread as such, only for blocks that
//! have been taken: where a helper comes late, or never, others do its work.

use std::sync::atomic::{AtomicU32, Ordering};

use super::grid::coordinates;

/// Looks at a block before a thread lets others have its core.
const PATIENCE: u32 = 4096;

/// Fewest pairs of layers a thread must have, unless all have the same number: the last pair of the
/// last thread is hardly shared.
const PAIRS_OF_LAYERS: usize = 4;

/// The order of base blocks.
#[derive(Debug)]
pub struct Schedule {
    /// Base blocks in the order of one thread.
    blocks: Vec<u32>,
    /// They are gone through group by group, and shared out by the unit within each.
    groups: Vec<Group>,
    /// Colour of each base block.
    colour: Vec<u32>,
    /// Base blocks next to each, where they begin and all of them.
    begin: Vec<u32>,
    next: Vec<u32>,
    /// The last sweep in which each base block was taken, and in which it was done.
    taken: Vec<AtomicU32>,
    done: Vec<AtomicU32>,
    sweeps: AtomicU32,
}

/// Base blocks that follow each other in the order.
#[derive(Debug, Clone, Copy)]
struct Group {
    start: usize,
    count: usize,
    unit: usize,
}

impl Group {
    /// Where the share of a thread begins; that of the next one is where it ends.
    fn share(&self, thread: usize, threads: usize) -> usize {
        self.unit * (self.count / self.unit * thread / threads)
    }
}

/// One sweep over all base blocks.
#[derive(Clone, Copy)]
struct Sweep {
    number: u32,
    reverse: bool,
    threads: usize,
}

fn fresh(count: usize) -> Vec<AtomicU32> {
    (0..count).map(|_| AtomicU32::new(0)).collect()
}

/// Notes that a block is done, whatever became of it: a panic must not keep the others waiting.
struct Done<'a>(&'a AtomicU32, u32);

impl Drop for Done<'_> {
    fn drop(&mut self) {
        self.0.store(self.1, Ordering::Release);
    }
}

impl Schedule {
    /// For so many blocks along each axis, of `colour` by coordinates, and that number of threads (others
    /// may come, but the order is made for these).
    pub(super) fn new(
        blocks: [usize; 3],
        threads: usize,
        colour: impl Fn([usize; 3]) -> usize,
    ) -> Self {
        let [nx, ny, nz] = blocks;
        let count = nx * ny * nz;
        let number = |at: [usize; 3]| (at[0] + nx * (at[1] + ny * at[2])) as u32;
        let at = |block: usize| coordinates(blocks, block);
        let colour: Vec<u32> = (0..count).map(|block| colour(at(block)) as u32).collect();
        let (mut begin, mut next) = (vec![0], Vec::new());
        for block in 0..count {
            let mut around: Vec<u32> = (0..27_usize)
                .map(|step| {
                    let steps = [step % 3, step / 3 % 3, step / 9];
                    number(std::array::from_fn(|a| {
                        (at(block)[a] + blocks[a] + steps[a] - 1) % blocks[a]
                    }))
                })
                .filter(|&other| other as usize != block)
                .collect();
            around.sort_unstable();
            around.dedup();
            next.extend(around);
            begin.push(next.len() as u32);
        }
        let mut schedule = Self {
            blocks: Vec::with_capacity(count),
            groups: Vec::new(),
            colour,
            begin,
            next,
            taken: fresh(count),
            done: fresh(count),
            sweeps: AtomicU32::new(0),
        };
        let layers = blocks.into_iter().rev().find(|&n| n > 1).unwrap_or(1);
        let (pairs, threads) = (layers / 2, threads.max(1));
        let enough = pairs >= PAIRS_OF_LAYERS * threads || pairs.is_multiple_of(threads);
        if layers.is_multiple_of(2) && enough {
            schedule.go_by_layers(count / pairs, threads);
        } else {
            schedule.go_by_colours();
        }
        schedule
    }

    /// Each share in the order of its blocks' numbers, but those next to one that come first before it.
    fn go_by_layers(&mut self, unit: usize, threads: usize) {
        let group = Group {
            start: 0,
            count: self.colour.len(),
            unit,
        };
        let mut seen = vec![false; group.count];
        let mut path = Vec::new();
        for thread in 0..threads {
            let [from, to] = [thread, thread + 1].map(|t| group.share(t, threads) as u32);
            for block in from..to {
                path.push(block);
                while let Some(&last) = path.last() {
                    let before = self.before(last, false);
                    let missing =
                        |other: &u32| (from..to).contains(other) && !seen[*other as usize];
                    if let Some(other) = before.into_iter().find(missing) {
                        path.push(other);
                        continue;
                    }
                    path.pop();
                    if !std::mem::replace(&mut seen[last as usize], true) {
                        self.blocks.push(last);
                    }
                }
            }
        }
        self.groups.push(group);
    }

    fn go_by_colours(&mut self) {
        self.blocks = self.in_order();
        let colours = self
            .blocks
            .chunk_by(|&a, &b| self.colour[a as usize] == self.colour[b as usize]);
        let mut start = 0;
        for blocks in colours {
            let count = blocks.len();
            self.groups.push(Group {
                start,
                count,
                unit: 1,
            });
            start += count;
        }
    }

    /// Base blocks in an order in which one thread may work on them, whatever the order of the others.
    pub fn in_order(&self) -> Vec<u32> {
        let mut blocks: Vec<u32> = (0..self.colour.len() as u32).collect();
        blocks.sort_by_key(|&block| self.colour[block as usize]);
        blocks
    }

    /// Bytes held.
    pub(super) fn bytes(&self) -> usize {
        let tables = [&self.blocks, &self.colour, &self.begin, &self.next];
        8 * self.done.capacity() + 4 * tables.map(Vec::capacity).iter().sum::<usize>()
    }

    /// Calls `work` for every base block, on all threads of the pool. The call is a virtual one, so
    /// that this is compiled once and not for every combination.
    pub fn run(&self, reverse: bool, work: &(dyn Fn(u32) + Sync)) {
        self.share(reverse, &|blocks| blocks(&mut |block, _| work(block)));
    }

    /// The same where a thread has something to keep from block to block: calls `part` on each, which
    /// calls the function it is given with what to do with a block. That gets the block, and the one that
    /// is likely to be next.
    pub fn share(&self, reverse: bool, part: &(dyn Fn(&Blocks) + Sync)) {
        let sweep = Sweep {
            number: self.sweeps.fetch_add(1, Ordering::Relaxed).wrapping_add(1),
            reverse,
            threads: rayon::current_num_threads().min(self.blocks.len()),
        };
        on_threads(sweep.threads, &|| part(&|work| self.take_part(sweep, work)));
    }

    /// Works on blocks until none is left.
    fn take_part(&self, sweep: Sweep, work: &mut dyn FnMut(u32, u32)) {
        let threads = sweep.threads;
        let thread = rayon::current_thread_index().unwrap_or(0) % threads;
        for turn in 0..self.groups.len() {
            let last = self.groups.len() - 1;
            let group = self.groups[if sweep.reverse { last - turn } else { turn }];
            let count = group.count;
            let [from, to] = [thread, thread + 1].map(|t| group.share(t, threads));
            let block = |k: usize| {
                let place = if sweep.reverse {
                    to + 2 * count - 1 - k
                } else {
                    from + k
                };
                self.blocks[group.start + place % count]
            };
            for k in 0..count {
                self.take(block(k), block(k + 1), sweep, work);
            }
        }
    }

    /// Works on a block unless someone has taken it, and before that on those that come first.
    fn take(&self, block: u32, next: u32, sweep: Sweep, work: &mut dyn FnMut(u32, u32)) {
        let number = block as usize;
        if self.taken[number].swap(sweep.number, Ordering::Relaxed) == sweep.number {
            return;
        }
        let _done = Done(&self.done[number], sweep.number);
        // As deep as there are colours.
        for other in self.before(block, sweep.reverse) {
            self.take(other, block, sweep, work);
        }
        if sweep.threads > 1 {
            for other in self.before(block, sweep.reverse) {
                self.wait(other, sweep);
            }
        }
        work(block, next);
    }

    /// Those next to a block that come before it.
    fn before(&self, block: u32, reverse: bool) -> impl Iterator<Item = u32> + '_ {
        let [begin, end] = [0, 1].map(|n| self.begin[block as usize + n] as usize);
        let own = self.colour[block as usize];
        self.next[begin..end].iter().copied().filter(move |&other| {
            let colour = self.colour[other as usize];
            if reverse { colour > own } else { colour < own }
        })
    }

    /// Waits until a block is done.
    fn wait(&self, block: u32, sweep: Sweep) {
        let mut looks = 0;
        while self.done[block as usize].load(Ordering::Acquire) != sweep.number {
            looks += 1;
            if looks < PATIENCE {
                std::hint::spin_loop();
            } else {
                std::thread::yield_now();
            }
        }
    }
}

/// Calls a function for one block after the other, until none is left.
pub type Blocks<'a> = dyn Fn(&mut dyn FnMut(u32, u32)) + 'a;

/// Calls the same on so many threads at once, as far as they are free. Allocates nothing.
fn on_threads(threads: usize, work: &(dyn Fn() + Sync)) {
    if threads < 2 {
        return work();
    }
    let half = threads / 2;
    rayon::join(
        || on_threads(threads - half, work),
        || on_threads(half, work),
    );
}

#[cfg(test)]
mod tests {
    use std::collections::{HashMap, HashSet};
    use std::sync::Mutex;

    use super::super::Grid;
    use crate::domain::PeriodicBox;

    fn pool(threads: usize) -> rayon::ThreadPool {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        pool.build().unwrap()
    }

    /// Blocks in the order in which they were begun and ended.
    fn log(grid: &Grid, pool: &rayon::ThreadPool, reverse: bool) -> Vec<(u32, bool)> {
        let log = Mutex::new(Vec::new());
        pool.install(|| {
            grid.schedule.run(reverse, &|block| {
                log.lock().unwrap().push((block, true));
                std::hint::black_box((0..200 * (block % 7)).sum::<u32>());
                log.lock().unwrap().push((block, false));
            });
        });
        log.into_inner().unwrap()
    }

    /// Blocks whose particles a base block touches, by coordinates: known without the schedule.
    fn touched(grid: &Grid, base: usize) -> HashSet<[usize; 3]> {
        let [nx, ny, _] = grid.blocks;
        let at = [base % nx, base / nx % ny, base / (nx * ny)];
        (0..8_usize)
            .map(|corner| std::array::from_fn(|a| (at[a] + (corner >> a & 1)) % grid.blocks[a]))
            .collect()
    }

    #[test]
    fn blocks_that_touch_the_same_particles_take_turns_by_colour() {
        let boxes = [[3.4, 3.4, 3.4], [20.0, 5.2, 7.9], [2.0, 9.3, 13.1]];
        for (edges, made_for) in boxes.into_iter().flat_map(|edges| [(edges, 1), (edges, 4)]) {
            let cell = PeriodicBox::new(&edges, 1.0).unwrap();
            let grid = pool(made_for).install(|| Grid::new(&cell, 3, 200_000, 1.1));
            let schedule = &grid.schedule;
            let own: Vec<_> = (0..grid.block_count()).map(|b| touched(&grid, b)).collect();
            let mut rivals = Vec::new();
            for (block, mine) in own.iter().enumerate() {
                for (other, theirs) in own.iter().enumerate() {
                    if block != other && !mine.is_disjoint(theirs) {
                        assert_ne!(schedule.colour[block], schedule.colour[other]);
                        rivals.push((block as u32, other as u32));
                    }
                }
            }
            for threads in [1, 2, 5] {
                let pool = pool(threads);
                for reverse in [false, true, false] {
                    let log = log(&grid, &pool, reverse);
                    let mut times = HashMap::new();
                    for (time, &(block, begins)) in log.iter().enumerate() {
                        assert!(times.insert((block, begins), time).is_none());
                    }
                    assert_eq!(times.len(), 2 * grid.block_count());
                    for &(block, other) in &rivals {
                        let [a, b] = [block, other].map(|n| schedule.colour[n as usize]);
                        if (a < b) != reverse {
                            assert!(times[&(block, false)] < times[&(other, true)]);
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn a_thread_with_layers_of_its_own_waits_for_none_but_the_first_of_the_next_one() {
        // Blocks along z, and threads that get layers.
        for (blocks, by_layers) in [(12, vec![1, 2, 3, 6]), (18, vec![1, 2, 3, 9]), (3, vec![])] {
            for threads in 1..=9 {
                let cell = PeriodicBox::new(&[9.0, 4.5, 1.12 * blocks as f64], 1.0).unwrap();
                let grid = pool(threads).install(|| Grid::new(&cell, 3, 50_000, 1.1));
                assert_eq!(grid.blocks[2], blocks);
                let schedule = &grid.schedule;
                assert_eq!(schedule.groups.len() == 1, by_layers.contains(&threads));
                let mut all = schedule.blocks.clone();
                all.sort_unstable();
                assert!(all.iter().copied().eq(0..grid.block_count() as u32));
                if schedule.groups.len() > 1 {
                    continue;
                }
                let layer = grid.block_count() / blocks;
                for thread in 0..threads {
                    let share = [thread, thread + 1].map(|t| schedule.groups[0].share(t, threads));
                    let first = schedule.blocks[share[0]] as usize / layer;
                    assert_eq!(first % 2, 0);
                    let next = share[1] / layer % blocks;
                    let mut seen = HashSet::new();
                    for &block in &schedule.blocks[share[0]..share[1]] {
                        for other in schedule.before(block, false) {
                            let ours = share[0]..share[1];
                            let of_next = other as usize / layer == next && next.is_multiple_of(2);
                            assert!(
                                seen.contains(&other)
                                    || of_next && !ours.contains(&(other as usize))
                            );
                        }
                        seen.insert(block);
                    }
                }
            }
        }
    }

    #[test]
    fn a_panic_reaches_the_caller() {
        let cell = PeriodicBox::new(&[4.4, 9.0, 9.0], 1.0).unwrap();
        let grid = Grid::new(&cell, 3, 5_000, 1.1);
        let pool = pool(2);
        let work = |block| assert!(block != 3, "on purpose");
        let run = || pool.install(|| grid.schedule.run(false, &work));
        let result = std::panic::catch_unwind(std::panic::AssertUnwindSafe(run));
        assert!(result.is_err());
        // the next sweep is none the worse for it
        assert_eq!(log(&grid, &pool, false).len(), 2 * grid.block_count());
    }
}
