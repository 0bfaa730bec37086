//! Every shader of the crate is valid under WebGPU's rules, and its bindings are the ones that the
//! kernels declare.

use gpu_primitives::compact::Compact;
use gpu_primitives::indirect::IndirectArgs;
use gpu_primitives::kernel::{Binding, KernelSource};
use gpu_primitives::scan::Scan;
use gpu_primitives::sort::Sort;
use naga::proc::Layouter;
use naga::valid::{Capabilities, ModuleInfo, ValidationFlags, Validator};
use naga::{AddressSpace, StorageAccess};

/// What the text declares for a binding.
#[derive(Debug, PartialEq)]
enum Declared {
    Uniform(u64),
    Read(u64),
    ReadWrite(u64),
    Other,
}

fn sources() -> Vec<KernelSource> {
    let mut sources = vec![IndirectArgs::source()];
    sources.extend(Scan::sources());
    sources.extend(Compact::sources());
    sources.extend(Sort::sources());
    sources
}

fn parse(text: &str) -> (naga::Module, ModuleInfo) {
    let module =
        naga::front::wgsl::parse_str(text).unwrap_or_else(|e| panic!("{}", e.emit_to_string(text)));
    let info = Validator::new(ValidationFlags::all(), Capabilities::empty())
        .validate(&module)
        .unwrap_or_else(|e| panic!("{}", e.emit_to_string(text)));
    (module, info)
}

/// Bindings of group 0 that the entry point uses, in order.
fn declared(text: &str, entry_point: &str) -> Vec<(u32, Declared)> {
    let (module, info) = parse(text);
    let mut layouter = Layouter::default();
    layouter.update(module.to_ctx()).expect("layouts of a valid module");
    let entry = module.entry_points.iter().position(|entry| entry.name == entry_point);
    let used = info.get_entry_point(entry.expect("the entry point is in the text"));
    let mut out: Vec<_> = module
        .global_variables
        .iter()
        .filter(|(handle, _)| !used[*handle].is_empty())
        .filter_map(|(_, variable)| {
            let binding = variable.binding.as_ref()?;
            assert_eq!(binding.group, 0, "kernels use one bind group");
            let kind = match variable.space {
                AddressSpace::Uniform => {
                    Declared::Uniform(least_bytes(&module, &layouter, variable))
                }
                AddressSpace::Storage { access } if access.contains(StorageAccess::STORE) => {
                    Declared::ReadWrite(least_bytes(&module, &layouter, variable))
                }
                AddressSpace::Storage { .. } => {
                    Declared::Read(least_bytes(&module, &layouter, variable))
                }
                _ => Declared::Other,
            };
            Some((binding.binding, kind))
        })
        .collect();
    out.sort_by_key(|&(binding, _)| binding);
    out
}

/// Size of the type, where a runtime-sized array at the top counts one element.
fn least_bytes(module: &naga::Module, layouter: &Layouter, variable: &naga::GlobalVariable) -> u64 {
    match module.types[variable.ty].inner {
        naga::TypeInner::Array { size: naga::ArraySize::Dynamic, stride, .. } => u64::from(stride),
        _ => u64::from(layouter[variable.ty].size),
    }
}

fn expected(bindings: &[Binding]) -> Vec<(u32, Declared)> {
    let kind = |binding: &Binding| match *binding {
        Binding::Uniform { bytes } => Declared::Uniform(bytes),
        Binding::StorageRead { min_bytes } => Declared::Read(min_bytes),
        Binding::StorageReadWrite { min_bytes } => Declared::ReadWrite(min_bytes),
        _ => Declared::Other,
    };
    (0u32..).zip(bindings.iter().map(kind)).collect()
}

#[test]
fn bindings_agree_with_the_texts() {
    for source in sources() {
        let found = declared(&source.wgsl.source, source.entry_point);
        assert_eq!(found, expected(&source.bindings), "{}", source.label);
        let storage = found.iter().filter(|(_, kind)| !matches!(kind, Declared::Uniform(_)));
        assert!(storage.count() <= 8, "{}", source.label);
    }
}

#[test]
fn the_check_of_bindings_sees_a_wrong_size_and_a_wrong_access() {
    let text = "@group(0) @binding(0) var<storage, read> a: array<vec2<u32>>;
        @group(0) @binding(1) var<storage, read_write> b: array<u32>;
        @compute @workgroup_size(1) fn main() { b[0] = a[0].x; }";
    let found = declared(text, "main");
    let right = [Binding::StorageRead { min_bytes: 8 }, Binding::StorageReadWrite { min_bytes: 4 }];
    assert_eq!(found, expected(&right));
    let wrong_size = [Binding::StorageRead { min_bytes: 4 }, right[1]];
    let wrong_access = [right[0], Binding::StorageRead { min_bytes: 4 }];
    assert_ne!(found, expected(&wrong_size));
    assert_ne!(found, expected(&wrong_access));
    assert_ne!(found, expected(&right[..1]));
}

#[test]
fn workgroups_stay_within_default_limits() {
    for source in sources() {
        let (module, _) = parse(&source.wgsl.source);
        let mut layouter = Layouter::default();
        layouter.update(module.to_ctx()).unwrap();
        let workgroup: u32 = module
            .global_variables
            .iter()
            .filter(|(_, variable)| variable.space == AddressSpace::WorkGroup)
            .map(|(_, variable)| layouter[variable.ty].size)
            .sum();
        assert!(workgroup <= 16_384, "{}", source.label);
        for entry in &module.entry_points {
            assert!(entry.workgroup_size.iter().product::<u32>() <= 256, "{}", source.label);
        }
    }
}

#[test]
fn every_composed_line_has_an_origin_or_is_a_constant() {
    for source in sources() {
        for (line, text) in (1..).zip(source.wgsl.source.lines()) {
            let injected = source.wgsl.origin(line).is_none();
            assert_eq!(
                injected,
                text.starts_with("const SCAN_ITEMS")
                    || text.contains("_SCATTER: ")
                    || text.contains("SCAN_ADD: "),
                "{}: {text}",
                source.label
            );
        }
    }
}
