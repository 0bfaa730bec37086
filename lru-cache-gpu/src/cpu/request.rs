//! Twin of `shader/lib/lru_request.wgsl`, for one invocation after the other.

use super::Cache;
use super::service::{
    ABSENT, FIRST_SLOT, LEADER, LEADER_CAPACITY, LEADER_COUNT, REQUEST_COUNT, REQUESTED, USED_TOTAL,
};

impl Cache {
    /// Slot of a resident block.
    pub fn lookup(&self, block: u32) -> Option<u32> {
        self.directory[block as usize].checked_sub(FIRST_SLOT)
    }

    /// Keeps the slot for the rest of this round and marks it as used.
    pub fn touch(&mut self, slot: u32) {
        let (word, clock) = (self.stamp_word(slot), self.clock());
        if self.state[word] != clock {
            self.state[word] = clock;
            self.state[USED_TOTAL] += 1;
        }
    }

    /// Asks for an absent block.
    pub fn request(&mut self, block: u32) {
        if self.directory[block as usize] != ABSENT {
            return;
        }
        let index = self.state[REQUEST_COUNT];
        self.state[REQUEST_COUNT] += 1;
        if index < self.params.request_capacity {
            self.directory[block as usize] = REQUESTED;
            let word = self.stamp_word(self.params.slots) + index as usize;
            self.state[word] = block;
        }
    }

    /// Says what the leader needs; blocks beyond the first 8 are left out.
    pub fn lead(&mut self, blocks: &[u32]) {
        for (index, &block) in blocks.iter().enumerate().take(LEADER_CAPACITY) {
            self.state[LEADER + index] = block;
            self.state[LEADER_COUNT] = index as u32 + 1;
        }
    }
}
