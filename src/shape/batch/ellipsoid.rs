//! Images of the unit sphere under affine maps: the ray goes back to the unit sphere's space.

use super::span::{Span, Spans};
use super::sphere::{crossings, wanted_done};
use super::{Batch, Hit, Ray, Surface, reach};
use crate::lanes::{Lanes, Real, V3};
use crate::shape::form::Form;
use glam::DMat3;
use std::ops::Range;

/// One ellipsoid. Matrices by rows.
#[derive(Clone, Copy)]
struct Ellipsoid<S> {
    center: [S; 3],
    unit_from_scene: [[S; 3]; 3],
    scene_from_unit: [[S; 3]; 3],
    reach: S,
}

/// All ellipsoids of a scene.
pub struct Ellipsoids<L: Lanes> {
    items: Vec<Ellipsoid<L::Scalar>>,
}

/// The rows of a matrix, rounded.
pub(super) fn rows<S: Real>(m: DMat3) -> [[S; 3]; 3] {
    m.transpose().to_cols_array_2d().map(|row| row.map(S::of))
}

/// A matrix, given by rows, times a vector.
#[inline(always)]
pub(super) fn times<L: Lanes>(m: &[[L::Scalar; 3]; 3], v: V3<L>) -> V3<L> {
    V3::new(V3::splat(m[0]).dot(v), V3::splat(m[1]).dot(v), V3::splat(m[2]).dot(v))
}

impl<L: Lanes> Ellipsoids<L> {
    /// From forms that are all ellipsoids.
    pub fn new(forms: &[Form]) -> Self {
        let items = forms
            .iter()
            .filter_map(|form| match form {
                Form::Ellipsoid { scene_from_unit: m } => Some(Ellipsoid {
                    center: m.translation.to_array().map(L::Scalar::of),
                    unit_from_scene: rows(m.matrix3.inverse()),
                    scene_from_unit: rows(m.matrix3),
                    reach: L::Scalar::of(reach(form)),
                }),
                _ => None,
            })
            .collect();
        Self { items }
    }
}

/// Ends of the chord in the scene's distances, and where there is one.
#[inline(always)]
fn chord<L: Lanes>(e: &Ellipsoid<L::Scalar>, ray: &Ray<L>) -> Option<(L, L, L::Mask)> {
    let f = times(&e.unit_from_scene, ray.origin - V3::splat(e.center));
    let d = times(&e.unit_from_scene, ray.direction);
    let scale = L::one() / d.length2().sqrt();
    let (near, far, meets) = crossings(f, d * scale, L::one())?;
    Some((near * scale, far * scale, meets))
}

impl<L: Lanes> Batch<L> for Ellipsoids<L> {
    fn closest(&self, range: Range<usize>, base: u32, ray: &Ray<L>, hit: &mut Hit<L>) {
        for (item, e) in range.clone().zip(&self.items[range]) {
            if let Some((near, far, meets)) = chord(e, ray) {
                let t = L::select(near.gt(L::zero()), near, far);
                hit.narrow(meets, t, base + item as u32);
            }
        }
    }

    fn blocked(&self, range: Range<usize>, ray: &Ray<L>, limit: L, wanted: L::Mask) -> L::Mask {
        let mut blocked = L::mask(false);
        for e in &self.items[range] {
            if let Some((near, far, meets)) = chord(e, ray) {
                let t = L::select(near.gt(L::zero()), near, far);
                blocked = blocked | (meets & t.gt(L::zero()) & t.lt(limit));
                if wanted_done::<L>(wanted, blocked) {
                    break;
                }
            }
        }
        blocked
    }

    fn surface(&self, item: usize, point: V3<L>) -> Surface<L> {
        let e = &self.items[item];
        let center = V3::splat(e.center);
        let on_unit = times(&e.unit_from_scene, point - center).normalize();
        // The normal of the image is the inverse transpose times the normal: columns of the inverse.
        let m = &e.unit_from_scene;
        let normal =
            V3::splat(m[0]) * on_unit.x + V3::splat(m[1]) * on_unit.y + V3::splat(m[2]) * on_unit.z;
        Surface {
            point: times(&e.scene_from_unit, on_unit) + center,
            normal: normal.normalize(),
            reach: L::splat(e.reach),
        }
    }
}

impl<L: Lanes> Spans<L> for Ellipsoids<L> {
    fn span(&self, item: usize, ray: &Ray<L>) -> Option<Span<L>> {
        let e = &self.items[item];
        let (enter, leave, meets) = chord(e, ray)?;
        let cosine = |t: L| self.surface(item, ray.at(t)).normal.dot(ray.direction).abs();
        let (enter_cosine, leave_cosine) = (cosine(enter), cosine(leave));
        Some(Span { enter, leave, enter_cosine, leave_cosine, meets })
    }
}
