//! What is told while files are read that a scene names.

use crate::asset::{Assets, LoadProgress};
use crate::command::warn;
use std::io::IsTerminal;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Files and trees that take longer than a moment: so many bytes, so many triangles.
const LARGE: (u64, usize) = (8 << 20, 200_000);

/// Where files are remembered, and who tells of large ones on a terminal's stderr.
pub struct LoadReporter {
    /// To be shared by all that read scenes.
    pub assets: Arc<Assets>,
    enabled: Arc<AtomicBool>,
}

impl LoadReporter {
    /// Aloud if somebody looks on.
    pub fn new() -> Self {
        let enabled = Arc::new(AtomicBool::new(std::io::stderr().is_terminal()));
        let heard = enabled.clone();
        let tell = move |stage: &LoadProgress| {
            let large = match stage {
                LoadProgress::Reading { bytes, .. } => *bytes >= LARGE.0,
                LoadProgress::Building { triangles, .. } => *triangles >= LARGE.1,
            };
            if large && heard.load(Ordering::Relaxed) {
                warn(&stage.to_string());
            }
        };
        Self { assets: Arc::new(Assets::new(tell)), enabled }
    }

    /// Says no more: the terminal is somebody else's.
    pub fn mute(&self) {
        self.enabled.store(false, Ordering::Relaxed);
    }
}
