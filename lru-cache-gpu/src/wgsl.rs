//! WGSL that walking kernels import.

use gpu_primitives::wgsl::{Constant, Module};

/// Sizes of the cache.
pub const PARAMS: Module =
    Module { name: "lru_params", source: include_str!("../shader/lib/lru_params.wgsl") };

/// Layout of the directory; imports [`PARAMS`].
pub const DIRECTORY: Module =
    Module { name: "lru_directory", source: include_str!("../shader/lib/lru_directory.wgsl") };

/// Layout of the cache's state; imports [`DIRECTORY`].
pub const STATE: Module =
    Module { name: "lru_state", source: include_str!("../shader/lib/lru_state.wgsl") };

/// Marking slots as used; imports [`STATE`].
pub const KEEP: Module =
    Module { name: "lru_keep", source: include_str!("../shader/lib/lru_keep.wgsl") };

/// Looking up, requesting and leading; imports [`KEEP`].
pub const REQUEST: Module =
    Module { name: "lru_request", source: include_str!("../shader/lib/lru_request.wgsl") };

/// Looking up only; imports [`DIRECTORY`].
pub const LOOKUP: Module =
    Module { name: "lru_lookup", source: include_str!("../shader/lib/lru_lookup.wgsl") };

/// Samples of resident blocks.
pub const SLOTS: Module =
    Module { name: "lru_slots", source: include_str!("../shader/lib/lru_slots.wgsl") };

/// What the service's own kernels share; imports [`STATE`].
pub(crate) const SERVICE: Module =
    Module { name: "lru_service", source: include_str!("../shader/lib/lru_service.wgsl") };

/// Everything a walking kernel needs to import from this crate.
pub const MODULES: [Module; 7] = [PARAMS, DIRECTORY, STATE, KEEP, REQUEST, LOOKUP, SLOTS];

/// Constants that fit [`SLOTS`] to a number of slot pages.
pub fn page_constants(pages: u32) -> [(&'static str, Constant); 3] {
    [("LRU_PAGES_2", 2), ("LRU_PAGES_3", 3), ("LRU_PAGES_4", 4)]
        .map(|(name, least)| (name, Constant::Bool(pages >= least)))
}
