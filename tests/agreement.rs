//! Comparison with a second, independent implementation: a slow reference path tracer that shares
//! only the scene description with the program. The pictures agree within noise, and deliberate
//! errors of the reference are detected.

use crate::harness::*;
use crate::reference::*;

/// Number of samples per pixel in each replicate, half of [`SAMPLES`]. It is for slow scenes, and
/// for pictures with rare bright samples: with more samples, the program would find some that the
/// reference tracer misses.
const FEW_SAMPLES: u32 = 64;

/// Number of samples per pixel in each replicate, four times [`SAMPLES`]. It is for
/// [`TEXTURED_SCENES`].
const MANY_SAMPLES: u32 = 512;

/// Files of scenes whose pictures take seconds with [`SAMPLES`] samples.
const SLOW_SCENES: [&str; 10] = [
    "torus.toml",
    "triptych.toml",
    "water-glass.toml",
    "gallery-dusk.toml",
    "gallery-three-balls.toml",
    "gallery-knot.toml",
    "gallery-skylight.toml",
    "gallery-still-life.toml",
    "gallery-sun-patch.toml",
    "gallery-water.toml",
];

/// Files of scenes with textures or bumps, whose noise is estimated too low with [`SAMPLES`]
/// samples.
const TEXTURED_SCENES: [&str; 3] = ["texture-image.toml", "footprint-square.toml", "bump.toml"];

/// Returns the number of samples per pixel in each replicate, for the picture of the shipped scene
/// `name`. Tests that take the same number share the picture.
fn samples_of(name: &str) -> u32 {
    match name {
        _ if SLOW_SCENES.contains(&name) => FEW_SAMPLES,
        _ if TEXTURED_SCENES.contains(&name) => MANY_SAMPLES,
        _ => SAMPLES,
    }
}

/// Files of scenes that the reference tracer must support, so that they are compared.
const GALLERY: &str = "mirror-room.toml triptych.toml goblet.toml glass-solids.toml \
     rough-glass.toml absorbing-glass.toml texture-checker.toml texture-image.toml \
     texture-mapping.toml texture-uv.toml bump.toml depth-of-field.toml sphere-light.toml \
     rectangle-light.toml disk-light.toml sun.toml environment.toml emissive-objects.toml \
     many-lights.toml";

#[test]
fn shipped_scenes_agree_with_reference_tracer() {
    let mut checked = Vec::new();
    let (mut wrong, mut unknown) = (Vec::new(), Vec::new());
    for (name, scene) in all_shipped() {
        let scene = small(scene);
        let samples = match Tracer::new(&scene, Mutation::None) {
            // A test of features needs this reference picture of emissive-objects.toml, too.
            Ok(tracer) if tracer.is_slow() && name != "emissive-objects.toml" => {
                REFERENCE_SAMPLES / 4
            }
            Ok(_) => REFERENCE_SAMPLES,
            Err(what) => {
                println!("{name}: not compared, the reference tracer does not support {what}");
                unknown.push(name);
                continue;
            }
        };
        let reference = reference(&scene, samples, Mutation::None).unwrap();
        let picture = Picture::new(&scene, samples_of(&name));
        let verdict = picture.beside(&reference, samples);
        println!("{name}: {verdict}");
        if !verdict.agree() {
            let folder = keep(&name, &verdict);
            wrong.push(format!("{name}: {verdict}; pictures in {}", folder.display()));
        }
        checked.push(name);
    }
    println!("{} scenes compared, not {unknown:?}", checked.len());
    // The gallery scenes combine most features.
    for name in GALLERY.split(' ') {
        assert!(checked.iter().any(|c| c == name), "{name} was not compared");
    }
    assert!(checked.len() >= 65, "only {checked:?}");
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// Checks that a picture of `scene` by the program agrees with one by the reference tracer. The
/// program traces `samples` samples per pixel in each replicate. The reference tracer traces
/// `reference_samples` samples per pixel.
fn check_agreement(name: &str, scene: &Scene, samples: u32, reference_samples: u32) {
    let reference = reference(scene, reference_samples, Mutation::None).unwrap();
    let verdict = Picture::new(scene, samples).beside(&reference, reference_samples);
    println!("{name}: {verdict}");
    assert!(verdict.agree(), "{name}: {verdict}");
}

/// Checks that the comparison detects each of `mutations`, the deliberate errors of the reference
/// tracer. Also checks that the reference picture without errors, at the same number of samples,
/// agrees with the program's picture.
fn check_detection(mutations: &[Mutation], name: &str, scene: &Scene, samples: u32) {
    detected(mutations, name, scene, FEW_SAMPLES.max(samples / 6), samples);
}

/// Implements [`check_detection`] for a picture with `picture_samples` samples per pixel in each
/// replicate, and for references with `samples` samples per pixel.
fn detected(mutations: &[Mutation], name: &str, scene: &Scene, picture_samples: u32, samples: u32) {
    let picture = Picture::new(scene, picture_samples);
    let beside = |m| picture.beside(&reference(scene, samples, m).unwrap(), samples);
    let right = beside(Mutation::None);
    assert!(right.agree(), "{name}: {right}");
    for mutation in mutations {
        let wrong = beside(*mutation);
        println!("{mutation:?} in {name}: {wrong}; without it {right}");
        assert!(!wrong.agree(), "{mutation:?} in {name} was not noticed: {wrong}");
    }
}

/// Returns `scene` with the positions of eye, lights and objects, and the sizes of objects,
/// multiplied by 1/1000.
fn shrunk(mut scene: Scene) -> Scene {
    const FACTOR: f64 = 1e-3;
    let shrink = |v: &mut [f64; 3]| *v = v.map(|x| x * FACTOR);
    shrink(&mut scene.camera.eye);
    scene.camera.target.as_mut().map(shrink);
    scene.lights.iter_mut().filter_map(Light::position_mut).for_each(shrink);
    let step = TransformOp::Scale(Scale([FACTOR; 3]));
    scene.objects.iter_mut().for_each(|object| object.transform.push(step));
    scene
}

#[test]
#[ignore = "half a minute: cargo test --release --test engine agreement:: -- --ignored"]
fn deliberate_errors_are_detected() {
    let scene = |name| small(shipped(name));
    // Each of these errors shifts the picture by at least 15 standard errors, three times the
    // allowed deviation.
    for (mutation, name, scene) in [
        (Mutation::ShadowOffset, "a small mirror room", shrunk(scene("mirror-room.toml"))),
        (Mutation::Absorb, "horizon-fold.toml", scene("horizon-fold.toml")),
        (Mutation::NoCosine, "mirror-room-physical.toml", scene("mirror-room-physical.toml")),
        (Mutation::LinearCone, "spot-light.toml", scene("spot-light.toml")),
        (Mutation::NoBending, "transmission.toml", scene("transmission.toml")),
        (Mutation::SidewaysTexture, "texture-image.toml", scene("texture-image.toml")),
        (Mutation::NoJacobian, "rough-glass.toml", scene("rough-glass.toml")),
        (Mutation::HalfAbsorption, "absorbing-glass.toml", scene("absorbing-glass.toml")),
        (Mutation::NoLampCosine, "disk-light.toml", scene("disk-light.toml")),
        (Mutation::NoSky, "environment.toml", scene("environment.toml")),
        (Mutation::NoEmissionCosine, "emissive-objects.toml", scene("emissive-objects.toml")),
    ] {
        detected(&[mutation], name, &scene, samples_of(name), REFERENCE_SAMPLES);
    }
    for (mutation, name, factor) in [
        (Mutation::SunkenBumps, "bump.toml", 4),
        (Mutation::LampSeenTwice, "rectangle-light.toml", 8),
    ] {
        detected(&[mutation], name, &scene(name), samples_of(name), factor * REFERENCE_SAMPLES);
    }
    let mut bouncing = scene("mirror-room.toml");
    bouncing.trace.max_diffuse_depth = 2;
    let mutations = [Mutation::UniformBounce, Mutation::AmbientTwice];
    check_detection(&mutations, "mirror-room.toml", &bouncing, 2 * REFERENCE_SAMPLES);
    let name = "depth-of-field.toml";
    let focused = zoomed(&scene(name), [0.9, 1.5, -6.5], 6.0);
    let mutations = [Mutation::SquareLens, Mutation::UnfocusedLens];
    check_detection(&mutations, name, &focused, 16 * REFERENCE_SAMPLES);
    // The camera is inside the glass. For a camera outside, rays would enter and leave the glass,
    // and the errors of the index at these two surfaces would cancel.
    let mut inside = scene("rough-glass.toml");
    inside.camera.eye = [0.1, 0.85, 0.1];
    let name = "rough-glass.toml from inside";
    check_detection(&[Mutation::OtherIndex], name, &inside, REFERENCE_SAMPLES);
    for lobe in [Lobe::Cone, Lobe::Beckmann] {
        let mut scene = scene("roughness-0.3.toml");
        scene.materials.values_mut().for_each(|material| material.lobe = lobe);
        let name = format!("{lobe:?}");
        // A view in which most blocks show blurred edges.
        let mirror = zoomed(&scene, [0.0, 1.0, -2.0], 20.0);
        check_detection(&[Mutation::WiderLobe], &name, &mirror, 12 * REFERENCE_SAMPLES);
        check_detection(&[Mutation::LobeDensity], &name, &scene, REFERENCE_SAMPLES);
    }
}

/// Checks a smooth icosahedron, most of whose points are far below its curved surface, on a floor.
#[test]
fn coarse_smooth_mesh_agrees_with_reference_tracer() {
    let scene = parsed(
        "film.size = [32, 24]
         camera = { eye = [0.6, 1.2, 2.2], target = [0.0, 0.6, 0.0], view_angle.vertical = 26.0 }
         [materials.shiny]\ndiffuse = 0.7\nspecular = 0.3
         [[light]]\npoint.position = [-2.0, 1.0, 0.8]
         [[light]]\nsphere = { center = [2.0, 1.5, -1.0], radius = 0.3 }\nintensity = 8.0
         [[light]]\nenvironment = { zenith = [0.2, 0.3, 0.5] }\nintensity = 0.2
         [[object]]\nshape.platform = { center = [0.0, 0.0, 0.0], size = [9.0, 9.0] }
         [[object]]\nmaterial = \"shiny\"\nshape.mesh = { normals = \"smooth\" }
         transform = [{ scale = [1.0, 0.8, 1.2] }, { rotate_z = 20.0 }, { translate = [0.0, 0.2, 0.0] }]
         [[object]]\nshape.sphere = { center = [-0.8, 0.5, 0.3], radius = 0.2 }",
    );
    detected(&[Mutation::Unlifted], "icosahedron", &scene, SAMPLES, 4 * REFERENCE_SAMPLES);
}

/// Scene of a box that is open towards the eye, with a rough ball and a glass ball in it. An
/// environment with a gradient lights the box.
const OPEN_BOX: &str = "
    camera = { eye = [0.2, 1.2, 5.0], target = [0.0, 0.9, 0.0] }
    materials.wall = { color = [0.9, 0.8, 0.7], ambient = 0.0, diffuse = 1.0 }
    materials.rough = { diffuse = 0.5, reflection = 0.4, roughness = 0.3 }
    [[light]]
    environment = { zenith = [0.3, 0.6, 1.5], horizon = [1.0, 0.8, 0.6], nadir = [0.3, 0.1, 0.1] }
    [materials.glass]
    diffuse = 0.1
    reflection = 0.9
    transmission = 0.9
    fresnel = \"dielectric\"
    [[object]]
    material = \"wall\"
    shape.rectangle = { center = [0.0, 0.0, 0.0], size = [2.0, 2.0], normal = [0.0, 1.0, 0.0], up = [0.0, 0.0, 1.0] }
    [[object]]
    material = \"wall\"
    shape.rectangle = { center = [0.0, 2.0, 0.0], size = [2.0, 2.0], normal = [0.0, -1.0, 0.0], up = [0.0, 0.0, 1.0] }
    [[object]]
    material = \"wall\"
    shape.rectangle = { center = [0.0, 1.0, -1.0], size = [2.0, 2.0], normal = [0.0, 0.0, 1.0] }
    [[object]]
    material = \"wall\"
    shape.rectangle = { center = [-1.0, 1.0, 0.0], size = [2.0, 2.0], normal = [1.0, 0.0, 0.0] }
    [[object]]
    material = \"wall\"
    shape.rectangle = { center = [1.0, 1.0, 0.0], size = [2.0, 2.0], normal = [-1.0, 0.0, 0.0] }
    [[object]]
    material = \"rough\"
    shape.sphere = { center = [-0.4, 0.45, -0.3], radius = 0.4 }
    [[object]]
    material = \"glass\"
    shape.sphere = { center = [0.45, 0.4, 0.3], radius = 0.35 }";

/// Checks diffuse bounces among mirrors, glass, textures, bumps and smooth meshes, with and without
/// caustics.
#[test]
fn diffuse_bounces_agree_with_reference_tracer() {
    for (name, bounces, depth, caustics) in [
        ("mirror-room.toml", 1, 16, true),
        ("mirror-room.toml", 3, 2, true),
        ("mirror-room.toml", 2, 16, false),
        ("glass-solids.toml", 2, 5, true),
        ("glass-solids.toml", 2, 5, false),
        ("round-room.toml", 3, 3, true),
        ("texture-checker.toml", 2, 4, true),
        ("bump.toml", 2, 0, true),
        ("background.toml", 4, 4, true),
        ("environment.toml", 1, 16, true),
        ("environment.toml", 3, 4, false),
        ("open box in an environment", 3, 4, true),
        ("rectangle-light.toml", 4, 16, true),
        ("rectangle-light.toml", 2, 4, false),
        ("lamp-and-mirror.toml", 4, 8, true),
        ("sphere-light.toml", 1, 16, true),
        ("disk-light.toml", 2, 3, false),
        ("spot-light.toml", 3, 4, true),
        ("emissive-objects.toml", 4, 4, false),
        ("rough-glass.toml", 2, 5, true),
        ("absorbing-glass.toml", 2, 5, true),
        ("depth-of-field.toml", 3, 4, true),
    ] {
        let mut scene =
            if name.contains(' ') { small(parsed(OPEN_BOX)) } else { small(shipped(name)) };
        scene.trace.max_diffuse_depth = bounces;
        (scene.trace.max_depth, scene.trace.caustics) = (depth, caustics);
        let name = format!("{name}, {bounces} bounces, depth {depth}, caustics {caustics}");
        check_agreement(&name, &scene, FEW_SAMPLES, REFERENCE_SAMPLES / 2);
    }
}

/// Checks lenses whose apertures, by radius and by f-number, are from tiny to larger than the room.
/// The lenses are focused by distance, by point and on the target, with and without near plane.
#[test]
fn lenses_agree_with_reference_tracer() {
    let number = Aperture::FNumber;
    for (name, aperture, focus, near) in [
        ("mirror-room.toml", Aperture::Radius(1e-9), None, 0.0),
        ("mirror-room.toml", number(0.05), None, 0.0),
        ("mirror-room.toml", Aperture::Radius(4.0), Some(Focus::Distance(6.0)), 0.0),
        ("mirror-room.toml", Aperture::Radius(0.3), Some(Focus::Point([0.0, 0.0, 2.0])), 2.5),
        ("glass-solids.toml", Aperture::Radius(0.1), None, 0.0),
        ("reflecting-tracks-lit.toml", Aperture::Radius(1.0), Some(Focus::Distance(5.0)), 0.0),
    ] {
        let mut scene = small(shipped(name));
        (scene.camera.aperture, scene.camera.focus) = (Some(aperture), focus);
        scene.camera.near = near;
        if scene.camera.target.is_none() && focus.is_none() {
            scene.camera.focus = Some(Focus::Distance(5.0));
        }
        assert_eq!(scene.faults(), []);
        let name = format!("{name}, {aperture:?}, {focus:?}, near {near}");
        check_agreement(&name, &scene, FEW_SAMPLES, REFERENCE_SAMPLES);
    }
}

/// Returns a scene of rough absorbing glass: a pane, a ball that contains a ball of air, and a box
/// that stands on a floor. `keys` are further keys of the glass material.
fn rough_glass(keys: &str) -> Scene {
    let text = format!(
        "camera = {{ eye = [0.5, 0.75, 4.0], target = [0.0, 0.0, 0.0] }}
        background.color = [0.25, 0.5, 1.0]
        ambient.color = [0.5, 0.5, 0.5]
        materials.air = {{ diffuse = 0.0, transmission = 1.0, ior = 1.0 }}
        materials.tiles.texture.checker = {{ scale = [1.0, 1.0] }}
        [[light]]
        point = {{ position = [2.0, 4.0, 3.0] }}
        [materials.glass]
        diffuse = 0.25
        reflection = 0.75
        transmission = 0.75
        attenuation_color = [0.9, 0.5, 0.0]
        attenuation_distance = 1.5
        {keys}
        [[object]]
        material = \"glass\"
        shape.rectangle = {{ center = [-1.0, 0.0, 0.5], size = [1.0, 1.5], normal = [0.2, 0.0, 1.0] }}
        [[object]]
        material = \"glass\"
        shape.sphere = {{ center = [0.9, 0.0, 0.5], radius = 0.6 }}
        [[object]]
        material = \"air\"
        shape.sphere = {{ center = [0.9, 0.1, 0.6], radius = 0.3 }}
        [[object]]
        material = \"glass\"
        shape.box = {{ center = [0.0, -0.7, 0.0], size = [1.0, 0.6, 0.5] }}
        [[object]]
        material = \"tiles\"
        shape.plane = {{ point = [0.0, -1.0, 0.0], normal = [0.0, 1.0, 0.0] }}"
    );
    small(parsed(&text))
}

/// Checks every lobe of rough glass, two-sided with Fresnel's equations and with Schlick's formula,
/// and one-sided. A glass box touches the floor. Each case has two pictures: lobe directions below
/// the surface are mirrored up in one and absorbed in the other. Microfacet lobes do not depend on
/// this setting, so both of their pictures must be equal, and only one is compared.
#[test]
fn rough_and_absorbing_glass_agrees_with_reference_tracer() {
    for lobe in [
        "lobe = \"cone\"\nroughness = 0.4",
        "lobe = \"square\"\nroughness = 0.7",
        "lobe = \"beckmann\"\nalpha = 0.3",
        "lobe = \"beckmann\"\nalpha = 0.6\nmasking = \"smith\"",
        "lobe = \"ggx\"\nalpha = 0.3",
        "lobe = \"ggx\"\nalpha = 0.6\nmasking = \"smith\"",
    ] {
        for law in
            ["dielectric", "schlick\"\nf0 = \"#c0a080", "dielectric\"\ntwo_sided = false\n#\""]
        {
            let mut scene = rough_glass(&format!("{lobe}\nfresnel = \"{law}\""));
            let name = format!("{lobe:?}, {law:?}");
            scene.trace.below_horizon = BelowHorizon::Fold;
            check_agreement(&format!("{name}, Fold"), &scene, FEW_SAMPLES, REFERENCE_SAMPLES);
            let folded = scene.clone();
            scene.trace.below_horizon = BelowHorizon::Absorb;
            if lobe.contains("alpha") {
                let few = |scene: &Scene| replicates(scene, 8, SamplerKind::Sobol);
                assert!(
                    few(&scene) == few(&folded),
                    "{name}: depends on directions below the surface"
                );
            } else {
                check_agreement(&format!("{name}, Absorb"), &scene, FEW_SAMPLES, REFERENCE_SAMPLES);
            }
        }
    }
}

/// Checks that single samples have the same variance in the program, with independent random
/// numbers, and in the reference tracer. Both sample the lobes of the tested scenes with equal
/// densities.
#[test]
fn variances_agree_under_independent_random_numbers() {
    for name in ["lobe-cone.toml", "lobe-square.toml", "mirror-room.toml"] {
        let scene = small(shipped(name));
        let reference = reference(&scene, REFERENCE_SAMPLES, Mutation::None).unwrap();
        let samples = MANY_SAMPLES;
        let (_, half) = replicates(&scene, samples, SamplerKind::Random);
        let z = variances_differ_by(&reference, REFERENCE_SAMPLES, &half, samples, scene.film.size);
        println!("{name}: {z:.2} standard errors");
        assert!(z < 4.0, "{name}: variances differ by {z:.2} standard errors");
    }
}

#[test]
fn one_sided_transparent_objects_reflect_on_their_front_only() {
    for law in ["constant", "schlick\"\nf0 = \"#806040", "dielectric"] {
        for side in [1.0, -1.0] {
            let text = format!(
                "camera = {{ eye = [0.5, 0.75, {}], target = [0.0, 0.0, 0.0] }}
                background.color = [0.25, 0.5, 1.0]
                ambient.color = [0.5, 0.5, 0.5]
                [[light]]
                point = {{ position = [2.0, 4.0, {}] }}
                [materials.glass]
                diffuse = 0.25
                reflection = 0.75
                transmission = 0.5
                fresnel = \"{law}\"
                two_sided = false
                [[object]]
                material = \"glass\"
                shape.rectangle = {{ center = [0.0, 0.0, 0.0], size = [2.0, 1.5], normal = [0.0, 0.0, 1.0] }}
                [[object]]
                material = \"glass\"
                shape.sphere = {{ center = [1.25, 0.0, 0.5], radius = 0.5 }}
                [[object]]
                shape.plane = {{ point = [0.0, -1.0, 0.0], normal = [0.0, 1.0, 0.0] }}",
                4.0 * side,
                3.0 * side,
            );
            let scene = small(parsed(&text));
            let name = format!("{law:?} from {side}");
            check_agreement(&name, &scene, SAMPLES, 2 * REFERENCE_SAMPLES);
        }
    }
}
