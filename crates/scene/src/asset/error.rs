//! Errors in asset files (meshes and images).

use crate::value::sanitized;
use std::fmt;
use std::path::{Path, PathBuf};

/// Location of an error in an asset file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum FileLocation {
    /// File as a whole.
    Whole,
    /// Line, counted from 1.
    Line(usize),
    /// Offset in bytes.
    Byte(usize),
    /// Part, such as `vertex 17` or `accessors[3]`.
    Part(String),
}

/// Error in an asset file that a scene names.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct AssetError {
    /// Path of the asset file.
    pub file: PathBuf,
    /// Location of the error in the file.
    pub place: FileLocation,
    /// Clause that states the error, such as `face names vertex 9, of 8`.
    pub found: String,
    /// Phrase that states what is valid, such as `a vertex below 8, their number`.
    pub expected: String,
}

impl AssetError {
    /// Creates an error about the file at `path` as a whole.
    pub(super) fn of_file(path: &Path, found: impl Into<String>, expected: &str) -> Self {
        let (file, expected) = (path.to_path_buf(), expected.to_string());
        Self { file, place: FileLocation::Whole, found: found.into(), expected }
    }

    /// Returns file, location and error: `bunny.obj:12: face names vertex 9, of 8`.
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
