//! Unsaved edits, kept where the next start finds them.
//!
//! A program that is killed loses what only its memory holds. So the text that saving would write is
//! put into a hidden file beside the scene, complete or not at all, and taken away when the scene is
//! saved or left on purpose. Whoever keeps such a file holds a lock on it, which ends with the process,
//! however that ends: a file that nobody has locked was left behind. The lock is taken before the file
//! gets its name, so that no file of somebody alive is ever seen without it.

use crate::value::fnv1a64;
use std::ffi::{OsStr, OsString};
use std::fs::{self, DirBuilder, File, Metadata, TryLockError};
use std::io::{self, ErrorKind, Read, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};
use tempfile::NamedTempFile;

/// Files of one scene in one folder: so many sessions can be lost one after another, or run side by
/// side.
const MOST: u32 = 9;
/// A larger file is no scene [bytes].
const MAX_BYTES: u64 = 64 << 20;
/// How the first line begins; the fingerprint of the scene's file follows.
const HEAD: &str = "# Unsaved edits, kept by zerkalo. The file was ";
/// In the place of the fingerprint if there was no file.
const NO_FILE: &str = "none";
/// What temporary files are called, before and after what makes them different.
pub(super) const TEMPORARY: [&str; 2] = [".zerkalo-", ".tmp"];
/// A temporary file that nobody has locked for so long was left behind.
const SWEPT_AFTER: Duration = Duration::from_secs(60);

/// Where the unsaved edits of a scene are kept.
#[derive(Debug)]
pub struct Recovery {
    /// Folder and first name, in the order in which they are tried.
    homes: Vec<(PathBuf, OsString)>,
    own: Option<Saved>,
}

/// A file with a lock on it.
#[derive(Debug)]
struct Saved {
    path: PathBuf,
    file: File,
}

/// What was found at the start.
#[derive(Debug, Default)]
pub struct RecoveryFile {
    /// Edits that were left behind, the newest first.
    pub lost: Vec<Orphan>,
    /// Files that cannot be read, and why. They stay.
    pub unreadable: Vec<(PathBuf, String)>,
    /// Somebody who is alive has unsaved edits.
    pub elsewhere: bool,
}

/// Edits that were left behind. Nobody else finds them while this exists.
#[derive(Debug)]
pub struct Orphan {
    kept: Saved,
    /// The scene's file as it would have been saved.
    pub text: String,
    /// [`crate::scene::SceneFile::fingerprint`] of what was edited; `None`: it was in no file, or it is not
    /// known.
    pub base: Option<u64>,
    /// When they were written.
    pub written: SystemTime,
}

/// The user's folder for what programs remember (XDG Base Directory Specification), by the `variable`s
/// of the environment: where the edits are kept of scenes that have no file, or one in a folder that
/// cannot be written.
pub fn state_folder(variable: impl Fn(&str) -> Option<OsString>) -> Option<PathBuf> {
    let absolute = |name| variable(name).map(PathBuf::from).filter(|path| path.is_absolute());
    let folder = absolute("XDG_STATE_HOME");
    let folder = folder.or_else(|| absolute("HOME").map(|home| home.join(".local/state")));
    folder.map(|folder| folder.join("zerkalo"))
}

impl Recovery {
    /// Of the scene in the file at `path`; without one, of the scene called `name`. `state`:
    /// [`state_folder`].
    pub fn of(path: Option<&Path>, name: &str, state: Option<&Path>) -> Self {
        let mut homes = Vec::new();
        let called = match path {
            Some(path) => {
                // However it is named, it is the same file.
                let real = fs::canonicalize(path).or_else(|_| std::path::absolute(path));
                let real = real.unwrap_or_else(|_| path.to_path_buf());
                let name = real.file_name().unwrap_or(OsStr::new("scene")).to_os_string();
                let mut hidden = OsString::from(".");
                hidden.push(&name);
                hidden.push(".unsaved");
                let folder = real.parent().filter(|folder| !folder.as_os_str().is_empty());
                homes.push((folder.unwrap_or(Path::new(".")).to_path_buf(), hidden));
                let hash = fnv1a64(real.as_os_str().as_encoded_bytes());
                format!("{:.40}-{hash:016x}", name.to_string_lossy())
            }
            None => format!("{:.40}", name.replace('/', "-")),
        };
        homes
            .extend(state.map(|folder| (folder.to_path_buf(), format!("{called}.unsaved").into())));
        Self { homes, own: None }
    }

    /// The file that these edits are kept in.
    pub fn path(&self) -> Option<&Path> {
        self.own.as_ref().map(|own| own.path.as_path())
    }

    /// Keeps `text`, what saving would write over a file with the fingerprint `base`.
    ///
    /// # Errors
    /// If it can be written nowhere; what was kept before stays.
    pub fn keep(&mut self, text: &str, base: Option<u64>) -> io::Result<()> {
        let base = base.map_or(NO_FILE.to_string(), |base| format!("{base:016x}"));
        let text = format!("{HEAD}{base}.\n{text}");
        if let Some(own) = self.own.as_mut().filter(|own| own.is_there()) {
            let folder = own.path.parent().unwrap_or(Path::new("."));
            own.file = filled(folder, &text)?.persist(&own.path)?;
            return Ok(());
        }
        self.own = None;
        let mut failed = io::Error::new(ErrorKind::NotFound, "no folder to keep them in");
        for (folder, name) in &self.homes {
            match begun(folder, name, &text) {
                Ok(kept) => {
                    self.own = Some(kept);
                    return Ok(());
                }
                Err(error) => failed = error,
            }
        }
        Err(failed)
    }

    /// Nothing is unsaved any more.
    pub fn forget(&mut self) {
        if let Some(own) = self.own.take() {
            own.remove();
        }
    }

    /// Looks for what was left behind. What is empty is removed.
    pub fn find(&self) -> RecoveryFile {
        let mut found = RecoveryFile::default();
        for (folder, name) in &self.homes {
            for number in 1..=MOST {
                let path = folder.join(numbered(name, number));
                if self.path() == Some(&*path) {
                    continue;
                }
                match left_behind(&path) {
                    Ok(Some(lost)) if lost.text.trim().is_empty() => lost.kept.remove(),
                    Ok(Some(lost)) => found.lost.push(lost),
                    Ok(None) => {}
                    Err(error) if error.kind() == ErrorKind::WouldBlock => found.elsewhere = true,
                    Err(error) => found.unreadable.push((path, error.to_string())),
                }
            }
        }
        found.lost.sort_by_key(|lost| std::cmp::Reverse(lost.written));
        found
    }

    /// These edits are the ones of this session from now on.
    pub fn take_up(&mut self, lost: Orphan) {
        self.forget();
        self.own = Some(lost.kept);
    }
}

impl Orphan {
    /// The file that holds them.
    pub fn path(&self) -> &Path {
        &self.kept.path
    }

    /// They are not wanted any more.
    pub fn discard(self) {
        self.kept.remove();
    }
}

impl Saved {
    /// Whether the file still has its name.
    fn is_there(&self) -> bool {
        let named = fs::symlink_metadata(&self.path);
        self.file.metadata().is_ok_and(|own| named.is_ok_and(|named| is_same(&own, &named)))
    }

    /// Removes it, before the lock goes.
    fn remove(self) {
        if self.is_there() {
            // What cannot be removed is found again, and told, at the next start.
            let _ = fs::remove_file(&self.path);
        }
    }
}

#[cfg(unix)]
fn is_same(a: &Metadata, b: &Metadata) -> bool {
    use std::os::unix::fs::MetadataExt;
    (a.dev(), a.ino()) == (b.dev(), b.ino())
}

#[cfg(not(unix))]
fn is_same(a: &Metadata, b: &Metadata) -> bool {
    a.created().ok() == b.created().ok()
}

/// `name`, `name-2`, `name-3`.
fn numbered(name: &OsStr, number: u32) -> OsString {
    let mut name = name.to_os_string();
    if number > 1 {
        name.push(format!("-{number}"));
    }
    name
}

/// Marks a temporary file as somebody's who is alive. Where files cannot be locked that is not known.
pub(super) fn lock(temporary: &NamedTempFile) {
    let _ = temporary.as_file().try_lock();
}

/// A file in `folder` that has no name yet, with `text` in it, locked, for the user's eyes only.
fn filled(folder: &Path, text: &str) -> io::Result<NamedTempFile> {
    let [prefix, suffix] = TEMPORARY;
    let mut file = tempfile::Builder::new().prefix(prefix).suffix(suffix).tempfile_in(folder)?;
    lock(&file);
    file.write_all(text.as_bytes())?;
    file.as_file().sync_data()?;
    Ok(file)
}

/// Puts `text` into a new file under the first name that is free.
fn begun(folder: &Path, name: &OsStr, text: &str) -> io::Result<Saved> {
    let mut folders = DirBuilder::new();
    folders.recursive(true);
    #[cfg(unix)]
    std::os::unix::fs::DirBuilderExt::mode(&mut folders, 0o700);
    folders.create(folder)?;
    let mut file = filled(folder, text)?;
    for number in 1..=MOST {
        let path = folder.join(numbered(name, number));
        match file.persist_noclobber(&path) {
            Ok(file) => return Ok(Saved { path, file }),
            Err(taken) if taken.error.kind() == ErrorKind::AlreadyExists => file = taken.file,
            Err(failed) => return Err(failed.error),
        }
    }
    let name = name.display();
    Err(io::Error::new(ErrorKind::AlreadyExists, format!("{MOST} files {name} are there already")))
}

/// Also for writing, without which some file systems lock nothing.
fn open(path: &Path) -> io::Result<File> {
    File::options().read(true).write(true).open(path)
}

/// What is in the file at `path`; `None`: there is no such file.
///
/// # Errors
/// [`ErrorKind::WouldBlock`] if somebody alive has it; or if it cannot be read.
fn left_behind(path: &Path) -> io::Result<Option<Orphan>> {
    // In a moment somebody may replace the file that was opened: then there is another one to look at.
    for _ in 0..5 {
        // Looked at before it is opened: to open a pipe, say, could take for ever.
        match fs::symlink_metadata(path) {
            Ok(metadata) if metadata.is_file() => {}
            Ok(_) => return Err(io::Error::other("it is not a regular file")),
            Err(error) if error.kind() == ErrorKind::NotFound => return Ok(None),
            Err(error) => return Err(error),
        }
        let kept = match open(path) {
            Ok(file) => Saved { path: path.to_path_buf(), file },
            Err(error) if error.kind() == ErrorKind::NotFound => return Ok(None),
            Err(error) => return Err(error),
        };
        match kept.file.try_lock() {
            Err(TryLockError::WouldBlock) => return Err(ErrorKind::WouldBlock.into()),
            // Where files cannot be locked nobody has.
            Ok(()) | Err(TryLockError::Error(_)) => {}
        }
        if kept.is_there() {
            return read(kept).map(Some);
        }
    }
    Err(ErrorKind::WouldBlock.into())
}

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

/// Files in `folder` that hold unsaved edits.
pub fn kept_in(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    let is_kept = |entry: &fs::DirEntry| entry.file_name().to_string_lossy().contains(".unsaved");
    let mut kept: Vec<_> = entries.filter(is_kept).map(|entry| entry.path()).collect();
    kept.sort();
    kept
}

/// Removes what programs have left half-written in `folder` that were killed.
pub fn remove_stale(folder: &Path) {
    let [prefix, suffix] = TEMPORARY;
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let name = entry.file_name();
        let name = name.to_string_lossy();
        let is_ours = name.starts_with(prefix) && name.ends_with(suffix);
        let Some(metadata) = entry.metadata().ok().filter(|m| is_ours && m.is_file()) else {
            continue;
        };
        let age = metadata.modified().ok().and_then(|written| written.elapsed().ok());
        if age.is_some_and(|age| age >= SWEPT_AFTER)
            && open(&entry.path()).is_ok_and(|file| file.try_lock().is_ok())
        {
            let _ = fs::remove_file(entry.path());
        }
    }
}
