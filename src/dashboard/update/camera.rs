//! Commands that move the view, by keys and mouse. They are no edits: the camera of the scene stays
//! until a command makes the view its camera.

use crate::dashboard::UpdateContext;
use crate::dashboard::update::{Coalesce, Direction};
use glam::DVec3;
use std::sync::Arc;
use zerkalo_kernel::primitive::HalfSpace;
use zerkalo_scene::camera::{Camera, Projection};
use zerkalo_scene::edit::{Edit, Target, bounds, pivot_distance, scene_bounds, step_length};
use zerkalo_scene::{Object, Scene};

/// Angle of one step of orbiting or rolling.
const ORBIT_DEGREES: f64 = 5.0;
/// Angle of one step of rotating the camera about the eye.
const LOOK_DEGREES: f64 = 3.0;
/// Length of one step of panning, as a fraction of the distance between the eye and the pivot, the
/// point that the camera orbits.
const PAN_SHARE: f64 = 0.05;
/// Factor by which one step of dollying in multiplies the distance between eye and pivot.
const DOLLY: f64 = 0.9;
/// Least height of the eye above the floor when the view orbits, as a fraction of the distance to
/// the pivot.
const FLOOR_GAP: f64 = 0.02;
/// Factor by which one step of zooming in multiplies the width of the view.
const ZOOM: f64 = 0.95;

impl UpdateContext<'_> {
    /// Moves the view. The arguments of `f` are its camera and the distance of the pivot.
    fn move_view(&mut self, f: impl Fn(&Camera, f64) -> Camera) {
        let seen = self.seen();
        let camera = f(&seen.camera, pivot_distance(seen));
        if camera != seen.camera {
            self.model.set_view(camera);
            self.show();
        }
    }

    /// Orbits the view by degrees. Its eye does not go below the floor under the pivot.
    fn orbit_by(&mut self, right: f64, up: f64) {
        let scene = Arc::clone(self.seen());
        self.move_view(|camera, distance| {
            camera.orbit(right, up.max(lowest_orbit(&scene, distance).min(0.0)), distance)
        });
    }

    pub(super) fn orbit(&mut self, direction: Direction) {
        let [right, up, _] = direction.map(|x| x * ORBIT_DEGREES);
        self.orbit_by(right, up);
    }

    pub(super) fn pan(&mut self, direction: Direction) {
        let [right, up, _] = direction.map(|x| x * PAN_SHARE);
        self.move_view(|camera, distance| camera.pan(right, up, distance));
    }

    /// Moves the camera by `steps`, nearer to its pivot if they are positive.
    pub(super) fn dolly(&mut self, steps: f64) {
        let factor = DOLLY.powf(steps.clamp(-50.0, 50.0));
        self.move_view(|camera, distance| camera.dolly(factor, distance));
    }

    pub(super) fn look(&mut self, direction: Direction) {
        let [right, up, _] = direction.map(|x| x * LOOK_DEGREES);
        self.move_view(|camera, _| camera.look(right, up));
    }

    pub(super) fn fly(&mut self, direction: Direction) {
        let step = 2.0 * step_length(self.seen());
        let movement = direction.map(|x| x * step);
        self.move_view(|camera, _| camera.fly(movement));
    }

    pub(super) fn roll(&mut self, direction: Direction) {
        let degrees = direction[0] * ORBIT_DEGREES;
        self.move_view(|camera, _| camera.roll(degrees));
    }

    /// Widens the view by `steps` steps of about 5 %; negative steps narrow it.
    pub(super) fn view_angle(&mut self, steps: i32) {
        if self.seen().camera.projection == Projection::Equirectangular {
            return self.say("a panorama has no view angle");
        }
        self.move_view(|camera, _| camera.zoom(ZOOM.powi(-steps)));
        let angle = self.seen().camera.view_angle;
        self.say(format!("{} view angle {}°", angle.key(), angle.degrees()));
    }

    /// Moves the camera so that the selection, or else the whole scene, fills the picture.
    pub(super) fn frame(&mut self) {
        let scene = self.seen();
        let ball = bounds(scene, &self.model.selection).unwrap_or_else(|| scene_bounds(scene));
        let size = scene.film.size.map(f64::from);
        // Bounds without extent get a radius that also shows the surroundings.
        let radius = if ball.radius > 0.0 { ball.radius } else { 5.0 * step_length(scene) };
        self.move_view(|camera, _| camera.framed(ball.center.to_array(), radius, size));
    }

    /// Goes back to the camera of the scene.
    pub(super) fn leave_view(&mut self) {
        if self.model.free_view.take().is_some() {
            self.show();
        }
        self.say("the camera of the scene");
    }

    /// Makes the view the camera of the scene.
    pub(super) fn keep_view(&mut self) {
        let scene = Scene::clone(self.seen());
        let label = "view to camera".to_string();
        let edit = Edit { scene, target: Target::Camera, label, note: None };
        match self.record(edit, Coalesce::Single) {
            true => self.say("the camera has this view now · u undoes"),
            false => self.say("the view is the camera already"),
        }
    }

    /// Goes to the stored camera whose number, counted from 1, was typed.
    pub(super) fn recall_view(&mut self) {
        let Some(number) = self.typed.and_then(|c| c.to_digit(10)) else {
            self.say("Keys 1 to 9 go to viewpoints · n stores one");
            return;
        };
        let mut cameras = self.scene().cameras.iter();
        match cameras.nth((number as usize).saturating_sub(1)) {
            Some((name, camera)) => {
                let (text, camera) = (format!("viewpoint {number}: {name}"), camera.clone());
                self.move_view(|_, _| camera.clone());
                self.say(text);
            }
            None => self.say(format!("There is no viewpoint {number} yet · n stores one")),
        }
    }

    /// Orbits the camera for a drag in half cells, by 180 degrees for the width of the picture.
    pub(super) fn orbit_by_hand(&mut self, right: f64, down: f64) {
        let degrees = self.per_half_cell(180.0);
        self.orbit_by(-right * degrees, down * degrees);
    }

    /// Rotates the camera about the eye for a drag in half cells, by 90 degrees for the width of
    /// the picture.
    pub(super) fn look_by_hand(&mut self, right: f64, down: f64) {
        let degrees = self.per_half_cell(90.0);
        self.move_view(|camera, _| camera.look(-right * degrees, down * degrees));
    }

    /// Pans the camera for a drag in half cells. Points at the depth of the pivot stay under the
    /// mouse.
    pub(super) fn pan_by_hand(&mut self, right: f64, down: f64) {
        let share = self.per_half_cell(2.0 * self.half_width());
        self.move_view(|camera, distance| camera.pan(-right * share, down * share, distance));
    }

    /// Returns half the width of the view at distance 1 in front of the eye.
    pub(super) fn half_width(&self) -> f64 {
        let scene = self.seen();
        match scene.camera.projection {
            Projection::Perspective => scene.camera.half_size(scene.film.size.map(f64::from))[0],
            Projection::Equirectangular => std::f64::consts::PI,
        }
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

/// Returns the degrees, at least -180, by which the eye can orbit upwards and stay above the floor:
/// the highest level surface under the pivot, which is `distance` from the eye.
fn lowest_orbit(scene: &Scene, distance: f64) -> f64 {
    let [right, _, forward] = scene.camera.frame();
    // A camera with another `up` does not orbit about the vertical axis.
    if right.y.abs() > 1e-3 || scene.camera.up[1] <= 0.0 {
        return -180.0;
    }
    let pivot = DVec3::from_array(scene.camera.eye) + forward * distance;
    let is_level = |plane: HalfSpace| plane.normal.y.abs() > 0.99;
    let floors = scene.objects.iter().map(Object::form).filter(|f| f.plane().is_some_and(is_level));
    let depth = floors.filter_map(|floor| floor.cast(pivot, DVec3::NEG_Y)).reduce(f64::min);
    let lowest = depth.map_or(1.0, |depth| (depth / distance - FLOOR_GAP).min(1.0));
    forward.y.clamp(-1.0, 1.0).asin().to_degrees() - lowest.asin().to_degrees()
}
