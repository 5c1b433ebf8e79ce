//! Commands that adjust a light, the mirror or the lens by a key, and show the new values.

use crate::dashboard::UpdateContext;
use crate::dashboard::update::Coalesce;
use crate::dashboard::update::mouse::first_hit;
use zerkalo_scene::Scene;
use zerkalo_scene::camera::{Aperture, Camera};
use zerkalo_scene::edit::{self, Edit, EditError, SceneSettings, Target, bounds};
use zerkalo_scene::value::{number, round_significant};

impl UpdateContext<'_> {
    /// Records an edit and shows the new values of the edited part in a notice.
    fn adjust(&mut self, edit: Result<Edit, EditError>, coalesce: Coalesce) {
        let target = edit.as_ref().ok().map(|edit| edit.target.clone());
        self.commit(edit, coalesce);
        if let Some(values) = target.and_then(|target| values(self.scene(), &target)) {
            let reason = self.restart_reason().map(|reason| format!(" · {reason}"));
            self.say(values + &reason.unwrap_or_default());
        }
    }

    /// Returns why the lights of the scene need new samples; `None` if they do not.
    pub(super) fn restart_reason(&self) -> Option<String> {
        let lighting = self.model.snapshot.as_ref()?.lighting.as_ref()?;
        lighting.groups.restart_reason(&lighting.compiled, self.scene())
    }

    /// Selects the next light group, or light without a given group.
    pub(super) fn next_light(&mut self) {
        let is_grouped = |i: &usize| !self.scene().lights[*i].group.is_empty();
        let mut lights: Vec<_> =
            self.scene().groups.keys().map(|name| Target::Group(name.clone())).collect();
        let single = (0..self.scene().lights.len()).filter(|i| !is_grouped(i));
        lights.extend(single.map(Target::Light));
        let current = lights.iter().position(|light| *light == self.model.selection);
        let next = current.map_or(0, |current| current + 1) % lights.len().max(1);
        let Some(next) = lights.into_iter().nth(next) else {
            return self.say("There is no light · A adds one");
        };
        let move_key = if matches!(next, Target::Light(_)) { " · m move" } else { "" };
        self.select(next);
        let label = self.model.selection.label(self.scene());
        self.say(format!("{label} · ; ' dim, brighten · L on, off · Alt-l alone{move_key}"));
    }

    /// Shows the light group of the selection alone, or all light again.
    pub(super) fn solo(&mut self) {
        let scene = self.scene();
        let own = self.model.selection.light_group(scene);
        let name = own.or_else(|| self.target_light().ok()?.light_group(scene));
        let name = name.filter(|name| *name != scene.film.solo).unwrap_or_default();
        let lighting = self.model.snapshot.as_ref().and_then(|snapshot| snapshot.lighting.as_ref());
        let names = lighting.map(|lighting| lighting.groups.names(scene));
        if !name.is_empty() && names.is_some_and(|names| !names.contains(&name)) {
            return self.refuse(&format!("{name} is dark, or not apart from other lights"));
        }
        let notice = match name.as_str() {
            "" => "All light".to_string(),
            name => format!("Only {name} · Alt-l all light"),
        };
        let film = Target::Settings(SceneSettings::Film);
        let edit = edit::set(scene, &film, "solo", &name);
        if self.commit(edit, Coalesce::Single) {
            self.say(notice);
        }
    }

    /// Returns the light that commands change: the selection if it is a light, the ambient light or
    /// the background, otherwise the first light.
    fn target_light(&self) -> Result<Target, EditError> {
        match &self.model.selection {
            s @ (Target::Light(_)
            | Target::Group(_)
            | Target::Settings(SceneSettings::Ambient | SceneSettings::Background)) => {
                Ok(s.clone())
            }
            _ if !self.scene().lights.is_empty() => Ok(Target::Light(0)),
            _ => Err(EditError::new("there is no light", "A adds one.")),
        }
    }

    pub(super) fn intensity(&mut self, steps: f64) {
        let edit = self.target_light().and_then(|light| {
            let key = if matches!(light, Target::Settings(_)) { "color" } else { "intensity" };
            edit::step(self.scene(), &light, key, None, steps)
        });
        self.adjust(edit, Coalesce::Repeat);
    }

    pub(super) fn switch_light(&mut self) {
        let edit = self.target_light().and_then(|light| match light {
            Target::Light(_) | Target::Group(_) => edit::toggle(self.scene(), &light, "on", true),
            other => {
                let found = format!("{} has no switch", other.label(self.scene()));
                Err(EditError::new(found, "Black is off."))
            }
        });
        self.adjust(edit, Coalesce::Single);
    }

    /// Steps the property `key` of the mirror: a reflecting material of the selection, or else of
    /// the scene.
    pub(super) fn step_mirror(&mut self, key: &str, steps: f64) {
        let edit = edit::step_mirror(self.scene(), Some(&self.model.selection), key, steps);
        self.adjust(edit, Coalesce::Repeat);
    }

    /// Opens the aperture by `stops` stops; a negative number closes it.
    pub(super) fn aperture(&mut self, stops: f64) {
        let edit = self.edit_lens(|seen| edit::change_aperture(seen, stops));
        self.adjust(edit, Coalesce::Repeat);
    }

    /// Focuses the lens on the pixel probe, else on the middle of the selection, else on the centre
    /// of the picture.
    pub(super) fn focus(&mut self) {
        let [width, height] = self.scene().film.size.map(|n| n as usize);
        let selection = bounds(self.scene(), &self.model.selection);
        match (self.model.probe, selection) {
            (Some(pixel), _) => self.focus_on_pixel(pixel),
            (None, Some(ball)) => self.focus_on(ball.center.to_array()),
            (None, None) => self.focus_on_pixel([width / 2, height / 2]),
        }
    }

    /// Focuses the lens on the object that is visible at the centre of film pixel `pixel`.
    pub(super) fn focus_on_pixel(&mut self, pixel: [usize; 2]) {
        match first_hit(self.seen(), pixel) {
            Some(hit) => self.focus_on(hit.point.to_array()),
            None => self.refuse("There is no object to focus on here."),
        }
    }

    fn focus_on(&mut self, point: [f64; 3]) {
        let edit = self.edit_lens(|seen| edit::focus_on(seen, point));
        self.adjust(edit, Coalesce::Single);
    }

    /// Returns an edit of the lens, which the view shares with the camera of the scene. Distances
    /// are from the eye of the view.
    fn edit_lens(
        &self,
        edit: impl FnOnce(&Scene) -> Result<Edit, EditError>,
    ) -> Result<Edit, EditError> {
        let mut edit = edit(self.seen())?;
        edit.scene.camera = self.scene().camera.with_lens_of(&edit.scene.camera);
        Ok(edit)
    }
}

/// Describes the adjustable values of a light, a material or the lens for a notice. Returns `None`
/// for other parts of the scene.
fn values(scene: &Scene, target: &Target) -> Option<String> {
    let color = |color: [f64; 3]| format!("color {}", color.map(number).join(" "));
    let intensity = |intensity: f64, on: bool| {
        format!("intensity {}{}", number(intensity), if on { "" } else { ", off" })
    };
    let state = match target {
        Target::Camera => lens(&scene.camera),
        Target::Light(i) => {
            let light = scene.lights.get(*i)?;
            intensity(light.intensity, light.on)
        }
        Target::Group(name) => {
            let group = scene.groups.get(name)?;
            intensity(group.intensity, group.on)
        }
        Target::Settings(SceneSettings::Ambient) => color(scene.ambient.color.0),
        Target::Settings(SceneSettings::Background) => color(scene.background.color.0),
        Target::Material(name) => {
            let material = scene.materials.get(name)?;
            let [roughness, reflection] = [material.roughness, material.reflection].map(number);
            let rows = edit::rows(scene, target).ok()?;
            let lobe = rows.into_iter().find(|row| row.key == "lobe");
            let lobe = lobe.map_or_else(String::new, |row| format!(" · {}", row.value));
            format!("roughness {roughness} · reflection {reflection}{lobe}")
        }
        Target::Settings(SceneSettings::Film | SceneSettings::Integrator)
        | Target::View(_)
        | Target::Object(_)
        | Target::Part(..) => return None,
    };
    Some(format!("{}: {state}", target.label(scene)))
}

/// Describes aperture and focus.
fn lens(camera: &Camera) -> String {
    let distance = number(round_significant(camera.focus_depth(), 4));
    let aperture = match camera.aperture {
        Some(Aperture::FNumber(f)) => format!("f/{}", number(f)),
        Some(Aperture::Radius(radius)) if radius > 0.0 => format!("aperture {}", number(radius)),
        _ => {
            return format!(
                "focus at {distance} · pinhole, all in focus · Alt-o opens the aperture"
            );
        }
    };
    format!("focus at {distance} · {aperture} · Alt-c Alt-o close, open · right click focuses")
}
