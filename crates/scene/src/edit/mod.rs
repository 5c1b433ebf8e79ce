//! Edits of scenes, as pure functions from a valid scene to an [`Edit`], or to an [`EditError`]
//! with the reason. They use no terminal and no clock, and read only the files that a scene names.

#![cfg_attr(not(test), deny(clippy::wildcard_enum_match_arm))]

mod add;
mod bounds;
mod compound;
mod convert;
mod copy;
mod increment;
#[cfg(test)]
mod increment_test;
mod lens;
mod mirror_material;
mod parse_value;
mod part;
mod placement;
mod properties;
mod ready_made;
mod rotate;
mod scale;
mod set;
mod target;
mod translate;
mod unique_name;
mod viewpoints;

pub use add::{add_light, add_object, light_kinds, object_kinds};
pub use bounds::{bounds, lowest, pivot_distance, scene_bounds, step_length};
pub use compound::{add_part, dissolve, join, part_kinds, solid_at};
pub use copy::{delete, duplicate, own_material, rename, repeat};
pub use increment::{step, toggle};
pub use lens::{change_aperture, focus_on};
pub use mirror_material::{mirror, step_mirror};
pub use placement::snap_to_ground;
pub use properties::{Property, Widget, Word, rows};
pub use ready_made::{
    add_ready_made, give_preset, presets, purge_materials, ready_lights, ready_objects,
};
pub use rotate::rotate;
pub use scale::scale;
pub use set::{set, set_component};
pub use target::{SceneSettings, Section, Target, outline};
pub use translate::move_by;
pub use viewpoints::store_view;

use crate::Scene;
use crate::value::truncated;
use std::fmt;

/// Result of an edit: the edited scene, and what the editor shows about it.
#[derive(Clone, Debug, PartialEq)]
pub struct Edit {
    /// Edited scene, which is valid.
    pub scene: Scene,
    /// Target to select after the edit.
    pub target: Target,
    /// Label in the undo history, such as `move cube`. Only edits with the same label are
    /// coalesced.
    pub label: String,
    /// Sentence about a side effect of the edit; `None` if there is none.
    pub note: Option<String>,
}

/// Reason why an edit of a scene was refused.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct EditError {
    /// Phrase that states why the edit was refused.
    pub found: String,
    /// Expected value or remedy, in sentences; may be empty.
    pub help: String,
}

impl fmt::Display for EditError {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{}.", self.found)?;
        if self.help.is_empty() { Ok(()) } else { write!(f, " {}", self.help) }
    }
}

impl std::error::Error for EditError {}

impl From<EditError> for String {
    fn from(error: EditError) -> Self {
        error.to_string()
    }
}

impl EditError {
    /// Creates an error with the phrase `found` and the sentences `help`.
    pub fn new(found: impl Into<String>, help: impl Into<String>) -> Self {
        Self { found: found.into(), help: help.into() }
    }

    fn gone(target: &Target) -> Self {
        let what = match target {
            Target::View(name) => format!("there is no camera \"{}\"", truncated(name)),
            Target::Group(name) => format!("there is no group \"{}\"", truncated(name)),
            Target::Material(name) => format!("there is no material \"{}\"", truncated(name)),
            Target::Light(i) => format!("there is no light {}", i + 1),
            Target::Object(i) => format!("there is no object {}", i + 1),
            Target::Part(..) => "there is no such part".to_string(),
            Target::Camera | Target::Settings(_) => "it cannot be read".to_string(),
        };
        Self::new(what, "")
    }
}

impl Edit {
    /// Creates the edit whose result is `scene`, or returns the first validation error.
    fn checked(mut scene: Scene, target: Target, label: String) -> Result<Self, EditError> {
        scene.resolve();
        match scene.faults().into_iter().next() {
            Some(fault) => Err(EditError::new(fault.found, fault.help)),
            None => Ok(Self { scene, target, label, note: None }),
        }
    }

    fn with_note(self, note: Option<String>) -> Self {
        Self { note, ..self }
    }
}
