//! Edits of the camera's focus and aperture.

use crate::Scene;
use crate::camera::{Aperture, Camera, Focus};
use crate::edit::bounds::pivot_distance;
use crate::edit::{Edit, EditError, Target};
use crate::value::{floor_log10, round_significant, rounded_to};
use glam::DVec3;

/// Radius to which a pinhole is opened, as a fraction of the distance of the plane in focus.
/// Objects at twice that distance are then visibly blurred.
const FIRST_RADIUS: f64 = 0.02;
/// Radius below which a lens becomes a pinhole, as a fraction of the same distance.
const LAST_RADIUS: f64 = 5e-4;
/// Smallest and largest f-number to which [`change_aperture`] leads.
const F_NUMBERS: [f64; 2] = [0.1, 1000.0];

/// Sets the focus of the camera to `point`. A focus that is given as a distance stays a distance.
/// Fails if `point` is the eye.
pub fn focus_on(scene: &Scene, point: [f64; 3]) -> Result<Edit, EditError> {
    let mut camera = scene.camera.clone();
    let to = DVec3::from_array(point) - DVec3::from_array(camera.eye);
    let exponent = floor_log10(to.length()) - 4;
    let focus = Focus::Point(point.map(|x| rounded_to(x, exponent)));
    let by_distance = matches!(camera.focus, Some(Focus::Distance(_)));
    camera.focus = Some(focus);
    if by_distance {
        camera.focus = Some(Focus::Distance(round_significant(camera.focus_depth(), 5)));
    }
    edited(scene, camera, "focus")
}

/// Opens the lens by `stops`; negative stops close it. One stop doubles the area of the lens. A
/// pinhole opens to a radius of a fiftieth of the distance of the plane in focus; a camera without
/// such a plane gets one. A lens that is given by its radius becomes a pinhole if it is closed far
/// enough.
pub fn change_aperture(scene: &Scene, stops: f64) -> Result<Edit, EditError> {
    let mut camera = scene.camera.clone();
    if camera.focus.is_none() && camera.target.is_none() {
        camera.focus = Some(Focus::Distance(round_significant(pivot_distance(scene), 3)));
    }
    let distance = camera.focus_depth();
    camera.aperture = match camera.aperture {
        Some(Aperture::FNumber(number)) => {
            Some(Aperture::FNumber(stopped(number, -stops).clamp(F_NUMBERS[0], F_NUMBERS[1])))
        }
        _ => {
            let changed = match camera.lens_radius() {
                0.0 if stops > 0.0 => stopped(FIRST_RADIUS * distance, 0.0),
                0.0 => 0.0,
                radius => stopped(radius, stops),
            };
            let radius = changed.min(distance);
            (radius >= LAST_RADIUS * distance).then_some(Aperture::Radius(radius))
        }
    };
    edited(scene, camera, "aperture")
}

/// Returns `x` times √2^`stops`, rounded to 1, 1.4, 2, 2.8 and so on.
fn stopped(x: f64, stops: f64) -> f64 {
    let position = (2.0 * x.log2()).round() + stops;
    round_significant((0.5 * position).exp2(), 2)
}

fn edited(scene: &Scene, camera: Camera, label: &str) -> Result<Edit, EditError> {
    let next = Scene { camera, ..scene.clone() };
    Edit::checked(next, Target::Camera, format!("{label} of the camera"))
}

/// Converts `aperture` or `focus` to the kind `name`. The picture stays the same, except for
/// rounding and for a pinhole that becomes a lens.
pub(super) fn switch(camera: &mut Camera, scene: &Scene, key: &str, name: &str) {
    let seen = Scene { camera: camera.clone(), ..scene.clone() };
    let distance = camera.focus_depth();
    let has_focus = camera.focus.is_some() || camera.target.is_some();
    match (key, name) {
        ("aperture", "radius") if !matches!(camera.aperture, Some(Aperture::Radius(_))) => {
            let radius = match camera.lens_radius() {
                0.0 => FIRST_RADIUS * distance,
                radius => radius,
            };
            camera.aperture = Some(Aperture::Radius(round_significant(radius, 3)));
        }
        ("aperture", "f_number") if !matches!(camera.aperture, Some(Aperture::FNumber(_))) => {
            let radius = camera.lens_radius();
            let number = if radius > 0.0 { camera.focal_length() / (2.0 * radius) } else { 2.8 };
            let [low, high] = F_NUMBERS;
            camera.aperture =
                Some(Aperture::FNumber(round_significant(number, 3).clamp(low, high)));
        }
        ("focus", "distance") if !matches!(camera.focus, Some(Focus::Distance(_))) => {
            let distance = if has_focus { distance } else { pivot_distance(&seen) };
            camera.focus = Some(Focus::Distance(round_significant(distance, 5)));
        }
        ("focus", "point") if !matches!(camera.focus, Some(Focus::Point(_))) => {
            let distance = if has_focus { distance } else { pivot_distance(&seen) };
            let ahead = camera.view().unwrap_or(DVec3::NEG_Z) * distance;
            let point = camera.target.filter(|_| camera.focus.is_none());
            let point = point.unwrap_or((DVec3::from_array(camera.eye) + ahead).to_array());
            let exponent = floor_log10(distance) - 4;
            camera.focus = Some(Focus::Point(point.map(|x| rounded_to(x, exponent))));
        }
        _ => {}
    }
    if key == "aperture" && camera.focus.is_none() && camera.target.is_none() {
        camera.focus = Some(Focus::Distance(round_significant(pivot_distance(&seen), 3)));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::edit::set;
    use crate::testing::mirror_room;

    fn distance(scene: &Scene) -> f64 {
        scene.camera.focus_depth()
    }

    #[test]
    fn focus_is_set_to_a_point() {
        let scene = mirror_room();
        let forward = scene.camera.view().unwrap();
        let point =
            (DVec3::from_array(scene.camera.eye) + forward * 3.0 + DVec3::X * 0.1).to_array();
        let focused = focus_on(&scene, point).unwrap().scene;
        assert!(
            matches!(focused.camera.focus, Some(Focus::Point(_))),
            "{:?}",
            focused.camera.focus
        );
        let expected = 3.0 + 0.1 * forward.x;
        assert!((distance(&focused) - expected).abs() < 1e-3, "{}", distance(&focused));
        let by_distance = set(&focused, &Target::Camera, "focus", "distance").unwrap().scene;
        let again = focus_on(&by_distance, point).unwrap().scene;
        assert!(matches!(again.camera.focus, Some(Focus::Distance(_))));
        assert!((distance(&again) - expected).abs() < 1e-3);
        assert!(focus_on(&scene, scene.camera.eye).is_err());
    }

    #[test]
    fn aperture_opens_and_closes_by_stops() {
        let open = |scene: &Scene, stops| change_aperture(scene, stops).unwrap().scene;
        let scene = mirror_room();
        let mut lens = open(&scene, 1.0);
        let first = lens.camera.lens_radius();
        assert!((first / (FIRST_RADIUS * distance(&scene)) - 1.0).abs() < 0.2, "{first}");
        lens = open(&open(&lens, 1.0), 1.0);
        assert!((lens.camera.lens_radius() / first - 2.0).abs() < 0.1);
        assert_eq!(open(&open(&lens, -1.0), -1.0).camera.lens_radius(), first);
        for _ in 0..40 {
            lens = open(&lens, -1.0);
        }
        assert_eq!(lens.camera.aperture, None);
        assert_eq!(open(&lens, -1.0).camera.aperture, None);
        for _ in 0..40 {
            lens = open(&lens, 1.0);
        }
        assert!(lens.camera.lens_radius() <= distance(&lens));
        let by_number = set(&scene, &Target::Camera, "aperture", "f_number").unwrap().scene;
        assert_eq!(by_number.camera.aperture, Some(Aperture::FNumber(2.8)));
        assert_eq!(open(&by_number, 1.0).camera.aperture, Some(Aperture::FNumber(2.0)));
        assert_eq!(open(&by_number, -1.0).camera.aperture, Some(Aperture::FNumber(4.0)));
    }

    #[test]
    fn converted_lenses_keep_the_picture() {
        let scene = mirror_room();
        let set = |scene: &Scene, key, text| set(scene, &Target::Camera, key, text).unwrap().scene;
        let lens = set(&scene, "aperture", "radius");
        assert!(lens.camera.focus.is_none() && lens.camera.lens_radius() > 0.0);
        let by_number = set(&lens, "aperture", "f_number");
        let ratio = by_number.camera.lens_radius() / lens.camera.lens_radius();
        assert!((ratio - 1.0).abs() < 0.01, "{ratio}");
        let by_distance = set(&lens, "focus", "distance");
        let by_point = set(&by_distance, "focus", "point");
        for focused in [&by_distance, &by_point] {
            assert!((distance(focused) / distance(&lens) - 1.0).abs() < 1e-4);
        }
        // A camera whose target is replaced by a direction keeps its focus distance.
        let free = set(&lens, "aim", "direction");
        assert!((distance(&free) / distance(&lens) - 1.0).abs() < 1e-4);
        // A camera without a target gets a plane in focus together with the lens.
        let free = set(&set(&scene, "aim", "direction"), "aperture", "radius");
        assert!(free.camera.focus.is_some());
    }
}
