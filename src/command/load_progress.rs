//! Progress messages while the files that a scene names are read.

use crate::asset::{Assets, LoadProgress};
use crate::command::warn;
use std::io::IsTerminal;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Least size in bytes of a file, and number of triangles of a BVH, that is reported.
const LARGE: (u64, usize) = (8 << 20, 200_000);

/// Asset cache that reports large files on stderr if that is a terminal.
pub struct LoadReporter {
    /// The cache, shared by all readers of scenes.
    pub assets: Arc<Assets>,
    enabled: Arc<AtomicBool>,
}

impl LoadReporter {
    /// Creates a reporter, enabled if stderr is a terminal.
    pub fn new() -> Self {
        let enabled = Arc::new(AtomicBool::new(std::io::stderr().is_terminal()));
        let is_enabled = enabled.clone();
        let report = move |stage: &LoadProgress| {
            let large = match stage {
                LoadProgress::Reading { bytes, .. } => *bytes >= LARGE.0,
                LoadProgress::Building { triangles, .. } => *triangles >= LARGE.1,
            };
            if large && is_enabled.load(Ordering::Relaxed) {
                warn(&stage.to_string());
            }
        };
        Self { assets: Arc::new(Assets::new(report)), enabled }
    }

    /// Disables the messages: the dashboard owns the terminal from now on.
    pub fn mute(&self) {
        self.enabled.store(false, Ordering::Relaxed);
    }
}
