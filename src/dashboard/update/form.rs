//! Creation of objects and lights: the user picks a kind, then fills in a form.

use crate::dashboard::update::Coalesce;
use crate::dashboard::{FieldList, Form, Overlay, UpdateContext};
use std::sync::Arc;
use zerkalo_scene::edit::{self, Edit, EditError};

impl UpdateContext<'_> {
    pub(super) fn pick_object(&mut self) {
        let entries = [edit::object_kinds(), edit::ready_objects()].concat();
        self.open_pick("add an object", entries, 0, |c, name| {
            match edit::object_kinds().iter().any(|kind| kind.name == name) {
                true => {
                    c.open_form(name, c.edit_seen(|seen| edit::add_object(seen, name, None)));
                }
                false => c.add_ready_made(c.edit_seen(|seen| edit::add_ready_object(seen, name))),
            }
        });
    }

    pub(super) fn pick_part(&mut self) {
        let edit = edit::add_part(self.scene(), &self.model.selection, "sphere");
        if let Err(refusal) = edit {
            return self.refuse(&refusal.to_string());
        }
        self.open_pick("add a part", edit::part_kinds(), 0, |c, name| {
            c.open_form(name, edit::add_part(c.scene(), &c.model.selection, name));
        });
    }

    pub(super) fn pick_light(&mut self) {
        let entries = [edit::light_kinds(), edit::ready_lights()].concat();
        self.open_pick("add a light", entries, 0, |c, name| {
            match edit::light_kinds().iter().any(|kind| kind.name == name) {
                true => {
                    let edit = c.edit_seen(|seen| edit::add_light(seen, name));
                    c.open_form(&format!("{name} light"), edit);
                }
                false => c.add_ready_made(c.edit_seen(|seen| edit::add_ready_light(seen, name))),
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
