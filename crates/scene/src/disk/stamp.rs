//! Stamp of a file, by which a replaced or changed file is recognised.

use std::fs;
use std::path::Path;
use std::time::SystemTime;

/// Properties of a file that change when it is written or replaced.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FileStamp {
    /// Time of the last modification.
    pub modified: SystemTime,
    length: u64,
    inode: u64,
}

impl FileStamp {
    /// Returns the stamp of the file at `path`, or `None` if there is no such file.
    pub fn of(path: &Path) -> Option<Self> {
        let metadata = fs::metadata(path).ok()?;
        let inode = std::os::unix::fs::MetadataExt::ino(&metadata);
        Some(Self { modified: metadata.modified().ok()?, length: metadata.len(), inode })
    }
}
