//! The generators against their formulas, against central differences, and against each other.

use proptest::prelude::*;
use volumes::{
    Field, Gyroid, MarschnerLobb, MixingLayer, NAMES, Patch, PlaneRamp, Rotated, RoughSolid,
    Shells, SphereDistance, Turbulence, by_name, samples,
};

const DIMS: [u32; 3] = [48, 40, 56];

/// Largest difference between the gradient and central differences, relative to the field's slopes
/// in this place.
fn gradient_error(field: &dyn Field, p: [f64; 3], gradient: [f64; 3]) -> f64 {
    let h = 1e-4;
    let mut worst = 0.0_f64;
    let mut scale = 1e-3_f64;
    for axis in 0..3 {
        let at = |step: f64| {
            let mut q = p;
            q[axis] += step;
            field.value(q)
        };
        // Fourth order, so that the steep edges of the scan-like fields leave no truncation error
        // to speak of.
        let difference = (8.0 * (at(h) - at(-h)) - (at(2.0 * h) - at(-2.0 * h))) / (12.0 * h);
        worst = worst.max((difference - gradient[axis]).abs());
        scale = scale.max(difference.abs());
    }
    worst / scale
}

fn inside() -> impl Strategy<Value = [f64; 3]> {
    prop::array::uniform3(0.01..0.99_f64)
        .prop_map(|u| [0, 1, 2].map(|axis| u[axis] * f64::from(DIMS[axis] - 1)))
}

proptest! {
    #[test]
    fn a_turned_field_turns_its_gradient(p in inside(), angle in 0.0..6.3_f64) {
        let (s, c) = angle.sin_cos();
        let rows = [[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]];
        let field = Rotated::new(by_name("turbulence", DIMS).unwrap(), DIMS, rows);
        let gradient = field.gradient(p).unwrap();
        prop_assert!(gradient_error(&field, p, gradient) < 1e-5);
    }

    #[test]
    fn gradients_match_central_differences(p in inside(), which in 0..NAMES.len()) {
        let field = by_name(NAMES[which], DIMS).unwrap();
        if let Some(gradient) = field.gradient(p) {
            let error = gradient_error(&*field, p, gradient);
            prop_assert!(error < 1e-5, "{}: relative error {error}", field.name());
        }
    }

    #[test]
    fn gradients_exist_away_from_singular_points(p in inside(), which in 0..NAMES.len()) {
        let field = by_name(NAMES[which], DIMS).unwrap();
        let gradient = field.gradient(p).expect("a gradient at a random position");
        prop_assert!(gradient.iter().all(|g| g.is_finite()));
        prop_assert!(field.value(p).is_finite());
    }
}

#[test]
fn the_gradient_check_notices_a_wrong_gradient() {
    let field = Gyroid::new(DIMS);
    let p = [10.3, 20.1, 7.7];
    let gradient = field.gradient(p).unwrap();
    assert!(gradient_error(&field, p, gradient) < 1e-6);
    for axis in 0..3 {
        let mut wrong = gradient;
        wrong[axis] += 1e-3;
        assert!(gradient_error(&field, p, wrong) > 1e-4, "axis {axis}");
    }
}

#[test]
fn the_sphere_is_a_distance_in_voxels() {
    let field = SphereDistance { centre: [3.0, 4.0, 0.0], radius: 2.0 };
    assert_eq!(field.value([0.0, 0.0, 0.0]), 5.0);
    assert_eq!(field.gradient([0.0, 0.0, 0.0]), Some([-0.6000000000000001, -0.8, 0.0]));
    assert_eq!(field.gradient(field.centre), None);
    assert_eq!(SphereDistance::new([11, 21, 31]).centre, [5.0, 10.0, 15.0]);
    assert_eq!(SphereDistance::new([11, 21, 31]).radius, 4.0);
}

#[test]
fn the_plane_passes_through_the_middle_and_is_exact_in_single_precision() {
    let field = PlaneRamp::new([9, 9, 9]);
    assert_eq!(field.value([4.0, 4.0, 4.0]), field.suggested_isovalue());
    assert_eq!(field.value([2.0, 3.0, 5.0]), 2.0 + 1.5 + 1.25);
    assert!(samples(&field, [9, 9, 9]).iter().all(|&v| (f64::from(v) * 4.0).fract() == 0.0));
    let moved = PlaneRamp { offset: 100.0, ..field };
    assert_eq!(moved.value([4.0, 4.0, 4.0]), moved.suggested_isovalue());
}

#[test]
fn marschner_lobb_has_its_published_values() {
    let field = MarschnerLobb::new([41, 41, 41]);
    // In the middle z = r = 0: (1 + 0.25 (1 + cos 12 pi)) / 2.5.
    assert!((field.value([20.0; 3]) - 0.6).abs() < 1e-15);
    // At the top of the axis the sine is 1; at the bottom it is -1.
    assert!((field.value([20.0, 20.0, 40.0]) - 0.2).abs() < 1e-15);
    assert!((field.value([20.0, 20.0, 0.0]) - 1.0).abs() < 1e-15);
    // The formula in the standard library's functions at some off-grid position.
    let [x, y, z] = [0.35, -0.6, 0.15_f64];
    let r = x.hypot(y);
    let rings = (12.0 * std::f64::consts::PI * (std::f64::consts::FRAC_PI_2 * r).cos()).cos();
    let expected = (1.0 - (std::f64::consts::FRAC_PI_2 * z).sin() + 0.25 * (1.0 + rings)) / 2.5;
    let p = [x, y, z].map(|u| 20.0 * (u + 1.0));
    assert!((field.value(p) - expected).abs() < 1e-13);
}

#[test]
fn the_gyroid_repeats_and_is_odd_about_its_centre() {
    let field = Gyroid::new([65, 65, 65]);
    assert_eq!(field.period, 16.0);
    assert_eq!(field.value([32.0; 3]), 0.0);
    assert_eq!(field.value([36.0, 32.0, 32.0]), 1.0);
    assert_eq!(field.value([52.0, 32.0, 32.0]), 1.0);
    let (a, b) = (field.value([30.0, 37.0, 33.5]), field.value([34.0, 27.0, 30.5]));
    assert!((a + b).abs() < 1e-15 && a.abs() > 0.1);
}

#[test]
fn shells_have_the_plateaus_of_a_scan() {
    let mut field = Shells::new([129, 129, 129]);
    assert_eq!(field.suggested_isovalue(), 1024.0 + 575.0);
    // Air in the corner, with noise inside its bounds.
    assert!((field.value([0.0; 3]) - 24.0).abs() <= 12.0 * 3.46);
    assert!(field.value([0.0; 3]) != 24.0);
    field.noise = 0.0;
    field.offset = 5000.0;
    assert_eq!(field.value([0.0; 3]), 4000.0);
    assert!((field.value([64.0; 3]) - 5005.0).abs() < 1e-9);
    // Bone lies between the radii 0.58 and 0.70 (of 64 voxels).
    assert!((field.value([64.0 + 0.64 * 64.0, 64.0, 64.0]) - 6100.0).abs() < 300.0);
    assert!((field.value([64.0 + 0.40 * 64.0, 64.0, 64.0]) - 5035.0).abs() < 1e-9);
}

#[test]
fn turbulence_has_two_fluids_and_detail_that_grows_with_the_volume() {
    assert_eq!([32, 64, 256, 1024].map(|n| Turbulence::new([n; 3]).octaves()), [1, 2, 4, 6]);
    let dims = [64, 64, 64];
    let mut field = Turbulence::new(dims);
    let all = samples(&field, dims);
    assert!(all.iter().all(|v| (1.0..=3.0).contains(v)));
    let share =
        |part: &[f32]| part.iter().filter(|v| **v >= 2.0).count() as f64 / part.len() as f64;
    let layer = 64 * 64;
    assert!(share(&all[..8 * layer]) < 0.2, "light fluid below");
    assert!(share(&all[56 * layer..]) > 0.8, "heavy fluid above");
    assert!((share(&all) - 0.5).abs() < 0.1);
    field.mixing = 0.0;
    assert_eq!(field.value([3.0, 9.0, 31.5]), 2.0);
}

#[test]
fn the_rough_solid_is_porous_and_speckled() {
    let dims = [64, 64, 64];
    let field = RoughSolid::new(dims);
    let noisy = samples(&field, dims);
    let mut quiet = field.clone();
    quiet.noise = 0.0;
    let clean = samples(&quiet, dims);
    let iso = field.suggested_isovalue() as f32;
    let solid = clean.iter().filter(|v| **v >= iso).count() as f64 / clean.len() as f64;
    assert!((0.25..0.65).contains(&solid), "solid share {solid}");
    let flipped = noisy.iter().zip(&clean).filter(|(n, c)| (**n >= iso) != (**c >= iso)).count();
    let share = flipped as f64 / clean.len() as f64;
    assert!((0.002..0.2).contains(&share), "flipped share {share}");
}

#[test]
fn the_patch_is_the_same_in_every_volume_and_constant_at_its_faces() {
    let (small, large) = (Patch::new([256; 3]), Patch::new([768, 512, 256]));
    assert_eq!(small.ball().0, [127.5; 3]);
    let offset = [256.0, 128.0, 0.0];
    assert_eq!(large.ball().0, [0, 1, 2].map(|a| 127.5 + offset[a]));
    for p in [[40.0, 128.0, 70.0], [7.0, 9.0, 30.0], [3.0, 128.0, 128.0], [250.0; 3]] {
        assert_eq!(small.value(p), large.value([0, 1, 2].map(|a| p[a] + offset[a])));
    }
    for face in [[2.0, 128.0, 128.0], [128.0, 253.0, 128.0], [128.0, 128.0, 252.0]] {
        assert_eq!(small.value(face), 1.0);
        assert_eq!(small.constant(face, face), Some(1.0));
    }
    assert_eq!(small.constant([0.0; 3], [4.0, 255.0, 255.0]), Some(1.0));
    assert_eq!(small.constant([0.0; 3], [5.0; 3]), None);
    assert_eq!(large.value([100.0; 3]), 1.0);
}

#[test]
fn the_mixing_layer_ends_in_pure_fluids() {
    let dims = [64, 48, 128];
    let field = MixingLayer::new(dims);
    let all = samples(&field, dims);
    let layer = 64 * 48;
    assert!(all[..32 * layer].iter().all(|v| *v == 0.0));
    assert!(all[96 * layer..].iter().all(|v| *v == 255.0));
    let mixed = &all[40 * layer..88 * layer];
    let share =
        mixed.iter().filter(|v| **v > 0.0 && **v < 255.0).count() as f64 / mixed.len() as f64;
    assert!(share > 0.3, "share {share}");
    for z in 0..32 {
        let box_of = |z: u32| ([0.0, 0.0, f64::from(4 * z)], [63.0, 47.0, f64::from(4 * z + 3)]);
        let (low, high) = box_of(z);
        if let Some(value) = field.constant(low, high) {
            let part = &all[4 * z as usize * layer..(4 * z as usize + 4) * layer];
            assert!(part.iter().all(|v| f64::from(*v) == value), "z block {z}");
        }
    }
}

#[test]
fn blocks_have_the_bits_of_single_values() {
    for name in NAMES {
        let field = by_name(name, DIMS).unwrap();
        for origin in [[0, 0, 0], [12, 8, 24], [44, 36, 52]] {
            let block = field.block(origin);
            for (i, sample) in block.into_iter().enumerate() {
                let offset = [i % 4, i / 4 % 4, i / 16];
                let p = [0, 1, 2].map(|a| f64::from(origin[a]) + offset[a] as f64);
                assert_eq!(sample.to_bits(), (field.value(p) as f32).to_bits(), "{name} {p:?}");
            }
        }
    }
}

#[test]
fn every_name_gives_its_field_and_another_name_lists_them() {
    for name in NAMES {
        let field = by_name(name, DIMS).unwrap();
        assert_eq!(field.name(), *name);
        // The suggested surface exists.
        let iso = field.suggested_isovalue() as f32;
        let all = samples(&*field, DIMS);
        assert!(all.iter().any(|v| *v >= iso) && all.iter().any(|v| *v < iso), "{name}");
    }
    let error = by_name("bunny", DIMS).err().unwrap();
    let text = error.to_string();
    assert!(text.contains("bunny") && NAMES.iter().all(|name| text.contains(name)), "{text}");
}

#[test]
fn seeds_change_the_noise_and_nothing_else() {
    let p = [20.0, 11.0, 30.0];
    let noisy: [fn(u32) -> Box<dyn Field>; 4] = [
        |seed| Box::new(Shells::with_seed(DIMS, seed)),
        |seed| Box::new(Turbulence::with_seed(DIMS, seed)),
        |seed| Box::new(RoughSolid::with_seed(DIMS, seed)),
        |seed| Box::new(MixingLayer::with_seed(DIMS, seed)),
    ];
    for make in noisy {
        assert_eq!(make(1).value(p).to_bits(), make(1).value(p).to_bits());
        assert!(make(1).value(p) != make(2).value(p), "{}", make(1).name());
        assert_eq!(make(1).suggested_isovalue(), make(2).suggested_isovalue());
        let default = by_name(make(1).name(), DIMS).unwrap();
        assert_eq!(make(1).value(p), default.value(p), "the default seed is 1");
    }
}

#[test]
fn degenerate_dimensions_give_finite_samples() {
    for name in NAMES {
        for dims in [[1, 1, 1], [1, 7, 2], [3, 1, 9]] {
            let field = by_name(name, dims).unwrap();
            assert!(samples(&*field, dims).iter().all(|v| v.is_finite()), "{name} {dims:?}");
        }
    }
}

/// FNV-1a over the bits of all samples.
fn checksum(samples: &[f32]) -> u64 {
    samples.iter().flat_map(|v| v.to_le_bytes()).fold(0xcbf2_9ce4_8422_2325, |hash, byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3)
    })
}

#[test]
fn samples_have_the_same_bits_on_every_platform() {
    let found: Vec<(&str, u64)> = NAMES
        .iter()
        .map(|name| (*name, checksum(&samples(&*by_name(name, DIMS).unwrap(), DIMS))))
        .collect();
    assert_eq!(found, CHECKSUMS);
}

const CHECKSUMS: [(&str, u64); 13] = [
    ("sphere", 0xf387_3c9f_0460_08c5),
    ("plane", 0x4712_0522_6624_8437),
    ("marschner-lobb", 0xc95b_6947_d5fb_ef6d),
    ("gyroid", 0x309e_347b_69f0_a115),
    ("shells", 0x9a62_279d_3cda_ee9e),
    ("turbulence", 0x9bff_17da_2aa7_ed7e),
    ("rough-solid", 0xf6a1_73e7_58f7_150a),
    ("patch", 0x9c8b_ed88_4b1e_a719),
    ("mixing-layer", 0xbcca_73d8_9cc3_2896),
    ("blobs", 0xac15_3fac_87f9_de36),
    ("sheets", 0x9732_199b_fe8b_6a5c),
    ("tubes", 0x295a_d636_66ac_5a6a),
    ("labels", 0x46b1_aae8_5dff_7cd8),
];
