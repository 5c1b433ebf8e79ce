//! Table of light kinds. CONTRIBUTING.md lists what a new kind needs.

use crate::light::{
    Directional, DiskLight, Environment, LightForm, Point, RectangleLight, SphereLight, Spot,
};
use crate::value::{KeyNode, ValidationError, kinds, round_nice, round_significant};
use glam::DVec3;

/// Description of one kind of light, with the keys that users write in scene files.
pub trait LightDesc: KeyNode {
    /// Converts the description, which must be valid, to its canonical form.
    fn form(&self) -> LightForm<'_>;

    /// Returns the validation errors of the description.
    fn faults(&self) -> Vec<ValidationError> {
        self.validator().errors()
    }

    /// Returns the position and the directions of the light, for edits.
    fn handles(&mut self) -> Handles<'_> {
        Handles::default()
    }

    /// Returns the name of the first new light of this kind.
    fn usual_name(&self) -> &'static str {
        "lamp"
    }

    /// Sets position, direction and size of the light by `placement`, as far as it has such keys.
    fn place(&mut self, _: &Placement) {}
}

/// References to the position and the directions of a light; `None` where its kind has no such key.
#[derive(Debug, Default)]
pub struct Handles<'a> {
    /// Position of the light, or centre of its surface.
    pub position: Option<&'a mut [f64; 3]>,
    /// Direction in which the light travels, axis of its cone, or normal of its surface.
    pub direction: Option<&'a mut [f64; 3]>,
    pub up: Option<&'a mut [f64; 3]>,
}

/// Position, direction and size of a light that is created.
#[derive(Clone, Copy, Debug)]
pub struct Placement {
    /// Position of the light, or centre of its surface.
    pub position: [f64; 3],
    /// Direction in which the light travels.
    pub direction: [f64; 3],
    /// Radius of the surface, or half of the side of a square.
    pub radius: f64,
}

kinds! {
    /// Kind of a light. In scene files, its key stands beside the other keys of the light.
    pub enum LightKind: LightDesc {
        "point" => Point(Point),
        "directional" => Directional(Directional),
        "spot" => Spot(Spot),
        "sphere" => Sphere(SphereLight),
        "rectangle" => Rectangle(RectangleLight),
        "disk" => Disk(DiskLight),
        "environment" => Environment(Environment),
    }
}

impl LightKind {
    /// Creates a light of the kind `key` by [`LightDesc::place`]; `None` if there is no such kind.
    pub fn placed(key: &str, placement: &Placement) -> Option<Self> {
        let mut kind = Self::of_kind(key)?;
        kind.place(placement);
        Some(kind)
    }
}

/// Returns the position of `placement`, rounded to multiples of a power of ten that is at most 1e-4
/// of the radius, and the radius, rounded to two significant digits.
pub(super) fn rounded_ball(placement: &Placement) -> ([f64; 3], f64) {
    let Placement { position, radius, .. } = *placement;
    let center = DVec3::from(position).map(|x| round_nice(x, radius)).to_array();
    (center, round_significant(radius, 2))
}
