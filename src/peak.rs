//! What the machine can do at best: a loop of nothing but multiplications and additions, and one of
//! nothing but loads and stores, by the instructions that the sweeps use. Speeds of steps are told
//! beside them.

use std::hint::black_box;
use std::time::Instant;

use rayon::prelude::*;

use crate::error::{Error, Result};
use crate::sweep::{Task, Wide, run_wide};

const ROUNDS: u64 = 2_000_000;
const REPEATS: usize = 5;
/// Numbers of each of the three arrays of a thread: 48 MB in all, more than a core's own caches hold.
const LENGTH: usize = 2_000_000;

/// Independent sums, so that none has to wait for the one before.
struct Multiply<const CHAINS: usize> {
    start: f64,
}

impl<const CHAINS: usize> Task for Multiply<CHAINS> {
    type Output = f64;

    #[inline(always)]
    fn run<W: Wide>(self) -> f64 {
        let (factor, more) = (W::splat(self.start), W::splat(1e-9));
        let mut sums = [factor; CHAINS];
        for _ in 0..ROUNDS {
            for k in 0..CHAINS {
                sums[k] = more.plus_product(sums[k], factor);
            }
        }
        let (mut total, mut lanes) = (0.0, [0.0; 8]);
        for k in 0..CHAINS {
            // SAFETY: eight lanes.
            unsafe { sums[k].store(lanes.as_mut_ptr()) };
            total += lanes.iter().sum::<f64>();
        }
        total
    }
}

/// Floating-point operations of a thread in such a loop.
fn operations<const CHAINS: usize>() -> f64 {
    black_box(run_wide(Multiply::<CHAINS> {
        start: black_box(0.999),
    }));
    (ROUNDS * 2 * 8 * CHAINS as u64) as f64
}

fn triad(arrays: &mut [Vec<f64>; 3]) -> f64 {
    let [to, a, b] = arrays;
    for ((to, a), b) in to.iter_mut().zip(a).zip(b) {
        *to = *a + 3.0 * *b;
    }
    black_box(&to[LENGTH / 2]);
    (24 * LENGTH) as f64
}

/// The best of some repeats of the same work on all threads at once, a second.
fn best(threads: usize, mut work: impl FnMut() -> f64) -> f64 {
    let once = |work: &mut dyn FnMut() -> f64| {
        let begun = Instant::now();
        let done = work();
        threads as f64 * done / begun.elapsed().as_secs_f64()
    };
    (0..REPEATS).map(|_| once(&mut work)).fold(0.0, f64::max)
}

/// Floating-point operations [1/s] and bytes moved [1/s] on so many threads.
pub fn peak(threads: usize) -> Result<[f64; 2]> {
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .map_err(|e| Error::Invalid(format!("`threads` = {threads}: {e}")))?;
    let multiply = |chains: fn() -> f64| {
        best(threads, || {
            let done = pool.broadcast(|_| chains());
            done.iter().sum::<f64>() / threads as f64
        })
    };
    // As many chains as the units can take, or fewer where there are fewer registers.
    let flops = multiply(operations::<10>).max(multiply(operations::<6>));
    let mut arrays: Vec<[Vec<f64>; 3]> = (0..threads)
        .map(|_| [0.0, 1.0, 2.0].map(|x| vec![x; LENGTH]))
        .collect();
    let bytes = best(threads, || {
        pool.install(|| arrays.par_iter_mut().map(triad).sum::<f64>()) / threads as f64
    });
    Ok([flops, bytes])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn machines_do_more_than_nothing() {
        let [flops, bytes] = peak(1).unwrap();
        assert!(flops > 1e8 && flops < 1e12 && bytes > 1e8 && bytes < 1e13);
    }
}
