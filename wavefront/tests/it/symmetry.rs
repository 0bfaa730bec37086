//! P12: a volume whose axes are exchanged or reversed, seen by a camera that went along, makes the same
//! picture: hits within the sum of both pictures' bounds, the same mask but for ties.

use glam::DMat4;
use gpu_testkit::bounds::RayErrors;
use gpu_testkit::judge::{Answer, Judge, Verdict};
use wavefront::Camera;

use crate::harness::{Field, Shot, Stage, WIDTH, along_axis, look, orbit};

const HEIGHT: u32 = 40;
const DIMS: [u32; 3] = [19, 26, 23];

/// Axis `axes[a]` of the original becomes axis `a`; reversed where `flips[a]`.
#[derive(Clone, Copy, Debug)]
struct Symmetry {
    axes: [usize; 3],
    flips: [bool; 3],
}

impl Symmetry {
    fn dims(&self) -> [u32; 3] {
        self.axes.map(|axis| DIMS[axis])
    }

    /// The original position of a position here.
    fn original(&self, p: [u32; 3]) -> [u32; 3] {
        let mut original = [0; 3];
        for a in 0..3 {
            let axis = self.axes[a];
            original[axis] = if self.flips[a] { DIMS[axis] - 1 - p[a] } else { p[a] };
        }
        original
    }

    fn field(&self, field: &Field) -> Field {
        Field::new(self.dims(), |p| field.at(self.original(p).map(|v| v as i32)))
    }

    /// From positions here to the original's.
    fn matrix(&self) -> DMat4 {
        let mut columns = [[0.0; 4]; 4];
        columns[3][3] = 1.0;
        for a in 0..3 {
            let axis = self.axes[a];
            columns[a][axis] = if self.flips[a] { -1.0 } else { 1.0 };
            columns[3][axis] = if self.flips[a] { f64::from(DIMS[axis]) - 1.0 } else { 0.0 };
        }
        DMat4::from_cols_array_2d(&columns)
    }

    fn camera(&self, camera: &Camera) -> Camera {
        let view = DMat4::from_cols_array_2d(&camera.view_from_world) * self.matrix();
        Camera { view_from_world: view.to_cols_array_2d(), ..*camera }
    }
}

/// Every pixel against the reference on its own volume.
fn verdicts(stage: &Stage, shot: &Shot<'_>) -> Vec<Verdict> {
    let (picture, view) = (stage.render(shot), shot.view());
    let judge = Judge::new(shot.field.dims, &shot.field.samples, f64::from(shot.isovalue));
    let errors = RayErrors::new([WIDTH, shot.height], view.start_depth(), |p| view.ray(p));
    let verdict = |i: u32| {
        let pixel = [i % WIDTH, i / WIDTH];
        let sight = errors.sight(pixel, view.ray(pixel));
        let truth = judge.truth(&sight, judge.scene().trace(&sight.ray));
        judge.verdict(&sight, &truth, picture.depth(i as usize))
    };
    (0..WIDTH * shot.height).map(verdict).collect()
}

/// Pixels that may differ; an error where others do.
fn differ(a: &[Verdict], b: &[Verdict]) -> Result<usize, String> {
    let mut ties = 0;
    for (pixel, (a, b)) in a.iter().zip(b).enumerate() {
        if a.answer.is_wrong() || b.answer.is_wrong() {
            return Err(format!("pixel {pixel}: {a:?}, {b:?}"));
        }
        if a.answer == Answer::Tie || b.answer == Answer::Tie {
            ties += 1;
            continue;
        }
        let same = match (a.t.zip(a.parameter), b.t.zip(b.parameter)) {
            (Some((t, m)), Some((u, n))) => (t - u).abs() <= m.bound + n.bound,
            (None, None) => a.t.is_none() && b.t.is_none(),
            _ => false,
        };
        if !same {
            return Err(format!("pixel {pixel}: {a:?}, {b:?}"));
        }
    }
    Ok(ties)
}

fn field() -> Field {
    Field::new(DIMS, |[x, y, z]| {
        let [x, y, z] = [x as f32 * 0.7, y as f32 * 0.6, z as f32 * 0.8];
        x.sin() * y.cos() + y.sin() * z.cos() + z.sin() * x.cos() + 0.01 * x
    })
}

fn cameras() -> [Camera; 4] {
    [
        orbit(DIMS, 35.0, 20.0, HEIGHT),
        orbit(DIMS, -140.0, -50.0, HEIGHT),
        look([9.0, 12.5, 11.0], [0.0, 20.0, 3.0], HEIGHT),
        along_axis(1, [9.3, 12.1, 11.7], 3.0, true, HEIGHT),
    ]
}

fn shot<'a>(field: &'a Field, camera: Camera) -> Shot<'a> {
    Shot { field, isovalue: 0.2, camera, height: HEIGHT }
}

#[test]
fn exchanged_and_reversed_axes_show_the_same_picture() {
    let (stage, field) = (Stage::new(), field());
    let symmetries = [
        ([1, 0, 2], [false; 3]),
        ([2, 0, 1], [false; 3]),
        ([0, 1, 2], [true, false, false]),
        ([0, 1, 2], [false, true, true]),
        ([2, 1, 0], [true; 3]),
    ];
    for (n, camera) in cameras().into_iter().enumerate() {
        let original = verdicts(&stage, &shot(&field, camera));
        let hits = original.iter().filter(|v| v.t.is_some()).count();
        assert!(hits > 500, "camera {n}: {hits} hits");
        for (axes, flips) in symmetries {
            let symmetry = Symmetry { axes, flips };
            let other = symmetry.field(&field);
            let found = verdicts(&stage, &shot(&other, symmetry.camera(&camera)));
            let ties = differ(&original, &found)
                .unwrap_or_else(|problem| panic!("camera {n}, {symmetry:?}: {problem}"));
            assert!(ties <= 3, "camera {n}, {symmetry:?}: {ties} ties");
        }
    }
}

/// A camera that stays where it was makes another picture.
#[test]
fn another_picture_is_noticed() {
    let (stage, field) = (Stage::new(), field());
    let [camera, ..] = cameras();
    let original = verdicts(&stage, &shot(&field, camera));
    let mirrored = Symmetry { axes: [0, 1, 2], flips: [true, false, false] }.field(&field);
    let found = verdicts(&stage, &shot(&mirrored, camera));
    assert!(differ(&original, &found).is_err());
}
