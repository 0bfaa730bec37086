//! Twin of `shader/lib/lru_directory.wgsl` and of the chains' part of `lru_service.wgsl`.

use std::iter::successors;

use super::Cache;
use crate::layout::*;

/// The finalizer of `MurmurHash3`.
pub(super) fn hash(block: u32) -> u32 {
    let mut h = block;
    h ^= h >> 16;
    h = h.wrapping_mul(0x85eb_ca6b);
    h ^= h >> 13;
    h = h.wrapping_mul(0xc2b2_ae35);
    h ^ (h >> 16)
}

impl Cache {
    /// Slot of a resident block.
    pub fn lookup(&self, block: u32) -> Option<u32> {
        self.chain(block).find(|&slot| self.owner(slot) == Some(block))
    }

    /// Block in a slot.
    pub fn owner(&self, slot: u32) -> Option<u32> {
        self.directory[self.entry(slot) + BLOCK].checked_sub(1)
    }

    /// Slots in a block's chain; endless if the chain is a cycle.
    pub fn chain(&self, block: u32) -> impl Iterator<Item = u32> {
        let slot = |word: usize| self.directory[word].checked_sub(1);
        successors(slot(self.head(block)), move |&s| slot(self.entry(s) + NEXT))
    }

    /// Gives a slot that has no block to a block, as if both were new in this round.
    pub fn insert(&mut self, block: u32, slot: u32) {
        self.insert_at(block, slot, self.clock());
    }

    pub(super) fn insert_at(&mut self, block: u32, slot: u32, stamp: u32) {
        let (entry, head) = (self.entry(slot), self.head(block));
        let first = std::mem::replace(&mut self.directory[head], slot + 1);
        self.directory[entry + BLOCK] = block + 1;
        self.directory[entry + NEXT] = first;
        let word = self.stamp_word(slot);
        self.state[word] = stamp;
    }

    /// Takes the block out of a slot, and the slot out of its chain.
    pub(super) fn evict(&mut self, slot: u32) {
        let Some(block) = self.owner(slot) else { return };
        let entry = self.entry(slot);
        let before = self.chain(block).take_while(|&s| s != slot).last();
        let link = before.map_or(self.head(block), |s| self.entry(s) + NEXT);
        self.directory[link] = self.directory[entry + NEXT];
        self.directory[entry + BLOCK] = 0;
        self.state[EVICTED_TOTAL] += 1;
    }

    /// Index of the head of a block's chain.
    fn head(&self, block: u32) -> usize {
        (hash(block) & (self.params.heads - 1)) as usize
    }

    /// Index of the first word of a slot's entry.
    fn entry(&self, slot: u32) -> usize {
        self.params.heads as usize + ENTRY_WORDS * slot as usize
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Blocks of a ball in grids whose rows and layers are powers of two, and others: chains are
    /// hardly longer than those of blocks drawn by chance.
    #[test]
    fn neighbouring_blocks_do_not_share_chains() {
        for [nx, ny, nz] in [[64u32, 64, 64], [128, 128, 128], [99, 61, 55], [256, 256, 32]] {
            let half = [nx, ny, nz].map(|n| f64::from(n) / 2.0);
            let inside = |x: u32, y: u32, z: u32| {
                let offset = [x, y, z].map(f64::from);
                let d: f64 = (0..3).map(|i| ((offset[i] - half[i]) / half[i]).powi(2)).sum();
                (0.7..0.8).contains(&d)
            };
            let blocks: Vec<u32> =
                (0..nx * ny * nz).filter(|&b| inside(b % nx, b / nx % ny, b / (nx * ny))).collect();
            let heads = (blocks.len() as u32).next_power_of_two();
            let mut lengths = vec![0u32; heads as usize];
            for &block in &blocks {
                lengths[(hash(block) & (heads - 1)) as usize] += 1;
            }
            // Sum over chains of length * (length - 1): what random hashing makes of n blocks and
            // m heads is n * (n - 1) / m.
            let pairs: f64 = lengths.iter().map(|&l| f64::from(l) * (f64::from(l) - 1.0)).sum();
            let n = blocks.len() as f64;
            let ratio = pairs / (n * (n - 1.0) / f64::from(heads));
            assert!(ratio < 1.1, "{ratio} for {} blocks of {nx} x {ny} x {nz}", blocks.len());
            assert!(lengths.iter().all(|&l| l < 12));
        }
    }
}
