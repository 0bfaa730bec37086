//! The command line.

use std::path::{Path, PathBuf};

use clap::{Args, Parser, Subcommand, ValueEnum};
use progressive_iso::{BlockSortedOptions, Residency, TraversalStrategy};
use volume_io::SampleType;

use crate::problem::Problem;

const EXAMPLES: &str = "\
Examples:
  render info scan.nii.gz
  render --volume scan.nii.gz --iso 300 --orbit 30,20 --color scan.png --depth scan.exr
  render --volume stream.zfp --dims 512,512,256 --rate 4 --iso -0.2 --eye -10,5,3 --color s.png
  render --volume gyroid:128x128x128 --rate 6 --color gyroid.png

A volume is a file (zfp with or without its own header, NIfTI, NumPy, NRRD, VTK ImageData, MRC,
raw samples; most of them also in gzip), `brain` for the bundled scan, or a generator with its size:
sphere, plane, marschner-lobb, gyroid, shells, turbulence or rough-solid, as in gyroid:128x128x128.

World space: voxel (i, j, k) lies at origin + spacing * (i, j, k); right-handed.

Exit codes: 0 done, 1 trouble with the device or with writing, 2 unusable options or input.";

/// Renders an isosurface of any volume to files.
#[derive(Parser, Debug)]
#[command(
    name = "render",
    after_help = EXAMPLES,
    args_conflicts_with_subcommands = true,
    subcommand_negates_reqs = true,
    arg_required_else_help = true,
    disable_help_subcommand = true
)]
pub struct Arguments {
    #[command(subcommand)]
    pub command: Option<Command>,
    /// Prints the names of the GPU adapters, best first
    #[arg(long, exclusive = true)]
    pub list_adapters: bool,
    /// File, `brain`, or generator such as gyroid:128x128x128
    #[arg(long, value_name = "FILE", required_unless_present = "list_adapters")]
    pub volume: Option<String>,
    #[command(flatten)]
    pub input: InputOptions,
    /// Isovalue in the file's own units; a suggestion is made from the histogram where it is left out
    #[arg(long, value_name = "V", value_parser = finite_f32, allow_hyphen_values = true)]
    pub iso: Option<f32>,
    #[command(flatten)]
    pub scene: SceneOptions,
    #[command(flatten)]
    pub camera: CameraOptions,
    /// Part of an adapter's name, see --list-adapters
    #[arg(long, value_name = "NAME")]
    pub adapter: Option<String>,
    /// How rays are taken through the volume
    #[arg(long, value_enum, default_value_t = Strategy::RunAhead)]
    pub strategy: Strategy,
    /// BlockSorted: ray-block pairs per pixel
    #[arg(long, value_name = "S", default_value_t = 1,
        value_parser = clap::value_parser!(u32).range(1..=8))]
    pub start_factor: u32,
    /// BlockSorted: every ray goes one block at a time
    #[arg(long)]
    pub no_speculation: bool,
    /// Most rounds of walking and decoding per submission; fewer where they take long
    #[arg(long, value_name = "N", default_value_t = 8,
        value_parser = clap::value_parser!(u32).range(1..=1024))]
    pub rounds_per_pass: u32,
    /// RunAhead: active blocks that a ray requests when it first stops, the missing one included; more need
    /// fewer passes and decode more, 1 means none ahead, ever [default: 2]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1024))]
    pub look_ahead: Option<u32>,
    /// Stops at this finished share of the rays that enter the volume, 0 to 1
    #[arg(long, value_name = "SHARE", default_value_t = 1.0, value_parser = share)]
    pub stop: f64,
    /// Colour picture to write (PNG)
    #[arg(long, value_name = "F.png", value_parser = png)]
    pub color: Option<PathBuf>,
    /// Distance along the view axis to write, in world units; +inf where no surface is known (EXR)
    #[arg(long, value_name = "F.exr", value_parser = exr)]
    pub depth: Option<PathBuf>,
    /// Report to write: adapter, plan, one entry per pass (JSON)
    #[arg(long, value_name = "F.json")]
    pub report: Option<PathBuf>,
}

#[derive(Subcommand, Debug)]
pub enum Command {
    /// Prints what a volume holds, a suggested isovalue and the plan for rendering it
    Info {
        /// File, `brain`, or generator such as gyroid:128x128x128
        #[arg(value_name = "FILE")]
        volume: String,
        #[command(flatten)]
        input: InputOptions,
        #[command(flatten)]
        scene: SceneOptions,
    },
}

#[derive(Clone, Copy, Debug, ValueEnum)]
pub enum Strategy {
    /// A ray walks through what is resident and stops at the first missing block
    RunAhead,
    /// The published algorithm: rays are grouped by block and go ahead speculatively
    BlockSorted,
}

impl Arguments {
    /// The strategy with its options, or what contradicts it.
    pub fn traversal(&self) -> Result<TraversalStrategy, Problem> {
        let refuse = |option: &str, strategy: &str| {
            Err(Problem::input(format!("{option} has no meaning with --strategy {strategy}")))
        };
        match self.strategy {
            Strategy::RunAhead if self.start_factor != 1 => refuse("--start-factor", "run-ahead"),
            Strategy::RunAhead if self.no_speculation => refuse("--no-speculation", "run-ahead"),
            Strategy::RunAhead => Ok(TraversalStrategy::RunAhead),
            Strategy::BlockSorted if self.look_ahead.is_some() => {
                refuse("--look-ahead", "block-sorted")
            }
            Strategy::BlockSorted => Ok(TraversalStrategy::BlockSorted(BlockSortedOptions {
                start_factor: self.start_factor,
                speculation: !self.no_speculation,
            })),
        }
    }
}

/// How to read the volume.
#[derive(Args, Debug)]
pub struct InputOptions {
    /// Voxels of a zfp stream without a header (with --rate) or of a raw file (with --type)
    #[arg(long, value_name = "X,Y,Z", value_parser = sizes)]
    pub dims: Option<[u32; 3]>,
    /// Type of a raw file's samples, such as uint8, int16 or float32
    #[arg(long = "type", value_name = "T", value_parser = sample_type, requires = "dims")]
    pub sample_type: Option<SampleType>,
    /// The samples of a raw file have their most significant byte first
    #[arg(long)]
    pub big_endian: bool,
    /// Bits per voxel: of a zfp stream without a header, or to encode other input with (then 8 if
    /// left out)
    #[arg(long, value_name = "R", value_parser = positive)]
    pub rate: Option<f64>,
    /// Distance between voxels, instead of the file's
    #[arg(long, value_name = "X,Y,Z", value_parser = positive_vector)]
    pub spacing: Option<[f64; 3]>,
    /// World position of voxel (0, 0, 0), instead of the file's
    #[arg(long, value_name = "X,Y,Z", value_parser = vector, allow_hyphen_values = true)]
    pub origin: Option<[f64; 3]>,
    /// Takes the place of NaN and infinity in uncompressed input
    #[arg(long, value_name = "V", value_parser = finite_f32, allow_hyphen_values = true)]
    pub replace_nan: Option<f32>,
    /// Which volume to take from a file with several, counted from 0
    #[arg(long, value_name = "N")]
    pub time_index: Option<u32>,
    /// Which array to take from a file with several
    #[arg(long, value_name = "NAME")]
    pub array: Option<String>,
}

/// What the plan depends on.
#[derive(Args, Debug)]
pub struct SceneOptions {
    /// Width and height of the picture in pixels
    #[arg(long, value_name = "WxH", default_value = "960x720", value_parser = size)]
    pub size: [u32; 2],
    /// GPU memory in MiB, everything included
    #[arg(long, value_name = "MiB", default_value_t = 256,
        value_parser = clap::value_parser!(u64).range(1..=1 << 24))]
    pub budget: u64,
    /// What is kept of the decoded volume
    #[arg(long, value_enum, default_value_t = Kept::Auto)]
    pub residency: Kept,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
pub enum Kept {
    /// All of it where the budget allows that, else what rays see
    Auto,
    /// What rays see, in a cache
    Cached,
    /// All of it
    Full,
}

impl From<Kept> for Residency {
    fn from(kept: Kept) -> Self {
        match kept {
            Kept::Auto => Self::Auto,
            Kept::Cached => Self::Cached,
            Kept::Full => Self::Full,
        }
    }
}

/// Where the viewer is.
#[derive(Args, Debug)]
pub struct CameraOptions {
    /// World position of the viewer
    #[arg(long, value_name = "x,y,z", value_parser = vector, allow_hyphen_values = true)]
    pub eye: Option<[f64; 3]>,
    /// World position in the middle of the picture; the volume's centre if left out
    #[arg(long, value_name = "x,y,z", value_parser = vector, allow_hyphen_values = true,
        requires = "eye")]
    pub target: Option<[f64; 3]>,
    /// Direction that points up; +y if left out
    #[arg(long, value_name = "x,y,z", value_parser = vector, allow_hyphen_values = true,
        requires = "eye")]
    pub up: Option<[f64; 3]>,
    /// Azimuth and elevation in degrees about the volume's centre, +y up; 0,0 looks along -z and
    /// the volume is fitted to the frame; 30,20 if neither this nor --eye is given
    #[arg(long, value_name = "AZ,EL", value_parser = angles, allow_hyphen_values = true,
        conflicts_with = "eye")]
    pub orbit: Option<[f64; 2]>,
    /// Vertical field of view in degrees
    #[arg(long, value_name = "D", default_value_t = 40.0, value_parser = field_of_view)]
    pub fov: f64,
    /// Parallel projection that shows this many world units from bottom to top
    #[arg(long, value_name = "HEIGHT", value_parser = positive, conflicts_with = "fov")]
    pub ortho: Option<f64>,
}

fn numbers<const N: usize>(text: &str) -> Result<[f64; N], String> {
    let parts = text.split(',').map(|part| finite(part.trim())).collect::<Result<Vec<_>, _>>()?;
    let found = parts.len();
    let expected = |_| format!("expected {N} numbers with commas, found {found}");
    parts.try_into().map_err(expected)
}

fn finite(text: &str) -> Result<f64, String> {
    let value: f64 =
        text.parse().map_err(|error| format!("\"{text}\" is not a number: {error}"))?;
    if value.is_finite() { Ok(value) } else { Err(format!("{text} is not finite")) }
}

fn finite_f32(text: &str) -> Result<f32, String> {
    let value = finite(text)? as f32;
    if value.is_finite() { Ok(value) } else { Err(format!("{text} exceeds 32-bit floats")) }
}

fn sample_type(text: &str) -> Result<SampleType, String> {
    SampleType::from_raw_name(text)
        .ok_or_else(|| "expected a type such as uint8, int16 or float32".into())
}

fn positive(text: &str) -> Result<f64, String> {
    let value = finite(text)?;
    if value > 0.0 { Ok(value) } else { Err("expected a number above 0".into()) }
}

fn share(text: &str) -> Result<f64, String> {
    let value = finite(text)?;
    if (0.0..=1.0).contains(&value) { Ok(value) } else { Err("expected 0 to 1".into()) }
}

fn field_of_view(text: &str) -> Result<f64, String> {
    let value = finite(text)?;
    let valid = value > 0.0 && value < 180.0;
    if valid { Ok(value) } else { Err("expected more than 0 and less than 180 degrees".into()) }
}

fn vector(text: &str) -> Result<[f64; 3], String> {
    numbers(text)
}

fn angles(text: &str) -> Result<[f64; 2], String> {
    numbers(text)
}

fn positive_vector(text: &str) -> Result<[f64; 3], String> {
    let vector: [f64; 3] = numbers(text)?;
    let valid = vector.iter().all(|&v| v > 0.0);
    if valid { Ok(vector) } else { Err("expected three numbers above 0".into()) }
}

/// Counts from 1 on with `separator` between them.
fn counts<const N: usize>(text: &str, separator: char) -> Result<[u32; N], String> {
    let expected = || format!("expected {N} whole numbers above 0 with '{separator}' between them");
    let count = |part: &str| part.trim().parse().ok().filter(|&n: &u32| n > 0);
    let parts = text.split(separator).map(count).collect::<Option<Vec<u32>>>();
    parts.and_then(|parts| parts.try_into().ok()).ok_or_else(expected)
}

fn sizes(text: &str) -> Result<[u32; 3], String> {
    counts(text, ',')
}

fn size(text: &str) -> Result<[u32; 2], String> {
    counts(text, 'x')
}

/// The size of a generated volume: `AxBxC`, or `A` for a cube.
pub fn generator_size(text: &str) -> Option<[u32; 3]> {
    counts(text, 'x').or_else(|_| counts(text, 'x').map(|[n]| [n; 3])).ok()
}

fn png(text: &str) -> Result<PathBuf, String> {
    with_ending(text, "png")
}

fn exr(text: &str) -> Result<PathBuf, String> {
    with_ending(text, "exr")
}

fn with_ending(text: &str, ending: &str) -> Result<PathBuf, String> {
    let path = Path::new(text);
    let found = path.extension().is_some_and(|e| e.eq_ignore_ascii_case(ending));
    if found { Ok(path.into()) } else { Err(format!("expected a name that ends in .{ending}")) }
}
