//! Commands on the selected part of the scene.

use crate::dashboard::update::{Coalesce, Direction};
use crate::dashboard::{Mode, UpdateContext};
use glam::{DVec2, DVec3};
use zerkalo_scene::Scene;
use zerkalo_scene::edit::{self, Edit, EditError, Target, bounds, step_length};
use zerkalo_scene::value::rotated_y;

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
        let [right, _, _] = self.seen().camera.frame();
        let right = nearest_axis(right);
        // The cross product points away from an upright observer.
        [right, DVec3::Y.cross(right)]
    }

    pub(super) fn move_selection(&mut self, direction: Direction, steps: f64) {
        let [x, y, z] = direction.map(|d| d * steps * step_length(self.scene()));
        let [right, away] = self.ground_axes();
        self.move_by(x * right + y * DVec3::Y + z * away);
    }

    /// Returns the edits of all marked parts, or of the selection, as one; `what` names it.
    fn edit_marked(
        &self,
        what: &str,
        edit: impl Fn(&Scene, &Target) -> Result<Edit, EditError>,
    ) -> Result<Edit, EditError> {
        let targets = self.model.targets();
        let mut edited = edit(self.scene(), &targets[targets.len() - 1])?;
        // A deletion changes the indices of the parts that follow, which come first.
        for target in targets.iter().rev().skip(1) {
            edited = edit(&edited.scene, target)?;
        }
        if let [_, _, ..] = targets[..] {
            edited.label = format!("{what} {} parts", targets.len());
        }
        Ok(edited)
    }

    /// Returns the name of the selection, or the names of the marked parts.
    fn marked_label(&self) -> String {
        let targets = self.model.targets();
        let shown: Vec<_> = targets.iter().take(3).map(|t| t.label(self.scene())).collect();
        match targets.len() {
            0..=3 => shown.join(", "),
            n => format!("{} and {} more", shown.join(", "), n - 3),
        }
    }

    /// Marks the selection, or removes its mark.
    pub(super) fn toggle_mark(&mut self) {
        let target = self.model.selection.clone();
        if !matches!(target, Target::Object(_) | Target::Part(..) | Target::Light(_)) {
            return self.refuse("Only objects, parts and lights are marked");
        }
        match self.model.marked.iter().position(|marked| *marked == target) {
            Some(at) => drop(self.model.marked.remove(at)),
            None => self.model.marked.push(target),
        }
        let text = match self.model.marked.is_empty() {
            true => "nothing is marked".to_string(),
            false => format!(
                "marked: {} · m r D x act on all · | & _ join · Esc unmarks",
                self.marked_label()
            ),
        };
        self.say(text);
    }

    pub(super) fn move_by(&mut self, by: DVec3) {
        let edit = self.edit_marked("move", |s, target| edit::move_by(s, target, by.to_array()));
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
        let scene = self.seen();
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

    /// Returns the middle of the underside of the selection or the marked parts.
    fn foot(&self) -> DVec3 {
        let balls = self.model.targets().into_iter().filter_map(|t| bounds(self.scene(), &t));
        let balls: Vec<_> = balls.collect();
        let middle = balls.iter().map(|b| b.center).sum::<DVec3>() / balls.len().max(1) as f64;
        let lows = self.model.targets().into_iter().filter_map(|t| edit::lowest(self.scene(), &t));
        middle.with_y(lows.reduce(f64::min).unwrap_or(middle.y))
    }

    /// Scales the selection or the marked parts about their foot.
    pub(super) fn scale_selection(&mut self, factor: f64) -> Result<(), String> {
        let foot = self.foot();
        let edit = self.edit_marked("scale", |s, target| edit::scale(s, target, factor, foot))?;
        self.record(edit, Coalesce::Single);
        Ok(())
    }

    /// Adds `count` copies of the selection or the marked parts, each moved `by` from the one before.
    pub(super) fn array(&mut self, count: u32, by: DVec3) -> Result<(), String> {
        let copied = |s: &Scene, target: &Target| edit::repeat(s, target, count, by.to_array());
        let edit = self.edit_marked("array of", copied)?;
        self.record(edit, Coalesce::Single);
        Ok(())
    }

    /// Rotates the selection counter-clockwise as seen from above: the side that faces the viewer
    /// moves to the right.
    pub(super) fn rotate_selection(&mut self, degrees: f64) {
        let centers = self.model.targets().into_iter();
        let centers: Vec<_> =
            centers.filter_map(|t| bounds(self.scene(), &t).map(|ball| ball.center)).collect();
        let pivot = centers.iter().sum::<DVec3>() / centers.len().max(1) as f64;
        let is_group = self.model.marked.len() > 1;
        let edit = self.edit_marked("rotate", |scene, target| {
            let rotated = edit::rotate(scene, target, degrees)?;
            // Several parts rotate about their common centre.
            let Some(ball) = bounds(scene, target).filter(|_| is_group) else { return Ok(rotated) };
            let from = (ball.center - pivot).to_array();
            let to = pivot + DVec3::from_array(rotated_y(from, degrees));
            let now = bounds(&rotated.scene, target).map_or(to, |ball| ball.center);
            edit::move_by(&rotated.scene, target, (to - now).to_array())
        });
        self.commit(edit, self.gesture());
    }

    /// Applies an edit of the selection, as one undo step.
    pub(super) fn apply(&mut self, edit: fn(&Scene, &Target) -> Result<Edit, EditError>) {
        let edit = edit(self.scene(), &self.model.selection);
        self.commit(edit, Coalesce::Single);
    }

    /// Duplicates the selection or the marked parts, which are then ready to be moved.
    pub(super) fn duplicate(&mut self) {
        let copies = std::cell::RefCell::new(Vec::new());
        let edit = self.edit_marked("duplicate", |scene, target| {
            let edit = edit::duplicate(scene, target)?;
            copies.borrow_mut().push(edit.target.clone());
            Ok(edit)
        });
        if self.commit_and_select(edit) {
            let copies = copies.into_inner();
            self.model.marked = if copies.len() > 1 { copies } else { Vec::new() };
            let label = self.marked_label();
            if self.model.place_of_selection().is_some() {
                self.enter_mode(Mode::Move);
            }
            self.say(format!("{label} added"));
        }
    }

    /// Deletes the selection or the marked parts. The part that is selected afterwards is not
    /// deleted before the user has selected it.
    pub(super) fn delete(&mut self) {
        let label = self.marked_label();
        if std::mem::take(&mut self.model.chosen_by_deletion) {
            return self.say(format!("{label} is selected now · x again deletes it"));
        }
        let edit = self.edit_marked("delete", edit::delete);
        let noted = edit.as_ref().is_ok_and(|edit| edit.note.is_some());
        if self.commit_and_select(edit) {
            self.model.marked.clear();
            self.model.chosen_by_deletion = true;
            if !noted {
                self.say(format!("{label} deleted · u undoes"));
            }
        }
    }

    /// Makes a compound of the kind `kind` of the marked objects, the first marked first.
    pub(super) fn join(&mut self, kind: &str) {
        let edit = edit::join(self.scene(), &self.model.marked, kind);
        if self.commit_and_select(edit) {
            self.model.marked.clear();
            let label = self.model.selection.label(self.scene());
            self.say(format!("{label} is a {kind} · Right lists its parts · B dissolves it"));
        }
    }

    pub(super) fn dissolve(&mut self) {
        let edit = edit::dissolve(self.scene(), &self.model.selection);
        self.commit_and_select(edit);
    }

    /// Adds what `edit` has added, without a form.
    pub(super) fn add_ready_made(&mut self, edit: Result<Edit, EditError>) {
        if self.commit_and_select(edit) {
            let label = self.model.selection.label(self.scene());
            self.say(format!("{label} added · m moves it · Enter inspects it · u undoes"));
        }
    }

    /// Opens the list of presets for the selection's material.
    pub(super) fn pick_preset(&mut self) {
        let label = self.model.selection.label(self.scene());
        self.open_pick(format!("make {label} of"), edit::presets(), 0, |c, name| {
            let edit = edit::give_preset(c.scene(), &c.model.selection, name);
            if c.commit(edit, Coalesce::Single) {
                let label = c.model.selection.label(c.scene());
                c.say(format!("{label} is {name} · u undoes"));
            }
        });
    }

    pub(super) fn purge_materials(&mut self) {
        let edit = edit::purge_materials(self.scene());
        self.commit(edit, Coalesce::Single);
    }
}
