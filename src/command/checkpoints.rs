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

/// Writer of checkpoints. A thread of its own writes the files; rendering pauses only while a
/// checkpoint is encoded.
pub struct CheckpointWriter {
    path: PathBuf,
    interval: Duration,
    provenance: Provenance,
    due: Instant,
    /// `true` while a checkpoint is being encoded or written.
    busy: bool,
    encoded: Sender<Option<EncodedCheckpoint>>,
    results: Receiver<Result<(), WriteError>>,
    thread: JoinHandle<()>,
}

impl CheckpointWriter {
    /// Starts the thread that writes checkpoints to `path`. The first one is due after `interval`.
    pub fn new(path: &Path, interval: Duration, provenance: Provenance) -> Self {
        let (encoded, inbox) = channel::<Option<EncodedCheckpoint>>();
        let (outbox, results) = channel();
        let target = path.to_path_buf();
        let thread = std::thread::spawn(move || {
            for checkpoint in inbox {
                let written = checkpoint.map_or(Ok(()), |it| it.write(&target, Existing::Replace));
                // Sending fails only if the channel is closed. The render has then ended with an
                // error and does not need the result.
                let _ = outbox.send(written);
            }
        });
        let due = Instant::now() + interval;
        let path = path.to_path_buf();
        Self { path, interval, provenance, due, busy: false, encoded, results, thread }
    }

    /// Checks that a render may write checkpoints to `path`. `resume` is the checkpoint that the
    /// render continues, if there is one.
    ///
    /// # Errors
    /// Fails if `path` cannot be written, or if it is an existing file other than `resume`.
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

    /// Requests a checkpoint if the interval since the last one has passed. The call does not
    /// block.
    pub fn poll(&mut self, session: &Session) {
        if let Ok(written) = self.results.try_recv() {
            self.busy = false;
            self.due = Instant::now() + self.interval;
            // An error is only a warning, because the next checkpoint may succeed, for example
            // after space on the disk was freed.
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
            // `send` fails only if the receiving thread has panicked, because this thread runs
            // until all senders are dropped.
            let _ = encoded.send(checkpoint);
        });
    }

    /// Writes the last checkpoint, waits until it is complete, and returns the path of its file.
    pub fn finish(self, session: &Session) -> Result<PathBuf, WriteError> {
        self.request(session);
        // Waits until the render thread of `session` has run the checkpoint task and has dropped it
        // with its sender. Otherwise the thread that writes checkpoints would not end, because it
        // runs until all senders are dropped.
        session.with(|_, _| ());
        let Self { path, encoded, results, thread, .. } = self;
        drop(encoded);
        if let Err(panic) = thread.join() {
            std::panic::resume_unwind(panic);
        }
        results.into_iter().last().unwrap_or(Ok(())).map(|()| path)
    }
}
