//! Isovalues at and beside special values.

use super::shapes::{checkerboard, distance, gyroid, hash};
use crate::suite::case::{Case, Volume};

const GROUP: &str = "isovalue";

pub fn cases() -> Vec<Case> {
    vec![
        Case::new(GROUP, "equal to samples", [18, 21, 15], |p| 1.0 + (4.0 * hash(p, 11)).floor())
            .exact()
            .at(&[1.0, 2.0, 3.0, 4.0]),
        Case::new(GROUP, "one ulp beside samples", [18, 21, 15], |p| {
            1.0 + (4.0 * hash(p, 13)).floor()
        })
        .exact()
        .at(&[2f32.next_up(), 2f32.next_down(), 1f32.next_up(), 4f32.next_down()]),
        plateau("equal to a plateau", &[2.0]),
        plateau("one ulp beside a plateau", &[2f32.next_up(), 2f32.next_down()]),
        Case::new(GROUP, "a block's least and largest value", [22, 19, 24], gyroid)
            .at_decoded(|volume| block_range(volume, [2, 1, 3]).to_vec()),
        Case::new(GROUP, "one ulp beside a block's least and largest value", [22, 19, 24], gyroid)
            .at_decoded(|volume| {
                let beside = |v: f32| [v.next_down(), v.next_up()];
                block_range(volume, [2, 1, 3]).into_iter().flat_map(beside).collect()
            }),
        Case::new(GROUP, "a constant volume", [13, 14, 15], |_| 2.5)
            .exact()
            .at(&[2.5, 2.5f32.next_up(), 2.5f32.next_down(), -2.5])
            .none_hit(),
        Case::new(GROUP, "outside the range of values", [18, 17, 16], gyroid)
            .at(&[4.0, -4.0, 1e30, -1e30])
            .none_hit(),
        Case::new(GROUP, "+0 and -0 through a field with zeros", [17, 15, 19], |p| {
            (3.0 * hash(p, 17)).floor() - 1.0
        })
        .at(&[0.0, -0.0]),
        Case::new(GROUP, "+0 and -0 on a volume of zeros", [9, 9, 9], |[x, ..]| {
            if x == 4.0 { -0.0 } else { 0.0 }
        })
        .at(&[0.0, -0.0])
        .none_hit(),
        Case::new(GROUP, "+1 and -1 on a checkerboard of them", [12, 13, 14], checkerboard)
            .exact()
            .at(&[1.0, -1.0, 1f32.next_down()]),
    ]
}

/// A ball whose top is cut off: half of its samples are exactly 2.
fn plateau(name: &str, isovalues: &[f32]) -> Case {
    Case::new(GROUP, name, [21, 22, 23], |p| {
        (12.0 - distance(p, [10.2, 10.7, 11.1])).clamp(1.0, 2.0)
    })
    .at(isovalues)
}

/// Least and largest sample of a block and the samples that its cells share with the next ones.
fn block_range(volume: &Volume, block: [u32; 3]) -> [f32; 2] {
    macrocell::cpu::ranges::block_range(volume.dims, &volume.samples, block)
}
