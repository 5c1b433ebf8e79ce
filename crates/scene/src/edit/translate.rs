//! Edits that move an object, a light or a camera by a vector, in scene units.

use crate::camera::Camera;
use crate::edit::bounds::scene_bounds;
use crate::edit::compound::{body, in_compound, set_body};
use crate::edit::{Edit, EditError, Target};
use crate::light::Light;
use crate::value::{floor_log10, rounded_to, unit};
use crate::{Object, Scene, TransformOp};
use glam::DVec3;

/// Moves an object, a part of one, a light or a camera by a vector in scene units. An object with a transform, or
/// without coordinates in its shape, gets a translation as the last step. A directional light is
/// treated as a lamp, three radii of the scene from the origin, that moves by `by` and stays aimed
/// at the origin. Fails for other targets, and for coordinates out of range.
pub fn move_by(scene: &Scene, target: &Target, by: [f64; 3]) -> Result<Edit, EditError> {
    if by.iter().any(|x| !x.is_finite()) {
        return Err(EditError::new("the distance is not a finite number", ""));
    }
    let mut next = scene.clone();
    match target {
        Target::Object(_) | Target::Part(..) => {
            let mut body = body(scene, target)?;
            move_object(&mut body, in_compound(scene, target, by));
            set_body(&mut next, target, body);
        }
        Target::Light(i) => {
            let light = next.lights.get_mut(*i).ok_or_else(|| EditError::gone(target))?;
            move_light(light, by, scene);
        }
        Target::Camera => move_camera(&mut next.camera, by),
        Target::View(name) => {
            let view = next.cameras.get_mut(name).ok_or_else(|| EditError::gone(target))?;
            move_camera(view, by);
        }
        Target::Group(_) | Target::Material(_) | Target::Settings(_) => {
            let found = format!("{} cannot be moved", target.label(scene));
            return Err(EditError::new(found, "Select an object, a light or the camera."));
        }
    }
    let label = format!("move {}", target.label(scene));
    Edit::checked(next, target.clone(), label)
}

/// Returns `at + by`. A coordinate that changes is rounded to about a thousandth of the change.
pub(super) fn moved(at: [f64; 3], by: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|i| match by[i] {
        0.0 => at[i],
        by => rounded_to(at[i] + by, floor_log10(by) - 3),
    })
}

/// Moves an object as [`move_by`] describes, by its coordinates or its last transform step.
pub(super) fn move_object(object: &mut Object, by: [f64; 3]) {
    match object.transform.last_mut() {
        None if !object.shape.anchor_points_mut().is_empty() => {
            for anchor in object.shape.anchor_points_mut() {
                *anchor = moved(*anchor, by);
            }
        }
        Some(TransformOp::Translate(last)) => {
            *last = moved(*last, by);
            if *last == [0.0; 3] {
                object.transform.pop();
            }
        }
        _ if by == [0.0; 3] => {}
        _ => object.transform.push(TransformOp::Translate(moved([0.0; 3], by))),
    }
}

fn move_camera(camera: &mut Camera, by: [f64; 3]) {
    camera.eye = moved(camera.eye, by);
    camera.target = camera.target.map(|target| moved(target, by));
}

fn move_light(light: &mut Light, by: [f64; 3], scene: &Scene) {
    let handles = light.kind.handles();
    if let Some(position) = handles.position {
        *position = moved(*position, by);
    } else if let Some(direction) = handles.direction {
        let reach = 3.0 * scene_bounds(scene).radius;
        let lamp = -unit(*direction).unwrap_or(DVec3::NEG_Y) * reach;
        let lamp = lamp + DVec3::from_array(by);
        // A lamp at the origin cannot be aimed at the origin.
        if let Some(aimed) = unit(-lamp) {
            *direction = aimed.map(|x| rounded_to(x, -4)).to_array();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::edit::SceneSettings;
    use crate::light::Directional;
    use crate::shape::Shape;
    use crate::testing::mirror_room;

    #[test]
    fn objects_move_by_shape_key_or_last_translation() {
        let scene = mirror_room();
        let ball = Target::Object(2);
        let edit = move_by(&scene, &ball, [0.1, 0.0, -0.2]).unwrap();
        assert_eq!(edit.label, "move ball");
        let Shape::Sphere(sphere) = &edit.scene.objects[2].shape else { panic!() };
        assert_eq!(sphere.center, [-0.8, 0.5, -0.2]);
        let mut rotated = scene.clone();
        rotated.objects[2].transform = vec![TransformOp::RotateY(30.0)];
        let once = move_by(&rotated, &ball, [0.1, 0.2, 0.0]).unwrap().scene;
        let twice = move_by(&once, &ball, [0.1, 0.2, 0.0]).unwrap().scene;
        let steps = [TransformOp::RotateY(30.0), TransformOp::Translate([0.2, 0.4, 0.0])];
        assert_eq!(twice.objects[2].transform, steps);
        let back = move_by(&twice, &ball, [-0.2, -0.4, 0.0]).unwrap().scene;
        assert_eq!(back, rotated);
    }

    #[test]
    fn point_lights_move_and_directional_lights_rotate() {
        let mut scene = mirror_room();
        let lamp = Target::Light(0);
        let edit = move_by(&scene, &lamp, [0.0, 0.1, 0.0]).unwrap();
        assert_eq!(edit.scene.lights[0].position(), Some([2.0, 4.1, 3.0]));
        scene.lights[0].kind = Directional::along([0.0, -2.0, 0.0]).into();
        let edit = move_by(&scene, &lamp, [1.0, 0.0, 0.0]).unwrap();
        let [x, y, z] = edit.scene.lights[0].direction().unwrap();
        assert!(x < 0.0 && y < 0.0 && z == 0.0, "{x} {y} {z}");
    }

    #[test]
    fn move_beyond_coordinate_range_is_refused() {
        let scene = mirror_room();
        assert!(move_by(&scene, &Target::Object(2), [1e10, 0.0, 0.0]).is_err());
        assert!(move_by(&scene, &Target::Object(2), [f64::NAN, 0.0, 0.0]).is_err());
        assert!(move_by(&scene, &Target::Settings(SceneSettings::Film), [1.0, 0.0, 0.0]).is_err());
        let camera = move_by(&scene, &Target::Camera, [0.5, 0.0, 0.0]).unwrap().scene.camera;
        assert_eq!((camera.eye, camera.target), ([1.1, 1.4, 4.5], Some([0.5, 0.8, -0.5])));
    }
}
