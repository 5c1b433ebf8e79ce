//! Claims: a file that one process continues is locked, so that no second process replaces it.

use crate::disk::{WriteError, open_regular};
use std::fs::{self, File, TryLockError};
use std::io::ErrorKind;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};

/// Right to replace a file. The death of the process ends it.
#[derive(Debug)]
pub struct Claim {
    path: PathBuf,
    /// Open file at `path` with its lock. `None` if there is no file, or if it cannot be locked.
    locked: Option<File>,
    /// `true` if the file at `path` was claimed or written by this process.
    owned: bool,
}

impl Claim {
    /// Claims the file at `path`, which need not exist. File systems without locks grant every
    /// claim.
    ///
    /// # Errors
    /// Returns [`ErrorKind::WouldBlock`] if another process holds the claim.
    pub fn new(path: &Path) -> Result<Self, WriteError> {
        let claim = |locked, owned| Self { path: path.to_path_buf(), locked, owned };
        // Another process may replace the file between the opening and the lock.
        loop {
            let Ok(file) = open_regular(path) else {
                return Ok(claim(None, path.exists()));
            };
            match file.try_lock() {
                Err(TryLockError::WouldBlock) => return Err(refused(path)),
                Err(TryLockError::Error(_)) => return Ok(claim(None, true)),
                Ok(()) => {}
            }
            let inode = file.metadata().map(|opened| opened.ino()).ok();
            if inode == fs::metadata(path).map(|named| named.ino()).ok() {
                return Ok(claim(Some(file), true));
            }
        }
    }

    /// Returns `true` if the file exists, but its file system has no locks.
    pub fn is_unlocked(&self) -> bool {
        self.owned && self.locked.is_none()
    }

    /// Returns `true` if the file existed when it was claimed, or was written since.
    pub fn has_file(&self) -> bool {
        self.owned
    }

    /// Path of the claimed file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Checks that the file may be replaced.
    ///
    /// # Errors
    /// Fails if another process has created the file after this claim.
    pub fn check(&self) -> Result<(), WriteError> {
        if self.owned || !self.path.exists() { Ok(()) } else { Err(refused(&self.path)) }
    }

    /// Continues the claim with `file`, which has replaced the claimed file. It was written with
    /// its lock, so that there is no moment at which another process can claim it.
    pub fn keep(&mut self, file: File) {
        // A file system without locks does not lock this file either.
        (self.locked, self.owned) = (Some(file), true);
    }
}

fn refused(path: &Path) -> WriteError {
    let what = "another process is writing it";
    let remedy = "wait until that process ends or name another file";
    WriteError::new(path, ErrorKind::WouldBlock, what, remedy)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::disk::{Existing, replace_file};

    #[test]
    fn one_process_at_a_time_replaces_a_file() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.zk");
        let write = || replace_file(&path, Existing::Replace, |_| Ok(())).unwrap();
        let mut early = Claim::new(&path).unwrap();
        let other = Claim::new(&path).unwrap();
        early.keep(write());
        for error in [other.check().unwrap_err(), Claim::new(&path).unwrap_err()] {
            assert_eq!(error.kind, ErrorKind::WouldBlock);
            assert!(error.to_string().contains("another process is writing it"), "{error}");
        }
        // The new file is claimed, too.
        let file = write();
        assert!(Claim::new(&path).is_err());
        early.keep(file);
        assert!(early.check().is_ok() && Claim::new(&path).is_err());
        drop(early);
        let mut next = Claim::new(&path).unwrap();
        next.keep(write());
        assert!(!next.is_unlocked());
    }
}
