//! The dashboard at work: terminal, keys, renderer, files, time. One thread decides and draws; whatever
//! could keep it waiting has a thread of its own.

mod autosave;
mod diagnose;
mod effects;
mod exporter;
mod file_worker;
mod frames;
mod image_upload;
mod image_viewer;
mod input;
mod job_control;
mod latency;
mod paths;
mod signals;
mod writer;

use crate::dashboard::message::{Effect, Exported, Message};
use crate::dashboard::model::{Model, Start};
use crate::dashboard::update::update;
use crate::render::Options;
use crate::render::schedule::{Settings, Stop};
use crate::render::session::{Snapshot, State};
use crate::scene::{SceneErrors, SceneFile};
use crate::terminal::flow::LinkStatus;
use crate::terminal::{
    Capabilities, Environment, Event, Keyboard, Reply, Screen, Timed, probe, size,
};
use crossbeam_channel::{Receiver, after, never, select};
use effects::{EffectRunner, EffectSetup, Outcome};
use frames::{DrawOutcome, FramePipeline};
use input::Input;
use job_control::{ResizeDebounce, TerminalIo};
use latency::LatencyRecorder;
use signals::{HUNG_UP, StopTarget};
use std::io;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};

pub use crate::dashboard::model::Colors;
pub use diagnose::{TerminalReport, diagnose};

/// What a dashboard is started with.
pub struct Setup {
    /// The scene's file; or where it is and why it cannot be read.
    pub file: Result<SceneFile, (PathBuf, SceneErrors)>,
    /// The folder for unsaved edits that cannot be kept beside their scene.
    pub state: Option<PathBuf>,
    /// Tracing threads, at least 1.
    pub threads: usize,
    /// How scenes are compiled and sampled.
    pub options: Options,
    /// How samples are allotted, and when the work is done at first.
    pub settings: Settings,
    /// How many colours the terminal has; `None`: as it turns out.
    pub colors: Option<Colors>,
    /// What the environment tells about the terminal.
    pub surroundings: Environment,
    /// Bytes a second that are sent, whatever the line may carry; `None`: what it carries.
    pub bandwidth: Option<f64>,
    /// Where to write how long answers took.
    pub trace: Option<PathBuf>,
}

/// How a dashboard ended.
#[derive(Debug, Default)]
pub struct Ended {
    /// The exit status that a signal asks for.
    pub signalled: Option<u8>,
    /// Pictures that were written after the screen was left.
    pub exported: Vec<Result<Exported, String>>,
    /// Where unsaved edits are kept, which the next start offers.
    pub kept: Option<PathBuf>,
    /// How long answers took, a line each; empty unless asked for.
    pub latencies: Vec<String>,
}

/// Runs a dashboard on the terminal of stdin and stdout until the user quits or a signal comes.
///
/// # Errors
/// If the terminal cannot be used (any more) or there are no threads. The terminal is restored.
pub fn run(setup: Setup) -> io::Result<Ended> {
    let Setup { file, state, threads, options, settings, colors, surroundings, bandwidth, trace } =
        setup;
    let (start, file) = match file {
        Ok(file) => (Ok(Arc::new(file.document().scene().clone())), Ok(file)),
        Err((path, errors)) => (Err(errors), Err(path)),
    };
    let (path, name) = match &file {
        Ok(file) => (file.path().map(PathBuf::from), file.document().name().to_string()),
        Err(path) => (Some(path.clone()), String::new()),
    };
    let mut effects = EffectRunner::new(EffectSetup { file, state, threads, options, settings })?;
    if let Ok(scene) = &start {
        // While the terminal is asked what it can do.
        effects.show(Arc::clone(scene));
    }
    let signals = signals::block()?;
    let screen = Screen::enter()?;
    let signals = signals::watch(signals, screen.tty(), signals::PATIENCE)?;
    let mut keyboard = Keyboard::new(&surroundings);
    let ending = || signals.is_ending();
    let Ok(terminal) = probe(&screen.tty(), &mut keyboard, surroundings, &ending) else {
        return Ok(Ended { signalled: Some(HUNG_UP), ..Ended::default() });
    };
    let model = Model::new(Start {
        path,
        name,
        scene: start,
        screen: size()?,
        colors: colors.unwrap_or(terminal.colors),
        stop: settings.stop,
        threads,
        max_threads: std::thread::available_parallelism().map_or(threads, usize::from),
    });
    let mut dashboard = Dashboard {
        model,
        effects,
        frames: FramePipeline::new(screen.tty(), &terminal, bandwidth)?,
        terminal,
        trace: LatencyRecorder::new(trace.is_some()),
        began: Instant::now(),
        shown: 0,
        image_epoch: 0,
        resizing: ResizeDebounce::default(),
        status_sent_at: Duration::ZERO,
        changed: true,
        suspend: false,
        quit: false,
    };
    // So that the renderer learns how large the picture is.
    dashboard.dispatch(Message::Resize(dashboard.model.screen));
    let input = input::read(keyboard)?;
    let line =
        TerminalIo { tty: screen.tty(), input, signals: signals.told, left: screen.left().clone() };
    let result = dashboard.watch(&line);
    // First of all, and whatever else there is to write.
    dashboard.effects.flush(Duration::ZERO);
    if matches!(&result, Ok(status) if *status != Some(HUNG_UP)) {
        dashboard.await_answers(&line.input);
    }
    // What is still to be written may take a while: it need not be waited for on an empty screen.
    drop(screen);
    let (finished, kept) = dashboard.effects.finish();
    let exported = finished.into_iter().filter_map(|message| match message {
        Message::Exported(result) => Some(result),
        _ => None,
    });
    let mut ended =
        Ended { signalled: result?, exported: exported.collect(), kept, latencies: Vec::new() };
    if let Some(path) = trace {
        dashboard.trace.write(&path)?;
        ended.latencies = dashboard.trace.summary();
    }
    Ok(ended)
}

struct Dashboard {
    model: Model,
    effects: EffectRunner,
    frames: FramePipeline,
    /// What the terminal can do, as far as it has said.
    terminal: Capabilities,
    trace: LatencyRecorder,
    began: Instant,
    /// The scene whose picture the model has: its number.
    shown: u64,
    /// Counts up when the picture is another one than the same with more samples.
    image_epoch: u64,
    /// The terminal's size may change again at once.
    resizing: ResizeDebounce,
    /// When the line was told about last.
    status_sent_at: Duration,
    /// The screen may have to change.
    changed: bool,
    suspend: bool,
    quit: bool,
}

impl Dashboard {
    /// Lets things happen until the end; the exit status of a signal.
    fn watch(&mut self, line: &TerminalIo) -> io::Result<Option<u8>> {
        let bell = self.effects.session().wakeup().clone();
        let done = self.effects.done().clone();
        let written = self.frames.written().clone();
        let silence = never();
        let mut waiting = Vec::new();
        // Who was told to end while the terminal was asked draws nothing any more.
        while let Ok(told) = line.signals.try_recv() {
            if let Some(status) = self.handle_signal(told, line) {
                return Ok(Some(status));
            }
        }
        while !self.quit {
            let wait = self.draw();
            // A picture is made when the last one has been taken: not before it can be shown.
            let (bell, wants_snapshot) = match self.wants_snapshot() {
                None => (&silence, None),
                Some(Duration::ZERO) => (&bell, None),
                wait => (&silence, wait),
            };
            let timer = match wait.into_iter().chain(wants_snapshot).min() {
                Some(wait) => after(wait),
                None => never(),
            };
            select! {
                recv(line.input) -> came => match came {
                    Ok(Ok(came)) => self.enqueue(came, &mut waiting),
                    // The terminal is gone.
                    Ok(Err(_)) | Err(_) => return Ok(Some(HUNG_UP)),
                },
                recv(bell) -> rung => match rung {
                    Ok(()) => self.take_snapshot(),
                    // Its panic has been told already.
                    Err(_) => return Err(io::Error::other("the renderer has ended")),
                },
                recv(done) -> message => message.into_iter().for_each(|m| self.take_done(m)),
                recv(written) -> frame => {
                    if let Ok(frame) = frame {
                        match self.frames.written_at(frame) {
                            Ok(at) => self.trace.written(at),
                            Err(_) => return Ok(Some(HUNG_UP)),
                        }
                    }
                }
                recv(line.signals) -> told => {
                    if let Some(status) = told.ok().and_then(|told| self.handle_signal(told, line)) {
                        return Ok(Some(status));
                    }
                }
                recv(line.left) -> _ => return Err(io::Error::other("the dashboard has failed")),
                recv(timer) -> _ => self.wake(),
            }
            while let Ok(Ok(came)) = line.input.try_recv() {
                self.enqueue(came, &mut waiting);
            }
            for Input { at, message } in waiting.drain(..) {
                self.frames.act(self.began.elapsed());
                let scene = self.dispatch(message);
                self.trace.event(at, scene);
            }
            while let Ok(message) = done.try_recv() {
                self.take_done(message);
            }
            if std::mem::take(&mut self.suspend)
                && let Some(status) = self.suspend(StopTarget::Group, line)
            {
                return Ok(Some(status));
            }
        }
        Ok(None)
    }

    /// Something came from the terminal: an answer counts at once, what the user did is `waiting`.
    fn enqueue(&mut self, Timed { at, event }: Timed, waiting: &mut Vec<Input>) {
        let message = match event {
            Event::Key(key) => Message::Key(key),
            Event::Mouse(mouse) => Message::Mouse(mouse),
            Event::Paste(text) => Message::Paste(text),
            Event::Reply(Reply::Cursor { .. }) => {
                self.frames.answered(at.saturating_duration_since(self.began));
                return;
            }
            Event::Reply(reply @ (Reply::Graphics(true) | Reply::Version(_))) => {
                // From behind a multiplexer, or late.
                self.terminal.learn(&reply);
                return;
            }
            Event::Reply(_) => return,
        };
        input::join(waiting, Input { at, message });
    }

    /// At the end: what the terminal still has to answer shall not be typed into a shell.
    fn await_answers(&mut self, input: &Receiver<io::Result<Timed>>) {
        let end = self.frames.awaits().map(|wait| Instant::now() + wait);
        while let Some(left) = end.map(|end| end.saturating_duration_since(Instant::now())) {
            match input.recv_timeout(left) {
                Ok(Ok(came)) => self.enqueue(came, &mut Vec::new()),
                _ => break,
            }
            if !self.frames.is_waiting() {
                break;
            }
        }
    }

    /// Updates the model with a message and runs the effects. Returns the generation of the scene if
    /// the response needs a new picture.
    fn dispatch(&mut self, message: Message) -> Option<u64> {
        let mut awaited = None;
        let is_snapshot = matches!(message, Message::Snapshot(_));
        let version = self.model.picture_version;
        for effect in update(&mut self.model, message, self.began.elapsed()) {
            let scene = match &effect {
                Effect::Show(scene) => Some(Arc::clone(scene)),
                _ => None,
            };
            match self.effects.run(effect, &mut self.frames, &self.terminal) {
                Outcome::Done => {}
                Outcome::Rendering(generation) => {
                    // A change of lights is visible at once: the current picture is relit.
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

    fn take_done(&mut self, message: Message) {
        self.effects.observe(&message);
        self.dispatch(message);
    }

    fn take_snapshot(&mut self) {
        if let Some(snapshot) = self.effects.session().take() {
            let failed = matches!(snapshot.report.state, State::Failed(_));
            let raster = |s: &Snapshot| s.picture.as_ref().map(|p| [p.cols, p.rows]);
            if snapshot.picture.is_some() || failed {
                let old = self.model.snapshot.as_deref().and_then(raster);
                let another = self.shown != snapshot.report.generation;
                self.image_epoch += u64::from(another || old != raster(&snapshot));
                self.shown = snapshot.report.generation;
            }
            self.dispatch(Message::Snapshot(Box::new(snapshot)));
        }
    }

    /// How long to wait before the next picture could be shown; `None`: until the terminal has taken
    /// the last one.
    fn wants_snapshot(&self) -> Option<Duration> {
        let now = self.began.elapsed();
        let due = self.frames.snapshot_due(now, self.trace.replies(u64::MAX));
        self.frames.ready().then(|| due.saturating_sub(now))
    }

    /// Time has passed: the model is told if it wanted to be.
    fn wake(&mut self) {
        if self.model.next_timeout().is_some_and(|at| at <= self.began.elapsed()) {
            self.dispatch(Message::Tick);
        }
    }

    /// Draws if there is something to draw and the terminal can take it. How long to wait for what
    /// happens by itself, if anything.
    fn draw(&mut self) -> Option<Duration> {
        let now = self.began.elapsed();
        if let Some(due) = self.resizing.due() {
            if due > now {
                return Some(due - now);
            }
            self.resize();
        }
        self.frames.look(now);
        let reading = self.frames.reading();
        let mode = |line: &Option<LinkStatus>| line.as_ref().map(|line| line.mode);
        let other = mode(&reading) != mode(&self.model.link);
        if other || self.changed && self.status_sent_at + STATUS_INTERVAL <= now {
            self.status_sent_at = now;
            self.dispatch(Message::LinkStatus(reading));
        }
        self.report_upload(now);
        self.frames.follow(&self.model);
        let mut due = None;
        if self.frames.ready() && !self.quit {
            let answers = self.trace.replies(self.shown);
            due = self.frames.due(now, self.changed, answers);
            if due.is_some_and(|at| at <= now) {
                let drawn =
                    self.frames.draw(&self.model, now, self.changed, answers, self.image_epoch);
                let (waits, sent) = self.frames.load();
                self.trace.line(now, waits, sent);
                self.changed &= matches!(drawn, DrawOutcome::Nothing | DrawOutcome::Slice);
                match drawn {
                    DrawOutcome::Nothing | DrawOutcome::Deferred | DrawOutcome::Slice => {}
                    DrawOutcome::Same => {
                        // The screen was the answer already.
                        self.trace.sent(self.shown);
                        self.trace.written(Instant::now());
                    }
                    // No picture answers by its number.
                    DrawOutcome::Text => self.trace.sent(0),
                    DrawOutcome::Picture => self.trace.sent(self.shown),
                }
                let answers = self.trace.replies(self.shown);
                due = if self.frames.ready() {
                    self.frames.due(now, self.changed, answers)
                } else {
                    None
                };
            }
        }
        let next = self.model.next_timeout().into_iter().chain(due).min();
        next.map(|at| at.saturating_sub(now))
    }
}

/// What the status line tells about the line to the terminal is not older than this.
const STATUS_INTERVAL: Duration = Duration::from_millis(500);

/// Without a better idea the work is done at half a step of an 8-bit file.
pub const DEFAULT_STOP: Stop =
    Stop { spp: None, noise_codes: Some(0.5), rmse_linear: None, seconds: None };
