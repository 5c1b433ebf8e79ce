//! Compound objects: union, intersection and difference of solids, nested up to 64 deep.
//!
//! A part is written like an object, with `shape` and optionally `material` and `transform`, so
//! that users can copy the text of an object into a compound, and the text of a part into an
//! object.

use crate::shape::registry::KIND_TABLE;
use crate::shape::transform::{TransformOp, compose, ill_conditioned};
use crate::shape::{Cuboid, Shape, ShapeDesc, Sphere};
use crate::value::{
    Description, Field, TableReader, TomlError, TomlValue, ValidationError, Validator, ValueType,
    written,
};
use glam::DVec3;
use toml::de::DeValue;
use toml::{Spanned, Value};
use zerkalo_kernel::primitive::{CsgSolid, CsgTree, Form};

/// Largest nesting depth of compounds. A compound that is no part of another one has depth 1.
pub const MAX_DEPTH: usize = 64;

/// Part of a compound: a solid with its own material and transform.
#[derive(Clone, Debug, PartialEq)]
pub struct CsgOperand {
    /// Solid of the part. A plane stands for the half-space behind it.
    pub shape: Shape,
    /// Name of one of the scene's materials; empty for the material of the whole compound.
    pub material: String,
    /// Steps that move, rotate and scale the part inside the whole compound, in order.
    pub transform: Vec<TransformOp>,
}

// These fields are a static. The macro `description!` would declare a constant, and constants
// cannot refer to each other in a cycle. The fields of shapes contain the fields of parts, and the
// fields of parts contain those of shapes.
static PART_FIELDS: [Field; 3] = [
    Field::required(
        "shape",
        ValueType::OneOf(&KIND_TABLE),
        "",
        "Shape of the part: a solid, or a plane for the half-space behind it.",
    ),
    Field::optional(
        "material",
        ValueType::Text,
        "",
        "that of the whole",
        "Name of one of the `[materials.NAME]`.",
    ),
    Field::optional(
        "transform",
        ValueType::ListOf(TransformOp::FIELDS),
        "",
        "it stays as its shape says",
        "Steps that move, rotate and scale it, in order.",
    ),
];

/// Keys of a compound (a union, an intersection or a difference): its list of parts.
pub(super) static OF_FIELDS: [Field; 1] = [Field::required(
    "of",
    ValueType::Tables(&PART_FIELDS),
    "",
    "Two parts or more, each written like an object: `shape`, `material`, `transform`.",
)];

impl TomlValue for CsgOperand {
    fn from_toml(value: &Spanned<DeValue>) -> Result<Self, TomlError> {
        let table = TableReader::new(value, &PART_FIELDS)?;
        Ok(Self {
            shape: table.required("shape")?,
            material: table.optional("material")?.unwrap_or_default(),
            transform: table.optional("transform")?.unwrap_or_default(),
        })
    }

    fn to_toml(&self) -> Value {
        let material = (!self.material.is_empty()).then_some(&self.material as &dyn TomlValue);
        let transform = (!self.transform.is_empty()).then_some(&self.transform as &dyn TomlValue);
        written(&[("shape", Some(&self.shape)), ("material", material), ("transform", transform)])
    }
}

macro_rules! compounds {
    ($($kind:ident, $doc:literal);+ $(;)?) => {$(
        #[doc = $doc]
        #[derive(Clone, Debug, PartialEq)]
        pub struct $kind {
            /// Parts of the compound, two or more.
            pub of: Vec<CsgOperand>,
        }

        impl TomlValue for $kind {
            fn from_toml(value: &Spanned<DeValue>) -> Result<Self, TomlError> {
                TableReader::new(value, &OF_FIELDS)?.required("of").map(|of| Self { of })
            }

            fn to_toml(&self) -> Value {
                written(&[("of", Some(&self.of))])
            }
        }

        impl Description for $kind {
            const DOC: &'static str = $doc;
            const FIELDS: &'static [Field] = &OF_FIELDS;

            fn validator(&self) -> Validator {
                let errors = part_faults(&self.of, 1).into_iter().map(Some);
                errors.fold(Validator::new(Self::FIELDS), Validator::and)
            }
        }

        impl ShapeDesc for $kind {
            fn form(&self) -> Form {
                Form::Csg(combined(&self.of, CsgTree::$kind))
            }

            fn faults(&self) -> Vec<ValidationError> {
                let faults = self.validator().errors();
                if !faults.is_empty() || self.form().bounds().is_some() {
                    return faults;
                }
                vec![ValidationError::new(
                    "of",
                    "the compound is unbounded",
                    "a bounded solid: planes can be subtracted from one, or intersected with one",
                )]
            }

            fn fitted_to(base: DVec3, size: DVec3) -> Self {
                Self { of: fitted_to(base, size).map(CsgOperand::new).into() }
            }

        }
    )+};
}

compounds! {
    Union,
    "Solids joined into one: every point that is in any part.";
    Intersection,
    "The common part of solids: every point that is in all parts.";
    Difference,
    "The first part without the others: every point of it that is in none of them. A cut shows \
     the material of the part that cut it.";
}

/// Returns the example parts of a new compound that fills a box. `base` is the centre of the lower
/// side of this box, and `size` is its size. The first part is a block that stands on `base` and
/// has nine tenths of `size`. The second is a ball that protrudes from the upper right near corner
/// of the block.
fn fitted_to(base: DVec3, size: DVec3) -> [Shape; 2] {
    let block = Cuboid::fitted_to(base, size * 0.9);
    let radius = 0.4 * size.min_element();
    let corner = base + DVec3::new(0.5 * size.x, size.y, 0.5 * size.z) - radius;
    let ball = Sphere { center: corner.to_array(), radius };
    [Shape::Cuboid(block), Shape::Sphere(ball)]
}

impl CsgOperand {
    /// Creates a part of a compound without a transform, with the material of the whole.
    pub fn new(shape: Shape) -> Self {
        Self { shape, material: String::new(), transform: Vec::new() }
    }
}

/// Returns the parts of a compound; `None` if the shape is no compound.
pub(super) fn parts_of(shape: &Shape) -> Option<&[CsgOperand]> {
    match shape {
        Shape::Union(Union { of })
        | Shape::Intersection(Intersection { of })
        | Shape::Difference(Difference { of }) => Some(of),
        _ => None,
    }
}

/// Returns the mutable parts of a compound; empty if the shape is no compound.
fn parts_of_mut(shape: &mut Shape) -> &mut [CsgOperand] {
    match shape {
        Shape::Union(Union { of })
        | Shape::Intersection(Intersection { of })
        | Shape::Difference(Difference { of }) => of,
        _ => &mut [],
    }
}

/// Combines the parts of a compound into one solid. `join` creates the CSG tree of the compound
/// from the CSG trees of its parts.
fn combined(of: &[CsgOperand], join: fn(Vec<CsgTree>) -> CsgTree) -> CsgSolid {
    let mut parts = Vec::new();
    let mut trees = Vec::new();
    for part in of {
        match part.shape.form().transformed(&compose(&part.transform)) {
            Form::Csg(inner) => {
                trees.push(inner.tree.shifted(parts.len()));
                parts.extend(inner.parts);
            }
            // Other geometry is left out; `unfit_reason` reports it.
            simple => {
                let Some(solid) = simple.into_solid() else { continue };
                trees.push(CsgTree::Part(parts.len()));
                parts.push(solid);
            }
        }
    }
    CsgSolid { parts, tree: join(trees) }
}

/// Returns the reason why `shape` cannot be a part of a compound; `None` if it can be one.
fn unfit_reason(shape: &Shape) -> Option<&'static str> {
    match shape {
        Shape::Rectangle(_) | Shape::HorizontalRectangle(_) => {
            Some("is flat: nothing is inside it")
        }
        Shape::MeshDesc(_) => Some("cannot be a part of a compound"),
        _ => None,
    }
}

/// Returns the validation errors of `of`, the parts of a compound. `depth` is the nesting depth of
/// the compound: 1 if it is no part of another one.
fn part_faults(of: &[CsgOperand], depth: usize) -> Vec<ValidationError> {
    let mut faults = Vec::new();
    if of.len() < 2 {
        let found = ["of is an empty list", "of is a list of one part"][of.len()];
        faults.push(ValidationError::new("of", found, "at least two parts"));
    }
    if depth > MAX_DEPTH {
        faults.push(ValidationError::new(
            "of",
            format!("compounds are nested more than {MAX_DEPTH} deep"),
            "a flatter tree: a union, intersection or difference takes any number of parts",
        ));
        return faults;
    }
    for (i, part) in of.iter().enumerate() {
        let inner = match parts_of(&part.shape) {
            Some(of) => part_faults(of, depth + 1)
                .into_iter()
                .map(|fault| fault.prefixed(part.shape.key()))
                .collect(),
            None => part.shape.faults(),
        };
        let unfit = unfit_reason(&part.shape).map(|reason| {
            let found = format!("a {} {reason}", part.shape.key());
            ValidationError::new("shape", found, "a solid")
        });
        let checks = Validator::new(&PART_FIELDS)
            .nested("shape", inner)
            .and(unfit)
            .field("transform", &part.transform);
        let ill_placed =
            if checks.is_clean() { ill_conditioned(&part.shape, &part.transform) } else { None };
        faults.extend(
            checks.and(ill_placed).errors().into_iter().map(|f| f.prefixed(&format!("of.{i}"))),
        );
    }
    faults
}

/// Material that a part of a compound names, as `(key, material)`. `key` is the dotted key of the
/// name in scene files, relative to the shape, such as `union.of.0.material`. `material` is the
/// name.
pub type Named<'a> = (String, &'a str);

impl Shape {
    /// Returns the material name of each solid in the shape, in the order of [`CsgSolid::parts`]. A
    /// solid without a material of its own has the material of the innermost enclosing compound
    /// that has one. If there is no such compound, its material is `whole`. A shape that is no
    /// compound is one solid.
    pub fn part_materials<'a>(&'a self, whole: &'a str) -> Vec<&'a str> {
        match parts_of(self) {
            None => vec![whole],
            Some(of) => of
                .iter()
                .flat_map(|part| {
                    let material = if part.material.is_empty() { whole } else { &part.material };
                    part.shape.part_materials(material)
                })
                .collect(),
        }
    }

    /// Returns the mutable material names of all parts; the name of a part without a material is
    /// empty.
    pub fn part_names_mut(&mut self) -> Vec<&mut String> {
        let mut names = Vec::new();
        for part in parts_of_mut(self) {
            names.push(&mut part.material);
            names.extend(part.shape.part_names_mut());
        }
        names
    }

    /// Returns the references to materials in all nested parts of a compound, except for parts
    /// without a material of their own. Empty if the shape is no compound.
    pub fn named_materials(&self) -> Vec<Named<'_>> {
        let mut named = Vec::new();
        for (i, part) in parts_of(self).into_iter().flatten().enumerate() {
            let key = format!("{}.of.{i}", self.key());
            if !part.material.is_empty() {
                named.push((format!("{key}.material"), part.material.as_str()));
            }
            let inner = part.shape.named_materials().into_iter();
            named.extend(inner.map(|(tail, name)| (format!("{key}.shape.{tail}"), name)));
        }
        named
    }
}
