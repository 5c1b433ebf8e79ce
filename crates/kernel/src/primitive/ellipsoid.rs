//! Ellipsoids. Rays are transformed into the space of the unit sphere.

use crate::bvh::Ray;
use crate::lanes::{Float, Mask, SimdFloat, Vec3};
use crate::primitive::bounding::BoundingSphere;
use crate::primitive::canonical::{
    Bounds, CanonicalShape, Projection, box_distance, frobenius_norm, normals_of_solid, rows,
};
use crate::primitive::compiled::{AnalyticPrimitive, SurfacePoint};
use crate::primitive::csg::{SolidPrimitive, Span};
use crate::primitive::sphere::intersections;
use crate::primitive::unit_space::{UnitSpace, rounded_rows, times};
use glam::{DAffine3, DMat3, DVec3};

/// Image of the unit sphere at the origin under an invertible affine map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EllipsoidForm {
    /// Map from the space of the unit sphere to the scene.
    pub scene_from_unit: DAffine3,
}

impl EllipsoidForm {
    pub(super) fn transformed(self, map: &DAffine3) -> Self {
        Self { scene_from_unit: *map * self.scene_from_unit }
    }
}

impl CanonicalShape for EllipsoidForm {
    fn bounds(&self) -> Option<Bounds> {
        // The half-widths of the box are the lengths of the matrix's rows.
        let m = &self.scene_from_unit;
        let half = DVec3::from(rows(&m.matrix3).map(DVec3::length));
        Some((m.translation - half, m.translation + half))
    }

    fn bounding_sphere(&self) -> BoundingSphere {
        let DAffine3 { matrix3, translation } = &self.scene_from_unit;
        // The norm is at least as large as the largest half-axis (singular value).
        BoundingSphere { center: *translation, radius: frobenius_norm(matrix3) }
    }

    fn oriented_box(&self) -> Option<(DAffine3, Bounds)> {
        Some((self.scene_from_unit, (DVec3::NEG_ONE, DVec3::ONE)))
    }

    fn thickness(&self) -> f64 {
        self.bounds().map_or(f64::INFINITY, |(low, high)| (high - low).min_element())
    }

    fn clearance(&self, point: DVec3) -> Option<f64> {
        let away = box_distance(self.bounds()?, point);
        Some(if away > 0.0 { away } else { surface_distance(&self.scene_from_unit, point) })
    }

    fn normals_at(&self, point: DVec3, slack: f64) -> Vec<Vec<DVec3>> {
        let unit_from_scene = self.scene_from_unit.inverse();
        let on_unit = unit_from_scene.transform_point3(point);
        let distance = on_unit.length();
        let steepness = unit_from_scene.matrix3.transpose() * (on_unit / distance);
        let height = (distance - 1.0) / steepness.length();
        normals_of_solid(vec![(height, steepness.normalize())], slack)
    }

    fn default_mapping(&self) -> Projection {
        Projection::Spherical
    }
}

/// Returns the distance between `point` and the surface of an ellipsoid.
///
/// M is the linear part of the map, Q is (M M^T)^-1, and p is the point relative to the centre. The
/// surface is q^T Q q = 1. Its point closest to p is q = (I + l Q)^-1 p, where I + l Q is positive
/// definite. Only one such l puts q on the surface. Bisection finds it, because q^T Q q decreases
/// with l (Eberly 2013, *Distance from a Point to an Ellipse, an Ellipsoid, or a Hyperellipsoid*).
fn surface_distance(scene_from_unit: &DAffine3, point: DVec3) -> f64 {
    let inverse = scene_from_unit.matrix3.inverse();
    let q = inverse.transpose() * inverse;
    let size = frobenius_norm(&q);
    // The offset selects one of several closest points if `point` is the centre or on an axis.
    let aside = DVec3::new(0.6, 0.5, 0.7) * (1e-8 / size.sqrt());
    let p = point - scene_from_unit.translation + aside;
    // The smallest half-axis is at least 1 / sqrt(size) and at most 3^(1/4) times this length.
    let (mut low, mut high) = (-1.8 / size, 0.25 * p.length_squared() + 1.0 / size);
    let mut nearest = p;
    for _ in 0..160 {
        let middle = 0.5 * (low + high);
        let matrix = DMat3::IDENTITY + q * middle;
        let [x, y, _] = [matrix.x_axis, matrix.y_axis, matrix.z_axis];
        let definite = x.x > 0.0 && x.x * y.y - x.y * y.x > 0.0 && matrix.determinant() > 0.0;
        if definite {
            nearest = matrix.inverse() * p;
        }
        if !definite || nearest.dot(q * nearest) > 1.0 {
            low = middle;
        } else {
            high = middle;
        }
    }
    nearest.distance(p)
}

/// Ellipsoid compiled for ray intersection. Matrices are stored by rows.
#[derive(Clone, Copy)]
pub struct Ellipsoid<S> {
    unit_space: UnitSpace<S>,
    scene_from_unit: [[S; 3]; 3],
    reach: S,
}

impl<S: Float> Ellipsoid<S> {
    pub fn new(form: &EllipsoidForm) -> Self {
        let DAffine3 { matrix3, translation } = form.scene_from_unit;
        Self {
            unit_space: UnitSpace::new(translation, matrix3),
            scene_from_unit: rounded_rows(matrix3),
            reach: S::from_f64(form.max_coordinate()),
        }
    }
}

/// Returns the distances at which each ray's line enters and leaves the ellipsoid, and the lanes
/// whose line hits it; `None` if no line hits it.
#[inline(always)]
fn chord<L: SimdFloat>(e: &Ellipsoid<L::Scalar>, ray: &Ray<L>) -> Option<(L, L, L::Mask)> {
    let Ray { origin: f, direction: d } = e.unit_space.ray(ray);
    let scale = L::one() / d.length_squared().sqrt();
    let (near, far, meets) = intersections(f, d * scale, L::one())?;
    Some((near * scale, far * scale, meets))
}

impl<L: SimdFloat> AnalyticPrimitive<L> for Ellipsoid<L::Scalar> {
    #[inline(always)]
    fn intersect(&self, ray: &Ray<L>) -> Option<(L, L::Mask)> {
        let (near, far, meets) = chord(self, ray)?;
        Some((L::select(near.gt(L::zero()), near, far), meets))
    }

    #[inline(always)]
    fn surface(&self, point: Vec3<L>) -> SurfacePoint<L> {
        let on_unit = self.unit_space.point(point).normalize();
        SurfacePoint {
            point: times(&self.scene_from_unit, on_unit) + Vec3::splat(self.unit_space.center),
            normal: self.unit_space.scene_normal(on_unit).normalize(),
            max_coordinate: L::splat(self.reach),
        }
    }
}

impl<L: SimdFloat> SolidPrimitive<L> for Ellipsoid<L::Scalar> {
    type Spans = Option<Span<L>>;

    fn spans(&self, ray: &Ray<L>, wanted: L::Mask) -> Option<Span<L>> {
        let (enter, leave, meets) = chord(self, ray)?;
        if (meets & wanted).none() {
            return None;
        }
        let cosine = |t: L| self.surface(ray.at(t)).normal.dot(ray.direction).abs();
        let (enter_cosine, leave_cosine) = (cosine(enter), cosine(leave));
        Some(Span { enter, leave, enter_cosine, leave_cosine, meets })
    }
}
