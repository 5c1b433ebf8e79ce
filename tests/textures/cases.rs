//! Textured objects, each in two forms: as a scene file, and for the direct evaluation. The
//! pictures of both forms must be equal. The direct evaluation of a variant of the object must give
//! another picture.

use crate::harness::*;
use crate::textures::direct;
use crate::textures::direct::{Colors, Lay, SIZE, Solid, TO_LIGHT, TexturedObject};
use tempfile::TempDir;

/// Folder of scenes, with two images of random pixels.
pub struct Desk {
    pub folder: TempDir,
    colors: RgbImage,
    heights: RgbImage,
}

impl Desk {
    pub fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let mut rng = Numbers::new(7);
        let mut random = |w, h, grey| {
            RgbImage::from_fn(w, h, |_, _| {
                let [r, g, b, _] = (rng.bits() as u32).to_le_bytes();
                if grey { [r; 3] } else { [r, g, b] }
            })
        };
        let (colors, heights) = (random(7, 5, false), random(6, 9, true));
        colors.save(&folder.path().join("colors.png"));
        heights.save(&folder.path().join("heights.png"));
        Self { folder, colors, heights }
    }

    pub fn scene(&self, text: &str) -> Scene {
        let name = self.folder.path().join("scene.toml");
        Scene::parse(text, name.to_str().unwrap()).unwrap_or_else(|e| panic!("{e}\n{text}"))
    }
}

const EYE: DVec3 = DVec3::new(1.1, 1.3, 3.2);
pub const EVEN: DVec3 = DVec3::new(0.9, 0.5, 0.1);
pub const ODD: DVec3 = DVec3::new(0.1, 0.3, 0.8);

/// Textured object, for the scene file and for the direct evaluation.
#[derive(Clone)]
pub struct Case {
    pub name: &'static str,
    pub solid: Solid,
    /// Text of the shape in the scene file, if it differs from `solid`.
    pub shape: Option<String>,
    pub transform: &'static str,
    pub scene_from_object: DAffine3,
    pub lay: Lay,
    pub checker: bool,
    pub painted: bool,
    pub height: f64,
    /// Translation of the whole scene.
    pub far: DVec3,
}

impl Case {
    pub fn new(name: &'static str, solid: Solid, lay: Lay) -> Self {
        Self {
            name,
            solid,
            shape: None,
            transform: "",
            scene_from_object: DAffine3::IDENTITY,
            lay,
            checker: false,
            painted: true,
            height: 0.0,
            far: DVec3::ZERO,
        }
    }

    pub fn shape(&self) -> String {
        let v = |v: DVec3| format!("{:?}", v.to_array());
        self.shape.clone().unwrap_or_else(|| match self.solid {
            Solid::Sphere(c, r) => format!("shape.sphere = {{ center = {}, radius = {r} }}", v(c)),
            Solid::Block(c, size) => {
                format!("shape.box = {{ center = {}, size = {} }}", v(c), v(size))
            }
            Solid::Pillar(b, h, r) => format!(
                "shape.cylinder = {{ base = {}, top = {}, radius = {r} }}",
                v(b),
                v(b + DVec3::Y * h)
            ),
            Solid::Sheet(c, w, h) => format!(
                "shape.rectangle = {{ center = {}, size = [{w}, {h}], normal = [0, 0, 1] }}",
                v(c)
            ),
            Solid::Floor(p) => {
                format!("shape.plane = {{ point = {}, normal = [0, 1, 0] }}", v(p))
            }
        })
    }

    /// Returns the text of the keys that place the texture.
    fn lay(&self) -> String {
        let Lay { mapping, axis, scale, offset, .. } = self.lay;
        let axis = axis.map(|a| format!("axis = \"{a}\", ")).unwrap_or_default();
        format!("mapping = \"{mapping}\", {axis}scale = {scale:?}, offset = {offset:?}")
    }

    pub fn text(&self) -> String {
        let mut material = String::new();
        let lay = self.lay();
        let wrap = if self.lay.clamp { "clamp" } else { "repeat" };
        if self.checker {
            let (even, odd) = (EVEN.to_array(), ODD.to_array());
            writeln!(material, "texture.checker = {{ even = {even:?}, odd = {odd:?}, {lay} }}")
                .unwrap();
        } else if self.painted {
            let filter = if self.lay.nearest { "nearest" } else { "bilinear" };
            let more = format!("wrap = \"{wrap}\", filter = \"{filter}\"");
            writeln!(material, "texture.image = {{ file = \"colors.png\", {lay}, {more} }}")
                .unwrap();
        }
        if self.height != 0.0 {
            let more = format!("height = {:?}, wrap = \"{wrap}\"", self.height);
            writeln!(material, "bump.image = {{ file = \"heights.png\", {lay}, {more} }}").unwrap();
        }
        let v = |v: DVec3| format!("{:?}", v.to_array());
        let (eye, target) = (v(EYE + self.far), v(self.far));
        let mut steps = self.transform.to_string();
        if self.far != DVec3::ZERO {
            write!(steps, "{{ translate = {} }}", v(self.far)).unwrap();
        }
        format!(
            "[film]\nsize = {SIZE:?}\nfilter = \"point\"\n[trace]\nray_types = \"primary\"\n\
             [camera]\neye = {eye}\ntarget = {target}\nview_angle.vertical = 40\n\
             [background]\ncolor = [0, 0, 0]\n[ambient]\ncolor = [0, 0, 0]\n\
             [[light]]\ndirectional = {{ direction = {} }}\nfalloff = \"none\"\nintensity = 1\n\
             [materials.m]\ncolor = [1, 1, 1]\n{material}\
             [[object]]\nmaterial = \"m\"\n{}\ntransform = [{steps}]\n",
            v(-TO_LIGHT),
            self.shape()
        )
    }

    pub fn expected(&self, desk: &Desk) -> Vec<DVec3> {
        let colors = if self.checker {
            Some(Colors::Checker([EVEN, ODD]))
        } else {
            self.painted.then_some(Colors::Image(&desk.colors))
        };
        let thing = TexturedObject {
            solid: self.solid,
            scene_from_object: self.scene_from_object,
            lay: self.lay,
            colors,
            bump: (self.height != 0.0).then_some((&desk.heights, self.height)),
        };
        direct::picture(&thing, EYE, DVec3::ZERO)
    }

    pub fn shown(&self, desk: &Desk, precision: Precision) -> Vec<DVec3> {
        let rendering = rendered(&desk.scene(&self.text()), 1, precision, 1);
        picture(&rendering, Replicates::Both).into_iter().map(DVec3::from).collect()
    }
}

/// Returns the fraction of pixels whose values in two pictures differ by more than `tolerance`.
/// Pixels that are black in both pictures, or NaN in `expected`, do not count.
pub fn differing(shown: &[DVec3], expected: &[DVec3], tolerance: f64) -> f64 {
    assert_eq!(shown.len(), expected.len());
    let pairs = shown.iter().zip(expected).filter(|(_, e)| !e.is_nan());
    let seen: Vec<_> = pairs.filter(|(s, e)| **s != DVec3::ZERO || **e != DVec3::ZERO).collect();
    assert!(seen.len() > 300, "only {} pixels show anything", seen.len());
    let wrong = seen.iter().filter(|(s, e)| (**s - **e).abs().max_element() > tolerance);
    wrong.count() as f64 / seen.len() as f64
}

/// Returns the fractions of pixels in which the program's pictures `shown` differ from the direct
/// evaluation: in double precision and in single precision. In single precision an edge may be on
/// the other side of a pixel's centre.
pub fn differences(case: &Case, shown: &[Vec<DVec3>; 2], desk: &Desk) -> [f64; 2] {
    let expected = case.expected(desk);
    [differing(&shown[0], &expected, 2e-5), differing(&shown[1], &expected, 4e-3)]
}

pub const ALLOWED: [f64; 2] = [0.001, 0.01];

/// Smallest fraction of pixels in which the direct evaluation of a variant must differ from the
/// program's picture of the object. It is at least eight times [`ALLOWED`], the largest fractions
/// for the object itself.
pub const TOLD: f64 = 0.08;

pub fn check(case: &Case, desk: &Desk) {
    let shown = [Precision::Double, Precision::Single].map(|p| case.shown(desk, p));
    let found = differences(case, &shown, desk);
    println!("{}: {found:?}", case.name);
    assert!(found[0] <= ALLOWED[0] && found[1] <= ALLOWED[1], "{}: {found:?}", case.name);
    for (neighbour, what) in variants(case) {
        let other = differences(&neighbour, &shown, desk);
        assert!(
            other.iter().all(|share| *share > TOLD),
            "{} is not told from {what}: {other:?}",
            case.name
        );
    }
}

/// Returns variants of a textured object whose direct evaluations must differ from the object's
/// picture, each with its name.
fn variants(case: &Case) -> Vec<(Case, &'static str)> {
    let with = |change: &dyn Fn(&mut Case)| {
        let mut other = case.clone();
        change(&mut other);
        other
    };
    let other = match case.lay.mapping {
        "spherical" => "planar",
        "planar" | "uv" => "spherical",
        _ if matches!(case.solid, Solid::Sphere(..)) => "spherical",
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

pub fn ball() -> Solid {
    Solid::Sphere(DVec3::new(0.1, -0.05, 0.0), 0.9)
}

pub fn block() -> Solid {
    Solid::Block(DVec3::new(-0.05, 0.0, 0.1), DVec3::new(1.3, 1.1, 0.9))
}

fn pillar() -> Solid {
    Solid::Pillar(DVec3::new(0.0, -0.7, 0.0), 1.3, 0.7)
}

pub fn sheet() -> Solid {
    Solid::Sheet(DVec3::new(0.05, 0.0, 0.0), 1.9, 1.4)
}

pub fn lay(mapping: &'static str, scale: [f64; 2], offset: [f64; 2]) -> Lay {
    Lay { scale, offset, ..Lay::new(mapping) }
}

/// Returns the object with a rotation, a scaling and a translation, both as transform steps in the
/// scene file and as an affine map.
pub fn moved(mut case: Case) -> Case {
    case.transform = "{ rotate_y = 35 }, { scale = [1.2, 0.8, 1.0] }, { rotate_x = 20 }, \
                      { translate = [0.05, -0.1, 0.1] }, ";
    case.scene_from_object = DAffine3::from_translation(DVec3::new(0.05, -0.1, 0.1))
        * DAffine3::from_rotation_x(PI / 9.0)
        * DAffine3::from_scale(DVec3::new(1.2, 0.8, 1.0))
        * DAffine3::from_rotation_y(35f64.to_radians());
    case
}

pub fn mappings() -> Vec<Case> {
    let mut cases = vec![
        Case::new("planar block", block(), lay("planar", [1.1, 0.9], [0.13, -0.37])),
        Case::new("spherical ball", ball(), lay("spherical", [3.0, 2.0], [0.3, 0.1])),
        Case::new("cylindrical pillar", pillar(), lay("cylindrical", [3.0, 1.7], [-0.4, 0.2])),
        Case::new("box block", block(), lay("box", [1.4, 1.1], [0.21, 0.17])),
        Case::new("box ball", ball(), lay("box", [1.4, 1.1], [0.21, 0.17])),
        Case::new("uv sheet", sheet(), lay("uv", [1.6, 1.3], [0.0, 0.4])),
        Case::new("planar sheet", sheet(), lay("planar", [0.9, 1.2], [-0.1, 0.4])),
        Case::new(
            "planar floor",
            Solid::Floor(DVec3::new(0.3, -0.8, 0.2)),
            lay("planar", [0.4, 0.3], [0.1, 0.0]),
        ),
        Case::new("cylindrical block", block(), lay("cylindrical", [2.0, 1.0], [0.0, 0.0])),
        Case::new("spherical block", block(), lay("spherical", [2.0, 2.0], [0.0, 0.0])),
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
        cases.push(Case::new(name, ball(), lay));
    }
    cases
}
