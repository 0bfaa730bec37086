//! How much memory scenes take: the bars on bytes beside the compressed stream, and that plans say
//! what is allocated, phase by phase.

use progressive_iso::{
    Category, PassReport, RendererOptions, Residency, ScenePlan, StreamLayout, When, wgpu,
};

use crate::invariance::same_picture;
use crate::support::{Gpu, Scene, UNFINISHED, frame, options};

/// Colour alone, in a budget that never limits.
fn bare(most_slots: u64) -> RendererOptions {
    RendererOptions {
        size: [1280, 720],
        budget_bytes: 1 << 40,
        residency: Residency::Cached,
        most_slots: Some(most_slots),
        ..RendererOptions::default()
    }
}

/// Slots of the cache in the second half of the table.
const CAPPED: u64 = 131_072;

/// Dims, bits per voxel, slots that a picture's blocks take, and at most how many bytes beside the
/// stream: with these slots and with those that are capped.
const BARS: [([u32; 3], u32, u64, [u64; 2]); 4] = [
    ([256; 3], 4, 66_000, [35_000_000, 35_000_000]),
    ([512; 3], 4, 175_000, [70_000_000, 58_000_000]),
    ([1024; 3], 4, 652_000, [240_000_000, 93_000_000]),
    ([2048, 2048, 1920], 1, 2_039_000, [880_000_000, 335_000_000]),
];

#[test]
fn bytes_beside_the_stream_stay_below_the_bars() {
    println!("volume                   slots   overhead        bar");
    for (dims, bits_per_voxel, working_set, bars) in BARS {
        let layout = StreamLayout::new(dims, 64 * bits_per_voxel, 0).unwrap();
        for (slots, bar) in [working_set, working_set.min(CAPPED)].into_iter().zip(bars) {
            let plan =
                ScenePlan::for_layout(&layout, &bare(slots), &wgpu::Limits::default()).unwrap();
            let found = plan.overhead_bytes();
            let name = format!("{dims:?}");
            println!("{name:<20} {slots:>9} {found:>10} {bar:>10}");
            assert_eq!(plan.slots(), slots, "{name}");
            assert!(found <= bar, "{name}, {found} of {bar}\n{}", plan.explain());
        }
    }
}

/// A budget of exactly what rendering needs leaves room for loading, too.
#[test]
fn loading_needs_no_more_than_rendering_in_common_scenes() {
    for (dims, bits_per_voxel, slots, _) in BARS {
        let layout = StreamLayout::new(dims, 64 * bits_per_voxel, 0).unwrap();
        let plan = ScenePlan::for_layout(&layout, &bare(slots), &wgpu::Limits::default()).unwrap();
        assert!(plan.loading_bytes() <= plan.rendering_bytes(), "{}", plan.explain());
        assert_eq!(plan.bytes(), plan.rendering_bytes());
    }
}

fn planned(plan: &ScenePlan, names: &[&str]) -> u64 {
    plan.parts().iter().filter(|part| names.contains(&part.name)).map(|part| part.bytes).sum()
}

/// 256^3 voxels, which run here, with the slots of the bar.
#[test]
fn what_is_allocated_is_what_was_planned() {
    let gpu = Gpu::new();
    let (dims, bits_per_voxel, slots, bars) = BARS[0];
    let scene = Scene::generated("turbulence", dims, f64::from(bits_per_voxel));
    let mut renderer = gpu.renderer(&scene, bare(slots));
    let plan = renderer.plan().clone();
    let always = plan.parts().iter().filter(|part| part.when == When::Always);
    let always: u64 = always.map(|part| part.bytes).sum();
    // Staging of both directions is made when it is first needed.
    let staging = planned(&plan, &["parameters", "readback", "upload"]);
    assert!(renderer.poll_report().bytes <= plan.loading_bytes());
    assert!(renderer.poll_report().bytes + staging >= always);

    let view = frame(scene.orbit(30.0, 20.0, [1280, 720]), scene.isovalue);
    renderer.set_frame(&view).unwrap();
    let mut peaks = [0; 2];
    let mut see = |report: &PassReport| {
        peaks[usize::from(report.pass > 0)] = report.peak_bytes;
        true
    };
    renderer.render_to_completion(&gpu.device, &gpu.queue, |_, report| see(report)).unwrap();
    println!("planned {} and {}, peaks {peaks:?}", plan.loading_bytes(), plan.rendering_bytes());
    let [loading, rendering] = peaks;
    assert!(loading <= plan.loading_bytes() && loading + staging >= plan.loading_bytes());
    assert!(rendering <= plan.bytes());
    assert!(rendering - planned(&plan, &["payload"]) <= bars[0]);

    let bytes = renderer.poll_report().bytes;
    let staged = planned(&plan, &["parameters", "readback"]);
    assert!(bytes <= plan.rendering_bytes() && bytes + staged >= plan.rendering_bytes());
    let found = |category| {
        let all = renderer.bytes_by_category();
        all.iter().find(|(c, _)| *c == category).map_or(0, |&(_, bytes)| bytes)
    };
    assert_eq!(found(Category::Slots), 256 * slots);
    assert_eq!(found(Category::Ranges), planned(&plan, &["ranges"]));
    assert_eq!(found(Category::Outputs), planned(&plan, &["pictures"]));
}

/// What loading needs goes before the cache comes; pictures are there all the time.
#[test]
fn loading_and_rendering_share_memory() {
    let gpu = Gpu::new();
    let size = [64, 48];
    let scene = Scene::generated("gyroid", [130, 120, 110], 8.0);
    let mut renderer = gpu.renderer(&scene, options(size));
    renderer.set_frame(&scene.frame(scene.orbit(20.0, 30.0, size))).unwrap();
    let bytes_of = |renderer: &progressive_iso::ProgressiveIsoRenderer, category| {
        let all = renderer.bytes_by_category();
        all.iter().find(|(c, _)| *c == category).map_or(0, |&(_, bytes)| bytes)
    };
    let scratch = planned(renderer.plan(), &["range scratch"]);
    let mut loads = 0;
    while bytes_of(&renderer, Category::Slots) == 0 {
        assert!(bytes_of(&renderer, Category::Scratch) >= scratch - 1000);
        renderer.render_pass(&gpu.device, &gpu.queue).unwrap();
        let picture = renderer.capture_blocking(&gpu.device, &gpu.queue).unwrap();
        if bytes_of(&renderer, Category::Slots) == 0 {
            loads += 1;
            assert!(picture.color.chunks_exact(4).all(|pixel| pixel == UNFINISHED));
            assert!(picture.depth.unwrap().iter().all(|&depth| depth == f32::INFINITY));
            assert!(picture.normal.unwrap().iter().all(|&normal| normal == [0.0; 3]));
            let status = picture.status.unwrap();
            assert!(status.iter().all(|&s| s == progressive_iso::PixelStatus::Unfinished));
        }
    }
    assert!(loads > 0);
    assert!(bytes_of(&renderer, Category::Scratch) < scratch);
}

/// A change of size while the volume is on its way.
#[test]
fn sizes_may_change_while_loading() {
    let gpu = Gpu::new();
    let (first, size) = ([30, 20], [64, 48]);
    let scene = Scene::generated("gyroid", [130, 120, 110], 8.0);
    let view = scene.frame(scene.orbit(20.0, 30.0, size));
    let expected = gpu.render(&scene, options(size), &view);
    for residency in [Residency::Cached, Residency::Full] {
        let options = RendererOptions { residency, ..options(first) };
        let mut renderer = gpu.renderer(&scene, options);
        renderer.set_frame(&view).unwrap();
        renderer.render_pass(&gpu.device, &gpu.queue).unwrap();
        renderer.resize(&gpu.device, size).unwrap();
        same_picture(&gpu.finish(&mut renderer, &view), &expected).unwrap();
        assert!(renderer.poll_report().peak_bytes <= renderer.plan().bytes());
    }
}
