//! Bounding boxes tested before a primitive's own intersection.

use crate::bvh::Ray;
use crate::bvh::packet::SlabPacket;
use crate::lanes::{Float, SimdFloat, Vec3};
use crate::primitive::form::Form;
use crate::value::Choice;
use glam::DVec3;
use serde::{Deserialize, Serialize};

/// Acceleration structure. Every choice renders the same image; only speed differs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Acceleration {
    /// The fastest by measurement: a tree for many primitives, else for each part of the picture
    /// the primitives that its rays may hit.
    #[default]
    Auto,
    /// Every ray meets everything.
    None,
    /// Camera rays test the primitives on their part of the screen: each has a rectangle there.
    ScreenBounds,
    /// Each primitive has a box in its own space.
    Obb,
    /// Each primitive has a box in the scene's space.
    Aabb,
    /// A tree of boxes.
    Bvh,
}

impl Acceleration {
    /// All of them, in the order of [`Acceleration::CHOICES`].
    pub const ALL: [Self; 6] =
        [Self::Auto, Self::None, Self::ScreenBounds, Self::Obb, Self::Aabb, Self::Bvh];

    /// Their names and what they mean.
    pub const CHOICES: &'static [Choice] = &[
        Choice { name: "auto", doc: "the fastest, by measurement" },
        Choice { name: "none", doc: "every ray meets everything" },
        Choice {
            name: "screen-bounds",
            doc: "a rectangle on the screen per thing, for camera rays",
        },
        Choice { name: "obb", doc: "a box per thing, in its own space" },
        Choice { name: "aabb", doc: "a box per thing, in the scene's space" },
        Choice { name: "bvh", doc: "a tree of boxes" },
    ];

    /// Its name.
    pub fn name(self) -> &'static str {
        Self::CHOICES[self as usize].name
    }

    /// Its name in earlier versions, which scene files and the command line still accept; `None` if
    /// that is the same.
    pub fn former_name(self) -> Option<&'static str> {
        match self {
            Self::Auto | Self::None => None,
            Self::ScreenBounds => Some("projected"),
            Self::Obb => Some("object"),
            Self::Aabb => Some("world"),
            Self::Bvh => Some("hierarchy"),
        }
    }

    /// The structure with this name or former name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|s| s.name() == name || s.former_name() == Some(name))
    }
}

/// A box around one primitive.
pub struct ItemBox<S> {
    low: [S; 3],
    high: [S; 3],
    /// The box's space; `None`: the scene's.
    space: Option<BoxFrame<S>>,
}

/// A space of its own: p becomes `rows (p - center)`.
struct BoxFrame<S> {
    center: [S; 3],
    rows: [[S; 3]; 3],
    /// For each row the sum of its magnitudes: coordinates grow by so much at most.
    growth: [S; 3],
    /// Largest magnitude of a coordinate of the primitive in the scene.
    reach: S,
}

/// Corners rounded outward by a few units in the last place, `epsilon`, of the largest coordinate, which
/// is also what an item's own test may err by, in any direction.
pub fn padded((low, high): (DVec3, DVec3), epsilon: f64) -> [DVec3; 2] {
    let reach = low.abs().max(high.abs()).max_element();
    let pad = DVec3::splat(reach * 4.0 * epsilon);
    [low - pad, high + pad]
}

/// Difference between faces and corners of one solid at most, as a part of its extent: in a scene far from the
/// origin of its file both were rounded to what double precision has there.
const GIVEN: f64 = 1.0 / 4_294_967_296.0;

impl<S: Float> ItemBox<S> {
    /// Creates the box of a form, in its own space if `own` and if it has one; `None`: it has no end.
    pub fn new(form: &Form, own: bool) -> Option<Self> {
        let bounds = form.bounds()?;
        let vector = |v: DVec3| v.to_array().map(S::from_f64);
        let made = |bounds, space| {
            let [low, high] = padded(bounds, S::EPSILON.max(GIVEN)).map(vector);
            Self { low, high, space }
        };
        let Some((scene_from_own, (low, high))) = form.oriented_box().filter(|_| own) else {
            return Some(made(bounds, None));
        };
        let rows = scene_from_own.matrix3.inverse().transpose();
        let rows = [rows.x_axis, rows.y_axis, rows.z_axis];
        let middle = 0.5 * (low + high);
        let space = BoxFrame {
            center: vector(scene_from_own.transform_point3(middle)),
            rows: rows.map(vector),
            growth: rows.map(|r| S::from_f64(r.abs().element_sum())),
            reach: S::from_f64(bounds.0.abs().max(bounds.1.abs()).max_element()),
        };
        Some(made((low - middle, high - middle), Some(space)))
    }

    /// Rays that may hit the primitive no farther than `limit`.
    #[inline(always)]
    pub fn meets<L: SimdFloat<Scalar = S>>(&self, ray: &Ray<L>, limit: L) -> L::Mask {
        let far = ray.origin.max_abs();
        let beam = match &self.space {
            None => {
                let pad = far * L::from_f64(4.0 * L::EPSILON);
                SlabPacket::new(ray, Vec3::new(pad, pad, pad))
            }
            Some(space) => {
                // What origin, direction and centre lose on their way into the space, at most, by the
                // time the ray has come to the primitive.
                let lost = (far + L::splat(space.reach)) * L::from_f64(64.0 * L::EPSILON);
                let rows = space.rows.map(Vec3::splat);
                let of = |v: Vec3<L>| Vec3::new(rows[0].dot(v), rows[1].dot(v), rows[2].dot(v));
                let inner = Ray {
                    origin: of(ray.origin - Vec3::splat(space.center)),
                    direction: of(ray.direction),
                };
                SlabPacket::new(&inner, Vec3::splat(space.growth) * lost)
            }
        };
        beam.enters(Vec3::splat(self.low), Vec3::splat(self.high), limit)
    }
}
