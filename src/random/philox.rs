//! Philox4x32-10, the counter-based generator of Salmon et al., "Parallel random numbers: as easy
//! as 1, 2, 3" (SC11, 2011). A counter and a key give four words; there is no state to carry.

pub(crate) const MULTIPLIER_0: u64 = 0xD251_1F53;
pub(crate) const MULTIPLIER_1: u64 = 0xCD9E_8D57;
pub(crate) const WEYL_0: u32 = 0x9E37_79B9;
pub(crate) const WEYL_1: u32 = 0xBB67_AE85;
pub(crate) const ROUNDS: usize = 10;
const LOW: u64 = 0xFFFF_FFFF;

/// Four words from a counter and a key. The words travel as `u64` below 2^32 because that is the
/// form in which a compiler turns the 32 x 32 -> 64 bit products of many lanes into one instruction.
#[inline(always)]
pub fn philox4x32_lanes(counter: [u64; 4], key: [u32; 2]) -> [u64; 4] {
    let [mut c0, mut c1, mut c2, mut c3] = counter;
    let [mut k0, mut k1] = key;
    for _ in 0..ROUNDS {
        let p0 = (c0 & LOW) * MULTIPLIER_0;
        let p1 = (c2 & LOW) * MULTIPLIER_1;
        c0 = (p1 >> 32) ^ c1 ^ u64::from(k0);
        c1 = p1 & LOW;
        c2 = (p0 >> 32) ^ c3 ^ u64::from(k1);
        c3 = p0 & LOW;
        k0 = k0.wrapping_add(WEYL_0);
        k1 = k1.wrapping_add(WEYL_1);
    }
    [c0, c1, c2, c3]
}

/// Four words from a counter and a key.
pub fn philox4x32(counter: [u32; 4], key: [u32; 2]) -> [u32; 4] {
    philox4x32_lanes(counter.map(u64::from), key).map(|word| word as u32)
}

#[cfg(test)]
mod tests {
    use super::philox4x32;

    /// Known answers of Random123's `kat_vectors`.
    #[test]
    fn known_answers() {
        assert_eq!(
            philox4x32([0; 4], [0; 2]),
            [0x6627_e8d5, 0xe169_c58d, 0xbc57_ac4c, 0x9b00_dbd8]
        );
        assert_eq!(
            philox4x32([u32::MAX; 4], [u32::MAX; 2]),
            [0x408f_276d, 0x41c8_3b0e, 0xa20b_c7c6, 0x6d54_51fd]
        );
        assert_eq!(
            philox4x32(
                [0x243f_6a88, 0x85a3_08d3, 0x1319_8a2e, 0x0370_7344],
                [0xa409_3822, 0x299f_31d0]
            ),
            [0xd16c_fe09, 0x94fd_cceb, 0x5001_e420, 0x2412_6ea1]
        );
    }
}
