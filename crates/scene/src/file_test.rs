//! Tests of saving and reloading scene files, on a real file system.

use crate::testing::MIRROR_ROOM;
use crate::{DiskState, SaveError, Scene, SceneFile};
use std::fs;
use std::path::{Path, PathBuf};

/// Writes the built-in scene to a file in `directory` and opens it. Returns the path of the file
/// and the opened file.
fn opened(directory: &Path) -> (PathBuf, SceneFile) {
    let path = directory.join("scene.toml");
    fs::write(&path, MIRROR_ROOM).unwrap();
    let file = SceneFile::open(&path).unwrap();
    (path, file)
}

/// Returns the scene of `file`, edited: its `max_depth` is `depth`.
fn edited(file: &SceneFile, depth: u32) -> Scene {
    let mut scene = file.document.scene().clone();
    scene.trace.max_depth = depth;
    scene
}

fn count(directory: &Path) -> usize {
    fs::read_dir(directory).unwrap().count()
}

#[test]
fn saving_and_undoing_gives_the_same_bytes() {
    let directory = tempfile::tempdir().unwrap();
    let (path, mut file) = opened(directory.path());
    let start = file.document.scene().clone();
    file.save(&edited(&file, 3), false).unwrap();
    let text = fs::read_to_string(&path).unwrap();
    assert_eq!(text, MIRROR_ROOM.to_string() + "\n[trace]\nmax_depth = 3\n");
    assert_eq!(file.on_disk(), DiskState::Unchanged);
    file.save(&start, false).unwrap();
    assert_eq!(fs::read_to_string(&path).unwrap(), MIRROR_ROOM);
    assert_eq!(count(directory.path()), 1, "no temporary file is left");
}

#[test]
fn changes_by_other_programs_are_detected() {
    let directory = tempfile::tempdir().unwrap();
    let (path, mut file) = opened(directory.path());
    let theirs = MIRROR_ROOM.replace("[640, 480]", "[320, 240]");
    fs::write(&path, &theirs).unwrap();
    assert_eq!(file.on_disk(), DiskState::Changed);
    let scene = edited(&file, 3);
    assert_eq!(file.save(&scene, false), Err(SaveError::Changed(path.clone())));
    assert_eq!(fs::read_to_string(&path).unwrap(), theirs);
    file.save(&scene, true).unwrap();
    assert_eq!(SceneFile::open(&path).unwrap().document.scene(), &scene);
    fs::write(&path, &theirs).unwrap();
    file.reload().unwrap();
    assert_eq!(file.document.scene().film.size, [320, 240]);
    assert_eq!(file.on_disk(), DiskState::Unchanged);
    fs::remove_file(&path).unwrap();
    assert_eq!(file.on_disk(), DiskState::Missing);
    file.save(&scene, false).unwrap();
    assert_eq!(file.on_disk(), DiskState::Unchanged);
}

#[test]
fn broken_file_is_reported_once_and_document_stays() {
    let directory = tempfile::tempdir().unwrap();
    let (path, mut file) = opened(directory.path());
    fs::write(&path, MIRROR_ROOM.replace("radius = 0.5", "radius = -0.5")).unwrap();
    let errors = file.reload().unwrap_err();
    assert_eq!(errors.messages[0].subject, "object \"ball\"");
    assert_eq!(file.document.text(), MIRROR_ROOM);
    assert_eq!(file.on_disk(), DiskState::Unchanged);
    fs::write(&path, MIRROR_ROOM).unwrap();
    assert_eq!(file.on_disk(), DiskState::Changed);
    file.reload().unwrap();
}

#[test]
fn save_as_does_not_overwrite_unless_asked() {
    let directory = tempfile::tempdir().unwrap();
    let mut file = SceneFile::untitled(MIRROR_ROOM.to_string(), "mirror-room.toml").unwrap();
    let scene = edited(&file, 3);
    assert_eq!(file.save(&scene, true), Err(SaveError::Untitled));
    assert_eq!(file.on_disk(), DiskState::Unchanged);
    let other = directory.path().join("other.toml");
    fs::write(&other, "theirs").unwrap();
    assert_eq!(file.save_as(&other, &scene, false), Err(SaveError::Exists(other.clone())));
    assert_eq!(fs::read_to_string(&other).unwrap(), "theirs");
    assert_eq!(file.path(), None);
    let new = directory.path().join("new.toml");
    file.save_as(&new, &scene, false).unwrap();
    assert_eq!((file.path(), &*file.document.name), (Some(&*new), &*new.display().to_string()));
    file.save_as(&other, &scene, true).unwrap();
    assert_eq!(fs::read(&other).unwrap(), fs::read(&new).unwrap());
    file.save(&edited(&file, 4), false).unwrap();
    assert_eq!(count(directory.path()), 2);
}

#[test]
fn failed_saves_give_the_cause() {
    let directory = tempfile::tempdir().unwrap();
    let (path, mut file) = opened(directory.path());
    let scene = edited(&file, 3);
    let missing = directory.path().join("no/such.toml");
    let error = file.save_as(&missing, &scene, false).unwrap_err().to_string();
    assert!(error.contains("does not exist; create it first"), "{error}");
    let error = file.save_as(directory.path(), &scene, true).unwrap_err().to_string();
    assert!(error.contains("it is a directory; add a file name"), "{error}");
    let mut permissions = fs::metadata(&path).unwrap().permissions();
    permissions.set_readonly(true);
    fs::set_permissions(&path, permissions).unwrap();
    let error = file.save(&scene, false).unwrap_err().to_string();
    assert!(error.contains("read-only"), "{error}");
    assert_eq!(fs::read_to_string(&path).unwrap(), MIRROR_ROOM);
}

#[test]
#[cfg(unix)]
fn saving_keeps_links_and_permissions() {
    use std::os::unix::fs::PermissionsExt;
    let directory = tempfile::tempdir().unwrap();
    let (path, _) = opened(directory.path());
    let link = directory.path().join("link.toml");
    std::os::unix::fs::symlink(&path, &link).unwrap();
    fs::set_permissions(&path, fs::Permissions::from_mode(0o640)).unwrap();
    let mut file = SceneFile::open(&link).unwrap();
    file.save(&edited(&file, 3), false).unwrap();
    assert!(link.symlink_metadata().unwrap().file_type().is_symlink());
    assert!(fs::read_to_string(&path).unwrap().ends_with("depth = 3\n"));
    assert_eq!(fs::metadata(&path).unwrap().permissions().mode() & 0o777, 0o640);
}

/// Checks that a named pipe at the path of a scene file is refused. Opening a pipe without another
/// end would block.
#[test]
fn pipe_in_place_of_the_file_is_refused_without_blocking() {
    use rustix::fs::{CWD, FileType, Mode, mknodat};
    let directory = tempfile::tempdir().unwrap();
    let (path, mut file) = opened(directory.path());
    fs::remove_file(&path).unwrap();
    mknodat(CWD, &path, FileType::Fifo, Mode::from_raw_mode(0o600), 0).unwrap();
    assert_eq!(file.on_disk(), DiskState::Changed);
    for overwrite in [false, true] {
        let error = file.save(&edited(&file, 3), overwrite).unwrap_err().to_string();
        assert!(error.contains("it is a pipe, not a regular file; save under"), "{error}");
    }
    assert!(file.reload().unwrap_err().to_string().contains("it is a pipe"));
    assert!(SceneFile::open(&path).is_err());
    assert_eq!(file.document.text(), MIRROR_ROOM);
    let other = directory.path().join("other.toml");
    file.save_as(&other, &edited(&file, 3), false).unwrap();
}
