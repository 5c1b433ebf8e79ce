//! Thread that reads and writes the scene file and watches it for changes by other programs. The
//! thread keeps a slow disk from blocking the dashboard.

use crate::dashboard::message::Message;
use crate::dashboard::run::autosave::Autosave;
use crate::scene::{DiskState, Document, SaveError, Scene, SceneErrors, SceneFile};
use crossbeam_channel::{Receiver, RecvTimeoutError, Sender, bounded, unbounded};
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant, SystemTime};

/// Interval between checks of the scene file for changes by other programs.
const CHECK_INTERVAL: Duration = Duration::from_secs(1);

enum Job {
    Save { scene: Arc<Scene>, path: Option<PathBuf>, overwrite: bool },
    Load,
    Autosave(Option<Arc<Scene>>),
    Flush(Sender<()>),
    Recover,
    Discard,
}

/// Shared handle of the scene document (the text of the scene file) as last read or written. It is
/// empty if the file has never been readable.
#[derive(Clone, Default)]
pub struct SharedDocument(Arc<Mutex<Option<Arc<Document>>>>);

impl SharedDocument {
    /// Returns the document. Returns `None` if the file has never been readable.
    pub fn get(&self) -> Option<Arc<Document>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    fn put(&self, document: &Document) {
        let document = Some(Arc::new(document.clone()));
        *self.0.lock().unwrap_or_else(PoisonError::into_inner) = document;
    }
}

/// Handle of the thread that reads and writes the scene file.
pub struct Files {
    jobs: Option<Sender<Job>>,
    document: SharedDocument,
    thread: Option<JoinHandle<Option<PathBuf>>>,
}

impl Files {
    /// Starts the thread for `file`, an open scene file or the path of an unreadable one. The
    /// thread sends its results to `results`. `state` is the folder for recovery files that cannot
    /// be written beside their scene file.
    pub fn new(
        file: Result<SceneFile, PathBuf>,
        state: Option<PathBuf>,
        results: Sender<Message>,
    ) -> io::Result<Self> {
        let (jobs, inbox) = unbounded();
        let document = SharedDocument::default();
        let (path, file) = match file {
            Ok(file) => (file.path().map(Path::to_path_buf), Some(file)),
            Err(path) => (Some(path), None),
        };
        // A readable file has no stamp yet, so the first check compares its contents. The errors of
        // an unreadable file have been reported; its stamp avoids a second report.
        let seen = path.as_deref().filter(|_| file.is_none()).and_then(stamp);
        let name = file.as_ref().map_or("", |file| file.document().name());
        let autosave = Autosave::new(path.as_deref(), name, state);
        let worker = FileWorker { path, file, seen, autosave, document: document.clone(), results };
        let thread = thread::Builder::new().name("files".into()).spawn(|| worker.run(inbox))?;
        Ok(Self { jobs: Some(jobs), document, thread: Some(thread) })
    }

    /// Writes `scene` to the scene file, or to `path`, which becomes the scene file. `overwrite`
    /// allows the replacement of content from other programs. The result is a [`Message::Saved`].
    pub fn save(&self, scene: Arc<Scene>, path: Option<PathBuf>, overwrite: bool) {
        self.give(Job::Save { scene, path, overwrite });
    }

    /// Reads the scene file. The result is a [`Message::Loaded`].
    pub fn load(&self) {
        self.give(Job::Load);
    }

    /// Schedules an autosave of a scene with unsaved edits. The recovery file is written after a
    /// pause in editing, or when the program ends. `None` removes the recovery file.
    pub fn autosave(&self, scene: Option<Arc<Scene>>) {
        self.give(Job::Autosave(scene));
    }

    /// Writes unsaved edits to the recovery file without waiting for a pause. Blocks until the
    /// edits are written, at most for `patience`.
    pub fn flush(&self, patience: Duration) {
        let (done, completion) = bounded(1);
        self.give(Job::Flush(done));
        let _ = completion.recv_timeout(patience);
    }

    /// Adopts the edits of the last [`Message::OrphanedEdits`] as the unsaved edits of this
    /// session.
    pub fn recover(&self) {
        self.give(Job::Recover);
    }

    /// Discards the edits of the last [`Message::OrphanedEdits`].
    pub fn discard(&self) {
        self.give(Job::Discard);
    }

    /// Waits for pending writes. Returns the path of the recovery file if there are unsaved edits.
    pub fn finish(mut self) -> Option<PathBuf> {
        self.join()
    }

    fn join(&mut self) -> Option<PathBuf> {
        drop(self.jobs.take());
        match self.thread.take()?.join() {
            Ok(kept) => kept,
            Err(_) if thread::panicking() => None,
            Err(panic) => std::panic::resume_unwind(panic),
        }
    }

    /// Returns a handle of the scene document.
    pub fn document(&self) -> SharedDocument {
        self.document.clone()
    }

    fn give(&self, job: Job) {
        // Sending fails only after a panic of the thread, which `join` propagates.
        let _ = self.jobs.as_ref().map(|jobs| jobs.send(job));
    }
}

/// Waits for pending writes.
impl Drop for Files {
    fn drop(&mut self) {
        self.join();
    }
}

/// Modification time and length of a file, to detect changes; `None` if the file has no metadata.
type FileStamp = Option<(SystemTime, u64)>;

fn stamp(path: &Path) -> FileStamp {
    let metadata = fs::metadata(path).ok()?;
    Some((metadata.modified().ok()?, metadata.len()))
}

struct FileWorker {
    /// Path of the scene file; `None` for a scene without file.
    path: Option<PathBuf>,
    /// Scene file; `None` if it has never been readable.
    file: Option<SceneFile>,
    /// Stamp of the scene file when it was last read, written or checked.
    seen: FileStamp,
    autosave: Autosave,
    document: SharedDocument,
    results: Sender<Message>,
}

impl FileWorker {
    /// Executes jobs until all senders are dropped. Returns the path of the recovery file if there
    /// are unsaved edits.
    fn run(mut self, inbox: Receiver<Job>) -> Option<PathBuf> {
        self.publish();
        for message in self.autosave.search(file_or_path(&self.file, &self.path)) {
            self.send(message);
        }
        let mut checked = Instant::now();
        loop {
            let next_check = checked + CHECK_INTERVAL;
            let due = self.autosave.due().map_or(next_check, |due| due.min(next_check));
            match inbox.recv_deadline(due) {
                Ok(job) => self.work(job),
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => break,
            }
            let now = Instant::now();
            if self.autosave.due().is_some_and(|due| due <= now) {
                self.write_autosave();
            }
            if next_check <= now {
                checked = now;
                if self.changed() {
                    self.send(Message::ChangedOnDisk);
                }
            }
        }
        self.write_autosave();
        self.autosave.path().map(Path::to_path_buf)
    }

    fn work(&mut self, job: Job) {
        match job {
            Job::Save { scene, path, overwrite } => {
                let saved = self.save(&scene, path, overwrite);
                self.send(Message::Saved(scene, saved));
            }
            Job::Load => {
                let loaded = self.load();
                self.send(Message::Loaded(Box::new(loaded)));
            }
            Job::Autosave(scene) => self.autosave.note(scene, Instant::now()),
            Job::Flush(done) => {
                self.write_autosave();
                // Sending fails if the receiver has timed out and is gone.
                let _ = done.try_send(());
            }
            Job::Recover => {
                let unreadable_path = self.path.as_deref().filter(|_| self.file.is_none());
                if let Some(file) = self.autosave.recover(unreadable_path) {
                    self.file = Some(file);
                    self.publish();
                }
            }
            Job::Discard => {
                self.autosave.discard();
                let next = self.autosave.offer(file_or_path(&self.file, &self.path));
                next.into_iter().for_each(|message| self.send(message));
            }
        }
    }

    fn write_autosave(&mut self) {
        let warning = self.file.as_ref().and_then(|file| self.autosave.write(file));
        warning.into_iter().for_each(|message| self.send(message));
    }

    fn send(&self, message: Message) {
        // Sending fails only at the end of the program, when the receiver is gone.
        let _ = self.results.send(message);
    }

    /// Returns `true` if another program has changed the file since the last read, write or report.
    fn changed(&mut self) -> bool {
        let Some(path) = &self.path else { return false };
        let now = stamp(path);
        if self.seen == now {
            return false;
        }
        self.seen = now;
        match &self.file {
            Some(file) => file.on_disk() == DiskState::Changed,
            None => now.is_some(),
        }
    }

    fn save(
        &mut self,
        scene: &Arc<Scene>,
        path: Option<PathBuf>,
        overwrite: bool,
    ) -> Result<PathBuf, SaveError> {
        let Some(file) = &mut self.file else {
            let what = "its contents are not a scene".to_string();
            return Err(SaveError::Failed { path: self.path.clone().unwrap_or_default(), what });
        };
        self.autosave.saving(file, scene);
        match path {
            Some(path) => file.save_as(&path, scene, overwrite)?,
            None => file.save(scene, overwrite)?,
        }
        let path = file.path().ok_or(SaveError::Untitled)?.to_path_buf();
        self.seen = stamp(&path);
        self.autosave.saved(scene, &path);
        self.path = Some(path.clone());
        self.publish();
        Ok(path)
    }

    fn load(&mut self) -> Result<Arc<Scene>, SceneErrors> {
        // The stamp is taken before reading, so that a write during the read counts as a change.
        self.seen = self.path.as_deref().and_then(stamp);
        let file = match (self.file.take(), &self.path) {
            (Some(file), _) => {
                let file = self.file.insert(file);
                file.reload()?;
                file
            }
            (None, Some(path)) => self.file.insert(SceneFile::open(path)?),
            (None, None) => return Ok(Arc::default()),
        };
        let scene = Arc::new(file.document().scene().clone());
        self.publish();
        Ok(scene)
    }

    fn publish(&self) {
        if let Some(file) = &self.file {
            self.document.put(file.document());
        }
    }
}

/// Returns the scene file, or the path of an unreadable one, which is empty for a scene without
/// file.
fn file_or_path<'a>(
    file: &'a Option<SceneFile>,
    path: &'a Option<PathBuf>,
) -> Result<&'a SceneFile, &'a Path> {
    file.as_ref().ok_or(path.as_deref().unwrap_or(Path::new("")))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::starter;

    /// Timeout that only a failing test reaches.
    const PATIENCE: Duration = Duration::from_secs(60);

    fn opened(path: &Path) -> (Files, Receiver<Message>) {
        let (results, inbox) = unbounded();
        let file = SceneFile::open(path).map_err(|_| path.to_path_buf());
        (Files::new(file, None, results).unwrap(), inbox)
    }

    fn loaded(message: Message) -> Result<Arc<Scene>, SceneErrors> {
        match message {
            Message::Loaded(result) => *result,
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn external_change_is_reported_once() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.toml");
        fs::write(&path, starter()).unwrap();
        let (files, inbox) = opened(&path);
        let mut scene = Scene::parse(starter(), "a").unwrap();
        scene.film.size = [64, 48];
        files.save(Arc::new(scene.clone()), None, false);
        let saved = inbox.recv_timeout(PATIENCE).unwrap();
        assert!(matches!(saved, Message::Saved(_, Ok(at)) if at == path));
        assert_eq!(files.document().get().unwrap().scene(), &scene);
        let quiet = inbox.recv_timeout(2 * CHECK_INTERVAL + CHECK_INTERVAL / 2);
        assert!(quiet.is_err(), "{quiet:?}");
        fs::write(&path, format!("{}\n# more\n", starter())).unwrap();
        assert!(matches!(inbox.recv_timeout(PATIENCE).unwrap(), Message::ChangedOnDisk));
        let quiet = inbox.recv_timeout(2 * CHECK_INTERVAL);
        assert!(quiet.is_err(), "reported once: {quiet:?}");
        files.save(Arc::new(scene), None, false);
        let refused = inbox.recv_timeout(PATIENCE).unwrap();
        assert!(matches!(refused, Message::Saved(_, Err(SaveError::Changed(_)))), "{refused:?}");
        files.load();
        assert_eq!(loaded(inbox.recv_timeout(PATIENCE).unwrap()).unwrap().film.size, [640, 480]);
    }

    #[test]
    fn fixed_file_can_be_loaded() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.toml");
        fs::write(&path, "[camera").unwrap();
        let (files, inbox) = opened(&path);
        files.load();
        assert!(loaded(inbox.recv_timeout(PATIENCE).unwrap()).is_err());
        files.save(Arc::default(), None, true);
        assert!(matches!(inbox.recv_timeout(PATIENCE).unwrap(), Message::Saved(_, Err(_))));
        assert_eq!(fs::read_to_string(&path).unwrap(), "[camera", "not ours to overwrite");
        fs::write(&path, starter()).unwrap();
        assert!(matches!(inbox.recv_timeout(PATIENCE).unwrap(), Message::ChangedOnDisk));
        files.load();
        assert!(loaded(inbox.recv_timeout(PATIENCE).unwrap()).is_ok());
        assert!(files.document().get().is_some());
    }

    #[test]
    fn edits_are_autosaved_at_end_unless_saved() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.toml");
        fs::write(&path, starter()).unwrap();
        let mut scene = Scene::parse(starter(), "a").unwrap();
        scene.film.size = [64, 48];
        let scene = Arc::new(scene);
        let hidden = folder.path().join(".a.toml.unsaved");
        let (files, _inbox) = opened(&path);
        files.autosave(Some(Arc::clone(&scene)));
        assert_eq!(files.finish(), Some(hidden.clone()));
        assert!(fs::read_to_string(&hidden).unwrap().contains("64"));
        let (files, inbox) = opened(&path);
        let offered = inbox.recv_timeout(PATIENCE).unwrap();
        assert!(
            matches!(&offered, Message::OrphanedEdits(left) if left.scene == scene),
            "{offered:?}"
        );
        files.recover();
        files.autosave(Some(Arc::clone(&scene)));
        files.save(Arc::clone(&scene), None, false);
        assert_eq!(files.finish(), None);
        assert!(!hidden.exists());
        assert!(fs::read_to_string(&path).unwrap().contains("64"));
        let (files, _inbox) = opened(&path);
        files.autosave(Some(Arc::new(Scene::parse(starter(), "a").unwrap())));
        files.flush(PATIENCE);
        assert!(hidden.exists());
        files.autosave(None);
        assert_eq!(files.finish(), None);
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn pending_jobs_finish_before_end() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("new.toml");
        let (results, _inbox) = unbounded();
        let untitled = SceneFile::untitled(starter().to_string(), "starter").unwrap();
        let files = Files::new(Ok(untitled), None, results).unwrap();
        let scene = Scene::parse(starter(), "starter").unwrap();
        files.save(Arc::new(scene), Some(path.clone()), false);
        drop(files);
        assert_eq!(fs::read_to_string(&path).unwrap(), starter());
    }
}
