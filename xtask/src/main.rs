//! Set-up, tests, demo and checks in one command each: `cargo xtask` lists them.
#![expect(clippy::print_stdout, clippy::print_stderr, reason = "a command-line program")]

mod adapter;
mod msrv;
mod packages;
mod process;
mod published;
#[cfg(feature = "web")]
mod serve;
#[cfg(feature = "web")]
mod web;

use std::process::ExitCode;

const ERROR_PREFIX: &str = "xtask: ";

const USAGE: &str = "\
usage: cargo xtask COMMAND

  demo [ARGUMENTS]  make sure that there is a GPU adapter, then render the example to out/demo
                    (further arguments go to the example)
  test [ARGUMENTS]  make sure that there is a GPU adapter, then run every test, on SwiftShader too
                    where it is found (further arguments go to both runs of cargo test), and those of
                    the web page
  web [--serve [PORT]]
                    build the web page in web/dist, and serve it on this computer
  web --test | --measure
                    test the page in Chromium, or measure it for docs/performance.md
  msrv              check that no dependency of a published crate needs a newer Rust
  features          check that every published crate compiles with each of its features alone
  outside           build and run a program outside the workspace that uses the published crate
  package [ARGUMENTS]
                    make the archives of all published crates (further arguments go to cargo)
  adapter           print the GPU adapter that demo and test use

The environment variable PROGRESSIVE_ISO_ADAPTER selects an adapter by a part of its name.";

fn main() -> ExitCode {
    let mut arguments = std::env::args().skip(1);
    let command = arguments.next().unwrap_or_default();
    let rest: Vec<String> = arguments.collect();
    let result = match (command.as_str(), rest.as_slice()) {
        ("demo", _) => demo(&rest),
        ("test", _) => test(&rest),
        ("web", _) => web(&rest),
        ("msrv", []) => msrv::check(),
        ("features", []) => published::check_features(),
        ("outside", []) => published::run_outside(),
        ("package", _) => published::package(&rest),
        ("adapter", []) => adapter::describe(&[]).map(|description| println!("{description}")),
        _ => {
            eprintln!("{USAGE}");
            return ExitCode::from(2);
        }
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(problem) => {
            eprintln!("{ERROR_PREFIX}{problem}");
            ExitCode::FAILURE
        }
    }
}

/// What the tests cover beside the default features.
const FEATURES: &str = "progressive-iso/published-network";

fn demo(arguments: &[String]) -> Result<(), String> {
    println!("adapter: {}", adapter::ensure()?);
    let mut cargo = process::cargo();
    cargo.args(["run", "--example", "quickstart", "--"]);
    if !arguments.iter().any(|argument| argument == "--out" || argument.starts_with("--out=")) {
        cargo.args(["--out", "out/demo"]);
    }
    process::run(cargo.args(arguments))
}

/// The command `web`, in a build of this program that has it.
#[cfg(not(feature = "web"))]
fn web(arguments: &[String]) -> Result<(), String> {
    let mut cargo = process::cargo();
    cargo.args(["run", "--quiet", "--package", "xtask", "--features", "web", "--", "web"]);
    process::run(cargo.args(arguments))
}

#[cfg(feature = "web")]
fn web(arguments: &[String]) -> Result<(), String> {
    web::run(arguments)
}

fn test(arguments: &[String]) -> Result<(), String> {
    let first = adapter::ensure()?;
    println!("adapter: {first}");
    let mut cargo = process::cargo();
    cargo.args(["test", "--workspace", "--features", FEATURES]).args(arguments);
    process::run(&mut cargo)?;
    if !adapter::is_swiftshader(&first) {
        test_second_driver(arguments)?;
    }
    // A selection of tests has none of the page.
    if arguments.is_empty() { web(&["--test".to_owned()]) } else { Ok(()) }
}

/// The test programs whose results depend on the driver, apart from those of the libraries: neither documentation nor
/// files nor the options of the example programs bring anything new on another one.
const DRIVER_TESTS: [&str; 8] =
    ["it", "published", "shaders", "gpu_*", "vectors", "large", "blue_noise", "session"];

fn test_second_driver(arguments: &[String]) -> Result<(), String> {
    let Some(icd) = adapter::swiftshader_icd() else {
        println!("{}", adapter::NO_SECOND_DRIVER);
        return Ok(());
    };
    println!("second adapter: {}", adapter::describe(&adapter::only(&icd))?);
    let mut cargo = process::cargo();
    cargo.args(["test", "--workspace", "--features", FEATURES, "--lib"]);
    cargo.args(DRIVER_TESTS.iter().flat_map(|&name| ["--test", name])).args(arguments);
    process::run(cargo.envs(adapter::only(&icd)))
}
