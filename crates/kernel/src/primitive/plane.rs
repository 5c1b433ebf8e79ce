//! Infinite planes, and the half-spaces behind them, which can be parts of compounds (CSG).

use crate::bvh::Ray;
use crate::lanes::{Float, SimdFloat, Vec3};
use crate::primitive::batch::{Primitive, SurfacePoint};
use crate::primitive::canonical::{
    Bounds, CanonicalShape, DefaultMapping, HalfSpace, Proxy, ProxyFace, half_space,
};
use crate::primitive::form::Form;
use crate::primitive::solid::{SolidPrimitive, Span};
use glam::{DAffine3, DVec3};

/// Canonical form of an infinite plane. Its front is the side to which `normal` points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlaneForm {
    /// Unit normal of the plane, on its front.
    pub normal: DVec3,
    /// Value of `normal . p` for all points p of the plane.
    pub offset: f64,
}

impl CanonicalShape for PlaneForm {
    fn transformed(self, map: &DAffine3) -> Form {
        let normals = map.matrix3.inverse().transpose();
        let on_plane = map.transform_point3(self.normal * self.offset);
        let HalfSpace { normal, offset } = half_space(on_plane, normals * self.normal);
        Self { normal, offset }.into()
    }

    fn bounds(&self) -> Option<Bounds> {
        None
    }

    fn plane(&self) -> Option<HalfSpace> {
        Some(HalfSpace { normal: self.normal, offset: self.offset })
    }

    fn is_convex(&self) -> bool {
        true
    }

    fn thickness(&self) -> f64 {
        f64::INFINITY
    }

    fn clearance(&self, point: DVec3) -> Option<f64> {
        Some((self.normal.dot(point) - self.offset).abs())
    }

    fn normals_at(&self, point: DVec3, slack: f64) -> Vec<Vec<DVec3>> {
        let on = (self.normal.dot(point) - self.offset).abs() <= slack;
        if on { vec![vec![self.normal]] } else { Vec::new() }
    }

    fn cast(&self, origin: DVec3, direction: DVec3) -> Option<f64> {
        let t = (self.offset - self.normal.dot(origin)) / self.normal.dot(direction);
        (t > 0.0 && t.is_finite()).then_some(t)
    }

    fn default_mapping(&self) -> DefaultMapping {
        DefaultMapping::Planar
    }

    fn proxies(&self) -> Vec<Proxy> {
        vec![Proxy::new(self.plane().into_iter().map(ProxyFace::Flat).collect(), None)]
    }

    fn extent_along(&self, axis: DVec3) -> Option<(f64, f64)> {
        let along = self.normal.dot(axis);
        let parallel = along.abs() > 1.0 - 1e-12;
        parallel.then_some((along.signum() * self.offset, along.signum() * self.offset))
    }
}

/// Infinite plane compiled for ray intersection.
#[derive(Clone, Copy)]
pub struct Plane<S> {
    normal: [S; 3],
    offset: S,
}

impl<S: Float> Plane<S> {
    /// Compiles a plane; `None` for any other form.
    pub fn new(form: &Form) -> Option<Self> {
        let Form::Plane(PlaneForm { normal, offset }) = form else { return None };
        Some(Self { normal: normal.to_array().map(S::from_f64), offset: S::from_f64(*offset) })
    }
}

impl<L: SimdFloat> Primitive<L> for Plane<L::Scalar> {
    #[inline(always)]
    fn intersect(&self, ray: &Ray<L>) -> Option<(L, L::Mask)> {
        let normal = Vec3::splat(self.normal);
        // `t` is infinite or NaN for a ray parallel to the plane.
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

/// Half-space behind a plane, as a part of compounds (CSG).
impl<L: SimdFloat> SolidPrimitive<L> for Plane<L::Scalar> {
    type Spans = Option<Span<L>>;

    fn spans(&self, ray: &Ray<L>) -> Option<Span<L>> {
        let normal = Vec3::splat(self.normal);
        let speed = ray.direction.dot(normal);
        let height = ray.origin.dot(normal) - L::splat(self.offset);
        let (all, none) = (L::from_f64(L::MAX), L::from_f64(-L::MAX));
        let t = -height / speed;
        let (enters, leaves) = (speed.lt(L::zero()), speed.gt(L::zero()));
        // A line parallel to the plane does not cross it: all of the line is behind the plane or in
        // front of it. If the distance of a crossing overflows, it is clamped to the largest
        // number, which means that there is no crossing.
        let enter = L::select(enters, t.max(none).min(all), none);
        let leave = L::select(leaves, t.max(none).min(all), all);
        let meets = enters | leaves | height.le(L::zero());
        let cosine = speed.abs();
        Some(Span { enter, leave, enter_cosine: cosine, leave_cosine: cosine, meets })
    }
}
