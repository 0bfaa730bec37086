//! One frame as an EXR picture.

use std::path::Path;

use exr::prelude::{
    AnyChannel, AnyChannels, Encoding, FlatSamples, Image, Layer, LayerAttributes, SmallVec,
    WritableImage, f16,
};

use crate::support::Failure;

/// Names and order of a pixel's numbers: the cut frame, the candidates, the finished frame.
pub const CHANNELS: [&str; 18] = [
    "finished", "c", "nv", "c_P", "nv_P", "c_L", "nv_L", "c_X", "nv_X", "v_R", "c_R", "nv_R",
    "d_L", "d_X", "d_P", "d_R", "truth_c", "truth_nv",
];

/// The numbers of a pixel, in the order of [`CHANNELS`].
pub type Pixel = [f32; CHANNELS.len()];

/// Largest number that half floats hold.
const MOST: f32 = 65504.0;

/// Writes a picture of half floats, one channel for each of [`CHANNELS`].
pub fn write(path: &Path, size: [u32; 2], pixels: &[Pixel]) -> Result<(), Failure> {
    let channel = |index: usize| {
        let half = |pixel: &Pixel| f16::from_f32(pixel[index].clamp(-MOST, MOST));
        AnyChannel::new(CHANNELS[index], FlatSamples::F16(pixels.iter().map(half).collect()))
    };
    let channels: SmallVec<[_; 4]> = (0..CHANNELS.len()).map(channel).collect();
    let layer = Layer::new(
        (size[0] as usize, size[1] as usize),
        LayerAttributes::named("infill"),
        Encoding::FAST_LOSSLESS,
        AnyChannels::sort(channels),
    );
    let image = Image::from_layer(layer);
    image.write().to_file(path).map_err(|e| format!("cannot write {}: {e}", path.display()).into())
}
