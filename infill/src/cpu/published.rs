//! Twin of the published network's kernels: dense, tensor by tensor as the authors' graph has it.

use crate::published::{CHANNELS, PublishedWeights};

/// Added to the features before kernels are predicted from them, and to the filled picture.
const FLOOR: f32 = 1e-7;

/// Channels of numbers, one channel after the other, rows from the top.
#[derive(Clone, Debug, PartialEq)]
pub struct Planes {
    size: [usize; 2],
    channels: Vec<Vec<f32>>,
}

impl Planes {
    /// All zero.
    pub fn zero(size: [usize; 2], channels: usize) -> Self {
        Self { size, channels: vec![vec![0.0; size[0] * size[1]]; channels] }
    }

    /// From a function of channel, x and y.
    pub fn from_fn(
        size: [usize; 2],
        channels: usize,
        f: impl Fn(usize, usize, usize) -> f32,
    ) -> Self {
        let plane = |c| (0..size[0] * size[1]).map(|i| f(c, i % size[0], i / size[0])).collect();
        Self { size, channels: (0..channels).map(plane).collect() }
    }

    /// One number.
    pub fn at(&self, channel: usize, x: usize, y: usize) -> f32 {
        self.channels[channel][x + self.size[0] * y]
    }

    /// One number of the 3x3 around a texel, zero beyond the edges.
    fn tap(&self, channel: usize, x: usize, y: usize, tap: usize) -> f32 {
        let (x, y) = (x + tap % 3, y + tap / 3);
        let inside = x > 0 && y > 0 && x <= self.size[0] && y <= self.size[1];
        if inside { self.at(channel, x - 1, y - 1) } else { 0.0 }
    }

    fn pooled(&self) -> Self {
        Self::from_fn(self.size.map(|s| s / 2), self.channels.len(), |c, x, y| {
            let at = |dx, dy| self.at(c, 2 * x + dx, 2 * y + dy);
            0.25 * (at(0, 0) + at(1, 0) + at(0, 1) + at(1, 1))
        })
    }

    /// Bilinear interpolation at twice the size between texel middles, clamped at the edges.
    fn enlarged(&self) -> Self {
        let place = |finer: usize, size: usize| {
            let position = ((finer as f32 + 0.5) / 2.0 - 0.5).max(0.0);
            let low = position as usize;
            (low, (low + 1).min(size - 1), position - low as f32)
        };
        Self::from_fn(self.size.map(|s| 2 * s), self.channels.len(), |c, x, y| {
            let (x0, x1, sx) = place(x, self.size[0]);
            let (y0, y1, sy) = place(y, self.size[1]);
            let row = |y| self.at(c, x0, y) * (1.0 - sx) + self.at(c, x1, y) * sx;
            row(y0) * (1.0 - sy) + row(y1) * sy
        })
    }

    fn joined<const N: usize>(maps: [&Self; N]) -> Self {
        let channels = maps.iter().flat_map(|m| m.channels.iter().cloned()).collect();
        Self { size: maps[0].size, channels }
    }

    fn plus(mut self, value: f32) -> Self {
        self.channels.iter_mut().flatten().for_each(|v| *v += value);
        self
    }
}

/// Features of the decoder that the next frame reads, by level.
pub type State = [Planes; 3];

/// The network with its weights.
#[derive(Clone, Copy, Debug)]
pub struct Published<'a>(pub &'a PublishedWeights);

impl Published<'_> {
    /// The state of a first frame of `size` pixels, a multiple of 8.
    pub fn initial_state(size: [usize; 2]) -> State {
        [0, 1, 2].map(|level| Planes::zero(size.map(|s| s >> level), CHANNELS[level]))
    }

    /// A matrix or a convolution of `taps` numbers per input.
    fn layer(&self, name: &str, map: &Planes, taps: usize) -> Planes {
        let weight = self.0.tensor(&format!("{name}.weight"));
        let bias = self.0.tensor(&format!("{name}.bias"));
        let inputs = map.channels.len();
        Planes::from_fn(map.size, bias.len(), |output, x, y| {
            let mut sum = bias[output];
            for (input, tap) in (0..inputs).flat_map(|i| (0..taps).map(move |t| (i, t))) {
                let value = if taps == 9 { map.tap(input, x, y, tap) } else { map.at(input, x, y) };
                sum += weight[(output * inputs + input) * taps + tap] * value;
            }
            sum
        })
    }

    fn relu(&self, name: &str, map: &Planes, taps: usize) -> Planes {
        let mut map = self.layer(name, map, taps);
        map.channels.iter_mut().flatten().for_each(|v| *v = v.max(0.0));
        map
    }

    fn pair(&self, name: &str, map: &Planes) -> Planes {
        self.relu(&format!("{name}.1"), &self.relu(&format!("{name}.0"), map, 9), 9)
    }

    /// Every texel's own kernel over `picture`, the tenth tap on `same_level`.
    fn filtered(
        &self,
        name: &str,
        features: &Planes,
        picture: &Planes,
        same_level: Option<&Planes>,
    ) -> Planes {
        let kernels = self.layer(name, &features.clone().plus(FLOOR), 1);
        Planes::from_fn(picture.size, 3, |c, x, y| {
            let (mut sum, mut total) = (0.0, 0.0);
            for tap in 0..kernels.channels.len() {
                let square = kernels.at(tap, x, y).powi(2);
                let value = match (tap, same_level) {
                    (9, Some(map)) => map.at(c, x, y),
                    _ => picture.tap(c, x, y, tap),
                };
                sum += square * value;
                total += square;
            }
            sum / total
        })
    }

    /// Fills a picture of 3 channels; changes the state to that for the next frame.
    pub fn fill(&self, picture: &Planes, state: &mut State) -> Planes {
        let mut skips = vec![self.pair("enc0", picture)];
        for level in 1..4 {
            skips.push(self.pair(&format!("enc{level}"), &skips[level - 1].pooled()));
        }
        for level in (0..3).rev() {
            let low = if level == 2 { &skips[3] } else { &state[level + 1] };
            let joined = Planes::joined([&skips[level], &low.enlarged(), &state[level]]);
            state[level] = self.pair(&format!("dec{level}"), &joined);
        }
        let mut down =
            vec![self.filtered("down0", &state[0], &self.relu("rgb", &state[0], 1), None)];
        for level in 1..4 {
            let features = if level == 3 { &skips[3] } else { &state[level] };
            let filtered =
                self.filtered(&format!("down{level}"), features, &down[level - 1].pooled(), None);
            down.push(filtered);
        }
        let mut up = down[3].clone();
        for level in (0..3).rev() {
            up = self.filtered(
                &format!("up{level}"),
                &state[level],
                &up.enlarged(),
                Some(&down[level]),
            );
        }
        up.plus(FLOOR)
    }
}
