//! Random valid scenes and random edits.

use crate::harness::*;
use proptest::prelude::*;
use zerkalo_scene::Rotate;
use zerkalo_scene::material::Metal;
use zerkalo_scene::shape::{
    Cone, Cube, Difference, HorizontalRectangle, Intersection, Plane, Prism, Pyramid, Rectangle,
    Sphere, TaperedCylinder, Union, UnitFrustum,
};

fn coordinate() -> impl Strategy<Value = f64> {
    prop_oneof![
        (-1000i32..1000).prop_map(|i| f64::from(i) / 8.0),
        -1e6..1e6f64,
        (-9..9i32, -9.99..9.99f64).prop_map(|(e, m)| m * 10f64.powi(e - 1)),
    ]
}

fn point() -> impl Strategy<Value = [f64; 3]> {
    [coordinate(), coordinate(), coordinate()]
}

fn size() -> impl Strategy<Value = f64> {
    prop_oneof![1e-3..1e3f64, (1i32..50).prop_map(f64::from)]
}

fn direction() -> impl Strategy<Value = [f64; 3]> {
    [-1.0..1.0f64, 0.1..1.0f64, -1.0..1.0f64]
}

fn color() -> impl Strategy<Value = Color> {
    prop_oneof![
        [0.0..2.0f64, 0.0..1.0f64, 0.0..1.0f64].prop_map(Color),
        any::<[u8; 3]>()
            .prop_map(|[r, g, b]| { Color::from_hex(&format!("#{r:02x}{g:02x}{b:02x}")).unwrap() }),
    ]
}

fn shape() -> impl Strategy<Value = Shape> {
    prop_oneof![4 => simple(), 1 => compound(2)]
}

/// Returns a strategy for random compounds of solids, nested at most `levels` deep.
fn compound(levels: u32) -> BoxedStrategy<Shape> {
    let solid = || {
        simple().prop_filter("flat", |shape| {
            !matches!(shape, Shape::HorizontalRectangle(_) | Shape::Rectangle(_) | Shape::Plane(_))
        })
    };
    let inner = if levels > 1 {
        prop_oneof![3 => solid(), 1 => compound(levels - 1)].boxed()
    } else {
        solid().boxed()
    };
    let transform =
        prop_oneof![2 => Just(Vec::new()), 1 => proptest::collection::vec(step(), 1..3)];
    let part = (inner, transform)
        .prop_map(|(shape, transform)| CsgOperand { transform, ..CsgOperand::new(shape) });
    (proptest::collection::vec(part, 2..4), 0..3)
        .prop_map(|(of, kind)| match kind {
            0 => Shape::Union(Union { of }),
            1 => Shape::Intersection(Intersection { of }),
            _ => Shape::Difference(Difference { of }),
        })
        .prop_filter("a part misplaced", |shape| shape.faults().is_empty())
        .boxed()
}

fn simple() -> impl Strategy<Value = Shape> {
    let angle = || prop_oneof![Just(0.0), -360.0..360.0f64];
    prop_oneof![
        (point(), size()).prop_map(|(center, radius)| Shape::Sphere(Sphere { center, radius })),
        (point(), size(), angle()).prop_map(|(corner, edge, rotation)| Shape::Cube(Cube {
            corner,
            edge,
            rotation
        })),
        (point(), [size(), size(), size()])
            .prop_map(|(center, size)| Shape::Cuboid(Cuboid { center, size })),
        (point(), size(), size(), size(), angle()).prop_map(
            |(corner, side, apex_height, height, rotation)| {
                Shape::Pyramid(Pyramid { corner, side, apex_height, height, rotation })
            }
        ),
        (point(), size(), size(), angle()).prop_map(|(corner, side, height, rotation)| {
            Shape::Prism(Prism { corner, side, height, rotation })
        }),
        (point(), [size(), size()]).prop_map(|(center, size)| Shape::HorizontalRectangle(
            HorizontalRectangle { center, size }
        )),
        (point(), [size(), size()], direction())
            .prop_map(|(center, size, normal)| {
                Shape::Rectangle(Rectangle { center, size, normal, up: [0.0, 0.0, 1.0] })
            })
            .prop_filter("up along the normal", |shape| shape.faults().is_empty()),
        (point(), direction()).prop_map(|(point, normal)| Shape::Plane(Plane { point, normal })),
        round(),
    ]
}

fn round() -> impl Strategy<Value = Shape> {
    let axis = || {
        (point(), direction(), size()).prop_map(|(base, [x, y, z], length)| {
            let top = [base[0] + x * length, base[1] + y * length, base[2] + z * length];
            (base, top)
        })
    };
    prop_oneof![
        (axis(), size()).prop_map(|((base, top), radius)| Shape::Cylinder(Cylinder {
            base,
            top,
            radius
        })),
        (axis(), size()).prop_map(|((base, apex), radius)| Shape::Cone(Cone {
            base,
            apex,
            radius
        })),
        (axis(), size(), size()).prop_map(|((base, top), base_radius, top_radius)| {
            Shape::TaperedCylinder(TaperedCylinder { base, top, base_radius, top_radius })
        }),
        (0.0..3.0f64).prop_map(|s| Shape::UnitFrustum(UnitFrustum { s })),
    ]
}

fn step() -> impl Strategy<Value = TransformOp> {
    let factor = || prop_oneof![0.1..10.0f64, -10.0..-0.1f64];
    prop_oneof![
        point().prop_map(TransformOp::Translate),
        coordinate().prop_map(TransformOp::RotateX),
        coordinate().prop_map(TransformOp::RotateY),
        coordinate().prop_map(TransformOp::RotateZ),
        (direction(), coordinate())
            .prop_map(|(axis, degrees)| TransformOp::Rotate(Rotate { axis, degrees })),
        factor().prop_map(|f| TransformOp::Scale(Scale([f; 3]))),
        [factor(), factor(), factor()].prop_map(|f| TransformOp::Scale(Scale(f))),
    ]
}

fn name() -> impl Strategy<Value = String> {
    prop_oneof![
        3 => "[a-c]",
        1 => Just(String::new()),
        2 => "[ -~]{1,8}",
        1 => "\\PC{1,8}",
        1 => "[\"'\\\\#\n\t\u{1b}]{1,4}",
    ]
}

fn object() -> impl Strategy<Value = Object> {
    let transform =
        prop_oneof![2 => Just(Vec::new()), 1 => proptest::collection::vec(step(), 0..4)];
    (name(), shape(), transform)
        .prop_map(|(name, shape, transform)| Object {
            name,
            material: String::new(),
            shape,
            transform,
        })
        .prop_filter("misplaced by its transform", |object| object.faults().is_empty())
}

fn light() -> impl Strategy<Value = Light> {
    (name(), point(), direction(), color(), 0.0..100.0f64, any::<(bool, bool, bool)>()).prop_map(
        |(name, position, direction, color, intensity, (is_point, inverse, on))| Light {
            name,
            color,
            intensity,
            falloff: if is_point && inverse { Falloff::InverseSquare } else { Falloff::None },
            on,
            ..Light::new(match is_point {
                true => LightKind::from(Point { position }),
                false => Directional::along(direction).into(),
            })
        },
    )
}

fn material() -> impl Strategy<Value = Material> {
    let coefficient = || prop_oneof![Just(0.0), Just(1.0), 0.0..1.0f64];
    let lobes = proptest::sample::select(vec![
        Lobe::Mirror,
        Lobe::Cone,
        Lobe::Square,
        Lobe::Beckmann,
        Lobe::Ggx,
    ]);
    let spread = (lobes, 0.0..1.0f64, proptest::option::of(0.0..1.0f64));
    (color(), [coefficient(), coefficient(), coefficient()], spread, any::<(bool, bool, bool)>())
        .prop_map(|(color, [diffuse, specular, reflection], (lobe, roughness, alpha), flags)| {
            Material {
                color,
                diffuse,
                specular,
                reflection,
                lobe,
                roughness,
                alpha,
                highlight: if flags.0 { Highlight::CookTorrance } else { Highlight::Phong },
                metal: flags.1.then_some(Metal::Copper),
                fresnel: flags.2.then_some(Fresnel::Schlick),
                two_sided: flags.0,
                ..Material::default()
            }
        })
}

pub fn camera() -> impl Strategy<Value = Camera> {
    (point(), direction(), 1.0..179.0f64, any::<(bool, bool, bool, u8)>())
        .prop_map(|(eye, direction, degrees, (aim, across, open, focus))| {
            let [x, y, z] = eye;
            Camera {
                eye,
                target: aim.then_some([x + 1.0, y, z + 1.0]),
                direction: (!aim).then_some(direction),
                up: [0.0, 0.5, 1.0],
                view_angle: if across {
                    ViewAngle::Horizontal(degrees)
                } else {
                    ViewAngle::Vertical(degrees)
                },
                aperture: open.then_some(Aperture::FNumber(degrees)),
                focus: match focus {
                    0 => Some(Focus::Distance(degrees)),
                    1 => Some(Focus::Point([x, y + 1.0, z])),
                    _ => None,
                },
                ..Camera::at_origin()
            }
        })
        .prop_filter("looks along up", |camera| camera.faults().is_empty())
}

fn unique<'a>(names: impl Iterator<Item = &'a mut String>) {
    let mut seen = std::collections::HashSet::new();
    for name in names.filter(|name| !name.is_empty()) {
        while !seen.insert(name.clone()) {
            *name += "'";
        }
    }
}

/// Returns the scene with unique names and with materials assigned to its objects.
pub fn tidy(mut scene: Scene) -> Scene {
    unique(scene.objects.iter_mut().map(|o| &mut o.name));
    unique(scene.lights.iter_mut().map(|l| &mut l.name));
    for (i, object) in scene.objects.iter_mut().enumerate() {
        let materials = scene.materials.len() + 1;
        object.material = scene.materials.keys().nth(i % materials).cloned().unwrap_or_default();
    }
    scene
}

pub fn scene() -> impl Strategy<Value = Scene> {
    let lists = (
        proptest::collection::vec(light(), 0..4),
        proptest::collection::btree_map("\\PC{1,6}", material(), 0..4),
        proptest::collection::vec(object(), 0..6),
    );
    let cameras = proptest::collection::btree_map("\\PC{1,6}", camera(), 0..3);
    (camera(), cameras, [1u32..2000, 1..2000], any::<bool>(), color(), lists).prop_map(
        |(camera, cameras, size, point, background, (lights, materials, objects))| {
            let mut scene =
                Scene { camera, cameras, lights, materials, objects, ..Scene::default() };
            scene.film.size = size;
            scene.film.filter = if point { Filter::Point } else { Filter::Box };
            scene.background.color = background;
            tidy(scene)
        },
    )
}

/// Applies the edit with the number `what` to `scene`. The edit may copy parts of the scene
/// `other`. `at` selects the objects.
pub fn edit(scene: &mut Scene, other: &Scene, (what, at): (u8, usize)) {
    let n = scene.objects.len();
    let some = |n: usize| if n == 0 { 0 } else { at % n };
    match what {
        0 => scene.camera = other.camera.clone(),
        1 => scene.film = other.film.clone(),
        2 if n > 0 => drop(scene.objects.remove(some(n))),
        3 => scene.objects.extend(other.objects.first().cloned()),
        4 if n > 0 && !other.objects.is_empty() => {
            scene.objects[some(n)].shape = other.objects[some(other.objects.len())].shape.clone();
            scene.objects[some(n)].transform.clear();
        }
        5 if n > 0 => scene.objects[some(n)].name += "'",
        6 if n > 0 => scene.objects.rotate_left(some(n)),
        7 if n > 0 => scene.objects.insert(
            some(n),
            Object {
                name: String::new(),
                material: String::new(),
                shape: Shape::Sphere(Sphere { center: [0.5; 3], radius: 0.5 }),
                transform: Vec::new(),
            },
        ),
        8 => scene.materials.extend(other.materials.clone()),
        9 => {
            for (a, b) in scene.materials.values_mut().zip(other.materials.values()) {
                *a = b.clone();
            }
        }
        10 => drop(scene.materials.pop_first()),
        11 => scene.lights.extend(other.lights.last().cloned()),
        12 if !scene.lights.is_empty() => drop(scene.lights.remove(0)),
        13 => scene.background = other.background.clone(),
        14 if n > 0 && !other.objects.is_empty() => {
            let transform = other.objects[some(other.objects.len())].transform.clone();
            let object = &mut scene.objects[some(n)];
            let old = std::mem::replace(&mut object.transform, transform);
            if !object.faults().is_empty() {
                object.transform = old;
            }
        }
        15 => *scene = other.clone(),
        16 => scene.cameras = other.cameras.clone(),
        17 => {
            if let Some((name, view)) = scene.cameras.pop_first() {
                scene.cameras.insert(name + "'", view);
            }
        }
        _ => {}
    }
}
