//! Images of the unit sphere under affine maps: the ray goes back to the unit sphere's space.

use super::sphere::crossings;
use super::{Item, Ray, Surface, reach};
use crate::lanes::{Lanes, Real, V3};
use crate::shape::form::Form;
use glam::DMat3;

/// One ellipsoid. Matrices by rows.
#[derive(Clone, Copy)]
pub struct Ellipsoid<S> {
    center: [S; 3],
    unit_from_scene: [[S; 3]; 3],
    scene_from_unit: [[S; 3]; 3],
    reach: S,
}

fn rows<S: Real>(m: DMat3) -> [[S; 3]; 3] {
    m.transpose().to_cols_array_2d().map(|row| row.map(S::of))
}

#[inline(always)]
fn times<L: Lanes>(m: &[[L::Scalar; 3]; 3], v: V3<L>) -> V3<L> {
    V3::new(V3::splat(m[0]).dot(v), V3::splat(m[1]).dot(v), V3::splat(m[2]).dot(v))
}

impl<S: Real> Ellipsoid<S> {
    /// `None`: the form is another.
    pub fn new(form: &Form) -> Option<Self> {
        let Form::Ellipsoid { scene_from_unit: m } = form else { return None };
        Some(Self {
            center: m.translation.to_array().map(S::of),
            unit_from_scene: rows(m.matrix3.inverse()),
            scene_from_unit: rows(m.matrix3),
            reach: S::of(reach(form)),
        })
    }
}

impl<L: Lanes> Item<L> for Ellipsoid<L::Scalar> {
    #[inline(always)]
    fn crossing(&self, ray: &Ray<L>) -> Option<(L, L::Mask)> {
        let f = times(&self.unit_from_scene, ray.origin - V3::splat(self.center));
        let d = times(&self.unit_from_scene, ray.direction);
        let scale = L::one() / d.length2().sqrt();
        let (near, far, meets) = crossings(f, d * scale, L::one())?;
        // Back to the scene's distances.
        let (near, far) = (near * scale, far * scale);
        Some((L::select(near.gt(L::zero()), near, far), meets))
    }

    #[inline(always)]
    fn surface(&self, point: V3<L>) -> Surface<L> {
        let center = V3::splat(self.center);
        let on_unit = times(&self.unit_from_scene, point - center).normalize();
        // The normal of the image is the inverse transpose times the normal: columns of the inverse.
        let m = &self.unit_from_scene;
        let normal =
            V3::splat(m[0]) * on_unit.x + V3::splat(m[1]) * on_unit.y + V3::splat(m[2]) * on_unit.z;
        Surface {
            point: times(&self.scene_from_unit, on_unit) + center,
            normal: normal.normalize(),
            reach: L::splat(self.reach),
        }
    }
}
