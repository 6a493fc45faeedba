//! A sequence of words for one particle, for what happens once: initial positions and velocities.
//! It is an ordinary generator to `rand`, so every distribution of `rand_distr` can draw from it.

use std::convert::Infallible;

use rand::TryRng;

use super::{Stream, philox4x32};

/// Words of (seed, stream, id): word after word of successive counters.
#[derive(Debug, Clone)]
pub struct Sequence {
    key: [u32; 2],
    counter: [u32; 4],
    words: [u32; 4],
    used: usize,
}

impl Sequence {
    /// The sequence of one particle.
    pub fn new(seed: u64, stream: Stream, id: u64) -> Self {
        Self {
            key: [seed as u32, (seed >> 32) as u32],
            counter: [id as u32, (id >> 32) as u32, 0, (stream as u32) << 24],
            words: [0; 4],
            used: 4,
        }
    }
}

impl TryRng for Sequence {
    type Error = Infallible;

    fn try_next_u32(&mut self) -> Result<u32, Infallible> {
        if self.used == 4 {
            self.words = philox4x32(self.counter, self.key);
            self.counter[2] += 1;
            self.used = 0;
        }
        self.used += 1;
        Ok(self.words[self.used - 1])
    }

    fn try_next_u64(&mut self) -> Result<u64, Infallible> {
        Ok(u64::from(self.try_next_u32()?) | u64::from(self.try_next_u32()?) << 32)
    }

    fn try_fill_bytes(&mut self, bytes: &mut [u8]) -> Result<(), Infallible> {
        for chunk in bytes.chunks_mut(4) {
            let word = self.try_next_u32()?.to_le_bytes();
            chunk.copy_from_slice(&word[..chunk.len()]);
        }
        Ok(())
    }
}
