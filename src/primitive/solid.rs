//! Where lines are inside convex solids: what compounds are computed from.

use crate::bvh::Ray;
use crate::lanes::SimdFloat;
use crate::primitive::batch::Primitive;

/// The part of a packet's lines inside a convex solid.
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
    /// The lines that have such a part; what is said of others means nothing.
    pub meets: L::Mask,
}

/// A convex solid.
pub trait SolidPrimitive<L: SimdFloat>: Primitive<L> {
    /// Where lines are inside it; `None`: no line of the packet meets it.
    fn span(&self, ray: &Ray<L>) -> Option<Span<L>>;
}
