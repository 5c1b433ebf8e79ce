//! Objects of a scene: a shape with a transform and a material.

use crate::shape::{Shape, TransformOp, compose, ill_conditioned};
use crate::value::{KeyNode, ValidationError, description};
use glam::DAffine3;
use zerkalo_kernel::primitive::Form;

description! {
    /// An object: a shape with a transform and a material.
    pub struct Object {
        /// Name of the object; no two objects have the same.
        name: String, or "a number";
        /// Name of the object's material, one of the `[materials.NAME]`.
        material: String, or "a diffuse light grey, the default of every material key";
        /// Shape of the object: exactly one kind.
        shape: Shape;
        /// Steps that move, rotate and scale the object, in order.
        transform: Vec<TransformOp>, or "it stays as its shape says";
    }
}

impl Object {
    /// Returns the name of each part's material, in the order of the parts of [`Object::form`]. A
    /// shape that is no compound has one part.
    pub fn materials(&self) -> Vec<&str> {
        self.shape.part_materials(&self.material)
    }

    /// Returns `true` if the object or a part of it has the material `name`.
    pub fn names_material(&self, name: &str) -> bool {
        self.material == name || self.shape.names_material(name)
    }

    /// Replaces the material name `old` of the object and its parts by `new`. An empty name means
    /// the default material for an object, and the object's material for a part.
    pub fn rename_material(&mut self, old: &str, new: &str) {
        let names = self.shape.part_names_mut().into_iter().chain([&mut self.material]);
        for name in names.filter(|name| *name == old) {
            *name = new.to_string();
        }
    }

    /// Returns the object's transform as one affine map.
    pub fn scene_from_object(&self) -> DAffine3 {
        compose(&self.transform)
    }

    /// Returns the canonical form of the valid object's shape, transformed to the scene's space.
    pub fn form(&self) -> Form {
        match self.transform.is_empty() {
            true => self.shape.form(),
            false => self.shape.form().transformed(&self.scene_from_object()),
        }
    }

    /// Returns the validation errors of the object, without a check that its material exists.
    pub fn faults(&self) -> Vec<ValidationError> {
        let checks = self.validator();
        let moved =
            if checks.is_clean() { ill_conditioned(&self.shape, &self.transform) } else { None };
        checks.and(moved).errors()
    }
}

#[cfg(test)]
mod tests {
    use crate::Scene;

    /// Checks that an empty compound, such as an intersection of disjoint spheres, may have a
    /// transform. A compound of tiny size that contains points must be rejected as too small.
    #[test]
    fn compound_without_points_is_not_too_small() {
        let ball = |x: f64, radius: f64| {
            format!("{{ shape.sphere = {{ center = [{x:?}, 1, 1], radius = {radius:?} }} }}")
        };
        let fault = |shape: &str| {
            let text = format!("[[object]]\nshape.{shape}\ntransform = [{{ scale = 2.0 }}]\n");
            Scene::parse(&text, "test").err().map(|error| error.to_string())
        };
        let two = |operation: &str, a: String, b: String| format!("{operation}.of = [{a}, {b}]");
        let apart = two("intersection", ball(-1.0, 0.5), ball(1.0, 0.5));
        let nested = format!("{{ shape.{apart} }}");
        for shape in [
            apart.clone(),
            two("union", nested.clone(), nested.clone()),
            two("difference", nested.clone(), ball(1.0, 0.5)),
            two("intersection", ball(-1.0, 2.0), nested),
        ] {
            assert_eq!(fault(&shape), None, "{shape}");
        }
        // Both spheres contain their common centre.
        let tiny = two("intersection", ball(1.0, 1e-20), ball(1.0, 0.5));
        assert!(fault(&tiny).is_some_and(|message| message.contains("too small")), "{tiny}");
    }
}
