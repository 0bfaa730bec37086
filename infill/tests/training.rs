//! The training scripts have the crate's constants.

#![allow(clippy::unwrap_used, reason = "a failed set-up fails the test")]

use infill::{DOUBT, PRIOR};
use wavefront::Shading;

/// What follows `name` and an equals sign on a line of its own in one of the scripts.
fn value(script: &str, name: &str) -> String {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("training").join(script);
    let text = std::fs::read_to_string(path).unwrap();
    let start = format!("{name} = ");
    text.lines().find_map(|line| line.strip_prefix(&start)).unwrap().to_owned()
}

/// The numbers in a text.
fn numbers(text: &str) -> Vec<f32> {
    let separated = text.split(|c: char| !c.is_ascii_digit() && !".-".contains(c));
    separated.filter_map(|word| word.parse().ok()).collect()
}

#[test]
fn the_network_starts_from_the_same_shares() {
    assert_eq!(numbers(&value("network.py", "PRIOR")), PRIOR);
    assert_eq!(numbers(&value("network.py", "DOUBT")), [DOUBT]);
}

#[test]
fn the_network_reads_and_gives_as_much() {
    let count = |name| value("network.py", name).parse::<usize>().unwrap();
    assert_eq!(count("FEATURES"), infill::cpu::network::FEATURES);
    assert_eq!(count("OWN"), infill::cpu::network::OWN);
    assert_eq!(count("OUTPUTS"), infill::cpu::network::OUTPUTS);
    let half = value("network.py", "HALF_DISTANCE").parse().unwrap();
    assert_eq!(infill::cpu::candidate::soft_distance(half), 0.5);
}

#[test]
fn colours_are_those_of_the_default_shading() {
    let Shading { base_color: [r, g, b], ambient, diffuse, specular, shininess, .. } =
        Shading::default();
    let expected = [r, g, b, ambient, diffuse, specular, shininess];
    assert_eq!(numbers(&value("shading.py", "DEFAULT")), expected);
}
