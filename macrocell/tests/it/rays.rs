//! Rays that are hard to trace, and the cells that they visit: all crossings of all planes, sorted.

use macrocell::Grid;
use macrocell::cpu::dda::{LEAST_DIRECTION, Ray};
use macrocell::cpu::skip::Masks;

use crate::common::Random;

fn direction(random: &mut Random) -> [f32; 3] {
    let sign = |random: &mut Random| random.choose(&[1.0f32, -1.0]);
    match random.below(8) {
        // Along one axis, with zeros of both signs.
        0 => {
            let axis = random.below(3) as usize;
            let mut direction: [f32; 3] = std::array::from_fn(|_| 0.0 * sign(random));
            direction[axis] = sign(random);
            direction
        }
        // In a plane.
        1 => {
            let mut direction: [f32; 3] = std::array::from_fn(|_| random.within(-1.0, 1.0));
            direction[random.below(3) as usize] = 0.0 * sign(random);
            direction
        }
        // Diagonals: crossings of two or three axes coincide.
        2 => std::array::from_fn(|_| sign(random)),
        3 => std::array::from_fn(|_| sign(random) * 0.577_350_26),
        // Small whole numbers lead from vertex to vertex.
        4 => std::array::from_fn(|_| random.below(7) as f32 - 3.0),
        // Components around the smallest one that counts.
        5 => std::array::from_fn(|_| {
            let tiny = [1.0, 1.0e-3, 1.0e-9, LEAST_DIRECTION, LEAST_DIRECTION * 0.99, 1.0e-20];
            sign(random) * random.choose(&tiny)
        }),
        _ => std::array::from_fn(|_| random.within(-1.0, 1.0)),
    }
}

/// Starts inside, on planes and vertices, outside and far away.
fn origin(dims: [u32; 3], direction: [f32; 3], random: &mut Random) -> [f32; 3] {
    let size = dims.map(|d| d as f32);
    let inside: [f32; 3] = std::array::from_fn(|a| random.unit() * size[a]);
    match random.below(6) {
        0 => inside,
        1 => inside.map(f32::floor),
        2 => inside.map(|v| if random.below(2) == 0 { v.floor() } else { v }),
        3 => std::array::from_fn(|a| random.within(-0.5, 1.5) * size[a]),
        // Back from a point or vertex inside.
        kind => {
            let target = if random.below(2) == 0 { inside } else { inside.map(f32::floor) };
            let far = if kind == 4 { 2.0 * size[0] } else { random.choose(&[64.0, 1.0e4, 1.0e8]) };
            std::array::from_fn(|a| target[a] - direction[a] * far)
        }
    }
}

pub(crate) fn ray(dims: [u32; 3], random: &mut Random) -> Ray {
    loop {
        let direction = direction(random);
        let ray = Ray::new(origin(dims, direction, random), direction);
        if ray.direction != [0.0; 3] {
            return ray;
        }
    }
}

pub(crate) fn rays(dims: [u32; 3], count: usize, seed: u64) -> Vec<Ray> {
    let mut random = Random::new(seed);
    (0..count).map(|_| ray(dims, &mut random)).collect()
}

/// Random masks; `sparse` of 64 empties whole coarse cells, 0 sets every bit.
pub(crate) fn masks(grid: &Grid, density: u32, random: &mut Random) -> Masks {
    let count = grid.coarse_count() as usize;
    let third = if grid.has_third_level() { grid.third_count() as usize } else { 0 };
    let mut words = vec![0u64; count + third];
    for index in 0..count {
        let coarse = grid.coarse_position(index as u64);
        for lane in 0..64u32 {
            let block: [u32; 3] = std::array::from_fn(|a| 4 * coarse[a] + (lane >> (2 * a) & 3));
            let present = (0..3).all(|a| 4 * block[a] + 1 < grid.dims()[a]);
            if present && random.below(64) < density {
                words[index] |= 1 << lane;
            }
        }
        // Some coarse cells stay empty, so that larger boxes are skipped.
        if density < 64 && random.below(3) != 0 {
            words[index] = 0;
        }
        if third > 0 && words[index] != 0 {
            let word = count + grid.third_index(coarse.map(|c| c / 4)) as usize;
            words[word] |= 1 << (coarse[0] % 4 + 4 * (coarse[1] % 4) + 16 * (coarse[2] % 4));
        }
    }
    Masks { words }
}

/// Every dual cell of the volume that the ray is in after some crossing or at its start, in order.
///
/// Crossings of all planes of the volume are made and sorted by parameter, axis, and order along the
/// axis; the start follows all crossings at `t <= 0`.
pub(crate) fn visited(grid: &Grid, ray: &Ray) -> Vec<[i32; 3]> {
    let last = grid.last_cell();
    let mut crossings = vec![(0.0f32, 3, 0, 0)];
    let mut cell = [0; 3];
    for axis in 0..3 {
        let (direction, origin) = (ray.direction[axis], ray.origin[axis]);
        if last[axis] < 0 {
            return Vec::new();
        }
        if direction == 0.0 {
            if !(0.0 <= origin && origin <= (last[axis] + 1) as f32) {
                return Vec::new();
            }
            cell[axis] = (origin.floor() as i32).min(last[axis]);
            continue;
        }
        cell[axis] = if direction > 0.0 { -1 } else { last[axis] + 1 };
        for plane in 0..=last[axis] + 1 {
            let t = (plane as f32 - origin) * ray.inverse[axis];
            let (rank, next) = if direction > 0.0 { (plane, plane) } else { (-plane, plane - 1) };
            crossings.push((t, axis, rank, next));
        }
    }
    crossings.sort_by(|a, b| a.0.total_cmp(&(b.0)).then((a.1, a.2).cmp(&(b.1, b.2))));
    let mut started = false;
    let mut cells = Vec::new();
    for (_, axis, _, next) in crossings {
        if axis == 3 {
            started = true;
        } else {
            cell[axis] = next;
        }
        if started && (0..3).all(|a| 0 <= cell[a] && cell[a] <= last[a]) {
            cells.push(cell);
        }
    }
    cells
}

#[test]
fn a_diagonal_through_vertices_visits_the_cells_between_in_axis_order() {
    let grid = Grid::new([4, 4, 4]);
    let ray = Ray::new([-1.0; 3], [1.0; 3]);
    let step = |n: i32| [[n, n - 1, n - 1], [n, n, n - 1], [n, n, n]];
    let mut expected = vec![[0, 0, 0]];
    expected.extend(step(1).into_iter().chain(step(2)));
    assert_eq!(visited(&grid, &ray), expected);
}

#[test]
fn known_walks() {
    let grid = Grid::new([4, 3, 2]);
    let walk = |origin, direction| visited(&grid, &Ray::new(origin, direction));
    assert_eq!(walk([-5.0, 0.5, 0.5], [1.0, 0.0, -0.0]), [[0, 0, 0], [1, 0, 0], [2, 0, 0]]);
    assert_eq!(walk([2.5, 1.5, 1.0], [-1.0, 0.0, 0.0]), [[2, 1, 0], [1, 1, 0], [0, 1, 0]]);
    assert_eq!(walk([1.0, 1.5, 0.5], [-1.0, 0.0, 0.0]), [[0, 1, 0]]);
    assert_eq!(walk([3.0, 2.0, 1.0], [0.0, -1.0, 0.0]), [[2, 1, 0], [2, 0, 0]]);
    assert!(walk([3.5, 2.0, 1.0], [0.0, -1.0, 0.0]).is_empty());
    assert!(walk([-1.0, 0.5, 0.5], [-1.0, 0.0, 0.0]).is_empty());
}
