//! Where the files are that a scene names.

use crate::asset::{AssetError, Assets, Image, Mesh};
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::{Arc, PoisonError, RwLock};

/// The folder that a scene's names of files start from, and the files that were read. All scenes that
/// come from one another by edits share it, so that a file is read once.
#[derive(Clone, Debug, Default)]
pub struct AssetResolver {
    folder: Arc<RwLock<PathBuf>>,
    assets: Arc<Assets>,
}

/// It is no part of what a scene says.
impl PartialEq for AssetResolver {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

impl AssetResolver {
    /// Of a scene that is kept in the file `scene`; what is read is remembered in `assets`.
    pub fn of(scene: &Path, assets: Arc<Assets>) -> Self {
        let out = Self { folder: Arc::default(), assets };
        out.move_to(scene);
        out
    }

    /// What was read, to be shared with other scenes.
    pub fn assets(&self) -> Arc<Assets> {
        self.assets.clone()
    }

    /// The scene is kept in the file `scene` from now on.
    pub(super) fn move_to(&self, scene: &Path) {
        *self.folder.write().unwrap_or_else(PoisonError::into_inner) = folder_of(scene);
    }

    /// The mesh in the file that a scene calls `name`.
    pub(super) fn mesh(&self, name: &str) -> Result<Arc<Mesh>, AssetError> {
        self.assets.mesh(&self.folder().join(name))
    }

    /// The image in the file that a scene calls `name`.
    pub(super) fn image(&self, name: &str) -> Result<Arc<Image>, AssetError> {
        self.assets.image(&self.folder().join(name))
    }

    /// Whether `name`, which leads to a file from here, would not lead to it from the file `scene`.
    pub(super) fn loses(&self, name: &str, scene: &Path) -> bool {
        let there = fs::canonicalize(folder_of(scene).join(name));
        fs::canonicalize(self.folder().join(name))
            .is_ok_and(|here| there.ok().is_none_or(|there| there != here))
    }

    fn folder(&self) -> PathBuf {
        self.folder.read().unwrap_or_else(PoisonError::into_inner).clone()
    }
}

fn folder_of(scene: &Path) -> PathBuf {
    scene.parent().map(Path::to_path_buf).unwrap_or_default()
}
