//! Undo, saving, reloading and quitting, and the results of saves, loads and exports.

use crate::dashboard::model::{Tone, file_notice, first_line};
use crate::dashboard::pictures::Pictures;
use crate::dashboard::{
    Answer, Effect, Exported, OpenedScene, PickEntry, SceneSource, UpdateContext, short_name,
};
use std::collections::HashSet;
use std::path::PathBuf;
use std::sync::Arc;
use zerkalo_scene::edit::{Target, outline};
use zerkalo_scene::value::sanitized;
use zerkalo_scene::{SaveError, Scene, SceneErrors};
use zerkalo_terminal::stores_files;

const KEEP_FILE: Answer = ('c', "cancel: keep the file on disk", |c| c.decline());
const KEEP_EDITS: Answer = ('k', "keep my edits", |c| c.decline());
const OVERWRITE: Answer = ('o', "overwrite it", |c| c.write(None, true));
const STAY: Answer = ('c', "stay", |c| c.decline());
const SAVE_AS: Answer = ('s', "save under another name", |c| c.ask_path());
const LOAD: Answer = ('r', "read the file and lose my edits", |c| c.emit(Effect::Load));

impl UpdateContext<'_> {
    pub(super) fn undo(&mut self) {
        let before = Arc::clone(self.scene());
        let undone = self.model.history.undo();
        self.select_new(&before);
        self.report_history_step(undone, "undone", "Nothing to undo");
    }

    pub(super) fn redo(&mut self) {
        let before = Arc::clone(self.scene());
        let redone = self.model.history.redo();
        self.select_new(&before);
        self.report_history_step(redone, "redone", "Nothing to redo");
    }

    /// Selects the first part that the scene has and `before` has not.
    fn select_new(&mut self, before: &Scene) {
        self.model.marked.clear();
        let old: HashSet<_> = outline(before).iter().map(|(_, part)| part.title(before)).collect();
        let scene = Arc::clone(self.scene());
        let parts = outline(&scene).into_iter().map(|(_, part)| part);
        let grown = scene.objects.len() > before.objects.len()
            || outline(&scene).len() > outline(before).len();
        let new = parts.into_iter().find(|part| !old.contains(&part.title(&scene)));
        if let Some(part) = new.filter(|_| grown) {
            self.select(part);
        }
    }

    fn report_history_step(&mut self, label: Option<String>, what: &str, nothing: &str) {
        self.model.last_edit = None;
        match label {
            Some(label) => {
                self.show();
                self.say(format!("{what}: {label}"));
            }
            None => self.say(nothing),
        }
    }

    pub(super) fn save(&mut self) {
        let asks = self.model.file.path.is_none() || self.model.file.broken.is_some();
        if asks && self.in_form() {
            return self.refuse("First Home Enter adds, or Esc cancels; then Ctrl-s saves");
        }
        if self.model.file.path.is_none() {
            self.ask_path();
        } else if self.model.file.broken.is_some() {
            let text = format!(
                "{} on disk has an error now. Saving puts this scene in its place.",
                self.model.file.name
            );
            self.ask(text, &[KEEP_FILE, OVERWRITE, SAVE_AS]);
        } else {
            self.write(None, false);
        }
    }

    /// Requests a write to the scene file, or to `path`, which then becomes the scene file.
    /// `overwrite` permits replacing changes by other programs, or another file.
    pub(super) fn write(&mut self, path: Option<PathBuf>, overwrite: bool) {
        let scene = Arc::clone(self.model.history.scene());
        self.emit(Effect::Save { scene, path, overwrite });
    }

    pub(super) fn saved(&mut self, scene: Arc<Scene>, result: Result<PathBuf, SaveError>) {
        match result {
            Ok(path) => {
                self.model.file.name = short_name(&path);
                self.model.file.path = Some(path);
                self.model.file.saved = Arc::clone(&scene);
                self.model.file.broken = None;
                self.model.file.is_new = false;
                self.model.history.mark_saved(scene);
                self.model.last_edit = None;
                let view = self.model.free_view.as_ref();
                let view = view.map_or("", |_| " · the view is not saved: H makes it the camera");
                self.notify(Tone::Good, format!("saved {}{view}", self.model.file.name), Some(3.0));
                // The scene may have been edited while it was being saved.
                let is_unsaved = self.model.is_unsaved();
                if std::mem::take(&mut self.model.quit_when_saved) && !is_unsaved {
                    self.emit(Effect::Quit);
                }
                let next = self.model.next_scene.take();
                next.into_iter()
                    .filter(|_| !is_unsaved)
                    .for_each(|next| self.emit(Effect::Open(next)));
            }
            Err(SaveError::Untitled) => self.ask_path(),
            Err(error @ SaveError::Changed(_)) => {
                let text = capital(&error.to_string());
                self.ask(text, &[KEEP_FILE, OVERWRITE, SAVE_AS, LOAD]);
            }
            Err(SaveError::Exists(path)) => {
                let text = format!("{} exists.", sanitized(&path.display().to_string()));
                self.model.file.occupied = Some(path);
                let overwrite: Answer = ('o', "overwrite it", |c| {
                    let path = c.model.file.occupied.take();
                    c.write(path, true);
                });
                self.ask(text, &[SAVE_AS, overwrite]);
            }
            Err(error @ SaveError::Failed { .. }) => {
                self.decline();
                self.notify(Tone::Bad, capital(&error.to_string()), None);
            }
        }
    }

    pub(super) fn reload(&mut self) {
        if self.model.file.path.is_none() {
            self.say("This scene has no file to read yet");
        } else {
            self.load(format!("Reading {} again loses the unsaved edits.", self.model.file.name));
        }
    }

    /// Opens the built-in scene called `name`, or the scene file at this path. If there is no such
    /// file, the new scene gets it.
    pub(super) fn open_scene_file(&mut self, name: &str) {
        self.open_scene(SceneSource::of(name));
    }

    /// Opens a scene. If there are unsaved edits, asks first.
    pub(super) fn open_scene(&mut self, next: SceneSource) {
        if !self.model.is_unsaved() || self.model.file.unreadable {
            return self.emit(Effect::Open(next));
        }
        self.model.next_scene = Some(next);
        let text = format!("{} has unsaved edits.", self.model.file.name);
        let discard: Answer = ('d', "discard them", |c| {
            let next = c.model.next_scene.take();
            next.into_iter().for_each(|next| c.emit(Effect::Open(next)));
        });
        self.ask(text, &[('s', "save them first", |c| c.save()), discard, STAY]);
    }

    pub(super) fn pick_scene(&mut self, scenes: Vec<(String, &'static str)>) {
        if self.model.is_busy() {
            return;
        }
        let entries: Vec<_> =
            scenes.into_iter().map(|(name, note)| PickEntry::new(name, note)).collect();
        self.open_pick("open a scene", entries, 0, |c, name| c.open_scene_file(name));
    }

    pub(super) fn opened(&mut self, result: Result<OpenedScene, SceneErrors>) {
        let OpenedScene { scene, path, name, is_new } = match result {
            Ok(opened) => opened,
            Err(errors) => return self.notify(Tone::Bad, first_line(&errors), None),
        };
        let file = &mut self.model.file;
        (file.name, file.path, file.is_new) = (name, path, is_new);
        self.model.pictures = Pictures::default();
        self.model.region = None;
        self.model.export_when_done = false;
        self.model.orphaned_edits = None;
        self.model.selection = Target::Camera;
        let verb = if is_new { "new scene" } else { "opened" };
        self.loaded(Ok(scene));
        if file_notice(self.scene()).is_none() {
            self.say(format!("{verb} {}", self.model.file.name));
        }
    }

    /// Shows the first error that another program has written to the scene file.
    pub(super) fn broken_on_disk(&mut self, errors: SceneErrors) {
        let text = first_line(&errors);
        self.model.file.broken = Some(errors);
        self.notify(Tone::Bad, format!("{text} The scene here stays as it is."), None);
    }

    /// Removes the messages about errors in the file.
    pub(super) fn mended_on_disk(&mut self) {
        if !self.model.file.unreadable && self.model.file.broken.take().is_some() {
            self.model.notice = None;
        }
    }

    pub(super) fn changed_on_disk(&mut self, difference: &str) {
        self.mended_on_disk();
        let name = &self.model.file.name;
        if self.model.is_busy() {
            let text = format!("{name} has changed on disk · Ctrl-o reads it");
            self.notify(Tone::Plain, text, None);
        } else {
            self.load(format!("{name} has changed on disk{difference}. Here are unsaved edits."));
        }
    }

    pub(super) fn assets_changed(&mut self) {
        if self.model.is_busy() || self.model.is_unsaved() {
            let text = "a mesh or image has changed on disk · save, then Ctrl-o reads it";
            self.notify(Tone::Plain, text.to_string(), None);
        } else {
            self.emit(Effect::Load);
        }
    }

    /// Reads the scene file. If there are unsaved edits, asks `question` first.
    fn load(&mut self, question: String) {
        if self.model.is_unsaved() {
            self.ask(question, &[KEEP_EDITS, LOAD]);
        } else {
            self.emit(Effect::Load);
        }
    }

    /// Answers a question by changing nothing.
    pub(super) fn decline(&mut self) {
        self.model.quit_when_saved = false;
        self.model.next_scene = None;
    }

    pub(super) fn loaded(&mut self, result: Result<Arc<Scene>, SceneErrors>) {
        match result {
            Ok(scene) => {
                self.follow = true;
                // Indices may differ in the reloaded scene, so the selection is restored by name.
                let title = self.model.selection.title(self.model.history.scene());
                self.model.overlay = None;
                self.end_mode();
                self.model.marked.clear();
                self.model.file.saved = Arc::clone(&scene);
                self.model.file.broken = None;
                self.model.file.unreadable = false;
                self.model.history.restart(scene);
                let mut targets = outline(self.scene()).into_iter().map(|(_, target)| target);
                let found = targets.find(|target| target.title(self.scene()) == title);
                self.model.inspector.editor = None;
                self.select(found.unwrap_or(Target::Camera));
                self.show();
                match file_notice(self.scene()) {
                    Some(notice) => self.notify(Tone::Bad, notice, None),
                    None => self.say(format!("read {}", self.model.file.name)),
                }
            }
            Err(errors) => {
                let text = first_line(&errors);
                self.model.file.broken = Some(errors);
                if !self.model.file.unreadable {
                    self.notify(Tone::Bad, text, None);
                }
            }
        }
    }

    pub(super) fn quit(&mut self) {
        if self.model.is_unsaved() && !self.model.file.unreadable {
            let text = format!("{} has unsaved edits.", self.model.file.name);
            let save: Answer = ('s', "save and quit", |c| {
                c.model.quit_when_saved = true;
                c.save();
            });
            let discard: Answer = ('d', "discard them and quit", |c| c.emit(Effect::Quit));
            self.ask(text, &[save, discard, STAY]);
        } else if self.model.export.is_some() {
            let text = "A picture is still being rendered.".to_string();
            self.ask(text, &[STAY, ('q', "quit without it", |c| c.emit(Effect::Quit))]);
        } else {
            self.emit(Effect::Quit);
        }
    }

    pub(super) fn exported(&mut self, result: Result<Exported, String>) {
        match result {
            Ok(Exported { path, description, advice, is_image }) => {
                let later = if self.improves() { ", Alt-p: when converged" } else { "" };
                let stores = stores_files(&self.model.graphics.terminal);
                let stored = if stores { ", Y downloads it" } else { "" };
                let shown = match is_image {
                    true => format!("  ·  o shows it{stored}{later}"),
                    false => String::new(),
                };
                let text = format!("{}  {description}  ·  {advice}{shown}", path.display());
                if is_image {
                    self.model.last_export = Some(path);
                }
                self.notify(Tone::Good, text, None);
            }
            Err(reason) => self.notify(Tone::Bad, capital(&reason), None),
        }
    }

    pub(super) fn copy_path(&mut self) {
        let Some(path) = self.last_export() else { return };
        let text = path.display().to_string();
        if sanitized(&text) != text {
            // Control characters could run commands when pasted into a shell.
            self.refuse("Path contains control characters; not copied");
            return;
        }
        self.emit(Effect::Copy(path));
        self.say(format!("the path of {text} is in the terminal's clipboard, if it allows that"));
    }
}

/// Returns `text` with its first letter in upper case, unless it begins with the name of a file.
pub(super) fn capital(text: &str) -> String {
    if text.split(' ').next().is_some_and(|word| word.contains(['.', '/'])) {
        return text.to_string();
    }
    let mut chars = text.chars();
    chars.next().map_or_else(String::new, |c| c.to_uppercase().chain(chars).collect())
}
