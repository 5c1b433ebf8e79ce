//! How far paths are followed, what goes through surfaces, and faults of old that are not inherited.

use crate::beside::{agrees, exactly, without_chance};
use crate::row::{Verdict, ensure, material, row};
use crate::sight::{RASTER, centers, sees, sighting};
use crate::support::{picture, rendered, shipped, sized};
use glam::DVec3;
use zerkalo::film::Replicates;
use zerkalo::material::Fresnel;
use zerkalo::scene::{Filter, RayTypes, Scene};
use zerkalo::shape::Shape;
use zerkalo::value::Color;
use zerkalo::world::Precision;

#[test]
fn b1_tracing_depth() {
    let levels: [(&str, crate::row::Change); 3] = [
        ("camera rays only", &|s| s.trace.ray_types = RayTypes::Primary),
        ("shadows", &|s| s.trace.ray_types = RayTypes::Shadows),
        ("everything", &|s| s.trace.ray_types = RayTypes::Full),
    ];
    let [primary, shadows, full] = levels;
    for (file, others) in
        [("level-primary.toml", [shadows, full]), ("level-shadows.toml", [primary, full])]
    {
        let meant = shipped(file);
        row(file, |shown| agrees(&meant, shown, 48), &others);
        exactly(&meant, &meant).unwrap();
    }
    let meant = shipped("level-full.toml");
    row("level-full.toml", |shown| agrees(&meant, shown, 96), &[primary, shadows]);
}

/// Upright panes, as the scene of the ray tree has them.
struct Pane {
    center: DVec3,
    half: [f64; 2],
    glow: DVec3,
    reflection: f64,
    transmission: f64,
}

/// What comes back along a ray that may meet `left` more surfaces: both arms at each.
fn tree(panes: &[Pane], background: DVec3, origin: DVec3, direction: DVec3, left: u32) -> DVec3 {
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
    if left == 0 {
        return pane.glow;
    }
    let at = origin + direction * t;
    let onward = |direction: DVec3| tree(panes, background, at, direction, left - 1);
    pane.glow
        + pane.reflection * onward(direction * DVec3::new(1.0, 1.0, -1.0))
        + pane.transmission * onward(direction)
}

fn grows_the_whole_tree(meant: &Scene, shown: &Scene) -> Verdict {
    let pane = |o: &zerkalo::scene::Object| {
        let Shape::Rectangle(r) = &o.shape else { panic!("not a pane") };
        let m = &meant.materials[&o.material];
        Pane {
            center: r.center.into(),
            half: r.size.map(|s| s / 2.0),
            glow: m.color.0.into(),
            reflection: m.reflection,
            transmission: m.transmission,
        }
    };
    let panes: Vec<Pane> = meant.objects.iter().map(pane).collect();
    let background = DVec3::from(meant.background.color.0);
    let mut shown = sized(shown.clone(), RASTER);
    shown.film.filter = Filter::Point;
    let rendering = rendered(&shown, 1, Precision::Double, 256);
    let [a, b] = [Replicates::A, Replicates::B].map(|part| picture(&rendering, part));
    // By bands of rows, so that errors of both signs do not cancel.
    for (band, centers) in centers(RASTER).chunks(6 * RASTER[0] as usize).enumerate() {
        let (mut sum, mut variance) = (DVec3::ZERO, DVec3::ZERO);
        let first = band * 6 * RASTER[0] as usize;
        for (i, center) in (first..).zip(centers) {
            let ray = sighting(&meant.camera, RASTER, *center);
            let expected =
                tree(&panes, background, ray.origin, ray.direction, meant.trace.max_depth);
            let [a, b] = [DVec3::from(a[i]), DVec3::from(b[i])];
            sum += (a + b) / 2.0 - expected;
            variance += ((a - b) / 2.0).powf(2.0) + DVec3::splat(1e-14);
        }
        let z = (sum / variance.map(f64::sqrt)).abs().max_element();
        // Eighteen numbers are looked at.
        ensure(z < 4.5, || {
            format!("rows {} to {}: {z:.1} standard errors", 6 * band, 6 * band + 5)
        })?;
    }
    Ok(())
}

/// Between two endless mirrors that glow with radiance 1 every pixel shows a sum, one term for each
/// surface that a path meets: its weights are those of the reflections before it.
fn glows_between(shown: &Scene, mirrors: [&str; 2], terms: impl Iterator<Item = f64>) -> Verdict {
    let mut shown = shown.clone();
    shown.objects.retain(|o| mirrors.contains(&o.name.as_str()));
    let mut middle = DVec3::ZERO;
    for object in &mut shown.objects {
        let Shape::Rectangle(r) = &mut object.shape else { panic!("not a mirror") };
        r.size = [1e4; 2];
        middle += DVec3::from(r.center) / 2.0;
    }
    // From the middle towards the first of the two.
    let Shape::Rectangle(first) = &shown.objects[0].shape else { unreachable!() };
    shown.camera.target = Some(first.center);
    shown.camera.eye = middle.to_array();
    let own = material(&mut shown, "mirror");
    (own.color, own.ambient, own.roughness) = (Color::WHITE, 1.0, 0.0);
    shown.ambient.color = Color::WHITE;
    shown.lights.clear();
    let sum: f64 = terms.sum();
    for shown in without_chance(&shown) {
        let apart = (shown - DVec3::splat(sum)).abs().max_element();
        ensure(apart < 1e-5, || format!("{shown} between the mirrors, not {sum}"))?;
    }
    Ok(())
}

#[test]
fn b2_ray_tree() {
    let meant = shipped("ray-tree.toml");
    row(
        "ray-tree.toml",
        |shown| grows_the_whole_tree(&meant, shown),
        &[
            ("one surface less", &|s| s.trace.max_depth -= 1),
            ("one surface more", &|s| s.trace.max_depth += 1),
            ("no reflected arm", &|s| material(s, "middle").reflection = 0.0),
            ("no transmitted arm", &|s| material(s, "middle").transmission = 0.0),
            ("no tree", &|s| s.trace.ray_types = RayTypes::Shadows),
        ],
    );
    // 0.9^28 is the last power above 0.05; after 40 reflections depth would end it.
    let powers = || (0..).map(|n| 0.9f64.powi(n)).take_while(|w| *w >= 0.05);
    assert_eq!(powers().count(), 29);
    row(
        "facing-mirrors.toml",
        |shown| glows_between(shown, ["front mirror", "back mirror"], powers()),
        &[
            ("no least weight", &|s| s.trace.min_throughput = 0.0),
            ("a larger least weight", &|s| s.trace.min_throughput = 0.055),
            ("a smaller depth", &|s| s.trace.max_depth = 27),
            ("a smaller coefficient", &|s| material(s, "mirror").reflection = 0.89),
        ],
    );
}

/// A ball that reflects everything outside and lets a fifth in and a fifth out: before a white background
/// 1 + 0.2 x 0.2, and not what would ring between its inner walls.
fn does_not_ring(shown: &Scene) -> Verdict {
    let mut alone = shown.clone();
    alone.objects.truncate(1);
    alone.background.color = Color::WHITE;
    alone.lights.clear();
    for shown in without_chance(&alone) {
        let one = |x: f64| (shown - DVec3::splat(x)).abs().max_element() < 1e-6;
        ensure(one(1.0) || one(1.04), || format!("{shown} on the ball"))?;
    }
    Ok(())
}

#[test]
fn c2_refraction() {
    let fixed = shipped("transmission.toml");
    row(
        "transmission.toml",
        |shown| agrees(&fixed, shown, 96),
        &[
            ("no bending", &|s| material(s, "clear").ior = 1.0),
            ("the ratio the wrong way round", &|s| material(s, "clear").ior = 0.7),
            ("a smaller index", &|s| material(s, "clear").ior = 1.3),
        ],
    );
    let glass = shipped("glass.toml");
    row(
        "glass.toml",
        |shown| agrees(&glass, shown, 96),
        &[
            ("fixed coefficients", &|s| material(s, "glass").fresnel = Some(Fresnel::Constant)),
            ("a bubble of glass", &|s| material(s, "air").ior = 1.5),
            ("no depth", &|s| s.trace.max_depth = 2),
        ],
    );
    let two_fifths = |s: &mut Scene| material(s, "mirror").transmission = 0.4;
    row("reflecting-tracks.toml", does_not_ring, &[("k_t of 0.4", &two_fifths)]);
}

/// A round room seen from inside, mirrors that face each other without loss, a lamp with a ball beyond it,
/// light brighter than 1 in a mirror, glass away from the origin.
#[test]
fn c4_old_faults() {
    let meant = shipped("round-room.toml");
    let check = |shown: &Scene| {
        sees(&meant, shown)?;
        agrees(&meant, shown, 96)?;
        // Twelve reflections without loss, and then an end.
        glows_between(shown, ["left mirror", "right mirror"], [1.0; 13].into_iter())?;
        // The white ball, lit by more than 1, is as bright in the mirrors.
        let brightest = |s: &Scene| without_chance(s).iter().map(|p| p.x).fold(0.0, f64::max);
        let bright = brightest(shown);
        ensure(bright > 1.5, || format!("nothing is brighter than {bright}"))
    };
    row(
        "round-room.toml",
        check,
        &[
            ("the room not seen from inside", &|s| material(s, "plaster").two_sided = false),
            ("the ball before the lamp", &|s| {
                let Shape::Sphere(ball) = &mut crate::row::object(s, "above the lamp").shape else {
                    unreachable!()
                };
                ball.center[1] = 1.6;
            }),
            ("fewer reflections between the mirrors", &|s| s.trace.max_depth = 11),
            ("glass bent as elsewhere", &|s| material(s, "glass").ior = 1.2),
        ],
    );
}
