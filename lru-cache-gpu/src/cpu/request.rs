//! Twin of `shader/lib/lru_request.wgsl`, for one invocation after the other.

use super::Cache;
use super::directory::hash;
use crate::layout::*;

impl Cache {
    /// Keeps the slot for the rest of this round and marks it as used.
    pub fn touch(&mut self, slot: u32) {
        let (word, clock) = (self.stamp_word(slot), self.clock());
        if self.state[word] != clock {
            self.state[word] = clock;
            self.state[USED_TOTAL] += 1;
        }
    }

    /// Asks for an absent block; fails if the list is full or the block's places are taken.
    pub fn request(&mut self, block: u32) {
        for place in self.places(block) {
            let word = self.table_word(place);
            if self.state[word] == block + 1 {
                return;
            }
            if self.state[word] == 0 {
                let index = self.state[REQUEST_COUNT];
                if index < self.params.request_capacity {
                    self.state[word] = block + 1;
                    self.state[REQUEST_COUNT] += 1;
                    let word = self.request_word(index);
                    self.state[word] = place;
                }
                return;
            }
        }
    }

    /// Whether a block is in the request table.
    pub fn is_requested(&self, block: u32) -> bool {
        self.places(block).any(|place| self.state[self.table_word(place)] == block + 1)
    }

    /// Says what the leader needs; blocks beyond the first 8 are left out.
    pub fn lead(&mut self, blocks: &[u32]) {
        for (index, &block) in blocks.iter().enumerate().take(LEADER_CAPACITY) {
            self.state[LEADER + index] = block;
            self.state[LEADER_COUNT] = index as u32 + 1;
        }
    }

    /// Places of the request table that a block may take, in order.
    fn places(&self, block: u32) -> impl Iterator<Item = u32> + use<> {
        let mask = self.table_places() - 1;
        (0..PROBES).scan(hash(block) & mask, move |next, probe| {
            let place = *next;
            *next = (place + probe + 1) & mask;
            Some(place)
        })
    }
}
