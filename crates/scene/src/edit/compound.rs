//! Compounds as trees: access to their parts, and edits that make, change and dissolve compounds.

use crate::edit::add::object_kinds;
use crate::edit::properties::Word;
use crate::edit::unique_name::{free_name, free_object};
use crate::edit::{Edit, EditError, Target};
use crate::material::Material;
use crate::shape::{CsgOperand, Shape, compose, unfit_reason};
use crate::value::{floor_log10, rounded_to};
use crate::{Object, Scene};
use glam::{DAffine3, DVec3};
use zerkalo_kernel::primitive::Form;

/// Returns the part at `path` of an object; `None` if there is no such part.
pub(super) fn operand<'a>(scene: &'a Scene, i: usize, path: &[usize]) -> Option<&'a CsgOperand> {
    let (last, outer) = path.split_last()?;
    let inner = |shape: &'a Shape, part: &usize| Some(&shape.parts()?.get(*part)?.shape);
    outer.iter().try_fold(&scene.objects.get(i)?.shape, inner)?.parts()?.get(*last)
}

/// Returns the list of parts that has the part at `path` of an object.
fn siblings<'a>(scene: &'a mut Scene, i: usize, path: &[usize]) -> Option<&'a mut Vec<CsgOperand>> {
    let (_, outer) = path.split_last()?;
    let inner =
        |shape: &'a mut Shape, part: &usize| Some(&mut shape.parts_mut()?.get_mut(*part)?.shape);
    outer.iter().try_fold(&mut scene.objects.get_mut(i)?.shape, inner)?.parts_mut()
}

/// Returns [`operand`] as a mutable reference.
pub(super) fn operand_mut<'a>(
    scene: &'a mut Scene,
    i: usize,
    path: &[usize],
) -> Option<&'a mut CsgOperand> {
    siblings(scene, i, path)?.get_mut(*path.last()?)
}

/// Returns an object, or a part as an object in the space of its compound.
pub(super) fn body(scene: &Scene, target: &Target) -> Result<Object, EditError> {
    let found = if let Target::Part(i, path) = target {
        operand(scene, *i, path).cloned().map(|CsgOperand { name, shape, material, transform }| {
            Object { name, material, shape, transform }
        })
    } else if let Target::Object(i) = target {
        scene.objects.get(*i).cloned()
    } else {
        None
    };
    found.ok_or_else(|| EditError::gone(target))
}

fn part_of(Object { name, material, shape, transform }: Object) -> CsgOperand {
    CsgOperand { name, shape, material, transform }
}

/// Replaces the object or part `target` by `body`.
pub(super) fn set_body(scene: &mut Scene, target: &Target, body: Object) {
    if let Target::Part(i, path) = target {
        operand_mut(scene, *i, path).into_iter().for_each(|part| *part = part_of(body.clone()));
    } else if let Target::Object(i) = target {
        scene.objects[*i] = body;
    }
}

impl Target {
    /// Returns the compound that has this part; `None` for other targets.
    pub fn compound(&self) -> Option<Self> {
        let Self::Part(i, path) = self else { return None };
        let (_, outer) = path.split_last()?;
        Some(if outer.is_empty() { Self::Object(*i) } else { Self::Part(*i, outer.to_vec()) })
    }

    /// Returns the parts of an object or part that is a compound; otherwise none.
    pub fn parts(&self, scene: &Scene) -> Vec<Self> {
        let (i, path, shape) = if let Self::Part(i, path) = self {
            (*i, &path[..], operand(scene, *i, path).map(|part| &part.shape))
        } else if let Self::Object(i) = self {
            (*i, &[][..], scene.objects.get(*i).map(|object| &object.shape))
        } else {
            return Vec::new();
        };
        let count = shape.and_then(|shape| Some(shape.parts()?.len())).unwrap_or(0);
        (0..count).map(|part| Self::Part(i, [path, &[part]].concat())).collect()
    }

    /// Returns the solids without parts in this object or part, in the order of their primitives.
    pub fn solids(&self, scene: &Scene) -> Vec<Self> {
        match &self.parts(scene)[..] {
            [] => vec![self.clone()],
            parts => parts.iter().flat_map(|part| part.solids(scene)).collect(),
        }
    }
}

/// Returns the material of an object or part, which may be that of its compound.
pub(super) fn material<'a>(scene: &'a Scene, target: &Target) -> Option<&'a Material> {
    let Target::Material(name) = target.material(scene)? else { return None };
    scene.materials.get(&name)
}

/// Returns the map from the space of the compound that has `target` to that of the scene.
pub(super) fn scene_from_compound(scene: &Scene, target: &Target) -> DAffine3 {
    let Some(compound) = target.compound() else { return DAffine3::IDENTITY };
    let steps = body(scene, &compound).map(|body| body.transform).unwrap_or_default();
    scene_from_compound(scene, &compound) * compose(&steps)
}

/// Returns the form of an object or part in the space of the scene.
pub(super) fn form(scene: &Scene, target: &Target) -> Option<Form> {
    let form = body(scene, target).ok()?.form();
    let map = scene_from_compound(scene, target);
    Some(if map == DAffine3::IDENTITY { form } else { form.transformed(&map) })
}

/// Returns the inverse of [`scene_from_compound`].
pub(super) fn to_compound(scene: &Scene, target: &Target) -> DAffine3 {
    scene_from_compound(scene, target).inverse()
}

/// Returns the vector `by` in the space of the compound that has `target`, rounded to a millionth.
pub(super) fn in_compound(scene: &Scene, target: &Target, by: [f64; 3]) -> [f64; 3] {
    let by = DVec3::from_array(by);
    let inner = to_compound(scene, target).transform_vector3(by);
    if inner == by || inner == DVec3::ZERO {
        return by.to_array();
    }
    inner.map(|x| rounded_to(x, floor_log10(inner.abs().max_element()) - 6)).to_array()
}

/// Returns the solid of an object at whose surface `point` is seen from `eye`; `None` if there is
/// none.
pub fn solid_at(scene: &Scene, object: usize, eye: DVec3, point: DVec3) -> Option<Target> {
    let direction = point - eye;
    let before = point - 1e-6 * direction;
    let is_at = |t: f64| (0.0..2e-6).contains(&t);
    let mut solids = Target::Object(object).solids(scene).into_iter();
    solids.find(|solid| {
        form(scene, solid).and_then(|form| form.cast(before, direction)).is_some_and(is_at)
    })
}

/// Returns the name and a description of each kind of solid that can be a part.
pub fn part_kinds() -> Vec<Word> {
    let fits = |kind: &Word| Shape::of_kind(&kind.name).is_some_and(|s| unfit_reason(&s).is_none());
    object_kinds().into_iter().filter(fits).collect()
}

/// Adds a solid of the kind `kind` to the compound `target`, or to that of the part `target`: half as
/// large, in the middle of its upper side.
pub fn add_part(scene: &Scene, target: &Target, kind: &str) -> Result<Edit, EditError> {
    let is_compound = |target: &Target| !target.parts(scene).is_empty();
    let compound = Some(target.clone()).filter(is_compound).or_else(|| target.compound());
    let compound = compound.ok_or_else(|| no_compound(scene, target))?;
    let mut whole = body(scene, &compound)?;
    let (low, high) = whole.shape.form().bounds().unwrap_or((-DVec3::ONE, DVec3::ONE));
    let size =
        rounded_to(0.5 * (high - low).max_element(), floor_log10((high - low).max_element()) - 2);
    let base = ((low + high) / 2.0).with_y(high.y - 0.5 * size);
    let base = base.map(|x| rounded_to(x, floor_log10(size) - 2));
    let shape = Shape::fitted_to(kind, base, DVec3::splat(size))
        .ok_or_else(|| EditError::new(format!("there is no solid called \"{kind}\""), ""))?;
    whole.shape.parts_mut().into_iter().for_each(|of| of.push(CsgOperand::new(shape.clone())));
    let mut next = scene.clone();
    set_body(&mut next, &compound, whole);
    let label = format!("add {kind} to {}", compound.label(scene));
    let added = compound.parts(&next).pop().unwrap_or(compound);
    Edit::checked(next, added, label)
}

fn no_compound(scene: &Scene, target: &Target) -> EditError {
    let help = "Mark objects (V), then | & or _ makes one of them.";
    EditError::new(format!("{} is no compound", target.label(scene)), help)
}

/// Joins objects to a compound of the kind `kind` in the place of the first, whose name and material
/// it keeps. A difference keeps the first solid without the others.
pub fn join(scene: &Scene, targets: &[Target], kind: &str) -> Result<Edit, EditError> {
    let mut indices = Vec::new();
    for target in targets {
        let Target::Object(i) = target else {
            let found = format!("{} is no object", target.label(scene));
            return Err(EditError::new(found, "Only whole objects are joined."));
        };
        let object = scene.objects.get(*i).ok_or_else(|| EditError::gone(target))?;
        if let Some(reason) = unfit_reason(&object.shape) {
            let found = format!("{}: a {} {reason}", target.label(scene), object.shape.key());
            return Err(EditError::new(found, "Only solids are joined."));
        }
        indices.push(*i);
    }
    let [first, _, ..] = indices[..] else {
        return Err(EditError::new("one object alone is no compound", "V marks several."));
    };
    let material = scene.objects[first].material.clone();
    let part = |i: &usize| {
        let mut part = part_of(scene.objects[*i].clone());
        if part.material == material {
            part.material.clear();
        }
        if *i == first {
            part.name.clear();
        }
        part
    };
    let of: Vec<_> = indices.iter().map(part).collect();
    let mut shape = Shape::of_kind(kind)
        .ok_or_else(|| EditError::new(format!("there is no compound called \"{kind}\""), ""))?;
    shape.parts_mut().into_iter().for_each(|parts| parts.clone_from(&of));
    let mut next = scene.clone();
    let name = match scene.objects[first].name.as_str() {
        "" => free_object(scene, kind),
        name => name.to_string(),
    };
    next.objects[first] = Object { name, material, shape, transform: Vec::new() };
    let mut rest = indices[1..].to_vec();
    rest.sort_unstable();
    rest.iter().rev().for_each(|i| drop(next.objects.remove(*i)));
    let target = Target::Object(first - rest.iter().filter(|i| **i < first).count());
    Edit::checked(next, target, format!("{kind} of {} objects", indices.len()))
}

/// Replaces a compound by its parts, which keep their place and material. The first one gets its name.
pub fn dissolve(scene: &Scene, target: &Target) -> Result<Edit, EditError> {
    let whole = body(scene, target).map_err(|_| no_compound(scene, target))?;
    let of = whole.shape.parts().ok_or_else(|| no_compound(scene, target))?;
    let mut next = scene.clone();
    let parts = of.iter().map(|part| freed(part, &whole));
    if let Target::Part(i, path) = target {
        let at = path.last().copied().unwrap_or(0);
        let parts: Vec<_> = parts.map(part_of).collect();
        siblings(&mut next, *i, path)
            .into_iter()
            .for_each(|of| drop(of.splice(at..=at, parts.clone())));
    } else if let Target::Object(i) = target {
        next.objects.remove(*i);
        for (n, part) in parts.enumerate() {
            let own = if part.name.is_empty() { part.shape.key() } else { &part.name };
            let name = if n == 0 { whole.name.clone() } else { free_object(&next, own) };
            next.objects.insert(i + n, Object { name, ..part });
        }
    }
    Edit::checked(next, target.clone(), format!("dissolve {}", target.label(scene)))
}

/// Returns a part of `whole` as it is without its compound.
fn freed(part: &CsgOperand, whole: &Object) -> Object {
    let inherits = part.material.is_empty();
    let material = if inherits { &whole.material } else { &part.material }.clone();
    let transform = [&part.transform[..], &whole.transform].concat();
    Object { name: part.name.clone(), material, shape: part.shape.clone(), transform }
}

/// Removes a part. The last part of a compound takes its place. Returns the target to select.
pub(super) fn remove_part(scene: &mut Scene, part: &Target) -> Option<Target> {
    let Target::Part(i, path) = part else { return None };
    let at = *path.last()?;
    siblings(scene, *i, path)?.remove(at);
    let compound = part.compound()?;
    let whole = body(scene, &compound).ok()?;
    if let Some([only]) = whole.shape.parts() {
        let only = Object { name: whole.name.clone(), ..freed(only, &whole) };
        set_body(scene, &compound, only);
        return Some(compound);
    }
    let parts = compound.parts(scene);
    parts.get(at.min(parts.len().saturating_sub(1))).cloned()
}

/// Adds a copy of a part after it. Returns the copy.
pub(super) fn copy_part(scene: &mut Scene, part: &Target) -> Option<Target> {
    let Target::Part(i, path) = part else { return None };
    let (at, outer) = path.split_last()?;
    let mut copy = operand(scene, *i, path)?.clone();
    let parts = siblings(scene, *i, path)?;
    if !copy.name.is_empty() {
        copy.name = free_name(&copy.name, |name| parts.iter().any(|part| part.name == name));
    }
    parts.insert(at + 1, copy);
    Some(Target::Part(*i, [outer, &[at + 1]].concat()))
}
