//! Unsaved edits on their way to where the next start finds them: soon after the last, not after each.

use crate::dashboard::message::{Message, OrphanedEdits};
use crate::scene::{Orphan, Recovery, RecoveryFile, Scene, SceneErrors, SceneFile, remove_stale};
use crate::value::sanitized;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant, SystemTime};

/// Edits are written when none has come for so long,
const DEBOUNCE: Duration = Duration::from_millis(400);
/// and while they go on coming, when the oldest has waited for so long.
const MAX_DELAY: Duration = Duration::from_secs(1);

/// Unsaved edits of one scene after another, and those that were found at the start.
pub struct Autosave {
    recovery: Recovery,
    state: Option<PathBuf>,
    pending: Option<Pending>,
    /// What was found and has not been decided about; the last is the next to be offered.
    found: Vec<Orphan>,
    /// It was told already that edits cannot be kept.
    complained: bool,
}

struct Pending {
    scene: Arc<Scene>,
    first: Instant,
    last: Instant,
}

impl Autosave {
    /// For the scene at `path`, or without one for that called `name`. `state`: the user's folder for
    /// what programs remember.
    pub fn new(path: Option<&Path>, name: &str, state: Option<PathBuf>) -> Self {
        Self {
            recovery: Recovery::new(path, name, state.as_deref()),
            state,
            pending: None,
            found: Vec::new(),
            complained: false,
        }
    }

    /// `scene` is about to be written. What is kept is never older than what the file holds: else the
    /// next start would offer what nobody wants any more.
    pub fn saving(&mut self, file: &SceneFile, scene: &Scene) {
        if self.recovery.path().is_some() {
            // If it cannot be kept, saving will tell.
            let _ = self.recovery.keep(&file.text_of(scene), file.fingerprint());
        }
    }

    /// `scene` was written to the file at `path`.
    pub fn saved(&mut self, scene: &Arc<Scene>, path: &Path) {
        self.recovery.forget();
        self.recovery = Recovery::new(Some(path), "", self.state.as_deref());
        self.pending.take_if(|pending| *pending.scene == **scene);
    }

    /// The scene has unsaved edits, and is this now; `None`: it has none.
    pub fn note(&mut self, scene: Option<Arc<Scene>>, now: Instant) {
        match scene {
            Some(scene) => {
                let first = self.pending.as_ref().map_or(now, |pending| pending.first);
                self.pending = Some(Pending { scene, first, last: now });
            }
            None => {
                self.pending = None;
                self.recovery.forget();
            }
        }
    }

    /// When to write; `None`: there is nothing to.
    pub fn due(&self) -> Option<Instant> {
        self.pending.as_ref().map(|p| (p.last + DEBOUNCE).min(p.first + MAX_DELAY))
    }

    /// Writes what `file` would be with the edits; what there is to tell about that.
    pub fn write(&mut self, file: &SceneFile) -> Option<Message> {
        let scene = self.pending.take()?.scene;
        let text = file.text_of(&scene);
        if file.holds(&text) {
            self.recovery.forget();
            return None;
        }
        match self.recovery.keep(&text, file.fingerprint()) {
            Ok(()) => {
                self.complained = false;
                None
            }
            Err(_) if std::mem::replace(&mut self.complained, true) => None,
            Err(error) => Some(Message::Trouble(format!(
                "unsaved edits would be lost if the program were killed: they cannot be kept ({error})"
            ))),
        }
    }

    /// The file that holds what is unsaved.
    pub fn path(&self) -> Option<&Path> {
        self.recovery.path()
    }

    /// Looks for what was left behind. `file`: the scene's, if it can be read.
    pub fn search(&mut self, file: Result<&SceneFile, &Path>) -> Vec<Message> {
        // Half-written scenes lie beside them, half-written pictures in the working directory.
        let beside = file.map_or_else(Some, SceneFile::path).and_then(Path::parent);
        let beside = beside.filter(|folder| !folder.as_os_str().is_empty());
        [Some(Path::new(".")), beside, self.state.as_deref()]
            .into_iter()
            .flatten()
            .for_each(remove_stale);
        let RecoveryFile { orphans: mut lost, unreadable, elsewhere } = self.recovery.find();
        let mut messages: Vec<_> = unreadable
            .iter()
            .map(|(path, why)| {
                let path = sanitized(&path.display().to_string());
                Message::Trouble(format!("unsaved edits in {path} cannot be read: {why}"))
            })
            .collect();
        if elsewhere {
            let told = "this scene is open elsewhere, with unsaved edits";
            messages.push(Message::Trouble(told.to_string()));
        }
        lost.reverse();
        self.found = lost;
        messages.extend(self.offer(file));
        messages
    }

    /// What was found next, or why it is of no use. Edits that the file has already are done with.
    pub fn offer(&mut self, file: Result<&SceneFile, &Path>) -> Option<Message> {
        loop {
            let lost = self.found.last()?;
            if file.is_ok_and(|file| file.holds(&lost.text)) {
                self.found.pop()?.discard();
                continue;
            }
            return Some(match scene(lost, file) {
                Ok(scene) => Message::OrphanedEdits(OrphanedEdits {
                    scene: Arc::new(scene),
                    age: SystemTime::now().duration_since(lost.written).unwrap_or_default(),
                    changed: file.map_or(true, |file| lost.base != file.fingerprint()),
                }),
                Err(errors) => {
                    // It stays where it is, for its user to look at.
                    self.found.pop();
                    let first = errors.messages().first().map(ToString::to_string);
                    let first = first.unwrap_or_default();
                    let first: Vec<_> = first.lines().map(str::trim).collect();
                    Message::Trouble(format!("unsaved edits cannot be read: {}", first.join(" ")))
                }
            });
        }
    }

    /// What was offered is what is unsaved now. Its file, if the scene's could not be read.
    pub fn take_up(&mut self, path: Option<&Path>) -> Option<SceneFile> {
        let lost = self.found.pop()?;
        let file = path.and_then(|path| SceneFile::recovered(path, lost.text.clone()).ok());
        self.recovery.take_up(lost);
        file
    }

    /// What was offered is not wanted.
    pub fn discard(&mut self) {
        if let Some(lost) = self.found.pop() {
            lost.discard();
        }
    }
}

fn scene(lost: &Orphan, file: Result<&SceneFile, &Path>) -> Result<Scene, SceneErrors> {
    let name = lost.path().display().to_string();
    match file {
        Ok(file) => file.parse(&lost.text, &name),
        Err(path) => {
            SceneFile::recovered(path, lost.text.clone()).map(|f| f.document().scene().clone())
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::starter;

    fn scene(depth: u32) -> Arc<Scene> {
        let mut scene = Scene::parse(starter(), "starter").unwrap();
        scene.trace.max_depth = depth;
        Arc::new(scene)
    }

    #[test]
    fn edits_are_written_when_they_pause_and_at_the_latest_after_a_second() {
        let mut journal = Autosave::new(None, "a", None);
        let start = Instant::now();
        let at = |ms| start + Duration::from_millis(ms);
        assert_eq!(journal.due(), None);
        journal.note(Some(scene(1)), at(0));
        assert_eq!(journal.due(), Some(at(400)));
        journal.note(Some(scene(2)), at(300));
        assert_eq!(journal.due(), Some(at(700)));
        journal.note(Some(scene(3)), at(650));
        assert_eq!(journal.due(), Some(at(1000)));
        journal.note(None, at(660));
        assert_eq!(journal.due(), None);
    }

    #[test]
    fn a_life_with_a_crash_in_it() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.toml");
        std::fs::write(&path, starter()).unwrap();
        let file = SceneFile::open(&path).unwrap();
        let mut first = Autosave::new(Some(&path), "", None);
        assert!(first.search(Ok(&file)).is_empty());
        first.note(Some(scene(3)), Instant::now());
        assert!(first.write(&file).is_none());
        assert_eq!(first.path(), Some(&*folder.path().join(".a.toml.unsaved")));
        // Whoever is alive is not offered to others, but told of.
        let mut second = Autosave::new(Some(&path), "", None);
        let told = second.search(Ok(&file));
        assert!(matches!(&told[..], [Message::Trouble(t)] if t.contains("elsewhere")), "{told:?}");
        drop(first);
        let told = second.search(Ok(&file));
        let [Message::OrphanedEdits(left)] = &told[..] else { panic!("{told:?}") };
        assert_eq!((&left.scene, left.changed), (&scene(3), false));
        // What another program wrote meanwhile is told of.
        std::fs::write(&path, format!("# new\n{}", starter())).unwrap();
        let file = SceneFile::open(&path).unwrap();
        let Some(Message::OrphanedEdits(left)) = second.offer(Ok(&file)) else { panic!() };
        assert!(left.changed);
        assert!(second.take_up(None).is_none());
        assert!(second.offer(Ok(&file)).is_none());
        // Saved, it is gone.
        second.note(Some(scene(3)), Instant::now());
        second.write(&file);
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 2);
        second.note(None, Instant::now());
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn what_the_file_has_already_is_not_offered_and_what_is_no_scene_is_told_and_stays() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.toml");
        std::fs::write(&path, starter()).unwrap();
        let file = SceneFile::open(&path).unwrap();
        let hidden = folder.path().join(".a.toml.unsaved");
        let mut journal = Autosave::new(Some(&path), "", None);
        std::fs::write(&hidden, starter()).unwrap();
        assert!(journal.search(Ok(&file)).is_empty() && !hidden.exists());
        std::fs::write(&hidden, "[camera\n").unwrap();
        let told = journal.search(Ok(&file));
        assert!(matches!(&told[..], [Message::Trouble(t)] if t.contains(".a.toml.unsaved:1:")));
        assert!(hidden.exists());
        journal.note(Some(scene(3)), Instant::now());
        assert!(journal.write(&file).is_none());
        assert_eq!(journal.path(), Some(&*folder.path().join(".a.toml.unsaved-2")));
    }

    #[test]
    fn a_scene_whose_file_is_spoilt_comes_back() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.toml");
        std::fs::write(&path, "[camera\n").unwrap();
        std::fs::write(folder.path().join(".a.toml.unsaved"), starter()).unwrap();
        let mut journal = Autosave::new(Some(&path), "", None);
        let told = journal.search(Err(&path));
        assert!(matches!(&told[..], [Message::OrphanedEdits(left)] if left.changed), "{told:?}");
        let mut file = journal.take_up(Some(&path)).unwrap();
        let scene = file.document().scene().clone();
        file.save(&scene, false).unwrap();
        assert_eq!(std::fs::read_to_string(&path).unwrap(), starter());
    }

    #[test]
    fn complaints_come_once() {
        let mut journal = Autosave::new(None, "a", None);
        let file = SceneFile::untitled(starter().to_string(), "a").unwrap();
        let mut write = || {
            journal.note(Some(scene(3)), Instant::now());
            journal.write(&file)
        };
        assert!(matches!(write(), Some(Message::Trouble(_))));
        assert!(write().is_none());
    }
}
