//! WGSL that other kernels import.

use gpu_primitives::wgsl::Module;

/// Exact traversal of nested grids along a ray.
pub const DDA: Module = Module { name: "dda", source: include_str!("../shader/lib/dda.wgsl") };

/// Advancing to the next active block; imports [`DDA`]. The importing text supplies
/// `fn macrocell_mask(index: u32) -> vec2<u32>`.
pub const SKIP: Module =
    Module { name: "macrocell_skip", source: include_str!("../shader/lib/macrocell_skip.wgsl") };

/// Monotone range codes.
pub const QUANTISE: Module = Module {
    name: "macrocell_quantise",
    source: include_str!("../shader/lib/macrocell_quantise.wgsl"),
};

/// Everything a kernel needs to import from this crate.
pub const MODULES: [Module; 3] = [DDA, SKIP, QUANTISE];
