//! Intervals of lines inside solids, the input of compounds.

use crate::bvh::Ray;
use crate::lanes::SimdFloat;
use crate::primitive::batch::Primitive;

/// Interval of a packet's lines inside a solid.
#[derive(Clone, Copy, Debug)]
pub struct Span<L: SimdFloat> {
    /// Distance of entry; `-L::MAX` if the line starts inside.
    pub enter: L,
    /// Distance of exit; `L::MAX` if the line stays inside.
    pub leave: L,
    /// Absolute cosine of the angle between line and normal at the entry.
    pub enter_cosine: L,
    /// Absolute cosine of the angle between line and normal at the exit.
    pub leave_cosine: L,
    /// Lanes with such an interval; the other fields are meaningless elsewhere.
    pub meets: L::Mask,
}

/// Solid that can be a part of a compound.
pub trait SolidPrimitive<L: SimdFloat>: Primitive<L> {
    /// Spans of one packet of lines, in ascending order and without overlap.
    type Spans: IntoIterator<Item = Span<L>>;

    /// Returns the intervals of the lines inside the solid; none if no line of the packet hits it.
    fn spans(&self, ray: &Ray<L>) -> Self::Spans;
}
