//! Checkpoints of `zerkalo render`: written at intervals, on signals and at the end.

use crate::command::{Failure, warn};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};
use zerkalo_render::EncodedCheckpoint;
use zerkalo_render::export::Provenance;
use zerkalo_render::film::file::is_film_file;
use zerkalo_render::session::Session;
use zerkalo_scene::disk::{Existing, WriteError, check_writable};

/// Writer of checkpoints in a thread of its own. Rendering pauses only while a checkpoint is
/// encoded.
pub struct CheckpointWriter {
    path: PathBuf,
    interval: Duration,
    provenance: Provenance,
    due: Instant,
    /// `true` while a checkpoint is encoded or written.
    busy: bool,
    encoded: Sender<Option<EncodedCheckpoint>>,
    results: Receiver<Result<(), WriteError>>,
    thread: JoinHandle<()>,
}

impl CheckpointWriter {
    /// Starts the thread. The first checkpoint is due after `interval`.
    pub fn new(path: &Path, interval: Duration, provenance: Provenance) -> Self {
        let (encoded, inbox) = channel::<Option<EncodedCheckpoint>>();
        let (outbox, results) = channel();
        let target = path.to_path_buf();
        let thread = std::thread::spawn(move || {
            for checkpoint in inbox {
                let written = checkpoint.map_or(Ok(()), |it| it.write(&target, Existing::Replace));
                // After an error of the render, the channel is closed.
                let _ = outbox.send(written);
            }
        });
        let due = Instant::now() + interval;
        let path = path.to_path_buf();
        Self { path, interval, provenance, due, busy: false, encoded, results, thread }
    }

    /// Checks that a render may write checkpoints to `path`, or continue the checkpoint `resume`.
    ///
    /// # Errors Fails if `path` cannot be written, or is an existing file other than `resume`.
    pub fn check(path: &Path, resume: Option<&Path>) -> Result<(), Failure> {
        check_writable(path)?;
        if resume == Some(path) || !path.exists() {
            return Ok(());
        }
        let shown = path.display();
        Err(Failure::Failed(if is_film_file(path) {
            format!(
                "cannot write {shown}: there is such a checkpoint already; add --resume {shown} to \
                 continue it, or remove it"
            )
        } else {
            format!("cannot write {shown}: there is another file of this name; name another one")
        }))
    }

    /// Requests a checkpoint if one is due. Does not block.
    pub fn poll(&mut self, session: &Session) {
        if let Ok(written) = self.results.try_recv() {
            self.busy = false;
            self.due = Instant::now() + self.interval;
            // The next checkpoint may succeed.
            written.unwrap_or_else(|error| warn(&format!("warning: {error}")));
        }
        if !self.busy && Instant::now() >= self.due {
            self.busy = true;
            self.request(session);
        }
    }

    fn request(&self, session: &Session) {
        let encoded = self.encoded.clone();
        session.checkpoint(self.provenance.clone(), move |checkpoint| {
            // The thread runs until all senders are dropped, unless it panics.
            let _ = encoded.send(checkpoint);
        });
    }

    /// Writes the last checkpoint and returns its path.
    pub fn finish(self, session: &Session) -> Result<PathBuf, WriteError> {
        self.request(session);
        // The task must have run and dropped its sender, or the writing thread would not end.
        session.with(|_, _| ());
        let Self { path, encoded, results, thread, .. } = self;
        drop(encoded);
        if let Err(panic) = thread.join() {
            std::panic::resume_unwind(panic);
        }
        results.into_iter().last().unwrap_or(Ok(())).map(|()| path)
    }
}
