//! Which pairs of a list are near enough to be worked on for some steps.

use super::precision::Mixed;
use super::rows::{Companion, Ends, MOST, Members, ROOM, Wrap, first_lanes};
use super::wide::{LANES, Vector};
use super::{Task, Wide};
use crate::domain::PeriodicBox;
use crate::neighbor::Rows;

/// Vectors of a chunk, and one more.
const VECTORS: usize = ROOM / MOST + 1;

/// Keeps of some rows the pairs within a cutoff, in their order. Distances are found in single precision.
pub(crate) struct Prune<'a, const D: usize> {
    pub rows: &'a Rows,
    /// Where they go.
    pub kept: &'a mut Rows,
    pub cell: &'a PeriodicBox,
    pub place: &'a [[f32; 4]],
    /// The square of the cutoff.
    pub square: f32,
}

/// Finds which pairs of a chunk are within the cutoff, a bit each.
struct Near<'a, W: Wide, const D: usize> {
    wrap: Wrap<Mixed, W>,
    place: &'a [[f32; 4]],
    square: W::Single,
    bits: [u32; VECTORS],
}

impl<W: Wide, const D: usize> Companion<W::Single> for Near<'_, W, D> {
    #[inline(always)]
    unsafe fn take(&mut self, ends: &Ends<'_>, lane: usize) {
        // SAFETY: promised by the caller.
        unsafe {
            let (here, there) = (ends.of_heads(self.place), ends.of_others(self.place));
            let (_, square) = self.wrap.between::<D>(&here, &there);
            *self.bits.get_unchecked_mut(lane / MOST) = square.below(self.square);
        }
    }
}

impl<const D: usize> Task for Prune<'_, D> {
    type Output = ();

    #[inline(always)]
    fn run<W: Wide>(self) {
        let Self { rows, kept, .. } = self;
        let mut members = Members::default();
        let mut near = Near::<W, D> {
            wrap: Wrap::new(self.cell),
            place: self.place,
            square: W::Single::splat(self.square),
            bits: [0; VECTORS],
        };
        let (mut searched, mut pairs, mut found, mut known) = (0, 0, 0, 0);
        kept.make_room(rows);
        kept.ends.resize(rows.ends.len(), [0; 2]);
        while members.has_more(rows) {
            members.fill::<W::Single>(rows, &mut near);
            // Pairs kept before each vector.
            let mut before = [0; VECTORS];
            let (first, count) = (members.first, members.count);
            let vectors = count.div_ceil(MOST);
            for n in 0..vectors {
                let bits = near.bits[n] & first_lanes::<W::Single>(count - MOST * n);
                (near.bits[n], before[n]) = (bits, pairs as u32);
                for part in 0..MOST / LANES {
                    let bits = (bits >> (LANES * part)) as u8;
                    // SAFETY: there is a vector of slots behind the last pair, and what is kept takes no
                    // more room than what there was. Behind the last one kept there are slots, too.
                    unsafe {
                        let from = rows.slots.as_ptr().add(first + MOST * n + LANES * part);
                        let slots = from.cast::<[u32; LANES]>().read_unaligned();
                        let to = kept.slots.as_mut_ptr().add(pairs);
                        to.cast::<[u32; LANES]>()
                            .write_unaligned(W::kept(slots, bits));
                    }
                    pairs += bits.count_ones() as usize;
                }
            }
            (near.bits[vectors], before[vectors]) = (0, pairs as u32);
            while let Some(&[head, end]) = rows.ends.get(searched) {
                let lane = end as usize - first;
                if lane > count {
                    break;
                }
                let below = (1 << (lane % MOST)) - 1;
                let until = before[lane / MOST] + (near.bits[lane / MOST] & below).count_ones();
                kept.ends[found] = [head, until];
                // A row without any is none.
                found += usize::from(until > known);
                known = until;
                searched += 1;
            }
        }
        kept.ends.truncate(found);
        kept.mark_starts();
    }
}

#[cfg(test)]
mod tests {
    use super::super::run_wide;
    use super::*;
    use crate::random::fmix64;

    /// Rows of so many partners each, kept within 0.6 of a box of edge 3, are those found one by one.
    fn check<const D: usize>(lengths: &[usize]) {
        let n = 500_u32;
        let cell = PeriodicBox::new(&[3.0; 3][..D], 1.0).unwrap();
        let places: Vec<[f32; 4]> = (0..n)
            .map(|k| {
                let word = |a| fmix64(u64::from(4 * k + a) + 1) >> 32;
                let turn = |a: u32| f32::from_bits(word(a) as u32);
                let flat = if D == 3 { turn(2) } else { 0.0 };
                [turn(0), turn(1), flat, 0.0]
            })
            .collect();
        let distance = |i: u32, j: u32| {
            let [a, b] = [i, j].map(|slot| places[slot as usize]);
            let along = |axis: usize| {
                let turns = a[axis].to_bits().wrapping_sub(b[axis].to_bits()) as i32;
                3.0 * f64::from(turns) / 4_294_967_296.0
            };
            (0..D).map(|axis| along(axis).powi(2)).sum::<f64>().sqrt()
        };
        let (mut rows, mut expected) = (Rows::default(), Vec::new());
        for (head, &length) in lengths.iter().enumerate() {
            let head = head as u32;
            let partners: Vec<u32> = (0..length as u32)
                .map(|k| (fmix64(u64::from(head * 4096 + k)) % u64::from(n)) as u32)
                .collect();
            if partners.is_empty() {
                continue; // as the search does
            }
            rows.slots.extend(&partners);
            rows.ends.push([head, rows.slots.len() as u32]);
            let near = partners.into_iter().filter(|&j| distance(head, j) < 0.6);
            expected.extend(near.map(|other| [head, other]));
        }
        rows.slots.extend([0; MOST]);
        rows.mark_starts();
        let mut kept = Rows::default();
        run_wide(Prune::<D> {
            rows: &rows,
            kept: &mut kept,
            cell: &cell,
            place: &places,
            square: 0.36,
        });
        let got = kept.iter().flat_map(|(head, others)| {
            assert!(!others.is_empty());
            others.iter().map(move |&other| [head, other])
        });
        assert_eq!(got.collect::<Vec<_>>(), expected);
        assert!(kept.slots.len() >= kept.pairs() + MOST && kept.slots.iter().all(|&slot| slot < n));
        assert!(expected.len() * 3 < rows.pairs() || rows.pairs() < 100);
    }

    #[test]
    fn rows_of_any_length_keep_what_is_near() {
        for lengths in [
            &[][..],
            &[1],
            &[16; 16],
            &[1; 400],
            &[700, 1, 0, 1023, 33],
            &[250, 6, 16, 240, 3, 3, 3, 3, 3, 300],
            &[30; 100],
        ] {
            check::<2>(lengths);
            check::<3>(lengths);
        }
    }
}
