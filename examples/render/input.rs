//! Volumes from files and generators, and what they hold.

use std::path::Path;

use progressive_iso::{RendererOptions, ScenePlan, wgpu};
use volume_io::{Format, Headerless, RawLayout, ReadOptions, ZfpVolume};

use crate::arguments::{InputOptions, SceneOptions, generator_size};
use crate::problem::Problem;

/// Bits per voxel at which input that is not fixed-rate ZFP is encoded.
const DEFAULT_RATE: f64 = 8.0;

/// Intervals for the suggested isovalue, and lines of the printed histogram.
const BINS: usize = 256;
const LINES: usize = 16;

/// A volume and what is known about it.
pub struct Input {
    pub name: String,
    pub volume: ZfpVolume,
    known_isovalue: Option<f32>,
    notes: Vec<String>,
}

impl Input {
    /// Reads a file or, where there is none of this name, makes a generator's volume.
    pub fn read(name: &str, options: &InputOptions) -> Result<Self, Problem> {
        let read_options = read_options(options)?;
        let (volume, known_isovalue) = match Generated::parse(name) {
            Some(generated) if !Path::new(name).exists() => generated.volume(options)?,
            _ => (volume_io::read_file(name, &read_options)?, None),
        };
        let mut input = Self { name: name.into(), volume, known_isovalue, notes: Vec::new() };
        input.note_unused(options);
        let geometry = &mut input.volume.geometry;
        geometry.spacing = options.spacing.unwrap_or(geometry.spacing);
        geometry.origin = options.origin.unwrap_or(geometry.origin);
        Ok(input)
    }

    fn note_unused(&mut self, options: &InputOptions) {
        let source = &self.volume.source;
        let takes_dims = matches!(source.format, Format::ZfpHeaderless | Format::Raw);
        let takes_rate = source.encoded || source.format == Format::ZfpHeaderless;
        self.notes.extend(source.notes.iter().map(ToString::to_string));
        if source.tiny_blocks > 0 {
            let text = "blocks hold nothing above 2^-96 in size and are taken as 0";
            self.notes.push(format!("{} {text}", source.tiny_blocks));
        }
        if source.replaced > 0 {
            self.notes.push(format!("{} samples that were not finite replaced", source.replaced));
        }
        if options.dims.is_some() && !takes_dims {
            let text = "--dims is for zfp streams without a header and raw files, and was not used";
            self.notes.push(text.into());
        }
        if options.rate.is_some() && !takes_rate {
            self.notes.push("the stream has its own rate, --rate was not used".into());
        }
    }

    /// What the volume is made of, line by line.
    pub fn describe(&self) -> String {
        let (volume, source) = (&self.volume, &self.volume.source);
        let [x, y, z] = volume.dims;
        let rate = volume.rate();
        let mut text = format!("volume        {}\n", self.name);
        let mut line = |name: &str, value: String| text += &format!("{name:<13} {value}\n");
        let format = match source.format {
            Format::Memory => "generated".into(),
            format => format.to_string(),
        };
        line("format", format!("{format}, {} samples", source.sample_type));
        line("dims", format!("{x} x {y} x {z} voxels in {} blocks", volume.block_count()));
        line(
            "stream",
            format!(
                "{} bits per block, {rate} bits per voxel, {} bytes",
                volume.bits_per_block,
                volume.bytes.len()
            ),
        );
        line(
            "error",
            match (&source.distortion, source.encoded) {
                (Some(d), _) => format!(
                    "largest {:.3e}, root mean square {:.3e}, PSNR {:.1} dB, from encoding at {rate} bits per voxel",
                    d.max, d.rms, d.psnr_db
                ),
                (None, true) => format!("not measured, encoded at {rate} bits per voxel"),
                (None, false) => "none added, the stream is used as it is".into(),
            },
        );
        line("spacing", triple(volume.geometry.spacing));
        line("origin", triple(volume.geometry.origin));
        for note in &self.notes {
            line("note", note.clone());
        }
        text
    }

    /// A generator's own isovalue, or one from the histogram.
    pub fn suggested_isovalue(&self) -> f32 {
        self.known_isovalue.unwrap_or_else(|| self.volume.histogram(BINS).suggested_isovalue())
    }

    /// Value range, histogram and a suggested isovalue.
    pub fn statistics(&self) -> String {
        let histogram = self.volume.histogram(BINS);
        let [low, high] = histogram.range();
        let isovalue = self.known_isovalue.unwrap_or_else(|| histogram.suggested_isovalue());
        let mut text =
            format!("values        {low} to {high}\nisovalue      {isovalue} suggested\n");
        text += "\nhistogram (length: logarithm of the count)\n";
        let counts: Vec<u64> =
            histogram.counts().chunks(BINS / LINES).map(|bins| bins.iter().sum()).collect();
        let length = |count: u64| (count as f64).ln_1p();
        let longest = counts.iter().map(|&c| length(c)).fold(1.0, f64::max);
        for (i, &count) in counts.iter().enumerate() {
            let from = low + (high - low) * (i as f32 / LINES as f32);
            let bar = "#".repeat((40.0 * length(count) / longest).round() as usize);
            text += &format!("{from:>12.5}  {bar:<40}  {count}\n");
        }
        text
    }

    /// The plan for rendering the volume to files on a device with WebGPU's default limits.
    pub fn plan(&self, scene: &SceneOptions) -> Result<String, Problem> {
        let volume = (&self.volume).try_into()?;
        let options = RendererOptions {
            size: scene.size,
            budget_bytes: scene.budget << 20,
            residency: scene.residency.into(),
            capture: true,
            ..Default::default()
        };
        Ok(ScenePlan::new(&volume, &options, &wgpu::Limits::default())?.explain())
    }
}

fn triple([x, y, z]: [f64; 3]) -> String {
    format!("{x}, {y}, {z}")
}

fn read_options(options: &InputOptions) -> Result<ReadOptions, Problem> {
    let (dims, sample_type) = (options.dims, options.sample_type);
    if dims.is_some() && options.rate.is_none() && sample_type.is_none() {
        let hint = "add --rate R for a zfp stream without a header, --type T for a raw file";
        return Err(Problem::input("--dims alone does not say how to read a file").hint(hint));
    }
    let raw = dims.zip(sample_type).map(|(dims, sample_type)| RawLayout { dims, sample_type });
    let headerless = dims.zip(options.rate).filter(|_| raw.is_none());
    Ok(ReadOptions {
        rate: options.rate.unwrap_or(DEFAULT_RATE),
        replace_non_finite: options.replace_nan,
        headerless: headerless.map(|(dims, rate)| Headerless { dims, rate }),
        time_index: options.time_index,
        raw,
        big_endian: options.big_endian,
        array: options.array.clone(),
    })
}

/// A volume that this program can make itself.
enum Generated<'a> {
    Brain,
    Field { name: &'a str, dims: [u32; 3] },
}

impl<'a> Generated<'a> {
    fn parse(text: &'a str) -> Option<Self> {
        if text == "brain" {
            return Some(Self::Brain);
        }
        let (name, size) = text.rsplit_once(':')?;
        Some(Self::Field { name, dims: generator_size(size)? })
    }

    fn volume(self, options: &InputOptions) -> Result<(ZfpVolume, Option<f32>), Problem> {
        match self {
            Self::Brain => Ok((volumes::brain(), Some(volumes::BRAIN_ISOVALUE))),
            Self::Field { name, dims } => {
                // Said before hours of sampling rather than after.
                let most = wgpu::Limits::default().max_storage_buffer_binding_size / 4;
                let blocks: u128 = dims.map(|n| u128::from(n.div_ceil(4))).iter().product();
                if blocks > u128::from(most) {
                    let message =
                        format!("{dims:?} voxels are {blocks} blocks, at most {most} fit");
                    return Err(Problem::input(message));
                }
                let field = volumes::by_name(name, dims).map_err(Problem::input)?;
                let rate = options.rate.unwrap_or(DEFAULT_RATE);
                let volume = volumes::generate(&*field, dims, rate)?;
                Ok((volume, Some(field.suggested_isovalue() as f32)))
            }
        }
    }
}
