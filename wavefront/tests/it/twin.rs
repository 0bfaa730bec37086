//! The GPU finds the hits of the CPU twin.

use gpu_testkit::compare::ulp_distance;
use wavefront::cpu::frame::FrameRay;
use wavefront::cpu::walk::first_hit;

use crate::harness::{Field, Picture, Shot, Stage, WIDTH, look, orbit};

/// Depth of every pixel by the twin; `None` without a hit.
fn twin(stage: &Stage, shot: &Shot<'_>) -> Vec<Option<f32>> {
    let frame = stage.params(shot);
    let (grid, masks) = (shot.field.grid(), shot.field.masks(shot.isovalue));
    (0..WIDTH * shot.height)
        .map(|i| {
            let ray = FrameRay::new(&frame, [i % WIDTH, i / WIDTH]);
            let hit = first_hit(&grid, &masks, &ray.ray, shot.isovalue, &|p| shot.field.at(p))?;
            Some(ray.depth(&frame, hit.t))
        })
        .collect()
}

/// How a picture differs from the twin's depths.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Difference {
    /// Pixels of which only one has a hit.
    mask: usize,
    /// Hits whose depth differs at all, and by more than 64 ulps.
    depths: usize,
    far: usize,
    /// Largest distance of two depths.
    ulps: u32,
}

fn difference(picture: &Picture, twin: &[Option<f32>]) -> Difference {
    let mut found = Difference::default();
    for (pixel, &expected) in twin.iter().enumerate() {
        match (picture.depth(pixel), expected) {
            (None, None) => {}
            (Some(a), Some(b)) => {
                found.depths += usize::from(a.to_bits() != b.to_bits());
                found.far += usize::from(ulp_distance(a, b) > 64);
                found.ulps = found.ulps.max(ulp_distance(a, b));
            }
            _ => found.mask += 1,
        }
    }
    found
}

fn wavy(dims: [u32; 3]) -> Field {
    Field::new(dims, |[x, y, z]| {
        let [x, y, z] = [x, y, z].map(|v| v as f32 * 0.7);
        x.sin() * y.cos() + y.sin() * z.cos() + z.sin() * x.cos()
    })
}

fn noisy(dims: [u32; 3]) -> Field {
    let mut state = 1u32;
    let mut samples = Vec::new();
    for _ in 0..dims.iter().product::<u32>() {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        samples.push((state >> 8) as f32 / 16_777_216.0 - 0.5);
    }
    Field { dims, samples }
}

#[test]
fn the_gpu_finds_the_hits_of_the_twin() {
    let stage = Stage::new();
    let mut sum = Difference::default();
    let (mut hits, mut rays) = (0, 0);
    for (field, isovalue) in
        [(wavy([37, 26, 31]), 0.2), (noisy([22, 19, 18]), 0.3), (noisy([9, 33, 14]), -0.45)]
    {
        let dims = field.dims;
        let middle = dims.map(|n| 0.5 * f64::from(n));
        for camera in [
            orbit(dims, 25.0, 30.0, 48),
            orbit(dims, 200.0, -60.0, 48),
            look(middle, [0.0, 3.0, 1.0], 48),
        ] {
            let shot = Shot { field: &field, isovalue, camera, height: 48 };
            let picture = stage.render(&shot);
            let found = difference(&picture, &twin(&stage, &shot));
            hits += picture.hits();
            rays += picture.status.len();
            sum.mask += found.mask;
            sum.depths += found.depths;
            sum.far += found.far;
            sum.ulps = sum.ulps.max(found.ulps);
        }
    }
    println!("{rays} rays, {hits} hits: {sum:?}");
    assert!(hits > rays / 5);
    // Not bit for bit: compilers may fuse multiplications and additions, and divide to 2.5 ulps.
    assert!(sum.mask * 10_000 <= rays, "{sum:?}");
    assert!(sum.far * 1000 <= hits, "{sum:?}");
}

#[test]
fn a_different_pixel_is_found() {
    let stage = Stage::new();
    let field = wavy([12, 12, 12]);
    let shot = Shot {
        field: &field,
        isovalue: 0.0,
        camera: orbit(field.dims, 10.0, 10.0, 16),
        height: 16,
    };
    let picture = stage.render(&shot);
    let twin = twin(&stage, &shot);
    let good = difference(&picture, &twin);
    let hit = picture.status.iter().position(|&s| s == 1).unwrap();
    let mut missing = twin.clone();
    missing[hit] = None;
    assert_eq!(difference(&picture, &missing).mask, good.mask + 1);
    let mut moved = twin;
    moved[hit] = moved[hit].map(|depth| depth * 1.01);
    assert!(difference(&picture, &moved).ulps > 10_000);
    assert_eq!(difference(&picture, &moved).far, good.far + 1);
}

/// Rays that are cut short go on where they stopped: the same bits, in more rounds, none of which visits more
/// cells than it may.
#[test]
fn a_bound_on_the_cells_of_a_walk_changes_no_bit() {
    let stage = Stage::new();
    let field = noisy([61, 43, 37]);
    // Noise is active everywhere; just below its largest sample most rays pass between the hits.
    let isovalue = 0.97 * field.samples.iter().fold(f32::NEG_INFINITY, |a, &b| a.max(b));
    let shot =
        Shot { field: &field, camera: orbit(field.dims, 33.0, 21.0, 40), isovalue, height: 40 };
    let (masks, zero) = (field.masks(isovalue), |_: usize| 0.0);
    let (expected, free) = stage.render_within(&shot, &masks, &zero, u32::MAX);
    assert_eq!((free.len(), free[0].cut), (1, 0));
    assert!(expected.hits() > 0 && free[0].most_cells > 10 * free[0].entered);
    let rays = free[0].entered;
    for most_cells in [0, 10 * rays, 11 * rays, 25 * rays, free[0].most_cells] {
        let (found, rounds) = stage.render_within(&shot, &masks, &zero, most_cells);
        assert!(found == expected, "{most_cells} cells");
        assert!(rounds.len() > 1 && rounds[0].cut > 0, "{most_cells} cells");
        // A ray visits a block at least, which has 10 cells at most on its way.
        let most = rounds.iter().map(|counters| counters.most_cells).max();
        assert!(most.unwrap() <= most_cells.max(10 * rays), "{most:?} of {most_cells} cells");
        println!("{most_cells} cells: {} rounds, at most {most:?} cells", rounds.len());
    }
}
