//! Checks of the published crates as others will use them: features, archives, a foreign workspace.

use serde_json::Value;

use crate::{adapter, process};

/// Features that only examples of this repository use.
const NOT_FOR_USERS: [&str; 1] = ["window"];

/// A crate that cargo may publish.
struct Published {
    name: String,
    /// Without `default`.
    features: Vec<String>,
}

fn published() -> Result<Vec<Published>, String> {
    let arguments = ["metadata", "--format-version", "1", "--no-deps", "--locked"];
    let json = process::output(process::cargo().args(arguments))?;
    let metadata: Value =
        serde_json::from_slice(&json).map_err(|error| format!("cargo metadata: {error}"))?;
    let found = select(&metadata);
    if found.is_empty() { Err("no published crate found".to_owned()) } else { Ok(found) }
}

fn select(metadata: &Value) -> Vec<Published> {
    let packages = metadata["packages"].as_array().into_iter().flatten();
    packages
        .filter(|package| package["publish"].as_array().is_none_or(|to| !to.is_empty()))
        .map(|package| Published {
            name: package["name"].as_str().unwrap_or_default().to_owned(),
            features: users_features(&package["features"]),
        })
        .collect()
}

fn users_features(features: &Value) -> Vec<String> {
    let names = features.as_object().into_iter().flatten().map(|(name, _)| name);
    let others = |name: &&String| *name != "default" && !NOT_FOR_USERS.contains(&name.as_str());
    names.filter(others).cloned().collect()
}

/// Checks that every published crate compiles without features and with each of them alone, and
/// without warnings.
pub(crate) fn check_features() -> Result<(), String> {
    for package in published()?.iter().filter(|package| !package.features.is_empty()) {
        for feature in [None].into_iter().chain(package.features.iter().map(Some)) {
            let mut cargo = process::cargo();
            cargo.args(["clippy", "--quiet", "--locked", "--no-default-features", "--no-deps"]);
            cargo.args(["-p", &package.name]);
            if let Some(feature) = feature {
                cargo.args(["--features", feature]);
            }
            let feature = feature.map_or("no features", String::as_str);
            println!("features: {}, {feature}", package.name);
            process::run(cargo.args(["--", "-D", "warnings"]))?;
        }
    }
    Ok(())
}

/// Makes the archives of all published crates, which needs no registry that has them.
pub(crate) fn package(arguments: &[String]) -> Result<(), String> {
    let mut cargo = process::cargo();
    cargo.args(["package", "--quiet", "--allow-dirty"]).args(arguments);
    let packages = published()?;
    for package in &packages {
        cargo.args(["-p", &package.name]);
    }
    process::run(&mut cargo)?;
    println!("package: {} archives made", packages.len());
    Ok(())
}

/// Builds and runs a program outside the workspace, with the versions of the workspace's lock file.
pub(crate) fn run_outside() -> Result<(), String> {
    adapter::ensure()?;
    let root = process::root();
    let outside = root.join("tests/outside-crate");
    std::fs::copy(root.join("Cargo.lock"), outside.join("Cargo.lock"))
        .map_err(|error| format!("the lock file cannot be copied: {error}"))?;
    let mut cargo = process::cargo();
    cargo.current_dir(&outside).args(["run", "--quiet", "--target-dir"]);
    process::run(cargo.arg(root.join("target/outside")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_published_crates_and_their_users_features_count() {
        let metadata: Value = serde_json::from_str(
            r#"{"packages": [
                {"name": "a", "publish": null,
                    "features": {"default": ["x"], "x": [], "window": []}},
                {"name": "hidden", "publish": [], "features": {"y": []}}
            ]}"#,
        )
        .unwrap();
        let found = select(&metadata);
        assert_eq!(found.len(), 1);
        assert_eq!((found[0].name.as_str(), &found[0].features[..]), ("a", &["x".to_owned()][..]));
    }
}
