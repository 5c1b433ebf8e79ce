//! What the program says about the limits of its paths, held against pictures without them.

#[path = "common/mod.rs"]
mod common;
mod support;

use common::Numbers;
use std::fmt::Write;
use support::{parsed, picture, rendered};
use zerkalo::film::Replicates;
use zerkalo::scene::Scene;
use zerkalo::shape::EXAMPLES;
use zerkalo::world::{self, AnyWorld, Precision};

const SAMPLES: u32 = 4;

/// What is said of a limit.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Told {
    Nothing,
    BoundingVolume(f64),
    NoBound,
}

fn told(scene: &Scene, limit: &str) -> Told {
    let all = AnyWorld::compile(scene, &world::Options::default()).biases();
    let Some(text) = all.iter().find(|text| text.starts_with(limit)) else { return Told::Nothing };
    match text.split_once("at most ") {
        Some((_, rest)) => Told::BoundingVolume(rest.split(' ').next().unwrap().parse().unwrap()),
        None => Told::NoBound,
    }
}

/// A random scene in which no surface is brighter than the number beside it.
fn random(seed: u64) -> (Scene, f64) {
    let mut numbers = Numbers::new(seed);
    let n = &mut numbers;
    let things = 1 + [0, 0, 1, 2][n.below(4)];
    let near = [0.0, 0.0, 0.0, 0.5][n.below(4)];
    let depth = [0, 1, 1, 2, 3, 5, 8][n.below(7)];
    let least = [0.0, 0.0, 0.01, 0.2][n.below(4)];
    let eye = n.direction() * [0.3, 1.2, 4.0, 4.0][n.below(4)];
    let mut text = format!(
        "film = {{ size = [10, 8] }}\ntrace = {{ max_depth = {depth}, min_throughput = {least:?} }}
        camera = {{ eye = {:?}, target = [0.01, 0.3, 0.02], near = {near:?}, view_angle.vertical = {:?} }}
        background.color = [1.0, 0.5, 0.25]\nambient.color = [1.0, 1.0, 1.0]
        [[light]]\npoint = {{ position = {:?} }}\nintensity = 0.5\n",
        eye.to_array(),
        n.between(20.0, 70.0),
        (n.direction() * 6.0).to_array(),
    );
    for i in 0..2 * things {
        // Of the second half parts are made.
        let mut lines = vec![
            format!("color = [{:?}, {:?}, 0.9]", n.unit(), n.unit()),
            format!("specular = {:?}", [0.0, 0.5][n.below(2)]),
            format!("two_sided = {}", n.below(3) > 0),
        ];
        if n.below(3) > 0 {
            lines.push(format!("reflection = {:?}", [0.05, 0.3, 0.9, 1.5][n.below(4)]));
            lines.push(format!("lobe = \"{}\"", ["mirror", "cone", "square", "ggx"][n.below(4)]));
            lines.push(format!("roughness = {:?}", [0.0, 0.2, 2.0][n.below(3)]));
        }
        if n.below(3) == 0 {
            lines.push(format!("transmission = {:?}", [0.05, 0.4, 1.0, 1.2][n.below(4)]));
            lines.push(format!("ior = {:?}", [1.0, 1.5, 0.7][n.below(3)]));
        }
        match n.below(4) {
            0 => lines.push("fresnel = \"dielectric\"".into()),
            1 => lines.push("fresnel = \"schlick\"\nf0 = [0.1, 0.5, 0.2]".into()),
            2 => lines.push("metal = \"copper\"".into()),
            _ => {}
        }
        if n.below(3) == 0 {
            lines.push("texture.checker = { scale = [3.0, 3.0] }".into());
        }
        if n.below(3) == 0 {
            let image =
                "bump.image = { file = \"scenes/textures/brick-heights.png\", height = 0.3 }";
            lines.push(image.into());
        }
        write!(text, "[materials.m{i}]\n{}\n", lines.join("\n")).unwrap();
    }
    for i in 0..things {
        let (_, example) = EXAMPLES[n.below(EXAMPLES.len())];
        // Parts get the materials of the second half.
        let own = format!("material = \"m{}\", shape.", things + i);
        let example = example.replacen("{ shape.", &format!("{{ {own}"), 1);
        let example = example.replace("knot.ply", "stone.obj");
        let at = n.in_cube(if things == 1 { 0.0 } else { 1.0 });
        write!(
            text,
            "[[object]]\nmaterial = \"m{i}\"\n{example}\n\
             transform = [{{ rotate_x = {:?} }}, {{ translate = {:?} }}]\n",
            n.between(-180.0, 180.0),
            at.to_array(),
        )
        .unwrap();
    }
    let scene = parsed(&text);
    // Ambient light and half as much from the lamp, a highlight, the background.
    (scene, 1.0 + 0.5 + 0.25)
}

fn values(scene: &Scene) -> Vec<f64> {
    picture(&rendered(scene, 3, Precision::Single, SAMPLES), Replicates::Both).concat()
}

fn apart(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

fn deeper(scene: &Scene) -> Scene {
    let mut deeper = scene.clone();
    deeper.trace.max_depth = 2 * scene.trace.max_depth + 7;
    deeper
}

fn checked(seeds: std::ops::Range<u64>) {
    let mut counts = [[0; 3]; 2];
    for seed in seeds {
        let (scene, brightest) = random(seed);
        let picture = values(&scene);
        let mut unweighted = scene.clone();
        unweighted.trace.min_throughput = 0.0;
        let others = [("max_depth", deeper(&scene)), ("min_throughput", unweighted)];
        for (row, (limit, other)) in others.iter().enumerate() {
            let off = apart(&picture, &values(other));
            match told(&scene, limit) {
                Told::Nothing => {
                    counts[row][0] += 1;
                    assert!(off == 0.0, "seed {seed}: {limit} cuts {off:e}, not a word of it");
                }
                Told::BoundingVolume(bound) => {
                    counts[row][1] += 1;
                    let allowed = bound * brightest * (1.0 + 1e-4) + 1e-7;
                    assert!(off <= allowed, "seed {seed}: {limit} cuts {off:e} of {bound:e}");
                }
                Told::NoBound => counts[row][2] += 1,
            }
        }
    }
    println!("nothing, bound, no bound: max_depth {:?}, min_throughput {:?}", counts[0], counts[1]);
    assert!(counts[0][0] > 20 && counts[0][1] > 20 && counts[1][1] > 10, "{counts:?}");
}

#[test]
fn what_is_said_of_the_limits_holds() {
    checked(0..400);
}

#[test]
#[ignore = "takes minutes"]
fn what_is_said_of_the_limits_holds_in_many_more_scenes() {
    checked(400..6000);
}

/// A lone ball that light enters: bumps, and rounding at its rim, keep some of it inside.
#[test]
fn a_lone_glass_ball_is_cut_by_depth() {
    let text = |more: &str, camera: &str| {
        format!(
            "film = {{ size = [24, 18], filter = \"point\" }}\ntrace.max_depth = 2
            background.color = [1.0, 1.0, 1.0]\nambient.color = [1.0, 1.0, 1.0]
            [camera]\n{camera}
            [materials.glass]\ndiffuse = 0.0\ncolor = [0.1, 0.1, 0.1]\ntransmission = 0.9\n{more}
            [[object]]\nmaterial = \"glass\"
            shape.sphere = {{ center = [0.0, 0.0, 0.0], radius = 1.0 }}"
        )
    };
    let bump = "bump.image = { file = \"scenes/textures/brick-heights.png\", height = 0.3 }";
    let whole = "eye = [0.0, 0.0, 5.0]\ntarget = [0.0, 0.0, 0.0]";
    let bumped = parsed(&text(bump, whole));
    let off = apart(&values(&bumped), &values(&deeper(&bumped)));
    assert!(off > 0.01 && told(&bumped, "max_depth") == Told::NoBound, "{off}");
    // The rim as seen from the eye: at cos = 1/5 from the axis. There rounding decides whether light gets out.
    let mut numbers = Numbers::new(4);
    let (mut cut, rounds) = (0, 240);
    for round in 0..rounds {
        let axis = numbers.direction();
        let across = axis.cross(numbers.direction()).normalize();
        let (eye, rim) = (axis * 5.0, axis * 0.2 + across * (1.0f64 - 0.04).sqrt());
        let degrees = [1e-3, 1e-4, 1e-5][round % 3];
        let index = [0.75, 1.25, 1.5, 2.0][round % 4];
        let camera = format!(
            "eye = {:?}\ntarget = {:?}\nup = {:?}\nview_angle.vertical = {degrees:?}",
            eye.to_array(),
            rim.to_array(),
            axis.cross(across).to_array()
        );
        let rim =
            parsed(&text(&format!("ior = {index:?}"), &camera).replace("\"point\"", "\"box\""));
        assert!(told(&rim, "max_depth") == Told::NoBound);
        cut += u32::from(apart(&values(&rim), &values(&deeper(&rim))) > 0.0);
    }
    println!("at the rim depth 2 cuts something in {cut} of {rounds} pictures");
    assert!(cut > rounds as u32 / 10, "rounding at the rim is told of, but does not happen");
}

/// A flat or convex mirror alone is met once, whatever the angle.
#[test]
fn a_lone_mirror_is_met_once() {
    let mut numbers = Numbers::new(9);
    let mut worst = Vec::new();
    let kinds = ["plane", "rectangle", "platform", "box", "sphere", "cylinder", "cone", "prism"];
    for round in 0..160 {
        let (kind, example) =
            EXAMPLES.iter().find(|(key, _)| *key == kinds[round % kinds.len()]).unwrap();
        let lobe = ["mirror", "cone", "square", "ggx"][(round / kinds.len()) % 4];
        let up = numbers.direction();
        let text = format!(
            "film = {{ size = [24, 18] }}\ntrace.max_depth = 1
            background.color = [1.0, 1.0, 1.0]\nambient.color = [1.0, 1.0, 1.0]
            [camera]\neye = [0.0, 0.0, 4.0]\ntarget = [0.0, 0.0, 0.0]\nview_angle.vertical = 40.0
            [materials.m]\ncolor = [0.5, 0.5, 0.5]\nreflection = 0.9\nlobe = \"{lobe}\"\nroughness = 0.5
            [[object]]\nmaterial = \"m\"\n{example}
            transform = [{{ rotate = {{ axis = {:?}, degrees = {:?} }} }}, {{ translate = [0.1, -0.4, 0.2] }}]",
            up.to_array(),
            numbers.between(0.0, 180.0)
        );
        let mut scene = parsed(&text);
        if told(&scene, "max_depth") != Told::Nothing {
            continue;
        }
        // Along the surface: its plane, seen at a grazing angle and so narrowly that all pixels graze.
        if round % 2 == 1
            && let Some((low, high)) = scene.objects[0].form().bounds()
        {
            let corner = if numbers.below(2) == 0 { low } else { high };
            scene.camera.target = Some(corner.to_array());
        }
        let off = apart(&values(&scene), &values(&deeper(&scene)));
        if off > 0.0 {
            worst.push(format!("{round}: {kind}, {lobe}: {off:e}"));
        }
    }
    assert!(worst.is_empty(), "{}", worst.join("\n"));
}
