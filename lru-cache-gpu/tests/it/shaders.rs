//! Every shader validates against core WebGPU and declares what the Rust side binds.

use gpu_primitives::kernel::{Binding, KernelSource};
use gpu_primitives::wgsl::{Module, compose};
use gpu_testkit::layout::{check_bindings, check_kernel, validate_wgsl};
use lru_cache_gpu::{Service, wgsl};

use crate::harness::script_source;
use crate::slots::sample_source;

fn sources() -> Vec<KernelSource> {
    let mut sources = vec![script_source()];
    sources.extend(Service::sources());
    sources.extend((1..=4).map(sample_source));
    sources
}

#[test]
fn shaders_are_valid_and_declare_what_is_bound() {
    for source in sources() {
        check_kernel(&source).unwrap();
    }
}

#[test]
fn lookup_alone_needs_only_a_read_only_directory() {
    const TEXT: &str = "#import lru_lookup
        @group(0) @binding(0) var<uniform> params: LruParams;
        @group(0) @binding(1) var<storage, read> lru_directory: array<u32>;
        @group(0) @binding(2) var<storage, read_write> out: array<u32>;
        fn lru_params() -> LruParams { return params; }
        @compute @workgroup_size(1) fn main() {
            out[0] = lru_lookup(out[1]);
        }";
    let entry = Module { name: "lookup", source: TEXT };
    let text = compose(entry, &wgsl::MODULES, &[]).unwrap().source;
    validate_wgsl(&text).unwrap();
    let kinds = [
        Binding::Uniform { bytes: 16 },
        Binding::StorageRead { min_bytes: 4 },
        Binding::StorageReadWrite { min_bytes: 4 },
    ];
    check_bindings(&text, "main", &kinds).unwrap();
}
