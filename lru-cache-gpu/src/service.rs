//! Serving a round's requests.

use bytemuck::{Pod, Zeroable};
use gpu_primitives::compact::Compact;
use gpu_primitives::kernel::{Binding, Kernel, KernelSource};
use gpu_primitives::wgsl::{Module, compose_fixed};
use gpu_primitives::{indirect, wgpu};

use crate::plan::{CONTROL_BYTES, HEADER_WORDS, LruParams};
use crate::{CacheBuffers, wgsl};

const HEADER_BYTES: u64 = 4 * HEADER_WORDS;

/// Word of the header that counts the jobs of the running round.
pub(crate) const JOB_COUNT_WORD: u64 = 6;

/// First of the counters' words in the header.
const COUNTER_WORD: u64 = 8;

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
    pub const BYTES: (u64, u64) = (4 * COUNTER_WORD, size_of::<Counters>() as u64);
}

/// The stage that serves requests. Immutable; used with any number of caches.
#[derive(Debug)]
pub struct Service {
    pub(crate) kernels: Kernels,
    pub(crate) compact: Compact,
}

#[derive(Debug)]
pub(crate) struct Kernels {
    pub(crate) begin_frame: Kernel,
    pub(crate) lead: Kernel,
    pub(crate) search: Kernel,
    pub(crate) assign: Kernel,
    pub(crate) finish: Kernel,
}

fn source(
    label: &'static str,
    name: &'static str,
    text: &'static str,
    params_bytes: u64,
    rest: &[Binding],
) -> KernelSource {
    let mut bindings = vec![
        Binding::Uniform { bytes: params_bytes },
        Binding::StorageReadWrite { min_bytes: 4 },
        Binding::StorageReadWrite { min_bytes: HEADER_BYTES },
    ];
    bindings.extend_from_slice(rest);
    let wgsl = compose_fixed(
        Module { name, source: text },
        &[wgsl::PARAMS, wgsl::STATE, indirect::MODULE],
        &[],
    );
    KernelSource { label, wgsl, entry_point: "main", bindings }
}

impl Service {
    /// Makes the pipelines.
    pub fn new(device: &wgpu::Device) -> Self {
        let [begin_frame, lead, search, assign, finish] = Self::sources().map(|s| s.kernel(device));
        let kernels = Kernels { begin_frame, lead, search, assign, finish };
        Self { kernels, compact: Compact::new(device) }
    }

    /// Texts and bindings of the kernels.
    pub fn sources() -> [KernelSource; 5] {
        let lru = size_of::<LruParams>() as u64;
        let finish = size_of::<FinishParams>() as u64;
        let read = |min_bytes| Binding::StorageRead { min_bytes };
        let write = |min_bytes| Binding::StorageReadWrite { min_bytes };
        [
            source(
                "lru.begin_frame",
                "begin_frame",
                include_str!("../shader/begin_frame.wgsl"),
                lru,
                &[],
            ),
            source(
                "lru.lead",
                "lead",
                include_str!("../shader/lead.wgsl"),
                lru,
                &[write(8), write(CONTROL_BYTES)],
            ),
            source(
                "lru.search",
                "search",
                include_str!("../shader/search.wgsl"),
                lru,
                &[read(CONTROL_BYTES), write(4), write(4)],
            ),
            source(
                "lru.assign",
                "assign",
                include_str!("../shader/assign.wgsl"),
                lru,
                &[read(4), read(4), write(8)],
            ),
            source(
                "lru.finish",
                "finish",
                include_str!("../shader/finish.wgsl"),
                finish,
                &[read(CONTROL_BYTES), read(4), read(4), write(12)],
            ),
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
        let (kernels, binds) = (&self.kernels, &cache.binds);
        {
            let mut pass = begin(encoder, "lru.search");
            kernels.lead.dispatch(&mut pass, &binds.lead, 1);
            kernels.search.dispatch_indirect(&mut pass, &binds.search, &cache.control, 0);
        }
        self.compact.record(encoder, &cache.compact);
        let mut pass = begin(encoder, "lru.assign");
        kernels.assign.dispatch_indirect(&mut pass, &binds.assign, &cache.control, 16);
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
        let lru = members!(LruParams: slots, slots_per_page, request_capacity, window_capacity);
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

    // The header is a list of constants in WGSL, not a struct; the host knows a few of its words.
    #[test]
    fn the_header_has_the_words_that_the_host_reads() {
        let [source, ..] = Service::sources();
        let says = |name: &str, value: u64| {
            let line = format!("const {name}: u32 = {value}u;");
            assert!(source.wgsl.source.contains(&line), "{line}");
        };
        says("LRU_JOB_COUNT", JOB_COUNT_WORD);
        says("LRU_HEADER", HEADER_WORDS);
        let counters = ["REQUESTED", "DECODED", "EVICTED", "DEFERRED", "USED"];
        for (word, name) in (COUNTER_WORD..).zip(counters) {
            says(&format!("LRU_{name}_TOTAL"), word);
        }
        assert_eq!(Counters::BYTES.1, 20);
    }
}
