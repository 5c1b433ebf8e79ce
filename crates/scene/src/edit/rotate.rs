//! Edits that rotate an object or a light about the vertical.

use crate::edit::bounds::scene_bounds;
use crate::edit::compound::{body, set_body};
use crate::edit::{Edit, EditError, Target};
use crate::shape::wrapped_angle;
use crate::value::{floor_log10, rotated_y, rounded_to, sin_cos_degrees};
use crate::{Object, Scene, TransformOp};
use glam::DVec3;

/// Rotates an object or a light by `degrees` about a vertical axis, counter-clockwise seen from
/// above. The axis goes through the centre of the object or, for a light, of the scene. A part rotates
/// about the vertical of its compound.
///
/// An object with a transform, or with a shape that has no keys for the rotation, gets a rotation
/// and a translation at the end of its transform; later rotations change these two steps. Fails for
/// targets other than objects and lights.
pub fn rotate(scene: &Scene, target: &Target, degrees: f64) -> Result<Edit, EditError> {
    if !degrees.is_finite() {
        return Err(EditError::new("the angle is not a finite number", ""));
    }
    let mut next = scene.clone();
    match target {
        Target::Object(_) | Target::Part(..) => {
            let mut body = body(scene, target)?;
            if !body.transform.is_empty() || !body.shape.rotate_y(degrees) {
                rotate_by_steps(&mut body, degrees);
            }
            set_body(&mut next, target, body);
        }
        Target::Light(i) => {
            let light = next.lights.get_mut(*i).ok_or_else(|| EditError::gone(target))?;
            let handles = light.kind.handles();
            for direction in [handles.direction, handles.up].into_iter().flatten() {
                *direction = rotated_y(*direction, degrees);
            }
            if let Some(position) = handles.position {
                let pivot = scene_bounds(scene).center;
                let offset = std::array::from_fn(|i| position[i] - pivot[i]);
                let offset = rotated_y(offset, degrees);
                let digits = floor_log10(offset[0].hypot(offset[2])) - 6;
                let coordinate = |i| rounded_to(pivot[i] + offset[i], digits);
                *position = [coordinate(0), position[1], coordinate(2)];
            }
        }
        Target::Camera
        | Target::View(_)
        | Target::Group(_)
        | Target::Material(_)
        | Target::Settings(_) => {
            let found = format!("{} cannot be rotated", target.label(scene));
            return Err(EditError::new(found, "Select an object or a light."));
        }
    }
    let label = format!("rotate {}", target.label(scene));
    Edit::checked(next, target.clone(), label)
}

/// Rotates the object by `degrees`: replaces or adds the steps `rotate_y` and `translate` at the
/// end of its transform. Steps without effect are left out.
fn rotate_by_steps(object: &mut Object, degrees: f64) {
    let (angle, shift, own_len) = match object.transform[..] {
        [.., TransformOp::RotateY(angle), TransformOp::Translate(shift)] => (angle, shift, 2),
        [.., TransformOp::RotateY(angle)] => (angle, [0.0; 3], 1),
        _ => (0.0, [0.0; 3], 0),
    };
    let kept_len = object.transform.len() - own_len;
    object.transform.truncate(kept_len);
    let form = object.form();
    let (middle, scale) = match form.bounds() {
        Some((low, high)) => (low + (high - low) / 2.0, (high - low).max_element()),
        None => {
            let point = object.shape.position();
            (object.scene_from_object().transform_point3(point), 1.0)
        }
    };
    let after = |angle: f64| {
        let (sin, cos) = sin_cos_degrees(angle);
        DVec3::new(middle.x * cos + middle.z * sin, middle.y, middle.z * cos - middle.x * sin)
    };
    let position = after(angle) + DVec3::from_array(shift);
    let angle = wrapped_angle(angle, degrees);
    let shift = position - after(angle);
    let digits = floor_log10(scale.max(middle.x.hypot(middle.z))) - 6;
    let shift = shift.map(|x| rounded_to(x, digits)).to_array();
    if angle != 0.0 {
        object.transform.push(TransformOp::RotateY(angle));
    }
    if shift != [0.0; 3] {
        object.transform.push(TransformOp::Translate(shift));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shape::{KINDS, Shape};
    use crate::testing::mirror_room;

    fn middle(object: &Object) -> DVec3 {
        let (low, high) = object.form().bounds().unwrap();
        (low + high) / 2.0
    }

    #[test]
    fn rotate_changes_the_rotation_key_of_a_shape() {
        let scene = mirror_room();
        let edit = rotate(&scene, &Target::Object(3), 5.0).unwrap();
        let Shape::Cube(cube) = &edit.scene.objects[3].shape else { panic!() };
        assert!(cube.rotation == 35.0 && edit.scene.objects[3].transform.is_empty());
        let edit = rotate(&scene, &Target::Object(1), 90.0).unwrap();
        let Shape::Rectangle(mirror) = &edit.scene.objects[1].shape else { panic!() };
        assert_eq!(mirror.normal, [1.0, 0.0, 0.0]);
    }

    /// Checks that rotations keep the position of objects of every kind, with and without a
    /// transform, and that small rotations together change nothing if they add up to 360 degrees.
    #[test]
    fn rotate_keeps_the_middle_and_360_degrees_are_identity() {
        for kind in KINDS {
            let base = DVec3::new(3.0, 0.0, -2.0);
            let shape = Shape::fitted_to(kind.name, base, DVec3::new(1.0, 0.5, 2.0)).unwrap();
            for transform in
                [vec![], vec![TransformOp::RotateX(20.0)], vec![TransformOp::RotateY(7.0)]]
            {
                let object = Object {
                    name: String::new(),
                    material: String::new(),
                    shape: shape.clone(),
                    transform,
                };
                let start = Scene { objects: vec![object], ..Scene::default() };
                let mut scene = start.clone();
                for _ in 0..72 {
                    scene = rotate(&scene, &Target::Object(0), 5.0).unwrap().scene;
                    let steps = scene.objects[0].transform.len();
                    assert!(steps <= 3, "{}: {steps} steps", kind.name);
                }
                if kind.name != "plane" {
                    let (a, b) = (middle(&start.objects[0]), middle(&scene.objects[0]));
                    assert!((a - b).length() < 1e-5, "{}: {a} {b}", kind.name);
                    let half = rotate(&start, &Target::Object(0), 180.0).unwrap().scene;
                    let c = middle(&half.objects[0]);
                    // The bounding box of an irregular object gets another centre when the object
                    // rotates.
                    let uneven = ["prism", "union", "intersection", "difference"];
                    let slack = if uneven.contains(&kind.name) { 0.5 } else { 1e-5 };
                    assert!((a - c).length() < slack, "{}: {a} {c}", kind.name);
                }
                let map = |scene: &Scene| scene.objects[0].scene_from_object();
                assert!(map(&start).abs_diff_eq(map(&scene), 2e-5), "{}", kind.name);
            }
        }
    }

    #[test]
    fn rotate_rotates_lights_about_the_scene() {
        let scene = mirror_room();
        let mut round = scene.clone();
        for _ in 0..72 {
            round = rotate(&round, &Target::Light(0), 5.0).unwrap().scene;
        }
        let [a, b] = [&scene, &round].map(|s| s.lights[0].apex().unwrap());
        assert!((a - b).length() < 1e-4, "{a} {b}");
        assert!(rotate(&scene, &Target::Camera, 5.0).is_err());
        assert!(rotate(&scene, &Target::Light(0), f64::NAN).is_err());
    }
}
