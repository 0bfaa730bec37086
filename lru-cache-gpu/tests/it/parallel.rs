//! Many rays at once: the order of the list is open, everything else is not.

use std::collections::BTreeSet;

use lru_cache_gpu::cpu::Cache;
use lru_cache_gpu::wgpu::Limits;

use crate::harness::{OnGpu, Op, Round, Served, assert_same, gpu, plan, sorted};
use crate::invariants;

fn op(random: u32, blocks: u32) -> Op {
    let block = (random >> 8) % blocks;
    match random % 8 {
        0 => Op::Touch(block),
        1 | 2 => Op::Request(block),
        _ => Op::Use(block),
    }
}

/// What many invocations may have done to the cache.
fn check_uses(start: &Cache, round: &Round, before: &Cache, capacity: usize) {
    let mut asked = BTreeSet::new();
    let mut touched = BTreeSet::new();
    for &op in &round.ops {
        let (Op::Use(block) | Op::Request(block) | Op::Touch(block)) = op;
        match start.lookup(block) {
            Some(slot) if !matches!(op, Op::Request(_)) => drop(touched.insert(slot)),
            None if !matches!(op, Op::Touch(_)) => drop(asked.insert(block)),
            _ => {}
        }
    }
    let listed: BTreeSet<u32> = before.requests().iter().copied().collect();
    assert_eq!(listed.len(), before.requests().len(), "each block once");
    assert!(listed.is_subset(&asked));
    assert_eq!(listed.len(), asked.len().min(capacity));
    for slot in 0..start.slots() {
        let clock = start.clock();
        let stamp = if touched.contains(&slot) { clock } else { start.stamp(slot) };
        assert_eq!(before.stamp(slot), stamp, "slot {slot}");
    }
}

fn run(blocks: u32, slots: u32, uses: u32) -> Cache {
    let plan = plan(blocks.into(), slots.into(), &Limits::default());
    let cache = OnGpu::new(&plan);
    let mut encoder = gpu().encoder();
    gpu().service.record_begin_frame(&mut encoder, &cache.buffers);
    gpu().submit(encoder);
    let mut twin = cache.read(&Cache::new(&plan));
    let mut random = blocks ^ slots;
    let mut next = || {
        random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        random ^ (random >> 15)
    };
    for step in 0..8 {
        let ops = (0..uses).map(|_| op(next(), blocks)).collect();
        let leader = (0..8).map(|_| (next() >> 8) % blocks).collect();
        let round = Round { new_frame: step % 3 == 2, ops, leader };
        let mut start = twin.clone();
        if round.new_frame {
            start.begin_frame();
        }
        let found = cache.play(&round, false);
        let before = cache.read(&twin);
        check_uses(&start, &round, &before, plan.request_capacity() as usize);
        for (op, slot) in round.ops.iter().zip(found) {
            let (Op::Use(block) | Op::Request(block) | Op::Touch(block)) = *op;
            assert_eq!(slot, start.lookup(block), "slots stay where they are during a walk");
        }
        let jobs = cache.serve();
        twin = before.clone();
        let expected = twin.serve();
        let after = cache.read(&twin);
        assert_same(&after, &twin, "after the service");
        assert_eq!(sorted(jobs.clone()), sorted(expected));
        invariants::check(&Served { before, found: Vec::new(), jobs }, &after).unwrap();
    }
    twin
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
fn many_rays_with_every_block_in_its_own_slot() {
    let cache = run(2000, 2000, 3000);
    assert_eq!(cache.counters().evicted, 0);
}
