//! Who may work on which block when. Base blocks next to each other touch the same particles; their
//! colours say which goes first, and that alone fixes the order of all sums, on any number of threads.
//!
//! Threads take blocks colour by colour, each from another place on, always the same one: its particles
//! are in the thread's own cache. Before one works on a block it waits until the blocks next to it that
//! come first are done, not for the whole of their colour; and it does not go to sleep for that, since
//! to wake it takes as long as hundreds of pairs. Nobody ever waits for a thread as such, only for
//! blocks that have been taken: where a helper comes late, or never, others do its work.

use std::sync::atomic::{AtomicU32, Ordering};

use super::grid::coordinates;

/// Looks at a block before a thread lets others have its core.
const PATIENCE: u32 = 4096;

/// The order of base blocks.
#[derive(Debug)]
pub struct Schedule {
    /// Base blocks, colour by colour.
    pub blocks: Vec<u32>,
    /// Where each colour begins among them, and where the last one ends.
    starts: Vec<u32>,
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
    /// For so many blocks along each axis, of `colour` by coordinates.
    pub(super) fn new(blocks: [usize; 3], colour: impl Fn([usize; 3]) -> usize) -> Self {
        let [nx, ny, nz] = blocks;
        let count = nx * ny * nz;
        let number = |at: [usize; 3]| (at[0] + nx * (at[1] + ny * at[2])) as u32;
        let at = |block: usize| coordinates(blocks, block);
        let colour: Vec<u32> = (0..count).map(|block| colour(at(block)) as u32).collect();
        let mut order: Vec<u32> = (0..count as u32).collect();
        order.sort_by_key(|&block| colour[block as usize]);
        let last = colour.iter().max().map_or(0, |&last| last as usize);
        let mut starts = vec![0; last + 2];
        for &colour in &colour {
            starts[colour as usize + 1] += 1;
        }
        for colour in 1..starts.len() {
            starts[colour] += starts[colour - 1];
        }
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
        Self {
            blocks: order,
            starts,
            colour,
            begin,
            next,
            taken: fresh(count),
            done: fresh(count),
            sweeps: AtomicU32::new(0),
        }
    }

    /// Bytes held.
    pub(super) fn bytes(&self) -> usize {
        let tables = [&self.blocks, &self.colour, &self.begin, &self.next];
        8 * self.done.capacity() + 4 * tables.map(Vec::capacity).iter().sum::<usize>()
    }

    /// Calls `work` for every base block, on all threads of the pool. The call is a virtual one, so
    /// that this is compiled once and not for every combination.
    pub fn run(&self, reverse: bool, work: &(dyn Fn(u32) + Sync)) {
        self.share(reverse, &|blocks| blocks(&mut |block| work(block)));
    }

    /// The same where a thread has something to keep from block to block: calls `part` on each, which
    /// calls the function it is given with what to do with a block.
    pub fn share(&self, reverse: bool, part: &(dyn Fn(&Blocks) + Sync)) {
        let threads = rayon::current_num_threads().min(self.blocks.len());
        let sweep = self.sweeps.fetch_add(1, Ordering::Relaxed).wrapping_add(1);
        on_threads(threads, &|| {
            part(&|work| self.take_part(reverse, sweep, threads, work));
        });
    }

    /// Works on blocks until none is left.
    fn take_part(&self, reverse: bool, sweep: u32, threads: usize, work: &mut dyn FnMut(u32)) {
        let thread = rayon::current_thread_index().unwrap_or(0) % threads;
        let colours = self.starts.len() - 1;
        for turn in 0..colours {
            let colour = if reverse { colours - 1 - turn } else { turn };
            let blocks =
                &self.blocks[self.starts[colour] as usize..self.starts[colour + 1] as usize];
            let (after, first) = blocks.split_at(blocks.len() * thread / threads);
            for &block in first.iter().chain(after) {
                let number = block as usize;
                if self.taken[number].swap(sweep, Ordering::Relaxed) == sweep {
                    continue;
                }
                let _done = Done(&self.done[number], sweep);
                if threads > 1 {
                    self.wait(block, reverse, sweep);
                }
                work(block);
            }
        }
    }

    /// Waits until those next to a block that come before it are done.
    fn wait(&self, block: u32, reverse: bool, sweep: u32) {
        let [begin, end] = [0, 1].map(|n| self.begin[block as usize + n] as usize);
        let own = self.colour[block as usize];
        for &other in &self.next[begin..end] {
            let colour = self.colour[other as usize];
            let comes_first = if reverse { colour > own } else { colour < own };
            if !comes_first {
                continue;
            }
            let mut looks = 0;
            while self.done[other as usize].load(Ordering::Acquire) != sweep {
                looks += 1;
                if looks < PATIENCE {
                    std::hint::spin_loop();
                } else {
                    std::thread::yield_now();
                }
            }
        }
    }
}

/// Calls a function for one block after the other, until none is left.
pub type Blocks<'a> = dyn Fn(&mut dyn FnMut(u32)) + 'a;

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
        for edges in [[3.4, 3.4, 3.4], [20.0, 5.2, 7.9], [2.0, 9.3, 13.1]] {
            let cell = PeriodicBox::new(&edges, 1.0).unwrap();
            let grid = Grid::new(&cell, 3, 200_000, 1.1);
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
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
                let pool = pool.build().unwrap();
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
    fn a_panic_reaches_the_caller() {
        let cell = PeriodicBox::new(&[4.4, 9.0, 9.0], 1.0).unwrap();
        let grid = Grid::new(&cell, 3, 5_000, 1.1);
        let pool = rayon::ThreadPoolBuilder::new().num_threads(2);
        let pool = pool.build().unwrap();
        let work = |block| assert!(block != 3, "on purpose");
        let run = || pool.install(|| grid.schedule.run(false, &work));
        let result = std::panic::catch_unwind(std::panic::AssertUnwindSafe(run));
        assert!(result.is_err());
        // the next sweep is none the worse for it
        assert_eq!(log(&grid, &pool, false).len(), 2 * grid.block_count());
    }
}
