//! Intervals in which lines are inside of solids. Compounds (CSG) are computed from these
//! intervals.

use crate::bvh::Ray;
use crate::lanes::SimdFloat;
use crate::primitive::batch::Primitive;

/// Interval of distances in which the line of each lane is inside of a solid.
#[derive(Clone, Copy, Debug)]
pub struct Span<L: SimdFloat> {
    /// Distance at which the line enters the solid; `-L::MAX` if the line has no entry.
    pub enter: L,
    /// Distance at which the line leaves the solid; `L::MAX` if the line has no exit.
    pub leave: L,
    /// Absolute cosine of the angle between line and surface normal at `enter`.
    pub enter_cosine: L,
    /// Absolute cosine of the angle between line and surface normal at `leave`.
    pub leave_cosine: L,
    /// Lanes whose line has this interval in the solid; the other fields are undefined in other
    /// lanes.
    pub meets: L::Mask,
}

/// Primitive with a closed surface, which encloses a solid. Only such primitives can be parts of a
/// compound.
pub trait SolidPrimitive<L: SimdFloat>: Primitive<L> {
    /// List of the intervals in which the lines of a packet are inside of the solid, in ascending
    /// order and without overlap.
    type Spans: IntoIterator<Item = Span<L>>;

    /// Returns the intervals in which the lines of a ray packet are inside of the solid; none if no
    /// line hits it.
    fn spans(&self, ray: &Ray<L>) -> Self::Spans;
}
