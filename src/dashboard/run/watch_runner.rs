//! Execution of effects in `zerkalo watch`. The picture can be displayed and exported, but there is
//! no scene to edit or render.

use crate::dashboard::message::{Effect, Exported, Format, Message};
use crate::dashboard::run::effects::{Effects, Outcome, run_on_terminal};
use crate::dashboard::run::export_paths;
use crate::dashboard::run::exporter::{exported, stem};
use crate::dashboard::run::frames::FramePipeline;
use crate::film::file::FilmFileHeader;
use crate::film::{Depth, Film, ImageOutput, LinearImage};
use crate::render::plan::WatchedFilms;
use crate::render::session::{Report, Snapshot, WatchSession};
use crate::terminal::Capabilities;
use crossbeam_channel::{Receiver, Sender, unbounded};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Longest time that the program waits, when it starts, for the first report on the watched files.
const FIRST_REPORT_WITHIN: Duration = Duration::from_secs(2);

/// Executor of effects in `zerkalo watch`, which shows film files of other processes.
pub struct WatchRunner {
    session: WatchSession,
    /// Number of exported images that have not been written yet.
    exporting: usize,
    results: Sender<Message>,
    done: Receiver<Message>,
}

impl WatchRunner {
    /// Starts the thread that reads the watched film files.
    pub fn new(films: WatchedFilms, threads: usize) -> io::Result<Self> {
        let (results, done) = unbounded();
        let reports = results.clone();
        let session = WatchSession::new(films, threads, move |report| {
            // Sending fails only at the end of the program, when the receiver is gone.
            let _ = reports.send(Message::Watched(Box::new(report)));
        })?;
        // This waits for the first report, so that the first frame shows the table of films.
        if let Ok(report) = done.recv_timeout(FIRST_REPORT_WITHIN) {
            let _ = results.send(report);
        }
        Ok(Self { session, exporting: 0, results, done })
    }

    fn export(&mut self, format: Format) {
        self.exporting += 1;
        let results = self.results.clone();
        self.session.submit(move |picture| {
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
        header.write_picture(film, Depth::Eight, &output)
    };
    let path = export_paths::numbered(Path::new(""), &stem, format.extension(), create)?;
    Ok(exported(path, film, report))
}

impl Effects for WatchRunner {
    fn wakeup(&self) -> &Receiver<()> {
        self.session.wakeup()
    }

    fn take_snapshot(&self) -> Option<Snapshot> {
        self.session.take()
    }

    fn rest(&self, _: bool) {}

    fn done(&self) -> &Receiver<Message> {
        &self.done
    }

    fn observe(&mut self, message: &Message) {
        if let Message::Exported(_) = message {
            self.exporting = self.exporting.saturating_sub(1);
        }
    }

    fn run(
        &mut self,
        effect: Effect,
        frames: &mut FramePipeline,
        terminal: &Capabilities,
    ) -> Outcome {
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
            effect => return run_on_terminal(effect, frames, terminal, &self.results),
        }
        Outcome::Done
    }

    fn flush(&self, _: Duration) {}

    fn finish(
        mut self: Box<Self>,
        deadline: Option<Instant>,
    ) -> (Vec<Message>, Result<Option<PathBuf>, String>) {
        let mut finished = Vec::new();
        // Other messages may arrive before those of the exports. `done` is never disconnected,
        // because this runner holds a sender; a panic of the watch session is therefore detected by
        // `has_ended`.
        while self.exporting > 0
            && deadline.is_none_or(|deadline| Instant::now() < deadline)
            && !self.session.has_ended()
        {
            if let Ok(message) = self.done.recv_timeout(Duration::from_millis(50)) {
                self.observe(&message);
                finished.push(message);
            }
        }
        (finished, Ok(None))
    }
}
