use crate::{device, encoder, first_difference, words};
use gpu_primitives::cpu;
use gpu_primitives::memory::Ledger;
use gpu_primitives::scan::{Scan, ScanBuffers};
use gpu_primitives::upload::UploadRing;
use gpu_testkit::gpu;
use proptest::prelude::*;
use std::sync::OnceLock;

const GROUP: usize = Scan::ITEMS_PER_GROUP as usize;

fn stage() -> &'static Scan {
    static STAGE: OnceLock<Scan> = OnceLock::new();
    STAGE.get_or_init(|| Scan::new(&device().0))
}

/// Scans the first `count` of `data` in buffers for all of it, twice in one recording where asked,
/// and compares everything with the twin.
fn check(data: &[u32], count: u32) {
    let (device, queue) = device();
    let mut filled = data.to_vec();
    filled.push(crate::SENTINEL);
    let buffer = words(device, &filled);
    let mut counts = vec![u32::MAX; 67];
    counts[66] = count;
    let counts = words(device, &counts);
    let ledger = Ledger::new();
    let plan = Scan::plan(data.len() as u64);
    let buffers = ScanBuffers::new(device, &ledger, stage(), &plan, &buffer, &counts, 4 * 66);
    assert_eq!(ledger.total(), plan.bytes());
    let mut encoder = encoder(device);
    stage().record(&mut encoder, &buffers);
    gpu::submit_and_wait(device, queue, encoder);

    let scanned = data.len().min(count as usize);
    let total = cpu::scan::exclusive_scan(&mut filled[..scanned]);
    assert_eq!(gpu::read_u32s(device, queue, buffers.total()), [total], "total of {count}");
    let found = gpu::read_u32s(device, queue, &buffer);
    assert_eq!(first_difference(&found, &filled), None, "{count} of {}", data.len());
}

fn mixed(length: usize) -> Vec<u32> {
    (0..length as u32).map(|i| (i ^ 0x9E37).wrapping_mul(2_654_435_761) >> 7).collect()
}

#[test]
fn the_twin_sums() {
    let mut data = [3, 0, u32::MAX, 5];
    assert_eq!(cpu::scan::exclusive_scan(&mut data), 7);
    assert_eq!(data, [0, 3, 3, 2]);
}

#[test]
fn lengths_around_a_group() {
    for length in [0, 1, 2, 255, 256, 257, GROUP - 1, GROUP, GROUP + 1, 2 * GROUP] {
        check(&mixed(length), length as u32);
    }
}

#[test]
fn several_levels() {
    for length in [GROUP * GROUP - 1, GROUP * GROUP, GROUP * GROUP + 1] {
        check(&mixed(length), length as u32);
    }
    assert_eq!(Scan::plan(1).dispatches(), 1);
    assert_eq!(Scan::plan(1025).dispatches(), 4);
    assert_eq!(Scan::plan((1 << 20) + 1).dispatches(), 6);
}

#[test]
fn the_count_on_the_gpu_decides() {
    let data = mixed(3 * GROUP + 17);
    for count in [0, 1, GROUP - 1, GROUP, GROUP + 1, 3 * GROUP, 3 * GROUP + 16] {
        check(&data, count as u32);
    }
    let three_levels = mixed(GROUP * GROUP + 1);
    for count in [0, 1, GROUP + 1, GROUP * GROUP] {
        check(&three_levels, count as u32);
    }
}

#[test]
fn a_count_above_the_plan_does_no_harm() {
    for count in [2 * GROUP as u32 + 6, u32::MAX] {
        check(&mixed(2 * GROUP + 5), count);
        check(&mixed(5), count);
    }
}

#[test]
fn sums_wrap() {
    check(&vec![u32::MAX; GROUP + 1], GROUP as u32 + 1);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]
    #[test]
    fn agrees_with_the_twin(data in prop::collection::vec(any::<u32>(), 0..5000), part in 0.0..=1.2) {
        check(&data, (data.len() as f64 * part) as u32);
    }
}

#[test]
fn buffers_serve_many_counts_in_one_recording() {
    const COUNTS: [u32; 4] = [2 * GROUP as u32 + 9, 0, 7, GROUP as u32 + 1];
    let (device, queue) = device();
    let ledger = Ledger::new();
    let data = words(device, &mixed(2 * GROUP + 9));
    let count = words(device, &[0]);
    let totals = gpu::sentinel_buffer(device, 4 * COUNTS.len() as u64, crate::SENTINEL);
    let plan = Scan::plan(2 * GROUP as u64 + 9);
    let buffers = ScanBuffers::new(device, &ledger, stage(), &plan, &data, &count, 0);
    let mut upload = UploadRing::new(&ledger, "test", 256);
    let mut encoder = encoder(device);
    for (place, value) in (0u64..).zip(COUNTS) {
        upload.write(device, &mut encoder, &count, 0, &value.to_le_bytes());
        stage().record(&mut encoder, &buffers);
        encoder.copy_buffer_to_buffer(buffers.total(), 0, &totals, 4 * place, 4);
    }
    gpu::submit_and_wait(device, queue, encoder);

    let mut expected = mixed(2 * GROUP + 9);
    let expected_totals =
        COUNTS.map(|count| cpu::scan::exclusive_scan(&mut expected[..count as usize]));
    assert_eq!(gpu::read_u32s(device, queue, &totals), expected_totals);
    assert_eq!(first_difference(&gpu::read_u32s(device, queue, &data), &expected), None);
}
