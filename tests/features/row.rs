//! Test of a row: a check that passes for the shipped scene and fails for each mutation of it.

use crate::support::{parsed, shipped};
use zerkalo::material::Material;
use zerkalo::scene::{Object, Scene};
use zerkalo::shape::Shape;

/// Result of a check, with a description of the failure.
pub type Verdict = Result<(), String>;

/// Mutation of a scene: replaces a feature by a similar one.
pub type Change<'a> = &'a dyn Fn(&mut Scene);

/// Asserts that `check` passes for the shipped scene `file` and fails for each of `mutations`. `check` renders
/// the scene it is given and compares with an expectation from an independent source.
pub fn row(file: &str, check: impl Fn(&Scene) -> Verdict, mutations: &[(&str, Change)]) {
    let original = shipped(file);
    if let Err(error) = check(&original) {
        panic!("{file}: {error}");
    }
    for (name, change) in mutations {
        let mut scene = original.clone();
        change(&mut scene);
        assert_ne!(scene, original, "`{name}` changes nothing");
        let faults = scene.faults();
        assert!(faults.is_empty(), "`{name}` has faults: {}", faults[0]);
        match check(&scene) {
            Ok(()) => panic!("{file}: mutation `{name}` passes"),
            Err(error) => println!("{file}, {name}: {error}"),
        }
    }
}

/// The object `name`.
pub fn object<'a>(scene: &'a mut Scene, name: &str) -> &'a mut Object {
    let found = scene.objects.iter_mut().find(|o| o.name == name);
    found.unwrap_or_else(|| panic!("no object \"{name}\""))
}

/// Index of the object `name`.
pub fn number(scene: &Scene, name: &str) -> usize {
    let found = scene.objects.iter().position(|o| o.name == name);
    found.unwrap_or_else(|| panic!("no object \"{name}\""))
}

/// The material `name`.
pub fn material<'a>(scene: &'a mut Scene, name: &str) -> &'a mut Material {
    scene.materials.get_mut(name).unwrap_or_else(|| panic!("no material \"{name}\""))
}

/// The shape with the text `text` after `shape.` in a scene file.
pub fn shape(text: &str) -> Shape {
    parsed(&format!("[[object]]\nshape.{text}")).objects.remove(0).shape
}

/// Returns `Err` with the text of `error` unless `condition` holds.
pub fn ensure(condition: bool, error: impl FnOnce() -> String) -> Verdict {
    if condition { Ok(()) } else { Err(error()) }
}
