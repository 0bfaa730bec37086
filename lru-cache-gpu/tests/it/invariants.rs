//! What holds after every service, whatever was asked for.

use std::collections::BTreeSet;

use lru_cache_gpu::cpu::Cache;
use lru_cache_gpu::wgpu;

use crate::harness::{Round, Served, plan, play};

type Check = Result<(), String>;

fn ensure(holds: bool, what: impl FnOnce() -> String) -> Check {
    if holds { Ok(()) } else { Err(what()) }
}

/// The directory is well-formed: every slot with a block is in exactly one chain, once, which is
/// its block's; no two blocks share a slot, no block has two.
pub(crate) fn consistent(cache: &Cache) -> Check {
    let mut owners = BTreeSet::new();
    let mut chained = 0;
    for slot in 0..cache.slots() {
        let used = slot < cache.next_free();
        let owner = cache.owner(slot);
        ensure(used == owner.is_some(), || format!("slot {slot}: used {used}, {owner:?}'s"))?;
        ensure(used == (cache.stamp(slot) > 0), || format!("slot {slot}: used {used}, stamp"))?;
        if let Some(block) = owner {
            ensure(owners.insert(block), || format!("block {block} has several slots"))?;
            chained += 1;
        }
    }
    let visited = chains(cache)?;
    ensure(visited.len() == chained, || "a slot with a block is in no chain".into())?;
    for &block in &owners {
        let slot = cache.lookup(block);
        let owner = slot.and_then(|slot| cache.owner(slot));
        ensure(owner == Some(block), || format!("block {block} is in another block's chain"))?;
    }
    Ok(())
}

/// Slots in all chains, each once.
fn chains(cache: &Cache) -> Result<BTreeSet<u32>, String> {
    let heads = cache.directory.len() - 2 * cache.slots() as usize;
    let mut visited = BTreeSet::new();
    for head in 0..heads {
        let mut link = cache.directory[head];
        while link != 0 {
            let slot = link - 1;
            ensure(slot < cache.slots(), || format!("head {head} leads to slot {slot}"))?;
            ensure(visited.insert(slot), || format!("slot {slot} is in chains twice"))?;
            link = cache.directory[heads + 2 * slot as usize + 1];
        }
    }
    Ok(visited)
}

/// Everything that one service promises.
pub(crate) fn check(served: &Served, after: &Cache) -> Check {
    let before = &served.before;
    consistent(before)?;
    consistent(after)?;
    let asked: BTreeSet<u32> = before.requests().into_iter().collect();
    ensure(asked.len() == before.requests().len(), || "a block was requested twice".into())?;
    let marked: BTreeSet<u32> =
        before.request_table().iter().filter_map(|word| word.checked_sub(1)).collect();
    ensure(asked == marked, || format!("listed {asked:?}, in the table {marked:?}"))?;
    let left = after.request_table().iter().find(|&&word| word != 0);
    ensure(left.is_none(), || format!("{left:?} stays requested"))?;
    for &block in before.leader() {
        ensure(after.lookup(block).is_some(), || format!("the leader lacks block {block}"))?;
    }
    jobs_are_what_changed(served, after)?;
    evictions_are_allowed(before, after)?;
    counters_reconcile(served, after)
}

fn jobs_are_what_changed(served: &Served, after: &Cache) -> Check {
    let before = &served.before;
    let blocks: BTreeSet<u32> = served.jobs.iter().map(|job| job[0]).collect();
    ensure(blocks.len() == served.jobs.len(), || "a block is decoded twice".into())?;
    let asked: BTreeSet<u32> = before.requests().into_iter().collect();
    for &[block, slot] in &served.jobs {
        ensure(after.lookup(block) == Some(slot), || format!("job {block} -> {slot} is not so"))?;
        let wanted = asked.contains(&block) || before.leader().contains(&block);
        ensure(wanted, || format!("nobody asked for block {block}"))?;
        ensure(before.lookup(block).is_none(), || format!("block {block} was there"))?;
    }
    for slot in 0..after.slots() {
        let (old, new) = (before.owner(slot), after.owner(slot));
        let came = new.filter(|_| new != old);
        let decoded = came.is_none_or(|block| blocks.contains(&block));
        ensure(decoded, || format!("block {came:?} in slot {slot} is not decoded"))?;
    }
    Ok(())
}

/// Blocks go only when all slots are in use, and only those that are not spared, except for at most
/// one per block of the leader.
fn evictions_are_allowed(before: &Cache, after: &Cache) -> Check {
    let lost =
        |slot: &u32| before.owner(*slot).is_some() && after.owner(*slot) != before.owner(*slot);
    for slot in (0..before.slots()).filter(lost) {
        ensure(after.next_free() == after.slots(), || {
            format!("slot {slot} lost its block, others were never used")
        })?;
        let to_leader = after.owner(slot).is_some_and(|block| before.leader().contains(&block));
        let spared = before.stamp(slot) >= before.spared_from();
        ensure(to_leader || !spared, || format!("slot {slot} was spared and lost its block"))?;
    }
    let kept = |block: &u32| before.lookup(*block) == after.lookup(*block);
    let leaders: Vec<_> = before.leader().iter().filter(|b| before.lookup(**b).is_some()).collect();
    ensure(leaders.into_iter().all(kept), || "a block of the leader moved".into())
}

fn counters_reconcile(served: &Served, after: &Cache) -> Check {
    let counters = after.counters();
    let before = &served.before;
    let resident = (0..after.slots()).filter(|&slot| after.owner(slot).is_some()).count() as u32;
    ensure(counters.decoded - counters.evicted == resident, || {
        format!("{counters:?} do not give {resident} resident blocks")
    })?;
    let earlier = before.counters();
    let decoded = counters.decoded - earlier.decoded;
    ensure(decoded as usize == served.jobs.len(), || format!("{decoded} decoded"))?;
    let requested = counters.requested - earlier.requested;
    let listed = before.requests();
    let alone = |block: &&u32| before.lookup(**block).is_none() && !before.is_requested(**block);
    let by_the_leader_alone: BTreeSet<&u32> = before.leader().iter().filter(alone).collect();
    let expected = listed.len() + by_the_leader_alone.len();
    ensure(requested as usize == expected, || format!("{requested} requested, not {expected}"))?;
    let absent = listed.iter().filter(|&&block| after.lookup(block).is_none()).count();
    let deferred = counters.deferred - earlier.deferred;
    ensure(deferred as usize == absent, || format!("{deferred} deferred, {absent} absent"))
}

/// A round in which blocks 20, 30 and 31 come into free slots, and 1 and 2 are used.
fn with_room() -> (Served, Cache) {
    let mut cache = Cache::new(&plan(40, 12, &wgpu::Limits::default()));
    play(&mut cache, &Round::uses(0..8).in_new_frame());
    let served = play(&mut cache, &Round::uses([1, 2, 20]).leads([30, 31, 3]));
    (served, cache)
}

/// A round in which block 20 takes the slot of a block of the frame before.
fn without_room() -> (Served, Cache) {
    let mut cache = Cache::new(&plan(40, 8, &wgpu::Limits::default()));
    play(&mut cache, &Round::uses(0..8).in_new_frame());
    play(&mut cache, &Round::uses(0..8).in_new_frame());
    play(&mut cache, &Round::uses(20..21).in_new_frame());
    let served = play(&mut cache, &Round::uses(20..21));
    (served, cache)
}

/// First word of a slot's entry in a cache of 12 slots.
fn entry(cache: &Cache, slot: usize) -> usize {
    cache.directory.len() - 2 * (12 - slot)
}

#[test]
fn the_checks_see_each_kind_of_damage() {
    type Damage = dyn Fn(&mut Served, &mut Cache);
    let damaged = |example: &dyn Fn() -> (Served, Cache), damage: &Damage, says: &str| {
        let (mut served, mut after) = example();
        check(&served, &after).unwrap();
        damage(&mut served, &mut after);
        let error = check(&served, &after).unwrap_err();
        assert!(error.contains(says), "{error}");
    };
    let room = |damage: &Damage, says: &str| damaged(&with_room, damage, says);
    room(&|_, after| *after.state.last_mut().unwrap() = 36, "Some(36) stays requested");
    room(&|served, _| *served.before.state.last_mut().unwrap() = 36, "in the table");
    room(
        &|_, after| {
            let first = entry(after, 0);
            after.directory[first] = 0;
        },
        "slot 0: used true",
    );
    room(
        &|_, after| {
            let first = entry(after, 0);
            after.directory[first] = 2;
        },
        "block 1 has several slots",
    );
    room(
        &|_, after| {
            let first = entry(after, 0);
            after.directory[first + 1] = 1;
        },
        "in chains twice",
    );
    room(&|_, after| after.directory[0] |= 1 << 31, "leads to slot");
    room(&|_, after| after.directory[..16].fill(0), "is in no chain");
    room(&|_, after| after.directory[..16].rotate_left(1), "another block's chain");
    room(&|served, _| served.jobs.push([5, 5]), "nobody asked");
    room(&|served, _| served.jobs.clear(), "not decoded");
    room(&|_, after| after.state[9] += 1, "resident blocks");
    room(&|_, after| after.state[8] += 1, "requested");
    room(&|_, after| after.state[11] += 1, "deferred");
    let full = |damage: &Damage, says: &str| damaged(&without_room, damage, says);
    full(&|served, _| served.before.state[25..33].fill(3), "was spared");
}
