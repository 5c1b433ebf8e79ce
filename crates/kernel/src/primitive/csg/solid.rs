//! Solids: primitives that enclose a volume, and can therefore be parts of compounds.

use crate::bvh::Ray;
use crate::lanes::{Float, SimdFloat, Vec3};
use crate::primitive::canonical::CanonicalShape;
use crate::primitive::compiled::{AnalyticPrimitive, SurfacePoint, TexCoord};
use crate::primitive::conical_frustum::{ConicalFrustum, ConicalFrustumForm};
use crate::primitive::convex_polyhedron::{ConvexPolyhedron, ConvexPolyhedronForm};
use crate::primitive::ellipsoid::{Ellipsoid, EllipsoidForm};
use crate::primitive::form::{Form, form_enum};
use crate::primitive::plane::{Plane, PlaneForm};
use crate::primitive::sphere::{Sphere, SphereForm};
use crate::primitive::torus::{Torus, TorusForm};
use glam::DAffine3;

/// Interval of distances in which the line of each lane is inside a solid.
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
    /// Lanes whose line has this interval; the other fields are undefined in other lanes.
    pub meets: L::Mask,
}

/// Compiled primitive that encloses a volume.
pub trait SolidPrimitive<L: SimdFloat>: AnalyticPrimitive<L> {
    /// Collection of spans in ascending order, without overlap.
    type Spans: IntoIterator<Item = Span<L>>;

    /// Returns the spans of the lines of a ray packet; none if no line in `wanted` hits the solid.
    fn spans(&self, ray: &Ray<L>, wanted: L::Mask) -> Self::Spans;
}

macro_rules! solids {
    ($($kind:ident($form:ident, $spans:literal)),+; others: $($other:ident),+) => {
        form_enum! {
            /// Canonical form that can be a part of a compound. A plane stands for the half-space
            /// behind it.
            #[allow(missing_docs, reason = "the variants of `Form` with the same names")]
            pub enum Solid {
                $($kind($form),)+
            }
        }

        impl From<Solid> for Form {
            fn from(solid: Solid) -> Self {
                match solid {
                    $(Solid::$kind(form) => Self::$kind(form),)+
                }
            }
        }

        impl Form {
            /// Converts to a part of a compound; `None` for other geometry.
            pub fn into_solid(self) -> Option<Solid> {
                match self {
                    $(Self::$kind(form) => Some(Solid::$kind(form)),)+
                    $(Self::$other(_) => None,)+
                }
            }
        }

        /// Solid compiled for ray intersection.
        pub enum CompiledSolid<S> {
            $($kind($kind<S>),)+
        }

        impl<S: Float> CompiledSolid<S> {
            /// Compiles the part of a compound.
            pub fn new(solid: &Solid) -> Self {
                match solid {
                    $(Solid::$kind(form) => Self::$kind($kind::new(form)),)+
                }
            }

            /// Returns the largest number of spans of one line.
            pub fn max_spans(&self) -> usize {
                match self {
                    $(Self::$kind(_) => $spans,)+
                }
            }

            /// Calls `use_it` for each span of the lines of a ray packet, unless no line in
            /// `wanted` hits the solid.
            #[inline(always)]
            pub fn for_each_span<L: SimdFloat<Scalar = S>>(
                &self,
                ray: &Ray<L>,
                wanted: L::Mask,
                use_it: impl FnMut(Span<L>),
            ) {
                match self {
                    $(Self::$kind(solid) => solid.spans(ray, wanted).into_iter().for_each(use_it),)+
                }
            }

            /// Projects `point` onto the solid, as [`AnalyticPrimitive::surface`] does.
            #[inline(always)]
            pub fn surface<L: SimdFloat<Scalar = S>>(&self, point: Vec3<L>) -> SurfacePoint<L> {
                match self {
                    $(Self::$kind(solid) => solid.surface(point),)+
                }
            }

            /// Returns the solid's own texture coordinates at `point`; `None` without any.
            pub fn uv<L: SimdFloat<Scalar = S>>(&self, point: Vec3<L>) -> Option<TexCoord<L>> {
                match self {
                    $(Self::$kind(solid) => solid.uv(point),)+
                }
            }
        }
    };
}

// Kinds of solids, each with the largest number of spans of one line; then forms that are not
// solids.
solids! {
    Sphere(SphereForm, 1),
    Ellipsoid(EllipsoidForm, 1),
    ConvexPolyhedron(ConvexPolyhedronForm, 1),
    ConicalFrustum(ConicalFrustumForm, 1),
    Torus(TorusForm, 2),
    Plane(PlaneForm, 1);
    others: Csg, Mesh, Parallelogram
}
