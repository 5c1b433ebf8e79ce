//! Commands on lights.

use crate::dashboard::UpdateContext;
use crate::dashboard::update::Coalesce;
use zerkalo_scene::edit::{Edit, EditError, Target, step, toggle};
use zerkalo_scene::value::number;

impl UpdateContext<'_> {
    pub(super) fn next_light(&mut self) {
        let lights = self.scene().lights.len();
        if lights == 0 {
            self.say("There is no light · A adds one");
            return;
        }
        let next = match self.model.selection {
            Target::Light(i) => (i + 1) % lights,
            _ => 0,
        };
        self.select(Target::Light(next));
        let label = self.model.selection.label(self.scene());
        self.say(format!("{label} · ; ' dim, brighten · L on, off · m move"));
    }

    /// Returns the light that commands change: the selection if it is a light, the ambient light or
    /// the background, otherwise the first light.
    fn target_light(&self) -> Result<Target, EditError> {
        match &self.model.selection {
            s @ (Target::Light(_) | Target::Ambient | Target::Background) => Ok(s.clone()),
            _ if !self.scene().lights.is_empty() => Ok(Target::Light(0)),
            _ => Err(EditError {
                found: "there is no light".to_string(),
                help: "A adds one.".to_string(),
            }),
        }
    }

    pub(super) fn intensity(&mut self, steps: f64) {
        let edit = self.target_light().and_then(|light| {
            let key = if matches!(light, Target::Light(_)) { "intensity" } else { "color" };
            step(self.scene(), &light, key, None, steps)
        });
        self.commit_light(edit, Coalesce::Repeat);
    }

    pub(super) fn switch_light(&mut self) {
        let edit = self.target_light().and_then(|light| match light {
            Target::Light(_) => toggle(self.scene(), &light, "on", true),
            other => Err(EditError {
                found: format!("{} has no switch", other.label(self.scene())),
                help: "Black is off.".to_string(),
            }),
        });
        self.commit_light(edit, Coalesce::Single);
    }

    /// Records an edit of a light and reports its new state.
    fn commit_light(&mut self, edit: Result<Edit, EditError>, coalesce: Coalesce) {
        let subject = edit.as_ref().ok().map(|edit| edit.subject.clone());
        self.commit(edit, coalesce);
        let scene = self.scene();
        let state = match subject {
            Some(Target::Light(i)) => scene.lights.get(i).map(|light| {
                let off = if light.on { "" } else { ", off" };
                format!("intensity {}{off}", number(light.intensity))
            }),
            Some(Target::Ambient) => Some(color_text(scene.ambient.color.0)),
            Some(Target::Background) => Some(color_text(scene.background.color.0)),
            _ => None,
        };
        if let (Some(subject), Some(state)) = (subject, state) {
            self.say(format!("{}: {state}", subject.label(self.scene())));
        }
    }
}

fn color_text(color: [f64; 3]) -> String {
    format!("color {}", color.map(number).join(" "))
}
