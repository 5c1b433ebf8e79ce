//! The scene file as last read or written, shared between threads.

use crate::scene::{Recovery, SceneFile};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Shared handle of the scene file. No lock is held during disk access.
#[derive(Clone)]
pub struct SharedFile(Arc<Mutex<State>>);

struct State {
    file: Option<Arc<SceneFile>>,
    elsewhere: Recovery,
}

impl SharedFile {
    /// Creates a handle without a file. `elsewhere` writes recovery files to the state folder.
    pub fn new(elsewhere: Recovery) -> Self {
        Self(Arc::new(Mutex::new(State { file: None, elsewhere })))
    }

    /// Returns the file. Returns `None` if it has never been readable.
    pub fn get(&self) -> Option<Arc<SceneFile>> {
        self.state().file.clone()
    }

    /// Sets the file.
    pub fn put(&self, file: &SceneFile) {
        let file = Some(Arc::new(file.clone()));
        self.state().file = file;
    }

    /// Returns the writer of recovery files in the state folder.
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
