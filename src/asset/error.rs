//! Errors in asset files.

use crate::value::sanitized;
use std::fmt;
use std::path::PathBuf;

/// Place in a file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum FileLocation {
    /// The file as a whole.
    Whole,
    /// A line, from 1.
    Line(usize),
    /// A byte, from 0.
    Byte(usize),
    /// A named part: `vertex 17`, `accessors[3]`.
    Part(String),
}

/// Error in a file that a scene names.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct AssetError {
    /// The file.
    pub file: PathBuf,
    /// Place in the file.
    pub place: FileLocation,
    /// Phrase that states the error.
    pub found: String,
    /// Phrase that states the valid content.
    pub expected: String,
}

impl AssetError {
    /// Returns file, place and error: `bunny.obj:12: face names vertex 9, of 8`.
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
