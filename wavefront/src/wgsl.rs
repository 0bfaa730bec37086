//! WGSL that other kernels import.

use gpu_primitives::wgsl::Module;

use crate::outputs;
use crate::rays;

/// A frame's camera, grids and rays, and where the rays' states lie.
pub const FRAME: Module = rays::FRAME;

/// The state of rays that have not started.
pub const FIRST_BLOCK: Module = rays::FIRST_BLOCK;

/// Shading of a surface.
pub const SHADING: Module = outputs::SHADING;

/// The trilinear field in a cell.
pub const CELL: Module = rays::CELL;

/// Which blocks hold the samples of a ray's cells in a block.
pub const BLOCK_NEED: Module = rays::BLOCK_NEED;

/// Keeping or requesting those blocks.
pub const BLOCK_REQUEST: Module = rays::BLOCK_REQUEST;

/// Everything a kernel needs to import from this crate, with what that imports.
pub fn modules() -> Vec<Module> {
    let mut modules = vec![FRAME, FIRST_BLOCK, SHADING, CELL, BLOCK_NEED, BLOCK_REQUEST];
    modules.extend(macrocell::wgsl::MODULES);
    modules.extend(lru_cache_gpu::wgsl::MODULES);
    modules
}
