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
        let mut claim = Self { path: path.to_path_buf(), locked: None, owned: false };
        claim.renew().map(|()| claim)
    }

    /// Returns `true` if the file exists, but its file system has no locks.
    pub fn is_unlocked(&self) -> bool {
        self.owned && self.locked.is_none()
    }

    /// Calls `write`, which replaces the file, and claims the new one.
    ///
    /// # Errors
    /// Fails with the error of `write`, or if another process has created the file in the meantime.
    pub fn replace<T>(
        &mut self,
        write: impl FnOnce(&Path) -> Result<T, WriteError>,
    ) -> Result<T, WriteError> {
        if !self.owned && self.path.exists() {
            return Err(self.refused());
        }
        let result = write(&self.path)?;
        self.renew().map(|()| result)
    }

    /// Locks the file that is at the path now.
    fn renew(&mut self) -> Result<(), WriteError> {
        // Another process may replace the file between the opening and the lock.
        loop {
            let Ok(file) = open_regular(&self.path) else {
                self.owned = self.path.exists();
                return Ok(());
            };
            match file.try_lock() {
                Err(TryLockError::WouldBlock) => return Err(self.refused()),
                Err(TryLockError::Error(_)) => {
                    self.owned = true;
                    return Ok(());
                }
                Ok(()) => {}
            }
            let inode = file.metadata().map(|opened| opened.ino()).ok();
            if inode == fs::metadata(&self.path).map(|named| named.ino()).ok() {
                (self.locked, self.owned) = (Some(file), true);
                return Ok(());
            }
        }
    }

    fn refused(&self) -> WriteError {
        let what = "another process is writing it";
        let remedy = "wait until that process ends or name another file";
        WriteError::new(&self.path, ErrorKind::WouldBlock, what, remedy)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_process_at_a_time_replaces_a_file() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.zk");
        let write = |path: &Path| crate::disk::write(path, b"film");
        let mut early = Claim::new(&path).unwrap();
        let mut other = Claim::new(&path).unwrap();
        early.replace(write).unwrap();
        for error in [other.replace(write).unwrap_err(), Claim::new(&path).unwrap_err()] {
            assert_eq!(error.kind, ErrorKind::WouldBlock);
            assert!(error.to_string().contains("another process is writing it"), "{error}");
        }
        // The new file is claimed, too.
        early.replace(write).unwrap();
        assert!(Claim::new(&path).is_err());
        drop(early);
        let mut next = Claim::new(&path).unwrap();
        next.replace(write).unwrap();
        assert!(!next.is_unlocked());
    }
}
