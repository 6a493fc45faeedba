//! Pairs row by row: those of a row have one particle in common, its head.

use crate::sweep::CHUNK;

/// Rows of pairs that stay together.
#[derive(Debug, Default, Clone)]
pub struct Rows {
    /// (slot of the row's head, end of the row in `slots`). No row is empty.
    pub ends: Vec<[u32; 2]>,
    /// Slots of partners, row after row, and some more behind the last, so that a row can be read a
    /// vector at a time.
    pub slots: Vec<u32>,
    /// A bit for each pair, the lowest one of a byte first: is it the first one of its row? And zeros behind the
    /// last one, for a chunk of pairs.
    pub starts: Vec<u8>,
}

impl Rows {
    /// Number of pairs.
    #[inline]
    pub fn pairs(&self) -> usize {
        self.ends.last().map_or(0, |&[_, end]| end as usize)
    }

    /// Row by row: the head and its partners.
    pub fn iter(&self) -> impl Iterator<Item = (u32, &[u32])> {
        let mut begin = 0;
        self.ends.iter().map(move |&[head, end]| {
            let partners = &self.slots[begin..end as usize];
            begin = end as usize;
            (head, partners)
        })
    }

    /// Bytes held.
    pub(super) fn bytes(&self) -> usize {
        8 * self.ends.capacity() + 4 * self.slots.capacity() + self.starts.capacity()
    }

    /// No rows; what they took is kept.
    pub(super) fn clear(&mut self) {
        self.ends.clear();
        self.slots.clear();
    }

    /// Marks the pairs that rows start with, once all rows are known.
    pub(crate) fn mark_starts(&mut self) {
        self.starts.clear();
        self.starts.resize((self.pairs() + 2 * CHUNK) / 8, 0);
        let mut begin = 0;
        for &[_, end] in &self.ends {
            debug_assert!(end > begin);
            self.starts[begin as usize / 8] |= 1 << (begin % 8);
            begin = end;
        }
    }

    /// Room for as many rows and slots as others have. What is not written holds some slots.
    pub(crate) fn make_room(&mut self, others: &Self) {
        let (rows, slots) = (others.ends.len(), others.slots.len());
        self.ends.clear();
        self.ends.reserve_exact(rows);
        if self.slots.capacity() < slots {
            self.slots.clear();
            self.slots.reserve_exact(slots + slots / 16);
        }
        self.slots.resize(slots, 0);
    }
}
