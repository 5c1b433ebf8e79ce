//! Errors in asset files.

use crate::value::sanitized;
use std::fmt;
use std::path::PathBuf;

/// Location in a file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum FileLocation {
    /// The file as a whole.
    Whole,
    /// A line, counted from 1.
    Line(usize),
    /// A byte, counted from 0.
    Byte(usize),
    /// A named part, such as `vertex 17` or `accessors[3]`.
    Part(String),
}

/// Error in an asset file that a scene names.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct AssetError {
    /// The file.
    pub file: PathBuf,
    /// Location of the error in the file.
    pub place: FileLocation,
    /// Phrase that states the error in the file.
    pub found: String,
    /// Phrase that states the valid content.
    pub expected: String,
}

impl AssetError {
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
