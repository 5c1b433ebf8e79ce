//! Model: the complete state of the dashboard, from which the screen is drawn.

use crate::dashboard::convergence::Convergence;
use crate::dashboard::editor::Editor;
use crate::dashboard::key_context::KeyContext;
use crate::dashboard::layout::{Focus, Layout, Request, layout};
use crate::dashboard::message::{DisplayChannel, OrphanedEdits};
use crate::dashboard::overlay::Overlay;
use crate::dashboard::overlay_layout::wrapped;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;
use zerkalo_render::film::{Display, LinearImage, PixelProbe};
use zerkalo_render::schedule::Stop;
use zerkalo_render::session::{Snapshot, WatchReport};
use zerkalo_scene::edit::Target;
use zerkalo_scene::value::sanitized;
use zerkalo_scene::{History, Scene, SceneErrors};
pub use zerkalo_terminal::cells::Colors;
use zerkalo_terminal::event::Button;
use zerkalo_terminal::flow::LinkStatus;

/// Mode of the picture's panel, which determines the effect of arrow keys and drags.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Mode {
    /// Orbit the camera, the default mode.
    #[default]
    Orbit,
    /// Move the selected object or light.
    Move,
    /// Rotate the selected object or light about the vertical axis.
    Rotate,
    /// Fly the camera: arrow keys and drags turn it, letter keys move it.
    Fly,
    /// Move the pixel probe, which shows the samples, radiance and error of one pixel.
    Probe,
}

/// State of the edited scene's file.
#[derive(Clone, Debug, Default)]
pub struct File {
    /// Path of the scene file; `None` for a scene that has no file yet.
    pub path: Option<PathBuf>,
    /// Last component of the scene file's path, for titles, with control characters escaped.
    pub name: String,
    /// Scene as it was last read from or written to its file. If there is no file, the scene with
    /// which the program started.
    pub saved: Arc<Scene>,
    /// Errors in the current contents of the scene file; `None` if the contents are valid.
    pub broken: Option<SceneErrors>,
    /// `true` if the scene file has been unreadable since the start. There is no scene then, and
    /// the dashboard shows only the errors in `broken`.
    pub unreadable: bool,
}

/// State of a list of properties: the inspector or a form.
#[derive(Clone, Debug, Default)]
pub struct FieldList {
    /// Index of the list's line under the cursor. This line is always a field, not a heading.
    pub cursor: usize,
    /// Index of the first visible line of the list.
    pub scroll: usize,
    /// Text editor of the field under the cursor; `None` unless a value is being typed.
    pub editor: Option<Editor>,
}

/// Comparison of the live picture with a pinned one: an earlier picture that the user has stored.
#[derive(Clone, Debug, Default)]
pub struct Comparison {
    /// Pinned picture (the one that the user has stored for comparison) and its mean number of
    /// samples per pixel; `None` if none is pinned.
    pub pinned: Option<(Arc<LinearImage>, f64)>,
    /// Picture that the dashboard shows during the comparison: the live one, the pinned (stored)
    /// one, or the difference.
    pub shown: CompareView,
}

/// Picture that is visible in a comparison: the live one, the stored one or their difference.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum CompareView {
    /// Live picture: the one that the renderer refines.
    #[default]
    Live,
    /// Pinned picture, which the user has stored earlier, in place of the live one.
    Pinned,
    /// Live picture minus the pinned (stored) one, in false colour.
    Difference,
}

/// Kind of a notice: success, information or failure. It determines the notice's mark and colour.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Tone {
    /// Notice of success.
    Good,
    /// Notice with information.
    Plain,
    /// Notice of a refusal or failure.
    Bad,
}

/// Notice: a message that replaces the hint line for a while.
#[derive(Clone, Debug, PartialEq)]
pub struct Notice {
    /// Text of the notice, with control characters escaped.
    pub text: String,
    /// Kind of the notice: success, information, or refusal.
    pub tone: Tone,
    /// Time at which the notice disappears, or `None` if it stays until the next key. The time has
    /// the same origin as the argument `now` of [`update`](crate::dashboard::update::update).
    pub until: Option<Duration>,
}

/// Table of the film files that `zerkalo watch` shows.
#[derive(Clone, Debug, PartialEq)]
pub struct WatchTable {
    /// Report on the film files that are watched.
    pub report: WatchReport,
    /// Index of the table's row under the cursor.
    pub cursor: usize,
    /// Index of the first visible row of the table.
    pub scroll: usize,
}

/// Export that renders in the background, at a size of the user's choice.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RunningExport {
    /// Width and height of the exported image in pixels.
    pub size: [u32; 2],
    /// Progress of the export's render, 0..=1.
    pub progress: f64,
}

/// State of a drag, which lasts from the press of a mouse button to its release.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Drag {
    /// Mouse button that is held down.
    pub button: Button,
    /// `true` if Control or Alt was held when the button was pressed.
    pub modified: bool,
    /// Column and row of the mouse at its last event.
    pub last: [u16; 2],
    /// `true` if the mouse has moved since the press. Otherwise the release is a click.
    pub moved: bool,
    /// `true` if the button was pressed inside of the picture.
    pub in_picture: bool,
}

/// State of the dashboard, from which the screen is drawn.
#[derive(Debug, Default)]
pub struct Model {
    /// Columns and rows of the terminal.
    pub screen: [u16; 2],
    /// Set of colours that the terminal shows.
    pub colors: Colors,
    /// State of the scene file.
    pub file: File,
    /// Edited scene with its undo history.
    pub history: History,
    /// Selected part of the scene, such as the camera or an object. It always exists in the scene.
    pub selection: Target,
    /// Panel with the keyboard focus.
    pub focus: Focus,
    /// Mode of the picture's panel, which determines the effect of arrow keys.
    pub mode: Mode,
    /// `true` in full screen: no panel except the picture's is visible.
    pub fullscreen: bool,
    /// Index of the first visible line of the outline, the list of all parts of the scene.
    pub outline_scroll: usize,
    /// Cursor, scroll position and text editor of the inspector, the list of the selection's
    /// properties. `panel_lines::inspector` returns its lines.
    pub inspector: FieldList,
    /// Open overlay, which covers panels and receives the keys.
    pub overlay: Option<Overlay>,
    /// Exposure and tone curve of the displayed picture.
    pub display: Display,
    /// Channel of the render that the picture's panel shows, such as the rendered picture or the
    /// noise.
    pub channel: DisplayChannel,
    /// Comparison of the live picture with a pinned one: an earlier picture that the user has
    /// stored.
    pub comparison: Comparison,
    /// Film pixel (column, row) whose values the pixel probe shows; `None` without a probe.
    pub probe: Option<[usize; 2]>,
    /// Latest snapshot of the renderer: state of the render at one moment, with the picture so far.
    /// `None` before the first one.
    pub snapshot: Option<Box<Snapshot>>,
    /// History of the picture's estimated error, for the convergence plot.
    pub convergence: Convergence,
    /// Stop criteria of the render.
    pub stop: Stop,
    /// `true` if the user has paused the render.
    pub paused: bool,
    /// Number of threads that trace rays.
    pub threads: usize,
    /// Largest number of rendering threads that the user can set.
    pub max_threads: usize,
    /// `true` if the rendering threads have low priority.
    pub low_priority: bool,
    /// Status of the connection to a remote terminal; `None` for a local terminal.
    pub link: Option<LinkStatus>,
    /// Notice that replaces the hint line for a while.
    pub notice: Option<Notice>,
    /// Export that renders in the background, at a size of the user's choice; `None` if there is
    /// none.
    pub export: Option<RunningExport>,
    /// Path of the last exported image; `None` before the first export.
    pub last_export: Option<PathBuf>,
    /// `true` until the first key is pressed. Until then, the hint line shows hints for beginners.
    pub first_time: bool,
    /// Drag in progress; `None` if no mouse button is held down.
    pub drag: Option<Drag>,
    /// Time of the last edit, if the next edit may still be merged with it. The two edits form one
    /// undo step if they have the same label and little time passes between them. `None` if the
    /// next edit starts a new undo step.
    pub last_edit: Option<Duration>,
    /// `true` if the program quits as soon as the pending save has succeeded.
    pub quit_when_saved: bool,
    /// Unsaved edits that a crashed run of the program has left, and that the user has neither
    /// recovered nor discarded.
    pub orphaned_edits: Option<OrphanedEdits>,
    /// Scene that was last passed to
    /// [`Effect::Autosave`](crate::dashboard::message::Effect::Autosave). It is passed again only
    /// after an edit. `None` if there were no unsaved edits.
    pub autosaved: Option<Arc<Scene>>,
    /// Size of the pictures that were last requested from the renderer, in columns and rows of half
    /// cells. A half cell is the upper or lower half of a terminal cell. `None` before the first
    /// request.
    pub raster: Option<[usize; 2]>,
    /// Counter that increases whenever the terminal cells that show the picture may have become
    /// outdated.
    pub picture_version: u64,
    /// Table of watched film files; `None` except in `zerkalo watch`. Commands that edit or render
    /// are refused while files are watched.
    pub watch: Option<WatchTable>,
}

/// Returns the last component of a path, with control characters escaped.
pub fn short_name(path: &Path) -> String {
    let name = path.file_name().unwrap_or(path.as_os_str());
    sanitized(&name.to_string_lossy())
}

/// Returns the first of `errors` as one line.
pub(super) fn first_line(errors: &SceneErrors) -> String {
    let first = errors.messages().first().map(ToString::to_string).unwrap_or_default();
    first.lines().map(str::trim).collect::<Vec<_>>().join(" ")
}

impl Model {
    /// Creates the model of a dashboard that renders `scene` with `threads` threads until the first
    /// of the criteria `stop` is reached. `scene` is an error if the scene file cannot be read.
    /// `path` is the path of the scene file; without a path, `name` is shown as the file name. The
    /// event loop later sets the screen size and the colours, and renders [`Model::scene`] unless
    /// [`File::unreadable`] is `true`.
    pub fn new(
        path: Option<PathBuf>,
        name: &str,
        scene: Result<Arc<Scene>, SceneErrors>,
        stop: Stop,
        threads: usize,
    ) -> Self {
        let (scene, broken) = match scene {
            Ok(scene) => (scene, None),
            Err(errors) => (Arc::default(), Some(errors)),
        };
        let name = path.as_deref().map_or(sanitized(name), short_name);
        let unreadable = broken.is_some();
        let threads = threads.max(1);
        Self {
            file: File { path, name, saved: Arc::clone(&scene), broken, unreadable },
            history: History::new(scene),
            stop,
            threads,
            max_threads: threads,
            first_time: true,
            ..Self::default()
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

    /// Returns the layout of the screen in panels. Returns `None` if the terminal is too small.
    pub fn layout(&self) -> Option<Layout> {
        layout(&Request {
            screen: self.screen,
            film: self.scene().film.size,
            focus: self.focus,
            fullscreen: self.fullscreen,
            watching: self.watch.is_some(),
        })
    }

    /// Returns the context (overlay, panel or mode) that decides which commands the keys run.
    pub fn context(&self) -> KeyContext {
        match (&self.overlay, self.focus, self.mode) {
            (Some(_), ..) => KeyContext::Overlay,
            // Watched films have no camera to orbit. The table of files uses the keys of the
            // outline (the list of all parts of the scene).
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

    /// Returns the cursor, scroll position and text editor of the open form, or of the inspector if
    /// no form is open.
    pub fn field_list(&self) -> &FieldList {
        match &self.overlay {
            Some(Overlay::Form(form)) => &form.fields,
            _ => &self.inspector,
        }
    }

    /// Returns `true` while an overlay or the inspector's text editor is open. A question to the
    /// user must wait then.
    pub fn is_busy(&self) -> bool {
        self.overlay.is_some() || self.inspector.editor.is_some()
    }

    /// Returns the samples, the value and the error of the pixel at the pixel probe. Returns `None`
    /// if there is no probe, or if the renderer has not reported this pixel yet.
    pub fn probed(&self) -> Option<&PixelProbe> {
        let probe = self.snapshot.as_ref()?.probe.as_ref()?;
        (Some(probe.pixel) == self.probe).then_some(probe)
    }

    /// Returns the inventory, which lists the features of the compiled scene, as lines wrapped to
    /// `width` columns.
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
