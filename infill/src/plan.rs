//! Sizes, before anything is allocated.

use gpu_primitives::wgpu;
use macrocell::MacrocellPlan;
use wavefront::cpu::frame::RayStates;
use wavefront::{FrameParams, RayOrder};

use crate::Error;
use crate::kernels::{InfillParams, ScatterParams};
use crate::options::{Look, Sources};
use crate::reduced;
use crate::weights::PackedWeights;

/// Pixels on the edge of a tile.
pub(crate) const TILE: u32 = 16;

/// Pixels of the picture for one of a halved one in both directions.
const HALF: u32 = 2;

/// Levels of averages, from 2x2 pixels on.
pub(crate) const LEVELS: usize = crate::cpu::push_pull::LEVELS;

/// Most pages of range codes that the kernel of the coarse field binds.
const MOST_CODE_PAGES: usize = 3;

/// Lists of tiles: those with holes, with their neighbours, and those within two tiles.
pub(crate) const LISTS: u64 = 3;
const TILES_HEADER_WORDS: u64 = 6;

/// Bytes of the arguments of dispatches over the lists, and over the rays' active bits.
pub(crate) const ARGS_BYTES: u64 = 16 * LISTS;
pub(crate) const GATE_BYTES: u64 = 16;

/// Bytes of a texel of averages, of four channels of a map's texel, and of what the coarse field says about a quad.
const AVERAGE_BYTES: u64 = 16;
const GROUP_BYTES: u64 = 8;
const GUESS_BYTES: u64 = 8;

/// What a scene's in-fill consists of and the sizes of everything that this crate allocates for it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct InfillPlan {
    /// Of the pictures that it works on, and pixels of the picture for one of theirs in both directions.
    size: [u32; 2],
    step: u32,
    /// Numbers of a reduced picture's rays.
    reduced_numbers: u64,
    sources: Sources,
    network: bool,
    code_pages: usize,
    diagonal_squared: u64,
    coarse_per_page: u64,
}

impl InfillPlan {
    /// Plans in-fill of pictures of `size` pixels. The coarse field is left out where the volume's ranges lie in more
    /// pages than a kernel can bind.
    ///
    /// # Errors
    /// If a buffer for so many pixels would exceed the limits.
    pub fn new(
        size: [u32; 2],
        sources: Sources,
        network: bool,
        ranges: &MacrocellPlan,
        limits: &wgpu::Limits,
    ) -> Result<Self, Error> {
        let code_pages = ranges.pages().count();
        let has_cells = ranges.grid().last_cell().iter().all(|&last| last >= 0);
        let coarse_field = sources.coarse_field && code_pages <= MOST_CODE_PAGES && has_cells;
        let plan = Self {
            size,
            step: 1,
            reduced_numbers: 0,
            sources: Sources { coarse_field, ..sources },
            network,
            code_pages: if coarse_field { code_pages } else { 0 },
            diagonal_squared: ranges
                .grid()
                .dims()
                .iter()
                .map(|&d| u64::from(d) * u64::from(d))
                .sum(),
            coarse_per_page: ranges.coarse_per_page(),
        };
        let available = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
        let needed = plan.average_bytes().max(plan.map_bytes()).max(plan.history_bytes());
        if needed > available {
            let [width, height] = size;
            return Err(Error::PictureSize { width, height, needed, available });
        }
        Ok(plan)
    }

    /// The same at half the picture's resolution: of 2x2 pixels one that is finished counts for all, and holes get the
    /// colours between those of a quarter of the pixels. `None` for pictures that are too small.
    #[must_use]
    pub fn halved(&self) -> Option<Self> {
        let order = RayOrder::new(self.size).preview(HALF).filter(|_| self.step == 1)?;
        let size = self.size.map(|s| s.div_ceil(HALF));
        Some(Self { size, step: HALF, reduced_numbers: order.numbers(), ..self.clone() })
    }

    /// Width and height of what it works on, in pixels.
    pub fn size(&self) -> [u32; 2] {
        self.size
    }

    /// Pixels of the picture for one of those in both directions: 1, or 2 if halved.
    pub fn step(&self) -> u32 {
        self.step
    }

    /// Numbers of a reduced picture's rays; 0 unless halved.
    pub(crate) fn reduced_numbers(&self) -> u64 {
        self.reduced_numbers
    }

    /// Header, states and active bits of a reduced picture's rays.
    pub(crate) fn reduced_ray_bytes(&self) -> u64 {
        RayStates::bytes(self.reduced_numbers)
    }

    /// Bytes of a reduced picture; 0 unless halved.
    fn reduced_bytes(&self) -> u64 {
        let textures = self.pixels() * reduced::OUTPUTS.bytes_per_pixel();
        let all = self.reduced_ray_bytes() + textures + FrameParams::BYTES;
        if self.step > 1 { all } else { 0 }
    }

    /// The sources that are in.
    pub fn sources(&self) -> Sources {
        self.sources
    }

    /// Whether the network is in.
    pub fn network(&self) -> bool {
        self.network
    }

    /// Pages of range codes that the coarse field reads; 0 without it.
    pub(crate) fn code_pages(&self) -> usize {
        self.code_pages
    }

    pub(crate) fn tiles(&self) -> [u32; 2] {
        self.size.map(|s| s.div_ceil(TILE))
    }

    pub(crate) fn padded(&self) -> [u32; 2] {
        self.size.map(|s| s.next_multiple_of(4))
    }

    fn pixels(&self) -> u64 {
        u64::from(self.size[0]) * u64::from(self.size[1])
    }

    fn padded_texels(&self, level: u32) -> u64 {
        self.padded().iter().map(|&s| u64::from(s >> level)).product()
    }

    /// First texel of every level of averages, and their number.
    fn levels(&self) -> ([u64; LEVELS], u64) {
        let mut next = 0;
        let first = std::array::from_fn(|level| {
            let first = next;
            next += self.size.iter().map(|s| u64::from(s.div_ceil(2 << level))).product::<u64>();
            first
        });
        (first, next)
    }

    /// Words of the header, the bits and the lists of tiles.
    pub(crate) fn tile_bytes(&self) -> u64 {
        let [x, y] = self.tiles().map(u64::from);
        4 * (self.tile_header_words() + LISTS * x * y)
    }

    /// Words that a fill begins by clearing.
    pub(crate) fn tile_header_words(&self) -> u64 {
        let [x, y] = self.tiles().map(u64::from);
        TILES_HEADER_WORDS + (x * y).div_ceil(32)
    }

    /// Bytes of what the coarse field says; 0 without it.
    pub(crate) fn guess_bytes(&self) -> u64 {
        if self.sources.coarse_field { GUESS_BYTES * self.quads() } else { 0 }
    }

    fn quads(&self) -> u64 {
        self.size.iter().map(|s| u64::from(s.div_ceil(2))).product()
    }

    /// Whether finished pixels are averaged.
    pub(crate) fn averages(&self) -> bool {
        self.sources.neighbours || self.network
    }

    /// The list of the tiles in which they are.
    pub(crate) fn averages_list(&self) -> u32 {
        if self.network { 2 } else { 1 }
    }

    /// Bytes of the previous frame's hits; 0 without history.
    pub(crate) fn history_bytes(&self) -> u64 {
        if self.sources.history { 4 * self.pixels() } else { 0 }
    }

    /// Bytes of the averages; 0 where nothing reads them.
    pub(crate) fn average_bytes(&self) -> u64 {
        if self.averages() { AVERAGE_BYTES * self.levels().1 } else { 0 }
    }

    /// Bytes of the averages spread over the holes; 0 without neighbours.
    pub(crate) fn pulled_bytes(&self) -> u64 {
        if self.sources.neighbours { AVERAGE_BYTES * self.quads() } else { 0 }
    }

    /// Bytes of the network's maps: of two at a half of the resolution with two groups of channels, and of two at a quarter with three,
    /// which have room for four.
    pub(crate) fn map_bytes(&self) -> u64 {
        if self.network { 2 * GROUP_BYTES * self.padded_texels(1) } else { 0 }
    }

    /// See [`Self::map_bytes`].
    pub(crate) fn quarter_bytes(&self) -> u64 {
        if self.network { 4 * GROUP_BYTES * self.padded_texels(2) } else { 0 }
    }

    /// Everything together.
    pub fn bytes(&self) -> u64 {
        let history = if self.sources.history {
            FrameParams::BYTES + size_of::<ScatterParams>() as u64
        } else {
            0
        };
        let weights = if self.network { PackedWeights::BYTES } else { 0 };
        self.tile_bytes()
            + ARGS_BYTES
            + GATE_BYTES
            + self.guess_bytes()
            + self.history_bytes()
            + history
            + self.average_bytes()
            + self.pulled_bytes()
            + 2 * (self.map_bytes() + self.quarter_bytes())
            + weights
            + self.reduced_bytes()
            + size_of::<InfillParams>() as u64
    }

    pub(crate) fn params(&self, look: Look) -> InfillParams {
        InfillParams {
            size: self.size,
            tiles: self.tiles(),
            levels: self.levels().0.map(|first| first as u32),
            padded: self.padded(),
            coarse_per_page: self.coarse_per_page.min(u64::from(u32::MAX)) as u32,
            crisp: look.crisp.into(),
            diagonal: (self.diagonal_squared as f32).sqrt(),
            none: 0.0,
            complete: look.from_completeness,
            pad0: 0,
        }
    }
}
