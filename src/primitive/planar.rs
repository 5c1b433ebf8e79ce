//! Flat shapes: parallelograms (rectangles, platforms) and infinite planes.

use crate::bvh::Ray;
use crate::lanes::{Float, SimdFloat, Vec3};
use crate::primitive::batch::{Primitive, SurfacePoint, max_coordinate};
use crate::primitive::form::Form;
use crate::primitive::solid::{SolidPrimitive, Span};
use glam::DVec3;

/// One parallelogram. A point p of its plane has the coordinates (p - corner) . dual, both in 0..1
/// inside.
#[derive(Clone, Copy)]
pub struct Parallelogram<S> {
    corner: [S; 3],
    normal: [S; 3],
    dual_u: [S; 3],
    dual_v: [S; 3],
    reach: S,
}

impl<S: Float> Parallelogram<S> {
    /// `None`: the form is another.
    pub fn new(form: &Form) -> Option<Self> {
        let Form::Parallelogram { corner, u, v } = form else { return None };
        let n = u.cross(*v);
        let area2 = n.length_squared();
        let of = |v: DVec3| v.to_array().map(S::from_f64);
        Some(Self {
            corner: of(*corner),
            normal: of(n.normalize()),
            dual_u: of(v.cross(n) / area2),
            dual_v: of(n.cross(*u) / area2),
            reach: S::from_f64(max_coordinate(form)),
        })
    }
}

impl<L: SimdFloat> Primitive<L> for Parallelogram<L::Scalar> {
    #[inline(always)]
    fn intersect(&self, ray: &Ray<L>) -> Option<(L, L::Mask)> {
        let normal = Vec3::splat(self.normal);
        let from_corner = ray.origin - Vec3::splat(self.corner);
        // Parallel rays divide by zero: infinite or NaN distances fail every comparison.
        let t = -from_corner.dot(normal) / ray.direction.dot(normal);
        let at = ray.direction.mul_add(t, from_corner);
        let a = at.dot(Vec3::splat(self.dual_u));
        let b = at.dot(Vec3::splat(self.dual_v));
        let inside = a.ge(L::zero()) & a.le(L::one()) & b.ge(L::zero()) & b.le(L::one());
        Some((t, inside))
    }

    #[inline(always)]
    fn surface(&self, point: Vec3<L>) -> SurfacePoint<L> {
        let normal = Vec3::splat(self.normal);
        let above = (point - Vec3::splat(self.corner)).dot(normal);
        SurfacePoint {
            point: normal.mul_add(-above, point),
            normal,
            max_coordinate: L::splat(self.reach),
        }
    }
}

/// One infinite plane.
#[derive(Clone, Copy)]
pub struct Plane<S> {
    normal: [S; 3],
    offset: S,
}

impl<S: Float> Plane<S> {
    /// `None`: the form is another.
    pub fn new(form: &Form) -> Option<Self> {
        let Form::Plane { normal, offset } = form else { return None };
        Some(Self { normal: normal.to_array().map(S::from_f64), offset: S::from_f64(*offset) })
    }
}

impl<L: SimdFloat> Primitive<L> for Plane<L::Scalar> {
    #[inline(always)]
    fn intersect(&self, ray: &Ray<L>) -> Option<(L, L::Mask)> {
        let normal = Vec3::splat(self.normal);
        // Infinite or NaN for a parallel ray.
        let t = (L::splat(self.offset) - ray.origin.dot(normal)) / ray.direction.dot(normal);
        Some((t, L::mask(true)))
    }

    #[inline(always)]
    fn surface(&self, point: Vec3<L>) -> SurfacePoint<L> {
        let normal = Vec3::splat(self.normal);
        let above = point.dot(normal) - L::splat(self.offset);
        let reach = L::splat(self.offset).abs();
        SurfacePoint { point: normal.mul_add(-above, point), normal, max_coordinate: reach }
    }
}

/// The half-spaces behind the planes.
impl<L: SimdFloat> SolidPrimitive<L> for Plane<L::Scalar> {
    fn span(&self, ray: &Ray<L>) -> Option<Span<L>> {
        let normal = Vec3::splat(self.normal);
        let speed = ray.direction.dot(normal);
        let height = ray.origin.dot(normal) - L::splat(self.offset);
        let (all, none) = (L::from_f64(L::MAX), L::from_f64(-L::MAX));
        let t = -height / speed;
        let (enters, leaves) = (speed.lt(L::zero()), speed.gt(L::zero()));
        // A line parallel to the plane is behind it or before it for ever. A crossing beyond all
        // numbers is none.
        let enter = L::select(enters, t.max(none).min(all), none);
        let leave = L::select(leaves, t.max(none).min(all), all);
        let meets = enters | leaves | height.le(L::zero());
        let cosine = speed.abs();
        Some(Span { enter, leave, enter_cosine: cosine, leave_cosine: cosine, meets })
    }
}
