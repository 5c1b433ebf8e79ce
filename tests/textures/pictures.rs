//! Pictures of textured things against the direct evaluation, for every mapping, wrap and kind; and the
//! neighbours of each, which must be told from it.

use crate::direct::{self, Colors, Lay, SIZE, Solid, TO_LIGHT, Thing};
use crate::support::{Rng, picture, rendered};
use glam::{DAffine3, DVec3};
use image::RgbImage;
use std::f64::consts::{PI, TAU};
use std::fmt::Write;
use tempfile::TempDir;
use zerkalo::film::Part;
use zerkalo::scene::Scene;
use zerkalo::world::Precision;

/// Images of random pixels, in a folder for scenes.
struct Desk {
    folder: TempDir,
    colors: RgbImage,
    heights: RgbImage,
}

impl Desk {
    fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let mut rng = Rng(7);
        let mut random = |w, h, grey| {
            RgbImage::from_fn(w, h, |_, _| {
                let [r, g, b, _] = (rng.bits() as u32).to_le_bytes();
                image::Rgb(if grey { [r; 3] } else { [r, g, b] })
            })
        };
        let (colors, heights) = (random(7, 5, false), random(6, 9, true));
        colors.save(folder.path().join("colors.png")).unwrap();
        heights.save(folder.path().join("heights.png")).unwrap();
        Self { folder, colors, heights }
    }

    fn scene(&self, text: &str) -> Scene {
        let name = self.folder.path().join("scene.toml");
        Scene::parse(text, name.to_str().unwrap()).unwrap_or_else(|e| panic!("{e}\n{text}"))
    }
}

const EYE: DVec3 = DVec3::new(1.1, 1.3, 3.2);
const EVEN: DVec3 = DVec3::new(0.9, 0.5, 0.1);
const ODD: DVec3 = DVec3::new(0.1, 0.3, 0.8);

/// Something to look at, as the scene file and as the evaluation have it.
#[derive(Clone)]
struct Case {
    name: &'static str,
    solid: Solid,
    /// Instead of what `solid` says.
    shape: Option<String>,
    transform: &'static str,
    scene_from_object: DAffine3,
    lay: Lay,
    checker: bool,
    painted: bool,
    height: f64,
    /// Where everything is moved to.
    far: DVec3,
}

impl Case {
    fn new(name: &'static str, solid: Solid, lay: Lay) -> Self {
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

    fn shape(&self) -> String {
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

    /// The keys that say how it lies.
    fn lay(&self) -> String {
        let Lay { mapping, axis, scale, offset, .. } = self.lay;
        let axis = axis.map(|a| format!("axis = \"{a}\", ")).unwrap_or_default();
        format!("mapping = \"{mapping}\", {axis}scale = {scale:?}, offset = {offset:?}")
    }

    fn text(&self) -> String {
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
            "[film]\nsize = {SIZE:?}\nfilter = \"center\"\n[trace]\nlevel = \"primary\"\n\
             [camera]\neye = {eye}\ntarget = {target}\nview_angle.vertical = 40\n\
             [background]\ncolor = [0, 0, 0]\n[ambient]\ncolor = [0, 0, 0]\n\
             [[light]]\ndirectional = {{ direction = {} }}\nfalloff = \"none\"\nintensity = 1\n\
             [materials.m]\ncolor = [1, 1, 1]\n{material}\
             [[object]]\nmaterial = \"m\"\n{}\ntransform = [{steps}]\n",
            v(-TO_LIGHT),
            self.shape()
        )
    }

    fn expected(&self, desk: &Desk) -> Vec<DVec3> {
        let colors = if self.checker {
            Some(Colors::Checker([EVEN, ODD]))
        } else {
            self.painted.then_some(Colors::Image(&desk.colors))
        };
        let thing = Thing {
            solid: self.solid,
            scene_from_object: self.scene_from_object,
            lay: self.lay,
            colors,
            bump: (self.height != 0.0).then_some((&desk.heights, self.height)),
        };
        direct::picture(&thing, EYE, DVec3::ZERO)
    }

    fn shown(&self, desk: &Desk, precision: Precision) -> Vec<DVec3> {
        let rendering = rendered(&desk.scene(&self.text()), 1, precision, 1);
        picture(&rendering, Part::Both).into_iter().map(DVec3::from).collect()
    }
}

/// The share of the pixels that show something in which two pictures differ by more than `tolerance`.
fn differing(shown: &[DVec3], expected: &[DVec3], tolerance: f64) -> f64 {
    assert_eq!(shown.len(), expected.len());
    let pairs = shown.iter().zip(expected).filter(|(_, e)| !e.is_nan());
    let seen: Vec<_> = pairs.filter(|(s, e)| **s != DVec3::ZERO || **e != DVec3::ZERO).collect();
    assert!(seen.len() > 300, "only {} pixels show anything", seen.len());
    let wrong = seen.iter().filter(|(s, e)| (**s - **e).abs().max_element() > tolerance);
    wrong.count() as f64 / seen.len() as f64
}

/// Differences: in double precision, and in single, where an edge may fall on the other side of the
/// middle of a pixel.
fn differences(case: &Case, shown: &[Vec<DVec3>; 2], desk: &Desk) -> [f64; 2] {
    let expected = case.expected(desk);
    [differing(&shown[0], &expected, 2e-5), differing(&shown[1], &expected, 4e-3)]
}

const ALLOWED: [f64; 2] = [0.001, 0.01];

/// A share that something else differs in at least: many times what is allowed.
const TOLD: f64 = 0.08;

fn check(case: &Case, desk: &Desk) {
    let shown = [Precision::Double, Precision::Single].map(|p| case.shown(desk, p));
    let found = differences(case, &shown, desk);
    println!("{}: {found:?}", case.name);
    assert!(found[0] <= ALLOWED[0] && found[1] <= ALLOWED[1], "{}: {found:?}", case.name);
    for (neighbour, what) in neighbours(case) {
        let other = differences(&neighbour, &shown, desk);
        assert!(
            other.iter().all(|share| *share > TOLD),
            "{} is not told from {what}: {other:?}",
            case.name
        );
    }
}

/// What the picture must not be.
fn neighbours(case: &Case) -> Vec<(Case, &'static str)> {
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

fn ball() -> Solid {
    Solid::Sphere(DVec3::new(0.1, -0.05, 0.0), 0.9)
}

fn block() -> Solid {
    Solid::Block(DVec3::new(-0.05, 0.0, 0.1), DVec3::new(1.3, 1.1, 0.9))
}

fn pillar() -> Solid {
    Solid::Pillar(DVec3::new(0.0, -0.7, 0.0), 1.3, 0.7)
}

fn sheet() -> Solid {
    Solid::Sheet(DVec3::new(0.05, 0.0, 0.0), 1.9, 1.4)
}

fn lay(mapping: &'static str, scale: [f64; 2], offset: [f64; 2]) -> Lay {
    Lay { scale, offset, ..Lay::new(mapping) }
}

/// A turn, a squeeze and a step, as steps and as a map.
fn moved(mut case: Case) -> Case {
    case.transform = "{ rotate_y = 35 }, { scale = [1.2, 0.8, 1.0] }, { rotate_x = 20 }, \
                      { translate = [0.05, -0.1, 0.1] }, ";
    case.scene_from_object = DAffine3::from_translation(DVec3::new(0.05, -0.1, 0.1))
        * DAffine3::from_rotation_x(PI / 9.0)
        * DAffine3::from_scale(DVec3::new(1.2, 0.8, 1.0))
        * DAffine3::from_rotation_y(35f64.to_radians());
    case
}

fn mappings() -> Vec<Case> {
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

#[test]
fn every_mapping_of_an_image() {
    let desk = Desk::new();
    for case in mappings() {
        check(&case, &desk);
    }
}

#[test]
fn every_mapping_of_a_checker_on_things_that_are_transformed() {
    let desk = Desk::new();
    for case in mappings() {
        // Where a side lies along a projection the edges of squares lie in it: nobody can say which.
        if case.name == "planar block" {
            continue;
        }
        check(&moved(Case { checker: true, ..case }), &desk);
    }
}

#[test]
fn wraps_and_filters() {
    let desk = Desk::new();
    for (name, clamp, nearest) in
        [("clamped", true, false), ("nearest", false, true), ("clamped and nearest", true, true)]
    {
        let lay = Lay { clamp, nearest, ..lay("uv", [1.9, 1.8], [-0.4, -0.5]) };
        check(&Case::new(name, sheet(), lay), &desk);
    }
}

#[test]
fn bumps_by_every_mapping() {
    let desk = Desk::new();
    for case in mappings() {
        let height = 0.02 / case.lay.scale[0].min(1.0);
        check(&Case { height, painted: false, ..case }, &desk);
    }
}

#[test]
fn bumps_on_things_that_are_transformed_and_painted() {
    let desk = Desk::new();
    for case in mappings() {
        check(&moved(Case { height: 0.03, ..case }), &desk);
    }
}

/// Far from the origin everything looks as it does there: coordinates have some 1e-10 of a unit left.
#[test]
fn textures_stay_where_they_are_far_from_the_origin() {
    let desk = Desk::new();
    for case in mappings().into_iter().filter(|c| !matches!(c.solid, Solid::Floor(_))) {
        check(&Case { far: DVec3::new(1e6, -3e5, 7e5), height: 0.02, ..case }, &desk);
    }
}

/// A rectangle of two triangles whose file has texture coordinates is one with mapping `uv`.
#[test]
fn the_coordinates_of_a_mesh() {
    let desk = Desk::new();
    let sheet_text = "v -0.9 -0.7 0\nv 1.0 -0.7 0\nv 1.0 0.7 0\nv -0.9 0.7 0\n\
                      vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3\nf 1/1 3/3 4/4\n";
    std::fs::write(desk.folder.path().join("sheet.obj"), sheet_text).unwrap();
    for (name, mapping, height) in
        [("uv mesh", "uv", 0.0), ("bumped uv mesh", "uv", 0.03), ("uv by itself", "auto", 0.02)]
    {
        let mut case = Case::new(name, sheet(), lay("uv", [1.6, 1.3], [0.0, 0.4]));
        case.height = height;
        case.shape = Some("shape.mesh = { file = \"sheet.obj\" }".into());
        check(&case, &desk);
        check(&moved(case.clone()), &desk);
        let text = case.text().replace("mapping = \"uv\"", &format!("mapping = \"{mapping}\""));
        let one =
            |text: &str| picture(&rendered(&desk.scene(text), 1, Precision::Double, 1), Part::Both);
        assert!(one(&text) == one(&case.text()), "{name}");
    }
}

/// A ball of triangles with texture coordinates looks like a sphere with mapping `spherical`, the nearer
/// the finer it is.
#[test]
fn a_mesh_of_a_sphere() {
    let desk = Desk::new();
    let mut error = Vec::new();
    for sides in [24usize, 96] {
        let rings = sides / 2;
        let mut text = String::new();
        for j in 0..=rings {
            for i in 0..=sides {
                let (u, v) = (i as f64 / sides as f64, j as f64 / rings as f64);
                let ((s, c), (y, across)) =
                    ((TAU * (u - 0.5)).sin_cos(), (PI * (v - 0.5)).sin_cos());
                let [x, z] = [across * s, across * c];
                writeln!(text, "v {x} {y} {z}\nvt {u} {v}\nvn {x} {y} {z}").unwrap();
            }
        }
        for j in 0..rings {
            for i in 0..sides {
                let at = |i: usize, j: usize| {
                    let n = j * (sides + 1) + i + 1;
                    format!("{n}/{n}/{n}")
                };
                let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
                writeln!(text, "f {a} {b} {c} {d}").unwrap();
            }
        }
        std::fs::write(desk.folder.path().join("ball.obj"), text).unwrap();
        let mut case = Case::new("mesh", ball(), lay("spherical", [2.0, 1.0], [0.0, 0.0]));
        case.height = 0.02;
        let expected = case.expected(&desk);
        case.lay.mapping = "uv";
        case.shape = Some("shape.mesh = { file = \"ball.obj\" }".into());
        case.transform = "{ scale = 0.9 }, { translate = [0.1, -0.05, 0.0] }, ";
        // As high as on the sphere after the scale.
        case.height /= 0.9;
        let shown = case.shown(&desk, Precision::Double);
        error.push(differing(&shown, &expected, 0.03));
    }
    println!("{error:?}");
    assert!(error[1] < 0.05 && error[1] < 0.3 * error[0], "{error:?}");
}

/// A part of a compound has its own material, and its own place carries the texture.
#[test]
fn parts_of_compounds() {
    let desk = Desk::new();
    for checker in [false, true] {
        let mut case = Case::new("part", block(), lay("box", [1.4, 1.1], [0.21, 0.17]));
        (case.checker, case.height) = (checker, if checker { 0.0 } else { 0.03 });
        let alone = moved(case);
        let shape = format!(
            "shape.union.of = [\n{{ shape.sphere = {{ center = [0, 0, 90], radius = 1 }}, material = \"other\" }},\n\
             {{ {}, transform = [{}] }},\n]",
            alone.shape(),
            alone.transform.trim_end_matches(", "),
        );
        let mut part = Case { shape: Some(shape), transform: "", ..alone.clone() };
        let text = part.text() + "[materials.other]\n";
        let shown = [Precision::Double, Precision::Single].map(|p| {
            let rendering = rendered(&desk.scene(&text), 1, p, 1);
            picture(&rendering, Part::Both).into_iter().map(DVec3::from).collect::<Vec<_>>()
        });
        let found = differences(&part, &shown, &desk);
        assert!(found[0] <= ALLOWED[0] && found[1] <= ALLOWED[1], "{found:?}");
        part.lay.offset[0] += 0.2;
        assert!(differences(&part, &shown, &desk).iter().all(|share| *share > TOLD));
    }
}
