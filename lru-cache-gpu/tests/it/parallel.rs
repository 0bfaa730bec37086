//! Many rays at once: the order of the list is open, everything else is not.

use std::collections::BTreeSet;

use lru_cache_gpu::cpu::Cache;
use lru_cache_gpu::wgpu::Limits;
use proptest::prelude::*;

use crate::harness::{OnGpu, Op, Round, Served, assert_agree, gpu, plan};
use crate::invariants;

/// Numbers that look random (Numerical Recipes' generator).
struct Random(u32);

impl Random {
    fn next(&mut self) -> u32 {
        self.0 = self.0.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        self.0 ^ (self.0 >> 15)
    }

    fn below(&mut self, n: u32) -> u32 {
        (self.next() >> 8) % n
    }

    fn op(&mut self, blocks: u32) -> Op {
        let block = self.below(blocks);
        match self.below(8) {
            0 => Op::Touch(block),
            1 | 2 => Op::Request(block),
            _ => Op::Use(block),
        }
    }

    fn round(&mut self, blocks: u32, uses: u32) -> Round {
        let new_frame = self.below(3) == 0;
        let ops = (0..uses).map(|_| self.op(blocks)).collect();
        let leads = self.below(9);
        let leader = (0..leads).map(|_| self.below(blocks)).collect();
        Round { new_frame, ops, leader }
    }
}

/// A cache on the GPU, and its words as of the last look.
struct Parallel {
    gpu: OnGpu,
    words: Cache,
    blocks: u32,
    capacity: usize,
}

impl Parallel {
    fn new(blocks: u32, slots: u32) -> Self {
        let plan = plan(blocks.into(), slots.into(), &Limits::default());
        let cache = OnGpu::new(&plan);
        let mut encoder = gpu().encoder();
        gpu().service.record_begin_frame(&mut encoder, &cache.buffers);
        gpu().submit(encoder);
        let words = cache.read(&Cache::new(&plan));
        Self { gpu: cache, words, blocks, capacity: plan.request_capacity() as usize }
    }

    fn round(&mut self, round: &Round) {
        let mut start = self.words.clone();
        if round.new_frame {
            start.begin_frame();
        }
        let found = self.gpu.play(round, false);
        let before = self.gpu.read(&self.words);
        check_uses(&start, round, &before, self.capacity);
        for (op, slot) in round.ops.iter().zip(&found) {
            assert_eq!(*slot, start.lookup(op.block()), "slots stay where they are during a walk");
        }
        let jobs = self.gpu.serve();
        let after = self.gpu.read(&self.words);
        let mut twin_after = before.clone();
        let twin_jobs = twin_after.serve();
        let twin = Served { before: before.clone(), found: found.clone(), jobs: twin_jobs };
        let served = Served { before, found, jobs };
        assert_agree(&served, &after, &twin, &twin_after);
        invariants::check(&twin, &twin_after).unwrap();
        invariants::check(&served, &after).unwrap();
        self.words = after;
    }

    /// What the GPU finds for every block is what its words say.
    fn check_lookups(&self) {
        let ops = (0..self.blocks).map(Op::Look).collect();
        let found = self.gpu.play(&Round { ops, ..Round::default() }, false);
        let mut by_block = vec![None; self.blocks as usize];
        for slot in 0..self.words.slots() {
            if let Some(block) = self.words.owner(slot) {
                by_block[block as usize] = Some(slot);
            }
        }
        assert_eq!(found, by_block);
        assert_eq!(self.gpu.read(&self.words), self.words, "looking changes nothing");
    }
}

/// What many invocations may have done to the cache.
fn check_uses(start: &Cache, round: &Round, before: &Cache, capacity: usize) {
    let mut asked = BTreeSet::new();
    let mut touched = BTreeSet::new();
    for &op in &round.ops {
        match start.lookup(op.block()) {
            Some(slot) if op.touches() => drop(touched.insert(slot)),
            None if op.asks() => drop(asked.insert(op.block())),
            _ => {}
        }
    }
    let listed: BTreeSet<u32> = before.requests().into_iter().collect();
    assert_eq!(listed.len(), before.requests().len(), "each block once");
    assert!(listed.is_subset(&asked));
    let least = asked.len().min(capacity);
    assert!(listed.len() >= least, "{} of {} listed", listed.len(), asked.len());
    for slot in 0..start.slots() {
        let clock = start.clock();
        let stamp = if touched.contains(&slot) { clock } else { start.stamp(slot) };
        assert_eq!(before.stamp(slot), stamp, "slot {slot}");
    }
}

fn run(blocks: u32, slots: u32, uses: u32) -> Cache {
    let mut cache = Parallel::new(blocks, slots);
    let mut random = Random(blocks ^ slots);
    for _ in 0..8 {
        cache.round(&random.round(blocks, uses));
        cache.check_lookups();
    }
    cache.words
}

#[test]
fn many_rays_with_room_for_all_requests() {
    let cache = run(3000, 2000, 1500);
    assert!(cache.counters().evicted > 0);
}

#[test]
fn many_rays_that_overflow_the_list() {
    let cache = run(5000, 300, 20_000);
    assert!(cache.counters().deferred > 0);
}

#[test]
fn many_rays_with_a_slot_for_every_block() {
    let cache = run(2000, 2000, 3000);
    assert_eq!((cache.counters().evicted, cache.counters().deferred), (0, 0));
}

#[test]
fn many_rays_in_the_smallest_cache() {
    let cache = run(100_000, 8, 50_000);
    assert!(cache.counters().evicted > 0);
}

// Every ray asks for another block, 64 times as many as the list takes.
#[test]
fn a_full_table_holds_every_block_once() {
    for slots in [8, 63, 500] {
        let mut cache = Parallel::new(64 * slots, slots);
        for _ in 0..3 {
            let ops = (0..64 * slots).chain(0..64 * slots).map(Op::Request).collect();
            cache.round(&Round { ops, ..Round::default() }.in_new_frame());
        }
        assert_eq!(cache.words.next_free(), slots);
    }
}

#[test]
fn more_requests_than_one_round_serves() {
    let (blocks, slots) = (800_000, 140_001);
    let mut cache = Parallel::new(blocks, slots);
    assert_eq!(cache.capacity, 1 << 17);
    for (first, served) in [(0, 1 << 17), (0, (1 << 17) + 8929), (400_000, 140_001)] {
        let ops = (first..first + 300_000).map(Op::Use).collect();
        cache.round(&Round { ops, ..Round::default() });
        assert_eq!(cache.words.next_free(), served);
    }
    assert_eq!(cache.words.counters().evicted, 1 << 17);
    cache.check_lookups();
}

proptest! {
    #![proptest_config(gpu_testkit::property(12))]

    /// Victims and new blocks meet in few chains: each round changes most of a small directory.
    #[test]
    fn small_directories_change_all_at_once(
        slots in prop_oneof![Just(8u32), 9..64u32, 64..400u32],
        factor in 2..20u32,
        seed: u32,
    ) {
        let blocks = slots * factor;
        let mut cache = Parallel::new(blocks, slots);
        let mut random = Random(seed);
        for _ in 0..20 {
            let uses = 1 + random.below(3 * slots);
            cache.round(&random.round(blocks, uses));
        }
        cache.check_lookups();
    }
}
