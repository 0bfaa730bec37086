//! Twin of `shader/upscale.wgsl`: colours of the pixels between a preview's.

/// The colour of the picture's pixel `cell`, counted from the preview's pixel before it in both directions, of whose pixels one
/// lies every `step`. `corners`: the preview's pixel, the next one to its right, below, and both.
#[must_use]
pub fn color(corners: [[f32; 4]; 4], cell: [u32; 2], step: u32, crisp: bool) -> [f32; 4] {
    let [x, y] = cell.map(|c| if crisp { 0.0 } else { c as f32 / step as f32 });
    std::array::from_fn(|i| {
        let upper = corners[0][i] + x * (corners[1][i] - corners[0][i]);
        let lower = corners[2][i] + x * (corners[3][i] - corners[2][i]);
        upper + y * (lower - upper)
    })
}
