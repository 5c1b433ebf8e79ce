//! Choice of precision by `auto`: double where errors of single precision would be visible, single
//! elsewhere. In each family of scenes, one parameter becomes smaller and smaller, such as the
//! radius of a ball on a floor of constant size. The error of single precision is the RMSE against
//! double precision with the same samples, in 8-bit levels.

use crate::harness::*;

const SIZE: [u32; 2] = [20, 15];
/// Picture size in pixels for scenes of a [`Family`].
const FAMILY_SIZE: [u32; 2] = [32, 24];
/// Number of samples per pixel in each replicate. Rounding diverts some paths, as often to one side
/// of an edge as to the other. With this number of samples, diverted paths add no visible noise.
const SAMPLES: u32 = 128;

/// Largest error of single precision in scenes for which `auto` selects it, in 8-bit levels: a
/// quarter of the noise at which pictures by default count as converged.
const INVISIBLE: f64 = 0.125;

fn takes_single(scene: &Scene) -> bool {
    matches!(AnyWorld::compile(scene, &Options::default()), AnyWorld::Single(_))
}

/// Pictures of a scene in single and in double precision, with the same samples.
struct Pair {
    pictures: [RenderState; 2],
    /// Samples per pixel in each replicate.
    samples: u32,
}

impl Pair {
    fn new(scene: &Scene) -> Self {
        let begin = |precision| begin(scene, 3, precision);
        Self { pictures: [Precision::Single, Precision::Double].map(begin), samples: 0 }
    }

    /// Traces more samples, until each replicate has `samples` samples per pixel. Returns the RMSE
    /// of single precision against double precision in 8-bit levels.
    fn error(&mut self, samples: u32) -> f64 {
        let (display, pool) = (Display::default(), pool(2));
        let [single, double] = self.pictures.each_mut().map(|rendering| -> Vec<f64> {
            uniform(rendering, self.samples, samples - self.samples, &pool);
            assert_eq!(rendering.film.bad_samples(), 0);
            picture(rendering, Replicates::Both).iter().flat_map(|p| display.levels(*p)).collect()
        });
        self.samples = samples;
        let sum: f64 = single.iter().zip(&double).map(|(a, b)| (a - b).powi(2)).sum();
        (sum / single.len() as f64).sqrt()
    }
}

fn error(scene: &Scene, samples: u32) -> f64 {
    Pair::new(scene).error(samples)
}

/// Family of scenes with one parameter.
struct Family {
    name: &'static str,
    /// Lower limit of the tested values of the parameter.
    least: f64,
    /// Lower limit of the error of single precision, in 8-bit levels, at the smallest tested value
    /// of the parameter.
    visible: f64,
    /// Function that returns the scene text for a value of the parameter, which is at most 1/4.
    text: fn(f64) -> String,
}

fn family(name: &'static str, least: f64, visible: f64, text: fn(f64) -> String) -> Family {
    Family { name, least, visible, text }
}

fn camera(eye: [f64; 3], target: [f64; 3], degrees: f64) -> String {
    format!(
        "film.size = [48, 36]\nbackground.color = [0.2, 0.4, 0.6]\n\
         ambient.color = [0.1, 0.1, 0.1]\n\
         camera = {{ eye = {eye:?}, target = {target:?}, view_angle.vertical = {degrees:e} }}\n"
    )
}

fn object(material: &str, shape: &str) -> String {
    format!("{material}[[object]]\nmaterial = \"m\"\nshape.{shape}\n")
}

fn ball(material: &str, x: f64, y: f64, radius: f64) -> String {
    object(material, &format!("sphere = {{ center = [{x:?}, {y:?}, 0], radius = {radius:?} }}"))
}

fn lamp(position: [f64; 3], intensity: f64) -> String {
    format!("[[light]]\npoint = {{ position = {position:?} }}\nintensity = {intensity:e}\n")
}

const SUN: &str = "[[light]]\ndirectional = { direction = [-0.4, -1.0, -0.3] }\n";
const FLOOR: &str = "[materials.floor]\ncolor = [0.6, 0.55, 0.5]\n[[object]]\n\
    material = \"floor\"\nshape.platform = { center = [0.0, 0.0, 0.0], size = [8.0, 8.0] }\n";
const PLAIN: &str = "[materials.m]\n";
const RED: &str = "[materials.m]\ncolor = [0.8, 0.2, 0.1]\n\
    specular = 0.5\nexponent = 80.0\nreflection = 0.3\n";
const GLASS: &str = "[materials.m]\nambient = 0.0\ndiffuse = 0.0\nreflection = 1.0\n\
    transmission = 1.0\nior = 1.5\nfresnel = \"dielectric\"\n";
/// Ball on the floor.
const RED_BALL: &str = "[[object]]\nmaterial = \"m\"\n\
    shape.sphere = { center = [0.0, 0.5, 0.0], radius = 0.5 }\n";

/// Returns the scene of a ball of radius `r` on a large floor, seen from close.
fn small_ball(r: f64) -> String {
    camera([2.0 * r, 2.5 * r, 5.0 * r], [0.0, r, 0.0], 40.0) + SUN + FLOOR + &ball(RED, 0.0, r, r)
}

/// Returns the scene of a pane of glass at the height `g` above a floor.
fn narrow_gap(g: f64) -> String {
    let shape = format!("box = {{ center = [0.0, {:e}, 0.0], size = [2.0, 0.1, 2.0] }}", 0.05 + g);
    camera([0.6, 2.0, 4.0], [0.0, 0.0, 0.0], 40.0) + SUN + FLOOR + &object(GLASS, &shape)
}

/// Returns the scene of bare ground, a ball of radius 1 / `p`, seen from the height 1.7.
fn bare_round_ground(p: f64) -> String {
    camera([0.0, 1.7, 0.0], [0.0, 1.2, -5.0], 40.0) + SUN + &ball(PLAIN, 0.0, -1.0 / p, 1.0 / p)
}

fn families() -> [Family; 10] {
    [
        family("a small ball on a floor", 1e-6, 1.0, small_ball),
        family("a slab of thickness t, seen from close to its edge", 1e-6, 1.0, |t| {
            let shape =
                format!("box = {{ center = [1.0, {:e}, 0.0], size = [2.0, {t:e}, 3.0] }}", 0.5 * t);
            let camera = camera([-4.0 * t, 3.0 * t, 6.0 * t], [0.0, 0.5 * t, 0.0], 40.0);
            camera + SUN + FLOOR + &object(RED, &shape)
        }),
        // Single precision is right even for the smallest gap, because surfaces within a rounding
        // error of each other are hit in the right order. Therefore `visible` is 0.
        family("a narrow gap under glass", 1e-7, 0.0, narrow_gap),
        family("a hollow ball with a wall of thickness t and a lamp inside", 1e-7, 1.0, |t| {
            let sphere = |radius: f64| {
                format!("{{ shape.sphere = {{ center = [0.0, 1.0, 0.0], radius = {radius:?} }} }}")
            };
            let shape = format!("difference.of = [{}, {}]", sphere(1.0), sphere(1.0 - t));
            let camera = camera([1.0, 2.5, 4.0], [0.0, 0.6, 0.0], 40.0);
            camera + &lamp([0.1, 1.1, 0.1], 1.0) + FLOOR + &object(PLAIN, &shape)
        }),
        family("a lamp at the height h, bright enough to show the floor", 1e-6, 1.0, |h| {
            let camera = camera([0.6, 2.0, 4.0], [0.0, 0.0, 0.0], 40.0);
            camera + FLOOR + &lamp([0.3, h, 0.2], 0.3 / h)
        }),
        family("a narrow view of a corner of a cube", 1e-6, 1.0, |a| {
            let cube = object(RED, "cube = { corner = [-0.4, 0.0, 0.1], edge = 0.8 }");
            camera([0.6, 1.4, 4.5], [0.4, 0.8, 0.1], 40.0 * a) + SUN + FLOOR + &cube
        }),
        family("the edge of a box's shadow from the height h", 5e-7, 1.0, |h| {
            let z = 0.7 - 3.0 * h;
            let shape = format!("box = {{ center = [1.6, 1.5, {z:?}], size = [0.5, 1.0, 1.0] }}");
            camera([0.3, h, 0.2], [0.3 - 4.0 * h, 0.0, 0.2 - 3.0 * h], 40.0)
                + &lamp([3.0, 4.0, 0.2 - 3.0 * h], 1.0)
                + FLOOR
                + &object(PLAIN, &shape)
        }),
        family("a ball on a ground that is a ball of radius 1 / p", 1e-8, 1.0, |p| {
            let ground = ball("", 0.0, -1.0 / p, 1.0 / p).replace("\"m\"", "\"ground\"");
            camera([0.6, 1.4, 4.5], [0.0, 0.3, -0.5], 40.0)
                + SUN
                + "[materials.ground]\n"
                + RED
                + RED_BALL
                + &ground
        }),
        family("a bare round ground", 1e-8, 1.0, bare_round_ground),
        family("two balls at the distance 1 / p, seen from near one of them", 1e-7, 1.0, |p| {
            let other = ball("", 1.0 / p, 0.5, 0.5).replace("\"m\"", "\"floor\"");
            camera([0.6, 1.4, 4.5], [0.0, 0.3, -0.5], 40.0) + SUN + FLOOR + RED + RED_BALL + &other
        }),
    ]
}

/// Checks families of scenes whose parameter shrinks. `auto` must select single precision at first,
/// and double precision from some value of the parameter on. Where it selects single precision, the
/// error must be invisible. At the smallest value, the error of single precision must be at least
/// `visible`.
#[test]
fn auto_takes_double_where_single_would_show() {
    let mut wrong = Vec::new();
    for Family { name, least, visible, text } in families() {
        let (mut single_before, mut p, mut worst) = (true, 0.25, 0.0f64);
        let mut last = 0.0;
        let begins_single = takes_single(&sized(parsed(&text(0.25)), FAMILY_SIZE));
        while p >= least {
            let scene = sized(parsed(&text(p)), FAMILY_SIZE);
            let single = takes_single(&scene);
            last = error(&scene, SAMPLES);
            println!(
                "{name} {p:.1e}: {}, single precision is {last:.4} levels off",
                if single { "single" } else { "double" }
            );
            if single {
                worst = worst.max(last);
                if !single_before {
                    wrong.push(format!("{name}: single again at {p:e}"));
                }
            }
            single_before = single;
            p /= 4.0;
        }
        if !begins_single || single_before {
            wrong.push(format!("{name}: no change of precision"));
        }
        if worst > INVISIBLE {
            wrong.push(format!("{name}: {worst} levels off where single is taken"));
        }
        if last < visible {
            wrong.push(format!("{name}: only {last} levels off at the end"));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// Checks that the choice of precision depends on the ratios of lengths in a scene only, not on the
/// size and place of the scene.
#[test]
fn auto_takes_single_where_proportions_are_harmless() {
    let scene_text = |place: f64, size: f64| {
        let [eye, center, light] = [[1.0, 2.0, 8.0], [0.0; 3], [3.0, 5.0, 3.0]]
            .map(|offsets| offsets.map(|offset| place + size * offset));
        format!(
            "camera = {{ eye = {eye:?}, target = {center:?} }}\n\
             [[light]]\npoint.position = {light:?}\n\
             [[object]]\nshape.sphere = {{ center = {center:?}, radius = {size:?} }}\n"
        )
    };
    for (place, size) in [(0.0, 1e-6), (0.0, 1e6), (1e6, 1.0), (-1e7, 10.0), (1e3, 1e-3)] {
        assert!(takes_single(&parsed(&scene_text(place, size))), "at {place:e}, of size {size:e}");
    }
    // Two balls almost touch. The gap between them is smaller than a pixel, except in a close view.
    let two_balls = |degrees: f64| {
        let camera = camera([0.0, 0.5, 2.0], [0.0, 0.0, 0.0], degrees);
        let balls = ball(PLAIN, -0.25, 0.0, 0.25) + &ball("", 0.250_001, 0.0, 0.25);
        parsed(&(camera + SUN + &balls))
    };
    assert!(takes_single(&two_balls(40.0)) && !takes_single(&two_balls(0.4)));
}

#[test]
fn auto_takes_double_for_the_extremes_beyond_single() {
    let scene_from = |eye: [f64; 3], degrees: f64, shape: &str| {
        camera(eye, [0.0, 0.0, 0.0], degrees) + SUN + &object(PLAIN, shape)
    };
    let sphere = |radius: f64| format!("sphere = {{ center = [0, 0, 0], radius = {radius:e} }}");
    let ball = &sphere(1.0);
    let cuboid = |h: f64| format!("box = {{ center = [0, 0, 0], size = [1, {h:e}, 1] }}");
    let cylinder = |height: f64| {
        format!("cylinder = {{ base = [0, 0, 0], top = [0, {height:e}, 0], radius = 1.0 }}")
    };
    let inline_scenes = [
        (1, true, scene_from([1e6, 0.0, 0.0], 1e-4, ball)),
        (2, true, bare_round_ground(1e-9)),
        (3, true, scene_from([1.0, 0.0, 0.0], 1e-3, &sphere(1e-6))),
        (4, false, scene_from([0.1, 0.2, 0.3], 90.0, ball)),
        (5, false, scene_from([3.0, 1.0, 0.0], 40.0, ball)),
        (6, false, scene_from([3.0, 0.5, 0.0], 40.0, &cuboid(1.0))),
        (11, true, scene_from([3.0, 2.0, 3.0], 40.0, &cylinder(1e-9))),
        (11, true, scene_from([3.0, 2.0, 3.0], 40.0, &cylinder(1e9))),
        (13, true, scene_from([3.0, 2.0, 3.0], 40.0, &cuboid(1e-6))),
        (15, false, small_ball(0.5)),
        (16, true, narrow_gap(1e-6)),
        (17, true, scene_from([3.0, 2.0, 3.0], 1e-3, ball)),
        // Near the border of a view as wide as this, adjacent rays are nearly parallel.
        (17, true, scene_from([3.0, 2.0, 3.0], 179.9, ball)),
    ];
    let shipped_scenes = "7 extents, 8 compound-nested, 9 compound-intersection, \
        10 compound-difference, 12 shape-tapered-cylinder, 14 shape-mesh, 18 lobe-cone, \
        19 slope-lobe, 20 lobe-square, 21 horizon-fold, 22 lobe-ggx, 23 furnace, 24 metals, \
        25 glass, 26 facing-mirrors, 27 transmission, 28 mirror-room, 29 light-groups, 30 slope-aa";
    let inline_scenes =
        inline_scenes.into_iter().map(|(number, double, text)| (number, double, parsed(&text)));
    let shipped_scenes = shipped_scenes.split(", ").map(|entry| {
        let (number, name) = entry.split_once(' ').unwrap();
        (number.parse().unwrap(), false, shipped(&format!("{name}.toml")))
    });
    let mut chosen: BTreeMap<usize, Vec<&str>> = BTreeMap::new();
    for (number, double, scene) in inline_scenes.chain(shipped_scenes) {
        assert_eq!(takes_single(&scene), !double, "extreme {number}");
        chosen.entry(number).or_default().push(if double { "double" } else { "single" });
    }
    assert!(chosen.keys().copied().eq(1..=30), "{chosen:?}");
    for (number, mut words) in chosen {
        words.dedup();
        report(number, "auto", &words.join(", "));
    }
}

/// Checks eyes inside the bounding box of a cylinder, a cone or an ellipsoid. The box contains
/// points close to the surface, for which `auto` selects double precision, and points far from it,
/// for which it selects single.
#[test]
fn eye_inside_a_box_of_a_round_solid_decides_by_its_distance_from_the_surface() {
    let scene = |shape: &str, eye: [f64; 3]| {
        parsed(&format!(
            "[film]\nsize = [16, 16]\n[camera]\neye = {eye:?}\ndirection = [0.0, 1.0, 1.0]\n\
             [[light]]\ndirectional.direction = [0.0, -1.0, 0.0]\n[[object]]\nshape.{shape}\n"
        ))
    };
    let cylinder = "cylinder = { base = [0.0, -1.0, 0.0], top = [0.0, 1.0, 0.0], radius = 1.0 }";
    let cone = "tapered_cylinder = { base = [0.0, -1.0, 0.0], base_radius = 1.0, \
                top = [0.0, 1.0, 0.0], top_radius = 0.0 }";
    let ellipsoid = "sphere = { center = [0.0, 0.0, 0.0], radius = 1.0 }\n\
                     transform = [{ scale = [1.0, 2.0, 1.0] }]";
    for (shape, far, near) in [
        (cylinder, [0.0, 0.0, 0.0], [1.0 - 1e-9, 0.0, 0.0]),
        (cylinder, [0.9, 0.0, 0.9], [0.0, 1.0 - 1e-9, 0.0]),
        (cone, [0.8, 0.7, 0.0], [0.5 + 1e-9, 0.0, 0.0]),
        (ellipsoid, [0.0, 1.0, 0.0], [1.0 - 1e-9, 0.0, 0.0]),
    ] {
        assert!(takes_single(&scene(shape, far)), "{shape} from {far:?}");
        assert!(!takes_single(&scene(shape, near)), "{shape} from {near:?}");
    }
}

#[test]
fn shipped_scenes_stay_in_single_precision() {
    // Rounding diverts some paths in glass and between mirrors. The result is noise, not an error,
    // and falls with the number of samples. With 96x54 pixels, single and double precision differ
    // in glass-solids.toml by 0.24, 0.13, 0.066 and 0.035 levels at 16, 64, 256 and 1024 samples
    // per pixel, and in emissive-objects.toml by 0.41, 0.16 and 0.08 levels at 64, 256 and 1024.
    let mut wrong = Vec::new();
    let mut worst = (0.0, String::new());
    for (name, scene) in all_shipped() {
        // Takes as long as all others; water-glass.toml has the same materials.
        if name == "gallery-water.toml" {
            continue;
        }
        // While the difference is visible, it is measured again with more samples. Noise then
        // falls, but an error stays.
        let mut pair = Pair::new(&sized(scene.clone(), SIZE));
        let mut levels = f64::INFINITY;
        for samples in [SAMPLES / 8, SAMPLES / 2, 2 * SAMPLES, 8 * SAMPLES, 16 * SAMPLES] {
            if levels > INVISIBLE {
                levels = pair.error(samples);
            }
        }
        if !takes_single(&scene) {
            wrong.push(format!("{name}: double, {levels} levels"));
        } else if levels > INVISIBLE {
            wrong.push(format!("{name}: {levels} levels off"));
        }
        if levels > worst.0 {
            worst = (levels, name);
        }
    }
    println!("worst: {} levels off in {}", worst.0, worst.1);
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}
