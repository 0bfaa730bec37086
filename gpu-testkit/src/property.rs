//! Property tests that can be repeated.

use std::hash::{BuildHasher as _, RandomState};

use proptest::test_runner::{Config, RngSeed};

/// `cases` runs, or `PROPTEST_CASES`, whose seed is printed when one fails and taken from
/// `PROPTEST_RNG_SEED` to repeat it.
#[expect(clippy::print_stdout, reason = "the test harness shows it when the test fails")]
pub fn property(cases: u32) -> Config {
    let mut config = Config { failure_persistence: None, ..Config::default() };
    if std::env::var_os("PROPTEST_CASES").is_none() {
        config.cases = cases;
    }
    let seed = match config.rng_seed {
        RngSeed::Fixed(seed) => seed,
        RngSeed::Random => RandomState::new().hash_one(cases),
    };
    println!("PROPTEST_RNG_SEED={seed}");
    config.rng_seed = RngSeed::Fixed(seed);
    config
}
