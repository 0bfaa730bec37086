//! Finding a GPU adapter, and installing a software one where there is none.

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::Stdio;

use crate::{packages, process};

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

/// Environment variable that selects an adapter by a part of its name.
const ADAPTER_VARIABLE: &str = "PROGRESSIVE_ISO_ADAPTER";
/// Exit code of the example `adapter` when there is no adapter at all.
const NO_ADAPTER_CODE: i32 = 3;

/// The adapter that tests and examples use, in one line; `None` where there is none at all. A new
/// process finds it, whose Vulkan loader reads its drivers again.
fn find(variables: &[(&str, OsString)]) -> Result<Option<String>, String> {
    let mut cargo = process::cargo();
    cargo.args(["run", "--example", "adapter"]).envs(variables.iter().cloned());
    let output = cargo.stderr(Stdio::inherit()).output();
    let output = output.map_err(|error| format!("cargo did not start: {error}"))?;
    match output.status.code() {
        Some(0) => Ok(Some(String::from_utf8_lossy(&output.stdout).trim().to_owned())),
        Some(NO_ADAPTER_CODE) => Ok(None),
        _ => Err("no GPU adapter could be used, see above".to_owned()),
    }
}

/// The adapter in one line.
pub(crate) fn describe(variables: &[(&str, OsString)]) -> Result<String, String> {
    find(variables)?.ok_or_else(|| "there is no GPU adapter, see above".to_owned())
}

/// [`describe`], after installing a software driver where there is no adapter and the system
/// allows it.
pub(crate) fn ensure() -> Result<String, String> {
    if let Some(description) = find(&[])? {
        return Ok(description);
    }
    println!("no GPU adapter found");
    packages::install(&PACKAGES)?;
    describe(&[])
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
        (ADAPTER_VARIABLE, "SwiftShader".into()),
    ]
}

pub(crate) fn is_swiftshader(description: &str) -> bool {
    description.contains("SwiftShader")
}
