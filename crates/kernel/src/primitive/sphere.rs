//! Spheres.

use crate::bvh::Ray;
use crate::lanes::{Float, Mask, SimdFloat, Vec3};
use crate::primitive::bounding::BoundingSphere;
use crate::primitive::canonical::{
    Bounds, CanonicalShape, Projection, Proxy, ProxyFace, normals_of_solid, similarity,
};
use crate::primitive::compiled::{AnalyticPrimitive, SurfacePoint};
use crate::primitive::csg::{Solid, SolidPrimitive, Span};
use crate::primitive::ellipsoid::EllipsoidForm;
use glam::{DAffine3, DVec3};

/// Canonical form of a sphere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SphereForm {
    /// Centre.
    pub center: DVec3,
    /// Radius, greater than 0.
    pub radius: f64,
}

impl SphereForm {
    /// Returns the image under `map`: a sphere if `map` is a similarity, otherwise an ellipsoid.
    pub(super) fn transformed(self, map: &DAffine3) -> Solid {
        let Self { center, radius } = self;
        match similarity(&map.matrix3) {
            Some(scale) => {
                Self { center: map.transform_point3(center), radius: radius * scale }.into()
            }
            None => EllipsoidForm {
                scene_from_unit: *map
                    * DAffine3::from_translation(center)
                    * DAffine3::from_scale(DVec3::splat(radius)),
            }
            .into(),
        }
    }
}

impl CanonicalShape for SphereForm {
    fn bounds(&self) -> Option<Bounds> {
        Some((self.center - self.radius, self.center + self.radius))
    }

    fn bounding_sphere(&self) -> BoundingSphere {
        BoundingSphere { center: self.center, radius: self.radius }
    }

    fn thickness(&self) -> f64 {
        2.0 * self.radius
    }

    fn clearance(&self, point: DVec3) -> Option<f64> {
        Some((point.distance(self.center) - self.radius).abs())
    }

    fn normals_at(&self, point: DVec3, slack: f64) -> Vec<Vec<DVec3>> {
        let from_center = point - self.center;
        let distance = from_center.length();
        normals_of_solid(vec![(distance - self.radius, from_center / distance)], slack)
    }

    fn default_mapping(&self) -> Projection {
        Projection::Spherical
    }

    fn proxies(&self) -> Vec<Proxy> {
        vec![Proxy::new(vec![ProxyFace::Round(self.bounding_sphere())], self.bounds())]
    }

    fn extent_along(&self, axis: DVec3) -> Option<(f64, f64)> {
        let middle = axis.dot(self.center);
        Some((middle - self.radius, middle + self.radius))
    }
}

/// Sphere compiled for ray intersection, rounded to the precision of the lanes.
#[derive(Clone, Copy)]
pub struct Sphere<S> {
    center: [S; 3],
    radius: S,
    radius2: S,
    reach: S,
}

impl<S: Float> Sphere<S> {
    pub fn new(form: &SphereForm) -> Self {
        Self {
            center: form.center.to_array().map(S::from_f64),
            radius: S::from_f64(form.radius),
            radius2: S::from_f64(form.radius * form.radius),
            reach: S::from_f64(form.max_coordinate()),
        }
    }
}

/// Returns the distances at which each line enters and leaves a sphere, and the lanes whose line
/// hits it; `None` if no line hits it. `f` is the line's origin relative to the centre, and `d` is
/// its unit direction.
///
/// The discriminant is computed from the vector f - (f.d) d, whose length is the line's distance
/// from the centre. The root closer to the origin is computed from the product of both roots.
/// Neither computation cancels for small or distant spheres (Haines, Günther, Akenine-Möller 2019,
/// *Precision Improvements for Ray/Sphere Intersection*, Ray Tracing Gems, chapter 7).
#[inline(always)]
pub fn intersections<L: SimdFloat>(f: Vec3<L>, d: Vec3<L>, radius2: L) -> Option<(L, L, L::Mask)> {
    let b = -f.dot(d);
    let across = d.mul_add(b, f);
    let discriminant = radius2 - across.length_squared();
    let meets = discriminant.ge(L::zero());
    if meets.none() {
        return None;
    }
    let root = discriminant.max(L::zero()).sqrt();
    let q = b + root.copysign(b);
    let c = f.length_squared() - radius2;
    // q is 0 only if the ray starts on the sphere and is tangent to it: both distances are 0.
    let other = c / q;
    let other = L::select(q.abs().gt(L::zero()), other, L::zero());
    let behind = b.lt(L::zero());
    Some((L::select(behind, q, other), L::select(behind, other, q), meets))
}

impl<L: SimdFloat> AnalyticPrimitive<L> for Sphere<L::Scalar> {
    #[inline(always)]
    fn intersect(&self, ray: &Ray<L>) -> Option<(L, L::Mask)> {
        let f = ray.origin - Vec3::splat(self.center);
        let (near, far, meets) = intersections(f, ray.direction, L::splat(self.radius2))?;
        Some((L::select(near.gt(L::zero()), near, far), meets))
    }

    #[inline(always)]
    fn surface(&self, point: Vec3<L>) -> SurfacePoint<L> {
        let center = Vec3::splat(self.center);
        let normal = (point - center).normalize();
        let point = normal.mul_add(L::splat(self.radius), center);
        SurfacePoint { point, normal, max_coordinate: L::splat(self.reach) }
    }
}

impl<L: SimdFloat> SolidPrimitive<L> for Sphere<L::Scalar> {
    type Spans = Option<Span<L>>;

    fn spans(&self, ray: &Ray<L>, wanted: L::Mask) -> Option<Span<L>> {
        let f = ray.origin - Vec3::splat(self.center);
        let (enter, leave, meets) = intersections(f, ray.direction, L::splat(self.radius2))?;
        if (meets & wanted).none() {
            return None;
        }
        // The cosine is half the chord divided by the radius.
        let cosine = (leave - enter) * (L::from_f64(0.5) / L::splat(self.radius));
        Some(Span { enter, leave, enter_cosine: cosine, leave_cosine: cosine, meets })
    }
}
