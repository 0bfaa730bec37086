//! The field along a straight line through one dual cell, as a cubic polynomial.

/// `c[0] + c[1] s + c[2] s^2 + c[3] s^3`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Cubic {
    c: [f64; 4],
}

impl Cubic {
    /// The trilinear interpolant of eight corners along the line from `a` (`s = 0`) to `b`
    /// (`s = 1`), both in cell coordinates.
    pub(super) fn along(corners: &[f64; 8], a: [f64; 3], b: [f64; 3]) -> Self {
        // For each axis, the weights of its lower and upper corners as (constant, slope) in s.
        let weights: [[(f64, f64); 2]; 3] = std::array::from_fn(|axis| {
            let slope = b[axis] - a[axis];
            [(1.0 - a[axis], -slope), (a[axis], slope)]
        });
        let mut c = [0.0; 4];
        for (n, corner) in corners.iter().enumerate() {
            let factors = [weights[0][n & 1], weights[1][n >> 1 & 1], weights[2][n >> 2]];
            for (sum, term) in c.iter_mut().zip(product(factors)) {
                *sum += corner * term;
            }
        }
        Self { c }
    }

    pub(super) fn value(&self, s: f64) -> f64 {
        let [c0, c1, c2, c3] = self.c;
        c0 + s * (c1 + s * (c2 + s * c3))
    }

    /// Roots of the derivative strictly between 0 and 1, in order.
    pub(super) fn extrema(&self) -> Vec<f64> {
        let [_, c1, c2, c3] = self.c;
        let mut roots = quadratic_roots(3.0 * c3, 2.0 * c2, c1);
        roots.retain(|s| *s > 0.0 && *s < 1.0);
        roots.sort_by(f64::total_cmp);
        roots.dedup();
        roots
    }
}

/// The product of three linear polynomials, constant term first.
fn product(factors: [(f64, f64); 3]) -> [f64; 4] {
    let [(a0, a1), (b0, b1), (c0, c1)] = factors;
    let square = [a0 * b0, a0 * b1 + a1 * b0, a1 * b1];
    [
        square[0] * c0,
        square[1] * c0 + square[0] * c1,
        square[2] * c0 + square[1] * c1,
        square[2] * c1,
    ]
}

/// Real roots of `a x^2 + b x + c`. The two roots come from the one sum without cancellation; a
/// vanishing coefficient yields an infinity or NaN, which no caller's range contains.
fn quadratic_roots(a: f64, b: f64, c: f64) -> Vec<f64> {
    let discriminant = b * b - 4.0 * a * c;
    if discriminant < 0.0 {
        return Vec::new();
    }
    let q = -0.5 * (b + discriminant.sqrt().copysign(b));
    vec![q / a, c / q]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quadratics_with_known_roots() {
        let mut roots = quadratic_roots(2.0, -3.0, 1.0);
        roots.sort_by(f64::total_cmp);
        assert_eq!(roots, [0.5, 1.0]);
        assert!(quadratic_roots(1.0, 0.0, 1.0).is_empty());
        assert_eq!(quadratic_roots(0.0, 4.0, -1.0)[1], 0.25, "a line has one root");
    }

    #[test]
    fn an_axis_runs_from_corner_to_corner() {
        let corners = [1.0, 5.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
        let cubic = Cubic::along(&corners, [0.0; 3], [1.0, 0.0, 0.0]);
        assert_eq!(cubic, Cubic { c: [1.0, 4.0, 0.0, 0.0] });
    }

    #[test]
    fn the_diagonal_of_one_raised_corner_is_a_cube() {
        let corners = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 8.0];
        let cubic = Cubic::along(&corners, [0.0; 3], [1.0; 3]);
        assert_eq!(cubic, Cubic { c: [0.0, 0.0, 0.0, 8.0] });
        assert_eq!(cubic.value(0.5), 1.0);
        assert!(cubic.extrema().is_empty());
    }

    #[test]
    fn extrema_lie_strictly_inside() {
        let cubic = Cubic { c: [0.0, 0.54, -1.5, 1.0] };
        let extrema = cubic.extrema();
        assert_eq!(extrema.len(), 2);
        for s in extrema {
            assert!((3.0 * s * s - 3.0 * s + 0.54).abs() < 1e-15);
        }
    }
}
