//! Pictures written while the work goes on: the film as it stands, or a render at another size.

use crate::dashboard::message::{Exported, Format, Message};
use crate::dashboard::run::file_worker::SharedDocument;
use crate::dashboard::run::paths;
use crate::film::{Depth, Display, ImageOutput};
use crate::render::export::{Provenance, scene_hash};
use crate::render::schedule::{Settings, Stop};
use crate::render::session::{RenderBackend, Report, Session, State};
use crate::render::{Options, RenderState};
use crate::sampling::SamplerKind;
use crate::scene::{Document, Scene};
use crossbeam_channel::Sender;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, JoinHandle};
use std::time::Duration;

/// How often a render at another size is looked at.
const LOOK: Duration = Duration::from_millis(200);

/// What every picture of this scene has in common.
#[derive(Clone)]
pub struct Exporter {
    /// The scene's file.
    pub document: SharedDocument,
    /// Where pictures are put.
    pub folder: PathBuf,
    /// What pictures are called, before the counter.
    pub stem: String,
    /// Where samples lie.
    pub sampler: SamplerKind,
    /// Whether noisy tiles get more samples than others.
    pub adaptive: bool,
}

impl Exporter {
    /// Writes the picture of `rendering` under the next free name.
    pub fn write(
        &self,
        rendering: &RenderState,
        report: &Report,
        format: Format,
    ) -> Result<Exported, String> {
        let (source, text) = self.source(rendering.scene());
        let origin = Provenance {
            source,
            scene_hash: scene_hash(&text),
            sampler: self.sampler,
            adaptive: self.adaptive,
        };
        let display = rendering.display();
        let write = |path: &Path| {
            let target = ImageOutput::from_path(path)?.create_new();
            rendering.write(report, &origin, display, Depth::Eight, &target)
        };
        let path = paths::numbered(&self.folder, &self.stem, format.extension(), write)
            .ok_or_else(|| format!("all names for pictures of {} are in use", self.stem))?
            .map_err(|error| error.to_string())?;
        Ok(Exported {
            scp: paths::scp(&path),
            path,
            size: [rendering.film.width(), rendering.film.height()],
            spp: report.spp.mean,
            noise_codes: report.noise.map(|noise| noise.rmse_codes),
        })
    }

    /// What the scene's file is called, and its text with `scene` in it.
    fn source(&self, scene: &Scene) -> (String, String) {
        match self.document.get() {
            Some(document) => {
                let mut document = (*document).clone();
                document.apply(scene);
                (document.name().to_string(), document.text().to_string())
            }
            None => (self.stem.clone(), Document::new(scene, &self.stem).text().to_string()),
        }
    }
}

/// A render at another size, in a thread of its own.
pub struct ResizedExport {
    cancelled: Arc<AtomicBool>,
    thread: JoinHandle<()>,
}

/// What is to be rendered.
pub struct ExportRequest {
    /// The scene, with the size that is wanted.
    pub scene: Arc<Scene>,
    /// The format.
    pub format: Format,
    /// Exposure and tone curve.
    pub display: Display,
    /// When it is done.
    pub stop: Stop,
    /// How the scene is compiled and sampled.
    pub options: Options,
    /// How samples are allotted.
    pub settings: Settings,
    /// Threads that trace.
    pub threads: usize,
}

impl ResizedExport {
    /// Starts the thread. It tells of its progress, and at last of the picture, unless cancelled.
    pub fn start(
        request: ExportRequest,
        exporter: Exporter,
        results: Sender<Message>,
    ) -> io::Result<Self> {
        let cancelled = Arc::new(AtomicBool::new(false));
        let mark = Arc::clone(&cancelled);
        let thread = thread::Builder::new().name("export".into()).spawn(move || {
            // Nobody listens any more when the program ends.
            let told = render(request, &exporter, &mark, &|progress| {
                let _ = results.send(Message::ExportProgress(progress));
            });
            if let Some(result) = told {
                let _ = results.send(Message::Exported(result));
            }
        })?;
        Ok(Self { cancelled, thread })
    }

    /// Ends the render soon, without a picture if it is not being written already.
    pub fn cancel(&self) {
        self.cancelled.store(true, Ordering::Relaxed);
    }

    /// Cancels, and waits until the thread has ended.
    pub fn end(self) {
        self.cancel();
        if let Err(panic) = self.thread.join() {
            std::panic::resume_unwind(panic);
        }
    }
}

/// Renders and writes; `None`: cancelled.
fn render(
    request: ExportRequest,
    exporter: &Exporter,
    cancelled: &AtomicBool,
    tell: &dyn Fn(f64),
) -> Option<Result<Exported, String>> {
    let options = Options { display: request.display, ..request.options };
    let settings = Settings { stop: request.stop, ..request.settings };
    let mut session: Session<RenderState> = match Session::new(request.threads, options, settings) {
        Ok(session) => session,
        Err(error) => return Some(Err(format!("no threads to render with: {error}"))),
    };
    session.set_scene(request.scene);
    loop {
        if cancelled.load(Ordering::Relaxed) {
            return None;
        }
        let Some(snapshot) = session.wait(LOOK) else { continue };
        match snapshot.report.state {
            State::Finished(_) => break,
            State::Failed(why) => return Some(Err(why)),
            State::Idle | State::Tracing | State::Paused => {
                tell(snapshot.report.progress.unwrap_or(0.0));
            }
        }
    }
    let (exporter, format) = (exporter.clone(), request.format);
    let written = session.with(move |rendering, report| exporter.write(rendering, report, format));
    Some(written.unwrap_or_else(|| Err("the renderer has no picture".to_string())))
}

/// What pictures of the scene at `path`, or called `name`, are called.
pub fn stem(path: Option<&Path>, name: &str) -> String {
    let path = path.unwrap_or(Path::new(name));
    let stem = path.file_stem().map(|stem| stem.to_string_lossy().into_owned());
    stem.filter(|stem| !stem.is_empty()).unwrap_or("picture".to_string())
}
