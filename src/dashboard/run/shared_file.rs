//! Contents of the scene file as last read or written, shared between threads.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use zerkalo_scene::{Recovery, SceneFile};

/// State of the scene file, shared between threads: its contents as last read or written, and the
/// writer of its recovery files in the user's state folder. The lock is not held during disk
/// access.
#[derive(Clone)]
pub struct SharedFile(Arc<Mutex<State>>);

struct State {
    file: Option<Arc<SceneFile>>,
    elsewhere: Recovery,
}

impl SharedFile {
    /// Creates the state before the scene file has been read. `elsewhere` is the writer of recovery
    /// files in the user's state folder.
    pub fn new(elsewhere: Recovery) -> Self {
        Self(Arc::new(Mutex::new(State { file: None, elsewhere })))
    }

    /// Returns the contents of the scene file as last read or written. Returns `None` if the file
    /// has never been readable.
    pub fn get(&self) -> Option<Arc<SceneFile>> {
        self.state().file.clone()
    }

    /// Sets the contents that [`SharedFile::get`] returns.
    pub fn put(&self, file: &SceneFile) {
        let file = Some(Arc::new(file.clone()));
        self.state().file = file;
    }

    /// Returns the writer of recovery files in the user's state folder, for use if the disk of the
    /// scene file does not respond.
    pub fn elsewhere(&self) -> Recovery {
        self.state().elsewhere.elsewhere()
    }

    /// Sets the writer of recovery files in the state folder.
    pub fn set_elsewhere(&self, elsewhere: Recovery) {
        self.state().elsewhere = elsewhere;
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
