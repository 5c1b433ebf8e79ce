//! Irradiance by spheres, rectangles and disks on diffuse surfaces, with and without an occluder.

use crate::emitters::forms;
use crate::harness::*;

/// Returns the scene of a white diffuse receiver that is lit by the light `light`, which the camera
/// does not see. `rest` is the text of further objects.
fn lit(normal: DVec3, light: &str, rest: &str) -> Scene {
    receiver(normal, WHITE, &format!("[[light]]\nvisible = false\n{light}\n{rest}"))
}

/// Returns name, scene, and expected radiance of the receiver, which is `irradiance` / pi.
fn case(name: String, scene: Scene, irradiance: f64) -> (String, Scene, f64) {
    (name, scene, irradiance / PI)
}

#[test]
fn irradiance_of_a_sphere_light_is_the_closed_form() {
    let mut cases = Vec::new();
    for distance in [1.001, 1.1, 2.0, 10.0, 1000.0] {
        // Angle between the receiver's normal and the direction to the sphere's centre. At 90
        // degrees half of the sphere is below the horizon of the receiver.
        for degrees in [0.0, 40.0, 80.0, 90.0, 95.0, 120.0f64] {
            let (sin, cos) = degrees.to_radians().sin_cos();
            let (normal, radius) = (DVec3::new(0.36, 0.48, 0.8), 0.5);
            let center = (normal * cos + normal.any_orthonormal_vector() * sin) * distance * radius;
            let light = format!("sphere = {{ center = {}, radius = {radius} }}", array(center));
            cases.push(case(
                format!("{distance} radii away at {degrees} degrees"),
                lit(normal, &light, ""),
                forms::sphere(center, radius, normal),
            ));
        }
    }
    check_means(&cases, 1 << 15, ROUNDING);
}

/// Returns the description of a rectangular light, and its corners.
fn rectangle(center: DVec3, size: [f64; 2], normal: DVec3) -> (String, Vec<DVec3>) {
    let up = normal.any_orthonormal_vector();
    let across = up.cross(normal);
    let corner = |x: f64, y: f64| center + across * (x * size[0]) + up * (y * size[1]);
    let text = format!(
        "rectangle = {{ center = {}, size = {size:?}, normal = {}, up = {} }}",
        array(center),
        array(normal),
        array(up)
    );
    (text, [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)].map(|(x, y)| corner(x, y)).into())
}

#[test]
fn irradiance_of_a_rectangle_light_is_lamberts_formula() {
    let mut cases = Vec::new();
    let normal = DVec3::new(0.48, 0.6, 0.64);
    let across = normal.any_orthonormal_vector();
    for (center, size) in [
        (normal * 0.5, [1.0, 1.0]),
        (normal * 0.001, [1.0, 3.0]),
        (normal + across * 2.0, [2.0, 0.5]),
        (normal * 30.0 + across * 5.0, [1.0, 1.0]),
        (normal * 0.4 + across * 3.0, [4.0, 4.0]),
        // Half of this light is below the receiver's horizon.
        (across * 0.7, [1.0, 0.6]),
        (normal * 2.0, [1e4, 1e4]),
    ] {
        for tilt in [0.0, 0.7, 2.0f64] {
            let towards = -normal * tilt.cos() - across * tilt.sin();
            if center.dot(towards) >= 0.0 {
                continue;
            }
            let (light, corners) = rectangle(center, size, towards);
            cases.push(case(
                format!("{center}, {size:?}, tilt {tilt}"),
                lit(normal, &light, ""),
                forms::polygon(&corners, normal),
            ));
        }
    }
    assert!(cases.len() > 12);
    check_means(&cases, 1 << 15, ROUNDING);
}

#[test]
fn irradiance_of_a_disk_light_is_the_closed_form() {
    let mut cases = Vec::new();
    for height in [0.3, 1.0, 20.0] {
        for aside in [0.0, 0.5, 1.0, 4.0] {
            let (normal, radius) = (DVec3::Y, 0.8);
            let center = DVec3::new(aside, height, 0.0);
            let light = format!(
                "disk = {{ center = {}, radius = {radius}, normal = [0.0, -1.0, 0.0] }}",
                array(center)
            );
            let expected = forms::parallel_disk(radius, height, aside);
            let name = format!("height {height}, {aside} aside");
            cases.push(case(name, lit(normal, &light, ""), expected));
        }
    }
    check_means(&cases, 1 << 15, ROUNDING);
}

#[test]
fn flat_lights_shine_from_one_side_only() {
    for shape in ["rectangle = { size = [1.0, 1.0], ", "disk = { radius = 1.0, "] {
        for (normal, front) in [(-1.0, true), (1.0, false)] {
            let light =
                format!("{shape}center = [0.0, 1.0, 0.0], normal = [0.0, {normal:?}, 0.0] }}");
            let scene = lit(DVec3::Y, &light, "");
            let (mean, _) = radiance::<Single>(&scene, 64, 1);
            assert_eq!(mean > 0.0, front, "{light}");
        }
    }
}

/// Checks the penumbra of a black half-plane at height 1, whose straight edge is below the light.
/// The receiver sees the part of the light on one side of the plane through the receiver and the
/// edge.
#[test]
fn penumbra_of_a_straight_edge_is_the_visible_part_of_the_light() {
    let (light, corners) = rectangle(DVec3::Y * 2.0, [1.0, 0.7], -DVec3::Y);
    let mut cases: Vec<_> = [-0.45, -0.3, -0.15, 0.0, 0.1, 0.24, 0.4]
        .map(|edge| {
            let cover = format!(
                "[[object]]\nmaterial = \"black\"\n\
                 shape.platform = {{ center = [{:?}, 1.0, 0.0], size = [20.0, 20.0] }}\n",
                edge - 10.0
            );
            // Directions to the light with x / y > edge pass.
            let plane = DVec3::new(1.0, -edge, 0.0);
            let expected = forms::polygon(&forms::clipped(&corners, plane), DVec3::Y);
            case(format!("edge at {edge}"), lit(DVec3::Y, &light, &cover), expected)
        })
        .into();
    // A light in a ceiling.
    let ceiling = "[[object]]\nmaterial = \"black\"\n\
                   shape.platform = { center = [0.0, 2.0, 0.0], size = [20.0, 20.0] }\n";
    let expected = forms::polygon(&corners, DVec3::Y);
    cases.push(case("ceiling".into(), lit(DVec3::Y, &light, ceiling), expected));
    check_means(&cases, 1 << 15, ROUNDING);
}

/// Returns the description of a sun that shines downwards with an angular diameter in degrees.
fn sun(angle: f64) -> String {
    format!("directional = {{ direction = [0.0, -1.0, 0.0], angle = {angle:?} }}")
}

/// Checks that the irradiance by a sun depends on its angular diameter only where the horizon of the
/// receiver cuts it. It is then that of a sphere of the same angular diameter and radiance.
#[test]
fn irradiance_of_a_sun_is_independent_of_its_angle() {
    let mut cases = Vec::new();
    for angle in [0.01, 0.53, 10.0, 90.0, 180.0f64] {
        let sin = (0.5 * angle).to_radians().sin();
        for tilt in [0.0, 40.0, 60.0, 88.0, 95.0f64] {
            let (x, y) = tilt.to_radians().sin_cos();
            let normal = DVec3::new(x, y, 0.0);
            let expected = match tilt + 0.5 * angle <= 90.0 {
                true => PI * y,
                false => forms::sphere(DVec3::Y, sin.min(1.0 - 1e-12), normal) / (sin * sin),
            };
            let name = format!("{angle} degrees at {tilt}");
            cases.push(case(name, lit(normal, &sun(angle), ""), expected));
        }
    }
    check_means(&cases, 1 << 15, ROUNDING);
}

/// Checks the penumbra of a black half-plane that faces the sun. The receiver sees the part of a disk
/// beyond a chord, at the same fraction of the penumbra for every distance of the half-plane: its
/// width grows with the distance.
#[test]
fn penumbra_of_a_sun_is_the_part_of_a_disk_beyond_a_chord() {
    let mut cases = Vec::new();
    for (angle, height) in [(0.53, 1.0), (0.53, 7.0), (2.0, 1.0), (2.0, 0.1)] {
        for chord in [-1.1, -0.8, -0.5, 0.0, 0.25, 0.6, 0.9, 1.1f64] {
            let edge = chord * height * (0.5f64 * angle).to_radians().tan();
            let cover = format!(
                "[[object]]\nmaterial = \"black\"\n\
                 shape.platform = {{ center = [{:?}, {height:?}, 0.0], size = [20.0, 20.0] }}\n",
                edge - 10.0
            );
            let cut = chord.clamp(-1.0, 1.0);
            let visible = (cut.acos() - cut * (1.0 - cut * cut).sqrt()) / PI;
            let name = format!("{angle} degrees, edge at {chord} of the penumbra, height {height}");
            cases.push(case(name, lit(DVec3::Y, &sun(angle), &cover), PI * visible));
        }
    }
    // Straight edges are chords of the disk if its angle is small.
    check_means(&cases, 1 << 14, [1e-3, 1e-3]);
}

/// Checks that the irradiance by a light of 1 W does not depend on the light's size. A faraway
/// sphere acts like a point light of 1 / (4 pi) W/sr. A flat light acts along its normal like a
/// point light of 1 / pi W/sr.
#[test]
fn power_is_independent_of_the_size() {
    let mut cases = Vec::new();
    for radius in [0.001, 0.1, 1.0] {
        for (kind, intensity) in
            [("sphere = { ", 0.25 / PI), ("disk = { normal = [0.0, -1.0, 0.0], ", 1.0 / PI)]
        {
            let light = format!(
                "unit = \"power\"\n{kind}center = [0.0, 1000.0, 0.0], radius = {radius:?} }}"
            );
            let name = format!("{kind} {radius}");
            cases.push(case(name, lit(DVec3::Y, &light, ""), intensity * 1e-6));
        }
    }
    check_means(&cases, 1 << 10, [1e-4, 1e-5]);
}

/// Checks lights that touch the receiver's surface, and lights far larger or smaller than the
/// scene.
#[test]
fn tiny_and_huge_lights_keep_their_irradiance() {
    let mut cases = Vec::new();
    for radius in [1e-7, 1e-6, 1e-3, 1e3, 1e6] {
        let center = DVec3::Y * f64::max(2.0 * radius, 1.0);
        let light = format!("sphere = {{ center = {}, radius = {radius:?} }}", array(center));
        let expected = forms::sphere(center, radius, DVec3::Y);
        cases.push(case(format!("sphere of radius {radius}"), lit(DVec3::Y, &light, ""), expected));
        let (light, corners) = rectangle(DVec3::Y, [radius, radius], -DVec3::Y);
        let expected = forms::polygon(&corners, DVec3::Y);
        let name = format!("square of side {radius}");
        cases.push(case(name, lit(DVec3::Y, &light, ""), expected));
    }
    // A sphere that rests on the receiver, and a vertical rectangle that stands on it.
    let center = DVec3::new(0.3, 0.25, 0.0);
    let light = format!("sphere = {{ center = {}, radius = 0.25 }}", array(center));
    let expected = forms::sphere(center, 0.25, DVec3::Y);
    cases.push(case("resting sphere".into(), lit(DVec3::Y, &light, ""), expected));
    let (light, corners) = rectangle(DVec3::new(0.2, 0.5, 0.0), [1.0, 1.0], -DVec3::X);
    let expected = forms::polygon(&corners, DVec3::Y);
    cases.push(case("standing rectangle".into(), lit(DVec3::Y, &light, ""), expected));
    check_means(&cases, 1 << 15, [1e-3, 1e-6]);
}
