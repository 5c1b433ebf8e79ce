//! `zerkalo render`: renders a scene file to a picture file.

use crate::command::args::RenderArgs;
use crate::command::checkpoints::CheckpointWriter;
use crate::command::deadline::Deadline;
use crate::command::progress::{Progress, counts, noise};
use crate::command::regions::Division;
use crate::command::{
    Failure, STREAM, checked_stdout, handle_signals, interruptible, print_error, print_line,
    read_scene, save, shard, stats, warn, warn_of_precision,
};
use std::fmt::Display;
use std::fs::File;
use std::io::{self, IsTerminal};
use std::mem::ManuallyDrop;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};
use tempfile::NamedTempFile;
use zerkalo_kernel::sampling::SampleSettings;
use zerkalo_render::export::{Provenance, film_header, scene_hash};
use zerkalo_render::image_file::{Depth, ImageOutput};
use zerkalo_render::schedule::{Criterion, Settings, Stop, StoppedBy};
use zerkalo_render::session::{Report, Session, State};
use zerkalo_render::{Checkpoint, ErrorTarget, Options, ROUNDING_TO_8_BITS, RegionRender};
use zerkalo_scene::Scene;
use zerkalo_scene::disk::{self, Claim, WriteError};
use zerkalo_terminal::Signals;
use zerkalo_world::Precision;

/// Default noise target: half a quantisation step of an 8-bit file.
const DEFAULT_NOISE_LEVELS: f64 = 0.5;

/// Interval at which signals and progress are polled.
const POLL: Duration = Duration::from_millis(50);
/// Time after a signal in which the first picture may still be completed.
const FIRST_PICTURE: Duration = Duration::from_millis(150);

/// Renders the scenes one after another. A scene that fails does not keep the others from being
/// rendered.
pub fn run(args: &RenderArgs, started: Instant) -> Result<(), Failure> {
    if let Some(plan) = &args.plan {
        return shard::run(args, plan);
    }
    let scenes: Vec<_> = std::iter::once(&args.scene).chain(&args.more).collect();
    let jobs: Result<Vec<_>, _> =
        (1..).zip(&scenes).map(|(number, scene)| numbered(args, number, scene)).collect();
    let (mut signals, mut failed) = (None, 0);
    for job in jobs? {
        let started = if args.more.is_empty() { started } else { Instant::now() };
        match render(&job, started, &mut signals) {
            Err(Failure::Failed(message)) if scenes.len() > 1 => {
                print_error(&message);
                failed += 1;
            }
            result => result?,
        }
    }
    match failed {
        0 => Ok(()),
        n => Err(Failure::Failed(format!("{n} of {} scenes failed", scenes.len()))),
    }
}

/// Returns the arguments of the render of one scene, with its `number` in the names of files.
fn numbered(args: &RenderArgs, number: usize, scene: &Path) -> Result<RenderArgs, Failure> {
    let mut job = RenderArgs { scene: scene.to_path_buf(), ..args.clone() };
    let files = [&mut job.stats, &mut job.checkpoint, &mut job.resume];
    for path in files.into_iter().flatten().chain([&mut job.output]) {
        match with_number(path, number) {
            Some(numbered) => *path = numbered,
            None if args.more.is_empty() => {}
            None => {
                return Err(Failure::Usage(format!(
                    "several scenes and one file, {}; expected %d for the number of the scene in \
                     its name, such as picture-%04d.png",
                    path.display()
                )));
            }
        }
    }
    Ok(job)
}

/// Replaces `%d` in a file name by `number`, with leading zeros for `%04d`. `None` without `%d`.
fn with_number(path: &Path, number: usize) -> Option<PathBuf> {
    let text = path.to_str()?;
    text.match_indices('%').find_map(|(at, _)| {
        let (digits, rest) = text[at + 1..].split_once('d')?;
        let is_width = digits.len() < 3 && digits.bytes().all(|b| b.is_ascii_digit());
        let width = digits.parse().unwrap_or(0);
        is_width.then(|| format!("{}{number:0width$}{rest}", &text[..at]).into())
    })
}

/// Picture file to be written, or stdout.
struct Target {
    output: ImageOutput,
    /// File whose content goes to stdout when it is complete; `None` for a picture file.
    temporary: Option<NamedTempFile>,
}

impl Target {
    fn of(args: &RenderArgs) -> Result<Self, Failure> {
        let usage = |error: &dyn Display| Failure::Usage(error.to_string());
        if args.output != Path::new(STREAM) {
            let output = match &args.format {
                Some(format) => ImageOutput::of_format(args.output.clone(), format),
                None => ImageOutput::from_path(&args.output),
            };
            let mut output = output.map_err(|error| usage(&error))?;
            output.existing = args.clobber.existing();
            return Ok(Self { output, temporary: None });
        }
        if io::stdout().is_terminal() {
            let message = "a picture is not written to a terminal; add `> FILE` or `| PROGRAM`, or \
                           name a file";
            return Err(usage(&message));
        }
        let temporary = NamedTempFile::new()?;
        let format = args.format.as_deref().unwrap_or("png");
        let output = ImageOutput::of_format(temporary.path().to_path_buf(), format)?;
        Ok(Self { output, temporary: Some(temporary) })
    }

    /// Copies the picture to stdout and prints `summary`: on stdout if the picture is in a file.
    fn deliver(&self, summary: &str) -> Result<(), Failure> {
        if self.temporary.is_none() {
            return print_line(summary);
        }
        let copied = File::open(&self.output.path)
            .and_then(|mut picture| io::copy(&mut picture, &mut io::stdout()));
        checked_stdout(copied.map(drop))?;
        warn(summary);
        Ok(())
    }
}

/// Renders the scene of `args`. `signals` are handled from the first render on.
fn render(
    args: &RenderArgs,
    started: Instant,
    signals: &mut Option<Signals>,
) -> Result<(), Failure> {
    let target = Target::of(args)?;
    let output = &target.output;
    let document = read_scene(&args.scene)?;
    let warnings = document.warnings.clone();
    let hash = scene_hash(document.text(), document.scene());
    let mut scene = document.into_scene();
    if let Some(acceleration) = args.acceleration {
        scene.trace.acceleration = acceleration;
    }
    args.picture.resize(&mut scene).map_err(Failure::Usage)?;
    // Faulty paths are reported before the render starts.
    check_outputs(args, output)?;
    let claim = args.checkpoint.as_deref().map(save::claim).transpose()?;
    let checkpoint = read_checkpoint(args)?;
    for warning in warnings {
        warn(&format!("warning: {warning}"));
    }
    let signals = match signals {
        Some(signals) => signals,
        None => signals.insert(handle_signals()?),
    };
    let sampling = SampleSettings { seed: args.compute.seed, kind: args.sampler };
    let mut options =
        Options::new(args.precision.precision, sampling, args.picture.display(&scene));
    let division = args.memory.map(|cap| Division::new(&scene, &options.world, args, cap));
    let division = division.transpose()?;

    let size = scene.film.size;
    let provenance = Provenance {
        source: args.scene.display().to_string(),
        scene_hash: hash.clone(),
        sampler: args.sampler,
        adaptive: !args.uniform,
    };
    warn_of_precision(&scene, &options.world);
    options.world.merge_lights = division.is_some_and(|division| division.merge_lights);
    let job = Job { args, scene, options, output, provenance, signals, started };
    let rendered = match division.filter(|division| division.regions.count > 1) {
        Some(division) => in_regions(job, division.regions.rows)?,
        None => as_a_whole(job, claim, checkpoint)?,
    };
    let end = rendered.end;
    let error = error_line(args, &rendered.report, end);
    let printed =
        target.deliver(&format!("{}\n{error}", summary(&args.output, size, &rendered.report, end)));
    if let Some(path) = &args.stats {
        let stats = stats::json(args, &hash, size, &rendered, started.elapsed());
        disk::write(path, stats.as_bytes())?;
    }
    printed?;
    rendered.kept?;
    end.map(drop).map_err(Failure::Signalled)
}

/// Inputs of a render to a picture file.
struct Job<'a> {
    args: &'a RenderArgs,
    scene: Scene,
    options: Options,
    output: &'a ImageOutput,
    provenance: Provenance,
    signals: &'a Signals,
    started: Instant,
}

/// Stop criterion that ended a render, or the exit status of the signal that did.
pub type End = Result<StoppedBy, u8>;

/// Results of a render whose picture has been written.
pub struct Rendered {
    pub report: Report,
    pub end: End,
    pub precision: Precision,
    /// Upper bounds of the light that the picture loses by each limit of the scene, in sentences.
    pub biased: Vec<String>,
    /// Time from the start of the program to the compilation of the scene.
    pub set_after: Duration,
    pub write_seconds: f64,
    /// Result of writing the last checkpoint, if there is to be one.
    kept: Result<(), WriteError>,
}

/// Renders a picture whose film fits into memory, from `checkpoint` on. Writes checkpoints to the
/// file of `claim`.
fn as_a_whole(
    job: Job,
    claim: Option<Claim>,
    checkpoint: Option<Checkpoint>,
) -> Result<Rendered, Failure> {
    let Job { args, scene, options, output, provenance, signals, started } = job;
    let threads = args.compute.threads();
    let session = Session::new(threads, options, schedule_settings(args, output))?;
    // The process usually ends without the time to free a large film.
    let mut session = ManuallyDrop::new(session);
    match checkpoint {
        Some(checkpoint) => resume(&mut session, Arc::new(scene), checkpoint),
        None => drop(session.set_scene(Arc::new(scene))),
    }
    let set_after = started.elapsed();
    let mut checkpoints = claim.map(|claim| {
        let interval = Duration::from_secs_f64(args.checkpoint_interval.min(1e9));
        CheckpointWriter::new(claim, interval, provenance.clone())
    });
    let deadline = Deadline::new(args, output, &provenance, started);
    let end = watch(&session, signals, checkpoints.as_mut(), deadline)?;
    // The checkpoint comes first: the picture can be written again from its samples, if the program
    // is killed soon after a signal. Its error is returned after the picture has been written.
    let kept = checkpoints.map_or(Ok(()), |checkpoints| checkpoints.finish(&session));
    let writing = Instant::now();
    let results = save::persist(|| {
        let quantization = quantization(args, output);
        let (depth, output, provenance) = (args.bits, output.clone(), provenance.clone());
        let results = session.with(move |state, report| {
            let mut report = report.clone();
            report.error.iter_mut().for_each(|error| error.quantization = quantization);
            let header = film_header(state, &report, &provenance);
            let world = state.world.info();
            output
                .write(&header, depth, &mut &state.film)
                .map(|_| (report, world.precision, world.biases.clone()))
        });
        results.transpose()
    });
    let (report, precision, biased) = results?.ok_or("the renderer has no picture")?;
    let write_seconds = writing.elapsed().as_secs_f64();
    if end.is_ok() && !args.more.is_empty() {
        drop(ManuallyDrop::into_inner(session));
    }
    Ok(Rendered { report, end, precision, biased, set_after, write_seconds, kept })
}

/// Renders a picture in regions of `rows` rows, written as they finish.
fn in_regions(job: Job, rows: u32) -> Result<Rendered, Failure> {
    let Job { args, scene, options, output, provenance, signals, started } = job;
    let set_after = started.elapsed();
    let mut progress = Progress::on_stderr();
    let mut signal = None;
    let mut observe = |report: &Report| {
        progress.show(report);
        signal = signals.caught();
        signal.map_or(Ok(()), |_| Err(io::Error::other("stopped by a signal")))
    };
    let (scene, settings) = (Arc::new(scene), schedule_settings(args, output));
    let threads = args.compute.threads();
    let new = || RegionRender::new(&scene, &options, settings, rows, threads);
    let mut render = interruptible(new)?;
    let results = render.write(&provenance, args.bits, output, &mut observe);
    let results = results.map(|(report, stopped_by)| {
        let world = &render.state().world;
        (report, stopped_by, world.info().precision, world.info().biases.clone())
    });
    drop(render);
    progress.finish();
    match (results, signal) {
        (Ok((report, stopped_by, precision, biased)), _) => {
            let traced = report.seconds + report.compile_seconds;
            let write_seconds = (started.elapsed() - set_after).as_secs_f64() - traced;
            let end = Ok(stopped_by);
            Ok(Rendered { report, end, precision, biased, set_after, write_seconds, kept: Ok(()) })
        }
        (Err(_), Some(status)) => {
            print_error(&format!(
                "stopped by a signal: {} is not written, because regions are missing",
                args.output.display()
            ));
            Err(Failure::Signalled(status))
        }
        (Err(error), None) => Err(error.into()),
    }
}

/// Shows the progress of the render and writes checkpoints, until it ends or a signal arrives.
fn watch(
    session: &Session,
    signals: &Signals,
    mut checkpoints: Option<&mut CheckpointWriter>,
    mut deadline: Option<Deadline>,
) -> Result<End, Failure> {
    let mut progress = Progress::on_stderr();
    let mut caught = None;
    let mut has_picture = false;
    let end = loop {
        if let Some(status) = signals.caught() {
            if has_picture {
                break Ok(Err(status));
            }
            let caught: &mut Instant = caught.get_or_insert_with(Instant::now);
            if caught.elapsed() >= FIRST_PICTURE {
                print_error("stopped by a signal before the first picture: nothing is written");
                break Err(Failure::Signalled(status));
            }
        }
        if let Some(checkpoints) = &mut checkpoints {
            checkpoints.poll(session);
        }
        let left = deadline.as_ref().map(Deadline::left);
        if has_picture && left == Some(Duration::ZERO) {
            break Ok(Ok(StoppedBy::Time));
        }
        let poll = left.map_or(POLL, |left| left.clamp(Duration::from_millis(1), POLL));
        let Some(snapshot) = session.wait(poll) else { continue };
        has_picture |= snapshot.report.first_picture_seconds.is_some();
        if let Some(deadline) = deadline.as_mut().filter(|_| has_picture) {
            deadline.reserve(session);
            if let Some(forecast) = deadline.forecast(&snapshot.report) {
                progress.note(&forecast);
            }
        }
        match &snapshot.report.state {
            State::Finished(reason) => break Ok(Ok(*reason)),
            State::Failed(reason) => break Err(Failure::Failed(reason.clone())),
            State::Idle | State::Tracing | State::Paused => progress.show(&snapshot.report),
        }
    };
    progress.finish();
    end
}

/// Reads the checkpoint of `--resume`. Returns `None` if `--checkpoint` names the same file and it
/// does not exist yet.
fn read_checkpoint(args: &RenderArgs) -> Result<Option<Checkpoint>, Failure> {
    let is_new = |path: &PathBuf| args.checkpoint.as_ref() == Some(path) && !path.exists();
    let path = args.resume.as_ref().filter(|path| !is_new(path));
    Ok(path.map(|path| Checkpoint::read(path)).transpose()?)
}

/// Continues `checkpoint`. Prints a note if its light weights differ from those of `scene`.
fn resume(session: &mut Session, scene: Arc<Scene>, checkpoint: Checkpoint) {
    let weights = checkpoint.header.weights.clone();
    session.continue_from(scene, checkpoint);
    if session.with(move |state, _| state.weights != weights) == Some(true) {
        warn(
            "note: the lights of the scene differ from those of the checkpoint; its samples are kept",
        );
    }
}

/// Checks that the files of `--output`, `--stats` and `--checkpoint` differ and can be written.
fn check_outputs(args: &RenderArgs, output: &ImageOutput) -> Result<(), Failure> {
    let outputs = [
        ("output", Some(&args.output)),
        ("stats", args.stats.as_ref()),
        ("checkpoint", args.checkpoint.as_ref()),
    ];
    for (i, (option, path)) in outputs.iter().enumerate() {
        let same = outputs[..i].iter().find(|(_, other)| other.is_some() && other == path);
        if let (Some(path), Some((other, _))) = (path, same) {
            let path = path.display();
            let what = format!("--{option} and --{other} name the same file, {path}");
            return Err(Failure::Usage(what));
        }
    }
    output.check_writable()?;
    args.stats.as_deref().map(|path| args.clobber.check_writable(path)).transpose()?;
    match &args.checkpoint {
        Some(path) => CheckpointWriter::check(path, args.resume.as_deref()),
        None => Ok(()),
    }
}

/// Returns the RMSE of rounding to the integers of the picture file, in 8-bit levels.
fn quantization(args: &RenderArgs, output: &ImageOutput) -> f64 {
    match args.bits {
        _ if output.is_linear() => 0.0,
        Depth::Eight => ROUNDING_TO_8_BITS,
        Depth::Sixteen => ROUNDING_TO_8_BITS / 257.0,
    }
}

fn schedule_settings(args: &RenderArgs, output: &ImageOutput) -> Settings {
    let errors = [args.noise, args.rmse, args.error];
    let has_target =
        args.spp.is_some() || args.time.is_some() || errors.iter().any(Option::is_some);
    let noise_levels = if has_target { args.noise } else { Some(DEFAULT_NOISE_LEVELS) };
    let linear = noise_levels.is_none()
        && args.error.is_none()
        && (args.rmse.is_some() || output.is_linear());
    let criterion = if linear { Criterion::Linear } else { Criterion::Levels };
    let error =
        args.error.map(|levels| ErrorTarget { levels, quantization: quantization(args, output) });
    let stop =
        Stop { spp: args.spp, noise_levels, rmse_linear: args.rmse, error, seconds: args.time };
    Settings { adaptive: !args.uniform, criterion, ..Settings::until(stop) }
}

/// Formats the result of a render, such as `room.png  640x480  212 spp (32-900)  noise 0.500 8-bit
/// levels  1.31 s`.
fn summary(path: &Path, size: [u32; 2], report: &Report, end: End) -> String {
    let ([width, height], seconds) = (size, report.seconds);
    let (path, counts, noise) = (path.display(), counts(report), noise(report));
    let mut text = format!("{path}  {width}x{height}  {counts}  {noise}  {seconds:.2} s");
    report.warnings().iter().for_each(|warning| text += &format!("  {warning}"));
    match end {
        Err(_) => text += "  (stopped by a signal: the picture so far)",
        Ok(StoppedBy::RaysPerPixel) => text += "  (the cap on rays per pixel is reached)",
        Ok(_) => {}
    }
    text
}

/// Formats the error with its parts. If `--error` has ended the render, adds the largest part, and
/// whether the target was met.
fn error_line(args: &RenderArgs, report: &Report, end: End) -> String {
    let Some(error) = &report.error else { return "error unknown".to_string() };
    let text = error.to_string();
    match args.error.filter(|_| end == Ok(StoppedBy::Error)) {
        Some(target) if error.is_open() || error.total() > target => {
            format!("{text}\nerror {target} is not met: the largest part is {}", error.largest())
        }
        Some(_) => format!("{text}  (largest part: {})", error.largest()),
        None => text,
    }
}
