//! Debian's packages.

use std::process::Command;

use crate::process;

/// Installs packages where the system has apt-get and allows it; elsewhere this does nothing, and
/// false comes back.
pub(crate) fn install(packages: &[&str]) -> Result<bool, String> {
    let Some(prefix) = administrator() else { return Ok(false) };
    println!("installing {} with apt-get", packages.join(" and "));
    apt_get(prefix, &["update"])?;
    let install = [&["install", "--yes", "--no-install-recommends"], packages].concat();
    apt_get(prefix, &install)?;
    Ok(true)
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
