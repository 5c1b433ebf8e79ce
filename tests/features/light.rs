//! Tests of materials, lights and shading formulas.

use crate::features::row::*;
use crate::harness::*;
use crate::reference::*;
use zerkalo_scene::light::SphereLight;
use zerkalo_scene::material::Metal;

/// Checks that the picture of `file` agrees exactly with the reference tracer. The picture of each
/// of `mutations`, changed versions of the scene, must disagree.
fn exact(file: &str, mutations: &[(&str, Change)]) {
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

#[test]
fn a8_point_light() {
    fn warm(scene: &mut Scene) -> &mut Light {
        &mut scene.lights[0]
    }
    exact(
        "point-light.toml",
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
        let brightest = without_noise(tested).iter().map(|p| p.max_element()).fold(0.0, f64::max);
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

#[test]
fn a18_background() {
    exact(
        "background.toml",
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
fn c3_ambient_and_directional_light() {
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

/// Checks the light that a tilted mirror throws on a wall against the closed form: that of a light
/// behind the mirror, seen through it.
#[test]
fn d14_mirror_light() {
    let lines: Vec<Line> = (0..60 * 40)
        .map(|i| (f64::from(i % 60) * 0.05 - 1.5, 0.1 + f64::from(i / 60) * 0.05))
        .map(|(x, y)| (DVec3::new(x, y, -2.9), -DVec3::Z))
        .collect();
    let (center, normal) = (DVec3::new(0.0, 0.45, 1.5), DVec3::new(0.0, 1.0, -0.6).normalize());
    let across = normal.cross(DVec3::X);
    // Radiance of the wall, and the distance from the edge of the patch, outside less than 0.
    let thrown = |scene: &Scene, point: DVec3| {
        let light = &scene.lights[0];
        let (to_image, strength) = match light.position() {
            None => (-DVec3::from(light.direction().unwrap()).normalize(), 1.0),
            Some(position) => (DVec3::from(position) - center, 1.0 / PI),
        };
        let mirrored = to_image - 2.0 * to_image.dot(normal) * normal;
        let (wi, falling) = match light.position() {
            None => (mirrored, 1.0),
            Some(_) => {
                let to_image = center + mirrored - point;
                (to_image.normalize(), to_image.length_squared().recip())
            }
        };
        let on_mirror = point + wi * ((center - point).dot(normal) / wi.dot(normal)) - center;
        let inside = 0.35 - on_mirror.x.abs().max(on_mirror.dot(across).abs());
        let color = light.color.scaled(light.intensity).0;
        let albedo = scene.materials["wall"].color.0;
        let scale = 0.9 * strength * falling * wi.z;
        ([0, 1, 2].map(|i| color[i] * albedo[i] * scale), inside)
    };
    let check = |original: &Scene, tested: &Scene| {
        let mut plain = original.clone();
        plain.trace.mirror_light = false;
        let [with, without] =
            [tested, &plain].map(|scene| Traced::new(scene, Precision::Double).radiance(&lines));
        let mut found = 0;
        for ((with, without), (origin, direction)) in with.iter().zip(without).zip(&lines) {
            let (expected, inside) = thrown(original, *origin + *direction * 0.1);
            let expected = if inside > 0.0 { expected } else { [0.0; 3] };
            found += usize::from(inside > 0.0);
            let apart = (0..3).map(|i| (with[i] - without[i] - expected[i]).abs());
            let apart = if inside.abs() < 1e-6 { 0.0 } else { apart.fold(0.0, f64::max) };
            ensure(apart < 1e-5, || format!("at {origin}: {apart}"))?;
        }
        ensure(found > 30, || format!("only {found} points in the patch"))
    };
    let original = shipped("mirror-light.toml");
    let mut lamp = original.clone();
    lamp.lights[0].kind = Point { position: [-0.1, 2.5, 2.7] }.into();
    lamp.lights[0].falloff = Falloff::InverseSquare;
    check(&lamp, &lamp).unwrap_or_else(|e| panic!("point light: {e}"));
    row(
        "mirror-light.toml",
        |tested| check(&original, tested),
        &[
            ("no light thrown", &|s| s.trace.mirror_light = false),
            ("a darker mirror", &|s| material(s, "mirror").reflection = 0.8),
            ("no shadows", &|s| s.trace.ray_types = RayTypes::Primary),
            ("a smaller mirror", &|s| {
                let wall = "rectangle = { center = [0.0, 0.45, 1.5], size = [0.6, 0.7], normal = [0.0, 1.0, -0.6] }";
                object(s, "mirror").shape = shape(wall);
            }),
        ],
    );
    // The upper side of a solid throws the same light as a mirror without thickness.
    let mut solid = original.clone();
    let mirror = object(&mut solid, "mirror");
    mirror.shape = shape("box = { center = [0.0, -0.2, 0.0], size = [0.7, 0.4, 0.7] }");
    mirror.transform = vec![
        TransformOp::RotateX(-(0.6f64).atan().to_degrees()),
        TransformOp::Translate([0.0, 0.45, 1.5]),
    ];
    check(&original, &solid).unwrap_or_else(|e| panic!("solid: {e}"));
    // A mirror throws all light that a bounce finds in it, and nothing counts twice.
    let mut sphere = sized(lamp, [8, 6]);
    sphere.camera.eye = [0.3, 1.6, 1.0];
    sphere.camera.target = Some([0.2, 0.4, -3.0]);
    sphere.camera.view_angle = ViewAngle::Vertical(12.0);
    let ball = SphereLight { center: [-0.1, 2.5, 2.7], radius: 0.12 };
    sphere.lights[0] = Light { intensity: 30.0, ..Light::new(ball) };
    sphere.trace.max_diffuse_depth = 1;
    sphere.trace.caustics = true;
    let mut without_caustics = sphere.clone();
    without_caustics.trace.caustics = false;
    means_agree("lamp in a mirror", &sphere, &without_caustics, 2048);
}
