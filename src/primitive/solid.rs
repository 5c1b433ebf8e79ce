//! Intervals of lines inside solids, from which compounds are computed.

use crate::bvh::Ray;
use crate::lanes::SimdFloat;
use crate::primitive::batch::Primitive;

/// A part of a packet's lines inside a solid.
#[derive(Clone, Copy, Debug)]
pub struct Span<L: SimdFloat> {
    /// Distance at which the line enters; `-L::MAX`: it comes from inside.
    pub enter: L,
    /// Distance at which it leaves; `L::MAX`: it stays inside.
    pub leave: L,
    /// Cosine of the angle between line and normal where it enters, without its sign.
    pub enter_cosine: L,
    /// The same where it leaves.
    pub leave_cosine: L,
    /// Lines that have such a part; the other fields are meaningless for all others.
    pub meets: L::Mask,
}

/// A solid that compounds can be made of.
pub trait SolidPrimitive<L: SimdFloat>: Primitive<L> {
    /// Spans of one packet of lines, in ascending order and without overlap.
    type Spans: IntoIterator<Item = Span<L>>;

    /// Parts of the lines inside the solid; none if no line of the packet hits it.
    fn spans(&self, ray: &Ray<L>) -> Self::Spans;
}
