//! Execution of effects in `zerkalo watch`. The picture can be displayed and exported, but there is
//! no scene to edit or render.

use crate::dashboard::message::{Effect, Format, Message};
use crate::dashboard::run::effects::{Effects, Outcome, run_on_terminal};
use crate::dashboard::run::exporter::Exporter;
use crate::dashboard::run::frames::FramePipeline;
use crossbeam_channel::{Receiver, Sender, bounded};
use std::io;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Instant;
use zerkalo_kernel::sampling::SamplerKind;
use zerkalo_render::film::LinearImage;
use zerkalo_render::plan::WatchedFilms;
use zerkalo_render::session::{Session, Snapshot};

/// Executor of effects in `zerkalo watch`, which shows film files of other processes.
pub struct WatchRunner {
    session: Session,
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
        let session = Session::watch(films, threads, move |report| {
            // Sending fails only at the end of the program, when the receiver is gone.
            let _ = reports.send(Message::Watched(Box::new(report)));
        })?;
        Ok(Self { session, exported: None, results })
    }

    fn export(&mut self, format: Format) {
        let results = self.results.clone();
        let (exporting, exported) = bounded(0);
        self.exported = Some(exported);
        let exporter = Exporter {
            file: None,
            unreadable_path: None,
            sampler: SamplerKind::Sobol,
            adaptive: true,
        };
        self.session.submit(move |picture| {
            let _exporting = exporting;
            let written = match picture {
                Some(picture) => exporter.write(&picture, format),
                None => Err("there is no picture to write".to_string()),
            };
            let _ = results.send(Message::Exported(written));
        });
    }
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
                    if let Some(picture) = picture {
                        let pinned = Arc::new(LinearImage::of_film(picture.film, picture.mix));
                        let _ = results.send(Message::Pinned(pinned, picture.report.spp.mean));
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
