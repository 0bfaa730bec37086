//! The web page: building, serving and testing it.

use std::fs;
use std::io::{BufRead as _, BufReader, Write as _};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

use flate2::Compression;
use flate2::write::GzEncoder;
use wasm_bindgen_cli_support::Bindgen;

use crate::{adapter, packages, process, serve};

const TARGET: &str = "wasm32-unknown-unknown";
/// Most bytes of the gzipped module.
const MOST_BYTES: usize = 1_500_000;
/// Where `--serve` listens unless a port is given.
const PORT: u16 = 8080;
/// The page's files beside the module and its bindings: where they are, and their names on the page.
const BUNDLED: [(&str, &str); 2] = [
    ("volumes/data/icbm152-2009c-t1-brain.zfp", "brain.zfp"),
    ("volumes/data/icbm152-2009c-t1-brain.NOTICE.txt", "brain.NOTICE.txt"),
];

/// `cargo xtask web`.
pub(crate) fn run(arguments: &[String]) -> Result<(), String> {
    let words: Vec<&str> = arguments.iter().map(String::as_str).collect();
    match words[..] {
        [] => build().map(drop),
        ["--serve"] => serve_page(PORT),
        ["--serve", port] => serve_page(port.parse().map_err(|_error| format!("no port: {port}"))?),
        ["--test"] => test(&["--test", "test.mjs"], 1),
        ["--measure"] => test(&["measure.mjs"], 3),
        _ => Err("usage: cargo xtask web [--serve [PORT] | --test | --measure]".to_owned()),
    }
}

/// Builds the page and returns its folder.
fn build() -> Result<PathBuf, String> {
    let root = process::root();
    let module = compile(root)?;
    let dist = root.join("web/dist");
    let failed = |error: std::io::Error| format!("{}: {error}", dist.display());
    if dist.exists() {
        fs::remove_dir_all(&dist).map_err(failed)?;
    }
    fs::create_dir_all(&dist).map_err(failed)?;
    bind(&module, &dist)?;
    let module = dist.join("web_bg.wasm");
    optimise(&module)?;
    let page = fs::read_dir(root.join("web/page")).map_err(failed)?;
    for file in page {
        let file = file.map_err(failed)?;
        fs::copy(file.path(), dist.join(file.file_name())).map_err(failed)?;
    }
    for (from, name) in BUNDLED {
        fs::copy(root.join(from), dist.join(name)).map_err(failed)?;
    }
    report_sizes(&dist)?;
    Ok(dist)
}

/// Compiles the crate `web` and returns its module.
fn compile(root: &Path) -> Result<PathBuf, String> {
    let mut installed = Command::new("rustup");
    installed.args(["target", "list", "--installed"]);
    let has_rustup = process::succeeds("rustup", &["--version"]);
    let has_target = has_rustup
        && String::from_utf8_lossy(&process::output(&mut installed)?).lines().any(|t| t == TARGET);
    if has_rustup && !has_target {
        // Without a network, `wasm-cargo` may still know a way.
        process::succeeds("rustup", &["target", "add", TARGET]);
    }
    let target = root.join("target/wasm");
    let mut cargo = Command::new(root.join("tools/wasm-cargo"));
    cargo.args(["build", "--profile", "web", "--package", "web"]);
    process::run(cargo.current_dir(root).env("CARGO_TARGET_DIR", &target))?;
    Ok(target.join(TARGET).join("web/web.wasm"))
}

/// Writes the module with its bindings for scripts.
fn bind(module: &Path, dist: &Path) -> Result<(), String> {
    let mut bindgen = Bindgen::new();
    let bindgen = bindgen.input_path(module).typescript(false).omit_default_module_path(false);
    let bindgen = bindgen.remove_name_section(true).remove_producers_section(true);
    let web = bindgen.web(true).map_err(|error| format!("wasm-bindgen: {error:#}"))?;
    web.generate(dist).map_err(|error| format!("wasm-bindgen: {error:#}"))
}

/// Makes the module smaller where Binaryen is there and new enough to read it: Debian 12's is not.
fn optimise(module: &Path) -> Result<(), String> {
    let smaller = module.with_extension("opt");
    let mut command = Command::new("wasm-opt");
    // The features are those that the module names.
    command.args(["-O3", "--output"]).arg(&smaller).arg(module);
    match command.output() {
        Ok(output) if output.status.success() => {
            fs::rename(&smaller, module).map_err(|error| format!("{}: {error}", smaller.display()))
        }
        Ok(output) => {
            let why = String::from_utf8_lossy(&output.stderr);
            let why = why.lines().next().unwrap_or("no reason given").to_owned();
            println!("web: wasm-opt cannot read the module ({why}), which stays as it was made");
            Ok(())
        }
        Err(_) => {
            println!("web: wasm-opt not found, the module stays as the compiler made it");
            Ok(())
        }
    }
}

/// Bytes of a file after gzip.
fn zipped(path: &Path) -> Result<usize, String> {
    let failed = |error: std::io::Error| format!("{}: {error}", path.display());
    let bytes = fs::read(path).map_err(failed)?;
    let mut encoder = GzEncoder::new(Vec::new(), Compression::best());
    encoder.write_all(&bytes).map_err(failed)?;
    Ok(encoder.finish().map_err(failed)?.len())
}

/// Prints what a visitor transfers, and refuses a module that is too large.
fn report_sizes(dist: &Path) -> Result<(), String> {
    let files = fs::read_dir(dist).map_err(|error| error.to_string())?;
    let mut paths: Vec<PathBuf> = files.flatten().map(|file| file.path()).collect();
    paths.sort();
    let mut sum = 0;
    for path in &paths {
        let bytes = zipped(path)?;
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        println!("web: {bytes:>9} bytes gzipped  {name}");
        sum += bytes;
        if name.ends_with(".wasm") && bytes > MOST_BYTES {
            return Err(format!("{name} has {bytes} bytes gzipped, more than {MOST_BYTES}"));
        }
    }
    println!("web: {sum:>9} bytes gzipped  in all, in {}", dist.display());
    Ok(())
}

fn serve_page(port: u16) -> Result<(), String> {
    let dist = build()?;
    let server = serve::Server::bind(&dist, port)?;
    println!("web: http://localhost:{}/ (Ctrl-C ends it)", server.port());
    server.run();
    Ok(())
}

/// Runs a script of `web/tests` against the page in a browser, after so many runs of what it compares with.
fn test(script: &[&str], runs: u32) -> Result<(), String> {
    let root = process::root();
    let browser = browser()?;
    let icd = adapter::swiftshader_icd().ok_or(adapter::NO_SECOND_DRIVER)?;
    let dist = build()?;
    let reference = root.join("target/web-reference");
    fs::create_dir_all(&reference).map_err(|error| error.to_string())?;
    let mut cargo = process::cargo();
    cargo.args(["run", "--package", "web", "--example", "reference", "--"]);
    cargo.arg(&reference).arg(runs.to_string());
    process::run(cargo.envs(adapter::only(&icd)))?;
    let tests = root.join("web/tests");
    process::run(Command::new("npm").args(["ci", "--silent", "--no-fund"]).current_dir(&tests))?;
    let server = serve::Server::bind(&dist, 0)?;
    let url = format!("http://localhost:{}/", server.port());
    std::thread::spawn(move || server.run());
    let screen = Screen::start()?;
    let mut node = Command::new("node");
    node.args(script).current_dir(&tests);
    if let Some(screen) = &screen {
        node.env("SCREEN", &screen.display);
    }
    process::run(node.envs([
        ("PAGE", url.into()),
        ("CHROMIUM", browser.into_os_string()),
        ("REFERENCE", reference.into_os_string()),
        ("OUTPUT", root.join("target/web-tests").into_os_string()),
    ]))
}

/// An X server without a monitor, which canvases of WebGPU are presented on.
struct Screen {
    server: Child,
    /// `:` and its number.
    display: String,
}

impl Screen {
    /// None where Xvfb is missing and cannot be installed.
    fn start() -> Result<Option<Self>, String> {
        // It answers an unknown option with a failure, but only where it is there.
        let is_there = || Command::new("Xvfb").arg("-version").output().is_ok();
        if !is_there() {
            packages::install(&["xvfb"])?;
        }
        if !is_there() {
            println!("web: Xvfb not found, nothing is presented on a screen");
            return Ok(None);
        }
        let failed = |error: std::io::Error| format!("Xvfb: {error}");
        let mut command = Command::new("Xvfb");
        command.args(["-displayfd", "1", "-screen", "0", "1280x1024x24", "-nolisten", "tcp"]);
        command.stdout(Stdio::piped()).stderr(Stdio::null());
        let mut screen = Self { server: command.spawn().map_err(failed)?, display: ":".into() };
        let output = screen.server.stdout.take().ok_or("Xvfb: no output")?;
        BufReader::new(output).read_line(&mut screen.display).map_err(failed)?;
        screen.display.truncate(screen.display.trim_end().len());
        if screen.display == ":" {
            return Err("Xvfb did not start".to_owned());
        }
        Ok(Some(screen))
    }
}

impl Drop for Screen {
    fn drop(&mut self) {
        // It may have ended already.
        drop(self.server.kill());
        drop(self.server.wait());
    }
}

/// Chromium's program, after installing what is missing where that is possible.
fn browser() -> Result<PathBuf, String> {
    let find = || {
        let named = std::env::var_os("CHROMIUM").map(PathBuf::from);
        let places = ["/usr/bin/chromium", "/usr/bin/chromium-browser"].map(PathBuf::from);
        named.into_iter().chain(places).find(|path| path.is_file())
    };
    let has_node =
        || process::succeeds("node", &["--version"]) && process::succeeds("npm", &["--version"]);
    if find().is_none() {
        packages::install(&["chromium"])?;
    }
    if !has_node() {
        packages::install(&["nodejs", "npm"])?;
    }
    if !has_node() {
        return Err("the page's tests need Node.js 18 or newer, and npm".to_owned());
    }
    find().ok_or_else(|| {
        "the page's tests need Chromium: install it or let CHROMIUM name its program".to_owned()
    })
}
