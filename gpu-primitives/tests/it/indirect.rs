use crate::{SENTINEL, STORAGE, device, encoder, words};
use gpu_primitives::cpu;
use gpu_primitives::indirect::{self, IndirectArgs};
use gpu_primitives::kernel::{Binding, Kernel};
use gpu_primitives::memory::Ledger;
use gpu_primitives::wgpu;
use gpu_primitives::wgsl::{Module, compose};
use gpu_testkit::gpu;
use proptest::prelude::*;

/// Each group adds one to the word with its number.
const MARK: Module = Module {
    name: "mark",
    source: "#import indirect
        @group(0) @binding(0) var<storage, read_write> marks: array<atomic<u32>>;
        @compute @workgroup_size(1)
        fn mark(@builtin(workgroup_id) group_id: vec3<u32>,
                @builtin(num_workgroups) groups: vec3<u32>) {
            let group = indirect_linear_group(group_id, groups);
            if (group < arrayLength(&marks)) {
                atomicAdd(&marks[group], 1u);
            }
        }",
};

#[test]
fn folding_has_the_stated_cases() {
    assert_eq!(indirect::fold(0), [0, 1, 1]);
    assert_eq!(indirect::fold(1), [1, 1, 1]);
    assert_eq!(indirect::fold(65_535), [65_535, 1, 1]);
    assert_eq!(indirect::fold(65_536), [32_768, 2, 1]);
    assert_eq!(indirect::fold(65_535 * 65_535), [65_535, 65_535, 1]);
    assert_eq!(indirect::fold(u64::MAX), [65_535, 65_535, 1]);
}

proptest! {
    #[test]
    fn folding_covers_with_less_than_a_row_to_spare(groups in 1u64..=65_535 * 65_535) {
        let [x, y, z] = indirect::fold(groups).map(u64::from);
        prop_assert!(x <= 65_535 && y <= 65_535 && z == 1);
        prop_assert!(x * y >= groups && x * y - groups < y);
    }
}

fn mark_kernel(device: &wgpu::Device) -> Kernel {
    let composed = compose(MARK, &[indirect::MODULE], &[]).expect("composes");
    let bindings = [Binding::StorageReadWrite { min_bytes: 4 }];
    Kernel::new(device, "test.mark", &composed, "mark", &bindings)
}

#[test]
fn every_group_of_a_folded_dispatch_has_its_number() {
    const GROUPS: usize = 70_001;
    let (device, queue) = device();
    let kernel = mark_kernel(device);
    assert_eq!(kernel.bindings().len(), 1);
    let marks = words(device, &vec![0; GROUPS]);
    let bind = kernel.bind(device, "test", &[marks.as_entire_binding()]);
    let args_usage = STORAGE | wgpu::BufferUsages::INDIRECT;
    let args = gpu::buffer_with(device, &[0; 16], args_usage);
    let count = words(device, &[10 * GROUPS as u32 - 3]);
    let stage = IndirectArgs::new(device);
    let buffers = stage.bind(device, &Ledger::new(), (&count, 0), 10, (&args, 4));

    let mut encoder = encoder(device);
    stage.record(&mut encoder, &buffers);
    let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
    kernel.dispatch(&mut pass, &bind, GROUPS as u64);
    kernel.dispatch(&mut pass, &bind, 0);
    kernel.dispatch_indirect(&mut pass, &bind, &args, 4);
    drop(pass);
    gpu::submit_and_wait(device, queue, encoder);
    let expected = vec![2; GROUPS];
    assert_eq!(crate::first_difference(&gpu::read_u32s(device, queue, &marks), &expected), None);
}

/// Arguments on the GPU for a count at word 70 of its buffer, at word 65 of theirs.
fn args_of(count: u32, max_count: u32, sizes: &[u32]) -> Vec<u32> {
    let (device, queue) = device();
    let mut counts = vec![u32::MAX; 72];
    counts[70] = count;
    let counts = words(device, &counts);
    let args = gpu::sentinel_buffer(device, 4 * 80, SENTINEL);
    let ledger = Ledger::new();
    let stage = IndirectArgs::new(device);
    let place = (&args, 4 * 65);
    let buffers = stage.bind_sets(device, &ledger, (&counts, 4 * 70), max_count, sizes, place);
    assert_eq!(ledger.total(), IndirectArgs::BIND_BYTES);
    let mut encoder = encoder(device);
    stage.record(&mut encoder, &buffers);
    gpu::submit_and_wait(device, queue, encoder);
    let found = gpu::read_u32s(device, queue, &args);
    let written = 3 * sizes.len().min(IndirectArgs::MAX_SETS);
    let outside = found[..65].iter().chain(&found[65 + written..]);
    assert!(outside.clone().all(|&word| word == SENTINEL));
    found[65..65 + written].to_vec()
}

#[test]
fn arguments_agree_with_the_twin() {
    let sizes = [1, 64, 256, 1 << 31];
    let counts = [0, 1, 63, 64, 65, 65_535, 65_536, 65_535 * 64 + 1, 1 << 31, u32::MAX];
    for count in counts {
        let expected: Vec<u32> =
            sizes.iter().flat_map(|&size| cpu::indirect::args(count, size)).collect();
        assert_eq!(args_of(count, u32::MAX, &sizes), expected, "{count}");
    }
}

#[test]
fn odd_parameters_of_arguments_are_harmless() {
    assert_eq!(args_of(500, 100, &[7]), cpu::indirect::args(100, 7));
    assert_eq!(args_of(5, u32::MAX, &[0]), [5, 1, 1]);
    assert_eq!(args_of(5, u32::MAX, &[1, 2, 3, 4, 5]).len(), 12);
    assert_eq!(args_of(5, u32::MAX, &[]), []);
}
