//! Thread that reads and writes the scene file and checks it for changes by other programs. Because
//! it is a separate thread, a slow disk does not block the dashboard. Another thread writes the
//! recovery files, and never waits for the scene file.

use crate::dashboard::message::Message;
use crate::dashboard::run::autosave::Autosave;
use crate::dashboard::run::autosave_worker::{AutosaveJob, AutosaveWorker};
use crate::dashboard::run::shared_file::SharedFile;
use crate::dashboard::run::worker::Worker;
use crossbeam_channel::{Receiver, RecvTimeoutError, Sender, bounded, unbounded};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::thread;
use std::time::{Duration, Instant};
use zerkalo_scene::disk::FileStamp;
use zerkalo_scene::{DiskState, Recovery, SaveError, Scene, SceneErrors, SceneFile};

/// Interval between checks of the scene file for changes by other programs.
const CHECK_INTERVAL: Duration = Duration::from_secs(1);
/// Longest time that a save waits for the update of the recovery file.
const PREPARED_WITHIN: Duration = Duration::from_secs(2);
/// Longest wait for pending saves when the program ends.
const SAVED_WITHIN: Duration = Duration::from_secs(2);
/// Longest wait for the recovery file when the program ends. If the file cannot be written beside
/// the scene file in this time, it is written to the user's state folder, with the same time limit.
/// Together, these two waits and [`SAVED_WITHIN`] are shorter than the grace period after a
/// terminating signal.
const KEPT_WITHIN: Duration = Duration::from_secs(1);

pub(super) enum Job {
    Save {
        scene: Arc<Scene>,
        path: Option<PathBuf>,
        overwrite: bool,
        /// Receiver that is disconnected as soon as the recovery file is up to date; the scene may
        /// be saved then.
        prepared: Receiver<()>,
    },
    /// Read the scene file. The result is a [`Message::Loaded`].
    Load,
    /// Continue with this scene file. Its text was recovered because the scene file on disk is
    /// unreadable.
    Adopt(Box<SceneFile>),
    End,
}

/// Handle of two threads: one that reads and writes the scene file, and one that writes the
/// recovery file.
pub struct Files {
    jobs: Sender<Job>,
    autosaves: Sender<AutosaveJob>,
    /// Contents of the scene file as last read or written, shared between threads.
    pub shared: SharedFile,
    /// Newest scene with unsaved edits; `None` if all edits are saved.
    unsaved: Option<Arc<Scene>>,
    threads: Option<[Worker; 2]>,
}

impl Files {
    /// Starts the threads. `file` is the scene file, or the path of a scene file that is
    /// unreadable. The threads send their results to `results`. `state` is the folder for recovery
    /// files that cannot be written beside their scene file.
    pub fn new(
        file: Result<SceneFile, PathBuf>,
        state: Option<PathBuf>,
        results: Sender<Message>,
    ) -> io::Result<Self> {
        let (jobs, inbox) = unbounded();
        let (autosaves, autosave_inbox) = unbounded();
        let (path, file) = match file {
            Ok(file) => (file.path().map(Path::to_path_buf), Some(file)),
            Err(path) => (Some(path), None),
        };
        // A readable file gets no stamp yet, so that the first check compares its contents. An
        // unreadable file gets one, so that its errors, which have been reported, are not reported
        // again.
        let seen = path.as_deref().filter(|_| file.is_none()).and_then(FileStamp::of);
        let name = file.as_ref().map_or("", |file| file.document().name());
        let autosave = Autosave::new(path.as_deref(), name, state.clone());
        let shared = SharedFile::new(autosave.recovery.elsewhere());
        file.iter().for_each(|file| shared.put(file));
        let autosave_worker = AutosaveWorker {
            autosave,
            path: path.clone(),
            shared: shared.clone(),
            jobs: jobs.clone(),
            results: results.clone(),
        };
        let worker = FileWorker {
            path,
            file,
            seen,
            state,
            autosaves: autosaves.clone(),
            shared: shared.clone(),
            results,
        };
        let threads = [
            Worker::spawn("files", move || worker.run(&inbox))?,
            Worker::spawn("autosave", move || autosave_worker.run(&autosave_inbox))?,
        ];
        Ok(Self { jobs, autosaves, shared, unsaved: None, threads: Some(threads) })
    }

    /// Writes `scene` to the scene file, or to `path`, which then becomes the scene file. If
    /// `overwrite` is `true`, content that another program has written may be replaced. The result
    /// is a [`Message::Saved`].
    pub fn save(&self, scene: Arc<Scene>, path: Option<PathBuf>, overwrite: bool) {
        let (preparing, prepared) = bounded(0);
        self.give_autosave(AutosaveJob::Saving(Arc::clone(&scene), preparing));
        self.give(Job::Save { scene, path, overwrite, prepared });
    }

    /// Schedules an autosave of a scene with unsaved edits. The recovery file is written after a
    /// pause in editing, after a second of continued edits, or when the program ends. `None`
    /// removes the recovery file.
    pub fn autosave(&mut self, scene: Option<Arc<Scene>>) {
        self.unsaved.clone_from(&scene);
        self.give_autosave(AutosaveJob::Note(scene));
    }

    /// Writes unsaved edits to the recovery file at once, without the usual delay until a pause in
    /// editing. Waits until the edits are written, but at most for `patience`.
    pub fn flush(&self, patience: Duration) {
        let (done, completion) = bounded(1);
        self.give_autosave(AutosaveJob::Flush(done));
        let _ = completion.recv_timeout(patience);
    }

    /// Waits for pending writes, at most four seconds in total. Returns the path of the recovery
    /// file if there are unsaved edits. If the disk of the scene file does not respond in time, the
    /// edits are kept in the state folder.
    ///
    /// # Errors
    /// Fails with a message for the user if there are unsaved edits that cannot be kept.
    pub fn finish(&mut self) -> Result<Option<PathBuf>, String> {
        let Some([files, autosave]) = self.threads.take() else { return Ok(None) };
        self.give(Job::End);
        files.join_within(SAVED_WITHIN);
        let (reply, kept) = bounded(1);
        self.give_autosave(AutosaveJob::End(reply));
        if autosave.join_within(KEPT_WITHIN) {
            return kept.recv().unwrap_or(Ok(None));
        }
        match (self.unsaved.take(), self.shared.get()) {
            (Some(scene), Some(file)) => keep_elsewhere(&scene, &file, self.shared.elsewhere()),
            _ => Ok(None),
        }
    }

    // Sending fails only after a panic of the thread, which `finish` propagates.

    /// Gives `job` to the thread that reads and writes the scene file.
    pub(super) fn give(&self, job: Job) {
        let _ = self.jobs.send(job);
    }

    /// Gives `job` to the thread that writes the recovery file.
    pub fn give_autosave(&self, job: AutosaveJob) {
        let _ = self.autosaves.send(job);
    }
}

/// Waits for pending writes when the handle is dropped, as [`Files::finish`] does.
impl Drop for Files {
    fn drop(&mut self) {
        let _ = self.finish();
    }
}

/// Writes `scene`, an edited version of the scene in `file`, to the recovery file in the user's
/// state folder. Returns the path of the recovery file. A separate thread writes it, because the
/// disk of the state folder may not respond either.
fn keep_elsewhere(
    scene: &Scene,
    file: &SceneFile,
    mut recovery: Recovery,
) -> Result<Option<PathBuf>, String> {
    let (text, base) = (file.text_of(scene), file.fingerprint());
    let (reply, kept) = bounded(1);
    thread::spawn(move || {
        let kept = recovery.keep(&text, base).map(|()| recovery.path().map(Path::to_path_buf));
        // This unlocks the recovery file, so that the next start of the program offers the edits in
        // it.
        drop(recovery);
        // Sending fails if the receiver has timed out and is gone.
        let _ = reply.send(kept.map_err(|error| error.to_string()));
    });
    let no_answer = || Err("the disk does not respond".to_string());
    kept.recv_timeout(KEPT_WITHIN)
        .unwrap_or_else(|_| no_answer())
        .map_err(|why| format!("unsaved edits are lost: they cannot be kept ({why})"))
}

struct FileWorker {
    /// Path of the scene file; `None` for a scene without file.
    path: Option<PathBuf>,
    /// Scene file as last read or written; `None` if it has never been readable.
    file: Option<SceneFile>,
    /// Stamp of the scene file when it was last read, written or checked.
    seen: Option<FileStamp>,
    /// Folder for the program's state according to the XDG specification; `None` if the user has no
    /// such folder.
    state: Option<PathBuf>,
    autosaves: Sender<AutosaveJob>,
    shared: SharedFile,
    results: Sender<Message>,
}

impl FileWorker {
    /// Executes jobs of the thread that reads and writes scene files, until [`Job::End`].
    fn run(mut self, inbox: &Receiver<Job>) {
        let mut checked = Instant::now();
        loop {
            let next_check = checked + CHECK_INTERVAL;
            match inbox.recv_deadline(next_check) {
                Ok(Job::Save { scene, path, overwrite, prepared }) => {
                    let _ = prepared.recv_timeout(PREPARED_WITHIN);
                    let saved = self.save(&scene, path, overwrite);
                    self.send(Message::Saved(scene, saved));
                }
                Ok(Job::Load) => {
                    let loaded = self.load();
                    self.send(Message::Loaded(Box::new(loaded)));
                }
                Ok(Job::Adopt(file)) => self.file = Some(*file),
                Err(RecvTimeoutError::Timeout) => {}
                Ok(Job::End) | Err(RecvTimeoutError::Disconnected) => break,
            }
            let now = Instant::now();
            if next_check <= now {
                checked = now;
                if self.changed() {
                    self.send(Message::ChangedOnDisk);
                }
            }
        }
    }

    fn send(&self, message: Message) {
        // Sending fails only at the end of the program, when the receiver is gone.
        let _ = self.results.send(message);
    }

    /// Returns `true` if another program has changed the scene file since the last read, write or
    /// check.
    fn changed(&mut self) -> bool {
        let Some(path) = &self.path else { return false };
        let now = FileStamp::of(path);
        if self.seen == now {
            return false;
        }
        self.seen = now;
        match &self.file {
            Some(file) => file.on_disk() == DiskState::Changed,
            None => now.is_some(),
        }
    }

    fn save(
        &mut self,
        scene: &Arc<Scene>,
        path: Option<PathBuf>,
        overwrite: bool,
    ) -> Result<PathBuf, SaveError> {
        let Some(file) = &mut self.file else {
            let what = "its contents are not a scene".to_string();
            return Err(SaveError::Failed { path: self.path.clone().unwrap_or_default(), what });
        };
        match path {
            Some(path) => file.save_as(&path, scene, overwrite)?,
            None => file.save(scene, overwrite)?,
        }
        let path = file.path().ok_or(SaveError::Untitled)?.to_path_buf();
        self.seen = FileStamp::of(&path);
        let recovery = Recovery::new(Some(&path), "", self.state.as_deref());
        self.shared.set_elsewhere(recovery.elsewhere());
        self.shared.put(file);
        let _ = self.autosaves.send(AutosaveJob::Saved(Arc::clone(scene), path.clone()));
        self.path = Some(path.clone());
        Ok(path)
    }

    fn load(&mut self) -> Result<Arc<Scene>, SceneErrors> {
        // The stamp is taken before the file is read, so that a write during the read counts as a
        // change.
        self.seen = self.path.as_deref().and_then(FileStamp::of);
        let file = match (self.file.take(), &self.path) {
            (Some(file), _) => {
                let file = self.file.insert(file);
                file.reload()?;
                file
            }
            (None, Some(path)) => self.file.insert(SceneFile::open(path)?),
            (None, None) => return Ok(Arc::default()),
        };
        let scene = Arc::new(file.document().scene().clone());
        self.shared.put(file);
        Ok(scene)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;
    use zerkalo_scene::starter;

    /// Longest time that a test waits for a message of the file worker. Only a failing test reaches
    /// it.
    const PATIENCE: Duration = Duration::from_secs(60);

    fn opened(path: &Path) -> (Files, Receiver<Message>) {
        let (results, inbox) = unbounded();
        let file = SceneFile::open(path).map_err(|_| path.to_path_buf());
        (Files::new(file, None, results).unwrap(), inbox)
    }

    fn loaded(message: Message) -> Result<Arc<Scene>, SceneErrors> {
        match message {
            Message::Loaded(result) => *result,
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn external_change_is_reported_once() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.toml");
        fs::write(&path, starter()).unwrap();
        let (files, inbox) = opened(&path);
        let mut scene = Scene::parse(starter(), "a").unwrap();
        scene.film.size = [64, 48];
        files.save(Arc::new(scene.clone()), None, false);
        let saved = inbox.recv_timeout(PATIENCE).unwrap();
        assert!(matches!(saved, Message::Saved(_, Ok(at)) if at == path));
        assert_eq!(files.shared.get().unwrap().document().scene(), &scene);
        let quiet = inbox.recv_timeout(2 * CHECK_INTERVAL + CHECK_INTERVAL / 2);
        assert!(quiet.is_err(), "{quiet:?}");
        // A rename replaces the file at once, so the worker never reads an incomplete file.
        let other = folder.path().join("b.toml");
        fs::write(&other, format!("{}\n# more\n", starter())).unwrap();
        fs::rename(&other, &path).unwrap();
        assert!(matches!(inbox.recv_timeout(PATIENCE).unwrap(), Message::ChangedOnDisk));
        let quiet = inbox.recv_timeout(2 * CHECK_INTERVAL);
        assert!(quiet.is_err(), "reported once: {quiet:?}");
        files.save(Arc::new(scene), None, false);
        let refused = inbox.recv_timeout(PATIENCE).unwrap();
        assert!(matches!(refused, Message::Saved(_, Err(SaveError::Changed(_)))), "{refused:?}");
        files.give(Job::Load);
        assert_eq!(loaded(inbox.recv_timeout(PATIENCE).unwrap()).unwrap().film.size, [640, 480]);
    }

    #[test]
    fn fixed_file_can_be_loaded() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.toml");
        fs::write(&path, "[camera").unwrap();
        let (files, inbox) = opened(&path);
        files.give(Job::Load);
        assert!(loaded(inbox.recv_timeout(PATIENCE).unwrap()).is_err());
        files.save(Arc::default(), None, true);
        assert!(matches!(inbox.recv_timeout(PATIENCE).unwrap(), Message::Saved(_, Err(_))));
        assert_eq!(fs::read_to_string(&path).unwrap(), "[camera", "not ours to overwrite");
        fs::write(&path, starter()).unwrap();
        assert!(matches!(inbox.recv_timeout(PATIENCE).unwrap(), Message::ChangedOnDisk));
        files.give(Job::Load);
        assert!(loaded(inbox.recv_timeout(PATIENCE).unwrap()).is_ok());
        assert!(files.shared.get().is_some());
    }

    #[test]
    fn edits_are_autosaved_at_end_unless_saved() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.toml");
        fs::write(&path, starter()).unwrap();
        let mut scene = Scene::parse(starter(), "a").unwrap();
        scene.film.size = [64, 48];
        let scene = Arc::new(scene);
        let hidden = folder.path().join(".a.toml.unsaved");
        let (mut files, _inbox) = opened(&path);
        files.autosave(Some(Arc::clone(&scene)));
        assert_eq!(files.finish(), Ok(Some(hidden.clone())));
        assert!(fs::read_to_string(&hidden).unwrap().contains("64"));
        let (mut files, inbox) = opened(&path);
        let offered = inbox.recv_timeout(PATIENCE).unwrap();
        assert!(
            matches!(&offered, Message::OrphanedEdits(left) if left.scene == scene),
            "{offered:?}"
        );
        files.give_autosave(AutosaveJob::Recover);
        files.autosave(Some(Arc::clone(&scene)));
        files.save(Arc::clone(&scene), None, false);
        assert_eq!(files.finish(), Ok(None));
        assert!(!hidden.exists());
        assert!(fs::read_to_string(&path).unwrap().contains("64"));
        let (mut files, _inbox) = opened(&path);
        files.autosave(Some(Arc::new(Scene::parse(starter(), "a").unwrap())));
        files.flush(PATIENCE);
        assert!(hidden.exists());
        files.autosave(None);
        assert_eq!(files.finish(), Ok(None));
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn pending_jobs_finish_before_end() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("new.toml");
        let (results, _inbox) = unbounded();
        let untitled = SceneFile::untitled(starter().to_string(), "starter").unwrap();
        let files = Files::new(Ok(untitled), None, results).unwrap();
        let scene = Scene::parse(starter(), "starter").unwrap();
        files.save(Arc::new(scene), Some(path.clone()), false);
        drop(files);
        assert_eq!(fs::read_to_string(&path).unwrap(), starter());
    }

    /// Writes a scene file to `folder`. Returns two values: its path, and a scene that differs from
    /// the one in the file.
    fn edited(folder: &Path) -> (PathBuf, Arc<Scene>) {
        let path = folder.join("a.toml");
        fs::write(&path, starter()).unwrap();
        let mut scene = Scene::parse(starter(), "a").unwrap();
        scene.film.size = [64, 48];
        (path, Arc::new(scene))
    }

    /// Opens the scene file at `path` and simulates a disk that does not respond: the threads of
    /// the returned `Files` block as soon as they send a message, because the channel has no
    /// capacity and the test does not receive.
    fn opened_blocking(path: &Path, state: Option<PathBuf>) -> (Files, Receiver<Message>) {
        let (results, inbox) = bounded(0);
        (Files::new(Ok(SceneFile::open(path).unwrap()), state, results).unwrap(), inbox)
    }

    #[test]
    fn edits_are_kept_while_the_scene_file_blocks() {
        let folder = tempfile::tempdir().unwrap();
        let (path, scene) = edited(folder.path());
        let (mut files, _inbox) = opened_blocking(&path, None);
        files.give(Job::Load);
        files.autosave(Some(Arc::clone(&scene)));
        files.flush(PATIENCE);
        let hidden = folder.path().join(".a.toml.unsaved");
        assert!(fs::read_to_string(&hidden).unwrap().contains("64"));
        assert_eq!(files.finish(), Ok(Some(hidden)), "quitting does not wait for ever");
    }

    #[test]
    fn edits_are_kept_elsewhere_if_the_recovery_file_blocks() {
        let folder = tempfile::tempdir().unwrap();
        let (path, scene) = edited(folder.path());
        // The autosave thread offers these edits of a crashed run in a message. It blocks because
        // nothing receives the message.
        fs::write(folder.path().join(".a.toml.unsaved"), "[trace]\nmax_depth = 3\n").unwrap();
        let state = folder.path().join("state");
        let (mut files, _inbox) = opened_blocking(&path, Some(state.clone()));
        files.autosave(Some(scene));
        let kept = files.finish().unwrap().expect("a recovery file");
        assert!(kept.starts_with(&state) && fs::read_to_string(&kept).unwrap().contains("64"));
        let found = Recovery::new(Some(&path), "", Some(&state)).find();
        assert!(found.orphans.iter().any(|lost| lost.path() == kept), "the next start offers them");
        let (mut files, _inbox) = opened_blocking(&path, None);
        files.autosave(Some(edited(folder.path()).1));
        assert!(files.finish().unwrap_err().contains("unsaved edits are lost"));
    }

    #[test]
    fn edits_after_a_save_are_kept() {
        let folder = tempfile::tempdir().unwrap();
        let (path, first) = edited(folder.path());
        let mut second = Scene::clone(&first);
        second.film.size = [80, 60];
        let (mut files, inbox) = opened(&path);
        files.autosave(Some(Arc::clone(&first)));
        files.flush(PATIENCE);
        files.save(first, None, false);
        files.autosave(Some(Arc::new(second)));
        files.flush(PATIENCE);
        assert!(matches!(inbox.recv_timeout(PATIENCE).unwrap(), Message::Saved(_, Ok(_))));
        let kept = files.finish().unwrap().expect("a recovery file");
        assert!(fs::read_to_string(&path).unwrap().contains("64, 48"));
        assert!(fs::read_to_string(kept).unwrap().contains("80, 60"));
    }
}
