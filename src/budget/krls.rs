//! Kernel recursive least squares: regression from examples that arrive one by one (Y. Engel, S. Mannor, R. Meir, The Kernel
//! Recursive Least-Squares Algorithm, 2004), with approximate linear dependence as the test for what is new, a
//! bounded dictionary and numbers that change with time.

/// Variance that the dictionary must leave to an example for it to join: more than noise leaves to one that is there.
const LEAST_NOVELTY: f64 = 0.055;
/// Most examples in the dictionary; further ones change its weights only.
const CAPACITY: usize = 64;
/// Added to the kernel's diagonal: variance of the examples' noise, a time's relative to that of what is learned.
const NOISE: f64 = 0.05;
/// Variance of what all numbers have in common, so that far from all examples their mean is predicted.
const COMMON: f64 = 4.0;
/// Variance of how numbers grow with a linear feature, wherever they are: for logarithms of costs, about a factor of two.
const GROWTH: f64 = 0.5;
const _: () = assert!(LEAST_NOVELTY > NOISE);
/// Variance by which what belongs to an example may change with every new one, relative to that of the noise: older ones count
/// less and less.
const CHANGE: f64 = 1e-3;

/// What a number belongs to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Features<const N: usize, const L: usize> {
    /// Numbers are alike where all of these are; each is scaled so that a difference of 1 is a large one.
    pub(crate) local: [f64; N],
    /// Numbers grow with these; from 0 to 1.
    pub(crate) linear: [f64; L],
}

/// Predicts a number from `N` local features and `L` linear ones.
#[derive(Clone, Debug, Default)]
pub(crate) struct Krls<const N: usize, const L: usize> {
    dictionary: Vec<Features<N, L>>,
    /// Inverse of the dictionary's kernel matrix, row by row.
    inverse: Vec<f64>,
    /// Covariance of the weights, row by row.
    covariance: Vec<f64>,
    weights: Vec<f64>,
}

/// A constant, a product of the linear features and a Gaussian of width 1 of the local ones.
fn kernel<const N: usize, const L: usize>(a: &Features<N, L>, b: &Features<N, L>) -> f64 {
    let square: f64 = a.local.iter().zip(&b.local).map(|(a, b)| (a - b).powi(2)).sum();
    COMMON + GROWTH * dot(&a.linear, &b.linear) + (-0.5 * square).exp()
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// A symmetric matrix times a vector.
fn times(matrix: &[f64], vector: &[f64]) -> Vec<f64> {
    matrix.chunks_exact(vector.len().max(1)).map(|row| dot(row, vector)).collect()
}

/// The matrix with another row and column.
fn grown(matrix: &[f64], size: usize, border: impl Fn(usize) -> f64, corner: f64) -> Vec<f64> {
    let mut grown = Vec::with_capacity((size + 1) * (size + 1));
    for row in 0..size {
        grown.extend_from_slice(&matrix[row * size..(row + 1) * size]);
        grown.push(border(row));
    }
    grown.extend((0..size).map(border));
    grown.push(corner);
    grown
}

impl<const N: usize, const L: usize> Krls<N, L> {
    /// The expected number, and how new the features are: the variance that examples leave, from that of their noise to 1
    /// far away from all that was learned.
    pub(crate) fn predict(&self, features: &Features<N, L>) -> (f64, f64) {
        let k = self.kernels(features);
        let novelty = kernel(features, features) - dot(&k, &times(&self.inverse, &k));
        (dot(&k, &self.weights), novelty.clamp(0.0, 1.0))
    }

    /// Learns that `features` go with `value`.
    pub(crate) fn learn(&mut self, features: &Features<N, L>, value: f64) {
        let k = self.kernels(features);
        let a = times(&self.inverse, &k);
        let novelty = kernel(features, features) - dot(&k, &a);
        let error = value - dot(&k, &self.weights);
        if novelty > LEAST_NOVELTY && self.dictionary.len() < CAPACITY {
            self.join(features, &a, novelty + NOISE, error);
        } else {
            self.correct(&a, error);
        }
    }

    fn kernels(&self, features: &Features<N, L>) -> Vec<f64> {
        self.dictionary.iter().map(|known| kernel(known, features)).collect()
    }

    fn join(&mut self, features: &Features<N, L>, a: &[f64], novelty: f64, error: f64) {
        let size = self.dictionary.len();
        let mut inverse = self.inverse.clone();
        for row in 0..size {
            for column in 0..size {
                inverse[row * size + column] += a[row] * a[column] / novelty;
            }
        }
        self.inverse = grown(&inverse, size, |i| -a[i] / novelty, 1.0 / novelty);
        self.covariance = grown(&self.covariance, size, |_| 0.0, 1.0);
        for (weight, a) in self.weights.iter_mut().zip(a) {
            *weight -= a * error / novelty;
        }
        self.weights.push(error / novelty);
        self.dictionary.push(*features);
    }

    fn correct(&mut self, a: &[f64], error: f64) {
        let size = a.len();
        let pa = times(&self.covariance, a);
        let divisor = 1.0 + dot(a, &pa);
        let gain: Vec<f64> = pa.iter().map(|pa| pa / divisor).collect();
        for row in 0..size {
            for column in 0..size {
                let entry = &mut self.covariance[row * size + column];
                *entry -= gain[row] * pa[column];
            }
            self.covariance[row * size + row] += CHANGE;
        }
        for (weight, change) in self.weights.iter_mut().zip(times(&self.inverse, &gain)) {
            *weight += change * error;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::budget::noise;

    fn at<const N: usize>(local: [f64; N]) -> Features<N, 0> {
        Features { local, linear: [] }
    }

    fn cost([x, y]: [f64; 2]) -> f64 {
        (1.3 * x).sin() + 0.5 * y * y
    }

    #[test]
    fn a_smooth_function_is_learned_from_noisy_examples() {
        let (mut random, mut model) = (noise(1), Krls::<2, 0>::default());
        for _ in 0..2000 {
            let place = [4.0 * random() - 2.0, 4.0 * random() - 2.0];
            model.learn(&at(place), cost(place) + 0.05 * (random() - 0.5));
        }
        for _ in 0..200 {
            let place = [3.0 * random() - 1.5, 3.0 * random() - 1.5];
            let (found, novelty) = model.predict(&at(place));
            assert!((found - cost(place)).abs() < 0.1, "{place:?}: {found} for {}", cost(place));
            assert!(novelty < 0.1, "{place:?}: {novelty}");
        }
    }

    #[test]
    fn novelty_is_1_far_away_and_0_where_something_was_learned() {
        let mut model = Krls::<2, 0>::default();
        assert_eq!(model.predict(&at([0.0, 0.0])), (0.0, 1.0));
        model.learn(&at([0.0, 0.0]), 3.0);
        let (found, novelty) = model.predict(&at([0.0, 0.0]));
        assert!((found - 3.0).abs() < 3.0 * NOISE && novelty < NOISE, "{found} {novelty}");
        // Most of what is known far away is what all numbers have in common.
        let (found, novelty) = model.predict(&at([9.0, 0.0]));
        assert!(novelty > 0.999 && (found - 3.0 * COMMON / (1.0 + COMMON)).abs() < 0.1, "{found}");
        assert!(found > 2.0, "{found}");
    }

    #[test]
    fn the_dictionary_is_bounded_and_numbers_stay_finite() {
        let (mut random, mut model) = (noise(2), Krls::<2, 0>::default());
        for i in 0..10_000 {
            // Long stretches at one place, then a wide field.
            let wide = if i % 1000 < 700 { 0.0 } else { 40.0 };
            let place = [wide * random(), wide * random()];
            model.learn(&at(place), cost(place.map(|v| v / 20.0)));
            assert!(model.dictionary.len() <= CAPACITY);
        }
        let numbers = model.covariance.iter().chain(&model.inverse).chain(&model.weights);
        for number in numbers {
            assert!(number.abs() < 1e6, "{number}");
        }
        let (found, _) = model.predict(&at([0.0, 0.0]));
        assert!((found - cost([0.0, 0.0])).abs() < 0.1, "{found}");
    }

    #[test]
    fn what_changes_is_learned_again() {
        let mut model = Krls::<1, 0>::default();
        // Long enough for what was learned elsewhere to be uncertain again.
        model.learn(&at([9.0]), 0.0);
        for _ in 0..1500 {
            model.learn(&at([0.5]), 1.0);
        }
        assert_eq!(model.dictionary.len(), 2, "an example joins once");
        for _ in 0..300 {
            model.learn(&at([0.5]), 2.0);
        }
        assert!((model.predict(&at([0.5])).0 - 2.0).abs() < 0.2, "{:?}", model.predict(&at([0.5])));
    }

    #[test]
    fn what_grows_with_a_linear_feature_is_known_where_nothing_was_learned() {
        let (mut random, mut model) = (noise(3), Krls::<1, 2>::default());
        let number = |[a, b]: [f64; 2]| 0.8 * a - 0.5 * b;
        let features = |x, linear| Features { local: [x], linear };
        for _ in 0..200 {
            let share = 0.3 * random();
            let linear = [share, 1.0 - share];
            model.learn(&features(random(), linear), number(linear) + 0.04 * (random() - 0.5));
        }
        for share in [0.5, 0.7, 0.9] {
            let linear = [share, 1.0 - share];
            let (found, _) = model.predict(&features(0.5, linear));
            assert!((found - number(linear)).abs() < 0.1, "{share}: {found} {}", number(linear));
        }
    }
}
