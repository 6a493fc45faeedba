//! Randomness by counters: (seed, stream, step, draw, id pair) is the key and nothing else is, so
//! the numbers do not depend on threads, storage order or how a run is cut into pieces.

mod philox;
mod sequence;
mod variates;

#[cfg(target_arch = "x86_64")]
pub(crate) use philox::{MULTIPLIER_0, MULTIPLIER_1, ROUNDS, WEYL_0, WEYL_1};
pub use philox::{philox4x32, philox4x32_lanes};
pub use sequence::Sequence;
pub use variates::{Gaussian, Silent, Uniform, Variate};

/// Every use of random numbers has its own stream; two uses can never share a counter.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum Stream {
    /// Random force of velocity Verlet.
    PairForce = 1,
    /// Exact velocity exchange of the pair splitting.
    PairExchange = 2,
    /// Exchange of momentum and heat of the thermal splitting.
    PairThermal = 5,
    /// Acceptance of those exchanges.
    PairAcceptance = 6,
    /// Random force and heat of velocity Verlet with energies.
    PairThermalForce = 7,
    /// Initial velocities.
    InitialVelocity = 3,
    /// Initial positions.
    InitialPosition = 4,
}

impl Stream {
    /// The stream of a given name, as the Python side spells it.
    pub fn parse(name: &str) -> Option<Self> {
        Some(match name {
            "pair_force" => Self::PairForce,
            "pair_exchange" => Self::PairExchange,
            "pair_thermal" => Self::PairThermal,
            "pair_acceptance" => Self::PairAcceptance,
            "pair_thermal_force" => Self::PairThermalForce,
            "initial_velocity" => Self::InitialVelocity,
            "initial_position" => Self::InitialPosition,
            _ => return None,
        })
    }
}

/// The part of a pair's counter and key that all pairs of one sweep share.
#[derive(Debug, Clone, Copy)]
pub struct SweepKey {
    /// Philox key: the seed.
    pub key: [u32; 2],
    /// Counter words 2 and 3: step, draw, stream.
    pub tail: [u64; 2],
}

impl SweepKey {
    /// Key of one sweep; steps are taken modulo 2^48.
    pub fn new(seed: u64, stream: Stream, step: u64, draw: u8) -> Self {
        let high = ((step >> 32) & 0xffff) | u64::from(draw) << 16 | (stream as u64) << 24;
        Self {
            key: [seed as u32, (seed >> 32) as u32],
            tail: [step & 0xffff_ffff, high],
        }
    }

    /// The key of links to images of the kind `label`, 1 to 127; 0 is the key of direct pairs.
    pub fn of_image(mut self, label: u8) -> Self {
        self.tail[1] |= u64::from(label) << 17;
        self
    }

    /// The key of one of several sweeps of a half step, 0 to 255; 0 is the key of an only one. Steps
    /// then count modulo 2^40.
    pub fn of_part(mut self, part: u8) -> Self {
        self.tail[1] |= u64::from(part) << 8;
        self
    }

    /// The word of a particle in this sweep, from which those of its pairs are made ([`blend`]): of the
    /// counter of a pair with itself, which no pair has.
    pub fn particle_word(&self, id: u64) -> u32 {
        self.pair_words(id, id)[0] as u32
    }

    /// The four words of a pair, the same for (a, b) and (b, a).
    #[inline(always)]
    pub fn pair_words(&self, id_a: u64, id_b: u64) -> [u64; 4] {
        let [c0, c1] = pair_counter(id_a, id_b);
        philox4x32_lanes([c0, c1, self.tail[0], self.tail[1]], self.key)
    }
}

/// Counter words 0 and 1 of a pair: the two ids, collision-free below 2^32; higher bits are mixed in.
#[inline(always)]
pub fn pair_counter(id_a: u64, id_b: u64) -> [u64; 2] {
    let (low, high) = if id_a < id_b {
        (id_a, id_b)
    } else {
        (id_b, id_a)
    };
    // Ids are counted from 0, so the mixing is hardly ever needed; fmix64(0) = 0.
    let beyond = (low >> 32) | (high & 0xffff_ffff_0000_0000);
    let mixed = if beyond == 0 { 0 } else { fmix64(beyond) };
    [
        (low & 0xffff_ffff) ^ (mixed & 0xffff_ffff),
        (high & 0xffff_ffff) ^ (mixed >> 32),
    ]
}

/// A word of a pair from those of its particles, the same for (a, b) and (b, a); another one for each
/// `turn`. Words of particles are as good as independent of each other and from sweep to sweep, so
/// that each pair has bits of its own by their sum alone; the mixing undoes what sums have in common,
/// (a + b) + (c + d) = (a + d) + (b + c).
#[inline(always)]
pub fn blend(word_a: u32, word_b: u32, turn: u32) -> u32 {
    fmix32(word_a.wrapping_add(word_b) ^ turn.wrapping_mul((GOLDEN >> 32) as u32))
}

/// 2^64 by the golden ratio: multiples of it differ in all bits.
pub const GOLDEN: u64 = 0x9E37_79B9_7F4A_7C15;

/// Finaliser of MurmurHash3 (Appleby): a bijection of 64-bit words with fmix64(0) = 0.
#[inline(always)]
pub fn fmix64(mut word: u64) -> u64 {
    word ^= word >> 33;
    word = word.wrapping_mul(0xff51_afd7_ed55_8ccd);
    word ^= word >> 33;
    word = word.wrapping_mul(0xc4ce_b9fe_1a85_ec53);
    word ^ (word >> 33)
}

/// The same of 32-bit words.
#[inline(always)]
fn fmix32(mut word: u32) -> u32 {
    word ^= word >> 16;
    word = word.wrapping_mul(0x85eb_ca6b);
    word ^= word >> 13;
    word = word.wrapping_mul(0xc2b2_ae35);
    word ^ (word >> 16)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pair_has_one_counter_and_streams_differ() {
        let key = SweepKey::new(7, Stream::PairForce, 3, 0);
        assert_eq!(key.pair_words(4, 9), key.pair_words(9, 4));
        let wide = 1_u64 << 40;
        assert_ne!(pair_counter(4, 9), pair_counter(4 + wide, 9));
        assert_ne!(pair_counter(4, 9), pair_counter(4, 9 + wide));
        let other = SweepKey::new(7, Stream::PairExchange, 3, 0);
        assert_ne!(key.pair_words(4, 9), other.pair_words(4, 9));
        let image = key.of_image(1);
        assert_ne!(key.pair_words(4, 9), image.pair_words(4, 9));
        assert_eq!(key.tail, key.of_image(0).tail);
        assert_eq!(key.tail, key.of_part(0).tail);
        let part = SweepKey::new(7, Stream::PairForce, 3, 1).of_part(255);
        assert_eq!(part.tail[1], 0xff << 8 | 1 << 16 | 1 << 24);
        assert_ne!(key.pair_words(4, 9), key.of_part(1).pair_words(4, 9));
        // The label shares its byte with the half step, and nothing else.
        let half = SweepKey::new(7, Stream::PairForce, 3, 1).of_image(127);
        assert_eq!(half.tail[1], 0xff << 16 | 1 << 24);
        assert_eq!(fmix64(0), 0);
    }

    #[test]
    fn pairs_have_bits_of_their_own_from_the_words_of_particles() {
        let key = SweepKey::new(7, Stream::PairForce, 3, 0);
        let word = |id| key.particle_word(id);
        assert_ne!(word(4), word(9));
        assert_ne!(
            word(4),
            SweepKey::new(7, Stream::PairForce, 4, 0).particle_word(4)
        );
        assert_eq!(blend(word(4), word(9), 0), blend(word(9), word(4), 0));
        assert_ne!(blend(word(4), word(9), 0), blend(word(4), word(9), 1));
        let mut seen = std::collections::HashSet::new();
        // So few of 2^32 that two of them are hardly ever alike.
        for a in 0..100 {
            for b in a + 1..100 {
                assert!((0..4).all(|turn| seen.insert(blend(word(a), word(b), turn))));
            }
        }
    }
}
