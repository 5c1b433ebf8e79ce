//! Infinite planes, and the half-spaces behind them, which can be parts of compounds.

use crate::bvh::Ray;
use crate::lanes::{Float, SimdFloat, Vec3};
use crate::primitive::canonical::{
    Bounds, CanonicalShape, HalfSpace, Projection, Proxy, ProxyFace,
};
use crate::primitive::compiled::{AnalyticPrimitive, SurfacePoint};
use crate::primitive::csg::{SolidPrimitive, Span};
use glam::DVec3;

/// Canonical form of an infinite plane: the half-space behind it. Its front is the side to which
/// `normal` points.
pub type PlaneForm = HalfSpace;

impl CanonicalShape for PlaneForm {
    fn bounds(&self) -> Option<Bounds> {
        None
    }

    /// Returns the distance of the plane from the origin.
    fn max_coordinate(&self) -> f64 {
        self.offset.abs()
    }

    fn plane(&self) -> Option<HalfSpace> {
        Some(*self)
    }

    fn thickness(&self) -> f64 {
        f64::INFINITY
    }

    fn clearance(&self, point: DVec3) -> Option<f64> {
        Some(self.height(point).abs())
    }

    fn normals_at(&self, point: DVec3, slack: f64) -> Vec<Vec<DVec3>> {
        let on = self.height(point).abs() <= slack;
        if on { vec![vec![self.normal]] } else { Vec::new() }
    }

    fn default_mapping(&self) -> Projection {
        Projection::Planar
    }

    fn proxies(&self) -> Vec<Proxy> {
        vec![Proxy::new(vec![ProxyFace::Flat(*self)], None)]
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
    pub normal: [S; 3],
    pub offset: S,
}

impl<S: Float> Plane<S> {
    pub fn new(form: &PlaneForm) -> Self {
        let normal = form.normal.to_array().map(S::from_f64);
        Self { normal, offset: S::from_f64(form.offset) }
    }
}

impl<L: SimdFloat> AnalyticPrimitive<L> for Plane<L::Scalar> {
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

/// Half-space behind the plane.
impl<L: SimdFloat> SolidPrimitive<L> for Plane<L::Scalar> {
    type Spans = Option<Span<L>>;

    fn spans(&self, ray: &Ray<L>, _wanted: L::Mask) -> Option<Span<L>> {
        let normal = Vec3::splat(self.normal);
        let speed = ray.direction.dot(normal);
        let height = ray.origin.dot(normal) - L::splat(self.offset);
        let (all, none) = (L::from_f64(L::MAX), L::from_f64(-L::MAX));
        let t = -height / speed;
        let (enters, leaves) = (speed.lt(L::zero()), speed.gt(L::zero()));
        // A line parallel to the plane is on one side everywhere. A distance that overflows is
        // clamped to the largest number, which means that there is no crossing.
        let enter = L::select(enters, t.max(none).min(all), none);
        let leave = L::select(leaves, t.max(none).min(all), all);
        let meets = enters | leaves | height.le(L::zero());
        let cosine = speed.abs();
        Some(Span { enter, leave, enter_cosine: cosine, leave_cosine: cosine, meets })
    }
}
