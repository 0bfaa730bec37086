//! Every shader validates against core WebGPU and declares what the Rust side binds.

use gpu_primitives::kernel::KernelSource;
use gpu_testkit::layout::check_kernel;
use macrocell::{Activate, Ranges};

use crate::walk_gpu::walk_source;

fn sources() -> [KernelSource; 5] {
    [
        Ranges::source(),
        Activate::source(),
        Activate::third_level_source(),
        Activate::active_box_source(),
        walk_source(),
    ]
}

#[test]
fn shaders_are_valid_and_declare_what_is_bound() {
    for source in sources() {
        check_kernel(&source).unwrap();
    }
}
