//! Tests of path depth, of transmission, and of faults of earlier ray tracers.

use crate::features::row::*;
use crate::harness::*;
use crate::reference::*;

#[test]
fn b1_tracing_depth() {
    let levels: [(&str, Change); 3] = [
        ("camera rays only", &|s| s.trace.ray_types = RayTypes::Primary),
        ("shadows", &|s| s.trace.ray_types = RayTypes::Shadows),
        ("everything", &|s| s.trace.ray_types = RayTypes::Full),
    ];
    let [primary, shadows, full] = levels;
    for (file, others) in
        [("level-primary.toml", [shadows, full]), ("level-shadows.toml", [primary, full])]
    {
        let original = shipped(file);
        row(file, |tested| agrees(&original, tested, 48), &others);
        agrees_exactly(&original, &original).unwrap();
    }
    let original = shipped("level-full.toml");
    row("level-full.toml", |tested| agrees(&original, tested, 96), &[primary, shadows]);
}

/// Upright pane of a scene of panes, each of which reflects and transmits rays.
struct Pane {
    center: DVec3,
    half: [f64; 2],
    /// Radiance that the pane emits.
    glow: DVec3,
    reflection: f64,
    transmission: f64,
}

/// Returns the radiance along a ray by the full ray tree: reflection and transmission at every
/// pane. `depth` is the number of further surfaces at which the ray may scatter.
fn tree(panes: &[Pane], background: DVec3, origin: DVec3, direction: DVec3, depth: u32) -> DVec3 {
    let nearest = panes
        .iter()
        .filter_map(|pane| {
            let t = (pane.center.z - origin.z) / direction.z;
            let [x, y, _] = (origin + direction * t - pane.center).to_array();
            let within = x.abs() <= pane.half[0] && y.abs() <= pane.half[1];
            (t > 1e-9 && within).then_some((t, pane))
        })
        .min_by(|a, b| a.0.total_cmp(&b.0));
    let Some((t, pane)) = nearest else { return background };
    if depth == 0 {
        return pane.glow;
    }
    let hit_point = origin + direction * t;
    let incoming = |direction: DVec3| tree(panes, background, hit_point, direction, depth - 1);
    pane.glow
        + pane.reflection * incoming(direction * DVec3::new(1.0, 1.0, -1.0))
        + pane.transmission * incoming(direction)
}

/// Checks that the mean radiance of each band of six rows is that of the full ray tree.
fn traces_the_whole_tree(original: &Scene, tested: &Scene) -> Verdict {
    let pane = |o: &zerkalo_scene::Object| {
        let Shape::Rectangle(r) = &o.shape else { panic!("not a pane") };
        let m = &original.materials[&o.material];
        Pane {
            center: r.center.into(),
            half: r.size.map(|s| s / 2.0),
            glow: m.color.0.into(),
            reflection: m.reflection,
            transmission: m.transmission,
        }
    };
    let panes: Vec<Pane> = original.objects.iter().map(pane).collect();
    let background = DVec3::from(original.background.color.0);
    let mut tested = sized(tested.clone(), RASTER);
    tested.film.filter = Filter::Point;
    let rendering = rendered(&tested, 1, Precision::Double, 256);
    let [a, b] = [Replicates::A, Replicates::B].map(|part| picture(&rendering, part));
    // In bands of rows, so that errors of opposite sign do not cancel.
    for (band, centers) in centers(RASTER).chunks(6 * RASTER[0] as usize).enumerate() {
        let (mut sum, mut variance) = (DVec3::ZERO, DVec3::ZERO);
        let first = band * 6 * RASTER[0] as usize;
        for (i, center) in (first..).zip(centers) {
            let (origin, direction) = pixel_ray(&sized(original.clone(), RASTER), *center);
            let expected = tree(&panes, background, origin, direction, original.trace.max_depth);
            let [a, b] = [DVec3::from(a[i]), DVec3::from(b[i])];
            sum += (a + b) / 2.0 - expected;
            variance += ((a - b) / 2.0).powf(2.0) + DVec3::splat(1e-14);
        }
        let z = (sum / variance.map(f64::sqrt)).abs().max_element();
        // The limit allows for eighteen comparisons.
        ensure(z < 4.5, || {
            format!("rows {} to {}: {z:.1} standard errors", 6 * band, 6 * band + 5)
        })?;
    }
    Ok(())
}

/// Checks two facing square mirrors, each 1e4 units wide. Ambient light adds the radiance 1 at
/// every surface. Every pixel must have the sum of `terms`, the throughputs with which a path
/// reaches its successive surfaces.
fn sums_reflections(
    tested: &Scene,
    mirrors: [&str; 2],
    terms: impl Iterator<Item = f64>,
) -> Verdict {
    let mut tested = tested.clone();
    tested.objects.retain(|o| mirrors.contains(&o.name.as_str()));
    let mut middle = DVec3::ZERO;
    for object in &mut tested.objects {
        let Shape::Rectangle(r) = &mut object.shape else { panic!("not a mirror") };
        r.size = [1e4; 2];
        middle += DVec3::from(r.center) / 2.0;
    }
    // The camera looks from the middle towards the first mirror.
    let Shape::Rectangle(first) = &tested.objects[0].shape else { unreachable!() };
    tested.camera.target = Some(first.center);
    tested.camera.eye = middle.to_array();
    let mirror = material(&mut tested, "mirror");
    (mirror.color, mirror.ambient, mirror.roughness) = (Color::WHITE, 1.0, 0.0);
    tested.ambient.color = Color::WHITE;
    tested.lights.clear();
    let sum: f64 = terms.sum();
    for pixel in without_noise(&tested) {
        let difference = (pixel - DVec3::splat(sum)).abs().max_element();
        ensure(difference < 1e-5, || format!("{pixel} between the mirrors, not {sum}"))?;
    }
    Ok(())
}

#[test]
fn b2_ray_tree() {
    let original = shipped("ray-tree.toml");
    row(
        "ray-tree.toml",
        |tested| traces_the_whole_tree(&original, tested),
        &[
            ("one surface less", &|s| s.trace.max_depth -= 1),
            ("one surface more", &|s| s.trace.max_depth += 1),
            ("no reflected branch", &|s| material(s, "middle").reflection = 0.0),
            ("no transmitted branch", &|s| material(s, "middle").transmission = 0.0),
            ("no tree", &|s| s.trace.ray_types = RayTypes::Shadows),
        ],
    );
    // Paths end at the smallest throughput of the scene, 0.05, before they reach its depth limit,
    // 40: 0.9^28 is the last power above 0.05.
    let powers = || (0..).map(|n| 0.9f64.powi(n)).take_while(|w| *w >= 0.05);
    assert_eq!(powers().count(), 29);
    row(
        "facing-mirrors.toml",
        |tested| sums_reflections(tested, ["front mirror", "back mirror"], powers()),
        &[
            ("no smallest weight", &|s| s.trace.min_throughput = 0.0),
            ("a larger smallest weight", &|s| s.trace.min_throughput = 0.055),
            ("a smaller depth", &|s| s.trace.max_depth = 27),
            ("a smaller coefficient", &|s| material(s, "mirror").reflection = 0.89),
        ],
    );
}

/// Checks a large ball that reflects all light on its outside and transmits a fifth at each
/// surface. In front of a white background its radiance is 1 + 0.2 x 0.2, because light inside the
/// ball is not reflected.
fn has_no_inner_reflections(tested: &Scene) -> Verdict {
    let mut alone = tested.clone();
    alone.objects.truncate(1);
    alone.background.color = Color::WHITE;
    alone.lights.clear();
    for pixel in without_noise(&alone) {
        let equals = |x: f64| (pixel - DVec3::splat(x)).abs().max_element() < 1e-6;
        ensure(equals(1.0) || equals(1.04), || format!("{pixel} on the ball"))?;
    }
    Ok(())
}

#[test]
fn c2_refraction() {
    let fixed = shipped("transmission.toml");
    row(
        "transmission.toml",
        |tested| agrees(&fixed, tested, 96),
        &[
            ("no bending", &|s| material(s, "clear").ior = 1.0),
            ("the ratio the wrong way round", &|s| material(s, "clear").ior = 0.7),
            ("a smaller index", &|s| material(s, "clear").ior = 1.3),
        ],
    );
    let glass = shipped("glass.toml");
    row(
        "glass.toml",
        |tested| agrees(&glass, tested, 96),
        &[
            ("fixed coefficients", &|s| material(s, "glass").fresnel = Some(Fresnel::Constant)),
            ("a bubble of glass", &|s| material(s, "air").ior = 1.5),
            ("no depth", &|s| s.trace.max_depth = 2),
        ],
    );
    let two_fifths = |s: &mut Scene| material(s, "mirror").transmission = 0.4;
    row("reflecting-tracks.toml", has_no_inner_reflections, &[("k_t of 0.4", &two_fifths)]);
}

/// Checks scenes that earlier ray tracers rendered wrongly: a round room seen from inside, lossless
/// facing mirrors, a light with a ball beyond it, radiance above 1 in a mirror, glass away from the
/// origin.
#[test]
fn c4_old_faults() {
    let original = shipped("round-room.toml");
    let check = |tested: &Scene| {
        hits_agree(&original, tested)?;
        agrees(&original, tested, 96)?;
        // Twelve lossless reflections, then the path ends.
        sums_reflections(tested, ["left mirror", "right mirror"], [1.0; 13].into_iter())?;
        // The white ball, lit by more than 1, keeps its brightness in the mirrors.
        let brightest = |s: &Scene| without_noise(s).iter().map(|p| p.x).fold(0.0, f64::max);
        let bright = brightest(tested);
        ensure(bright > 1.5, || format!("the brightest pixel has {bright}"))
    };
    row(
        "round-room.toml",
        check,
        &[
            ("the room not seen from inside", &|s| material(s, "plaster").two_sided = false),
            ("the ball before the lamp", &|s| {
                let Shape::Sphere(ball) = &mut object(s, "above the lamp").shape else {
                    unreachable!()
                };
                ball.center[1] = 1.6;
            }),
            ("fewer reflections between the mirrors", &|s| s.trace.max_depth = 11),
            ("glass bent as elsewhere", &|s| material(s, "glass").ior = 1.2),
        ],
    );
}
