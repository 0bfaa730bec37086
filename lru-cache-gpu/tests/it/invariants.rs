//! What holds after every service, whatever was asked for.

use std::collections::BTreeSet;

use lru_cache_gpu::cpu::Cache;
use lru_cache_gpu::wgpu;

use crate::harness::{Round, Served, plan, play};

type Check = Result<(), String>;

fn ensure(holds: bool, what: impl FnOnce() -> String) -> Check {
    if holds { Ok(()) } else { Err(what()) }
}

/// Directory and owners are inverse to each other; no two blocks share a slot.
pub(crate) fn consistent(cache: &Cache) -> Check {
    for block in 0..cache.directory.len() as u32 {
        if let Some(slot) = cache.lookup(block) {
            ensure(slot < cache.slots(), || format!("block {block} is in slot {slot}"))?;
            let owner = cache.owner(slot);
            ensure(owner == Some(block), || format!("slot {slot} of {block} is {owner:?}'s"))?;
        }
    }
    for slot in 0..cache.slots() {
        if let Some(block) = cache.owner(slot) {
            let found = cache.lookup(block);
            ensure(found == Some(slot), || format!("owner {block} of {slot} is in {found:?}"))?;
        } else {
            ensure(cache.stamp(slot) == 0, || format!("free slot {slot} has a stamp"))?;
        }
    }
    Ok(())
}

/// Everything that one service promises.
pub(crate) fn check(served: &Served, after: &Cache) -> Check {
    let before = &served.before;
    consistent(before)?;
    consistent(after)?;
    let asked: BTreeSet<u32> = before.requests().iter().copied().collect();
    ensure(asked.len() == before.requests().len(), || "a block was requested twice".into())?;
    for block in 0..before.directory.len() as u32 {
        let listed = asked.contains(&block);
        let marked = before.directory[block as usize] == 1;
        ensure(listed == marked, || format!("block {block}: listed {listed}, marked {marked}"))?;
        let left = after.directory[block as usize] == 1;
        ensure(!left, || format!("block {block} stays requested"))?;
    }
    for &block in before.leader() {
        ensure(after.lookup(block).is_some(), || format!("the leader lacks block {block}"))?;
    }
    jobs_are_what_changed(served, after)?;
    evictions_are_allowed(before, after)?;
    counters_reconcile(served, after)
}

fn jobs_are_what_changed(served: &Served, after: &Cache) -> Check {
    let blocks: BTreeSet<u32> = served.jobs.iter().map(|job| job[0]).collect();
    ensure(blocks.len() == served.jobs.len(), || "a block is decoded twice".into())?;
    for &[block, slot] in &served.jobs {
        ensure(after.lookup(block) == Some(slot), || format!("job {block} -> {slot} is not so"))?;
        let wanted =
            served.before.requests().contains(&block) || served.before.leader().contains(&block);
        ensure(wanted, || format!("nobody asked for block {block}"))?;
        ensure(served.before.lookup(block).is_none(), || format!("block {block} was there"))?;
    }
    for block in 0..after.directory.len() as u32 {
        let came =
            after.lookup(block).is_some() && after.lookup(block) != served.before.lookup(block);
        ensure(!came || blocks.contains(&block), || format!("block {block} is not decoded"))?;
    }
    Ok(())
}

/// Slots touched in the round keep their blocks, except for at most one per block of the leader.
fn evictions_are_allowed(before: &Cache, after: &Cache) -> Check {
    let lost =
        |slot: &u32| before.owner(*slot).is_some() && after.owner(*slot) != before.owner(*slot);
    let in_use = |slot: &u32| before.stamp(*slot) == before.clock();
    for slot in (0..before.slots()).filter(lost).filter(in_use) {
        let to_leader = after.owner(slot).is_some_and(|block| before.leader().contains(&block));
        ensure(to_leader, || format!("slot {slot} was in use and lost its block"))?;
    }
    let kept = |block: &u32| before.lookup(*block) == after.lookup(*block);
    let leaders: Vec<_> = before.leader().iter().filter(|b| before.lookup(**b).is_some()).collect();
    ensure(leaders.into_iter().all(kept), || "a block of the leader moved".into())
}

fn counters_reconcile(served: &Served, after: &Cache) -> Check {
    let counters = after.counters();
    let resident = (0..after.slots()).filter(|&slot| after.owner(slot).is_some()).count() as u32;
    ensure(counters.decoded - counters.evicted == resident, || {
        format!("{counters:?} do not give {resident} resident blocks")
    })?;
    let earlier = served.before.counters();
    let decoded = counters.decoded - earlier.decoded;
    ensure(decoded as usize == served.jobs.len(), || format!("{decoded} decoded"))?;
    let requested = counters.requested - earlier.requested;
    let listed = served.before.requests();
    let absent = |block: &&u32| served.before.directory[**block as usize] == 0;
    let by_the_leader_alone: BTreeSet<&u32> =
        served.before.leader().iter().filter(absent).collect();
    let expected = listed.len() + by_the_leader_alone.len();
    ensure(requested as usize == expected, || format!("{requested} requested, not {expected}"))?;
    let absent = listed.iter().filter(|&&block| after.lookup(block).is_none()).count();
    let deferred = counters.deferred - earlier.deferred;
    ensure(deferred as usize == absent, || format!("{deferred} deferred, {absent} absent"))
}

fn example() -> (Served, Cache) {
    let mut cache = Cache::new(&plan(40, 12, &wgpu::Limits::default()));
    play(&mut cache, &Round::uses(0..8).in_new_frame());
    let served = play(&mut cache, &Round::uses([1, 2, 20]).leads([30, 31, 3]));
    (served, cache)
}

#[test]
fn the_checks_see_each_kind_of_damage() {
    let (served, after) = example();
    check(&served, &after).unwrap();
    let damaged = |damage: &dyn Fn(&mut Served, &mut Cache)| {
        let (mut served, mut after) = example();
        damage(&mut served, &mut after);
        check(&served, &after).unwrap_err()
    };
    assert!(damaged(&|_, after| after.directory[35] = 1).contains("stays requested"));
    assert!(damaged(&|_, after| after.directory[35] = 2).contains("slot 0"));
    assert!(damaged(&|_, after| after.directory[35] = 99).contains("is in slot 97"));
    assert!(damaged(&|_, after| after.state[24] = 0).contains("slot 0"));
    assert!(damaged(&|served, _| served.before.directory[35] = 1).contains("marked true"));
    assert!(damaged(&|served, _| served.jobs.push([5, 5])).contains("nobody asked"));
    assert!(damaged(&|served, _| served.jobs.clear()).contains("not decoded"));
    assert!(damaged(&|_, after| after.state[9] += 1).contains("resident blocks"));
    assert!(damaged(&|_, after| after.state[8] += 1).contains("requested"));
    assert!(damaged(&|_, after| after.state[11] += 1).contains("deferred"));
    // Block 1 was in use in this round; its slot goes to the requested block 20 instead.
    let stolen = damaged(&|served, after| {
        let (slot, own) = (after.lookup(1).unwrap(), after.lookup(20).unwrap());
        after.directory[1] = 0;
        after.directory[20] = slot + 2;
        after.state[24 + slot as usize] = 21;
        after.state[24 + own as usize] = 0;
        after.state[24 + 12 + own as usize] = 0;
        let job = served.jobs.iter_mut().find(|job| job[0] == 20).unwrap();
        job[1] = slot;
    });
    assert!(stolen.contains("was in use"), "{stolen}");
}
