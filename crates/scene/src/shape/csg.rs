//! Compound objects: union, intersection and difference of solids, nested up to 64 deep. A part is
//! written like an object, so that users can copy the text of one into the other.

use crate::shape::transform::{TransformOp, compose, ill_conditioned};
use crate::shape::{Cuboid, Shape, ShapeDesc, Sphere};
use crate::value::{
    Description, Field, FieldValue, KeyNode, ValidationError, Validator, ValueType, description,
};
use glam::DVec3;
use zerkalo_kernel::primitive::{CsgSolid, CsgTree, Form};

/// Largest nesting depth of compounds. A compound that is no part of another one has depth 1.
pub const MAX_DEPTH: usize = 64;

description! {
    /// Part of a compound: a solid with its own material and transform.
    pub struct CsgOperand {
        /// Name of the part, such as `foot`.
        name: String, or "a number";
        /// Shape of the part: a solid, or a plane for the half-space behind it.
        shape: Shape;
        /// Name of one of the `[materials.NAME]`.
        material: String, or "that of the whole";
        /// Steps that move, rotate and scale it, in order.
        transform: Vec<TransformOp>, or "it stays as its shape says";
    }
}

impl FieldValue for Vec<CsgOperand> {
    const TYPE: ValueType = ValueType::Tables(|| CsgOperand::FIELDS);

    fn errors(&self, _: &Field) -> Vec<ValidationError> {
        part_faults(self, 1)
    }
}

macro_rules! compounds {
    ($($kind:ident, $doc:literal, $example:literal;)+) => {$(
        description! {
            #[doc = $doc]
            pub struct $kind {
                /// Two parts or more, each written like an object: `name`, `shape`, `material`, `transform`.
                of: Vec<CsgOperand>;
                example $example;
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

            fn fit(&mut self, base: DVec3, size: DVec3) {
                self.of = fitted_parts(base, size).map(CsgOperand::new).into();
            }

            fn parts(&self) -> Option<&[CsgOperand]> {
                Some(&self.of)
            }

            fn parts_mut(&mut self) -> Option<&mut Vec<CsgOperand>> {
                Some(&mut self.of)
            }
        }
    )+};
}

compounds! {
    Union,
    " Solids joined into one: every point that is in any part.",
    "shape.union.of = [
    { shape.sphere = { center = [0.0, 0.4, 0.0], radius = 0.4 } },
    { shape.cylinder = { base = [0.0, 0.4, 0.0], top = [0.0, 1.2, 0.0], radius = 0.2 } },
]";
    Intersection,
    " The common part of solids: every point that is in all parts.",
    "shape.intersection.of = [
    { shape.cube = { corner = [-0.5, 0.0, 0.5], edge = 1.0 } },
    { shape.sphere = { center = [0.0, 0.5, 0.0], radius = 0.65 } },
]";
    Difference,
    " The first part without the others: every point of it that is in none of them. A cut shows \
     the material of the part that cut it.",
    "shape.difference.of = [
    { shape.box = { center = [0.0, 0.5, 0.0], size = [1.0, 1.0, 1.0] } },
    { shape.sphere = { center = [0.5, 1.0, 0.5], radius = 0.6 } },
]";
}

/// Returns the parts of a new compound that fills a box on `base`: a block of nine tenths of
/// `size`, and a ball at its upper right near corner.
fn fitted_parts(base: DVec3, size: DVec3) -> [Shape; 2] {
    let mut block = Cuboid::default();
    block.fit(base, size * 0.9);
    let radius = 0.4 * size.min_element();
    let corner = base + DVec3::new(0.5 * size.x, size.y, 0.5 * size.z) - radius;
    let ball = Sphere { center: corner.to_array(), radius };
    [Shape::Cuboid(block), Shape::Sphere(ball)]
}

impl CsgOperand {
    /// Creates a part of a compound without a transform, with the material of the whole.
    pub fn new(shape: Shape) -> Self {
        Self { name: String::new(), shape, material: String::new(), transform: Vec::new() }
    }
}

/// Combines the parts of a compound; `join` creates its tree from the trees of the parts.
fn combined(of: &[CsgOperand], join: fn(Vec<CsgTree>) -> CsgTree) -> CsgSolid {
    let mut parts = Vec::new();
    let mut trees = Vec::new();
    for part in of {
        let form = part.shape.form().transformed(&compose(&part.transform));
        if let Form::Csg(inner) = form {
            trees.push(inner.tree.shifted(parts.len()));
            parts.extend(inner.parts);
        } else if let Some(solid) = form.into_solid() {
            // Other geometry is left out; `unfit_reason` reports it.
            trees.push(CsgTree::Part(parts.len()));
            parts.push(solid);
        }
    }
    CsgSolid::of_solids(parts, join(trees))
}

/// Returns the reason why `shape` cannot be a part of a compound; `None` if it can be one.
pub(crate) fn unfit_reason(shape: &Shape) -> Option<&'static str> {
    match shape {
        Shape::Rectangle(_) | Shape::HorizontalRectangle(_) => {
            Some("is flat: nothing is inside it")
        }
        Shape::MeshDesc(_) => Some("cannot be a part of a compound"),
        // A plane stands for a half-space.
        Shape::Sphere(_)
        | Shape::Cube(_)
        | Shape::Cuboid(_)
        | Shape::Pyramid(_)
        | Shape::Prism(_)
        | Shape::Cylinder(_)
        | Shape::Cone(_)
        | Shape::TaperedCylinder(_)
        | Shape::UnitFrustum(_)
        | Shape::Torus(_)
        | Shape::Plane(_)
        | Shape::Union(_)
        | Shape::Intersection(_)
        | Shape::Difference(_) => None,
    }
}

/// Returns the validation errors of the parts of a compound. `depth` is 1 for a compound that is no
/// part of another one.
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
        let inner = match part.shape.parts() {
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
        let checks = Validator::new(CsgOperand::FIELDS)
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

/// Material that a part names: the dotted key, such as `union.of.0.material`, and the name.
pub type Named<'a> = (String, &'a str);

impl Shape {
    /// Returns the material of each solid in the shape, in the order of [`CsgSolid::parts`]: its
    /// own material, or that of the innermost compound around it that has one, or `whole`.
    pub fn part_materials<'a>(&'a self, whole: &'a str) -> Vec<&'a str> {
        match self.parts() {
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

    /// Returns the material names of all parts, including nested parts. Names may be empty.
    pub fn part_names_mut(&mut self) -> Vec<&mut String> {
        let mut names = Vec::new();
        for part in self.parts_mut().into_iter().flatten() {
            names.push(&mut part.material);
            names.extend(part.shape.part_names_mut());
        }
        names
    }

    /// Returns `true` if a part of the shape, even a nested one, names the material `name`.
    pub fn names_material(&self, name: &str) -> bool {
        self.named_materials().iter().any(|(_, own)| *own == name)
    }

    /// Returns the materials that the parts of the shape name, including nested parts.
    pub fn named_materials(&self) -> Vec<Named<'_>> {
        let mut named = Vec::new();
        for (i, part) in self.parts().into_iter().flatten().enumerate() {
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shape::EXAMPLES;

    #[test]
    fn shapes_that_fit_into_compounds_are_solids() {
        for (key, _) in EXAMPLES {
            let shape = Shape::fitted_to(key, DVec3::ZERO, DVec3::ONE).unwrap();
            let form = shape.form();
            let is_solid = matches!(form, Form::Csg(_)) || form.into_solid().is_some();
            assert_eq!(unfit_reason(&shape).is_none(), is_solid, "{key}");
        }
    }
}
