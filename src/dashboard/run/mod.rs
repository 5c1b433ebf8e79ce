//! Dashboard on the terminal at stdin and stdout.

mod diagnose;
mod effects;
mod event_loop;
mod exports;
mod files;
mod frames;
mod input;
mod job_control;
mod latency;
mod loading;
mod tiles;
mod worker;
mod writer;

use crate::dashboard::graphics::Graphics;
use crate::dashboard::scene_source::is_new;
use crate::dashboard::{Exported, Message, Model, Preferences};
use crossbeam_channel::{Receiver, unbounded};
use effects::EffectRunner;
use event_loop::Dashboard;
use frames::FramePipeline;
use job_control::{ENDED_WITHIN, ResizeDebounce, TerminalIo};
use latency::LatencyRecorder;
use loading::OpenTerminal;
use std::io;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};
use zerkalo_render::plan::FilmFiles;
use zerkalo_render::schedule::Stop;
use zerkalo_render::{Checkpoint, Options};
use zerkalo_scene::{SceneErrors, SceneFile};
use zerkalo_terminal::cells::Oklab;
use zerkalo_terminal::image::GraphicsMode;
use zerkalo_terminal::{
    Environment, HUNG_UP, Screen, TimedEvent, cell_px, query_capabilities, size,
};

pub use crate::dashboard::model::Colors;
pub use diagnose::{TerminalReport, diagnose};
pub use loading::Loading;

/// Parameters of a dashboard.
pub struct Setup {
    pub file: Result<SceneFile, FaultyFile>,
    /// Checkpoint from which the render continues.
    pub checkpoint: Option<Checkpoint>,
    /// Folder for recovery files that cannot be written beside their scene file.
    pub state: Option<PathBuf>,
    pub threads: usize,
    pub options: Options,
    /// Path of the CSV file for input latencies; `None` to measure none.
    pub trace: Option<PathBuf>,
}

/// Scene file with errors, which the dashboard shows until the user has corrected the file.
pub struct FaultyFile {
    pub path: PathBuf,
    pub errors: SceneErrors,
}

/// Settings of the terminal.
#[derive(Debug)]
pub struct TerminalSetup {
    /// Set of colours; `None` to use the detected one.
    pub colors: Option<Colors>,
    pub environment: Environment,
    /// Choice of the protocol that shows the picture.
    pub graphics: GraphicsMode,
    /// Fixed rate of output in bytes per second; `None` to adapt it to the connection.
    pub bandwidth: Option<f64>,
    pub preferences: Preferences,
}

/// Result of a dashboard after it has ended.
#[derive(Debug)]
pub struct Ended {
    /// Exit status if a signal or the loss of the terminal has ended the dashboard.
    pub signalled: Option<u8>,
    /// Exports that ended after the screen was restored.
    pub exported: Vec<Result<Exported, String>>,
    /// Path of the recovery file with unsaved edits, or the reason why they are lost. `None`
    /// without unsaved edits.
    pub kept: Result<Option<PathBuf>, String>,
}

impl Ended {
    /// Returns the result of a dashboard that has ended before its first frame.
    fn early(signalled: Option<u8>) -> Self {
        Self { signalled, exported: Vec::new(), kept: Ok(None) }
    }
}

/// Runs a dashboard of what `load` returns until the user quits, a terminating signal arrives or the
/// terminal is lost.
pub fn run<E: From<io::Error> + Send + 'static>(
    loading: Loading,
    load: impl FnOnce() -> Result<Setup, E> + Send + 'static,
    terminal: TerminalSetup,
) -> Result<Ended, E> {
    let (setup, opened) = match loading.run(load, &terminal.environment)? {
        Ok(loaded) => loaded,
        Err(signalled) => return Ok(Ended::early(signalled)),
    };
    let Setup { file, checkpoint, state, threads, options, trace } = setup?;
    let (scene, file) = match file {
        Ok(file) => (Ok(file.document.shared_scene()), Ok(file)),
        Err(FaultyFile { path, errors }) => (Err(errors), Err(path)),
    };
    let (path, name) = match &file {
        Ok(file) => (file.path().map(PathBuf::from), file.document.name.clone()),
        Err(path) => (Some(path.clone()), String::new()),
    };
    let (results, done) = unbounded();
    let mut effects = EffectRunner::new(file, state, threads, options, results)?;
    if let Ok(scene) = &scene {
        // Rendering starts while the terminal replies to the capability queries.
        match checkpoint {
            Some(checkpoint) => effects.session.continue_from(Arc::clone(scene), checkpoint),
            None => effects.session.set_scene(Arc::clone(scene)),
        };
    }
    let is_new = path.as_deref().is_some_and(is_new);
    let mut model = Model::new(path, &name, scene, DEFAULT_STOP);
    model.file.is_new = is_new;
    Ok(run_on_terminal((effects, done), model, terminal, opened, trace)?)
}

/// Shows the films that `load` returns, which other processes write, as [`run`] shows a scene. No
/// thread traces rays.
pub fn watch<E: From<io::Error> + Send + 'static>(
    loading: Loading,
    load: impl FnOnce() -> Result<FilmFiles, E> + Send + 'static,
    threads: usize,
    terminal: TerminalSetup,
) -> Result<Ended, E> {
    let (films, opened) = match loading.run(load, &terminal.environment)? {
        Ok((films, opened)) => (films?, opened),
        Err(signalled) => return Ok(Ended::early(signalled)),
    };
    let model = Model::new(None, "", Ok(Arc::default()), Stop::default());
    let (results, done) = unbounded();
    let effects = EffectRunner::watching(films, threads, results.clone())?;
    // The wait lets the first frame show the table of films.
    if let Ok(report) = done.recv_timeout(FIRST_REPORT_WITHIN) {
        let _ = results.send(report);
    }
    Ok(run_on_terminal((effects, done), model, terminal, opened, None)?)
}

/// Runs a dashboard with `model`. `done` receives the results of effects. `opened` is the terminal
/// if it is in full-screen use already. `trace` is the path of the file for input latencies.
fn run_on_terminal(
    (effects, done): (EffectRunner, Receiver<Message>),
    mut model: Model,
    terminal: TerminalSetup,
    opened: Option<OpenTerminal>,
    trace: Option<PathBuf>,
) -> io::Result<Ended> {
    let TerminalSetup { colors, environment, graphics, bandwidth, preferences } = terminal;
    let opened = opened.map_or_else(|| OpenTerminal::new(&environment), Ok)?;
    let OpenTerminal { screen, signals, mut input } = opened;
    let ending = |events: &[TimedEvent]| {
        signals.caught().is_some() || events.iter().any(|timed| loading::quits(&timed.event))
    };
    let capabilities = query_capabilities(&screen.tty, &mut input, environment, &ending);
    let Ok((mut terminal, screen_size)) = capabilities.and_then(|terminal| Ok((terminal, size()?)))
    else {
        return Ok(Ended::early(Some(HUNG_UP)));
    };
    model.screen = screen_size;
    model.preferences = preferences;
    model.colors = colors.unwrap_or(terminal.colors);
    terminal.cell_px = cell_px().or(terminal.cell_px);
    model.graphics = Graphics::new(terminal.clone(), graphics);
    model.on_light = terminal.background.is_some_and(|rgb| Oklab::of(rgb).l > 0.6);
    let input = input::read(input)?;
    let terminal_io = TerminalIo {
        tty: screen.tty.clone(),
        input,
        signals: signals.events,
        left: screen.left.clone(),
    };
    let mut dashboard = Dashboard {
        model,
        effects,
        done,
        terminal_io,
        frames: FramePipeline::new(screen.tty.clone(), terminal, bandwidth)?,
        latency: LatencyRecorder::new(trace.is_some()),
        began: Instant::now(),
        shown: 0,
        image_epoch: 0,
        resizing: ResizeDebounce::default(),
        status_sent_at: Duration::ZERO,
        resting: false,
        changed: true,
        is_last_reply: false,
        suspend: false,
        quit: false,
    };
    while let Ok(message) = dashboard.done.try_recv() {
        dashboard.dispatch(message);
    }
    // This also informs the renderer of the size of the picture.
    dashboard.dispatch(Message::Resize(dashboard.model.screen));
    let result = dashboard.event_loop();
    end(dashboard, screen, result, trace)
}

/// Restores the terminal and completes pending writes.
fn end(
    mut dashboard: Dashboard,
    screen: Screen,
    result: io::Result<Option<u8>>,
    trace: Option<PathBuf>,
) -> io::Result<Ended> {
    // If the user quits, the wait for pictures that are being written has no limit.
    let deadline = (!matches!(result, Ok(None))).then(|| Instant::now() + ENDED_WITHIN);
    // The autosave thread writes unsaved edits before this thread may block.
    dashboard.effects.flush(Duration::ZERO);
    dashboard.effects.stop_early();
    if matches!(&result, Ok(status) if *status != Some(HUNG_UP)) {
        dashboard.suspend_terminal();
    }
    // The terminal is restored first, because the remaining writes may take a while.
    drop(screen);
    let kept = dashboard.effects.finish(deadline, &dashboard.terminal_io.signals);
    let mut ended = Ended { signalled: result?, exported: Vec::new(), kept };
    for message in dashboard.done.try_iter() {
        if let Message::Exported(result) = message {
            ended.exported.push(result);
        }
    }
    if let Some(path) = trace {
        dashboard.latency.write(&path)?;
    }
    // The process ends without the time to free large scenes and films.
    std::mem::forget(dashboard);
    Ok(ended)
}

/// Longest wait for the first report on watched files.
const FIRST_REPORT_WITHIN: Duration = Duration::from_millis(300);

/// Initial stop criterion: a noise of half a level.
const DEFAULT_STOP: Stop =
    Stop { spp: None, noise_levels: Some(0.5), rmse_linear: None, error: None, seconds: None };
