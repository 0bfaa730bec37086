//! Sizes, before anything is allocated.

use gpu_primitives::wgpu;

use crate::{Error, Grid};

/// Coarse cells on each axis of the largest region whose ranges are built at once: its block
/// extrema take 33^3 * 64 bytes, 2.3 MB.
const REGION_COARSE: u32 = 8;

/// Bytes of a block's extrema: (min, max) of 8 classes.
const EXTREMA_BYTES: u64 = 64;

/// Bytes of a coarse cell's range codes.
pub(crate) const CODE_BYTES: u64 = 128;

/// Bytes of the box of the active blocks.
const ACTIVE_BOX_BYTES: u64 = 32;

/// Most bits of a block's packed position, so that two are left for a ray's status.
const MOST_BITS: u32 = 30;

/// Sizes of everything this crate allocates for one volume.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct MacrocellPlan {
    grid: Grid,
    coarse_per_page: u64,
}

/// Coarse cells whose ranges are built by one recording.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Region {
    /// First coarse cell.
    pub coarse_origin: [u32; 3],
    /// Coarse cells on each axis.
    pub coarse_size: [u32; 3],
}

impl Region {
    /// First block of the region.
    pub fn block_origin(&self) -> [u32; 3] {
        self.coarse_origin.map(|c| c * 4)
    }

    /// Blocks whose extrema the region needs: its own and one layer on the plus side.
    pub fn block_size(&self) -> [u32; 3] {
        self.coarse_size.map(|c| c * 4 + 1)
    }
}

impl MacrocellPlan {
    /// Plans the ranges and masks of a volume of `dims` voxels.
    ///
    /// # Errors
    /// If an axis is empty, the blocks cannot be numbered, or the masks exceed one binding.
    pub fn new(dims: [u32; 3], limits: &wgpu::Limits) -> Result<Self, Error> {
        if dims.contains(&0) {
            return Err(Error::EmptyVolume { dims });
        }
        let grid = Grid::new(dims);
        let [.., bits] = grid.packing();
        if bits > MOST_BITS {
            let (blocks, limit) = (grid.block_count(), 1 << MOST_BITS);
            return Err(Error::TooManyBlocks { dims, blocks, limit });
        }
        let available = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
        let plan = Self { grid, coarse_per_page: (available / CODE_BYTES).max(1) };
        if plan.mask_bytes() > available {
            return Err(Error::MasksTooLarge { dims, needed: plan.mask_bytes(), available });
        }
        Ok(plan)
    }

    /// The nested grids.
    pub fn grid(&self) -> Grid {
        self.grid
    }

    /// Coarse cells per page of range codes.
    pub fn coarse_per_page(&self) -> u64 {
        self.coarse_per_page
    }

    /// First coarse cell and number of coarse cells of every page of range codes.
    pub fn pages(&self) -> impl Iterator<Item = (u64, u64)> + use<> {
        let (count, step) = (self.grid.coarse_count(), self.coarse_per_page);
        (0..count.div_ceil(step)).map(move |p| (p * step, step.min(count - p * step)))
    }

    /// Bytes of the value ranges: codes and coarse ranges.
    pub fn range_bytes(&self) -> u64 {
        self.grid.coarse_count() * (CODE_BYTES + 8)
    }

    /// Bytes of the active masks and of the box behind them.
    pub fn mask_bytes(&self) -> u64 {
        self.grid.mask_count() * 8 + ACTIVE_BOX_BYTES
    }

    /// Coarse cells of the largest region.
    pub fn region_coarse(&self) -> [u32; 3] {
        self.grid.coarse().map(|c| c.min(REGION_COARSE))
    }

    /// Bytes that building the ranges needs for the time of loading.
    pub fn scratch_bytes(&self) -> u64 {
        self.region_coarse().iter().map(|&c| u64::from(c * 4 + 1)).product::<u64>() * EXTREMA_BYTES
    }

    /// Number of regions that cover the volume.
    pub fn region_count(&self) -> u64 {
        self.region_grid().iter().map(|&r| u64::from(r)).product()
    }

    fn region_grid(&self) -> [u32; 3] {
        let (coarse, size) = (self.grid.coarse(), self.region_coarse());
        std::array::from_fn(|a| coarse[a].div_ceil(size[a]))
    }

    /// The region with number `index`, x fastest.
    pub fn region(&self, index: u64) -> Region {
        let position = crate::grid::position(index, self.region_grid());
        let (coarse, size) = (self.grid.coarse(), self.region_coarse());
        let coarse_origin: [u32; 3] = std::array::from_fn(|a| position[a] * size[a]);
        let coarse_size = std::array::from_fn(|a| size[a].min(coarse[a] - coarse_origin[a]));
        Region { coarse_origin, coarse_size }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn regions_cover_every_coarse_cell_once() {
        let plan = MacrocellPlan::new([300, 17, 140], &wgpu::Limits::default()).unwrap();
        let mut seen = vec![0; plan.grid().coarse_count() as usize];
        for index in 0..plan.region_count() {
            let region = plan.region(index);
            for z in 0..region.coarse_size[2] {
                for y in 0..region.coarse_size[1] {
                    for x in 0..region.coarse_size[0] {
                        let o = region.coarse_origin;
                        seen[plan.grid().coarse_index([o[0] + x, o[1] + y, o[2] + z]) as usize] +=
                            1;
                    }
                }
            }
        }
        assert!(seen.iter().all(|&n| n == 1));
    }

    #[test]
    fn sizes_of_the_largest_published_volume() {
        let plan = MacrocellPlan::new([2048, 2048, 1920], &wgpu::Limits::default()).unwrap();
        let blocks = plan.grid().block_count();
        assert_eq!(blocks, 125_829_120);
        assert_eq!(plan.range_bytes(), 2 * blocks + blocks / 8);
        assert_eq!(plan.pages().count(), 2);
        assert_eq!(plan.mask_bytes(), blocks / 8 + blocks / 512 + 32);
    }

    #[test]
    fn refuses_what_cannot_be_numbered() {
        let limits = wgpu::Limits::default();
        assert!(matches!(
            MacrocellPlan::new([1 << 14, 1 << 14, 1 << 14], &limits),
            Err(Error::TooManyBlocks { .. })
        ));
        assert!(matches!(
            MacrocellPlan::new([0, 4, 4], &limits),
            Err(Error::EmptyVolume { dims: [0, 4, 4] })
        ));
    }
}
