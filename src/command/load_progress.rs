//! Progress messages while meshes and images of a scene are loaded.

use crate::command::warn;
use std::io::IsTerminal;
use std::sync::Arc;
use zerkalo_scene::asset::{Assets, LoadProgress};

/// Length of a file above which reading is reported.
const LARGE_FILE_BYTES: u64 = 8 << 20;
/// Number of triangles of a mesh above which building its BVH is reported.
const LARGE_MESH_TRIANGLES: usize = 200_000;

/// Creates an asset cache that passes messages about large files and meshes to `report`.
pub fn reporting(report: impl Fn(String) + Send + Sync + 'static) -> Arc<Assets> {
    Arc::new(Assets::new(move |stage: &LoadProgress| {
        let large = match stage {
            LoadProgress::Reading { bytes, .. } => *bytes >= LARGE_FILE_BYTES,
            LoadProgress::Building { triangles, .. } => *triangles >= LARGE_MESH_TRIANGLES,
        };
        if large {
            report(stage.to_string());
        }
    }))
}

/// Creates an asset cache that reports large files and meshes on stderr, if that is a terminal.
pub fn reporting_on_stderr() -> Arc<Assets> {
    let is_terminal = std::io::stderr().is_terminal();
    reporting(move |stage| {
        if is_terminal {
            warn(&stage);
        }
    })
}
