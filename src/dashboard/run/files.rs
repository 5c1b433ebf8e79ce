//! The scene's file, in a thread of its own: a slow disk holds up nobody, and somebody else's writing
//! is noticed.

use crate::dashboard::message::Message;
use crate::scene::{DiskState, Document, SaveError, Scene, SceneErrors, SceneFile};
use crossbeam_channel::{Receiver, RecvTimeoutError, Sender, unbounded};
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::{Duration, SystemTime};

/// How often the file is looked at.
const CHECK_INTERVAL: Duration = Duration::from_secs(1);

enum Job {
    Save { scene: Arc<Scene>, path: Option<PathBuf>, overwrite: bool },
    Load,
}

/// The scene file as it was last read or written; nothing if it never could be read.
#[derive(Clone, Default)]
pub struct Paper(Arc<Mutex<Option<Arc<Document>>>>);

impl Paper {
    /// The document.
    pub fn document(&self) -> Option<Arc<Document>> {
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
    paper: Paper,
    thread: Option<JoinHandle<()>>,
}

impl Files {
    /// Starts the thread for a file that has been opened, or for one at a path that cannot be read
    /// yet. Results go to `results`.
    pub fn new(file: Result<SceneFile, PathBuf>, results: Sender<Message>) -> io::Result<Self> {
        let (jobs, inbox) = unbounded();
        let paper = Paper::default();
        let (path, file) = match file {
            Ok(file) => (file.path().map(Path::to_path_buf), Some(file)),
            Err(path) => (Some(path), None),
        };
        // A file that could be read is compared at the first look; what is wrong with another one is
        // known already.
        let seen = path.as_deref().filter(|_| file.is_none()).and_then(stamp);
        let clerk = Clerk { path, file, seen, paper: paper.clone(), results };
        let thread = thread::Builder::new().name("files".into()).spawn(|| clerk.run(inbox))?;
        Ok(Self { jobs: Some(jobs), paper, thread: Some(thread) })
    }

    /// Writes the scene: a [`Message::Saved`] follows.
    pub fn save(&self, scene: Arc<Scene>, path: Option<PathBuf>, overwrite: bool) {
        self.give(Job::Save { scene, path, overwrite });
    }

    /// Reads the file: a [`Message::Loaded`] follows.
    pub fn load(&self) {
        self.give(Job::Load);
    }

    /// What the file holds.
    pub fn paper(&self) -> Paper {
        self.paper.clone()
    }

    fn give(&self, job: Job) {
        // The thread ends only with this sender, or by a panic, which `drop` passes on.
        let _ = self.jobs.as_ref().map(|jobs| jobs.send(job));
    }
}

/// Waits for what is being written.
impl Drop for Files {
    fn drop(&mut self) {
        drop(self.jobs.take());
        if let Some(Err(panic)) = self.thread.take().map(JoinHandle::join)
            && !thread::panicking()
        {
            std::panic::resume_unwind(panic);
        }
    }
}

/// What tells one state of a file from another.
type Stamp = Option<(SystemTime, u64)>;

fn stamp(path: &Path) -> Stamp {
    let metadata = fs::metadata(path).ok()?;
    Some((metadata.modified().ok()?, metadata.len()))
}

struct Clerk {
    /// Where it is, if it is anywhere yet.
    path: Option<PathBuf>,
    /// The file, once it could be read.
    file: Option<SceneFile>,
    /// The state of the file when it was last read, written or looked at.
    seen: Stamp,
    paper: Paper,
    results: Sender<Message>,
}

impl Clerk {
    fn run(mut self, inbox: Receiver<Job>) {
        self.publish();
        loop {
            let message = match inbox.recv_timeout(CHECK_INTERVAL) {
                Ok(Job::Save { scene, path, overwrite }) => {
                    let saved = self.save(&scene, path, overwrite);
                    Message::Saved(scene, saved)
                }
                Ok(Job::Load) => Message::Loaded(Box::new(self.load())),
                Err(RecvTimeoutError::Timeout) if self.changed() => Message::ChangedOnDisk,
                Err(RecvTimeoutError::Timeout) => continue,
                Err(RecvTimeoutError::Disconnected) => break,
            };
            // Nobody listens any more when the program ends.
            let _ = self.results.send(message);
        }
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
        scene: &Scene,
        path: Option<PathBuf>,
        overwrite: bool,
    ) -> Result<PathBuf, SaveError> {
        let Some(file) = &mut self.file else {
            let what = "it holds something that is no scene".to_string();
            return Err(SaveError::Failed { path: self.path.clone().unwrap_or_default(), what });
        };
        match path {
            Some(path) => file.save_as(&path, scene, overwrite)?,
            None => file.save(scene, overwrite)?,
        }
        let path = file.path().ok_or(SaveError::Untitled)?.to_path_buf();
        self.seen = stamp(&path);
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
            self.paper.put(file.document());
        }
    }
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
        (Files::new(file, results).unwrap(), inbox)
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
        assert_eq!(files.paper().document().unwrap().scene(), &scene);
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
        assert!(files.paper().document().is_some());
    }

    #[test]
    fn what_was_given_is_done_before_the_end() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("new.toml");
        let (results, _inbox) = unbounded();
        let untitled = SceneFile::untitled(starter().to_string(), "starter").unwrap();
        let files = Files::new(Ok(untitled), results).unwrap();
        let scene = Scene::parse(starter(), "starter").unwrap();
        files.save(Arc::new(scene), Some(path.clone()), false);
        drop(files);
        assert_eq!(fs::read_to_string(&path).unwrap(), starter());
    }
}
