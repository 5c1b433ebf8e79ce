//! Recovery files: unsaved edits on disk, similar to the swap files of vim.
//!
//! The text that saving would write is kept in a hidden file beside the scene, until the scene is
//! saved or closed deliberately. The process that writes it holds a lock on it. An unlocked
//! recovery file is an orphan of a process that was killed. The lock is taken before the file gets
//! its name, so that other processes never see it unlocked.

use crate::disk::{TEMPORARY, is_own, lock, open_regular_with, user_name};
use crate::format::read::MAX_BYTES;
use crate::value::fnv1a64;
use std::cmp::Reverse;
use std::ffi::{OsStr, OsString};
use std::fs::{self, DirBuilder, File, Metadata, TryLockError};
use std::io::{self, ErrorKind, Read, Write};
use std::os::unix::fs::{DirBuilderExt, MetadataExt};
use std::path::{Path, PathBuf};
use std::time::SystemTime;
use tempfile::NamedTempFile;

/// Largest number of recovery files of one scene in one folder.
const MAX_FILES: u32 = 9;
/// Beginning of a recovery file; the fingerprint of the scene file follows.
const HEAD: &str = "# Unsaved edits, kept by zerkalo. The file was ";
/// Word in place of the fingerprint, if the scene has no file.
const NO_FILE: &str = "none";

/// Writer and finder of the recovery files of one scene.
#[derive(Debug)]
pub struct Recovery {
    /// Folder of the scene file, and name of the recovery file in it; `None` without a scene file.
    beside: Option<(PathBuf, OsString)>,
    /// State folder, for files that cannot be written `beside` the scene, and name of the file in
    /// it.
    state: Option<(PathBuf, OsString)>,
    saved: Option<Saved>,
}

/// Recovery file of this process, and the handle that holds its lock.
#[derive(Debug)]
struct Saved {
    path: PathBuf,
    file: File,
}

/// Result of the search for recovery files of a scene.
#[derive(Debug, Default)]
pub struct RecoveryFile {
    /// Unsaved edits of killed processes; the newest first.
    pub orphans: Vec<Orphan>,
    /// Recovery files that cannot be read, with the reason.
    pub unreadable: Vec<(PathBuf, String)>,
    /// Recovery files of other users, which are not read, with the name or number of the user.
    pub foreign: Vec<(PathBuf, String)>,
    /// `true` if another running process has unsaved edits of the scene.
    pub elsewhere: bool,
}

/// Unsaved edits of a killed process. Its recovery file stays locked, so that other processes do
/// not offer these edits.
#[derive(Debug)]
pub struct Orphan {
    kept: Saved,
    /// Text that saving would have written to the scene file.
    pub text: String,
    /// Fingerprint of the scene file that was edited; `None` if there was none or it is unknown.
    pub base: Option<u64>,
    /// Time at which the recovery file was written.
    pub written: SystemTime,
}

/// Returns the program's folder in the user's state folder (XDG Base Directory Specification), for
/// scenes without a file or in a folder that is not writable. `variable` returns the value of an
/// environment variable. Returns `None` if neither `XDG_STATE_HOME` nor `HOME` is an absolute path.
pub fn state_folder(variable: impl Fn(&str) -> Option<OsString>) -> Option<PathBuf> {
    let absolute = |name| variable(name).map(PathBuf::from).filter(|path| path.is_absolute());
    let folder = absolute("XDG_STATE_HOME");
    let folder = folder.or_else(|| absolute("HOME").map(|home| home.join(".local/state")));
    folder.map(|folder| folder.join("zerkalo"))
}

impl Recovery {
    /// Creates the writer and finder for the scene at `path`; without a path, for a scene that has
    /// no file and is called `name`. `state` is the [`state_folder`].
    pub fn new(path: Option<&Path>, name: &str, state: Option<&Path>) -> Self {
        let mut beside = None;
        let stem = match path {
            Some(path) => {
                // Every path to the same scene file gives the same name of the recovery file.
                let canonical = fs::canonicalize(path).or_else(|_| std::path::absolute(path));
                let canonical = canonical.unwrap_or_else(|_| path.to_path_buf());
                let name = canonical.file_name().unwrap_or(OsStr::new("scene")).to_os_string();
                let mut hidden = OsString::from(".");
                hidden.push(&name);
                hidden.push(".unsaved");
                let folder = canonical.parent().filter(|folder| !folder.as_os_str().is_empty());
                beside = Some((folder.unwrap_or(Path::new(".")).to_path_buf(), hidden));
                let hash = fnv1a64(canonical.as_os_str().as_encoded_bytes());
                format!("{:.40}-{hash:016x}", name.to_string_lossy())
            }
            None => format!("{:.40}", name.replace('/', "-")),
        };
        let state = state.map(|folder| (folder.to_path_buf(), format!("{stem}.unsaved").into()));
        Self { beside, state, saved: None }
    }

    /// Returns folder and file name of each place for the recovery file, the preferred place first.
    fn candidates(&self) -> impl Iterator<Item = &(PathBuf, OsString)> {
        self.beside.iter().chain(&self.state)
    }

    /// Returns a writer and finder for the same scene that uses only the state folder.
    pub fn elsewhere(&self) -> Self {
        Self { beside: None, state: self.state.clone(), saved: None }
    }

    /// Returns the path of the recovery file; `None` if none is written.
    pub fn path(&self) -> Option<&Path> {
        self.saved.as_ref().map(|saved| saved.path.as_path())
    }

    /// Writes the recovery file: the `text` that saving would write, and `base`, the fingerprint of
    /// the scene file that saving would replace. If no folder is writable, the previous recovery
    /// file stays.
    pub fn keep(&mut self, text: &str, base: Option<u64>) -> io::Result<()> {
        let base = base.map_or(NO_FILE.to_string(), |base| format!("{base:016x}"));
        let text = format!("{HEAD}{base}.\n{text}");
        if let Some(saved) = self.saved.as_mut().filter(|saved| saved.has_its_name()) {
            let folder = saved.path.parent().unwrap_or(Path::new("."));
            saved.file = locked_temporary(folder, &text)?.persist(&saved.path)?;
            return Ok(());
        }
        self.saved = None;
        let mut kept = Err(io::Error::new(ErrorKind::NotFound, "no folder to keep them in"));
        for (folder, name) in self.candidates() {
            kept = kept.or_else(|_| create_numbered(folder, name, &text));
        }
        self.saved = Some(kept?);
        Ok(())
    }

    /// Removes the recovery file.
    pub fn forget(&mut self) {
        if let Some(saved) = self.saved.take() {
            saved.remove();
        }
    }

    /// Finds the unsaved edits that killed processes have left. Empty files are removed.
    pub fn find(&self) -> RecoveryFile {
        let mut found = RecoveryFile::default();
        for (folder, name) in self.candidates() {
            for number in 1..=MAX_FILES {
                let path = folder.join(numbered(name, number));
                if self.path() == Some(&*path) {
                    continue;
                }
                match read_orphan(&path) {
                    Ok(Found::Orphan(lost)) if lost.text.trim().is_empty() => lost.kept.remove(),
                    Ok(Found::Orphan(lost)) => found.orphans.push(lost),
                    Ok(Found::OfUser(id)) => found.foreign.push((path, user_name(id))),
                    Ok(Found::Nothing) => {}
                    Err(error) if error.kind() == ErrorKind::WouldBlock => found.elsewhere = true,
                    Err(error) => found.unreadable.push((path, error.to_string())),
                }
            }
        }
        found.orphans.sort_by_key(|lost| Reverse(lost.written));
        found
    }

    /// Makes the file of `lost` the recovery file of this process; an earlier one is removed.
    pub fn adopt(&mut self, lost: Orphan) {
        self.forget();
        self.saved = Some(lost.kept);
    }
}

impl Orphan {
    /// Returns the path of the recovery file.
    pub fn path(&self) -> &Path {
        &self.kept.path
    }

    /// Removes the recovery file.
    pub fn discard(self) {
        self.kept.remove();
    }
}

impl Saved {
    /// Returns `true` if the path still leads to the locked file.
    fn has_its_name(&self) -> bool {
        let named = fs::symlink_metadata(&self.path);
        self.file.metadata().is_ok_and(|saved| named.is_ok_and(|named| is_same(&saved, &named)))
    }

    /// Removes the recovery file, then releases its lock.
    fn remove(self) {
        if self.has_its_name() {
            // A file that cannot be removed is found, and reported, at the next start.
            let _ = fs::remove_file(&self.path);
        }
    }
}

fn is_same(a: &Metadata, b: &Metadata) -> bool {
    (a.dev(), a.ino()) == (b.dev(), b.ino())
}

/// Returns `name` for the number 1, `name-2` for 2, `name-3` for 3.
fn numbered(name: &OsStr, number: u32) -> OsString {
    let mut name = name.to_os_string();
    if number > 1 {
        name.push(format!("-{number}"));
    }
    name
}

/// Creates a locked temporary file in `folder` with the content `text`, readable by the user only.
fn locked_temporary(folder: &Path, text: &str) -> io::Result<NamedTempFile> {
    let [prefix, suffix] = TEMPORARY;
    let mut file = tempfile::Builder::new().prefix(prefix).suffix(suffix).tempfile_in(folder)?;
    lock(&file);
    file.write_all(text.as_bytes())?;
    file.as_file().sync_data()?;
    Ok(file)
}

/// Writes `text` to a new locked recovery file: `name`, `name-2`, `name-3` and so on.
fn create_numbered(folder: &Path, name: &OsStr, text: &str) -> io::Result<Saved> {
    DirBuilder::new().recursive(true).mode(0o700).create(folder)?;
    let mut file = locked_temporary(folder, text)?;
    for number in 1..=MAX_FILES {
        let path = folder.join(numbered(name, number));
        match file.persist_noclobber(&path) {
            Ok(file) => return Ok(Saved { path, file }),
            Err(taken) if taken.error.kind() == ErrorKind::AlreadyExists => file = taken.file,
            Err(failed) => return Err(failed.error),
        }
    }
    let name = name.display();
    Err(io::Error::new(
        ErrorKind::AlreadyExists,
        format!("{MAX_FILES} files {name} are there already"),
    ))
}

/// Opens the recovery file. Some file systems lock only files that are open for writing.
fn open(path: &Path) -> io::Result<File> {
    open_regular_with(File::options().read(true).write(true), path)
}

/// Result of opening a recovery file.
enum Found {
    Nothing,
    /// The file belongs to the user with this number.
    OfUser(u32),
    Orphan(Orphan),
}

/// Reads the recovery file at `path`. Fails with [`ErrorKind::WouldBlock`] if a running process
/// holds the lock.
fn read_orphan(path: &Path) -> io::Result<Found> {
    let folder = path.parent().unwrap_or(Path::new("."));
    // Another process may replace the file after it was opened.
    for _ in 0..5 {
        // The target of a symbolic link is never opened.
        match fs::symlink_metadata(path) {
            Ok(metadata) if !metadata.is_file() => {
                return Err(io::Error::other("it is not a regular file"));
            }
            Ok(metadata) if !is_own(&metadata, folder) => return Ok(Found::OfUser(metadata.uid())),
            Ok(_) => {}
            Err(error) if error.kind() == ErrorKind::NotFound => return Ok(Found::Nothing),
            Err(error) => return Err(error),
        }
        let kept = match open(path) {
            Ok(file) => Saved { path: path.to_path_buf(), file },
            Err(error) if error.kind() == ErrorKind::NotFound => return Ok(Found::Nothing),
            Err(error) => return Err(error),
        };
        let metadata = kept.file.metadata()?;
        if !is_own(&metadata, folder) {
            return Ok(Found::OfUser(metadata.uid()));
        }
        match kept.file.try_lock() {
            Err(TryLockError::WouldBlock) => return Err(ErrorKind::WouldBlock.into()),
            // File systems without locks report an error: the file counts as unlocked.
            Ok(()) | Err(TryLockError::Error(_)) => {}
        }
        if kept.has_its_name() {
            return read(kept).map(Found::Orphan);
        }
    }
    Err(ErrorKind::WouldBlock.into())
}

/// Reads text, fingerprint and time of writing from the recovery file `kept`.
fn read(kept: Saved) -> io::Result<Orphan> {
    let mut bytes = Vec::new();
    (&kept.file).take(MAX_BYTES + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > MAX_BYTES {
        return Err(io::Error::other(format!("it is larger than {} MiB", MAX_BYTES >> 20)));
    }
    let text = String::from_utf8(bytes).map_err(|_| io::Error::other("it is not UTF-8 text"))?;
    let written = kept.file.metadata()?.modified()?;
    let head = text.strip_prefix(HEAD).and_then(|rest| rest.split_once(".\n"));
    let (base, text) = match head {
        Some((base, text)) => (u64::from_str_radix(base, 16).ok(), text.to_string()),
        None => (None, text),
    };
    Ok(Orphan { kept, text, base, written })
}
