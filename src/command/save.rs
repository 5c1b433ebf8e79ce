//! Files that must not be lost: the claim of a checkpoint, and last writes, which are repeated.

use crate::command::{Failure, warn};
use std::io::ErrorKind;
use std::path::Path;
use std::thread::sleep;
use std::time::{Duration, Instant};
use zerkalo_scene::disk::{Claim, WriteError};

/// Time for which another process may hold the claim of a file.
const CLAIM_PATIENCE: Duration = Duration::from_secs(60);
/// Interval between attempts to claim a file.
const CLAIM_POLL: Duration = Duration::from_millis(200);
/// Time for which a failed last write is repeated.
const WRITE_PATIENCE: Duration = Duration::from_secs(300);
/// Longest pause between two attempts to write.
const LONGEST_PAUSE: Duration = Duration::from_secs(10);

/// Claims the file at `path`. Waits for another process that writes it.
pub fn claim(path: &Path) -> Result<Claim, Failure> {
    let end = Instant::now() + CLAIM_PATIENCE;
    let mut warned = false;
    loop {
        match Claim::new(path) {
            Err(error) if error.kind == ErrorKind::WouldBlock && Instant::now() < end => {
                if !std::mem::replace(&mut warned, true) {
                    let seconds = CLAIM_PATIENCE.as_secs();
                    warn(&format!("note: {error}; waiting for up to {seconds} s"));
                }
                sleep(CLAIM_POLL);
            }
            Err(error) => return Err(error.into()),
            Ok(claim) => {
                if claim.is_unlocked() {
                    let path = path.display();
                    warn(&format!(
                        "note: the file system of {path} has no locks; let only one process write it"
                    ));
                }
                return Ok(claim);
            }
        }
    }
}

/// Calls `write` again after a failure that may pass, such as a full disk, for five minutes.
pub fn persist<T>(mut write: impl FnMut() -> Result<T, WriteError>) -> Result<T, WriteError> {
    let end = Instant::now() + WRITE_PATIENCE;
    let mut pause = Duration::from_secs(1);
    loop {
        match write() {
            Err(error) if may_pass(error.kind) && Instant::now() + pause < end => {
                warn(&format!("warning: {error}; trying again in {} s", pause.as_secs()));
                sleep(pause);
                pause = (2 * pause).min(LONGEST_PAUSE);
            }
            result => return result,
        }
    }
}

/// Returns `false` for errors that a repetition does not change.
fn may_pass(kind: ErrorKind) -> bool {
    let lasting = [
        ErrorKind::AlreadyExists,
        ErrorKind::FileTooLarge,
        ErrorKind::InvalidFilename,
        ErrorKind::InvalidInput,
        ErrorKind::IsADirectory,
        ErrorKind::Unsupported,
        // Another process has created the file.
        ErrorKind::WouldBlock,
    ];
    !lasting.contains(&kind)
}
