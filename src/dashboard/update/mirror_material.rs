//! Commands on the mirror: a reflecting material of the selection, or else of the scene.

use crate::dashboard::UpdateContext;
use crate::dashboard::update::Coalesce;
use zerkalo_scene::edit::{self, Edit, EditError, Target};
use zerkalo_scene::value::{number, truncated};

impl UpdateContext<'_> {
    pub(super) fn roughness(&mut self, steps: f64) {
        let edit = edit::step_mirror(self.scene(), Some(&self.model.selection), "roughness", steps);
        self.commit_mirror(edit, Coalesce::Repeat);
    }

    pub(super) fn reflection(&mut self, steps: f64) {
        let edit =
            edit::step_mirror(self.scene(), Some(&self.model.selection), "reflection", steps);
        self.commit_mirror(edit, Coalesce::Repeat);
    }

    pub(super) fn next_lobe(&mut self) {
        let edit = edit::step_mirror(self.scene(), Some(&self.model.selection), "lobe", 1.0);
        self.commit_mirror(edit, Coalesce::Single);
    }

    /// Records an edit of the mirror and reports its new values.
    fn commit_mirror(&mut self, edit: Result<Edit, EditError>, coalesce: Coalesce) {
        let subject = edit.as_ref().ok().map(|edit| edit.subject.clone());
        self.commit(edit, coalesce);
        let Some(Target::Material(name)) = subject else { return };
        let Some(material) = self.scene().materials.get(&name) else { return };
        let lobe = edit::rows(self.scene(), &Target::Material(name.clone()))
            .ok()
            .and_then(|rows| rows.into_iter().find(|row| row.key == "lobe"))
            .map_or_else(String::new, |row| format!(" · {}", row.value));
        let text = format!(
            "{}: roughness {} · reflection {}{lobe}",
            truncated(&name),
            number(material.roughness),
            number(material.reflection),
        );
        self.say(text);
    }
}
