//! Contents of the scene file as last read or written, shared between threads.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use zerkalo_scene::{Recovery, SceneFile};

/// Contents of the scene file, and the writer of its recovery files in the state folder. The lock
/// is not held during disk access.
#[derive(Clone)]
pub struct SharedFile(Arc<Mutex<State>>);

struct State {
    file: Option<Arc<SceneFile>>,
    elsewhere: Recovery,
}

impl SharedFile {
    pub fn new(elsewhere: Recovery) -> Self {
        Self(Arc::new(Mutex::new(State { file: None, elsewhere })))
    }

    /// Returns the scene file; `None` if it has never been readable.
    pub fn get(&self) -> Option<Arc<SceneFile>> {
        self.state().file.clone()
    }

    pub fn put(&self, file: &SceneFile) {
        let file = Some(Arc::new(file.clone()));
        self.state().file = file;
    }

    /// Returns the writer of recovery files in the state folder, for use if the disk of the scene
    /// file does not respond.
    pub fn elsewhere(&self) -> Recovery {
        self.state().elsewhere.elsewhere()
    }

    pub fn set_elsewhere(&self, elsewhere: Recovery) {
        self.state().elsewhere = elsewhere;
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
