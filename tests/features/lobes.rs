//! Mirrors and the blur of what they show.

use crate::beside::{agrees, without_chance};
use crate::row::{Verdict, ensure, material, number, object, row, shape};
use crate::sight::{RASTER, centers, sighting, sights};
use crate::support::{picture, rendered, shipped, sized};
use glam::DVec3;
use std::f64::consts::PI;
use zerkalo::film::Replicates;
use zerkalo::material::Lobe;
use zerkalo::scene::{Filter, Scale, Scene, TransformOp};
use zerkalo::shape::Shape;
use zerkalo::world::Precision;

/// Only the mirror reflects, and it shows nothing of its own.
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

/// Without the mirror, everything on the other side of the plane z = -2 in which it lies.
fn behind_the_mirror(scene: &Scene) -> Scene {
    let mut scene = stripped(scene);
    scene.objects.retain(|o| o.material != "mirror");
    for object in &mut scene.objects {
        object.transform.push(TransformOp::Scale(Scale([1.0, 1.0, -1.0])));
        object.transform.push(TransformOp::Translate([0.0, 0.0, -4.0]));
    }
    for point in scene.lights.iter_mut().filter_map(|l| l.point.as_mut()) {
        point.position[2] = -4.0 - point.position[2];
    }
    scene
}

/// Where the mirror is seen there is 0.92 of what stands mirrored behind it.
fn shows_the_mirrored_room(meant: &Scene, shown: &Scene) -> Verdict {
    let mirror = number(meant, "mirror") as u32;
    let seen = sights(&sized(meant.clone(), RASTER));
    let beyond = without_chance(&behind_the_mirror(meant));
    let own = without_chance(&stripped(shown));
    let (mut compared, mut things) = (0, 0);
    for ((sight, beyond), own) in seen.iter().zip(&beyond).zip(&own) {
        if sight.object == Some(mirror) {
            compared += 1;
            things += usize::from(beyond.distance(DVec3::from(meant.background.color.0)) > 0.01);
            let apart = (*own - 0.92 * *beyond).abs().max_element();
            ensure(apart < 1e-6, || format!("{own} in the mirror, {beyond} behind it"))?;
        }
    }
    ensure(things > 50, || format!("only {things} of {compared} pixels of the mirror show things"))
}

/// Standard deviation of the mirror's pixels, by their brightness.
fn contrast(scene: &Scene) -> f64 {
    let mirror = number(scene, "mirror") as u32;
    let scene = sized(stripped(scene), RASTER);
    let seen = sights(&scene);
    let shown = picture(&rendered(&scene, 1, Precision::Double, 128), Replicates::Both);
    let of_mirror = seen.iter().zip(&shown).filter(|(s, _)| s.object == Some(mirror));
    let values: Vec<f64> = of_mirror.map(|(_, rgb)| rgb.iter().sum::<f64>() / 3.0).collect();
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / values.len() as f64).sqrt()
}

#[test]
fn a6_flat_mirror() {
    let sharp = shipped("roughness-0.toml");
    row(
        "roughness-0.toml",
        |shown| shows_the_mirrored_room(&sharp, shown),
        &[
            ("matt", &|s| material(s, "mirror").reflection = 0.0),
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
        |shown| agrees(&blurred, shown, 96),
        &[
            ("perfect", &|s| material(s, "mirror").roughness = 0.0),
            ("half as rough", &|s| material(s, "mirror").roughness = 0.15),
        ],
    );
    // From perfect to fully blurred, without a limit.
    let by_roughness = [0.0, 0.1, 0.3, 1.0, 1e3].map(|roughness| {
        let mut scene = sharp.clone();
        material(&mut scene, "mirror").roughness = roughness;
        contrast(&scene)
    });
    println!("contrast by roughness: {by_roughness:?}");
    assert!(by_roughness.is_sorted_by(|a, b| a > b), "{by_roughness:?}");
    // What is left is how much of the floor and of the sky the surroundings of a point have.
    assert!(by_roughness[4] < 0.5 * by_roughness[0], "{by_roughness:?}");
}

/// The raster in which footprints are looked at.
const FINE: [u32; 2] = [96, 64];

/// A ball as seen from a point of the mirror: the angle to the mirrored direction, the ball's own
/// half-angle, and its radiance.
struct Spot {
    angle: f64,
    half: f64,
    radiance: DVec3,
}

/// A pixel of the mirror: the balls that it may show, what it shows, and the error of that.
struct Footprint {
    spots: Vec<Spot>,
    shown: DVec3,
    error: DVec3,
}

fn footprints(meant: &Scene, shown: &Scene) -> Vec<Footprint> {
    let meant = sized(meant.clone(), FINE);
    let mut shown = sized(shown.clone(), FINE);
    shown.film.filter = Filter::Point;
    let rendering = rendered(&shown, 1, Precision::Double, 512);
    let [a, b] = [Replicates::A, Replicates::B].map(|part| picture(&rendering, part));
    let seen = sights(&meant);
    let mirrors = (0..a.len()).filter(|i| seen[*i].object == Some(0));
    let pixel = |i: usize| {
        let ray = sighting(&meant.camera, FINE, centers(FINE)[i]);
        let on_mirror = ray.origin + ray.direction * ((-1.0 - ray.origin.z) / ray.direction.z);
        let mirrored = ray.direction * DVec3::new(1.0, 1.0, -1.0);
        let spot = |o: &zerkalo::scene::Object| match &o.shape {
            Shape::Sphere(s) => {
                let to = DVec3::from(s.center) - on_mirror;
                let color = DVec3::from(meant.materials[&o.material].color.0);
                let radiance = color * DVec3::from(meant.ambient.color.0);
                let half = (s.radius / to.length()).asin();
                Some(Spot { angle: mirrored.angle_between(to), half, radiance })
            }
            _ => None,
        };
        let (a, b) = (DVec3::from(a[i]), DVec3::from(b[i]));
        let spots = meant.objects.iter().filter_map(spot).collect();
        Footprint { spots, shown: (a + b) / 2.0, error: (a - b) / 2.0 }
    };
    mirrors.map(pixel).collect()
}

/// Pixels for which `share` tells of every ball which share of the lobe it covers show that share of
/// its radiance, weighted by k_r = 0.9, and where that is nothing, nothing.
fn shows_shares(pixels: &[Footprint], share: impl Fn(&Spot) -> Option<f64>) -> Verdict {
    let (mut sum, mut variance, mut expected_sum) = (DVec3::ZERO, DVec3::ZERO, DVec3::ZERO);
    let (mut bright, mut dark) = (0, 0);
    for pixel in pixels {
        let shares: Option<Vec<f64>> = pixel.spots.iter().map(&share).collect();
        let Some(shares) = shares else { continue };
        let parts = pixel.spots.iter().zip(&shares);
        let expected = parts.map(|(spot, share)| spot.radiance * (0.9 * share)).sum::<DVec3>();
        if expected == DVec3::ZERO {
            dark += 1;
            ensure(pixel.shown == DVec3::ZERO, || format!("{} outside of all lobes", pixel.shown))?;
        } else {
            bright += 1;
            sum += pixel.shown - expected;
            variance += pixel.error * pixel.error;
            expected_sum += expected;
        }
    }
    ensure(bright > 100 && dark > 100, || format!("{bright} pixels inside, {dark} outside"))?;
    let z = (sum / variance.map(f64::sqrt)).abs().max_element();
    let off = (sum / expected_sum).abs().max_element();
    // Three channels: by chance alone once in five thousand seeds.
    ensure(z < 4.0, || format!("inside {off:.4} too much or too little, {z:.1} standard errors"))
}

/// Radius of the cone's base at unit distance, and half the side of the square of the same area.
const RADIUS: f64 = 0.2;

fn half_side() -> f64 {
    0.5 * PI.sqrt() * RADIUS
}

/// Where a direction at `angle` to the axis meets the plane at unit distance, if it does.
fn reach(angle: f64) -> f64 {
    if angle < 0.5 * PI { angle.tan() } else { f64::INFINITY }
}

/// Every direction in the cone is as likely as any other: a ball counts by its solid angle.
fn spreads_over_a_cone(meant: &Scene, shown: &Scene) -> Verdict {
    let edge = RADIUS.atan();
    shows_shares(&footprints(meant, shown), |spot| {
        if spot.angle - spot.half > edge {
            return Some(0.0);
        }
        let inside = spot.angle + spot.half < edge;
        inside.then(|| (1.0 - spot.half.cos()) / (1.0 - edge.cos()))
    })
}

/// Every point of the square is as likely as any other: a ball counts by the ellipse that it covers in
/// the plane at unit distance. The corners reach further than the cone, the sides less far.
fn spreads_over_a_square(meant: &Scene, shown: &Scene) -> Verdict {
    let half = half_side();
    let pixels = footprints(meant, shown);
    shows_shares(&pixels, |spot| {
        if reach(spot.angle - spot.half) > 2f64.sqrt() * half {
            return Some(0.0);
        }
        let (cos, sin) = (spot.angle.cos(), spot.half.sin());
        let ellipse = PI * sin * sin * spot.half.cos() / (cos * cos - sin * sin).powf(1.5);
        let inside = reach(spot.angle + spot.half) < half;
        inside.then_some(ellipse / (4.0 * half * half))
    })?;
    let beyond = |pixel: &&Footprint, radius: f64| {
        pixel.spots.iter().all(|spot| reach(spot.angle - spot.half) > radius)
    };
    let corners = pixels.iter().filter(|p| beyond(p, RADIUS) && p.shown != DVec3::ZERO).count();
    ensure(corners > 10, || format!("only {corners} pixels are lit by corners"))?;
    // Some pixels are dark that the cone would reach: those beside the middle of a side.
    let sides = pixels.iter().filter(|p| beyond(p, half) && p.shown == DVec3::ZERO);
    let sides = sides.filter(|p| p.spots.iter().any(|s| reach(s.angle - s.half) < RADIUS)).count();
    ensure(sides > 10, || format!("only {sides} pixels are dark beside the sides"))
}

#[test]
fn a11_blurred_reflection() {
    let meant = shipped("footprint-cone.toml");
    row(
        "footprint-cone.toml",
        |shown| spreads_over_a_cone(&meant, shown),
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
    let meant = shipped("footprint-square.toml");
    row(
        "footprint-square.toml",
        |shown| spreads_over_a_square(&meant, shown),
        &[
            ("the cone", &|s| material(s, "mirror").lobe = Lobe::Cone),
            ("no spread", &|s| material(s, "mirror").lobe = Lobe::Mirror),
            ("a tenth wider", &|s| material(s, "mirror").roughness *= 1.1),
            ("a tenth narrower", &|s| material(s, "mirror").roughness *= 0.9),
        ],
    );
}
