//! The few places where the benchmark depends on choices that the library offers.

use progressive_iso::{FrameOptions, RendererOptions, Residency, ScenePlan};
use serde::Serialize;

/// Where a renderer shall keep its samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Wanted {
    /// Blocks decoded when rays need them.
    Cached,
    /// The decoded volume as a whole.
    Full,
}

impl Wanted {
    pub fn name(self) -> &'static str {
        match self {
            Self::Cached => "cached",
            Self::Full => "full",
        }
    }
}

/// The options with the wanted residency.
pub fn with_residency(options: RendererOptions, wanted: Wanted) -> RendererOptions {
    let residency = match wanted {
        Wanted::Cached => Residency::Cached,
        Wanted::Full => Residency::Full,
    };
    RendererOptions { residency, ..options }
}

/// What a plan has come to: a setting whose plan is another than it wanted is not measured.
pub fn residency(plan: &ScenePlan) -> Wanted {
    match plan.residency() {
        Residency::Full => Wanted::Full,
        _ => Wanted::Cached,
    }
}

/// A frame's options for `look_ahead`; a pass of `rounds` rounds.
pub fn frame_options(look_ahead: u32, rounds: u32) -> FrameOptions {
    FrameOptions {
        look_ahead,
        rounds_per_pass: rounds,
        pass_ms: f32::INFINITY,
        ..Default::default()
    }
}

/// Rounds per pass of a frame that continues one before it (state "moved"). One, so that rounds are
/// counted one by one; where a pass ends by itself when its rays are finished, it may hold many.
pub const ROUNDS_OF_MOVED: u32 = 1;
