//! Thread that writes the recovery file. It never accesses the scene file, which may block.

use crate::dashboard::Message;
use crate::dashboard::run::files::autosave::Autosave;
use crate::dashboard::run::files::{Job, SharedFile};
use crossbeam_channel::{Receiver, RecvTimeoutError, Sender};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;
use zerkalo_scene::{Scene, SceneFile};

pub enum AutosaveJob {
    /// Schedule an autosave of this scene. `None` removes the recovery file.
    Note(Option<Arc<Scene>>),
    /// Write scheduled edits now, then send a message.
    Flush(Sender<()>),
    /// Update an existing recovery file before this scene is saved. The thread then drops the
    /// sender.
    Saving(Arc<Scene>, Sender<()>),
    /// Record that the scene was written to the file at this path.
    Saved(Arc<Scene>, PathBuf),
    /// Remove the recovery file, and keep the edits of the scene at this path or, without a path, of
    /// this name.
    Opened(Option<PathBuf>, String),
    /// Recover the edits of the last [`Message::OrphanedEdits`].
    Recover,
    Discard,
    /// Write scheduled edits, and end the thread.
    End,
}

/// State of the thread that writes the recovery file.
pub struct AutosaveWorker {
    pub autosave: Autosave,
    /// Path of the scene file as it was opened.
    pub path: Option<PathBuf>,
    pub shared: SharedFile,
    /// Sender of jobs to the thread that reads and writes the scene file.
    pub jobs: Sender<Job>,
    pub results: Sender<Message>,
}

impl AutosaveWorker {
    /// Executes jobs until [`AutosaveJob::End`], and returns the path of the recovery file.
    ///
    /// # Errors
    /// Fails with a message for the user if the last edits could not be written.
    pub fn run(mut self, inbox: &Receiver<AutosaveJob>) -> Result<Option<PathBuf>, String> {
        let messages = self.with_file(|autosave, file| autosave.search(file));
        messages.into_iter().for_each(|message| self.send(message));
        loop {
            let job = match self.autosave.due() {
                Some(due) => inbox.recv_deadline(due),
                None => inbox.recv().map_err(|_| RecvTimeoutError::Disconnected),
            };
            match job {
                Ok(AutosaveJob::End) | Err(RecvTimeoutError::Disconnected) => {
                    self.write();
                    return self.autosave.kept();
                }
                Ok(job) => self.work(job),
                Err(RecvTimeoutError::Timeout) => {}
            }
            if self.autosave.due().is_some_and(|due| due <= Instant::now()) {
                self.write_and_warn();
            }
        }
    }

    fn work(&mut self, job: AutosaveJob) {
        match job {
            AutosaveJob::Note(scene) => self.autosave.note(scene, Instant::now()),
            AutosaveJob::Flush(done) => {
                self.write_and_warn();
                // The receiver may have timed out.
                let _ = done.try_send(());
            }
            AutosaveJob::Saving(scene, _done) => {
                if let Some(file) = self.shared.get() {
                    self.autosave.saving(&file, &scene);
                }
            }
            AutosaveJob::Saved(scene, path) => {
                self.autosave.saved(&scene, &path, Instant::now());
                self.write_and_warn();
            }
            AutosaveJob::Opened(path, name) => {
                self.autosave.reopen(path.as_deref(), &name);
                self.path = path;
                let messages = self.with_file(|autosave, file| autosave.search(file));
                messages.into_iter().for_each(|message| self.send(message));
            }
            AutosaveJob::Recover => {
                let is_unreadable = self.shared.get().is_none();
                let unreadable_path = self.path.as_deref().filter(|_| is_unreadable);
                if let Some(file) = self.autosave.recover(unreadable_path) {
                    self.shared.put(&file);
                    let _ = self.jobs.send(Job::Adopt(Box::new(file)));
                }
            }
            AutosaveJob::Discard => {
                self.autosave.discard();
                let next = self.with_file(|autosave, file| autosave.offer(file));
                next.into_iter().for_each(|message| self.send(message));
            }
            AutosaveJob::End => {}
        }
    }

    /// Calls `call` with the scene file, or with its path (empty without a file) if it has never
    /// been readable.
    fn with_file<R>(
        &mut self,
        call: impl FnOnce(&mut Autosave, Result<&SceneFile, &Path>) -> R,
    ) -> R {
        let file = self.shared.get();
        let path = self.path.as_deref().unwrap_or(Path::new(""));
        call(&mut self.autosave, file.as_deref().ok_or(path))
    }

    fn write(&mut self) -> Option<Message> {
        self.shared.get().and_then(|file| self.autosave.write(&file))
    }

    fn write_and_warn(&mut self) {
        let warning = self.write();
        warning.into_iter().for_each(|message| self.send(message));
    }

    fn send(&self, message: Message) {
        // Sending fails only at the end of the program, when the receiver is gone.
        let _ = self.results.send(message);
    }
}
