//! Exports to image files: the current picture, or a separate render at another size.

use crate::dashboard::message::{Exported, Format, Message};
use crate::dashboard::run::paths;
use crate::dashboard::run::shared_file::SharedFile;
use crate::film::{Depth, Display, ImageOutput};
use crate::render::export::{Provenance, scene_hash};
use crate::render::schedule::{Settings, Stop};
use crate::render::session::{Report, Session, State};
use crate::render::{EncodedCheckpoint, Options, RenderState};
use crate::sampling::SamplerKind;
use crate::scene::{Document, Scene};
use crossbeam_channel::Sender;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, JoinHandle};
use std::time::Duration;

/// Polling interval of a render at another size.
const LOOK: Duration = Duration::from_millis(200);

/// Writer of exports, with the properties that are common to all exports of a scene.
#[derive(Clone)]
pub struct Exporter {
    /// Text of the scene file, for the metadata.
    pub file: SharedFile,
    /// Folder that exports are written to.
    pub folder: PathBuf,
    /// Beginning of the file names, before the counter.
    pub stem: String,
    /// Sampler, for the metadata.
    pub sampler: SamplerKind,
    /// `true` if sample allocation is adaptive, for the metadata.
    pub adaptive: bool,
}

impl Exporter {
    /// Writes the picture of `rendering` to a file with the next free name.
    pub fn write(
        &self,
        rendering: &RenderState,
        report: &Report,
        format: Format,
    ) -> Result<Exported, String> {
        let provenance = self.provenance(rendering.scene());
        let display = rendering.display();
        let write = |path: &Path| {
            let target = ImageOutput::from_path(path)?.create_new();
            rendering.write(report, &provenance, display, Depth::Eight, &target)
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

    /// Returns the provenance of pictures of `scene`.
    pub fn provenance(&self, scene: &Scene) -> Provenance {
        let (source, text) = self.source(scene);
        Provenance {
            source,
            scene_hash: scene_hash(&text, scene),
            sampler: self.sampler,
            adaptive: self.adaptive,
        }
    }

    /// Writes a checkpoint to a file with the next free name.
    pub fn write_checkpoint(
        &self,
        checkpoint: Option<EncodedCheckpoint>,
    ) -> Result<PathBuf, String> {
        let checkpoint = checkpoint.ok_or("there are no samples to write")?;
        paths::numbered(&self.folder, &self.stem, "zk", |path| checkpoint.create(path))
            .ok_or_else(|| format!("all names for checkpoints of {} are in use", self.stem))?
            .map_err(|error| error.to_string())
    }

    /// Returns the name of the scene file, and the text that it would have if `scene` were saved.
    fn source(&self, scene: &Scene) -> (String, String) {
        match self.file.get() {
            Some(file) => {
                let mut document = file.document().clone();
                document.apply(scene);
                (document.name().to_string(), document.text().to_string())
            }
            None => (self.stem.clone(), Document::new(scene, &self.stem).text().to_string()),
        }
    }
}

/// A render at another size that runs in a separate thread.
pub struct ResizedExport {
    cancelled: Arc<AtomicBool>,
    thread: JoinHandle<()>,
}

/// Request for a render at another size.
pub struct ExportRequest {
    /// Scene with the requested film size.
    pub scene: Arc<Scene>,
    /// File format.
    pub format: Format,
    /// Exposure and tone curve.
    pub display: Display,
    /// Stop criteria.
    pub stop: Stop,
    /// Options of scene compilation and sampling.
    pub options: Options,
    /// Sample allocation.
    pub settings: Settings,
    /// Tracing threads.
    pub threads: usize,
}

impl ResizedExport {
    /// Starts the thread. It sends [`Message::ExportProgress`] and finally [`Message::Exported`] to
    /// `results`. A cancelled render sends no result.
    pub fn start(
        request: ExportRequest,
        exporter: Exporter,
        results: Sender<Message>,
    ) -> io::Result<Self> {
        let cancelled = Arc::new(AtomicBool::new(false));
        let cancel_flag = Arc::clone(&cancelled);
        let thread = thread::Builder::new().name("export".into()).spawn(move || {
            // Sending fails only at the end of the program, when the receiver is gone.
            let result = render(request, &exporter, &cancel_flag, &|progress| {
                let _ = results.send(Message::ExportProgress(progress));
            });
            if let Some(result) = result {
                let _ = results.send(Message::Exported(result));
            }
        })?;
        Ok(Self { cancelled, thread })
    }

    /// Cancels the render. A file that is already being written is completed.
    pub fn cancel(&self) {
        self.cancelled.store(true, Ordering::Relaxed);
    }

    /// Cancels the render and waits until the thread has ended.
    pub fn end(self) {
        self.cancel();
        if let Err(panic) = self.thread.join() {
            std::panic::resume_unwind(panic);
        }
    }
}

/// Renders and writes the picture of `request`. Returns `None` if the render is cancelled.
fn render(
    request: ExportRequest,
    exporter: &Exporter,
    cancelled: &AtomicBool,
    report_progress: &dyn Fn(f64),
) -> Option<Result<Exported, String>> {
    let options = Options { display: request.display, ..request.options };
    let settings = Settings { stop: request.stop, ..request.settings };
    let mut session: Session = match Session::new(request.threads, options, settings) {
        Ok(session) => session,
        Err(error) => return Some(Err(format!("cannot start rendering threads: {error}"))),
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
                report_progress(snapshot.report.progress.unwrap_or(0.0));
            }
        }
    }
    let (exporter, format) = (exporter.clone(), request.format);
    let written = session.with(move |rendering, report| exporter.write(rendering, report, format));
    Some(written.unwrap_or_else(|| Err("the renderer has no picture".to_string())))
}

/// Returns the beginning of the exports' file names, before the counter: the stem of the scene's
/// file name in `path`, or that of `name` for a scene without a file.
pub fn stem(path: Option<&Path>, name: &str) -> String {
    let path = path.unwrap_or(Path::new(name));
    let stem = path.file_stem().map(|stem| stem.to_string_lossy().into_owned());
    stem.filter(|stem| !stem.is_empty()).unwrap_or("picture".to_string())
}
