//! `zerkalo render`: a scene file to a picture file.

use crate::command::args::RenderArgs;
use crate::command::load_progress::LoadReporter;
use crate::command::progress::Progress;
use crate::command::signals::Signals;
use crate::command::stats::{Stats, peak_rss_bytes};
use crate::command::{Failure, all_threads, print_line, warn};
use crate::film::{Depth, Display, ImageOutput, WriteError};
use crate::render::Options;
use crate::render::export::{Provenance, scene_hash};
use crate::render::schedule::{Criterion, Settings, Stop, StoppedBy};
use crate::render::session::{Report, Session, State};
use crate::sampling::SampleSettings;
use crate::scene::{Document, Scene};
use crate::world;
use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// The noise at which a render stops that is not told when to: half a step of an 8-bit file.
const DEFAULT_NOISE_CODES: f64 = 0.5;

/// How often signals are looked for.
const POLL: Duration = Duration::from_millis(50);

pub fn run(args: &RenderArgs, started: Instant) -> Result<(), Failure> {
    let target =
        ImageOutput::from_path(&args.output).map_err(|error| Failure::Usage(error.to_string()))?;
    let document = Document::read_with(&args.scene, LoadReporter::new().assets)
        .map_err(|e| Failure::Failed(e.to_string()))?;
    let scene = sized(document.scene(), args)?;
    // What cannot be written had better be known before the work than after it.
    target.check_writable().map_err(failed_write)?;
    if let Some(path) = &args.stats {
        check_stats_path(path, &args.output)?;
    }
    for warning in document.warnings() {
        warn(&format!("warning: {warning}"));
    }
    let signals = Signals::watch().map_err(|e| Failure::Failed(format!("no signals: {e}")))?;

    let threads = args.threads.map_or_else(all_threads, usize::from);
    let mut session: Session = Session::new(threads, options(args), schedule_settings(args))
        .map_err(|error| {
            Failure::Failed(format!(
                "cannot start {threads} threads: {error}; try fewer by --threads"
            ))
        })?;
    let size = scene.film.size;
    session.set_scene(Arc::new(scene));
    let taken_up = started.elapsed();
    let end = watch(&session, &signals)?;

    let writing = Instant::now();
    let hash = scene_hash(document.text());
    let (report, precision, written) = write(&session, args, &target, hash.clone())
        .ok_or_else(|| Failure::Failed("the renderer has no picture".to_string()))?;
    written.map_err(failed_write)?;
    let write_seconds = writing.elapsed().as_secs_f64();
    print_line(&summary(target.path(), size, &report, end));

    if let Some(path) = &args.stats {
        let stats = Stats {
            scene: args.scene.display().to_string(),
            scene_hash: hash,
            output: args.output.display().to_string(),
            version: env!("CARGO_PKG_VERSION"),
            size,
            seed: args.seed,
            sampler: args.sampler.kind().name(),
            precision,
            lanes: report.lanes,
            threads,
            adaptive: !args.uniform,
            samples: report.samples,
            spp_min: report.spp.min,
            spp_mean: report.spp.mean,
            spp_max: report.spp.max,
            rays: report.rays,
            seconds: report.seconds,
            compile_seconds: report.compile_seconds,
            write_seconds,
            total_seconds: started.elapsed().as_secs_f64(),
            samples_per_second: report.samples_per_second(),
            first_picture_seconds: report.first_picture_seconds.map(|s| s + taken_up.as_secs_f64()),
            noise_codes: report.noise.map(|n| n.rmse_codes),
            noise_codes_p95: report.noise.map(|n| n.p95_codes),
            rmse_linear: report.noise.map(|n| n.rmse_linear),
            bad_samples: report.bad_samples,
            saturated_samples: report.saturated_samples,
            saturated_pixels: report.saturated_pixels,
            peak_rss_bytes: peak_rss_bytes(),
            stopped_by: match end {
                End::Done(reason) => reason.name(),
                End::Signal(_) => "signal",
            },
        };
        stats.write(path).map_err(Failure::Failed)?;
    }
    match end {
        End::Done(_) => Ok(()),
        End::Signal(status) => Err(Failure::Signalled(status)),
    }
}

/// How rendering ended.
#[derive(Clone, Copy)]
enum End {
    Done(StoppedBy),
    /// With this exit status.
    Signal(u8),
}

/// Shows progress until the work is done or a signal ends it.
fn watch(session: &Session, signals: &Signals) -> Result<End, Failure> {
    let mut progress = Progress::on_stderr();
    let end = loop {
        if let Some(status) = signals.caught() {
            break Ok(End::Signal(status));
        }
        let Some(snapshot) = session.wait(POLL) else { continue };
        match &snapshot.report.state {
            State::Finished(reason) => break Ok(End::Done(*reason)),
            State::Failed(why) => break Err(Failure::Failed(why.clone())),
            State::Idle | State::Tracing | State::Paused => progress.show(&snapshot.report),
        }
    };
    progress.finish();
    end
}

type Written = (Report, &'static str, Result<(), WriteError>);

/// Writes the picture where the film lives.
fn write(
    session: &Session,
    args: &RenderArgs,
    target: &ImageOutput,
    hash: String,
) -> Option<Written> {
    let origin = Provenance {
        source: args.scene.display().to_string(),
        scene_hash: hash,
        sampler: args.sampler.kind(),
        adaptive: !args.uniform,
    };
    let depth = if args.bits == 16 { Depth::Sixteen } else { Depth::Eight };
    let (display, target) = (display(args), target.clone());
    session.with(move |rendering, report| {
        let written = rendering.write(report, &origin, display, depth, &target);
        (report.clone(), rendering.world.precision(), written)
    })
}

fn failed_write(error: WriteError) -> Failure {
    Failure::Failed(error.to_string())
}

/// The scene with the size that the command line asks for.
fn sized(scene: &Scene, args: &RenderArgs) -> Result<Scene, Failure> {
    let mut scene = scene.clone();
    if let Some(acceleration) = args.acceleration {
        scene.trace.acceleration = acceleration;
    }
    if let Some(size) = args.size {
        scene.film.size = size;
        if let Some(fault) = scene.faults().first() {
            return Err(Failure::Usage(format!("--size {}x{}: {fault}", size[0], size[1])));
        }
    }
    Ok(scene)
}

fn check_stats_path(path: &Path, output: &Path) -> Result<(), Failure> {
    if path == output {
        let path = path.display();
        return Err(Failure::Usage(format!("--stats and --output name the same file, {path}")));
    }
    let parent = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let what = if path.is_dir() {
        "it is a directory"
    } else if !parent.is_dir() {
        "its directory does not exist"
    } else {
        return Ok(());
    };
    Err(Failure::Failed(format!("cannot write {}: {what}", path.display())))
}

fn display(args: &RenderArgs) -> Display {
    Display { exposure_ev: args.exposure, tone: args.tone }
}

fn options(args: &RenderArgs) -> Options {
    Options {
        world: world::Options { precision: args.precision.precision() },
        sampling: SampleSettings { seed: args.seed, kind: args.sampler.kind() },
        display: display(args),
    }
}

fn schedule_settings(args: &RenderArgs) -> Settings {
    let told =
        args.spp.is_some() || args.noise.is_some() || args.rmse.is_some() || args.time.is_some();
    let noise_codes = if told { args.noise } else { Some(DEFAULT_NOISE_CODES) };
    let linear_file = args.output.extension().is_some_and(|e| e.eq_ignore_ascii_case("exr"));
    let linear = noise_codes.is_none() && (args.rmse.is_some() || linear_file);
    Settings {
        adaptive: !args.uniform,
        criterion: if linear { Criterion::Linear } else { Criterion::Codes },
        // The scene's; the session puts it in.
        rays_per_pixel: 0,
        stop: Stop { spp: args.spp, noise_codes, rmse_linear: args.rmse, seconds: args.time },
    }
}

/// `room.png  640x480  212 spp (32-900)  noise 0.50 codes  1.31 s`
fn summary(path: &Path, size: [u32; 2], report: &Report, end: End) -> String {
    let spp = &report.spp;
    let counts = if spp.min == spp.max {
        format!("{} spp", spp.min)
    } else {
        format!("{:.0} spp ({}-{})", spp.mean, spp.min, spp.max)
    };
    let noise = match report.noise {
        Some(noise) => format!("noise {:.3} codes", noise.rmse_codes),
        None => "noise unknown".to_string(),
    };
    let mut text = format!(
        "{}  {}x{}  {counts}  {noise}  {:.2} s",
        path.display(),
        size[0],
        size[1],
        report.seconds
    );
    report.warnings().iter().for_each(|warning| text += &format!("  {warning}"));
    match end {
        End::Signal(_) => text += "  (stopped by a signal: the picture so far)",
        End::Done(StoppedBy::RaysPerPixel) => text += "  (the cap on rays per pixel is reached)",
        End::Done(_) => {}
    }
    text
}
