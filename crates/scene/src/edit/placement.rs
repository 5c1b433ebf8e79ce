//! Placement of objects: on surfaces that support them, and at positions free of other objects.

use crate::camera::Camera;
use crate::edit::add::view_size;
use crate::edit::bounds::{Extent, scene_bounds};
use crate::edit::{Edit, EditError, Target};
use crate::value::{floor_log10, round_significant, rounded_to};
use crate::{Object, Scene, TransformOp};
use glam::{DVec2, DVec3};
use zerkalo_kernel::primitive::{Form, HalfSpace};

/// Lowers an object onto the highest surface below its centre and its lowest corners, or raises it
/// to the lowest surface above if there is none below. Fails for targets other than objects, for
/// infinite objects, and if there is no surface at all.
pub fn snap_to_ground(scene: &Scene, target: &Target) -> Result<Edit, EditError> {
    let Target::Object(index) = target else {
        return Err(EditError::new("only objects can be snapped to ground", "Select an object."));
    };
    if !target.exists(scene) {
        return Err(EditError::gone(target));
    }
    let mut others: Vec<_> = scene.objects.iter().map(Object::form).collect();
    let form = others.remove(*index);
    let Some((low, high)) = form.bounds() else {
        return Err(EditError::new("a plane without end has no lowest point", ""));
    };
    let level = (low.y + high.y) / 2.0;
    let support_points = support_points(&form, (low, high));
    let heights = |down: bool| {
        let found = support_points.iter().flat_map(|foot| {
            let from = DVec3::new(foot.x, level, foot.y);
            let direction = if down { DVec3::NEG_Y } else { DVec3::Y };
            others.iter().filter_map(move |form| {
                let t = form.cast(from, direction)?;
                // Rounding removes the error of the sum, which would leave a gap.
                Some(round_significant(from.y + direction.y * t, 13))
            })
        });
        found.collect::<Vec<_>>()
    };
    let below = heights(true).into_iter().reduce(f64::max);
    let support_height = below.or_else(|| heights(false).into_iter().reduce(f64::min));
    let Some(support_height) = support_height else {
        let help = "Add a platform or a plane first.";
        return Err(EditError::new("there is no surface below or above it", help));
    };
    let mut next = scene.clone();
    let dropped = &mut next.objects[*index];
    // Later passes remove the gap that rounding leaves after the first pass.
    for _ in 0..3 {
        let lowest = dropped.form().bounds().map_or(support_height, |(low, _)| low.y);
        lift(dropped, support_height - lowest);
    }
    let label = format!("drop {}", target.label(scene));
    Edit::checked(next, target.clone(), label)
}

/// Moves an object up by exactly `by`.
fn lift(object: &mut Object, by: f64) {
    if by == 0.0 {
        return;
    }
    match object.transform.last_mut() {
        None if !object.shape.anchor_points_mut().is_empty() => {
            object.shape.anchor_points_mut().into_iter().for_each(|anchor| anchor[1] += by);
        }
        Some(TransformOp::Translate(last)) => last[1] += by,
        _ => object.transform.push(TransformOp::Translate([0.0, by, 0.0])),
    }
}

/// Returns the points (x, z) where an object may be supported: its middle and its lowest corners.
fn support_points(form: &Form, (low, high): Extent) -> Vec<DVec2> {
    let flat = |p: DVec3| DVec2::new(p.x, p.z);
    let middle = flat(low + (high - low) / 2.0);
    let mut support_points = vec![middle];
    let corners = form.corners();
    let near = 1e-9 * (high - low).max_element();
    let lowest = corners.iter().filter(|c| c.y - low.y <= near).map(|c| flat(*c));
    // Objects that only touch the sides are no support: corners are moved slightly inwards.
    support_points.extend(lowest.map(|c| middle + (c - middle) * (1.0 - 1e-6)));
    support_points
}

/// Returns a position for the centre of the underside of a new object of `size`: on a surface, free
/// of other objects, near the middle of the view, and visible if possible.
pub(super) fn place_for(scene: &Scene, size: DVec3) -> DVec3 {
    let radius = scene_bounds(scene).radius;
    let eye = DVec3::from_array(scene.camera.eye);
    let forward = scene.camera.view().unwrap_or(DVec3::NEG_Z);
    let forms: Vec<_> = scene.objects.iter().map(Object::form).collect();
    let aim = eye + forward * crate::edit::pivot_distance(scene);
    let solids: Vec<Extent> =
        forms.iter().filter(|f| f.is_solid()).filter_map(|form| form.bounds()).collect();
    let walls: Vec<&Form> = forms.iter().filter(|form| !form.is_solid()).collect();
    let floors: Vec<&Form> = walls.iter().copied().filter(|form| is_level(form)).collect();
    // New positions are round numbers: whole centimetres for an object of one metre.
    let grid = floor_log10(size.min_element()) - 2;
    let candidate = |offset: DVec2| {
        let at = DVec3::new(aim.x + offset.x, aim.y, aim.z + offset.y);
        let ground = ground_under(&floors, at).unwrap_or_else(|| bare_ground(scene, aim, size.y));
        DVec3::new(rounded_to(at.x, grid), round_significant(ground, 13), rounded_to(at.z, grid))
    };
    let spread = size.x.max(size.z);
    // Beside each other as the camera sees it.
    let [right, ..] = scene.camera.frame();
    let side = DVec2::new(right.x, right.z).try_normalize().unwrap_or(DVec2::X);
    let row = [0.0, 1.0, -1.0, 2.0, -2.0].map(|i| side * (1.25 * i * spread));
    let spiral = (0..400).map(|i| {
        // A sunflower spiral covers the area evenly from the middle outwards.
        let angle = f64::from(i) * 2.399_963_229_728_653;
        DVec2::from_angle(angle) * (0.45 * spread * f64::from(i).sqrt())
    });
    let reach = 6.0 * radius.max(spread);
    let free = row
        .into_iter()
        .chain(spiral)
        .take_while(|offset| offset.length() <= reach)
        .map(candidate)
        .filter(|base| {
            let half = DVec3::new(spread / 2.0, 0.0, spread / 2.0);
            let room = (*base - half, *base + half + DVec3::Y * size.y);
            !walls.iter().any(|wall| intersects(wall, room))
                && !solids.iter().any(|solid| overlap(*solid, room))
        });
    // A hidden position inside the picture is second best.
    let (mut hidden, mut outside) = (None, None);
    for base in free {
        let middle = base + DVec3::Y * (size.y / 2.0);
        if !in_view(&scene.camera, scene.film.size, middle) {
            outside = outside.or(Some(base));
        } else if !is_visible(&forms, eye, middle) {
            hidden = hidden.or(Some(base));
        } else {
            return base;
        }
    }
    hidden.or(outside).unwrap_or_else(|| candidate(DVec2::ZERO))
}

/// Returns the height of the ground at `at` for an object of height `size`.
pub(super) fn ground_height(scene: &Scene, at: DVec3, size: f64) -> f64 {
    let forms: Vec<_> = scene.objects.iter().map(Object::form).collect();
    let floors: Vec<&Form> = forms.iter().filter(|f| !f.is_solid() && is_level(f)).collect();
    ground_under(&floors, at).unwrap_or_else(|| bare_ground(scene, at, size))
}

/// Returns the height on which objects stand without a floor: 0 if the camera sees it below its
/// target `aim`, otherwise half of `size` below the target.
fn bare_ground(scene: &Scene, aim: DVec3, size: f64) -> f64 {
    let is_near = aim.y >= 0.0 && aim.y <= view_size(scene)[1] / 2.0;
    if is_near { 0.0 } else { aim.y - size / 2.0 }
}

/// Returns `true` if an object is flat and its slope is less than 60 degrees.
fn is_level(form: &Form) -> bool {
    form.plane().is_some_and(|plane| plane.normal.y.abs() > 0.5)
}

/// Returns the height of the highest of `floors` below `at`, or else of the lowest one above it.
fn ground_under(floors: &[&Form], at: DVec3) -> Option<f64> {
    let heights = |direction: DVec3| {
        floors.iter().filter_map(move |form| Some(at.y + direction.y * form.cast(at, direction)?))
    };
    heights(DVec3::NEG_Y).reduce(f64::max).or_else(|| heights(DVec3::Y).reduce(f64::min))
}

/// Returns `true` if the flat object `form` intersects the slightly shrunk box: no axis separates
/// them. An infinite plane has no corners and no edges.
fn intersects(form: &Form, (low, high): Extent) -> bool {
    let (center, half) = ((low + high) / 2.0, (high - low) * (0.5 - 1e-6));
    let reach = |axis: DVec3| half.dot(axis.abs());
    let crosses =
        |plane: HalfSpace| (plane.normal.dot(center) - plane.offset).abs() < reach(plane.normal);
    let corners = form.corners();
    let edges = corners.iter().skip(1).take(2).map(|corner| corner - corners[0]);
    let across = edges.flat_map(|edge| DVec3::AXES.map(|axis| axis.cross(edge)));
    let is_separated = |axis: DVec3| {
        let along = || corners.iter().map(|corner| axis.dot(corner - center));
        along().all(|x| x > reach(axis)) || along().all(|x| x < -reach(axis))
    };
    form.plane().is_some_and(crosses)
        && (corners.is_empty() || !DVec3::AXES.into_iter().chain(across).any(is_separated))
}

fn overlap(a: Extent, b: Extent) -> bool {
    a.0.cmplt(b.1).all() && b.0.cmplt(a.1).all()
}

/// Returns `true` if `point` is inside the picture, with a margin of 7.5 %.
fn in_view(camera: &Camera, size: [u32; 2], point: DVec3) -> bool {
    let [right, up, forward] = camera.frame();
    let to = point - DVec3::from_array(camera.eye);
    let depth = to.dot(forward);
    let [half_width, half_height] = camera.half_size(size.map(f64::from));
    depth > 0.0
        && to.dot(right).abs() < 0.85 * half_width * depth
        && to.dot(up).abs() < 0.85 * half_height * depth
}

/// Returns `true` if nothing occludes `point` from the eye.
fn is_visible(forms: &[Form], eye: DVec3, point: DVec3) -> bool {
    !forms.iter().any(|form| form.cast(eye, point - eye).is_some_and(|t| t < 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::TomlText;
    use crate::edit::move_by;
    use crate::shape::Shape;
    use crate::testing::mirror_room;
    use glam::DAffine3;

    #[test]
    fn rectangles_in_a_box_intersect_it() {
        let text =
            "rectangle = { center = [0.3, 0.5, 0.1], size = [0.1, 0.1], normal = [1, 0, 0] }";
        let small = Shape::from_text(text).unwrap().form();
        let far = small.clone().transformed(&DAffine3::from_translation(DVec3::X));
        let room = (DVec3::new(-0.5, 0.0, -0.5), DVec3::new(0.5, 1.0, 0.5));
        assert!(intersects(&small, room) && !intersects(&far, room));
    }

    fn lowest(scene: &Scene, i: usize) -> f64 {
        scene.objects[i].form().bounds().unwrap().0.y
    }

    #[test]
    fn snap_to_ground_rests_exactly_on_the_surface() {
        let scene = mirror_room();
        for i in 2..6 {
            for by in [[0.0, 1.23, 0.0], [0.0, -0.217, 0.0], [0.1, 0.777, 0.1]] {
                let target = Target::Object(i);
                let up = move_by(&scene, &target, by).unwrap().scene;
                let down = snap_to_ground(&up, &target).unwrap();
                assert_eq!(lowest(&down.scene, i), 0.0, "object {i} {by:?}");
            }
        }
    }

    #[test]
    fn snap_to_ground_finds_table_and_ground_above() {
        let text = "[[object]]\nshape.plane = { point = [0, -1, 0], normal = [0, 1, 0] }\n\
                    [[object]]\nshape.box = { center = [0, 0, 0], size = [2, 0.5, 2] }\n\
                    [[object]]\nshape.cube = { corner = [-0.5, 3, 0.5], edge = 1 }\n\
                    transform = [{ rotate_y = 30.0 }]\n";
        let scene = Scene::parse(text, "text").unwrap();
        let cube = Target::Object(2);
        let on_table = snap_to_ground(&scene, &cube).unwrap().scene;
        assert!((lowest(&on_table, 2) - 0.25).abs() < 1e-15);
        let aside = move_by(&scene, &cube, [5.0, 0.0, 0.0]).unwrap().scene;
        assert!((lowest(&snap_to_ground(&aside, &cube).unwrap().scene, 2) + 1.0).abs() < 1e-15);
        let corner = move_by(&scene, &cube, [1.3, 0.0, 0.0]).unwrap().scene;
        assert!((lowest(&snap_to_ground(&corner, &cube).unwrap().scene, 2) - 0.25).abs() < 1e-15);
        let sunk = move_by(&aside, &cube, [0.0, -9.0, 0.0]).unwrap().scene;
        assert!((lowest(&snap_to_ground(&sunk, &cube).unwrap().scene, 2) + 1.0).abs() < 1e-15);
        let refusal = snap_to_ground(&scene, &Target::Object(0)).unwrap_err();
        assert!(refusal.found.contains("no lowest point"), "{refusal}");
        let alone = Scene { objects: vec![scene.objects[2].clone()], ..Scene::default() };
        let refusal = snap_to_ground(&alone, &Target::Object(0)).unwrap_err();
        assert!(refusal.found.contains("no surface below"), "{refusal}");
    }
}
