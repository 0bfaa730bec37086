//! Arithmetic that the generators share: additions, multiplications, divisions and square roots
//! only, which IEEE 754 rounds the same way everywhere, so that a generator gives the same bits on
//! every platform. (The sine of the standard library comes from the platform and may differ in the
//! last digit.)

use std::f64::consts::TAU;
use std::ops::{Add, Mul, Neg, Sub};

/// A number that a formula is evaluated on: an `f64` for the value alone, a [`Jet`] for the value
/// with its gradient. Every formula is written once over this trait, so value and gradient cannot
/// disagree.
pub(crate) trait Real:
    Copy + From<f64> + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Neg<Output = Self>
{
    /// The value without its derivative.
    fn value(self) -> f64;
    /// The function applied to this number, given its value and derivative here.
    fn chain(self, value: f64, derivative: f64) -> Self;

    fn scale(self, factor: f64) -> Self {
        self.chain(self.value() * factor, factor)
    }

    fn plus(self, term: f64) -> Self {
        self.chain(self.value() + term, 1.0)
    }

    /// Square root; zero at zero, where the derivative is taken as zero too.
    fn sqrt(self) -> Self {
        let root = self.value().sqrt();
        self.chain(root, if root > 0.0 { 0.5 / root } else { 0.0 })
    }

    /// sin(2 pi x) and cos(2 pi x)
    fn sin_cos_turns(self) -> (Self, Self) {
        let (sin, cos) = sin_cos_turns(self.value());
        (self.chain(sin, TAU * cos), self.chain(cos, -TAU * sin))
    }

    /// 6x^5 - 15x^4 + 10x^3 on [0, 1], 0 below and 1 above: two continuous derivatives.
    fn smoothstep(self) -> Self {
        let x = self.value().clamp(0.0, 1.0);
        let value = x * x * x * (x * (x * 6.0 - 15.0) + 10.0);
        let slope = x * (1.0 - x);
        self.chain(value, 30.0 * slope * slope)
    }
}

impl Real for f64 {
    fn value(self) -> f64 {
        self
    }

    fn chain(self, value: f64, _derivative: f64) -> Self {
        value
    }
}

/// A value and its exact gradient with respect to the position (forward differentiation).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Jet {
    value: f64,
    pub(crate) gradient: [f64; 3],
}

impl Jet {
    /// The three coordinates of a position, each with its unit gradient.
    pub(crate) fn position(p: [f64; 3]) -> [Jet; 3] {
        [
            Jet { value: p[0], gradient: [1.0, 0.0, 0.0] },
            Jet { value: p[1], gradient: [0.0, 1.0, 0.0] },
            Jet { value: p[2], gradient: [0.0, 0.0, 1.0] },
        ]
    }

    fn zip(self, other: Jet, value: f64, f: impl Fn(f64, f64) -> f64) -> Jet {
        let (a, b) = (self.gradient, other.gradient);
        Jet { value, gradient: [f(a[0], b[0]), f(a[1], b[1]), f(a[2], b[2])] }
    }
}

impl Real for Jet {
    fn value(self) -> f64 {
        self.value
    }

    fn chain(self, value: f64, derivative: f64) -> Self {
        Jet { value, gradient: self.gradient.map(|g| g * derivative) }
    }
}

impl From<f64> for Jet {
    fn from(value: f64) -> Self {
        Jet { value, gradient: [0.0; 3] }
    }
}

impl Add for Jet {
    type Output = Jet;
    fn add(self, other: Jet) -> Jet {
        self.zip(other, self.value + other.value, |a, b| a + b)
    }
}

impl Sub for Jet {
    type Output = Jet;
    fn sub(self, other: Jet) -> Jet {
        self.zip(other, self.value - other.value, |a, b| a - b)
    }
}

impl Mul for Jet {
    type Output = Jet;
    #[allow(clippy::suspicious_arithmetic_impl, reason = "the product rule is a sum")]
    fn mul(self, other: Jet) -> Jet {
        let product_rule = |a: f64, b: f64| (a * other.value) + (self.value * b);
        self.zip(other, self.value * other.value, product_rule)
    }
}

impl Neg for Jet {
    type Output = Jet;
    fn neg(self) -> Jet {
        self.chain(-self.value, -1.0)
    }
}

/// Ratios of consecutive terms of the Taylor series of sine and cosine, last term first.
const TERM_RATIOS: [(f64, f64); 8] = {
    let mut ratios = [(0.0, 0.0); 8];
    let mut k = 0;
    while k < 8 {
        let n = (16 - 2 * k) as f64;
        ratios[k] = (1.0 / (n * (n + 1.0)), 1.0 / (n * (n - 1.0)));
        k += 1;
    }
    ratios
};

/// Sine and cosine of 2 pi x: exact reduction to an eighth of a turn, then the Taylor series (next
/// term below 1e-16).
pub(crate) fn sin_cos_turns(x: f64) -> (f64, f64) {
    let t = x - (x + 0.5).floor();
    let quarter = (t * 4.0 + 0.5).floor();
    let r = (t - quarter * 0.25) * TAU;
    let r2 = r * r;
    let mut sin = 1.0;
    let mut cos = 1.0;
    for (sin_ratio, cos_ratio) in TERM_RATIOS {
        sin = 1.0 - sin * (r2 * sin_ratio);
        cos = 1.0 - cos * (r2 * cos_ratio);
    }
    sin *= r;
    match quarter as i32 {
        0 => (sin, cos),
        1 => (cos, -sin),
        -1 => (-cos, sin),
        _ => (-sin, -cos),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn sine_and_cosine_agree_with_the_standard_library(x in -50.0..50.0_f64) {
            let (sin, cos) = sin_cos_turns(x);
            // The reference loses digits in its own argument 2 pi x.
            prop_assert!((sin - (TAU * x).sin()).abs() < 2e-13);
            prop_assert!((cos - (TAU * x).cos()).abs() < 2e-13);
            prop_assert!((sin * sin + cos * cos - 1.0).abs() < 1e-15);
        }

        #[test]
        fn a_jet_carries_the_value_of_plain_arithmetic(p in prop::array::uniform3(-3.0..3.0_f64)) {
            fn formula<T: Real>(p: [T; 3]) -> T {
                (p[0] * p[1] - p[2].sin_cos_turns().0).plus(0.25) * p[1].smoothstep()
                    + (p[0] * p[0] + p[2] * p[2]).sqrt().scale(1.5)
            }
            prop_assert_eq!(formula(p), formula(Jet::position(p)).value());
        }
    }

    #[test]
    fn quarter_turns_are_exact() {
        for (x, expected) in [
            (0.0, (0.0, 1.0)),
            (0.25, (1.0, 0.0)),
            (0.5, (0.0, -1.0)),
            (-0.25, (-1.0, 0.0)),
            (7.0, (0.0, 1.0)),
            (-3.75, (1.0, 0.0)),
        ] {
            assert_eq!(sin_cos_turns(x), expected, "{x} turns");
        }
    }

    #[test]
    fn the_smooth_step_is_flat_outside_the_unit_interval() {
        assert_eq!([-1.0, 0.0, 0.5, 1.0, 9.0].map(Real::smoothstep), [0.0, 0.0, 0.5, 1.0, 1.0]);
        let outside = Jet { value: 1.5, gradient: [1.0; 3] }.smoothstep();
        assert_eq!(outside.gradient, [0.0; 3]);
    }
}
