//! P1, P2 and P9 on the twin: every change of sides along a ray is a hit, whatever the samples.

use macrocell::cpu::dda::Ray;
use proptest::prelude::*;
use wavefront::cpu::walk::{crossings, first_hit, steps};

use crate::harness::Field;

fn values() -> impl Strategy<Value = f32> {
    prop_oneof![
        3 => -1.0f32..1.0,
        // Plateaus, and values equal to the isovalue.
        2 => (-2i32..3).prop_map(|v| v as f32 * 0.25),
        1 => Just(0.0f32),
        1 => prop_oneof![Just(1e-30f32), Just(-1e-30), Just(1e30), Just(-1e30), Just(-0.0)],
    ]
}

fn fields() -> impl Strategy<Value = Field> {
    let dims = [2u32..11, 2..11, 2..11];
    dims.prop_flat_map(|dims| {
        let count = dims.iter().product::<u32>() as usize;
        prop::collection::vec(values(), count).prop_map(move |samples| Field { dims, samples })
    })
}

/// Directions with zeros, ties and everything between.
fn rays() -> impl Strategy<Value = Ray> {
    let coordinate = prop_oneof![
        2 => -6.0f32..16.0,
        2 => (-3i32..14).prop_map(|v| v as f32),
        1 => (-6i32..28).prop_map(|v| v as f32 * 0.5),
    ];
    let component = prop_oneof![
        3 => -1.0f32..1.0,
        2 => (-1i32..2).prop_map(|v| v as f32),
        1 => prop_oneof![Just(-0.0f32), Just(1e-7), Just(-1e-7)],
    ];
    let origin = [coordinate.clone(), coordinate.clone(), coordinate];
    let direction = [component.clone(), component.clone(), component];
    (origin, direction).prop_filter_map("a direction", |(origin, d)| {
        let length = d.iter().map(|v| v * v).sum::<f32>().sqrt();
        (length > 1e-3).then(|| Ray::new(origin, d.map(|v| v / length)))
    })
}

proptest! {
    #![proptest_config(gpu_testkit::property(10_000))]

    #[test]
    fn every_change_of_sides_is_a_hit(
        field in fields(),
        ray in rays(),
        isovalue in prop_oneof![Just(0.0f32), Just(0.25), Just(-0.5), -1.0f32..1.0],
    ) {
        let sample = |p: [i32; 3]| field.at(p);
        let steps = steps(&field.grid(), &ray, isovalue, &sample);
        let all = crossings(&steps).map_err(TestCaseError::fail)?;
        if let (Some(first), Some(last)) = (steps.first(), steps.last()) {
            let hits: usize = all.iter().map(|&(_, count)| count).sum();
            prop_assert_eq!(hits % 2 == 1, first.inside_low != last.inside_high);
        }
        // The walk that skips and goes block by block finds the first of them.
        let hit = first_hit(&field.grid(), &field.masks(isovalue), &ray, isovalue, &sample);
        prop_assert_eq!(hit.map(|h| h.cell), all.first().map(|&(cell, _)| cell));
        let unskipped = first_hit(&field.grid(), &field.all_active(), &ray, isovalue, &sample);
        prop_assert_eq!(hit, unskipped);
        if let Some(hit) = hit {
            let last = field.dims.map(|n| n as f32 - 1.0);
            prop_assert!(hit.t >= 0.0);
            for a in 0..3 {
                let position = ray.origin[a] + hit.t * ray.direction[a];
                prop_assert!(position > -1e-4 && position < last[a] + 1e-4);
            }
        }
    }
}

#[test]
fn a_wrong_side_is_noticed() {
    let field = Field::new([6, 6, 6], |[x, _, _]| x as f32 - 2.5);
    let ray = Ray::new([-1.0, 2.3, 2.6], [1.0, 0.0, 0.0]);
    let good = steps(&field.grid(), &ray, 0.0, &|p| field.at(p));
    assert_eq!(crossings(&good), Ok(vec![([2, 2, 2], 1)]));
    for n in 0..good.len() {
        let mut bad = good.clone();
        bad[n].inside_high = !bad[n].inside_high;
        assert!(crossings(&bad).is_err(), "step {n}");
    }
}
