//! How many rounds a pass gets, so that no submission takes long.

use wavefront::FrameParams;

use crate::budget::{STEPS, Setting, step_index};

/// Rounds of a pass by measured time.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Schedule {
    /// By the logarithms of a setting's first and last step.
    rounds: [[Rounds; STEPS]; STEPS],
    /// Cells that a walk may visit; `None` before anything was measured.
    most_cells: Option<u32>,
}

/// Rounds of passes of one kind.
#[derive(Debug, Clone, Copy, Default)]
struct Rounds {
    /// Milliseconds that a round took lately; `None` before anything was measured.
    round_ms: Option<f64>,
    /// Rounds in which the first pass of the newest frame had something to do; `None` before there was one.
    first_rounds: Option<u32>,
}

/// Cells of a walk before anything was measured: 64 for each of the 2 million rays that are walked at most, more
/// than most views need. A GPU that visits less than a hundred million cells a second takes longer than a
/// second for it; watchdogs wait for 2 s and more.
pub(crate) const FIRST_CELLS: u32 = 1 << 27;

/// Least cells of a walk: 32 for each of 2 million rays, with which a round of most views still ends.
const LEAST_CELLS: u32 = 1 << 26;

/// How much the bound may change by one measurement.
const LEAST_FACTOR: f64 = 0.25;
const MOST_FACTOR: f64 = 2.0;

/// Part of an older estimate that stays: rounds with few rays left say little about the next frame.
const MEMORY: f64 = 0.7;

impl Schedule {
    /// Rounds of the next pass: at least 1, at most `most`, and no more than fit `pass_ms`. The `first` of a frame
    /// has but one more than the frame before had to do, since every round costs dispatches, empty ones, too.
    pub(crate) fn rounds(&self, setting: Setting, first: bool, most: u32, pass_ms: f32) -> u32 {
        let most = most.max(1);
        if pass_ms == f32::INFINITY {
            return most;
        }
        // A pass of one round comes first, so that something is measured.
        let [i, j] = places(setting);
        let Rounds { round_ms, first_rounds } = self.rounds[i][j];
        let fitting = round_ms.map_or(1.0, |ms| f64::from(pass_ms) / ms.max(1e-3)) as u32;
        let needed = first_rounds.filter(|_| first).map_or(u32::MAX, |n| n.saturating_add(1));
        fitting.min(needed).clamp(1, most)
    }

    /// Cells that the walks of the next frame may visit each.
    pub(crate) fn most_cells(&self) -> u32 {
        self.most_cells.unwrap_or(FIRST_CELLS)
    }

    /// Takes in that rounds with the bound in force took `round_ms` each and rays were cut short by it: the
    /// next frame's bound is what would take `pass_ms`.
    pub(crate) fn calibrate(&mut self, round_ms: f64, pass_ms: f32) {
        let factor = f64::from(pass_ms) / round_ms.max(1e-3);
        if round_ms.is_finite() && !factor.is_nan() {
            let cells = f64::from(self.most_cells()) * factor.clamp(LEAST_FACTOR, MOST_FACTOR);
            self.most_cells = Some((cells as u32).clamp(LEAST_CELLS, FrameParams::MOST_CELLS));
        }
    }

    /// Takes in what a pass took that had something to do in `rounds` rounds; `first`: of a frame.
    pub(crate) fn take(&mut self, setting: Setting, first: bool, rounds: u32, ms: f64) {
        let [i, j] = places(setting);
        let own = &mut self.rounds[i][j];
        if first {
            own.first_rounds = Some(rounds);
        }
        if rounds > 0 && ms.is_finite() {
            let newest = ms / f64::from(rounds);
            let before = own.round_ms.unwrap_or(0.0);
            own.round_ms = Some(newest.max(MEMORY * before));
        }
    }
}

fn places(setting: Setting) -> [usize; 2] {
    [setting.first, setting.last].map(step_index)
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALL: Setting = Setting::ALL;

    #[test]
    fn the_bound_of_a_walk_follows_the_time_it_takes() {
        let mut schedule = Schedule::default();
        assert_eq!(schedule.most_cells(), FIRST_CELLS);
        schedule.calibrate(60.0, 30.0);
        assert_eq!(schedule.most_cells(), FIRST_CELLS / 2);
        schedule.calibrate(1e9, 30.0);
        assert_eq!(schedule.most_cells(), LEAST_CELLS);
        schedule.calibrate(f64::NAN, 30.0);
        schedule.calibrate(1.0, f32::NAN);
        schedule.calibrate(30.0, 30.0);
        assert_eq!(schedule.most_cells(), LEAST_CELLS);
        for _ in 0..40 {
            schedule.calibrate(0.0, f32::INFINITY);
        }
        assert_eq!(schedule.most_cells(), FrameParams::MOST_CELLS);
    }

    #[test]
    fn rounds_follow_the_time_they_take() {
        let mut schedule = Schedule::default();
        assert_eq!(schedule.rounds(ALL, false, 8, 30.0), 1);
        assert_eq!(schedule.rounds(ALL, false, 8, f32::INFINITY), 8);
        schedule.take(ALL, false, 1, 10.0);
        assert_eq!(schedule.rounds(ALL, false, 8, 30.0), 3);
        schedule.take(ALL, false, 3, 300.0);
        assert_eq!(schedule.rounds(ALL, false, 8, 30.0), 1);
        for _ in 0..20 {
            schedule.take(ALL, false, 1, 0.01);
        }
        assert_eq!(
            (schedule.rounds(ALL, false, 8, 30.0), schedule.rounds(ALL, false, 0, 30.0)),
            (8, 1)
        );
        schedule.take(ALL, false, 0, 1e9);
        schedule.take(ALL, false, 1, f64::NAN);
        assert_eq!(schedule.rounds(ALL, false, 8, 30.0), 8);
        assert_eq!(schedule.rounds(ALL, false, 8, f32::NAN), 1);
    }

    #[test]
    fn first_passes_grow_by_a_round_from_frame_to_frame() {
        let mut schedule = Schedule::default();
        schedule.take(ALL, true, 1, 0.1);
        assert_eq!(schedule.rounds(ALL, true, 8, 30.0), 2);
        assert_eq!(schedule.rounds(ALL, false, 8, 30.0), 8);
        assert_eq!(schedule.rounds(ALL, true, 8, f32::INFINITY), 8);
        schedule.take(ALL, true, 2, 0.1);
        schedule.take(ALL, false, 1, 0.1);
        assert_eq!(schedule.rounds(ALL, true, 8, 30.0), 3);
        schedule.take(ALL, true, 0, 0.1);
        assert_eq!(schedule.rounds(ALL, true, 8, 30.0), 1);
        schedule.take(ALL, true, u32::MAX, 0.1);
        assert_eq!(schedule.rounds(ALL, true, 8, 30.0), 8);
    }

    #[test]
    fn previews_have_times_of_their_own() {
        let mut schedule = Schedule::default();
        schedule.take(Setting { first: 4, last: 4, share: 0.0625 }, true, 1, 1.0);
        assert_eq!(schedule.rounds(ALL, false, 8, 30.0), 1, "nothing is known of full pictures");
        schedule.take(ALL, true, 1, 10.0);
        let of =
            |first, last| schedule.rounds(Setting { first, last, share: 0.0625 }, false, 8, 30.0);
        assert_eq!([of(4, 4), of(4, 2), of(1, 1)], [8, 1, 3]);
    }
}
