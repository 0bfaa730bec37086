//! How many rounds a pass gets, so that no submission takes long.

/// Rounds of a pass by measured time.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Schedule {
    /// Milliseconds that a round took lately; `None` before anything was measured.
    round_ms: Option<f64>,
}

/// Part of an older estimate that stays: rounds with few rays left say little about the next frame.
const MEMORY: f64 = 0.7;

impl Schedule {
    /// Rounds of the next pass: at least 1, at most `most`, and no more than fit `pass_ms`.
    pub(crate) fn rounds(&self, most: u32, pass_ms: f32) -> u32 {
        let most = most.max(1);
        if pass_ms == f32::INFINITY {
            return most;
        }
        // A pass of one round comes first, so that something is measured.
        let fitting = self.round_ms.map_or(1.0, |ms| f64::from(pass_ms) / ms.max(1e-3));
        (fitting as u32).clamp(1, most)
    }

    /// Takes in what a pass of `rounds` rounds took.
    pub(crate) fn take(&mut self, rounds: u32, ms: f64) {
        if rounds > 0 && ms.is_finite() {
            let newest = ms / f64::from(rounds);
            let before = self.round_ms.unwrap_or(0.0);
            self.round_ms = Some(newest.max(MEMORY * before));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounds_follow_the_time_they_take() {
        let mut schedule = Schedule::default();
        assert_eq!(schedule.rounds(8, 30.0), 1);
        assert_eq!(schedule.rounds(8, f32::INFINITY), 8);
        schedule.take(1, 10.0);
        assert_eq!(schedule.rounds(8, 30.0), 3);
        schedule.take(3, 300.0);
        assert_eq!(schedule.rounds(8, 30.0), 1);
        for _ in 0..20 {
            schedule.take(1, 0.01);
        }
        assert_eq!((schedule.rounds(8, 30.0), schedule.rounds(0, 30.0)), (8, 1));
        schedule.take(0, 1e9);
        schedule.take(1, f64::NAN);
        assert_eq!(schedule.rounds(8, 30.0), 8);
        assert_eq!(schedule.rounds(8, f32::NAN), 1);
    }
}
