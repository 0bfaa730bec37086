//! The fuzz targets without a fuzzer: seeded inputs, a few in every run of the tests and any number of them by
//! `PROGRESSIVE_ISO_FUZZ_RUNS`, from the seed `PROGRESSIVE_ISO_FUZZ_SEED` on.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
#![allow(clippy::print_stdout, reason = "executions, shown with --nocapture and when a run fails")]

#[allow(unreachable_pub, reason = "a library of its own for the fuzzer")]
#[path = "../fuzz/exercise.rs"]
mod exercise;

use std::path::Path;

/// Longest file to start from: long ones take long and have few bytes that decide anything.
const MOST_BYTES: u64 = 4096;

/// Runs of a target where nothing else is said.
const RUNS: u64 = 2000;

fn number(variable: &str, default: u64) -> u64 {
    std::env::var(variable).map_or(default, |text| text.parse().unwrap())
}

/// Steele, Lea and Flood's `SplitMix64`.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    fn below(&mut self, end: usize) -> usize {
        (self.next() % end.max(1) as u64) as usize
    }
}

/// The short files below `folder`.
fn corpus(folder: &Path, found: &mut Vec<Vec<u8>>) {
    let mut paths: Vec<_> = folder.read_dir().unwrap().map(|entry| entry.unwrap().path()).collect();
    paths.sort();
    for path in paths {
        if path.is_dir() {
            corpus(&path, found);
        } else if path.metadata().unwrap().len() <= MOST_BYTES {
            found.push(std::fs::read(path).unwrap());
        }
    }
}

/// Random bytes, or a file with up to eight changes.
fn input(random: &mut Random, corpus: &[Vec<u8>]) -> Vec<u8> {
    if random.below(4) == 0 {
        return (0..random.below(512)).map(|_| random.next() as u8).collect();
    }
    let mut bytes = corpus[random.below(corpus.len())].clone();
    for _ in 0..1 + random.below(8) {
        let at = random.below(bytes.len());
        match random.below(6) {
            0 => bytes.truncate(at),
            1 => bytes.insert(at, random.next() as u8),
            2 => drop(bytes.drain(at..(at + 1 + random.below(16)).min(bytes.len()))),
            3 if !bytes.is_empty() => bytes[at] ^= 1 << random.below(8),
            _ if !bytes.is_empty() => bytes[at] = random.next() as u8,
            _ => {}
        }
    }
    bytes
}

/// Every target on the files of its own format and on those of the others.
#[test]
fn targets_take_any_bytes() {
    let (runs, seed) =
        (number("PROGRESSIVE_ISO_FUZZ_RUNS", RUNS), number("PROGRESSIVE_ISO_FUZZ_SEED", 1));
    let mut files = Vec::new();
    corpus(&Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data"), &mut files);
    assert!(files.len() > 20);
    for (name, target) in exercise::TARGETS {
        let own: Vec<_> = files.iter().filter(|bytes| belongs(name, bytes)).cloned().collect();
        assert!(name == "raw" || !own.is_empty(), "{name} has no file to start from");
        for run in seed..seed + runs {
            let _run = Run { name, seed: run };
            let mut random = Random(run);
            let pick = if own.is_empty() || random.below(8) == 0 { &files } else { &own };
            target(&input(&mut random, pick));
        }
        println!("{name}: {runs} executions from seed {seed} on");
    }
}

/// Says which run it was that panics.
struct Run {
    name: &'static str,
    seed: u64,
}

impl Drop for Run {
    fn drop(&mut self) {
        if std::thread::panicking() {
            println!("target {}: PROGRESSIVE_ISO_FUZZ_SEED={}", self.name, self.seed);
        }
    }
}

/// Whether a file begins as those of the format do.
fn belongs(name: &str, bytes: &[u8]) -> bool {
    let magic: (usize, &[u8]) = match name {
        "gzip" => (0, b"\x1f\x8b\x08"),
        "mrc" => (208, b"MAP "),
        "nifti" => (344, b"n+1\0"),
        "npy" => (0, b"\x93NUMPY"),
        "nrrd" => (0, b"NRRD000"),
        "vti" => (0, b"<"),
        "zfp" => (0, b"zfp"),
        _ => return false,
    };
    bytes.get(magic.0..magic.0 + magic.1.len()) == Some(magic.1)
}
