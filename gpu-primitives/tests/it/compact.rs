use crate::{SENTINEL, device, encoder, first_difference, words};
use gpu_primitives::compact::{Compact, CompactBuffers};
use gpu_primitives::cpu;
use gpu_primitives::memory::Ledger;
use gpu_primitives::scan::Scan;
use gpu_testkit::gpu;
use proptest::prelude::*;
use std::sync::OnceLock;

const GROUP: usize = Scan::ITEMS_PER_GROUP as usize;

fn stage() -> &'static Compact {
    static STAGE: OnceLock<Compact> = OnceLock::new();
    STAGE.get_or_init(|| Compact::new(&device().0))
}

/// Compacts the first `count` elements in buffers for all of them and compares with the twin.
fn check(flags: &[u32], count: u32) {
    let (device, queue) = device();
    let length = flags.len();
    let values: Vec<u32> = (0..length as u32).map(|i| i.wrapping_mul(3) ^ 0xA5A5).collect();
    // One word more: bindings are never empty, and nothing beyond the length is touched.
    let pad = |data: &[u32]| words(device, &[data, &[1]].concat());
    let (flag_buffer, value_buffer) = (pad(flags), pad(&values));
    let out = gpu::sentinel_buffer(device, 4 * (length as u64 + 1), SENTINEL);
    let mut counters = vec![SENTINEL; 69];
    counters[67] = count;
    let counters = words(device, &counters);

    let ledger = Ledger::new();
    let plan = Compact::plan(length as u64);
    let buffers = CompactBuffers::new(
        device,
        &ledger,
        stage(),
        &plan,
        &flag_buffer,
        &value_buffer,
        (&counters, 4 * 67),
        &out,
        (&counters, 4 * 68),
    );
    assert_eq!(ledger.total(), plan.bytes());
    let mut encoder = encoder(device);
    stage().record(&mut encoder, &buffers);
    gpu::submit_and_wait(device, queue, encoder);

    let part = length.min(count as usize);
    let mut expected = cpu::compact::compact(&flags[..part], &values[..part]);
    let kept = expected.len() as u32;
    let counters = gpu::read_u32s(device, queue, &counters);
    assert_eq!(counters[65..], [SENTINEL, SENTINEL, count, kept], "{count} of {length}");
    expected.resize(length + 1, SENTINEL);
    let found = gpu::read_u32s(device, queue, &out);
    assert_eq!(first_difference(&found, &expected), None, "{count} of {length}");
}

fn some(length: usize) -> Vec<u32> {
    (0..length as u32).map(|i| (i.wrapping_mul(2_654_435_761) >> 29) & 5).collect()
}

#[test]
fn the_twin_keeps_flagged_values_in_order() {
    assert_eq!(cpu::compact::compact(&[0, 1, 0, 7], &[10, 11, 12, 13]), [11, 13]);
}

#[test]
fn lengths_around_a_group() {
    for length in [0, 1, 255, 256, 257, GROUP - 1, GROUP, GROUP + 1, 5 * GROUP] {
        check(&some(length), length as u32);
    }
}

#[test]
fn several_levels() {
    check(&some(GROUP * GROUP + 1), (GROUP * GROUP) as u32 + 1);
}

#[test]
fn none_and_all_are_kept() {
    check(&vec![0; 2 * GROUP + 1], 2 * GROUP as u32 + 1);
    check(&vec![u32::MAX; 2 * GROUP + 1], 2 * GROUP as u32 + 1);
}

#[test]
fn the_count_on_the_gpu_decides() {
    let flags = some(3 * GROUP + 17);
    for count in [0, 1, GROUP - 1, GROUP, GROUP + 1, 3 * GROUP + 16] {
        check(&flags, count as u32);
    }
    check(&flags, 3 * GROUP as u32 + 18);
    check(&flags, u32::MAX);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]
    #[test]
    fn agrees_with_the_twin(
        flags in prop::collection::vec(prop_oneof![3 => Just(0u32), 2 => any::<u32>()], 0..5000),
        part in 0.0..=1.2,
    ) {
        check(&flags, (flags.len() as f64 * part) as u32);
    }
}
