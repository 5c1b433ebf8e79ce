//! Progress messages while meshes and images of a scene are loaded.

use crate::command::warn;
use std::io::IsTerminal;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use zerkalo_scene::asset::{Assets, LoadProgress};

/// Length of a file above which reading is reported.
const LARGE_FILE_BYTES: u64 = 8 << 20;
/// Number of triangles of a mesh above which building its BVH is reported.
const LARGE_MESH_TRIANGLES: usize = 200_000;

/// Asset cache that reports large files and meshes on stderr, if that is a terminal.
pub struct LoadReporter {
    pub assets: Arc<Assets>,
    enabled: Arc<AtomicBool>,
}

impl LoadReporter {
    pub fn new() -> Self {
        let enabled = Arc::new(AtomicBool::new(std::io::stderr().is_terminal()));
        let is_enabled = enabled.clone();
        let report = move |stage: &LoadProgress| {
            let large = match stage {
                LoadProgress::Reading { bytes, .. } => *bytes >= LARGE_FILE_BYTES,
                LoadProgress::Building { triangles, .. } => *triangles >= LARGE_MESH_TRIANGLES,
            };
            if large && is_enabled.load(Ordering::Relaxed) {
                warn(&stage.to_string());
            }
        };
        Self { assets: Arc::new(Assets::new(report)), enabled }
    }

    /// Disables the messages, before the dashboard takes over the terminal.
    pub fn mute(&self) {
        self.enabled.store(false, Ordering::Relaxed);
    }
}
