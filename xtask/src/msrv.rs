//! Check of the declared minimum Rust version against the dependencies.

use std::collections::{BTreeMap, BTreeSet};

use serde_json::Value;

use crate::process;

/// Checks that no normal or build dependency of a published crate, direct or not, declares a
/// higher `rust-version` than that crate.
pub(crate) fn check() -> Result<(), String> {
    let arguments = ["metadata", "--format-version", "1", "--all-features", "--locked"];
    let json = process::output(process::cargo().args(arguments))?;
    let metadata: Value =
        serde_json::from_slice(&json).map_err(|error| format!("cargo metadata: {error}"))?;
    let graph = Graph::new(&metadata);
    let mut checked = BTreeSet::new();
    let mut problems = Vec::new();
    for member in graph.published() {
        let Some(own) = graph.rust_version(member) else {
            problems.push(format!("{} declares no rust-version", graph.name(member)));
            continue;
        };
        for dependency in graph.reachable(member) {
            checked.insert(dependency);
            if let Some(needed) = graph.rust_version(dependency).filter(|needed| *needed > own) {
                let (crate_name, name) = (graph.name(member), graph.name(dependency));
                problems.push(format!("{crate_name}: {name} needs Rust {}", text(needed)));
            }
        }
    }
    if checked.is_empty() {
        problems.push("no published crate found".to_owned());
    }
    if problems.is_empty() {
        println!("msrv: {} packages fit the declared minimum Rust version", checked.len());
        Ok(())
    } else {
        Err(problems.join("\n  "))
    }
}

/// Major, minor, patch.
type Version = [u64; 3];

struct Graph<'a> {
    packages: BTreeMap<&'a str, &'a Value>,
    dependencies: BTreeMap<&'a str, Vec<&'a str>>,
    members: Vec<&'a str>,
}

impl<'a> Graph<'a> {
    fn new(metadata: &'a Value) -> Self {
        let packages = array(&metadata["packages"]).map(|p| (string(&p["id"]), p)).collect();
        let dependencies = array(&metadata["resolve"]["nodes"])
            .map(|node| {
                let kept = array(&node["deps"]).filter(|dependency| !only_for_tests(dependency));
                (string(&node["id"]), kept.map(|dependency| string(&dependency["pkg"])).collect())
            })
            .collect();
        let members = array(&metadata["workspace_members"]).map(string).collect();
        Self { packages, dependencies, members }
    }

    /// Members that cargo may publish: `publish` is null or a list with entries.
    fn published(&self) -> impl Iterator<Item = &'a str> {
        let publish =
            |id: &str| self.packages[id]["publish"].as_array().is_none_or(|l| !l.is_empty());
        self.members.iter().copied().filter(move |id| publish(id))
    }

    /// The package itself and all that it depends on.
    fn reachable(&self, from: &'a str) -> BTreeSet<&'a str> {
        let mut found = BTreeSet::new();
        let mut open = vec![from];
        while let Some(id) = open.pop() {
            if found.insert(id) {
                open.extend(self.dependencies.get(id).into_iter().flatten());
            }
        }
        found
    }

    fn rust_version(&self, id: &str) -> Option<Version> {
        self.packages[id]["rust_version"].as_str().and_then(parse)
    }

    fn name(&self, id: &str) -> String {
        let package = self.packages[id];
        format!("{} {}", string(&package["name"]), string(&package["version"]))
    }
}

fn only_for_tests(dependency: &Value) -> bool {
    array(&dependency["dep_kinds"]).all(|kind| kind["kind"] == "dev")
}

fn array(value: &Value) -> impl Iterator<Item = &Value> {
    value.as_array().into_iter().flatten()
}

fn string(value: &Value) -> &str {
    value.as_str().unwrap_or_default()
}

fn parse(version: &str) -> Option<Version> {
    let mut parts = [0; 3];
    for (part, text) in parts.iter_mut().zip(version.split('.')) {
        *part = text.parse().ok()?;
    }
    Some(parts)
}

fn text([major, minor, patch]: Version) -> String {
    format!("{major}.{minor}.{patch}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn versions_compare_by_number() {
        assert_eq!(parse("1.89"), Some([1, 89, 0]));
        assert!(parse("1.100.0") > parse("1.89.1"));
        assert_eq!(parse("one"), None);
    }

    #[test]
    fn development_dependencies_do_not_count() {
        let metadata: Value = serde_json::from_str(
            r#"{
                "workspace_members": ["a", "hidden"],
                "packages": [
                    {"id": "a", "name": "a", "version": "1", "publish": null, "rust_version": "1.89"},
                    {"id": "hidden", "name": "h", "version": "1", "publish": []},
                    {"id": "n", "name": "n", "version": "2", "rust_version": "1.90.0"},
                    {"id": "d", "name": "d", "version": "3", "rust_version": "1.99"}
                ],
                "resolve": {"nodes": [
                    {"id": "a", "deps": [
                        {"pkg": "n", "dep_kinds": [{"kind": null}, {"kind": "dev"}]},
                        {"pkg": "d", "dep_kinds": [{"kind": "dev"}]}]},
                    {"id": "n", "deps": []}
                ]}
            }"#,
        )
        .unwrap();
        let graph = Graph::new(&metadata);
        assert_eq!(graph.published().collect::<Vec<_>>(), ["a"]);
        assert_eq!(graph.reachable("a"), BTreeSet::from(["a", "n"]));
        assert!(graph.rust_version("n") > graph.rust_version("a"));
        assert_eq!(graph.rust_version("hidden"), None);
    }
}
