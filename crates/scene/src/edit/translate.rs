//! Edits that move an object, a light or a camera by a vector, in scene units.

use crate::edit::bounds::scene_bounds;
use crate::edit::{Edit, EditError, Target};
use crate::light::{Directional, Light};
use crate::value::{floor_log10, rounded_to, unit};
use crate::{Object, Scene, TransformOp};
use glam::DVec3;

/// Moves an object, a light, the current camera or a stored camera by the vector `by`, in scene
/// units. If an object has no transform, the coordinates in its shape change. Otherwise, or if its
/// shape has no coordinates (a mesh), a translation by `by` is added as the last step of its
/// transform, or added to a translation that is the last step. A directional light changes its
/// direction: it is treated as a lamp that moves by `by` and stays aimed at the origin. The lamp's
/// distance from the origin is three times the radius of the scene's bounding sphere.
///
/// # Errors
/// Fails for targets that cannot be moved, and for new coordinates beyond the largest valid one.
pub fn move_by(scene: &Scene, subject: &Target, by: [f64; 3]) -> Result<Edit, EditError> {
    if by.iter().any(|x| !x.is_finite()) {
        return Err(EditError::new("the distance is not a finite number", ""));
    }
    let mut next = scene.clone();
    match subject {
        Target::Object(i) => {
            let object = next.objects.get_mut(*i).ok_or_else(|| EditError::gone(subject))?;
            move_object(object, by);
        }
        Target::Light(i) => {
            let light = next.lights.get_mut(*i).ok_or_else(|| EditError::gone(subject))?;
            move_light(light, by, scene);
        }
        Target::Camera | Target::View(_) => {
            let camera = match subject {
                Target::View(name) => next.cameras.get_mut(name),
                _ => Some(&mut next.camera),
            };
            let camera = camera.ok_or_else(|| EditError::gone(subject))?;
            camera.eye = moved(camera.eye, by);
            camera.target = camera.target.map(|target| moved(target, by));
        }
        _ => {
            let found = format!("{} cannot be moved", subject.label(scene));
            return Err(EditError::new(&found, "Select an object, a light or the camera."));
        }
    }
    let label = format!("move {}", subject.label(scene));
    Edit::checked(next, subject.clone(), label)
}

/// Returns the point `at + by`. Each coordinate that changes is rounded to a multiple of `p /
/// 1000`, where `p` is the largest power of ten that is at most the absolute change.
pub(super) fn moved(at: [f64; 3], by: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|i| match by[i] {
        0.0 => at[i],
        by => rounded_to(at[i] + by, floor_log10(by) - 3),
    })
}

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

fn move_light(light: &mut Light, by: [f64; 3], scene: &Scene) {
    if let Some(position) = light.position_mut() {
        *position = moved(*position, by);
    }
    if let Some(Directional { direction }) = &mut light.directional {
        let reach = 3.0 * scene_bounds(scene).radius;
        let lamp = -unit(*direction).unwrap_or(DVec3::NEG_Y) * reach;
        let lamp = lamp + DVec3::from_array(by);
        // If the lamp is at the origin, it has no direction towards the origin. The light then
        // stays unchanged.
        if let Some(aimed) = unit(-lamp) {
            *direction = aimed.map(|x| rounded_to(x, -4)).to_array();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::built_in;
    use crate::shape::Shape;

    #[test]
    fn objects_move_by_shape_key_or_last_translation() {
        let scene = built_in();
        let ball = Target::Object(2);
        let edit = move_by(&scene, &ball, [0.1, 0.0, -0.2]).unwrap();
        assert_eq!(edit.label, "move ball");
        let Shape::Sphere(sphere) = &edit.scene.objects[2].shape else { panic!() };
        assert_eq!(sphere.center, [-0.8, 0.5, -0.2]);
        let mut turned = scene.clone();
        turned.objects[2].transform = vec![TransformOp::RotateY(30.0)];
        let once = move_by(&turned, &ball, [0.1, 0.2, 0.0]).unwrap().scene;
        let twice = move_by(&once, &ball, [0.1, 0.2, 0.0]).unwrap().scene;
        let steps = [TransformOp::RotateY(30.0), TransformOp::Translate([0.2, 0.4, 0.0])];
        assert_eq!(twice.objects[2].transform, steps);
        let back = move_by(&twice, &ball, [-0.2, -0.4, 0.0]).unwrap().scene;
        assert_eq!(back, turned);
    }

    #[test]
    fn point_lights_move_and_directional_lights_rotate() {
        let mut scene = built_in();
        let lamp = Target::Light(0);
        let edit = move_by(&scene, &lamp, [0.0, 0.1, 0.0]).unwrap();
        assert_eq!(edit.scene.lights[0].point.unwrap().position, [2.0, 4.1, 3.0]);
        scene.lights[0].point = None;
        scene.lights[0].directional = Some(Directional { direction: [0.0, -2.0, 0.0] });
        let edit = move_by(&scene, &lamp, [1.0, 0.0, 0.0]).unwrap();
        let [x, y, z] = edit.scene.lights[0].directional.unwrap().direction;
        assert!(x < 0.0 && y < 0.0 && z == 0.0, "{x} {y} {z}");
    }

    #[test]
    fn move_beyond_coordinate_range_is_refused() {
        let scene = built_in();
        assert!(move_by(&scene, &Target::Object(2), [1e10, 0.0, 0.0]).is_err());
        assert!(move_by(&scene, &Target::Object(2), [f64::NAN, 0.0, 0.0]).is_err());
        assert!(move_by(&scene, &Target::Film, [1.0, 0.0, 0.0]).is_err());
        let camera = move_by(&scene, &Target::Camera, [0.5, 0.0, 0.0]).unwrap().scene.camera;
        assert_eq!((camera.eye, camera.target), ([1.1, 1.4, 4.5], Some([0.5, 0.8, -0.5])));
    }
}
