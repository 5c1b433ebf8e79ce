//! Test of a row of docs/features.md: a check that passes for the shipped scene and fails for each
//! mutation of it.

use crate::harness::*;

/// Mutation of a scene, which replaces a feature by a similar one.
pub type Change<'a> = &'a dyn Fn(&mut Scene);

/// Checks that `check` passes for the shipped scene `file` and fails for each of `mutations`.
/// `check` renders the given scene and compares it with an expectation from an independent source.
pub fn row(file: &str, check: impl Fn(&Scene) -> Verdict, mutations: &[(&str, Change)]) {
    checked_row(file, &check, mutations);
}

/// Implements [`row`] once for all types of checks, which shortens the compilation.
fn checked_row(file: &str, check: &dyn Fn(&Scene) -> Verdict, mutations: &[(&str, Change)]) {
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

pub fn object<'a>(scene: &'a mut Scene, name: &str) -> &'a mut Object {
    let found = scene.objects.iter_mut().find(|o| o.name == name);
    found.unwrap_or_else(|| panic!("no object \"{name}\""))
}

pub fn number(scene: &Scene, name: &str) -> usize {
    let found = scene.objects.iter().position(|o| o.name == name);
    found.unwrap_or_else(|| panic!("no object \"{name}\""))
}

pub fn material<'a>(scene: &'a mut Scene, name: &str) -> &'a mut Material {
    scene.materials.get_mut(name).unwrap_or_else(|| panic!("no material \"{name}\""))
}

pub fn shape(text: &str) -> Shape {
    parsed(&format!("[[object]]\nshape.{text}")).objects.remove(0).shape
}
