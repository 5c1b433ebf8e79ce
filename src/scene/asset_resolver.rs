//! Resolution of the mesh and image files that a scene names.

use crate::asset::{AssetError, Assets, Image, Mesh};
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::{Arc, PoisonError, RwLock};

/// Folder to which file names in a scene are relative, and a cache of the files that were read.
/// Scenes derived from one another by edits share both, so that a file is read once.
#[derive(Clone, Debug, Default)]
pub struct AssetResolver {
    folder: Arc<RwLock<PathBuf>>,
    assets: Arc<Assets>,
}

/// Always equal: two scenes with the same description are equal wherever their files are.
impl PartialEq for AssetResolver {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

impl AssetResolver {
    /// Creates the resolver of a scene that is stored in the file `scene`; `assets` caches what is
    /// read.
    pub fn new(scene: &Path, assets: Arc<Assets>) -> Self {
        let out = Self { folder: Arc::default(), assets };
        out.move_to(scene);
        out
    }

    /// Returns the cache, to be shared with other scenes.
    pub fn assets(&self) -> Arc<Assets> {
        self.assets.clone()
    }

    /// Makes names relative to the folder of the file `scene`.
    pub(super) fn move_to(&self, scene: &Path) {
        *self.folder.write().unwrap_or_else(PoisonError::into_inner) = folder_of(scene);
    }

    /// Returns the mesh in the file `name`.
    pub(super) fn mesh(&self, name: &str) -> Result<Arc<Mesh>, AssetError> {
        self.assets.mesh(&self.folder().join(name))
    }

    /// Returns the image in the file `name`.
    pub(super) fn image(&self, name: &str) -> Result<Arc<Image>, AssetError> {
        self.assets.image(&self.folder().join(name))
    }

    /// Returns `true` if `name` leads to a file from the present folder, but not to the same file
    /// from the folder of `scene`.
    pub(super) fn breaks_when_moved(&self, name: &str, scene: &Path) -> bool {
        let there = fs::canonicalize(folder_of(scene).join(name));
        fs::canonicalize(self.folder().join(name))
            .is_ok_and(|target| there.ok().is_none_or(|there| there != target))
    }

    fn folder(&self) -> PathBuf {
        self.folder.read().unwrap_or_else(PoisonError::into_inner).clone()
    }
}

fn folder_of(scene: &Path) -> PathBuf {
    scene.parent().map(Path::to_path_buf).unwrap_or_default()
}
