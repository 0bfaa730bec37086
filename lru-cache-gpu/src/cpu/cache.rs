//! The words of a cache and what they say.

use crate::layout::*;
use crate::{CachePlan, Counters, LruParams};

/// A cache on the CPU. After the same touches, the same leader and the same list of requests, the
/// header equals that on the GPU; which of several possible victims go, to whom, and the order
/// within chains are open there.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Cache {
    pub(super) params: LruParams,
    /// Heads and entries, as laid out in `shader/lib/lru_directory.wgsl`.
    pub directory: Vec<u32>,
    /// Header, stamps and requests, as laid out in `shader/lib/lru_state.wgsl`.
    pub state: Vec<u32>,
}

impl Cache {
    /// An empty cache.
    pub fn new(plan: &CachePlan) -> Self {
        Self {
            params: plan.params(),
            directory: vec![0; (plan.table_bytes() / 4) as usize],
            state: vec![0; (plan.state_bytes() / 4) as usize],
        }
    }

    /// Slots in all.
    pub fn slots(&self) -> u32 {
        self.params.slots
    }

    /// Slots that were given to a block at some time: those below this one.
    pub fn next_free(&self) -> u32 {
        self.state[NEXT_FREE]
    }

    /// Round of a slot's last use; 0 for a slot that was never used.
    pub fn stamp(&self, slot: u32) -> u32 {
        self.state[self.stamp_word(slot)]
    }

    /// Number of the running round, from 1.
    pub fn clock(&self) -> u32 {
        self.state[CLOCK]
    }

    /// Slot at which the next search for victims starts.
    pub fn hand(&self) -> u32 {
        self.state[HAND]
    }

    /// Slots last used before this round may be taken.
    pub fn spared_from(&self) -> u32 {
        self.state[match self.state[SPARED_FRAMES] {
            2 => PREVIOUS_FRAME_CLOCK,
            1 => FRAME_CLOCK,
            _ => CLOCK,
        }]
    }

    /// Blocks in the list of requests, in the order in which they were asked for.
    pub fn requests(&self) -> Vec<u32> {
        let count = self.state[REQUEST_COUNT];
        let place = |index| self.state[self.request_word(index)];
        // A place without a block, which nothing leaves in the list, would come out as u32::MAX.
        (0..count).map(|i| self.state[self.table_word(place(i))].wrapping_sub(1)).collect()
    }

    /// The request table: block + 1 or 0 in each place.
    pub fn request_table(&self) -> &[u32] {
        &self.state[self.table_word(0)..]
    }

    /// Blocks that the leader needs in this round.
    pub fn leader(&self) -> &[u32] {
        let most = LEADER_CAPACITY.min(self.params.slots as usize);
        &self.state[LEADER..LEADER + most.min(self.state[LEADER_COUNT] as usize)]
    }

    /// The header's words.
    pub fn header(&self) -> &[u32] {
        &self.state[..HEADER]
    }

    /// What the cache has done since its creation.
    pub fn counters(&self) -> Counters {
        Counters {
            requested: self.state[REQUESTED_TOTAL],
            decoded: self.state[DECODED_TOTAL],
            evicted: self.state[EVICTED_TOTAL],
            deferred: self.state[DEFERRED_TOTAL],
            used: self.state[USED_TOTAL],
        }
    }

    pub(super) fn stamp_word(&self, slot: u32) -> usize {
        HEADER + slot as usize
    }

    pub(super) fn table_places(&self) -> u32 {
        (2 * self.params.request_capacity).next_power_of_two()
    }

    pub(super) fn request_word(&self, index: u32) -> usize {
        HEADER + (self.params.slots + index) as usize
    }

    pub(super) fn table_word(&self, place: u32) -> usize {
        HEADER + (self.params.slots + self.table_places() + place) as usize
    }
}
