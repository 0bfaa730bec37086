//! What a caller chooses.

/// Where guesses about an unfinished pixel come from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sources {
    /// The finished pixels around it.
    pub neighbours: bool,
    /// Its ray through the blocks' middle values, and through values that favour thin features.
    pub coarse_field: bool,
    /// The hits of the previous frame.
    pub history: bool,
}

impl Default for Sources {
    /// All of them.
    fn default() -> Self {
        Self { neighbours: true, coarse_field: true, history: true }
    }
}

/// How a picture is filled.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Look {
    /// Finished share of the rays that enter the volume from which on holes are filled; 0 for always.
    pub from_completeness: f32,
    /// Whether holes show either surface or background, nothing between.
    pub crisp: bool,
}

/// The candidates of a pixel, in the order in which kernels, network and files have them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Source {
    /// Push-pull of the finished pixels.
    Neighbours = 0,
    /// The coarse field of the blocks' middles.
    Coarse = 1,
    /// The coarse field that favours thin features.
    CoarseThin = 2,
    /// The hits of the previous frame.
    History = 3,
}

/// Logarithms of the weights that candidates have without a network, in the order of [`Source`]; from that of the
/// neighbours [`DOUBT`] is taken. Both were fitted to the training pictures (`infill/training/fit_prior.py`).
pub const PRIOR: [f32; 4] = [0.1, 0.0, -5.6, 3.2];

/// How much less neighbours weigh where they disagree: times `4 c (1 - c)`, which is 0 where their mean coverage `c`
/// is 0 or 1 and 1 where half of them show the surface.
pub const DOUBT: f32 = 2.0;
