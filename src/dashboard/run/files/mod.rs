//! Scene file and recovery file, each read and written by a thread of its own, so that a slow disk
//! does not block the dashboard.

mod autosave;
mod autosave_worker;
mod file_worker;
mod scene_list;
mod shared_file;

use crate::dashboard::Message;
use crate::dashboard::run::worker::Worker;
use autosave::Autosave;
pub use autosave_worker::AutosaveJob;
use autosave_worker::AutosaveWorker;
use crossbeam_channel::{Receiver, Sender, bounded, unbounded};
use file_worker::FileWorker;
pub use file_worker::Job;
pub use shared_file::SharedFile;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;
use zerkalo_scene::disk::FileStamp;
use zerkalo_scene::{Recovery, Scene, SceneFile};

/// Longest wait for pending saves when the program ends.
const SAVED_WITHIN: Duration = Duration::from_secs(2);
/// Longest wait for the write of the recovery file when the program ends. If it times out, the
/// program waits as long again for a recovery file in the state folder. Both waits and
/// [`SAVED_WITHIN`] together are shorter than the grace period after a terminating signal.
const KEPT_WITHIN: Duration = Duration::from_secs(1);

/// Path of the recovery file that keeps unsaved edits; `None` if there are none to keep. The error
/// is a message for the user.
type Kept = Result<Option<PathBuf>, String>;

/// Handle of the threads that access the scene file and the recovery file.
pub struct Files {
    jobs: Sender<Job>,
    autosaves: Sender<AutosaveJob>,
    pub shared: SharedFile,
    /// Newest scene with unsaved edits.
    unsaved: Option<Arc<Scene>>,
    /// Receiver that is disconnected after the last requested save.
    saving: Option<Receiver<()>>,
    threads: Option<(Worker<()>, Worker<Kept>)>,
}

impl Files {
    /// Starts the threads. `file` is the scene file, or the path of an unreadable one. `state` is
    /// the folder for recovery files that cannot be written beside their scene file.
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
        // A readable file gets no stamp yet, so that the first check compares its contents. The
        // errors of an unreadable one have been reported already.
        let seen = path.as_deref().filter(|_| file.is_none()).and_then(FileStamp::of);
        let name = file.as_ref().map_or("", |file| &file.document.name);
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
            is_broken: false,
            seen_assets: Vec::new(),
            state,
            autosaves: autosaves.clone(),
            shared: shared.clone(),
            results,
        };
        let threads = (
            Worker::spawn("files", move || worker.run(&inbox))?,
            Worker::spawn("autosave", move || autosave_worker.run(&autosave_inbox))?,
        );
        let threads = Some(threads);
        Ok(Self { jobs, autosaves, shared, unsaved: None, saving: None, threads })
    }

    /// Writes `scene` to the scene file, or to `path`, which then becomes the scene file.
    /// `overwrite` permits replacing what another program has written.
    pub fn save(&mut self, scene: Arc<Scene>, path: Option<PathBuf>, overwrite: bool) {
        let (preparing, prepared) = bounded(0);
        let (saving, saved) = bounded(0);
        self.saving = Some(saved);
        self.give_autosave(AutosaveJob::Saving(Arc::clone(&scene), preparing));
        self.give(Job::Save { scene, path, overwrite, prepared, saving });
    }

    /// Schedules an autosave: after a pause in editing, after a second of edits, or when the
    /// program ends. `None` removes the recovery file.
    pub fn autosave(&mut self, scene: Option<Arc<Scene>>) {
        self.unsaved.clone_from(&scene);
        self.give_autosave(AutosaveJob::Note(scene));
    }

    /// Writes unsaved edits to the recovery file at once, and waits at most for `patience`.
    pub fn flush(&self, patience: Duration) {
        let (done, completion) = bounded(1);
        self.give_autosave(AutosaveJob::Flush(done));
        let _ = completion.recv_timeout(patience);
    }

    /// Waits for pending writes, at most four seconds. Returns the path of the recovery file if
    /// there are unsaved edits. If the disk of the scene file does not respond, the edits are kept
    /// in the state folder.
    ///
    /// # Errors
    /// Fails with a message for the user if there are unsaved edits that cannot be kept.
    pub fn finish(&mut self) -> Result<Option<PathBuf>, String> {
        let Some((files, autosave)) = self.threads.take() else { return Ok(None) };
        self.give(Job::End);
        // The thread may still be reading a large file.
        let _ = self.saving.take().map(|saved| saved.recv_timeout(SAVED_WITHIN));
        files.join_within(Duration::ZERO);
        self.give_autosave(AutosaveJob::End);
        match (autosave.join_within(KEPT_WITHIN), self.unsaved.take(), self.shared.get()) {
            (Some(kept), ..) => kept,
            (None, Some(scene), Some(file)) => {
                keep_elsewhere(&scene, &file, self.shared.elsewhere())
            }
            _ => Ok(None),
        }
    }

    // Sending fails only after a panic of the thread, which `finish` propagates.

    pub fn give(&self, job: Job) {
        let _ = self.jobs.send(job);
    }

    pub fn give_autosave(&self, job: AutosaveJob) {
        let _ = self.autosaves.send(job);
    }
}

impl Drop for Files {
    fn drop(&mut self) {
        let _ = self.finish();
    }
}

/// Writes `scene` to a recovery file in the state folder, in a thread of its own, because that disk
/// may not respond either.
fn keep_elsewhere(
    scene: &Scene,
    file: &SceneFile,
    mut recovery: Recovery,
) -> Result<Option<PathBuf>, String> {
    let (text, base) = (file.text_of(scene), file.fingerprint());
    // The end of the thread unlocks the recovery file for the next start.
    let writer = Worker::spawn("recovery", move || {
        recovery.keep(&text, base).map(|()| recovery.path().map(Path::to_path_buf))
    });
    let no_answer = || Err(io::Error::other("the disk does not respond"));
    writer
        .and_then(|writer| writer.join_within(KEPT_WITHIN).unwrap_or_else(no_answer))
        .map_err(|why| format!("unsaved edits are lost: they cannot be kept ({why})"))
}

#[cfg(test)]
mod tests {
    use super::file_worker::CHECK_INTERVAL;
    use super::*;
    use crate::dashboard::testing::STARTER;
    use crossbeam_channel::Receiver;
    use std::fs;
    use zerkalo_scene::{SaveError, SceneErrors};

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
        fs::write(&path, STARTER).unwrap();
        let (mut files, inbox) = opened(&path);
        let mut scene = Scene::parse(STARTER, "a").unwrap();
        scene.film.size = [64, 48];
        files.save(Arc::new(scene.clone()), None, false);
        let saved = inbox.recv_timeout(PATIENCE).unwrap();
        assert!(matches!(saved, Message::Saved(_, Ok(at)) if at == path));
        assert_eq!(files.shared.get().unwrap().document.scene(), &scene);
        let quiet = inbox.recv_timeout(CHECK_INTERVAL + CHECK_INTERVAL / 2);
        assert!(quiet.is_err(), "{quiet:?}");
        // A rename replaces the file at once, so the worker never reads an incomplete file.
        let other = folder.path().join("b.toml");
        // The second save has the same length, and may be in the same second.
        for comment in ["# more", "# else"] {
            fs::write(&other, format!("{STARTER}\n{comment}\n")).unwrap();
            fs::rename(&other, &path).unwrap();
            let message = inbox.recv_timeout(PATIENCE).unwrap();
            let Message::ChangedOnDisk(difference) = message else { panic!("{message:?}") };
            assert!(difference.contains("is now `"), "{difference}");
        }
        let quiet = inbox.recv_timeout(CHECK_INTERVAL + CHECK_INTERVAL / 2);
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
        let (mut files, inbox) = opened(&path);
        files.give(Job::Load);
        assert!(loaded(inbox.recv_timeout(PATIENCE).unwrap()).is_err());
        files.save(Arc::default(), None, true);
        assert!(matches!(inbox.recv_timeout(PATIENCE).unwrap(), Message::Saved(_, Err(_))));
        assert_eq!(fs::read_to_string(&path).unwrap(), "[camera", "not ours to overwrite");
        fs::write(&path, STARTER).unwrap();
        assert!(matches!(inbox.recv_timeout(PATIENCE).unwrap(), Message::ChangedOnDisk(_)));
        files.give(Job::Load);
        assert!(loaded(inbox.recv_timeout(PATIENCE).unwrap()).is_ok());
        assert!(files.shared.get().is_some());
    }

    #[test]
    fn changed_mesh_is_noticed_once() {
        let folder = tempfile::tempdir().unwrap();
        let write = |name: &str, text: &str| {
            fs::write(folder.path().join(name), text).unwrap();
            folder.path().join(name)
        };
        let triangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
        write("m.obj", triangle);
        let scene = "ambient.color = [1, 1, 1]\n[[object]]\nshape.mesh = { file = \"m.obj\" }\n";
        let (files, inbox) = opened(&write("a.toml", scene));
        let quiet = inbox.recv_timeout(CHECK_INTERVAL + CHECK_INTERVAL / 2);
        assert!(quiet.is_err(), "{quiet:?}");
        write("m.obj", &triangle.replace("1 0 0", "2 0 0"));
        assert!(matches!(inbox.recv_timeout(PATIENCE).unwrap(), Message::AssetsChanged));
        let quiet = inbox.recv_timeout(CHECK_INTERVAL + CHECK_INTERVAL / 2);
        assert!(quiet.is_err(), "reported once: {quiet:?}");
        files.give(Job::Load);
        assert!(loaded(inbox.recv_timeout(PATIENCE).unwrap()).is_ok());
        let quiet = inbox.recv_timeout(CHECK_INTERVAL + CHECK_INTERVAL / 2);
        assert!(quiet.is_err(), "read anew: {quiet:?}");
    }

    #[test]
    fn edits_are_autosaved_at_end_unless_saved() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.toml");
        fs::write(&path, STARTER).unwrap();
        let mut scene = Scene::parse(STARTER, "a").unwrap();
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
        files.autosave(Some(Arc::new(Scene::parse(STARTER, "a").unwrap())));
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
        let untitled = SceneFile::untitled(STARTER.to_string(), "starter").unwrap();
        let mut files = Files::new(Ok(untitled), None, results).unwrap();
        let scene = Scene::parse(STARTER, "starter").unwrap();
        files.save(Arc::new(scene), Some(path.clone()), false);
        drop(files);
        assert_eq!(fs::read_to_string(&path).unwrap(), STARTER);
    }

    /// Writes a scene file to `folder`. Returns its path, and a scene that differs from its
    /// contents.
    fn edited(folder: &Path) -> (PathBuf, Arc<Scene>) {
        let path = folder.join("a.toml");
        fs::write(&path, STARTER).unwrap();
        let mut scene = Scene::parse(STARTER, "a").unwrap();
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
