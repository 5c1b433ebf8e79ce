//! Exports: the current picture, a checkpoint, or a render at a size of the user's choice.

pub mod image_upload;
pub mod image_viewer;
pub mod paths;

use crate::dashboard::run::files::SharedFile;
use crate::dashboard::{Exported, Format, Message};
use crossbeam_channel::{Receiver, Sender, bounded};
use paths::{numbered, scp};
use std::io;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;
use zerkalo_kernel::sampling::SamplerKind;
use zerkalo_render::export::{Provenance, scene_hash};
use zerkalo_render::image_file::{Depth, ImageOutput};
use zerkalo_render::schedule::Interval;
use zerkalo_render::session::{Picture, Session, State};
use zerkalo_scene::Scene;
use zerkalo_scene::disk::Existing;

/// Interval at which the progress of a render is polled.
const POLL_INTERVAL: Duration = Duration::from_millis(200);

/// Writer of exported images and checkpoints.
#[derive(Clone)]
pub struct Exporter {
    /// Scene file as last read or written; `None` for watched films, whose metadata name their
    /// scene file.
    pub file: Option<SharedFile>,
    /// Kind of random numbers that the metadata name.
    pub sampler: SamplerKind,
    /// Size of the film in the scene file if the pictures have another.
    pub film_size: Option<[u32; 2]>,
}

impl Exporter {
    /// Writes `picture` to a file with the next free name.
    pub fn write(&self, picture: Option<Picture>, format: Format) -> Result<Exported, String> {
        let picture = picture.ok_or("there is no picture to write")?;
        let header = picture.header(|scene| self.provenance(scene));
        let write = |path: &Path| {
            let mut output = ImageOutput::from_path(path)?;
            output.existing = Existing::Refuse;
            if format == Format::PlainExr {
                output = output.without_layers();
            }
            output.write(&header, Depth::Eight, &mut &*picture.film)
        };
        let stem = self.stem(header.source().unwrap_or_default());
        let path = numbered(&stem, format.extension(), write)?;
        let [width, height] = [picture.film.header.width, picture.film.header.height];
        let (spp, noise) = (picture.report.spp.mean, picture.report.noise);
        let noise = noise.map_or("unknown".to_string(), |n| format!("{:.2} levels", n.rmse.levels));
        Ok(Exported {
            description: format!("{width}x{height}  {spp:.0} spp  noise {noise}"),
            advice: format!("scp {} .", scp(&path)),
            path,
            is_image: true,
        })
    }

    /// Returns the metadata on the origin of a picture of `scene`.
    pub fn provenance(&self, scene: &Scene) -> Provenance {
        let mut scene = scene.clone();
        scene.film.size = self.film_size.unwrap_or(scene.film.size);
        let scene = &scene;
        let (source, text) = match self.file.as_ref().and_then(SharedFile::get) {
            // The text that saving the scene would write to its file.
            Some(file) => (file.document.name.clone(), file.text_of(scene)),
            None => (self.stem(""), scene.to_text()),
        };
        let scene_hash = scene_hash(&text, scene);
        Provenance { source, scene_hash, sampler: self.sampler, adaptive: true }
    }

    /// Writes a checkpoint to a file with the next free name.
    pub fn write_checkpoint(
        &self,
        picture: Option<Picture>,
        provenance: &Provenance,
    ) -> Result<Exported, String> {
        if picture.as_ref().is_some_and(|picture| picture.report.mixed) {
            return Err("a mix of roughnesses cannot be continued; R renders it afresh".to_string());
        }
        let checkpoint = picture.and_then(|picture| picture.checkpoint(provenance));
        let checkpoint = checkpoint.ok_or("there are no samples to write")?;
        let write = |path: &Path| checkpoint.write(path, Existing::Refuse);
        let path = numbered(&self.stem(""), "zk", write)?;
        let advice = format!("`zerkalo {}` continues it", path.display());
        Ok(Exported { path, description: "checkpoint".to_string(), advice, is_image: false })
    }

    /// Returns the beginning of file names, such as `room` in `room-2.png`: the name of the scene
    /// file without its extension. For watched films, `source` is the path of their scene file.
    fn stem(&self, source: &str) -> String {
        let file = self.file.as_ref().and_then(SharedFile::get);
        let path = match &file {
            Some(file) => file.path().unwrap_or(Path::new(&file.document.name)),
            None => Path::new(source),
        };
        let stem = path.file_stem().map(|stem| stem.to_string_lossy().into_owned());
        stem.unwrap_or("picture".to_string())
    }
}

/// Export that renders the scene at a size of the user's choice, in a separate thread.
pub struct ResizedExport {
    /// `true` if the picture is to be written as it is.
    finished: Arc<AtomicBool>,
    cancelled: Arc<AtomicBool>,
    /// `true` from the beginning of the write.
    is_writing: Arc<AtomicBool>,
    /// Receiver that is disconnected at the end of the thread.
    ended: Receiver<()>,
}

impl ResizedExport {
    /// Starts the thread that waits for the render of `session` and writes the image. It sends
    /// [`Message::ExportProgress`] until it is cancelled, and [`Message::Exported`] unless it is
    /// cancelled before the write.
    pub fn start(
        session: Session,
        format: Format,
        exporter: Exporter,
        results: Sender<Message>,
    ) -> io::Result<Self> {
        let [finished, cancelled, is_writing] = [(); 3].map(|()| Arc::<AtomicBool>::default());
        let flags = [&finished, &cancelled, &is_writing].map(Arc::clone);
        let (running, ended) = bounded(0);
        thread::Builder::new().name("export".into()).spawn(move || {
            let _running: Sender<()> = running;
            let [finish_flag, cancel_flag, write_flag] = &flags;
            let report_progress = |progress| {
                if !cancel_flag.load(Ordering::Relaxed) {
                    // Sending fails only at the end of the program, when the receiver is gone.
                    let _ = results.send(Message::ExportProgress(progress));
                }
            };
            let flags = [&**finish_flag, cancel_flag, write_flag];
            let result = finish(session, format, exporter, flags, report_progress);
            report_progress(None);
            if let Some(result) = result {
                let _ = results.send(Message::Exported(result));
            }
        })?;
        Ok(Self { finished, cancelled, is_writing, ended })
    }

    /// Ends the render and writes the picture as it is.
    pub fn finish(&self) {
        self.finished.store(true, Ordering::Relaxed);
    }

    /// Cancels the render. A file that is being written is completed.
    pub fn cancel(&self) {
        self.cancelled.store(true, Ordering::SeqCst);
    }

    /// Cancels the render. If the picture is being written, returns the receiver that is
    /// disconnected at the end of the write.
    pub fn end(self) -> Option<Receiver<()>> {
        self.cancel();
        self.is_writing.load(Ordering::SeqCst).then_some(self.ended)
    }
}

/// Waits for the end of the render and writes the picture. Returns `None` if the render is
/// cancelled.
fn finish(
    session: Session,
    format: Format,
    exporter: Exporter,
    [finished, cancelled, is_writing]: [&AtomicBool; 3],
    report_progress: impl Fn(Option<(f64, Option<Interval>)>),
) -> Option<Result<Exported, String>> {
    let mut is_complete = false;
    loop {
        if cancelled.load(Ordering::Relaxed) {
            return None;
        }
        if finished.load(Ordering::Relaxed) && is_complete {
            break;
        }
        let Some(snapshot) = session.wait(POLL_INTERVAL) else { continue };
        // Before, some pixels have no samples of both replicates.
        is_complete = snapshot.report.noise.is_some();
        match snapshot.report.state {
            State::Finished(_) => break,
            State::Failed(why) => return Some(Err(why)),
            State::Idle | State::Tracing | State::Paused => {
                let progress = snapshot.report.progress.unwrap_or(0.0);
                report_progress(Some((progress, snapshot.report.eta_seconds)));
            }
        }
    }
    is_writing.store(true, Ordering::SeqCst);
    if cancelled.load(Ordering::SeqCst) {
        return None;
    }
    let (sender, receiver) = bounded(1);
    session.submit(move |picture| {
        let _ = sender.send(exporter.write(picture, format));
    });
    receiver.recv().ok()
}
