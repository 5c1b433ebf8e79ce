//! Commands on the selected part of the scene.

use crate::dashboard::UpdateContext;
use crate::dashboard::update::{Coalesce, Direction};
use glam::{DVec2, DVec3};
use zerkalo_scene::edit::{self, bounds, step_length};

/// Largest factor by which a drag in the ground plane is stretched in depth. The stretch
/// compensates foreshortening: it is 1 / sin of the angle between view direction and ground, which
/// is 4 at 14.5 degrees.
const MOST_STRETCH: f64 = 4.0;

/// Returns the coordinate axis in the ground plane, positive or negative, nearest to `v`.
fn nearest_axis(v: DVec3) -> DVec3 {
    if v.x.abs() >= v.z.abs() { DVec3::X * v.x.signum() } else { DVec3::Z * v.z.signum() }
}

impl UpdateContext<'_> {
    /// Returns the coordinate axes in the ground plane that point most nearly to the right and away
    /// from the eye. Moves along coordinate axes keep round coordinates round.
    fn ground_axes(&self) -> [DVec3; 2] {
        let [right, _, _] = self.scene().camera.frame();
        let right = nearest_axis(right);
        // The cross product points away from an upright observer.
        [right, DVec3::Y.cross(right)]
    }

    pub(super) fn move_selection(&mut self, direction: Direction, steps: f64) {
        let [x, y, z] = direction.map(|d| d * steps * step_length(self.scene()));
        let [right, away] = self.ground_axes();
        self.move_by(x * right + y * DVec3::Y + z * away);
    }

    pub(super) fn move_by(&mut self, by: DVec3) {
        let edit = edit::move_by(self.scene(), &self.model.selection, by.to_array());
        self.commit(edit, self.gesture());
    }

    /// Returns the rule for edits by arrow keys and drags: in a drag or in a mode that moves or
    /// rotates, all edits with the same label form one undo step.
    fn gesture(&self) -> Coalesce {
        let in_gesture = self.moves_or_rotates() || self.model.drag.is_some();
        if in_gesture { Coalesce::Gesture } else { Coalesce::Repeat }
    }

    /// Moves the selection by a drag in half cells, vertically if `upright` is `true`, otherwise in
    /// the ground plane. The selection stays under the mouse as far as [`MOST_STRETCH`] allows.
    pub(super) fn move_by_hand(&mut self, right: f64, down: f64, upright: bool) {
        let scene = self.scene();
        let [x, _, forward] = scene.camera.frame();
        let eye = DVec3::from_array(scene.camera.eye);
        let distance = match bounds(scene, &self.model.selection) {
            Some(ball) => forward.dot(ball.center - eye),
            None => edit::pivot_distance(scene),
        };
        let distance = if distance > 0.0 { distance } else { edit::pivot_distance(scene) };
        let unit = distance * self.per_half_cell(2.0 * self.half_width());
        let flat = |v: DVec3| DVec2::new(v.x, v.z).try_normalize();
        let by = if upright {
            DVec3::Y * (-down * unit)
        } else {
            let Some(across) = flat(x) else { return };
            let away = DVec2::new(across.y, -across.x);
            let stretch = (1.0 / forward.y.abs().max(1e-9)).min(MOST_STRETCH);
            let by = across * (right * unit) + away * (-down * unit * stretch);
            DVec3::new(by.x, 0.0, by.y)
        };
        self.move_by(by);
    }

    /// Rotates the selection counter-clockwise as seen from above: the side that faces the viewer
    /// moves to the right.
    pub(super) fn rotate_selection(&mut self, degrees: f64) {
        let edit = edit::rotate(self.scene(), &self.model.selection, degrees);
        self.commit(edit, self.gesture());
    }

    pub(super) fn snap_to_ground(&mut self) {
        let edit = edit::snap_to_ground(self.scene(), &self.model.selection);
        self.commit(edit, Coalesce::Single);
    }

    pub(super) fn duplicate(&mut self) {
        let edit = edit::duplicate(self.scene(), &self.model.selection);
        if self.commit_and_select(edit) {
            let label = self.model.selection.label(self.scene());
            self.say(format!("{label} added · m moves it"));
        }
    }

    pub(super) fn delete(&mut self) {
        let label = self.model.selection.label(self.scene());
        let edit = edit::delete(self.scene(), &self.model.selection);
        let noted = edit.as_ref().is_ok_and(|edit| edit.note.is_some());
        if self.commit_and_select(edit) && !noted {
            self.say(format!("{label} deleted · u undoes"));
        }
    }

    pub(super) fn own_material(&mut self) {
        let edit = edit::own_material(self.scene(), &self.model.selection);
        self.commit(edit, Coalesce::Single);
    }
}
