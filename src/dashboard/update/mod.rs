//! State transitions of the dashboard, without access to clock, files or terminal.

mod adjust;
mod camera;
pub mod commands;
mod compare;
mod fields;
mod files;
mod focus;
mod form;
mod image_viewer;
mod keys;
mod lists;
mod mouse;
mod objects;
mod palette;
mod prompt;
mod recovery;
mod render;
mod watch;
mod zoom;

use crate::dashboard::model::{Notice, Tone, file_notice};
use crate::dashboard::panel_lines::{outline_position, scrolled, walked};
use crate::dashboard::{Effect, FieldList, Message, Model, Overlay};
use files::capital;
use ratatui::layout::Rect;
use std::iter::successors;
use std::mem::discriminant;
use std::sync::Arc;
use std::time::Duration;
use zerkalo_scene::Scene;
use zerkalo_scene::edit::{Edit, EditError, Target};
use zerkalo_scene::value::sanitized;

/// Updates the model with a message and returns the effects. `now` is the time since an arbitrary
/// fixed moment.
pub fn update(model: &mut Model, message: Message, now: Duration) -> Vec<Effect> {
    let mut context = UpdateContext { model, now, effects: Vec::new(), follow: false, typed: None };
    context.model.notice.take_if(|notice| notice.until.is_some_and(|until| until <= now));
    let marked = |model: &Model| model.shows_marks().then(|| model.selection.clone());
    let before = marked(context.model);
    context.model.marks_until.take_if(|until| *until <= now);
    if matches!(message, Message::Key(_) | Message::Mouse(_) | Message::Paste(_)) {
        context.model.marks_until = Some(now + MARKED);
    }
    context.handle(message);
    context.normalize();
    if marked(context.model) != before {
        context.repaint();
    }
    context.effects
}

/// Context of one call of [`update`].
pub(super) struct UpdateContext<'a> {
    model: &'a mut Model,
    now: Duration,
    effects: Vec<Effect>,
    /// `true` if lists are to be scrolled so that their cursors are visible.
    follow: bool,
    /// Character of the key that ran the current command; `None` if the key types none.
    typed: Option<char>,
}

/// Time after the last input for which the selection and the lights are marked.
const MARKED: Duration = Duration::from_secs(4);

/// Longest time between edits that form one undo step, longer than the delay after which a held key
/// repeats.
const REPEAT_WINDOW: Duration = Duration::from_millis(700);

/// Undo coalescing: rule that decides if an edit with the same label joins the previous undo step.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Coalesce {
    /// The edit is an undo step of its own.
    Single,
    /// The edit joins the previous step if it comes soon enough.
    Repeat,
    /// The edits of a gesture (a drag or mode) are one undo step.
    Gesture,
}

impl Coalesce {
    /// Returns `true` if the edit joins the previous step. `age` is the time since the previous
    /// edit; `None` unless its rule was [`Self::Repeat`].
    fn joins(self, age: Option<Duration>) -> bool {
        match self {
            Self::Single => false,
            Self::Repeat => age.is_some_and(|age| age <= REPEAT_WINDOW),
            Self::Gesture => true,
        }
    }
}

/// Unit vector (right, up, forward).
type Direction = [f64; 3];

const LEFT: Direction = [-1.0, 0.0, 0.0];
const RIGHT: Direction = [1.0, 0.0, 0.0];
const DOWN: Direction = [0.0, -1.0, 0.0];
const UP: Direction = [0.0, 1.0, 0.0];
/// Towards the eye.
const BACK: Direction = [0.0, 0.0, -1.0];
/// Away from the eye.
const FORWARD: Direction = [0.0, 0.0, 1.0];

impl UpdateContext<'_> {
    fn handle(&mut self, message: Message) {
        match message {
            Message::Key(key) => self.key(key),
            Message::Mouse(mouse) => self.mouse(mouse),
            Message::Paste(text) => self.paste(&text),
            Message::Resize(screen) => {
                self.follow = true;
                self.model.screen = screen;
                self.refit_image();
                self.repaint();
            }
            Message::Snapshot(snapshot) => {
                self.model.convergence.add(&snapshot.report);
                self.model.snapshot = Some(snapshot);
                self.model.refresh_loupe();
                self.repaint();
                self.keep_converged();
                self.export_if_done();
            }
            Message::Watched(report) => self.watched(*report),
            Message::Pinned(picture) => self.pinned(picture),
            Message::Bounces(shares) => self.bounces(shares),
            Message::Saved(scene, result) => self.saved(scene, result),
            Message::Loaded(result) => self.loaded(*result),
            Message::ChangedOnDisk(difference) => self.changed_on_disk(&difference),
            Message::BrokenOnDisk(errors) => self.broken_on_disk(errors),
            Message::MendedOnDisk => self.mended_on_disk(),
            Message::Opened(result) => self.opened(*result),
            Message::Scenes(scenes) => self.pick_scene(scenes),
            Message::Paths(text, paths) => self.complete_path(&text, &paths),
            Message::AssetsChanged => self.assets_changed(),
            Message::OrphanedEdits(edits) => self.orphaned_edits(edits),
            Message::Warning(text) => self.notify(Tone::Bad, capital(&text), None),
            Message::Exported(result) => self.exported(result),
            Message::ExportProgress(progress) => match (&mut self.model.export, progress) {
                (Some(export), Some((progress, left))) => {
                    export.progress = progress.max(export.progress);
                    export.left = left.or(export.left).filter(|_| export.progress < 1.0);
                }
                (export, _) => *export = None,
            },
            Message::ViewerImage(path, result) => self.image_ready(&path, result),
            Message::ImageSent(sent) => self.image_sent(sent),
            Message::ConnectionRate(rate) => self.model.connection_rate = rate,
            Message::Terminal(terminal) => self.set_graphics(*terminal),
            Message::Tick => {}
        }
    }

    /// Adds an effect. It replaces an effect of the same kind that this update has added before,
    /// except for saves and exports.
    fn emit(&mut self, effect: Effect) {
        if !matches!(effect, Effect::Save { .. } | Effect::Export(_) | Effect::ExportSized { .. }) {
            self.effects.retain(|e| discriminant(e) != discriminant(&effect));
        }
        self.effects.push(effect);
    }

    /// Marks the picture's cells as outdated.
    fn repaint(&mut self) {
        self.model.picture_version += 1;
    }

    /// Requests a render of the scene in the present view.
    fn show(&mut self) {
        self.keep_replaced();
        self.model.follow_edits();
        let scene = Arc::clone(self.model.seen());
        if self.model.display.tone != scene.film.tone {
            self.model.display.tone = scene.film.tone;
            self.emit(Effect::Display(self.model.display));
        }
        self.emit(Effect::Show(scene));
        self.repaint();
    }

    fn scene(&self) -> &Arc<Scene> {
        self.model.scene()
    }

    fn seen(&self) -> &Arc<Scene> {
        self.model.seen()
    }

    /// Returns an edit that depends on the view but leaves the camera of the scene as it is.
    fn edit_seen(
        &self,
        edit: impl FnOnce(&Scene) -> Result<Edit, EditError>,
    ) -> Result<Edit, EditError> {
        let mut edit = edit(self.seen())?;
        edit.scene.camera.clone_from(&self.scene().camera);
        Ok(edit)
    }

    /// Records an edit, or shows its error. `coalesce` decides if the edit joins the previous undo
    /// step. Returns `true` if the scene has changed.
    fn commit(&mut self, edit: Result<Edit, EditError>, coalesce: Coalesce) -> bool {
        match edit {
            Ok(edit) => self.record(edit, coalesce),
            Err(error) => {
                self.refuse(&error.to_string());
                false
            }
        }
    }

    /// Stores the edited scene in the open form, or else in the undo history. Returns `true` if the
    /// scene has changed.
    fn record(&mut self, edit: Edit, coalesce: Coalesce) -> bool {
        let known = file_notice(self.scene());
        match file_notice(&edit.scene).filter(|notice| known.as_ref() != Some(notice)) {
            Some(notice) => self.notify(Tone::Bad, notice, None),
            None => edit.note.iter().for_each(|note| self.say(note.clone())),
        }
        let scene = Arc::new(edit.scene);
        if let Some(Overlay::Form(form)) = &mut self.model.overlay {
            let changed = *form.scene != *scene;
            form.scene = scene;
            form.fields.refusal = None;
            if changed {
                self.show();
            }
            return changed;
        }
        let model = &mut *self.model;
        let age = model.last_edit.map(|last| self.now.saturating_sub(last));
        if !coalesce.joins(age) {
            model.history.end_gesture();
        }
        let changed = model.history.record(scene, &edit.label, coalesce != Coalesce::Single);
        model.last_edit = (coalesce == Coalesce::Repeat).then_some(self.now);
        if changed {
            self.show();
            self.restart_reason().into_iter().for_each(|reason| self.say(reason));
        }
        changed
    }

    /// Lets the next edit start a new undo step.
    fn end_gesture(&mut self) {
        self.model.history.end_gesture();
        self.model.last_edit = None;
    }

    /// Records an edit and selects the edited part. Returns `true` if the scene has changed.
    fn commit_and_select(&mut self, edit: Result<Edit, EditError>) -> bool {
        let target = edit.as_ref().ok().map(|edit| edit.target.clone());
        let changed = self.commit(edit, Coalesce::Single);
        if let Some(target) = target {
            self.select(target);
        }
        changed
    }

    fn select(&mut self, target: Target) {
        self.model.chosen_by_deletion = false;
        self.model.unfolded.extend(successors(target.compound(), Target::compound));
        if self.model.selection != target {
            self.model.selection = target;
            self.model.inspector = FieldList::default();
            self.skip_text();
        }
    }

    /// Shows a notice for `seconds`, or longer if reading it takes longer; `None` shows it until
    /// the next key.
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
            form.fields.refusal = Some(sanitized(text));
        } else {
            self.notify(Tone::Bad, text, Some(5.0));
        }
    }

    /// Restores the invariants of the model after an update: the selection exists, cursors are in
    /// range and visible, the session knows the size of the picture, and new edits are autosaved.
    fn normalize(&mut self) {
        if !self.model.selection.exists(self.model.scene()) {
            let last = |len: usize, of: fn(usize) -> Target| len.checked_sub(1).map(of);
            let scene = self.model.scene();
            let near = match &self.model.selection {
                part @ Target::Part(..) => successors(part.compound(), Target::compound)
                    .find(|compound| compound.exists(scene)),
                Target::Object(_) => last(scene.objects.len(), Target::Object),
                Target::Light(_) => last(scene.lights.len(), Target::Light),
                _ => None,
            };
            self.select(near.unwrap_or(Target::Camera));
        }
        let scene = Arc::clone(self.model.scene());
        self.model.marked.retain(|part| part.exists(&scene));
        self.request_view();
        self.normalize_lists();
        self.autosave();
    }

    /// Limits cursors and scroll positions to the existing lines, and scrolls lists to their
    /// cursors.
    fn normalize_lists(&mut self) {
        let follow = self.follow;
        let height = |area: Option<Rect>| area.map_or(0, |area| usize::from(area.height));
        let list = height(self.model.list_rows());
        if let Some((at, len)) = self.model.list() {
            at.follow(len, list);
        }
        if self.model.watch.is_some() {
            return;
        }
        let inspector = height(self.model.inspector_rows().map(|(rows, _)| rows));
        let rows = if self.in_form() { list } else { inspector };
        let lines = self.model.field_lines();
        let FieldList { cursor, scroll, .. } = self.model.field_list_mut();
        *cursor = walked(&lines, *cursor, 0);
        *scroll = scrolled(*scroll, Some(*cursor).filter(|_| follow), lines.len(), rows);
        let Some(rows) = self.model.outline_rows().filter(|_| !self.in_form()) else { return };
        let lines = self.model.outline_lines();
        let line = outline_position(&lines, &self.model.selection).filter(|_| follow);
        let scroll = &mut self.model.outline_scroll;
        *scroll = scrolled(*scroll, line, lines.len(), rows.height.into());
    }
}

/// Returns the item `by` positions after the current one, cyclically. The current item is the first
/// for which `is_current` is `true`, or else the first of all.
fn cycled<T>(items: &[T], is_current: impl Fn(&T) -> bool, by: isize) -> &T {
    let position = items.iter().position(is_current).unwrap_or(0) as isize;
    &items[(position + by).rem_euclid(items.len() as isize) as usize]
}
