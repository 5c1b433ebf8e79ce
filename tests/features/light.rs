//! Materials, lights, and the formulas that join them.

use crate::beside::{agrees, exactly, without_chance};
use crate::row::{Verdict, ensure, material, object, row};
use crate::sight::{RASTER, centers, sighting, sights};
use crate::support::{shipped, sized};
use glam::DVec3;
use zerkalo::camera::ViewAngle;
use zerkalo::light::{Directional, Falloff, Light, Point};
use zerkalo::material::{Fresnel, Highlight, Lobe, Masking, Metal};
use zerkalo::scene::{RayTypes, Scene};
use zerkalo::value::Color;

/// `file` is exactly what the plain tracer makes of it.
fn exact(file: &str, neighbours: &[(&str, crate::row::Change)]) {
    let meant = shipped(file);
    row(file, |shown| exactly(&meant, shown), neighbours);
}

/// The blurred ball fills the picture.
fn close_up(scene: &Scene) -> Scene {
    let mut scene = scene.clone();
    scene.camera.target = Some([1.65, 0.5, 0.3]);
    scene.camera.view_angle = ViewAngle::Vertical(12.0);
    scene
}

#[test]
fn a7_material() {
    let meant = shipped("material.toml");
    row(
        "material.toml",
        |shown| {
            agrees(&meant, shown, 96)?;
            agrees(&close_up(&meant), &close_up(shown), 96)
        },
        &[
            ("another colour", &|s| material(s, "matt").color = Color([0.7, 0.2, 0.15])),
            ("no specularity", &|s| material(s, "shiny").specular = 0.0),
            ("no reflection", &|s| material(s, "reflecting").reflection = 0.0),
            ("a reflection coefficient of 0.8", &|s| material(s, "reflecting").reflection = 0.8),
            ("no roughness", &|s| material(s, "blurred").roughness = 0.0),
            ("materials exchanged", &|s| object(s, "matt").material = "shiny".into()),
        ],
    );
}

/// On the floor, where one lamp reaches it: color x intensity x cosine, with the other lamp or without.
fn floor_is_lit(meant: &Scene, shown: &Scene) -> Verdict {
    let meant = sized(meant.clone(), RASTER);
    let picture = without_chance(shown);
    let balls: Vec<(DVec3, f64)> = meant
        .objects
        .iter()
        .filter_map(|o| match &o.shape {
            zerkalo::shape::Shape::Sphere(s) => Some((DVec3::from(s.center), s.radius)),
            _ => None,
        })
        .collect();
    // Whether a ball comes within its radius of the way between two points.
    let blocked = |a: DVec3, b: DVec3| {
        balls.iter().any(|(center, radius)| {
            let t = ((center - a).dot(b - a) / (b - a).length_squared()).clamp(0.0, 1.0);
            (a + (b - a) * t).distance(*center) < *radius
        })
    };
    let (mut lit, mut shadowed) = (0, 0);
    for (center, shown) in centers(RASTER).iter().zip(&picture) {
        let ray = sighting(&meant.camera, RASTER, *center);
        let on_floor = ray.origin - ray.direction * (ray.origin.y / ray.direction.y);
        let [x, _, z] = on_floor.to_array();
        if ray.direction.y >= 0.0 || x.abs() > 4.5 || z.abs() > 3.5 {
            continue;
        }
        if blocked(ray.origin, on_floor) {
            continue;
        }
        let mut expected = DVec3::ZERO;
        for light in &meant.lights {
            let lamp = DVec3::from(light.point.as_ref().unwrap().position);
            if blocked(on_floor, lamp) {
                shadowed += 1;
                continue;
            }
            lit += 1;
            let cos = (lamp - on_floor).normalize().y;
            expected += DVec3::from(light.color.0) * (0.8 * light.intensity * cos);
        }
        let apart = (*shown - expected).abs().max_element();
        ensure(apart < 1e-6, || format!("{shown} instead of {expected} at {on_floor}"))?;
    }
    ensure(lit > 500 && shadowed > 50, || format!("{lit} lit, {shadowed} in shadow"))
}

#[test]
fn a8_point_light() {
    let meant = shipped("point-light.toml");
    fn warm(scene: &mut Scene) -> &mut Light {
        &mut scene.lights[0]
    }
    row(
        "point-light.toml",
        |shown| floor_is_lit(&meant, shown),
        &[
            ("falling off with distance", &|s| warm(s).falloff = Falloff::InverseSquare),
            ("a directional light", &|s| {
                warm(s).point = None;
                warm(s).directional = Some(Directional { direction: [2.2, -2.0, -1.2] });
            }),
            ("another place", &|s| warm(s).point = Some(Point { position: [-2.2, 2.1, 1.2] })),
            ("half the intensity", &|s| warm(s).intensity *= 0.5),
            ("white", &|s| warm(s).color = Color::WHITE),
            ("without shadows", &|s| s.trace.ray_types = RayTypes::Primary),
        ],
    );
}

#[test]
fn a10_phong_lighting() {
    exact(
        "phong.toml",
        &[
            ("no ambient part", &|s| s.ambient.color = Color::BLACK),
            ("no diffuse part", &|s| material(s, "wide").diffuse = 0.0),
            ("no highlight", &|s| material(s, "narrow").specular = 0.0),
            ("another exponent", &|s| material(s, "middle").exponent = 21.0),
            ("no shadow rays", &|s| s.trace.ray_types = RayTypes::Primary),
            ("one of two lights", &|s| s.lights[1].on = false),
            ("Cook-Torrance", &|s| material(s, "narrow").highlight = Highlight::CookTorrance),
        ],
    );
}

#[test]
fn b10_phong() {
    exact(
        "highlights.toml",
        &[
            ("Cook-Torrance", &|s| material(s, "phong").highlight = Highlight::CookTorrance),
            ("another exponent", &|s| material(s, "phong").exponent = 82.0),
            ("Phong in place of Cook-Torrance", &|s| {
                material(s, "cook-torrance").highlight = Highlight::Phong;
            }),
        ],
    );
}

#[test]
fn b11_cook_torrance() {
    let schlick = |s: &mut Scene| {
        s.materials.values_mut().for_each(|m| m.fresnel = m.fresnel.map(|_| Fresnel::Schlick));
    };
    exact(
        "cook-torrance.toml",
        &[
            ("Phong", &|s| material(s, "satin").highlight = Highlight::Phong),
            ("GGX for Beckmann", &|s| material(s, "satin").lobe = Lobe::Ggx),
            ("Smith for V-cavities", &|s| material(s, "dull").masking = Masking::Smith),
            ("Schlick for Fresnel", &schlick),
            ("another slope", &|s| material(s, "rough").alpha = Some(0.36)),
        ],
    );
}

#[test]
fn b12_metals() {
    // The published numbers stand here once more, in place of the names.
    let mut meant = shipped("metals.toml");
    for (name, f0) in [
        ("gold", [0.989, 0.876, 0.349]),
        ("silver", [0.950, 0.930, 0.880]),
        ("copper", [0.755, 0.490, 0.095]),
        ("iron", [0.530, 0.505, 0.480]),
    ] {
        let own = material(&mut meant, name);
        (own.metal, own.f0, own.fresnel) = (None, Some(Color(f0)), Some(Fresnel::Exact));
    }
    let instead =
        |name: &'static str, metal| move |s: &mut Scene| material(s, name).metal = Some(metal);
    row(
        "metals.toml",
        |shown| agrees(&meant, shown, 96),
        &[
            ("silver for gold", &instead("gold", Metal::Silver)),
            ("iron for silver", &instead("silver", Metal::Iron)),
            ("gold for copper", &instead("copper", Metal::Gold)),
            ("copper for iron", &instead("iron", Metal::Copper)),
        ],
    );
}

/// The parts are added: what is shown is the Phong part plus k_r x reflected and k_t x transmitted.
#[test]
fn a17_composition() {
    let weighted = |s: &mut Scene| {
        for m in s.materials.values_mut() {
            let left = (1.0 - m.reflection - m.transmission).max(0.0);
            (m.ambient, m.diffuse, m.specular) =
                (m.ambient * left, m.diffuse * left, m.specular * left);
        }
    };
    let bright = shipped("brighter-than-its-light.toml");
    let check = |shown: &Scene| {
        agrees(&bright, shown, 96)?;
        let brightest = without_chance(shown).iter().map(|p| p.max_element()).fold(0.0, f64::max);
        ensure(brightest > 1.2, || format!("nothing is brighter than {brightest}"))?;
        let warnings: Vec<String> = shown.warnings().iter().map(|w| w.to_string()).collect();
        let words = "more than the light";
        ensure(warnings.len() == 1 && warnings[0].contains(words), || format!("{warnings:?}"))
    };
    row(
        "brighter-than-its-light.toml",
        check,
        &[
            ("the Phong part weighted by 1 - k_r", &weighted),
            ("no reflected part", &|s| material(s, "glowing").reflection = 0.0),
        ],
    );
    let transparent = shipped("transmission.toml");
    row(
        "transmission.toml",
        |shown| agrees(&transparent, shown, 96),
        &[
            ("the Phong part weighted by 1 - k_r - k_t", &weighted),
            ("k_t of 0.5", &|s| material(s, "clear").transmission = 0.5),
            ("k_r of 0.3", &|s| material(s, "clear").reflection = 0.3),
        ],
    );
}

/// Where nothing is met there is the background, and k_r times it where a ball mirrors it.
fn background_is_seen(meant: &Scene, shown: &Scene) -> Verdict {
    let meant = sized(meant.clone(), RASTER);
    let color = DVec3::from(meant.background.color.0);
    let mut mirrored = [0; 3];
    let seen = sights(&meant);
    for ((center, sight), shown) in centers(RASTER).iter().zip(&seen).zip(&without_chance(shown)) {
        let share = match sight.object {
            None => 1.0,
            Some(0) => continue,
            Some(ball) => {
                // A ray that goes up from a ball misses floor and balls: their centres are level.
                let ray = sighting(&meant.camera, RASTER, *center);
                let n = DVec3::from(sight.normal.map(f64::from));
                let away = ray.direction - 2.0 * n * n.dot(ray.direction);
                if away.y < 0.5 {
                    continue;
                }
                mirrored[ball as usize - 1] += 1;
                [1.0, 2.0 / 3.0, 1.0 / 3.0][ball as usize - 1]
            }
        };
        let apart = (*shown - color * share).abs().max_element();
        ensure(apart < 1e-6, || format!("{shown} instead of {} at {center:?}", color * share))?;
    }
    let directly = seen.iter().filter(|s| s.object.is_none()).count();
    ensure(directly > 500 && mirrored.iter().all(|n| *n > 5), || {
        format!("{directly} directly, {mirrored:?} in the balls")
    })
}

#[test]
fn a18_background() {
    let meant = shipped("background.toml");
    row(
        "background.toml",
        |shown| background_is_seen(&meant, shown),
        &[
            ("black", &|s| s.background.color = Color::BLACK),
            ("as ambient light", &|s| {
                s.ambient.color = std::mem::replace(&mut s.background.color, Color::BLACK);
            }),
            ("not in mirrors", &|s| s.trace.ray_types = RayTypes::Shadows),
        ],
    );
}

/// Ambient and directional light exist, by themselves and where they were missed.
#[test]
fn c3_what_the_tracks_lacked() {
    exact(
        "directional.toml",
        &[
            ("no ambient light", &|s| s.ambient.color = Color::BLACK),
            ("no directional light", &|s| s.lights[0].on = false),
            ("a lamp far away, but not infinitely far", &|s| {
                s.lights[0].directional = None;
                s.lights[0].point = Some(Point { position: [-100.0, 100.0, 50.0] });
            }),
            ("from another side", &|s| {
                s.lights[0].directional = Some(Directional { direction: [1.0, -1.0, 0.5] });
            }),
        ],
    );
    let tracks = shipped("reflecting-tracks-lit.toml");
    row(
        "reflecting-tracks-lit.toml",
        |shown| agrees(&tracks, shown, 16),
        &[
            ("no ambient light", &|s| s.ambient.color = Color::BLACK),
            ("no directional light", &|s| s.lights[2].on = false),
        ],
    );
}
