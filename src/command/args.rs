//! Command-line arguments, parsed by clap. Doc comments of arguments are their help texts.

mod values;

use crate::dashboard::preferences::Preferences;
use crate::dashboard::run::TerminalSetup;
use crate::measure::{EXPERIMENTS, Experiment};
use clap::{Args, Parser, Subcommand};
use clap_complete::Shell;
use std::path::{Path, PathBuf};
use values::{
    COLORS, ColorChoice, DEPTHS, GRAPHICS, PRECISIONS, SAMPLERS, bandwidth, choice, exposure,
    file_of, memory, not_negative, positive, size,
};
use zerkalo_kernel::sampling::SamplerKind;
use zerkalo_render::film::Display;
use zerkalo_render::image_file::Depth;
use zerkalo_render::plan::MAX_SHARDS;
use zerkalo_scene::disk::{Existing, Replacement, WriteError, check_writable};
use zerkalo_scene::{Acceleration, Scene, Tone};
use zerkalo_terminal::Environment;
use zerkalo_terminal::image::GraphicsMode;
use zerkalo_world::Precision;

/// A progressive, accumulating ray tracer that lives in a terminal.
#[derive(Debug, Parser)]
#[command(version, about, args_conflicts_with_subcommands = true)]
#[command(after_help = "`--help` lists examples, exit statuses and environment variables.")]
#[command(after_long_help = include_str!("help/zerkalo.txt").trim_end())]
pub struct Cli {
    #[command(subcommand)]
    pub command: Option<Command>,
    /// Print errors only
    #[arg(short, long, global = true)]
    pub quiet: bool,
    #[command(flatten)]
    pub edit: EditArgs,
}

/// Arguments of `zerkalo` without a subcommand.
#[derive(Clone, Debug, Args)]
pub struct EditArgs {
    /// A scene file [default: a built-in scene], :NAME for a built-in scene, or a checkpoint to
    /// continue
    pub scene: Option<PathBuf>,
    #[command(flatten)]
    pub compute: ComputeArgs,
    #[command(flatten)]
    pub precision: PrecisionArgs,
    #[command(flatten)]
    pub terminal: TerminalArgs,
    /// Write the latencies of keys and mouse as CSV
    #[arg(long, value_name = "FILE.csv", hide = true)]
    pub trace: Option<PathBuf>,
}

/// Options of every command that shows the dashboard.
#[derive(Clone, Copy, Debug, Args)]
pub struct TerminalArgs {
    /// Colours of the terminal: 24-bit, 256, 16 or none; auto: from the environment and the
    /// terminal's replies
    #[arg(long, value_parser = choice(COLORS), default_value = "auto")]
    color: ColorChoice,
    /// Protocol that shows the picture; auto: the best one that is known to work in the terminal
    #[arg(long, value_parser = choice(GRAPHICS), default_value = "auto")]
    graphics: GraphicsMode,
    /// Kilobytes per second sent to the terminal [default: over SSH the measured rate of the
    /// connection; else unlimited]
    #[arg(long, value_name = "KB", value_parser = bandwidth, allow_negative_numbers = true)]
    bandwidth: Option<f64>,
}

/// Option of every command that traces.
#[derive(Clone, Copy, Debug, Args)]
pub struct ThreadArgs {
    /// Number of tracing threads, 1 to 4096, of which at most 16, or four per processor if that is
    /// more, are started [default: one per processor]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=4096), allow_negative_numbers = true)]
    threads: Option<u16>,
}

/// Options of every command that renders.
#[derive(Clone, Copy, Debug, Args)]
pub struct ComputeArgs {
    #[command(flatten)]
    threads: ThreadArgs,
    /// Random seed; equal seeds give equal pictures
    #[arg(long, value_name = "N", default_value_t = 0, allow_negative_numbers = true)]
    pub seed: u64,
}

/// Option of every command that reports results.
#[derive(Clone, Copy, Debug, Args)]
pub struct JsonArgs {
    /// Print the results as JSON
    #[arg(long)]
    pub json: bool,
}

/// Option of every command that writes files.
#[derive(Clone, Copy, Debug, Args)]
pub struct ClobberArgs {
    /// Refuse to replace files that exist
    #[arg(short, long)]
    no_clobber: bool,
}

/// Arguments of every command that compiles a scene: the option `--precision`.
#[derive(Clone, Copy, Debug, Args)]
pub struct PrecisionArgs {
    /// Floating-point precision of the geometry; auto: double where the scene's proportions need it
    #[arg(long, value_parser = choice(PRECISIONS), default_value = "auto")]
    pub precision: Precision,
}

/// Arguments of every command that makes a picture: size and display.
#[derive(Clone, Copy, Debug, Args)]
pub struct PictureArgs {
    /// Width and height in pixels, instead of the scene's
    #[arg(long, value_name = "WxH", value_parser = size)]
    pub size: Option<[u32; 2]>,
    /// Exposure of the displayed picture, in stops: radiance times 2 to the power of EV
    #[arg(long, value_name = "EV", default_value_t = 0.0, value_parser = exposure, allow_negative_numbers = true)]
    exposure: f64,
    /// Tone curve for light brighter than white: clip it, or compress it and keep the hue
    /// [default: the scene's `film.tone`]
    #[arg(long, value_parser = choice(Tone::ALL.map(|tone| (tone.name(), None, tone))))]
    tone: Option<Tone>,
}

/// Subcommands of `zerkalo`.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Render a scene to a picture file
    Render(Box<RenderArgs>),
    /// Divide a render into shards: parts that other processes or machines trace
    Plan(Box<PlanArgs>),
    /// Trace shards of a plan together with other processes, through all rounds
    Work(WorkArgs),
    /// Print how far a plan is: percent, hours left, late and failed shards
    Status(StatusArgs),
    /// Merge the film files of the shards of a plan into one picture
    Merge(MergeArgs),
    /// Show renders of other processes or machines while they run, from their film files
    Watch(WatchArgs),
    /// Measure the cost of accuracy on a scene: seconds to a given noise, gain and cost of settings
    Measure(Box<MeasureArgs>),
    /// Validate a scene and print its contents
    Check(CheckArgs),
    /// Print the origin of a picture, checkpoint or plan: scene, samples, noise, seed, shards
    Info(InfoArgs),
    /// Compare two pictures: RMSE, largest difference, and what the noise of both explains
    Compare(CompareArgs),
    /// List the built-in scenes, print one or copy it to a file
    Scenes(ScenesArgs),
    /// Write a commented starter scene
    #[command(after_help = include_str!("help/new.txt").trim_end())]
    New {
        /// The scene file to write; must not exist
        file: PathBuf,
    },
    /// Report the capabilities of the terminal and of the connection, and how to improve them
    #[command(after_help = include_str!("help/doctor.txt").trim_end())]
    Doctor(JsonArgs),
    /// Print options, keys and colours in force, as a configuration file
    Config,
    /// Print the completions of a shell
    Completions { shell: Shell },
    /// Write the manual pages of all commands
    Man {
        /// The folder to write them to
        folder: PathBuf,
    },
}

/// Arguments of `zerkalo render`.
#[derive(Clone, Debug, Args)]
#[command(after_help = include_str!("help/render.txt").trim_end())]
pub struct RenderArgs {
    /// The scene file; - for stdin, :NAME for a built-in scene (`zerkalo scenes` lists them)
    pub scene: PathBuf,
    /// Further scenes, rendered one after another; %d in the names of files is then the number of
    /// the scene, from 1, and %04d has leading zeros
    #[arg(value_name = "SCENE", conflicts_with = "plan")]
    pub more: Vec<PathBuf>,
    /// The picture file; its extension chooses the format: .png, .exr or .hdr; - for stdout
    #[arg(short, long, value_name = "FILE")]
    pub output: PathBuf,
    /// Format of the picture, instead of that of the extension [default for stdout: png]
    #[arg(long, value_parser = ["png", "exr", "hdr"], conflicts_with = "plan")]
    pub format: Option<String>,
    #[command(flatten)]
    pub clobber: ClobberArgs,
    #[command(flatten)]
    pub picture: PictureArgs,
    /// Stop at this many samples per pixel (the mean, if adaptive; rounds up to even)
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..), allow_negative_numbers = true)]
    pub spp: Option<u32>,
    /// Stop at this noise: estimated RMSE of the displayed picture, in 8-bit levels [default: 0.5]
    #[arg(long, value_name = "LEVELS", value_parser = positive, allow_negative_numbers = true)]
    pub noise: Option<f64>,
    /// Stop at this estimated RMSE of the linear picture
    #[arg(long, value_name = "LINEAR", value_parser = positive, allow_negative_numbers = true)]
    pub rmse: Option<f64>,
    /// Stop at this error of the displayed picture, in 8-bit levels: noise, rounding, cut paths and
    /// 8 bits together. Chooses double precision where single is not enough
    #[arg(long, value_name = "LEVELS", value_parser = positive, conflicts_with_all = ["noise", "rmse", "memory"], allow_negative_numbers = true)]
    pub error: Option<f64>,
    /// Stop in time to have written the picture after this many seconds
    #[arg(long, value_name = "SECONDS", value_parser = positive, allow_negative_numbers = true)]
    pub time: Option<f64>,
    #[command(flatten)]
    pub compute: ComputeArgs,
    #[command(flatten)]
    pub precision: PrecisionArgs,
    /// Acceleration structure, instead of the scene's; every choice renders the same picture
    #[arg(long, value_parser = choice(Acceleration::ALL.map(|a| (a.name(), None, a))))]
    pub acceleration: Option<Acceleration>,
    /// Sampler: sobol spreads samples evenly, random is for comparison
    #[arg(long, value_parser = choice(SAMPLERS), default_value = "sobol")]
    pub sampler: SamplerKind,
    /// Give every pixel the same number of samples
    #[arg(long)]
    pub uniform: bool,
    /// Trace the samples of a plan, which `zerkalo plan` has written
    #[arg(long, value_name = "FILE", conflicts_with_all = ["size", "exposure", "tone", "spp", "noise", "rmse", "error", "time", "seed", "precision", "sampler", "uniform", "stats"])]
    pub plan: Option<PathBuf>,
    /// Trace only this shard of the plan, into a .zk file
    #[arg(
        long,
        value_name = "K",
        requires = "plan",
        conflicts_with = "no_clobber",
        allow_negative_numbers = true
    )]
    pub shard: Option<u32>,
    /// Stay below this much memory, such as 4GB: if needed, lights share a light group; if that is
    /// not enough, the picture is rendered in regions and written row by row
    #[arg(long, value_name = "SIZE", value_parser = memory, conflicts_with = "plan", allow_negative_numbers = true)]
    pub memory: Option<u64>,
    /// Bits per channel of a PNG
    #[arg(long, default_value = "8", value_parser = choice(DEPTHS))]
    pub bits: Depth,
    /// Write statistics of the run as JSON
    #[arg(long, value_name = "FILE.json")]
    pub stats: Option<PathBuf>,
    /// Keep the samples in this file: every minute, on signals and at the end
    #[arg(long, value_name = "FILE.zk", conflicts_with = "plan")]
    pub checkpoint: Option<PathBuf>,
    /// Seconds between checkpoints
    #[arg(long, value_name = "SECONDS", value_parser = positive, default_value_t = 60.0, requires = "checkpoint", allow_negative_numbers = true)]
    pub checkpoint_interval: f64,
    /// Continue this checkpoint. If --checkpoint names the same file and it does not exist yet, the
    /// render starts anew
    #[arg(long, value_name = "FILE.zk", conflicts_with = "plan")]
    pub resume: Option<PathBuf>,
}

/// Arguments of `zerkalo plan`.
#[derive(Clone, Debug, Args)]
#[command(after_help = include_str!("help/plan.txt").trim_end())]
pub struct PlanArgs {
    /// The scene file
    #[arg(required_unless_present = "from", conflicts_with = "from")]
    pub scene: Option<PathBuf>,
    /// The plan file to write
    #[arg(
        short,
        long,
        value_name = "FILE.plan",
        required_unless_present = "from",
        conflicts_with = "from"
    )]
    pub output: Option<PathBuf>,
    #[command(flatten)]
    pub clobber: ClobberArgs,
    #[command(flatten)]
    pub json: JsonArgs,
    /// Target: estimated RMSE of the displayed picture, in 8-bit levels
    #[arg(long, value_name = "LEVELS", value_parser = positive, default_value_t = 0.5, allow_negative_numbers = true)]
    pub noise: f64,
    /// Number of shards; eight to sixteen for each machine
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=i64::from(MAX_SHARDS)), required_unless_present = "from", allow_negative_numbers = true)]
    pub shards: Option<u32>,
    /// Plan a further round of this finished job, to a lower noise
    #[arg(long, value_name = "PLAN", conflicts_with_all = ["size", "exposure", "tone", "seed", "precision", "sampler"])]
    pub from: Option<PathBuf>,
    #[command(flatten)]
    pub picture: PictureArgs,
    /// Random seed; equal seeds give equal pictures
    #[arg(long, value_name = "N", default_value_t = 0, allow_negative_numbers = true)]
    pub seed: u64,
    #[command(flatten)]
    pub precision: PrecisionArgs,
    /// Sampler: sobol spreads samples evenly, random is for comparison
    #[arg(long, value_parser = choice(SAMPLERS), default_value = "sobol")]
    pub sampler: SamplerKind,
}

/// Arguments of `zerkalo merge`.
#[derive(Clone, Debug, Args)]
#[command(after_help = include_str!("help/merge.txt").trim_end())]
pub struct MergeArgs {
    /// The plan, which stands for the film files of its last round beside it: job.plan for
    /// job-1.zk, job-2.zk and so on; or film files in any order
    #[arg(required = true, value_name = "PLAN|PART.zk")]
    pub parts: Vec<PathBuf>,
    /// The file to write: a picture (.png, .exr) or a film (.zk)
    #[arg(short, long, value_name = "FILE")]
    pub output: PathBuf,
    #[command(flatten)]
    pub clobber: ClobberArgs,
    #[command(flatten)]
    pub json: JsonArgs,
    /// Accept missing and unfinished shards, and report what they cost in noise
    #[arg(long)]
    pub partial: bool,
    /// Bits per channel of a PNG
    #[arg(long, default_value = "8", value_parser = choice(DEPTHS))]
    pub bits: Depth,
}

/// Arguments of `zerkalo measure`.
#[derive(Clone, Debug, Args)]
#[command(after_help = include_str!("help/measure.txt").trim_end())]
pub struct MeasureArgs {
    /// The scene file
    pub scene: PathBuf,
    /// Noise targets, in 8-bit levels
    #[arg(long, value_name = "LEVELS,..", value_parser = positive, value_delimiter = ',', default_value = "2,1,0.5,0.25")]
    pub noise: Vec<f64>,
    /// Compare only these settings
    #[arg(long, value_name = "SETTING,..", value_parser = choice(EXPERIMENTS.each_ref().map(|e| (e.name, Some(e.title), e))), value_delimiter = ',', conflicts_with = "full")]
    pub only: Vec<&'static Experiment>,
    /// Compare all settings, which takes about five minutes
    #[arg(long)]
    pub full: bool,
    /// Approximate duration of all measurements [default: 50, with --full 300]
    #[arg(long, value_name = "SECONDS", value_parser = positive, allow_negative_numbers = true)]
    pub seconds: Option<f64>,
    /// Least number of timed runs of each setting
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u16).range(1..=1000))]
    pub repetitions: u16,
    /// Picture to measure errors against, instead of one rendered with another seed
    #[arg(long, value_name = "FILE.exr")]
    pub reference: Option<PathBuf>,
    #[command(flatten)]
    pub picture: PictureArgs,
    #[command(flatten)]
    pub compute: ComputeArgs,
    /// Write all results as JSON
    #[arg(long, value_name = "FILE.json")]
    pub json: Option<PathBuf>,
    /// Write errors against samples and seconds as CSV
    #[arg(long, value_name = "FILE.csv")]
    pub csv: Option<PathBuf>,
    /// Plot error against time
    #[arg(long, value_name = "FILE.svg", value_parser = |name: &str| file_of(name, "svg"))]
    pub plot: Option<PathBuf>,
}

/// Arguments of `zerkalo watch`.
#[derive(Debug, Args)]
#[command(after_help = include_str!("help/watch.txt").trim_end())]
pub struct WatchArgs {
    /// Film files of the shards of one plan, or one checkpoint; a plan file stands for the film
    /// files of its latest round (job.plan: job-1.zk, job-2.zk, ..)
    #[arg(required = true, value_name = "FILE.zk")]
    pub files: Vec<PathBuf>,
    #[command(flatten)]
    pub terminal: TerminalArgs,
}

/// Arguments of `zerkalo check`.
#[derive(Debug, Args)]
#[command(after_help = include_str!("help/check.txt").trim_end())]
pub struct CheckArgs {
    /// The scene file; - for stdin
    pub scene: PathBuf,
    #[command(flatten)]
    pub json: JsonArgs,
}

/// Arguments of `zerkalo compare`.
#[derive(Debug, Args)]
#[command(after_help = include_str!("help/compare.txt").trim_end())]
pub struct CompareArgs {
    /// A PNG or OpenEXR picture
    pub a: PathBuf,
    /// The picture to compare it with
    pub b: PathBuf,
    /// Write a picture of the difference: orange where B is brighter, blue where it is darker
    #[arg(short, long, value_name = "FILE.png", value_parser = |name: &str| file_of(name, "png"))]
    pub output: Option<PathBuf>,
    /// Exit with status 1 if the RMSE exceeds this number of 8-bit levels
    #[arg(long, value_name = "LEVELS", value_parser = not_negative, allow_negative_numbers = true)]
    pub threshold: Option<f64>,
    #[command(flatten)]
    pub json: JsonArgs,
}

/// Arguments of `zerkalo scenes`.
#[derive(Debug, Args)]
#[command(after_help = include_str!("help/scenes.txt").trim_end())]
pub struct ScenesArgs {
    /// The scene to print
    pub name: Option<String>,
    /// The file to copy it to; must not exist
    #[arg(requires = "name")]
    pub file: Option<PathBuf>,
}

/// Arguments of `zerkalo work`.
#[derive(Debug, Args)]
#[command(after_help = include_str!("help/work.txt").trim_end())]
pub struct WorkArgs {
    /// The scene file of the plan
    pub scene: PathBuf,
    /// The plan, which `zerkalo plan` has written; parts and later plans are written beside it
    pub plan: PathBuf,
    #[command(flatten)]
    pub threads: ThreadArgs,
    /// Acceleration structure, instead of the scene's; every choice renders the same picture
    #[arg(long, value_parser = choice(Acceleration::ALL.map(|a| (a.name(), None, a))))]
    pub acceleration: Option<Acceleration>,
}

/// Arguments of `zerkalo status`.
#[derive(Debug, Args)]
pub struct StatusArgs {
    /// The plan
    pub plan: PathBuf,
    #[command(flatten)]
    pub json: JsonArgs,
}

/// Arguments of `zerkalo info`.
#[derive(Debug, Args)]
#[command(after_help = include_str!("help/info.txt").trim_end())]
pub struct InfoArgs {
    /// A PNG, OpenEXR, checkpoint or plan file
    pub file: PathBuf,
    /// Compare the file with this scene; exit status 1 if it shows another one
    #[arg(long, value_name = "SCENE")]
    pub scene: Option<PathBuf>,
    #[command(flatten)]
    pub json: JsonArgs,
}

fn processors() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}

/// Returns the number to which `--threads` is limited. More threads wait for each other: with 4,096
/// threads on two processors, a render of 64 x 48 pixels takes half a minute.
fn max_threads() -> usize {
    usize::max(16, 4 * processors())
}

impl TerminalArgs {
    pub fn setup(&self, environment: Environment, preferences: Preferences) -> TerminalSetup {
        let bandwidth = self.bandwidth.map(|kilobytes| 1e3 * kilobytes);
        let (colors, graphics) = (self.color, self.graphics);
        TerminalSetup { colors, environment, graphics, bandwidth, preferences }
    }
}

impl ThreadArgs {
    /// Returns the number of threads that trace rays.
    pub fn count(&self) -> usize {
        self.threads.map_or_else(processors, |given| usize::from(given).min(max_threads()))
    }
}

impl ComputeArgs {
    /// Returns the number of threads that trace rays.
    pub fn threads(&self) -> usize {
        self.threads.count()
    }
}

impl ClobberArgs {
    pub fn existing(&self) -> Existing {
        if self.no_clobber { Existing::Refuse } else { Existing::Replace }
    }

    /// Checks that the file at `path` can be written.
    pub fn check_writable(&self, path: &Path) -> Result<(), WriteError> {
        match self.existing() {
            Existing::Replace => check_writable(path),
            Existing::Refuse => Replacement::begin(path, Existing::Refuse).map(drop),
        }
    }
}

impl PictureArgs {
    pub fn display(&self, scene: &Scene) -> Display {
        let tone = self.tone.unwrap_or(scene.film.tone);
        Display { exposure_ev: self.exposure, tone }
    }

    /// Sets the size of `scene` to `--size`.
    ///
    /// # Errors
    /// Returns the first validation error of the scene with the new size.
    pub fn resize(&self, scene: &mut Scene) -> Result<(), String> {
        let Some(size) = self.size else { return Ok(()) };
        scene.film.size = size;
        match scene.faults().first() {
            Some(fault) => Err(format!("--size {}x{}: {fault}", size[0], size[1])),
            None => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;
    use zerkalo_terminal::cells::Colors;

    #[test]
    fn command_line_definition_is_consistent() {
        Cli::command().debug_assert();
    }

    fn render(more: &[&str]) -> Result<Box<RenderArgs>, clap::Error> {
        let start = ["zerkalo", "render", "a.toml", "-o", "a.png"];
        let cli = Cli::try_parse_from(start.iter().chain(more))?;
        match cli.command {
            Some(Command::Render(args)) => Ok(args),
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn accelerations_are_parsed_by_name() {
        for structure in Acceleration::ALL {
            let args = render(&["--acceleration", structure.name()]).unwrap();
            assert_eq!(args.acceleration, Some(structure));
        }
        assert!(render(&["--acceleration", "tree"]).is_err());
    }

    #[test]
    fn sizes_have_two_sides() {
        assert_eq!(render(&["--size", "640x480"]).unwrap().picture.size, Some([640, 480]));
        for wrong in ["640", "640x", "x480", "640x-1", "640X480", "1x1x1", "5000000000x1", ""] {
            assert!(render(&["--size", wrong]).is_err(), "{wrong}");
        }
    }

    #[test]
    fn sizes_of_memory_have_units() {
        let memory = |text: &str| render(&["--memory", text]).map(|args| args.memory.unwrap());
        for (text, bytes) in [
            ("4GB", 4_000_000_000),
            ("1.5gib", 1_610_612_736),
            ("800 MB", 800_000_000),
            ("1KB", 1000),
        ] {
            assert_eq!(memory(text).unwrap(), bytes, "{text}");
        }
        for wrong in ["4", "GB", "-1GB", "0MB", "4TB", "1e99GB", "nanGB", "infKB", "", "é", "4 G B"]
        {
            assert_eq!(memory(wrong).unwrap_err().exit_code(), 2, "{wrong}");
        }
    }

    #[test]
    fn numbers_have_ranges() {
        assert_eq!(render(&["--exposure", "-1.5"]).unwrap().picture.exposure, -1.5);
        for wrong in [
            ["--noise", "0"],
            ["--noise", "nan"],
            ["--rmse", "-1"],
            ["--time", "inf"],
            ["--spp", "0"],
            ["--threads", "0"],
            ["--bits", "12"],
            ["--exposure", "1e3"],
            ["--seed", "-1"],
        ] {
            assert_eq!(render(&wrong).unwrap_err().exit_code(), 2, "{wrong:?}");
        }
    }

    #[test]
    fn threads_are_limited_to_a_multiple_of_the_processors() {
        let compute = |n: &str| render(&["--threads", n]).unwrap().compute;
        assert_eq!(compute("16").threads(), 16);
        assert_eq!(compute("4096").threads(), max_threads().min(4096));
    }

    #[test]
    fn scene_alone_opens_the_dashboard() {
        assert!(Cli::try_parse_from(["zerkalo"]).unwrap().command.is_none());
        let cli = Cli::try_parse_from(["zerkalo", "a.toml"]).unwrap();
        assert_eq!(cli.edit.scene, Some(PathBuf::from("a.toml")));
        let cli = Cli::try_parse_from(["zerkalo", "a.toml", "--color", "256", "--threads", "2"]);
        let edit = cli.unwrap().edit;
        assert_eq!((edit.terminal.color, edit.compute.threads()), (Some(Colors::Indexed), 2));
        assert!(Cli::try_parse_from(["zerkalo", "--color", "17"]).is_err());
        let slow = Cli::try_parse_from(["zerkalo", "--bandwidth", "12.5"]).unwrap().edit;
        assert_eq!(slow.terminal.bandwidth, Some(12.5));
        for wrong in ["0", "-3", "inf", "nan", "fast"] {
            assert!(Cli::try_parse_from(["zerkalo", "--bandwidth", wrong]).is_err(), "{wrong}");
        }
    }
}
