//! Commands that move the camera, by keys and mouse.

use crate::dashboard::UpdateContext;
use crate::dashboard::update::{Coalesce, Direction};
use zerkalo_scene::Scene;
use zerkalo_scene::camera::Camera;
use zerkalo_scene::edit::{
    Edit, EditError, Target, bounds, pivot_distance, recall_view, scene_bounds, step_length,
};

/// Angle of one step of orbiting or rolling.
const ORBIT_DEGREES: f64 = 5.0;
/// Angle of one step of rotating the camera about the eye.
const LOOK_DEGREES: f64 = 3.0;
/// Length of one step of panning, as a fraction of the distance between the eye and the pivot, the
/// point that the camera orbits.
const PAN_SHARE: f64 = 0.05;
/// Factor by which one step of dollying in multiplies the distance between eye and pivot.
const DOLLY: f64 = 0.9;
/// Factor by which one step of zooming in multiplies the width of the view.
const ZOOM: f64 = 0.95;

impl UpdateContext<'_> {
    /// Replaces the camera by the result of `f`, whose arguments are the camera and its distance
    /// from the pivot. All camera moves have the same label, so that different moves can join into
    /// one undo step.
    pub(super) fn set_camera(&mut self, coalesce: Coalesce, f: impl Fn(&Camera, f64) -> Camera) {
        let scene = self.scene();
        let camera = f(&scene.camera, pivot_distance(scene));
        if camera == scene.camera {
            return;
        }
        let next = Scene { camera, ..Scene::clone(scene) };
        // The scene needs no validation: camera moves keep a valid camera valid.
        let edit =
            Edit { scene: next, target: Target::Camera, label: "camera".to_string(), note: None };
        self.commit(Ok::<_, EditError>(edit), coalesce);
    }

    pub(super) fn orbit(&mut self, direction: Direction) {
        let [right, up, _] = direction.map(|x| x * ORBIT_DEGREES);
        self.set_camera(Coalesce::Repeat, |camera, distance| camera.orbit(right, up, distance));
    }

    pub(super) fn pan(&mut self, direction: Direction) {
        let [right, up, _] = direction.map(|x| x * PAN_SHARE);
        self.set_camera(Coalesce::Repeat, |camera, distance| camera.pan(right, up, distance));
    }

    /// Moves the camera by `steps`, nearer to its pivot if they are positive.
    pub(super) fn dolly(&mut self, steps: f64) {
        let factor = DOLLY.powf(steps.clamp(-50.0, 50.0));
        self.set_camera(Coalesce::Repeat, |camera, distance| camera.dolly(factor, distance));
    }

    pub(super) fn look(&mut self, direction: Direction) {
        let [right, up, _] = direction.map(|x| x * LOOK_DEGREES);
        self.set_camera(Coalesce::Repeat, |camera, _| camera.look(right, up));
    }

    pub(super) fn fly(&mut self, direction: Direction) {
        let step = 2.0 * step_length(self.scene());
        let movement = direction.map(|x| x * step);
        self.set_camera(Coalesce::Repeat, |camera, _| camera.fly(movement));
    }

    pub(super) fn roll(&mut self, direction: Direction) {
        let degrees = direction[0] * ORBIT_DEGREES;
        self.set_camera(Coalesce::Repeat, |camera, _| camera.roll(degrees));
    }

    /// Widens the view by `steps` steps of about 5 %; negative steps narrow it.
    pub(super) fn view_angle(&mut self, steps: i32) {
        self.set_camera(Coalesce::Repeat, |camera, _| camera.zoom(ZOOM.powi(-steps)));
        let angle = self.scene().camera.view_angle;
        self.say(format!("{} view angle {}°", angle.key(), angle.degrees()));
    }

    /// Moves the camera so that the selection, or else the whole scene, fills the picture.
    pub(super) fn frame(&mut self) {
        let scene = self.scene();
        let ball = bounds(scene, &self.model.selection).unwrap_or_else(|| scene_bounds(scene));
        let size = scene.film.size.map(f64::from);
        // Bounds without extent get a radius that also shows the surroundings.
        let radius = if ball.radius > 0.0 { ball.radius } else { 5.0 * step_length(scene) };
        self.set_camera(Coalesce::Single, |camera, _| {
            camera.framed(ball.center.to_array(), radius, size)
        });
    }

    pub(super) fn reset_camera(&mut self) {
        let camera = self.model.file.saved.camera.clone();
        self.set_camera(Coalesce::Single, |_, _| camera.clone());
    }

    /// Goes to the stored camera whose number, counted from 1, was typed.
    pub(super) fn recall_view(&mut self) {
        let Some(number) = self.typed.and_then(|c| c.to_digit(10)) else {
            self.say("Keys 1 to 9 go to viewpoints · n stores one");
            return;
        };
        match self.scene().cameras.keys().nth((number as usize).saturating_sub(1)).cloned() {
            Some(name) => {
                let edit = recall_view(self.scene(), &name);
                if self.commit(edit, Coalesce::Single) {
                    self.say(format!("viewpoint {number}: {name}"));
                }
            }
            None => self.say(format!("There is no viewpoint {number} yet · n stores one")),
        }
    }

    /// Orbits the camera for a drag in half cells, by 180 degrees for the width of the picture.
    pub(super) fn orbit_by_hand(&mut self, right: f64, down: f64) {
        let degrees = self.per_half_cell(180.0);
        self.set_camera(Coalesce::Gesture, |camera, distance| {
            camera.orbit(-right * degrees, down * degrees, distance)
        });
    }

    /// Rotates the camera about the eye for a drag in half cells, by 90 degrees for the width of
    /// the picture.
    pub(super) fn look_by_hand(&mut self, right: f64, down: f64) {
        let degrees = self.per_half_cell(90.0);
        self.set_camera(Coalesce::Gesture, |camera, _| {
            camera.look(-right * degrees, down * degrees)
        });
    }

    /// Pans the camera for a drag in half cells. Points at the depth of the pivot stay under the
    /// mouse.
    pub(super) fn pan_by_hand(&mut self, right: f64, down: f64) {
        let share = self.per_half_cell(2.0 * self.half_width());
        self.set_camera(Coalesce::Gesture, |camera, distance| {
            camera.pan(-right * share, down * share, distance)
        });
    }

    /// Returns half the width of the view at distance 1 in front of the eye.
    pub(super) fn half_width(&self) -> f64 {
        let scene = self.scene();
        scene.camera.half_size(scene.film.size.map(f64::from))[0]
    }

    /// Returns the change by a drag of one half cell. `across` is the change by a drag across the
    /// width of the picture. Returns 0 if there is no room for a picture.
    pub(super) fn per_half_cell(&self, across: f64) -> f64 {
        self.model.layout().map_or(0.0, |layout| {
            let share = layout.window.size[0] as f64 / f64::from(self.scene().film.size[0].max(1));
            across * share / layout.raster[0] as f64
        })
    }
}
