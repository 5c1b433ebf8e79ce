//! Resolver of the mesh and image files that a scene refers to.

use crate::asset::{AssetError, Assets, Reading};
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::{Arc, PoisonError, RwLock};

/// Resolver of the file names in a scene: the folder to which they are relative, and a cache of the
/// files read so far. Scenes that are derived from one another share both.
#[derive(Clone, Debug, Default)]
pub struct AssetResolver {
    folder: Arc<RwLock<PathBuf>>,
    /// Cache of asset files.
    pub assets: Arc<Assets>,
}

/// All resolvers are equal: scenes with the same description are equal wherever their files are.
impl PartialEq for AssetResolver {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

impl AssetResolver {
    /// Creates the resolver of a scene in the file `scene`.
    pub fn new(scene: &Path, assets: Arc<Assets>) -> Self {
        let out = Self { folder: Arc::default(), assets };
        out.move_to(scene);
        out
    }

    /// Resolves file names relative to the folder of the scene file `scene` from now on.
    pub(super) fn move_to(&self, scene: &Path) {
        *self.folder.write().unwrap_or_else(PoisonError::into_inner) = folder_of(scene);
    }

    /// Returns the path of the file `name`.
    pub(super) fn path(&self, name: &str) -> PathBuf {
        self.folder.read().unwrap_or_else(PoisonError::into_inner).join(name)
    }

    /// Reads the file `name` by `read`. If the files of the scene are `refused` because of their sum,
    /// none is read: one of them gets the error.
    pub(super) fn load<T>(
        &self,
        name: &str,
        refused: Option<&AssetError>,
        read: impl Fn(&Assets, &Path) -> Result<Arc<T>, AssetError>,
    ) -> Reading<T> {
        let path = self.path(name);
        match refused {
            Some(error) => (error.file == path).then(|| Err(error.clone())),
            None => Some(read(&self.assets, &path)),
        }
    }

    /// Returns `true` if `name` leads to a file now, but to another file or to none once the scene
    /// has moved to the file `scene`.
    pub(super) fn breaks_when_moved(&self, name: &str, scene: &Path) -> bool {
        let there = fs::canonicalize(folder_of(scene).join(name));
        fs::canonicalize(self.path(name))
            .is_ok_and(|target| there.ok().is_none_or(|there| there != target))
    }
}

fn folder_of(scene: &Path) -> PathBuf {
    scene.parent().map(Path::to_path_buf).unwrap_or_default()
}
