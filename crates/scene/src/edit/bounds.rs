//! Bounds of objects and scenes: to frame objects, to step coordinates, and to place new objects.

use crate::edit::Target;
use crate::edit::compound::{body, form, scene_from_compound};
use crate::value::floor_log10;
use crate::{Object, Scene};
use glam::DVec3;
use zerkalo_kernel::primitive::BoundingSphere;

/// Bounding box with sides parallel to the axes: `(lowest corner, highest corner)`.
pub(super) type Extent = (DVec3, DVec3);

/// Returns the bounding sphere of an object, part, light or material; `None` for other targets. An
/// infinite object, such as a plane, has a sphere around its position, with the radius R of
/// [`scene_bounds`]. A light has a sphere with its own radius, at least R / 10, and none without a
/// position. The sphere of a material contains all finite objects that use it.
pub fn bounds(scene: &Scene, target: &Target) -> Option<BoundingSphere> {
    match target {
        Target::Object(_) | Target::Part(..) => Some(match form(scene, target)?.bounds() {
            Some(extent) => ball(extent),
            None => {
                let body = body(scene, target).ok()?;
                let map = scene_from_compound(scene, target) * body.scene_from_object();
                let center = map.transform_point3(body.shape.position());
                BoundingSphere { center, radius: scene_bounds(scene).radius }
            }
        }),
        Target::Light(i) => {
            let light = scene.lights.get(*i)?;
            let usual = scene_bounds(scene).radius / 10.0;
            let radius = light.surface().map_or(usual, |surface| surface.radius().max(usual));
            Some(BoundingSphere { center: DVec3::from(light.position()?), radius })
        }
        Target::Material(name) => {
            let used = scene.objects.iter().filter(|o| o.names_material(name));
            used.filter_map(|o| o.form().bounds()).reduce(union).map(ball)
        }
        Target::Camera | Target::View(_) | Target::Group(_) | Target::Settings(_) => None,
    }
}

/// Returns the height of the lowest point of an object or part; `None` if it has none.
pub fn lowest(scene: &Scene, target: &Target) -> Option<f64> {
    form(scene, target)?.bounds().map(|(low, _)| low.y)
}

/// Returns the bounding sphere of all solids; without solids, of all finite objects; without these,
/// the unit sphere about the origin.
pub fn scene_bounds(scene: &Scene) -> BoundingSphere {
    middle(scene).map_or(BoundingSphere { center: DVec3::ZERO, radius: 1.0 }, ball)
}

/// Returns the bounding box of all solids or, without solids, of all finite objects.
fn middle(scene: &Scene) -> Option<Extent> {
    let forms: Vec<_> = scene.objects.iter().map(Object::form).collect();
    let solids = forms.iter().filter(|form| form.is_solid()).filter_map(|form| form.bounds());
    solids.reduce(union).or_else(|| forms.iter().filter_map(|form| form.bounds()).reduce(union))
}

pub(super) fn union(a: Extent, b: Extent) -> Extent {
    (a.0.min(b.0), a.1.max(b.1))
}

/// Returns the sphere through the corners of a box. Its radius is greater than 0.
fn ball((low, high): Extent) -> BoundingSphere {
    let radius = (high - low).length() / 2.0;
    let center = low + (high - low) / 2.0;
    BoundingSphere { center, radius: radius.max(f64::MIN_POSITIVE) }
}

/// Returns the coarse step of a coordinate by arrow keys: the power of ten between a hundredth and
/// a tenth of the diameter of [`scene_bounds`]. A fine step is a tenth of it.
pub fn step_length(scene: &Scene) -> f64 {
    let exponent = floor_log10(2.0 * scene_bounds(scene).radius) - 1;
    format!("1e{}", exponent.clamp(-12, 8)).parse().unwrap_or(0.1)
}

/// Returns the distance, greater than 0, from the eye to the pivot of camera movements. The pivot
/// is the target or, without one, the point of the view axis closest to the centre of
/// [`scene_bounds`]. If this point is less than a tenth of the radius ahead, the distance is the
/// radius.
pub fn pivot_distance(scene: &Scene) -> f64 {
    let eye = DVec3::from_array(scene.camera.eye);
    if let Some(target) = scene.camera.target {
        return (DVec3::from_array(target) - eye).length();
    }
    let BoundingSphere { center, radius } = scene_bounds(scene);
    let along = scene.camera.view().map_or(0.0, |w| w.dot(center - eye));
    if along > 0.1 * radius { along } else { radius }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::edit::SceneSettings;
    use crate::testing::mirror_room;

    #[test]
    fn scene_bounds_enclose_the_solids() {
        let mut scene = mirror_room();
        let room = scene_bounds(&scene);
        assert!(room.radius > 1.5 && room.radius < 3.0, "{room:?}");
        assert_eq!(step_length(&scene), 0.1);
        let floor = bounds(&scene, &Target::Object(0)).unwrap();
        assert!((floor.radius - 32f64.sqrt()).abs() < 1e-12 && floor.center == DVec3::ZERO);
        let red = bounds(&scene, &Target::Material("red".into())).unwrap();
        assert_eq!(red, bounds(&scene, &Target::Object(2)).unwrap());
        assert_eq!(bounds(&scene, &Target::Settings(SceneSettings::Film)), None);
        scene.objects.truncate(1);
        assert_eq!(scene_bounds(&scene), floor, "without solids what there is");
        scene.objects.clear();
        assert_eq!(scene_bounds(&scene).radius, 1.0);
    }

    #[test]
    fn pivot_distance_is_positive() {
        let mut scene = mirror_room();
        let target = pivot_distance(&scene);
        let w = scene.camera.view().unwrap();
        scene.camera.target = None;
        scene.camera.direction = Some(w.to_array());
        assert!((pivot_distance(&scene) / target - 1.0).abs() < 0.3);
        scene.camera.direction = Some((-w).to_array());
        assert!(pivot_distance(&scene) > 0.0);
    }
}
