//! Creation of objects and lights: the user picks a kind from a list, then fills in a form. The
//! picture previews the new object or light.

use crate::dashboard::overlay::{Form, Overlay, Pick, PickFor};
use crate::dashboard::update::{Coalesce, UpdateContext};
use crate::scene::edit::{self, Edit, EditError, Word};
use std::sync::Arc;

impl UpdateContext<'_> {
    pub(super) fn pick_object(&mut self) {
        self.pick_kind(PickFor::Object, "add an object", edit::object_kinds());
    }

    pub(super) fn pick_light(&mut self) {
        self.pick_kind(PickFor::Light, "add a light", edit::light_kinds());
    }

    fn pick_kind(&mut self, purpose: PickFor, title: &str, kinds: Vec<Word>) {
        let entries = kinds.into_iter().map(|word| (word.name, word.doc.to_string())).collect();
        let title = title.to_string();
        self.model.overlay =
            Some(Overlay::Pick(Pick { purpose, title, entries, cursor: 0, scroll: 0 }));
    }

    pub(super) fn open_object_form(&mut self, kind: &str) {
        self.open_form(kind, edit::add_object(self.scene(), kind, None));
    }

    pub(super) fn open_light_form(&mut self, kind: &str) {
        self.open_form(&format!("{kind} light"), edit::add_light(self.scene(), kind));
    }

    fn open_form(&mut self, what: &str, edit: Result<Edit, EditError>) {
        match edit {
            Ok(Edit { scene, subject, label, .. }) => {
                self.end_mode();
                self.model.overlay = Some(Overlay::Form(Form {
                    title: format!("new {what}"),
                    scene: Arc::new(scene),
                    subject,
                    label,
                    before: self.model.selection.clone(),
                    cursor: 0,
                    scroll: 0,
                    editor: None,
                    problem: None,
                }));
                self.show();
            }
            Err(error) => self.refuse(&error.to_string()),
        }
    }

    /// Adds the new object or light of the form to the scene, as one undo step.
    pub(super) fn confirm_form(&mut self) {
        let Some(Overlay::Form(form)) = self.model.overlay.take() else { return };
        let base = Arc::clone(self.model.history.scene());
        let mut scene = form.scene;
        // Materials that were created for the form but that no object uses are not kept.
        let unused: Vec<_> = scene
            .materials
            .keys()
            .filter(|name| !base.materials.contains_key(*name))
            .filter(|name| !scene.objects.iter().any(|object| object.names_material(name)))
            .cloned()
            .collect();
        for name in unused {
            Arc::make_mut(&mut scene).materials.remove(&name);
        }
        let scene = Arc::unwrap_or_clone(scene);
        let edit = Edit { scene, subject: form.subject.clone(), label: form.label, note: None };
        self.record(edit, Coalesce::Single);
        self.select(form.subject);
        let label = self.model.selection.label(self.scene());
        self.say(format!("{label} added · m moves it · r turns it · u undoes"));
    }

    /// Closes the form and restores the scene and the selection from before it was opened.
    pub(super) fn cancel_form(&mut self) {
        if let Some(Overlay::Form(form)) = self.model.overlay.take() {
            self.select(form.before);
            self.show();
        }
    }
}
