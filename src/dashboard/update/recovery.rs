//! Recovery of unsaved edits after a crash, and requests for autosaves.

use crate::dashboard::model::Tone;
use crate::dashboard::text::duration;
use crate::dashboard::{Effect, OrphanedEdits, UpdateContext};
use std::sync::Arc;

impl UpdateContext<'_> {
    /// Asks if the edits of a crashed run are to be recovered, or shows a notice while the user is
    /// busy.
    pub(super) fn orphaned_edits(&mut self, edits: OrphanedEdits) {
        self.model.orphaned_edits = Some(edits);
        if self.model.is_busy() {
            let text = "Unsaved edits of a crashed session were found · : recover restores them";
            self.notify(Tone::Plain, text, None);
        } else {
            self.ask_recovery();
        }
    }

    pub(super) fn ask_recovery(&mut self) {
        let Some(edits) = &self.model.orphaned_edits else {
            self.say("No session with this scene has crashed");
            return;
        };
        let mut text = format!(
            "A session with {} ended unexpectedly {} ago with unsaved edits.",
            self.model.file.name,
            duration(edits.age.as_secs_f64())
        );
        if self.model.file.unreadable {
            text += " The file has become unreadable since.";
        } else if edits.changed {
            text += " The file has been changed since.";
        }
        self.ask(
            text,
            &[
                ('r', "recover them: undo returns to the file", |c| c.recover()),
                ('f', "view the file, decide later", |c| c.decline()),
                ('d', "discard them", |c| c.discard_orphaned_edits()),
            ],
        );
    }

    pub(super) fn recover(&mut self) {
        let Some(edits) = self.model.orphaned_edits.take() else { return };
        let scene = edits.scene;
        self.end_gesture();
        if std::mem::take(&mut self.model.file.unreadable) {
            self.model.history.restart(Arc::clone(&scene));
            // The recovered scene counts as unsaved.
            self.model.history.mark_saved(Arc::default());
            self.model.file.saved = scene;
        } else if !self.model.history.record(scene, "recovered edits", false) {
            self.emit(Effect::Discard);
            self.say("the file has them already");
            return;
        }
        self.emit(Effect::Recover);
        self.show();
        self.say("recovered, not yet saved · Ctrl-s saves, u undoes");
    }

    pub(super) fn discard_orphaned_edits(&mut self) {
        if self.model.orphaned_edits.take().is_some() {
            self.emit(Effect::Discard);
            self.say("discarded");
        }
    }

    /// Requests a write of the recovery file for new unsaved edits, or its removal if there are
    /// none or the user quits.
    pub(super) fn autosave(&mut self) {
        let quit = self.effects.iter().position(|effect| *effect == Effect::Quit);
        self.model.quits |= quit.is_some();
        let unsaved = !self.model.quits && !self.model.file.unreadable && self.model.is_unsaved();
        let scene = unsaved.then(|| Arc::clone(self.model.history.scene()));
        let [now, before] = [&scene, &self.model.autosaved].map(|s| s.as_ref().map(Arc::as_ptr));
        if now != before {
            self.model.autosaved.clone_from(&scene);
            self.effects.insert(quit.unwrap_or(self.effects.len()), Effect::Autosave(scene));
        }
    }
}
