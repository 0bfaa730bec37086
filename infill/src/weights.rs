//! The network's weights.

use std::sync::LazyLock;

use half::f16;
use safetensors::{Dtype, SafeTensors};

use crate::Error;

/// One convolution of the network.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Layer {
    /// Name of its tensors: `<name>.weight`, `<name>.bias`.
    pub name: &'static str,
    /// Channels that it reads.
    pub inputs: usize,
    /// Channels that it makes.
    pub outputs: usize,
    /// Width and height of its kernel.
    pub taps: usize,
}

impl Layer {
    const fn new(name: &'static str, inputs: usize, outputs: usize, taps: usize) -> Self {
        Self { name, inputs, outputs, taps }
    }

    /// Numbers in its weight.
    pub const fn weights(&self) -> usize {
        self.inputs * self.outputs * self.taps * self.taps
    }
}

/// The network's layers, in order: convolutions at a half and at a quarter of the resolution and back, then those of a pixel
/// on its own.
pub const LAYERS: [Layer; 6] = [
    Layer::new("e0", 16, 8, 3),
    Layer::new("e1a", 8, 12, 3),
    Layer::new("e1b", 12, 12, 3),
    Layer::new("d0", 20, 8, 3),
    Layer::new("hidden", 16, 8, 1),
    Layer::new("head", 8, 6, 1),
];

/// Weights of one layer.
#[derive(Clone, Debug, PartialEq)]
pub struct LayerWeights {
    /// `[outputs][inputs][row][column]`, as in `torch.nn.Conv2d`.
    pub weight: Vec<f16>,
    /// One per output.
    pub bias: Vec<f16>,
}

/// Weights of the whole network, in half precision.
#[derive(Clone, Debug, PartialEq)]
pub struct Weights {
    /// In the order of [`LAYERS`].
    layers: Vec<LayerWeights>,
    /// Added to [`crate::DOUBT`].
    doubt: f16,
}

impl Weights {
    /// Numbers in all.
    pub const COUNT: usize = {
        let (mut count, mut i) = (0, 0);
        while i < LAYERS.len() {
            count += LAYERS[i].weights() + LAYERS[i].outputs;
            i += 1;
        }
        count + 1
    };

    /// The trained weights that come with the crate; `infill/training` says how they were made.
    pub fn trained() -> &'static Self {
        static TRAINED: LazyLock<Weights> =
            LazyLock::new(|| Weights::embedded(include_bytes!("../weights/infill.safetensors")));
        &TRAINED
    }

    /// Like [`Self::trained`], trained on the sparse pixels of foveated frames: few neighbours, no rays on their way.
    pub fn trained_sparse() -> &'static Self {
        static TRAINED: LazyLock<Weights> =
            LazyLock::new(|| Weights::embedded(include_bytes!("../weights/sparse.safetensors")));
        &TRAINED
    }

    /// Those of a file of the crate. A test reads it, so that the zeros, with which pixels are filled all the
    /// same, are never needed.
    fn embedded(bytes: &[u8]) -> Self {
        Self::from_safetensors(bytes).unwrap_or_else(|_| Self::zero())
    }

    /// All zero: the filler without a network.
    pub fn zero() -> Self {
        Self::from_fn(|_| 0.0)
    }

    /// From a function of the number's place among all, layer by layer, weight before bias, the doubt last.
    pub fn from_fn(mut value: impl FnMut(usize) -> f32) -> Self {
        let mut place = 0;
        let mut next = |count: usize| {
            place += count;
            (place - count..place).map(|i| f16::from_f32(value(i))).collect::<Vec<_>>()
        };
        let layers = LAYERS
            .iter()
            .map(|layer| LayerWeights { weight: next(layer.weights()), bias: next(layer.outputs) })
            .collect();
        let doubt = next(1)[0];
        Self { layers, doubt }
    }

    /// From a file with the tensors of [`LAYERS`] and one number, `doubt`, as f16 or f32.
    ///
    /// # Errors
    /// If the file is not a safetensors file, or lacks a tensor of the right shape, or holds numbers beyond f16.
    pub fn from_safetensors(bytes: &[u8]) -> Result<Self, Error> {
        let file =
            SafeTensors::deserialize(bytes).map_err(|e| Error::WeightsFile(e.to_string()))?;
        let layers = LAYERS.iter().map(|layer| {
            let Layer { name, inputs, outputs, taps } = *layer;
            Ok(LayerWeights {
                weight: tensor(&file, format!("{name}.weight"), &[outputs, inputs, taps, taps])?,
                bias: tensor(&file, format!("{name}.bias"), &[outputs])?,
            })
        });
        let layers = layers.collect::<Result<_, _>>()?;
        let doubt = tensor(&file, "doubt".into(), &[1])?[0];
        Ok(Self { layers, doubt })
    }

    /// What is added to [`crate::DOUBT`]: -`DOUBT` for neighbours that weigh the same whether they disagree or not.
    pub fn doubt(&self) -> f32 {
        self.doubt.to_f32()
    }

    /// Weights of one of [`LAYERS`].
    pub fn layer(&self, index: usize) -> &LayerWeights {
        &self.layers[index]
    }
}

/// Weights as the kernels read them: pairs of vectors of four halves.
///
/// For every group of four outputs, tap and group of four inputs a vector of inputs for each of the outputs, then the
/// biases. Other channels that fill up a group, and groups of biases that fill up a pair, are 0. The doubt stands behind the last
/// biases.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct PackedWeights {
    pub(crate) vectors: Vec<[f16; 4]>,
}

const fn vectors(layer: Layer) -> u64 {
    let (inputs, outputs) = (layer.inputs.div_ceil(4), layer.outputs.div_ceil(4));
    ((4 * outputs * layer.taps * layer.taps) * inputs + outputs.next_multiple_of(2)) as u64
}

impl PackedWeights {
    /// Bytes of the vectors.
    pub(crate) const BYTES: u64 = {
        let (mut bytes, mut i) = (0, 0);
        while i < LAYERS.len() {
            bytes += 8 * vectors(LAYERS[i]);
            i += 1;
        }
        bytes
    };

    /// First pair of every layer.
    pub(crate) fn first() -> [u32; LAYERS.len()] {
        let mut next = 0;
        LAYERS.map(|layer| {
            let first = next;
            next += vectors(layer) as u32 / 2;
            first
        })
    }

    pub(crate) fn new(weights: &Weights) -> Self {
        let mut packed = Vec::new();
        for (layer, own) in LAYERS.iter().zip(&weights.layers) {
            let taps = layer.taps * layer.taps;
            for group in 0..layer.outputs.div_ceil(4) {
                for tap in 0..taps {
                    for inputs in 0..layer.inputs.div_ceil(4) {
                        for output in 4 * group..4 * group + 4 {
                            packed.push(std::array::from_fn(|i| {
                                let input = 4 * inputs + i;
                                let place = (output * layer.inputs + input) * taps + tap;
                                let is_there = input < layer.inputs && output < layer.outputs;
                                if is_there { own.weight[place] } else { f16::ZERO }
                            }));
                        }
                    }
                }
            }
            for group in 0..layer.outputs.div_ceil(4).next_multiple_of(2) {
                let bias = |i: usize| own.bias.get(4 * group + i).copied().unwrap_or(f16::ZERO);
                packed.push(std::array::from_fn(bias));
            }
        }
        if let Some(last) = packed.last_mut() {
            last[2] = weights.doubt;
        }
        Self { vectors: packed }
    }
}

fn tensor(file: &SafeTensors<'_>, name: String, shape: &[usize]) -> Result<Vec<f16>, Error> {
    let view = file.tensor(&name).map_err(|e| Error::WeightsFile(e.to_string()))?;
    if view.shape() != shape {
        let (expected, found) = (shape.to_vec(), view.shape().to_vec());
        return Err(Error::WeightsShape { name, expected, found });
    }
    let values: Vec<f16> = match view.dtype() {
        Dtype::F16 => {
            view.data().chunks_exact(2).map(|b| f16::from_le_bytes([b[0], b[1]])).collect()
        }
        Dtype::F32 => {
            let value = |b: &[u8]| f16::from_f32(f32::from_le_bytes([b[0], b[1], b[2], b[3]]));
            view.data().chunks_exact(4).map(value).collect()
        }
        found => return Err(Error::WeightsType { name, found: format!("{found:?}") }),
    };
    if values.iter().all(|v| v.is_finite()) {
        Ok(values)
    } else {
        Err(Error::WeightsRange { name })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use safetensors::tensor::TensorView;

    fn file(change: impl Fn(&str, &mut Vec<usize>, &mut Vec<f32>)) -> Vec<u8> {
        let mut tensors = Vec::new();
        for layer in LAYERS {
            let shape = vec![layer.outputs, layer.inputs, layer.taps, layer.taps];
            let count = layer.weights();
            let values = (0..count).map(|i| i as f32 / 64.0).collect();
            tensors.push((format!("{}.weight", layer.name), shape, values));
            tensors.push((
                format!("{}.bias", layer.name),
                vec![layer.outputs],
                vec![0.5; layer.outputs],
            ));
        }
        tensors.push(("doubt".into(), vec![1], vec![-2.5]));
        for (name, shape, values) in &mut tensors {
            change(name, shape, values);
        }
        let bytes: Vec<(String, Vec<usize>, Vec<u8>)> = tensors
            .into_iter()
            .map(|(n, s, v)| (n, s, v.iter().flat_map(|v| v.to_le_bytes()).collect()))
            .collect();
        let views = bytes
            .iter()
            .map(|(n, s, b)| (n.clone(), TensorView::new(Dtype::F32, s.clone(), b).unwrap()));
        safetensors::serialize(views, None).unwrap()
    }

    #[test]
    fn the_network_is_as_large_as_the_documents_say() {
        assert_eq!(Weights::COUNT, 4982 + 1, "and the doubt");
    }

    #[test]
    fn packed_weights_have_their_places() {
        let packed = PackedWeights::new(&Weights::from_fn(|i| (i % 2048) as f32));
        assert_eq!(8 * packed.vectors.len() as u64, PackedWeights::BYTES);
        // Of the first layer: output 2, tap 5, inputs 8 to 11.
        let vector = packed.vectors[(5 * 4 + 2) * 4 + 2].map(f16::to_f32);
        assert_eq!(vector, [8.0, 9.0, 10.0, 11.0].map(|input| (2.0 * 16.0 + input) * 9.0 + 5.0));
        let head = 2 * PackedWeights::first()[5] as usize;
        assert_eq!(packed.vectors.len(), head + 18);
        // Of the head: outputs 4 and 5 for inputs 4 to 7, then two that there are not.
        let first = Weights::COUNT - 1 - 6 - 8 * 6;
        let inputs = |output: usize| {
            let input = |i| f16::from_f32(((first + 8 * output + 4 + i) % 2048) as f32);
            std::array::from_fn(input)
        };
        let none = [f16::ZERO; 4];
        assert_eq!(packed.vectors[head + 12..head + 16], [inputs(4), inputs(5), none, none]);
        let doubt = f16::from_f32(((Weights::COUNT - 1) % 2048) as f32);
        assert_eq!(packed.vectors[head + 17][2..], [doubt, f16::ZERO]);
    }

    #[test]
    fn a_file_gives_its_numbers() {
        let weights = Weights::from_safetensors(&file(|_, _, _| ())).unwrap();
        assert_eq!(weights.layer(0).weight[65].to_f32(), 65.0 / 64.0);
        assert_eq!(weights.layer(5).bias, vec![f16::from_f32(0.5); 6]);
        assert_eq!(weights.doubt(), -2.5);
    }

    #[test]
    fn wrong_files_are_refused() {
        assert!(matches!(Weights::from_safetensors(b"no"), Err(Error::WeightsFile(_))));
        let shape = file(|name, shape, _| {
            if name == "d0.weight" {
                shape.swap(0, 1);
            }
        });
        assert!(matches!(Weights::from_safetensors(&shape), Err(Error::WeightsShape { .. })));
        let range = file(|name, _, values| {
            if name == "d0.bias" {
                values[1] = 1e6;
            }
        });
        assert!(matches!(Weights::from_safetensors(&range), Err(Error::WeightsRange { .. })));
    }

    #[test]
    fn the_trained_weights_are_those_of_the_files() {
        let files: [(&Weights, &[u8]); 2] = [
            (Weights::trained(), include_bytes!("../weights/infill.safetensors")),
            (Weights::trained_sparse(), include_bytes!("../weights/sparse.safetensors")),
        ];
        for (trained, bytes) in files {
            assert_eq!(trained, &Weights::from_safetensors(bytes).unwrap());
            for (i, layer) in LAYERS.iter().enumerate() {
                let weights = &trained.layer(i).weight;
                assert!(weights.iter().any(|w| *w != f16::ZERO), "{}", layer.name);
            }
        }
        assert_ne!(Weights::trained(), Weights::trained_sparse());
    }
}
