//! Serving a round's requests.

use bytemuck::{Pod, Zeroable};
use gpu_primitives::kernel::{Binding, Kernel, KernelSource};
use gpu_primitives::wgsl::{Module, compose_fixed};
use gpu_primitives::{indirect, wgpu};

use crate::layout::{HEADER, REQUESTED_TOTAL};
use crate::plan::{CONTROL_BYTES, LruParams};
use crate::{CacheBuffers, wgsl};

const HEADER_BYTES: u64 = 4 * HEADER as u64;

/// Uniform of `shader/finish.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(crate) struct FinishParams {
    lru: LruParams,
    jobs_per_group: u32,
    pad0: u32,
    pad1: u32,
    pad2: u32,
}

impl FinishParams {
    pub(crate) fn new(lru: LruParams, jobs_per_group: u32) -> Self {
        Self { lru, jobs_per_group: jobs_per_group.max(1), pad0: 0, pad1: 0, pad2: 0 }
    }
}

/// What a cache has done since its creation.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
pub struct Counters {
    /// Blocks asked for, the leader's included, each once per round.
    pub requested: u32,
    /// Blocks given a slot, to be decoded.
    pub decoded: u32,
    /// Blocks that lost their slot.
    pub evicted: u32,
    /// Requests that found no slot.
    pub deferred: u32,
    /// Resident blocks that rays used, each once per round.
    pub used: u32,
}

impl Counters {
    /// Where the counters are in [`CacheBuffers::state`]: byte offset and length.
    pub const BYTES: (u64, u64) = (4 * REQUESTED_TOTAL as u64, size_of::<Counters>() as u64);
}

/// The stage that serves requests. Immutable; used with any number of caches.
#[derive(Debug)]
pub struct Service {
    pub(crate) kernels: Kernels,
}

#[derive(Debug)]
pub(crate) struct Kernels {
    pub(crate) begin_frame: Kernel,
    pub(crate) lead: Kernel,
    pub(crate) search: Kernel,
    pub(crate) assign: Kernel,
    pub(crate) unlink: Kernel,
    pub(crate) insert: Kernel,
    pub(crate) finish: Kernel,
}

fn source(label: &'static str, module: Module, bindings: Vec<Binding>) -> KernelSource {
    let mut modules = wgsl::MODULES.to_vec();
    modules.extend([wgsl::SERVICE, indirect::MODULE]);
    KernelSource {
        label,
        wgsl: compose_fixed(module, &modules, &[]),
        entry_point: "main",
        bindings,
    }
}

macro_rules! module {
    ($name:literal) => {
        Module { name: $name, source: include_str!(concat!("../shader/", $name, ".wgsl")) }
    };
}

impl Service {
    /// Makes the pipelines.
    pub fn new(device: &wgpu::Device) -> Self {
        let [begin_frame, lead, search, assign, unlink, insert, finish] =
            Self::sources().map(|s| s.kernel(device));
        let kernels = Kernels { begin_frame, lead, search, assign, unlink, insert, finish };
        Self { kernels }
    }

    /// Texts and bindings of the kernels.
    pub fn sources() -> [KernelSource; 7] {
        let params = Binding::Uniform { bytes: size_of::<LruParams>() as u64 };
        let finish_params = Binding::Uniform { bytes: size_of::<FinishParams>() as u64 };
        let read = |min_bytes| Binding::StorageRead { min_bytes };
        let write = |min_bytes| Binding::StorageReadWrite { min_bytes };
        let (directory, state) = (write(4), write(HEADER_BYTES));
        let on_cache = |rest: &[Binding]| [&[params, directory, state], rest].concat();
        let finish = vec![finish_params, directory, state, write(12)];
        [
            source("lru.begin_frame", module!("begin_frame"), on_cache(&[])),
            source("lru.lead", module!("lead"), on_cache(&[write(8), write(CONTROL_BYTES)])),
            source("lru.search", module!("search"), on_cache(&[write(4)])),
            source("lru.assign", module!("assign"), on_cache(&[write(4), write(8)])),
            source("lru.unlink", module!("unlink"), on_cache(&[read(4)])),
            source("lru.insert", module!("insert"), on_cache(&[read(4), read(8)])),
            source("lru.finish", module!("finish"), finish),
        ]
    }

    /// Records forgetting every block; the counters start at 0 again. A frame must start next.
    pub fn record_clear(&self, encoder: &mut wgpu::CommandEncoder, cache: &CacheBuffers) {
        encoder.clear_buffer(&cache.directory, 0, None);
        encoder.clear_buffer(&cache.state, 0, None);
    }

    /// Records the start of a frame. Needed once before the first round, too.
    pub fn record_begin_frame(&self, encoder: &mut wgpu::CommandEncoder, cache: &CacheBuffers) {
        let mut pass = begin(encoder, "lru.begin_frame");
        self.kernels.begin_frame.dispatch(&mut pass, &cache.binds.begin_frame, 1);
    }

    /// Records serving the requests of a round. Afterwards the jobs and the arguments of the decode
    /// dispatch are in place; blocks count as resident, so the decode must follow before any use.
    pub fn record(&self, encoder: &mut wgpu::CommandEncoder, cache: &CacheBuffers) {
        let (kernels, binds, control) = (&self.kernels, &cache.binds, &cache.control);
        let mut pass = begin(encoder, "lru.serve");
        kernels.lead.dispatch(&mut pass, &binds.lead, 1);
        // Sets of arguments in the order in which shader/lead.wgsl writes them.
        kernels.search.dispatch_indirect(&mut pass, &binds.search, control, 0);
        kernels.assign.dispatch_indirect(&mut pass, &binds.assign, control, 12);
        kernels.unlink.dispatch_indirect(&mut pass, &binds.unlink, control, 24);
        kernels.insert.dispatch_indirect(&mut pass, &binds.insert, control, 36);
        kernels.finish.dispatch(&mut pass, &binds.finish, 1);
    }
}

fn begin<'a>(encoder: &'a mut wgpu::CommandEncoder, label: &str) -> wgpu::ComputePass<'a> {
    gpu_primitives::profile::begin_pass(encoder, label)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plan::PARAMS_BYTES;
    use gpu_testkit::layout::{check_struct, struct_size};

    macro_rules! members {
        ($params:ty: $($name:ident),*) => {{
            let params = <$params>::zeroed();
            [$((
                stringify!($name),
                std::mem::offset_of!($params, $name) as u32,
                size_of_val(&params.$name) as u32,
            )),*]
        }};
    }

    #[test]
    fn uniforms_lie_where_the_host_writes_them() {
        let lru = members!(LruParams: slots, slots_per_page, request_capacity, heads);
        for source in Service::sources() {
            check_struct(&source.wgsl.source, "LruParams", &lru).unwrap();
        }
        let finish = members!(FinishParams: lru, jobs_per_group, pad0, pad1, pad2);
        let [.., source] = Service::sources();
        check_struct(&source.wgsl.source, "FinishParams", &finish).unwrap();
        let bytes = struct_size(&source.wgsl.source, "FinishParams").unwrap();
        assert_eq!(bytes as usize, size_of::<FinishParams>());
        assert_eq!(size_of::<LruParams>() + size_of::<FinishParams>(), PARAMS_BYTES as usize);
    }

    #[test]
    fn counters_follow_each_other_in_the_header() {
        use crate::layout::{DECODED_TOTAL, DEFERRED_TOTAL, EVICTED_TOTAL, USED_TOTAL};
        let words = [REQUESTED_TOTAL, DECODED_TOTAL, EVICTED_TOTAL, DEFERRED_TOTAL, USED_TOTAL];
        let offsets = members!(Counters: requested, decoded, evicted, deferred, used);
        for (word, (name, offset, _)) in words.into_iter().zip(offsets) {
            assert_eq!(4 * word as u64, Counters::BYTES.0 + u64::from(offset), "{name}");
        }
        assert_eq!(Counters::BYTES.1, 20);
    }
}
