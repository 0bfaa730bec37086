//! Twins of `shader/reduce.wgsl` and `shader/spread.wgsl`: the picture at half its resolution, and its colours in the picture.

use wavefront::cpu::frame::RayStates;
use wavefront::{FrameParams, RayOrder};

/// The pixels of a picture of `size` that one of the reduced picture stands for, in the order of their rays.
pub fn pixels(place: [u32; 2], size: [u32; 2]) -> impl Iterator<Item = [u32; 2]> {
    (0..4)
        .map(move |child| [2 * place[0] + (child & 1), 2 * place[1] + (child >> 1)])
        .filter(move |pixel| pixel[0] < size[0] && pixel[1] < size[1])
}

/// The words of the reduced picture's rays from those of a frame's: a ray is active if those of all of its pixels are, and
/// has the state of the first one. `None` for a picture that is too small.
#[must_use]
pub fn rays(frame: &FrameParams, words: &[u32]) -> Option<Vec<u32>> {
    let size = frame.size();
    let (states, order) = (RayStates::new(frame, words), RayOrder::new(size).preview(2)?);
    let (header, numbers) = (RayStates::bytes(0) as usize / 4, order.numbers() as usize);
    let mut reduced = words[..header].to_vec();
    reduced.extend((0..numbers).map(|number| words[header + 4 * number]));
    reduced.resize(header + numbers + numbers / 32, 0);
    for number in 0..numbers {
        let mut own = pixels(order.pixel(number as u32), size).peekable();
        if own.peek().is_some() && own.all(|pixel| states.is_active(pixel)) {
            reduced[header + numbers + number / 32] |= 1 << (number % 32);
        }
    }
    Some(reduced)
}

/// Colour of a pixel between the middles of the reduced picture's pixels, whose colours `color` gives, clamped at the
/// edges; `crisp`: that of its own.
pub fn color(color: impl Fn([i64; 2]) -> [f32; 3], pixel: [u32; 2], crisp: bool) -> [f32; 3] {
    let place = pixel.map(|p| i64::from(p / 2));
    let [dx, dy] = pixel.map(|p| if p % 2 == 0 { -1 } else { 1 });
    let own = color(place);
    if crisp {
        return own;
    }
    let beside = color([place[0] + dx, place[1]]);
    let below = color([place[0], place[1] + dy]);
    let across = color([place[0] + dx, place[1] + dy]);
    std::array::from_fn(|i| 0.5625 * own[i] + 0.1875 * (beside[i] + below[i]) + 0.0625 * across[i])
}
