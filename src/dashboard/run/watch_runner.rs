//! Execution of effects in `zerkalo watch`. The picture can be displayed and exported, but there is
//! no scene to edit or render.

use crate::dashboard::message::{Effect, Exported, Format, Message};
use crate::dashboard::run::effects::{Effects, Outcome, run_on_terminal};
use crate::dashboard::run::export_paths::numbered;
use crate::dashboard::run::exporter::{exported, stem};
use crate::dashboard::run::frames::FramePipeline;
use crossbeam_channel::{Receiver, Sender, bounded};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;
use zerkalo_render::film::file::FilmFileHeader;
use zerkalo_render::film::{Film, LinearImage};
use zerkalo_render::image_file::{Depth, ImageOutput};
use zerkalo_render::plan::WatchedFilms;
use zerkalo_render::session::{Report, Snapshot, WatchSession};

/// Executor of effects in `zerkalo watch`, which shows film files of other processes.
pub struct WatchRunner {
    session: WatchSession,
    /// Receiver that is disconnected as soon as the last requested export has ended; `None` before
    /// the first export.
    exported: Option<Receiver<()>>,
    results: Sender<Message>,
}

impl WatchRunner {
    /// Starts the thread that reads the watched film files. Its reports are sent to `results`, as
    /// are the results of effects.
    pub fn new(films: WatchedFilms, threads: usize, results: Sender<Message>) -> io::Result<Self> {
        let reports = results.clone();
        let session = WatchSession::new(films, threads, move |report| {
            // Sending fails only at the end of the program, when the receiver is gone.
            let _ = reports.send(Message::Watched(Box::new(report)));
        })?;
        Ok(Self { session, exported: None, results })
    }

    fn export(&mut self, format: Format) {
        let results = self.results.clone();
        let (exporting, exported) = bounded(0);
        self.exported = Some(exported);
        self.session.submit(move |picture| {
            let _exporting = exporting;
            let written = match picture {
                Some((film, header, report)) => write(film, header, report, format),
                None => Err("there is no picture to write".to_string()),
            };
            let _ = results.send(Message::Exported(written));
        });
    }
}

/// Writes the picture of `film` to an image file with an unused name. The name begins with that of
/// the scene file.
fn write(
    film: &Film,
    header: &FilmFileHeader,
    report: &Report,
    format: Format,
) -> Result<Exported, String> {
    let stem = stem(None, header.source().unwrap_or_default());
    let create = |path: &Path| {
        let output = ImageOutput::from_path(path)?.create_new();
        output.write_film(header, film, Depth::Eight)
    };
    let path = numbered(&stem, format.extension(), create)?;
    Ok(exported(path, film, report))
}

impl Effects for WatchRunner {
    fn wakeup(&self) -> &Receiver<()> {
        self.session.wakeup()
    }

    fn take_snapshot(&self) -> Option<Snapshot> {
        self.session.take()
    }

    fn run(&mut self, effect: Effect, frames: &mut FramePipeline) -> Outcome {
        match effect {
            Effect::View(view) => self.session.set_view(view),
            Effect::Display(display) => self.session.set_display(display),
            Effect::Pin => {
                let results = self.results.clone();
                self.session.submit(move |picture| {
                    if let Some((film, header, report)) = picture {
                        let picture = LinearImage::of_film(film, &header.weights);
                        let _ = results.send(Message::Pinned(Arc::new(picture), report.spp.mean));
                    }
                });
            }
            Effect::Export(format) => self.export(format),
            effect => return run_on_terminal(effect, frames, &self.results),
        }
        Outcome::Done
    }

    fn finish(self: Box<Self>, deadline: Option<Instant>) -> Result<Option<PathBuf>, String> {
        // The session runs exports in the order of their requests. If its thread panics, it drops
        // the sender as at the end of an export.
        match (self.exported, deadline) {
            (Some(exported), Some(deadline)) => drop(exported.recv_deadline(deadline)),
            (Some(exported), None) => drop(exported.recv()),
            (None, _) => {}
        }
        Ok(None)
    }
}
