//! Camera movement by keys and mouse.

use crate::camera::Camera;
use crate::dashboard::update::{Coalesce, Direction, StepSize, UpdateContext};
use crate::scene::Scene;
use crate::scene::edit::{
    Edit, EditError, Target, bounds, focus_distance, recall_view, scene_bounds, step_length,
};

/// Degrees per step of an orbit or a roll.
const ORBIT_DEGREES: f64 = 5.0;
/// Degrees per step of a look.
const LOOK_DEGREES: f64 = 3.0;
/// Step of a pan, as a fraction of the distance to the pivot.
const PAN_SHARE: f64 = 0.05;
/// Factors of the distance to the pivot per step of a dolly.
const DOLLY: f64 = 0.9;
const DOLLY_FINE: f64 = 0.99;
/// Factor of the view's width per step of the view angle.
const ZOOM: f64 = 0.95;

/// Returns the direction as components to the right and up.
fn right_up(way: Direction) -> [f64; 2] {
    match way {
        Direction::Left => [-1.0, 0.0],
        Direction::Right => [1.0, 0.0],
        Direction::Up => [0.0, 1.0],
        Direction::Down => [0.0, -1.0],
        Direction::In | Direction::Out => [0.0, 0.0],
    }
}

impl UpdateContext<'_> {
    /// Replaces the camera. Consecutive moves of any kind are one undo step.
    pub(super) fn set_camera(&mut self, coalesce: Coalesce, f: impl Fn(&Camera, f64) -> Camera) {
        let scene = self.scene();
        let camera = f(&scene.camera, focus_distance(scene));
        if camera == scene.camera {
            return;
        }
        let next = Scene { camera, ..Scene::clone(scene) };
        // A valid camera stays valid.
        let edit =
            Edit { scene: next, subject: Target::Camera, label: "camera".to_string(), note: None };
        self.commit(Ok::<_, EditError>(edit), coalesce);
    }

    pub(super) fn orbit(&mut self, way: Direction) {
        let [right, up] = right_up(way).map(|x| x * ORBIT_DEGREES);
        self.set_camera(Coalesce::Repeat, |camera, distance| camera.orbit(right, up, distance));
    }

    pub(super) fn pan(&mut self, way: Direction) {
        let [right, up] = right_up(way).map(|x| x * PAN_SHARE);
        self.set_camera(Coalesce::Repeat, |camera, distance| camera.pan(right, up, distance));
    }

    pub(super) fn dolly(&mut self, way: Direction, pace: StepSize) {
        let nearer = match pace {
            StepSize::Coarse => DOLLY,
            StepSize::Fine => DOLLY_FINE,
        };
        let factor = if way == Direction::In { nearer } else { 1.0 / nearer };
        self.set_camera(Coalesce::Repeat, |camera, distance| camera.dolly(factor, distance));
    }

    /// Dollies by ticks of the wheel; positive ticks move in.
    pub(super) fn dolly_by_wheel(&mut self, ticks: i32) {
        let factor = DOLLY.powi(ticks.clamp(-50, 50));
        self.set_camera(Coalesce::Repeat, |camera, distance| camera.dolly(factor, distance));
    }

    pub(super) fn look(&mut self, way: Direction) {
        let [right, up] = right_up(way).map(|x| x * LOOK_DEGREES);
        self.set_camera(Coalesce::Repeat, |camera, _| camera.look(right, up));
    }

    pub(super) fn fly(&mut self, way: Direction) {
        let step = 2.0 * step_length(self.scene());
        let [right, up] = right_up(way).map(|x| x * step);
        let ahead = match way {
            Direction::In => step,
            Direction::Out => -step,
            _ => 0.0,
        };
        self.set_camera(Coalesce::Repeat, |camera, _| camera.fly([right, up, ahead]));
    }

    pub(super) fn roll(&mut self, way: Direction) {
        let degrees = right_up(way)[0] * ORBIT_DEGREES;
        self.set_camera(Coalesce::Repeat, |camera, _| camera.roll(degrees));
    }

    /// Widens the view angle by `steps`; negative steps narrow it.
    pub(super) fn view_angle(&mut self, steps: i32) {
        self.set_camera(Coalesce::Repeat, |camera, _| camera.zoom(ZOOM.powi(-steps)));
        let (key, degrees) = self.scene().camera.view_angle.key_degrees();
        self.say(format!("{key} view angle {degrees}°"));
    }

    /// Frames the selection, or the scene if the selection has no extent.
    pub(super) fn frame(&mut self) {
        let scene = self.scene();
        let ball = bounds(scene, &self.model.selection).unwrap_or_else(|| scene_bounds(scene));
        let [width, height] = scene.film.size.map(f64::from);
        // A point light is framed with its surroundings.
        let radius = if ball.radius > 0.0 { ball.radius } else { 5.0 * step_length(scene) };
        self.set_camera(Coalesce::Single, |camera, _| {
            camera.framed(ball.center, radius, width / height)
        });
    }

    pub(super) fn reset_camera(&mut self) {
        let camera = self.model.file.saved.camera.clone();
        self.set_camera(Coalesce::Single, |_, _| camera.clone());
    }

    pub(super) fn recall_view(&mut self, number: u8) {
        let index = usize::from(number).saturating_sub(1);
        match self.scene().cameras.keys().nth(index).cloned() {
            Some(name) => {
                let edit = recall_view(self.scene(), &name);
                if self.commit(edit, Coalesce::Single) {
                    self.say(format!("viewpoint {number}: {name}"));
                }
            }
            None => self.say(format!("There is no viewpoint {number} yet · n stores one")),
        }
    }

    /// Orbits by a drag of `right` and `down` half cells, such that the picture follows the mouse.
    /// The picture's full width is half a turn.
    pub(super) fn orbit_by_hand(&mut self, right: f64, down: f64) {
        let degrees = self.per_half_cell(180.0);
        self.set_camera(Coalesce::Gesture, |camera, distance| {
            camera.orbit(-right * degrees, down * degrees, distance)
        });
    }

    /// Looks around by a drag of `right` and `down` half cells. The picture's full width is a
    /// quarter turn.
    pub(super) fn look_by_hand(&mut self, right: f64, down: f64) {
        let degrees = self.per_half_cell(90.0);
        self.set_camera(Coalesce::Gesture, |camera, _| {
            camera.look(-right * degrees, down * degrees)
        });
    }

    /// Pans by a drag, such that the point under the mouse follows it at the distance of the pivot.
    pub(super) fn pan_by_hand(&mut self, right: f64, down: f64) {
        let share = self.per_half_cell(2.0 * self.half_width());
        self.set_camera(Coalesce::Gesture, |camera, distance| {
            camera.pan(-right * share, down * share, distance)
        });
    }

    /// Half the width of the picture at unit distance.
    pub(super) fn half_width(&self) -> f64 {
        let scene = self.scene();
        let [width, height] = scene.film.size.map(f64::from);
        scene.camera.half_size(width / height)[0]
    }

    /// Amount per half cell, if `across` is the amount for the picture's full width.
    pub(super) fn per_half_cell(&self, across: f64) -> f64 {
        self.model.layout().map_or(0.0, |layout| across / layout.raster[0] as f64)
    }
}
