//! Transparent objects in contact with others. The picture must be the limit of pictures with a gap
//! between the objects as the gap vanishes.

use crate::harness::*;
use tempfile::TempDir;

/// Width of the gap in scenes that are compared with the same scene without a gap.
const GAP: f64 = 1e-4;

/// Shapes that stand on the plane y = 0, and a flat one in that plane.
const UPPER: [&str; 7] = [
    "box = { center = [0, 0.5, 0], size = [2, 1, 2] }",
    "mesh = { file = \"upper.obj\", normals = \"flat\" }",
    "cylinder = { base = [0, 0, 0], top = [0, 1, 0], radius = 1.2 }",
    "cone = { base = [0, 0, 0], apex = [0, 1, 0], radius = 1.2 }",
    "union.of = [{ shape.box = { center = [-0.25, 0.5, 0], size = [1.5, 1, 2] } }, \
     { shape.box = { center = [0.5, 0.5, 0], size = [1, 1, 2] } }]",
    "sphere = { center = [0, 1, 0], radius = 1 }",
    "platform = { center = [0, 0, 0], size = [2, 2] }",
];

/// Shapes with their highest points at y = 0.
const LOWER: [&str; 6] = [
    "platform = { center = [0, 0, 0], size = [5, 5] }",
    "plane = { point = [0, 0, 0], normal = [0, 1, 0] }",
    "box = { center = [0, -0.5, 0], size = [5, 1, 5] }",
    "mesh = { file = \"lower.obj\", normals = \"flat\" }",
    "difference.of = [{ shape.box = { center = [0, 0, 0], size = [5, 1, 5] } }, \
     { shape.box = { center = [0, 0.5, 0], size = [6, 1, 6] } }]",
    "cylinder = { base = [0, -1, 0], top = [0, 0, 0], radius = 3 }",
];

/// Pairs of materials: those of the upper and of the lower shape.
const MATERIALS: [(&str, &str); 8] = [
    ("glass", "matte"),
    ("glass", "mirror"),
    ("glass", "glass"),
    ("glass", "water"),
    ("matte", "glass"),
    ("mirror", "water"),
    ("thin", "matte"),
    ("thin", "thin"),
];

/// Returns a folder with the files `upper.obj` and `lower.obj`, the meshes of two boxes that touch
/// in the plane y = 0.
fn meshes() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let write_file = |name: &str, text: &str| fs::write(folder.path().join(name), text).unwrap();
    write_file("upper.obj", &obj_box(DVec3::new(-1.0, 0.0, -1.0), DVec3::new(1.0, 1.0, 1.0)));
    write_file("lower.obj", &obj_box(DVec3::new(-2.5, -1.0, -2.5), DVec3::new(2.5, 0.0, 2.5)));
    folder
}

struct Setting<'a> {
    upper: &'a str,
    lower: &'a str,
    materials: (&'a str, &'a str),
    place: DAffine3,
    folder: &'a Path,
}

/// Text of a box whose lower face is in the plane of the lower face of [`INNER`], a smaller box
/// inside it.
const OUTER: &str = "box = { center = [0, 0.5, 0], size = [3, 1, 3] }";
const INNER: &str = "box = { center = [0, 0.25, 0], size = [1.4, 0.5, 1.4] }";

impl Setting<'_> {
    /// Compiles the scene, with the upper shape lifted by `gap`.
    fn traced(&self, gap: f64, precision: Precision) -> Traced {
        let transform_text = |lift: f64| {
            let steps = steps(&self.place);
            format!("transform = [{{ translate = [0, {lift:?}, 0] }}, {steps}]\n")
        };
        let placed_text = |p: DVec3| array(self.place.transform_point3(p));
        let text = format!(
            "background.color = [0.2, 0.5, 0.9]\nambient.color = [1, 1, 1]\n\
             trace.max_depth = 6\n[camera]\neye = {}\ntarget = {}\n\
             [[light]]\npoint.position = {}\nfalloff = \"none\"\n\
             [materials.matte]\ncolor = [0.9, 0.6, 0.3]\nambient = 0.5\n\
             [materials.mirror]\ncolor = [0.9, 0.6, 0.3]\nambient = 0.2\nreflection = 0.7\n\
             [materials.glass]\ncolor = [0.3, 0.9, 0.6]\nambient = 0.1\ndiffuse = 0.1\nreflection = 1\n\
             transmission = 1\nfresnel = \"dielectric\"\n\
             [materials.water]\ndiffuse = 0\nreflection = 1\ntransmission = 1\nior = 1.33\n\
             fresnel = \"dielectric\"\n\
             [materials.thin]\ncolor = [0.3, 0.9, 0.6]\nambient = 0.1\ndiffuse = 0.1\nreflection = 0.2\n\
             transmission = 0.7\n\
             [[object]]\nmaterial = \"{}\"\nshape.{}\n{}[[object]]\nmaterial = \"{}\"\nshape.{}\n{}",
            placed_text(DVec3::new(0.3, 4.0, 5.0)),
            placed_text(DVec3::ZERO),
            placed_text(DVec3::new(3.0, 4.0, 2.0)),
            self.materials.0,
            self.upper,
            transform_text(gap),
            self.materials.1,
            self.lower,
            transform_text(0.0),
        );
        let name = self.folder.join("scene.toml");
        let scene = Scene::parse(&text, &name.display().to_string());
        Traced::new(&scene.unwrap_or_else(|e| panic!("{e}\n{text}")), precision)
    }

    /// Returns `count` lines through the middle of the contact area, from above or from below.
    fn lines(&self, above: bool, count: usize) -> Vec<Line> {
        let mut numbers = Numbers::new(5);
        let line = |_| {
            let [x, z] = [numbers.between(-0.5, 0.5), numbers.between(-0.5, 0.5)];
            let mut direction = numbers.direction();
            direction.y = direction.y.abs() + 0.1;
            let from = DVec3::new(x, 0.0, z) + direction * if above { 4.0 } else { -4.0 };
            let (from, to) = (
                self.place.transform_point3(from),
                self.place.transform_point3(DVec3::new(x, 0.0, z)),
            );
            (from, (to - from).normalize())
        };
        (0..count).map(line).collect()
    }

    /// Compares the scene of both shapes in contact with the scene with a gap, by `count` rays from
    /// above and `count` rays from below.
    fn check(&self, precision: Precision, count: usize) {
        // A surface that coincides with a clear pane gets no light through it.
        let is_pane = |material: &str, shape: &str| {
            !is_solid(shape) && !["matte", "mirror"].contains(&material)
        };
        if is_pane(self.materials.0, self.upper) || is_pane(self.materials.1, self.lower) {
            return;
        }
        let both_flat = !is_solid(self.upper) && !is_solid(self.lower);
        // Of two flat shapes in one plane, a transparent one is in front of an opaque one. If both
        // are transparent, the one listed last is in front.
        let front_is_lower = !["matte", "mirror"].contains(&self.materials.1);
        for above in [true, false] {
            let gap = if both_flat && above == front_is_lower { -GAP } else { GAP };
            self.compare(gap, above, precision, count);
        }
    }

    /// Compares the radiance along `count` rays in the scene and in a copy whose upper shape is
    /// lifted by `gap`. At most 2 % of the rays may differ visibly.
    fn compare(&self, gap: f64, above: bool, precision: Precision, count: usize) {
        let lines = self.lines(above, count);
        let touching = self.traced(0.0, precision).radiance(&lines);
        let apart = self.traced(gap, precision).radiance(&lines);
        let mut differ = 0;
        let mut sum = DVec3::ZERO;
        for (a, b) in touching.iter().zip(&apart) {
            let difference = DVec3::from(*a) - DVec3::from(*b);
            sum += difference;
            differ += usize::from(difference.abs().max_element() > 0.02);
        }
        let mean = (sum / count as f64).abs().max_element();
        let context = || {
            format!(
                "{} on {}, {:?}, {}, {precision:?}, above: {above}: {differ} of {count} differ, \
                     the mean by {mean}",
                self.upper, self.lower, self.materials, self.place
            )
        };
        assert!(differ * 100 <= 2 * count, "{}", context());
        assert!(mean < 4e-3, "{}", context());
    }
}

fn is_solid(shape: &str) -> bool {
    !shape.starts_with("pla")
}

/// Checks every pair of shapes with every pair of materials, in both precisions.
#[test]
fn contact_is_the_limit_of_a_gap() {
    let folder = meshes();
    for upper in UPPER {
        for lower in LOWER {
            for materials in MATERIALS {
                if materials == ("thin", "thin") && (is_solid(upper) || is_solid(lower)) {
                    continue;
                }
                let (place, folder) = (DAffine3::IDENTITY, folder.path());
                let setting = Setting { upper, lower, materials, place, folder };
                for precision in [Precision::Single, Precision::Double] {
                    setting.check(precision, 256);
                }
            }
        }
    }
}

/// Checks shapes in contact that are tilted, far from the origin, small, or large.
#[test]
fn transformed_contact_is_the_limit_of_a_gap() {
    let folder = meshes();
    let mut numbers = Numbers::new(9);
    for scale in [1e-4, 1.0, 1e4] {
        for far in [0.0, 1.0, 1e5] {
            // Numbers in the scene file are rounded to 1e-16 of the offset, which is too coarse
            // here.
            if far == 1e5 && scale < 1.0 {
                continue;
            }
            for upper in UPPER {
                for lower in LOWER {
                    let turn =
                        DQuat::from_axis_angle(numbers.direction(), numbers.between(0.0, 3.0));
                    let offset = numbers.direction() * far;
                    let place = DAffine3::from_scale_rotation_translation(
                        DVec3::splat(scale),
                        turn,
                        offset,
                    );
                    let materials = MATERIALS[numbers.below(6)];
                    let folder = folder.path();
                    let setting = Setting { upper, lower, materials, place, folder };
                    for precision in [Precision::Single, Precision::Double] {
                        setting.check(precision, 256);
                    }
                }
            }
        }
    }
}

/// Checks nested solids with a common face that bounds both on the same side. A transparent solid
/// counts as outside of an opaque one. Of transparent solids, the last one listed counts as
/// outside.
#[test]
fn common_faces_of_nested_solids_have_an_order() {
    let folder = meshes();
    for (upper, lower, materials, gap) in [
        (OUTER, INNER, ("glass", "water"), GAP),
        (INNER, OUTER, ("water", "glass"), GAP),
        (OUTER, INNER, ("glass", "matte"), -GAP),
        (INNER, OUTER, ("mirror", "water"), GAP),
    ] {
        for place in [DAffine3::IDENTITY, DAffine3::from_rotation_x(0.7)] {
            let setting = Setting { upper, lower, materials, place, folder: folder.path() };
            for precision in [Precision::Single, Precision::Double] {
                setting.compare(gap, true, precision, 512);
                setting.compare(gap, false, precision, 512);
            }
        }
    }
}

/// Checks that light that bounces from the floor below a glass box hits the box's lower face, both
/// in contact and with a gap.
#[test]
fn diffuse_bounces_in_contact_are_the_limit_of_a_gap() {
    for floor in ["matte", "glass"] {
        for precision in [Precision::Single, Precision::Double] {
            let mean = |gap: f64, seed: u64| {
                let scene = parsed(&format!(
                    "film.size = [8, 8]\nambient.color = [1, 1, 1]\ntrace.max_diffuse_depth = 1\n\
                     camera = {{ eye = [0, 5, 0.1], target = [0, 0, 0], view_angle.vertical = 10 }}\n\
                     materials.matte = {{ diffuse = 0.8 }}\n\
                     materials.glass = {{ diffuse = 0.1, transmission = 1 }}\n\
                     [[object]]\nmaterial = \"glass\"\n\
                     shape.box = {{ center = [0, 0.5, 0], size = [2, 1, 2] }}\n\
                     transform = [{{ translate = [0, {gap}, 0] }}]\n\
                     [[object]]\nmaterial = \"{floor}\"\n\
                     shape.box = {{ center = [0, -0.5, 0], size = [5, 1, 5] }}\n"
                ));
                let picture = picture(&rendered(&scene, seed, precision, 32), Replicates::Both);
                picture.iter().map(|rgb| rgb[0]).sum::<f64>() / picture.len() as f64
            };
            let differences: Vec<f64> =
                (0..8).map(|seed| mean(0.0, seed) - mean(GAP, seed)).collect();
            let average = differences.iter().sum::<f64>() / 8.0;
            let squares: f64 = differences.iter().map(|d| (d - average).powi(2)).sum();
            let error = (squares / 56.0).sqrt();
            // With 7 degrees of freedom, Student's t exceeds 8 with a probability of 1e-4. The gap
            // itself moves edges by about its width.
            assert!(
                average.abs() < 8.0 * error + 10.0 * GAP,
                "glass on {floor}, {precision:?}: {average} +- {error} brighter in contact"
            );
        }
    }
}
