//! Autosave of unsaved edits to a recovery file, delayed until a pause in editing.

use crate::dashboard::model::first_line;
use crate::dashboard::{Message, OrphanedEdits};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant, SystemTime};
use zerkalo_scene::disk::remove_stale;
use zerkalo_scene::value::sanitized;
use zerkalo_scene::{Orphan, Recovery, RecoveryFile, Scene, SceneErrors, SceneFile};

/// Pause in editing after which unsaved edits are written.
const DEBOUNCE: Duration = Duration::from_millis(400);
/// Longest time between an edit and its write, even if edits continue.
const MAX_DELAY: Duration = Duration::from_secs(1);

/// Autosave of a scene. At the start it also looks for unsaved edits of crashed runs (orphaned
/// edits).
pub struct Autosave {
    pub recovery: Recovery,
    /// State folder of the user (XDG), for recovery files that cannot be written beside the scene
    /// file.
    state: Option<PathBuf>,
    pending: Option<Pending>,
    /// Scene that this run last wrote to the recovery file.
    kept: Option<Arc<Scene>>,
    /// Orphaned edits that the user has neither recovered nor discarded, one entry for each run.
    /// The last is offered next.
    found: Vec<Orphan>,
    /// Cause of the failure if the last write has failed. The user is warned only of the first of
    /// several failures.
    failed: Option<String>,
}

struct Pending {
    scene: Arc<Scene>,
    /// Time of the oldest edit that is not in the recovery file.
    first: Instant,
    /// Time of the newest edit.
    last: Instant,
}

impl Autosave {
    /// Creates the autosave of the scene file at `path`, or of a scene `name` without a file.
    pub fn new(path: Option<&Path>, name: &str, state: Option<PathBuf>) -> Self {
        Self {
            recovery: Recovery::new(path, name, state.as_deref()),
            state,
            pending: None,
            kept: None,
            found: Vec::new(),
            failed: None,
        }
    }

    /// Removes the recovery file, and continues with another scene as [`Autosave::new`] does.
    pub fn reopen(&mut self, path: Option<&Path>, name: &str) {
        self.recovery.forget();
        *self = Self::new(path, name, self.state.take());
    }

    /// Updates an existing recovery file before `scene` is saved. Otherwise a program that is
    /// killed during the save would leave older edits, which the next start would offer.
    pub fn saving(&mut self, file: &SceneFile, scene: &Arc<Scene>) {
        if self.recovery.path().is_some() {
            // The save reports the error.
            let _ = self.recovery.keep(&file.text_of(scene), file.fingerprint());
            self.kept = Some(Arc::clone(scene));
        }
    }

    /// Records that `scene` was written to the scene file at `path`, and removes the recovery file.
    /// Schedules the write of newer edits.
    pub fn saved(&mut self, scene: &Arc<Scene>, path: &Path, now: Instant) {
        let newest = self.pending.take().map(|pending| pending.scene).or(self.kept.take());
        self.recovery.forget();
        self.recovery = Recovery::new(Some(path), "", self.state.as_deref());
        self.note(newest.filter(|newest| **newest != **scene), now);
    }

    /// Schedules an autosave of `scene`. `None` cancels it and removes the recovery file.
    pub fn note(&mut self, scene: Option<Arc<Scene>>, now: Instant) {
        match scene {
            Some(scene) => {
                let first = self.pending.as_ref().map_or(now, |pending| pending.first);
                self.pending = Some(Pending { scene, first, last: now });
            }
            None => {
                self.pending = None;
                self.kept = None;
                self.failed = None;
                self.recovery.forget();
            }
        }
    }

    /// Returns the time at which pending edits must be written.
    pub fn due(&self) -> Option<Instant> {
        self.pending.as_ref().map(|p| (p.last + DEBOUNCE).min(p.first + MAX_DELAY))
    }

    /// Writes pending edits to the recovery file, or removes it if `file` already contains them.
    /// Returns a warning if this write fails and the previous one did not.
    pub fn write(&mut self, file: &SceneFile) -> Option<Message> {
        let scene = self.pending.take()?.scene;
        let text = file.text_of(&scene);
        if file.holds(&text) {
            self.kept = None;
            self.recovery.forget();
            return None;
        }
        match self.recovery.keep(&text, file.fingerprint()) {
            Ok(()) => {
                self.kept = Some(scene);
                self.failed = None;
                None
            }
            Err(error) => match self.failed.replace(error.to_string()) {
                Some(_) => None,
                None => Some(Message::Warning(format!(
                    "unsaved edits would be lost if the program were killed: they cannot be kept ({error})"
                ))),
            },
        }
    }

    /// Returns the path of the recovery file that remains when the program ends.
    ///
    /// # Errors
    /// Fails with a message for the user if the last edits could not be written.
    pub fn kept(&self) -> Result<Option<PathBuf>, String> {
        match (&self.failed, self.recovery.path()) {
            (None, path) => Ok(path.map(Path::to_path_buf)),
            (Some(why), None) => {
                Err(format!("unsaved edits are lost: they cannot be kept ({why})"))
            }
            (Some(why), Some(path)) => Err(format!(
                "the last edits are lost: they cannot be kept ({why}); earlier ones are in {}",
                path.display()
            )),
        }
    }

    /// Searches for orphaned edits, and removes incomplete files of killed runs. `file` is the
    /// scene file, or the path of an unreadable one. Returns warnings, and an offer to recover one
    /// run's edits.
    pub fn search(&mut self, file: Result<&SceneFile, &Path>) -> Vec<Message> {
        // Incomplete exports are in the working directory.
        let beside = file.map_or_else(Some, SceneFile::path).and_then(Path::parent);
        let beside = beside.filter(|folder| !folder.as_os_str().is_empty());
        [Some(Path::new(".")), beside, self.state.as_deref()]
            .into_iter()
            .flatten()
            .for_each(remove_stale);
        let RecoveryFile { mut orphans, unreadable, foreign, elsewhere } = self.recovery.find();
        let mut messages: Vec<_> = unreadable
            .iter()
            .map(|(path, why)| {
                let path = sanitized(&path.display().to_string());
                Message::Warning(format!("unsaved edits in {path} cannot be read: {why}"))
            })
            .collect();
        messages.extend(foreign.iter().map(|(path, user)| {
            let [path, user] = [&path.display().to_string(), user].map(|text| sanitized(text));
            Message::Warning(format!("{path} has unsaved edits of user {user}: not offered to you"))
        }));
        if elsewhere {
            let text = "this scene is open elsewhere, with unsaved edits";
            messages.push(Message::Warning(text.to_string()));
        }
        orphans.reverse();
        self.found = orphans;
        messages.extend(self.offer(file));
        messages
    }

    /// Returns the offer to recover the edits of the next crashed run, or a warning if they are
    /// unreadable. Discards edits that `file` already contains.
    pub fn offer(&mut self, file: Result<&SceneFile, &Path>) -> Option<Message> {
        loop {
            let orphan = self.found.last()?;
            if file.is_ok_and(|file| file.holds(&orphan.text)) {
                self.found.pop()?.discard();
                continue;
            }
            return Some(match scene(orphan, file) {
                Ok(scene) => Message::OrphanedEdits(OrphanedEdits {
                    scene: Arc::new(scene),
                    age: SystemTime::now().duration_since(orphan.written).unwrap_or_default(),
                    changed: file.map_or(true, |file| orphan.base != file.fingerprint()),
                }),
                Err(errors) => {
                    // The user can repair the recovery file, which is kept.
                    self.found.pop();
                    let why = first_line(&errors);
                    Message::Warning(format!("unsaved edits cannot be read: {why}"))
                }
            });
        }
    }

    /// Takes over the recovery file with the offered edits. `path` is the path of an unreadable
    /// scene file; if it is given, returns a scene file with the recovered text.
    pub fn recover(&mut self, path: Option<&Path>) -> Option<SceneFile> {
        let orphan = self.found.pop()?;
        let file = path.and_then(|path| SceneFile::recovered(path, orphan.text.clone()).ok());
        self.recovery.adopt(orphan);
        file
    }

    pub fn discard(&mut self) {
        if let Some(orphan) = self.found.pop() {
            orphan.discard();
        }
    }
}

fn scene(orphan: &Orphan, file: Result<&SceneFile, &Path>) -> Result<Scene, SceneErrors> {
    let name = orphan.path().display().to_string();
    match file {
        Ok(file) => file.parse(&orphan.text, &name),
        Err(path) => {
            SceneFile::recovered(path, orphan.text.clone()).map(|f| f.document.scene().clone())
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dashboard::testing::STARTER;

    fn scene(depth: u32) -> Arc<Scene> {
        let mut scene = Scene::parse(STARTER, "starter").unwrap();
        scene.trace.max_depth = depth;
        Arc::new(scene)
    }

    #[test]
    fn autosave_waits_for_pause_up_to_one_second() {
        let mut autosave = Autosave::new(None, "a", None);
        let start = Instant::now();
        let at = |ms| start + Duration::from_millis(ms);
        assert_eq!(autosave.due(), None);
        autosave.note(Some(scene(1)), at(0));
        assert_eq!(autosave.due(), Some(at(400)));
        autosave.note(Some(scene(2)), at(300));
        assert_eq!(autosave.due(), Some(at(700)));
        autosave.note(Some(scene(3)), at(650));
        assert_eq!(autosave.due(), Some(at(1000)));
        autosave.note(None, at(660));
        assert_eq!(autosave.due(), None);
    }

    #[test]
    fn orphaned_edits_are_offered_after_crash() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.toml");
        std::fs::write(&path, STARTER).unwrap();
        let file = SceneFile::open(&path).unwrap();
        let mut first = Autosave::new(Some(&path), "", None);
        assert!(first.search(Ok(&file)).is_empty());
        first.note(Some(scene(3)), Instant::now());
        assert!(first.write(&file).is_none());
        assert_eq!(first.recovery.path(), Some(&*folder.path().join(".a.toml.unsaved")));
        // Edits of a run that has not ended yet are reported but not offered.
        let mut second = Autosave::new(Some(&path), "", None);
        let messages = second.search(Ok(&file));
        assert!(
            matches!(&messages[..], [Message::Warning(t)] if t.contains("elsewhere")),
            "{messages:?}"
        );
        drop(first);
        let messages = second.search(Ok(&file));
        let [Message::OrphanedEdits(left)] = &messages[..] else { panic!("{messages:?}") };
        assert_eq!((&left.scene, left.changed), (&scene(3), false));
        // The next offer reports that another program has changed the scene file.
        std::fs::write(&path, format!("# new\n{}", STARTER)).unwrap();
        let file = SceneFile::open(&path).unwrap();
        let Some(Message::OrphanedEdits(left)) = second.offer(Ok(&file)) else { panic!() };
        assert!(left.changed);
        assert!(second.recover(None).is_none());
        assert!(second.offer(Ok(&file)).is_none());
        // `note` with `None` means that all edits are saved. It removes the recovery file; the
        // folder then has one file less.
        second.note(Some(scene(3)), Instant::now());
        second.write(&file);
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 2);
        second.note(None, Instant::now());
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn equal_edits_are_discarded_and_unreadable_ones_reported() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.toml");
        std::fs::write(&path, STARTER).unwrap();
        let file = SceneFile::open(&path).unwrap();
        let hidden = folder.path().join(".a.toml.unsaved");
        let mut autosave = Autosave::new(Some(&path), "", None);
        std::fs::write(&hidden, STARTER).unwrap();
        assert!(autosave.search(Ok(&file)).is_empty() && !hidden.exists());
        std::fs::write(&hidden, "[camera\n").unwrap();
        let messages = autosave.search(Ok(&file));
        assert!(matches!(&messages[..], [Message::Warning(t)] if t.contains(".a.toml.unsaved:1:")));
        assert!(hidden.exists());
        autosave.note(Some(scene(3)), Instant::now());
        assert!(autosave.write(&file).is_none());
        assert_eq!(autosave.recovery.path(), Some(&*folder.path().join(".a.toml.unsaved-2")));
    }

    #[test]
    fn scene_of_unreadable_file_is_recovered() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.toml");
        std::fs::write(&path, "[camera\n").unwrap();
        std::fs::write(folder.path().join(".a.toml.unsaved"), STARTER).unwrap();
        let mut autosave = Autosave::new(Some(&path), "", None);
        let messages = autosave.search(Err(&path));
        assert!(
            matches!(&messages[..], [Message::OrphanedEdits(left)] if left.changed),
            "{messages:?}"
        );
        let mut file = autosave.recover(Some(&path)).unwrap();
        let scene = file.document.scene().clone();
        file.save(&scene, false).unwrap();
        assert_eq!(std::fs::read_to_string(&path).unwrap(), STARTER);
    }

    #[test]
    fn autosave_failure_is_reported_once() {
        let mut autosave = Autosave::new(None, "a", None);
        let file = SceneFile::untitled(STARTER.to_string(), "a").unwrap();
        let mut write = || {
            autosave.note(Some(scene(3)), Instant::now());
            autosave.write(&file)
        };
        assert!(matches!(write(), Some(Message::Warning(_))));
        assert!(write().is_none());
    }
}
