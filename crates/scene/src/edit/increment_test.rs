//! Tests of the arrow keys that step a property's value: round values, steps back, limits.

use crate::Scene;
use crate::edit::{Property, SceneSettings, Target, Widget, outline, rows, set, step, toggle};
use crate::testing::mirror_room;

/// Returns the value of the property `key` as text, after `steps` steps of the arrow keys.
fn after(scene: &Scene, target: &Target, key: &str, steps: f64) -> String {
    let edit = step(scene, target, key, None, steps).unwrap_or_else(|e| panic!("{key}: {e}"));
    value(&edit.scene, target, key)
}

fn value(scene: &Scene, target: &Target, key: &str) -> String {
    row(scene, target, key).value
}

fn row(scene: &Scene, target: &Target, key: &str) -> Property {
    let rows = rows(scene, target).unwrap();
    rows.into_iter().find(|r| r.key == key).unwrap_or_else(|| panic!("no row {key}"))
}

fn with(target: &Target, key: &str, text: &str) -> Scene {
    set(&mirror_room(), target, key, text).unwrap_or_else(|e| panic!("{key} = {text}: {e}")).scene
}

#[test]
fn arrow_steps_of_each_number_kind() {
    let ball = Target::Object(2);
    let red = Target::Material("red".into());
    let lamp = Target::Light(0);
    let [film, trace] = [SceneSettings::Film, SceneSettings::Integrator].map(Target::Settings);
    for (target, key, from, steps, to) in [
        (&ball, "shape.sphere.radius", "0.5", 1.0, "0.64"),
        (&ball, "shape.sphere.radius", "0.5", -1.0, "0.4"),
        (&ball, "shape.sphere.radius", "0.5", 0.1, "0.53"),
        (&ball, "shape.sphere.radius", "0.5", -0.1, "0.48"),
        (&ball, "shape.sphere.radius", "0.34", 1.0, "0.4"),
        (&ball, "shape.sphere.radius", "0.34", -1.0, "0.32"),
        (&ball, "shape.sphere.radius", "1", -0.1, "0.95"),
        (&ball, "shape.sphere.radius", "0.95", 0.1, "1"),
        (&ball, "shape.sphere.radius", "1", -1.0, "0.8"),
        (&ball, "shape.sphere.radius", "0.8", 1.0, "1"),
        (&ball, "shape.sphere.radius", "0.35", 3.0, "0.64"),
        (&ball, "shape.sphere.radius", "1e9", 1.0, "1e9"),
        (&ball, "shape.sphere.center", "0.35 0 -1", 1.0, "0.45, 0.1, -0.9"),
        (&ball, "shape.sphere.center", "1.33094 0 0", 0.1, "1.3409, 0.01, 0.01"),
        (&Target::Camera, "view_angle.vertical", "40", 1.0, "45"),
        (&Target::Camera, "view_angle.vertical", "40", -0.1, "39.5"),
        (&Target::Camera, "view_angle.vertical", "179", 1.0, "179.5"),
        (&Target::Camera, "near", "0", 1.0, "0.01"),
        (&Target::Object(3), "shape.cube.rotation", "30", 1.0, "35"),
        (&red, "diffuse", "0.65", 1.0, "0.7"),
        (&red, "diffuse", "0.65", -0.1, "0.645"),
        (&red, "diffuse", "0.02", -1.0, "0"),
        (&red, "roughness", "0", 0.1, "0.01"),
        (&red, "roughness", "0.01", -0.1, "0"),
        (&red, "roughness", "0.02", 1.0, "0.025"),
        (&red, "exponent", "60", 1.0, "64"),
        (&red, "exponent", "0", 1.0, "1"),
        (&red, "color", "0.8 0.4 0", 1.0, "0.85, 0.425, 0"),
        (&red, "color", "0 0 0", 1.0, "0.05, 0.05, 0.05"),
        (&red, "color", "0.02 0.01 0", -1.0, "0.005, 0.0025, 0"),
        (&lamp, "intensity", "40", 1.0, "50"),
        (&lamp, "intensity", "0", 1.0, "0.01"),
        (&lamp, "intensity", "0.01", -1.0, "0"),
        (&lamp, "color", "4 2 1", 1.0, "5, 2.5, 1.25"),
        (&trace, "max_depth", "16", 0.1, "17"),
        (&trace, "max_depth", "16", 1.0, "26"),
        (&trace, "max_depth", "3", -1.0, "0"),
        (&film, "rays_per_pixel", "0", 1.0, "1"),
        (&film, "rays_per_pixel", "64", 1.0, "128"),
        (&film, "rays_per_pixel", "1", -1.0, "0"),
        (&film, "size", "640 480", 1.0, "1280, 960"),
        (&film, "size", "640 480", -0.1, "624, 468"),
        (&film, "size", "8192 8192", 1.0, "16384, 16384"),
        (&film, "size", "16384 16384", 1.0, "16384, 16384"),
    ] {
        let scene = with(target, key, from);
        assert_eq!(after(&scene, target, key, steps), to, "{key} {from} {steps:+}");
    }
}

#[test]
fn arrow_step_of_one_component() {
    let ball = Target::Object(2);
    let edit = step(&mirror_room(), &ball, "shape.sphere.center", Some(2), -1.0).unwrap();
    assert_eq!(value(&edit.scene, &ball, "shape.sphere.center"), "-0.9, 0.5, -0.1");
    let film = Target::Settings(SceneSettings::Film);
    let edit = step(&mirror_room(), &film, "size", Some(0), 0.1).unwrap();
    assert_eq!(value(&edit.scene, &film, "size"), "641, 480");
    assert!(step(&mirror_room(), &ball, "shape.sphere.center", Some(3), 1.0).is_err());
    let mirror = Target::Object(1);
    let flat = with(&mirror, "shape.rectangle.normal", "0.05 0 0");
    let edit = step(&flat, &mirror, "shape.rectangle.normal", Some(0), -1.0).unwrap();
    assert_ne!(value(&edit.scene, &mirror, "shape.rectangle.normal"), "0, 0, 0");
}

#[test]
fn increment_ladders_are_reversible_and_round() {
    let ball = Target::Object(2);
    let key = "shape.sphere.radius";
    for width in [1.0, 0.1] {
        let mut scene = with(&ball, key, "1");
        let mut way = vec![value(&scene, &ball, key)];
        for _ in 0..500 {
            scene = step(&scene, &ball, key, None, -width).unwrap().scene;
            let text = value(&scene, &ball, key);
            let digits = text.split('e').next().unwrap().trim_matches(['0', '.']).len();
            assert!(digits <= 3, "{text}");
            way.push(text);
            let fits = text_to(&way[way.len() - 1]) / text_to(&way[way.len() - 2]);
            assert!(fits < 0.9999 && fits > 0.77, "{way:?}");
            if text_to(&way[way.len() - 1]) < 1e-4 {
                break;
            }
        }
        for expected in way.iter().rev().skip(1) {
            scene = step(&scene, &ball, key, None, width).unwrap().scene;
            assert_eq!(value(&scene, &ball, key), *expected);
        }
    }
}

fn text_to(text: &str) -> f64 {
    text.parse().unwrap()
}

#[test]
fn arrow_step_of_missing_key_starts_from_default() {
    let red = Target::Material("red".into());
    let scene = with(&red, "roughness", "0.2");
    // The step starts at the default, roughness / (2 sqrt 2) = 0.2 / (2 sqrt 2) = 0.0707.
    assert_eq!(after(&scene, &red, "alpha", 1.0), "0.08");
    assert_eq!(after(&scene, &red, "f0", -1.0), "0.95, 0.95, 0.95");
}

/// Checks that the scene stays valid when any number of any property is changed by many arrow
/// steps, up or down. Steps of 50 rungs reach the ends of all ranges.
#[test]
fn arrow_steps_stop_at_range_ends() {
    let scene = mirror_room();
    for (_, target) in outline(&scene) {
        for row in rows(&scene, &target).unwrap() {
            if !matches!(row.widget, Widget::Numbers | Widget::Color) {
                continue;
            }
            for component in std::iter::once(None).chain((0..row.components.len()).map(Some)) {
                for (steps, times) in
                    [(1.0, 5), (-1.0, 5), (0.1, 3), (-0.1, 3), (50.0, 100), (-50.0, 100)]
                {
                    let mut now = scene.clone();
                    for _ in 0..times {
                        let edit = step(&now, &target, &row.key, component, steps);
                        let edit = edit.unwrap_or_else(|e| panic!("{target:?} {}: {e}", row.key));
                        let at_the_end = edit.scene == now;
                        now = edit.scene;
                        if at_the_end {
                            break;
                        }
                    }
                    assert_eq!(now.faults(), []);
                }
            }
        }
    }
}

#[test]
fn choices_cycle() {
    let red = Target::Material("red".into());
    let mut scene = mirror_room();
    let mut seen = Vec::new();
    for _ in 0..5 {
        scene = toggle(&scene, &red, "metal", true).unwrap().scene;
        seen.push(value(&scene, &red, "metal"));
    }
    assert_eq!(seen, ["gold", "silver", "copper", "iron", ""]);
    assert_eq!(scene, mirror_room());
    let edit = toggle(&scene, &red, "metal", false).unwrap();
    assert_eq!(value(&edit.scene, &red, "metal"), "iron");
    let ball = Target::Object(2);
    let edit = toggle(&scene, &ball, "material", true).unwrap();
    assert_eq!(edit.scene.objects[2].material, "yellow");
    let edit = toggle(&scene, &ball, "shape", true).unwrap();
    assert_eq!(edit.scene.objects[2].shape.key(), "cube");
    let edit = toggle(&scene, &Target::Light(0), "kind", true).unwrap();
    assert_eq!(edit.scene.lights[0].kind.key(), "directional");
    let edit = toggle(&scene, &Target::Camera, "aim", false).unwrap();
    assert!(edit.scene.camera.direction.is_some());
    let edit = toggle(&scene, &Target::Light(0), "on", true).unwrap();
    assert!(!edit.scene.lights[0].on);
    // An arrow step of a key with choices sets the next choice, as `toggle` does.
    let edit = step(&scene, &Target::Light(0), "falloff", None, 1.0).unwrap();
    assert_eq!(value(&edit.scene, &Target::Light(0), "falloff"), "inverse-square");
    assert!(toggle(&scene, &ball, "name", true).is_err());
}
