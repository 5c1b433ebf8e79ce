//! How a row is tested: a check that holds for the real thing and fails for each of its neighbours.

use crate::support::{parsed, shipped};
use zerkalo::material::Material;
use zerkalo::scene::{Object, Scene};
use zerkalo::shape::Shape;

/// What a check finds: nothing wrong, or what.
pub type Verdict = Result<(), String>;

/// Makes of a feature what stands next to it.
pub type Change<'a> = &'a dyn Fn(&mut Scene);

/// Asserts that `check` holds for the shipped scene `file` and fails for each of its `neighbours`, scenes
/// in which the feature is replaced by what stands next to it. `check` is given the scene to show; what
/// it should look like, it must know from elsewhere.
pub fn row(file: &str, check: impl Fn(&Scene) -> Verdict, neighbours: &[(&str, Change)]) {
    let real = shipped(file);
    if let Err(found) = check(&real) {
        panic!("{file}: {found}");
    }
    for (name, change) in neighbours {
        let mut scene = real.clone();
        change(&mut scene);
        assert_ne!(scene, real, "`{name}` changes nothing");
        let faults = scene.faults();
        assert!(faults.is_empty(), "`{name}` is no scene: {}", faults[0]);
        match check(&scene) {
            Ok(()) => panic!("{file}: {name} passes for the real thing"),
            Err(found) => println!("{file}, {name}: {found}"),
        }
    }
}

/// The object called `name`.
pub fn object<'a>(scene: &'a mut Scene, name: &str) -> &'a mut Object {
    let found = scene.objects.iter_mut().find(|o| o.name == name);
    found.unwrap_or_else(|| panic!("no object \"{name}\""))
}

/// The number of the object called `name`.
pub fn number(scene: &Scene, name: &str) -> usize {
    let found = scene.objects.iter().position(|o| o.name == name);
    found.unwrap_or_else(|| panic!("no object \"{name}\""))
}

/// The material called `name`.
pub fn material<'a>(scene: &'a mut Scene, name: &str) -> &'a mut Material {
    scene.materials.get_mut(name).unwrap_or_else(|| panic!("no material \"{name}\""))
}

/// The shape that a scene file would have behind `shape.`.
pub fn shape(text: &str) -> Shape {
    parsed(&format!("[[object]]\nshape.{text}")).objects.remove(0).shape
}

/// `Err` with the words of `found` unless `holds`.
pub fn ensure(holds: bool, found: impl FnOnce() -> String) -> Verdict {
    if holds { Ok(()) } else { Err(found()) }
}
