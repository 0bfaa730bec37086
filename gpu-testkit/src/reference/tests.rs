use proptest::prelude::*;

use super::*;

fn field(dims: [u32; 3], f: impl Fn([f64; 3]) -> f64) -> Vec<f32> {
    let mut samples = Vec::new();
    for z in 0..dims[2] {
        for y in 0..dims[1] {
            for x in 0..dims[0] {
                samples.push(f([x, y, z].map(f64::from)) as f32);
            }
        }
    }
    samples
}

fn ray(origin: [f64; 3], direction: [f64; 3]) -> Ray {
    let length = direction.iter().map(|x| x * x).sum::<f64>().sqrt();
    Ray { origin, direction: direction.map(|x| x / length), t_min: 0.0 }
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[test]
fn a_constant_field_has_no_surface() {
    let dims = [4, 5, 6];
    let samples = field(dims, |_| 2.0);
    for isovalue in [1.0, 2.0, 3.0] {
        let scene = Scene::new(dims, &samples, isovalue);
        let trace = scene.trace(&ray([-3.0, 1.5, 2.5], [1.0, 0.1, 0.05]));
        assert_eq!(trace.hit, None);
        assert_eq!(trace.margin, (2.0 - isovalue).abs());
        assert_eq!(trace.turning_margin, trace.margin);
        assert_eq!(trace.max_abs, isovalue.max(2.0));
    }
}

#[test]
fn volumes_without_dual_cells_have_no_surface() {
    for dims in [[1, 4, 4], [4, 4, 1], [0, 0, 0]] {
        let samples = field(dims, |p| p[1]);
        let scene = Scene::new(dims, &samples, 1.5);
        assert_eq!(scene.trace(&ray([0.0, -1.0, 0.0], [0.0, 1.0, 0.0])).hit, None);
    }
}

#[test]
fn a_ramp_is_hit_where_the_plane_lies() {
    let (dims, normal, isovalue) = ([9, 8, 7], [1.0, 2.0, -0.5], 9.3);
    let samples = field(dims, |p| dot(normal, p));
    let scene = Scene::new(dims, &samples, isovalue);
    let rays = [
        ray([-2.0, 1.1, 3.3], [1.0, 0.5, 0.1]),
        ray([4.0, -5.0, 2.0], [0.1, 1.0, 0.2]),
        ray([4.2, 9.0, 2.6], [0.0, -1.0, 0.0]),
        ray([2.0, 3.0, 2.0], [1.0, 1.0, 1.0]),
    ];
    for ray in rays {
        let expected = (isovalue - dot(normal, ray.origin)) / dot(normal, ray.direction);
        let hit = scene.trace(&ray).hit.unwrap();
        assert!((hit.t - expected).abs() < 1e-12, "{} instead of {expected}", hit.t);
        assert!((hit.slope - dot(normal, ray.direction)).abs() < 1e-12);
        assert_eq!(hit.enters, hit.slope > 0.0);
        assert_eq!(scene.trace_all(&ray), [hit]);
        for axis in 0..3 {
            assert!((hit.gradient[axis] - normal[axis]).abs() < 1e-12);
            let above = hit.position[axis] - f64::from(hit.cell[axis]);
            assert!((-1e-12..=1.0 + 1e-12).contains(&above), "the cell holds the hit");
        }
    }
}

#[test]
fn one_corrupted_sample_moves_the_hit() {
    let dims = [6, 6, 6];
    let mut samples = field(dims, |p| p[0]);
    let ray = ray([-1.0, 2.4, 2.6], [1.0, 0.0, 0.0]);
    let before = Scene::new(dims, &samples, 2.5).trace(&ray).hit.unwrap();
    assert!((before.t - 3.5).abs() < 1e-12);
    samples[3 + 6 * (2 + 6 * 2)] += 0.5;
    let after = Scene::new(dims, &samples, 2.5).trace(&ray).hit.unwrap();
    assert!((before.t - after.t).abs() > 1e-3);
}

#[test]
fn t_min_skips_earlier_crossings() {
    let dims = [8, 4, 4];
    let samples = field(dims, |p| (p[0] - 3.5).abs());
    let scene = Scene::new(dims, &samples, 2.0);
    let mut ray = ray([-1.0, 1.3, 1.7], [1.0, 0.0, 0.0]);
    let all = scene.trace_all(&ray);
    assert_eq!(all.len(), 2);
    assert!(!all[0].enters && all[1].enters, "the path starts inside");
    assert_eq!(all[0].cell, [1, 1, 1]);
    assert_eq!(all[1].cell, [5, 1, 1]);
    ray.t_min = all[0].t + 0.1;
    assert_eq!(scene.trace(&ray).hit, Some(all[1]));
    ray.t_min = 20.0;
    assert_eq!(scene.trace(&ray).hit, None);
}

#[test]
fn a_sphere_is_met_within_the_interpolation_error() {
    let (dims, centre, radius) = ([32, 32, 32], [15.3, 15.6, 15.1], 11.0);
    let samples = field(dims, |p| {
        let d = [0, 1, 2].map(|axis| p[axis] - centre[axis]);
        radius - dot(d, d).sqrt()
    });
    let scene = Scene::new(dims, &samples, 0.0);
    // Trilinear error <= (sum of |second derivatives|) / 8, and the Laplacian of a distance is 2/r.
    let bound = 2.0 / (8.0 * (radius - 1.8));
    let mut rays = Vec::new();
    for i in 0..20 {
        for j in 0..20 {
            let target = [15.0 + f64::from(i) - 10.0, 15.0 + f64::from(j) - 10.0, 15.0];
            let origin = [40.0, -20.0, -30.0];
            rays.push(ray(origin, [0, 1, 2].map(|axis| target[axis] - origin[axis])));
        }
    }
    let traces = scene.trace_rays(&rays);
    assert_eq!(traces.len(), rays.len());
    let mut hits = 0;
    for (ray, trace) in rays.iter().zip(&traces) {
        assert_eq!(*trace, scene.trace(ray), "threads do not change the answer");
        let to_centre = [0, 1, 2].map(|axis| centre[axis] - ray.origin[axis]);
        let along = dot(to_centre, ray.direction);
        let closest = (dot(to_centre, to_centre) - along * along).max(0.0).sqrt();
        assert!((closest - radius).abs() < bound || trace.hit.is_some() == (closest < radius));
        if let Some(hit) = trace.hit {
            let d = [0, 1, 2].map(|axis| hit.position[axis] - centre[axis]);
            assert!((dot(d, d).sqrt() - radius).abs() < bound);
            assert!(hit.enters);
            hits += 1;
        }
    }
    assert!(hits > 200, "only {hits} rays hit the sphere");
}

#[test]
fn rays_through_vertices_and_edges_and_along_axes() {
    let dims = [5, 5, 5];
    let samples = field(dims, |p| p[0] + p[1] + p[2]);
    let scene = Scene::new(dims, &samples, 6.3);
    let diagonal = scene.trace(&ray([-1.0; 3], [1.0; 3]));
    assert!((diagonal.hit.unwrap().position[1] - 2.1).abs() < 1e-12);
    assert_eq!(diagonal.edge_distance, 0.0);
    let in_plane = scene.trace(&ray([-1.0, 2.0, 1.0], [1.0, 0.0, 0.0]));
    assert!((in_plane.hit.unwrap().position[0] - 3.3).abs() < 1e-12);
    let on_box_face = scene.trace(&ray([-1.0, 4.0, 1.5], [1.0, 0.0, 0.0]));
    assert!((on_box_face.hit.unwrap().position[0] - 0.8).abs() < 1e-12);
    assert_eq!(on_box_face.silhouette_distance, 0.0);
    let through_edge = scene.trace(&ray([0.0, 1.0, 2.5], [1.0, 1.0, 0.0]));
    assert!((through_edge.hit.unwrap().position[0] - 1.4).abs() < 1e-12);
    let negative_zero = scene.trace(&ray([2.5, 2.5, 6.0], [-0.0, 0.0, -1.0]));
    assert!((negative_zero.hit.unwrap().position[2] - 1.3).abs() < 1e-12);
}

#[test]
fn a_hit_exactly_on_a_sample_belongs_to_the_inside() {
    let dims = [4, 3, 3];
    let samples = field(dims, |p| p[0]);
    let scene = Scene::new(dims, &samples, 2.0);
    let hit = scene.trace(&ray([-1.0, 0.5, 0.5], [1.0, 0.0, 0.0])).hit.unwrap();
    assert!((hit.t - 3.0).abs() < 1e-12);
    assert!(hit.face_distance < 1e-12);
    // A peak that just reaches the isovalue counts as a crossing in and out.
    let peak = field(dims, |p| if p[0] == 1.0 { 1.0 } else { 0.0 });
    let scene = Scene::new(dims, &peak, 1.0);
    assert_eq!(scene.trace_all(&ray([-1.0, 0.5, 0.5], [1.0, 0.0, 0.0])).len(), 2);
}

#[test]
fn margins_tell_near_misses() {
    // Along the face diagonal of one cell the field is 2s(1 - s), with its peak of 0.5 in between.
    let dims = [2, 2, 2];
    let samples = field(dims, |p| if p[0] == p[1] { 0.0 } else { 1.0 });
    let ray = ray([-1.0, -1.0, 0.5], [1.0, 1.0, 0.0]);
    let missed = Scene::new(dims, &samples, 0.5 + 1e-7).trace(&ray);
    assert_eq!(missed.hit, None);
    assert!((missed.turning_margin - 1e-7).abs() < 1e-12);
    assert_eq!(missed.margin, missed.turning_margin);
    let grazed = Scene::new(dims, &samples, 0.5 - 1e-7).trace(&ray);
    assert!(grazed.hit.is_some());
    assert!((grazed.turning_margin - 1e-7).abs() < 1e-12, "the peak comes after the hit");
    let clear = Scene::new(dims, &samples, 0.2).trace(&ray);
    assert!((clear.turning_margin - 0.2).abs() < 1e-12);
    assert!(missed.is_ambiguous(1e-6, 0.0) && grazed.is_ambiguous(1e-6, 0.0));
    assert!(!clear.is_ambiguous(1e-6, 0.1));
    assert!(clear.is_ambiguous(1e-6, 0.6), "half a voxel is as deep as one cell goes");
}

#[test]
fn a_crossing_near_a_face_is_no_near_miss() {
    let dims = [6, 3, 3];
    let samples = field(dims, |p| p[0]);
    let trace =
        Scene::new(dims, &samples, 3.0 - 1e-9).trace(&ray([-1.0, 0.4, 0.4], [1.0, 0.0, 0.0]));
    assert!(trace.margin < 2e-9);
    assert!((trace.turning_margin - 2.0).abs() < 1e-6, "{}", trace.turning_margin);
    assert!(trace.hit.unwrap().face_distance < 2e-9);
}

#[test]
fn distances_to_edges_and_to_the_silhouette() {
    let dims = [5, 5, 5];
    let samples = field(dims, |p| p[0]);
    let scene = Scene::new(dims, &samples, 9.0);
    let inner = scene.trace(&ray([-1.0, 2.1, 1.6], [1.0, 0.0, 0.0]));
    assert!((inner.edge_distance - 0.1).abs() < 1e-12);
    assert!((inner.silhouette_distance - 1.6).abs() < 1e-12);
    let outside = scene.trace(&ray([-1.0, 4.25, 1.5], [1.0, 0.0, 0.0]));
    assert_eq!(outside.hit, None);
    assert!((outside.silhouette_distance + 0.25).abs() < 1e-12);
    let corner_cut = scene.trace(&ray([-1.0, 1.25, 2.0], [1.0, -1.0, 0.0]));
    assert!((corner_cut.silhouette_distance - 0.125).abs() < 1e-12);
    let past = scene.trace(&ray([6.0, 2.0, 2.0], [1.0, 0.0, 0.0]));
    assert!((past.silhouette_distance + 2.0).abs() < 1e-12, "the box lies behind t_min");
}

/// Value minus isovalue by three rounds of linear interpolation, to check the caster's own.
fn naive_value(dims: [u32; 3], samples: &[f32], isovalue: f64, p: [f64; 3]) -> f64 {
    let at = |x: usize, y: usize, z: usize| {
        f64::from(samples[x + dims[0] as usize * (y + dims[1] as usize * z)])
    };
    let cell = [0, 1, 2].map(|a| (p[a].max(0.0) as usize).min(dims[a] as usize - 2));
    let [u, v, w] = [0, 1, 2].map(|a| p[a] - cell[a] as f64);
    let mix = |a: f64, b: f64, s: f64| a + (b - a) * s;
    let [x, y, z] = cell;
    let row = |y, z| mix(at(x, y, z), at(x + 1, y, z), u);
    mix(mix(row(y, z), row(y + 1, z), v), mix(row(y, z + 1), row(y + 1, z + 1), v), w) - isovalue
}

fn scenes() -> impl Strategy<Value = ([u32; 3], Vec<f32>, f64)> {
    (2u32..6, 2u32..5, 2u32..5).prop_flat_map(|(x, y, z)| {
        let sample = prop_oneof![3 => -1.0f32..1.0, 1 => Just(0.0f32), 1 => Just(0.5f32)];
        let samples = prop::collection::vec(sample, (x * y * z) as usize);
        let isovalue = prop_oneof![2 => -0.8f64..0.8, 1 => Just(0.0), 1 => Just(0.5)];
        (Just([x, y, z]), samples, isovalue)
    })
}

fn rays() -> impl Strategy<Value = Ray> {
    let coordinate = || prop_oneof![3 => -2.0f64..6.0, 1 => (-1i32..5).prop_map(f64::from)];
    let component = || prop_oneof![3 => -1.0f64..1.0, 1 => Just(0.0), 1 => Just(1.0)];
    let origin = [coordinate(), coordinate(), coordinate()];
    let target = [0.0f64..3.0, 0.0f64..3.0, 0.0f64..3.0];
    let direction = [component(), component(), component()];
    (origin, target, direction, any::<bool>()).prop_filter_map(
        "a direction",
        |(origin, target, direction, aimed)| {
            let towards = [0, 1, 2].map(|a| target[a] - origin[a]);
            let direction = if aimed { towards } else { direction };
            (dot(direction, direction) > 1e-6).then(|| ray(origin, direction))
        },
    )
}

proptest! {
    #[test]
    fn the_number_of_crossings_has_the_parity_of_the_ends((dims, samples, isovalue) in scenes(),
                                                          ray in rays()) {
        let scene = Scene::new(dims, &samples, isovalue);
        let all = scene.trace_all(&ray);
        let Some([enter, exit]) = scene.interval(&ray) else {
            prop_assert!(all.is_empty());
            return Ok(());
        };
        let inside = |t| scene.value(ray.at(t)) >= 0.0;
        prop_assert_eq!(inside(enter) != inside(exit), all.len() % 2 == 1);
        for pair in all.windows(2) {
            prop_assert!(pair[0].t <= pair[1].t);
            prop_assert_ne!(pair[0].enters, pair[1].enters);
        }
        if let Some(first) = all.first() {
            prop_assert_eq!(first.enters, !inside(enter));
        }
    }

    #[test]
    fn fine_sampling_finds_the_same_crossings((dims, samples, isovalue) in scenes(),
                                              ray in rays()) {
        const STEPS: u32 = 1000;
        let scene = Scene::new(dims, &samples, isovalue);
        let all = scene.trace_all(&ray);
        let Some([enter, exit]) = scene.interval(&ray) else { return Ok(()) };
        let t_at = |i: u32| enter + (exit - enter) * f64::from(i) / f64::from(STEPS);
        let value = |t| {
            let p = ray.at(t);
            let p = [0, 1, 2].map(|a| p[a].clamp(0.0, f64::from(dims[a]) - 1.0));
            naive_value(dims, &samples, isovalue, p)
        };
        for i in 0..STEPS {
            let (from, to) = (t_at(i), t_at(i + 1));
            let (a, b) = (value(from), value(to));
            if a.abs().min(b.abs()) < 1e-12 {
                continue;
            }
            let between = all.iter().filter(|hit| hit.t > from && hit.t <= to).count();
            prop_assert_eq!((a >= 0.0) != (b >= 0.0), between % 2 == 1, "between {} and {}", from, to);
        }
        for hit in &all {
            prop_assert!(value(hit.t).abs() < 1e-12 * (1.0 + hit.cell_max_abs) + hit.slope.abs() * 1e-14);
        }
    }

    #[test]
    fn the_first_crossing_is_the_one_traced((dims, samples, isovalue) in scenes(), ray in rays()) {
        let scene = Scene::new(dims, &samples, isovalue);
        let trace = scene.trace(&ray);
        prop_assert_eq!(trace.hit, scene.trace_all(&ray).first().copied());
        prop_assert!(trace.margin <= trace.turning_margin || trace.hit.is_some());
    }

    #[test]
    fn gradients_are_those_of_finite_differences((dims, samples, isovalue) in scenes(),
                                                 ray in rays()) {
        const STEP: f64 = 1e-5;
        let scene = Scene::new(dims, &samples, isovalue);
        for hit in scene.trace_all(&ray) {
            let ahead = scene.gradient(hit.cell, hit.position);
            prop_assert_eq!(ahead, hit.gradient);
            for axis in 0..3 {
                // Interpolants of one cell are linear along each axis: differences are exact.
                let middle = [0, 1, 2].map(|a| hit.position[a].clamp(f64::from(hit.cell[a]) + STEP,
                    f64::from(hit.cell[a]) + 1.0 - STEP));
                let (mut low, mut high) = (middle, middle);
                low[axis] -= STEP / 2.0;
                high[axis] += STEP / 2.0;
                let slope = (naive_value(dims, &samples, isovalue, high)
                    - naive_value(dims, &samples, isovalue, low)) / STEP;
                prop_assert!((slope - scene.gradient(hit.cell, middle)[axis]).abs() < 1e-8);
            }
        }
    }
}
