//! Executor of the effects (saving, rendering, exporting) that the dashboard's function `update`
//! returns.

use crate::dashboard::message::{Effect, Format, Message};
use crate::dashboard::run::autosave_worker::AutosaveJob;
use crate::dashboard::run::exporter::{ExportRequest, Exporter, ResizedExport};
use crate::dashboard::run::file_worker::{Files, Job};
use crate::dashboard::run::frames::FramePipeline;
use crate::dashboard::run::worker::Worker;
use crate::dashboard::run::{export_paths, image_viewer};
use crossbeam_channel::{Receiver, Sender};
use std::io;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};
use zerkalo_render::Options;
use zerkalo_render::film::LinearImage;
use zerkalo_render::schedule::Settings;
use zerkalo_render::session::{Session, Snapshot};
use zerkalo_scene::SceneFile;

/// Niceness of tracing threads with low priority: the largest value of Linux. Threads of normal
/// priority get nearly all the time of a processor that they share with such a thread.
const LOW_PRIORITY: i32 = 19;

/// Action that the event loop must take after it has executed an effect.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// The event loop continues. Results of the effect, if there are any, arrive as messages.
    Done,
    /// The renderer has started a new picture. The value is the generation of the picture: the
    /// number of the scene version that it shows.
    Rendering(u64),
    /// Suspend the program and give the terminal back to the shell.
    Suspend,
    /// End the dashboard and the program.
    Quit,
}

/// Executor of the dashboard's effects, such as saving and exporting, and source of snapshots of
/// the render.
pub trait Effects {
    /// Returns the channel that receives a message whenever the renderer publishes a new snapshot,
    /// the state of the render at one moment with the picture so far.
    fn wakeup(&self) -> &Receiver<()>;

    /// Takes the renderer's latest snapshot (state of the render at one moment). Returns `None` if
    /// it has been taken already.
    fn take_snapshot(&self) -> Option<Snapshot>;

    /// Pauses rendering if the argument is `true`, otherwise resumes it. The event loop pauses it
    /// while the connection to the terminal is silent. Does nothing without a renderer.
    fn rest(&self, _resting: bool) {}

    /// Executes `effect`. Its results arrive as messages. `frames` is the output to the terminal.
    fn run(&mut self, effect: Effect, frames: &mut FramePipeline) -> Outcome;

    /// Writes unsaved edits to the recovery file at once, without the usual delay until a pause in
    /// editing. Blocks until the edits are written, at most for `patience`.
    fn flush(&self, _patience: Duration) {}

    /// Completes pending writes and ends the threads. First writes unsaved edits. Then waits until
    /// `deadline` for the renderer and for pictures that are being written, or without limit if
    /// `deadline` is `None`.
    ///
    /// Returns the path of the recovery file, or `None` if there are no unsaved edits. If unsaved
    /// edits are lost, returns an error with the reason.
    fn finish(self: Box<Self>, deadline: Option<Instant>) -> Result<Option<PathBuf>, String>;
}

/// Executor of effects for a dashboard that edits and renders a scene. It owns the renderer, the
/// thread that reads and writes the scene file, and the exports.
pub struct EffectRunner {
    /// Renderer of the scene.
    pub session: Session,
    files: Files,
    exporter: Exporter,
    resized: Option<ResizedExport>,
    threads: usize,
    niceness: i32,
    options: Options,
    settings: Settings,
    results: Sender<Message>,
}

impl EffectRunner {
    /// Creates the executor and starts the threads that render, read and write. `file` is the scene
    /// file, or the path of a scene file that is unreadable. `state` is the folder for recovery
    /// files that cannot be written beside their scene file. `threads` is the number of threads
    /// that trace rays. The results of effects are sent to `results`.
    pub fn new(
        file: Result<SceneFile, PathBuf>,
        state: Option<PathBuf>,
        threads: usize,
        options: Options,
        settings: Settings,
        results: Sender<Message>,
    ) -> io::Result<Self> {
        let unreadable_path = file.as_ref().err().cloned();
        let session = Session::new(threads, options.clone(), settings)?;
        let files = Files::new(file, state, results.clone())?;
        let exporter = Exporter {
            file: files.shared.clone(),
            unreadable_path,
            sampler: options.sampling.kind,
            adaptive: settings.adaptive,
        };
        Ok(Self {
            session,
            files,
            exporter,
            resized: None,
            threads,
            niceness: 0,
            options,
            settings,
            results,
        })
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
        // If the threads cannot be started, the old ones continue. No message is needed, because
        // the renderer's reports contain the number of threads.
        let _ = self.session.set_threads(self.threads, self.niceness);
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

    fn run(&mut self, effect: Effect, frames: &mut FramePipeline) -> Outcome {
        match effect {
            Effect::Show(scene) => return Outcome::Rendering(self.session.set_scene(scene)),
            Effect::Restart => return Outcome::Rendering(self.session.restart()),
            Effect::Display(display) => {
                self.options.display = display;
                self.session.set_display(display);
            }
            Effect::Stop(stop) => self.session.set_stop(stop),
            Effect::View(view) => self.session.set_view(view),
            Effect::Pause(paused) => self.rest(paused),
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
            Effect::Load => self.files.give(Job::Load),
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
                    options: Options { display, ..self.options.clone() },
                    settings: Settings { stop, ..self.settings },
                    threads: self.threads,
                };
                let started =
                    ResizedExport::start(request, self.exporter.clone(), self.results.clone());
                match started {
                    Ok(resized) => self.resized = Some(resized),
                    Err(error) => {
                        let why = format!("cannot start a rendering thread: {error}");
                        let _ = self.results.send(Message::Exported(Err(why)));
                    }
                }
            }
            Effect::CancelExport => {
                if let Some(resized) = &self.resized {
                    resized.cancel();
                }
            }
            Effect::Autosave(scene) => self.files.autosave(scene),
            Effect::Recover => self.files.give_autosave(AutosaveJob::Recover),
            Effect::Discard => self.files.give_autosave(AutosaveJob::Discard),
            effect => return run_on_terminal(effect, frames, &self.results),
        }
        Outcome::Done
    }

    fn flush(&self, patience: Duration) {
        self.files.flush(patience);
    }

    fn finish(self: Box<Self>, deadline: Option<Instant>) -> Result<Option<PathBuf>, String> {
        let Self { session, mut files, resized, .. } = *self;
        let kept = files.finish();
        let end = move || {
            if let Some(resized) = resized {
                resized.end();
            }
            // The renderer's thread runs tasks in the order of their submission. When this empty
            // task runs, all exports that were requested before it have been written.
            session.with(|_, _| ());
        };
        let patience = deadline
            .map_or(Duration::MAX, |deadline| deadline.saturating_duration_since(Instant::now()));
        // If the thread cannot be started, the closure `end` is dropped without being run. The
        // renderer ends then, and pictures that were not written yet are lost.
        if let Ok(ending) = Worker::spawn("end", end) {
            ending.join_within(patience);
        }
        kept
    }
}

/// Executes an effect that concerns the terminal: view an image file, copy a path, suspend, or
/// quit. Other effects are ignored. `frames` is the output to the terminal. A separate thread reads
/// and encodes an image file and sends the result to `results`.
pub fn run_on_terminal(
    effect: Effect,
    frames: &mut FramePipeline,
    results: &Sender<Message>,
) -> Outcome {
    match effect {
        Effect::ViewImage { path, display, screen } => {
            let viewport = image_viewer::viewport(frames, screen);
            image_viewer::prepare(path, display, viewport, results.clone());
        }
        Effect::Copy(path) => frames.copy(&export_paths::full(&path)),
        Effect::Suspend => return Outcome::Suspend,
        Effect::Quit => return Outcome::Quit,
        _ => {}
    }
    Outcome::Done
}
