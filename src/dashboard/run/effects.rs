//! Execution of the effects that `update` returns.

use crate::dashboard::message::{Effect, Format, Message};
use crate::dashboard::run::exporter::{ExportRequest, Exporter, ResizedExport, stem};
use crate::dashboard::run::file_worker::Files;
use crate::dashboard::run::frames::FramePipeline;
use crate::dashboard::run::worker::Worker;
use crate::dashboard::run::{image_viewer, paths};
use crate::film::LinearImage;
use crate::render::schedule::Settings;
use crate::render::session::{Session, Snapshot, View};
use crate::render::{Checkpoint, Options};
use crate::scene::{Scene, SceneFile};
use crate::terminal::Capabilities;
use crossbeam_channel::{Receiver, Sender, unbounded};
use std::io;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Niceness of tracing threads with low priority: the lowest priority of Linux, at which threads
/// use only idle processors.
const LOW_PRIORITY: i32 = 19;

/// Parameters of an [`EffectRunner`].
pub struct EffectSetup {
    /// The scene file, or the path of an unreadable one.
    pub file: Result<SceneFile, PathBuf>,
    /// Folder for recovery files that cannot be written beside their scene file.
    pub state: Option<PathBuf>,
    /// Number of tracing threads.
    pub threads: usize,
    /// Options of scene compilation and sampling.
    pub options: Options,
    /// Settings of sample allocation, and stop criteria.
    pub settings: Settings,
}

/// Action that the event loop must take after an effect.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// No action. Results of the effect, if any, arrive as messages.
    Done,
    /// The renderer has started a new picture with this generation number.
    Rendering(u64),
    /// Suspend the program and give the terminal back to the shell.
    Suspend,
    /// End the program.
    Quit,
}

/// Executor of effects, and source of snapshots.
pub trait Effects {
    /// Returns the channel that receives a message whenever a new snapshot is published.
    fn wakeup(&self) -> &Receiver<()>;

    /// Takes the latest snapshot. Returns `None` if it has been taken already.
    fn take_snapshot(&self) -> Option<Snapshot>;

    /// Pauses (`true`) or resumes (`false`) rendering. The event loop pauses it while the
    /// connection is silent.
    fn rest(&self, resting: bool);

    /// Returns the receiver of the results of effects, as messages. Each message must be passed to
    /// [`Effects::observe`] before it updates the model.
    fn done(&self) -> &Receiver<Message>;

    /// Updates the executor by the result of an effect.
    fn observe(&mut self, message: &Message);

    /// Executes `effect`. Its results arrive as messages. `frames` is the output to the terminal,
    /// and `terminal` its capabilities.
    fn run(
        &mut self,
        effect: Effect,
        frames: &mut FramePipeline,
        terminal: &Capabilities,
    ) -> Outcome;

    /// Writes unsaved edits to the recovery file without waiting for a pause. Blocks until the
    /// edits are written, at most for `patience`.
    fn flush(&self, patience: Duration);

    /// Completes pending writes and ends the threads. Returns the remaining results, and the path
    /// of the recovery file if there are unsaved edits. If these are lost, returns the reason.
    ///
    /// After `deadline` it no longer waits for the renderer and for pictures that are being
    /// written; `None` sets no limit. Unsaved edits never wait for them.
    fn finish(
        self: Box<Self>,
        deadline: Option<Instant>,
    ) -> (Vec<Message>, Result<Option<PathBuf>, String>);
}

/// Executor of effects that edits and renders a scene. It owns the renderer, the thread of the
/// scene file and the exports.
pub struct EffectRunner {
    session: Session,
    files: Files,
    exporter: Exporter,
    resized: Option<ResizedExport>,
    view: View,
    threads: usize,
    niceness: i32,
    options: Options,
    settings: Settings,
    results: Sender<Message>,
    done: Receiver<Message>,
}

impl EffectRunner {
    /// Starts the threads.
    pub fn new(setup: EffectSetup) -> io::Result<Self> {
        let EffectSetup { file, state, threads, options, settings } = setup;
        let (results, done) = unbounded();
        let stem = match &file {
            Ok(file) => stem(file.path(), file.document().name()),
            Err(path) => stem(Some(path), ""),
        };
        let session = Session::new(threads, options.clone(), settings)?;
        let files = Files::new(file, state, results.clone())?;
        let exporter = Exporter {
            file: files.shared(),
            folder: PathBuf::new(),
            stem,
            sampler: options.sampling.kind,
            adaptive: settings.adaptive,
        };
        Ok(Self {
            session,
            files,
            exporter,
            resized: None,
            view: View::default(),
            threads,
            niceness: 0,
            options,
            settings,
            results,
            done,
        })
    }

    /// Starts rendering `scene`. Returns its generation number, which the reports about this scene
    /// contain.
    pub fn show(&mut self, scene: Arc<Scene>) -> u64 {
        self.session.set_scene(scene)
    }

    /// Continues the render of `checkpoint` and shows `scene`.
    pub fn resume(&mut self, scene: Arc<Scene>, checkpoint: Checkpoint) {
        self.session.continue_from(scene, checkpoint);
    }

    fn export(&mut self, format: Format) {
        let (exporter, results) = (self.exporter.clone(), self.results.clone());
        self.session.submit(move |film| {
            let written = match film {
                Some((rendering, report)) => exporter.write(rendering, report, format),
                None => Err("there is no picture to write".to_string()),
            };
            let _ = results.send(Message::Exported(written));
        });
    }

    fn set_threads(&self) {
        // On failure the old threads stay. The renderer's reports contain their number.
        let _ = self.session.set_threads(self.threads, self.niceness);
    }

    fn refuse(&self, error: &io::Error) {
        let why = format!("cannot start a rendering thread: {error}");
        let _ = self.results.send(Message::Exported(Err(why)));
    }
}

impl Effects for EffectRunner {
    fn wakeup(&self) -> &Receiver<()> {
        self.session.wakeup()
    }

    fn take_snapshot(&self) -> Option<Snapshot> {
        self.session.take()
    }

    fn rest(&self, resting: bool) {
        if resting { self.session.pause() } else { self.session.resume() }
    }

    fn done(&self) -> &Receiver<Message> {
        &self.done
    }

    /// Changes the base name of future exports if `message` reports that the scene was saved at
    /// another path.
    fn observe(&mut self, message: &Message) {
        if let Message::Saved(_, Ok(path)) = message {
            self.exporter.stem = stem(Some(path), "");
        }
    }

    fn run(
        &mut self,
        effect: Effect,
        frames: &mut FramePipeline,
        terminal: &Capabilities,
    ) -> Outcome {
        match effect {
            Effect::Show(scene) => return Outcome::Rendering(self.show(scene)),
            Effect::Restart => return Outcome::Rendering(self.session.restart()),
            Effect::Display(display) => {
                self.options.display = display;
                self.session.set_display(display);
            }
            Effect::Stop(stop) => self.session.set_stop(stop),
            Effect::Raster(raster) => {
                self.view.raster = Some(raster);
                self.session.set_view(self.view);
            }
            Effect::Probe(pixel) => {
                self.view.probe = pixel;
                self.session.set_view(self.view);
            }
            Effect::Pause(true) => self.session.pause(),
            Effect::Pause(false) => self.session.resume(),
            Effect::Threads(threads) => {
                self.threads = threads;
                self.set_threads();
            }
            Effect::LowPriority(low) => {
                self.niceness = if low { LOW_PRIORITY } else { 0 };
                self.set_threads();
            }
            Effect::Pin => {
                let results = self.results.clone();
                self.session.submit(move |film| {
                    if let Some((rendering, report)) = film {
                        let picture = LinearImage::of_film(&rendering.film, &rendering.mix);
                        let _ = results.send(Message::Pinned(Arc::new(picture), report.spp.mean));
                    }
                });
            }
            Effect::Save { scene, path, overwrite } => self.files.save(scene, path, overwrite),
            Effect::Load => self.files.load(),
            Effect::Export(format) => self.export(format),
            Effect::Checkpoint(scene) => {
                let (exporter, results) = (self.exporter.clone(), self.results.clone());
                self.session.checkpoint(self.exporter.provenance(&scene), move |checkpoint| {
                    let written = exporter.write_checkpoint(checkpoint);
                    let _ = results.send(Message::CheckpointWritten(written));
                });
            }
            Effect::ExportSized { scene, format, display, stop } => {
                let request = ExportRequest {
                    scene,
                    format,
                    display,
                    stop,
                    options: self.options.clone(),
                    settings: self.settings,
                    threads: self.threads,
                };
                let started =
                    ResizedExport::start(request, self.exporter.clone(), self.results.clone());
                match started {
                    Ok(resized) => self.resized = Some(resized),
                    Err(error) => self.refuse(&error),
                }
            }
            Effect::CancelExport => {
                if let Some(resized) = &self.resized {
                    resized.cancel();
                }
            }
            Effect::Autosave(scene) => self.files.autosave(scene),
            Effect::Recover => self.files.recover(),
            Effect::Discard => self.files.discard(),
            effect => return run_on_terminal(effect, frames, terminal, &self.results),
        }
        Outcome::Done
    }

    fn flush(&self, patience: Duration) {
        self.files.flush(patience);
    }

    fn finish(
        mut self: Box<Self>,
        deadline: Option<Instant>,
    ) -> (Vec<Message>, Result<Option<PathBuf>, String>) {
        let resized = self.resized.take();
        let Self { session, files, results, done, .. } = *self;
        let kept = files.finish();
        let end = move || {
            if let Some(resized) = resized {
                resized.end();
            }
            // The session runs its tasks in order, so all requested exports are written after this
            // one.
            session.with(|_, _| ());
            drop((session, results));
        };
        let patience = deadline
            .map_or(Duration::MAX, |deadline| deadline.saturating_duration_since(Instant::now()));
        // If there is no thread, the session ends here, without the pictures.
        if let Ok(ending) = Worker::spawn("end", end) {
            ending.join_within(patience);
        }
        (done.try_iter().collect(), kept)
    }
}

/// Executes an effect on the terminal, or one that shows an image file. All other effects are
/// ignored.
pub fn run_on_terminal(
    effect: Effect,
    frames: &mut FramePipeline,
    terminal: &Capabilities,
    results: &Sender<Message>,
) -> Outcome {
    match effect {
        Effect::ViewImage { path, display, screen } => {
            let line_rate = frames.reading().map(|link| link.rate);
            let viewport = image_viewer::viewport(terminal, screen, line_rate);
            image_viewer::prepare(path, display, viewport, results.clone());
        }
        Effect::Copy(path) => frames.copy(&paths::full(&path)),
        Effect::Suspend => return Outcome::Suspend,
        Effect::Quit => return Outcome::Quit,
        _ => {}
    }
    Outcome::Done
}
