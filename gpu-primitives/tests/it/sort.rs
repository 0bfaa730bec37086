use crate::{SENTINEL, device, encoder, first_difference, words};
use gpu_primitives::cpu;
use gpu_primitives::memory::Ledger;
use gpu_primitives::sort::{Sort, SortBuffers};
use gpu_primitives::upload::UploadRing;
use gpu_testkit::gpu;
use proptest::prelude::*;
use std::sync::OnceLock;

const GROUP: usize = Sort::PAIRS_PER_GROUP as usize;

fn stage() -> &'static Sort {
    static STAGE: OnceLock<Sort> = OnceLock::new();
    STAGE.get_or_init(|| Sort::new(&device().0))
}

/// Values that tell every pair apart, so that a pair out of order shows even among equal keys.
fn values(length: usize) -> Vec<u32> {
    (0..length as u32).map(|i| i.wrapping_mul(3) ^ 0xA5A5).collect()
}

/// Sorts the first `count` of `keys` in buffers for all of them and compares with the twin.
fn check(keys: &[u32], count: u32, key_bits: u32) {
    let (device, queue) = device();
    let length = keys.len();
    let what = || format!("{count} of {length} by {key_bits} bits");
    let values = values(length);
    // One word more: bindings are never empty, and nothing beyond the count is touched.
    let pad = |data: &[u32]| [data, &[SENTINEL]].concat();
    let (all_keys, all_values) = (pad(keys), pad(&values));
    let (key_buffer, value_buffer) = (words(device, &all_keys), words(device, &all_values));
    let mut counts = vec![u32::MAX; 67];
    counts[66] = count;
    let counts = words(device, &counts);

    let ledger = Ledger::new();
    let plan = Sort::plan(length as u64, key_bits);
    let place = (&counts, 4 * 66);
    let buffers =
        SortBuffers::new(device, &ledger, stage(), &plan, &key_buffer, &value_buffer, place);
    assert_eq!(ledger.total(), plan.bytes());
    let mut encoder = encoder(device);
    stage().record(&mut encoder, &buffers);
    gpu::submit_and_wait(device, queue, encoder);

    let part = length.min(count as usize);
    let (sorted_keys, sorted_values) = cpu::sort::sort(&keys[..part], &values[..part], key_bits);
    let sides = [
        (buffers.keys(), sorted_keys, &key_buffer, &all_keys),
        (buffers.values(), sorted_values, &value_buffer, &all_values),
    ];
    for (result, expected, given, all) in sides {
        let found = gpu::read_u32s(device, queue, result);
        assert_eq!(first_difference(&found[..part], &expected), None, "{}", what());
        assert_eq!(result == given, plan.in_place());
        let given = gpu::read_u32s(device, queue, given);
        assert_eq!(first_difference(&given[part..], &all[part..]), None, "{}", what());
    }
}

fn mixed(length: usize) -> Vec<u32> {
    (0..length as u32).map(|i| (i ^ 0x9E37).wrapping_mul(2_654_435_761)).collect()
}

#[test]
fn the_twin_orders_by_the_lowest_bits_and_keeps_the_order_of_equal_ones() {
    let sorted = |bits| cpu::sort::sort(&[3, 0x11, 2, 1, 3], &[0, 1, 2, 3, 4], bits);
    assert_eq!(sorted(4), (vec![0x11, 1, 2, 3, 3], vec![1, 3, 2, 0, 4]));
    assert_eq!(sorted(32), (vec![1, 2, 3, 3, 0x11], vec![3, 2, 0, 4, 1]));
    assert_eq!(sorted(40), sorted(32));
    assert_eq!(sorted(0).1, [0, 1, 2, 3, 4]);
}

#[test]
fn lengths_around_a_group() {
    for length in [0, 1, 2, 255, 256, 257, GROUP - 1, GROUP, GROUP + 1, 2 * GROUP, 5 * GROUP + 3] {
        check(&mixed(length), length as u32, 8);
        check(&mixed(length), length as u32, 3);
    }
}

#[test]
fn every_number_of_key_bits() {
    for bits in 0..=33 {
        check(&mixed(2 * GROUP + 77), 2 * GROUP as u32 + 77, bits);
    }
}

#[test]
fn several_levels() {
    // 64 groups have as many counts of digits as one group of the scan takes.
    for length in [64 * GROUP, 64 * GROUP + 1] {
        check(&mixed(length), length as u32, 17);
    }
}

#[test]
fn all_equal_sorted_and_reversed() {
    let length = 3 * GROUP as u32 + 5;
    check(&vec![0; length as usize], length, 12);
    check(&vec![u32::MAX; length as usize], length, 32);
    check(&(0..length).collect::<Vec<_>>(), length, 14);
    check(&(0..length).rev().collect::<Vec<_>>(), length, 14);
    // Runs longer and shorter than a group.
    check(&(0..length).map(|i| 7 - i / 2500).collect::<Vec<_>>(), length, 3);
    check(&(0..length).map(|i| i / 3 % 16).collect::<Vec<_>>(), length, 4);
}

#[test]
fn each_digit_alone() {
    for digit in 0..16 {
        let keys: Vec<u32> = (0..2 * GROUP as u32).map(|i| (digit + i / 700) % 16).collect();
        check(&keys, keys.len() as u32, 4);
    }
}

#[test]
fn the_count_on_the_gpu_decides() {
    let keys = mixed(3 * GROUP + 17);
    for count in [0, 1, GROUP - 1, GROUP, GROUP + 1, 3 * GROUP + 16] {
        check(&keys, count as u32, 8);
        check(&keys, count as u32, 9);
    }
    let two_levels = mixed(64 * GROUP + 1);
    for count in [0, 1, GROUP, 63 * GROUP + 5] {
        check(&two_levels, count as u32, 6);
    }
}

#[test]
fn a_count_above_the_plan_does_no_harm() {
    for count in [2 * GROUP as u32 + 6, u32::MAX] {
        check(&mixed(2 * GROUP + 5), count, 7);
        check(&mixed(5), count, 4);
    }
}

#[test]
fn only_as_many_passes_as_the_bits_need() {
    let passes = |bits| Sort::plan(1, bits).passes();
    assert_eq!([1, 4, 5, 14, 17, 32].map(passes), [1, 1, 2, 4, 5, 8]);
    assert_eq!(Sort::plan(1, 14).dispatches(), 1 + 4 * 3);
    assert_eq!(Sort::plan(1 << 20, 17).dispatches(), 2 + 5 * 5);
    assert!(Sort::plan(1, 14).in_place() && !Sort::plan(1, 17).in_place());
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]
    #[test]
    fn agrees_with_the_twin(
        keys in prop::collection::vec(prop_oneof![any::<u32>(), 0..20u32], 0..5000),
        part in 0.0..=1.2,
        key_bits in 0..=32u32,
    ) {
        check(&keys, (keys.len() as f64 * part) as u32, key_bits);
    }
}

#[test]
fn buffers_serve_many_counts_in_one_recording() {
    const COUNTS: [u32; 4] = [2 * GROUP as u32 + 9, 0, 7, GROUP as u32 + 1];
    const BITS: u32 = 10;
    let (device, queue) = device();
    let ledger = Ledger::new();
    let length = COUNTS[0] as usize;
    let given = words(device, &mixed(length));
    let (keys, values_buffer) = (words(device, &mixed(length)), words(device, &values(length)));
    let count = words(device, &[0]);
    let bytes = 4 * length as u64;
    let seen = gpu::sentinel_buffer(device, bytes * COUNTS.len() as u64, SENTINEL);
    let plan = Sort::plan(length as u64, BITS);
    let buffers =
        SortBuffers::new(device, &ledger, stage(), &plan, &keys, &values_buffer, (&count, 0));
    let mut upload = UploadRing::new(&ledger, "test", 256);
    let mut encoder = encoder(device);
    for (place, value) in (0u64..).zip(COUNTS) {
        upload.write(device, &mut encoder, &count, 0, &value.to_le_bytes());
        encoder.copy_buffer_to_buffer(&given, 0, &keys, 0, bytes);
        stage().record(&mut encoder, &buffers);
        let sorted = 4 * u64::from(value);
        encoder.copy_buffer_to_buffer(buffers.keys(), 0, &seen, place * bytes, sorted);
    }
    gpu::submit_and_wait(device, queue, encoder);

    let seen = gpu::read_u32s(device, queue, &seen);
    for (found, count) in seen.chunks(length).zip(COUNTS) {
        let count = count as usize;
        let mut expected = cpu::sort::sort(&mixed(count), &values(count), BITS).0;
        expected.resize(length, SENTINEL);
        assert_eq!(first_difference(found, &expected), None, "{count}");
    }
}
