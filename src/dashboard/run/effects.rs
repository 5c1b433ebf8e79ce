//! Does what `update` asks for.

use crate::dashboard::message::{Effect, Format, Message};
use crate::dashboard::run::exporter::{ExportRequest, Exporter, ResizedExport, stem};
use crate::dashboard::run::file_worker::Files;
use crate::film::LinearImage;
use crate::render::Options;
use crate::render::schedule::Settings;
use crate::render::session::{Session, View};
use crate::scene::{Scene, SceneFile};
use crossbeam_channel::{Receiver, Sender, unbounded};
use std::io;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

/// What low priority means: the tracing threads only take what nobody else wants.
const LOW_PRIORITY: i32 = 19;

/// What the hands work with.
pub struct EffectSetup {
    /// The scene's file; or where it is, as long as it cannot be read.
    pub file: Result<SceneFile, PathBuf>,
    /// The folder for unsaved edits that cannot be kept beside their scene.
    pub state: Option<PathBuf>,
    /// Tracing threads.
    pub threads: usize,
    /// How scenes are compiled and sampled.
    pub options: Options,
    /// How samples are allotted, and when the work is done.
    pub settings: Settings,
}

/// The renderer, the files, and what is being written.
pub struct EffectRunner {
    session: Session,
    files: Files,
    studio: Exporter,
    sized: Option<ResizedExport>,
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
    pub fn new(tools: EffectSetup) -> io::Result<Self> {
        let EffectSetup { file, state, threads, options, settings } = tools;
        let (results, done) = unbounded();
        let stem = match &file {
            Ok(file) => stem(file.path(), file.document().name()),
            Err(path) => stem(Some(path), ""),
        };
        let session = Session::new(threads, options.clone(), settings)?;
        let files = Files::new(file, state, results.clone())?;
        let studio = Exporter {
            paper: files.paper(),
            folder: PathBuf::new(),
            stem,
            sampler: options.sampling.kind,
            adaptive: settings.adaptive,
        };
        Ok(Self {
            session,
            files,
            studio,
            sized: None,
            view: View::default(),
            threads,
            niceness: 0,
            options,
            settings,
            results,
            done,
        })
    }

    /// The renderer.
    pub fn session(&self) -> &Session {
        &self.session
    }

    /// Where what was done is told.
    pub fn results(&self) -> Sender<Message> {
        self.results.clone()
    }

    /// What was done, as messages; pass them through [`EffectRunner::observe`].
    pub fn done(&self) -> &Receiver<Message> {
        &self.done
    }

    /// Shows a scene; the number returned comes back in reports about it.
    pub fn show(&mut self, scene: Arc<Scene>) -> u64 {
        self.session.set_scene(scene)
    }

    /// Does what is asked for. What it leads to comes as messages. The number of the scene if the
    /// renderer has a new one to show.
    pub fn run_effect(&mut self, effect: Effect) -> Option<u64> {
        match effect {
            Effect::Show(scene) => return Some(self.show(scene)),
            Effect::Restart => return Some(self.session.restart()),
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
            Effect::Keep => {
                let results = self.results.clone();
                self.session.submit(move |film| {
                    if let Some((rendering, report)) = film {
                        let picture = LinearImage::of_film(&rendering.film, &rendering.mix);
                        let _ = results.send(Message::Kept(Arc::new(picture), report.spp.mean));
                    }
                });
            }
            Effect::Save { scene, path, overwrite } => self.files.save(scene, path, overwrite),
            Effect::Load => self.files.load(),
            Effect::Export(format) => self.export(format),
            Effect::ExportSized { scene, format, display, stop } => {
                let order = ExportRequest {
                    scene,
                    format,
                    display,
                    stop,
                    options: self.options.clone(),
                    settings: self.settings,
                    threads: self.threads,
                };
                let started =
                    ResizedExport::start(order, self.studio.clone(), self.results.clone());
                match started {
                    Ok(sized) => self.sized = Some(sized),
                    Err(error) => self.refuse(&error),
                }
            }
            Effect::CancelExport => {
                if let Some(sized) = &self.sized {
                    sized.cancel();
                }
            }
            Effect::KeepEdits(scene) => self.files.journal(scene),
            Effect::TakeUp => self.files.take_up(),
            Effect::Discard => self.files.discard(),
            // The loop's own.
            Effect::Quit | Effect::Suspend | Effect::Copy(_) | Effect::Look { .. } => {}
        }
        None
    }

    /// Takes note of what was done, before the model does.
    pub fn observe(&mut self, message: &Message) {
        if let Message::Saved(_, Ok(path)) = message {
            self.studio.stem = stem(Some(path), "");
        }
    }

    /// Unsaved edits are written now, whatever comes. Waits for that at most as long as `patience`.
    pub fn flush(&self, patience: Duration) {
        self.files.flush(patience);
    }

    /// Ends the work, but waits for what is being written: returns what was done meanwhile, and where
    /// unsaved edits are kept, if there are any.
    pub fn finish(mut self) -> (Vec<Message>, Option<PathBuf>) {
        if let Some(sized) = self.sized.take() {
            sized.end();
        }
        let Self { session, files, results, done, .. } = self;
        let kept = files.finish();
        // Tasks are done in order: when this one is done, so are the pictures asked for before.
        session.with(|_, _| ());
        drop((session, results));
        (done.into_iter().collect(), kept)
    }

    fn export(&mut self, format: Format) {
        let (studio, results) = (self.studio.clone(), self.results.clone());
        self.session.submit(move |film| {
            let written = match film {
                Some((rendering, report)) => studio.write(rendering, report, format),
                None => Err("there is no picture to write".to_string()),
            };
            let _ = results.send(Message::Exported(written));
        });
    }

    fn set_threads(&self) {
        // If no threads are to be had the old ones stay, and the renderer's reports say how many.
        let _ = self.session.set_threads(self.threads, self.niceness);
    }

    fn refuse(&self, error: &io::Error) {
        let why = format!("no thread to render with: {error}");
        let _ = self.results.send(Message::Exported(Err(why)));
    }
}
