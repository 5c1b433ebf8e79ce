//! State transitions: [`update`] changes the model by a message and returns effects. It has no
//! access to clock, files or terminal.

mod camera;
pub mod commands;
mod compare;
mod fields;
mod files;
mod focus;
mod form;
mod image_viewer;
mod keys;
mod lens;
mod light;
mod lists;
mod mirror;
mod mouse;
mod objects;
mod prompt;
mod recovery;
mod render;
mod watch;

use crate::dashboard::message::{Effect, Message};
use crate::dashboard::model::{Inspector, Model, Notice, Tone};
use crate::dashboard::overlay::Overlay;
use crate::dashboard::panel_lines::{
    PanelLine, nearest_field, outline, outline_position, scrolled,
};
use crate::render::session::State;
use crate::scene::Scene;
use crate::scene::edit::{Edit, EditError, Target};
use crate::value::sanitized;
use files::capital;
use std::mem::discriminant;
use std::sync::Arc;
use std::time::Duration;

/// Longest time between edits by repeated keys that form one undo step. It is longer than the delay
/// after which a held key starts to repeat.
const REPEAT_WINDOW: Duration = Duration::from_millis(700);

/// Returns the initial effects of a new model.
pub fn begin(model: &mut Model) -> Vec<Effect> {
    let mut context = UpdateContext::new(model, Duration::ZERO);
    context.emit(Effect::Stop(context.model.stop));
    if !context.model.file.unreadable {
        context.show();
    }
    context.normalize();
    context.effects
}

/// Updates the model with a message and returns the effects. `now` is the current time since any
/// fixed origin.
pub fn update(model: &mut Model, message: Message, now: Duration) -> Vec<Effect> {
    let mut context = UpdateContext::new(model, now);
    context.expire_notice();
    context.handle(message);
    context.normalize();
    context.effects
}

/// Context of one call of [`update`].
struct UpdateContext<'a> {
    model: &'a mut Model,
    now: Duration,
    effects: Vec<Effect>,
    /// `true` if outline and inspector scroll to keep their cursor visible; `false` after updates
    /// that must not undo scrolling by the user.
    follow: bool,
    /// Character of the key that ran the current command, if the key types one.
    typed: Option<char>,
}

/// Direction of a command on the screen or along the view direction.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Direction {
    Left,
    Right,
    Up,
    Down,
    /// Away from the eye.
    In,
    /// Towards the eye.
    Out,
}

/// Size of a step of a command.
#[derive(Clone, Copy, PartialEq, Eq)]
enum StepSize {
    Coarse,
    Fine,
}

/// Rule that decides if an edit is merged with the previous one into one undo step.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Coalesce {
    /// The edit is a separate undo step.
    Single,
    /// The edit is merged with an edit of the same label at most [`REPEAT_WINDOW`] before.
    Repeat,
    /// The edit is merged with edits of the same label until the gesture (a drag or mode) ends.
    Gesture,
}

impl<'a> UpdateContext<'a> {
    fn new(model: &'a mut Model, now: Duration) -> Self {
        Self { model, now, effects: Vec::new(), follow: true, typed: None }
    }

    fn handle(&mut self, message: Message) {
        match message {
            Message::Key(key) => self.key(key),
            Message::Mouse(mouse) => self.mouse(mouse),
            Message::Paste(text) => self.paste(&text),
            Message::Resize(screen) => {
                self.model.screen = screen;
                self.refit_image();
                self.repaint();
            }
            Message::Snapshot(snapshot) => {
                self.follow = false;
                if let State::Failed(reason) = &snapshot.report.state {
                    let text = format!("This scene cannot be rendered: {reason}");
                    self.notify(Tone::Bad, text, None);
                }
                self.model.convergence.add(&snapshot.report);
                self.model.snapshot = Some(snapshot);
                self.repaint();
            }
            Message::Watched(report) => {
                self.follow = false;
                self.watched(*report);
            }
            Message::Pinned(picture, spp) => self.pinned(picture, spp),
            Message::Saved(scene, result) => self.saved(scene, result),
            Message::Loaded(result) => self.loaded(*result),
            Message::ChangedOnDisk => self.changed_on_disk(),
            Message::OrphanedEdits(edits) => self.orphaned_edits(edits),
            Message::Warning(text) => {
                self.follow = false;
                self.notify(Tone::Bad, capital(&text), None);
            }
            Message::Exported(result) => self.exported(result),
            Message::CheckpointWritten(result) => self.checkpoint_written(result),
            Message::ExportProgress(progress) => {
                self.follow = false;
                if let Some(export) = &mut self.model.export {
                    export.progress = progress;
                }
            }
            Message::ViewerImage(path, result) => self.image_ready(&path, result),
            Message::ImageSent(sent) => {
                self.follow = false;
                if let Some(Overlay::ViewerImage(viewed)) = &mut self.model.overlay {
                    viewed.sent = sent;
                }
            }
            Message::LinkStatus(link) => {
                self.follow = false;
                self.model.link = link;
            }
            Message::Tick => self.follow = false,
        }
    }

    /// Adds `effect` to the results of the update. It replaces an earlier effect of the same kind,
    /// except for saves and exports.
    fn emit(&mut self, effect: Effect) {
        if !matches!(effect, Effect::Save { .. } | Effect::Export(_) | Effect::ExportSized { .. }) {
            self.effects.retain(|e| discriminant(e) != discriminant(&effect));
        }
        self.effects.push(effect);
    }

    /// Marks the cells of the picture as outdated.
    fn repaint(&mut self) {
        self.model.picture_version += 1;
    }

    /// Requests a render of the scene.
    fn show(&mut self) {
        let scene = Arc::clone(self.model.scene());
        self.emit(Effect::Show(scene));
        self.repaint();
    }

    fn scene(&self) -> &Arc<Scene> {
        self.model.scene()
    }

    /// Commits an edit, or shows its error as a notice. Returns `true` if the scene has changed.
    fn commit(&mut self, edit: Result<Edit, EditError>, coalesce: Coalesce) -> bool {
        match edit {
            Ok(edit) => self.record(edit, coalesce),
            Err(error) => {
                self.refuse(&error.to_string());
                false
            }
        }
    }

    /// Makes the scene of `edit` the current one, in the open form or else in the undo history.
    /// Returns `true` if the scene has changed.
    fn record(&mut self, edit: Edit, coalesce: Coalesce) -> bool {
        if let Some(note) = &edit.note {
            self.say(note.clone());
        }
        let scene = Arc::new(edit.scene);
        if let Some(Overlay::Form(form)) = &mut self.model.overlay {
            let changed = *form.scene != *scene;
            form.scene = scene;
            form.problem = None;
            if changed {
                self.show();
            }
            return changed;
        }
        let model = &mut *self.model;
        let soon = |last: Duration| self.now.saturating_sub(last) <= REPEAT_WINDOW;
        let joins = match coalesce {
            Coalesce::Single => false,
            Coalesce::Repeat => model.last_edit.is_some_and(soon),
            Coalesce::Gesture => true,
        };
        if !joins {
            model.history.end_gesture();
        }
        let changed = model.history.record(scene, &edit.label, coalesce != Coalesce::Single);
        model.last_edit = (coalesce == Coalesce::Repeat).then_some(self.now);
        if changed {
            self.show();
        }
        changed
    }

    /// Ends the merging of edits, so that the next edit starts a new undo step.
    fn end_gesture(&mut self) {
        self.model.history.end_gesture();
        self.model.last_edit = None;
    }

    /// Commits an edit and selects its target. Returns `true` if the scene has changed.
    fn commit_and_select(&mut self, edit: Result<Edit, EditError>) -> bool {
        let subject = edit.as_ref().ok().map(|edit| edit.subject.clone());
        let changed = self.commit(edit, Coalesce::Single);
        if let Some(subject) = subject {
            self.select(subject);
        }
        changed
    }

    fn select(&mut self, subject: Target) {
        if self.model.selection != subject {
            self.model.selection = subject;
            self.model.inspector = Inspector::default();
        }
    }

    /// Shows a notice for at least `seconds`, and for longer if the text is long. `None` shows
    /// the notice until the next key.
    fn notify(&mut self, tone: Tone, text: impl Into<String>, seconds: Option<f64>) {
        let text = sanitized(&text.into());
        let until = seconds.map(|seconds| {
            let reading = text.chars().count() as f64 * 0.05;
            self.now + Duration::from_secs_f64(seconds.max(reading))
        });
        self.model.notice = Some(Notice { text, tone, until });
    }

    fn say(&mut self, text: impl Into<String>) {
        self.notify(Tone::Plain, text, Some(3.0));
    }

    fn refuse(&mut self, text: &str) {
        if let Some(Overlay::Form(form)) = &mut self.model.overlay {
            form.problem = Some(sanitized(text));
        } else {
            self.notify(Tone::Bad, text, Some(5.0));
        }
    }

    /// Removes an expired notice.
    fn expire_notice(&mut self) {
        let over = |notice: &Notice| notice.until.is_some_and(|until| until <= self.now);
        if self.model.notice.as_ref().is_some_and(over) {
            self.model.notice = None;
        }
    }

    /// Restores the model's invariants: the selection exists in the scene, cursors are in range and
    /// visible, and the renderer has the current raster size.
    fn normalize(&mut self) {
        if !self.model.selection.exists(self.model.scene()) {
            let last = |len: usize, of: fn(usize) -> Target| len.checked_sub(1).map(of);
            let scene = self.model.scene();
            let near = match self.model.selection {
                Target::Object(_) => last(scene.objects.len(), Target::Object),
                Target::Light(_) => last(scene.lights.len(), Target::Light),
                _ => None,
            };
            self.select(near.unwrap_or(Target::Camera));
        }
        let raster = self.model.layout().map(|layout| layout.raster);
        if let Some(raster) = raster.filter(|raster| self.model.raster != Some(*raster)) {
            self.model.raster = Some(raster);
            self.emit(Effect::Raster(raster));
            self.repaint();
        }
        if self.model.watch.is_some() {
            self.move_watch_cursor(0);
            return;
        }
        self.normalize_panels();
        self.autosave();
    }

    /// Limits cursors and scroll positions of outline, inspector and form to the existing lines.
    fn normalize_panels(&mut self) {
        let lines = self.model.field_lines();
        let follow = self.follow;
        let overlay_layout = self.model.overlay_layout();
        let inspector_rows = self.model.inspector_rows();
        if let Some(Overlay::Form(form)) = &mut self.model.overlay {
            let rows = overlay_layout.map_or(0, |layout| layout.list.height);
            normalize_cursor(&mut form.cursor, &mut form.scroll, &lines, rows, follow);
            return;
        }
        let rows = inspector_rows.map_or(0, |(rows, _)| rows.height);
        let Inspector { cursor, scroll, .. } = &mut self.model.inspector;
        normalize_cursor(cursor, scroll, &lines, rows, follow);
        if let Some(rows) = self.model.outline_rows() {
            let lines = outline(self.model.scene());
            let rows = usize::from(rows.height);
            let scroll = &mut self.model.outline_scroll;
            *scroll = (*scroll).min(lines.len().saturating_sub(rows));
            let line = outline_position(&lines, &self.model.selection).filter(|_| follow);
            *scroll = line.map_or(*scroll, |line| scrolled(*scroll, line, lines.len(), rows));
        }
    }
}

/// Returns the item `by` positions after the current one, cyclically. Without a current item,
/// counts from the first.
fn cycled<T>(items: &[T], is_current: impl Fn(&T) -> bool, by: isize) -> &T {
    let position = items.iter().position(is_current).unwrap_or(0) as isize;
    &items[(position + by).rem_euclid(items.len() as isize) as usize]
}

/// Moves `cursor` to the nearest field of `lines` and limits `scroll` to the list. If `follow` is
/// `true`, scrolls to make the cursor visible in `rows` rows.
fn normalize_cursor(
    cursor: &mut usize,
    scroll: &mut usize,
    lines: &[PanelLine],
    rows: u16,
    follow: bool,
) {
    let rows = usize::from(rows);
    *cursor = nearest_field(lines, *cursor);
    *scroll = (*scroll).min(lines.len().saturating_sub(rows));
    if follow {
        *scroll = scrolled(*scroll, *cursor, lines.len(), rows);
    }
}
