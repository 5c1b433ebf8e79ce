//! Access to the values of edit targets by key path.

use crate::edit::compound::{operand, operand_mut};
use crate::edit::{EditError, Target};
use crate::light::LightKind;
use crate::shape::CsgOperand;
use crate::value::{Description, Field, KeyNode, ValueType};
use crate::{FIELDS, Scene};

/// Returns the keys that scene files permit for `target`, with their types and defaults.
pub(super) fn fields(target: &Target) -> &'static [Field] {
    if let Target::Part(..) = target {
        return CsgOperand::FIELDS;
    }
    match FIELDS.iter().find(|field| field.name == target.path()[0]).map(|field| field.takes) {
        Some(ValueType::Table(fields) | ValueType::Named(fields)) => fields,
        Some(ValueType::Tables(fields)) => fields(),
        _ => &[],
    }
}

/// Returns the keys of `target` of which at most one may be given.
pub(super) fn exclusive_keys(target: &Target) -> &'static [&'static str] {
    match target {
        Target::Camera | Target::View(_) => &["target", "direction"],
        Target::Light(_) => LightKind::KEYS,
        Target::Material(_) => &["f0", "metal"],
        Target::Object(_) | Target::Part(..) | Target::Group(_) | Target::Settings(_) => &[],
    }
}

/// Returns the part of `scene` that `target` names.
pub(super) fn part<'a>(scene: &'a Scene, target: &Target) -> Result<&'a dyn KeyNode, EditError> {
    let root: &dyn KeyNode = scene;
    let part = if let Target::Part(i, path) = target {
        operand(scene, *i, path).map(|part| part as &dyn KeyNode)
    } else {
        target.path().iter().try_fold(root, |node, key| node.child(key))
    };
    part.ok_or_else(|| EditError::gone(target))
}

/// Returns [`part`] as a mutable reference.
pub(super) fn part_mut<'a>(
    scene: &'a mut Scene,
    target: &Target,
) -> Result<&'a mut dyn KeyNode, EditError> {
    if let Target::Part(i, path) = target {
        let part = operand_mut(scene, *i, path).map(|part| part as &mut dyn KeyNode);
        return part.ok_or_else(|| EditError::gone(target));
    }
    let root: &mut dyn KeyNode = scene;
    let part = target.path().iter().try_fold(root, |node, key| node.child_mut(key));
    part.ok_or_else(|| EditError::gone(target))
}

/// Returns which of the [`exclusive_keys`] is given; `None` if none is.
pub(super) fn given_key(part: &dyn KeyNode, target: &Target) -> Option<&'static str> {
    let is_given = |key: &&&str| part.child(key).is_some_and(|node| !node.is_absent());
    exclusive_keys(target).iter().find(is_given).copied()
}

/// Returns the field of the dotted path `key` (keys, list indices); `None` if there is none.
pub(super) fn field(fields: &'static [Field], key: &str) -> Option<&'static Field> {
    let (first, rest) = match key.split_once('.') {
        Some((first, rest)) => (first, Some(rest)),
        None => (key, None),
    };
    let found = fields.iter().find(|f| f.name == first)?;
    match (rest, found.takes) {
        (None, _) => Some(found),
        (Some(rest), ValueType::Table(inner) | ValueType::OneOf(inner)) => field(inner, rest),
        (Some(rest), ValueType::ListOf(inner)) => {
            let (index, rest) = rest.split_once('.')?;
            index.parse::<usize>().ok()?;
            field(inner, rest)
        }
        _ => None,
    }
}
