//! Every shader validates against core WebGPU and declares what the Rust side binds.

use gpu_primitives::kernel::{Binding, KernelSource};
use gpu_testkit::layout::{BindingKind, check_bindings, validate_wgsl};
use macrocell::{Activate, Ranges};

use crate::walk_gpu::walk_source;

fn sources() -> [KernelSource; 5] {
    [
        Ranges::source(),
        Activate::source(),
        Activate::third_level_source(),
        Activate::active_box_source(),
        walk_source(),
    ]
}

fn kind(binding: &Binding) -> BindingKind {
    match *binding {
        Binding::Uniform { bytes } => BindingKind::Uniform { bytes },
        Binding::StorageRead { min_bytes } => BindingKind::StorageRead { min_bytes },
        Binding::StorageReadWrite { min_bytes } => BindingKind::StorageReadWrite { min_bytes },
        ref other => panic!("unexpected {other:?}"),
    }
}

#[test]
fn shaders_are_valid_under_default_limits() {
    for source in sources() {
        validate_wgsl(&source.wgsl.source).unwrap_or_else(|e| panic!("{}: {e}", source.label));
    }
}

#[test]
fn shaders_declare_what_is_bound() {
    for source in sources() {
        let kinds: Vec<_> = source.bindings.iter().map(kind).collect();
        check_bindings(&source.wgsl.source, source.entry_point, &kinds)
            .unwrap_or_else(|e| panic!("{}: {e}", source.label));
    }
}
