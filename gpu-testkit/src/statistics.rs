//! Quantiles and Pareto fronts of what was measured.

/// The value that a share of the values does not exceed, by nearest rank: the ceil(share n)-th
/// smallest of n, the smallest for share 0. `None` without values.
///
/// # Panics
/// Unless `share` is from 0 to 1.
#[must_use]
pub fn quantile(values: &[f64], share: f64) -> Option<f64> {
    assert!((0.0..=1.0).contains(&share), "a share of {share}");
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let rank = (share * sorted.len() as f64).ceil() as usize;
    sorted.get(rank.max(1) - 1).copied()
}

/// Indices of the points that no other point beats, by growing cost: a point beats another if it
/// has no more of either cost and less of one. Of equal points the first one counts; points with a
/// NaN never do.
#[must_use]
pub fn pareto_front(points: &[[f64; 2]]) -> Vec<usize> {
    let mut order: Vec<usize> =
        (0..points.len()).filter(|&i| points[i].iter().all(|cost| !cost.is_nan())).collect();
    let by_cost = |&i: &usize, &j: &usize| {
        points[i][0].total_cmp(&points[j][0]).then(points[i][1].total_cmp(&points[j][1]))
    };
    order.sort_by(by_cost);
    let mut least = f64::INFINITY;
    let mut front: Vec<usize> = Vec::new();
    for i in order {
        if front.is_empty() || points[i][1] < least {
            least = points[i][1];
            front.push(i);
        }
    }
    front
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn quantiles_are_values_of_their_rank() {
        let values = [5.0, 1.0, 4.0, 2.0, 3.0];
        for (share, expected) in
            [(0.0, 1.0), (0.2, 1.0), (0.21, 2.0), (0.5, 3.0), (0.8, 4.0), (0.81, 5.0), (1.0, 5.0)]
        {
            assert_eq!(quantile(&values, share), Some(expected), "{share}");
        }
        assert_eq!(quantile(&[], 0.5), None);
        assert_eq!(quantile(&[1.0, f64::INFINITY], 0.99), Some(f64::INFINITY));
    }

    #[test]
    #[should_panic(expected = "a share of 1.5")]
    fn shares_beyond_one_are_refused() {
        let _value = quantile(&[1.0], 1.5);
    }

    #[test]
    fn beaten_points_are_not_on_the_front() {
        let points = [[3.0, 3.0], [1.0, 5.0], [2.0, 4.0], [2.0, 6.0], [4.0, 3.0], [5.0, 1.0]];
        assert_eq!(pareto_front(&points), [1, 2, 0, 5]);
        assert_eq!(pareto_front(&[[1.0, f64::INFINITY], [2.0, 7.0]]), [0, 1]);
        assert_eq!(pareto_front(&[[1.0, 1.0], [1.0, 1.0]]), [0]);
        assert_eq!(pareto_front(&[[f64::NAN, 0.0], [1.0, f64::NAN]]), [] as [usize; 0]);
    }

    fn beats(a: [f64; 2], b: [f64; 2]) -> bool {
        a[0] <= b[0] && a[1] <= b[1] && a != b
    }

    proptest! {
        #![proptest_config(crate::property(200))]

        #[test]
        fn the_front_is_what_nothing_beats(
            points in proptest::collection::vec([0..8u8, 0..8u8], 0..40),
        ) {
            let points: Vec<[f64; 2]> = points.iter().map(|p| p.map(f64::from)).collect();
            let front = pareto_front(&points);
            prop_assert!(front.windows(2).all(|w| points[w[0]][0] < points[w[1]][0]));
            for (i, &point) in points.iter().enumerate() {
                let best = !points.iter().any(|&other| beats(other, point));
                let first = points.iter().position(|&other| other == point) == Some(i);
                prop_assert_eq!(front.contains(&i), best && first, "point {}", i);
            }
        }
    }
}
