//! Lights with a size that lie exactly on surfaces. They must be visible and light the scene as with
//! a vanishing gap.

use crate::emitters::forms;
use crate::emitters::objects::{MATT, ROUNDING, object, receiver, rectangle};
use crate::emitters::setup::{array, check, scene};
use glam::DVec3;
use std::f64::consts::PI;
use zerkalo::scene::Scene;

/// Returns the scene of a camera at `eye` that sees nothing but a small spot around `target`. `rest`
/// is the text of objects and lights; they may have the materials `lamp` (black and emissive),
/// `front` (the same, one-sided), and `black`.
fn look_through(degrees: f64, eye: DVec3, target: DVec3, rest: &str) -> Scene {
    scene(&format!(
        "[film]\nsize = [1, 1]\n\
         [camera]\neye = {}\ntarget = {}\nup = [0.1, 0.2, 0.9]\nview_angle.vertical = {degrees:?}\n\
         [materials.black]\ncolor = [0.0, 0.0, 0.0]\n\
         [materials.lamp]\ncolor = [0.0, 0.0, 0.0]\nemission = 1.0\n\
         [materials.front]\ncolor = [0.0, 0.0, 0.0]\nemission = 1.0\ntwo_sided = false\n{rest}",
        array(eye),
        array(target),
    ))
}

/// Checks lights with a size on an infinite plane: the eye sees them, and they light a floor. The
/// finite objects of the scene are small and far away from the light, or there are none.
#[test]
fn lights_on_planes_are_visible_and_light_the_scene() {
    let mut cases = Vec::new();
    for (height, size) in [(1.0, 0.5), (2.3, 0.5), (64.0, 0.5), (333.3, 2.0), (1000.0, 0.5)] {
        let ceiling = format!(
            "[[object]]\nmaterial = \"black\"\n\
             shape.plane = {{ point = [0.0, {height:?}, 0.0], normal = [0.0, -1.0, 0.0] }}\n"
        );
        let ball = object("black", "shape.sphere = { center = [0.1, -0.4, 0.2], radius = 0.3 }");
        let center = DVec3::new(0.2 * height, height, -0.3 * height);
        let (text, corners) = rectangle(center, [size, size]);
        let disk = format!(
            "disk = {{ center = {}, radius = {:?}, normal = [0.0, -1.0, 0.0] }}",
            array(center),
            0.5 * size
        );
        let sphere = format!(
            "sphere = {{ center = {}, radius = {:?} }}",
            array(center - DVec3::Y * size),
            size
        );
        for objects in [ceiling.clone(), ceiling.clone() + &ball] {
            for (light, middle) in
                [(&text, center), (&disk, center), (&sphere, center - DVec3::Y * size)]
            {
                let target = middle + DVec3::X * (0.1 * size);
                let eye = DVec3::new(1.0, 0.6, 1.2);
                let degrees = (0.05 * size / height).to_degrees();
                let lit = format!("{objects}[[light]]\n{light}\n");
                let view = look_through(degrees, eye, target, &lit);
                cases.push((format!("{light} at {height}"), view, 1.0));
            }
            let lit = format!("{objects}[[light]]\n{text}\n");
            let irradiance = forms::polygon(&corners, DVec3::Y);
            cases.push((
                format!("floor below {text}"),
                receiver(DVec3::Y, MATT, &lit),
                irradiance / PI,
            ));
        }
    }
    check(&cases, 4096, ROUNDING);
}
