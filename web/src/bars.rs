//! The histogram as the page draws it behind the slider.

/// Heights of the bars, 0 to 1. The counts' logarithms, or else the many voxels of the background
/// would flatten everything else; a bin with a single value still shows.
#[must_use]
pub fn heights(counts: &[u64]) -> Vec<f32> {
    let height = |count: u64| (1.0 + count as f64).ln();
    let most = counts.iter().copied().max().map_or(0.0, height);
    counts.iter().map(|&c| if most > 0.0 { (height(c) / most) as f32 } else { 0.0 }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_highest_bar_is_1_and_order_stays() {
        let heights = heights(&[0, 1, 1000, 50, 1000]);
        assert_eq!(heights[0], 0.0);
        assert_eq!([heights[2], heights[4]], [1.0, 1.0]);
        assert!(heights[1] > 0.05 && heights[1] < heights[3] && heights[3] < 1.0);
    }

    #[test]
    fn nothing_has_no_height() {
        assert!(heights(&[]).is_empty());
        assert_eq!(heights(&[0, 0]), [0.0, 0.0]);
    }
}
