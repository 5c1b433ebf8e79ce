//! Lights with a size and flat emissive objects that lie exactly on surfaces. They must be visible
//! and light the scene as with a vanishing gap.

use crate::emitters::forms;
use crate::emitters::objects::{mesh, object, rectangle};
use crate::harness::*;

/// Centre of the lamps on ceilings, and their size.
const LAMP: (DVec3, [f64; 2]) = (DVec3::new(0.2, 2.0, 0.1), [1.0, 0.7]);

/// Returns the scene of a camera at `eye` that sees nothing but a small spot around `target`. `rest`
/// is the text of objects and lights; they may have the materials `lamp` (black and emissive),
/// `front` (the same, one-sided), and `black`.
fn look(eye: DVec3, target: DVec3, rest: &str) -> Scene {
    look_through(0.5, eye, target, rest)
}

/// Returns the scene of [`look`] for a camera with the given angle of view in degrees.
fn look_through(degrees: f64, eye: DVec3, target: DVec3, rest: &str) -> Scene {
    parsed(&format!(
        "[film]\nsize = [1, 1]\n\
         [camera]\neye = {}\ntarget = {}\nup = [0.1, 0.2, 0.9]\nview_angle.vertical = {degrees:?}\n\
         [materials.black]\ncolor = [0.0, 0.0, 0.0]\n\
         [materials.lamp]\ncolor = [0.0, 0.0, 0.0]\nemission = 1.0\n\
         [materials.front]\ncolor = [0.0, 0.0, 0.0]\nemission = 1.0\ntwo_sided = false\n{rest}",
        array(eye),
        array(target),
    ))
}

/// Checks lights with a size on an infinite plane: the eye must see them, and they must light a
/// floor. The finite objects of the scene are small and far away from the light, or there are none.
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
                receiver(DVec3::Y, WHITE, &lit),
                irradiance / PI,
            ));
        }
    }
    check_means(&cases, 4096, ROUNDING);
}

/// Returns a box between two corners as six quadrilaterals, counter-clockwise as seen from outside.
fn sides(low: DVec3, high: DVec3) -> Vec<Vec<DVec3>> {
    let corner = |i: usize| {
        let axis = |axis: usize| if i >> axis & 1 == 0 { low[axis] } else { high[axis] };
        DVec3::new(axis(0), axis(1), axis(2))
    };
    [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]]
        .map(|side| side.map(corner).to_vec())
        .into()
}

/// Returns rooms around the origin whose ceiling is in the plane y = 2, as text of shapes.
fn rooms() -> Vec<String> {
    let (low, high) = (DVec3::new(-2.0, -0.25, -1.5), DVec3::new(2.0, 2.0, 1.5));
    let outward = sides(low, high);
    let inward: Vec<Vec<DVec3>> =
        outward.iter().map(|side| side.iter().rev().copied().collect()).collect();
    let without_front: Vec<Vec<DVec3>> = outward[..5].to_vec();
    vec![
        "shape.box = { center = [0.0, 0.875, 0.0], size = [4.0, 2.25, 3.0] }".to_string(),
        "shape.cylinder = { base = [0.0, -0.25, 0.0], top = [0.0, 2.0, 0.0], radius = 2.0 }".to_string(),
        "shape.difference.of = [{ shape.box = { center = [0.0, 1.0, 0.0], size = [6.0, 6.0, 6.0] } }, \
         { shape.box = { center = [0.0, 0.875, 0.0], size = [4.0, 2.25, 3.0] } }]".to_string(),
        "shape.plane = { point = [0.0, 2.0, 0.0], normal = [0.0, -1.0, 0.0] }".to_string(),
        "shape.plane = { point = [0.0, 2.0, 0.0], normal = [0.0, 1.0, 0.0] }".to_string(),
        "shape.platform = { center = [0.0, 2.0, 0.0], size = [4.0, 3.0] }".to_string(),
        // Smaller than the lamp.
        "shape.platform = { center = [0.2, 2.0, 0.1], size = [0.3, 0.3] }".to_string(),
        mesh("room", &outward),
        mesh("inward-room", &inward),
        mesh("open-room", &without_front),
        // Slab above the lamp, seen from outside.
        "shape.box = { center = [0.0, 2.5, 0.0], size = [4.0, 1.0, 3.0] }".to_string(),
        mesh("slab", &sides(DVec3::new(-2.0, 2.0, -1.5), DVec3::new(2.0, 3.0, 1.5))),
    ]
}

#[test]
fn emissive_sheets_on_ceilings_are_visible_and_light_the_room() {
    let (center, size) = LAMP;
    let (text, corners) = rectangle(center, size);
    let quad = mesh("lamp-on-ceiling", std::slice::from_ref(&corners));
    let irradiance = forms::polygon(&corners, DVec3::Y);
    let mut cases = Vec::new();
    for room in rooms() {
        for lamp in [format!("shape.{text}"), quad.clone()] {
            for material in ["lamp", "front"] {
                let (walls, lamp) = (object("black", &room), object(material, &lamp));
                for objects in [walls.clone() + &lamp, lamp + &walls] {
                    let target = center + DVec3::new(0.1, 0.0, 0.05);
                    let eye = DVec3::new(0.3, 0.4, -0.5);
                    cases.push((format!("look: {objects}"), look(eye, target, &objects), 1.0));
                    let lit = receiver(DVec3::Y, WHITE, &objects);
                    cases.push((format!("lit: {objects}"), lit, irradiance / PI));
                }
            }
        }
    }
    check_means(&cases, 4096, ROUNDING);
}

/// Checks that rays which hit an emissive sheet on a ceiling and points sampled on it agree: glossy
/// surfaces, which combine both, reflect as much light as with a visible gap.
#[test]
fn reflections_of_emissive_sheets_on_ceilings_are_the_limit_of_a_gap() {
    let (center, size) = LAMP;
    for (room, roughness) in rooms().into_iter().zip([0.1, 0.5].into_iter().cycle()) {
        let glossy = format!(
            "color = [0.0, 0.0, 0.0]\nreflection = 1.0\nroughness = {roughness:?}\nlobe = \"ggx\""
        );
        let scene = |gap: f64| {
            let (text, _) = rectangle(center - DVec3::Y * gap, size);
            let objects = object("black", &room) + &object("lamp", &format!("shape.{text}"));
            receiver(DVec3::Y, &glossy, &objects)
        };
        means_agree(&room, &scene(0.0), &scene(1e-4), 1 << 14);
    }
}

/// Checks an emissive sheet on the outside of a solid; the eye is outside, too. The sheet must be
/// visible and light the outside. It must also be visible if it faces away from the eye and towards
/// a mirror.
#[test]
fn emissive_sheets_on_the_outside_of_solids_light_the_outside() {
    // Receiver at the origin below the block. The emissive sheet is on the block's lower side, or
    // on its far side (`far_sign`), which a mirror shows.
    let (text, corners) = rectangle(DVec3::new(0.1, 1.0, 0.0), [0.5, 0.3]);
    let far_sign = "shape.rectangle = { center = [0.0, 1.5, -0.5], size = [0.5, 0.3], \
                    normal = [0.0, 0.0, -1.0] }";
    let mirror = "[materials.mirror]\ncolor = [0.0, 0.0, 0.0]\nreflection = 1.0\n\
                  [[object]]\nmaterial = \"mirror\"\n\
                  shape.rectangle = { center = [0.0, 3.0, -2.0], size = [9.0, 9.0], normal = [0.0, 0.0, 1.0] }\n";
    let mut cases = Vec::new();
    for block in [
        "shape.box = { center = [0.0, 1.5, 0.0], size = [1.0, 1.0, 1.0] }".to_string(),
        mesh("block", &sides(DVec3::new(-0.5, 1.0, -0.5), DVec3::new(0.5, 2.0, 0.5))),
    ] {
        for material in ["lamp", "front"] {
            let objects = object("black", &block) + &object(material, &format!("shape.{text}"));
            let lit = forms::polygon(&corners, DVec3::Y) / PI;
            cases.push((
                format!("{material} below {block}"),
                receiver(DVec3::Y, WHITE, &objects),
                lit,
            ));
            let eye = DVec3::new(0.3, 0.1, 0.4);
            cases.push((
                format!("look at {material}"),
                look(eye, corners[0] * 0.3 + corners[2] * 0.7, &objects),
                1.0,
            ));
            // The image of the far sign in the mirror is at z = -3.5.
            let eye = DVec3::new(3.0, 3.0, 2.0);
            let objects = object("black", &block) + &object(material, far_sign) + mirror;
            let image = DVec3::new(0.05, 1.55, -3.5);
            cases.push((format!("{material} behind {block}"), look(eye, image, &objects), 1.0));
        }
    }
    check_means(&cases, 4096, ROUNDING);
}

#[test]
fn emissive_sheets_on_sheets_show_on_the_side_of_the_eye() {
    let lamp = object("lamp", "shape.platform = { center = [0.0, 1.0, 0.0], size = [1.0, 1.0] }");
    let sheet = object("black", "shape.platform = { center = [0.0, 1.0, 0.0], size = [6.0, 6.0] }");
    let mut cases = Vec::new();
    for objects in [lamp.clone() + &sheet, sheet.clone() + &lamp] {
        for eye in [DVec3::new(1.2, 2.4, 4.0), DVec3::new(1.2, 0.2, 1.0)] {
            let target = DVec3::new(0.1, 1.0, 0.2);
            cases.push((format!("look from {eye}: {objects}"), look(eye, target, &objects), 1.0));
        }
        let (_, corners) = rectangle(DVec3::Y, [1.0, 1.0]);
        let lit = forms::polygon(&corners, DVec3::Y) / PI;
        cases.push((format!("lit: {objects}"), receiver(DVec3::Y, WHITE, &objects), lit));
        // The eye is above both sheets. A mirror shows the back of the lower one.
        let below = "[materials.mirror]\ncolor = [0.0, 0.0, 0.0]\nreflection = 1.0\n\
                     [[object]]\nmaterial = \"mirror\"\n\
                     shape.plane = { point = [0.0, 0.0, 0.0], normal = [0.0, 1.0, 0.0] }\n";
        let eye = DVec3::new(0.0, 2.0, 8.0);
        let image = DVec3::new(0.1, -1.0, 0.2);
        let from_below = look(eye, image, &(objects + below));
        cases.push(("back of the lower sheet".to_string(), from_below, 0.0));
    }
    check_means(&cases, 4096, ROUNDING);
}

/// Checks that lamps on tilted ceilings light the room where all coordinates are rounded to nine
/// decimals, as people write them: some lamps are then behind their ceiling.
#[test]
fn lamps_on_tilted_ceilings_with_written_coordinates_light_the_room() {
    let mut numbers = Numbers::new(1);
    for i in 0..40 {
        let written = |v: DVec3| (v * 1e9).round() / 1e9;
        let normal = written((numbers.direction() * 0.4 - DVec3::Y).normalize());
        let center = written(DVec3::Y * 2.0 + numbers.in_cube(0.3));
        let side = normal.any_orthonormal_vector();
        let lamp = array(written(center + side * 0.7 + side.cross(normal) * 0.5));
        let normal = array(normal);
        let rectangle =
            format!("rectangle = {{ center = {lamp}, size = [0.4, 0.3], normal = {normal} }}");
        let ceiling = format!(
            "[[object]]\nmaterial = \"black\"\n\
             shape.rectangle = {{ center = {}, size = [4, 4], normal = {normal} }}\n",
            array(center)
        );
        for lamp in [
            format!("[[light]]\npoint = {{ position = {lamp} }}"),
            format!("[[light]]\n{rectangle}"),
            format!("[[object]]\nmaterial = \"lamp\"\nshape.{rectangle}"),
        ] {
            let scene = receiver(DVec3::Y, WHITE, &format!("{ceiling}{lamp}\n"));
            let lit = [radiance::<Single>(&scene, 64, 1).0, radiance::<Double>(&scene, 64, 1).0];
            assert!(lit.iter().all(|lit| *lit > 1e-3), "{i}: {lit:?} under\n{lamp}\n{ceiling}");
        }
    }
}
