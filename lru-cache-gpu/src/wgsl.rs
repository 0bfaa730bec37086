//! WGSL that walking kernels import.

use gpu_primitives::wgsl::{Constant, Module};

/// Sizes of the cache and the entries of its directory.
pub const PARAMS: Module =
    Module { name: "lru_params", source: include_str!("../shader/lib/lru_params.wgsl") };

/// Layout of the cache's state; imports [`PARAMS`].
pub const STATE: Module =
    Module { name: "lru_state", source: include_str!("../shader/lib/lru_state.wgsl") };

/// Looking up, touching, requesting, leading; imports [`STATE`].
pub const REQUEST: Module =
    Module { name: "lru_request", source: include_str!("../shader/lib/lru_request.wgsl") };

/// Looking up only; imports [`PARAMS`].
pub const LOOKUP: Module =
    Module { name: "lru_lookup", source: include_str!("../shader/lib/lru_lookup.wgsl") };

/// Samples of resident blocks.
pub const SLOTS: Module =
    Module { name: "lru_slots", source: include_str!("../shader/lib/lru_slots.wgsl") };

/// Everything a walking kernel needs to import from this crate.
pub const MODULES: [Module; 5] = [PARAMS, STATE, REQUEST, LOOKUP, SLOTS];

/// Constants that fit [`SLOTS`] to a number of slot pages.
pub fn page_constants(pages: u32) -> [(&'static str, Constant); 3] {
    [
        ("LRU_PAGES_2", Constant::Bool(pages >= 2)),
        ("LRU_PAGES_3", Constant::Bool(pages >= 3)),
        ("LRU_PAGES_4", Constant::Bool(pages >= 4)),
    ]
}
