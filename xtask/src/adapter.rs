//! Finding a GPU adapter, and installing a software one where there is none.

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::Command;

use gpu_testkit::gpu;

use crate::process;

/// Vulkan driver with the software adapter lavapipe, and the loader that finds it.
const PACKAGES: [&str; 2] = ["mesa-vulkan-drivers", "libvulkan1"];
/// Overrides where SwiftShader's Vulkan driver description lies.
const SWIFTSHADER_VARIABLE: &str = "SWIFTSHADER_ICD";
/// Where browser packages put it.
const SWIFTSHADER_PLACES: [&str; 4] = [
    "/usr/lib/chromium/vk_swiftshader_icd.json",
    "/usr/lib/chromium-browser/vk_swiftshader_icd.json",
    "/opt/google/chrome/vk_swiftshader_icd.json",
    "/opt/microsoft/msedge/vk_swiftshader_icd.json",
];
pub(crate) const NO_SECOND_DRIVER: &str = "second driver not found, tests ran on one only: install \
    Chromium for SwiftShader (Debian: apt-get install chromium) or point SWIFTSHADER_ICD at its \
    vk_swiftshader_icd.json";

/// The adapter that tests and examples of this machine use, in one line.
pub(crate) fn describe() -> Result<String, String> {
    let info = gpu::find_adapter()?.get_info();
    let wgpu_info = format!("{:?} {:?}", info.backend, info.device_type);
    Ok(format!("{} ({wgpu_info}, {} {})", info.name, info.driver, info.driver_info))
}

/// [`describe`] from a new process, whose Vulkan loader reads its drivers again.
pub(crate) fn describe_in_child(variables: &[(&str, OsString)]) -> Result<String, String> {
    let program = std::env::current_exe().map_err(|error| format!("own path unknown: {error}"))?;
    let mut command = Command::new(program);
    command.arg("adapter").envs(process::headless()).envs(variables.iter().cloned());
    let output = command.output();
    let output = output.map_err(|error| format!("own program did not start: {error}"))?;
    if output.status.success() {
        return Ok(String::from_utf8_lossy(&output.stdout).trim().to_owned());
    }
    let message = String::from_utf8_lossy(&output.stderr);
    let last = message.lines().last().unwrap_or("looking for a GPU adapter failed");
    Err(last.trim_start_matches(crate::ERROR_PREFIX).to_owned())
}

/// [`describe`], after installing a software driver where there is no adapter and the system
/// allows it.
pub(crate) fn ensure() -> Result<String, String> {
    let problem = match describe_in_child(&[]) {
        Ok(description) => return Ok(description),
        Err(problem) => problem,
    };
    // A name in PROGRESSIVE_ISO_ADAPTER that fits no adapter is not cured by another driver.
    if problem != gpu::NO_ADAPTER {
        return Err(problem);
    }
    let Some(prefix) = administrator() else { return Err(problem) };
    println!("no GPU adapter found: installing {} with apt-get", PACKAGES.join(" and "));
    apt_get(prefix, &["update"])?;
    apt_get(prefix, &[&["install", "--yes", "--no-install-recommends"], &PACKAGES[..]].concat())?;
    describe_in_child(&[])
}

/// What to put before a command so that it runs as root, where apt-get is there and that is
/// possible without a password.
fn administrator() -> Option<&'static [&'static str]> {
    if !process::succeeds("apt-get", &["--version"]) {
        return None;
    }
    let id = process::output(Command::new("id").arg("-u")).unwrap_or_default();
    if id.trim_ascii() == b"0" {
        Some(&["env"])
    } else if process::succeeds("sudo", &["-n", "true"]) {
        Some(&["sudo", "-n", "env"])
    } else {
        None
    }
}

fn apt_get(prefix: &[&str], arguments: &[&str]) -> Result<(), String> {
    let mut command = Command::new(prefix[0]);
    command.args(&prefix[1..]).args(["DEBIAN_FRONTEND=noninteractive", "apt-get", "-qq"]);
    process::run(command.args(arguments))
}

/// SwiftShader's driver description, if one is found.
pub(crate) fn swiftshader_icd() -> Option<PathBuf> {
    let named = std::env::var_os(SWIFTSHADER_VARIABLE).map(PathBuf::from);
    let places = SWIFTSHADER_PLACES.map(PathBuf::from);
    named.into_iter().chain(places).find(|path| Path::is_file(path))
}

/// Environment under which only SwiftShader is used; where it does not load, nothing is found,
/// rather than another adapter.
pub(crate) fn only(icd: &Path) -> [(&'static str, OsString); 3] {
    [
        ("VK_ICD_FILENAMES", icd.into()),
        ("VK_DRIVER_FILES", icd.into()),
        (gpu::ADAPTER_VARIABLE, "SwiftShader".into()),
    ]
}

pub(crate) fn is_swiftshader(description: &str) -> bool {
    description.contains("SwiftShader")
}
