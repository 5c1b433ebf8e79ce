//! Textured objects whose pictures must equal those of the reference tracer. The reference tracer's
//! picture of a variant must be another one.

use crate::harness::*;
use crate::reference::*;
use tempfile::TempDir;

/// Folder with two images of random pixels.
pub struct Desk(pub TempDir);

impl Desk {
    pub fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let mut rng = Numbers::new(7);
        let mut save = |name: &str, w, h, grey| {
            let image = RgbImage::from_fn(w, h, |_, _| {
                let [r, g, b, _] = (rng.bits() as u32).to_le_bytes();
                if grey { [r; 3] } else { [r, g, b] }
            });
            image.save(&folder.path().join(name));
        };
        save("colors.png", 7, 5, false);
        save("heights.png", 6, 9, true);
        Self(folder)
    }

    fn file(&self, name: &str) -> String {
        self.0.path().join(name).to_str().unwrap().to_string()
    }

    pub fn scene(&self, text: &str) -> Scene {
        Scene::parse(text, &self.file("scene.toml")).unwrap_or_else(|e| panic!("{e}\n{text}"))
    }

    pub fn shown(&self, text: &str, precision: Precision) -> Vec<DVec3> {
        let rendering = rendered(&self.scene(text), 1, precision, 1);
        picture(&rendering, Replicates::Both).into_iter().map(DVec3::from).collect()
    }
}

/// Placement of a texture.
#[derive(Clone, Copy, Debug)]
pub struct Lay {
    pub mapping: &'static str,
    pub axis: Option<char>,
    pub scale: [f64; 2],
    pub offset: [f64; 2],
    pub clamp: bool,
    pub nearest: bool,
}

pub fn lay(mapping: &'static str, scale: [f64; 2], offset: [f64; 2]) -> Lay {
    Lay { mapping, axis: None, scale, offset, clamp: false, nearest: false }
}

#[derive(Clone)]
pub struct Case {
    pub name: &'static str,
    /// Text of the shape after `shape.`.
    pub shape: String,
    pub transform: &'static str,
    pub lay: Lay,
    pub checker: bool,
    pub painted: bool,
    pub height: f64,
    /// Translation of the whole scene.
    pub far: DVec3,
}

impl Case {
    pub fn new(name: &'static str, shape: &str, lay: Lay) -> Self {
        let (shape, far) = (shape.to_string(), DVec3::ZERO);
        Self { name, shape, transform: "", lay, checker: false, painted: true, height: 0.0, far }
    }

    pub fn text(&self, desk: &Desk) -> String {
        let Lay { mapping, axis, scale, offset, clamp, nearest } = self.lay;
        let axis = axis.map(|a| format!("axis = \"{a}\", ")).unwrap_or_default();
        let lay = format!("mapping = \"{mapping}\", {axis}scale = {scale:?}, offset = {offset:?}");
        let wrap = if clamp { "clamp" } else { "repeat" };
        let filter = if nearest { "nearest" } else { "bilinear" };
        let mut material = String::new();
        if self.checker {
            material += &format!(
                "texture.checker = {{ even = [0.9, 0.5, 0.1], odd = [0.1, 0.3, 0.8], {lay} }}\n"
            );
        } else if self.painted {
            material += &format!(
                "texture.image = {{ file = {:?}, {lay}, wrap = \"{wrap}\", filter = \"{filter}\" }}\n",
                desk.file("colors.png")
            );
        }
        if self.height != 0.0 {
            material += &format!(
                "bump.image = {{ file = {:?}, {lay}, height = {:?}, wrap = \"{wrap}\" }}\n",
                desk.file("heights.png"),
                self.height
            );
        }
        let far = self.far.to_array();
        let eye = (self.far + DVec3::new(1.1, 1.3, 3.2)).to_array();
        let (shape, transform) = (&self.shape, self.transform);
        format!(
            "film = {{ size = [60, 48], filter = \"point\" }}\ntrace.ray_types = \"primary\"\n\
             camera = {{ eye = {eye:?}, target = {far:?}, view_angle.vertical = 40 }}\n\
             [[light]]\ndirectional.direction = [-0.5, -0.7, -0.9]\n\
             [materials.m]\ncolor = [1, 1, 1]\n{material}\
             [[object]]\nmaterial = \"m\"\nshape.{shape}\n\
             transform = [{transform}{{ translate = {far:?} }}]\n"
        )
    }

    /// Returns the reference tracer's picture of the object at the origin.
    pub fn expected(&self, desk: &Desk) -> Vec<DVec3> {
        let scene = desk.scene(&Self { far: DVec3::ZERO, ..self.clone() }.text(desk));
        reference_without_noise(&scene)
    }
}

/// Returns the fraction of pixels whose values in two pictures differ by more than `tolerance`.
/// Pixels that are black in both pictures do not count.
pub fn differing(shown: &[DVec3], expected: &[DVec3], tolerance: f64) -> f64 {
    let pairs = shown.iter().zip(expected);
    let seen: Vec<_> = pairs.filter(|(s, e)| **s != DVec3::ZERO || **e != DVec3::ZERO).collect();
    assert!(seen.len() > 300, "only {} pixels show anything", seen.len());
    let wrong = seen.iter().filter(|(s, e)| (**s - **e).abs().max_element() > tolerance);
    wrong.count() as f64 / seen.len() as f64
}

/// Returns the fractions of pixels in which the program's pictures `shown` differ from `expected`:
/// in double precision and in single precision. In single precision an edge may be on the other
/// side of a pixel's centre.
fn differences(expected: &[DVec3], shown: &[Vec<DVec3>; 2]) -> [f64; 2] {
    [differing(&shown[0], expected, 2e-5), differing(&shown[1], expected, 4e-3)]
}

/// Checks that the program's picture of the scene `text` shows the object `case`, and not a variant
/// of it.
pub fn check_text(text: &str, case: &Case, desk: &Desk) {
    let shown = [Precision::Double, Precision::Single].map(|p| desk.shown(text, p));
    let found = differences(&case.expected(desk), &shown);
    println!("{}: {found:?}", case.name);
    assert!(found[0] <= 0.001 && found[1] <= 0.01, "{}: {found:?}\n{text}", case.name);
    for (variant, what) in variants(case) {
        // At least eight times the fractions that are allowed for the object itself.
        let other = differences(&variant.expected(desk), &shown);
        assert!(other.iter().all(|share| *share > 0.08), "{} and {what}: {other:?}", case.name);
    }
}

pub fn check(case: &Case, desk: &Desk) {
    check_text(&case.text(desk), case, desk);
}

fn variants(case: &Case) -> Vec<(Case, &'static str)> {
    let with = |change: &dyn Fn(&mut Case)| {
        let mut other = case.clone();
        change(&mut other);
        other
    };
    let other = match case.lay.mapping {
        "spherical" => "planar",
        "planar" | "uv" => "spherical",
        _ if case.shape.starts_with("sphere") => "spherical",
        "cylindrical" => "box",
        _ => "cylindrical",
    };
    let mut out = vec![
        (with(&|c| c.lay.mapping = other), "another mapping"),
        (with(&|c| c.lay.scale = [1.3 * c.lay.scale[0], 0.7 * c.lay.scale[1]]), "another scale"),
        (with(&|c| c.lay.offset[0] += 0.21), "another offset"),
    ];
    if case.painted || case.checker {
        out.push((with(&|c| (c.checker, c.painted) = (!c.checker, c.checker)), "another kind"));
    }
    if case.height != 0.0 {
        out.push((with(&|c| c.height = 0.0), "a flat surface"));
        out.push((with(&|c| c.height = -c.height), "a sunken surface"));
    }
    if case.lay.nearest {
        out.push((with(&|c| c.lay.nearest = false), "bilinear"));
    }
    if case.lay.clamp {
        out.push((with(&|c| c.lay.clamp = false), "repeat"));
    }
    out
}

pub const BALL: &str = "sphere = { center = [0.1, -0.05, 0.0], radius = 0.9 }";
pub const BLOCK: &str = "box = { center = [-0.05, 0.0, 0.1], size = [1.3, 1.1, 0.9] }";
const PILLAR: &str = "cylinder = { base = [0.0, -0.7, 0.0], top = [0.0, 0.6, 0.0], radius = 0.7 }";
pub const SHEET: &str =
    "rectangle = { center = [0.05, 0.0, 0.0], size = [1.9, 1.4], normal = [0, 0, 1] }";
const FLOOR: &str = "plane = { point = [0.3, -0.8, 0.2], normal = [0, 1, 0] }";

/// Returns the object with a rotation, a scaling and a translation.
pub fn moved(case: Case) -> Case {
    let transform = "{ rotate_y = 35 }, { scale = [1.2, 0.8, 1.0] }, { rotate_x = 20 }, \
                     { translate = [0.05, -0.1, 0.1] }, ";
    Case { transform, ..case }
}

pub fn mappings() -> Vec<Case> {
    let mut cases = vec![
        Case::new("planar block", BLOCK, lay("planar", [1.1, 0.9], [0.13, -0.37])),
        Case::new("spherical ball", BALL, lay("spherical", [3.0, 2.0], [0.3, 0.1])),
        Case::new("cylindrical pillar", PILLAR, lay("cylindrical", [3.0, 1.7], [-0.4, 0.2])),
        Case::new("box block", BLOCK, lay("box", [1.4, 1.1], [0.21, 0.17])),
        Case::new("box ball", BALL, lay("box", [1.4, 1.1], [0.21, 0.17])),
        Case::new("uv sheet", SHEET, lay("uv", [1.6, 1.3], [0.0, 0.4])),
        Case::new("planar sheet", SHEET, lay("planar", [0.9, 1.2], [-0.1, 0.4])),
        Case::new("planar floor", FLOOR, lay("planar", [0.4, 0.3], [0.1, 0.0])),
        Case::new("cylindrical block", BLOCK, lay("cylindrical", [2.0, 1.0], [0.0, 0.0])),
        Case::new("spherical block", BLOCK, lay("spherical", [2.0, 2.0], [0.0, 0.0])),
    ];
    for (name, mapping, axis) in [
        ("planar along x", "planar", 'x'),
        ("planar along y", "planar", 'y'),
        ("spherical around x", "spherical", 'x'),
        ("spherical around z", "spherical", 'z'),
        ("cylindrical around x", "cylindrical", 'x'),
        ("cylindrical around z", "cylindrical", 'z'),
    ] {
        let lay = Lay { axis: Some(axis), ..lay(mapping, [1.7, 1.3], [0.11, 0.23]) };
        cases.push(Case::new(name, BALL, lay));
    }
    cases
}
