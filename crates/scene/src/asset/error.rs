//! Errors in asset files (meshes and images).

use crate::value::sanitized;
use std::fmt;
use std::path::{Path, PathBuf};

/// Location of an error in an asset file: a line, a byte offset, a named part, or the whole file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum FileLocation {
    /// No location: the error concerns the file as a whole.
    Whole,
    /// Line of the error in a text file, counted from 1.
    Line(usize),
    /// Offset of the error in the file, in bytes counted from 0.
    Byte(usize),
    /// Name of the part with the error, such as `vertex 17` or `accessors[3]`.
    Part(String),
}

/// Error in an asset file that a scene names.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct AssetError {
    /// Path of the asset file.
    pub file: PathBuf,
    /// Location of the error in the file.
    pub place: FileLocation,
    /// Clause without a full stop that states the error, such as `face names vertex 9, of 8`. The
    /// message consists of file, location and this clause.
    pub found: String,
    /// Phrase that states the valid content at this location, such as `a vertex below 8, their
    /// number`.
    pub expected: String,
}

impl AssetError {
    /// Creates an error about the file at `path` as a whole. `found` and `expected` become the
    /// fields of these names in [`AssetError`].
    pub(super) fn of_file(path: &Path, found: impl Into<String>, expected: &str) -> Self {
        let (file, expected) = (path.to_path_buf(), expected.to_string());
        Self { file, place: FileLocation::Whole, found: found.into(), expected }
    }

    /// Returns the file, the location and the error, such as `bunny.obj:12: face names vertex 9, of
    /// 8`.
    pub fn what(&self) -> String {
        let file = self.file.display();
        let place = match &self.place {
            FileLocation::Whole => String::new(),
            FileLocation::Line(line) => format!(":{line}"),
            FileLocation::Byte(byte) => format!(", byte {byte}"),
            FileLocation::Part(part) => format!(", {part}"),
        };
        sanitized(&format!("{file}{place}: {}", self.found))
    }
}

impl fmt::Display for AssetError {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{}. Expected {}.", self.what(), self.expected)
    }
}

impl std::error::Error for AssetError {}
