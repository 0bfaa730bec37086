//! Every shader validates against core WebGPU and its default limits, and declares what the Rust
//! side binds.

#![allow(clippy::unwrap_used, reason = "a failed set-up fails the test")]

use gpu_primitives::kernel::KernelSource;
use gpu_testkit::layout::{check_bindings, check_kernel, check_struct};
use zfp_gpu::{BlockExtrema, Decode};

fn sources() -> Vec<KernelSource> {
    let decodes = (1..=4).map(|pages| Decode::source(pages).unwrap());
    let extrema = (0..=4).map(|pages| BlockExtrema::source(pages).unwrap());
    decodes.chain(extrema).collect()
}

#[test]
fn shaders_are_valid_and_declare_what_is_bound() {
    for source in sources() {
        check_kernel(&source).unwrap();
        let short = &source.bindings[..source.bindings.len() - 1];
        check_bindings(&source.wgsl.source, source.entry_point, short).unwrap_err();
    }
}

#[test]
fn entry_points_have_the_announced_group_size() {
    for source in sources() {
        let module = naga::front::wgsl::parse_str(&source.wgsl.source).unwrap();
        let names: Vec<_> = module.entry_points.iter().map(|e| e.name.as_str()).collect();
        assert_eq!(names, [source.entry_point]);
        assert_eq!(module.entry_points[0].workgroup_size, [64, 1, 1]);
    }
}

#[test]
fn parameters_lie_where_the_host_writes_them() {
    let decode = Decode::source(3).unwrap().wgsl.source;
    let page =
        [("first_block", 0, 4), ("blocks", 4, 4), ("bits_per_block", 8, 4), ("first_bit", 12, 4)];
    check_struct(&decode, "ZfpPage", &page).unwrap();
    let params =
        [("slots_per_page", 0, 4), ("slots", 4, 4), ("count_word", 8, 4), ("padding", 12, 4)];
    check_struct(&decode, "DecodeParams", &params).unwrap();
    let extrema = BlockExtrema::source(0).unwrap().wgsl.source;
    check_struct(&extrema, "ZfpPage", &page).unwrap();
    let params = [("origin", 0, 16), ("size", 16, 16), ("dims", 32, 16)];
    check_struct(&extrema, "ExtremaParams", &params).unwrap();
}

#[test]
fn only_one_to_four_cache_pages_exist() {
    for pages in [0, 5] {
        assert!(Decode::source(pages).is_err(), "{pages} cache pages");
    }
}
