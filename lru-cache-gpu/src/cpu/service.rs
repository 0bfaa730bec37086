//! Twin of `shader/begin_frame.wgsl`, `lead.wgsl`, `search.wgsl`, `assign.wgsl` and `finish.wgsl`.

use crate::plan::HEADER_WORDS;
use crate::{CachePlan, Counters, LruParams};

pub(super) const ABSENT: u32 = 0;
pub(super) const REQUESTED: u32 = 1;
pub(super) const FIRST_SLOT: u32 = 2;
const PINNED: u32 = u32::MAX;
const POLITE_STEPS: u32 = 64;

pub(super) const REQUEST_COUNT: usize = 0;
pub(super) const CLOCK: usize = 1;
const HAND: usize = 2;
const FRAME_CLOCK: usize = 3;
const SPARE_FRAME: usize = 4;
const SWEPT: usize = 5;
const JOB_COUNT: usize = 6;
pub(super) const LEADER_COUNT: usize = 7;
const REQUESTED_TOTAL: usize = 8;
const DECODED_TOTAL: usize = 9;
const EVICTED_TOTAL: usize = 10;
const DEFERRED_TOTAL: usize = 11;
pub(super) const USED_TOTAL: usize = 12;
pub(super) const LEADER: usize = 16;
pub(super) const LEADER_CAPACITY: usize = 8;
const HEADER: usize = HEADER_WORDS as usize;

/// A cache on the CPU. After the same touches, the same leader and the same list of requests, its
/// words equal those on the GPU; only the order of the jobs may differ there.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Cache {
    pub(super) params: LruParams,
    /// One word per block: 0 absent, 1 requested, otherwise the slot + 2.
    pub directory: Vec<u32>,
    /// Header, owners, stamps and requests, as laid out in `shader/lib/lru_state.wgsl`.
    pub state: Vec<u32>,
}

impl Cache {
    /// An empty cache.
    pub fn new(plan: &CachePlan) -> Self {
        Self {
            params: plan.params(),
            directory: vec![0; (plan.block_directory_bytes() / 4) as usize],
            state: vec![0; (plan.state_bytes() / 4) as usize],
        }
    }

    /// Slots in all.
    pub fn slots(&self) -> u32 {
        self.params.slots
    }

    /// Block in a slot.
    pub fn owner(&self, slot: u32) -> Option<u32> {
        self.state[HEADER + slot as usize].checked_sub(1)
    }

    /// Round of a slot's last use; 0 for a free slot.
    pub fn stamp(&self, slot: u32) -> u32 {
        self.state[self.stamp_word(slot)]
    }

    /// Number of the running round, from 1.
    pub fn clock(&self) -> u32 {
        self.state[CLOCK]
    }

    /// Blocks in the list of requests.
    pub fn requests(&self) -> &[u32] {
        let first = HEADER + 2 * self.params.slots as usize;
        let count = self.state[REQUEST_COUNT].min(self.params.request_capacity);
        &self.state[first..first + count as usize]
    }

    /// Blocks that the leader needs in this round.
    pub fn leader(&self) -> &[u32] {
        let most = LEADER_CAPACITY.min(self.params.slots as usize);
        &self.state[LEADER..LEADER + most.min(self.state[LEADER_COUNT] as usize)]
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

    /// Starts a frame: slots used from now on are spared first.
    pub fn begin_frame(&mut self) {
        let clock = self.clock().max(1);
        self.state[CLOCK] = clock;
        self.state[FRAME_CLOCK] = clock;
        self.state[SPARE_FRAME] = 1;
        self.state[SWEPT] = 0;
    }

    /// Serves the requests of a round; the jobs (block, slot), the leader's first.
    pub fn serve(&mut self) -> Vec<[u32; 2]> {
        let mut jobs = self.serve_leader();
        let window = self.window();
        let victims = self.search(window);
        self.assign(&victims, &mut jobs);
        self.finish(window, &victims, jobs.len() as u32);
        jobs
    }

    /// Whether every block has a slot of its own.
    pub fn holds_all(&self) -> bool {
        self.params.slots as usize >= self.directory.len()
    }

    pub(super) fn stamp_word(&self, slot: u32) -> usize {
        HEADER + (self.params.slots + slot) as usize
    }

    fn spared_from(&self) -> u32 {
        self.state[if self.state[SPARE_FRAME] != 0 { FRAME_CLOCK } else { CLOCK }]
    }

    fn place(&mut self, block: u32, slot: u32, stamp: u32) {
        if let Some(owner) = self.owner(slot) {
            self.directory[owner as usize] = ABSENT;
            self.state[EVICTED_TOTAL] += 1;
        }
        self.state[HEADER + slot as usize] = block + 1;
        let word = self.stamp_word(slot);
        self.state[word] = stamp;
        self.directory[block as usize] = slot + FIRST_SLOT;
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

    fn serve_leader(&mut self) -> Vec<[u32; 2]> {
        let blocks = self.leader().to_vec();
        for &block in &blocks {
            if let Some(slot) = self.lookup(block) {
                let word = self.stamp_word(slot);
                self.state[word] = PINNED;
            }
        }
        let mut jobs = Vec::new();
        for &block in &blocks {
            if self.lookup(block).is_none() {
                // What others requested, too, is counted with the list.
                let alone = self.directory[block as usize] == ABSENT;
                self.state[REQUESTED_TOTAL] += u32::from(alone);
                let slot = if self.holds_all() { block } else { self.leader_victim() };
                self.place(block, slot, PINNED);
                jobs.push([block, slot]);
            }
        }
        let clock = self.clock();
        for &block in &blocks {
            if let Some(slot) = self.lookup(block) {
                let word = self.stamp_word(slot);
                self.state[word] = clock;
            }
        }
        jobs
    }

    fn window(&self) -> u32 {
        let requests = self.requests().len() as u32;
        if requests == 0 || self.holds_all() {
            return 0;
        }
        (2 * requests + 256).min(self.params.window_capacity)
    }

    fn search(&self, window: u32) -> Vec<u32> {
        let spared_from = self.spared_from();
        (0..window)
            .map(|index| (self.state[HAND] + index) % self.params.slots)
            .filter(|&slot| self.stamp(slot) < spared_from)
            .collect()
    }

    fn assign(&mut self, victims: &[u32], jobs: &mut Vec<[u32; 2]>) {
        for (index, block) in self.requests().to_vec().into_iter().enumerate() {
            if self.directory[block as usize] != REQUESTED {
                continue;
            }
            let slot = if self.holds_all() { Some(block) } else { victims.get(index).copied() };
            match slot {
                None => {
                    self.directory[block as usize] = ABSENT;
                    self.state[DEFERRED_TOTAL] += 1;
                }
                Some(slot) => {
                    self.place(block, slot, self.clock());
                    jobs.push([block, slot]);
                }
            }
        }
    }

    fn advance_hand(&mut self, window: u32, victims: &[u32]) {
        let slots = self.params.slots;
        let requests = self.requests().len();
        if let Some(&last) = requests.checked_sub(1).and_then(|last| victims.get(last)) {
            self.state[HAND] = (last + 1) % slots;
            return;
        }
        self.state[HAND] = (self.state[HAND] + window) % slots;
        self.state[SWEPT] = (self.state[SWEPT] + window).min(slots);
        if self.state[SWEPT] >= slots {
            self.state[SPARE_FRAME] = 0;
        }
    }

    fn finish(&mut self, window: u32, victims: &[u32], jobs: u32) {
        self.advance_hand(window, victims);
        self.state[REQUESTED_TOTAL] += self.requests().len() as u32;
        self.state[DECODED_TOTAL] += jobs;
        self.state[JOB_COUNT] = jobs;
        self.state[REQUEST_COUNT] = 0;
        self.state[LEADER_COUNT] = 0;
        self.state[CLOCK] += 1;
    }
}
