//! The example `render` as its users call it: options, exit codes, files written.

#![allow(clippy::unwrap_used, reason = "a failing test says where")]

mod cli;

use std::path::PathBuf;
use std::process::Output;

use cli::{path, read_json, text};

fn render(arguments: &[&str]) -> Output {
    cli::run("render", arguments)
}

/// Runs to success and returns what is printed.
fn succeed(arguments: &[&str]) -> String {
    cli::succeed("render", arguments)
}

/// Fails with exit code 2 and a message that contains all of `expected`.
fn refuse(arguments: &[&str], expected: &[&str]) {
    let output = render(arguments);
    let message = text(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{arguments:?}\n{message}");
    for part in expected {
        assert!(message.contains(part), "{arguments:?}: no \"{part}\" in\n{message}");
    }
}

fn folder(name: &str) -> PathBuf {
    cli::folder("render_cli", name)
}

/// Size and samples of the only channel, "Z".
fn read_exr(path: &str) -> ([usize; 2], Vec<f32>) {
    let image = exr::prelude::read_first_flat_layer_from_file(path).unwrap();
    let layer = &image.layer_data;
    let [channel] = &layer.channel_data.list[..] else { panic!("not one channel") };
    assert_eq!(channel.name.to_string(), "Z");
    ([layer.size.0, layer.size.1], channel.sample_data.values_as_f32().collect())
}

/// A NIfTI-1 file of 12x10x8 floats that hold their z index, 2x2x2 units apart.
fn nifti() -> Vec<u8> {
    let dims = [12u16, 10, 8];
    let mut file = vec![0u8; 352];
    file[0..4].copy_from_slice(&348i32.to_le_bytes());
    for (i, value) in [3, dims[0], dims[1], dims[2], 1, 1, 1, 1].into_iter().enumerate() {
        file[40 + 2 * i..][..2].copy_from_slice(&value.to_le_bytes());
    }
    file[70..72].copy_from_slice(&16i16.to_le_bytes()); // float
    file[72..74].copy_from_slice(&32i16.to_le_bytes()); // bits
    for i in 0..4 {
        file[76 + 4 * i..][..4].copy_from_slice(&[1.0f32, 2.0, 2.0, 2.0][i].to_le_bytes());
    }
    file[108..112].copy_from_slice(&352f32.to_le_bytes());
    file[344..348].copy_from_slice(b"n+1\0");
    for z in 0..dims[2] {
        for _ in 0..dims[0] * dims[1] {
            file.extend_from_slice(&f32::from(z).to_le_bytes());
        }
    }
    file
}

fn sphere() -> volume_io::ZfpVolume {
    let dims = [17, 14, 11];
    volumes::generate(&*volumes::by_name("sphere", dims).unwrap(), dims, 8.0).unwrap()
}

#[test]
fn writes_color_depth_and_report() {
    let folder = folder("files");
    let [color, depth, report] = ["c.png", "d.exr", "r.json"].map(|name| path(&folder, name));
    let printed = succeed(&[
        "--volume",
        "gyroid:24x20x16",
        "--rate",
        "12",
        "--size",
        "40x30",
        "--budget",
        "16",
        "--orbit",
        "-25,10.5",
        "--rounds-per-pass",
        "2",
        "--look-ahead",
        "3",
        "--color",
        &color,
        "--depth",
        &depth,
        "--report",
        &report,
    ]);
    assert!(printed.contains("suggested"), "{printed}");

    let picture = image::open(&color).unwrap().to_rgba8();
    assert_eq!(picture.dimensions(), (40, 30));
    let (size, depths) = read_exr(&depth);
    assert_eq!((size, depths.len()), ([40, 30], 1200));
    let report = read_json(&report);
    let hits = depths.iter().filter(|d| d.is_finite()).count();
    assert!(depths.iter().all(|d| *d > 0.0 && (d.is_finite() || *d == f32::INFINITY)));
    assert!(hits > 100 && hits < 1200, "{hits} pixels with a surface");
    let surface = picture.pixels().filter(|p| p.0 != [255; 4]).count();
    assert_eq!(surface, hits);

    let passes = report["passes"].as_array().unwrap();
    assert_eq!(passes.last().unwrap()["hits"], hits);
    assert_eq!(report["complete"], true);
    assert_eq!(report["completeness"], 1.0);
    assert_eq!(report["dims"], serde_json::json!([24, 20, 16]));
    assert_eq!(report["bits_per_block"], 12 * 64);
    assert_eq!(report["budget_bytes"], 16 << 20);
    for key in ["adapter", "volume", "isovalue", "size", "plan", "bytes_by_category", "setup_ms"] {
        assert!(!report[key].is_null(), "{key}");
    }
    for key in ["pass", "rounds", "ms", "entered_rays", "blocks_decoded", "bytes", "peak_bytes"] {
        assert!(passes.iter().all(|pass| pass[key].is_number()), "{key}");
    }
}

#[test]
fn takes_negative_values() {
    let folder = folder("negative");
    let [depth, report] = ["d.exr", "r.json"].map(|name| path(&folder, name));
    succeed(&[
        "--volume",
        "gyroid:16x16x16",
        "--origin",
        "-40,-8,-8",
        "--iso",
        "-0.2",
        "--eye",
        "-60,5,3",
        "--target",
        "-32,-0.5,-0.5",
        "--up",
        "0,-1,0",
        "--size",
        "32x32",
        "--depth",
        &depth,
        "--report",
        &report,
    ]);
    assert_eq!(read_json(&report)["isovalue"].as_f64().unwrap() as f32, -0.2);
    let (_, depths) = read_exr(&depth);
    // The volume's nearest corner is 20 units in front of the eye along x.
    let finite: Vec<f32> = depths.into_iter().filter(|d| d.is_finite()).collect();
    assert!(!finite.is_empty() && finite.iter().all(|d| (15.0..50.0).contains(d)));
}

#[test]
fn nifti_depth_is_the_distance_along_the_view_axis() {
    let folder = folder("nifti");
    let [volume, depth] = ["ramp.nii", "d.exr"].map(|name| path(&folder, name));
    std::fs::write(&volume, nifti()).unwrap();
    // The surface is the plane z = 2 * 3.5, and the eye lies 100 above it.
    let view = ["--eye", "11,9,107", "--target", "11,9,0", "--size", "24x16", "--depth", &depth];
    for projection in [["--fov", "20"], ["--ortho", "30"]] {
        let mut arguments = vec!["--volume", &volume, "--rate", "16", "--iso", "3.5"];
        arguments.extend(view);
        arguments.extend(projection);
        let printed = succeed(&arguments);
        for part in ["NIfTI", "12 x 10 x 8", "2, 2, 2", "PSNR"] {
            assert!(printed.contains(part), "no \"{part}\" in\n{printed}");
        }
        let (_, depths) = read_exr(&depth);
        assert!(depths.iter().any(|d| d.is_infinite()));
        let finite: Vec<f32> = depths.into_iter().filter(|d| d.is_finite()).collect();
        assert!(finite.len() > 50, "{projection:?}: {} pixels", finite.len());
        for d in finite {
            assert!((d - 100.0).abs() < 0.01, "{projection:?}: depth {d}");
        }
    }
}

#[test]
fn reads_streams_with_and_without_a_header_alike() {
    let folder = folder("streams");
    let [with, without] = ["with.zfp", "without.zfp"].map(|name| path(&folder, name));
    let volume = sphere();
    volume_io::write_zfp(&volume, std::fs::File::create(&with).unwrap()).unwrap();
    std::fs::write(&without, &volume.bytes).unwrap();
    let picture = |name: &str, arguments: &[&str]| {
        let depth = path(&folder, name);
        let common = ["--iso", "4", "--size", "20x20", "--depth", &depth];
        succeed(&[arguments, &common[..]].concat());
        read_exr(&depth)
    };
    let expected = picture("a.exr", &["--volume", &with]);
    assert!(expected.1.iter().any(|d| d.is_finite()));
    let found = picture("b.exr", &["--volume", &without, "--dims", "17,14,11", "--rate", "8"]);
    assert_eq!(found, expected);

    refuse(&["--volume", &without, "--iso", "4"], &["header", "--dims"]);
    refuse(&["--volume", &without, "--dims", "17,14,11"], &["--rate"]);
    refuse(&["--volume", &without, "--dims", "40,14,11", "--rate", "8"], &["7680", "3840", "hint"]);
}

#[test]
fn reads_raw_samples_of_a_given_type() {
    let folder = folder("raw");
    let volume = path(&folder, "ramp.bin");
    let samples: Vec<u8> = (0..10 * 9 * 8u16).flat_map(|i| (i % 10).to_be_bytes()).collect();
    std::fs::write(&volume, samples).unwrap();
    let layout = ["--dims", "10,9,8", "--type", "uint16", "--big-endian", "--rate", "16"];
    let printed = succeed(&[&["info", &volume], &layout[..]].concat());
    for part in ["u16 samples", "10 x 9 x 8", "0 to 9", "1024 bits per block"] {
        assert!(printed.contains(part), "no \"{part}\" in\n{printed}");
    }
    refuse(&["info", &volume, "--dims", "10,9,7", "--type", "uint16"], &["hint"]);
    refuse(&["info", &volume, "--dims", "10,9,8", "--type", "byte"], &["uint8"]);
    refuse(&["info", &volume, "--type", "uint8"], &["--dims"]);
}

#[test]
fn stops_early_on_request() {
    let folder = folder("stop");
    let report = path(&folder, "r.json");
    // A strategy that takes more than one pass, however small the volume is.
    let slow = ["--strategy", "block-sorted", "--no-speculation"];
    let stopped = ["--volume", "gyroid:24", "--stop", "0", "--size", "20x20", "--report", &report];
    succeed(&[&stopped[..], &slow].concat());
    let report = read_json(&report);
    assert_eq!(report["passes"].as_array().unwrap().len(), 1);
    assert_eq!(report["complete"], false);
}

#[test]
fn says_when_there_is_no_surface() {
    let printed = succeed(&["--volume", "sphere:8x8x8", "--iso", "1e6", "--size", "8x8"]);
    assert!(printed.contains("no surface"), "{printed}");
    assert!(printed.contains("nothing written"), "{printed}");
}

#[test]
fn refuses_unusable_input_with_a_hint() {
    let folder = folder("input");
    let [missing, garbage, short] =
        ["missing.zfp", "garbage.bin", "short.zfp"].map(|name| path(&folder, name));
    std::fs::write(&garbage, b"neither a volume nor a picture").unwrap();
    let mut stream = Vec::new();
    volume_io::write_zfp(&sphere(), &mut stream).unwrap();
    std::fs::write(&short, &stream[..stream.len() / 2]).unwrap();

    refuse(&["--volume", &missing, "--iso", "1"], &["missing.zfp", "hint"]);
    refuse(&["info", &missing], &["missing.zfp", "hint"]);
    refuse(&["info", folder.to_str().unwrap()], &["cannot access", "hint"]);
    refuse(&["--volume", &garbage, "--iso", "1"], &["garbage.bin", "hint"]);
    refuse(&["--volume", &short, "--iso", "1"], &["expected", "found"]);
    refuse(&["--volume", "blob:8x8x8"], &["no generator", "gyroid"]);
    refuse(&["--volume", "sphere:60000x60000x60000"], &["blocks"]);
    refuse(&["--volume", "sphere:8", "--rate", "1000"], &["rate", "--rate"]);
}

#[test]
fn refuses_unusable_options_with_a_hint() {
    let folder = folder("options");
    let nowhere = path(&folder, "none/c.png");
    let with = |arguments: &[&str], expected: &[&str]| {
        refuse(&[&["--volume", "sphere:8"], arguments].concat(), expected);
    };
    refuse(&[], &["Usage", "--volume"]);
    refuse(&["--iso", "1"], &["--volume"]);
    refuse(&["info"], &["FILE"]);
    refuse(&["--list-adapters", "--volume", "sphere:8"], &["--list-adapters"]);
    refuse(&["--volume", "sphere:8", "info", "x"], &["info"]);
    with(&["--isovalue", "1"], &["--isovalue", "--iso"]);
    with(&["--iso", "much"], &["--iso", "not a number"]);
    with(&["--iso", "nan"], &["not finite"]);
    with(&["--iso", "1e39"], &["32-bit"]);
    with(&["--iso", "3e38"], &["isovalue"]);
    with(&["--eye", "1,2"], &["expected 3 numbers"]);
    with(&["--eye", "1,2,3", "--orbit", "0,0"], &["cannot be used with"]);
    with(&["--target", "1,2,3"], &["--eye"]);
    with(&["--eye", "1,2,3", "--target", "1,2,3"], &["--eye and --target"]);
    with(&["--ortho", "3", "--fov", "30"], &["cannot be used with"]);
    with(&["--fov", "180"], &["--fov"]);
    with(&["--spacing", "1,0,1"], &["above 0"]);
    with(&["--size", "0x5"], &["above 0"]);
    with(&["--size", "4000000000x4000000000"], &["pixels", "--size"]);
    with(&["--budget", "1"], &["budget", "hint: --budget"]);
    with(&["--budget", "0"], &["--budget"]);
    with(&["--stop", "1.5"], &["0 to 1"]);
    with(&["--strategy", "fastest"], &["run-ahead"]);
    with(&["--adapter", "abacus"], &["abacus", "--list-adapters"]);
    with(&["--color", "c.jpg"], &[".png"]);
    with(&["--color", &nowhere], &["none", "hint"]);
    with(&["--dims", "8,8,8"], &["--rate"]);
}

#[test]
fn info_says_what_a_volume_holds() {
    let folder = folder("info");
    let volume = path(&folder, "ramp.nii");
    std::fs::write(&volume, nifti()).unwrap();
    let expected = [
        "NIfTI, f32 samples",
        "12 x 10 x 8 voxels",
        "512 bits per block",
        "2, 2, 2",
        "PSNR",
        "values ",
        "isovalue ",
        "suggested",
        "histogram",
        "####",
        "payload",
        "total",
        "64x48",
    ];
    let printed = succeed(&["info", &volume, "--size", "64x48"]);
    for part in expected {
        assert!(printed.contains(part), "no \"{part}\" in\n{printed}");
    }
    let counts = printed.lines().filter(|line| line.contains('#') && !line.contains("note"));
    let total: u64 =
        counts.map(|line| line.split_whitespace().last().unwrap().parse::<u64>().unwrap()).sum();
    assert_eq!(total, 12 * 10 * 8);
    refuse(&["info", &volume, "--budget", "1"], &["budget", "hint"]);
}

#[test]
fn helps_and_lists_adapters() {
    assert!(succeed(&["--help"]).contains("Examples:"));
    assert!(succeed(&["info", "--help"]).contains("Usage: render info"));
    assert!(!succeed(&["--list-adapters"]).trim().is_empty());
}

#[test]
fn both_strategies_write_the_same_picture() {
    let folder = folder("strategies");
    let settings: [&[&str]; 4] = [
        &["--strategy", "run-ahead", "--look-ahead", "3"],
        &["--strategy", "block-sorted"],
        &["--strategy", "block-sorted", "--start-factor", "4"],
        &["--strategy", "block-sorted", "--no-speculation"],
    ];
    let pictures = settings.iter().enumerate().map(|(i, setting)| {
        let file = path(&folder, &format!("{i}.png"));
        let mut arguments = vec!["--volume", "gyroid:24x24x24", "--size", "48x32"];
        arguments.extend_from_slice(setting);
        arguments.extend_from_slice(&["--color", &file]);
        succeed(&arguments);
        image::open(&file).unwrap().into_rgba8()
    });
    let pictures: Vec<_> = pictures.collect();
    assert!(pictures[0].pixels().any(|p| p != pictures[0].get_pixel(0, 0)), "the picture is empty");
    assert!(pictures.iter().all(|picture| *picture == pictures[0]));
    refuse(&["--volume", "brain", "--start-factor", "2"], &["--start-factor", "run-ahead"]);
    let ahead = ["--volume", "brain", "--strategy", "block-sorted", "--look-ahead", "2"];
    refuse(&ahead, &["--look-ahead", "block-sorted"]);
}
