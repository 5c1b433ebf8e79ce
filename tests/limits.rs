//! Truncation bias that the program reports for `max_depth` and `min_throughput`. It is compared
//! with the true bias, the difference between pictures with and without these limits.

use crate::harness::*;

const SAMPLES: u32 = 4;

/// Truncation bias that the program reports for `max_depth` or for `min_throughput`.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Bias {
    /// The program reports no bias for the limit.
    Zero,
    /// The bias is at most this radiance, if the brightest surface has unit radiance.
    AtMost(f64),
    /// The program reports a bias without an upper bound.
    Unbounded,
}

fn reported_bias(scene: &Scene, limit: &str) -> Bias {
    let all = AnyWorld::compile(scene, &world::Options::default()).info().biases.clone();
    let Some(text) = all.iter().find(|text| text.starts_with(limit)) else { return Bias::Zero };
    match text.split_once("at most ") {
        Some((_, rest)) => Bias::AtMost(rest.split(' ').next().unwrap().parse().unwrap()),
        None => Bias::Unbounded,
    }
}

/// Returns a random scene, and an upper bound of the radiance of its surfaces.
fn random(seed: u64) -> (Scene, f64) {
    let mut numbers = Numbers::new(seed);
    let n = &mut numbers;
    let objects = 1 + [0, 0, 1, 2][n.below(4)];
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
    for i in 0..2 * objects {
        // The first half of the materials is for objects, the second half for parts of compounds.
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
    for i in 0..objects {
        let (_, example) = EXAMPLES[n.below(EXAMPLES.len())];
        // Parts of a compound get materials of the second half, other than the object's own.
        let part_key = format!("material = \"m{}\", shape.", objects + i);
        let example = example.replacen("{ shape.", &format!("{{ {part_key}"), 1);
        let example = example.replace("knot.ply", "stone.obj");
        let position = n.in_cube(if objects == 1 { 0.0 } else { 1.0 });
        write!(
            text,
            "[[object]]\nmaterial = \"m{i}\"\n{example}\n\
             transform = [{{ rotate_x = {:?} }}, {{ translate = {:?} }}]\n",
            n.between(-180.0, 180.0),
            position.to_array(),
        )
        .unwrap();
    }
    let scene = parsed(&text);
    // The sum of three bounds: ambient light 1, diffuse reflection of the light of intensity 0.5,
    // and a highlight with the coefficient 0.5 of the same light.
    (scene, 1.0 + 0.5 + 0.25)
}

fn values(scene: &Scene) -> Vec<f64> {
    values_and_rounding(scene).0
}

/// Returns the values of a scene's picture, and the largest error of the film's fixed-point
/// rounding. The film's scale depends on the largest radiance that paths of the greatest depth can
/// carry. A change of the depth limit therefore changes the rounding, too.
fn values_and_rounding(scene: &Scene) -> (Vec<f64>, f64) {
    let rendering = rendered(scene, 3, Precision::Single, SAMPLES);
    let rounding = rendering.film.header.scales.iter().map(|scale| 0.5 / scale).sum();
    (picture(&rendering, Replicates::Both).concat(), rounding)
}

fn max_difference(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

/// Returns the scene with `max_depth` more than doubled.
fn deeper(scene: &Scene) -> Scene {
    let mut deeper = scene.clone();
    deeper.trace.max_depth = 2 * scene.trace.max_depth + 7;
    deeper
}

fn checked(seeds: std::ops::Range<u64>) {
    let mut counts = [[0; 3]; 2];
    for seed in seeds {
        let (scene, brightest) = random(seed);
        let (picture, rounding) = values_and_rounding(&scene);
        let mut unweighted = scene.clone();
        unweighted.trace.min_throughput = 0.0;
        let others = [("max_depth", deeper(&scene)), ("min_throughput", unweighted)];
        for (row, (limit, other)) in others.iter().enumerate() {
            let (other, other_rounding) = values_and_rounding(other);
            let difference = max_difference(&picture, &other);
            let rounded = if rounding == other_rounding { 0.0 } else { rounding + other_rounding };
            match reported_bias(&scene, limit) {
                Bias::Zero => {
                    counts[row][0] += 1;
                    assert!(
                        difference <= rounded,
                        "seed {seed}: {limit} cuts {difference:e}, unreported"
                    );
                }
                Bias::AtMost(bound) => {
                    counts[row][1] += 1;
                    let allowed = bound * brightest * (1.0 + 1e-4) + 1e-7;
                    assert!(
                        difference <= allowed,
                        "seed {seed}: {limit} cuts {difference:e} of {bound:e}"
                    );
                }
                Bias::Unbounded => counts[row][2] += 1,
            }
        }
    }
    println!("nothing, bound, no bound: max_depth {:?}, min_throughput {:?}", counts[0], counts[1]);
    assert!(counts[0][0] > 20 && counts[0][1] > 20 && counts[1][1] > 10, "{counts:?}");
}

#[test]
fn reported_truncation_bias_holds() {
    checked(0..400);
}

/// Checks that the depth bias of a single glass ball is reported without a bound. Bumps, and
/// rounding at the silhouette, can keep light inside the ball for any number of reflections.
#[test]
fn single_glass_ball_has_unbounded_depth_bias() {
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
    let difference = max_difference(&values(&bumped), &values(&deeper(&bumped)));
    assert!(
        difference > 0.01 && reported_bias(&bumped, "max_depth") == Bias::Unbounded,
        "{difference}"
    );
    // The eye is at the distance 5 from the centre of a unit ball. The angle between the directions
    // from the centre to the eye and to the silhouette has the cosine 1/5. At the silhouette,
    // rounding decides whether light leaves the ball.
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
            parsed(&text(&format!("ior = {index:?}"), &camera).replace("\"center\"", "\"box\""));
        assert!(reported_bias(&rim, "max_depth") == Bias::Unbounded);
        cut += u32::from(max_difference(&values(&rim), &values(&deeper(&rim))) > 0.0);
    }
    println!("at the silhouette depth 2 has an effect in {cut} of {rounds} pictures");
    assert!(cut > rounds as u32 / 10, "rounding at the silhouette is reported, but does not occur");
}

/// Checks that no depth bias is reported for a single flat or convex mirror. A path that leaves it
/// cannot hit it again.
#[test]
fn single_mirror_has_no_depth_bias() {
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
        if reported_bias(&scene, "max_depth") != Bias::Zero {
            continue;
        }
        // In every second round the camera looks at a corner of the bounds, so that some rays graze
        // the surface.
        if round % 2 == 1
            && let Some((low, high)) = scene.objects[0].form().bounds()
        {
            let corner = if numbers.below(2) == 0 { low } else { high };
            scene.camera.target = Some(corner.to_array());
        }
        let difference = max_difference(&values(&scene), &values(&deeper(&scene)));
        if difference > 0.0 {
            worst.push(format!("{round}: {kind}, {lobe}: {difference:e}"));
        }
    }
    assert!(worst.is_empty(), "{}", worst.join("\n"));
}
