//! The plan says what is allocated.

use gpu_primitives::memory::Category;
use lru_cache_gpu::wgpu::Limits;
use lru_cache_gpu::{CachePlan, CacheRoom, MAX_PAGES, SLOT_BYTES};

use crate::harness::{OnGpu, plan};

fn binding(bytes: u64) -> Limits {
    Limits { max_storage_buffer_binding_size: bytes, ..Limits::default() }
}

#[test]
fn the_plan_counts_every_allocated_byte() {
    let small = binding(1 << 14);
    let plans = [
        plan(1, 1, &Limits::default()),
        plan(8, 8, &Limits::default()),
        plan(5000, 8, &Limits::default()),
        plan(5000, 5000, &Limits::default()),
        plan(100_000, 70_001, &Limits::default()),
        plan(300, 65, &small),
        plan(300, 150, &small),
        plan(300, 256, &small),
    ];
    let pages: Vec<_> = plans.iter().map(CachePlan::page_count).collect();
    assert_eq!(pages, [1, 1, 1, 1, 1, 2, 3, 4]);
    for plan in &plans {
        let cache = OnGpu::new(plan);
        assert_eq!(cache.ledger.total(), plan.bytes(), "{plan:?}");
        assert_eq!(cache.ledger.bytes(Category::Slots), plan.slot_bytes());
        assert_eq!(cache.ledger.bytes(Category::Directory), plan.directory_bytes());
        let sizes: Vec<_> = cache.buffers.slots().iter().map(|page| page.size()).collect();
        let expected: Vec<_> = plan.pages().map(|slots| slots * SLOT_BYTES).collect();
        assert_eq!(sizes, expected);
        drop(cache.buffers);
        assert_eq!(cache.ledger.total(), 0);
    }
}

#[test]
fn every_buffer_fits_a_binding() {
    for bytes in [1 << 12, 1 << 14, 1 << 20, (1 << 20) + 4, 1 << 22] {
        let limits = binding(bytes);
        let blocks = bytes / 4;
        for most_pages in 1..=MAX_PAGES {
            let plan = CachePlan::fit_beside(
                blocks,
                CacheRoom { most_pages, ..CacheRoom::new(1 << 40) },
                &limits,
                |_| 0,
            )
            .unwrap();
            assert!(u64::from(plan.page_count()) <= most_pages);
            assert!(plan.pages().all(|slots| slots * SLOT_BYTES <= bytes));
            assert!(plan.directory_bytes() <= bytes, "{bytes} per binding");
            assert_eq!(plan.slots(), blocks.min(most_pages * (bytes / SLOT_BYTES)));
        }
        assert_eq!(
            CachePlan::fit(blocks, 1 << 40, &limits),
            CachePlan::fit_beside(blocks, CacheRoom::new(1 << 40), &limits, |_| 0)
        );
    }
}

#[test]
fn memory_beside_the_cache_counts_towards_the_bytes() {
    let limits = Limits::default();
    let beside = |slots: u64| 1000 + 12 * slots;
    for bytes in [50_000, 1 << 20, 10_000_000] {
        let plan = CachePlan::fit_beside(5000, CacheRoom::new(bytes), &limits, beside).unwrap();
        assert!(plan.bytes() + beside(plan.slots()) <= bytes);
        let alone = CachePlan::fit(5000, bytes, &limits).unwrap();
        assert!(plan.slots() < alone.slots() || plan.slots() == 5000);
        let one_more = CachePlan::fit(5000, plan.bytes() + 400, &limits).unwrap();
        let needed = one_more.bytes() + beside(one_more.slots());
        assert!(plan.slots() == 5000 || (one_more.slots() > plan.slots() && needed > bytes));
    }
    let minimum = CachePlan::minimum_bytes(5000) + beside(8);
    let fit = |bytes| CachePlan::fit_beside(5000, CacheRoom::new(bytes), &limits, beside);
    assert_eq!(fit(minimum).unwrap().slots(), 8);
    assert!(fit(minimum - 1).is_err());
}
