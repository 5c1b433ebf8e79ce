//! Spans of lines inside of solids, from which compounds are computed.

use crate::bvh::Ray;
use crate::lanes::SimdFloat;
use crate::primitive::batch::Primitive;

/// Interval in which the line of each lane is inside of a solid.
#[derive(Clone, Copy, Debug)]
pub struct Span<L: SimdFloat> {
    /// Distance at which the line enters; `-L::MAX` if the line starts inside.
    pub enter: L,
    /// Distance at which the line leaves; `L::MAX` if the line stays inside.
    pub leave: L,
    /// Absolute cosine of the angle between line and normal where the line enters.
    pub enter_cosine: L,
    /// Absolute cosine of the angle between line and normal where the line leaves.
    pub leave_cosine: L,
    /// Lanes that have such an interval; the other fields are undefined in other lanes.
    pub meets: L::Mask,
}

/// Primitive with a closed surface, which encloses a solid. Only these can be parts of a compound.
pub trait SolidPrimitive<L: SimdFloat>: Primitive<L> {
    /// Spans of one packet of lines, in ascending order and without overlap.
    type Spans: IntoIterator<Item = Span<L>>;

    /// Returns the intervals of the packet's lines inside of the solid; none if no line hits it.
    fn spans(&self, ray: &Ray<L>) -> Self::Spans;
}
