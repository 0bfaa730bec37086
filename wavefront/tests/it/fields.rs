//! Pictures of fields whose surfaces are known, and what must not change a picture.

use gpu_testkit::reference::{Ray, Scene};

use crate::harness::{Field, Picture, Shot, Stage, WIDTH, along_axis, look, orbit};

const HEIGHT: u32 = 24;

fn rays(shot: &Shot<'_>) -> Vec<(Ray, f64)> {
    let view = shot.view();
    (0..WIDTH * shot.height)
        .map(|i| {
            let (origin, direction, depth) = view.ray([i % WIDTH, i / WIDTH]);
            (Ray { origin, direction, t_min: 0.0 }, depth)
        })
        .collect()
}

/// Parameter of a hit, from its depth.
fn t_of(picture: &Picture, pixel: usize, depth_per_voxel: f64) -> Option<f64> {
    picture.depth(pixel).map(|d| (f64::from(d) - picture.start_depth) / depth_per_voxel)
}

/// The mask of the f64 reference, but for rays that it calls ambiguous; hits within a thousandth
/// of a voxel of it, or where the field is within rounding of the isovalue.
fn check(name: &str, stage: &Stage, shot: &Shot<'_>) -> Picture {
    let picture = stage.render(shot);
    let field = shot.field;
    let scene = Scene::new(field.dims, &field.samples, f64::from(shot.isovalue));
    let mut excused = 0;
    for (pixel, (ray, depth_per_voxel)) in rays(shot).iter().enumerate() {
        let trace = scene.trace(ray);
        let t = t_of(&picture, pixel, *depth_per_voxel);
        let fits = match (t, trace.hit) {
            (None, None) => true,
            (Some(t), Some(hit)) => {
                (t - hit.t).abs() < 1e-3
                    || (t < hit.t && scene.value(ray.at(t)).abs() < 1e-5 * trace.max_abs)
            }
            (Some(t), None) => scene.value(ray.at(t)).abs() < 1e-5 * trace.max_abs,
            (None, Some(_)) => false,
        };
        if !fits {
            assert!(
                trace.is_ambiguous(2e-5, 1e-4),
                "{name}, pixel {pixel}: t = {t:?}, expected {trace:?} for {ray:?}"
            );
            excused += 1;
        }
        if let Some(t) = t {
            assert!(t >= -1e-4, "{name}, pixel {pixel}: a hit behind the start, t = {t}");
            let last = field.dims.map(|n| f64::from(n) - 1.0);
            for (a, x) in ray.at(t).into_iter().enumerate() {
                assert!(x > -1e-3 && x < last[a] + 1e-3, "{name}: a hit outside, {:?}", ray.at(t));
            }
        }
    }
    assert!(excused * 100 <= picture.status.len(), "{name}: {excused} rays excused");
    picture
}

fn cameras(dims: [u32; 3]) -> Vec<wavefront::Camera> {
    let middle = dims.map(|n| 0.5 * (f64::from(n) - 1.0));
    let mut cameras = vec![
        orbit(dims, 30.0, 20.0, HEIGHT),
        orbit(dims, 210.0, -35.0, HEIGHT),
        look(middle, middle.map(|v| v * 0.3 - 1.0), HEIGHT),
    ];
    for axis in 0..3 {
        // Half a pixel is an eighth of a voxel: some rays run along voxel planes exactly.
        let center = middle.map(|v| v.floor() + 0.125);
        cameras.push(along_axis(axis, center, 4.0, axis == 1, HEIGHT));
    }
    cameras
}

/// P11: a linear field's surface is a plane, found where it is.
#[test]
fn a_ramp_is_a_plane() {
    let stage = Stage::new();
    let dims = [21, 18, 23];
    let slope = [0.5, -0.25, 1.0];
    let field = Field::new(dims, |p| (0..3).map(|a| slope[a] * p[a] as f32).sum());
    for (n, camera) in cameras(dims).into_iter().enumerate() {
        let shot = Shot { field: &field, isovalue: 11.3, camera, height: HEIGHT };
        let picture = check(&format!("ramp {n}"), &stage, &shot);
        for (pixel, (ray, depth)) in rays(&shot).iter().enumerate() {
            if let Some(t) = t_of(&picture, pixel, *depth) {
                let value: f64 = (0..3).map(|a| f64::from(slope[a]) * ray.at(t)[a]).sum();
                assert!((value - f64::from(11.3f32)).abs() < 1e-4, "camera {n}: {value}");
            }
        }
        assert!(picture.hits() > 30, "camera {n}: {} hits", picture.hits());
    }
}

/// P11: trilinear interpolation of a distance is off by at most 3/8 voxel^2 over the radius.
#[test]
fn a_distance_field_is_a_sphere() {
    let stage = Stage::new();
    let dims = [34, 34, 34];
    let center = [16.5f64; 3];
    let distance =
        |p: [f64; 3]| (0..3).map(|a| (p[a] - center[a]) * (p[a] - center[a])).sum::<f64>().sqrt();
    let field = Field::new(dims, |p| distance(p.map(f64::from)) as f32);
    let radius = 12.25;
    for camera in cameras(dims) {
        let shot = Shot { field: &field, isovalue: radius as f32, camera, height: HEIGHT };
        let picture = check("sphere", &stage, &shot);
        for (pixel, (ray, depth)) in rays(&shot).iter().enumerate() {
            if let Some(t) = t_of(&picture, pixel, *depth) {
                let off = distance(ray.at(t)) - radius;
                assert!(off.abs() < 0.375 / (radius - 1.0), "off by {off}");
            }
        }
        assert!(picture.hits() > 30);
    }
}

/// P14: isovalues equal to samples, plateaus, constant volumes, zeros.
#[test]
fn isovalues_on_samples_and_plateaus() {
    let stage = Stage::new();
    let dims = [14, 11, 13];
    let steps = Field::new(dims, |[x, y, z]| ((x / 3 + y / 2 + z / 4) % 3) as f32 - 1.0);
    let checkers = Field::new(dims, |[x, y, z]| ((x + y + z) % 2) as f32);
    let flat = Field::new(dims, |_| 2.5);
    let half = Field::new(dims, |[x, ..]| if x < 6 { 0.0 } else { -1.0 });
    let still = Field::new(dims, |_| 0.0);
    for (name, field, isovalues) in [
        ("steps", &steps, &[-1.0, 0.0, 1.0, 1.5, -1.5][..]),
        ("checkers", &checkers, &[0.0, 0.5, 1.0]),
        ("flat", &flat, &[2.5, 2.4, 2.6]),
        ("half", &half, &[0.0, -1.0, -0.5]),
        ("zero", &still, &[0.0, 1e-30, -1e-30]),
    ] {
        for &isovalue in isovalues {
            for camera in cameras(dims) {
                let shot = Shot { field, isovalue, camera, height: HEIGHT };
                let picture = check(&format!("{name} at {isovalue}"), &stage, &shot);
                if ["flat", "zero"].contains(&name) {
                    assert_eq!(picture.hits(), 0, "a constant has no surface");
                }
            }
        }
    }
}

/// P15: what is stored beyond the volume's end never shows.
#[test]
fn padded_samples_do_not_matter() {
    let stage = Stage::new();
    for dims in [[13, 10, 11], [5, 5, 5], [6, 7, 4], [2, 3, 9]] {
        let field = Field::new(dims, |[x, y, z]| {
            (x as f32 * 0.9).sin() + (y as f32 * 1.1).cos() - (z as f32 * 0.8).sin()
        });
        for camera in cameras(dims) {
            let shot = Shot { field: &field, isovalue: 0.1, camera, height: HEIGHT };
            let masks = field.masks(0.1);
            let clean = check("padding", &stage, &shot);
            let garbage = |n: usize| if n.is_multiple_of(2) { 1e30 } else { -7.0 };
            assert_eq!(stage.render_with(&shot, &masks, &garbage), clean, "{dims:?}");
            // Even if every block were walked through.
            assert_eq!(stage.render_with(&shot, &field.all_active(), &garbage), clean, "{dims:?}");
        }
    }
}

/// P9: the masks only save work.
#[test]
fn skipping_does_not_change_the_picture() {
    let stage = Stage::new();
    for dims in [[41, 38, 45], [130, 20, 17]] {
        let field = Field::new(dims, |[x, y, z]| {
            let [x, y, z] = [x, y, z].map(|v| v as f32 - 15.0);
            (x * x + y * y + z * z).sqrt() + (x * 0.9).sin()
        });
        for camera in cameras(dims) {
            let shot = Shot { field: &field, isovalue: 9.5, camera, height: HEIGHT };
            let clean = check("skipping", &stage, &shot);
            let all = stage.render_with(&shot, &field.all_active(), &|_| 0.0);
            assert_eq!(all, clean, "{dims:?}");
        }
    }
}

/// P16: few voxels on an axis, single blocks, an eye on planes and vertices.
#[test]
fn small_volumes_and_eyes_on_vertices() {
    let stage = Stage::new();
    let tilted = |dims: [u32; 3]| {
        Field::new(dims, |[x, y, z]| x as f32 * 0.7 + y as f32 * 0.6 - z as f32 * 0.8)
    };
    for dims in [[1, 9, 9], [9, 1, 9], [9, 9, 1], [1, 1, 1], [2, 2, 1]] {
        let field = tilted(dims);
        let camera = orbit([9, 9, 9], 30.0, 20.0, HEIGHT);
        let shot = Shot { field: &field, isovalue: 1.1, camera, height: HEIGHT };
        assert_eq!(stage.render(&shot).hits(), 0, "{dims:?} has no dual cell");
    }
    for dims in [[2, 2, 2], [4, 4, 4], [5, 4, 4], [2, 9, 3], [17, 2, 5], [6, 7, 8]] {
        let field = tilted(dims);
        let middle = dims.map(|n| 0.35 * (f64::from(n) - 1.0));
        let isovalue = (middle[0] * 0.7 + middle[1] * 0.6 - middle[2] * 0.8) as f32;
        let mut cameras = cameras(dims);
        // Eyes on a vertex, on an edge, on a face's plane, at the volume's corner and on its face.
        for eye in [[1.0, 1.0, 1.0], [1.0, 1.0, 0.5], [0.5, 1.0, 0.5], [0.0; 3], [0.5, 0.0, 0.3]] {
            cameras.push(look(eye, [3.0, 2.5, -2.0], HEIGHT));
            cameras.push(look(eye, [eye[0] + 1.0, eye[1], eye[2]], HEIGHT));
        }
        let mut hits = 0;
        for (n, camera) in cameras.into_iter().enumerate() {
            let shot = Shot { field: &field, isovalue, camera, height: HEIGHT };
            hits += check(&format!("{dims:?}, camera {n}"), &stage, &shot).hits();
        }
        assert!(hits > 200, "{dims:?}: {hits} hits");
    }
}

/// P13 at the walk: powers of two scale every product and sum exactly.
#[test]
fn scaled_values_give_the_same_picture() {
    let stage = Stage::new();
    let dims = [15, 14, 13];
    let wavy = |k: f32| {
        Field::new(dims, move |[x, y, z]| {
            k * ((x as f32).sin() * (y as f32 * 0.8).cos() + (z as f32 * 0.6).sin())
        })
    };
    let field = wavy(1.0);
    let camera = || orbit(dims, 75.0, 10.0, HEIGHT);
    let clean = check(
        "unscaled",
        &stage,
        &Shot { field: &field, isovalue: 0.3, camera: camera(), height: HEIGHT },
    );
    assert!(clean.hits() > 100);
    for exponent in [-40, 3, 100] {
        let factor = 2f32.powi(exponent);
        let field = wavy(factor);
        let isovalue = 0.3 * factor;
        let shot = Shot { field: &field, isovalue, camera: camera(), height: HEIGHT };
        assert_eq!(stage.render(&shot), clean, "2^{exponent}");
    }
}
