//! Exports of image files: the current picture, or a separate render at a size of the user's
//! choice.

use crate::dashboard::message::{Exported, Format, Message};
use crate::dashboard::run::export_paths::{numbered, scp};
use crate::dashboard::run::shared_file::SharedFile;
use crate::dashboard::run::worker::Worker;
use crossbeam_channel::Sender;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;
use zerkalo_kernel::sampling::SamplerKind;
use zerkalo_render::export::{Provenance, scene_hash};
use zerkalo_render::film::Film;
use zerkalo_render::image_file::{Depth, ImageOutput};
use zerkalo_render::schedule::Settings;
use zerkalo_render::session::{Report, Session, State};
use zerkalo_render::{EncodedCheckpoint, Options, RenderState};
use zerkalo_scene::Scene;
use zerkalo_scene::disk::Existing;

/// Interval at which the progress of a render for an exported image is polled.
const LOOK: Duration = Duration::from_millis(200);

/// Writer of exported images and checkpoints. It holds the settings that all exports of a scene
/// share.
#[derive(Clone)]
pub struct Exporter {
    /// Scene file as last read or written. The metadata of exported images contain its name and a
    /// hash of the scene.
    pub file: SharedFile,
    /// Path of a scene file that was unreadable at the start; `None` if it was readable.
    pub unreadable_path: Option<PathBuf>,
    /// Kind of random numbers with which the picture is rendered, for the metadata of the image.
    pub sampler: SamplerKind,
    /// `true` if noisy pixels get more samples than others (adaptive sample allocation), for the
    /// metadata of the image.
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
        let path = numbered(&self.stem(), format.extension(), write)?;
        Ok(exported(path, &rendering.film, report))
    }

    /// Returns the provenance of a picture of `scene` for the metadata of the image: scene file,
    /// random numbers and sample allocation.
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
        numbered(&self.stem(), "zk", |path| checkpoint.write(path, Existing::Refuse))
    }

    /// Returns the beginning of the names of exported files: the name of the scene file without its
    /// extension.
    fn stem(&self) -> String {
        match self.file.get() {
            Some(file) => stem(file.path(), file.document().name()),
            None => stem(self.unreadable_path.as_deref(), ""),
        }
    }

    /// Returns two texts: the name of the scene file, and the text that saving `scene` would write
    /// to it.
    fn source(&self, scene: &Scene) -> (String, String) {
        match self.file.get() {
            Some(file) => {
                let mut document = file.document().clone();
                document.apply(scene);
                (document.name().to_string(), document.text().to_string())
            }
            None => (self.stem(), scene.to_text()),
        }
    }
}

/// Export that renders the scene at a size of the user's choice, in a separate thread.
pub struct ResizedExport {
    cancelled: Arc<AtomicBool>,
    worker: Worker,
}

/// Request for an export at a size of the user's choice.
pub struct ExportRequest {
    /// Scene with the requested film size.
    pub scene: Arc<Scene>,
    /// File format of the image.
    pub format: Format,
    /// Options of scene compilation and sampling. They include the exposure and tone curve of the
    /// image.
    pub options: Options,
    /// Settings of sample allocation (the distribution of samples over the picture), and the stop
    /// criteria of the render.
    pub settings: Settings,
    /// Number of threads that trace rays.
    pub threads: usize,
}

impl ResizedExport {
    /// Starts the thread that renders and writes the image. It sends [`Message::ExportProgress`]
    /// and finally [`Message::Exported`] to `results`. A cancelled render sends no result.
    pub fn start(
        request: ExportRequest,
        exporter: Exporter,
        results: Sender<Message>,
    ) -> io::Result<Self> {
        let cancelled = Arc::new(AtomicBool::new(false));
        let cancel_flag = Arc::clone(&cancelled);
        let worker = Worker::spawn("export", move || {
            // Sending fails only at the end of the program, when the receiver is gone.
            let result = render(request, &exporter, &cancel_flag, &|progress| {
                let _ = results.send(Message::ExportProgress(progress));
            });
            if let Some(result) = result {
                let _ = results.send(Message::Exported(result));
            }
        })?;
        Ok(Self { cancelled, worker })
    }

    /// Cancels the render of the export. A file that is already being written is completed.
    pub fn cancel(&self) {
        self.cancelled.store(true, Ordering::Relaxed);
    }

    /// Cancels the render of the export and waits until its thread has ended.
    pub fn end(self) {
        self.cancel();
        self.worker.join_within(Duration::MAX);
    }
}

/// Renders and writes the picture of `request`. Returns `None` if the render is cancelled.
fn render(
    request: ExportRequest,
    exporter: &Exporter,
    cancelled: &AtomicBool,
    report_progress: &dyn Fn(f64),
) -> Option<Result<Exported, String>> {
    let ExportRequest { scene, format, options, settings, threads } = request;
    let mut session: Session = match Session::new(threads, options, settings) {
        Ok(session) => session,
        Err(error) => return Some(Err(error.to_string())),
    };
    session.set_scene(scene);
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
    let exporter = exporter.clone();
    let written = session.with(move |rendering, report| exporter.write(rendering, report, format));
    Some(written.unwrap_or_else(|| Err("the renderer has no picture".to_string())))
}

/// Returns the description of an exported image, for the user. `path` is the path of the image
/// file, `film` the film with the exported picture, and `report` the renderer's report on this
/// film.
pub fn exported(path: PathBuf, film: &Film, report: &Report) -> Exported {
    Exported {
        scp: scp(&path),
        path,
        size: [film.width(), film.height()],
        spp: report.spp.mean,
        noise_levels: report.noise.map(|noise| noise.rmse_levels),
    }
}

/// Returns the beginning of the names of exported files, such as `room` in `room-2.png`. It is the
/// name of the scene file at `path` without its extension. If `path` is `None`, `name` takes the
/// place of the scene file's name.
pub fn stem(path: Option<&Path>, name: &str) -> String {
    let path = path.unwrap_or(Path::new(name));
    let stem = path.file_stem().map(|stem| stem.to_string_lossy().into_owned());
    stem.filter(|stem| !stem.is_empty()).unwrap_or("picture".to_string())
}
