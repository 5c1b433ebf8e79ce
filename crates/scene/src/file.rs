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
    /// Scene and its text, as last read or saved.
    pub document: Document,
    /// Hash of the bytes that this program last read from or wrote to the file; `None` if there is no
    /// file, or it has not been readable.
    fingerprint: Option<u64>,
}

/// State of a scene file on disk, compared with the bytes that this program last read or wrote.
#[allow(missing_docs, reason = "the names say it")]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DiskState {
    Unchanged,
    /// Written by another program, or no longer a readable regular file.
    Changed,
    /// Deleted or moved.
    Missing,
}

/// Reason why a scene was not saved.
#[allow(missing_docs, reason = "the names say it")]
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum SaveError {
    /// The scene has no file yet, and no path was given.
    Untitled,
    /// Another program has written the file since it was read.
    Changed(PathBuf),
    /// The file exists, and overwriting was not requested.
    Exists(PathBuf),
    Failed {
        path: PathBuf,
        /// Cause of the failure, as a clause.
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
    /// Reads and validates the regular file at `path`. Returns the same errors as [`Scene::read`].
    pub fn open(path: &Path) -> Result<Self, SceneErrors> {
        Self::open_with(path, Arc::default())
    }

    /// Reads a scene like [`SceneFile::open`], with a cache of the files that it refers to.
    pub fn open_with(path: &Path, assets: Arc<Assets>) -> Result<Self, SceneErrors> {
        let document = Document::read_opened(path, open_regular(path), assets)?;
        let fingerprint = Some(fnv1a64(document.text().as_bytes()));
        Ok(Self { path: Some(path.to_path_buf()), document, fingerprint })
    }

    /// Creates a scene without a file. `name` is the file name in diagnostics.
    pub fn untitled(text: String, name: &str) -> Result<Self, SceneErrors> {
        Ok(Self { path: None, document: Document::parse(text, name)?, fingerprint: None })
    }

    /// Creates a scene from `text`: unsaved edits of the scene file at `path`. The file stays as it
    /// is until the scene is saved.
    pub fn recovered(path: &Path, text: String) -> Result<Self, SceneErrors> {
        let document = Document::parse(text, &path.display().to_string())?;
        let fingerprint = content(path).ok().flatten();
        Ok(Self { path: Some(path.to_path_buf()), document, fingerprint })
    }

    /// Parses `text` as a scene whose file names are relative to the folder of this file.
    pub fn parse(&self, text: &str, name: &str) -> Result<Scene, SceneErrors> {
        Scene::parse_in(text, name, self.document.scene().resolver.clone())
    }

    /// Returns the hash of the bytes last read or written; `None` if there are none.
    pub fn fingerprint(&self) -> Option<u64> {
        self.fingerprint
    }

    /// Returns `true` if `text` is what was last read or written. In a scene without a file, this
    /// is the text from which the scene was created.
    pub fn holds(&self, text: &str) -> bool {
        match self.path {
            Some(_) => self.fingerprint == Some(fnv1a64(text.as_bytes())),
            None => text == self.document.text(),
        }
    }

    /// Returns the text that saving the valid `scene` would write.
    pub fn text_of(&self, scene: &Scene) -> String {
        self.described(scene).text().to_string()
    }

    fn described(&self, scene: &Scene) -> Document {
        let mut document = self.document.clone();
        document.apply(scene);
        document
    }

    /// Returns the path of the scene file; `None` if the scene has no file.
    pub fn path(&self) -> Option<&Path> {
        self.path.as_deref()
    }

    /// Compares the file with the bytes last read or written.
    pub fn on_disk(&self) -> DiskState {
        self.path.as_deref().map_or(DiskState::Unchanged, |path| self.state_of(&content(path)))
    }

    fn state_of(&self, found: &io::Result<Option<u64>>) -> DiskState {
        match found {
            Ok(None) => DiskState::Missing,
            Ok(found) if *found == self.fingerprint => DiskState::Unchanged,
            _ => DiskState::Changed,
        }
    }

    /// Reads the file again. If it is not valid, only the fingerprint changes, so that a broken
    /// file is reported once.
    pub fn reload(&mut self) -> Result<(), SceneErrors> {
        let Some(path) = self.path.clone() else { return Ok(()) };
        if let Ok(found @ Some(_)) = content(&path) {
            self.fingerprint = found;
        }
        *self = Self::open_with(&path, self.document.scene().resolver.assets.clone())?;
        Ok(())
    }

    /// Writes the valid `scene` to its file, which is replaced atomically; comments, a symbolic
    /// link and permissions are kept. Fails if the scene has no file, if another program has
    /// written the file (unless `overwrite`), or if it is not a regular file.
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
        self.write(self.described(scene), &path, true)
    }

    /// Writes the valid `scene` to the file at `path`, which becomes the scene's file. The comment at
    /// the top of the old file, which describes the old scene, is kept only in a copy of it. Fails if
    /// this file exists (unless `overwrite`), or if a file that the scene names would not be found
    /// from the new folder.
    pub fn save_as(
        &mut self,
        path: &Path,
        scene: &Scene,
        overwrite: bool,
    ) -> Result<(), SaveError> {
        let resolver = &scene.resolver;
        let mut files = scene.files().map(|(_, file)| file);
        if let Some(file) = files.find(|file| resolver.breaks_when_moved(file, path)) {
            let file = sanitized(file);
            return Err(SaveError::Failed {
                path: path.to_path_buf(),
                what: format!("from there \"{file}\", which the scene names, would not be found"),
            });
        }
        let mut document = self.described(scene);
        if self.path.as_deref() != Some(path) && document.text() != self.document.text() {
            document.drop_header();
        }
        document.name = path.display().to_string();
        self.write(document, path, overwrite)?;
        resolver.move_to(path);
        self.path = Some(path.to_path_buf());
        Ok(())
    }

    /// Replaces the file at `path` atomically and durably. Fails if it exists, unless `overwrite`.
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
        self.fingerprint = Some(fnv1a64(text));
        self.document = document;
        Ok(())
    }
}

/// Returns the fingerprint of the file at `path`; `None` if there is none. Fails with
/// [`ErrorKind::InvalidInput`] if it is not a regular file.
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
