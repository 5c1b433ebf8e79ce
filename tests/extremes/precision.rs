//! Choice of precision by `auto`: double where errors of single precision would be visible, single
//! elsewhere. In each family of scenes, one parameter becomes smaller and smaller, such as the
//! radius of a ball on a floor of constant size. The error of single precision is the RMSE against
//! double precision with the same samples, in 8-bit levels.

use crate::harness::*;

const SIZE: [u32; 2] = [24, 18];
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
            assert_eq!(rendering.film.bad_samples().count, 0);
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

/// Family of scenes with one parameter, such as the radius of a ball on a floor of constant size.
struct Family {
    name: &'static str,
    /// Function that returns the scene text for a value of the parameter, which is at most 1/4.
    text: fn(f64) -> String,
    /// Lower limit of the tested values of the parameter.
    least: f64,
    /// Lower limit of the error of single precision, in 8-bit levels, at the smallest tested value
    /// of the parameter.
    visible: f64,
}

fn camera(eye: [f64; 3], target: [f64; 3], degrees: f64) -> String {
    format!(
        "[film]\nsize = [48, 36]\n[camera]\neye = {eye:?}\ntarget = {target:?}\n\
         view_angle.vertical = {degrees:e}\n[background]\ncolor = [0.2, 0.4, 0.6]\n\
         [ambient]\ncolor = [0.1, 0.1, 0.1]\n"
    )
}

const SUN: &str = "[[light]]\ndirectional = { direction = [-0.4, -1.0, -0.3] }\n";
const FLOOR: &str = "[materials.floor]\ncolor = [0.6, 0.55, 0.5]\n[[object]]\n\
    material = \"floor\"\nshape.platform = { center = [0.0, 0.0, 0.0], size = [8.0, 8.0] }\n";
const RED: &str = "[materials.red]\ncolor = [0.8, 0.2, 0.1]\n\
    specular = 0.5\nexponent = 80.0\nreflection = 0.3\n";

/// Returns the scene of a ball of radius `r` on a large floor, seen from close.
fn small_ball(r: f64) -> String {
    camera([2.0 * r, 2.5 * r, 5.0 * r], [0.0, r, 0.0], 40.0)
        + SUN
        + FLOOR
        + RED
        + &format!(
            "[[object]]\nmaterial = \"red\"\n\
             shape.sphere = {{ center = [0.0, {r:e}, 0.0], radius = {r:e} }}\n"
        )
}

/// Returns the scene of a sheet of thickness `t` on a floor, seen from close to its edge.
fn thin_slab(t: f64) -> String {
    camera([-4.0 * t, 3.0 * t, 6.0 * t], [0.0, 0.5 * t, 0.0], 40.0)
        + SUN
        + FLOOR
        + RED
        + &format!(
            "[[object]]\nmaterial = \"red\"\nshape.box = {{ center = [1.0, {:e}, 0.0], \
             size = [2.0, {t:e}, 3.0] }}\n",
            0.5 * t
        )
}

/// Returns the scene of a pane of glass at the height `g` above a floor.
fn narrow_gap(g: f64) -> String {
    camera([0.6, 2.0, 4.0], [0.0, 0.0, 0.0], 40.0)
        + SUN
        + FLOOR
        + &format!(
            "[materials.glass]\nambient = 0.0\ndiffuse = 0.0\nreflection = 1.0\ntransmission = 1.0\n\
             ior = 1.5\nfresnel = \"dielectric\"\n[[object]]\nmaterial = \"glass\"\n\
             shape.box = {{ center = [0.0, {:e}, 0.0], size = [2.0, 0.1, 2.0] }}\n",
            0.05 + g
        )
}

/// Returns the scene of a hollow ball with a wall of thickness `t` and a lamp inside.
fn thin_shell(t: f64) -> String {
    camera([1.0, 2.5, 4.0], [0.0, 0.6, 0.0], 40.0)
        + "[[light]]\npoint = { position = [0.1, 1.1, 0.1] }\n"
        + FLOOR
        + &format!(
            "[[object]]\nshape.difference.of = [\n\
             {{ shape.sphere = {{ center = [0.0, 1.0, 0.0], radius = 1.0 }} }},\n\
             {{ shape.sphere = {{ center = [0.0, 1.0, 0.0], radius = {:?} }} }},\n]\n",
            1.0 - t
        )
}

/// Returns the scene of a lamp at the height `h` above a floor, bright enough for the floor to be
/// visible.
fn low_lamp(h: f64) -> String {
    camera([0.6, 2.0, 4.0], [0.0, 0.0, 0.0], 40.0)
        + FLOOR
        + &format!(
            "[[light]]\npoint = {{ position = [0.3, {h:e}, 0.2] }}\nintensity = {:e}\n",
            0.3 / h
        )
}

/// Returns a scene with a narrow view, 40 degrees times `a`, of a corner of a cube on a floor.
fn narrow_view(a: f64) -> String {
    camera([0.6, 1.4, 4.5], [0.4, 0.8, 0.1], 40.0 * a)
        + SUN
        + FLOOR
        + RED
        + "[[object]]\nmaterial = \"red\"\nshape.cube = { corner = [-0.4, 0.0, 0.1], edge = 0.8 }\n"
}

/// Returns the scene of an eye at the height `h` above a floor that looks at the edge of a box's
/// shadow.
fn low_eye(h: f64) -> String {
    camera([0.3, h, 0.2], [0.3 - 4.0 * h, 0.0, 0.2 - 3.0 * h], 40.0)
        + &format!("[[light]]\npoint = {{ position = [3.0, 4.0, {:?}] }}\n", 0.2 - 3.0 * h)
        + FLOOR
        + &format!(
            "[[object]]\nshape.box = {{ center = [1.6, 1.5, {:?}], size = [0.5, 1.0, 1.0] }}\n",
            0.7 - 3.0 * h
        )
}

/// Returns the scene of a ball on the ground, which is a ball of radius 1 / `p`.
fn round_ground(p: f64) -> String {
    let r = 1.0 / p;
    camera([0.6, 1.4, 4.5], [0.0, 0.3, -0.5], 40.0)
        + SUN
        + RED
        + &format!(
            "[[object]]\nshape.sphere = {{ center = [0.0, {:?}, 0.0], radius = {r:?} }}\n\
             [[object]]\nmaterial = \"red\"\n\
             shape.sphere = {{ center = [0.0, 0.5, 0.0], radius = 0.5 }}\n",
            -r
        )
}

/// Returns the scene of bare ground, a ball of radius 1 / `p`, seen from the height 1.7.
fn bare_round_ground(p: f64) -> String {
    let r = 1.0 / p;
    camera([0.0, 1.7, 0.0], [0.0, 1.2, -5.0], 40.0)
        + SUN
        + &format!(
            "[[object]]\nshape.sphere = {{ center = [0.0, {:?}, 0.0], radius = {r:?} }}\n",
            -r
        )
}

/// Returns the scene of two balls at the distance 1 / `p` from each other, seen from near one of
/// them.
fn far_apart(p: f64) -> String {
    camera([0.6, 1.4, 4.5], [0.0, 0.3, -0.5], 40.0)
        + SUN
        + FLOOR
        + RED
        + "[[object]]\nmaterial = \"red\"\nshape.sphere = { center = [0.0, 0.5, 0.0], radius = 0.5 }\n"
        + &format!(
            "[[object]]\nshape.sphere = {{ center = [{:?}, 0.5, 0.0], radius = 0.5 }}\n",
            1.0 / p
        )
}

const FAMILIES: [Family; 10] = [
    Family { name: "a small ball on a floor", text: small_ball, least: 1e-6, visible: 1.0 },
    Family { name: "a thin slab", text: thin_slab, least: 1e-6, visible: 1.0 },
    // Single precision is right even for the smallest gap, because surfaces within a rounding error
    // of each other are hit in the right order. Therefore `visible` is 0.
    Family { name: "a narrow gap under glass", text: narrow_gap, least: 1e-7, visible: 0.0 },
    Family { name: "a thin shell around a lamp", text: thin_shell, least: 1e-7, visible: 1.0 },
    Family { name: "a low lamp", text: low_lamp, least: 1e-6, visible: 1.0 },
    Family { name: "a narrow view", text: narrow_view, least: 1e-6, visible: 1.0 },
    Family { name: "a low eye", text: low_eye, least: 5e-7, visible: 1.0 },
    Family { name: "a round ground with a ball", text: round_ground, least: 1e-8, visible: 1.0 },
    Family { name: "a bare round ground", text: bare_round_ground, least: 1e-8, visible: 1.0 },
    Family { name: "two balls far apart", text: far_apart, least: 1e-7, visible: 1.0 },
];

/// Checks families of scenes whose parameter shrinks. `auto` must select single precision at first,
/// and double precision from some value of the parameter on. Where it selects single precision, the
/// error must be invisible. At the smallest value, the error of single precision must be at least
/// `visible`.
#[test]
fn auto_takes_double_where_single_would_show() {
    let mut wrong = Vec::new();
    for Family { name, text, least, visible } in FAMILIES {
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
        let x = |offset: f64| place + size * offset;
        format!(
            "[camera]\neye = [{:?}, {:?}, {:?}]\ntarget = [{:?}, {:?}, {:?}]\n\
             [[light]]\npoint = {{ position = [{:?}, {:?}, {:?}] }}\n\
             [[object]]\nshape.sphere = {{ center = [{:?}, {:?}, {:?}], radius = {size:?} }}\n",
            x(1.0),
            x(2.0),
            x(8.0),
            x(0.0),
            x(0.0),
            x(0.0),
            x(3.0),
            x(5.0),
            x(3.0),
            x(0.0),
            x(0.0),
            x(0.0)
        )
    };
    for (place, size) in [(0.0, 1e-6), (0.0, 1e6), (1e6, 1.0), (-1e7, 10.0), (1e3, 1e-3)] {
        assert!(takes_single(&parsed(&scene_text(place, size))), "at {place:e}, of size {size:e}");
    }
    // Two balls almost touch. The gap between them is smaller than a pixel, except in a close view.
    let two_balls = |degrees: f64| {
        let ball = |x: f64| {
            format!("[[object]]\nshape.sphere = {{ center = [{x:?}, 0.0, 0.0], radius = 0.25 }}\n")
        };
        let camera = camera([0.0, 0.5, 2.0], [0.0, 0.0, 0.0], degrees);
        parsed(&(camera + SUN + &ball(-0.25) + &ball(0.250_001)))
    };
    assert!(takes_single(&two_balls(40.0)) && !takes_single(&two_balls(0.4)));
}

#[test]
fn auto_takes_double_for_the_extremes_beyond_single() {
    let scene_from = |eye: [f64; 3], degrees: f64, shape: &str| {
        camera(eye, [0.0, 0.0, 0.0], degrees) + SUN + "[[object]]\nshape." + shape + "\n"
    };
    let ball = "sphere = { center = [0.0, 0.0, 0.0], radius = 1.0 }";
    let cylinder = |height: f64| {
        format!("cylinder = {{ base = [0, 0, 0], top = [0, {height:e}, 0], radius = 1.0 }}")
    };
    let inline_scenes = [
        (1, true, scene_from([1e6, 0.0, 0.0], 1e-4, ball)),
        (2, true, bare_round_ground(1e-9)),
        (
            3,
            true,
            scene_from([1.0, 0.0, 0.0], 1e-3, "sphere = { center = [0, 0, 0], radius = 1e-6 }"),
        ),
        (4, false, scene_from([0.1, 0.2, 0.3], 90.0, ball)),
        (5, false, scene_from([3.0, 1.0, 0.0], 40.0, ball)),
        (
            6,
            false,
            scene_from([3.0, 0.5, 0.0], 40.0, "box = { center = [0, 0, 0], size = [1, 1, 1] }"),
        ),
        (11, true, scene_from([3.0, 2.0, 3.0], 40.0, &cylinder(1e-9))),
        (11, true, scene_from([3.0, 2.0, 3.0], 40.0, &cylinder(1e9))),
        (
            13,
            true,
            scene_from([3.0, 2.0, 3.0], 40.0, "box = { center = [0, 0, 0], size = [1, 1e-6, 1] }"),
        ),
        (15, false, small_ball(0.5)),
        (16, true, narrow_gap(1e-6)),
        (17, true, scene_from([3.0, 2.0, 3.0], 1e-3, ball)),
        // Near the border of a view as wide as this, adjacent rays are nearly parallel.
        (17, true, scene_from([3.0, 2.0, 3.0], 179.9, ball)),
    ];
    let shipped_scenes = [
        (7, "extents"),
        (8, "compound-nested"),
        (9, "compound-intersection"),
        (10, "compound-difference"),
        (12, "shape-tapered-cylinder"),
        (14, "shape-mesh"),
        (18, "lobe-cone"),
        (19, "slope-lobe"),
        (20, "lobe-square"),
        (21, "horizon-fold"),
        (22, "lobe-ggx"),
        (23, "furnace"),
        (24, "metals"),
        (25, "glass"),
        (26, "facing-mirrors"),
        (27, "transmission"),
        (28, "mirror-room"),
        (29, "light-groups"),
        (30, "slope-aa"),
    ];
    let inline_scenes =
        inline_scenes.into_iter().map(|(number, double, text)| (number, double, parsed(&text)));
    let shipped_scenes = shipped_scenes
        .into_iter()
        .map(|(number, name)| (number, false, shipped(&format!("{name}.toml"))));
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
    // in gallery-glass.toml by 0.24, 0.13, 0.066 and 0.035 levels at 16, 64, 256 and 1024 samples
    // per pixel, and in emissive-objects.toml by 0.41, 0.16 and 0.08 levels at 64, 256 and 1024.
    let mut wrong = Vec::new();
    let mut worst = (0.0, String::new());
    for (name, scene) in all_shipped() {
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
