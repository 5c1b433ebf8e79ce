//! Event loop of the dashboard. One thread updates the model and draws it. Work that may block runs
//! in other threads, whose results come back through channels.

mod autosave;
mod autosave_worker;
mod diagnose;
mod effects;
mod export_paths;
mod exporter;
mod file_worker;
mod frames;
mod image_upload;
mod image_viewer;
mod input;
mod job_control;
mod latency;
mod shared_file;
mod shrink;
mod signals;
mod watch_runner;
mod worker;
mod writer;

use crate::dashboard::message::{Effect, Exported, Message};
use crate::dashboard::model::Model;
use crate::dashboard::update::update;
use crossbeam_channel::{Receiver, after, never, select, unbounded};
use effects::{EffectRunner, Effects, Outcome};
use frames::{DrawOutcome, FramePipeline};
use input::Input;
use job_control::{ResizeDebounce, TerminalIo};
use latency::LatencyRecorder;
use signals::{HUNG_UP, stop_group};
use std::io;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};
use watch_runner::WatchRunner;
use zerkalo_render::plan::WatchedFilms;
use zerkalo_render::schedule::{Settings, Stop};
use zerkalo_render::session::{Snapshot, State};
use zerkalo_render::{Checkpoint, Options};
use zerkalo_scene::{SceneErrors, SceneFile};
use zerkalo_terminal::flow::LinkStatus;
use zerkalo_terminal::{
    Environment, Event, InputReader, Reply, Screen, TimedEvent, query_capabilities, size,
};

pub use crate::dashboard::model::Colors;
pub use diagnose::{TerminalReport, diagnose};

/// Parameters with which a dashboard is run.
pub struct Setup {
    /// Scene file. For an unreadable file, its path and the errors in it.
    pub file: Result<SceneFile, (PathBuf, SceneErrors)>,
    /// Checkpoint from which the render of this scene continues; `None` for a new render.
    pub checkpoint: Option<Checkpoint>,
    /// Folder for recovery files that cannot be written beside their scene file; `None` if there is
    /// none.
    pub state: Option<PathBuf>,
    /// Number of tracing threads, at least 1.
    pub threads: usize,
    /// Options of scene compilation and sampling.
    pub options: Options,
    /// Settings of sample allocation (the distribution of samples over the picture), and the
    /// initial stop criteria.
    pub settings: Settings,
    /// Settings of the terminal.
    pub terminal: TerminalSetup,
    /// Path of the CSV file to which input latencies are written; `None` to measure none.
    pub trace: Option<PathBuf>,
}

/// Settings of the terminal, from the command line and the environment.
#[derive(Debug)]
pub struct TerminalSetup {
    /// Set of colours that is used on the terminal; `None` to use the detected one.
    pub colors: Option<Colors>,
    /// Environment variables that describe the terminal.
    pub environment: Environment,
    /// Fixed rate of output in bytes per second; `None` to adapt it to the connection.
    pub bandwidth: Option<f64>,
}

/// Result of a dashboard after it has ended.
#[derive(Debug)]
pub struct Ended {
    /// Exit status if a signal or the loss of the terminal has ended the dashboard; `None` if the
    /// user has quit.
    pub signalled: Option<u8>,
    /// Result of each export that ended after the screen was restored: the image, or the error.
    pub exported: Vec<Result<Exported, String>>,
    /// Path of the recovery file with unsaved edits, which the next start of the program offers to
    /// recover. `None` if all edits are saved. If unsaved edits are lost, an error with the reason.
    pub kept: Result<Option<PathBuf>, String>,
    /// Result of each write of a checkpoint that ended after the screen was restored: the path of
    /// the file, or the error.
    pub checkpoints: Vec<Result<PathBuf, String>>,
    /// Lines of the summary of input latencies; empty unless [`Setup::trace`] is set.
    pub latencies: Vec<String>,
}

impl Ended {
    fn new(signalled: Option<u8>, kept: Result<Option<PathBuf>, String>) -> Self {
        let (exported, checkpoints, latencies) = Default::default();
        Self { signalled, exported, kept, checkpoints, latencies }
    }
}

/// Runs a dashboard on the terminal at stdin and stdout until the user quits, a terminating signal
/// arrives or the terminal is lost.
pub fn run(setup: Setup) -> io::Result<Ended> {
    let Setup { file, checkpoint, state, threads, options, settings, terminal, trace } = setup;
    let (scene, file) = match file {
        Ok(file) => (Ok(Arc::new(file.document().scene().clone())), Ok(file)),
        Err((path, errors)) => (Err(errors), Err(path)),
    };
    let (path, name) = match &file {
        Ok(file) => (file.path().map(PathBuf::from), file.document().name().to_string()),
        Err(path) => (Some(path.clone()), String::new()),
    };
    let (results, done) = unbounded();
    let mut effects = EffectRunner::new(file, state, threads, options, settings, results)?;
    if let Ok(scene) = &scene {
        // Rendering starts while the terminal replies to the capability queries.
        match checkpoint {
            Some(checkpoint) => effects.session.continue_from(Arc::clone(scene), checkpoint),
            None => effects.session.set_scene(Arc::clone(scene)),
        };
    }
    let mut model = Model::new(path, &name, scene, settings.stop, threads);
    model.max_threads = std::thread::available_parallelism().map_or(threads, usize::from);
    run_on_terminal(Box::new(effects), done, model, terminal, trace)
}

/// Shows `films`, which other processes write, until the user quits, a terminating signal arrives
/// or the terminal is lost. `threads` is the number of threads that compute noise estimates and
/// pictures. No thread traces rays.
pub fn watch(films: WatchedFilms, threads: usize, terminal: TerminalSetup) -> io::Result<Ended> {
    let model = Model::new(None, "", Ok(Arc::default()), Stop::default(), threads);
    let (results, done) = unbounded();
    let effects = WatchRunner::new(films, threads, results.clone())?;
    // This waits for the first report, so that the first frame shows the table of films.
    if let Ok(report) = done.recv_timeout(FIRST_REPORT_WITHIN) {
        let _ = results.send(report);
    }
    run_on_terminal(Box::new(effects), done, model, terminal, None)
}

/// Runs a dashboard with the model `model`, whose effects are executed by `effects`. `done` receives
/// the results of effects. The screen size and the colours in `model` are replaced by those of the
/// terminal. `trace` is the path of the file for input latencies.
fn run_on_terminal(
    effects: Box<dyn Effects>,
    done: Receiver<Message>,
    mut model: Model,
    terminal: TerminalSetup,
    trace: Option<PathBuf>,
) -> io::Result<Ended> {
    let TerminalSetup { colors, environment, bandwidth } = terminal;
    let signals = signals::block()?;
    let screen = Screen::enter()?;
    let signals = signals::watch(signals, screen.tty(), signals::PATIENCE)?;
    let mut input = InputReader::new(&environment);
    let ending = || signals.is_ending();
    let capabilities = query_capabilities(&screen.tty(), &mut input, environment, &ending);
    let Ok((terminal, screen_size)) = capabilities.and_then(|terminal| Ok((terminal, size()?)))
    else {
        return Ok(Ended::new(Some(HUNG_UP), Ok(None)));
    };
    model.screen = screen_size;
    model.colors = colors.unwrap_or(terminal.colors);
    let input = input::read(input)?;
    let terminal_io =
        TerminalIo { tty: screen.tty(), input, signals: signals.events, left: screen.left.clone() };
    let mut dashboard = Dashboard {
        model,
        effects,
        done,
        terminal_io,
        frames: FramePipeline::new(screen.tty(), terminal, bandwidth)?,
        latency: LatencyRecorder::new(trace.is_some()),
        began: Instant::now(),
        shown: 0,
        image_epoch: 0,
        resizing: ResizeDebounce::default(),
        status_sent_at: Duration::ZERO,
        resting: false,
        changed: true,
        suspend: false,
        quit: false,
    };
    while let Ok(message) = dashboard.done.try_recv() {
        dashboard.dispatch(message);
    }
    // This message also informs the renderer of the size of the picture in half cells (upper and
    // lower halves of terminal cells).
    dashboard.dispatch(Message::Resize(dashboard.model.screen));
    let result = dashboard.watch();
    // If the user quits, the program waits without limit for pictures that are being written. If a
    // signal or the loss of the terminal ends it, the wait is limited.
    let deadline = (!matches!(result, Ok(None))).then(|| Instant::now() + signals::ENDED_WITHIN);
    // This call makes the autosave thread write unsaved edits before this thread may block. With a
    // timeout of 0, the call does not wait for the write.
    dashboard.effects.flush(Duration::ZERO);
    if matches!(&result, Ok(status) if *status != Some(HUNG_UP)) {
        dashboard.await_answers();
    }
    // The screen is restored before the remaining files are written, which may take a while.
    drop(screen);
    let kept = dashboard.effects.finish(deadline);
    let mut ended = Ended::new(result?, kept);
    for message in dashboard.done.try_iter() {
        match message {
            Message::Exported(result) => ended.exported.push(result),
            Message::CheckpointWritten(result) => ended.checkpoints.push(result),
            _ => {}
        }
    }
    if let Some(path) = trace {
        dashboard.latency.write(&path)?;
        ended.latencies = dashboard.latency.summary();
    }
    Ok(ended)
}

struct Dashboard {
    model: Model,
    effects: Box<dyn Effects>,
    /// Receiver of the results of effects.
    done: Receiver<Message>,
    terminal_io: TerminalIo,
    frames: FramePipeline,
    latency: LatencyRecorder,
    began: Instant,
    /// Generation of the visible picture: the version number of the scene that it shows.
    shown: u64,
    /// Counter that increases when the picture is replaced by a different one. It stays when more
    /// samples refine the same picture.
    image_epoch: u64,
    /// Changes of the terminal's size that have not taken effect yet.
    resizing: ResizeDebounce,
    /// Time at which the model last received the connection's status or upload progress.
    status_sent_at: Duration,
    /// `true` if rendering is paused because the terminal no longer replies.
    resting: bool,
    /// `true` if the model has changed since the last frame was drawn.
    changed: bool,
    /// `true` if the program is to be suspended after the messages that are being handled.
    suspend: bool,
    /// `true` if the program is to quit after the messages that are being handled.
    quit: bool,
}

impl Dashboard {
    /// Runs the event loop until the program is to end. Returns the exit status if a signal or the
    /// loss of the terminal ends the program, and `None` if the user quits.
    fn watch(&mut self) -> io::Result<Option<u8>> {
        let TerminalIo { input, signals, left, .. } = self.terminal_io.clone();
        let wakeup = self.effects.wakeup().clone();
        let done = self.done.clone();
        let written = self.frames.writer.written.clone();
        let silence = never();
        let mut waiting = Vec::new();
        // Signals that arrived during the capability query are handled before the first frame.
        while let Ok(event) = signals.try_recv() {
            if let Some(status) = self.handle_signal(event) {
                return Ok(Some(status));
            }
        }
        while !self.quit {
            let wait = self.draw();
            // A snapshot is taken only when the terminal can receive another frame.
            let (wakeup, wants_snapshot) = match self.wants_snapshot() {
                None => (&silence, None),
                Some(Duration::ZERO) => (&wakeup, None),
                wait => (&silence, wait),
            };
            let timer = match wait.into_iter().chain(wants_snapshot).min() {
                Some(wait) => after(wait),
                None => never(),
            };
            select! {
                recv(input) -> event => match event {
                    Ok(Ok(event)) => self.enqueue(event, &mut waiting),
                    // The terminal is gone.
                    Ok(Err(_)) | Err(_) => return Ok(Some(HUNG_UP)),
                },
                recv(wakeup) -> notified => match notified {
                    Ok(()) => self.take_snapshot(),
                    // The renderer's panic has been reported already.
                    Err(_) => return Err(io::Error::other("the renderer has ended")),
                },
                recv(done) -> message => if let Ok(message) = message {
                    self.dispatch(message);
                },
                recv(written) -> frame => {
                    if let Ok(written) = frame {
                        self.frames.record_written();
                        match written {
                            Ok(at) => self.latency.written(at),
                            Err(_) => return Ok(Some(HUNG_UP)),
                        }
                    }
                }
                recv(signals) -> event => {
                    if let Some(status) = event.ok().and_then(|event| self.handle_signal(event)) {
                        return Ok(Some(status));
                    }
                }
                recv(left) -> _ => return Err(io::Error::other("the dashboard has failed")),
                recv(timer) -> _ => self.wake(),
            }
            while let Ok(Ok(event)) = input.try_recv() {
                self.enqueue(event, &mut waiting);
            }
            for Input { at, message } in waiting.drain(..) {
                self.frames.flow.record_input(self.began.elapsed());
                let scene = self.dispatch(message);
                self.latency.event(at, scene);
            }
            while let Ok(message) = done.try_recv() {
                self.dispatch(message);
            }
            if std::mem::take(&mut self.suspend)
                && let Some(status) = self.suspend(stop_group)
            {
                return Ok(Some(status));
            }
        }
        Ok(None)
    }

    /// Handles a terminal reply at once, and appends user input to `waiting`.
    fn enqueue(&mut self, TimedEvent { at, event }: TimedEvent, waiting: &mut Vec<Input>) {
        let message = match event {
            Event::Key(key) => Message::Key(key),
            Event::Mouse(mouse) => Message::Mouse(mouse),
            Event::Paste(text) => Message::Paste(text),
            Event::Reply(Reply::Cursor { .. }) => {
                self.frames.flow.on_ack(at.saturating_duration_since(self.began));
                return;
            }
            Event::Reply(reply @ (Reply::Graphics(true) | Reply::Version(_))) => {
                // A terminal behind a multiplexer may reply only after the capability query has
                // ended.
                self.frames.terminal.learn(&reply);
                return;
            }
            Event::Reply(_) => return,
        };
        input::join(waiting, Input { at, message });
    }

    /// Waits for outstanding replies of the terminal, before the terminal is restored. Otherwise
    /// the shell would read the replies as input.
    fn await_answers(&mut self) {
        let end = self.frames.flow.awaits().map(|wait| Instant::now() + wait);
        while let Some(left) = end.map(|end| end.saturating_duration_since(Instant::now())) {
            match self.terminal_io.input.recv_timeout(left) {
                Ok(Ok(event)) => self.enqueue(event, &mut Vec::new()),
                _ => break,
            }
            if !self.frames.flow.is_waiting() {
                break;
            }
        }
    }

    /// Updates the model with `message` and executes the resulting effects. If the response to the
    /// message needs a newly rendered picture, returns the number of the new version of the scene
    /// (its generation). Otherwise returns `None`.
    fn dispatch(&mut self, message: Message) -> Option<u64> {
        let mut awaited = None;
        let is_snapshot = matches!(message, Message::Snapshot(_));
        let version = self.model.picture_version;
        for effect in update(&mut self.model, message, self.began.elapsed()) {
            let scene = match &effect {
                Effect::Show(scene) => Some(Arc::clone(scene)),
                _ => None,
            };
            match self.effects.run(effect, &mut self.frames) {
                Outcome::Done => {}
                Outcome::Rendering(generation) => {
                    // A change of lights alone needs no newly rendered picture: the current
                    // snapshot has one picture per light group, and these are added up with new
                    // weights.
                    let snapshot = self.model.snapshot.as_deref();
                    let relit =
                        scene.is_some_and(|s| snapshot.is_some_and(|n| n.mix_for(&s).is_some()));
                    if !relit {
                        awaited = Some(generation);
                    }
                }
                Outcome::Suspend => self.suspend = true,
                Outcome::Quit => self.quit = true,
            }
        }
        if version != self.model.picture_version && awaited.is_none() && !is_snapshot {
            self.image_epoch += 1;
        }
        self.changed = true;
        awaited
    }

    fn take_snapshot(&mut self) {
        if let Some(snapshot) = self.effects.take_snapshot() {
            let failed = matches!(snapshot.report.state, State::Failed(_));
            let raster = |s: &Snapshot| s.picture.as_ref().map(|p| [p.cols, p.rows]);
            if snapshot.picture.is_some() || failed {
                let old = self.model.snapshot.as_deref().and_then(raster);
                let is_new_scene = self.shown != snapshot.report.generation;
                self.image_epoch += u64::from(is_new_scene || old != raster(&snapshot));
                self.shown = snapshot.report.generation;
            }
            self.dispatch(Message::Snapshot(Box::new(snapshot)));
        }
    }

    /// Returns the time from now until a frame with a new picture may be sent. Returns `None` while
    /// the last frame is still being written.
    fn wants_snapshot(&self) -> Option<Duration> {
        let now = self.began.elapsed();
        let flow = &self.frames.flow;
        let may_send = flow.allowance(now, self.latency.replies(u64::MAX)).is_some();
        let due = if may_send { now } else { flow.wakes_at(now, true) };
        self.frames.writing_since.is_none().then(|| due.saturating_sub(now))
    }

    /// Sends [`Message::Tick`] to the model if the time of its next timeout has come.
    fn wake(&mut self) {
        if self.model.next_timeout().is_some_and(|at| at <= self.began.elapsed()) {
            self.dispatch(Message::Tick);
        }
    }

    /// Draws a frame if one is due and the connection has room for it. Returns the time from now
    /// until this method must be called again, or `None` if it need not be called before the next
    /// event.
    fn draw(&mut self) -> Option<Duration> {
        let now = self.began.elapsed();
        if let Some(due) = self.resizing.due() {
            if due > now {
                return Some(due - now);
            }
            self.resize();
        }
        self.frames.look(now);
        let reading = self.frames.flow.reading();
        let mode = |link: &Option<LinkStatus>| link.as_ref().map(|link| link.mode);
        let mode_changed = mode(&reading) != mode(&self.model.link);
        if mode_changed || self.changed && self.status_sent_at + STATUS_INTERVAL <= now {
            self.status_sent_at = now;
            self.dispatch(Message::LinkStatus(reading));
        }
        self.report_upload(now);
        self.frames.follow(&self.model);
        let mut due = None;
        if self.frames.writing_since.is_none() && !self.quit {
            let answers = self.latency.replies(self.shown);
            due = self.frames.due(now, self.changed, answers);
            if due.is_some_and(|at| at <= now) {
                let drawn =
                    self.frames.draw(&self.model, now, self.changed, answers, self.image_epoch);
                self.latency.line(now, self.frames.diff.pending().visible, self.frames.sent);
                self.changed &= matches!(drawn, DrawOutcome::Nothing | DrawOutcome::Slice);
                match drawn {
                    DrawOutcome::Nothing | DrawOutcome::Deferred | DrawOutcome::Slice => {}
                    DrawOutcome::Same => {
                        // The screen already shows the response, so the latency ends now.
                        self.latency.sent(self.shown);
                        self.latency.written(Instant::now());
                    }
                    // Generations of pictures begin at 1, so the value 0 means a frame without
                    // picture.
                    DrawOutcome::Text => self.latency.sent(0),
                    DrawOutcome::Picture => self.latency.sent(self.shown),
                }
                let answers = self.latency.replies(self.shown);
                due = match self.frames.writing_since {
                    None => self.frames.due(now, self.changed, answers),
                    Some(_) => None,
                };
            }
        }
        let measures_at = self.frames.flow.measures_at(now);
        let silent_at = self.rest(now);
        let times = [self.model.next_timeout(), due, measures_at, silent_at];
        times.into_iter().flatten().min().map(|at| at.saturating_sub(now))
    }

    /// Pauses rendering while the terminal does not reply, because pictures would not arrive.
    /// Returns the time at which rendering will be paused unless a reply arrives before. Returns
    /// `None` if rendering is paused for this reason already, or if no reply is expected.
    fn rest(&mut self, now: Duration) -> Option<Duration> {
        let silent_at = self.frames.flow.silent_at(self.frames.writing_since);
        let is_silent = silent_at.is_some_and(|at| at <= now);
        if std::mem::replace(&mut self.resting, is_silent) != is_silent && !self.model.paused {
            self.effects.rest(is_silent);
        }
        silent_at.filter(|_| !is_silent)
    }
}

/// Longest time that `zerkalo watch` waits, when it starts, for the first report on the files.
const FIRST_REPORT_WITHIN: Duration = Duration::from_secs(2);

/// Shortest interval between two updates of the displayed connection status, and between two
/// updates of the displayed upload progress.
const STATUS_INTERVAL: Duration = Duration::from_millis(500);

/// Default stop criterion: a noise of half an 8-bit level, which is half a quantisation step of an
/// 8-bit image file.
pub const DEFAULT_STOP: Stop =
    Stop { spp: None, noise_levels: Some(0.5), rmse_linear: None, seconds: None };
