//! Weights of the published network.

use std::collections::BTreeMap;

use safetensors::{Dtype, SafeTensors};

use super::layers::{CHANNELS, Kind, RGB, Step, steps};
use crate::Error;

/// Channels of an element of a feature map.
const GROUP: usize = 4;

/// Weights as `infill/training/convert_published.py` writes them, by name.
#[derive(Clone, Debug, PartialEq)]
pub struct PublishedWeights {
    tensors: BTreeMap<String, Vec<f32>>,
}

/// Where a step's weights lie, in units of 16 bytes.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct PackedWeights {
    /// The numbers in the order in which the kernels read them.
    pub(super) values: Vec<[f32; GROUP]>,
    /// First of every step's weights.
    pub(super) first: Vec<u32>,
    /// First of the weights that make colours.
    pub(super) rgb: u32,
}

/// Shape of a step's weight.
fn shape(step: &Step) -> [usize; 4] {
    let taps = if matches!(step.kind, Kind::Convolution(_)) { 3 } else { 1 };
    [step.outputs, step.inputs, taps, taps]
}

/// Names and shapes of all weights; a bias has the first number of its weight's shape.
fn shapes() -> Vec<(String, [usize; 4])> {
    let mut shapes: Vec<_> = steps().iter().map(|s| (s.name.clone(), shape(s))).collect();
    shapes.push((RGB.to_owned(), [3, CHANNELS[0], 1, 1]));
    shapes
}

impl PublishedWeights {
    /// From a file with all tensors as f32.
    ///
    /// # Errors
    /// If the file is not a safetensors file, or lacks a tensor of the right shape.
    pub fn from_safetensors(bytes: &[u8]) -> Result<Self, Error> {
        let file =
            SafeTensors::deserialize(bytes).map_err(|e| Error::WeightsFile(e.to_string()))?;
        let mut tensors = BTreeMap::new();
        for (name, shape) in shapes() {
            for (name, shape) in
                [(format!("{name}.weight"), &shape[..]), (format!("{name}.bias"), &shape[..1])]
            {
                let values = tensor(&file, &name, shape)?;
                tensors.insert(name, values);
            }
        }
        Ok(Self { tensors })
    }

    /// From a function of a tensor's name and of the place in it.
    pub fn from_fn(value: impl Fn(&str, usize) -> f32) -> Self {
        let fill = |name: String, count: usize| {
            let values = (0..count).map(|i| value(&name, i)).collect();
            (name, values)
        };
        let tensors = shapes().into_iter().flat_map(|(name, shape)| {
            let count = shape.iter().product();
            [fill(format!("{name}.weight"), count), fill(format!("{name}.bias"), shape[0])]
        });
        Self { tensors: tensors.collect() }
    }

    /// The numbers of a tensor, as PyTorch orders them: `[output][input][row][column]`. Empty for an unknown name.
    pub fn tensor(&self, name: &str) -> &[f32] {
        self.tensors.get(name).map_or(&[], Vec::as_slice)
    }

    pub(super) fn packed(&self) -> PackedWeights {
        let mut packed = PackedWeights { values: Vec::new(), first: Vec::new(), rgb: 0 };
        for step in steps() {
            packed.first.push(packed.values.len() as u32);
            let columns = match step.kind {
                Kind::Convolution(_) => self.convolution(&step),
                Kind::Filter(..) => self.columns(&step.name, step.inputs, step.outputs),
            };
            packed.values.extend(columns);
        }
        packed.rgb = packed.values.len() as u32;
        packed.values.extend(self.columns(RGB, CHANNELS[0], 3));
        packed
    }

    /// A weight's columns group by group of outputs, of inputs, and tap by tap; then the biases.
    fn convolution(&self, step: &Step) -> Vec<[f32; GROUP]> {
        let (weight, bias) = self.pair(&step.name);
        let mut columns = Vec::new();
        for first in (0..step.outputs).step_by(GROUP) {
            for input_group in (0..step.inputs).step_by(GROUP) {
                for (tap, input) in
                    (0..9).flat_map(|t| (0..GROUP).map(move |i| (t, input_group + i)))
                {
                    let at = |output| ((first + output) * step.inputs + input) * 9 + tap;
                    let known = input < step.inputs;
                    columns.push(std::array::from_fn(|o| if known { weight[at(o)] } else { 0.0 }));
                }
            }
        }
        columns.extend(bias.chunks_exact(GROUP).map(|b| [b[0], b[1], b[2], b[3]]));
        columns
    }

    /// A matrix column by column, each filled up with zeros; then the biases.
    fn columns(&self, name: &str, inputs: usize, outputs: usize) -> Vec<[f32; GROUP]> {
        let (weight, bias) = self.pair(name);
        let mut columns = Vec::new();
        for input in 0..=inputs {
            let value = |output: usize| match () {
                () if output >= outputs => 0.0,
                () if input == inputs => bias[output],
                () => weight[output * inputs + input],
            };
            let groups = (0..outputs).step_by(GROUP);
            columns.extend(groups.map(|first| std::array::from_fn(|o| value(first + o))));
        }
        columns
    }

    fn pair(&self, name: &str) -> (&[f32], &[f32]) {
        (self.tensor(&format!("{name}.weight")), self.tensor(&format!("{name}.bias")))
    }
}

fn tensor(file: &SafeTensors<'_>, name: &str, shape: &[usize]) -> Result<Vec<f32>, Error> {
    let view = file.tensor(name).map_err(|e| Error::WeightsFile(e.to_string()))?;
    let name = name.to_owned();
    if view.shape() != shape {
        let (expected, found) = (shape.to_vec(), view.shape().to_vec());
        return Err(Error::WeightsShape { name, expected, found });
    }
    if view.dtype() != Dtype::F32 {
        return Err(Error::WeightsType { name, found: format!("{:?}", view.dtype()) });
    }
    let value = |b: &[u8]| f32::from_le_bytes([b[0], b[1], b[2], b[3]]);
    Ok(view.data().chunks_exact(4).map(value).collect())
}
