//! Opening of plan files and film files, and their errors.

use std::fmt;
use std::fs::File;
use std::io::{ErrorKind, Read};
use std::path::{Path, PathBuf};
use zerkalo_scene::disk::open_regular;

/// Error that makes a plan file or a film file unusable.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FileError {
    pub path: PathBuf,
    /// Line of the error, counted from 1; 0 for the file as a whole.
    pub line: usize,
    /// Clause about what was found and expected.
    pub what: String,
    /// Advice to the user, as a clause.
    pub remedy: String,
}

impl fmt::Display for FileError {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "cannot use {}", self.path.display())?;
        if self.line > 0 {
            write!(f, ":{}", self.line)?;
        }
        write!(f, ": {}; {}", self.what, self.remedy)
    }
}

impl std::error::Error for FileError {}

impl FileError {
    /// Creates an error of a file as a whole.
    pub fn new(path: &Path, what: impl Into<String>, remedy: &str) -> Self {
        Self { path: path.into(), line: 0, what: what.into(), remedy: remedy.to_string() }
    }
}

/// Opens a regular file and returns it with its length in bytes.
pub(super) fn open(path: &Path) -> Result<(File, u64), FileError> {
    let opened = open_regular(path).and_then(|file| Ok((file.metadata()?.len(), file)));
    opened.map(|(length, file)| (file, length)).map_err(|e| match e.kind() {
        ErrorKind::NotFound => FileError::new(path, "there is no such file", "check its name"),
        ErrorKind::InvalidInput => FileError::new(path, e.to_string(), "name a file"),
        _ => FileError::new(path, e.to_string(), "check its name and permissions"),
    })
}

/// Returns `true` if the regular file at `path` begins with `start`.
pub(super) fn begins_with<const N: usize>(path: &Path, start: &[u8; N]) -> bool {
    let mut found = [0; N];
    open_regular(path).and_then(|mut file| file.read_exact(&mut found)).is_ok() && found == *start
}
