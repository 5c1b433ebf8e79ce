//! `zerkalo render --plan`: traces one shard of a plan into a film file, or the whole plan.
//!
//! The film file is also the checkpoint of its shard: the same command continues an unfinished
//! file, and leaves a complete one. Workflow engines can therefore repeat any failed command.

use crate::command::args::RenderArgs;
use crate::command::part_file::{self, FilmOutput};
use crate::command::progress::Progress;
use crate::command::{Failure, handle_signals, print_line, read_scene, save, warn};
use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};
use zerkalo_kernel::sampling::SampleSettings;
use zerkalo_render::export::scene_hash;
use zerkalo_render::film::Film;
use zerkalo_render::film::file::FilmReader;
use zerkalo_render::plan::{BASE, Part, PartShard, Plan, ShardRender};
use zerkalo_render::{FileError, Options, RenderState};
use zerkalo_scene::Document;
use zerkalo_scene::disk::WriteError;
use zerkalo_terminal::Signals;

/// Time to the first checkpoint. Each later interval is twice the previous one.
const FIRST_CHECKPOINT: Duration = Duration::from_secs(5);
/// Longest interval between checkpoints.
const LONGEST_INTERVAL: Duration = Duration::from_secs(60);
/// Smallest interval between checkpoints, as a multiple of the time of writing one.
const WRITES_PER_INTERVAL: u32 = 50;

/// Renders all shards of a plan, or the one of `--shard`.
pub fn run(args: &RenderArgs, plan_path: &Path) -> Result<(), Failure> {
    let plan = Plan::read(plan_path)?;
    let numbers = match args.shard {
        Some(number) => {
            check_shard(args, &plan, plan_path, number)?;
            vec![number]
        }
        None => (BASE..=plan.settings.shards).collect(),
    };
    let output = FilmOutput::new(&args.output, args.bits, args.clobber.existing())?;
    let document = read_scene(&args.scene)?;
    let found = scene_hash(document.text(), document.scene());
    if found != plan.settings.scene_hash {
        return Err(Failure::Failed(format!(
            "{} is not the scene of {}: its hash is {found}, that of the plan {}; name the \
             unchanged scene, or plan again",
            args.scene.display(),
            plan_path.display(),
            plan.settings.scene_hash
        )));
    }
    let complete = numbers.iter().map(|number| PartShard { number: *number, complete: true });
    let mut part = Part { plan: Arc::new(plan), shards: complete.collect(), rays: 0 };
    let mut claim = save::claim(&args.output)?;
    let saved = match args.shard {
        Some(_) => saved(&args.output, &part)?,
        None => None,
    };
    if let Some(SavedShard { is_complete: true, rays, .. }) = saved {
        return print_line(&format!("{}  complete already  {rays} rays", args.output.display()));
    }
    let signals = handle_signals()?;
    let mut render = start(args, &document, &part, saved)?;
    let mut write = |render: &ShardRender, complete| {
        part.shards.iter_mut().for_each(|shard| shard.complete = complete);
        part.rays = render.rays;
        claim.check()?;
        let written = part_file::write(&output, &render.state, &part)?;
        claim.keep(written.file);
        Ok(written.report)
    };
    let mut checkpoint = |render: &ShardRender| match output {
        FilmOutput::Film(..) => write(render, false).map(drop),
        FilmOutput::Picture(..) => Ok(()),
    };
    let signal = trace(&mut render, &signals, &mut checkpoint);
    let unfinished = signal.is_some() && render.progress() < 1.0;
    let report = save::persist(|| write(&render, !unfinished))?;
    let share = match unfinished {
        true => {
            format!("  {:.0} % of the samples (stopped by a signal)", 100.0 * render.progress())
        }
        false => String::new(),
    };
    print_line(&format!(
        "{}  {}  {} rays{share}",
        args.output.display(),
        part_file::summary(&report),
        render.rays,
    ))?;
    match signal {
        Some(status) if unfinished => Err(Failure::Signalled(status)),
        _ => Ok(()),
    }
}

/// Checks that the plan has `shard` to trace, and that the output is a film file.
fn check_shard(args: &RenderArgs, plan: &Plan, path: &Path, shard: u32) -> Result<(), Failure> {
    let last = plan.settings.shards;
    if shard > last {
        return Err(Failure::Usage(format!(
            "--shard {shard}: {} has the shards 1 to {last}, and 0 for the base",
            path.display()
        )));
    }
    if shard == BASE
        && let Some(merged) = plan.settings.base_plan
    {
        return Err(Failure::Usage(format!(
            "--shard 0: the base of {} is the merged film of the plan {merged:016x}, which no \
             shard traces",
            path.display()
        )));
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

/// Film of an earlier run of a shard.
struct SavedShard {
    film: Film,
    rays: u64,
    is_complete: bool,
}

/// Reads the film file of an earlier run of the same shard. Returns `None` if the file does not
/// exist or is damaged.
fn saved(path: &Path, part: &Part) -> Result<Option<SavedShard>, Failure> {
    if !path.exists() {
        return Ok(None);
    }
    let failed = |reason: &str| {
        Failure::Failed(format!(
            "{} exists and {reason}; remove it or name another file",
            path.display()
        ))
    };
    let report = |error: &FileError| warn(&format!("warning: {error}; the shard starts again"));
    let Ok(reader) = FilmReader::open(path).inspect_err(report) else { return Ok(None) };
    let found = Part::of_header(path, &reader.header)?;
    let found = found.ok_or_else(|| failed("is a film without plan"))?;
    if found.plan != part.plan {
        return Err(failed("belongs to another plan"));
    }
    let [shard] = found.shards[..] else { return Err(failed("holds several shards")) };
    if shard.number != part.shards[0].number {
        return Err(failed(&format!("holds shard {}", shard.number)));
    }
    let film = reader.read().inspect_err(report).ok().map(|saved| saved.film);
    Ok(film.map(|film| SavedShard { film, rays: found.rays, is_complete: shard.complete }))
}

/// Creates the render of the shards of `part`, which continues `saved`.
fn start(
    args: &RenderArgs,
    document: &Document,
    part: &Part,
    saved: Option<SavedShard>,
) -> Result<ShardRender, Failure> {
    let plan = &part.plan;
    let settings = &plan.settings;
    let mut scene = document.scene().clone();
    scene.film.size = settings.size;
    if let Some(acceleration) = args.acceleration {
        scene.trace.acceleration = acceleration;
    }
    let sampling = SampleSettings { seed: settings.seed, kind: settings.sampler };
    let options = Options::new(settings.precision, sampling, settings.display);
    let mut state = RenderState::new(&Arc::new(scene), &options, None)
        .map_err(|fault| format!("{}: {fault}", args.scene.display()))?;
    let mut rays = 0;
    if let Some(saved) = saved {
        if saved.film.header != state.film.header {
            return Err(Failure::Failed(format!(
                "{} is the film of another scene; remove it or name another file",
                args.output.display()
            )));
        }
        (state.film, rays) = (saved.film, saved.rays);
    }
    let ranges = match part.shards[..] {
        [one] => plan.ranges(one.number),
        _ => plan.tiles.iter().map(|tile| 0..tile.end).collect(),
    };
    let threads = args.compute.threads();
    Ok(ShardRender::new(state, &ranges, rays, threads)?)
}

/// Traces samples until the shards are complete or a signal arrives. Returns the exit status of the
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
