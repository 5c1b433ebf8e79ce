//! Tests of recovery files, which hold unsaved edits, on a real file system. Two `Recovery` values
//! in one process behave like two processes, because a lock belongs to an open file and not to the
//! process.

use crate::disk::remove_stale;
use crate::{Recovery, RecoveryFile, state_folder};
use std::ffi::OsString;
use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

fn of(path: &Path) -> Recovery {
    Recovery::new(Some(path), "", None)
}

fn texts(found: &RecoveryFile) -> Vec<&str> {
    found.orphans.iter().map(|lost| lost.text.as_str()).collect()
}

fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).unwrap();
    let mut names: Vec<_> =
        entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

#[test]
fn recovery_file_is_found_after_its_process_ends() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.toml");
    let mut keeper = of(&path);
    assert!(keeper.find().orphans.is_empty());
    for text in ["one\n", "two\n", "three\r\nwithout end"] {
        keeper.keep(text, Some(0xabc)).unwrap();
        assert_eq!(names(folder.path()), [".a.toml.unsaved"], "nothing half-written is left");
        let found = of(&path).find();
        assert!(found.orphans.is_empty() && found.elsewhere && found.unreadable.is_empty());
    }
    drop(keeper);
    let seeker = of(&path);
    let found = seeker.find();
    assert_eq!(texts(&found), ["three\r\nwithout end"]);
    assert_eq!((found.orphans[0].base, found.elsewhere), (Some(0xabc), false));
    // An orphan is the recovery file of a process that was killed. While `found` holds an orphan,
    // other processes do not find it.
    assert!(of(&path).find().elsewhere);
    drop(found);
    let mut heir = of(&path);
    let lost = heir.find().orphans.pop().unwrap();
    heir.adopt(lost);
    assert!(of(&path).find().elsewhere);
    heir.keep("four", None).unwrap();
    assert_eq!(names(folder.path()), [".a.toml.unsaved"]);
    heir.forget();
    assert_eq!(names(folder.path()), [""; 0]);
}

#[test]
fn concurrent_sessions_write_separate_recovery_files() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.toml");
    let mut keepers: Vec<_> = (0..9).map(|_| of(&path)).collect();
    for (i, keeper) in keepers.iter_mut().enumerate() {
        keeper.keep(&format!("{i}"), None).unwrap();
    }
    assert_eq!(names(folder.path()).len(), 9);
    assert!(of(&path).keep("one too many", None).is_err());
    keepers[4].forget();
    let mut late = of(&path);
    late.keep("late", None).unwrap();
    assert!(late.path().unwrap().ends_with(".a.toml.unsaved-5"));
    // A process that writes or removes its recovery file leaves those of other processes alone.
    keepers[3].keep("3 again", None).unwrap();
    keepers.truncate(2);
    let found = of(&path).find();
    assert!(found.elsewhere);
    assert_eq!(found.orphans.len(), 6);
    assert!(found.orphans.windows(2).all(|pair| pair[0].written >= pair[1].written));
    found.orphans.into_iter().for_each(crate::Orphan::discard);
    assert_eq!(names(folder.path()), [".a.toml.unsaved", ".a.toml.unsaved-2", ".a.toml.unsaved-5"]);
}

#[test]
fn deleted_recovery_file_is_written_again() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.toml");
    let mut keeper = of(&path);
    keeper.keep("one", None).unwrap();
    fs::remove_file(keeper.path().unwrap()).unwrap();
    let mut other = of(&path);
    other.keep("other", None).unwrap();
    keeper.keep("two", None).unwrap();
    drop((keeper, other));
    let found = of(&path).find();
    let mut found = texts(&found);
    found.sort_unstable();
    assert_eq!(found, ["other", "two"]);
    // `forget` removes the recovery file only if this process has written it.
    let mut keeper = of(&folder.path().join("b.toml"));
    keeper.keep("one", None).unwrap();
    let hidden = keeper.path().unwrap().to_path_buf();
    fs::remove_file(&hidden).unwrap();
    fs::write(&hidden, "somebody else's").unwrap();
    keeper.forget();
    assert_eq!(fs::read_to_string(&hidden).unwrap(), "somebody else's");
}

#[test]
fn unreadable_recovery_file_is_reported_and_stays() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.toml");
    let hidden = |n: &str| folder.path().join(format!(".a.toml.unsaved{n}"));
    fs::write(hidden(""), "").unwrap();
    fs::write(hidden("-2"), "# Unsaved edits, kept by zerkalo. The file was none.\n\n").unwrap();
    fs::write(hidden("-3"), b"name = \"\xff\"").unwrap();
    fs::create_dir(hidden("-4")).unwrap();
    fs::write(hidden("-5"), "plain = true").unwrap();
    let large = File::create(hidden("-6")).unwrap();
    large.set_len((256 << 20) + 1).unwrap();
    let found = of(&path).find();
    assert_eq!(texts(&found), ["plain = true"], "empty ones are nothing");
    assert_eq!(found.orphans[0].base, None);
    let why: Vec<_> = found.unreadable.iter().map(|(_, why)| why.as_str()).collect();
    assert_eq!(
        why,
        ["it is not UTF-8 text", "it is not a regular file", "it is larger than 256 MiB"]
    );
    assert_eq!(
        names(folder.path()),
        [".a.toml.unsaved-3", ".a.toml.unsaved-4", ".a.toml.unsaved-5", ".a.toml.unsaved-6"]
    );
}

#[test]
#[cfg(unix)]
fn symbolic_links_share_recovery_and_planted_links_are_not_followed() {
    use std::os::unix::fs::{PermissionsExt, symlink};
    let folder = tempfile::tempdir().unwrap();
    let other = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.toml");
    fs::write(&path, "").unwrap();
    let link = other.path().join("link.toml");
    symlink(&path, &link).unwrap();
    let mut keeper = of(&link);
    keeper.keep("one", None).unwrap();
    assert_eq!(
        keeper.path(),
        Some(&*fs::canonicalize(folder.path()).unwrap().join(".a.toml.unsaved"))
    );
    let mode = fs::metadata(keeper.path().unwrap()).unwrap().permissions().mode();
    assert_eq!(mode & 0o777, 0o600, "for nobody else's eyes");
    drop(keeper);
    assert_eq!(texts(&of(&path).find()), ["one"]);
    symlink("/dev/zero", folder.path().join(".a.toml.unsaved-2")).unwrap();
    let found = of(&path).find();
    assert!(matches!(&found.unreadable[..], [(_, why)] if why == "it is not a regular file"));
}

#[test]
fn state_folder_is_used_if_the_scene_folder_is_not_writable() {
    let folder = tempfile::tempdir().unwrap();
    let state = folder.path().join("deep/state");
    // The folder of the scene file does not exist; the recovery file cannot be written there.
    let gone = PathBuf::from("/proc/nowhere/a.toml");
    let with = |path: Option<&Path>| Recovery::new(path, "mirror/room.toml", Some(&state));
    let mut keeper = with(Some(&gone));
    keeper.keep("one", None).unwrap();
    assert!(keeper.path().unwrap().starts_with(&state));
    drop(keeper);
    assert_eq!(texts(&with(Some(&gone)).find()), ["one"]);
    assert!(texts(&with(Some(Path::new("/proc/nowhere/b.toml"))).find()).is_empty());
    let mut untitled = with(None);
    untitled.keep("two", None).unwrap();
    assert!(untitled.path().unwrap().ends_with("mirror-room.toml.unsaved"));
    assert!(Recovery::new(None, "a", None).keep("three", None).is_err());
}

#[test]
fn recovery_of_longest_file_names() {
    let folder = tempfile::tempdir().unwrap();
    let state = folder.path().join("state");
    let long = folder.path().join("ä".repeat(125) + ".toml");
    let mut keeper = Recovery::new(Some(&long), "", Some(&state));
    keeper.keep("one", None).unwrap();
    assert!(keeper.path().unwrap().starts_with(&state));
    assert_eq!(names(folder.path()), ["state"]);
}

#[test]
fn state_folder_follows_xdg_variables() {
    let with = |state: Option<&str>, home: Option<&str>| {
        state_folder(|name| match name {
            "XDG_STATE_HOME" => state.map(OsString::from),
            _ => home.map(OsString::from),
        })
    };
    assert_eq!(with(Some("/s"), Some("/h")), Some("/s/zerkalo".into()));
    // The XDG specification requires that relative paths in these variables are ignored.
    assert_eq!(with(Some("s"), Some("/h")), Some("/h/.local/state/zerkalo".into()));
    assert_eq!(with(None, None), None);
}

#[test]
fn only_old_unlocked_temporary_files_are_removed() {
    let folder = tempfile::tempdir().unwrap();
    let old = SystemTime::now() - Duration::from_secs(3600);
    let file = |name: &str| {
        let file = File::create(folder.path().join(name)).unwrap();
        file.set_modified(old).unwrap();
        file
    };
    file(".zerkalo-abc.tmp");
    file("scene.tmp");
    file(".zerkalo-notes");
    let busy = file(".zerkalo-busy.tmp");
    busy.try_lock().unwrap();
    File::create(folder.path().join(".zerkalo-new.tmp")).unwrap();
    remove_stale(folder.path());
    assert_eq!(
        names(folder.path()),
        [".zerkalo-busy.tmp", ".zerkalo-new.tmp", ".zerkalo-notes", "scene.tmp"]
    );
    remove_stale(&folder.path().join("nowhere"));
}

/// Checks that a recovery file of another user is not offered. The test gives its own file to
/// another user, which only the superuser may do. Without this right the test ends early.
#[test]
fn recovery_file_of_another_user_is_not_offered() {
    use std::os::unix::fs::chown;
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.toml");
    let hidden = folder.path().join(".a.toml.unsaved");
    fs::write(&hidden, "theirs").unwrap();
    assert_eq!(texts(&of(&path).find()), ["theirs"]);
    if chown(&hidden, Some(4321), None).is_err() {
        return;
    }
    let found = of(&path).find();
    assert!(found.orphans.is_empty());
    let [(at, user)] = &found.foreign[..] else { panic!("{found:?}") };
    assert_eq!((at.file_name(), user.as_str()), (hidden.file_name(), "4321"));
    assert_eq!(fs::read_to_string(&hidden).unwrap(), "theirs");
}
