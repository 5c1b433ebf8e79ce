//! Tests of materials, lights and shading formulas.

use crate::agreement::REFERENCE_SAMPLES;
use crate::features::first_hits::{RASTER, centers, first_hits, pixel_ray};
use crate::features::plain_tracer::{agrees, agrees_exactly, without_chance};
use crate::features::row::{Verdict, ensure, material, object, row};
use crate::support::{parsed, shipped, sized};
use glam::DVec3;
use zerkalo_scene::camera::ViewAngle;
use zerkalo_scene::light::{Directional, Falloff, Light, LightKind, Point, Spot};
use zerkalo_scene::material::{Fresnel, Highlight, Lobe, Masking, Metal};
use zerkalo_scene::value::Color;
use zerkalo_scene::{RayTypes, Scene};

/// Checks that the picture of `file` agrees exactly with the reference tracer. The picture of each
/// of `mutations`, changed versions of the scene, must disagree.
fn exact(file: &str, mutations: &[(&str, crate::features::row::Change)]) {
    let original = shipped(file);
    row(file, |tested| agrees_exactly(&original, tested), mutations);
}

/// Returns `scene` with a camera for which a ball with blurred reflection fills the picture.
fn close_up(scene: &Scene) -> Scene {
    let mut scene = scene.clone();
    scene.camera.target = Some([1.65, 0.5, 0.3]);
    scene.camera.view_angle = ViewAngle::Vertical(12.0);
    scene
}

#[test]
fn a7_material() {
    let original = shipped("material.toml");
    row(
        "material.toml",
        |tested| {
            agrees(&original, tested, 128)?;
            agrees(&close_up(&original), &close_up(tested), 128)
        },
        &[
            ("another colour", &|s| material(s, "diffuse").color = Color([0.7, 0.2, 0.15])),
            ("no specularity", &|s| material(s, "shiny").specular = 0.0),
            ("no reflection", &|s| material(s, "reflecting").reflection = 0.0),
            ("a reflection coefficient of 0.8", &|s| material(s, "reflecting").reflection = 0.8),
            ("no roughness", &|s| material(s, "blurred").roughness = 0.0),
            ("materials exchanged", &|s| object(s, "diffuse").material = "shiny".into()),
        ],
    );
}

/// Checks that the radiance of each visible point of the floor is the sum of colour x intensity x
/// cosine over the lamps that no ball hides from the point.
fn floor_is_lit(original: &Scene, tested: &Scene) -> Verdict {
    let original = sized(original.clone(), RASTER);
    let pixels = without_chance(tested);
    let balls: Vec<(DVec3, f64)> = original
        .objects
        .iter()
        .filter_map(|o| match &o.shape {
            zerkalo_scene::shape::Shape::Sphere(s) => Some((DVec3::from(s.center), s.radius)),
            _ => None,
        })
        .collect();
    // `true` if a ball intersects the segment between two points.
    let blocked = |a: DVec3, b: DVec3| {
        balls.iter().any(|(center, radius)| {
            let t = ((center - a).dot(b - a) / (b - a).length_squared()).clamp(0.0, 1.0);
            (a + (b - a) * t).distance(*center) < *radius
        })
    };
    let (mut lit, mut shadowed) = (0, 0);
    for (center, pixel) in centers(RASTER).iter().zip(&pixels) {
        let ray = pixel_ray(&original.camera, RASTER, *center);
        let on_floor = ray.origin - ray.direction * (ray.origin.y / ray.direction.y);
        let [x, _, z] = on_floor.to_array();
        if ray.direction.y >= 0.0 || x.abs() > 4.5 || z.abs() > 3.5 {
            continue;
        }
        if blocked(ray.origin, on_floor) {
            continue;
        }
        let mut expected = DVec3::ZERO;
        for light in &original.lights {
            let position = light.apex().unwrap();
            if blocked(on_floor, position) {
                shadowed += 1;
                continue;
            }
            lit += 1;
            let cos = (position - on_floor).normalize().y;
            expected += DVec3::from(light.color.0) * (0.8 * light.intensity * cos);
        }
        let difference = (*pixel - expected).abs().max_element();
        ensure(difference < 1e-6, || format!("{pixel} instead of {expected} at {on_floor}"))?;
    }
    ensure(lit > 500 && shadowed > 50, || format!("{lit} lit, {shadowed} in shadow"))
}

#[test]
fn a8_point_light() {
    let original = shipped("point-light.toml");
    fn warm(scene: &mut Scene) -> &mut Light {
        &mut scene.lights[0]
    }
    row(
        "point-light.toml",
        |tested| floor_is_lit(&original, tested),
        &[
            ("falling off with distance", &|s| warm(s).falloff = Falloff::InverseSquare),
            ("a directional light", &|s| {
                warm(s).kind = Directional::along([2.2, -2.0, -1.2]).into();
            }),
            ("another place", &|s| warm(s).kind = Point { position: [-2.2, 2.1, 1.2] }.into()),
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
    // The names of metals are replaced by their published reflectances.
    let mut original = shipped("metals.toml");
    for (name, f0) in [
        ("gold", [0.989, 0.876, 0.349]),
        ("silver", [0.950, 0.930, 0.880]),
        ("copper", [0.755, 0.490, 0.095]),
        ("iron", [0.530, 0.505, 0.480]),
    ] {
        let metal = material(&mut original, name);
        (metal.metal, metal.f0, metal.fresnel) = (None, Some(Color(f0)), Some(Fresnel::Exact));
    }
    let replaced =
        |name: &'static str, metal| move |s: &mut Scene| material(s, name).metal = Some(metal);
    row(
        "metals.toml",
        |tested| agrees(&original, tested, 96),
        &[
            ("silver for gold", &replaced("gold", Metal::Silver)),
            ("iron for silver", &replaced("silver", Metal::Iron)),
            ("gold for copper", &replaced("copper", Metal::Gold)),
            ("copper for iron", &replaced("iron", Metal::Copper)),
        ],
    );
}

/// Checks that radiance is the sum of the Phong part, k_r x reflected radiance, and k_t x
/// transmitted radiance.
#[test]
fn a17_composition() {
    let weighted = |s: &mut Scene| {
        for m in s.materials.values_mut() {
            let weight = (1.0 - m.reflection - m.transmission).max(0.0);
            (m.ambient, m.diffuse, m.specular) =
                (m.ambient * weight, m.diffuse * weight, m.specular * weight);
        }
    };
    let bright = shipped("brighter-than-its-light.toml");
    let check = |tested: &Scene| {
        agrees(&bright, tested, 96)?;
        let brightest = without_chance(tested).iter().map(|p| p.max_element()).fold(0.0, f64::max);
        ensure(brightest > 1.2, || format!("the brightest pixel has {brightest}"))?;
        let warnings: Vec<String> = tested.warnings().iter().map(|w| w.to_string()).collect();
        let phrase = "more than the light";
        ensure(warnings.len() == 1 && warnings[0].contains(phrase), || format!("{warnings:?}"))
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
        |tested| agrees(&transparent, tested, 96),
        &[
            ("the Phong part weighted by 1 - k_r - k_t", &weighted),
            ("k_t of 0.5", &|s| material(s, "clear").transmission = 0.5),
            ("k_r of 0.3", &|s| material(s, "clear").reflection = 0.3),
        ],
    );
}

/// Checks that a camera ray that misses shows the background colour. A ball that reflects the
/// background shows k_r times this colour.
fn background_is_seen(original: &Scene, tested: &Scene) -> Verdict {
    let original = sized(original.clone(), RASTER);
    let color = DVec3::from(original.background.color.0);
    let mut mirrored = [0; 3];
    let hits = first_hits(&original);
    for ((center, hit), pixel) in centers(RASTER).iter().zip(&hits).zip(&without_chance(tested)) {
        let share = match hit.object {
            None => 1.0,
            Some(0) => continue,
            Some(ball) => {
                // A ray that is reflected steeply upwards misses the floor. It also misses the
                // other balls, because the centres of all balls have the same height.
                let ray = pixel_ray(&original.camera, RASTER, *center);
                let n = DVec3::from(hit.normal.map(f64::from));
                let reflected = ray.direction - 2.0 * n * n.dot(ray.direction);
                if reflected.y < 0.5 {
                    continue;
                }
                mirrored[ball as usize - 1] += 1;
                [1.0, 2.0 / 3.0, 1.0 / 3.0][ball as usize - 1]
            }
        };
        let difference = (*pixel - color * share).abs().max_element();
        ensure(difference < 1e-6, || {
            format!("{pixel} instead of {} at {center:?}", color * share)
        })?;
    }
    let directly = hits.iter().filter(|s| s.object.is_none()).count();
    ensure(directly > 500 && mirrored.iter().all(|n| *n > 5), || {
        format!("{directly} directly, {mirrored:?} in the balls")
    })
}

#[test]
fn a18_background() {
    let original = shipped("background.toml");
    row(
        "background.toml",
        |tested| background_is_seen(&original, tested),
        &[
            ("black", &|s| s.background.color = Color::BLACK),
            ("as ambient light", &|s| {
                s.ambient.color = std::mem::replace(&mut s.background.color, Color::BLACK);
            }),
            ("not in mirrors", &|s| s.trace.ray_types = RayTypes::Shadows),
        ],
    );
}

/// Checks ambient and directional light, alone and in the scene of the reflecting tracks.
#[test]
fn c3_what_the_tracks_lacked() {
    exact(
        "directional.toml",
        &[
            ("no ambient light", &|s| s.ambient.color = Color::BLACK),
            ("no directional light", &|s| s.lights[0].on = false),
            ("a distant point light", &|s| {
                s.lights[0].kind = Point { position: [-100.0, 100.0, 50.0] }.into();
            }),
            ("from another side", &|s| {
                s.lights[0].kind = Directional::along([1.0, -1.0, 0.5]).into();
            }),
        ],
    );
    let tracks = shipped("reflecting-tracks-lit.toml");
    row(
        "reflecting-tracks-lit.toml",
        |tested| agrees(&tracks, tested, REFERENCE_SAMPLES),
        &[
            ("no ambient light", &|s| s.ambient.color = Color::BLACK),
            ("no directional light", &|s| s.lights[2].on = false),
        ],
    );
}

#[test]
fn d2_spot_light() {
    fn middle(scene: &mut Scene) -> &mut Light {
        &mut scene.lights[1]
    }
    fn cone(scene: &mut Scene) -> &mut Spot {
        match &mut middle(scene).kind {
            LightKind::Spot(spot) => spot,
            kind => panic!("a {} light has no cone", kind.key()),
        }
    }
    exact(
        "spot-light.toml",
        &[
            ("a point light", &|s| {
                let position = cone(s).position;
                middle(s).kind = Point { position }.into();
            }),
            ("another axis", &|s| cone(s).direction = [0.1, -1.0, -0.5]),
            ("another inner angle", &|s| cone(s).inner_angle = 15.0),
            ("another outer angle", &|s| cone(s).outer_angle = 19.0),
            ("without falloff", &|s| s.lights[2].falloff = Falloff::None),
            ("without shadows", &|s| s.trace.ray_types = RayTypes::Primary),
        ],
    );
}

/// Returns `scene` with a point light as its only light. One wall of the room reflects, so that
/// caustics light much of the room.
fn with_point_light(scene: &Scene) -> Scene {
    let mut scene = scene.clone();
    material(&mut scene, "green").reflection = 0.8;
    let light = parsed(
        "[[light]]\npoint.position = [0.0, 1.9, 0.0]\nfalloff = \"inverse-square\"\nintensity = 2.0",
    );
    scene.lights = light.lights;
    scene
}

#[test]
fn d3_indirect_diffuse() {
    let original = with_point_light(&shipped("indirect-diffuse.toml"));
    row(
        "indirect-diffuse.toml",
        |tested| agrees(&original, &with_point_light(tested), 192),
        &[
            ("ambient light alone", &|s| s.trace.max_diffuse_depth = 0),
            ("one bounce", &|s| s.trace.max_diffuse_depth = 1),
            ("without caustics", &|s| s.trace.caustics = false),
            ("another red", &|s| material(s, "red").color = Color([0.06, 0.06, 0.5])),
        ],
    );
    // Ambient light must not be added where a path bounces.
    let mut ambient = shipped("mirror-room.toml");
    ambient.trace.max_diffuse_depth = 1;
    agrees(&ambient, &ambient, 96).unwrap_or_else(|e| panic!("ambient light: {e}"));
}
