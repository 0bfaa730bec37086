//! Twin of `shader/begin_frame.wgsl`, `lead.wgsl`, `search.wgsl`, `assign.wgsl`, `unlink.wgsl`,
//! `insert.wgsl` and `finish.wgsl`.

use super::Cache;
use crate::layout::*;

const PINNED: u32 = u32::MAX;
const POLITE_STEPS: u32 = 64;

/// What is served in a round after the leader.
#[derive(Clone, Copy, Debug)]
struct Round {
    requests: u32,
    /// Requests that get slots that were never used.
    fresh: u32,
    /// Slots that the search for the others looks at.
    window: u32,
}

impl Round {
    /// Victims that the search is for.
    fn wanted(self) -> u32 {
        self.requests - self.fresh
    }
}

impl Cache {
    /// Starts a frame: slots used from now on are spared first, then those of the frame before.
    pub fn begin_frame(&mut self) {
        let clock = self.clock().max(1);
        self.state[CLOCK] = clock;
        if self.state[FRAME_CLOCK] != clock {
            self.state[PREVIOUS_FRAME_CLOCK] = self.state[FRAME_CLOCK];
            self.state[FRAME_CLOCK] = clock;
        }
        let previous = self.state[PREVIOUS_FRAME_CLOCK];
        self.state[SPARED_FRAMES] = u32::from(clock > 1) + u32::from(previous > 1);
        self.state[SWEPT] = 0;
    }

    /// Serves the requests of a round; the jobs (block, slot), the leader's first.
    pub fn serve(&mut self) -> Vec<[u32; 2]> {
        let mut jobs = self.serve_leader();
        let round = self.round();
        let victims = self.search(round);
        self.assign(round, &victims, &mut jobs);
        self.advance_hand(round, victims.len() as u32);
        self.finish(jobs.len() as u32);
        jobs
    }

    fn reluctance(&self, slot: u32) -> u32 {
        let stamp = self.stamp(slot);
        if stamp < self.spared_from() {
            0
        } else if stamp < self.clock() {
            1
        } else if stamp != PINNED {
            2
        } else {
            3
        }
    }

    fn leader_victim(&mut self) -> u32 {
        let slots = self.params.slots;
        let mut slot = self.state[HAND] % slots;
        let (mut best, mut best_reluctance) = (slot, 3);
        for step in 1..=slots {
            let found = self.reluctance(slot);
            if found < best_reluctance {
                (best, best_reluctance) = (slot, found);
            }
            if best_reluctance == 0 || (step >= POLITE_STEPS && best_reluctance < 3) {
                break;
            }
            slot = (slot + 1) % slots;
        }
        self.state[HAND] = (best + 1) % slots;
        best
    }

    fn take_fresh(&mut self) -> u32 {
        self.state[NEXT_FREE] += 1;
        self.state[NEXT_FREE] - 1
    }

    fn leader_slot(&mut self) -> u32 {
        if self.state[NEXT_FREE] < self.params.slots {
            return self.take_fresh();
        }
        let slot = self.leader_victim();
        self.evict(slot);
        slot
    }

    fn serve_leader(&mut self) -> Vec<[u32; 2]> {
        let blocks = self.leader().to_vec();
        self.stamp_resident(&blocks, PINNED);
        let mut jobs = Vec::new();
        for &block in &blocks {
            if self.lookup(block).is_none() {
                // What others requested, too, is counted with the list.
                self.state[REQUESTED_TOTAL] += u32::from(!self.is_requested(block));
                let slot = self.leader_slot();
                self.insert_at(block, slot, PINNED);
                jobs.push([block, slot]);
            }
        }
        self.stamp_resident(&blocks, self.clock());
        jobs
    }

    fn stamp_resident(&mut self, blocks: &[u32], stamp: u32) {
        for &block in blocks {
            if let Some(slot) = self.lookup(block) {
                let word = self.stamp_word(slot);
                self.state[word] = stamp;
            }
        }
    }

    fn round(&self) -> Round {
        let slots = self.params.slots;
        let requests = self.state[REQUEST_COUNT].min(self.params.request_capacity);
        let fresh = requests.min(slots - self.state[NEXT_FREE]);
        let wanted = requests - fresh;
        let window = (2 * wanted + 256).max(self.state[SWEPT]).min(slots);
        Round { requests, fresh, window: if wanted == 0 { 0 } else { window } }
    }

    fn search(&self, round: Round) -> Vec<u32> {
        let spared_from = self.spared_from();
        (0..round.window)
            .map(|index| (self.state[HAND] + index) % self.params.slots)
            .filter(|&slot| slot < self.state[NEXT_FREE] && self.stamp(slot) < spared_from)
            .take(round.wanted() as usize)
            .collect()
    }

    fn assign(&mut self, round: Round, victims: &[u32], jobs: &mut Vec<[u32; 2]>) {
        let (mut fresh, mut victims) = (0..round.fresh, victims.iter().copied());
        for (index, block) in (0..).zip(self.requests()) {
            if self.lookup(block).is_some() {
                continue;
            }
            let slot = if index >= round.requests {
                None
            } else if fresh.next().is_some() {
                Some(self.take_fresh())
            } else {
                victims.next()
            };
            if let Some(slot) = slot {
                self.evict(slot);
                self.insert(block, slot);
                jobs.push([block, slot]);
            } else {
                self.state[DEFERRED_TOTAL] += 1;
            }
        }
    }

    fn advance_hand(&mut self, round: Round, found: u32) {
        if round.window == 0 {
            return;
        }
        let slots = self.params.slots;
        self.state[HAND] = (self.state[HAND] + round.window) % slots;
        let vain = found < round.wanted();
        let swept = if vain { (self.state[SWEPT] + round.window).min(slots) } else { 0 };
        self.state[SWEPT] = swept;
        if swept == slots && self.state[SPARED_FRAMES] > 0 {
            self.state[SPARED_FRAMES] -= 1;
            self.state[SWEPT] = 0;
        }
    }

    fn finish(&mut self, jobs: u32) {
        let table = self.table_word(0)..;
        self.state[table].fill(0);
        self.state[REQUESTED_TOTAL] += self.state[REQUEST_COUNT];
        self.state[DECODED_TOTAL] += jobs;
        self.state[JOB_COUNT] = jobs;
        self.state[REQUEST_COUNT] = 0;
        self.state[LEADER_COUNT] = 0;
        self.state[CLOCK] += 1;
    }
}
