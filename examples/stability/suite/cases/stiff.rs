//! Steep, thin and degenerate surfaces.

use gpu_testkit::reference::{Ray, Scene};

use super::shapes::{checkerboard, distance, gyroid, hash};
use crate::suite::case::{Case, View, Volume};
use crate::suite::views::{self, Effort};

const GROUP: &str = "stiff";

pub fn cases() -> Vec<Case> {
    vec![
        step(),
        sheet("a sheet one voxel thick", |[x, ..]| x == 11.0),
        sheet("a tilted sheet one voxel thick", |[x, y, z]| {
            (x + 0.5 * y + 0.25 * z).floor() == 17.0
        }),
        sheet("voxels of one sign alone in the other", |p| hash(p, 3) < 0.05),
        gradients(),
        grazing(),
        roots("a triple root in a cell", [3.5, 3.5, 3.5]),
        roots("double roots in a cell", [3.5, 3.5, 3.25]),
        roots("three roots in a cell", [3.2, 3.5, 3.75]),
        roots("triple roots on a vertex", [4.0, 4.0, 4.0]),
        saddles(),
        Case::new(GROUP, "several crossings in a cell: noise", [19, 22, 17], |p| {
            2.0 * hash(p, 7) - 1.0
        })
        .at(&[0.0, 0.4]),
        Case::new(GROUP, "checkerboard of +1 and -1", [17, 14, 18], checkerboard)
            .exact()
            .at(&[0.0, 0.5, -0.999]),
        Case::new(GROUP, "noise of +1 and -1", [17, 19, 18], |p| {
            if hash(p, 5) < 0.5 { 1.0 } else { -1.0 }
        })
        .exact()
        .at(&[0.0, 1.0]),
    ]
}

fn step() -> Case {
    Case::new(GROUP, "steps one voxel wide", [25, 21, 23], |[x, y, z]| {
        let stairs = (x / 3.0).floor() + (y / 4.0).floor() + (z / 5.0).floor();
        if stairs < 8.0 { 1.0 } else { -1.0 }
    })
    .at(&[0.0, 0.875])
}

fn sheet(name: &str, on: impl Fn([f64; 3]) -> bool) -> Case {
    Case::new(GROUP, name, [25, 21, 23], move |p| if on(p) { 1.0 } else { -1.0 }).at(&[0.0, 0.9999])
}

/// The gradient grows from 1e-6 to 1e6 per voxel along x, 96 voxels with a factor of 1.33 each.
fn gradients() -> Case {
    let gradient = |x: f64| 10f64.powf(-6.0 + 12.0 * x / 95.0);
    Case::new(GROUP, "gradients from 1e-6 to 1e6 per voxel", [97, 18, 15], move |[x, y, z]| {
        let sum: f64 = (0..x as u32).map(|i| gradient(f64::from(i))).sum();
        sum + 0.3 * gradient(x) * (gyroid([0.0, y, z]) - 1.0)
    })
    .at(&[0.0, 1e-5, 1e-3, 1.0, 1e3, 1e6])
}

/// Rays beside the silhouette of a ball, by shares of its radius; the silhouette is that of the
/// interpolated field, found on the reference.
fn grazing() -> Case {
    let center = [16.3, 15.8, 16.1];
    let radius = 12.25;
    Case::new(
        GROUP,
        "rays that graze a ball within 1e-3 .. 1e-7 of its radius",
        [34, 33, 35],
        move |p| distance(p, center) as f32 as f64,
    )
    .at(&[radius as f32])
    .seen(move |volume, isovalue, effort| {
        let scene = Scene::new(volume.dims, &volume.samples, f64::from(isovalue));
        let mut found = Vec::new();
        for axis in 0..3 {
            let silhouette = silhouette(&scene, center, radius, axis);
            for exponent in 3..=7 {
                let step = radius * 10f64.powi(-exponent) / 16.0;
                found.push(graze(volume, silhouette, axis, step, effort));
            }
        }
        found
    })
    .closed()
}

/// The point on the line from the centre along the next axis at which rays along `axis` begin to miss.
fn silhouette(scene: &Scene<'_>, center: [f64; 3], radius: f64, axis: usize) -> [f64; 3] {
    let point = |r: f64| {
        let mut p = center;
        p[(axis + 1) % 3] += r;
        p
    };
    let hits = |r: f64| {
        let mut origin = point(r);
        origin[axis] = -1.0;
        let ray = Ray { origin, direction: views::axis_direction(axis, false), t_min: 0.0 };
        scene.trace(&ray).hit.is_some()
    };
    let (mut low, mut high) = (radius - 1.0, radius + 1.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if hits(middle) { low = middle } else { high = middle }
    }
    point(low)
}

/// A picture around the silhouette: its pixels are `step` voxels apart.
fn graze(volume: &Volume, at: [f64; 3], axis: usize, step: f64, effort: Effort) -> View {
    let size = effort.size();
    views::parallel(volume, at, views::axis_direction(axis, axis == 1), 1.0 / step, size)
}

/// (x - a)(y - b)(z - c): along the diagonal a cubic with these roots.
fn roots(name: &str, [a, b, c]: [f64; 3]) -> Case {
    Case::new(GROUP, name, [8, 8, 8], move |[x, y, z]| (x - a) * (y - b) * (z - c)).seen(
        move |volume, _, effort| {
            let size = effort.size().map(|n| n | 1);
            let diagonal = |d, center, pitch| views::parallel(volume, center, d, pitch, size);
            let mut found = views::all_around(volume, effort);
            found.push(diagonal([1.0, 1.0, 1.0], [3.5; 3], 40.0));
            found.push(diagonal([1.0, 1.0, 1.0], [a, b, c], 4000.0));
            found.push(diagonal([1.0, -1.0, 1.0], [a, b, c], 1e6));
            found
        },
    )
}

/// Pairs of planes that cross each other, barely joined or barely parted.
fn saddles() -> Case {
    Case::new(GROUP, "saddle cells", [16, 16, 16], |[x, y, z]| {
        let local = |v: f64| (v % 4.0) - 1.5;
        local(x) * local(y) + 1e-3 * (z - 7.3)
    })
    .at(&[0.0, 1e-6, -1e-6])
}
