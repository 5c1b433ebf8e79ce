//! Thread that reads and writes the scene file and checks it for changes by other programs.

use crate::dashboard::run::files::{AutosaveJob, SharedFile, scene_list};
use crate::dashboard::{Message, OpenedScene, SceneSource, short_name};
use crossbeam_channel::{Receiver, RecvTimeoutError, Sender};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};
use zerkalo_scene::disk::FileStamp;
use zerkalo_scene::value::truncated;
use zerkalo_scene::{DiskState, Recovery, SaveError, Scene, SceneErrors, SceneFile};

/// Interval between checks for changes by other programs.
pub const CHECK_INTERVAL: Duration = Duration::from_secs(1);
/// Longest time for which a save waits until the recovery file is up to date.
const PREPARED_WITHIN: Duration = Duration::from_secs(2);

pub enum Job {
    Save {
        scene: Arc<Scene>,
        path: Option<PathBuf>,
        overwrite: bool,
        /// Receiver that is disconnected as soon as the recovery file is up to date.
        prepared: Receiver<()>,
        /// Sender that is dropped after the save.
        saving: Sender<()>,
    },
    /// Read the scene file.
    Load,
    /// Replace the scene by another one.
    Open(SceneSource),
    /// List the scenes that can be opened.
    List,
    /// List the paths that begin with this text: if `true`, relative to the folder of the scene file.
    Complete(String, bool),
    /// Continue with this text, recovered for an unreadable scene file.
    Adopt(Box<SceneFile>),
    End,
}

pub struct FileWorker {
    pub path: Option<PathBuf>,
    /// Scene file as last read or written; `None` if it has never been readable.
    pub file: Option<SceneFile>,
    /// Stamp of the scene file when it was last read, written or checked.
    pub seen: Option<FileStamp>,
    /// `true` if the scene file had errors at the latest check.
    pub is_broken: bool,
    /// Meshes and images that had changed at the latest check.
    pub seen_assets: Vec<(PathBuf, Option<FileStamp>)>,
    /// State folder of the user (XDG).
    pub state: Option<PathBuf>,
    pub autosaves: Sender<AutosaveJob>,
    pub shared: SharedFile,
    pub results: Sender<Message>,
}

impl FileWorker {
    pub fn run(mut self, inbox: &Receiver<Job>) {
        let mut checked = Instant::now();
        loop {
            let next_check = checked + CHECK_INTERVAL;
            match inbox.recv_deadline(next_check) {
                Ok(Job::Save { scene, path, overwrite, prepared, saving: _saving }) => {
                    let _ = prepared.recv_timeout(PREPARED_WITHIN);
                    let saved = self.save(&scene, path, overwrite);
                    self.send(Message::Saved(scene, saved));
                }
                Ok(Job::Load) => {
                    let loaded = self.load();
                    self.send(Message::Loaded(Box::new(loaded)));
                }
                Ok(Job::Open(source)) => {
                    let opened = self.open(&source);
                    self.send(Message::Opened(Box::new(opened)));
                }
                Ok(Job::List) => {
                    let folder = self.path.as_deref().and_then(Path::parent);
                    self.send(Message::Scenes(scene_list::names(folder, self.state.as_deref())));
                }
                Ok(Job::Complete(text, beside_scene)) => {
                    let folder = self.path.as_deref().and_then(Path::parent);
                    let folder = folder.filter(|_| beside_scene).unwrap_or(Path::new(""));
                    let paths = scene_list::paths(folder, &text);
                    self.send(Message::Paths(text, paths));
                }
                Ok(Job::Adopt(file)) => self.file = Some(*file),
                Err(RecvTimeoutError::Timeout) => {}
                Ok(Job::End) | Err(RecvTimeoutError::Disconnected) => break,
            }
            let now = Instant::now();
            if next_check <= now {
                checked = now;
                if let Some(change) = self.changed() {
                    self.send(change);
                } else if self.assets_changed() {
                    self.send(Message::AssetsChanged);
                }
            }
        }
    }

    fn send(&self, message: Message) {
        // Sending fails only at the end of the program, when the receiver is gone.
        let _ = self.results.send(message);
    }

    /// Returns the message that another program has changed the scene file since the last read,
    /// write or check; `None` if none has.
    fn changed(&mut self) -> Option<Message> {
        let path = self.path.as_ref()?;
        let now = FileStamp::of(path);
        if self.seen == now {
            return None;
        }
        self.seen = now;
        let Some(file) = &self.file else {
            return now.map(|_| Message::ChangedOnDisk(String::new()));
        };
        let was_broken = std::mem::take(&mut self.is_broken);
        if file.on_disk() != DiskState::Changed {
            return was_broken.then_some(Message::MendedOnDisk);
        }
        let assets = file.document.scene().resolver.assets.clone();
        match SceneFile::open_with(path, assets) {
            Ok(new) => {
                let texts = [file.document.text(), new.document.text()];
                Some(Message::ChangedOnDisk(difference(texts)))
            }
            Err(errors) => {
                self.is_broken = true;
                Some(Message::BrokenOnDisk(errors))
            }
        }
    }

    fn open(&mut self, source: &SceneSource) -> Result<OpenedScene, SceneErrors> {
        let assets = self.file.as_ref().map(|file| file.document.scene().resolver.assets.clone());
        let file = source.open(assets.unwrap_or_default())?;
        self.path = file.path().map(Path::to_path_buf);
        self.seen = self.path.as_deref().and_then(FileStamp::of);
        self.is_broken = false;
        let opened = OpenedScene {
            scene: file.document.shared_scene(),
            path: self.path.clone(),
            name: self.path.as_deref().map_or(file.document.name.clone(), short_name),
            is_new: self.path.is_some() && self.seen.is_none(),
        };
        let recovery = Recovery::new(self.path.as_deref(), &opened.name, self.state.as_deref());
        self.shared.set_elsewhere(recovery.elsewhere());
        self.shared.put(&file);
        self.file = Some(file);
        let job = AutosaveJob::Opened(self.path.clone(), opened.name.clone());
        let _ = self.autosaves.send(job);
        self.remember();
        Ok(opened)
    }

    /// Adds the scene file to the list of recent ones.
    fn remember(&self) {
        if let (Some(path), Some(state)) = (&self.path, &self.state) {
            scene_list::remember(path, state);
        }
    }

    /// Returns `true` if another program has changed a mesh or image since the last check.
    fn assets_changed(&mut self) -> bool {
        let Some(file) = &self.file else { return false };
        let changed = file.document.scene().resolver.assets.changed();
        let is_new = !changed.is_empty() && changed != self.seen_assets;
        self.seen_assets = changed;
        is_new
    }

    /// Writes the scene file, and informs the other threads of its new contents.
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
        self.is_broken = false;
        self.remember();
        Ok(path)
    }

    fn load(&mut self) -> Result<Arc<Scene>, SceneErrors> {
        // The stamp is older than the text, so that a write during the read counts as a change.
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
        let scene = file.document.shared_scene();
        self.shared.put(file);
        Ok(scene)
    }
}

/// Describes the first line in which the second text differs from the first.
fn difference([old, new]: [&str; 2]) -> String {
    let same = old.lines().zip(new.lines()).take_while(|(old, new)| old == new).count();
    match new.lines().nth(same) {
        Some(line) => format!(": line {} is now `{}`", same + 1, truncated(line.trim())),
        None => format!(": it ends after line {same}"),
    }
}
