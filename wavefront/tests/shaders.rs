//! Every shader composes, validates and binds what the Rust side says.

#![allow(clippy::unwrap_used, reason = "a failed set-up fails the test")]

use gpu_primitives::kernel::KernelSource;
use gpu_testkit::layout::{check_kernel, validate_wgsl};
use wavefront::{Outputs, Previews, Rays, RunAhead, SampleLayout};

fn check(source: &KernelSource) {
    check_kernel(source).unwrap();
}

#[test]
fn kernels_validate_with_every_set_of_outputs_and_pages() {
    for bits in 0..8 {
        let outputs =
            Outputs { depth: bits & 1 != 0, normal: bits & 2 != 0, status: bits & 4 != 0 };
        for pages in 1..=4 {
            for samples in [SampleLayout::cached(pages), SampleLayout::resident(pages)] {
                Rays::sources(outputs, samples).iter().for_each(check);
                Rays::foveation_sources(samples).iter().for_each(check);
                Previews::sources(outputs, samples).iter().for_each(check);
                RunAhead::sources(samples).iter().for_each(check);
            }
        }
    }
}

#[cfg(feature = "block-sorted")]
#[test]
fn block_sorted_kernels_validate() {
    for pages in 1..=3 {
        wavefront::BlockSorted::sources(pages).iter().for_each(check);
    }
}

#[test]
fn draw_validates() {
    validate_wgsl(include_str!("../shader/draw.wgsl")).unwrap();
}
