//! Every shader composes, validates and binds what the Rust side says.

use gpu_primitives::kernel::{Binding, KernelSource};
use gpu_testkit::layout::{self, BindingKind};
use wavefront::{Outputs, Rays, RunAhead, SampleLayout};

fn kind(binding: &Binding) -> BindingKind {
    match *binding {
        Binding::Uniform { bytes } => BindingKind::Uniform { bytes },
        Binding::StorageRead { min_bytes } => BindingKind::StorageRead { min_bytes },
        Binding::StorageReadWrite { min_bytes } => BindingKind::StorageReadWrite { min_bytes },
        Binding::TextureWrite { format } => BindingKind::TextureWrite { format },
        Binding::TextureSample { sample } => BindingKind::TextureSample { sample },
    }
}

fn check(source: &KernelSource) {
    let text = &source.wgsl.source;
    layout::validate_wgsl(text).unwrap_or_else(|e| panic!("{}: {e}", source.label));
    let kinds: Vec<BindingKind> = source.bindings.iter().map(kind).collect();
    layout::check_bindings(text, source.entry_point, &kinds)
        .unwrap_or_else(|e| panic!("{}: {e}", source.label));
}

#[test]
fn kernels_validate_with_every_set_of_outputs_and_pages() {
    for bits in 0..8 {
        let outputs =
            Outputs { depth: bits & 1 != 0, normal: bits & 2 != 0, status: bits & 4 != 0 };
        for pages in 1..=4 {
            for samples in [SampleLayout::cached(pages), SampleLayout::resident(pages)] {
                Rays::sources(outputs, samples).iter().for_each(check);
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
    layout::validate_wgsl(include_str!("../shader/draw.wgsl")).unwrap();
}
