//! How far predictions are off, and which of that is to be learned.

/// Typical error before any was seen, and how much the newest counts.
const FIRST_SPREAD: f64 = 0.05;
const SPREAD_RATE: f64 = 0.1;
/// The least that counts as typical, so that the first errors after many without any are not all surprises.
const LEAST_SPREAD: f64 = 0.01;
/// An error counts as at most as many typical ones.
const MOST_SPREADS: f64 = 3.0;
/// As many typical errors, with what is expected of something as new, are a surprise.
const SURPRISE: f64 = 2.0;
/// How much of the newest error the drift takes in, and how much of it stays from frame to frame, since the model learns, too.
const DRIFT_RATE: f64 = 0.3;
const DRIFT_KEPT: f64 = 0.9;
/// What is newer than this says little about the machine.
const MOST_NOVELTY: f64 = 0.2;

/// Errors of predictions, as logarithms of times over predicted ones.
#[derive(Clone, Copy, Debug)]
pub(super) struct Errors {
    /// Mean size of the newest ones, less what was to be expected of something new and without what stands out.
    spread: f64,
    /// The newest one, if it was a surprise.
    surprise: Option<f64>,
    /// What the newest ones have in common.
    drift: f64,
}

impl Default for Errors {
    fn default() -> Self {
        Self { spread: FIRST_SPREAD, surprise: None, drift: 0.0 }
    }
}

impl Errors {
    /// Typical size.
    pub(super) fn spread(&self) -> f64 {
        self.spread
    }

    /// How much slower the machine is than the model knows yet, as a logarithm; to be added to predictions.
    pub(super) fn drift(&self) -> f64 {
        self.drift
    }

    /// Takes in the error of a prediction that was as new as `novelty`, 0 to 1; returns how much of it is to be learned: of
    /// a surprise as much as was to be expected, since it may be another process's, or as much as there was of the
    /// surprise before it, if that was in the same direction.
    pub(super) fn take(&mut self, error: f64, novelty: f64) -> f64 {
        let expected = SURPRISE * (self.spread + novelty);
        let counted = (error.abs() - novelty).clamp(0.0, MOST_SPREADS * self.spread);
        // What is new says little about what is known.
        self.spread += SPREAD_RATE * (1.0 - novelty) * (counted - self.spread);
        self.spread = self.spread.max(LEAST_SPREAD);
        let learned = self.learned(error, expected);
        let taken = if novelty < MOST_NOVELTY { DRIFT_RATE * learned } else { 0.0 };
        self.drift = DRIFT_KEPT * (self.drift + taken);
        learned
    }

    fn learned(&mut self, error: f64, expected: f64) -> f64 {
        let before = self.surprise.take().filter(|before| before * error > 0.0);
        if error.abs() <= expected {
            return error;
        }
        self.surprise = Some(error);
        let most = before.map_or(expected, |before| expected.max(before.abs()));
        error.clamp(-most, most)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::budget::noise;

    #[test]
    fn the_spread_is_that_of_most_errors() {
        let (mut errors, mut random) = (Errors::default(), noise(5));
        for i in 0..2000 {
            // Mean size 0.02; every tenth is of another kind.
            let usual = 0.08 * random() - 0.04;
            errors.take(if i % 10 == 0 { 2.0 } else { usual }, 0.0);
            if i > 100 {
                let spread = errors.spread();
                assert!((0.014..0.045).contains(&spread), "seed 5, error {i}: {spread}");
            }
        }
    }

    #[test]
    fn the_spread_rises_from_nothing() {
        let mut errors = Errors::default();
        for _ in 0..500 {
            errors.take(0.0, 0.0);
        }
        for i in 0..20 {
            errors.take(if i % 2 == 0 { 0.1 } else { -0.1 }, 0.0);
        }
        assert!((0.05..=0.1).contains(&errors.spread()), "{}", errors.spread());
    }

    #[test]
    fn a_surprise_is_learned_when_it_comes_again() {
        let mut errors = Errors::default();
        let expected = 2.0 * (FIRST_SPREAD + 0.1);
        assert!((errors.take(1.0, 0.1) - expected).abs() < 1e-12);
        assert!((errors.take(0.8, 0.0) - 0.8).abs() < 1e-12);
        // And of a larger one as much as before, from one frame to the next.
        assert!((errors.take(2.0, 0.0) - 0.8).abs() < 1e-12);
        assert!((errors.take(3.0, 0.0) - 2.0).abs() < 1e-12);
        // The other way it is new.
        let expected = 2.0 * errors.spread();
        assert!((errors.take(-0.8, 0.0) + expected).abs() < 1e-12);
        // What was to be expected ends it.
        let usual = 0.5 * errors.spread();
        assert!((errors.take(usual, 0.0) - usual).abs() < 1e-12);
        assert!(errors.take(-0.8, 0.0) > -0.8);
    }

    #[test]
    fn errors_in_one_direction_are_a_drift() {
        let mut errors = Errors::default();
        // The machine is slower by 0.2 from now on, and the model does not learn it.
        for _ in 0..12 {
            let error = 0.2 - errors.drift();
            errors.take(error, 0.0);
        }
        assert!((0.1..0.2).contains(&errors.drift()), "{}", errors.drift());
        // What is new says nothing about it.
        let before = errors.drift();
        errors.take(2.0, 0.9);
        assert!((errors.drift() - DRIFT_KEPT * before).abs() < 1e-12);
        // Once it has learned it, nothing is left.
        for _ in 0..30 {
            let error = -errors.drift();
            errors.take(error, 0.0);
        }
        assert!(errors.drift().abs() < 1e-3, "{}", errors.drift());
    }
}
