//! Replacement of files in one step: a failure leaves the old file unchanged.

use crate::disk::{open_regular_with, require_regular, user_name};
use rustix::process::geteuid;
use std::fmt;
use std::fs::{self, File, Metadata, Permissions};
use std::io::{self, ErrorKind, Write};
use std::os::unix::fs::{MetadataExt, PermissionsExt};
use std::path::{Path, PathBuf};
use std::time::Duration;
use tempfile::NamedTempFile;

/// Prefix and suffix of the names of the program's temporary files.
pub const TEMPORARY: [&str; 2] = [".zerkalo-", ".tmp"];
/// Age from which an unlocked temporary file is taken for one of a killed process and removed.
const STALE_AFTER: Duration = Duration::from_secs(10);
/// Largest number of symbolic links that are followed, as in Linux.
const MAX_LINKS: usize = 40;

/// Reason for which a file cannot be written.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct WriteError {
    /// Path of the file as requested.
    pub path: PathBuf,
    /// Kind of the problem.
    pub kind: ErrorKind,
    /// Description of the problem, as a clause of a sentence.
    pub what: String,
    /// Advice to the user, as a clause of a sentence.
    pub remedy: String,
}

impl fmt::Display for WriteError {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "cannot write {}: {}; {}", self.path.display(), self.what, self.remedy)
    }
}

impl std::error::Error for WriteError {}

impl WriteError {
    /// Creates an error whose fields are the arguments.
    pub fn new(path: &Path, kind: ErrorKind, what: impl Into<String>, remedy: &str) -> Self {
        Self { path: path.to_path_buf(), kind, what: what.into(), remedy: remedy.to_string() }
    }
}

/// Action if the file to be written exists already.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Existing {
    /// Replaces the file, which keeps its permissions. If the path is a symbolic link, its target is
    /// replaced.
    Replace,
    /// Fails if the file exists, even if another program creates it in the meantime.
    Refuse,
}

/// New content of a file, in a temporary file in the same folder. [`Replacement::commit`] renames it
/// to the path of the file; without a commit it is removed.
#[derive(Debug)]
pub struct Replacement {
    path: PathBuf,
    /// Path with symbolic links followed.
    target: PathBuf,
    folder: PathBuf,
    existing: Existing,
    /// `true` if there was a file at `target` when the replacement began.
    exists: bool,
    /// File that gets the new content.
    pub temporary: NamedTempFile,
}

impl Replacement {
    /// Creates the temporary file for the new content of the file at `path`.
    ///
    /// # Errors
    /// Fails if the file may not be replaced or its folder cannot be written to.
    pub fn begin(path: &Path, existing: Existing) -> Result<Self, WriteError> {
        let error = |kind, what: &str, remedy: &str| WriteError::new(path, kind, what, remedy);
        let other_file = |e: io::Error| error(e.kind(), &e.to_string(), "name another file");
        let target = match existing {
            Existing::Replace => follow(path).map_err(other_file)?,
            Existing::Refuse if path.symlink_metadata().is_ok() => return Err(exists(path)),
            Existing::Refuse => follow(path).map_err(other_file)?,
        };
        let parent = target.parent().filter(|parent| !parent.as_os_str().is_empty());
        let folder = parent.unwrap_or(Path::new(".")).to_path_buf();
        let old = fs::metadata(&target).ok();
        if let Some(old) = &old {
            if old.is_dir() {
                let kind = ErrorKind::IsADirectory;
                return Err(error(kind, "it is a directory", "add a file name"));
            }
            require_regular(old.file_type()).map_err(other_file)?;
            if old.permissions().readonly() {
                let what = "the existing file is read-only";
                let remedy = "make it writable or name another file";
                return Err(error(ErrorKind::PermissionDenied, what, remedy));
            }
        }
        remove_stale(&folder);
        let mut builder = tempfile::Builder::new();
        // An existing file keeps its permissions. A new file gets those that the umask allows.
        builder.prefix(TEMPORARY[0]).suffix(TEMPORARY[1]);
        builder.permissions(Permissions::from_mode(0o666));
        let created = builder.tempfile_in(&folder).and_then(|temporary| {
            lock(&temporary);
            if let Some(old) = &old {
                temporary.as_file().set_permissions(old.permissions())?;
            }
            Ok(temporary)
        });
        let exists = old.is_some();
        match created {
            Ok(temporary) => {
                Ok(Self { path: path.to_path_buf(), target, folder, existing, exists, temporary })
            }
            Err(error) => Err(explain(path, &folder, exists, &error)),
        }
    }

    /// Converts an error of writing the temporary file to one with a remedy for the user.
    pub fn explain(&self, error: &io::Error) -> WriteError {
        explain(&self.path, &self.folder, self.exists, error)
    }

    /// Stores the content of the temporary file on the disk, then renames it to the requested file.
    /// Returns the file, which stays locked while it is open.
    ///
    /// # Errors
    /// Fails if the content cannot be stored or the file cannot be replaced; an existing file is
    /// then unchanged.
    pub fn commit(self) -> Result<File, WriteError> {
        let synced = self.temporary.as_file().sync_all();
        synced.map_err(|error| self.explain(&error))?;
        let Self { path, target, folder, existing, exists, temporary } = self;
        let renamed = match existing {
            Existing::Replace => temporary.persist(&target),
            Existing::Refuse => temporary.persist_noclobber(&target),
        };
        let file = renamed.map_err(|e| explain(&path, &folder, exists, &e.error))?;
        // Stores the new name on the disk. Some systems cannot open or synchronise a directory.
        if let Ok(directory) = File::open(&folder) {
            let _ = directory.sync_all();
        }
        Ok(file)
    }
}

/// Locks a temporary file until it is closed. Other processes remove only files that they can lock.
pub fn lock(temporary: &NamedTempFile) {
    let _ = temporary.as_file().try_lock();
}

/// Removes the temporary files that killed processes have left in `folder`.
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
        // Some file systems lock only files that are open for writing.
        let mut writable = File::options();
        writable.read(true).write(true);
        if age.is_some_and(|age| age >= STALE_AFTER)
            && open_regular_with(&mut writable, &entry.path())
                .is_ok_and(|file| file.try_lock().is_ok())
        {
            let _ = fs::remove_file(entry.path());
        }
    }
}

/// Replaces the content of the file at `path` by `bytes`, or appends them to a stream.
///
/// # Errors
/// Fails if the file cannot be written; an existing regular file is then unchanged.
pub fn write(path: &Path, bytes: &[u8]) -> Result<(), WriteError> {
    if is_stream(path) {
        let opened = File::options().append(true).open(path);
        return opened.and_then(|mut stream| stream.write_all(bytes)).map_err(|error| {
            WriteError::new(path, error.kind(), error.to_string(), "name another file")
        });
    }
    replace_file(path, Existing::Replace, |file| file.write_all(bytes)).map(drop)
}

/// Writes the file at `path` by a [`Replacement`], which `write` fills. Returns the file, which
/// stays locked while it is open.
///
/// # Errors
/// Fails if `write` fails or the file cannot be written; an existing file is then unchanged.
pub fn replace_file(
    path: &Path,
    existing: Existing,
    write: impl FnOnce(&mut NamedTempFile) -> io::Result<()>,
) -> Result<File, WriteError> {
    let mut replacement = Replacement::begin(path, existing)?;
    let written = write(&mut replacement.temporary);
    written.map_err(|error| replacement.explain(&error))?;
    replacement.commit()
}

/// Checks that [`write()`] could write the file at `path` now.
///
/// # Errors
/// Returns the error that writing would return.
pub fn check_writable(path: &Path) -> Result<(), WriteError> {
    if is_stream(path) { Ok(()) } else { Replacement::begin(path, Existing::Replace).map(drop) }
}

/// Returns `true` if `path` leads to a stream: a pipe, a device, a socket, or an open file of a
/// process. A replacement of `/dev/stdout`, for example, would not reach the open file behind it.
fn is_stream(path: &Path) -> bool {
    let is_other = |m: Metadata| !m.is_file() && !m.is_dir();
    fs::metadata(path).is_ok_and(is_other)
        || follow(path).is_err_and(|e| e.kind() == ErrorKind::Unsupported)
}

/// Returns the path to which `path` leads through symbolic links, also those to directories. There
/// may be no file at it.
///
/// # Errors
///
/// [`ErrorKind::PermissionDenied`] with an explanation if [`may_follow`] does not permit a link;
/// [`ErrorKind::Unsupported`] for a link to an open file of a process. Fails also if a link cannot
/// be read, or after [`MAX_LINKS`] links.
fn follow(path: &Path) -> io::Result<PathBuf> {
    let reversed = |path: &Path| -> Vec<_> {
        path.components().rev().map(|component| component.as_os_str().to_os_string()).collect()
    };
    let (mut followed, mut rest, mut links) = (PathBuf::new(), reversed(path), 0);
    while let Some(component) = rest.pop() {
        let next = followed.join(component);
        let Some(link) = next.symlink_metadata().ok().filter(Metadata::is_symlink) else {
            followed = next;
            continue;
        };
        let folder = Some(&*followed).filter(|folder| !folder.as_os_str().is_empty());
        let folder = folder.unwrap_or(Path::new("."));
        let directory = fs::metadata(folder)?;
        let user = geteuid().as_raw();
        if !may_follow(link.uid(), directory.uid(), directory.mode(), user) {
            let why = format!(
                "{} is a symbolic link of user {} in a folder that everybody may write to",
                if rest.is_empty() { "it".into() } else { next.to_string_lossy() },
                user_name(link.uid())
            );
            return Err(io::Error::new(ErrorKind::PermissionDenied, why));
        }
        if rest.is_empty() && fs::canonicalize(folder)?.starts_with("/proc") {
            let why = "it is an open file of a process";
            return Err(io::Error::new(ErrorKind::Unsupported, why));
        }
        links += 1;
        if links > MAX_LINKS {
            return Err(io::Error::other("too many symbolic links lead to it"));
        }
        rest.extend(reversed(&fs::read_link(&next)?));
    }
    Ok(followed)
}

/// Returns `true` if the user with the id `user` may write through a symbolic link with the owner
/// `link_owner` in a folder with these permission bits. In a sticky folder that everybody may write
/// to, only links of `user` and of the folder's owner are followed, as by Linux's
/// `fs.protected_symlinks` (proc_sys_fs(5)).
fn may_follow(link_owner: u32, folder_owner: u32, folder_mode: u32, user: u32) -> bool {
    const STICKY_AND_WRITABLE_BY_ALL: u32 = 0o1002;
    let is_shared = folder_mode & STICKY_AND_WRITABLE_BY_ALL == STICKY_AND_WRITABLE_BY_ALL;
    !is_shared || [user, folder_owner].contains(&link_owner)
}

fn exists(path: &Path) -> WriteError {
    let what = "there is such a file already, and it was not changed";
    WriteError::new(path, ErrorKind::AlreadyExists, what, "name another one or remove it first")
}

/// Converts an error of writing `path` in `folder` to one with a remedy. `exists` is `true` if the
/// file existed before.
fn explain(path: &Path, folder: &Path, exists: bool, error: &io::Error) -> WriteError {
    let shown = folder.display();
    let kept = if exists { "the old file is unchanged" } else { "no file was written" };
    let (what, remedy) = match error.kind() {
        ErrorKind::AlreadyExists => return self::exists(path),
        ErrorKind::NotFound if !folder.exists() => {
            (format!("the directory {shown} does not exist"), "create it first or name another one")
        }
        ErrorKind::NotADirectory => (format!("{shown} is not a directory"), "name a directory"),
        ErrorKind::PermissionDenied => (
            format!("no permission to write in the directory {shown}"),
            "name a directory that you may write to",
        ),
        ErrorKind::ReadOnlyFilesystem => {
            (format!("the file system of {shown} is read-only"), "name a directory on another one")
        }
        ErrorKind::StorageFull | ErrorKind::QuotaExceeded => (
            format!("no space is left for it in {shown}, and {kept}"),
            "free some space or name a directory on another disk",
        ),
        _ => (format!("{error}, and {kept}"), "if that is unclear, try another directory"),
    };
    WriteError::new(path, error.kind(), what, remedy)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::os::unix::fs::{lchown, symlink};

    fn message<T: fmt::Debug>(result: Result<T, WriteError>) -> String {
        result.unwrap_err().to_string()
    }

    fn count(folder: &Path) -> usize {
        fs::read_dir(folder).unwrap().count()
    }

    #[test]
    fn unwritable_file_is_reported_before_the_work() {
        let folder = tempfile::tempdir().unwrap();
        let check = |path: &Path| message(check_writable(path));
        let missing = check(&folder.path().join("no/such/a.png"));
        assert!(missing.contains("no/such does not exist; create it first"), "{missing}");
        assert!(check(folder.path()).contains("it is a directory; add a file name"));
        let file = folder.path().join("file");
        fs::write(&file, "old").unwrap();
        let under_file = check(&file.join("a.png"));
        assert!(under_file.contains("is not a directory"), "{under_file}");
        check_writable(&file).unwrap();
        check_writable(&folder.path().join("new")).unwrap();
        let mut permissions = fs::metadata(&file).unwrap().permissions();
        permissions.set_readonly(true);
        fs::set_permissions(&file, permissions).unwrap();
        assert!(check(&file).contains("the existing file is read-only; make it writable"));
        assert_eq!(fs::read(&file).unwrap(), b"old");
        assert_eq!(count(folder.path()), 1);
    }

    #[test]
    fn uncommitted_replacement_changes_nothing_and_explains() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.png");
        let begin = || {
            let mut replacement = Replacement::begin(&path, Existing::Replace).unwrap();
            replacement.temporary.write_all(&[7; 100_000]).unwrap();
            replacement
        };
        let error = begin().explain(&ErrorKind::StorageFull.into()).to_string();
        assert!(error.contains("a.png: no space is left for it in"), "{error}");
        assert!(error.contains("no file was written; free some space"), "{error}");
        fs::write(&path, "old").unwrap();
        for (kind, words) in [
            (ErrorKind::StorageFull, "and the old file is unchanged"),
            (ErrorKind::QuotaExceeded, "and the old file is unchanged"),
            (ErrorKind::ReadOnlyFilesystem, "read-only"),
            (ErrorKind::PermissionDenied, "no permission"),
            (ErrorKind::Other, "other error, and the old file is unchanged"),
        ] {
            let error = begin().explain(&kind.into()).to_string();
            assert!(error.contains(words), "{error}");
            assert_eq!(fs::read(&path).unwrap(), b"old");
            assert_eq!(count(folder.path()), 1);
        }
    }

    #[test]
    fn refused_existing_file_stays() {
        let folder = tempfile::tempdir().unwrap();
        let [path, dangling] = ["a", "link"].map(|name| folder.path().join(name));
        symlink("nowhere", &dangling).unwrap();
        let new = Replacement::begin(&path, Existing::Refuse).unwrap();
        // Another program creates the file after `begin` and before `commit`.
        fs::write(&path, "theirs").unwrap();
        assert!(message(new.commit()).contains("such a file already"));
        for path in [&path, &dangling] {
            let error = Replacement::begin(path, Existing::Refuse).unwrap_err();
            assert_eq!(error.kind, ErrorKind::AlreadyExists);
        }
        assert_eq!(fs::read(&path).unwrap(), b"theirs");
        assert_eq!(count(folder.path()), 2);
    }

    #[test]
    fn own_links_and_permissions_are_kept() {
        let folder = tempfile::tempdir().unwrap();
        let [real, link, second] = ["real", "link", "second"].map(|n| folder.path().join(n));
        fs::write(&real, "old").unwrap();
        fs::set_permissions(&real, Permissions::from_mode(0o640)).unwrap();
        symlink("real", &link).unwrap();
        symlink(&link, &second).unwrap();
        write(&second, b"new").unwrap();
        assert!([&link, &second].iter().all(|path| path.is_symlink()));
        assert_eq!(fs::read(&real).unwrap(), b"new");
        let mode = |path: &Path| fs::metadata(path).unwrap().permissions().mode();
        assert_eq!(mode(&real) & 0o777, 0o640);
        // A new file has the same permissions as a file that `fs::write` creates.
        let [new, plain] = ["new", "plain"].map(|name| folder.path().join(name));
        write(&new, b"new").unwrap();
        fs::write(&plain, "").unwrap();
        assert_eq!(mode(&new), mode(&plain));
        symlink(&second, folder.path().join("loop")).unwrap();
        fs::remove_file(&link).unwrap();
        symlink("second", &link).unwrap();
        assert!(message(write(&second, b"new")).contains("too many symbolic links"));
    }

    #[test]
    fn links_are_followed_as_with_protected_symlinks() {
        for (link_owner, folder_owner, folder_mode, user, expected) in [
            // The folder is sticky and everybody may write to it, like /tmp.
            (1001, 0, 0o41_777, 1000, false),
            (1001, 0, 0o41_777, 0, false),
            (1001, 0, 0o41_777, 1001, true),
            (0, 0, 0o41_777, 1000, true),
            // The folder is not sticky, or not everybody may write to it.
            (1001, 0, 0o40_777, 1000, true),
            (1001, 0, 0o41_775, 1000, true),
            (1001, 0, 0o40_755, 1000, true),
        ] {
            let followed = may_follow(link_owner, folder_owner, folder_mode, user);
            assert_eq!(followed, expected, "link of {link_owner}, {folder_mode:o}, {user}");
        }
    }

    /// Checks that a symbolic link in a shared folder is not followed if it belongs to another
    /// user. Only the superuser can give the link to another user. For other users the test ends
    /// before this step.
    #[test]
    fn link_of_another_user_in_a_shared_folder_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let shared = folder.path().join("shared");
        fs::create_dir(&shared).unwrap();
        fs::set_permissions(&shared, Permissions::from_mode(0o1777)).unwrap();
        let [victim, link] = [folder.path().join("victim"), shared.join("link")];
        fs::write(&victim, "old").unwrap();
        symlink(&victim, &link).unwrap();
        write(&link, b"mine").unwrap();
        assert_eq!(fs::read(&victim).unwrap(), b"mine");
        if lchown(&link, Some(4321), None).is_err() {
            return;
        }
        let error = message(write(&link, b"new"));
        assert!(error.contains("symbolic link of user 4321"), "{error}");
        assert_eq!(fs::read(&victim).unwrap(), b"mine");
        // A link whose target is the link of the other user is refused, too.
        let outer = folder.path().join("outer");
        symlink(&link, &outer).unwrap();
        assert!(message(write(&outer, b"new")).contains("symbolic link of user 4321"));
        // So is a file in a directory that such a link leads to.
        let [directory, linked] = [folder.path().join("directory"), shared.join("linked")];
        fs::create_dir(&directory).unwrap();
        symlink(&directory, &linked).unwrap();
        for name in ["a/../b", "b"] {
            fs::create_dir_all(directory.join("a")).unwrap();
            write(&linked.join(name), b"mine").unwrap();
        }
        lchown(&linked, Some(4321), None).unwrap();
        for existing in [Existing::Replace, Existing::Refuse] {
            for name in ["b", "new"] {
                let error = replace_file(&linked.join(name), existing, |_| Ok(())).unwrap_err();
                let words = ["such a file already", "linked is a symbolic link of user 4321"];
                let refused = usize::from(name == "new" || existing == Existing::Replace);
                assert!(error.what.contains(words[refused]), "{error}");
            }
        }
        assert_eq!(count(&directory), 2);
    }

    #[test]
    fn devices_get_the_bytes_themselves() {
        write(Path::new("/dev/null"), b"gone").unwrap();
        #[cfg(target_os = "linux")]
        assert!(message(write(Path::new("/dev/full"), b"no")).contains("No space left"));
        let file = tempfile::NamedTempFile::new().unwrap();
        if Path::new("/proc/self/fd").exists() {
            use std::os::fd::AsRawFd;
            fs::write(file.path(), "kept ").unwrap();
            let path = format!("/proc/self/fd/{}", file.as_file().as_raw_fd());
            write(Path::new(&path), b"appended").unwrap();
            assert_eq!(fs::read(file.path()).unwrap(), b"kept appended");
            assert!(Replacement::begin(Path::new(&path), Existing::Replace).is_err());
        }
    }
}
