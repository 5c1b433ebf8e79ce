//! Resolver of the mesh and image files that a scene refers to.

use crate::asset::Assets;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::{Arc, PoisonError, RwLock};

/// Resolver of the file names in a scene: it has the folder to which the names are relative, and a
/// cache of the files read so far. Scenes that are derived from one another by edits share both, so
/// that each file is read once.
#[derive(Clone, Debug, Default)]
pub struct AssetResolver {
    folder: Arc<RwLock<PathBuf>>,
    assets: Arc<Assets>,
}

/// Equality of resolvers: all are equal, so that scenes with the same description are equal
/// wherever their mesh and image files are.
impl PartialEq for AssetResolver {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

impl AssetResolver {
    /// Creates the resolver of a scene that is stored in the file `scene`. `assets` is the cache of
    /// the files that the scene refers to.
    pub fn new(scene: &Path, assets: Arc<Assets>) -> Self {
        let out = Self { folder: Arc::default(), assets };
        out.move_to(scene);
        out
    }

    /// Returns the cache of asset files, for use by other scenes.
    pub fn assets(&self) -> Arc<Assets> {
        self.assets.clone()
    }

    /// Sets the folder to which file names are relative: that of the scene file `scene`.
    pub(super) fn move_to(&self, scene: &Path) {
        *self.folder.write().unwrap_or_else(PoisonError::into_inner) = folder_of(scene);
    }

    /// Returns the path of the file `name`.
    pub(super) fn path(&self, name: &str) -> PathBuf {
        self.folder.read().unwrap_or_else(PoisonError::into_inner).join(name)
    }

    /// Returns `true` if the file name `name` breaks when the scene is saved as the file `scene`:
    /// it leads to a file from the current folder, but to another file or none from the folder of
    /// `scene`.
    pub(super) fn breaks_when_moved(&self, name: &str, scene: &Path) -> bool {
        let there = fs::canonicalize(folder_of(scene).join(name));
        fs::canonicalize(self.path(name))
            .is_ok_and(|target| there.ok().is_none_or(|there| there != target))
    }
}

fn folder_of(scene: &Path) -> PathBuf {
    scene.parent().map(Path::to_path_buf).unwrap_or_default()
}
