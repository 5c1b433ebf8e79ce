//! Opening of regular files without blocking on pipes and devices.

use rustix::fs::{OFlags, fcntl_getfl, fcntl_setfl};
use std::fs::{self, File, FileType, OpenOptions};
use std::io::{self, ErrorKind};
use std::os::unix::fs::{FileTypeExt, OpenOptionsExt};
use std::path::Path;

/// Opens the regular file at `path` for reading. This never blocks, as opening a pipe may.
///
/// # Errors
/// Fails if the file cannot be opened or is not a regular file.
pub fn open_regular(path: &Path) -> io::Result<File> {
    open_regular_with(File::options().read(true), path)
}

/// Opens the file at `path` for reading. A pipe that no program writes to is empty; opening it does
/// not block. Reading blocks as usual.
///
/// # Errors
/// Fails if the file cannot be opened.
pub fn open_at_once(path: &Path) -> io::Result<File> {
    let nonblocking = OFlags::NONBLOCK.bits() as i32;
    let file = File::options().read(true).custom_flags(nonblocking).open(path)?;
    fcntl_setfl(&file, fcntl_getfl(&file)? - OFlags::NONBLOCK)?;
    Ok(file)
}

/// Opens the regular file at `path` with the access that `options` requests.
pub(crate) fn open_regular_with(options: &mut OpenOptions, path: &Path) -> io::Result<File> {
    // Opening a device may have side effects.
    require_regular(fs::metadata(path)?.file_type())?;
    let file = options.custom_flags(OFlags::NONBLOCK.bits() as i32).open(path)?;
    // The file at `path` may have been replaced between the check and the opening.
    require_regular(file.metadata()?.file_type())?;
    Ok(file)
}

/// Checks that `file_type` is that of a regular file.
///
/// # Errors
/// Returns [`ErrorKind::InvalidInput`] for any other type, which the message names.
pub fn require_regular(file_type: FileType) -> io::Result<()> {
    let found = if file_type.is_file() {
        return Ok(());
    } else if file_type.is_dir() {
        "a directory"
    } else if file_type.is_fifo() {
        "a pipe"
    } else if file_type.is_socket() {
        "a socket"
    } else if file_type.is_symlink() {
        "a symbolic link"
    } else {
        "a device"
    };
    Err(io::Error::new(ErrorKind::InvalidInput, format!("it is {found}, not a regular file")))
}

#[cfg(test)]
mod tests {
    use super::*;
    use rustix::fs::{CWD, Mode, mknodat};
    use std::io::Read;

    #[test]
    fn only_regular_files_are_opened_and_pipes_do_not_block() {
        let folder = tempfile::tempdir().unwrap();
        let [file, pipe] = ["file", "pipe"].map(|name| folder.path().join(name));
        fs::write(&file, "text").unwrap();
        let mut text = String::new();
        open_regular(&file).unwrap().read_to_string(&mut text).unwrap();
        assert_eq!(text, "text");
        mknodat(CWD, &pipe, rustix::fs::FileType::Fifo, Mode::from_raw_mode(0o600), 0).unwrap();
        let link = folder.path().join("link");
        std::os::unix::fs::symlink(&pipe, &link).unwrap();
        for (path, kind) in [
            (&*pipe, "a pipe"),
            (&*link, "a pipe"),
            (folder.path(), "a directory"),
            (Path::new("/dev/null"), "a device"),
        ] {
            let error = open_regular(path).unwrap_err();
            assert_eq!(error.kind(), ErrorKind::InvalidInput);
            assert_eq!(error.to_string(), format!("it is {kind}, not a regular file"));
        }
        let mut text = String::new();
        open_at_once(&pipe).unwrap().read_to_string(&mut text).unwrap();
        assert_eq!(text, "");
        let missing = open_regular(&folder.path().join("nowhere")).unwrap_err();
        assert_eq!(missing.kind(), ErrorKind::NotFound);
    }
}
