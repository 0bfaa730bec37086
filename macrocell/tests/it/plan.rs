//! The plan says what is allocated.

use gpu_primitives::memory::{Category, Ledger};
use macrocell::wgpu::Limits;
use macrocell::{MacrocellPlan, Masks, RangeBuffers, RangeScratch};

use crate::common::gpu;

#[test]
fn the_plan_counts_every_allocated_byte() {
    let gpu = gpu();
    let small = Limits { max_storage_buffer_binding_size: 1152, ..Limits::default() };
    let default = Limits::default();
    for (dims, limits, third_level) in [
        ([1, 1, 1], &default, false),
        ([70, 33, 5], &default, false),
        ([70, 70, 70], &small, false),
        ([129, 129, 129], &default, true),
        ([300, 16, 900], &default, true),
    ] {
        let plan = MacrocellPlan::new(dims, limits).unwrap();
        assert_eq!(plan.grid().has_third_level(), third_level);
        let ledger = Ledger::new();
        let ranges = RangeBuffers::new(&gpu.device, &ledger, &plan);
        assert_eq!(ledger.by_category(), [(Category::Ranges, plan.range_bytes())]);
        let masks = Masks::new(&gpu.device, &ledger, &gpu.activate, &ranges);
        assert_eq!(ledger.bytes(Category::Masks), plan.mask_bytes());
        let params = Masks::params_bytes(&plan);
        assert_eq!(ledger.bytes(Category::Params), params);
        assert_eq!(ledger.total(), plan.range_bytes() + plan.mask_bytes() + params, "{dims:?}");
        let kept = ledger.total();
        let scratch = RangeScratch::new(&gpu.device, &ledger, &gpu.ranges, &ranges);
        let scratch_bytes = plan.scratch_bytes() + RangeScratch::PARAMS_BYTES;
        assert_eq!(ledger.total() - kept, scratch_bytes);
        drop(scratch);
        assert_eq!(ledger.total(), kept);
        drop((ranges, masks));
        assert_eq!(ledger.total(), 0);
    }
}

#[test]
fn volumes_without_a_third_level_allocate_none() {
    let plan = MacrocellPlan::new([64; 3], &Limits::default()).unwrap();
    assert_eq!(plan.grid().mask_count(), plan.grid().coarse_count());
}
