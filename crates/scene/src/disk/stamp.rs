//! Stamps, by which changes of files are noticed.

use std::fs::{self, Metadata};
use std::io;
use std::os::unix::fs::MetadataExt;
use std::path::Path;
use std::time::{Duration, SystemTime};

/// Time after a write in which a further write may leave the stamp unchanged, on file systems that
/// store whole seconds.
const UNCERTAIN: Duration = Duration::from_secs(2);

/// Properties of a file that change when the file is written or replaced.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FileStamp {
    /// Time of the last write.
    pub modified: SystemTime,
    /// Time of the last change of the inode, in seconds and nanoseconds. A file that is moved into
    /// place may have any time of the last write.
    changed: [i64; 2],
    /// Length of the file.
    pub bytes: u64,
    inode: u64,
    /// Time of this look, if the file may change in the same second. Two such looks differ.
    looked: Option<SystemTime>,
}

impl FileStamp {
    /// Returns the stamp of the file at `path`; `None` if its metadata cannot be read.
    pub fn of(path: &Path) -> Option<Self> {
        fs::metadata(path).and_then(|metadata| Self::new(&metadata)).ok()
    }

    /// Returns the stamp of the file with these metadata, which are read now.
    pub fn new(metadata: &Metadata) -> io::Result<Self> {
        let modified = metadata.modified()?;
        let now = SystemTime::now();
        let is_recent = now.duration_since(modified).is_ok_and(|age| age < UNCERTAIN);
        let looked = (metadata.ctime_nsec() == 0 && is_recent).then_some(now);
        let changed = [metadata.ctime(), metadata.ctime_nsec()];
        Ok(Self { modified, changed, bytes: metadata.len(), inode: metadata.ino(), looked })
    }
}
