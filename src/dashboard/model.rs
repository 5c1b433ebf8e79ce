//! Model: the complete state that the screen is drawn from.

use crate::dashboard::convergence::Convergence;
use crate::dashboard::editor::Editor;
use crate::dashboard::key_context::KeyContext;
use crate::dashboard::layout::{Focus, Layout, Request, layout};
use crate::dashboard::message::{DisplayChannel, Format, OrphanedEdits};
use crate::dashboard::overlay::Overlay;
use crate::dashboard::overlay_layout::wrapped;
use crate::film::{Display, LinearImage, Probe};
use crate::render::schedule::Stop;
use crate::render::session::{Snapshot, WatchReport};
use crate::scene::edit::Target;
use crate::scene::{History, Scene, SceneErrors};
pub use crate::terminal::cells::Colors;
use crate::terminal::event::Button;
use crate::terminal::flow::LinkStatus;
use crate::value::sanitized;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

/// Mode of the picture's panel: determines the effect of arrow keys and drags.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Mode {
    /// Default mode: orbit the camera.
    Orbit,
    /// Move the selection.
    Move,
    /// Rotate the selection about the vertical axis.
    Rotate,
    /// Fly: arrow keys and drags turn the camera, letter keys move it.
    Fly,
    /// Move the probe, which shows the values of a pixel.
    Probe,
}

/// State of the scene file.
#[derive(Clone, Debug)]
pub struct File {
    /// Path; `None` for a scene that has no file yet.
    pub path: Option<PathBuf>,
    /// Last component of the path for titles, with control characters escaped.
    pub name: String,
    /// Scene as last read from or written to the file; without a file, the scene at the start.
    pub saved: Arc<Scene>,
    /// Errors in the current contents of the file; `None` if they are valid.
    pub broken: Option<SceneErrors>,
    /// `true` if the file has never been readable. There is no scene then, and only `broken` can be
    /// shown.
    pub unreadable: bool,
}

/// State of the inspector, whose lines `panel_lines::inspector` returns.
#[derive(Clone, Debug, Default)]
pub struct Inspector {
    /// Index of the line under the cursor, which is always a field.
    pub cursor: usize,
    /// Index of the first visible line.
    pub scroll: usize,
    /// Text editor of the field under the cursor, while a value is typed.
    pub editor: Option<Editor>,
}

/// Comparison of the live picture with a pinned one: an earlier picture that the user has stored.
#[derive(Clone, Debug, Default)]
pub struct Comparison {
    /// The pinned picture and its mean samples per pixel.
    pub pinned: Option<(Arc<LinearImage>, f64)>,
    /// Visible view of the comparison.
    pub shown: CompareView,
}

/// Visible view of a comparison.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum CompareView {
    /// The live picture.
    #[default]
    Live,
    /// The pinned picture.
    Pinned,
    /// The difference, live minus pinned.
    Difference,
}

/// Kind of a notice, which determines its mark and colour.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Tone {
    /// Success.
    Good,
    /// Information.
    Plain,
    /// Refusal or failure.
    Bad,
}

/// A message that replaces the hint line for a while.
#[derive(Clone, Debug, PartialEq)]
pub struct Notice {
    /// Text, with control characters escaped.
    pub text: String,
    /// Kind of the notice.
    pub tone: Tone,
    /// Time at which the notice disappears; `None` if it stays until the next key.
    pub until: Option<Duration>,
}

/// Table of the files that `zerkalo watch` shows.
#[derive(Clone, Debug, PartialEq)]
pub struct WatchTable {
    /// State of the files.
    pub report: WatchReport,
    /// Index of the row under the cursor.
    pub cursor: usize,
    /// Index of the first visible row.
    pub scroll: usize,
}

/// A running export, which renders at another size.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RunningExport {
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// File format.
    pub format: Format,
    /// Progress, 0..=1.
    pub progress: f64,
}

/// State of a mouse button that is held down.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Drag {
    /// Button that is held down.
    pub button: Button,
    /// Control or Alt was held when the button was pressed.
    pub modified: bool,
    /// Last known column and row of the mouse.
    pub last: [u16; 2],
    /// The mouse has moved since the press. Otherwise the release is a click.
    pub moved: bool,
    /// The button was pressed inside the picture.
    pub in_picture: bool,
}

/// State of the dashboard, from which the screen is drawn.
#[derive(Debug)]
pub struct Model {
    /// Columns and rows of the terminal.
    pub screen: [u16; 2],
    /// Colour depth of the terminal.
    pub colors: Colors,
    /// Scene file.
    pub file: File,
    /// Scene with its undo history.
    pub history: History,
    /// Selected part of the scene, such as the camera or an object. It always exists.
    pub selection: Target,
    /// Panel with the focus.
    pub focus: Focus,
    /// Meaning of the arrow keys while the picture has the focus.
    pub mode: Mode,
    /// `true` if only the picture is visible.
    pub fullscreen: bool,
    /// First visible line of the outline.
    pub outline_scroll: usize,
    /// State of the inspector.
    pub inspector: Inspector,
    /// Open overlay, which covers panels and receives the keys.
    pub overlay: Option<Overlay>,
    /// Exposure and tone curve.
    pub display: Display,
    /// Channel that the picture shows.
    pub channel: DisplayChannel,
    /// Comparison with a pinned picture.
    pub comparison: Comparison,
    /// Film pixel (column, row) whose values the probe shows.
    pub probe: Option<[usize; 2]>,
    /// Latest snapshot of the renderer.
    pub snapshot: Option<Box<Snapshot>>,
    /// History of the estimated error.
    pub convergence: Convergence,
    /// Stop criteria of the render.
    pub stop: Stop,
    /// `true` if the user has paused the render.
    pub paused: bool,
    /// Number of tracing threads.
    pub threads: usize,
    /// Maximum number of tracing threads.
    pub max_threads: usize,
    /// `true` if the tracing threads have low priority.
    pub low_priority: bool,
    /// Status of the connection to a remote terminal; `None` for a local terminal.
    pub link: Option<LinkStatus>,
    /// Notice that replaces the hints.
    pub notice: Option<Notice>,
    /// The running export at another size.
    pub export: Option<RunningExport>,
    /// Path of the last exported image.
    pub last_export: Option<PathBuf>,
    /// `true` until the first key is pressed. The hint line then shows the hints for beginners.
    pub first_time: bool,
    /// A mouse button that is held down.
    pub drag: Option<Drag>,
    /// Time of the last edit, if the next one may be merged with it into one undo step.
    pub last_edit: Option<Duration>,
    /// `true` if the program quits after the pending save.
    pub quit_when_saved: bool,
    /// Unsaved edits of a crashed session that the user has neither recovered nor discarded.
    pub orphaned_edits: Option<OrphanedEdits>,
    /// Scene that was last passed to
    /// [`Effect::Autosave`](crate::dashboard::message::Effect::Autosave).
    pub autosaved: Option<Arc<Scene>>,
    /// Columns and rows of half cells that were last requested for snapshots.
    pub raster: Option<[usize; 2]>,
    /// Counter that increases whenever the picture's cells may have changed.
    pub picture_version: u64,
    /// Table of watched files, in `zerkalo watch`. Commands that edit or render are then refused.
    /// `None` in the editing dashboard.
    pub watch: Option<WatchTable>,
}

/// Parameters of a new model.
#[derive(Debug)]
pub struct Start {
    /// Path of the scene file; `None` without a file.
    pub path: Option<PathBuf>,
    /// Name of a scene without a file.
    pub name: String,
    /// The scene, or the errors in its file.
    pub scene: Result<Arc<Scene>, SceneErrors>,
    /// Columns and rows of the terminal.
    pub screen: [u16; 2],
    /// Colour depth of the terminal.
    pub colors: Colors,
    /// Stop criteria of the render.
    pub stop: Stop,
    /// Number of tracing threads.
    pub threads: usize,
    /// Maximum number of tracing threads.
    pub max_threads: usize,
}

/// Returns the last component of a path, with control characters escaped.
pub fn short_name(path: &Path) -> String {
    let name = path.file_name().unwrap_or(path.as_os_str());
    sanitized(&name.to_string_lossy())
}

impl Model {
    /// Creates the model at the start of the program. The event loop then renders [`Model::scene`],
    /// unless [`File::unreadable`] is `true`.
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
            fullscreen: false,
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
            max_threads: start.max_threads.max(1),
            low_priority: false,
            link: None,
            notice: None,
            export: None,
            last_export: None,
            first_time: true,
            drag: None,
            last_edit: None,
            quit_when_saved: false,
            orphaned_edits: None,
            autosaved: None,
            raster: None,
            picture_version: 0,
            watch: None,
        }
    }

    /// Returns the scene to render: the preview of an open form, otherwise the edited scene.
    pub fn scene(&self) -> &Arc<Scene> {
        match &self.overlay {
            Some(Overlay::Form(form)) => &form.scene,
            _ => self.history.scene(),
        }
    }

    /// Returns `true` if the scene has edits that are not in its file.
    pub fn is_unsaved(&self) -> bool {
        !self.history.is_saved()
    }

    /// Returns the layout of the screen. Returns `None` if the terminal is too small.
    pub fn layout(&self) -> Option<Layout> {
        layout(&Request {
            screen: self.screen,
            film: self.scene().film.size,
            focus: self.focus,
            fullscreen: self.fullscreen,
            watching: self.watch.is_some(),
        })
    }

    /// Returns the context in which keys are looked up.
    pub fn context(&self) -> KeyContext {
        match (&self.overlay, self.focus, self.mode) {
            (Some(_), ..) => KeyContext::Overlay,
            // The keys of the table are those of the outline. There is no camera to orbit.
            (None, _, Mode::Orbit) if self.watch.is_some() => KeyContext::Outline,
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

    /// Returns the text editor that receives the keys. Returns `None` if none is open.
    pub fn editor(&self) -> Option<&Editor> {
        match &self.overlay {
            Some(Overlay::Palette(palette)) => Some(&palette.editor),
            Some(Overlay::Prompt(prompt)) => Some(&prompt.editor),
            Some(Overlay::Form(form)) => form.editor.as_ref(),
            Some(_) => None,
            None => self.inspector.editor.as_ref(),
        }
    }

    /// Returns `true` while an overlay or a text editor is open, which notices must not interrupt.
    pub fn is_busy(&self) -> bool {
        self.overlay.is_some() || self.editor().is_some()
    }

    /// Returns the values of the probed pixel. Returns `None` if the snapshot does not contain
    /// them.
    pub fn probed(&self) -> Option<&Probe> {
        let probe = self.snapshot.as_ref()?.probe.as_ref()?;
        (Some(probe.pixel) == self.probe).then_some(probe)
    }

    /// Returns the lines of the compiled scene's inventory, wrapped to `width` columns.
    pub fn inventory(&self, width: u16) -> Vec<String> {
        match &self.snapshot {
            Some(snapshot) if !snapshot.report.inventory.is_empty() => {
                wrapped(&snapshot.report.inventory, width)
            }
            _ => vec!["Nothing has been compiled yet.".to_string()],
        }
    }

    /// Returns the time at which the model needs the next
    /// [`Tick`](crate::dashboard::message::Message::Tick). Returns `None` if no timeout is pending.
    pub fn next_timeout(&self) -> Option<Duration> {
        self.notice.as_ref().and_then(|notice| notice.until)
    }
}
