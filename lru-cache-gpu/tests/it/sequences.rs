//! Random rounds: the twin against what every service promises, the GPU against the twin.

use lru_cache_gpu::cpu::Cache;
use lru_cache_gpu::wgpu::Limits;
use proptest::prelude::*;

use crate::harness::{Lockstep, Op, Round, plan, play};
use crate::invariants;

#[derive(Clone, Debug)]
struct Sequence {
    blocks: u32,
    slots: u32,
    rounds: Vec<Round>,
}

fn op(kind: u32, block: u32) -> Op {
    match kind {
        0 => Op::Request(block),
        1 => Op::Touch(block),
        _ => Op::Use(block),
    }
}

/// Rays walk through neighbouring blocks, so uses come in runs.
fn round(blocks: u32, run: u32) -> impl Strategy<Value = Round> {
    let runs = prop::collection::vec((0..6u32, 0..blocks, 1..=run), 0..6);
    let leader = prop::collection::vec(0..blocks, 0..=8);
    (prop::bool::weighted(0.2), runs, leader).prop_map(move |(new_frame, runs, leader)| {
        let ops = runs.into_iter().flat_map(|(kind, first, length)| {
            (0..length).map(move |i| op(kind, (first + i) % blocks))
        });
        Round { new_frame, ops: ops.collect(), leader }
    })
}

fn sequence(most: u32, rounds: usize) -> impl Strategy<Value = Sequence> {
    let sizes = (1..=most).prop_flat_map(|blocks| (Just(blocks), blocks.min(8)..=blocks));
    sizes.prop_flat_map(move |(blocks, slots)| {
        let run = (slots / 2).max(4);
        prop::collection::vec(round(blocks, run), 1..=rounds).prop_map(move |rounds| Sequence {
            blocks,
            slots,
            rounds,
        })
    })
}

fn start(sequence: &Sequence) -> Cache {
    let plan = plan(sequence.blocks.into(), sequence.slots.into(), &Limits::default());
    let mut cache = Cache::new(&plan);
    cache.begin_frame();
    cache
}

proptest! {
    #![proptest_config(gpu_testkit::property(256))]

    #[test]
    fn every_service_keeps_its_promises(sequence in sequence(60, 24)) {
        let mut cache = start(&sequence);
        for round in &sequence.rounds {
            let served = play(&mut cache, round);
            invariants::check(&served, &cache).map_err(TestCaseError::fail)?;
        }
    }

    #[test]
    fn large_caches_keep_their_promises(sequence in sequence(1500, 12)) {
        let mut cache = start(&sequence);
        for round in &sequence.rounds {
            let served = play(&mut cache, round);
            invariants::check(&served, &cache).map_err(TestCaseError::fail)?;
        }
    }

    /// Every ray needs up to 8 blocks at each of its steps; the first unfinished one leads.
    #[test]
    fn rays_finish_with_any_cache(
        slots in 8..20u32,
        rays in prop::collection::vec(
            prop::collection::vec(prop::collection::vec(0..40u32, 1..=8), 1..6), 1..6),
    ) {
        let mut cache = start(&Sequence { blocks: 40, slots, rounds: Vec::new() });
        let mut done = vec![0; rays.len()];
        let steps: usize = rays.iter().map(Vec::len).sum();
        let mut rounds = 0;
        while let Some(leader) = (0..rays.len()).find(|&ray| done[ray] < rays[ray].len()) {
            prop_assert!(rounds < 2 * steps, "{rounds} rounds for {steps} steps");
            rounds += 1;
            let mut round = Round::default();
            let mut lead = Vec::new();
            for (ray, needs) in rays.iter().enumerate() {
                let next = |done: usize| needs.get(done);
                while let Some(need) = next(done[ray]).filter(|need| {
                    need.iter().all(|&block| cache.lookup(block).is_some())
                }) {
                    round.ops.extend(need.iter().map(|&block| Op::Use(block)));
                    done[ray] += 1;
                }
                if let Some(need) = next(done[ray]) {
                    round.ops.extend(need.iter().map(|&block| Op::Use(block)));
                    if ray == leader {
                        lead.clone_from(need);
                    }
                }
            }
            round.leader = lead;
            let served = play(&mut cache, &round);
            invariants::check(&served, &cache).map_err(TestCaseError::fail)?;
        }
    }
}

proptest! {
    #![proptest_config(gpu_testkit::property(64))]

    #[test]
    fn the_gpu_and_the_twin_go_in_step(sequence in sequence(120, 6)) {
        let plan = plan(sequence.blocks.into(), sequence.slots.into(), &Limits::default());
        let mut cache = Lockstep::new(&plan);
        for round in &sequence.rounds {
            cache.round(round);
        }
    }
}
