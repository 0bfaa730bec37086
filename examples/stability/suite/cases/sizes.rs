//! Sizes of volumes and pictures.

use super::shapes::{distance, gyroid};
use crate::suite::case::{Case, View};
use crate::suite::views::{Effort, looking, orbit, view};

const GROUP: &str = "geometry";

pub fn cases(effort: Effort) -> Vec<Case> {
    let mut cases = flat();
    let volumes =
        [[2, 2, 2], [3, 3, 3], [5, 5, 5], [2, 9, 3], [13, 14, 15], [9, 18, 31], [4, 8, 16]];
    cases.extend(volumes.map(ramp));
    cases.extend([[2048, 5, 6], [5, 2048, 3]].map(long));
    let largest = match effort {
        Effort::Reduced => [8192, 16],
        Effort::Full => [8192, 2048],
    };
    cases.extend([[1, 1], [1, 64], [67, 1], [65, 33], largest].map(picture));
    cases
}

/// Volumes without a dual cell.
fn flat() -> Vec<Case> {
    [[1, 9, 9], [9, 1, 9], [9, 9, 1], [1, 1, 1]]
        .map(|dims| {
            Case::new(GROUP, format!("{dims:?} voxels"), dims, |[x, y, z]| x - y + z).none_hit()
        })
        .into()
}

fn ramp(dims: [u32; 3]) -> Case {
    let middle = dims.map(|n| 0.35 * (f64::from(n) - 1.0));
    let value = |[x, y, z]: [f64; 3]| 0.7 * x + 0.6 * y - 0.8 * z;
    Case::new(GROUP, format!("{dims:?} voxels"), dims, value).at(&[value(middle) as f32])
}

fn long(dims: [u32; 3]) -> Case {
    Case::new(GROUP, format!("{dims:?} voxels"), dims, gyroid).at(&[0.1]).seen(
        |volume, _, effort| {
            let size = effort.size();
            let last = volume.dims.map(|n| f64::from(n) - 1.0);
            vec![
                orbit(volume, [20.0, 30.0], 40.0, size),
                // Along the whole volume.
                looking(volume, [-1.0, -1.0, -1.0], last.map(|v| 0.9 * v), 1.0, size),
                looking(volume, last.map(|v| v + 0.5), last.map(|v| 0.2 * v), 2.0, size),
                looking(volume, last.map(|v| 0.5 * v), last, 90.0, size),
            ]
        },
    )
}

/// Pictures from within a ball: every ray must hit.
fn picture(size: [u32; 2]) -> Case {
    let center = [14.3, 15.1, 13.8];
    let name = format!("a picture of {} x {} pixels", size[0], size[1]);
    Case::new(GROUP, name, [29, 31, 28], move |p| distance(p, center))
        .at(&[11.25])
        .closed()
        .all_hit()
        .seen(move |volume, _, effort| {
            let [a, b] = [[14.0, 15.0, 14.0], [11.0, 17.3, 12.2]];
            let fewest = match effort {
                Effort::Reduced => 2_000,
                Effort::Full => 200_000,
            };
            let pixels = (size[0] * size[1]) as usize;
            let stride = (pixels / fewest).max(1);
            let View { camera, .. } = looking(volume, a, b, 70.0, size);
            vec![View { stride, ..view(camera, size) }]
        })
}
