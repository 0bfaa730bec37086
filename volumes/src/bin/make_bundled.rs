//! Makes the bundled volume: reads a volume file, encodes it at 4 bits per voxel and writes it with
//! zfp's own header.
//!
//! `cargo run -p volumes --bin make_bundled -- IN.nii.gz OUT.zfp`
#![allow(clippy::print_stdout, clippy::print_stderr, reason = "a command-line program")]

use std::fs::File;
use std::process::ExitCode;

use volume_io::{Error, ReadOptions, ZfpVolume, read_file, write_zfp};
use volumes::BRAIN_RATE;

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [input, output] = arguments.as_slice() else {
        eprintln!("usage: make_bundled IN.nii.gz OUT.zfp");
        return ExitCode::from(2);
    };
    match convert(input, output) {
        Ok((volume, bytes)) => {
            report(&volume, bytes);
            ExitCode::SUCCESS
        }
        Err(error) => {
            eprintln!("make_bundled: {error}");
            ExitCode::FAILURE
        }
    }
}

/// The volume as encoded, and the length of the file written.
fn convert(input: &str, output: &str) -> volume_io::Result<(ZfpVolume, u64)> {
    let options = ReadOptions { rate: BRAIN_RATE, ..ReadOptions::default() };
    let volume = read_file(input, &options)?;
    let name = output.to_owned();
    let file = File::create(output).map_err(|source| Error::Io { name, source })?;
    let bytes = write_zfp(&volume, file)?;
    Ok((volume, bytes))
}

fn report(volume: &ZfpVolume, bytes: u64) {
    println!("dims           {:?}", volume.dims);
    println!("spacing        {:?}", volume.geometry.spacing);
    println!("sample type    {:?}", volume.source.sample_type);
    println!("bits per block {}", volume.bits_per_block);
    println!("bytes          {bytes}");
    if let Some(error) = &volume.source.distortion {
        println!("largest error  {:.4}", error.max);
        println!("RMS error      {:.4}", error.rms);
        println!("PSNR           {:.2} dB", error.psnr_db);
    }
}
