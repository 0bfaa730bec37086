//! Who gets a slot, and whose slot goes: scenarios, on the GPU and the twin in step.

use lru_cache_gpu::cpu::Cache;
use lru_cache_gpu::wgpu::Limits;

use crate::harness::{Lockstep, Op, Round, plan, sorted};

fn cache(blocks: u64, slots: u64) -> Lockstep {
    Lockstep::new(&plan(blocks, slots, &Limits::default()))
}

fn resident(cache: &Cache) -> Vec<u32> {
    (0..cache.directory.len() as u32).filter(|&block| cache.lookup(block).is_some()).collect()
}

fn list(blocks: impl IntoIterator<Item = u32>) -> Vec<u32> {
    blocks.into_iter().collect()
}

#[test]
fn a_block_is_requested_once_however_many_ask() {
    let mut cache = cache(100, 20);
    let served = cache.round(&Round::uses([7, 7, 7, 9, 7, 9]));
    assert_eq!(served.before.requests(), [7, 9]);
    assert_eq!(served.jobs, [[7, 0], [9, 1]]);
    assert_eq!(cache.twin.counters().requested, 2);
}

#[test]
fn requests_beyond_the_list_are_forgotten_and_may_be_made_again() {
    let mut cache = cache(100, 8);
    let served = cache.round(&Round::uses(0..20));
    assert_eq!(served.before.requests(), list(0..8));
    assert_eq!(served.before.state[0], 20, "the count goes on");
    assert_eq!(resident(&cache.twin), list(0..8));
    cache.round(&Round::uses(8..20).in_new_frame());
    assert_eq!(resident(&cache.twin), list(8..16));
}

#[test]
fn slots_in_use_are_kept_and_deferred_requests_asked_again() {
    let mut cache = cache(100, 10);
    cache.round(&Round::uses(0..10));
    let served = cache.round(&Round::uses((0..10).chain(20..25)));
    assert!(served.jobs.is_empty(), "every slot is in use");
    assert_eq!(cache.twin.counters().deferred, 5);
    cache.round(&Round::uses((0..5).chain(20..25)));
    assert_eq!(resident(&cache.twin), list((0..5).chain(20..25)));
    assert_eq!(cache.twin.counters().deferred, 5);
}

#[test]
fn slots_of_earlier_frames_go_first_then_older_rounds_of_this_one() {
    let mut cache = cache(100, 20);
    cache.round(&Round::uses(0..10));
    cache.round(&Round::uses(50..60).in_new_frame());
    assert_eq!(cache.twin.counters().evicted, 0, "free slots come before any others");
    cache.round(&Round::uses(70..80));
    assert_eq!(resident(&cache.twin), list((50..60).chain(70..80)), "the earlier frame's went");
    let served = cache.round(&Round::uses(90..95));
    assert!(served.jobs.is_empty(), "the sweep finds only slots of this frame");
    cache.round(&Round::uses((50..53).chain(90..95)));
    assert_eq!(cache.twin.counters().evicted, 15);
    let kept: Vec<_> = (50..53).map(|block| cache.twin.lookup(block).is_some()).collect();
    assert_eq!(kept, [true; 3], "used in this round");
    let new_frame = cache.round(&Round::uses(0..15).in_new_frame());
    assert_eq!(new_frame.jobs.len(), 15, "a new frame spares nothing of the earlier one");
}

#[test]
fn an_old_block_that_is_used_again_counts_as_new() {
    let mut cache = cache(100, 20);
    cache.round(&Round::uses(0..20));
    let touched = Round { ops: (5..20).map(Op::Touch).collect(), ..Round::default() };
    cache.round(&touched.in_new_frame());
    cache.round(&Round::uses(40..45));
    assert_eq!(resident(&cache.twin), list((5..20).chain(40..45)));
}

// One search looks at 2 * 5 + 256 slots, so a sweep of 1000 slots takes four rounds.
#[test]
fn a_full_cache_is_swept_once_before_slots_of_this_frame_go() {
    let mut cache = cache(3000, 1000);
    cache.round(&Round::uses(0..1000));
    for round in 0..4 {
        let served = cache.round(&Round::uses(2000..2005).leads([2900 + round]));
        assert_eq!(served.jobs.len(), 1, "only the leader is served in round {round}");
    }
    let served = cache.round(&Round::uses(2000..2005));
    assert_eq!(sorted(served.jobs).iter().map(|job| job[0]).collect::<Vec<_>>(), list(2000..2005));
}

#[test]
fn the_leader_is_served_even_if_every_slot_is_in_use() {
    for slots in [8, 9, 63, 64, 65, 100] {
        let mut cache = cache(200, slots);
        let all = 0..slots as u32;
        cache.round(&Round::uses(all.clone()));
        let served = cache.round(&Round::uses(all.clone().chain(150..160)).leads(190..198));
        assert_eq!(served.jobs.len(), 8, "{slots} slots");
        // Half of the leader's blocks are there already and must not go for the other half.
        cache.round(&Round::uses(150..200).leads((194..198).chain(180..184)));
        assert!((180..184).chain(194..198).all(|block| cache.twin.lookup(block).is_some()));
    }
}

#[test]
fn the_leader_never_takes_a_slot_that_it_needs_itself() {
    for slots in [8, 9, 66] {
        let mut cache = cache(400, slots);
        cache.round(&Round::uses(0..slots as u32));
        for round in 0..20 {
            // Four blocks after the hand, which the search meets first, and four absent ones.
            let hand = cache.twin.state[2];
            let next = (0..4).map(|i| (hand + i) % slots as u32);
            let own: Vec<_> = next.filter_map(|slot| cache.twin.owner(slot)).collect();
            let absent = 200 + 4 * round..204 + 4 * round;
            let all = Round::uses(resident(&cache.twin));
            let served = cache.round(&all.leads(own.into_iter().chain(absent)));
            assert_eq!(served.jobs.len(), 4, "{slots} slots, round {round}");
        }
    }
}

#[test]
fn the_leader_prefers_slots_that_nobody_uses() {
    let mut cache = cache(200, 60);
    cache.round(&Round::uses(0..50));
    cache.round(&Round::uses(0..40).leads([100, 101]).in_new_frame());
    assert_eq!(cache.twin.counters().evicted, 0, "there are free slots");
    cache.round(&Round::uses(110..118).leads([102, 103]));
    let evicted: Vec<_> = (0..60).filter(|&block| cache.twin.lookup(block).is_none()).collect();
    assert_eq!(cache.twin.counters().evicted, 2);
    assert!(evicted.iter().all(|block| *block >= 40), "{evicted:?} were used in this frame");
}

#[test]
fn a_block_that_the_leader_and_others_ask_for_is_decoded_once() {
    let mut cache = cache(100, 20);
    let served = cache.round(&Round::uses([1, 5, 2, 6, 3]).leads([5, 5, 6, 4]));
    let blocks: Vec<_> = served.jobs.iter().map(|job| job[0]).collect();
    assert_eq!(blocks, [5, 6, 4, 1, 2, 3]);
    let other = cache.round(&Round::default().leads([5, 6]));
    assert!(other.jobs.is_empty(), "both are there");
}

#[test]
fn a_cache_with_a_slot_for_every_block_never_evicts() {
    for blocks in [1, 3, 8, 50, 700] {
        let mut cache = cache(blocks, blocks);
        let blocks = blocks as u32;
        let mut decoded = 0;
        for step in 0..6 {
            let asked = (0..30).map(|i| (i * i * 7 + step * 13) % blocks);
            let leads = (0..blocks.min(8)).map(|i| (step * 31 + i) % blocks);
            let round = Round::uses(asked).leads(leads);
            let round = if step % 2 == 0 { round.in_new_frame() } else { round };
            let served = cache.round(&round);
            assert!(served.jobs.iter().all(|[block, slot]| block == slot));
            decoded += served.jobs.len();
        }
        assert_eq!(resident(&cache.twin).len(), decoded);
        let counters = cache.twin.counters();
        assert_eq!((counters.evicted, counters.deferred), (0, 0), "{blocks} blocks");
    }
}

#[test]
fn slots_over_several_pages_are_one_cache() {
    let limits = Limits { max_storage_buffer_binding_size: 1 << 14, ..Limits::default() };
    let mut cache = Lockstep::new(&plan(300, 150, &limits));
    for first in (0..300).step_by(50) {
        cache.round(&Round::uses(first..first + 50).leads(first + 48..first + 50).in_new_frame());
    }
    assert_eq!(resident(&cache.twin).len(), 150);
    assert!((0..150).all(|slot| cache.twin.owner(slot).is_some()));
}

#[test]
fn an_empty_round_does_nothing_but_count() {
    let mut cache = cache(100, 10);
    cache.round(&Round::uses(0..4));
    let before = cache.twin.clone();
    let served = cache.round(&Round::default());
    assert!(served.jobs.is_empty());
    assert_eq!(cache.twin.directory, before.directory);
    assert_eq!(cache.twin.counters(), before.counters());
    assert_eq!(cache.twin.clock(), before.clock() + 1);
}
