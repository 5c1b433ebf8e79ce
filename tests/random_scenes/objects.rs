//! Random materials, shapes of every registered kind, and objects.

use crate::harness::*;
use crate::random_scenes::words::{chance, direction, list, log, pick, table};
use std::sync::OnceLock;
use zerkalo_scene::material;
use zerkalo_scene::shape::KINDS;
use zerkalo_scene::{AssetResolver, Rotate};

/// Names of mesh files; the empty name is the built-in icosahedron.
const MESHES: &[&str] = &[
    "",
    "scenes/meshes/knot.ply",
    "scenes/meshes/stone.obj",
    "scenes/meshes/vase.ply",
    "tests/random_scenes/block.obj",
    "tests/random_scenes/block.obj",
    "tests/random_scenes/sheet.obj",
];

const IMAGES: &[&str] = &[
    "scenes/textures/brick-heights.png",
    "scenes/textures/bricks.png",
    "scenes/textures/sheet.png",
    "scenes/textures/wood.png",
];

/// Returns the resolver that loads the files to which scenes refer. All scenes share the loaded
/// files.
pub fn library() -> AssetResolver {
    static ASSETS: OnceLock<Arc<Assets>> = OnceLock::new();
    AssetResolver::new(Path::new(NAME), ASSETS.get_or_init(Arc::default).clone())
}

/// Returns a random coefficient of a material: 0, 1 or a number between them, and rarely a larger
/// number.
fn coefficient(numbers: &mut Numbers) -> f64 {
    match numbers.below(12) {
        0 => 0.0,
        1 | 2 => 1.0,
        3 => numbers.between(1.0, 1.5),
        _ => numbers.unit(),
    }
}

fn index(numbers: &mut Numbers) -> f64 {
    match numbers.below(6) {
        0 => 1.0,
        1 | 2 => 1.5,
        3 => log(numbers, 0.1, 100.0),
        _ => numbers.between(1.0, 2.5),
    }
}

fn material_key(numbers: &mut Numbers, field: &Field) -> Option<Value> {
    Some(match field.name {
        "ambient" | "diffuse" | "specular" => Value::Float(coefficient(numbers)),
        "reflection" | "transmission" => Value::Float(coefficient(numbers).min(1.0)),
        "exponent" => Value::Float(match numbers.below(3) {
            0 => log(numbers, 1.0, 1e9),
            _ => numbers.between(0.0, 200.0),
        }),
        "ior" => Value::Float(index(numbers)),
        "roughness" | "alpha" => Value::Float(match numbers.below(4) {
            0 => 0.0,
            _ => log(numbers, 1e-4, 3.0),
        }),
        "attenuation_distance" => Value::Float(log(numbers, 0.01, 100.0)),
        "height" => Value::Float(numbers.between(-0.05, 0.05)),
        "scale" => list([log(numbers, 0.1, 50.0), log(numbers, 0.1, 50.0)]),
        "offset" => list([numbers.between(-2.0, 2.0), numbers.between(-2.0, 2.0)]),
        "file" => Value::String(pick(numbers, IMAGES).to_string()),
        _ => return None,
    })
}

/// Kind of a random material.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Finish {
    Any,
    Glass,
    Mirror,
    /// Material that is bright in ambient light.
    Glowing,
}

/// Returns a random material without validation errors. Its emission is 0; the function
/// [`emission`] chooses it.
pub fn material(numbers: &mut Numbers, finish: Finish) -> Material {
    let emits_nothing = |field: &&Field| !field.name.starts_with("emission");
    let fields: Vec<Field> = material::FIELDS.iter().filter(emits_nothing).copied().collect();
    loop {
        let mut keys = table(numbers, &fields, 0.3, &material_key);
        let mut set = |key: &str, value| keys.insert(key.to_string(), value);
        match finish {
            Finish::Any => {}
            Finish::Glass => {
                set("transmission", Value::Float(pick(numbers, &[0.5, 0.9, 1.0])));
                set("ior", Value::Float(index(numbers)));
                if chance(numbers, 1, 2) {
                    set("fresnel", Value::String("dielectric".to_string()));
                    set("reflection", Value::Float(1.0));
                }
                set("diffuse", Value::Float(pick(numbers, &[0.0, 0.1])));
            }
            Finish::Mirror => {
                set("reflection", Value::Float(pick(numbers, &[0.3, 0.9, 1.0])));
            }
            Finish::Glowing => {
                set("ambient", Value::Float(pick(numbers, &[1.0, 30.0])));
            }
        }
        if let Ok(material) = Material::from_text(&keys.to_string())
            && material.faults().is_empty()
        {
            return material;
        }
    }
}

/// Returns a random emission: strength and colour. Most strengths are 0.
pub fn emission(numbers: &mut Numbers) -> (f64, Color) {
    let color = pick(numbers, &[Color::WHITE, Color([1.0, 0.6, 0.2]), Color([0.0, 0.0, 1.0])]);
    (if chance(numbers, 1, 6) { log(numbers, 0.1, 30.0) } else { 0.0 }, color)
}

fn keys_of(kind: &Field) -> &'static [Field] {
    match kind.takes {
        ValueType::Table(fields) => fields,
        _ => &[],
    }
}

/// Returns `true` if shapes of this kind are compounds.
fn has_parts(kind: &Field) -> bool {
    keys_of(kind).iter().any(|f| matches!(f.takes, ValueType::Tables(_)))
}

/// Returns two lists: the kinds of shapes that can be parts of a compound, and the kinds of
/// compounds.
fn solids() -> &'static (Vec<&'static Field>, Vec<&'static Field>) {
    static SOLIDS: OnceLock<(Vec<&Field>, Vec<&Field>)> = OnceLock::new();
    SOLIDS.get_or_init(|| {
        let (compounds, simple) = KINDS.iter().partition::<Vec<&Field>, _>(|kind| has_parts(kind));
        let fits = |kind: &&Field| {
            let [first, second] = ["sphere", kind.name].map(|key| {
                CsgOperand::new(Shape::fitted_to(key, DVec3::ZERO, DVec3::ONE).unwrap())
            });
            compound(compounds[0].name, vec![first, second]).is_some()
        };
        (simple.into_iter().filter(fits).collect(), compounds)
    })
}

/// Returns the compound of the parts `of` by the set operation `key`. Returns `None` if the
/// compound has validation errors.
fn compound(key: &str, of: Vec<CsgOperand>) -> Option<Shape> {
    let of = of.iter().map(|part| Value::Table(part.to_table())).collect();
    let parts = Table::from_iter([("of".to_string(), Value::Array(of))]);
    let whole = Table::from_iter([(key.to_string(), Value::Table(parts))]);
    Shape::from_text(&whole.to_string()).ok().filter(|shape| shape.faults().is_empty())
}

/// Returns a shape of the kind `kind` whose keys have random values. The shape is approximately in
/// a box of the size `size` that stands on the point `base`. Returns `None` if the shape has
/// validation errors.
fn by_keys(numbers: &mut Numbers, kind: &Field, base: DVec3, size: DVec3) -> Option<Shape> {
    let key_value = |numbers: &mut Numbers, field: &Field| {
        let least = size.min_element();
        Some(match field.takes {
            ValueType::Numbers(3, range) if range.low < 0.0 => {
                let up = DVec3::new(0.0, 0.5 * size.y, 0.0);
                let spread = DVec3::from_array([(); 3].map(|()| numbers.between(-0.5, 0.5)));
                list((base + up + spread * size).to_array())
            }
            ValueType::Number(range) if range.low.is_finite() => {
                let zero = range.holds(0.0) && chance(numbers, 1, 6);
                Value::Float(if zero { 0.0 } else { least * log(numbers, 0.03, 0.6) })
            }
            ValueType::Number(_) => Value::Float(match numbers.below(3) {
                0 => pick(numbers, &[0.0, 45.0, 90.0]),
                _ => numbers.between(-180.0, 180.0),
            }),
            ValueType::Numbers(n, _) => list((0..n).map(|_| least * log(numbers, 0.1, 1.0))),
            ValueType::Text => Value::String(pick(numbers, MESHES).to_string()),
            _ => return None,
        })
    };
    let keys = table(numbers, keys_of(kind), 0.5, &key_value);
    let whole = Table::from_iter([(kind.name.to_string(), Value::Table(keys))]);
    Shape::from_text(&whole.to_string()).ok().filter(|shape| shape.faults().is_empty())
}

/// Returns a random compound in a box of the size `size` that stands on the point `base`. Faces of
/// its parts often coincide. Compounds are nested at most `levels` deep.
pub fn combined(
    numbers: &mut Numbers,
    base: DVec3,
    size: DVec3,
    materials: &[String],
    levels: usize,
) -> Shape {
    let (simple, compounds) = solids();
    let kind = compounds[numbers.below(compounds.len())];
    for _ in 0..8 {
        let mut parts = Vec::new();
        for _ in 0..2 + numbers.below(3) {
            let mut quarters = || f64::from(numbers.below(3) as u32 + 2) / 4.0;
            let part = size * DVec3::new(quarters(), quarters(), quarters());
            let mut step = || f64::from(numbers.below(5) as u32) / 4.0 - 0.5;
            let part_base = base + DVec3::new(step(), 0.5 + step(), step()) * (size - part);
            let shape = if levels > 1 && chance(numbers, 1, 4) {
                combined(numbers, part_base, part, materials, levels - 1)
            } else {
                let kind = simple[numbers.below(simple.len())];
                of_kind(numbers, kind, part_base, part)
            };
            let mut part = CsgOperand::new(shape);
            if chance(numbers, 1, 2) {
                part.material = materials[numbers.below(materials.len())].clone();
            }
            if chance(numbers, 1, 4) {
                part.transform = steps(numbers, part_base);
            }
            parts.push(part);
        }
        if let Some(shape) = compound(kind.name, parts) {
            return shape;
        }
    }
    Shape::fitted_to(kind.name, base, size).expect("a registered kind")
}

fn of_kind(numbers: &mut Numbers, kind: &Field, base: DVec3, size: DVec3) -> Shape {
    let drawn = match numbers.below(2) {
        0 => None,
        _ => by_keys(numbers, kind, base, size),
    };
    drawn.unwrap_or_else(|| Shape::fitted_to(kind.name, base, size).expect("a registered kind"))
}

/// Returns random transform steps that rotate, stretch, shear or mirror an object. They leave the
/// point `base` fixed. In most cases the list is empty.
fn steps(numbers: &mut Numbers, base: DVec3) -> Vec<TransformOp> {
    let rotation = |numbers: &mut Numbers| {
        let any = 180.0 * numbers.unit();
        let degrees = pick(numbers, &[90.0, 45.0, any]);
        TransformOp::Rotate(Rotate { axis: direction(numbers).to_array(), degrees })
    };
    let stretch = |numbers: &mut Numbers| {
        let factors = [(); 3].map(|()| {
            let any = log(numbers, 0.05, 3.0);
            pick(numbers, &[1.0, 0.5, 2.0, any])
        });
        TransformOp::Scale(Scale(factors))
    };
    let inner = match numbers.below(12) {
        0 => vec![TransformOp::RotateY(numbers.between(-180.0, 180.0))],
        1 => vec![rotation(numbers)],
        2 => vec![stretch(numbers)],
        // Shear.
        3 => vec![rotation(numbers), stretch(numbers), rotation(numbers)],
        // Reflection.
        4 => vec![TransformOp::Scale(Scale([-1.0, 1.0, 1.0])), rotation(numbers)],
        5 => {
            vec![rotation(numbers), TransformOp::Scale(Scale([0.7, 1.3, -0.6])), rotation(numbers)]
        }
        _ => return Vec::new(),
    };
    let to_origin = TransformOp::Translate((-base).to_array());
    let back = TransformOp::Translate(base.to_array());
    std::iter::once(to_origin).chain(inner).chain([back]).collect()
}

/// Materials that random objects choose from, by name, and the largest depth of nested compounds.
pub struct Stock<'a> {
    pub materials: &'a [String],
    pub levels: usize,
}

/// Returns a random object that stands on the point `base`, about as large as `size`, without
/// validation errors.
pub fn object(numbers: &mut Numbers, stock: &Stock, base: DVec3, size: DVec3) -> Object {
    // Unbounded objects are rare, because they hide all others.
    let kind = loop {
        let kind = &KINDS[numbers.below(KINDS.len())];
        let drawn =
            Shape::fitted_to(kind.name, DVec3::ZERO, DVec3::ONE).expect("a registered kind");
        if drawn.form().bounds().is_some() || chance(numbers, 1, 6) {
            break kind;
        }
    };
    object_of(numbers, stock, kind, base, size)
}

/// Returns a random object of the kind that `key` names, such as `sphere`. The object stands on the
/// point `base` and is about as large as `size`.
pub fn named(numbers: &mut Numbers, stock: &Stock, key: &str, base: DVec3, size: DVec3) -> Object {
    let kind = KINDS.iter().find(|kind| kind.name == key).expect("a registered kind");
    object_of(numbers, stock, kind, base, size)
}

fn object_of(
    numbers: &mut Numbers,
    stock: &Stock,
    kind: &Field,
    base: DVec3,
    size: DVec3,
) -> Object {
    let material = stock.materials[numbers.below(stock.materials.len())].clone();
    let shape = match has_parts(kind) {
        true => combined(numbers, base, size, stock.materials, stock.levels),
        false => of_kind(numbers, kind, base, size),
    };
    let mut object = Object { name: String::new(), material, shape, transform: Vec::new() };
    if object.shape.anchor_points_mut().is_empty() && !has_parts(kind) {
        fit(&mut object, base, size);
    }
    let placed = object.transform.len();
    object.transform.extend(steps(numbers, base));
    if !object.faults().is_empty() {
        object.transform.truncate(placed);
    }
    object
}

/// Returns the object after the files that it refers to, such as meshes, have been loaded.
pub fn resolved(object: &Object) -> Object {
    let mut scene =
        Scene { objects: vec![object.clone()], resolver: library(), ..Scene::default() };
    scene.resolve();
    scene.objects.remove(0)
}

/// Scales an object uniformly and moves it, so that it fits into a box of the size `size` that
/// stands on the point `base`.
fn fit(object: &mut Object, base: DVec3, size: DVec3) {
    let Some((low, high)) = resolved(object).form().bounds() else { return };
    let factor = (size / (high - low).max(DVec3::splat(1e-9))).min_element();
    let foot = DVec3::new(0.5 * (low.x + high.x), low.y, 0.5 * (low.z + high.z));
    object.transform = vec![
        TransformOp::Translate((-foot).to_array()),
        TransformOp::Scale(Scale([factor; 3])),
        TransformOp::Translate(base.to_array()),
    ];
}
