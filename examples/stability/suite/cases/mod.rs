//! The cases, by group.

mod geometry;
mod isovalue;
mod scale;
mod shapes;
mod sizes;
mod stiff;

pub use shapes::{checkerboard, distance, gyroid, hash};

use super::case::Case;
use super::views::Effort;

/// All cases.
pub fn all(effort: Effort) -> Vec<Case> {
    let groups = [
        stiff::cases(),
        isovalue::cases(),
        scale::cases(),
        geometry::cases(),
        sizes::cases(effort),
    ];
    groups.into_iter().flatten().collect()
}
