//! Every shader parses, validates without optional capabilities, and declares what the Rust side
//! binds.

#![allow(clippy::unwrap_used, reason = "a failed set-up fails the test")]

use gpu_primitives::kernel::{Binding, KernelSource};
use naga::valid::{Capabilities, ValidationFlags, Validator};
use naga::{AddressSpace, Module, StorageAccess, TypeInner};
use zfp_gpu::{BlockExtrema, Decode};

fn sources() -> Vec<KernelSource> {
    let decodes = (1..=3).map(|pages| Decode::source(pages).unwrap());
    decodes.chain([BlockExtrema::source()]).collect()
}

fn parse(source: &KernelSource) -> Module {
    let text = &source.wgsl.source;
    let module = naga::front::wgsl::parse_str(text)
        .unwrap_or_else(|error| panic!("{}", error.emit_to_string(text)));
    Validator::new(ValidationFlags::all(), Capabilities::empty())
        .validate(&module)
        .unwrap_or_else(|error| panic!("{}", error.emit_to_string(text)));
    module
}

/// Binding kinds of group 0 as the shader declares them, with the bytes that it needs at least.
fn declared(module: &Module) -> Vec<Binding> {
    let mut found: Vec<(u32, Binding)> = Vec::new();
    for (_, variable) in module.global_variables.iter() {
        let Some(binding) = &variable.binding else { continue };
        assert_eq!(binding.group, 0, "kernels use group 0 only");
        let inner = &module.types[variable.ty].inner;
        let bytes = match *inner {
            TypeInner::Array { stride, .. } => u64::from(stride),
            TypeInner::Struct { span, .. } => u64::from(span),
            ref other => panic!("unexpected type {other:?}"),
        };
        let kind = match variable.space {
            AddressSpace::Uniform => Binding::Uniform { bytes },
            AddressSpace::Storage { access } if access.contains(StorageAccess::STORE) => {
                Binding::StorageReadWrite { min_bytes: bytes }
            }
            AddressSpace::Storage { .. } => Binding::StorageRead { min_bytes: bytes },
            other => panic!("unexpected address space {other:?}"),
        };
        found.push((binding.binding, kind));
    }
    found.sort_by_key(|entry| entry.0);
    assert!((0..).zip(&found).all(|(i, entry)| i == entry.0), "bindings are numbered from 0");
    found.into_iter().map(|entry| entry.1).collect()
}

#[test]
fn shaders_declare_what_is_bound() {
    for source in sources() {
        let module = parse(&source);
        assert_eq!(declared(&module), source.bindings, "{}", source.label);
        let storage = |b: &&Binding| !matches!(b, Binding::Uniform { .. });
        assert!(source.bindings.iter().filter(storage).count() <= 8, "{}", source.label);
    }
}

#[test]
fn entry_points_have_the_announced_group_size() {
    for source in sources() {
        let module = parse(&source);
        let names: Vec<_> = module.entry_points.iter().map(|e| e.name.as_str()).collect();
        assert_eq!(names, [source.entry_point]);
        assert_eq!(module.entry_points[0].workgroup_size, [Decode::JOBS_PER_GROUP, 1, 1]);
    }
}

#[test]
fn parameters_lie_where_the_host_writes_them() {
    let offsets = |module: &Module, name: &str| -> Vec<(String, u32)> {
        let (_, ty) = module.types.iter().find(|(_, t)| t.name.as_deref() == Some(name)).unwrap();
        let TypeInner::Struct { members, .. } = &ty.inner else { panic!("{name} is a struct") };
        members.iter().map(|m| (m.name.clone().unwrap(), m.offset)).collect()
    };
    let in_words = |names: &[&str], words: u32| -> Vec<(String, u32)> {
        (0..).zip(names).map(|(i, n)| ((*n).to_owned(), i * words * 4)).collect()
    };
    let decode = parse(&Decode::source(3).unwrap());
    let page = ["first_block", "blocks", "bits_per_block", "first_bit"];
    assert_eq!(offsets(&decode, "ZfpPage"), in_words(&page, 1));
    let params = ["slots_per_page", "slots", "count_word", "padding"];
    assert_eq!(offsets(&decode, "DecodeParams"), in_words(&params, 1));
    let extrema = parse(&BlockExtrema::source());
    assert_eq!(offsets(&extrema, "ExtremaParams"), in_words(&["origin", "size", "dims"], 4));
}

#[test]
fn only_one_to_three_cache_pages_exist() {
    for pages in [0, 4] {
        assert!(Decode::source(pages).is_err(), "{pages} cache pages");
    }
}
