//! Reflection of WGSL, so that tests compare host-side layouts with what the shader declares.

use gpu_primitives::kernel::{Binding, KernelSource};
use naga::valid::{Capabilities, ModuleInfo, ValidationFlags, Validator};
use naga::{AddressSpace, GlobalVariable, Handle, ImageClass, Module, ScalarKind, TypeInner};

/// WebGPU's default limits for what one shader stage uses, with the name of each.
const DEFAULT_LIMITS: [(&str, usize); 4] = [
    ("uniform buffers", 12),
    ("storage buffers", 8),
    ("sampled textures", 16),
    ("storage textures", 4),
];
const MAX_INVOCATIONS: u32 = 256;
const MAX_WORKGROUP_BYTES: u32 = 16 * 1024;

/// Parses and validates a whole shader against core WebGPU, without optional features, and checks
/// each compute entry point against the default limits (invocations, workgroup memory, bindings).
///
/// # Errors
/// The compiler's message with the place in the source, or the limit that is exceeded.
pub fn validate_wgsl(source: &str) -> Result<(), String> {
    let (module, info) = parse(source)?;
    for (index, entry) in module.entry_points.iter().enumerate() {
        let name = &entry.name;
        let invocations: u32 = entry.workgroup_size.iter().product();
        if invocations > MAX_INVOCATIONS {
            return Err(format!("{name}: {invocations} invocations, at most {MAX_INVOCATIONS}"));
        }
        let used: Vec<_> = used_variables(&module, &info, index).collect();
        let workgroup = used.iter().filter(|(_, v)| v.space == AddressSpace::WorkGroup);
        let bytes: u32 = workgroup.map(|(_, variable)| size_of(&module, variable)).sum();
        if bytes > MAX_WORKGROUP_BYTES {
            return Err(format!("{name}: {bytes} workgroup bytes, at most {MAX_WORKGROUP_BYTES}"));
        }
        let classes: Vec<_> = used.iter().filter_map(|(_, v)| limit_class(&module, v)).collect();
        for (class, (what, most)) in DEFAULT_LIMITS.into_iter().enumerate() {
            let count = classes.iter().filter(|&&c| c == class).count();
            if count > most {
                return Err(format!("{name}: {count} {what}, at most {most}"));
            }
        }
    }
    Ok(())
}

/// Checks that the WGSL struct has exactly these members in this order: name, byte offset and
/// byte size of each.
///
/// # Errors
/// The first difference, or that the source does not compile or lacks the struct.
pub fn check_struct(
    source: &str,
    struct_name: &str,
    expected: &[(&str, u32, u32)],
) -> Result<(), String> {
    let (module, _) = parse(source)?;
    let (members, _) = find_struct(&module, struct_name)?;
    for (index, &(name, offset, size)) in expected.iter().enumerate() {
        let Some(member) = members.get(index) else {
            return Err(format!("{struct_name} has no member {index}, expected {name}"));
        };
        let found = (
            member.name.as_deref().unwrap_or_default(),
            member.offset,
            module.types[member.ty].inner.size(module.to_ctx()),
        );
        if found != (name, offset, size) {
            return Err(format!(
                "{struct_name} member {index}: expected {name} at byte {offset} of {size} bytes, \
                 found {} at byte {} of {} bytes",
                found.0, found.1, found.2
            ));
        }
    }
    match members.get(expected.len()) {
        None => Ok(()),
        Some(extra) => Err(format!(
            "{struct_name} has {} members, expected {}: the first unexpected is {}",
            members.len(),
            expected.len(),
            extra.name.as_deref().unwrap_or_default()
        )),
    }
}

/// Bytes that the WGSL struct takes, its end padding included.
///
/// # Errors
/// That the source does not compile or lacks the struct.
pub fn struct_size(source: &str, struct_name: &str) -> Result<u32, String> {
    let (module, _) = parse(source)?;
    find_struct(&module, struct_name).map(|(_, span)| span)
}

/// Checks a kernel: its text as [`validate_wgsl`] does, and that it declares what the kernel binds.
///
/// # Errors
/// The kernel's label and the first problem.
pub fn check_kernel(source: &KernelSource) -> Result<(), String> {
    let text = &source.wgsl.source;
    validate_wgsl(text)
        .and_then(|()| check_bindings(text, source.entry_point, &source.bindings))
        .map_err(|problem| format!("{}: {problem}", source.label))
}

/// Checks that every variable the entry point uses is in group 0 and of the kind that `expected`
/// gives for its binding index, and that every expected binding is declared in the source.
///
/// # Errors
/// The first difference, or that the source does not compile or lacks the entry point.
pub fn check_bindings(source: &str, entry_point: &str, expected: &[Binding]) -> Result<(), String> {
    let (module, info) = parse(source)?;
    let Some(index) = module.entry_points.iter().position(|entry| entry.name == entry_point) else {
        let names: Vec<_> = module.entry_points.iter().map(|entry| &entry.name).collect();
        return Err(format!("no entry point {entry_point}, found {names:?}"));
    };
    for (_, variable) in used_variables(&module, &info, index) {
        let Some(binding) = &variable.binding else { continue };
        let name = variable.name.as_deref().unwrap_or_default();
        if binding.group != 0 {
            return Err(format!("{name} is in group {}, expected group 0", binding.group));
        }
        let Some(kind) = expected.get(binding.binding as usize) else {
            return Err(format!(
                "{entry_point} uses {name} at binding {}, but only {} are bound",
                binding.binding,
                expected.len()
            ));
        };
        check_kind(&module, variable, *kind)
            .map_err(|problem| format!("binding {} ({name}): {problem}", binding.binding))?;
    }
    for index in 0..expected.len() {
        let declared = |variable: &GlobalVariable| {
            variable.binding.as_ref().is_some_and(|b| b.group == 0 && b.binding as usize == index)
        };
        if !module.global_variables.iter().any(|(_, variable)| declared(variable)) {
            return Err(format!("binding {index} is bound but not declared in the source"));
        }
    }
    Ok(())
}

fn parse(source: &str) -> Result<(Module, ModuleInfo), String> {
    let module =
        naga::front::wgsl::parse_str(source).map_err(|error| error.emit_to_string(source))?;
    // Packing halves, which all of WebGPU has, is a capability of its own to naga.
    let info = Validator::new(ValidationFlags::all(), Capabilities::SHADER_FLOAT16_IN_FLOAT32)
        .validate(&module)
        .map_err(|error| error.emit_to_string(source))?;
    Ok((module, info))
}

fn find_struct<'m>(
    module: &'m Module,
    name: &str,
) -> Result<(&'m [naga::StructMember], u32), String> {
    for (_, ty) in module.types.iter() {
        if let (Some(found), TypeInner::Struct { members, span }) = (&ty.name, &ty.inner)
            && found == name
        {
            return Ok((members, *span));
        }
    }
    Err(format!("no struct {name} in the source"))
}

fn used_variables<'m>(
    module: &'m Module,
    info: &'m ModuleInfo,
    entry_point: usize,
) -> impl Iterator<Item = (Handle<GlobalVariable>, &'m GlobalVariable)> {
    let uses = info.get_entry_point(entry_point);
    module.global_variables.iter().filter(move |(handle, _)| !uses[*handle].is_empty())
}

fn size_of(module: &Module, variable: &GlobalVariable) -> u32 {
    module.types[variable.ty].inner.size(module.to_ctx())
}

/// Index into [`DEFAULT_LIMITS`].
fn limit_class(module: &Module, variable: &GlobalVariable) -> Option<usize> {
    match (variable.space, &module.types[variable.ty].inner) {
        (AddressSpace::Uniform, _) => Some(0),
        (AddressSpace::Storage { .. }, _) => Some(1),
        (_, TypeInner::Image { class: ImageClass::Storage { .. }, .. }) => Some(3),
        (_, TypeInner::Image { .. }) => Some(2),
        _ => None,
    }
}

fn check_kind(module: &Module, variable: &GlobalVariable, expected: Binding) -> Result<(), String> {
    let bytes = u64::from(size_of(module, variable));
    let writes = |access: naga::StorageAccess| access.contains(naga::StorageAccess::STORE);
    let inner = &module.types[variable.ty].inner;
    let ok = match (expected, variable.space, inner) {
        (Binding::Uniform { bytes: expected }, AddressSpace::Uniform, _) => expected == bytes,
        (Binding::StorageRead { min_bytes }, AddressSpace::Storage { access }, _) => {
            !writes(access) && (min_bytes == 0 || min_bytes >= bytes)
        }
        (Binding::StorageReadWrite { min_bytes }, AddressSpace::Storage { access }, _) => {
            writes(access) && (min_bytes == 0 || min_bytes >= bytes)
        }
        (Binding::TextureWrite { format }, _, TypeInner::Image { class, .. }) => {
            // naga and wgpu give their formats the same names.
            matches!(class, ImageClass::Storage { format: found, access } if writes(*access)
                && format!("{found:?}") == format!("{format:?}"))
        }
        (Binding::TextureSample { sample }, _, TypeInner::Image { class, .. }) => {
            sample_matches(*class, sample)
        }
        _ => false,
    };
    if ok {
        Ok(())
    } else {
        Err(format!(
            "the host binds {expected:?}, the shader declares {:?} of {bytes} bytes, {inner:?}",
            variable.space
        ))
    }
}

fn sample_matches(class: ImageClass, sample: wgpu::TextureSampleType) -> bool {
    use wgpu::TextureSampleType as Sample;
    match class {
        ImageClass::Sampled { kind, multi: false } => matches!(
            (kind, sample),
            (ScalarKind::Float, Sample::Float { .. })
                | (ScalarKind::Sint, Sample::Sint)
                | (ScalarKind::Uint, Sample::Uint)
        ),
        ImageClass::Depth { multi: false } => sample == Sample::Depth,
        _ => false,
    }
}

#[cfg(test)]
mod tests {
    use gpu_primitives::wgsl::{Module, compose_fixed};

    use super::*;

    const SHADER: &str = "
        struct Params { origin: vec3<f32>, count: u32, size: vec2<u32> }
        @group(0) @binding(0) var<uniform> params: Params;
        @group(0) @binding(1) var<storage, read> input: array<vec2<u32>>;
        @group(0) @binding(2) var<storage, read_write> output: array<u32>;
        @group(0) @binding(3) var image: texture_storage_2d<rgba8unorm, write>;
        @group(0) @binding(4) var depth: texture_2d<f32>;
        var<workgroup> shared_words: array<u32, 64>;
        @compute @workgroup_size(64)
        fn main(@builtin(global_invocation_id) id: vec3<u32>) {
            if (id.x >= params.count) { return; }
            shared_words[id.x % 64u] = input[id.x].y;
            output[id.x] = shared_words[0];
            textureStore(image, id.xy, textureLoad(depth, id.xy, 0));
        }";

    const MEMBERS: [(&str, u32, u32); 3] = [("origin", 0, 12), ("count", 12, 4), ("size", 16, 8)];

    fn bindings() -> Vec<Binding> {
        vec![
            Binding::Uniform { bytes: 32 },
            Binding::StorageRead { min_bytes: 8 },
            Binding::StorageReadWrite { min_bytes: 0 },
            Binding::TextureWrite { format: wgpu::TextureFormat::Rgba8Unorm },
            Binding::TextureSample { sample: wgpu::TextureSampleType::Float { filterable: false } },
        ]
    }

    #[test]
    fn a_matching_struct_passes_and_each_corruption_fails() {
        check_struct(SHADER, "Params", &MEMBERS).unwrap();
        assert_eq!(struct_size(SHADER, "Params"), Ok(32));
        for index in 0..MEMBERS.len() {
            let mut wrong = MEMBERS;
            wrong[index].0 = "other";
            assert!(check_struct(SHADER, "Params", &wrong).is_err());
            let mut wrong = MEMBERS;
            wrong[index].1 += 4;
            assert!(check_struct(SHADER, "Params", &wrong).is_err());
            let mut wrong = MEMBERS;
            wrong[index].2 += 4;
            assert!(check_struct(SHADER, "Params", &wrong).is_err());
        }
        assert!(check_struct(SHADER, "Params", &MEMBERS[..2]).unwrap_err().contains("size"));
        let longer = [MEMBERS.as_slice(), &[("more", 24, 4)]].concat();
        assert!(check_struct(SHADER, "Params", &longer).unwrap_err().contains("more"));
        assert!(check_struct(SHADER, "Missing", &MEMBERS).unwrap_err().contains("Missing"));
    }

    #[test]
    fn matching_bindings_pass_and_each_corruption_fails() {
        check_bindings(SHADER, "main", &bindings()).unwrap();
        let wrong = [
            Binding::Uniform { bytes: 28 },
            Binding::StorageReadWrite { min_bytes: 8 },
            Binding::StorageRead { min_bytes: 4 },
            Binding::TextureWrite { format: wgpu::TextureFormat::R32Float },
            Binding::TextureSample { sample: wgpu::TextureSampleType::Uint },
        ];
        for (index, wrong) in wrong.into_iter().enumerate() {
            let mut list = bindings();
            list[index] = wrong;
            let problem = check_bindings(SHADER, "main", &list).unwrap_err();
            assert!(problem.starts_with(&format!("binding {index} ")), "{problem}");
        }
        let mut small = bindings();
        small[1] = Binding::StorageRead { min_bytes: 4 };
        assert!(check_bindings(SHADER, "main", &small).is_err(), "one element takes 8 bytes");
        assert!(check_bindings(SHADER, "main", &bindings()[..4]).unwrap_err().contains("depth"));
        let longer = [bindings(), vec![Binding::StorageRead { min_bytes: 4 }]].concat();
        assert!(check_bindings(SHADER, "main", &longer).unwrap_err().contains("not declared"));
        assert!(check_bindings(SHADER, "other", &bindings()).unwrap_err().contains("main"));
        let grouped = SHADER.replace("@group(0) @binding(2)", "@group(1) @binding(2)");
        assert!(check_bindings(&grouped, "main", &bindings()).unwrap_err().contains("group 1"));
    }

    #[test]
    fn a_kernel_that_binds_something_else_or_is_no_shader_is_named() {
        let kernel = |text, bindings| {
            let wgsl = compose_fixed(Module { name: "test", source: text }, &[], &[]);
            KernelSource { label: "test.kernel", wgsl, entry_point: "main", bindings }
        };
        check_kernel(&kernel(SHADER, bindings())).unwrap();
        for wrong in [kernel(SHADER, bindings()[..4].to_vec()), kernel("fn f( {", bindings())] {
            let problem = check_kernel(&wrong).unwrap_err();
            assert!(problem.starts_with("test.kernel: "), "{problem}");
        }
    }

    #[test]
    fn validation_reports_faults_and_exceeded_limits() {
        validate_wgsl(SHADER).unwrap();
        assert!(validate_wgsl("fn f( {").unwrap_err().contains("expected"));
        assert!(validate_wgsl("fn f() -> u32 { return 1.5; }").is_err());
        let large = SHADER.replace("workgroup_size(64)", "workgroup_size(512)");
        assert!(validate_wgsl(&large).unwrap_err().contains("invocations"));
        let hungry = SHADER.replace("array<u32, 64>", "array<u32, 8192>");
        assert!(validate_wgsl(&hungry).unwrap_err().contains("32768 workgroup bytes"));
        let subgroup = "@compute @workgroup_size(1) fn main() { let x = subgroupAdd(1u); }";
        assert!(validate_wgsl(subgroup).is_err());
    }

    #[test]
    fn a_ninth_storage_buffer_is_too_many() {
        let shader = |count: u32| {
            let declare =
                |i| format!("@group(0) @binding({i}) var<storage, read_write> b{i}: array<u32>;\n");
            let declarations: String = (0..count).map(declare).collect();
            let writes: String = (0..count).map(|i| format!("b{i}[0] = 1u;")).collect();
            format!("{declarations}@compute @workgroup_size(1) fn main() {{ {writes} }}")
        };
        validate_wgsl(&shader(8)).unwrap();
        assert!(validate_wgsl(&shader(9)).unwrap_err().contains("9 storage buffers"));
    }
}
