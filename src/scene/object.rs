//! Objects: a shape, where it stands, what it is made of.

use super::transform::{STEP_FIELDS, Step, is_sound};
use crate::shape::{Form, KINDS, Shape};
use crate::value::{Checks, Fault, Field, Range, Takes};
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
    pub transform: Vec<Step>,
}

/// The keys of `[[object]]`.
pub const OBJECT_FIELDS: &[Field] = &[
    Field::without("name", Takes::Text, "", "a number", "Name; no two objects have the same."),
    Field::without(
        "material",
        Takes::Text,
        "",
        "a matt light grey, the default of every material key",
        "Name of one of the `[materials.NAME]`.",
    ),
    Field::required("shape", Takes::OneOf(KINDS), "", "What it looks like: exactly one kind."),
    Field::without(
        "transform",
        Takes::ListOf(STEP_FIELDS),
        "",
        "it stays as its shape says",
        "Steps that move, turn and scale it, the first step first.",
    ),
];

impl Object {
    /// The transform's steps in order, as one map.
    pub fn scene_from_object(&self) -> DAffine3 {
        self.transform.iter().fold(DAffine3::IDENTITY, |map, step| step.map() * map)
    }

    /// Its geometry where it stands, in double precision. Of an object without faults.
    pub fn form(&self) -> Form {
        match self.transform.is_empty() {
            true => self.shape.form(),
            false => self.shape.form().transformed(&self.scene_from_object()),
        }
    }

    /// What is wrong with it (its material's name is the scene's business).
    pub fn faults(&self) -> Vec<Fault> {
        let mut checks = Checks::new(OBJECT_FIELDS).inner("shape", self.shape.faults());
        for (i, step) in self.transform.iter().enumerate() {
            checks = checks.inner(&format!("transform.{i}"), step.faults());
        }
        let moved = if checks.clean() { self.misplaced() } else { None };
        checks.and(moved).faults()
    }

    /// What the transform as a whole does wrong although each step is right.
    fn misplaced(&self) -> Option<Fault> {
        if self.transform.is_empty() {
            return None;
        }
        let map = self.scene_from_object();
        if !is_sound(&map) {
            return Some(Fault::new(
                "transform",
                "transform flattens the object or tears it apart",
                "factors within 1e12 of each other and of 1",
            ));
        }
        let form = self.shape.form().transformed(&map);
        let (reach, extent) = match (&form, form.bounds()) {
            (_, Some((low, high))) => {
                (low.abs().max(high.abs()).max_element(), (high - low).max_element())
            }
            (Form::Plane { offset, .. }, None) => (offset.abs(), f64::INFINITY),
            (_, None) => (0.0, f64::INFINITY),
        };
        if !Range::COORDINATE.holds(reach) {
            return Some(Fault::new(
                "transform",
                "transform moves the object to coordinates beyond 1e9",
                "coordinates from -1e9 to 1e9",
            ));
        }
        (extent < 1e-12 * reach).then(|| {
            Fault::new(
                "transform",
                "transform makes the object too small for the place where it stands",
                "sizes and coordinates within a factor of 1e12 of each other",
            )
        })
    }
}
