//! Images of the unit sphere under affine maps: the ray goes back to the unit sphere's space.

use crate::bvh::Ray;
use crate::lanes::{Float, SimdFloat, Vec3};
use crate::primitive::batch::{Primitive, SurfacePoint, max_coordinate};
use crate::primitive::form::Form;
use crate::primitive::solid::{SolidPrimitive, Span};
use crate::primitive::sphere::intersections;
use glam::DMat3;

/// One ellipsoid. Matrices by rows.
#[derive(Clone, Copy)]
pub struct Ellipsoid<S> {
    center: [S; 3],
    unit_from_scene: [[S; 3]; 3],
    scene_from_unit: [[S; 3]; 3],
    reach: S,
}

/// The rows of a matrix, rounded.
pub(crate) fn rows<S: Float>(m: DMat3) -> [[S; 3]; 3] {
    m.transpose().to_cols_array_2d().map(|row| row.map(S::from_f64))
}

/// A matrix, given by rows, times a vector.
#[inline(always)]
pub(crate) fn times<L: SimdFloat>(m: &[[L::Scalar; 3]; 3], v: Vec3<L>) -> Vec3<L> {
    Vec3::new(Vec3::splat(m[0]).dot(v), Vec3::splat(m[1]).dot(v), Vec3::splat(m[2]).dot(v))
}

impl<S: Float> Ellipsoid<S> {
    /// `None`: the form is another.
    pub fn new(form: &Form) -> Option<Self> {
        let Form::Ellipsoid { scene_from_unit: m } = form else { return None };
        Some(Self {
            center: m.translation.to_array().map(S::from_f64),
            unit_from_scene: rows(m.matrix3.inverse()),
            scene_from_unit: rows(m.matrix3),
            reach: S::from_f64(max_coordinate(form)),
        })
    }
}

/// Ends of the chord in the scene's distances, and where there is one.
#[inline(always)]
fn chord<L: SimdFloat>(e: &Ellipsoid<L::Scalar>, ray: &Ray<L>) -> Option<(L, L, L::Mask)> {
    let f = times(&e.unit_from_scene, ray.origin - Vec3::splat(e.center));
    let d = times(&e.unit_from_scene, ray.direction);
    let scale = L::one() / d.length_squared().sqrt();
    let (near, far, meets) = intersections(f, d * scale, L::one())?;
    Some((near * scale, far * scale, meets))
}

impl<L: SimdFloat> Primitive<L> for Ellipsoid<L::Scalar> {
    #[inline(always)]
    fn intersect(&self, ray: &Ray<L>) -> Option<(L, L::Mask)> {
        let (near, far, meets) = chord(self, ray)?;
        Some((L::select(near.gt(L::zero()), near, far), meets))
    }

    #[inline(always)]
    fn surface(&self, point: Vec3<L>) -> SurfacePoint<L> {
        let center = Vec3::splat(self.center);
        let on_unit = times(&self.unit_from_scene, point - center).normalize();
        // The normal of the image is the inverse transpose times the normal: columns of the inverse.
        let m = &self.unit_from_scene;
        let normal = Vec3::splat(m[0]) * on_unit.x
            + Vec3::splat(m[1]) * on_unit.y
            + Vec3::splat(m[2]) * on_unit.z;
        SurfacePoint {
            point: times(&self.scene_from_unit, on_unit) + center,
            normal: normal.normalize(),
            max_coordinate: L::splat(self.reach),
        }
    }
}

impl<L: SimdFloat> SolidPrimitive<L> for Ellipsoid<L::Scalar> {
    fn span(&self, ray: &Ray<L>) -> Option<Span<L>> {
        let (enter, leave, meets) = chord(self, ray)?;
        let cosine = |t: L| self.surface(ray.at(t)).normal.dot(ray.direction).abs();
        let (enter_cosine, leave_cosine) = (cosine(enter), cosine(leave));
        Some(Span { enter, leave, enter_cosine, leave_cosine, meets })
    }
}
