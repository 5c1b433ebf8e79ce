//! White furnaces: white objects in surroundings of radiance 1 are white, whatever lights them.

use crate::harness::*;

/// Surroundings of radiance 1 that only rays find.
const BACKGROUND: &str = "background.color = [1, 1, 1]";

/// Surroundings of radiance 1: lights with sampled points, and walls; the last two walls are found
/// by rays only.
const SAMPLED: [&str; 7] = [
    "[[light]]\nenvironment = {}",
    "[[light]]\nsphere = { center = [0.1, 0.2, 0.0], radius = 3.0 }",
    "sphere = { center = [0.1, 0.2, 0.0], radius = 2.0 }",
    "box = { center = [0.1, 0.2, 0.0], size = [2.0, 3.0, 2.5] }",
    "mesh = { file = \"\", normals = \"flat\" }\n\
     transform = [{ scale = 4.0 }, { translate = [0.0, -2.0, 0.0] }]",
    "cylinder = { base = [0.0, -1.0, 0.0], top = [0.0, 1.5, 0.0], radius = 1.2 }",
    "torus = { center = [0.0, 0.0, 2.0], axis = [0.0, 1.0, 0.0], ring = 2.0, tube = 0.9 }",
];

const GLASS: &str = "reflection = 1.0\ntransmission = 1.0\nfresnel = \"dielectric\"";

/// Returns the scene of a ball with the material `material` in `surroundings`. `rest` is the text of
/// further objects and materials.
fn furnace(surroundings: &str, material: &str, rest: &str) -> Scene {
    let is_wall = !surroundings.starts_with("[[light]]") && !surroundings.starts_with("background");
    let wall = format!("[[object]]\nmaterial = \"lamp\"\nshape.{surroundings}");
    let unset = ["ambient", "diffuse"].map(|key| match material.contains(key) {
        true => String::new(),
        false => format!("{key} = 0\n"),
    });
    parsed(&format!(
        "film.size = [8, 6]\ntrace.max_depth = 10000\n\
         camera = {{ eye = [0.4, 0.3, 0.5], target = [0, 0, 0], view_angle.vertical = 36 }}\n{}\n\
         [materials.lamp]\ncolor = [0, 0, 0]\nemission = 1\n\
         [materials.tested]\ncolor = [1, 1, 1]\n{}{material}\n\
         [[object]]\nmaterial = \"tested\"\nshape.sphere = {{ center = [0, 0, 0], radius = 0.25 }}\n\
         {}\n{rest}",
        if is_wall { "" } else { surroundings },
        unset.concat(),
        if is_wall { &wall } else { "" },
    ))
}

/// Checks that every sample is white where only rays find the light: with all lobes that lose
/// nothing, and with clear and rough glass of every index, also with a bubble in it.
#[test]
fn closed_form_7_a_white_furnace_is_exact() {
    fn check<L: SimdFloat>(scene: &Scene, tolerance: f64) {
        for sample in samples::<L>(scene, 16) {
            assert!(sample.iter().all(|c| (c - 1.0).abs() <= tolerance), "{}: {sample:?}", L::NAME);
        }
    }
    let mut materials = Vec::new();
    for lobe in ["mirror", "cone", "square"] {
        for roughness in [0.0, 1e-3, 0.3, 3.0, 1e4] {
            materials.push((
                format!("reflection = 1\nlobe = \"{lobe}\"\nroughness = {roughness:?}"),
                "",
            ));
        }
    }
    let bubble = format!(
        "[materials.air]\nambient = 0\ndiffuse = 0\nior = 1\n{GLASS}\n[[object]]\n\
         material = \"air\"\nshape.sphere = {{ center = [0.07, 0.05, 0.02], radius = 0.1 }}"
    );
    for ior in [0.7, 1.0, 1.5, 1e3] {
        let glass = format!("{GLASS}\nior = {ior:?}");
        materials.push((glass.clone(), ""));
        // Total reflection would trap light in glass of index 1000 around a bubble.
        if ior < 100.0 {
            materials.push((glass, &bubble));
        }
    }
    for lobe in ["cone", "square"] {
        for roughness in [1e-3, 0.3, 3.0] {
            let rough = format!("{GLASS}\nlobe = \"{lobe}\"\nroughness = {roughness:?}");
            materials.push((rough, ""));
        }
    }
    for (material, rest) in &materials {
        println!("{material}");
        let scene = furnace(BACKGROUND, material, rest);
        let glass = material.starts_with(GLASS);
        check::<Double>(&scene, if glass { 1e-9 } else { 0.0 });
        check::<Single>(&scene, if glass { 1e-3 } else { 0.0 });
    }
    let scene = shipped("furnace.toml");
    check::<Single>(&scene, 0.0);
    check::<Double>(&scene, 0.0);
}

/// Checks all surroundings whose light is found by sampled points, by rays, or by both. A diffuse
/// bounce that reaches them must not add their light a second time; where no points are sampled,
/// diffuse objects need the bounce.
#[test]
fn white_ball_is_white_in_every_furnace() {
    let narrow = &*format!("{GLASS}\nroughness = 1e-6");
    let materials = [
        "diffuse = 1",
        "diffuse = 0.5\nreflection = 0.5\nroughness = 0.2",
        "reflection = 1",
        "reflection = 1\nroughness = 0.05",
        "reflection = 1\nroughness = 0.5",
        "reflection = 1\nroughness = 0.4\nlobe = \"square\"",
        "reflection = 1\nroughness = 1.5\nlobe = \"square\"",
        "reflection = 1\nroughness = 1e-5",
        "reflection = 1\nroughness = 1e-7",
        "reflection = 1\nroughness = 1e-6\nlobe = \"square\"",
        "reflection = 1\nroughness = 1e-30\nlobe = \"square\"",
        GLASS,
        narrow,
    ];
    let mut cases = Vec::new();
    for (i, surroundings) in SAMPLED.into_iter().enumerate() {
        for material in materials {
            for bounces in [0, 1, 3] {
                let diffuse = material.starts_with("diffuse");
                if (bounces > 0 && !diffuse) || (bounces == 0 && diffuse && i >= 5) {
                    continue;
                }
                let mut scene = furnace(surroundings, material, "");
                scene.trace.max_diffuse_depth = bounces;
                cases.push((
                    format!("{material}, {bounces} bounces in {surroundings}"),
                    scene,
                    1.0,
                ));
            }
        }
    }
    check_means(&cases, 1 << 8, [1e-4, 1e-6]);
}

/// Checks a scene whose objects light each other, at every limit on the number of diffuse bounces.
/// Ambient light of the same radiance replaces the bounces beyond the limit.
#[test]
fn furnace_is_white_at_every_diffuse_depth() {
    let surroundings = "background.color = [1, 1, 1]\nambient.color = [1, 1, 1]";
    let object = |material: &str, keys: &str, shape: &str| {
        format!(
            "[materials.{material}]\ncolor = [1, 1, 1]\n{keys}\n\
             [[object]]\nmaterial = \"{material}\"\nshape.{shape}\n"
        )
    };
    let opaque = object(
        "white",
        "ambient = 1\ndiffuse = 1",
        "platform = { center = [0, -0.2, 0], size = [4, 4] }",
    ) + &object(
        "half",
        "ambient = 0.5\ndiffuse = 0.5\nreflection = 0.5\nroughness = 0.3",
        "cube = { corner = [-0.3, -0.2, 0.2], edge = 0.3, rotation = 25 }",
    );
    let glass = object(
        "glass",
        "ambient = 0.25\ndiffuse = 0.25\nreflection = 0.25\ntransmission = 0.5",
        "rectangle = { center = [0.1, 0.1, 0.3], size = [0.2, 0.2], normal = [0.1, 0.0, 1.0] }",
    );
    for rest in [opaque.clone(), opaque + &glass] {
        for bounces in [0, 1, 2, 3, 5] {
            let mut scene = furnace(surroundings, "ambient = 1\ndiffuse = 1", &rest);
            (scene.trace.max_depth, scene.trace.max_diffuse_depth) = (64, bounces);
            for precision in [Precision::Single, Precision::Double] {
                let rendering = rendered(&scene, 11, precision, 64);
                // Every path has the throughput 1 where it ends, apart from rounding. Paths of more
                // bounces play Russian roulette after some ambient light was added.
                let tolerance =
                    if bounces > 3 && !rest.contains("transmission") { 0.05 } else { 1e-3 };
                let pixels = picture(&rendering, Replicates::Both);
                for pixel in &pixels {
                    let off = (pixel[0] - 1.0).abs();
                    assert!(off < tolerance, "{bounces}, {precision:?}: {pixel:?}");
                }
                let mean = pixels.iter().map(|p| p[0]).sum::<f64>() / pixels.len() as f64;
                assert!((mean - 1.0).abs() < 1e-3, "{bounces}, {precision:?}: mean {mean}");
            }
        }
    }
}
