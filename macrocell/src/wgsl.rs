//! WGSL that other kernels import.

use gpu_primitives::wgsl::Module;

/// Exact traversal of nested grids along a ray.
pub const DDA: Module = Module { name: "dda", source: include_str!("../shader/lib/dda.wgsl") };

/// Sizes of the nested grids; imports [`DDA`].
pub const GRID: Module =
    Module { name: "macrocell_grid", source: include_str!("../shader/lib/macrocell_grid.wgsl") };

/// Advancing to the next active block; imports [`GRID`]. The importing text supplies
/// `fn macrocell_mask(index: u32) -> vec2<u32>`.
pub const SKIP: Module =
    Module { name: "macrocell_skip", source: include_str!("../shader/lib/macrocell_skip.wgsl") };

/// Monotone range codes.
pub const QUANTISE: Module = Module {
    name: "macrocell_quantise",
    source: include_str!("../shader/lib/macrocell_quantise.wgsl"),
};

/// Everything a kernel needs to import from this crate.
pub const MODULES: [Module; 4] = [DDA, GRID, SKIP, QUANTISE];
