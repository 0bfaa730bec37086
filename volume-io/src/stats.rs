//! What a volume holds: value range, histogram and a suggested isovalue, from one block at a time.

use crate::volume::{Block, ZfpVolume};

/// Smallest and largest sample of some blocks; none if they hold no sample inside the volume.
pub fn value_range(blocks: impl IntoIterator<Item = Block>) -> Option<[f32; 2]> {
    let mut range: Option<[f32; 2]> = None;
    for block in blocks {
        for (_, value) in block.voxels() {
            let [min, max] = range.unwrap_or([value; 2]);
            range = Some([min.min(value), max.max(value)]);
        }
    }
    range
}

/// Counts of samples in equal intervals of a value range.
#[derive(Clone, Debug, PartialEq)]
pub struct Histogram {
    range: [f32; 2],
    counts: Vec<u64>,
}

impl Histogram {
    /// An empty histogram with `bins` intervals (at least 1) from `range[0]` to `range[1]`.
    #[must_use]
    pub fn new(range: [f32; 2], bins: usize) -> Self {
        Self { range, counts: vec![0; bins.max(1)] }
    }

    /// Counts the samples of some blocks. Values outside the range go to the first or last bin.
    pub fn add_blocks(&mut self, blocks: impl IntoIterator<Item = Block>) {
        for block in blocks {
            for (_, value) in block.voxels() {
                self.add(value);
            }
        }
    }

    /// Counts one value. One outside the range goes to the first or last bin.
    pub fn add(&mut self, value: f32) {
        let [min, max] = self.range.map(f64::from);
        let bins = self.counts.len();
        // Saturating, also from NaN where the range is empty.
        let bin = ((f64::from(value) - min) / (max - min) * bins as f64) as usize;
        if let Some(count) = self.counts.get_mut(bin.min(bins - 1)) {
            *count += 1;
        }
    }

    /// Number of values per bin.
    #[must_use]
    pub fn counts(&self) -> &[u64] {
        &self.counts
    }

    /// Lower end of the first bin and upper end of the last.
    #[must_use]
    pub fn range(&self) -> [f32; 2] {
        self.range
    }

    /// Number of values counted.
    #[must_use]
    pub fn total(&self) -> u64 {
        self.counts.iter().sum()
    }

    /// An isovalue between the two classes of values that differ most, by Otsu's rule: of all
    /// borders between bins, the one with the largest variance between the values below and
    /// those above (the middle of them, if several are equal). The middle of the range if all
    /// values lie in one bin.
    #[must_use]
    pub fn suggested_isovalue(&self) -> f32 {
        let [min, max] = self.range.map(f64::from);
        let bins = self.counts.len() as f64;
        let (first, last) = self.best_borders().unwrap_or((bins / 2.0, bins / 2.0));
        (min + (max - min) * (first + last) / 2.0 / bins) as f32
    }

    /// First and last border with the largest variance between classes, counted in bins.
    fn best_borders(&self) -> Option<(f64, f64)> {
        let weight = |(bin, &count): (usize, &u64)| bin as f64 * count as f64;
        let total = self.total() as f64;
        let sum: f64 = self.counts.iter().enumerate().map(weight).sum();
        let (mut below, mut below_sum) = (0.0, 0.0);
        let (mut best, mut borders) = (0.0, None);
        for (bin, count) in self.counts.iter().enumerate() {
            below += *count as f64;
            below_sum += weight((bin, count));
            let above = total - below;
            if below == 0.0 || above <= 0.0 {
                continue;
            }
            let distance = below_sum / below - (sum - below_sum) / above;
            let variance = below * above * distance * distance;
            let border = (bin + 1) as f64;
            if variance > best {
                (best, borders) = (variance, Some((border, border)));
            } else if variance == best {
                borders = borders.map(|(first, _)| (first, border));
            }
        }
        borders
    }
}

impl ZfpVolume {
    /// Smallest and largest decoded sample; decodes the volume once.
    #[must_use]
    pub fn value_range(&self) -> [f32; 2] {
        value_range(self.decoded_blocks()).unwrap_or([0.0; 2])
    }

    /// Histogram of the decoded samples over their range; decodes the volume twice.
    #[must_use]
    pub fn histogram(&self, bins: usize) -> Histogram {
        let mut histogram = Histogram::new(self.value_range(), bins);
        histogram.add_blocks(self.decoded_blocks());
        histogram
    }
}
