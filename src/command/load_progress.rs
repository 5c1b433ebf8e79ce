//! Progress messages while meshes and images of a scene are loaded.

use crate::command::warn;
use std::io::IsTerminal;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use zerkalo_scene::asset::{Assets, LoadProgress};

/// Limits above which the loading of a file is reported, because it takes a noticeable time. The
/// first is the length of a file in bytes, 8 MiB. The second is the number of triangles of a mesh
/// whose BVH is built.
const LARGE: (u64, usize) = (8 << 20, 200_000);

/// Asset cache with progress messages for large files on stderr, if stderr is a terminal.
pub struct LoadReporter {
    /// Cache of asset files, shared between all readers of scenes.
    pub assets: Arc<Assets>,
    enabled: Arc<AtomicBool>,
}

impl LoadReporter {
    /// Creates a reporter. Its messages are enabled if stderr is a terminal.
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

    /// Disables the progress messages. The dashboard calls this before it takes over the terminal.
    pub fn mute(&self) {
        self.enabled.store(false, Ordering::Relaxed);
    }
}
