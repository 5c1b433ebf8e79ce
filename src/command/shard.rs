//! `zerkalo render --plan`: traces one shard of a plan into a film file, or the whole plan.
//!
//! The film file is also the checkpoint of its shard: the same command continues an unfinished
//! file, and leaves a complete one. Workflow engines can therefore repeat any failed command.

use crate::command::args::RenderArgs;
use crate::command::part_file::{self, FilmOutput};
use crate::command::progress::Progress;
use crate::command::{Failure, handle_signals, print_line, read_scene, save, warn};
use std::fs::File;
use std::io::{BufReader, ErrorKind};
use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};
use zerkalo_kernel::sampling::SampleSettings;
use zerkalo_render::export::scene_hash;
use zerkalo_render::film::file::FilmReader;
use zerkalo_render::plan::{Job, Part, PartShard, PlanHead, ShardRender};
use zerkalo_render::{FileError, Options, RenderState};
use zerkalo_scene::disk::{Claim, Existing, WriteError};
use zerkalo_scene::{Acceleration, Document};
use zerkalo_terminal::Signals;

/// Time to the first checkpoint. Each later interval is twice the previous one.
const FIRST_CHECKPOINT: Duration = Duration::from_secs(5);
/// Longest interval between checkpoints.
const LONGEST_INTERVAL: Duration = Duration::from_secs(60);
/// Smallest interval between checkpoints, as a multiple of the time of writing one.
const WRITES_PER_INTERVAL: u32 = 50;

/// Renders all shards of a plan, or the one of `--shard`.
pub fn run(args: &RenderArgs, plan: &Path) -> Result<(), Failure> {
    let job = Job::at(plan)?;
    if let Some(shard) = args.shard {
        check_shard(args, &job, shard)?;
    }
    let output = FilmOutput::new(&args.output, args.bits, args.clobber.existing())?;
    let document = read_scene(&args.scene)?;
    check_scene(&document, &args.scene, &job)?;
    let mut claim = save::claim(&args.output)?;
    let signals = handle_signals()?;
    let state = compile(&document, &args.scene, &job, args.acceleration)?;
    let Some(number) = args.shard else {
        return whole(args, &job, &output, state, &signals);
    };
    let mut tracer =
        ShardTracer { state: Some(state), threads: args.compute.threads(), signals: &signals };
    match tracer.trace(&job, number, &mut claim)? {
        Traced::Done => Ok(()),
        Traced::Taken => Err(Failure::Failed(format!(
            "cannot write {}: another process is writing it",
            args.output.display()
        ))),
        Traced::Stopped(status) => Err(Failure::Signalled(status)),
    }
}

/// Traces all samples of the plan of `job` in this process.
fn whole(
    args: &RenderArgs,
    job: &Job,
    output: &FilmOutput,
    state: RenderState,
    signals: &Signals,
) -> Result<(), Failure> {
    let threads = args.compute.threads();
    let mut render = ShardRender::new(state, &job.plan, job.plan.whole(), threads)?;
    let signal = trace(&mut render, signals, &mut |_| Ok(()));
    let unfinished = signal.is_some() && render.progress() < 1.0;
    let shard = |number: u32| {
        // All samples count as those of the first shard.
        let samples = if number == 1 { render.samples() } else { [0; 2] };
        PartShard { number, complete: !unfinished, samples }
    };
    let shards = (1..=job.head.settings.shards).map(shard).collect();
    let part = Part { plan: Arc::clone(&job.head), shards, rays: render.rays() };
    let written = save::persist(|| part_file::write(output, &render, &part))?;
    let rays = job.head.settings.base_rays + render.rays();
    let share = stopped(&render, unfinished);
    let path = args.output.display();
    print_line(&format!("{path}  {}  {rays} rays{share}", part_file::summary(&written.report)))?;
    signal.filter(|_| unfinished).map_or(Ok(()), |status| Err(Failure::Signalled(status)))
}

/// Checks that the plan has `shard` to trace, and that the output is a film file.
fn check_shard(args: &RenderArgs, job: &Job, shard: u32) -> Result<(), Failure> {
    let last = job.head.settings.shards;
    if !(1..=last).contains(&shard) {
        let plan = job.path.display();
        return Err(Failure::Usage(format!("--shard {shard}: {plan} has the shards 1 to {last}")));
    }
    if !part_file::is_film(&args.output) {
        return Err(Failure::Usage(format!(
            "cannot write a shard to {}: it holds a part of the samples; name a .zk file, and \
             add the parts by `zerkalo merge`",
            args.output.display()
        )));
    }
    Ok(())
}

/// Checks that `document`, the scene at `path`, is that of the plan of `job`.
pub fn check_scene(document: &Document, path: &Path, job: &Job) -> Result<(), Failure> {
    let (found, planned) =
        (scene_hash(document.text(), document.scene()), &job.head.settings.scene_hash);
    if found == *planned {
        return Ok(());
    }
    Err(Failure::Failed(format!(
        "{} is not the scene of {}: its hash is {found}, that of the plan {planned}; name the \
         unchanged scene, or plan again",
        path.display(),
        job.path.display(),
    )))
}

/// Compiles the scene of `job`, without memory for a film.
pub fn compile(
    document: &Document,
    path: &Path,
    job: &Job,
    acceleration: Option<Acceleration>,
) -> Result<RenderState, Failure> {
    let settings = &job.head.settings;
    let mut scene = document.scene().clone();
    scene.film.size = settings.size;
    scene.trace.acceleration = acceleration.unwrap_or(scene.trace.acceleration);
    let sampling = SampleSettings { seed: settings.seed, kind: settings.sampler };
    let options = Options::new(settings.precision, sampling, settings.display);
    RenderState::without_film(&Arc::new(scene), &options)
        .map_err(|fault| Failure::Failed(format!("{}: {fault}", path.display())))
}

/// Tracer of shards, one after the other.
pub struct ShardTracer<'a> {
    /// Compiled scene; `None` after a failure.
    pub state: Option<RenderState>,
    pub threads: usize,
    pub signals: &'a Signals,
}

/// End of the work on a shard.
pub enum Traced {
    Done,
    /// Another process has begun the shard at the same moment.
    Taken,
    /// A signal with this exit status has stopped it.
    Stopped(u8),
}

impl ShardTracer<'_> {
    /// Traces a shard of `job` into the claimed file, or continues it.
    pub fn trace(&mut self, job: &Job, number: u32, claim: &mut Claim) -> Result<Traced, Failure> {
        let path = claim.path().to_path_buf();
        let is_new = !claim.has_file();
        let saved = match if is_new { Saved::Nothing } else { saved(&path, &job.head, number)? } {
            Saved::Complete(rays) => {
                print_line(&format!("{}  complete already  {rays} rays", path.display()))?;
                return Ok(Traced::Done);
            }
            Saved::Unfinished(reader) => Some(reader),
            Saved::Nothing => None,
        };
        let share = job.plan.share(number);
        let state = self.state.take().ok_or("no compiled scene")?;
        let mut render = ShardRender::new(state, &job.plan, share.clone(), self.threads)?;
        let mut existing = if is_new { Existing::Refuse } else { Existing::Replace };
        let mut write = |render: &ShardRender, complete| {
            let shards = vec![PartShard { number, complete, samples: render.samples() }];
            let part = Part { plan: Arc::clone(&job.head), shards, rays: render.rays() };
            claim.check()?;
            let output = FilmOutput::Film(path.clone(), existing);
            claim.keep(part_file::write(&output, render, &part)?.file);
            existing = Existing::Replace;
            Ok::<_, WriteError>(())
        };
        if is_new {
            // The empty part shows other processes that the shard is taken.
            match write(&render, false) {
                Err(error) if is_taken(&error) => {
                    self.state = Some(render.state);
                    return Ok(Traced::Taken);
                }
                written => written?,
            }
        }
        match saved.map(|reader| render.resume(*reader)) {
            Some(Ok(())) => {}
            Some(Err(error)) => {
                warn(&format!("warning: {}: {error}; the shard starts again", path.display()));
                render = ShardRender::new(render.state, &job.plan, share.clone(), self.threads)?;
                render.take_base(job.base_of(&share).into_iter());
            }
            None => render.take_base(job.base_of(&share).into_iter()),
        }
        let signal = trace(&mut render, self.signals, &mut |render| write(render, false));
        let unfinished = signal.is_some() && render.progress() < 1.0;
        save::persist(|| write(&render, !unfinished))?;
        print_line(&format!(
            "{}  {} tiles  {} rays  {:.1} s{}",
            path.display(),
            share.ranges.len(),
            render.rays(),
            render.report().seconds,
            stopped(&render, unfinished)
        ))?;
        self.state = Some(render.state);
        Ok(signal.filter(|_| unfinished).map_or(Traced::Done, Traced::Stopped))
    }
}

/// Formats the progress of a shard that a signal has stopped.
fn stopped(render: &ShardRender, unfinished: bool) -> String {
    let share = 100.0 * render.progress();
    let text = format!("  {share:.0} % of the samples (stopped by a signal)");
    if unfinished { text } else { String::new() }
}

/// File of an earlier run of a shard.
enum Saved {
    /// There is no such file, or it is damaged or without samples.
    Nothing,
    Unfinished(Box<FilmReader<BufReader<File>>>),
    /// Complete part with this number of rays.
    Complete(u64),
}

/// Opens the film file of an earlier run of the shard `number` of `plan`.
fn saved(path: &Path, plan: &PlanHead, number: u32) -> Result<Saved, Failure> {
    if !path.exists() {
        return Ok(Saved::Nothing);
    }
    let failed = |reason: &str| {
        Failure::Failed(format!(
            "{} exists and {reason}; remove it or name another file",
            path.display()
        ))
    };
    let damaged = |error: FileError| {
        warn(&format!("warning: {error}; the shard starts again"));
        Ok(Saved::Nothing)
    };
    let reader = match FilmReader::open(path) {
        Ok(reader) => reader,
        Err(error) => return damaged(error),
    };
    let found = Part::of_header(path, &reader.header)?;
    let found = found.ok_or_else(|| failed("is a film without plan"))?;
    if found.plan.checksum != plan.checksum {
        return Err(failed("belongs to another plan"));
    }
    let [shard] = found.shards[..] else { return Err(failed("holds several shards")) };
    if shard.number != number {
        return Err(failed(&format!("holds shard {}", shard.number)));
    }
    match shard.samples {
        _ if shard.complete => {
            reader.verify().map(|_| Saved::Complete(found.rays)).or_else(damaged)
        }
        [0, _] => Ok(Saved::Nothing),
        _ => Ok(Saved::Unfinished(Box::new(reader))),
    }
}

/// Returns `true` if the part at `path` is complete and belongs to `plan`.
pub fn is_complete(path: &Path, plan: &PlanHead) -> bool {
    let part = FilmReader::open(path)
        .ok()
        .and_then(|reader| Part::of_header(path, &reader.header).ok().flatten());
    part.is_some_and(|part| part.is_complete() && part.plan.checksum == plan.checksum)
}

/// Returns `true` if `error` says that another process writes the file.
pub fn is_taken(error: &WriteError) -> bool {
    [ErrorKind::WouldBlock, ErrorKind::AlreadyExists].contains(&error.kind)
}

/// Traces samples until the shard is complete or a signal arrives. Returns the exit status of the
/// signal, or `None` without a signal. Calls `write_checkpoint` at intervals.
fn trace(
    render: &mut ShardRender,
    signals: &Signals,
    write_checkpoint: &mut dyn FnMut(&ShardRender) -> Result<(), WriteError>,
) -> Option<u8> {
    let mut progress = Progress::on_stderr();
    let mut interval = FIRST_CHECKPOINT;
    let mut written = Instant::now();
    let mut signal = None;
    while render.step() {
        signal = signals.caught();
        if signal.is_some() {
            break;
        }
        progress.show(&render.report());
        if written.elapsed() >= interval {
            let start = Instant::now();
            // The next checkpoint may succeed.
            write_checkpoint(render).unwrap_or_else(|error| warn(&format!("warning: {error}")));
            interval =
                (2 * interval).min(LONGEST_INTERVAL).max(WRITES_PER_INTERVAL * start.elapsed());
            written = Instant::now();
        }
    }
    progress.finish();
    signal
}
