//! The keys that act on a light.

use crate::dashboard::update::{Hold, Turn};
use crate::scene::edit::{Edit, Refusal, Subject, step, toggle};
use crate::value::number;

impl Turn<'_> {
    pub(super) fn next_light(&mut self) {
        let lights = self.scene().lights.len();
        if lights == 0 {
            self.say("There is no light · A adds one");
            return;
        }
        let next = match self.model.selection {
            Subject::Light(i) => (i + 1) % lights,
            _ => 0,
        };
        self.select(Subject::Light(next));
        let label = self.model.selection.label(self.scene());
        self.say(format!("{label} · ; ' dim, brighten · L on, off · m move"));
    }

    /// The selected light, ambient light or background, else the first light.
    fn the_light(&self) -> Result<Subject, Refusal> {
        match &self.model.selection {
            s @ (Subject::Light(_) | Subject::Ambient | Subject::Background) => Ok(s.clone()),
            _ if !self.scene().lights.is_empty() => Ok(Subject::Light(0)),
            _ => Err(Refusal {
                found: "there is no light".to_string(),
                help: "A adds one.".to_string(),
            }),
        }
    }

    pub(super) fn intensity(&mut self, steps: f64) {
        let edit = self.the_light().and_then(|light| {
            let key = if matches!(light, Subject::Light(_)) { "intensity" } else { "color" };
            step(self.scene(), &light, key, None, steps)
        });
        self.commit_light(edit, Hold::Repeat);
    }

    pub(super) fn switch_light(&mut self) {
        let edit = self.the_light().and_then(|light| match light {
            Subject::Light(_) => toggle(self.scene(), &light, "on", true),
            other => Err(Refusal {
                found: format!("{} has no switch", other.label(self.scene())),
                help: "Black is off.".to_string(),
            }),
        });
        self.commit_light(edit, Hold::Single);
    }

    fn commit_light(&mut self, edit: Result<Edit, Refusal>, hold: Hold) {
        let subject = edit.as_ref().ok().map(|edit| edit.subject.clone());
        self.commit(edit, hold);
        let scene = self.scene();
        let told = match subject {
            Some(Subject::Light(i)) => scene.lights.get(i).map(|light| {
                let off = if light.on { "" } else { ", off" };
                format!("intensity {}{off}", number(light.intensity))
            }),
            Some(Subject::Ambient) => Some(of_color(scene.ambient.color.0)),
            Some(Subject::Background) => Some(of_color(scene.background.color.0)),
            _ => None,
        };
        if let (Some(subject), Some(told)) = (subject, told) {
            self.say(format!("{}: {told}", subject.label(self.scene())));
        }
    }
}

fn of_color(color: [f64; 3]) -> String {
    format!("color {}", color.map(number).join(" "))
}
