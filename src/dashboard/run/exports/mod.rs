//! Exports of image files: the current picture, or a render at a size of the user's choice.

pub mod image_upload;
pub mod image_viewer;
pub mod paths;

use crate::dashboard::run::files::SharedFile;
use crate::dashboard::run::worker::Worker;
use crate::dashboard::{Exported, Format, Message};
use crossbeam_channel::{Sender, bounded};
use paths::{numbered, scp};
use std::io;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;
use zerkalo_kernel::sampling::SamplerKind;
use zerkalo_render::export::{Provenance, scene_hash};
use zerkalo_render::film::file::EncodedFilm;
use zerkalo_render::image_file::{Depth, ImageOutput};
use zerkalo_render::session::{Picture, Session, State};
use zerkalo_scene::Scene;
use zerkalo_scene::disk::Existing;

/// Interval at which the progress of a render is polled.
const LOOK: Duration = Duration::from_millis(200);

/// Writer of exported images and checkpoints.
#[derive(Clone)]
pub struct Exporter {
    /// Scene file as last read or written; `None` for watched films, whose metadata name their
    /// scene file.
    pub file: Option<SharedFile>,
    /// Kind of random numbers, for the metadata.
    pub sampler: SamplerKind,
    /// `true` if sample allocation is adaptive, for the metadata.
    pub adaptive: bool,
}

impl Exporter {
    /// Creates the writer of pictures of watched films.
    pub fn of_films() -> Self {
        Self { file: None, sampler: SamplerKind::Sobol, adaptive: true }
    }

    /// Writes `picture` to a file with the next free name.
    pub fn write(&self, picture: &Picture, format: Format) -> Result<Exported, String> {
        let header = picture.header(|scene| self.provenance(scene));
        let write = |path: &Path| {
            let output = ImageOutput::from_path(path)?.create_new();
            output.write(&header, Depth::Eight, &mut &*picture.film)
        };
        let stem = self.stem(header.source().unwrap_or_default());
        let path = numbered(&stem, format.extension(), write)?;
        let size @ [width, height] = [picture.film.width(), picture.film.height()];
        let (spp, noise) = (picture.report.spp.mean, picture.report.noise);
        let noise = noise.map_or("unknown".to_string(), |n| format!("{:.2} levels", n.rmse_levels));
        Ok(Exported {
            description: format!("{width}x{height}  {spp:.0} spp  noise {noise}"),
            advice: format!("o shows it, y copies the path  ·  scp {} .", scp(&path)),
            path,
            size: Some(size),
        })
    }

    /// Returns the metadata on the origin of a picture of `scene`.
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
    pub fn write_checkpoint(&self, checkpoint: Option<EncodedFilm>) -> Result<Exported, String> {
        let checkpoint = checkpoint.ok_or("there are no samples to write")?;
        let write = |path: &Path| checkpoint.write(path, Existing::Refuse);
        let path = numbered(&self.stem(""), "zk", write)?;
        let advice = format!("`zerkalo {}` continues it", path.display());
        Ok(Exported { path, description: "checkpoint".to_string(), advice, size: None })
    }

    /// Returns the beginning of file names, from the scene file of this process, or from the file
    /// name `source` if it has none.
    fn stem(&self, source: &str) -> String {
        match self.file.as_ref().and_then(SharedFile::get) {
            Some(file) => stem(file.path(), &file.document.name),
            None => stem(None, source),
        }
    }

    /// Returns the name of the scene file, and the text that saving `scene` would write to it.
    fn source(&self, scene: &Scene) -> (String, String) {
        match self.file.as_ref().and_then(SharedFile::get) {
            Some(file) => {
                let mut document = file.document.clone();
                document.apply(scene);
                (document.name.clone(), document.text().to_string())
            }
            None => (self.stem(""), scene.to_text()),
        }
    }
}

/// Export that renders the scene at a size of the user's choice, in a separate thread.
pub struct ResizedExport {
    cancelled: Arc<AtomicBool>,
    worker: Worker,
}

impl ResizedExport {
    /// Starts the thread that waits for the render of `session` and writes the image. It sends
    /// [`Message::ExportProgress`] and finally [`Message::Exported`], unless it is cancelled.
    pub fn start(
        session: Session,
        format: Format,
        exporter: Exporter,
        results: Sender<Message>,
    ) -> io::Result<Self> {
        let cancelled = Arc::new(AtomicBool::new(false));
        let cancel_flag = Arc::clone(&cancelled);
        let worker = Worker::spawn("export", move || {
            // Sending fails only at the end of the program, when the receiver is gone.
            let result = finish(session, format, exporter, &cancel_flag, |progress| {
                let _ = results.send(Message::ExportProgress(progress));
            });
            if let Some(result) = result {
                let _ = results.send(Message::Exported(result));
            }
        })?;
        Ok(Self { cancelled, worker })
    }

    /// Cancels the render. A file that is being written is completed.
    pub fn cancel(&self) {
        self.cancelled.store(true, Ordering::Relaxed);
    }

    /// Cancels the render and waits for the end of its thread.
    pub fn end(self) {
        self.cancel();
        self.worker.join_within(Duration::MAX);
    }
}

/// Waits for the end of the render and writes the picture. Returns `None` if the render is
/// cancelled.
fn finish(
    session: Session,
    format: Format,
    exporter: Exporter,
    cancelled: &AtomicBool,
    report_progress: impl Fn(f64),
) -> Option<Result<Exported, String>> {
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
    let (sender, receiver) = bounded(1);
    session.submit(move |picture| {
        let written = picture.map(|picture| exporter.write(&picture, format));
        let _ = sender.send(written.unwrap_or(Err("the renderer has no picture".to_string())));
    });
    receiver.recv().ok()
}

/// Returns the beginning of file names, such as `room` in `room-2.png`: the name of the scene file
/// without its extension, or `name` without a path.
fn stem(path: Option<&Path>, name: &str) -> String {
    let path = path.unwrap_or(Path::new(name));
    let stem = path.file_stem().map(|stem| stem.to_string_lossy().into_owned());
    stem.filter(|stem| !stem.is_empty()).unwrap_or("picture".to_string())
}
