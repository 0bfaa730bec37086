use thiserror::Error as ThisError;

/// What can go wrong between a volume and its picture.
#[derive(Debug, Clone, PartialEq, ThisError)]
#[non_exhaustive]
pub enum Error {
    /// The budget does not hold the smallest working set.
    #[error("the scene needs at least {minimum} bytes of GPU memory, the budget is {budget}")]
    BudgetTooSmall {
        /// Least bytes.
        minimum: u64,
        /// [`crate::RendererOptions::budget_bytes`].
        budget: u64,
    },
    /// The stream ends too early.
    #[error(
        "{dims:?} voxels at {bits_per_block} bits per block need {expected} bytes of stream, found {found}"
    )]
    ShortStream {
        /// Voxels on each axis.
        dims: [u32; 3],
        /// Bits of every block.
        bits_per_block: u32,
        /// Least bytes.
        expected: u64,
        /// Bytes given.
        found: u64,
    },
    /// The stream of [`crate::CompressedVolume::streamed`] went to another renderer.
    #[error("the volume's stream is gone: another renderer has loaded it")]
    StreamTaken,
    /// The device lacks something that every scene needs.
    #[error("the device offers {found} {what}, at least {needed} are needed")]
    UnsupportedDevice {
        /// Which limit.
        what: &'static str,
        /// Least value.
        needed: u64,
        /// The device's value.
        found: u64,
    },
    /// A frame has exactly one isovalue.
    #[error("a frame needs exactly one isovalue, found {found}")]
    IsovalueCount {
        /// Isovalues given.
        found: usize,
    },
    /// An isovalue is NaN, infinite, or beyond what samples can be.
    #[error("the isovalue {found} is not finite or larger than 2^124 in size")]
    Isovalue {
        /// Isovalue given.
        found: f32,
    },
    /// [`crate::RendererOptions::capture`] was not set.
    #[error("capture was not planned: set RendererOptions::capture")]
    CaptureNotPlanned,
    /// Nothing to draw to.
    #[error("drawing was not planned: set RendererOptions::draw_target")]
    DrawNotPlanned,
    /// [`crate::RendererOptions::infill`] does not have what a frame asks for.
    #[error(
        "this in-fill was not planned: set RendererOptions::infill, with weights for the network"
    )]
    InfillNotPlanned,
    /// [`crate::RendererOptions::foveation`] was not set.
    #[error("foveation was not planned: set RendererOptions::foveation")]
    FoveationNotPlanned,
    /// [`crate::RendererOptions::budget`] was not set.
    #[error("a frame-time budget was not planned: set RendererOptions::budget")]
    BudgetNotPlanned,
    /// [`crate::FrameOptions::target_ms`] is no time.
    #[error("the target of a frame's time is {found} ms; expected a finite number above 0")]
    Target {
        /// What was given.
        found: f32,
    },
    /// No frame has been set.
    #[error("no frame has been set")]
    NoFrame,
    /// Several passes in a row changed nothing: a fault of the device or of this library.
    #[error("no progress in {passes} passes with {active_rays} rays unfinished")]
    Stalled {
        /// Passes without progress.
        passes: u32,
        /// Rays that are not finished.
        active_rays: u32,
    },
    /// The device is lost. Make a renderer on a new one; [`crate::ProgressiveIsoRenderer::volume`] still
    /// has the stream, unless that arrived in pieces. In browsers a lost device is seen as [`Error::MapFailed`].
    #[error("the device is lost")]
    DeviceLost,
    /// The device has no memory for what the plan asks for. The renderer stays unusable.
    #[error("the device is out of memory: {message}")]
    OutOfMemory {
        /// What wgpu says.
        message: String,
    },
    /// The device refused a shader or a pipeline. The renderer stays unusable.
    #[error("the device refused a shader: {message}")]
    ShaderRefused {
        /// What wgpu says.
        message: String,
    },
    /// The device refused memory, bindings or commands: a fault of this library, or of a caller that
    /// changed what belongs to it. The renderer stays unusable.
    #[error("the device refused a pass: {message}")]
    Refused {
        /// What wgpu says.
        message: String,
    },
    /// Results could not be mapped. The renderer stays unusable.
    #[error("results could not be mapped")]
    MapFailed,
    /// A pass was submitted and did not run, or its shaders did not. The renderer stays unusable.
    #[error("a submitted pass did not run")]
    NotRun,
    /// An encoder with a part of the volume was dropped. The renderer stays unusable.
    #[error("an encoder that loads a part of the volume was dropped")]
    LoadDropped,
    /// Waiting for the device failed.
    #[error("waiting for the device failed: {0}")]
    Device(String),
    /// The compressed stream.
    #[error(transparent)]
    Stream(#[from] zfp_gpu::Error),
    /// Value ranges and masks.
    #[error(transparent)]
    Macrocell(#[from] macrocell::Error),
    /// The block cache.
    #[error(transparent)]
    Cache(#[from] lru_cache_gpu::Error),
    /// In-fill of unfinished pixels.
    #[error(transparent)]
    Infill(#[from] infill::Error),
    /// Rays, camera and pictures.
    #[error(transparent)]
    Wavefront(#[from] wavefront::Error),
}
