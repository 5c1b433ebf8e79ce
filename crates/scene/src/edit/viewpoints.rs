//! Edit that stores the current camera.

use crate::Scene;
use crate::edit::parse_value::name;
use crate::edit::unique_name::free_view;
use crate::edit::{Edit, EditError, Target};

/// Stores the current camera under the name `given`, or under the first free one of `view`, `view
/// 2` and so on. Fails if the name is empty or not printable.
pub fn store_view(scene: &Scene, given: Option<&str>) -> Result<Edit, EditError> {
    let name = match given {
        Some(given) => name("name", given)?,
        None => free_view(scene, "view"),
    };
    if name.is_empty() {
        return Err(EditError::new("a camera needs a name", ""));
    }
    let mut next = scene.clone();
    let old = next.cameras.insert(name.clone(), scene.camera.clone());
    let label = format!("store camera {name}");
    let replaced = old.is_some_and(|old| old != scene.camera);
    let note = replaced.then(|| format!("View {name} was replaced."));
    Ok(Edit::checked(next, Target::View(name), label)?.with_note(note))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::mirror_room;

    #[test]
    fn cameras_are_stored() {
        let scene = mirror_room();
        let edit = store_view(&scene, None).unwrap();
        assert_eq!(edit.target, Target::View("view".into()));
        let edit = store_view(&edit.scene, None).unwrap();
        assert_eq!(edit.target, Target::View("view 2".into()));
        let mut moved = edit.scene;
        moved.camera.eye = [3.0, 2.0, 1.0];
        let edit = store_view(&moved, Some(" view ")).unwrap();
        assert_eq!(edit.scene.cameras["view"], moved.camera);
        assert!(edit.note.is_some());
        assert!(store_view(&scene, Some(" ")).is_err());
    }
}
