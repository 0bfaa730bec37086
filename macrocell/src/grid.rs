//! Sizes and indices of the nested grids over a volume.

/// The grids over a volume: voxels, blocks of 4^3 voxels, coarse cells of 4^3 blocks and, for large
/// volumes, a third level of 4^3 coarse cells. All linear indices run x fastest.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Grid {
    dims: [u32; 3],
}

/// Coarse cells from which on the third level pays.
const THIRD_LEVEL_FROM: u64 = 512;

fn linear(position: [u32; 3], size: [u32; 3]) -> u64 {
    u64::from(position[0])
        + u64::from(size[0])
            * (u64::from(position[1]) + u64::from(size[1]) * u64::from(position[2]))
}

/// The position whose linear index is `index`.
pub(crate) fn position(index: u64, size: [u32; 3]) -> [u32; 3] {
    let [x, y, _] = size.map(u64::from);
    [index % x, index / x % y, index / (x * y)].map(|p| p as u32)
}

fn volume(size: [u32; 3]) -> u64 {
    size.iter().map(|&s| u64::from(s)).product()
}

impl Grid {
    /// Grids over a volume of `dims` voxels.
    pub fn new(dims: [u32; 3]) -> Self {
        Self { dims }
    }

    /// Voxels on each axis.
    pub fn dims(&self) -> [u32; 3] {
        self.dims
    }

    /// Blocks on each axis.
    pub fn blocks(&self) -> [u32; 3] {
        self.dims.map(|d| d.div_ceil(4))
    }

    /// Blocks in all.
    pub fn block_count(&self) -> u64 {
        volume(self.blocks())
    }

    /// Linear index of a block.
    pub fn block_index(&self, block: [u32; 3]) -> u64 {
        linear(block, self.blocks())
    }

    /// Coarse cells on each axis.
    pub fn coarse(&self) -> [u32; 3] {
        self.dims.map(|d| d.div_ceil(16))
    }

    /// Coarse cells in all.
    pub fn coarse_count(&self) -> u64 {
        volume(self.coarse())
    }

    /// Linear index of a coarse cell.
    pub fn coarse_index(&self, coarse: [u32; 3]) -> u64 {
        linear(coarse, self.coarse())
    }

    /// Position of the coarse cell with a linear index.
    pub fn coarse_position(&self, index: u64) -> [u32; 3] {
        position(index, self.coarse())
    }

    /// Third-level cells on each axis.
    pub fn third(&self) -> [u32; 3] {
        self.dims.map(|d| d.div_ceil(64))
    }

    /// Third-level cells in all.
    pub fn third_count(&self) -> u64 {
        volume(self.third())
    }

    /// Linear index of a third-level cell.
    pub fn third_index(&self, third: [u32; 3]) -> u64 {
        linear(third, self.third())
    }

    /// Position of the third-level cell with a linear index.
    pub fn third_position(&self, index: u64) -> [u32; 3] {
        position(index, self.third())
    }

    /// Whether the volume is large enough for the third level to pay.
    pub fn has_third_level(&self) -> bool {
        self.coarse_count() >= THIRD_LEVEL_FROM
    }

    /// Masks of all levels.
    pub fn mask_count(&self) -> u64 {
        let third = if self.has_third_level() { self.third_count() } else { 0 };
        self.coarse_count() + third
    }

    /// Bits of a block's x, of its x and y, and of its whole position when the three coordinates are packed
    /// into one number.
    pub fn packing(&self) -> [u32; 3] {
        let [x, y, z] = self.blocks().map(|n| n.max(1).next_power_of_two().ilog2());
        [x, x + y, x + y + z]
    }

    /// Last dual cell on each axis, `dims - 2`; -1 where an axis has no dual cells.
    pub fn last_cell(&self) -> [i32; 3] {
        self.dims.map(|d| d as i32 - 2)
    }
}
