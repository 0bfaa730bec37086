//! Watertightness by the billion: from within a closed surface every ray must hit. Both ends of every ray
//! are known by construction (all samples around the eye are inside, all samples of the volume's sides
//! are outside), so the counters of rays and hits tell, and nothing is read back.

use progressive_iso::{
    Camera, Frame, FrameOptions, ProgressiveIsoRenderer, RendererOptions, Residency, wgpu,
};
use serde::Serialize;

use super::case::{Case, Volume};
use super::cases::{checkerboard, distance, hash};
use super::random::Random;
use super::row::Failure;
use super::views::aspect;

const DIMS: [u32; 3] = [23, 21, 25];
const CENTER: [f64; 3] = [11.0, 10.0, 12.0];
/// As many rays as one round takes.
const SIZE: [u32; 2] = [2048, 1024];

/// What came of it.
#[derive(Clone, Debug, Default, Serialize)]
pub struct MassReport {
    pub seed: u64,
    pub rays: u64,
    pub pictures: u64,
    pub entered: u64,
    pub hits: u64,
    /// Rays that did not hit.
    pub violations: u64,
    pub by_field: Vec<FieldReport>,
    pub problems: Vec<String>,
}

/// The rays of one field.
#[derive(Clone, Debug, Serialize)]
pub struct FieldReport {
    pub field: String,
    pub rays: u64,
    pub violations: u64,
}

impl MassReport {
    pub fn ok(&self) -> bool {
        self.violations == 0 && self.problems.is_empty()
    }
}

/// Inside around the centre, outside on all sides, anything between.
fn closed(name: &str, isovalue: f32, ends: [f64; 2], value: impl Fn([f64; 3]) -> f64) -> Case {
    let [inside, outside] = ends;
    let filled = move |p: [f64; 3]| {
        let border = (0..3).any(|a| p[a] == 0.0 || p[a] == f64::from(DIMS[a]) - 1.0);
        let near = (0..3).all(|a| (p[a] - CENTER[a]).abs() <= 1.0);
        match (border, near) {
            (true, _) => outside,
            (_, true) => inside,
            _ => value(p),
        }
    };
    Case::new("mass", name, DIMS, filled).at(&[isovalue])
}

fn fields() -> Vec<Case> {
    let sign = |p, seed| if hash(p, seed) < 0.5 { 1.0 } else { -1.0 };
    vec![
        closed("ball", 0.0, [9.0, -1.0], |p| 8.3 - distance(p, CENTER)),
        closed("noise", 0.0, [1.0, -1.0], |p| 2.0 * hash(p, 1) - 1.0),
        closed("noise of +1 and -1", 0.0, [1.0, -1.0], move |p| sign(p, 2)),
        closed("checkerboard", 0.0, [1.0, -1.0], checkerboard),
        closed("mostly inside", 0.0, [1.0, -1.0], |p| hash(p, 3) - 0.02),
        closed("isovalue equal to samples", 2.0, [4.0, 1.0], |p| 1.0 + (4.0 * hash(p, 4)).floor()),
        closed("one ulp above samples", 2f32.next_up(), [4.0, 1.0], |p| {
            1.0 + (4.0 * hash(p, 5)).floor()
        }),
        closed("magnitudes from 2^-20 to 2^20", 0.0, [1.0, -1.0], move |p| {
            sign(p, 6) * 2f64.powf(40.0 * hash(p, 7) - 20.0)
        }),
    ]
}

/// At least `rays` rays, shared among the fields.
pub fn run(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    rays: u64,
    seed: u64,
) -> Result<MassReport, Failure> {
    let per_picture = u64::from(SIZE[0] * SIZE[1]);
    let pictures = rays.div_ceil(per_picture).div_ceil(fields().len() as u64);
    sample(device, queue, SIZE, pictures, seed)
}

/// Some pictures of each field.
pub fn sample(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    size: [u32; 2],
    pictures: u64,
    seed: u64,
) -> Result<MassReport, Failure> {
    let mut report = MassReport { seed, ..MassReport::default() };
    let mut random = Random::new(seed);
    for case in fields() {
        let (rays, violations) = (report.rays, report.violations);
        let volume = sealed(&case)?;
        field(device, queue, &volume, &case, size, pictures, &mut random, &mut report)?;
        report.by_field.push(FieldReport {
            field: case.name,
            rays: report.rays - rays,
            violations: report.violations - violations,
        });
    }
    Ok(report)
}

/// The case's volume, whose ends decoding has left on their sides.
pub fn sealed(case: &Case) -> Result<Volume, Failure> {
    let volume = case.volume()?;
    check_ends(&volume, (case.isovalues)(&volume)[0])?;
    Ok(volume)
}

/// Counts the rays of pictures from within.
pub fn field(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    volume: &Volume,
    case: &Case,
    size: [u32; 2],
    pictures: u64,
    random: &mut Random,
    report: &mut MassReport,
) -> Result<(), Failure> {
    let isovalue = (case.isovalues)(volume)[0];
    let options =
        RendererOptions { size, residency: Residency::Full, ..RendererOptions::default() };
    let mut renderer =
        ProgressiveIsoRenderer::new(device, queue, volume.compressed.clone(), options)?;
    for _ in 0..pictures {
        let camera = camera(volume, size, random);
        let options = FrameOptions { pass_ms: f32::INFINITY, ..FrameOptions::default() };
        renderer.set_frame(&Frame { camera, isovalues: vec![isovalue], options })?;
        let done = renderer.render_to_completion(device, queue, |_, _| true)?;
        let rays = u64::from(size[0] * size[1]);
        report.rays += rays;
        report.pictures += 1;
        report.entered += u64::from(done.entered_rays);
        report.hits += u64::from(done.hits);
        let missed = rays - u64::from(done.hits);
        report.violations += missed;
        if missed > 0 && report.problems.len() < 5 {
            report.problems.push(format!("{}: {missed} rays miss with {camera:?}", case.name));
        }
    }
    Ok(())
}

/// What decoding left of the ends: it must not have moved a sample across the isovalue.
fn check_ends(volume: &Volume, isovalue: f32) -> Result<(), Failure> {
    let last = volume.dims.map(|n| n - 1);
    for (n, &value) in volume.samples.iter().enumerate() {
        let n = n as u32;
        let p = [n % DIMS[0], n / DIMS[0] % DIMS[1], n / (DIMS[0] * DIMS[1])];
        let border = (0..3).any(|a| p[a] == 0 || p[a] == last[a]);
        let near = (0..3).all(|a| (f64::from(p[a]) - CENTER[a]).abs() <= 1.0);
        if (border && value >= isovalue) || (near && value < isovalue) {
            return Err(format!("the sample at {p:?} is on the wrong side: {value}").into());
        }
    }
    Ok(())
}

/// From within half a voxel of the centre, or exactly from it, in any direction.
fn camera(volume: &Volume, size: [u32; 2], random: &mut Random) -> Camera {
    let offset = random.vector(-0.5, 0.5);
    let exact = random.below(4) == 0;
    let eye = [0, 1, 2].map(|a| if exact { CENTER[a] } else { CENTER[a] + offset[a] });
    let direction = match random.below(4) {
        0 => [[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [1.0, 1.0, 1.0]][random.below(3) as usize],
        _ => random.direction(),
    };
    let target = [0, 1, 2].map(|a| eye[a] + direction[a]);
    let (eye, target) = (volume.world(eye), volume.world(target));
    let fov = random.between(1.0, 120.0);
    Camera::perspective(eye, target, random.direction(), fov, aspect(size), 0.01, 100.0)
}
