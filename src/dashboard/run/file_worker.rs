//! The scene's file, in a thread of its own: a slow disk holds up nobody, and somebody else's writing
//! is noticed.

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

/// How often the file is looked at.
const CHECK_INTERVAL: Duration = Duration::from_secs(1);

enum Job {
    Save { scene: Arc<Scene>, path: Option<PathBuf>, overwrite: bool },
    Load,
    Autosave(Option<Arc<Scene>>),
    Secure(Sender<()>),
    Recover,
    Discard,
}

/// The scene file as it was last read or written; nothing if it never could be read.
#[derive(Clone, Default)]
pub struct SharedDocument(Arc<Mutex<Option<Arc<Document>>>>);

impl SharedDocument {
    /// The document.
    pub fn get(&self) -> Option<Arc<Document>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    fn put(&self, document: &Document) {
        let document = Some(Arc::new(document.clone()));
        *self.0.lock().unwrap_or_else(PoisonError::into_inner) = document;
    }
}

/// The thread that reads and writes the scene's file.
pub struct Files {
    jobs: Option<Sender<Job>>,
    document: SharedDocument,
    thread: Option<JoinHandle<Option<PathBuf>>>,
}

impl Files {
    /// Starts the thread for a file that has been opened, or for one at a path that cannot be read
    /// yet. Results go to `results`. `state`: the folder for unsaved edits that cannot be kept beside
    /// their scene.
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
        // A file that could be read is compared at the first look; what is wrong with another one is
        // known already.
        let seen = path.as_deref().filter(|_| file.is_none()).and_then(stamp);
        let name = file.as_ref().map_or("", |file| file.document().name());
        let journal = Autosave::new(path.as_deref(), name, state);
        let clerk = FileWorker { path, file, seen, journal, document: document.clone(), results };
        let thread = thread::Builder::new().name("files".into()).spawn(|| clerk.run(inbox))?;
        Ok(Self { jobs: Some(jobs), document, thread: Some(thread) })
    }

    /// Writes the scene: a [`Message::Saved`] follows.
    pub fn save(&self, scene: Arc<Scene>, path: Option<PathBuf>, overwrite: bool) {
        self.give(Job::Save { scene, path, overwrite });
    }

    /// Reads the file: a [`Message::Loaded`] follows.
    pub fn load(&self) {
        self.give(Job::Load);
    }

    /// The scene has unsaved edits, and is this now; `None`: it has none any more. They are written
    /// where the next start finds them: soon, or at the end.
    pub fn autosave(&self, scene: Option<Arc<Scene>>) {
        self.give(Job::Autosave(scene));
    }

    /// Unsaved edits are written now. Waits for that at most as long as `patience`.
    pub fn flush(&self, patience: Duration) {
        let (done, told) = bounded(1);
        self.give(Job::Secure(done));
        let _ = told.recv_timeout(patience);
    }

    /// The edits of the last [`Message::OrphanedEdits`] are what is unsaved now.
    pub fn recover(&self) {
        self.give(Job::Recover);
    }

    /// The edits of the last [`Message::OrphanedEdits`] are not wanted.
    pub fn discard(&self) {
        self.give(Job::Discard);
    }

    /// Waits for what is being written; where unsaved edits are kept, if there are any.
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

    /// What the file holds.
    pub fn document(&self) -> SharedDocument {
        self.document.clone()
    }

    fn give(&self, job: Job) {
        // The thread ends only with this sender, or by a panic, which `drop` passes on.
        let _ = self.jobs.as_ref().map(|jobs| jobs.send(job));
    }
}

/// Waits for what is being written.
impl Drop for Files {
    fn drop(&mut self) {
        self.join();
    }
}

/// What tells one state of a file from another.
type FileStamp = Option<(SystemTime, u64)>;

fn stamp(path: &Path) -> FileStamp {
    let metadata = fs::metadata(path).ok()?;
    Some((metadata.modified().ok()?, metadata.len()))
}

struct FileWorker {
    /// Where it is, if it is anywhere yet.
    path: Option<PathBuf>,
    /// The file, once it could be read.
    file: Option<SceneFile>,
    /// The state of the file when it was last read, written or looked at.
    seen: FileStamp,
    journal: Autosave,
    document: SharedDocument,
    results: Sender<Message>,
}

impl FileWorker {
    /// Works until there is nobody to work for. Where unsaved edits are kept, if there are any.
    fn run(mut self, inbox: Receiver<Job>) -> Option<PathBuf> {
        self.publish();
        for message in self.journal.search(whole(&self.file, &self.path)) {
            self.tell(message);
        }
        let mut looked = Instant::now();
        loop {
            let next_look = looked + CHECK_INTERVAL;
            let due = self.journal.due().map_or(next_look, |due| due.min(next_look));
            match inbox.recv_deadline(due) {
                Ok(job) => self.work(job),
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => break,
            }
            let now = Instant::now();
            if self.journal.due().is_some_and(|due| due <= now) {
                self.write_journal();
            }
            if next_look <= now {
                looked = now;
                if self.changed() {
                    self.tell(Message::ChangedOnDisk);
                }
            }
        }
        self.write_journal();
        self.journal.path().map(Path::to_path_buf)
    }

    fn work(&mut self, job: Job) {
        match job {
            Job::Save { scene, path, overwrite } => {
                let saved = self.save(&scene, path, overwrite);
                self.tell(Message::Saved(scene, saved));
            }
            Job::Load => {
                let loaded = self.load();
                self.tell(Message::Loaded(Box::new(loaded)));
            }
            Job::Autosave(scene) => self.journal.note(scene, Instant::now()),
            Job::Secure(done) => {
                self.write_journal();
                // Nobody waits any more if it has taken long.
                let _ = done.try_send(());
            }
            Job::Recover => {
                let spoilt = self.path.as_deref().filter(|_| self.file.is_none());
                if let Some(file) = self.journal.recover(spoilt) {
                    self.file = Some(file);
                    self.publish();
                }
            }
            Job::Discard => {
                self.journal.discard();
                let next = self.journal.offer(whole(&self.file, &self.path));
                next.into_iter().for_each(|message| self.tell(message));
            }
        }
    }

    fn write_journal(&mut self) {
        let told = self.file.as_ref().and_then(|file| self.journal.write(file));
        told.into_iter().for_each(|message| self.tell(message));
    }

    fn tell(&self, message: Message) {
        // Nobody listens any more when the program ends.
        let _ = self.results.send(message);
    }

    /// Whether somebody has written the file since it was read, written or told about.
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
            let what = "it holds something that is no scene".to_string();
            return Err(SaveError::Failed { path: self.path.clone().unwrap_or_default(), what });
        };
        self.journal.saving(file, scene);
        match path {
            Some(path) => file.save_as(&path, scene, overwrite)?,
            None => file.save(scene, overwrite)?,
        }
        let path = file.path().ok_or(SaveError::Untitled)?.to_path_buf();
        self.seen = stamp(&path);
        self.journal.saved(scene, &path);
        self.path = Some(path.clone());
        self.publish();
        Ok(path)
    }

    fn load(&mut self) -> Result<Arc<Scene>, SceneErrors> {
        // Before reading: what is written meanwhile is news.
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

/// The file, or where it is.
fn whole<'a>(
    file: &'a Option<SceneFile>,
    path: &'a Option<PathBuf>,
) -> Result<&'a SceneFile, &'a Path> {
    file.as_ref().ok_or(path.as_deref().unwrap_or(Path::new("")))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::starter;

    /// Long enough for any machine; reached only on failure.
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
    fn what_others_write_is_told_once_and_what_is_saved_is_not() {
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
        assert!(quiet.is_err(), "told once: {quiet:?}");
        files.save(Arc::new(scene), None, false);
        let refused = inbox.recv_timeout(PATIENCE).unwrap();
        assert!(matches!(refused, Message::Saved(_, Err(SaveError::Changed(_)))), "{refused:?}");
        files.load();
        assert_eq!(loaded(inbox.recv_timeout(PATIENCE).unwrap()).unwrap().film.size, [640, 480]);
    }

    #[test]
    fn a_broken_file_is_read_once_it_is_mended() {
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
    fn edits_are_kept_at_the_end_unless_they_were_saved_or_left() {
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
    fn what_was_given_is_done_before_the_end() {
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
