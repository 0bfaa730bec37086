//! What the published network computes, layer by layer.

/// Channels of the feature maps at 1, 1/2, 1/4 and 1/8 of the resolution.
pub const CHANNELS: [usize; 4] = [4, 8, 16, 32];

/// Maps that live beside the output: at every level the features that the decoder reads again, what lies between two
/// convolutions, and the decoder's features, which the next frame reads.
///
/// The filters follow the last convolution and keep their pictures in the first two.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Map {
    /// Features of the encoder; then the picture on the way down.
    Skip(usize),
    /// Between two convolutions; then the picture on the way up.
    Between(usize),
    /// Features of the decoder. Level 3 has none.
    State(usize),
    /// The filled picture.
    Output,
}

/// What a layer reads beside its weights.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Reads {
    /// The caller's picture.
    Picture,
    /// A map of the same resolution.
    Same(Map),
    /// A map of twice the resolution, averaged.
    Pooled(Map),
    /// A map of this resolution, one of half the resolution, enlarged, and the state of the previous frame.
    Joined {
        /// Of this resolution.
        skip: Map,
        /// Of half the resolution.
        low: Map,
        /// Of the previous frame.
        state: Map,
    },
}

/// What a filter reads beside the features that its kernels come from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Filters {
    /// The colours that the features give.
    Colors,
    /// The picture of twice the resolution, averaged.
    Pooled(Map),
    /// The picture of half the resolution, enlarged, and the one of the way down.
    Enlarged {
        /// Of half the resolution.
        low: Map,
        /// Of the way down.
        same_level: Map,
    },
}

/// What a step computes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// A 3x3 convolution and its ReLU.
    Convolution(Reads),
    /// A filter whose kernels are predicted from the features of a map.
    Filter(Map, Filters),
}

/// One dispatch.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Step {
    /// Name of its tensors: `<name>.weight`, `<name>.bias`.
    pub(super) name: String,
    /// What it computes.
    pub(super) kind: Kind,
    /// How often its maps are halved.
    pub(super) level: usize,
    /// Channels that the weights take.
    pub(super) inputs: usize,
    /// Channels, or taps, that they give.
    pub(super) outputs: usize,
    /// Where the result goes.
    pub(super) target: Map,
}

impl Step {
    /// The maps that it reads, in the order of the kernel's bindings.
    pub(super) fn reads(&self) -> Vec<Map> {
        match self.kind {
            Kind::Convolution(Reads::Picture) => vec![],
            Kind::Convolution(Reads::Same(map) | Reads::Pooled(map)) => vec![map],
            Kind::Convolution(Reads::Joined { skip, low, state }) => vec![low, skip, state],
            Kind::Filter(features, Filters::Colors) => vec![features],
            Kind::Filter(features, Filters::Pooled(map)) => vec![features, map],
            Kind::Filter(features, Filters::Enlarged { low, same_level }) => {
                vec![features, low, same_level]
            }
        }
    }
}

/// Tensors of the layer that makes colours.
pub(super) const RGB: &str = "rgb";

fn convolution(name: String, level: usize, inputs: usize, reads: Reads, target: Map) -> Step {
    let kind = Kind::Convolution(reads);
    Step { name, kind, level, inputs, outputs: CHANNELS[level], target }
}

fn encoder(level: usize) -> [Step; 2] {
    let (inputs, reads) = match level {
        0 => (3, Reads::Picture),
        _ => (CHANNELS[level - 1], Reads::Pooled(Map::Skip(level - 1))),
    };
    let between = Map::Between(level);
    let second = Reads::Same(between);
    [
        convolution(format!("enc{level}.0"), level, inputs, reads, between),
        convolution(format!("enc{level}.1"), level, CHANNELS[level], second, Map::Skip(level)),
    ]
}

/// The map with the features of a level: the bottleneck has no decoder.
fn features(level: usize) -> Map {
    if level == 3 { Map::Skip(3) } else { Map::State(level) }
}

fn decoder(level: usize) -> [Step; 2] {
    let (between, state) = (Map::Between(level), Map::State(level));
    let first = Reads::Joined { skip: Map::Skip(level), low: features(level + 1), state };
    let inputs = 2 * CHANNELS[level] + CHANNELS[level + 1];
    [
        convolution(format!("dec{level}.0"), level, inputs, first, between),
        convolution(format!("dec{level}.1"), level, CHANNELS[level], Reads::Same(between), state),
    ]
}

fn down(level: usize) -> Step {
    let filters = if level == 0 { Filters::Colors } else { Filters::Pooled(Map::Skip(level - 1)) };
    Step {
        name: format!("down{level}"),
        kind: Kind::Filter(features(level), filters),
        level,
        inputs: CHANNELS[level],
        outputs: 9,
        // The bottleneck's features are still read when its picture is made.
        target: if level == 3 { Map::Between(3) } else { Map::Skip(level) },
    }
}

fn up(level: usize) -> Step {
    let filters = Filters::Enlarged { low: Map::Between(level + 1), same_level: Map::Skip(level) };
    Step {
        name: format!("up{level}"),
        kind: Kind::Filter(Map::State(level), filters),
        level,
        inputs: CHANNELS[level],
        outputs: 10,
        target: if level == 0 { Map::Output } else { Map::Between(level) },
    }
}

/// All steps of a frame in order.
pub(super) fn steps() -> Vec<Step> {
    let mut steps: Vec<Step> = (0..4).flat_map(encoder).collect();
    steps.extend((0..3).rev().flat_map(decoder));
    steps.extend((0..4).map(down));
    steps.extend((0..3).rev().map(up));
    steps
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_step_writes_what_it_reads() {
        for step in steps() {
            assert!(!step.reads().contains(&step.target), "{step:?}");
        }
    }

    #[test]
    fn it_is_as_large_as_published() {
        let count = |step: &Step| {
            let taps = if matches!(step.kind, Kind::Convolution(_)) { 9 } else { 1 };
            step.outputs * (step.inputs * taps + 1)
        };
        let rgb = 3 * (CHANNELS[0] + 1);
        assert_eq!(steps().iter().map(count).sum::<usize>() + rgb, 34_593);
    }
}
