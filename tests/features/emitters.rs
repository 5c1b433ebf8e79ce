//! Tests of lights with a size, and of many lights.

use crate::features::row::*;
use crate::harness::*;
use crate::reference::*;
use zerkalo_scene::light::{Environment, LightUnit, SphereLight};

/// Checks that the picture of `file` agrees with the reference tracer. The picture of each of
/// `mutations`, changed versions of the scene, must disagree.
fn alike(file: &str, mutations: &[(&str, Change)]) {
    let original = shipped(file);
    row(file, |tested| agrees(&original, tested, REFERENCE_SAMPLES), mutations);
}

fn lamp(scene: &mut Scene) -> &mut Light {
    &mut scene.lights[0]
}

fn radius(scene: &mut Scene) -> &mut f64 {
    match &mut lamp(scene).kind {
        LightKind::Sphere(sphere) => &mut sphere.radius,
        LightKind::Disk(disk) => &mut disk.radius,
        kind => panic!("a {} light has no radius", kind.key()),
    }
}

fn rectangle(scene: &mut Scene) -> &mut RectangleLight {
    match &mut lamp(scene).kind {
        LightKind::Rectangle(rectangle) => rectangle,
        kind => panic!("a {} light is no rectangle", kind.key()),
    }
}

#[test]
fn d4_sphere_light() {
    alike(
        "sphere-light.toml",
        &[
            ("a point", &|s| {
                let position = lamp(s).position().unwrap();
                lamp(s).kind = Point { position }.into();
            }),
            ("a smaller sphere of the same power", &|s| {
                *radius(s) *= 0.5;
                lamp(s).intensity *= 4.0;
            }),
            ("invisible", &|s| lamp(s).visible = false),
            ("another place", &|s| lamp(s).position_mut().unwrap()[0] += 0.3),
            ("half the radiance", &|s| lamp(s).intensity *= 0.5),
        ],
    );
}

#[test]
fn d5_rectangle_light() {
    alike(
        "rectangle-light.toml",
        &[
            ("a visible window", &|s| s.lights[1].visible = true),
            ("an invisible ceiling lamp", &|s| lamp(s).visible = false),
            ("the wrong side", &|s| lamp(s).kind.handles().direction.unwrap()[1] = 1.0),
            ("sides exchanged", &|s| rectangle(s).size.reverse()),
            ("power for radiance", &|s| lamp(s).unit = LightUnit::Power),
            ("a diffuse floor", &|s| material(s, "floor").reflection = 0.0),
        ],
    );
    let filled = |height: f64| {
        let side = 0.5 * height;
        let light = format!(
            "[[light]]\nrectangle = {{ center = [0.0, {height:?}, 0.0], size = [{side:?}, {side:?}], \
             normal = [0.0, -1.0, 0.0] }}"
        );
        let mirror = "ambient = 0\ndiffuse = 0\nreflection = 0.7\nlobe = \"cone\"\nroughness = 0.2";
        let scene = receiver(DVec3::Y, mirror, &light);
        (format!("height {height}"), scene, 0.7)
    };
    // A light that fills the cone lobe. Sampled points of the light and reflected rays both find
    // all of its light. The weights of these two techniques are 0.22 and 0.78.
    check_means(&[filled(0.5), filled(1.0), filled(20.0)], 1 << 14, [1e-4, 1e-9]);
}

#[test]
fn d8_disk_light() {
    alike(
        "disk-light.toml",
        &[
            ("half the size", &|s| *radius(s) *= 0.5),
            ("facing the wall", &|s| *lamp(s).kind.handles().direction.unwrap() = [0.0, 0.0, -1.0]),
            ("radiance for power", &|s| lamp(s).unit = LightUnit::Radiance),
            ("another place", &|s| lamp(s).position_mut().unwrap()[1] += 0.2),
        ],
    );
}

#[test]
fn d12_sun() {
    fn sun(scene: &mut Scene) -> &mut Directional {
        match &mut lamp(scene).kind {
            LightKind::Directional(sun) => sun,
            kind => panic!("a {} light is no sun", kind.key()),
        }
    }
    alike(
        "sun.toml",
        &[
            ("parallel rays", &|s| sun(s).angle = 0.0),
            ("half the angle", &|s| sun(s).angle *= 0.5),
            ("another direction", &|s| sun(s).direction[0] = 0.7),
            ("invisible", &|s| lamp(s).visible = false),
            ("half the intensity", &|s| lamp(s).intensity *= 0.5),
        ],
    );
}

#[test]
fn d9_environment() {
    fn sky(scene: &mut Scene) -> &mut Environment {
        lamp(scene).environment_mut().unwrap()
    }
    alike(
        "environment.toml",
        &[
            ("no environment", &|s| lamp(s).on = false),
            ("invisible", &|s| lamp(s).visible = false),
            ("upside down", &|s| {
                let (zenith, nadir) = (sky(s).zenith, sky(s).nadir);
                (sky(s).zenith, sky(s).nadir) = (nadir, zenith);
            }),
            ("a constant", &|s| sky(s).horizon = sky(s).zenith),
            ("half the intensity", &|s| lamp(s).intensity *= 0.5),
        ],
    );
    // A diffuse bounce that leaves the scene must add no light of the environment.
    let mut bouncing = shipped("environment.toml");
    bouncing.trace.max_diffuse_depth = 2;
    agrees(&bouncing, &bouncing, REFERENCE_SAMPLES)
        .unwrap_or_else(|e| panic!("two diffuse bounces: {e}"));
}

#[test]
fn d10_emissive_objects() {
    alike(
        "emissive-objects.toml",
        &[
            ("a dark ball", &|s| material(s, "ball").emission = 0.0),
            ("a dark box", &|s| material(s, "box").emission = 0.0),
            ("a dark crystal", &|s| material(s, "crystal").emission = 0.0),
            ("a dark ring", &|s| material(s, "ring").emission = 0.0),
            ("a brighter sign", &|s| material(s, "sign").emission *= 1.2),
            ("a sign with two sides", &|s| material(s, "sign").two_sided = true),
            ("no bounce that finds the ring", &|s| s.trace.max_diffuse_depth = 0),
        ],
    );
}

#[test]
fn d11_many_lights() {
    alike(
        "many-lights.toml",
        &[
            ("three lamps switched off", &|s| s.lights[..3].iter_mut().for_each(|l| l.on = false)),
            ("the second string without its lamps", &|s| s.lights.truncate(20)),
            ("no falloff", &|s| s.lights[..20].iter_mut().for_each(|l| l.falloff = Falloff::None)),
            ("strings exchanged", &|s| {
                let colors: Vec<_> = s.lights.iter().map(|light| light.color).collect();
                let lights = s.lights.iter_mut().rev();
                lights.zip(colors).for_each(|(light, color)| light.color = color);
            }),
            ("no shadows", &|s| s.trace.ray_types = RayTypes::Primary),
            ("a darker mirror", &|s| material(s, "mirror").reflection = 0.6),
        ],
    );
    let mut bulbs = shipped("many-lights.toml");
    for light in &mut bulbs.lights[..20] {
        let center = *light.position_mut().unwrap();
        light.kind = LightKind::Sphere(SphereLight { center, radius: 0.1 });
        (light.falloff, light.intensity) = (Falloff::None, light.intensity * 30.0);
    }
    assert!(bulbs.faults().is_empty(), "{}", bulbs.faults()[0]);
    agrees(&bulbs, &bulbs, REFERENCE_SAMPLES).unwrap();
}

/// Returns `scene` without named groups: their mixes are in the emissions of their lights.
fn ungrouped(scene: &Scene) -> Scene {
    let mut scene = scene.clone();
    let groups = std::mem::take(&mut scene.groups);
    let mixed = |group: &mut String, color: &mut Color| {
        let factor = groups.get(&std::mem::take(group)).map_or([1.0; 3], |group| group.factor());
        color.0.iter_mut().zip(factor).for_each(|(channel, factor)| *channel *= factor);
    };
    scene.lights.iter_mut().for_each(|light| mixed(&mut light.group, &mut light.color));
    let materials = scene.materials.values_mut();
    materials.for_each(|material| mixed(&mut material.group, &mut material.emission_color));
    scene
}

/// Checks that the film of the scene, mixed for other groups, equals a render of lights with these
/// emissions: the samples are the same, and the sums differ by rounding.
#[test]
fn d13_named_groups() {
    let small = |scene: &Scene| sized(scene.clone(), [64, 48]);
    let fresh = |scene: &Scene| {
        let rendering = rendered(&small(&ungrouped(scene)), 4, Precision::Single, 4);
        picture(&rendering, Replicates::Both)
    };
    let original = shipped("named-groups.toml");
    let kept = rendered(&small(&original), 4, Precision::Single, 4);
    let groups = &kept.world.info().groups;
    assert_eq!(groups.names(&original), ["left", "right", "lone"]);
    let mixed = |scene: &Scene| {
        let mix = LightWeights { weights: groups.weights(scene) };
        let rows = 0..kept.film.header.height;
        rows.flat_map(|y| kept.film.row(y, Replicates::Both, &mix)).collect::<Vec<_>>()
    };
    let same = |of: &[[f64; 3]], other: &[[f64; 3]]| {
        let differences = of.as_flattened().iter().zip(other.as_flattened());
        let largest = differences.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        ensure(largest < 1e-5, || format!("they differ by {largest}"))
    };
    let expected = fresh(&original);
    let changes: [(&str, Change); 4] = [
        ("a group dimmed", &|s| s.groups.get_mut("left").unwrap().intensity = 0.1),
        ("another colour", &|s| s.groups.get_mut("right").unwrap().color = Color::WHITE),
        ("both groups", &|s| {
            s.groups.get_mut("left").unwrap().color = Color([0.2, 0.9, 0.4]);
            s.groups.get_mut("right").unwrap().intensity = 0.3;
        }),
        ("the lone lamp brighter", &|s| s.lights[0].intensity = 0.5),
    ];
    row("named-groups.toml", |tested| same(&mixed(tested), &expected), &changes);
    for (what, change) in changes {
        let mut scene = original.clone();
        change(&mut scene);
        assert!(groups.can_reuse(kept.scene(), &small(&scene)), "{what} needs new samples");
        same(&mixed(&scene), &fresh(&scene)).unwrap_or_else(|e| panic!("{what}: {e}"));
    }
    let mut alone = original.clone();
    alone.film.solo = "right".to_string();
    let mut others_off = original.clone();
    others_off.groups.get_mut("left").unwrap().on = false;
    others_off.lights[0].on = false;
    same(&mixed(&alone), &mixed(&others_off)).unwrap();
    let black = groups.weights(&alone).iter().filter(|weight| **weight == [0.0; 3]).count();
    assert_eq!(black, 2, "the others are black");
    let mut apart = small(&original);
    apart.lights[1].intensity *= 2.0;
    assert!(!groups.can_reuse(kept.scene(), &apart));
    let reason = groups.restart_reason(kept.scene(), &apart).unwrap();
    assert!(reason.contains("11 lights of left"), "{reason}");
}
