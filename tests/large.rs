//! Streams that need more bits than a u32 counts and more bytes than a binding holds.

#![allow(clippy::unwrap_used, reason = "a failed set-up fails the test")]
#![allow(clippy::print_stdout, reason = "plans and reports, for people who look")]

use gpu_testkit::gpu;
use progressive_iso::{
    Camera, Capture, CompressedVolume, Frame, FrameOptions, Outputs, ProgressiveIsoRenderer,
    RendererOptions, Residency,
};

const SIZE: [u32; 2] = [96, 72];

fn render(volume: CompressedVolume, isovalue: f32, options: RendererOptions) -> Capture {
    let (device, queue) = gpu::device();
    let (center, radius) = volume.bounding_ball();
    let mut renderer = ProgressiveIsoRenderer::new(&device, &queue, volume, options).unwrap();
    let aspect = f64::from(SIZE[0]) / f64::from(SIZE[1]);
    let camera = Camera::orbit(center, 0.7 * radius, 25.0, 20.0, 40.0, aspect);
    let frame = Frame { camera, isovalues: vec![isovalue], options: FrameOptions::default() };
    renderer.set_frame(&frame).unwrap();
    let report = renderer.render_to_completion(&device, &queue, |_, _| true).unwrap();
    assert!(report.complete() && report.hits > 500, "{report:?}");
    assert!(report.peak_bytes <= renderer.plan().bytes(), "{}", renderer.plan().explain());
    println!("{}{report:?}", renderer.plan().explain());
    renderer.capture_blocking(&device, &queue).unwrap()
}

fn options(budget_bytes: u64) -> RendererOptions {
    RendererOptions {
        size: SIZE,
        budget_bytes,
        capture: true,
        outputs: Outputs { depth: true, ..Outputs::default() },
        residency: Residency::Cached,
        ..Default::default()
    }
}

/// Largest difference of two depths in voxels, and the number of pixels of which only one shows the surface.
fn difference(a: &Capture, b: &Capture) -> (f32, usize) {
    let (a, b) = (a.depth.as_ref().unwrap(), b.depth.as_ref().unwrap());
    assert_eq!(a.len(), b.len());
    let mut found = (0.0f32, 0);
    for (&a, &b) in a.iter().zip(b) {
        if a.is_finite() && b.is_finite() {
            found.0 = found.0.max((a - b).abs());
        } else {
            found.1 += usize::from(a.is_finite() != b.is_finite());
        }
    }
    found
}

/// A ball's distance field is smooth: with 1090 and with 2110 bits a block the samples differ by far less than
/// 0.001 voxels, while a block from a wrong place in the stream would be off by whole voxels.
#[test]
fn streams_beyond_128_and_512_mib_show_the_same_ball() {
    let dims = [512; 3];
    let field = volumes::by_name("sphere", dims).unwrap();
    let isovalue = field.suggested_isovalue() as f32;
    let [large, larger] = [(1090.0, 128), (2110.0, 512)].map(|(bits_per_block, mib)| {
        let stream = volumes::generate(&*field, dims, bits_per_block / 64.0).unwrap();
        let bytes = stream.bytes.len() as u64;
        assert!(bytes > mib << 20 && f64::from(stream.bits_per_block) == bits_per_block);
        render(CompressedVolume::try_from(&stream).unwrap(), isovalue, options(bytes + (96 << 20)))
    });
    let (depth, pixels) = difference(&large, &larger);
    println!("depths differ by {depth} voxels at most, the outline by {pixels} pixels");
    assert!(depth < 1e-3 && pixels <= 2);
    let mut other = large.clone();
    other.depth.as_mut().unwrap()[SIZE[0] as usize * 36 + 48] += 1.0;
    assert!(difference(&other, &larger).0 > 0.9, "the comparison sees one pixel");
}

#[test]
#[ignore = "a stream of 1 GB: some minutes and 5 GB of memory"]
fn eight_billion_voxels_within_two_gigabytes() {
    let dims = [2048, 2048, 1920];
    let field = volumes::by_name("mixing-layer", dims).unwrap();
    let isovalue = field.suggested_isovalue() as f32;
    let stream = volumes::generate(&*field, dims, 1.0).unwrap();
    assert!(stream.bytes.len() > 1_000_000_000);
    let volume = CompressedVolume::try_from(&stream).unwrap();
    drop(stream);
    let expected = render(volume.clone(), isovalue, options(2_000_000_000));
    let capped = RendererOptions { most_slots: Some(16_384), ..options(2_000_000_000) };
    assert!(render(volume, isovalue, capped) == expected);
}
