//! Checkpoints of `zerkalo render`: written at intervals, on signals and at the end.

use crate::command::{Failure, save, warn};
use std::path::Path;
use std::sync::mpsc::{Receiver, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};
use zerkalo_render::export::Provenance;
use zerkalo_render::film::file::is_film_file;
use zerkalo_render::session::Session;
use zerkalo_scene::disk::{Claim, Existing, WriteError, check_writable};

/// Writer of checkpoints at intervals. Rendering pauses only while a checkpoint is encoded.
pub struct CheckpointWriter {
    claim: Arc<Mutex<Claim>>,
    interval: Duration,
    provenance: Provenance,
    due: Instant,
    /// Channel for the result of the checkpoint in progress. `None` if none is in progress.
    written: Option<Receiver<Result<(), WriteError>>>,
}

impl CheckpointWriter {
    /// Creates a writer to the file of `claim`. The first checkpoint is due after `interval`.
    pub fn new(claim: Claim, interval: Duration, provenance: Provenance) -> Self {
        let due = Instant::now() + interval;
        let claim = Arc::new(Mutex::new(claim));
        Self { claim, interval, provenance, due, written: None }
    }

    /// Checks that a render may write checkpoints to `path`, or continue the checkpoint `resume`.
    ///
    /// # Errors
    /// Fails if `path` cannot be written, or is an existing file other than `resume`.
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

    /// Requests a checkpoint if one is due, and warns if the last one failed. Does not block.
    pub fn poll(&mut self, session: &Session) {
        if let Some(Ok(written)) = self.written.as_ref().map(Receiver::try_recv) {
            self.written = None;
            self.due = Instant::now() + self.interval;
            // The next checkpoint may succeed.
            written.unwrap_or_else(|error| warn(&format!("warning: {error}")));
        }
        if self.written.is_none() && Instant::now() >= self.due {
            self.written = Some(self.request(session));
        }
    }

    /// Requests a checkpoint, written by a thread of its own. Returns the channel for its result.
    fn request(&self, session: &Session) -> Receiver<Result<(), WriteError>> {
        let (sender, written) = channel();
        let claim = Arc::clone(&self.claim);
        let provenance = self.provenance.clone();
        session.submit(move |picture| {
            let checkpoint = picture.and_then(|picture| picture.checkpoint(&provenance));
            std::thread::spawn(move || {
                let mut claim = claim.lock().unwrap_or_else(PoisonError::into_inner);
                let written = checkpoint.map_or(Ok(()), |checkpoint| {
                    claim.check()?;
                    let file = checkpoint.write(claim.path(), Existing::Replace)?;
                    claim.keep(file);
                    Ok(())
                });
                // The receiver has been dropped if the render has failed.
                let _ = sender.send(written);
            });
        });
        written
    }

    /// Writes the last checkpoint, again and again if that fails.
    pub fn finish(self, session: &Session) -> Result<(), WriteError> {
        // An earlier checkpoint must not replace the last one.
        self.written.as_ref().map(Receiver::recv);
        save::persist(|| self.request(session).recv().unwrap_or(Ok(())))
    }
}
