//! Pictures against the f64 reference renderer: the bundled scan and three generators, three views
//! each. `docs/numerics.md` derives the bounds.

use progressive_iso::{Camera, Capture, CompressedVolume, PixelStatus};

use crate::compare::{Expected, Summary};
use crate::support::{BACKGROUND, Gpu, Scene, options};

const SIZE: [u32; 2] = [320, 240];

/// Rotation by (1, 2, 3) turns of 0.1 about x, y, z, after unequal spacings, and a shift.
fn oblique() -> [[f64; 4]; 4] {
    let [a, b, c] = [0.1f64, 0.2, 0.3].map(|turns| turns * std::f64::consts::TAU);
    let rotate = |v: [f64; 3]| {
        let v = [v[0], v[1] * a.cos() - v[2] * a.sin(), v[1] * a.sin() + v[2] * a.cos()];
        let v = [v[0] * b.cos() + v[2] * b.sin(), v[1], -v[0] * b.sin() + v[2] * b.cos()];
        [v[0] * c.cos() - v[1] * c.sin(), v[0] * c.sin() + v[1] * c.cos(), v[2]]
    };
    let column = |v: [f64; 3]| {
        let [x, y, z] = rotate(v);
        [x, y, z, 0.0]
    };
    [
        column([0.7, 0.0, 0.0]),
        column([0.0, 1.1, 0.0]),
        column([0.2, 0.0, 0.9]),
        [-400.0, 120.0, 33.0, 1.0],
    ]
}

/// Three views each: from outside in perspective, in parallel, from inside.
fn views(scene: &Scene) -> [(&'static str, Camera); 3] {
    [
        ("orbit", scene.orbit(33.0, 21.0, SIZE)),
        ("orthographic", scene.orthographic([-0.6, 0.35, 0.9], SIZE)),
        ("inside", scene.looking([0.47, 0.55, 0.41], [0.9, 0.45, 0.2], SIZE)),
    ]
}

fn compare(name: &str, scene: &Scene) {
    let gpu = Gpu::new();
    let samples = scene.volume.decode();
    let mut renderer = gpu.renderer(scene, options(SIZE));
    let mut sum = Summary::default();
    for (view, camera) in views(scene) {
        let expected = Expected::new(scene, &samples, &camera, SIZE);
        let picture = gpu.finish(&mut renderer, &scene.frame(camera));
        match expected.check(&picture) {
            Ok(summary) => {
                println!("{name}, {view}: {summary:?}");
                sum.add(&summary);
            }
            Err(problem) => panic!("{name}, {view}: {problem}"),
        }
    }
    let adapter = gpu_testkit::gpu::adapter_info();
    println!("{name} on {} ({:?}): {sum:?}", adapter.name, adapter.backend);
    assert!(sum.hits * 10 > sum.rays, "hardly anything to see");
    assert!((sum.excused as f64) < 1e-5 * sum.rays as f64, "{} rays excused", sum.excused);
    assert!(sum.vague_colors * 20 < sum.hits, "{} colours are vague", sum.vague_colors);
}

#[test]
fn the_bundled_brain_agrees_with_the_reference() {
    let volume = volumes::brain();
    let geometry = volume.geometry;
    let world_from_index = CompressedVolume::placed(geometry.spacing, geometry.origin);
    let isovalue = volumes::BRAIN_ISOVALUE;
    compare("brain", &Scene { volume, world_from_index, isovalue });
}

#[test]
fn a_gyroid_with_unequal_spacing_agrees_with_the_reference() {
    let scene = Scene::generated("gyroid", [70, 83, 94], 8.0);
    let world = CompressedVolume::placed([0.5, 1.25, 0.8], [100.0, -2000.0, 7.5]);
    compare("gyroid", &scene.placed(world));
}

#[test]
fn an_oblique_marschner_lobb_signal_agrees_with_the_reference() {
    let scene = Scene::generated("marschner-lobb", [65, 71, 62], 10.0);
    compare("marschner-lobb", &scene.placed(oblique()));
}

#[test]
fn turbulence_agrees_with_the_reference() {
    compare("turbulence", &Scene::generated("turbulence", [90, 77, 67], 6.0));
}

/// P15: whatever the encoder was given beyond the volume's end, the picture is that of the samples
/// inside.
#[test]
fn padding_does_not_show() {
    let dims = [33, 30, 27];
    let field = volumes::by_name("turbulence", dims).unwrap();
    let mut encoder = volume_io::BlockEncoder::new(dims, 20.0).unwrap();
    for _ in 0..encoder.block_count() {
        let (origin, valid) = (encoder.next_origin(), encoder.next_valid());
        let mut block = volumes::sample_block(&*field, dims, origin.map(|o| o / 4));
        for (n, sample) in block.iter_mut().enumerate() {
            let p = [n & 3, n >> 2 & 3, n >> 4].map(|v| v as u32);
            if (0..3).any(|a| p[a] >= valid[a]) {
                *sample = if n % 2 == 0 { 3.0 } else { -3.0 };
            }
        }
        encoder.push(&block).unwrap();
    }
    let scene =
        Scene { volume: encoder.finish().unwrap(), ..Scene::generated("turbulence", dims, 1.0) };
    let (samples, gpu) = (scene.volume.decode(), Gpu::new());
    // Views onto the faces at the upper ends, which partial blocks fill.
    for camera in [scene.orbit(45.0, 35.0, SIZE), scene.orthographic([0.3, 0.9, 0.2], SIZE)] {
        let expected = Expected::new(&scene, &samples, &camera, SIZE);
        let picture = gpu.render(&scene, options(SIZE), &scene.frame(camera));
        let summary = expected.check(&picture).unwrap();
        assert!(summary.hits > 10_000 && summary.excused <= 1, "{summary:?}");
    }
}

/// The comparison notices one wrong pixel of any kind.
#[test]
fn every_corruption_of_one_pixel_is_found() {
    let gpu = Gpu::new();
    let scene = Scene::generated("gyroid", [30, 34, 27], 8.0).placed(oblique());
    let camera = scene.orbit(20.0, 30.0, SIZE);
    let samples = scene.volume.decode();
    let expected = Expected::new(&scene, &samples, &camera, SIZE);
    let good = gpu.render(&scene, options(SIZE), &scene.frame(camera));
    expected.check(&good).unwrap();
    let status = good.status.as_ref().unwrap();
    let center = SIZE[0] as usize * (SIZE[1] as usize / 2) + SIZE[0] as usize / 2;
    let hit = (center..).find(|&i| status[i] == PixelStatus::Hit).unwrap();
    let empty = (0..).find(|&i| status[i] == PixelStatus::Background).unwrap();
    let corrupted = |change: &dyn Fn(&mut Capture)| {
        let mut bad = good.clone();
        change(&mut bad);
        expected.check(&bad).unwrap_err()
    };
    let problems = [
        corrupted(&|p| p.status.as_mut().unwrap()[hit] = PixelStatus::Unfinished),
        corrupted(&|p| {
            p.status.as_mut().unwrap()[hit] = PixelStatus::Background;
            p.depth.as_mut().unwrap()[hit] = f32::INFINITY;
            p.normal.as_mut().unwrap()[hit] = [0.0; 3];
            p.color[4 * hit..][..4].copy_from_slice(&BACKGROUND);
        }),
        corrupted(&|p| p.depth.as_mut().unwrap()[hit] += 2e-2),
        corrupted(&|p| p.depth.as_mut().unwrap()[hit] = -1e3),
        corrupted(&|p| p.normal.as_mut().unwrap()[hit][1] += 4e-3),
        corrupted(&|p| p.color[4 * hit + 1] ^= 4),
        corrupted(&|p| p.color[4 * hit + 3] = 254),
        corrupted(&|p| p.color[4 * empty] += 1),
        corrupted(&|p| p.depth.as_mut().unwrap()[empty] = 3.0),
        corrupted(&|p| p.normal.as_mut().unwrap()[empty][2] = 1.0),
        corrupted(&|p| {
            p.status.as_mut().unwrap()[empty] = PixelStatus::Hit;
            p.depth.as_mut().unwrap()[empty] = p.depth.as_ref().unwrap()[hit];
        }),
    ];
    for (n, problem) in problems.iter().enumerate() {
        assert!(problem.contains("pixel"), "{n}: {problem}");
    }
}
