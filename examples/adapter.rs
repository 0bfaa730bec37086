//! Prints the GPU adapter that tests and demo use: `cargo run --example adapter`.
//!
//! Exit code 3 says that there is none, 1 that none fits `PROGRESSIVE_ISO_ADAPTER`. `cargo xtask`
//! runs it, so that a machine builds wgpu once.

#![allow(clippy::print_stdout, clippy::print_stderr, reason = "a command-line program")]

use std::process::ExitCode;

use gpu_testkit::gpu;

fn main() -> ExitCode {
    match gpu::find_adapter() {
        Ok(adapter) => {
            let info = adapter.get_info();
            let kind = format!("{:?} {:?}", info.backend, info.device_type);
            println!("{} ({kind}, {} {})", info.name, info.driver, info.driver_info);
            ExitCode::SUCCESS
        }
        Err(problem) => {
            eprintln!("{problem}");
            ExitCode::from(if problem == gpu::NO_ADAPTER { 3 } else { 1 })
        }
    }
}
