//! Has anyone written into an array? To compare it with the particles takes a walk from slot to row; a
//! digest tells in a tenth of the time that nobody has. Not meant for adversaries.

use crate::random::{GOLDEN, fmix64};

/// 64 bits that depend on every bit of the numbers and on their order, and on where they `start`.
pub fn digest(values: &[f64], start: u64) -> u64 {
    const LANES: usize = 8;
    // Every turn is one to one in each of its arguments. Rotated, since products carry upwards only.
    let turn = |sum: u64, x: f64| (sum ^ x.to_bits()).wrapping_mul(GOLDEN).rotate_left(31);
    let mut lanes: [u64; LANES] = std::array::from_fn(|k| fmix64(start.wrapping_add(k as u64 + 1)));
    let chunks = values.chunks_exact(LANES);
    let rest = chunks.remainder();
    for chunk in chunks {
        for (sum, &x) in lanes.iter_mut().zip(chunk) {
            *sum = turn(*sum, x);
        }
    }
    for (sum, &x) in lanes.iter_mut().zip(rest) {
        *sum = turn(*sum, x);
    }
    lanes.into_iter().fold(values.len() as u64, |sum, lane| {
        fmix64(sum.rotate_left(9) ^ lane)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_digest_sees_every_change() {
        let values: Vec<f64> = (0..1003).map(|k| (f64::from(k) * 0.37).sin()).collect();
        let all = digest(&values, 1);
        assert_eq!(all, digest(&values.clone(), 1));
        assert_ne!(all, digest(&values, 2));
        let changed = |change: &dyn Fn(&mut Vec<f64>)| {
            let mut other = values.clone();
            change(&mut other);
            digest(&other, 1) != all
        };
        for k in 0..values.len() {
            assert!(changed(&|other| other[k] = -other[k]));
            assert!(changed(&|other| other[k] = other[k].next_up()));
            assert!(changed(&|other| other.swap(k, (k + 8) % 1003)));
            assert!(changed(&|other| other[k..]
                .iter_mut()
                .for_each(|x| *x = -*x)));
        }
        assert!(changed(&|other| other.fill(0.0)));
        assert!(changed(&|other| other.reverse()));
        assert!(changed(&|other| other.push(0.0)));
    }
}
