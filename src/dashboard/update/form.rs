//! Creation of objects and lights: the user picks a kind from a list, then fills in a form. The
//! picture previews the new object or light.

use crate::dashboard::model::FieldList;
use crate::dashboard::overlay::{Form, Overlay, Pick};
use crate::dashboard::update::{Coalesce, UpdateContext};
use std::sync::Arc;
use zerkalo_scene::edit::{self, Edit, EditError, Word};

impl UpdateContext<'_> {
    pub(super) fn pick_object(&mut self) {
        self.open_pick("add an object".to_string(), edit::object_kinds(), 0, |c, kind| {
            c.open_form(kind, edit::add_object(c.scene(), kind, None));
        });
    }

    pub(super) fn pick_light(&mut self) {
        self.open_pick("add a light".to_string(), edit::light_kinds(), 0, |c, kind| {
            c.open_form(&format!("{kind} light"), edit::add_light(c.scene(), kind));
        });
    }

    /// Opens a list of `words`, which are names with descriptions. The user picks one, which is
    /// passed to `take`. The cursor starts on the word with index `cursor`.
    pub(super) fn open_pick(
        &mut self,
        title: String,
        words: Vec<Word>,
        cursor: usize,
        take: fn(&mut UpdateContext<'_>, &str),
    ) {
        let entries = words.into_iter().map(|word| (word.name, word.doc.to_string())).collect();
        self.model.overlay = Some(Overlay::Pick(Pick { title, entries, cursor, scroll: 0, take }));
    }

    /// Opens the form for a new object or light of the kind `what`. `edit` is the edit that adds it
    /// to the scene. If `edit` is an error, shows a notice instead.
    pub(super) fn open_form(&mut self, what: &str, edit: Result<Edit, EditError>) {
        match edit {
            Ok(Edit { scene, subject, label, .. }) => {
                self.end_mode();
                self.model.overlay = Some(Overlay::Form(Form {
                    title: format!("new {what}"),
                    scene: Arc::new(scene),
                    subject,
                    label,
                    before: self.model.selection.clone(),
                    fields: FieldList::default(),
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
        // Materials that were created while the form was open are removed if no object uses them.
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
