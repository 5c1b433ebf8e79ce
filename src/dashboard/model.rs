//! The model: everything that the screen depends on.

use crate::dashboard::convergence::Convergence;
use crate::dashboard::editor::Editor;
use crate::dashboard::key_context::KeyContext;
use crate::dashboard::layout::{Focus, Layout, Request, layout};
use crate::dashboard::message::{DisplayChannel, Format, OrphanedEdits};
use crate::dashboard::overlay::Overlay;
use crate::dashboard::overlay_layout::wrapped;
use crate::film::{Display, LinearImage, Probe};
use crate::render::schedule::Stop;
use crate::render::session::Snapshot;
use crate::scene::edit::Target;
use crate::scene::{History, Scene, SceneErrors};
pub use crate::terminal::cells::Colors;
use crate::terminal::event::Button;
use crate::terminal::flow::LinkStatus;
use crate::value::sanitized;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

/// What the keys act on while the picture has the focus.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Mode {
    /// The camera.
    Orbit,
    /// The selection moves.
    Move,
    /// The selection turns.
    Rotate,
    /// The camera flies.
    Fly,
    /// The probe moves.
    Probe,
}

/// The file of the scene.
#[derive(Clone, Debug)]
pub struct File {
    /// Where it is; `None`: the scene has none yet.
    pub path: Option<PathBuf>,
    /// What the title calls it, printable: the last part of the path.
    pub name: String,
    /// The scene as the file has it; that as begun with if there is no file.
    pub saved: Arc<Scene>,
    /// Why the file as it is now cannot be read.
    pub broken: Option<SceneErrors>,
    /// Nothing could be read yet: there is nothing to show but `broken`.
    pub unreadable: bool,
}

/// The inspector's state. Its lines come from `panels::inspector`.
#[derive(Clone, Debug, Default)]
pub struct Inspector {
    /// Position in the lines; always that of a field.
    pub cursor: usize,
    /// First line shown.
    pub scroll: usize,
    /// The value being typed for the field under the cursor.
    pub editor: Option<Editor>,
}

/// What the picture is compared with.
#[derive(Clone, Debug, Default)]
pub struct Comparison {
    /// The kept picture and its mean samples per pixel.
    pub pinned: Option<(Arc<LinearImage>, f64)>,
    /// What is shown.
    pub shown: CompareView,
}

/// What is shown of two pictures.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum CompareView {
    /// The live one.
    #[default]
    Live,
    /// The kept one.
    Pinned,
    /// Their difference.
    Difference,
}

/// The tone of a notice.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Tone {
    /// Something was done.
    Good,
    /// Something to know.
    Plain,
    /// Something was refused or went wrong.
    Bad,
}

/// A line that stands in the place of the hints for a while.
#[derive(Clone, Debug, PartialEq)]
pub struct Notice {
    /// What it says; printable.
    pub text: String,
    /// How it is meant.
    pub tone: Tone,
    /// When it goes; `None`: with the next key.
    pub until: Option<Duration>,
}

/// A render at another size that is under way.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RunningExport {
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// The format.
    pub format: Format,
    /// How far it is, 0..=1.
    pub progress: f64,
}

/// A mouse button that is held down.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Drag {
    /// Which.
    pub button: Button,
    /// With Control or Alt when it went down.
    pub modified: bool,
    /// Column and row where it was last.
    pub last: [u16; 2],
    /// Whether it has moved since it went down: else it is a click.
    pub moved: bool,
    /// Whether it went down in the picture.
    pub in_picture: bool,
}

/// Everything that the screen depends on.
#[derive(Debug)]
pub struct Model {
    /// Columns and rows of the terminal.
    pub screen: [u16; 2],
    /// How many colours it has.
    pub colors: Colors,
    /// The scene's file.
    pub file: File,
    /// The scene and its edits.
    pub history: History,
    /// What is selected; always something that the scene has.
    pub selection: Target,
    /// Which panel has the focus.
    pub focus: Focus,
    /// What the keys do in the picture.
    pub mode: Mode,
    /// Everything but the picture is hidden.
    pub only_picture: bool,
    /// First line of the outline that is shown.
    pub outline_scroll: usize,
    /// The inspector.
    pub inspector: Inspector,
    /// What lies over the panels.
    pub overlay: Option<Overlay>,
    /// Exposure and tone curve.
    pub display: Display,
    /// What the picture shows.
    pub channel: DisplayChannel,
    /// Kept and live.
    pub comparison: Comparison,
    /// The probed pixel of the film (column, row).
    pub probe: Option<[usize; 2]>,
    /// The newest news of the renderer.
    pub snapshot: Option<Box<Snapshot>>,
    /// How the error has fallen.
    pub convergence: Convergence,
    /// When the work is done.
    pub stop: Stop,
    /// Tracing is stopped by the user.
    pub paused: bool,
    /// Tracing threads.
    pub threads: usize,
    /// The most tracing threads that make sense here.
    pub most_threads: usize,
    /// The tracing threads have low priority.
    pub low_priority: bool,
    /// What is known of the line to the terminal, if that is not here.
    pub line: Option<LinkStatus>,
    /// A notice instead of the hints.
    pub notice: Option<Notice>,
    /// A render at another size.
    pub export: Option<RunningExport>,
    /// The last picture that was written.
    pub last_export: Option<PathBuf>,
    /// Nothing has been pressed yet: the hints are those for a first time.
    pub first_time: bool,
    /// A mouse button that is held down.
    pub drag: Option<Drag>,
    /// When the last edit was that may be one gesture with the next.
    pub last_edit: Option<Duration>,
    /// A save that was asked for so as to quit afterwards.
    pub quit_when_saved: bool,
    /// Unsaved edits of a session that broke off, about which is not decided.
    pub left_behind: Option<OrphanedEdits>,
    /// The unsaved edits that were last asked to be kept.
    pub journaled: Option<Arc<Scene>>,
    /// The raster that snapshots were last asked for.
    pub raster: Option<[usize; 2]>,
    /// Counts up whenever the cells of the picture may have to be others.
    pub picture_version: u64,
}

/// What a model is begun with.
#[derive(Debug)]
pub struct Start {
    /// The file's path; `None`: no file yet.
    pub path: Option<PathBuf>,
    /// What to call the scene if it has no file.
    pub name: String,
    /// The scene, or why it cannot be read.
    pub scene: Result<Arc<Scene>, SceneErrors>,
    /// Columns and rows of the terminal.
    pub screen: [u16; 2],
    /// How many colours it has.
    pub colors: Colors,
    /// When the work is done.
    pub stop: Stop,
    /// Tracing threads.
    pub threads: usize,
    /// The most tracing threads that make sense here.
    pub most_threads: usize,
}

/// The last part of a path, printable.
pub fn short_name(path: &Path) -> String {
    let name = path.file_name().unwrap_or(path.as_os_str());
    sanitized(&name.to_string_lossy())
}

impl Model {
    /// The model of a program that has just been started. The run shows its scene
    /// ([`Model::scene`]) unless [`File::unreadable`].
    pub fn new(start: Start) -> Self {
        let (scene, broken) = match start.scene {
            Ok(scene) => (scene, None),
            Err(errors) => (Arc::new(Scene::default()), Some(errors)),
        };
        let name = start.path.as_deref().map_or(sanitized(&start.name), short_name);
        let unreadable = broken.is_some();
        let selection = Target::Camera;
        Self {
            screen: start.screen,
            colors: start.colors,
            file: File { path: start.path, name, saved: Arc::clone(&scene), broken, unreadable },
            history: History::new(scene),
            selection,
            focus: Focus::Picture,
            mode: Mode::Orbit,
            only_picture: false,
            outline_scroll: 0,
            inspector: Inspector::default(),
            overlay: None,
            display: Display::default(),
            channel: DisplayChannel::Beauty,
            comparison: Comparison::default(),
            probe: None,
            snapshot: None,
            convergence: Convergence::default(),
            stop: start.stop,
            paused: false,
            threads: start.threads.max(1),
            most_threads: start.most_threads.max(1),
            low_priority: false,
            line: None,
            notice: None,
            export: None,
            last_export: None,
            first_time: true,
            drag: None,
            last_edit: None,
            quit_when_saved: false,
            left_behind: None,
            journaled: None,
            raster: None,
            picture_version: 0,
        }
    }

    /// The scene that is shown: with the new thing of an open form.
    pub fn scene(&self) -> &Arc<Scene> {
        match &self.overlay {
            Some(Overlay::Form(form)) => &form.scene,
            _ => self.history.scene(),
        }
    }

    /// Whether there are edits that no file has.
    pub fn is_unsaved(&self) -> bool {
        !self.history.is_saved()
    }

    /// Where everything is; `None`: the terminal is too small.
    pub fn layout(&self) -> Option<Layout> {
        layout(&Request {
            screen: self.screen,
            film: self.scene().film.size,
            focus: self.focus,
            only_picture: self.only_picture,
        })
    }

    /// Where keys are looked up now.
    pub fn context(&self) -> KeyContext {
        match (&self.overlay, self.focus, self.mode) {
            (Some(_), ..) => KeyContext::Overlay,
            (None, Focus::Outline, _) => KeyContext::Outline,
            (None, Focus::Inspector, _) => KeyContext::Inspector,
            (None, Focus::Picture, mode) => match mode {
                Mode::Orbit => KeyContext::Picture,
                Mode::Move => KeyContext::Moving,
                Mode::Rotate => KeyContext::Turning,
                Mode::Fly => KeyContext::Flying,
                Mode::Probe => KeyContext::Probing,
            },
        }
    }

    /// The line of text that keys go to, if one is open.
    pub fn editor(&self) -> Option<&Editor> {
        match &self.overlay {
            Some(Overlay::Palette(palette)) => Some(&palette.editor),
            Some(Overlay::Prompt(prompt)) => Some(&prompt.editor),
            Some(Overlay::Form(form)) => form.editor.as_ref(),
            Some(_) => None,
            None => self.inspector.editor.as_ref(),
        }
    }

    /// What is known about the probed pixel.
    pub fn probed(&self) -> Option<&Probe> {
        let probe = self.snapshot.as_ref()?.probe.as_ref()?;
        (Some(probe.pixel) == self.probe).then_some(probe)
    }

    /// What the compiled scene contains, in lines of at most `width` columns.
    pub fn inventory(&self, width: u16) -> Vec<String> {
        match &self.snapshot {
            Some(snapshot) if !snapshot.report.inventory.is_empty() => {
                wrapped(&snapshot.report.inventory, width)
            }
            _ => vec!["Nothing has been compiled yet.".to_string()],
        }
    }

    /// When the screen changes by itself: send a [`Tick`](crate::dashboard::message::Message::Tick) then.
    pub fn next_timeout(&self) -> Option<Duration> {
        self.notice.as_ref().and_then(|notice| notice.until)
    }
}
