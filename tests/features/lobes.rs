//! Tests of mirrors and blurred reflection.

use crate::features::first_hits::{RASTER, centers, first_hits, pixel_ray};
use crate::features::plain_tracer::{agrees, without_chance};
use crate::features::row::{Verdict, ensure, material, number, object, row, shape};
use crate::support::{picture, rendered, shipped, sized};
use glam::DVec3;
use std::f64::consts::PI;
use zerkalo_render::film::Replicates;
use zerkalo_scene::material::Lobe;
use zerkalo_scene::shape::Shape;
use zerkalo_scene::{Filter, Scale, Scene, TransformOp};
use zerkalo_world::Precision;

/// Returns `scene` with the mirror as its only reflecting object. The mirror's material has no
/// ambient and no diffuse part.
fn stripped(scene: &Scene) -> Scene {
    let mut scene = scene.clone();
    for (name, m) in &mut scene.materials {
        if name == "mirror" {
            (m.ambient, m.diffuse) = (0.0, 0.0);
        } else {
            m.reflection = 0.0;
        }
    }
    scene
}

/// Returns `scene` without the mirror, and with objects and lights mirrored at the mirror's plane z
/// = -2.
fn mirrored_scene(scene: &Scene) -> Scene {
    let mut scene = stripped(scene);
    scene.objects.retain(|o| o.material != "mirror");
    for object in &mut scene.objects {
        object.transform.push(TransformOp::Scale(Scale([1.0, 1.0, -1.0])));
        object.transform.push(TransformOp::Translate([0.0, 0.0, -4.0]));
    }
    for position in scene.lights.iter_mut().filter_map(|light| light.position_mut()) {
        position[2] = -4.0 - position[2];
    }
    scene
}

/// Checks that each pixel of `tested` that shows the mirror has k_r = 0.92 times the radiance of
/// the same pixel in the mirrored scene, [`mirrored_scene`].
fn shows_the_mirrored_room(original: &Scene, tested: &Scene) -> Verdict {
    let mirror = number(original, "mirror") as u32;
    let hits = first_hits(&sized(original.clone(), RASTER));
    let mirrored = without_chance(&mirrored_scene(original));
    let pixels = without_chance(&stripped(tested));
    let (mut compared, mut objects) = (0, 0);
    for ((hit, mirrored), pixel) in hits.iter().zip(&mirrored).zip(&pixels) {
        if hit.object == Some(mirror) {
            compared += 1;
            objects +=
                usize::from(mirrored.distance(DVec3::from(original.background.color.0)) > 0.01);
            let difference = (*pixel - 0.92 * *mirrored).abs().max_element();
            ensure(difference < 1e-6, || format!("{pixel} in the mirror, {mirrored} behind it"))?;
        }
    }
    ensure(objects > 50, || {
        format!("only {objects} of {compared} pixels of the mirror show objects")
    })
}

/// Returns the standard deviation of the brightness of the pixels that show the mirror.
fn contrast(scene: &Scene) -> f64 {
    let mirror = number(scene, "mirror") as u32;
    let scene = sized(stripped(scene), RASTER);
    let hits = first_hits(&scene);
    let pixels = picture(&rendered(&scene, 1, Precision::Double, 128), Replicates::Both);
    let mirror_pixels = hits.iter().zip(&pixels).filter(|(s, _)| s.object == Some(mirror));
    let values: Vec<f64> = mirror_pixels.map(|(_, rgb)| rgb.iter().sum::<f64>() / 3.0).collect();
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / values.len() as f64).sqrt()
}

#[test]
fn a6_flat_mirror() {
    let sharp = shipped("roughness-0.toml");
    row(
        "roughness-0.toml",
        |tested| shows_the_mirrored_room(&sharp, tested),
        &[
            ("diffuse", &|s| material(s, "mirror").reflection = 0.0),
            ("rough", &|s| material(s, "mirror").roughness = 0.01),
            ("a mirror ball", &|s| {
                object(s, "mirror").shape =
                    shape("sphere = { center = [0.0, 1.5, -52.0], radius = 50.0 }");
            }),
            ("facing elsewhere", &|s| {
                let Shape::Rectangle(r) = &mut object(s, "mirror").shape else { unreachable!() };
                r.normal = [0.01, 0.0, 1.0];
            }),
        ],
    );
    let blurred = shipped("roughness-0.3.toml");
    row(
        "roughness-0.3.toml",
        |tested| agrees(&blurred, tested, 96),
        &[
            ("perfect", &|s| material(s, "mirror").roughness = 0.0),
            ("half as rough", &|s| material(s, "mirror").roughness = 0.15),
        ],
    );
    // Contrast falls with every increase of roughness.
    let by_roughness = [0.0, 0.1, 0.3, 1.0, 1e3].map(|roughness| {
        let mut scene = sharp.clone();
        material(&mut scene, "mirror").roughness = roughness;
        contrast(&scene)
    });
    println!("contrast by roughness: {by_roughness:?}");
    assert!(by_roughness.is_sorted_by(|a, b| a > b), "{by_roughness:?}");
    // Even the roughest mirror keeps some contrast, because some of its points see more of the
    // floor, and others see more of the sky.
    assert!(by_roughness[4] < 0.5 * by_roughness[0], "{by_roughness:?}");
}

/// Width and height in pixels of the pictures that show the shape of lobes.
const FINE: [u32; 2] = [96, 64];

/// Ball as seen from a point of the mirror.
struct Spot {
    /// Angle between the direction to the ball's centre and the mirrored view direction, in
    /// radians.
    angle: f64,
    /// Angular radius of the ball, in radians.
    half: f64,
    radiance: DVec3,
}

/// Pixel that shows the mirror, with all balls of the scene.
struct Footprint {
    /// Balls of the scene, as seen from the point of the mirror that the pixel shows.
    spots: Vec<Spot>,
    /// Rendered radiance of the pixel.
    radiance: DVec3,
    /// Standard error of `radiance`.
    error: DVec3,
}

/// Returns the pixels of `tested` that show the mirror. Each has the balls of `original`, as seen
/// from the point of the mirror that the pixel shows.
fn footprints(original: &Scene, tested: &Scene) -> Vec<Footprint> {
    let original = sized(original.clone(), FINE);
    let mut tested = sized(tested.clone(), FINE);
    tested.film.filter = Filter::Point;
    let rendering = rendered(&tested, 1, Precision::Double, 512);
    let [a, b] = [Replicates::A, Replicates::B].map(|part| picture(&rendering, part));
    let hits = first_hits(&original);
    let mirrors = (0..a.len()).filter(|i| hits[*i].object == Some(0));
    let pixel = |i: usize| {
        let ray = pixel_ray(&original.camera, FINE, centers(FINE)[i]);
        let on_mirror = ray.origin + ray.direction * ((-1.0 - ray.origin.z) / ray.direction.z);
        let mirrored = ray.direction * DVec3::new(1.0, 1.0, -1.0);
        let spot = |o: &zerkalo_scene::Object| match &o.shape {
            Shape::Sphere(s) => {
                let to_center = DVec3::from(s.center) - on_mirror;
                let color = DVec3::from(original.materials[&o.material].color.0);
                let radiance = color * DVec3::from(original.ambient.color.0);
                let half = (s.radius / to_center.length()).asin();
                Some(Spot { angle: mirrored.angle_between(to_center), half, radiance })
            }
            _ => None,
        };
        let (a, b) = (DVec3::from(a[i]), DVec3::from(b[i]));
        let spots = original.objects.iter().filter_map(spot).collect();
        Footprint { spots, radiance: (a + b) / 2.0, error: (a - b) / 2.0 }
    };
    mirrors.map(pixel).collect()
}

/// Compares each pixel with its expected radiance: the sum over its balls of k_r x share x
/// radiance, where k_r is 0.9. `share` returns the share of the lobe that a ball covers. Pixels
/// with a ball for which `share` returns `None` are left out. A pixel whose expected radiance is 0
/// must be exactly black. The differences between rendered and expected radiance of the other
/// pixels must add up to 0, apart from noise.
fn shows_shares(pixels: &[Footprint], share: impl Fn(&Spot) -> Option<f64>) -> Verdict {
    let (mut sum, mut variance, mut expected_sum) = (DVec3::ZERO, DVec3::ZERO, DVec3::ZERO);
    let (mut bright, mut dark) = (0, 0);
    for pixel in pixels {
        let shares: Option<Vec<f64>> = pixel.spots.iter().map(&share).collect();
        let Some(shares) = shares else { continue };
        let weighted_spots = pixel.spots.iter().zip(&shares);
        let expected =
            weighted_spots.map(|(spot, share)| spot.radiance * (0.9 * share)).sum::<DVec3>();
        if expected == DVec3::ZERO {
            dark += 1;
            ensure(pixel.radiance == DVec3::ZERO, || {
                format!("{} outside the lobe", pixel.radiance)
            })?;
        } else {
            bright += 1;
            sum += pixel.radiance - expected;
            variance += pixel.error * pixel.error;
            expected_sum += expected;
        }
    }
    ensure(bright > 100 && dark > 100, || format!("{bright} pixels inside, {dark} outside"))?;
    let z = (sum / variance.map(f64::sqrt)).abs().max_element();
    let off = (sum / expected_sum).abs().max_element();
    // The largest z of the three channels exceeds 4 by chance in one of five thousand renders.
    ensure(z < 4.0, || format!("inside off by {off:.4}, {z:.1} standard errors"))
}

/// Radius of the lobe's cone at unit distance.
const RADIUS: f64 = 0.2;

/// Returns half the side of the square whose area equals that of a circle of radius [`RADIUS`].
fn half_side() -> f64 {
    0.5 * PI.sqrt() * RADIUS
}

/// Returns the distance from the axis at which a direction, at `angle` to the axis, reaches the
/// plane at unit distance. Returns infinity if it does not reach the plane.
fn reach(angle: f64) -> f64 {
    if angle < 0.5 * PI { angle.tan() } else { f64::INFINITY }
}

/// Checks that reflected directions are uniform in the lobe's cone: the share of the lobe that a
/// ball covers is the ratio of their solid angles.
fn spreads_over_a_cone(original: &Scene, tested: &Scene) -> Verdict {
    let edge = RADIUS.atan();
    shows_shares(&footprints(original, tested), |spot| {
        if spot.angle - spot.half > edge {
            return Some(0.0);
        }
        let inside = spot.angle + spot.half < edge;
        inside.then(|| (1.0 - spot.half.cos()) / (1.0 - edge.cos()))
    })
}

/// Checks that reflected directions are uniform on a square at unit distance: the share of the lobe
/// that a ball covers is the ratio of the areas of the ball's ellipse and of the square, both in
/// the square's plane. The corners of the square are outside of the cone of equal area, and the
/// middles of its sides are inside.
fn spreads_over_a_square(original: &Scene, tested: &Scene) -> Verdict {
    let half = half_side();
    let pixels = footprints(original, tested);
    shows_shares(&pixels, |spot| {
        if reach(spot.angle - spot.half) > 2f64.sqrt() * half {
            return Some(0.0);
        }
        let (cos, sin) = (spot.angle.cos(), spot.half.sin());
        let ellipse = PI * sin * sin * spot.half.cos() / (cos * cos - sin * sin).powf(1.5);
        let inside = reach(spot.angle + spot.half) < half;
        inside.then_some(ellipse / (4.0 * half * half))
    })?;
    let all_outside = |pixel: &&Footprint, radius: f64| {
        pixel.spots.iter().all(|spot| reach(spot.angle - spot.half) > radius)
    };
    let corners =
        pixels.iter().filter(|p| all_outside(p, RADIUS) && p.radiance != DVec3::ZERO).count();
    ensure(corners > 10, || format!("only {corners} pixels are lit by corners"))?;
    // Pixels beside the middle of a side are dark although the cone would reach them.
    let sides = pixels.iter().filter(|p| all_outside(p, half) && p.radiance == DVec3::ZERO);
    let sides = sides.filter(|p| p.spots.iter().any(|s| reach(s.angle - s.half) < RADIUS)).count();
    ensure(sides > 10, || format!("only {sides} pixels are dark beside the sides"))
}

#[test]
fn a11_blurred_reflection() {
    let original = shipped("footprint-cone.toml");
    row(
        "footprint-cone.toml",
        |tested| spreads_over_a_cone(&original, tested),
        &[
            ("the square", &|s| material(s, "mirror").lobe = Lobe::Square),
            ("no spread", &|s| material(s, "mirror").lobe = Lobe::Mirror),
            ("microfacets", &|s| material(s, "mirror").lobe = Lobe::Beckmann),
            ("a tenth wider", &|s| material(s, "mirror").roughness *= 1.1),
            ("a tenth narrower", &|s| material(s, "mirror").roughness *= 0.9),
        ],
    );
}

#[test]
fn a12_pyramid_lobe() {
    let original = shipped("footprint-square.toml");
    row(
        "footprint-square.toml",
        |tested| spreads_over_a_square(&original, tested),
        &[
            ("the cone", &|s| material(s, "mirror").lobe = Lobe::Cone),
            ("no spread", &|s| material(s, "mirror").lobe = Lobe::Mirror),
            ("a tenth wider", &|s| material(s, "mirror").roughness *= 1.1),
            ("a tenth narrower", &|s| material(s, "mirror").roughness *= 0.9),
        ],
    );
}
