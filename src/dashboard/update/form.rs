//! Creation of objects and lights: the user picks a kind, then fills in a form.

use crate::dashboard::update::Coalesce;
use crate::dashboard::{FieldList, Form, Overlay, PickEntry, UpdateContext};
use std::sync::Arc;
use zerkalo_scene::edit::{self, Edit, EditError, Word};

/// Returns the entries of a list of what can be added: kinds, whose properties a form asks for, then
/// parts that are ready, which a search finds first.
fn added(kinds: Vec<Word>, ready: Vec<Word>) -> Vec<PickEntry> {
    let kind = |kind: Word| PickEntry {
        comes_late: true,
        ..PickEntry::new(readable(&kind.name), &kind.doc)
    };
    kinds.into_iter().map(kind).chain(ready.into_iter().map(PickEntry::from)).collect()
}

/// Returns the key of a kind as a name for users.
fn readable(kind: &str) -> String {
    kind.replace('_', " ")
}

impl UpdateContext<'_> {
    pub(super) fn pick_object(&mut self) {
        let ready = [edit::ready_objects(self.scene()), edit::ready_lights()].concat();
        let entries = added(edit::object_kinds(), ready);
        self.open_pick(
            "add an object or a light",
            entries,
            0,
            |c, name| match edit::object_kinds().iter().find(|kind| readable(&kind.name) == name) {
                Some(kind) => {
                    c.open_form(name, c.edit_seen(|seen| edit::add_object(seen, &kind.name, None)));
                }
                None => c.add_ready_made(c.edit_seen(|seen| edit::add_ready_made(seen, name))),
            },
        );
    }

    pub(super) fn pick_part(&mut self) {
        let edit = edit::add_part(self.scene(), &self.model.selection, "sphere");
        if let Err(refusal) = edit {
            return self.refuse(&refusal.to_string());
        }
        self.open_pick("add a part", added(edit::part_kinds(), Vec::new()), 0, |c, name| {
            let kind = name.replace(' ', "_");
            c.open_form(name, edit::add_part(c.scene(), &c.model.selection, &kind));
        });
    }

    pub(super) fn pick_light(&mut self) {
        let entries = added(edit::light_kinds(), edit::ready_lights());
        self.open_pick("add a light", entries, 0, |c, name| {
            match edit::light_kinds().iter().any(|kind| kind.name == name) {
                true => {
                    let edit = c.edit_seen(|seen| edit::add_light(seen, name));
                    c.open_form(&format!("{name} light"), edit);
                }
                false => c.add_ready_made(c.edit_seen(|seen| edit::add_ready_made(seen, name))),
            }
        });
    }

    /// Opens the form for a new object or light of the kind `what`, which `edit` adds.
    pub(super) fn open_form(&mut self, what: &str, edit: Result<Edit, EditError>) {
        match edit {
            Ok(Edit { scene, target, label, .. }) => {
                self.end_mode();
                self.model.overlay = Some(Overlay::Form(Form {
                    title: format!("new {what}"),
                    scene: Arc::new(scene),
                    target,
                    label,
                    fields: FieldList::default(),
                }));
                self.show();
                // A mesh begins with the name of its file.
                if self.show_row(|line| line.property.key == "shape.mesh.file") {
                    self.open_field();
                }
            }
            Err(error) => self.refuse(&error.to_string()),
        }
    }

    /// Adds the new object or light, as one undo step.
    pub(super) fn confirm_form(&mut self) {
        let Some(Overlay::Form(form)) = self.model.overlay.take() else { return };
        let base = Arc::clone(self.model.history.scene());
        let mut scene = form.scene;
        // Materials created in the form are removed if no object uses them.
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
        let edit = Edit { scene, target: form.target.clone(), label: form.label, note: None };
        self.record(edit, Coalesce::Single);
        self.select(form.target);
        let label = self.model.selection.label(self.scene());
        self.say(format!("{label} added · m moves it · r rotates it · u undoes"));
    }
}
