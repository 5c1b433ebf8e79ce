//! Flat parallelograms.

use crate::bvh::Ray;
use crate::lanes::{Float, SimdFloat, Vec3};
use crate::primitive::canonical::{
    Bounds, CanonicalShape, HalfSpace, Projection, Proxy, ProxyFace, bounds_of_points,
    normal_of_triangle, triangle_distance,
};
use crate::primitive::compiled::{AnalyticPrimitive, SurfacePoint};
use glam::{DAffine3, DVec3};

/// Flat parallelogram of the points `corner + a u + b v`, with a and b in 0..=1. Its front is the
/// side to which u x v points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ParallelogramForm {
    /// Corner at which both edges start.
    pub corner: DVec3,
    /// Edge from `corner` to the next corner.
    pub u: DVec3,
    /// Edge from `corner` to the other adjacent corner.
    pub v: DVec3,
}

impl ParallelogramForm {
    /// Returns two triangles that form the parallelogram, counter-clockwise as seen from its front.
    pub fn halves(&self) -> [[DVec3; 3]; 2] {
        let Self { corner, u, v } = *self;
        let far = corner + u + v;
        [[corner, corner + u, far], [corner, far, corner + v]]
    }

    pub(super) fn transformed(self, map: &DAffine3) -> Self {
        let linear = map.matrix3;
        let (u, v) = (linear * self.u, linear * self.v);
        let corner = map.transform_point3(self.corner);
        // Exchanged edges keep the front of the parallelogram under a map that mirrors space.
        let (u, v) = if linear.determinant() < 0.0 { (v, u) } else { (u, v) };
        Self { corner, u, v }
    }
}

impl CanonicalShape for ParallelogramForm {
    fn bounds(&self) -> Option<Bounds> {
        bounds_of_points(&self.corners())
    }

    fn plane(&self) -> Option<HalfSpace> {
        Some(HalfSpace::through(self.corner, self.u.cross(self.v)))
    }

    fn thickness(&self) -> f64 {
        self.u.length().min(self.v.length())
    }

    fn clearance(&self, point: DVec3) -> Option<f64> {
        let [a, b] = self.halves().map(|corners| triangle_distance(corners, point));
        Some(a.min(b))
    }

    fn normals_at(&self, point: DVec3, slack: f64) -> Vec<Vec<DVec3>> {
        let mut halves = self.halves().into_iter();
        let normal = halves.find_map(|corners| normal_of_triangle(corners, point, slack));
        normal.map(|normal| vec![normal]).into_iter().collect()
    }

    fn default_mapping(&self) -> Projection {
        Projection::Planar
    }

    fn proxies(&self) -> Vec<Proxy> {
        let faces = self.plane().into_iter().map(ProxyFace::Flat).collect();
        vec![Proxy::new(faces, self.bounds())]
    }

    fn corners(&self) -> Vec<DVec3> {
        let Self { corner, u, v } = *self;
        vec![corner, corner + u, corner + v, corner + u + v]
    }
}

/// Parallelogram compiled for ray intersection. The coordinates (p - corner) . `dual_u` and (p -
/// corner) . `dual_v` of a point p inside it are in 0..=1.
#[derive(Clone, Copy)]
pub struct Parallelogram<S> {
    corner: [S; 3],
    normal: [S; 3],
    dual_u: [S; 3],
    dual_v: [S; 3],
    reach: S,
}

impl<S: Float> Parallelogram<S> {
    pub fn new(form: &ParallelogramForm) -> Self {
        let ParallelogramForm { corner, u, v } = *form;
        let n = u.cross(v);
        let area2 = n.length_squared();
        let rounded = |v: DVec3| v.to_array().map(S::from_f64);
        Self {
            corner: rounded(corner),
            normal: rounded(n.normalize()),
            dual_u: rounded(v.cross(n) / area2),
            dual_v: rounded(n.cross(u) / area2),
            reach: S::from_f64(form.max_coordinate()),
        }
    }
}

impl<L: SimdFloat> AnalyticPrimitive<L> for Parallelogram<L::Scalar> {
    #[inline(always)]
    fn intersect(&self, ray: &Ray<L>) -> Option<(L, L::Mask)> {
        let normal = Vec3::splat(self.normal);
        let from_corner = ray.origin - Vec3::splat(self.corner);
        // For a ray parallel to the plane, t, a and b are infinite or NaN, and the tests fail.
        let t = -from_corner.dot(normal) / ray.direction.dot(normal);
        let hit_point = ray.direction.mul_add(t, from_corner);
        let a = hit_point.dot(Vec3::splat(self.dual_u));
        let b = hit_point.dot(Vec3::splat(self.dual_v));
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
