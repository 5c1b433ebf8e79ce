//! Light of emissive objects: closed forms, agreement with lights of the same size, white furnaces.

use crate::emitters::forms;
use crate::harness::*;

pub fn object(material: &str, shape: &str) -> String {
    format!("[[object]]\nmaterial = \"{material}\"\n{shape}\n")
}

/// Returns a horizontal rectangle that faces down: its description as a shape or a light, and its
/// corners.
pub fn rectangle(center: DVec3, [width, depth]: [f64; 2]) -> (String, Vec<DVec3>) {
    let corner = |x: f64, z: f64| center + DVec3::new(x * width, 0.0, z * depth);
    let text = format!(
        "rectangle = {{ center = {}, size = [{width:?}, {depth:?}], normal = [0.0, -1.0, 0.0], \
         up = [0.0, 0.0, 1.0] }}",
        array(center)
    );
    (text, [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)].map(|(x, z)| corner(x, z)).into())
}

/// Returns 6 x 6 equal pieces of the rectangle with the given corners. A mesh of the pieces has 72
/// triangles.
fn pieces(corners: &[DVec3]) -> Vec<Vec<DVec3>> {
    let (u, v) = ((corners[1] - corners[0]) / 6.0, (corners[3] - corners[0]) / 6.0);
    let corner = |i: u32, j: u32| corners[0] + u * f64::from(i) + v * f64::from(j);
    let squares = (0..6).flat_map(|i| (0..6).map(move |j| (i, j)));
    let piece =
        |(i, j)| vec![corner(i, j), corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1)];
    squares.map(piece).collect()
}

/// Writes `polygons` to an OBJ file. Returns the description of the shape that uses the file.
pub fn mesh(name: &str, polygons: &[Vec<DVec3>]) -> String {
    let folder = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join("emissive-objects");
    fs::create_dir_all(&folder).unwrap();
    let path = folder.join(format!("{name}.obj"));
    let (mut vertices, mut faces, mut count) = (String::new(), String::new(), 0);
    for polygon in polygons {
        faces += "f";
        for corner in polygon {
            count += 1;
            vertices += &format!("v {:?} {:?} {:?}\n", corner.x, corner.y, corner.z);
            faces += &format!(" {count}");
        }
        faces += "\n";
    }
    // Another test may read the file at the same time.
    let draft = folder.join(format!("{name}-{:?}", std::thread::current().id()));
    fs::write(&draft, vertices + &faces).unwrap();
    fs::rename(&draft, &path).unwrap();
    format!("shape.mesh = {{ file = {:?}, normals = \"flat\" }}", path.to_str().unwrap())
}

#[test]
fn irradiance_of_emissive_objects_is_that_of_lights_of_the_same_size() {
    let mut cases = Vec::new();
    let mut case = |name: String, normal: DVec3, rest: String, irradiance: f64| {
        cases.push((name, receiver(normal, WHITE, &rest), irradiance / PI));
    };
    for (i, (center, size)) in [
        (DVec3::Y, [1.0, 0.7]),
        (DVec3::new(1.5, 0.3, 0.2), [1.0, 2.0]),
        (DVec3::Y * 30.0, [1.0; 2]),
    ]
    .into_iter()
    .enumerate()
    {
        let (text, corners) = rectangle(center, size);
        let expected = forms::polygon(&corners, DVec3::Y);
        for material in ["lamp", "front"] {
            let shape = object(material, &format!("shape.{text}"));
            case(format!("{material} rectangle {i}"), DVec3::Y, shape, expected);
            let two = mesh(&format!("rectangle-{i}"), std::slice::from_ref(&corners));
            case(format!("{material} mesh {i}"), DVec3::Y, object(material, &two), expected);
            let many = mesh(&format!("pieces-{i}"), &pieces(&corners));
            case(format!("{material} pieces {i}"), DVec3::Y, object(material, &many), expected);
        }
        // A mesh with the same corners in the opposite order faces away from the receiver.
        let away: Vec<DVec3> = corners.iter().rev().copied().collect();
        let away = mesh(&format!("away-{i}"), &[away]);
        case(format!("back of mesh {i}"), DVec3::Y, object("lamp", &away), expected);
        case(format!("black back of mesh {i}"), DVec3::Y, object("front", &away), 0.0);
        // The front of a mesh stays the front if a transform mirrors the mesh.
        let image = corners.iter().rev().map(|p| DVec3::new(-p.x, p.y, p.z)).collect();
        let mirrored = object("front", &mesh(&format!("mirrored-{i}"), &[image]));
        let mirrored = mirrored + "transform = [{ scale = [-1.0, 1.0, 1.0] }]\n";
        case(format!("mirrored mesh {i}"), DVec3::Y, mirrored, expected);
        // A rectangle that is rotated and then stretched becomes a parallelogram.
        let stretched = DVec3::new(2.0, 1.0, 1.0);
        let rotation = DMat3::from_rotation_y(30f64.to_radians());
        let sheared: Vec<DVec3> = corners.iter().map(|p| stretched * (rotation * *p)).collect();
        let shape = object("front", &format!("shape.{text}"))
            + "transform = [{ rotate_y = 30.0 }, { scale = [2.0, 1.0, 1.0] }]\n";
        let irradiance = forms::polygon(&sheared, DVec3::Y);
        case(format!("parallelogram {i}"), DVec3::Y, shape, irradiance);
        let up = DVec3::new(0.48, 0.6, 0.64);
        let sphere = format!("shape.sphere = {{ center = {}, radius = 0.2 }}", array(center));
        for material in ["lamp", "front"] {
            let expected = forms::sphere(center, 0.2, up);
            case(format!("{material} sphere {i}"), up, object(material, &sphere), expected);
        }
    }
    // The receiver sees one, two or three faces of the box.
    for center in [DVec3::Y, DVec3::new(1.5, 1.0, 0.0), DVec3::new(1.5, 0.9, 1.4)] {
        let half = DVec3::new(0.25, 0.2, 0.3);
        let mut expected = 0.0;
        for axis in 0..3 {
            for sign in [-1.0, 1.0] {
                let mut normal = DVec3::ZERO;
                normal[axis] = sign;
                let middle = center + normal * half;
                if middle.dot(normal) >= 0.0 {
                    continue;
                }
                let (mut u, mut v) = (DVec3::ZERO, DVec3::ZERO);
                u[(axis + 1) % 3] = half[(axis + 1) % 3];
                v[(axis + 2) % 3] = half[(axis + 2) % 3];
                let corners = [middle - u - v, middle + u - v, middle + u + v, middle - u + v];
                expected += forms::polygon(&corners, DVec3::Y);
            }
        }
        let shape =
            format!("shape.box = {{ center = {}, size = {} }}", array(center), array(2.0 * half));
        for material in ["lamp", "front"] {
            case(
                format!("{material} box at {center}"),
                DVec3::Y,
                object(material, &shape),
                expected,
            );
        }
    }
    check_means(&cases, 1 << 15, ROUNDING);
}

#[test]
fn box_lights_nothing_behind_the_surface_that_it_stands_on() {
    let rotated = "transform = [{ rotate_y = 30.0 }]\n";
    let lamp = object("lamp", "shape.box = { center = [0.1, 1.25, 0.0], size = [0.4, 0.5, 0.3] }");
    let floors = [
        "shape.platform = { center = [0.0, 1.0, 0.0], size = [3.0, 3.0] }",
        "shape.plane = { point = [0.0, 1.0, 0.0], normal = [0.0, 1.0, 0.0] }",
        "shape.plane = { point = [0.0, 1.0, 0.0], normal = [0.0, -1.0, 0.0] }",
        "shape.box = { center = [0.0, 0.0, 0.0], size = [3.0, 2.0, 3.0] }",
        "shape.cylinder = { base = [0.0, -1.0, 0.0], top = [0.0, 1.0, 0.0], radius = 2.0 }",
    ];
    let dark = floors.map(|floor| {
        let rest = object("black", floor) + rotated + &lamp + rotated;
        (floor.to_string(), receiver(DVec3::Y, WHITE, &rest), 0.0)
    });
    check_means(&dark, 4096, ROUNDING);
    let (_, corners) = rectangle(DVec3::new(0.1, 1.0, 0.0), [0.4, 0.3]);
    // A floor that is smaller than the face covers a part of it.
    let small = "shape.platform = { center = [0.1, 1.0, 0.0], size = [0.2, 0.1] }";
    let (_, covered) = rectangle(DVec3::new(0.1, 1.0, 0.0), [0.2, 0.1]);
    let seen = forms::polygon(&corners, DVec3::Y) - forms::polygon(&covered, DVec3::Y);
    let partly = receiver(DVec3::Y, WHITE, &(object("black", small) + &lamp));
    check_means(&[("a part of the face".to_string(), partly, seen / PI)], 1 << 14, ROUNDING);
    // Shadow rays end at glass, even if the glass stands on the lamp.
    let glass = "[materials.glass]\ncolor = [0.0, 0.0, 0.0]\ntransmission = 1.0\n".to_string();
    let block = "shape.box = { center = [0.0, 0.0, 0.0], size = [1.0, 1.0, 1.0] }";
    let inside = [
        "shape.platform = { center = [0.0, -0.5, 0.0], size = [3.0, 3.0] }",
        "shape.box = { center = [0.0, -1.0, 0.0], size = [3.0, 1.0, 3.0] }",
        "shape.box = { center = [0.3, -1.0, 0.2], size = [0.8, 1.0, 0.9] }",
    ]
    .map(|shape| {
        let rest = glass.clone() + &object("glass", block) + &object("lamp", shape);
        (format!("glass on {shape}"), receiver(DVec3::NEG_Y, WHITE, &rest), 0.0)
    });
    check_means(&inside, 4096, ROUNDING);
    // The lamp's lower face is in the plane of a rotated square. The face is within the square's
    // bounding box, but beside the square.
    let beside =
        object("lamp", "shape.box = { center = [1.8, 1.05, 0.6], size = [0.1, 0.1, 0.1] }");
    let square =
        object("black", "shape.platform = { center = [0.0, 0.0, 0.0], size = [1.0, 1.0] }")
            + "transform = [{ rotate_y = 45.0 }, { translate = [1.2, 1.0, 0.0] }]\n";
    let alone = receiver(DVec3::Y, WHITE, &beside);
    let with_square = receiver(DVec3::Y, WHITE, &(square + &beside));
    means_agree("box beside a square", &alone, &with_square, 4096);
}

#[test]
fn back_of_a_flat_emissive_object_follows_two_sided() {
    let (text, corners) = rectangle(DVec3::Y, [1.0, 0.7]);
    let upward = text.replace("normal = [0.0, -1.0, 0.0]", "normal = [0.0, 1.0, 0.0]");
    let expected = forms::polygon(&corners, DVec3::Y) / PI;
    let scene =
        |material: &str| receiver(DVec3::Y, WHITE, &object(material, &format!("shape.{upward}")));
    let cases = [
        ("two-sided".to_string(), scene("lamp"), expected),
        ("one-sided".to_string(), scene("front"), 0.0),
    ];
    check_means(&cases, 1 << 14, ROUNDING);
}

#[test]
fn reflection_of_emissive_objects_is_that_of_lights_of_the_same_size() {
    let center = DVec3::new(0.15, 0.7, 0.0);
    let (text, corners) = rectangle(center, [0.6, 0.4]);
    let two = mesh("reflected", std::slice::from_ref(&corners));
    let many = mesh("reflected-pieces", &pieces(&corners));
    let sphere = format!("sphere = {{ center = {}, radius = 0.25 }}", array(center));
    for lobe in ["cone", "square", "beckmann", "ggx"] {
        for roughness in [0.05, 0.5] {
            let mirror = format!(
                "color = [0.0, 0.0, 0.0]\nreflection = 1.0\nroughness = {roughness:?}\nlobe = \"{lobe}\""
            );
            let light = |shape: &str| receiver(DVec3::Y, &mirror, &format!("[[light]]\n{shape}\n"));
            let lamp = |shape: &str| receiver(DVec3::Y, &mirror, &object("lamp", shape));
            let name = format!("{lobe} {roughness}");
            means_agree(&name, &light(&text), &lamp(&format!("shape.{text}")), 1 << 14);
            means_agree(&name, &light(&text), &lamp(&two), 1 << 14);
            means_agree(&name, &light(&text), &lamp(&many), 1 << 14);
            means_agree(&name, &light(&sphere), &lamp(&format!("shape.{sphere}")), 1 << 14);
        }
    }
}

#[test]
fn inside_of_an_emissive_sphere_has_shadows() {
    // A black square above the receiver, larger than the sphere.
    let cover =
        object("black", "shape.platform = { center = [0.0, 0.5, 0.0], size = [100.0, 100.0] }");
    let wall = object("lamp", "shape.sphere = { center = [0.0, 0.0, 0.0], radius = 2.0 }");
    let scene = receiver(DVec3::Y, WHITE, &(cover + &wall));
    // The receiver sees the wall below the cover. This is a band of directions from the horizon up
    // to the elevation of the circle in which the cover cuts the sphere.
    let cos2 = 0.25 / 4.0;
    check_means(&[("band".to_string(), scene, cos2)], 1 << 15, [1e-3, 1e-6]);
}

/// Checks that a glowing glass ball inside a glass listed later, which hides it, lights nothing.
#[test]
fn hidden_glowing_glass_lights_nothing_inside_the_glass_that_hides_it() {
    let scene = parsed(
        "film.size = [8, 6]
         camera = { eye = [0, 0.2, 1.5], target = [0, -0.3, 0], view_angle.vertical = 40 }
         [materials.glowing]\ncolor = [0, 0, 0]\nambient = 0\nemission = 3\ntransmission = 1
         [materials.glass]\nambient = 0\ndiffuse = 0\ntransmission = 1\nior = 1.5
         [[object]]\nmaterial = \"glowing\"\nshape.sphere = { center = [0, 0.5, 0], radius = 0.3 }
         [[object]]\nshape.box = { center = [0, -0.5, 0], size = [1, 0.5, 1] }
         [[object]]\nmaterial = \"glass\"\nshape.sphere = { center = [0, 0, 0], radius = 3 }",
    );
    assert!(samples::<Single>(&scene, 16).iter().all(|sample| *sample == [0.0; 3]));
    let mut shown = scene.clone();
    shown.objects.rotate_right(1);
    assert!(samples::<Single>(&shown, 16).iter().any(|sample| sample[0] > 0.0));
}
