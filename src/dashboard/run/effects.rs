//! Executor of the effects that `update` returns.

use crate::dashboard::pictures::KeptPicture;
use crate::dashboard::run::DEFAULT_STOP;
use crate::dashboard::run::exports::{Exporter, ResizedExport, image_viewer, paths};
use crate::dashboard::run::files::{AutosaveJob, Files, Job};
use crate::dashboard::run::frames::FramePipeline;
use crate::dashboard::{Effect, Exported, Format, Message};
use crossbeam_channel::{Receiver, Sender, TryRecvError, after, bounded, never, select};
use std::io;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};
use zerkalo_kernel::sampling::SamplerKind;
use zerkalo_render::Options;
use zerkalo_render::film::{Display, LinearImage};
use zerkalo_render::plan::FilmFiles;
use zerkalo_render::schedule::{Settings, Stop};
use zerkalo_render::session::{Picture, Session};
use zerkalo_scene::{Scene, SceneFile};
use zerkalo_terminal::{INTERRUPTED, SignalEvent};

/// Time after which a message says that a picture is still being written at the end.
const NOTICED_AFTER: Duration = Duration::from_millis(400);

/// Executor of effects: the session, the threads of the scene file, and the exports.
pub struct EffectRunner {
    /// Renderer of the scene, or reader of watched films.
    pub session: Session,
    exporter: Exporter,
    /// Scene file and resized export of a dashboard with a scene; `None` in `zerkalo watch`.
    editing: Option<Editing>,
    /// Receiver that is disconnected as soon as the last requested export has ended.
    exporting: Option<Receiver<()>>,
    results: Sender<Message>,
}

struct Editing {
    files: Files,
    resized: Option<ResizedExport>,
    threads: usize,
    options: Options,
}

impl EffectRunner {
    /// Starts the threads that render, read and write. `file` is the scene file, or the path of an
    /// unreadable one. `state` is the folder for recovery files that cannot be written beside their
    /// scene file.
    pub fn new(
        file: Result<SceneFile, PathBuf>,
        state: Option<PathBuf>,
        threads: usize,
        options: Options,
        results: Sender<Message>,
    ) -> io::Result<Self> {
        let session = Session::new(threads, options.clone(), Settings::until(DEFAULT_STOP))?;
        let files = Files::new(file, state, results.clone())?;
        let exporter = Exporter {
            file: Some(files.shared.clone()),
            sampler: options.sampling.kind,
            film_size: None,
        };
        let editing = Editing { files, resized: None, threads, options };
        Ok(Self { session, exporter, editing: Some(editing), exporting: None, results })
    }

    /// Creates the runner of `zerkalo watch`. Its session reads `films`, which other processes
    /// write, in a thread of its own.
    pub fn watching(
        films: FilmFiles,
        threads: usize,
        results: Sender<Message>,
    ) -> io::Result<Self> {
        let reports = results.clone();
        let session = Session::watch(films, threads, move |report| {
            // Sending fails only at the end of the program, when the receiver is gone.
            let _ = reports.send(Message::Watched(Box::new(report)));
        })?;
        let exporter = Exporter { file: None, sampler: SamplerKind::Sobol, film_size: None };
        Ok(Self { session, exporter, editing: None, exporting: None, results })
    }

    /// Executes `effect`. Its results arrive as messages. Returns the generation of the new picture
    /// if the effect makes the renderer start one.
    pub fn run(&mut self, effect: Effect, frames: &mut FramePipeline) -> Option<u64> {
        match effect {
            Effect::Show(scene) => return Some(self.session.set_scene(scene)),
            Effect::Restart => return Some(self.session.restart()),
            // The event loop suspends or quits after the present messages.
            Effect::Suspend | Effect::Quit => {}
            Effect::Display(display) => self.session.set_display(display),
            Effect::Stop(stop) => self.session.set_stop(stop),
            Effect::View(view) => self.session.set_view(view),
            Effect::Pin { step, is_pinned } => self.pin(step, is_pinned),
            Effect::MeasureBounces(seconds) => {
                let results = self.results.clone();
                self.session.submit(move |picture| {
                    let shares = picture.and_then(|picture| picture.bounce_shares(seconds));
                    let _ = results.send(Message::Bounces(shares));
                });
            }
            Effect::Export(format) => {
                self.export(move |exporter, picture| exporter.write(picture, format));
            }
            Effect::Checkpoint(scene) => {
                let provenance = self.exporter.provenance(&scene);
                self.export(move |exporter, picture| {
                    exporter.write_checkpoint(picture, &provenance)
                });
            }
            Effect::Copy(path) => frames.copy(&paths::full(&path)),
            Effect::ViewImage { path, display, screen, downloads } => {
                let viewport = image_viewer::viewport(frames, screen);
                image_viewer::prepare(path, display, viewport, downloads, self.results.clone());
            }
            Effect::Save { scene, path, overwrite } => {
                self.edit(|editing| editing.files.save(scene, path, overwrite));
            }
            Effect::Load => self.edit(|editing| editing.files.give(Job::Load)),
            Effect::Open(source) => self.edit(|editing| editing.files.give(Job::Open(source))),
            Effect::ListScenes => self.edit(|editing| editing.files.give(Job::List)),
            Effect::CompletePath { text, beside_scene } => {
                self.edit(|editing| editing.files.give(Job::Complete(text, beside_scene)));
            }
            Effect::Autosave(scene) => self.edit(|editing| editing.files.autosave(scene)),
            Effect::Recover => {
                self.edit(|editing| editing.files.give_autosave(AutosaveJob::Recover));
            }
            Effect::Discard => {
                self.edit(|editing| editing.files.give_autosave(AutosaveJob::Discard));
            }
            Effect::ExportSized { scene, format, display, stop } => {
                self.export_sized(scene, format, display, stop);
            }
            Effect::FinishExport => {
                self.edit(|editing| editing.resized.iter().for_each(ResizedExport::finish));
            }
            Effect::CancelExport => {
                self.edit(|editing| editing.resized.iter().for_each(ResizedExport::cancel));
            }
        }
        None
    }

    /// Calls `act` unless this is `zerkalo watch`, which neither edits nor renders.
    fn edit(&mut self, act: impl FnOnce(&mut Editing)) {
        if let Some(editing) = &mut self.editing {
            act(editing);
        }
    }

    /// Starts the render and export of `scene`, whose film has the requested size.
    fn export_sized(&mut self, scene: Arc<Scene>, format: Format, display: Display, stop: Stop) {
        let Some(editing) = &mut self.editing else { return };
        let options = Options { display, ..editing.options.clone() };
        let file = editing.files.shared.get();
        let film_size = file.map(|file| file.document.scene().film.size);
        let exporter = Exporter { film_size, ..self.exporter.clone() };
        let settings = Settings::until(stop);
        let started = Session::new(editing.threads, options, settings).and_then(|mut session| {
            session.set_scene(scene);
            ResizedExport::start(session, format, exporter, self.results.clone())
        });
        match started {
            Ok(export) => editing.resized = Some(export),
            Err(error) => {
                let why = format!("cannot start a rendering thread: {error}");
                let _ = self.results.send(Message::ExportProgress(None));
                let _ = self.results.send(Message::Exported(Err(why)));
            }
        }
    }

    fn pin(&self, step: String, is_pinned: bool) {
        let results = self.results.clone();
        self.session.submit(move |picture| {
            if let Some(picture) = picture {
                let report = picture.report;
                let _ = results.send(Message::Pinned(KeptPicture {
                    image: Arc::new(LinearImage::of_film(picture.film, picture.weights)),
                    spp: report.spp.mean,
                    noise_levels: report.noise.map(|noise| noise.rmse.levels),
                    generation: report.generation,
                    step,
                    is_pinned,
                }));
            }
        });
    }

    /// Calls `write` with the present picture, in the session's thread.
    fn export<F>(&mut self, write: F)
    where
        F: FnOnce(&Exporter, Option<Picture>) -> Result<Exported, String> + Send + 'static,
    {
        let (running, ended) = bounded::<()>(0);
        self.exporting = Some(ended);
        let (exporter, results) = (self.exporter.clone(), self.results.clone());
        self.session.submit(move |picture| {
            let _running = running;
            let _ = results.send(Message::Exported(write(&exporter, picture)));
        });
    }

    /// Writes unsaved edits to the recovery file at once. Blocks until they are written, at most
    /// for `patience`.
    pub fn flush(&self, patience: Duration) {
        self.editing.iter().for_each(|editing| editing.files.flush(patience));
    }

    /// Ends the session without waiting, unless it may have pictures to write.
    pub fn stop_early(&self) {
        let is_over =
            |running: &Receiver<()>| running.try_recv() == Err(TryRecvError::Disconnected);
        if self.exporting.as_ref().is_none_or(is_over) {
            self.session.stop();
        }
    }

    /// Completes pending writes. Waits for pictures that are being written until `deadline`. If that
    /// is `None`, because the user quits, waits until Ctrl-C is among `signals`.
    /// Returns the path of the recovery file, or `None` if there are no unsaved edits.
    ///
    /// # Errors
    /// Fails with the reason if unsaved edits are lost.
    pub fn finish(
        &mut self,
        deadline: Option<Instant>,
        signals: &Receiver<SignalEvent>,
    ) -> Result<Option<PathBuf>, String> {
        let editing = self.editing.as_mut();
        let (kept, resized) = editing
            .map_or((Ok(None), None), |editing| (editing.files.finish(), editing.resized.take()));
        // The session runs exports in the order of their requests, so that waiting for the last one
        // suffices. A panic of its thread drops the sender, too.
        let writing = self.exporting.take().into_iter().chain(resized.and_then(ResizedExport::end));
        for written in writing {
            let noticed = after(NOTICED_AFTER);
            let ended = deadline.map_or(never(), crossbeam_channel::at);
            loop {
                select! {
                    recv(written) -> _ => break,
                    recv(signals) -> event => {
                        if deadline.is_none() && event == Ok(SignalEvent::End(INTERRUPTED)) {
                            break;
                        }
                    }
                    recv(ended) -> _ => break,
                    recv(noticed) -> _ => {
                        eprintln!("A picture is being written; Ctrl-C ends without it.");
                    }
                }
            }
        }
        kept
    }
}
