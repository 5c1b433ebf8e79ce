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
        let clerk = Clerk { held: file, told: None, paper: paper.clone(), results };
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
    /// The file; or where it is, as long as it cannot be read.
    held: Result<SceneFile, PathBuf>,
    /// The state of the file that was last told about.
    told: Option<Stamp>,
    paper: Paper,
    results: Sender<Message>,
}

impl Clerk {
    fn run(mut self, inbox: Receiver<Job>) {
        self.publish();
        // What is there now was told by whoever opened the file.
        self.told = self.path().map(|path| stamp(&path));
        loop {
            let message = match inbox.recv_timeout(CHECK_INTERVAL) {
                Ok(Job::Save { scene, path, overwrite }) => {
                    Message::Saved(self.save(&scene, path, overwrite))
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

    fn path(&self) -> Option<PathBuf> {
        match &self.held {
            Ok(file) => file.path().map(Path::to_path_buf),
            Err(path) => Some(path.clone()),
        }
    }

    /// Whether somebody has written the file since it was read, written or told about.
    fn changed(&mut self) -> bool {
        let Some(path) = self.path() else { return false };
        let now = stamp(&path);
        let differs = match &self.held {
            Ok(file) => file.on_disk() == DiskState::Changed,
            Err(_) => now.is_some(),
        };
        let news = differs && self.told != Some(now);
        if news {
            self.told = Some(now);
        }
        news
    }

    fn save(
        &mut self,
        scene: &Scene,
        path: Option<PathBuf>,
        overwrite: bool,
    ) -> Result<PathBuf, SaveError> {
        let file = match &mut self.held {
            Ok(file) => file,
            // Nothing could be read: what is saved is a new file.
            Err(broken) => {
                let name = broken.display().to_string();
                let text = Document::new(scene, &name).text().to_string();
                let file = SceneFile::untitled(text, &name).map_err(|_| SaveError::Untitled)?;
                self.held = Ok(file);
                self.held.as_mut().expect("just put there")
            }
        };
        match path {
            Some(path) => file.save_as(&path, scene, overwrite)?,
            None => file.save(scene, overwrite)?,
        }
        self.publish();
        let path = self.path().ok_or(SaveError::Untitled)?;
        self.told = Some(stamp(&path));
        Ok(path)
    }

    fn load(&mut self) -> Result<Arc<Scene>, SceneErrors> {
        // Before reading: what is written meanwhile is news.
        self.told = self.path().map(|path| stamp(&path));
        match &mut self.held {
            Ok(file) => file.reload()?,
            Err(path) => self.held = Ok(SceneFile::open(path)?),
        }
        self.publish();
        let scene = self.held.as_ref().map(|file| file.document().scene().clone());
        Ok(Arc::new(scene.unwrap_or_default()))
    }

    fn publish(&self) {
        if let Ok(file) = &self.held {
            self.paper.put(file.document());
        }
    }
}
