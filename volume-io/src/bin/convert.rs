//! Turns a volume file into fixed-rate ZFP, without ever holding the volume in memory.

#![allow(clippy::print_stdout, reason = "a program reports to its user")]

fn main() -> std::process::ExitCode {
    program::main()
}

#[cfg(all(target_arch = "wasm32", target_os = "unknown"))]
mod program {
    /// There are no files to convert here.
    pub(crate) fn main() -> std::process::ExitCode {
        std::process::ExitCode::FAILURE
    }
}

#[cfg(not(all(target_arch = "wasm32", target_os = "unknown")))]
mod program {
    use std::fs::File;
    use std::io;
    use std::path::{Path, PathBuf};
    use std::process::ExitCode;

    use clap::Parser;
    use clap::error::ErrorKind;
    use indicatif::{ProgressBar, ProgressStyle};
    use volume_io::{
        Conversion, Error, Headerless, RawLayout, ReadOptions, Result, SampleType, ZfpVolume,
        convert_file, read_file, write_npy, write_nrrd, write_raw,
    };

    /// Converts a volume to fixed-rate ZFP with zfp's own header, or back.
    ///
    /// Reads zfp, NIfTI, NumPy, NRRD, VTK `ImageData`, MRC and raw files, also compressed with
    /// gzip. At most four slices of the input are in memory at a time, except for zfp streams
    /// (the compressed file) and arrays whose slices do not follow each other (NumPy in Fortran
    /// order, MRC with sections across z).
    #[derive(Debug, Parser)]
    #[command(version)]
    struct Arguments {
        /// The volume to read; `NAME_XxYxZ_TYPE.raw` says itself what a raw file holds.
        input: PathBuf,
        /// The file to write: .zfp, or .npy, .nrrd or .raw for the samples that the compressed
        /// volume decodes to.
        output: PathBuf,
        /// Bits per voxel.
        #[arg(long, default_value_t = 8.0)]
        rate: f64,
        /// Takes the place of NaN and infinity, which are refused otherwise.
        #[arg(long, value_name = "V", allow_hyphen_values = true)]
        replace_nan: Option<f32>,
        /// Voxels of a raw file (with --type) or of a headerless zfp stream (with --zfp-rate).
        #[arg(long, value_name = "X,Y,Z", value_parser = parse_dims)]
        dims: Option<[u32; 3]>,
        /// Samples of a raw file, such as uint8, int16 or float32.
        #[arg(long = "type", value_name = "T", value_parser = parse_type, requires = "dims")]
        sample_type: Option<SampleType>,
        /// Bits per voxel that a headerless zfp stream has.
        #[arg(long, value_name = "R", requires = "dims", conflicts_with = "sample_type")]
        zfp_rate: Option<f64>,
        /// The samples of a raw file have their most significant byte first.
        #[arg(long)]
        big_endian: bool,
        /// Which volume to take from a file with several, counted from 0.
        #[arg(long, value_name = "N")]
        time_index: Option<u32>,
        /// Which array to take from a file with several.
        #[arg(long, value_name = "NAME")]
        array: Option<String>,
        /// Shows no progress and no report.
        #[arg(short, long)]
        quiet: bool,
    }

    fn parse_dims(text: &str) -> std::result::Result<[u32; 3], String> {
        let sizes: std::result::Result<Vec<u32>, _> =
            text.split([',', 'x']).map(|n| n.trim().parse()).collect();
        sizes
            .ok()
            .and_then(|sizes| sizes.try_into().ok())
            .ok_or_else(|| "expected three numbers such as 64,64,32".into())
    }

    fn parse_type(text: &str) -> std::result::Result<SampleType, String> {
        SampleType::from_raw_name(text).ok_or_else(|| {
            let names: Vec<&str> = SampleType::ALL.iter().map(|ty| ty.raw_name()).collect();
            format!("expected one of {}", names.join(", "))
        })
    }

    impl Arguments {
        fn options(&self) -> ReadOptions {
            let raw = self.dims.zip(self.sample_type);
            let headerless = self.dims.zip(self.zfp_rate);
            ReadOptions {
                rate: self.rate,
                replace_non_finite: self.replace_nan,
                raw: raw.map(|(dims, sample_type)| RawLayout { dims, sample_type }),
                headerless: headerless.map(|(dims, rate)| Headerless { dims, rate }),
                big_endian: self.big_endian,
                time_index: self.time_index,
                array: self.array.clone(),
            }
        }

        /// What to write, by the ending of the output's name.
        fn writer(&self) -> Option<Writer> {
            let ending = self.output.extension()?.to_str()?.to_ascii_lowercase();
            Some(match ending.as_str() {
                "zfp" => Writer::Zfp,
                "npy" => Writer::Decoded(write_npy),
                "nrrd" => Writer::Decoded(write_nrrd),
                "raw" => Writer::Decoded(write_raw),
                _ => return None,
            })
        }
    }

    enum Writer {
        Zfp,
        Decoded(fn(&ZfpVolume, File) -> Result<u64>),
    }

    pub(crate) fn main() -> ExitCode {
        let arguments = Arguments::parse();
        if let Err((kind, message)) = check(&arguments) {
            use clap::CommandFactory;
            Arguments::command().error(kind, message).exit();
        }
        match run(&arguments) {
            Ok(()) => ExitCode::SUCCESS,
            Err(error) => {
                let message = format!("error: {error}\n");
                let shown = io::Write::write_all(&mut io::stderr(), message.as_bytes());
                if shown.is_err() {
                    return ExitCode::from(2);
                }
                ExitCode::FAILURE
            }
        }
    }

    /// Finds what clap cannot.
    fn check(arguments: &Arguments) -> std::result::Result<(), (ErrorKind, &'static str)> {
        if arguments.writer().is_none() {
            let message = "the output's name has to end in .zfp, .npy, .nrrd or .raw";
            return Err((ErrorKind::ValueValidation, message));
        }
        let says_kind = arguments.sample_type.is_some() || arguments.zfp_rate.is_some();
        if arguments.dims.is_some() && !says_kind {
            let message = "--dims needs --type (raw files) or --zfp-rate (headerless zfp)";
            return Err((ErrorKind::MissingRequiredArgument, message));
        }
        Ok(())
    }

    /// Writes to a file of another name first, so that a failure leaves nothing half done and the
    /// input may be replaced by its own conversion.
    fn run(arguments: &Arguments) -> Result<()> {
        let mut partial = arguments.output.clone().into_os_string();
        partial.push(".partial");
        let partial = PathBuf::from(partial);
        let result = convert(arguments, &partial).and_then(|()| {
            std::fs::rename(&partial, &arguments.output)
                .map_err(|source| access(&arguments.output, source))
        });
        if result.is_err() && partial.exists() {
            std::fs::remove_file(&partial).map_err(|source| access(&partial, source))?;
        }
        result
    }

    fn convert(arguments: &Arguments, partial: &Path) -> Result<()> {
        let options = arguments.options();
        let create = || File::create(partial).map_err(|source| access(partial, source));
        match arguments.writer() {
            Some(Writer::Decoded(write)) => {
                let volume = read_file(&arguments.input, &options)?;
                let bytes = write(&volume, create()?)?;
                if !arguments.quiet {
                    report_source(volume.dims, &volume.geometry, &volume.source);
                    println!("written: {bytes} bytes");
                }
            }
            Some(Writer::Zfp) | None => {
                let bar = progress_bar(arguments.quiet);
                let conversion =
                    convert_file(&arguments.input, create()?, &options, |done, total| {
                        bar.set_length(total);
                        bar.set_position(done);
                    })?;
                bar.finish_and_clear();
                if !arguments.quiet {
                    report(&conversion);
                }
            }
        }
        Ok(())
    }

    fn access(path: &Path, source: io::Error) -> Error {
        Error::Io { name: path.display().to_string(), source }
    }

    fn progress_bar(quiet: bool) -> ProgressBar {
        if quiet {
            return ProgressBar::hidden();
        }
        let bar = ProgressBar::new(0);
        let style = "{bar:40} {percent:>3} % of {len} blocks, {eta} left";
        if let Ok(style) = ProgressStyle::with_template(style) {
            bar.set_style(style);
        }
        bar
    }

    fn report(conversion: &Conversion) {
        report_source(conversion.dims, &conversion.geometry, &conversion.source);
        let voxels: f64 = conversion.dims.iter().map(|&n| f64::from(n)).product();
        let rate = f64::from(conversion.bits_per_block) / 64.0;
        let ratio =
            voxels * f64::from(conversion.source.sample_type.bytes()) / conversion.bytes as f64;
        println!("written: {} bytes, {rate} bits per voxel, {ratio:.2} : 1", conversion.bytes);
    }

    fn report_source(dims: [u32; 3], geometry: &volume_io::Geometry, source: &volume_io::Source) {
        let [nx, ny, nz] = dims;
        println!(
            "read: {nx} x {ny} x {nz} voxels, {} of type {}",
            source.format, source.sample_type
        );
        println!("placement: spacing {:?}, origin {:?}", geometry.spacing, geometry.origin);
        for note in &source.notes {
            println!("note: {note}");
        }
        if source.replaced > 0 {
            println!("replaced: {} voxels that were NaN or infinite", source.replaced);
        }
        match source.distortion {
            Some(d) => {
                println!("error: max {:.6e}, RMS {:.6e}, PSNR {:.2} dB", d.max, d.rms, d.psnr_db);
            }
            None => println!("error: none, the compressed stream was kept"),
        }
    }

    #[cfg(test)]
    mod tests {
        use super::*;

        #[test]
        fn arguments_are_checked() {
            let parse = |rest: &[&str]| {
                let all = ["convert", "a.raw", "b.zfp"].iter().chain(rest).copied();
                Arguments::try_parse_from(all)
            };
            let options = parse(&["--dims", "1,2,3", "--type", "int16", "--replace-nan", "-1"]);
            let options = options.unwrap().options();
            assert_eq!(options.raw.unwrap().dims, [1, 2, 3]);
            assert_eq!(options.replace_non_finite, Some(-1.0));
            assert!(parse(&["--dims", "1,2", "--type", "int16"]).is_err());
            assert!(parse(&["--type", "int16"]).is_err());
            assert!(parse(&["--dims", "1,2,3", "--type", "long"]).is_err());
            assert!(check(&parse(&["--dims", "1,2,3"]).unwrap()).is_err());
            assert!(check(&parse(&[]).unwrap()).is_ok());
        }
    }
}
