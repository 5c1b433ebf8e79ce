//! Stamps, by which changes of files are noticed.

use std::fs;
use std::os::unix::fs::MetadataExt;
use std::path::Path;
use std::time::SystemTime;

/// Properties of a file that change when the file is written or replaced.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FileStamp {
    /// Time of the last write.
    pub modified: SystemTime,
    bytes: u64,
    inode: u64,
}

impl FileStamp {
    /// Returns the stamp of the file at `path`; `None` if its metadata cannot be read.
    pub fn of(path: &Path) -> Option<Self> {
        let metadata = fs::metadata(path).ok()?;
        let modified = metadata.modified().ok()?;
        Some(Self { modified, bytes: metadata.len(), inode: metadata.ino() })
    }
}
