//! Duplicating, deleting and renaming of objects, lights, materials and stored cameras.

use crate::edit::bounds::bounds;
use crate::edit::compound::{body, copy_part, material, operand_mut, remove_part, set_body};
use crate::edit::parse_value::name;
use crate::edit::placement::place_for;
use crate::edit::translate::{move_by, move_object, moved};
use crate::edit::unique_name::{free_light, free_material, free_object, free_view};
use crate::edit::{Edit, EditError, Target};
use crate::value::{floor_log10, rounded_to, truncated};
use crate::{Object, Scene};
use glam::DVec3;

/// Duplicates an object, a part, a light, a material or a stored camera under a name such as `cube 2`.
/// An object is moved to a free place on the same level, or down if it is infinite; a part is moved by
/// its width, a light along x. Fails for targets of which a scene has exactly one, such as the camera.
pub fn duplicate(scene: &Scene, target: &Target) -> Result<Edit, EditError> {
    let mut next = scene.clone();
    let copy = add_copy(&mut next, target)?;
    let mut by = [0.0; 3];
    if let Ok(body) = body(scene, target) {
        by = match (body.form().bounds(), target) {
            (Some((low, high)), Target::Part(..)) => {
                let width = (high.x - low.x).clamp(1e-6, 1e6);
                [rounded_to(width, floor_log10(width) - 2), 0.0, 0.0]
            }
            (Some((low, high)), _) => {
                let size = high - low;
                let usual = size.max_element();
                let base = place_for(scene, size.map(|s| s.max(1e-3 * usual)));
                let from = DVec3::new((low.x + high.x) / 2.0, low.y, (low.z + high.z) / 2.0);
                // The copy is at the same height above the ground as the original.
                let by = DVec3::new(base.x - from.x, 0.0, base.z - from.z);
                by.map(|x| rounded_to(x, floor_log10(usual) - 3)).to_array()
            }
            (None, _) => [0.0, -0.1 * bounds(scene, target).map_or(1.0, |b| b.radius), 0.0],
        };
        let mut copied = self::body(&next, &copy)?;
        move_object(&mut copied, by);
        set_body(&mut next, &copy, copied);
    } else if let Target::Light(i) = copy {
        by[0] = 5.0 * crate::edit::step_length(scene);
        next.lights[i].position_mut().into_iter().for_each(|at| *at = moved(*at, by));
    }
    Edit::checked(next, copy, format!("duplicate {}", target.label(scene)))
}

/// Adds `count` copies of an object, a part or a light, each moved `by` from the one before.
pub fn repeat(scene: &Scene, target: &Target, count: u32, by: [f64; 3]) -> Result<Edit, EditError> {
    let mut next = scene.clone();
    let mut last = target.clone();
    for n in 1..=count {
        last = add_copy(&mut next, target)?;
        next = move_by(&next, &last, by.map(|x| x * f64::from(n)))?.scene;
    }
    Edit::checked(next, last, format!("array of {}", target.label(scene)))
}

/// Adds a copy of `target` in its place, under a free name. Returns the copy.
fn add_copy(scene: &mut Scene, target: &Target) -> Result<Target, EditError> {
    if !target.exists(scene) {
        return Err(EditError::gone(target));
    }
    Ok(match target {
        Target::Object(i) => {
            let mut copy = scene.objects[*i].clone();
            if !copy.name.is_empty() {
                copy.name = free_object(scene, &copy.name);
            }
            scene.objects.push(copy);
            Target::Object(scene.objects.len() - 1)
        }
        Target::Part(..) => copy_part(scene, target).ok_or_else(|| EditError::gone(target))?,
        Target::Light(i) => {
            let mut copy = scene.lights[*i].clone();
            if !copy.name.is_empty() {
                copy.name = free_light(scene, &copy.name);
            }
            scene.lights.push(copy);
            Target::Light(scene.lights.len() - 1)
        }
        Target::Material(old) => {
            let new = free_material(scene, old);
            scene.materials.insert(new.clone(), scene.materials[old].clone());
            Target::Material(new)
        }
        Target::View(old) => {
            let new = free_view(scene, old);
            scene.cameras.insert(new.clone(), scene.cameras[old].clone());
            Target::View(new)
        }
        Target::Camera | Target::Settings(_) => {
            return Err(EditError::new(format!("there is only one {}", target.label(scene)), ""));
        }
        Target::Group(_) => {
            return Err(EditError::new("a light group cannot be copied", "Copy its lights."));
        }
    })
}

/// Deletes an object, a part, a light, a light group, a stored camera or a material. Objects whose material is deleted get
/// the default material, parts of compounds get that of the whole; the note names these objects.
/// Fails for targets that every scene has.
pub fn delete(scene: &Scene, target: &Target) -> Result<Edit, EditError> {
    if !target.exists(scene) {
        return Err(EditError::gone(target));
    }
    let label = format!("delete {}", target.label(scene));
    let mut next = scene.clone();
    let mut note = None;
    // Index to select after entry `i` was deleted and `left` remain.
    let neighbour = |i: usize, left: usize| if i < left { Some(i) } else { left.checked_sub(1) };
    let select = match target {
        Target::Object(i) => {
            next.objects.remove(*i);
            neighbour(*i, next.objects.len()).map(Target::Object)
        }
        Target::Part(..) => remove_part(&mut next, target),
        Target::Light(i) => {
            next.lights.remove(*i);
            neighbour(*i, next.lights.len()).map(Target::Light)
        }
        Target::View(name) => {
            next.cameras.remove(name);
            following(next.cameras.keys(), name).map(Target::View)
        }
        Target::Group(name) => {
            regroup(&mut next, name, "");
            following(next.groups.keys(), name).map(Target::Group)
        }
        Target::Material(name) => {
            next.materials.remove(name);
            note = strip(&mut next, name);
            following(next.materials.keys(), name).map(Target::Material)
        }
        Target::Camera | Target::Settings(_) => {
            let found = format!("{} belongs to every scene", target.label(scene));
            return Err(EditError::new(found, "Only its values can be changed."));
        }
    };
    Ok(Edit::checked(next, select.unwrap_or(Target::Camera), label)?.with_note(note))
}

/// Returns the name to select once `gone` is deleted: the next of the sorted `names`, or the last.
fn following<'a>(names: impl Iterator<Item = &'a String> + Clone, gone: &str) -> Option<String> {
    names.clone().find(|name| name.as_str() > gone).or_else(|| names.last()).cloned()
}

/// Renames a light group, with its lights and materials. With an empty name, they have groups of their
/// own.
fn regroup(scene: &mut Scene, old: &str, new: &str) {
    let mix = scene.groups.remove(old).filter(|_| !new.is_empty());
    scene.groups.extend(mix.map(|mix| (new.to_string(), mix)));
    let of_lights = scene.lights.iter_mut().map(|light| &mut light.group);
    let named = of_lights.chain(scene.materials.values_mut().map(|material| &mut material.group));
    let named = named.chain([&mut scene.film.solo]);
    named.filter(|group| *group == old).for_each(|group| *group = new.to_string());
}

/// Removes the material `name` from all objects and parts. Returns a note that names them; `None`
/// if there are none.
fn strip(scene: &mut Scene, name: &str) -> Option<String> {
    let note_of = |uses: fn(&Object, &str) -> bool, [one, many]: [&str; 2]| {
        let users = (0..scene.objects.len()).filter(|i| uses(&scene.objects[*i], name));
        let labels: Vec<_> = users.map(|i| Target::Object(i).label(scene)).collect();
        let names = labels[..labels.len().min(3)].join(", ");
        match labels.len() {
            0 => None,
            1 => Some(format!("{names} {one} now.")),
            2 | 3 => Some(format!("{names} {many} now.")),
            n => Some(format!("{names} and {} more {many} now.", n - 3)),
        }
    };
    let whole = ["has the default material", "have the default material"];
    let in_parts = [
        "has the material of the whole in its parts",
        "have the material of the whole in their parts",
    ];
    let notes = [
        note_of(|object, name| object.material == name, whole),
        note_of(|object, name| object.shape.names_material(name), in_parts),
    ];
    scene.objects.iter_mut().for_each(|object| object.rename_material(name, ""));
    notes.into_iter().flatten().reduce(|whole, in_parts| format!("{whole} {in_parts}"))
}

/// Renames an object, a part, a light, a material or a stored camera. Fails for a name that exists
/// already or is not printable. Only objects, parts and lights may have an empty name.
pub fn rename(scene: &Scene, target: &Target, new: &str) -> Result<Edit, EditError> {
    if !target.exists(scene) {
        return Err(EditError::gone(target));
    }
    let new = name("name", new)?;
    let mut next = scene.clone();
    let needed = || EditError::new("the name must not be empty", "Type one.");
    let taken = |what| EditError::new(format!("there is a {what} \"{new}\" already"), "");
    let select = match target {
        Target::Object(i) => {
            next.objects[*i].name = new.clone();
            target.clone()
        }
        Target::Light(i) => {
            next.lights[*i].name = new.clone();
            target.clone()
        }
        Target::Material(_) | Target::View(_) | Target::Group(_) if new.is_empty() => {
            return Err(needed());
        }
        Target::Material(old) => {
            if old != &new && next.materials.contains_key(&new) {
                return Err(taken("material"));
            }
            let moved = next.materials.remove(old);
            next.materials.extend(moved.map(|material| (new.clone(), material)));
            next.objects.iter_mut().for_each(|object| object.rename_material(old, &new));
            Target::Material(new.clone())
        }
        Target::Group(old) => {
            if old != &new && next.groups.contains_key(&new) {
                return Err(taken("group"));
            }
            regroup(&mut next, old, &new);
            Target::Group(new.clone())
        }
        Target::View(old) => {
            if old != &new && next.cameras.contains_key(&new) {
                return Err(taken("view"));
            }
            let moved = next.cameras.remove(old);
            next.cameras.extend(moved.map(|view| (new.clone(), view)));
            Target::View(new.clone())
        }
        Target::Part(i, path) => {
            operand_mut(&mut next, *i, path)
                .into_iter()
                .for_each(|part| part.name.clone_from(&new));
            target.clone()
        }
        Target::Camera | Target::Settings(_) => {
            let found = format!("{} has no name to change", target.label(scene));
            return Err(EditError::new(found, ""));
        }
    };
    Edit::checked(next, select, format!("rename {}", target.label(scene)))
}

/// Gives an object or a part a copy of its material that no other object uses.
pub fn own_material(scene: &Scene, target: &Target) -> Result<Edit, EditError> {
    let Ok(mut body) = body(scene, target) else {
        return Err(EditError::new("only objects have a material", "Select an object."));
    };
    let mut next = scene.clone();
    let old = material(scene, target).cloned().unwrap_or_default();
    let wanted = if body.name.is_empty() { body.shape.key() } else { &body.name };
    let new = free_material(scene, wanted);
    next.materials.insert(new.clone(), old);
    body.material.clone_from(&new);
    set_body(&mut next, target, body);
    let label = format!("own material for {}", target.label(scene));
    Ok(Edit::checked(next, target.clone(), label)?
        .with_note(Some(format!("Its material is {} now.", truncated(&new)))))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::edit::SceneSettings;
    use crate::testing::mirror_room;

    #[test]
    fn duplicates_are_apart_and_have_unique_names() {
        let scene = mirror_room();
        let edit = duplicate(&scene, &Target::Object(3)).unwrap();
        assert_eq!(edit.target, Target::Object(6));
        let (old, new) = (&scene.objects[3], &edit.scene.objects[6]);
        assert_eq!((new.name.as_str(), &new.material), ("cube 2", &old.material));
        let (a, b) = (old.form().bounds().unwrap(), new.form().bounds().unwrap());
        assert!(!(a.0.cmplt(b.1).all() && b.0.cmplt(a.1).all()), "{a:?} {b:?}");
        assert_eq!(a.0.y, b.0.y);
        let mut unnamed = scene.clone();
        unnamed.objects[1].name.clear();
        unnamed.objects[2].name = "rectangle".into();
        let copy = duplicate(&unnamed, &Target::Object(2)).unwrap().scene;
        assert_eq!(Target::Object(1).label(&copy), "rectangle 2");
        assert_eq!(Target::Object(6).label(&copy), "rectangle 3");
        let lamp = duplicate(&scene, &Target::Light(0)).unwrap().scene;
        assert_eq!(lamp.lights[1].name, "lamp 2");
        assert_ne!(lamp.lights[1].kind, lamp.lights[0].kind);
        let red = duplicate(&scene, &Target::Material("red".into())).unwrap();
        assert_eq!(red.target, Target::Material("red 2".into()));
        assert!(duplicate(&scene, &Target::Settings(SceneSettings::Film)).is_err());
        assert!(duplicate(&scene, &Target::Light(7)).is_err());
    }

    #[test]
    fn delete_selects_neighbour_and_notes_lost_materials() {
        let scene = mirror_room();
        let edit = delete(&scene, &Target::Object(5)).unwrap();
        assert_eq!((edit.target, edit.scene.objects.len()), (Target::Object(4), 5));
        let edit = delete(&scene, &Target::Object(2)).unwrap();
        assert_eq!(edit.target, Target::Object(2));
        let edit = delete(&scene, &Target::Material("red".into())).unwrap();
        assert_eq!(edit.scene.objects[2].material, "");
        assert_eq!(edit.note.as_deref(), Some("ball has the default material now."));
        assert_eq!(edit.target, Target::Material("yellow".into()));
        let edit = delete(&scene, &Target::Light(0)).unwrap();
        assert_eq!(edit.target, Target::Camera);
        assert!(delete(&scene, &Target::Camera).is_err());
    }

    #[test]
    fn rename_material_updates_objects() {
        let scene = mirror_room();
        let red = Target::Material("red".into());
        let edit = rename(&scene, &red, " crimson ").unwrap();
        assert_eq!(edit.scene.objects[2].material, "crimson");
        assert_eq!(edit.target, Target::Material("crimson".into()));
        assert_eq!(rename(&scene, &red, "red").unwrap().scene, scene);
        assert_eq!(
            rename(&scene, &Target::Object(2), "bowl").unwrap().scene.objects[2].name,
            "bowl"
        );
        for (target, new) in [
            (red.clone(), "green"),
            (red, ""),
            (Target::Object(2), "cube"),
            (Target::Object(2), "a\nb"),
            (Target::Camera, "x"),
        ] {
            assert!(rename(&scene, &target, new).is_err(), "{target:?} {new:?}");
        }
    }

    #[test]
    fn own_material_copies_a_shared_material() {
        let scene = mirror_room();
        let edit = own_material(&scene, &Target::Object(2)).unwrap();
        assert_eq!(edit.scene.objects[2].material, "ball");
        assert_eq!(edit.scene.materials["ball"], scene.materials["red"]);
        assert!(own_material(&scene, &Target::Light(0)).is_err());
    }

    const COMPOUND: &str = "
        [materials.red]
        color = [1.0, 0.0, 0.0]
        [materials.blue]
        color = [0.0, 0.0, 1.0]
        [[object]]
        name = \"dice\"
        material = \"blue\"
        [[object.shape.union.of]]
        shape.sphere = { center = [0.0, 0.0, 0.0], radius = 1.0 }
        [[object.shape.union.of]]
        material = \"red\"
        [[object.shape.union.of.shape.difference.of]]
        shape.sphere = { center = [1.0, 0.0, 0.0], radius = 1.0 }
        [[object.shape.union.of.shape.difference.of]]
        material = \"red\"
        shape.sphere = { center = [1.0, 1.0, 0.0], radius = 0.5 }
    ";

    #[test]
    fn rename_material_updates_parts() {
        let scene = Scene::parse(COMPOUND, "test").unwrap();
        let edit = rename(&scene, &Target::Material("red".into()), "crimson").unwrap();
        assert_eq!(edit.scene.objects[0].materials(), ["blue", "crimson", "crimson"]);
        let edit = rename(&scene, &Target::Material("blue".into()), "navy").unwrap();
        assert_eq!(edit.scene.objects[0].materials(), ["navy", "red", "red"]);
    }

    #[test]
    fn delete_material_clears_parts() {
        let scene = Scene::parse(COMPOUND, "test").unwrap();
        let edit = delete(&scene, &Target::Material("red".into())).unwrap();
        assert_eq!(edit.scene.objects[0].materials(), ["blue"; 3]);
        let note = "dice has the material of the whole in its parts now.";
        assert_eq!(edit.note.as_deref(), Some(note));
        let edit = delete(&scene, &Target::Material("blue".into())).unwrap();
        assert_eq!(edit.scene.objects[0].materials(), ["", "red", "red"]);
        assert_eq!(edit.note.as_deref(), Some("dice has the default material now."));
    }
}
