//! Bounded convex solids.

use crate::bvh::Ray;
use crate::lanes::{Float, Mask, SimdFloat, Vec3};
use crate::primitive::canonical::{
    Bounds, CanonicalShape, HalfSpace, Proxy, ProxyFace, bounds_of_points, normals_of_solid,
};
use crate::primitive::compiled::{AnalyticPrimitive, SurfacePoint};
use crate::primitive::csg::{SolidPrimitive, Span};
use crate::primitive::plane::Plane;
use glam::{DAffine3, DVec3};

/// Bounded intersection of half-spaces, with its corners.
#[derive(Clone, Debug, PartialEq)]
pub struct ConvexPolyhedronForm {
    /// Half-space behind each face.
    pub faces: Vec<HalfSpace>,
    /// Corners of the solid.
    pub corners: Vec<DVec3>,
}

impl ConvexPolyhedronForm {
    pub(super) fn transformed(self, map: &DAffine3) -> Self {
        Self {
            faces: self.faces.iter().map(|face| face.transformed(map)).collect(),
            corners: self.corners.iter().map(|c| map.transform_point3(*c)).collect(),
        }
    }
}

impl CanonicalShape for ConvexPolyhedronForm {
    fn bounds(&self) -> Option<Bounds> {
        bounds_of_points(&self.corners)
    }

    fn thickness(&self) -> f64 {
        let behind = |face: &HalfSpace| {
            self.corners.iter().map(|corner| -face.height(*corner)).fold(0.0, f64::max)
        };
        self.faces.iter().map(behind).fold(f64::INFINITY, f64::min)
    }

    fn clearance(&self, point: DVec3) -> Option<f64> {
        let heights = self.faces.iter().map(|face| face.height(point));
        Some(heights.fold(f64::NEG_INFINITY, f64::max).abs())
    }

    fn normals_at(&self, point: DVec3, slack: f64) -> Vec<Vec<DVec3>> {
        let side = |face: &HalfSpace| (face.height(point), face.normal);
        normals_of_solid(self.faces.iter().map(side).collect(), slack)
    }

    fn proxies(&self) -> Vec<Proxy> {
        let faces = self.faces.iter().copied().map(ProxyFace::Flat).collect();
        vec![Proxy::new(faces, self.bounds())]
    }

    fn corners(&self) -> Vec<DVec3> {
        self.corners.clone()
    }
}

/// Pair of parallel faces. The points p between them satisfy low <= normal . (p - center) <= high,
/// with `center` of [`ConvexPolyhedron`].
struct Slab<S> {
    normal: [S; 3],
    low: S,
    high: S,
}

/// Convex polyhedron compiled for ray intersection: bounding sphere, slabs, faces without a slab.
pub struct ConvexPolyhedron<S> {
    center: [S; 3],
    radius2: S,
    reach: S,
    slabs: Vec<Slab<S>>,
    /// Faces without a parallel face, relative to `center`.
    faces: Vec<Plane<S>>,
}

impl<S: Float> ConvexPolyhedron<S> {
    pub fn new(form: &ConvexPolyhedronForm) -> Self {
        let ConvexPolyhedronForm { faces, corners } = form;
        let (low, high) = form.bounds().unwrap_or_default();
        let center = 0.5 * (low + high);
        let radius2 = corners.iter().map(|c| c.distance_squared(center)).fold(0.0, f64::max);
        let mut out = Self {
            center: center.to_array().map(S::from_f64),
            // Rounded up, so that the test against the bounding sphere never rejects a hit.
            radius2: S::from_f64(radius2 * (1.0 + 8.0 * S::EPSILON)),
            reach: S::from_f64(form.max_coordinate()),
            slabs: Vec::new(),
            faces: Vec::new(),
        };
        let mut paired = vec![false; faces.len()];
        for (i, face) in faces.iter().enumerate() {
            if paired[i] {
                continue;
            }
            let opposite = (i + 1..faces.len())
                .find(|j| !paired[*j] && (faces[*j].normal + face.normal).length() < 1e-14);
            let high = face.offset - face.normal.dot(center);
            let normal = face.normal.to_array().map(S::from_f64);
            match opposite {
                Some(j) => {
                    paired[j] = true;
                    let low = -(faces[j].offset - faces[j].normal.dot(center));
                    out.slabs.push(Slab { normal, low: S::from_f64(low), high: S::from_f64(high) });
                }
                None => out.faces.push(Plane { normal, offset: S::from_f64(high) }),
            }
        }
        out
    }
}

impl<S: Float> ConvexPolyhedron<S> {
    /// Returns the distances at which each ray's line enters and leaves the solid, and the lanes
    /// that hit it; `None` if no line hits the bounding sphere.
    #[inline(always)]
    fn chord<L: SimdFloat<Scalar = S>>(&self, ray: &Ray<L>) -> Option<(L, L, L::Mask)> {
        let from_center = ray.origin - Vec3::splat(self.center);
        let along = from_center.dot(ray.direction);
        let across = ray.direction.mul_add(-along, from_center);
        let near = across.length_squared().le(L::splat(self.radius2));
        if near.none() {
            return None;
        }
        let mut enter = L::from_f64(-L::MAX);
        let mut leave = L::from_f64(L::MAX);
        // The speed of a ray towards a face to which it is parallel, +0 or -0, is replaced by a
        // tiny speed with the same sign, so that 0 / 0 cannot occur. A line on the inner side of
        // the face is not cut by it. A line on the outer side gets an empty chord. A line in the
        // plane of the face touches the solid or misses it, depending on the sign.
        let tiny = L::from_f64(1e-30);
        let steep = |speed: L| speed.abs().max(tiny).copysign(speed);
        for slab in &self.slabs {
            let normal = Vec3::splat(slab.normal);
            let inverse = L::one() / steep(ray.direction.dot(normal));
            let height = from_center.dot(normal);
            let t0 = (L::splat(slab.low) - height) * inverse;
            let t1 = (L::splat(slab.high) - height) * inverse;
            enter = t0.min(t1).max(enter);
            leave = t0.max(t1).min(leave);
        }
        for face in &self.faces {
            let normal = Vec3::splat(face.normal);
            let speed = steep(ray.direction.dot(normal));
            let t = (L::splat(face.offset) - from_center.dot(normal)) / speed;
            let entering = speed.lt(L::zero());
            enter = L::select(entering, t.max(enter), enter);
            leave = L::select(entering, leave, t.min(leave));
        }
        Some((enter, leave, near & enter.le(leave)))
    }
}

impl<L: SimdFloat> AnalyticPrimitive<L> for ConvexPolyhedron<L::Scalar> {
    #[inline(always)]
    fn intersect(&self, ray: &Ray<L>) -> Option<(L, L::Mask)> {
        let (enter, leave, meets) = self.chord(ray)?;
        Some((L::select(enter.gt(L::zero()), enter, leave), meets))
    }

    /// Projects onto the face plane above which `point` has the largest signed height.
    #[inline(always)]
    fn surface(&self, point: Vec3<L>) -> SurfacePoint<L> {
        let from_center = point - Vec3::splat(self.center);
        let mut outside = L::from_f64(-L::MAX);
        let mut normal = Vec3::zero();
        for slab in &self.slabs {
            let n = Vec3::splat(slab.normal);
            let height = from_center.dot(n);
            let above = height - L::splat(slab.high);
            let below = L::splat(slab.low) - height;
            let upper = above.gt(below);
            let distance = L::select(upper, above, below);
            let nearer = distance.gt(outside);
            outside = L::select(nearer, distance, outside);
            normal = Vec3::select(nearer, Vec3::select(upper, n, -n), normal);
        }
        for face in &self.faces {
            let n = Vec3::splat(face.normal);
            let distance = from_center.dot(n) - L::splat(face.offset);
            let nearer = distance.gt(outside);
            outside = L::select(nearer, distance, outside);
            normal = Vec3::select(nearer, n, normal);
        }
        SurfacePoint {
            point: normal.mul_add(-outside, point),
            normal,
            max_coordinate: L::splat(self.reach),
        }
    }
}

impl<L: SimdFloat> SolidPrimitive<L> for ConvexPolyhedron<L::Scalar> {
    type Spans = Option<Span<L>>;

    fn spans(&self, ray: &Ray<L>, wanted: L::Mask) -> Option<Span<L>> {
        let (enter, leave, meets) = self.chord(ray)?;
        if (meets & wanted).none() {
            return None;
        }
        let from_center = ray.origin - Vec3::splat(self.center);
        // The entry is on the face whose plane is closest to it, among the faces that the line
        // crosses inwards. The exit is on the face whose plane is closest to it, among the faces
        // that the line crosses outwards.
        let mut best = (L::from_f64(-L::MAX), L::from_f64(-L::MAX));
        let mut cosines = (L::one(), L::one());
        let mut face = |normal: Vec3<L>, offset: L| {
            let speed = normal.dot(ray.direction);
            let height = from_center.dot(normal) - offset;
            let above = |t: L| speed.mul_add(t, height);
            let nearer = speed.lt(L::zero()) & above(enter).gt(best.0);
            best.0 = L::select(nearer, above(enter), best.0);
            cosines.0 = L::select(nearer, -speed, cosines.0);
            let nearer = speed.gt(L::zero()) & above(leave).gt(best.1);
            best.1 = L::select(nearer, above(leave), best.1);
            cosines.1 = L::select(nearer, speed, cosines.1);
        };
        for slab in &self.slabs {
            let normal = Vec3::splat(slab.normal);
            face(normal, L::splat(slab.high));
            face(-normal, -L::splat(slab.low));
        }
        for half_space in &self.faces {
            face(Vec3::splat(half_space.normal), L::splat(half_space.offset));
        }
        let (enter_cosine, leave_cosine) = cosines;
        Some(Span { enter, leave, enter_cosine, leave_cosine, meets })
    }
}
