//! Every shader composes, validates and binds what the Rust side says.

#![allow(clippy::unwrap_used, reason = "a failed set-up fails the test")]

use gpu_primitives::kernel::KernelSource;
use gpu_testkit::gpu;
use gpu_testkit::layout::check_kernel;
use infill::{Guide, Infill, InfillPlan, Sources};
use macrocell::MacrocellPlan;

fn check(source: &KernelSource) {
    check_kernel(source).unwrap();
}

/// Ranges of a volume of 3x1x1 coarse cells in pages of so many.
fn ranges(coarse_per_page: u32) -> MacrocellPlan {
    let limits = wgpu::Limits {
        max_storage_buffer_binding_size: 128 * u64::from(coarse_per_page),
        ..wgpu::Limits::default()
    };
    MacrocellPlan::new([48, 16, 16], &limits).unwrap()
}

#[test]
fn kernels_validate_with_every_set_of_sources() {
    let limits = gpu::webgpu_limits();
    for bits in 0..8 {
        let sources = Sources {
            neighbours: bits & 1 != 0,
            coarse_field: bits & 2 != 0,
            history: bits & 4 != 0,
        };
        for per_page in 1..=3 {
            for network in [false, true] {
                let plan = InfillPlan::new([40, 30], sources, network, &ranges(per_page), &limits);
                let plan = plan.unwrap();
                assert_eq!(plan.sources(), sources);
                Infill::sources(&plan).iter().for_each(check);
                Infill::sources(&plan.halved().unwrap()).iter().for_each(check);
                Guide::source(&plan).iter().for_each(check);
            }
        }
    }
}

#[test]
fn a_picture_costs_what_the_documentation_says() {
    let limits = gpu::webgpu_limits();
    let plan = |sources, network| {
        InfillPlan::new([1280, 720], sources, network, &ranges(3), &limits).unwrap().bytes()
    };
    let no_history = Sources { history: false, ..Sources::default() };
    // Depth and normals, which in-fill asks for, take 12 bytes a pixel more.
    let pictures = 12 * 1280 * 720;
    let found = [
        ("all", plan(Sources::default(), true)),
        ("without history", plan(no_history, true)),
        ("classical", plan(Sources::default(), false)),
        ("classical, without history", plan(no_history, false)),
    ];
    let docs = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/infill.md");
    let docs = std::fs::read_to_string(docs).unwrap();
    for (what, bytes) in found {
        let bytes = bytes + pictures;
        assert!(bytes <= 40_000_000, "{what}: {bytes}");
        let [millions, thousands, rest] = [bytes / 1_000_000, bytes / 1000 % 1000, bytes % 1000];
        let row = format!("| {what} | {millions} {thousands:03} {rest:03} |");
        assert!(docs.contains(&row), "docs/infill.md does not have {row}");
    }
}
