//! Comparisons of numbers that name the first difference.

use std::fmt;

/// Where two slices first differ.
#[derive(Clone, Debug, PartialEq)]
pub struct Mismatch {
    /// Index of the first differing element, or the shorter length when only the lengths differ.
    pub index: usize,
    /// How many elements differ; elements that only one slice has count too.
    pub count: usize,
    /// What was found and expected there.
    pub detail: String,
}

impl fmt::Display for Mismatch {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} elements differ, the first at {}: {}", self.count, self.index, self.detail)
    }
}

impl std::error::Error for Mismatch {}

/// Checks that two slices hold the same bits: `-0.0` differs from `0.0`, a NaN equals itself.
///
/// # Errors
/// The first element that differs, and how many do.
pub fn bits_equal<T: bytemuck::Pod + fmt::Debug>(
    actual: &[T],
    expected: &[T],
) -> Result<(), Mismatch> {
    let differ = |(a, b): (&T, &T)| bytemuck::bytes_of(a) != bytemuck::bytes_of(b);
    check(actual, expected, differ, |a, b| {
        let bits = |value: &T| {
            bytemuck::bytes_of(value).iter().rev().map(|b| format!("{b:02x}")).collect::<String>()
        };
        format!("found {a:?} (0x{}), expected {b:?} (0x{})", bits(a), bits(b))
    })
}

/// Checks that no element is further than `ulps` steps of f32 from the expected one.
///
/// # Errors
/// The first element that is, and how many are.
pub fn within_ulps(actual: &[f32], expected: &[f32], ulps: u32) -> Result<(), Mismatch> {
    let differ = |(a, b): (&f32, &f32)| ulp_distance(*a, *b) > ulps;
    check(actual, expected, differ, |a, b| {
        format!("found {a:?}, expected {b:?}, {} ulps apart (at most {ulps})", ulp_distance(*a, *b))
    })
}

/// Checks that no element is further than `tolerance` from the expected one.
///
/// # Errors
/// The first element that is, and how many are.
pub fn within_abs(actual: &[f32], expected: &[f32], tolerance: f64) -> Result<(), Mismatch> {
    let differ = |(a, b): (&f32, &f32)| abs_distance(*a, *b) > tolerance;
    check(actual, expected, differ, |a, b| {
        format!(
            "found {a:?}, expected {b:?}, {:e} apart (at most {tolerance:e})",
            abs_distance(*a, *b)
        )
    })
}

/// Steps of f32 between two numbers: 0 for equal numbers (`-0.0` and `0.0` are equal), 1 for
/// neighbours, `u32::MAX` when exactly one is NaN.
#[must_use]
pub fn ulp_distance(a: f32, b: f32) -> u32 {
    match (a.is_nan(), b.is_nan()) {
        (true, true) => 0,
        (false, false) => ordered(a).abs_diff(ordered(b)),
        _ => u32::MAX,
    }
}

/// The largest [`ulp_distance`] and where it is first found; `None` for empty slices.
///
/// # Panics
/// When the lengths differ.
#[must_use]
pub fn max_ulp_distance(actual: &[f32], expected: &[f32]) -> Option<(usize, u32)> {
    largest(actual, expected, ulp_distance)
}

/// The largest |actual - expected| and where it is first found; `None` for empty slices. A NaN
/// against a number counts as infinite.
///
/// # Panics
/// When the lengths differ.
#[must_use]
pub fn max_abs_distance(actual: &[f32], expected: &[f32]) -> Option<(usize, f64)> {
    largest(actual, expected, abs_distance)
}

fn abs_distance(a: f32, b: f32) -> f64 {
    if a == b || (a.is_nan() && b.is_nan()) {
        return 0.0;
    }
    let distance = (f64::from(a) - f64::from(b)).abs();
    if distance.is_nan() { f64::INFINITY } else { distance }
}

/// Maps f32 to integers in the same order, both zeros to 0.
fn ordered(x: f32) -> i32 {
    let magnitude = (x.to_bits() & 0x7FFF_FFFF) as i32;
    if x.is_sign_negative() { -magnitude } else { magnitude }
}

fn largest<D: PartialOrd + Copy>(
    actual: &[f32],
    expected: &[f32],
    distance: impl Fn(f32, f32) -> D,
) -> Option<(usize, D)> {
    assert_eq!(actual.len(), expected.len(), "slices of different lengths");
    let mut found: Option<(usize, D)> = None;
    for (index, (a, b)) in actual.iter().zip(expected).enumerate() {
        let distance = distance(*a, *b);
        if found.is_none_or(|(_, largest)| distance > largest) {
            found = Some((index, distance));
        }
    }
    found
}

fn check<T>(
    actual: &[T],
    expected: &[T],
    differ: impl Fn((&T, &T)) -> bool,
    describe: impl Fn(&T, &T) -> String,
) -> Result<(), Mismatch> {
    let mut differing =
        actual.iter().zip(expected).enumerate().filter(|(_, (a, b))| differ((a, b)));
    let extra = actual.len().abs_diff(expected.len());
    let lengths = || format!("{} elements instead of {}", actual.len(), expected.len());
    match differing.next() {
        None if extra == 0 => Ok(()),
        None => Err(Mismatch {
            index: actual.len().min(expected.len()),
            count: extra,
            detail: lengths(),
        }),
        Some((index, (a, b))) => {
            let mut detail = describe(a, b);
            if extra > 0 {
                detail = format!("{detail}; {}", lengths());
            }
            Err(Mismatch { index, count: 1 + differing.count() + extra, detail })
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn equal_slices_pass_and_one_corrupted_element_fails() {
        let expected = [1.0f32, -2.5, 0.0, f32::NAN];
        bits_equal(&expected, &expected).unwrap();
        within_ulps(&expected, &expected, 0).unwrap();
        within_abs(&expected, &expected, 0.0).unwrap();
        for index in 0..expected.len() {
            let mut actual = expected;
            actual[index] = 7.0;
            assert_eq!(bits_equal(&actual, &expected).unwrap_err().index, index);
            assert_eq!(within_ulps(&actual, &expected, 9).unwrap_err().index, index);
            assert_eq!(within_abs(&actual, &expected, 0.5).unwrap_err().index, index);
            assert_eq!(max_ulp_distance(&actual, &expected).unwrap().0, index);
            assert_eq!(max_abs_distance(&actual, &expected).unwrap().0, index);
        }
    }

    #[test]
    fn signs_of_zero_are_different_bits() {
        let problem = bits_equal(&[0.0f32, -0.0], &[0.0, 0.0]).unwrap_err();
        assert_eq!((problem.index, problem.count), (1, 1));
        assert!(problem.to_string().contains("0x80000000"), "{problem}");
        within_ulps(&[-0.0], &[0.0], 0).unwrap();
    }

    #[test]
    fn lengths_count() {
        let problem = bits_equal(&[1u32, 2], &[1, 2, 3]).unwrap_err();
        assert_eq!((problem.index, problem.count), (2, 1));
        let problem = bits_equal(&[1u32, 9, 3], &[1]).unwrap_err();
        assert_eq!((problem.index, problem.count), (1, 2));
        let problem = bits_equal(&[4u32, 9, 3], &[1]).unwrap_err();
        assert_eq!((problem.index, problem.count), (0, 3));
    }

    #[test]
    fn tolerances_are_inclusive() {
        let (a, b) = (1.0f32, 1.0 + 4.0 * f32::EPSILON);
        within_ulps(&[a], &[b], 4).unwrap();
        assert!(within_ulps(&[a], &[b], 3).is_err());
        within_abs(&[1.0], &[1.5], 0.5).unwrap();
        assert!(within_abs(&[1.0], &[1.5], 0.499).is_err());
        assert_eq!(max_abs_distance(&[1.0, f32::NAN], &[1.5, 0.0]), Some((1, f64::INFINITY)));
        assert_eq!(max_abs_distance(&[f32::INFINITY], &[f32::INFINITY]), Some((0, 0.0)));
        assert_eq!(max_ulp_distance(&[], &[]), None);
    }

    proptest! {
        #[test]
        fn neighbours_are_one_ulp_apart(x in proptest::num::f32::NORMAL) {
            let above = x.next_up();
            prop_assert_eq!(ulp_distance(x, above), 1);
            prop_assert_eq!(ulp_distance(x, x), 0);
            prop_assert_eq!(ulp_distance(x, f32::NAN), u32::MAX);
            prop_assert_eq!(ulp_distance(x, -x), 2 * ulp_distance(x, 0.0));
        }
    }
}
