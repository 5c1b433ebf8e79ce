//! Objects: a shape, where it stands, what it is made of.

use crate::primitive::Form;
use crate::shape::{KINDS, Shape, TRANSFORM_OP_FIELDS, TransformOp, compose, ill_conditioned};
use crate::value::{Field, ValidationError, Validator, ValueType};
use glam::DAffine3;
use serde::{Deserialize, Serialize};

/// A thing: a shape, where it stands, what it is made of.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Object {
    /// Name, unique in the scene; empty: none.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub name: String,
    /// Key of `materials`; empty: the default finish.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub material: String,
    /// What it looks like.
    pub shape: Shape,
    /// Steps that move, turn and scale it, the first step first.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub transform: Vec<TransformOp>,
}

/// The keys of `[[object]]`.
pub const OBJECT_FIELDS: &[Field] = &[
    Field::optional("name", ValueType::Text, "", "a number", "Name; no two objects have the same."),
    Field::optional(
        "material",
        ValueType::Text,
        "",
        "a matt light grey, the default of every material key",
        "Name of one of the `[materials.NAME]`.",
    ),
    Field::required("shape", ValueType::OneOf(KINDS), "", "What it looks like: exactly one kind."),
    Field::optional(
        "transform",
        ValueType::ListOf(TRANSFORM_OP_FIELDS),
        "",
        "it stays as its shape says",
        "Steps that move, turn and scale it, the first step first.",
    ),
];

impl Object {
    /// Returns the material of each part of the compiled form; a simple object has one part.
    pub fn materials(&self) -> Vec<&str> {
        self.shape.part_materials(&self.material)
    }

    /// Returns `true` if the object or a part of it has the material `name`.
    pub fn names_material(&self, name: &str) -> bool {
        self.material == name || self.shape.named_materials().iter().any(|(_, own)| *own == name)
    }

    /// Replaces the material `old` of the object and its parts by `new`. An empty name means the
    /// default material, in a part the material of the whole.
    pub fn rename_material(&mut self, old: &str, new: &str) {
        let names = self.shape.part_names_mut().into_iter().chain([&mut self.material]);
        for name in names.filter(|name| *name == old) {
            *name = new.to_string();
        }
    }

    /// Returns the transform as one affine map.
    pub fn scene_from_object(&self) -> DAffine3 {
        compose(&self.transform)
    }

    /// Returns the geometry in the scene's space, in double precision. The object must be valid.
    pub fn form(&self) -> Form {
        match self.transform.is_empty() {
            true => self.shape.form(),
            false => self.shape.form().transformed(&self.scene_from_object()),
        }
    }

    /// Validates the object, except that its material exists, which
    /// [`Scene::faults`](crate::scene::Scene::faults) checks.
    pub fn faults(&self) -> Vec<ValidationError> {
        let mut checks = Validator::new(OBJECT_FIELDS).nested("shape", self.shape.faults());
        for (i, step) in self.transform.iter().enumerate() {
            checks = checks.nested(&format!("transform.{i}"), step.faults());
        }
        let moved =
            if checks.clean() { ill_conditioned(&self.shape, &self.transform) } else { None };
        checks.and(moved).validate()
    }
}
