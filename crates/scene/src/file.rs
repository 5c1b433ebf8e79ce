//! Scene files on disk: opening, atomic saving, detection of changes by other programs.

use crate::asset::Assets;
use crate::disk::{Existing, WriteError, open_regular, replace_file};
use crate::value::{fnv1a64, sanitized};
use crate::{Document, Scene, SceneErrors};
use std::fmt;
use std::io::{self, ErrorKind, Read, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Scene as last read or saved, with its text and the path of its file.
#[derive(Clone, Debug)]
pub struct SceneFile {
    path: Option<PathBuf>,
    document: Document,
    /// Hash of the bytes that this program last read from or wrote to the file.
    fingerprint: u64,
}

/// State of a scene file on disk relative to the bytes that this program last read or wrote.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DiskState {
    /// State: the file still has the bytes that this program last read or wrote, or the scene has
    /// no file yet.
    Unchanged,
    /// State: another program has written the file, or it is no longer a readable regular file.
    Changed,
    /// State: the scene file has been deleted or moved.
    Missing,
}

/// Reason why a scene was not saved.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum SaveError {
    /// Error: the scene has no file yet, and no path was given.
    Untitled,
    /// Error: another program has written the file since it was read. The value is its path.
    Changed(PathBuf),
    /// Error: a file with this path exists, and overwriting was not requested.
    Exists(PathBuf),
    /// Error: the scene file cannot be written.
    Failed {
        /// Path of the scene file.
        path: PathBuf,
        /// Cause of the failure, as a clause for the error message.
        what: String,
    },
}

impl fmt::Display for SaveError {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let printable = |path: &PathBuf| sanitized(&path.display().to_string());
        match self {
            Self::Untitled => f.write_str("this scene has no file yet; save it under a name"),
            Self::Changed(path) => write!(
                f,
                "{} was changed by another program; reload it, overwrite it, or save under another \
                 name",
                printable(path)
            ),
            Self::Exists(path) => {
                write!(f, "{} exists; overwrite it or choose another name", printable(path))
            }
            Self::Failed { path, what } => write!(f, "cannot write {}: {what}", printable(path)),
        }
    }
}

impl std::error::Error for SaveError {}

impl SceneFile {
    /// Reads and validates the scene file at `path`, which must be a regular file.
    ///
    /// # Errors
    /// The errors of [`Scene::read`].
    pub fn open(path: &Path) -> Result<Self, SceneErrors> {
        Self::open_with(path, Arc::default())
    }

    /// Reads and validates the scene file at `path`. `assets` is the cache of the files that the
    /// scene refers to.
    ///
    /// # Errors
    /// The errors of [`Scene::read`].
    pub fn open_with(path: &Path, assets: Arc<Assets>) -> Result<Self, SceneErrors> {
        let document = Document::read_regular(path, assets)?;
        let fingerprint = fnv1a64(document.text().as_bytes());
        Ok(Self { path: Some(path.to_path_buf()), document, fingerprint })
    }

    /// Creates a scene without a file. `name` is the file name in diagnostics.
    ///
    /// # Errors
    /// The errors of [`Scene::parse`].
    pub fn untitled(text: String, name: &str) -> Result<Self, SceneErrors> {
        Ok(Self { path: None, document: Document::parse(text, name)?, fingerprint: 0 })
    }

    /// Creates a scene from `text`, the unsaved edits in a recovery file. `path` is the scene file
    /// that was edited. The present content of the file differs from `text`, and stays until the
    /// edits are saved.
    ///
    /// # Errors
    /// Returns the errors of [`Scene::parse`].
    pub fn recovered(path: &Path, text: String) -> Result<Self, SceneErrors> {
        let document = Document::parse(text, &path.display().to_string())?;
        let fingerprint = content(path).ok().flatten().unwrap_or_default();
        Ok(Self { path: Some(path.to_path_buf()), document, fingerprint })
    }

    /// Parses `text` as a scene. File names in the scene are relative to the folder of this file.
    /// `name` is the file name in diagnostics.
    ///
    /// # Errors
    /// The errors of [`Scene::parse`].
    pub fn parse(&self, text: &str, name: &str) -> Result<Scene, SceneErrors> {
        Scene::parse_in(text, name, self.document.scene().resolver.clone())
    }

    /// Returns the hash of the bytes that this program last read from or wrote to the file. Returns
    /// `None` if the scene has no file.
    pub fn fingerprint(&self) -> Option<u64> {
        self.path.as_ref().map(|_| self.fingerprint)
    }

    /// Returns `true` if `text` is the text that this program last read from or wrote to the file.
    /// For a scene without a file, it is the text from which the scene was created.
    pub fn holds(&self, text: &str) -> bool {
        match self.path {
            Some(_) => fnv1a64(text.as_bytes()) == self.fingerprint,
            None => text == self.document.text(),
        }
    }

    /// Returns the text that saving the valid `scene` would write.
    pub fn text_of(&self, scene: &Scene) -> String {
        let mut document = self.document.clone();
        document.apply(scene);
        document.text().to_string()
    }

    /// Returns the path of the scene file; `None` if the scene has no file.
    pub fn path(&self) -> Option<&Path> {
        self.path.as_deref()
    }

    /// Returns the scene and its text, as last read or saved.
    pub fn document(&self) -> &Document {
        &self.document
    }

    /// Reads the scene file and compares it with the bytes that this program last read or wrote.
    pub fn on_disk(&self) -> DiskState {
        self.path.as_deref().map_or(DiskState::Unchanged, |path| self.state_of(&content(path)))
    }

    fn state_of(&self, found: &io::Result<Option<u64>>) -> DiskState {
        match found {
            Ok(Some(found)) if *found == self.fingerprint => DiskState::Unchanged,
            Ok(None) => DiskState::Missing,
            _ => DiskState::Changed,
        }
    }

    /// Reads the scene file again.
    ///
    /// # Errors
    /// Returns the errors of [`Scene::read`]; the document then stays unchanged. The fingerprint
    /// (hash of the file's bytes) is updated even then, so that a broken file is reported only
    /// once.
    pub fn reload(&mut self) -> Result<(), SceneErrors> {
        let Some(path) = self.path.clone() else { return Ok(()) };
        if let Ok(Some(found)) = content(&path) {
            self.fingerprint = found;
        }
        *self = Self::open_with(&path, self.document.scene().resolver.assets())?;
        Ok(())
    }

    /// Writes the valid `scene` to its file. Comments, order and layout of unchanged parts are
    /// kept. The file is replaced atomically; a symbolic link and the permissions are kept.
    ///
    /// # Errors
    /// Fails if there is no file yet, if another program has written the file (unless `overwrite`
    /// is `true`), if the path leads to something other than a regular file, or if the file cannot
    /// be written.
    pub fn save(&mut self, scene: &Scene, overwrite: bool) -> Result<(), SaveError> {
        let Some(path) = self.path.clone() else { return Err(SaveError::Untitled) };
        let found = content(&path);
        if let Err(error) = &found
            && error.kind() == ErrorKind::InvalidInput
        {
            let what = format!("{error}; save under another name");
            return Err(SaveError::Failed { path, what });
        }
        if !overwrite && self.state_of(&found) == DiskState::Changed {
            return Err(SaveError::Changed(path));
        }
        let mut document = self.document.clone();
        document.apply(scene);
        self.write(document, &path, true)
    }

    /// Writes the valid `scene` to another file, which becomes the scene's file.
    ///
    /// # Errors
    /// Fails if the file exists (unless `overwrite` is `true`), or if it cannot be written. Also
    /// fails if a file name in the scene would lead to another file, or to none, from the new
    /// folder.
    pub fn save_as(
        &mut self,
        path: &Path,
        scene: &Scene,
        overwrite: bool,
    ) -> Result<(), SaveError> {
        let resolver = &scene.resolver;
        let meshes = scene.objects.iter().filter_map(|object| object.shape.file());
        let images = scene.materials.values().flat_map(|material| material.files());
        let environments =
            scene.lights.iter().filter_map(|light| light.environment.as_ref()?.file());
        if let Some(file) = meshes
            .chain(images)
            .chain(environments)
            .find(|file| resolver.breaks_when_moved(file, path))
        {
            let file = sanitized(file);
            return Err(SaveError::Failed {
                path: path.to_path_buf(),
                what: format!("from there \"{file}\", which the scene names, would not be found"),
            });
        }
        let mut document = self.document.clone().renamed(&path.display().to_string());
        document.apply(scene);
        self.write(document, path, overwrite)?;
        resolver.move_to(path);
        self.path = Some(path.to_path_buf());
        Ok(())
    }

    /// Replaces the content of the file at `path` by the text of `document` atomically and durably.
    /// If `overwrite` is `false`, fails if the file exists.
    fn write(&mut self, document: Document, path: &Path, overwrite: bool) -> Result<(), SaveError> {
        let existing = if overwrite { Existing::Replace } else { Existing::Refuse };
        let text = document.text().as_bytes();
        let written = replace_file(path, existing, |file| file.write_all(text));
        written.map_err(|WriteError { kind, what, remedy, .. }| match kind {
            ErrorKind::AlreadyExists => SaveError::Exists(path.to_path_buf()),
            _ => SaveError::Failed {
                path: path.to_path_buf(),
                what: sanitized(&format!("{what}; {remedy}")),
            },
        })?;
        self.fingerprint = fnv1a64(text);
        self.document = document;
        Ok(())
    }
}

/// Returns the fingerprint (hash) of the content of the file at `path`; `None` if there is no file.
///
/// # Errors
/// Returns [`ErrorKind::InvalidInput`] if the path leads to something other than a regular file.
fn content(path: &Path) -> io::Result<Option<u64>> {
    match open_regular(path) {
        Ok(file) => {
            let mut bytes = Vec::new();
            file.take(1 << 30).read_to_end(&mut bytes)?;
            Ok(Some(fnv1a64(&bytes)))
        }
        Err(error) if error.kind() == ErrorKind::NotFound => Ok(None),
        Err(error) => Err(error),
    }
}
