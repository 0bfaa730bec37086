//! Rays, cameras and transforms.

use progressive_iso::{Camera, CompressedVolume};

use super::shapes::{distance, gyroid};
use crate::suite::case::{Case, Matrix, View, Volume};
use crate::suite::views::{Effort, aspect, looking, parallel, view};

const GROUP: &str = "geometry";
const DIMS: [u32; 3] = [38, 33, 41];
const CENTER: [f64; 3] = [18.4, 16.2, 20.3];
const RADIUS: f32 = 13.25;

/// Directions along axes, faces' diagonals and space diagonals, with zeros of both signs.
const DIRECTIONS: [[f64; 3]; 10] = [
    [1.0, 0.0, 0.0],
    [-1.0, -0.0, 0.0],
    [0.0, 1.0, -0.0],
    [-0.0, 0.0, -1.0],
    [1.0, 1.0, 0.0],
    [0.0, -1.0, 1.0],
    [-1.0, 0.0, -1.0],
    [1.0, 1.0, 1.0],
    [-1.0, 1.0, -1.0],
    [-1.0, -1.0, -1.0],
];

pub fn cases() -> Vec<Case> {
    let mut cases = vec![
        lattice("along axes and diagonals through voxels", [18.0, 16.0, 20.0], 1.0),
        lattice("the same between voxels", [18.5, 16.5, 20.5], 2.0),
        lattice("through corners, edges and faces of blocks", [20.0, 16.0, 20.0], 0.25),
        lattice("through corners, edges and faces of coarse cells", [16.0; 3], 0.0625),
        vertices(),
        inside(),
        pocket(),
    ];
    let cameras: [fn() -> Case; 5] = [far, narrow, narrower, wide, oblique];
    cases.extend(cameras.iter().flat_map(|case| [case(), case().own_rays()]));
    cases.extend(transforms());
    cases
}

fn gyroid_case(name: &str) -> Case {
    Case::new(GROUP, name, DIMS, gyroid).at(&[0.1])
}

fn ball(name: &str) -> Case {
    Case::new(GROUP, name, DIMS, |p| distance(p, CENTER)).at(&[RADIUS]).closed()
}

/// Parallel rays in special directions, one of them through `center`.
fn lattice(name: &str, center: [f64; 3], per_voxel: f64) -> Case {
    gyroid_case(name).seen(move |volume, _, effort| {
        let size = effort.size().map(|n| n | 1);
        DIRECTIONS.iter().map(|&d| parallel(volume, center, d, per_voxel, size)).collect()
    })
}

/// A perspective view whose slopes are multiples of 1/8, from an eye on a vertex: every eighth voxel on
/// its way a ray meets a vertex or an edge.
fn vertices() -> Case {
    gyroid_case("perspective rays through vertices and edges").seen(|volume, _, effort| {
        let size = effort.size().map(|n| n | 1);
        let fov = 2.0 * (f64::from(size[1]) / 16.0).atan().to_degrees();
        let from = |eye: [f64; 3], axis: usize| {
            let target = [0, 1, 2].map(|a| if a == axis { eye[a] + 50.0 } else { eye[a] });
            let up = if axis == 1 { [1.0, 0.0, 0.0] } else { [0.0, 1.0, 0.0] };
            let [eye, target] = [eye, target].map(|p| volume.world(p));
            view(Camera::perspective(eye, target, up, fov, aspect(size), 0.01, 200.0), size)
        };
        let eyes = [[-8.0, 16.0, 20.0], [16.0, -8.0, 16.0], [20.0, 16.0, -4.0], [16.0, 16.0, 16.0]];
        eyes.iter().enumerate().map(|(n, &eye)| from(eye, n % 3)).collect()
    })
}

/// Eyes on a vertex, an edge, a face, block and coarse corners inside a ball: every ray must hit.
fn inside() -> Case {
    let case = ball("an eye in a ball, on vertices, edges, faces and block corners");
    case.all_hit().seen(|volume, _, effort| {
        let eyes = [
            [18.0, 16.0, 20.0],
            [18.0, 16.0, 20.5],
            [18.0, 16.5, 20.5],
            [20.0, 16.0, 20.0],
            [16.0, 16.0, 16.0],
            [18.4, 16.2, 20.3],
        ];
        let from = |eye: [f64; 3]| {
            let targets = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.3], [-0.4, 0.2, -1.0]];
            targets.map(|d| {
                let target = [0, 1, 2].map(|a| eye[a] + d[a]);
                looking(volume, eye, target, 100.0, effort.size())
            })
        };
        eyes.into_iter().flat_map(from).collect()
    })
}

/// Eyes inside the volume where no block is active.
fn pocket() -> Case {
    gyroid_and_ball("an eye in an inactive pocket", |volume, effort| {
        let corner = looking(volume, [0.5, 0.5, 0.5], CENTER, 60.0, effort.size());
        let middle = looking(volume, CENTER, [0.0, 10.0, 0.0], 120.0, effort.size());
        vec![corner, middle]
    })
}

fn gyroid_and_ball(name: &str, views: impl Fn(&Volume, Effort) -> Vec<View> + 'static) -> Case {
    ball(name).seen(move |volume, _, effort| views(volume, effort))
}

/// A perspective view from `distance` voxels away.
fn from_afar(volume: &Volume, distance: f64, fov: f64, effort: Effort) -> View {
    let away = [0.36, 0.48, 0.8];
    let center = volume.world(CENTER);
    let eye = [0, 1, 2].map(|a| center[a] + distance * away[a]);
    let size = effort.size();
    let (near, far) = (distance - 100.0, distance + 100.0);
    let up = [0.0, 1.0, 0.0];
    view(Camera::perspective(eye, center, up, fov, aspect(size), near, far), size)
}

fn far() -> Case {
    let fov = 2.0 * (16e-6f64).atan().to_degrees();
    ball("an eye 1e6 voxels away")
        .seen(move |volume, _, effort| vec![from_afar(volume, 1e6, fov, effort)])
}

fn narrow() -> Case {
    ball("fields of view of 1 and 0.1 degrees").seen(|volume, _, effort| {
        vec![from_afar(volume, 1500.0, 1.0, effort), from_afar(volume, 150.0, 0.1, effort)]
    })
}

fn narrower() -> Case {
    ball("a field of view of 0.01 degrees").seen(|volume, _, effort| {
        vec![from_afar(volume, 120.0, 0.01, effort), from_afar(volume, 160_000.0, 0.01, effort)]
    })
}

fn wide() -> Case {
    gyroid_case("fields of view of 120 and 170 degrees").seen(|volume, _, effort| {
        let eye = [18.7, 16.1, 20.9];
        [120.0, 170.0].map(|fov| looking(volume, eye, [30.0, 20.0, 5.0], fov, effort.size())).into()
    })
}

fn oblique() -> Case {
    gyroid_case("orthographic, oblique").seen(|volume, _, effort| {
        [[0.3, -0.5, 0.8], [1.0, 1e-4, -1e-5], [1e-7, 1.0, 1e-9]]
            .map(|d| parallel(volume, CENTER, d, 3.0, effort.size()))
            .into()
    })
}

/// Rows of the linear part, and no shift.
fn rows(m: [[f64; 3]; 3]) -> Matrix {
    let column = |c: usize| [m[0][c], m[1][c], m[2][c], 0.0];
    [column(0), column(1), column(2), [5.0, -7.0, 11.0, 1.0]]
}

fn transforms() -> Vec<Case> {
    let placed = |spacing| CompressedVolume::placed(spacing, [100.0, -20.0, 3.0]);
    let cases = [
        ("spacing 1 : 1000 : 1", placed([1.0, 1000.0, 1.0])),
        ("spacing 0.001 : 1 : 0.03", placed([0.001, 1.0, 0.03])),
        ("sheared", rows([[1.0, 0.7, -0.4], [0.1, 1.0, 0.9], [0.0, -0.6, 1.0]])),
        ("mirrored in x", placed([-1.0, 1.0, 1.0])),
        ("mirrored in all axes", placed([-1.0, -1.0, -1.0])),
        ("rotated, mirrored, scaled", rows([[0.0, 3.0, 0.0], [0.0, 0.0, -2.0], [0.5, 0.0, 0.0]])),
    ];
    cases.map(|(name, matrix)| gyroid_case(name).placed(matrix)).into()
}
