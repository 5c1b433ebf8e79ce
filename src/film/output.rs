//! Picture files: chooses the format by extension, and replaces files atomically, so that a failure
//! leaves the old file unchanged.

use crate::film::image_data::{ImageData, WriteSeek};
use crate::film::{exr, png};
use std::ffi::OsStr;
use std::fmt;
use std::fs::{self, File};
use std::io::{self, BufWriter, ErrorKind, Write};
use std::path::{Path, PathBuf};
use tempfile::NamedTempFile;

/// A picture file format.
struct Format {
    extension: &'static str,
    encode: fn(&ImageData, &mut dyn WriteSeek) -> io::Result<()>,
}

/// All formats that can be written.
static FORMATS: [Format; 2] = [
    Format { extension: "png", encode: png::encode },
    Format { extension: "exr", encode: exr::encode },
];

/// Picture file to be written: a path with the extension of a known format.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ImageOutput {
    path: PathBuf,
    format: usize,
    /// `true` if writing fails when the file exists.
    create_new: bool,
}

/// Reason for which a picture cannot be written.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct WriteError {
    /// The requested file.
    pub path: PathBuf,
    /// Problem, as a clause of a sentence.
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

impl ImageOutput {
    /// Chooses the format by the extension of `path`, in upper or lower case. Accesses no file.
    ///
    /// # Errors
    /// Fails if the extension is missing or unknown.
    pub fn from_path(path: impl Into<PathBuf>) -> Result<Self, WriteError> {
        let path = path.into();
        let extension = path.extension().map(OsStr::to_string_lossy);
        let known = extension
            .as_ref()
            .and_then(|e| FORMATS.iter().position(|f| e.eq_ignore_ascii_case(f.extension)));
        match known {
            Some(format) => Ok(Self { path, format, create_new: false }),
            None => {
                let known: Vec<_> = FORMATS.iter().map(|f| format!(".{}", f.extension)).collect();
                Err(WriteError {
                    what: match extension {
                        Some(e) => format!("no picture format has the extension .{e}"),
                        None => {
                            "its name has no extension that names the picture format".to_string()
                        }
                    },
                    remedy: format!("known extensions: {}", known.join(", ")),
                    path,
                })
            }
        }
    }

    /// Returns an output that fails to write if the file exists, or if another program creates it
    /// in the meantime.
    pub fn create_new(self) -> Self {
        Self { create_new: true, ..self }
    }

    /// Path of the file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Checks that the file can be written, without changing it. Called before a long render.
    ///
    /// # Errors
    /// Returns the error that writing would return now.
    pub fn check_writable(&self) -> Result<(), WriteError> {
        self.prepare().map(drop)
    }

    /// Writes the picture to a temporary file in the same directory. Renames the file when it is
    /// complete and stored on the disk.
    ///
    /// # Errors
    /// Fails if the file cannot be written; an existing file is then unchanged.
    pub fn write(&self, picture: &ImageData) -> Result<(), WriteError> {
        self.replace(|sink| (FORMATS[self.format].encode)(picture, sink))
    }

    fn replace(
        &self,
        encode: impl FnOnce(&mut dyn WriteSeek) -> io::Result<()>,
    ) -> Result<(), WriteError> {
        let PendingFile { file, directory, temporary } = self.prepare()?;
        let explain = |error| self.explain(&error, &directory);
        let mut out = BufWriter::with_capacity(1 << 16, temporary);
        encode(&mut out).and_then(|()| out.flush()).map_err(explain)?;
        let temporary = out.into_inner().map_err(|e| explain(e.into_error()))?;
        temporary.as_file().sync_all().map_err(explain)?;
        let renamed = match self.create_new {
            true => temporary.persist_noclobber(&file),
            false => temporary.persist(&file),
        };
        renamed.map_err(|e| explain(e.error))?;
        // Stores the new name on the disk. Some systems do not let a directory be opened or
        // synchronised; the picture is complete in any case.
        if let Ok(directory) = File::open(&directory) {
            let _ = directory.sync_all();
        }
        Ok(())
    }

    fn prepare(&self) -> Result<PendingFile, WriteError> {
        // A symbolic link is kept, and the file to which it points is replaced.
        let is_link = self.path.symlink_metadata().is_ok_and(|m| m.file_type().is_symlink());
        let file = match is_link.then(|| fs::canonicalize(&self.path)) {
            Some(Ok(real)) => real,
            _ => self.path.clone(),
        };
        let parent = file.parent().filter(|parent| !parent.as_os_str().is_empty());
        let directory = parent.unwrap_or(Path::new(".")).to_path_buf();
        let mut builder = tempfile::Builder::new();
        builder.prefix(".zerkalo-").suffix(".tmp");
        let existing = fs::metadata(&file).ok();
        if let Some(existing) = &existing {
            if existing.is_dir() {
                return Err(self.error("it is a directory", "add a file name"));
            }
            if !existing.is_file() {
                let remedy = "name a regular file";
                return Err(self.error("it is not a file that can be replaced", remedy));
            }
            if existing.permissions().readonly() {
                let remedy = "make it writable or name another file";
                return Err(self.error("the existing file is read-only", remedy));
            }
        }
        // An existing file keeps its permissions. A new file gets those that the user's umask
        // allows.
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt;
            builder.permissions(fs::Permissions::from_mode(0o666));
        }
        let created = builder.tempfile_in(&directory).and_then(|temporary| {
            // The lock shows that the file is in use. On file systems without locks, leftover files
            // are not removed.
            let _ = temporary.as_file().try_lock();
            if let Some(existing) = &existing {
                temporary.as_file().set_permissions(existing.permissions())?;
            }
            Ok(temporary)
        });
        let temporary = created.map_err(|error| self.explain(&error, &directory))?;
        Ok(PendingFile { file, directory, temporary })
    }

    fn error(&self, what: impl Into<String>, remedy: impl Into<String>) -> WriteError {
        WriteError { path: self.path.clone(), what: what.into(), remedy: remedy.into() }
    }

    fn explain(&self, error: &io::Error, directory: &Path) -> WriteError {
        let shown = directory.display();
        match error.kind() {
            ErrorKind::AlreadyExists => {
                self.error("there is such a file already", "name another one")
            }
            ErrorKind::NotFound if !directory.exists() => self.error(
                format!("the directory {shown} does not exist"),
                "create it first or name another one",
            ),
            ErrorKind::NotADirectory => {
                self.error(format!("{shown} is not a directory"), "name a directory")
            }
            ErrorKind::PermissionDenied => self.error(
                format!("no permission to write in the directory {shown}"),
                "name a directory that you may write to",
            ),
            ErrorKind::ReadOnlyFilesystem => self.error(
                format!("the file system of {shown} is read-only"),
                "name a directory on another one",
            ),
            ErrorKind::StorageFull | ErrorKind::QuotaExceeded => self.error(
                format!("no space is left for it in {shown}"),
                "free some space or name a directory on another disk",
            ),
            _ => self.error(error.to_string(), "if that is unclear, try another directory"),
        }
    }
}

/// Temporary file, and the path that it gets when it is complete.
struct PendingFile {
    file: PathBuf,
    directory: PathBuf,
    temporary: NamedTempFile,
}

#[cfg(test)]
mod tests {
    use super::*;

    fn message(path: &Path) -> String {
        let target = ImageOutput::from_path(path).unwrap();
        target.check_writable().unwrap_err().to_string()
    }

    #[test]
    fn extension_chooses_the_format() {
        for good in ["a.png", "A.PNG", "dir.x/b.Exr"] {
            assert_eq!(ImageOutput::from_path(good).unwrap().path(), Path::new(good));
        }
        let error = ImageOutput::from_path("out.jpeg").unwrap_err().to_string();
        assert_eq!(
            error,
            "cannot write out.jpeg: no picture format has the extension .jpeg; \
             known extensions: .png, .exr"
        );
        let error = ImageOutput::from_path("picture").unwrap_err().to_string();
        assert!(error.contains("has no extension") && error.contains(".png, .exr"), "{error}");
    }

    #[test]
    fn unwritable_output_is_reported_before_the_work() {
        let dir = tempfile::tempdir().unwrap();
        let missing = message(&dir.path().join("no/such/a.png"));
        assert!(missing.contains("no/such does not exist; create it first"), "{missing}");
        let folder = dir.path().join("folder.png");
        fs::create_dir(&folder).unwrap();
        assert!(message(&folder).contains("it is a directory; add a file name"));
        let through_file = dir.path().join("file");
        fs::write(&through_file, "").unwrap();
        let under_file = message(&through_file.join("a.png"));
        assert!(under_file.contains("is not a directory"), "{under_file}");
        let locked = dir.path().join("locked.png");
        fs::write(&locked, "old").unwrap();
        let mut permissions = fs::metadata(&locked).unwrap().permissions();
        permissions.set_readonly(true);
        fs::set_permissions(&locked, permissions).unwrap();
        assert!(message(&locked).contains("the existing file is read-only; make it writable"));
    }

    #[test]
    fn check_writable_leaves_no_file() {
        let dir = tempfile::tempdir().unwrap();
        let old = dir.path().join("old.png");
        fs::write(&old, "old").unwrap();
        for path in [&old, &dir.path().join("new.png")] {
            ImageOutput::from_path(path).unwrap().check_writable().unwrap();
        }
        assert_eq!(fs::read(&old).unwrap(), b"old");
        assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 1);
    }

    #[test]
    fn failed_write_keeps_the_old_file_and_names_the_reason() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.png");
        fs::write(&path, "old").unwrap();
        let target = ImageOutput::from_path(&path).unwrap();
        for (kind, words) in [
            (ErrorKind::StorageFull, "no space is left"),
            (ErrorKind::ReadOnlyFilesystem, "read-only"),
            (ErrorKind::PermissionDenied, "no permission"),
            (ErrorKind::Other, "other error"),
        ] {
            let failing = |sink: &mut dyn WriteSeek| {
                sink.write_all(&[7; 100_000])?;
                Err(kind.into())
            };
            let error = target.replace(failing).unwrap_err().to_string();
            assert!(error.contains(words), "{error}");
            assert_eq!(fs::read(&path).unwrap(), b"old");
            assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 1);
        }
    }

    #[test]
    fn create_new_overwrites_no_file() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.png");
        let target = ImageOutput::from_path(&path).unwrap().create_new();
        target.replace(|sink| sink.write_all(b"new")).unwrap();
        let error = target.replace(|sink| sink.write_all(b"newer")).unwrap_err().to_string();
        assert!(error.contains("such a file already"), "{error}");
        assert_eq!(fs::read(&path).unwrap(), b"new");
        assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 1);
    }

    #[test]
    #[cfg(unix)]
    fn symbolic_links_and_permissions_are_kept() {
        use std::os::unix::fs::PermissionsExt;
        let dir = tempfile::tempdir().unwrap();
        let (real, link) = (dir.path().join("real.png"), dir.path().join("link.png"));
        fs::write(&real, "old").unwrap();
        fs::set_permissions(&real, fs::Permissions::from_mode(0o640)).unwrap();
        std::os::unix::fs::symlink(&real, &link).unwrap();
        let target = ImageOutput::from_path(&link).unwrap();
        target.replace(|sink| sink.write_all(b"new")).unwrap();
        assert!(link.symlink_metadata().unwrap().file_type().is_symlink());
        assert_eq!(fs::read(&real).unwrap(), b"new");
        assert_eq!(fs::metadata(&real).unwrap().permissions().mode() & 0o777, 0o640);
        // A new file has the permissions of any other file that the user creates.
        let (new, plain) = (dir.path().join("new.png"), dir.path().join("plain"));
        ImageOutput::from_path(&new).unwrap().replace(|sink| sink.write_all(b"new")).unwrap();
        fs::write(&plain, "").unwrap();
        let mode = |path| fs::metadata(path).unwrap().permissions().mode();
        assert_eq!(mode(&new), mode(&plain));
    }
}
