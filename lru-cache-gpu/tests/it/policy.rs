//! Who gets a slot, and whose slot goes: scenarios, on the GPU and the twin in step. Where several
//! victims are possible, scenarios do not say which goes.

use lru_cache_gpu::cpu::Cache;
use lru_cache_gpu::wgpu::Limits;

use crate::harness::{Lockstep, Op, Round, gpu, plan, sorted};

fn cache(blocks: u64, slots: u64) -> Lockstep {
    Lockstep::new(&plan(blocks, slots, &Limits::default()))
}

fn resident(cache: &Cache) -> Vec<u32> {
    sorted((0..cache.slots()).filter_map(|slot| cache.owner(slot)).collect())
}

fn list(blocks: impl IntoIterator<Item = u32>) -> Vec<u32> {
    blocks.into_iter().collect()
}

fn touches(blocks: impl IntoIterator<Item = u32>) -> Round {
    Round { ops: blocks.into_iter().map(Op::Touch).collect(), ..Round::default() }
}

fn blocks_of(jobs: &[[u32; 2]]) -> Vec<u32> {
    sorted(jobs.iter().map(|job| job[0]).collect())
}

#[test]
fn a_block_is_requested_once_however_many_ask() {
    let mut cache = cache(100, 20);
    let served = cache.round(&Round::uses([7, 7, 7, 9, 7, 9]));
    assert_eq!(served.before.requests(), [7, 9]);
    assert_eq!(blocks_of(&served.jobs), [7, 9]);
    assert_eq!(cache.twin.counters().requested, 2);
}

#[test]
fn requests_are_listed_in_the_order_in_which_they_arrive() {
    let mut cache = cache(1000, 40);
    let asked: Vec<u32> = (0..30).map(|i| (i * 377 + 5) % 1000).collect();
    let served = cache.round(&Round::uses(asked.clone()));
    assert_eq!(served.before.requests(), asked);
}

#[test]
fn requests_beyond_the_list_are_forgotten_and_may_be_made_again() {
    let mut cache = cache(100, 8);
    let served = cache.round(&Round::uses(0..20));
    assert_eq!(served.before.requests(), list(0..8));
    assert_eq!(resident(&cache.twin), list(0..8));
    cache.round(&Round::uses(8..20).in_new_frame());
    assert_eq!(resident(&cache.twin), list(8..16));
}

#[test]
fn a_request_for_a_resident_block_gives_it_no_second_slot() {
    let mut cache = cache(100, 20);
    cache.round(&Round::uses(0..5));
    let ops = (3..8).map(Op::RequestBlindly).collect();
    let served = cache.round(&Round { ops, ..Round::default() });
    assert_eq!(blocks_of(&served.jobs), [5, 6, 7]);
    assert_eq!(resident(&cache.twin), list(0..8));
}

#[test]
fn slots_that_were_never_used_are_given_away_one_after_the_other() {
    let mut cache = cache(100, 20);
    for (first, leads) in [(0, 50), (5, 51), (10, 0)] {
        let next = cache.twin.next_free();
        let served = cache.round(&Round::uses(first..first + 5).leads([leads]));
        let slots = sorted(served.jobs.iter().map(|job| job[1]).collect());
        assert_eq!(slots, list(next..next + served.jobs.len() as u32));
        assert_eq!(cache.twin.hand(), 0, "nothing is searched");
    }
    // Of six requests, the last three slots serve three; the search finds only slots in use.
    let ops = touches((0..15).chain(50..52)).ops;
    let ops = ops.into_iter().chain((80..86).map(Op::Request)).collect();
    let served = cache.round(&Round { ops, ..Round::default() });
    assert_eq!(sorted(served.jobs.iter().map(|job| job[1]).collect()), [17, 18, 19]);
    assert_eq!(cache.twin.counters().deferred, 3);
    assert_eq!(cache.twin.counters().evicted, 0);
}

#[test]
fn a_cleared_cache_begins_anew() {
    let mut cache = cache(100, 10);
    cache.round(&Round::uses(0..30));
    let mut encoder = gpu().encoder();
    gpu().service.record_clear(&mut encoder, &cache.gpu.buffers);
    gpu().service.record_begin_frame(&mut encoder, &cache.gpu.buffers);
    gpu().submit(encoder);
    cache.twin = Cache::new(cache.gpu.buffers.plan());
    cache.twin.begin_frame();
    let served = cache.round(&Round::uses(40..50));
    assert_eq!(sorted(served.jobs.iter().map(|job| job[1]).collect()), list(0..10));
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
fn slots_go_by_the_frame_of_their_last_use_then_by_the_round() {
    let mut cache = cache(100, 30);
    cache.round(&Round::uses(0..10));
    cache.round(&Round::uses(10..20).in_new_frame());
    cache.round(&Round::uses(20..30).in_new_frame());
    assert_eq!(cache.twin.counters().evicted, 0, "free slots come before any others");
    cache.round(&Round::uses(30..40));
    assert_eq!(resident(&cache.twin), list(10..40), "two frames back");
    let served = cache.round(&Round::uses(40..50));
    assert!(served.jobs.is_empty(), "the sweep finds only slots of this frame and the last");
    cache.round(&Round::uses(40..50));
    assert_eq!(resident(&cache.twin), list(20..50), "one frame back");
    let served = cache.round(&Round::uses(50..55));
    assert!(served.jobs.is_empty(), "the sweep finds only slots of this frame");
    cache.round(&Round::uses((20..45).chain(50..55)));
    assert_eq!(resident(&cache.twin), list((20..45).chain(50..55)), "not used in this round");
    let next = cache.round(&Round::uses(60..70).in_new_frame());
    assert!(next.jobs.is_empty(), "a new frame spares the last one again");
    let next = cache.round(&Round::uses(60..70));
    assert_eq!(next.jobs.len(), 10);
}

#[test]
fn a_frame_without_a_round_does_not_count() {
    let mut cache = cache(100, 20);
    for first in [0, 5, 10, 15] {
        cache.round(&Round::uses(first..first + 5).in_new_frame());
    }
    let empty = Round { new_frame: true, ..Round::default() };
    cache.gpu.play(&empty, true);
    cache.twin.begin_frame();
    cache.round(&Round::uses(50..65).in_new_frame());
    assert_eq!(resident(&cache.twin), list((15..20).chain(50..65)), "spared is the last frame");
}

#[test]
fn an_old_block_that_is_used_again_counts_as_new() {
    let mut cache = cache(100, 20);
    cache.round(&Round::uses(0..20));
    cache.round(&touches(5..20).in_new_frame());
    cache.round(&Round::uses(40..45));
    assert_eq!(resident(&cache.twin), list((5..20).chain(40..45)));
}

// The first search looks at 2 * 5 + 256 slots, those after one in vain at twice as many as before.
#[test]
fn a_full_cache_is_swept_once_before_slots_of_this_frame_go() {
    let mut cache = cache(3000, 1000);
    cache.round(&Round::uses(0..1000));
    cache.round(&Round::uses((0..1000).chain(2000..2005)).in_new_frame());
    for round in 0..2 {
        let served = cache.round(&Round::uses(2000..2005).leads([2900 + round]));
        assert_eq!(served.jobs.len(), 1, "only the leader is served in round {round}");
    }
    let served = cache.round(&Round::uses(2000..2005));
    assert_eq!(blocks_of(&served.jobs), list(2000..2005));
    assert_eq!(cache.twin.counters().evicted, 7);
}

#[test]
fn the_first_frame_does_not_sweep_for_earlier_ones() {
    let mut cache = cache(100, 10);
    cache.round(&Round::uses(0..10));
    let served = cache.round(&Round::uses(20..25));
    assert_eq!(served.jobs.len(), 5, "there is nothing older to look for");
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
            let hand = cache.twin.hand();
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
    let led: Vec<_> = served.jobs[..3].iter().map(|job| job[0]).collect();
    assert_eq!(led, [5, 6, 4]);
    assert_eq!(blocks_of(&served.jobs), list(1..7));
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
