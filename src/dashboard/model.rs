//! Model: the complete state of the dashboard, from which the screen is drawn.

use crate::dashboard::graphics::Graphics;
use crate::dashboard::layout::{Border, Borders, Zoom};
use crate::dashboard::loupe::Loupe;
use crate::dashboard::pictures::{KeptPicture, Pictures};
use crate::dashboard::{
    Convergence, DisplayChannel, Editor, Focus, KeyContext, ListCursor, OrphanedEdits, Overlay,
    Preferences, SceneSource,
};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;
use zerkalo_render::film::{Display, PixelProbe, Window};
use zerkalo_render::schedule::{Interval, Stop};
use zerkalo_render::session::{Snapshot, View, WatchReport};
use zerkalo_scene::camera::Camera;
use zerkalo_scene::edit::Target;
use zerkalo_scene::value::sanitized;
use zerkalo_scene::{History, Scene, SceneErrors};
pub use zerkalo_terminal::cells::Colors;
use zerkalo_terminal::event::{Button, Mouse};

/// Mode of the picture's panel: the effect of arrow keys and drags.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Mode {
    /// Orbit the camera.
    #[default]
    Orbit,
    Move,
    /// Rotate the selection about the vertical axis.
    Rotate,
    /// Rotate the camera, and move it by letter keys.
    Fly,
    /// Move the pixel probe, which shows the values of one pixel.
    Probe,
}

/// State of the edited scene's file.
#[derive(Clone, Debug, Default)]
pub struct File {
    /// Path; `None` for a scene that has no file yet.
    pub path: Option<PathBuf>,
    /// Last component of the path, with control characters escaped.
    pub name: String,
    /// Scene as last read or written; without a file, the scene at the start.
    pub saved: Arc<Scene>,
    /// Errors in the current contents of the file; `None` without errors.
    pub broken: Option<SceneErrors>,
    /// Path of the last save that was refused because a file exists there.
    pub occupied: Option<PathBuf>,
    /// `true` if the file does not exist until the scene is saved.
    pub is_new: bool,
    /// `true` if the file has been unreadable since the start. There is no scene then, and the
    /// dashboard shows only the errors in `broken`.
    pub unreadable: bool,
}

/// State of a list of properties: the inspector or a form.
#[derive(Clone, Debug, Default)]
pub struct FieldList {
    /// Index of the line under the cursor, which is never a heading.
    pub cursor: usize,
    /// Index of the first visible line.
    pub scroll: usize,
    /// Editor of the field under the cursor; `None` unless a value is being typed.
    pub editor: Option<Editor>,
    /// Editor of the words that filter the lines; `None` unless they are being typed.
    pub filter: Option<Editor>,
    /// `true` if rarely used properties are visible.
    pub unfolded: bool,
    /// Reason why the last change in a form was refused.
    pub refusal: Option<String>,
}

impl FieldList {
    /// Returns `true` while a value or the words of the filter are being typed.
    pub fn is_typing(&self) -> bool {
        self.editor.is_some() || self.filter.is_some()
    }

    /// Returns the editor that receives the keys.
    pub fn typing(&mut self) -> Option<&mut Editor> {
        self.filter.as_mut().or(self.editor.as_mut())
    }

    /// Leaves the value and the filter as they are.
    pub fn stop_typing(&mut self) {
        (self.editor, self.filter) = (None, None);
    }

    /// Returns the reason why the typed value or the last change was refused.
    pub fn problem(&self) -> Option<&str> {
        let typed = self.editor.as_ref().and_then(|editor| editor.problem.as_deref());
        typed.or(self.refusal.as_deref())
    }
}

/// Kind of a notice, which determines its mark and colour.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Tone {
    Good,
    Plain,
    Bad,
}

/// Message that replaces the hint line for a while.
#[derive(Clone, Debug, PartialEq)]
pub struct Notice {
    /// Text with control characters escaped.
    pub text: String,
    pub tone: Tone,
    /// Time at which the notice disappears, on the clock of
    /// [`update`](crate::dashboard::update::update); `None` if it stays until the next key.
    pub until: Option<Duration>,
}

/// Returns a notice of what the readers of the scene's files left out; `None` if that is nothing.
pub fn file_notice(scene: &Scene) -> Option<String> {
    let notes = scene.file_notes();
    let (_, first) = notes.first()?;
    match notes.len() {
        1 => Some(first.clone()),
        n => Some(format!("{first} (and {} more: `zerkalo check`)", n - 1)),
    }
}

#[derive(Clone, Debug, PartialEq)]
pub struct WatchTable {
    pub report: WatchReport,
    pub at: ListCursor,
}

/// Export that renders in the background, at a size of the user's choice.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RunningExport {
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// Largest progress of the render so far, 0..=1.
    pub progress: f64,
    /// Time until its end, if it can be estimated.
    pub left: Option<Interval>,
}

/// Drag, which lasts from the press of a mouse button to its release.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Drag {
    pub button: Button,
    /// `true` if Control or Alt was held when the button was pressed.
    pub modified: bool,
    /// Column and row of the mouse at its last event.
    pub last: [u16; 2],
    /// `true` if the mouse has moved since the press; otherwise the release is a click.
    pub moved: bool,
    /// `true` if the button was pressed inside the picture.
    pub in_picture: bool,
    /// `true` if the button was pressed on a number in the inspector or a form.
    pub on_number: bool,
    /// `true` if the drag moves the selection, because it began there.
    pub moves: bool,
    /// Border between panels on which the button was pressed.
    pub border: Option<Border>,
}

impl Drag {
    /// Creates a drag that begins at `mouse`, on nothing that it changes.
    pub(super) fn new(button: Button, Mouse { column, row, modified, .. }: Mouse) -> Self {
        let last = [column, row];
        let (moved, in_picture, on_number, moves) = (false, false, false, false);
        Self { button, modified, last, moved, in_picture, on_number, moves, border: None }
    }
}

/// View that is not the camera of the scene.
#[derive(Clone, Debug)]
pub struct FreeView {
    /// Camera of the scene while this view is seen.
    pub left: Camera,
    /// Scene with the camera of the view.
    pub scene: Arc<Scene>,
}

/// State of the dashboard, from which the screen is drawn.
#[derive(Debug, Default)]
pub struct Model {
    pub screen: [u16; 2],
    pub colors: Colors,
    pub preferences: Preferences,
    /// `true` if the terminal is known to have a light background.
    pub on_light: bool,
    pub file: File,
    /// Edited scene with its undo history.
    pub history: History,
    /// View in the picture; `None` while it is that of the scene's camera.
    pub free_view: Option<FreeView>,
    /// Selected part of the scene, which always exists.
    pub selection: Target,
    /// Parts that are moved, rotated, duplicated and deleted together, the first marked first; if
    /// there are none, the selection is.
    pub marked: Vec<Target>,
    /// Compounds whose parts are listed in the outline.
    pub unfolded: BTreeSet<Target>,
    /// Groups of fields that are folded, each by the key of its first field.
    pub folded: BTreeSet<String>,
    /// Borders between panels that the user has moved.
    pub borders: Borders,
    /// `true` if a deletion has chosen the selection. It is not deleted before the user selects it.
    pub chosen_by_deletion: bool,
    pub focus: Focus,
    pub mode: Mode,
    /// `true` if no panel except the picture's is visible.
    pub fullscreen: bool,
    /// Index of the first visible line of the outline.
    pub outline_scroll: usize,
    /// State of the inspector, whose lines are those of `panel_lines::inspector`.
    pub inspector: FieldList,
    /// Open overlay, which covers panels and receives the keys.
    pub overlay: Option<Overlay>,
    /// Exposure and tone curve.
    pub display: Display,
    pub channel: DisplayChannel,
    pub pictures: Pictures,
    /// `true` if a histogram replaces the convergence plot.
    pub histogram: bool,
    /// Channel before the probe, to which its end returns; `None` without one.
    pub channel_before_probe: Option<DisplayChannel>,
    /// Film pixel (column, row) of the pixel probe.
    pub probe: Option<[usize; 2]>,
    /// Latest snapshot of the session.
    pub snapshot: Option<Box<Snapshot>>,
    pub convergence: Convergence,
    pub stop: Stop,
    /// `true` if the user has paused the render.
    pub paused: bool,
    /// Measured or fixed rate of output in bytes per second; `None` for a local terminal.
    pub connection_rate: Option<f64>,
    pub notice: Option<Notice>,
    /// Names of the palette entries that were chosen last, the latest first.
    pub recent: Vec<String>,
    pub export: Option<RunningExport>,
    pub last_export: Option<PathBuf>,
    /// `true` until the first user input. Until then, the hint line has hints for beginners.
    pub first_time: bool,
    pub drag: Option<Drag>,
    /// Time until which the selection and the lights are marked in the picture; `None` if the user
    /// has not done anything for a while.
    pub marks_until: Option<Duration>,
    /// `true` if the user has turned marks off.
    pub marks_off: bool,
    /// Time of the last edit, if the next edit may still join its undo step.
    pub last_edit: Option<Duration>,
    /// `true` if the program quits as soon as the pending save has succeeded.
    pub quit_when_saved: bool,
    /// `true` after the request to quit: later messages keep no edits that the user has discarded.
    pub quits: bool,
    /// Scene that opens as soon as the unsaved edits are saved or discarded.
    pub next_scene: Option<SceneSource>,
    /// `true` if a PNG is written as soon as the render ends.
    pub export_when_done: bool,
    /// Unsaved edits of a crashed run, until they are recovered or discarded.
    pub orphaned_edits: Option<OrphanedEdits>,
    /// Scene of the last autosave; `None` if there were no unsaved edits at that time.
    pub autosaved: Option<Arc<Scene>>,
    /// Last requested parts of snapshots.
    pub requested: View,
    /// Window of the film to which the render is limited.
    pub region: Option<Window>,
    /// Zoom of the film in its panel; `None` if the whole film is visible.
    pub zoom: Option<Zoom>,
    pub loupe: Loupe,
    pub graphics: Graphics,
    /// Counter that increases whenever the picture's cells may have become outdated.
    pub picture_version: u64,
    /// Table of watched film files; `None` except in `zerkalo watch`.
    pub watch: Option<WatchTable>,
}

/// Returns the last component of a path, with control characters escaped.
pub fn short_name(path: &Path) -> String {
    let name = path.file_name().unwrap_or(path.as_os_str());
    sanitized(&name.to_string_lossy())
}

/// Returns the first of `errors` as one line.
pub(super) fn first_line(errors: &SceneErrors) -> String {
    let first = errors.messages.first().map(ToString::to_string).unwrap_or_default();
    first.lines().map(str::trim).collect::<Vec<_>>().join(" ")
}

impl Model {
    /// Creates the model of a dashboard that renders `scene`, which is an error if the scene file
    /// at `path` cannot be read. Without a path, `name` is shown as the file name. The caller sets
    /// the screen size and the colours later.
    pub fn new(
        path: Option<PathBuf>,
        name: &str,
        scene: Result<Arc<Scene>, SceneErrors>,
        stop: Stop,
    ) -> Self {
        let (scene, broken) = match scene {
            Ok(scene) => (scene, None),
            Err(errors) => (Arc::default(), Some(errors)),
        };
        let name = path.as_deref().map_or(sanitized(name), short_name);
        let unreadable = broken.is_some();
        let notice = file_notice(&scene);
        Self {
            notice: notice.map(|text| Notice {
                text: sanitized(&text),
                tone: Tone::Bad,
                until: None,
            }),
            file: File {
                path,
                name,
                saved: Arc::clone(&scene),
                broken,
                occupied: None,
                is_new: false,
                unreadable,
            },
            display: Display { tone: scene.film.tone, ..Display::default() },
            history: History::new(scene),
            stop,
            first_time: true,
            ..Self::default()
        }
    }

    /// Returns the scene that edits start from: the preview of an open form, otherwise the edited
    /// scene.
    pub fn scene(&self) -> &Arc<Scene> {
        match &self.overlay {
            Some(Overlay::Form(form)) => &form.scene,
            _ => self.history.scene(),
        }
    }

    /// Returns `true` if there is no object to see.
    pub fn is_empty(&self) -> bool {
        self.watch.is_none() && !self.file.unreadable && self.scene().objects.is_empty()
    }

    /// Returns the scene to render: [`Model::scene`] as the view shows it.
    pub fn seen(&self) -> &Arc<Scene> {
        self.free_view.as_ref().map_or(self.scene(), |view| &view.scene)
    }

    /// Shows the scene from `camera`, which is no edit.
    pub(super) fn set_view(&mut self, camera: Camera) {
        let scene = self.scene();
        let free = camera != scene.camera && camera.faults().is_empty();
        self.free_view = free.then(|| FreeView {
            left: scene.camera.clone(),
            scene: Arc::new(Scene { camera, ..Scene::clone(scene) }),
        });
    }

    /// Shows edits of the scene in the view. The view follows an edit of the scene's camera: it
    /// becomes the camera that was moved, or gets the lens that was changed.
    pub(super) fn follow_edits(&mut self) {
        let Some(FreeView { left, scene: seen }) = self.free_view.take() else { return };
        let now = &self.scene().camera;
        if *now == left {
            self.set_view(seen.camera.clone());
        } else if left.with_lens_of(now) == *now {
            self.set_view(seen.camera.with_lens_of(now));
        }
    }

    /// Returns the picture that is compared with the live one.
    pub fn compared(&self) -> Option<&KeptPicture> {
        let live = self.snapshot.as_ref().map_or(0, |snapshot| snapshot.report.generation);
        self.pictures.compared(live)
    }

    /// Returns the parts of the scene that commands on the selection change, in the order of the
    /// outline.
    pub fn targets(&self) -> Vec<Target> {
        if self.marked.is_empty() {
            return vec![self.selection.clone()];
        }
        let mut targets = self.marked.clone();
        targets.sort_unstable();
        targets
    }

    pub fn is_unsaved(&self) -> bool {
        !self.history.is_saved()
    }

    /// Returns the context that decides which commands the keys run.
    pub fn context(&self) -> KeyContext {
        match (&self.overlay, self.focus, self.mode) {
            (Some(_), ..) => KeyContext::Overlay,
            _ if self.inspector.is_typing() => KeyContext::Overlay,
            // Watched films have no camera to orbit. Their table uses the keys of the outline.
            (None, _, Mode::Orbit) if self.watch.is_some() => KeyContext::Outline,
            (None, Focus::Outline, _) => KeyContext::Outline,
            (None, Focus::Inspector, _) => KeyContext::Inspector,
            (None, Focus::Picture, mode) => match mode {
                Mode::Orbit => KeyContext::Picture,
                Mode::Move => KeyContext::Moving,
                Mode::Rotate => KeyContext::Rotating,
                Mode::Fly => KeyContext::Flying,
                Mode::Probe => KeyContext::Probing,
            },
        }
    }

    /// Returns the state of the open form, or of the inspector.
    pub fn field_list(&self) -> &FieldList {
        match &self.overlay {
            Some(Overlay::Form(form)) => &form.fields,
            _ => &self.inspector,
        }
    }

    /// Returns cursor and length of the list in the open overlay, or of the table of watched files.
    /// Returns `None` if there is neither.
    pub fn list(&mut self) -> Option<(&mut ListCursor, usize)> {
        match (&mut self.overlay, &mut self.watch) {
            (Some(overlay), _) => overlay.list(),
            (None, Some(table)) => Some((&mut table.at, table.report.shards.len())),
            (None, None) => None,
        }
    }

    /// Returns `true` while an overlay or the inspector's text editor is open: questions must wait.
    pub fn is_busy(&self) -> bool {
        self.overlay.is_some() || self.inspector.is_typing()
    }

    /// Returns the values of the probed pixel; `None` without a probe, or before the session has
    /// reported them.
    pub fn probed(&self) -> Option<&PixelProbe> {
        let probe = self.snapshot.as_ref()?.probe.as_ref()?;
        (Some(probe.pixel) == self.probe).then_some(probe)
    }

    /// Returns the time at which the model needs the next
    /// [`Tick`](crate::dashboard::message::Message::Tick); `None` if it needs none.
    pub fn next_timeout(&self) -> Option<Duration> {
        let notice = self.notice.as_ref().and_then(|notice| notice.until);
        notice.into_iter().chain(self.marks_until).min()
    }
}
