//! Flat shapes: parallelograms (rectangles, platforms) and infinite planes.

use super::span::{Span, Spans};
use super::sphere::wanted_done;
use super::{Batch, Hit, Ray, Surface, reach};
use crate::lanes::{Lanes, Real, V3};
use crate::shape::form::Form;
use std::ops::Range;

/// One parallelogram. A point p of its plane has the coordinates (p - corner) . dual, both in 0..1
/// inside.
#[derive(Clone, Copy)]
struct Parallelogram<S> {
    corner: [S; 3],
    normal: [S; 3],
    dual_u: [S; 3],
    dual_v: [S; 3],
    reach: S,
}

/// All parallelograms of a scene.
pub struct Parallelograms<L: Lanes> {
    items: Vec<Parallelogram<L::Scalar>>,
}

impl<L: Lanes> Parallelograms<L> {
    /// From forms that are all parallelograms.
    pub fn new(forms: &[Form]) -> Self {
        let items = forms
            .iter()
            .filter_map(|form| match form {
                Form::Parallelogram { corner, u, v } => {
                    let n = u.cross(*v);
                    let area2 = n.length_squared();
                    Some(Parallelogram {
                        corner: corner.to_array().map(L::Scalar::of),
                        normal: n.normalize().to_array().map(L::Scalar::of),
                        dual_u: (v.cross(n) / area2).to_array().map(L::Scalar::of),
                        dual_v: (n.cross(*u) / area2).to_array().map(L::Scalar::of),
                        reach: L::Scalar::of(reach(form)),
                    })
                }
                _ => None,
            })
            .collect();
        Self { items }
    }
}

/// Distance at which the ray crosses the parallelogram's plane, and where that is inside it.
#[inline(always)]
fn crossing<L: Lanes>(p: &Parallelogram<L::Scalar>, ray: &Ray<L>) -> (L, L::Mask) {
    let normal = V3::splat(p.normal);
    let from_corner = ray.origin - V3::splat(p.corner);
    // Parallel rays divide by zero: infinite or NaN distances fail every comparison below.
    let t = -from_corner.dot(normal) / ray.direction.dot(normal);
    let at = ray.direction.mul_add(t, from_corner);
    let a = at.dot(V3::splat(p.dual_u));
    let b = at.dot(V3::splat(p.dual_v));
    let inside = a.ge(L::zero()) & a.le(L::one()) & b.ge(L::zero()) & b.le(L::one());
    (t, inside)
}

impl<L: Lanes> Batch<L> for Parallelograms<L> {
    fn closest(&self, range: Range<usize>, base: u32, ray: &Ray<L>, hit: &mut Hit<L>) {
        for (item, p) in range.clone().zip(&self.items[range]) {
            let (t, inside) = crossing(p, ray);
            hit.narrow(inside, t, base + item as u32);
        }
    }

    fn blocked(&self, range: Range<usize>, ray: &Ray<L>, limit: L, wanted: L::Mask) -> L::Mask {
        let mut blocked = L::mask(false);
        for p in &self.items[range] {
            let (t, inside) = crossing(p, ray);
            blocked = blocked | (inside & t.gt(L::zero()) & t.lt(limit));
            if wanted_done::<L>(wanted, blocked) {
                break;
            }
        }
        blocked
    }

    fn surface(&self, item: usize, point: V3<L>) -> Surface<L> {
        let p = &self.items[item];
        let normal = V3::splat(p.normal);
        let above = (point - V3::splat(p.corner)).dot(normal);
        Surface { point: normal.mul_add(-above, point), normal, reach: L::splat(p.reach) }
    }
}

/// One infinite plane.
#[derive(Clone, Copy)]
struct Plane<S> {
    normal: [S; 3],
    offset: S,
}

/// All infinite planes of a scene.
pub struct Planes<L: Lanes> {
    items: Vec<Plane<L::Scalar>>,
}

impl<L: Lanes> Planes<L> {
    /// From forms that are all planes.
    pub fn new(forms: &[Form]) -> Self {
        let items = forms
            .iter()
            .filter_map(|form| match form {
                Form::Plane { normal, offset } => Some(Plane {
                    normal: normal.to_array().map(L::Scalar::of),
                    offset: L::Scalar::of(*offset),
                }),
                _ => None,
            })
            .collect();
        Self { items }
    }
}

impl<S: Real> Plane<S> {
    /// Distance at which the ray crosses the plane; infinite or NaN for a parallel ray.
    #[inline(always)]
    fn crossing<L: Lanes<Scalar = S>>(&self, ray: &Ray<L>) -> L {
        let normal = V3::splat(self.normal);
        (L::splat(self.offset) - ray.origin.dot(normal)) / ray.direction.dot(normal)
    }
}

impl<L: Lanes> Batch<L> for Planes<L> {
    fn closest(&self, range: Range<usize>, base: u32, ray: &Ray<L>, hit: &mut Hit<L>) {
        for (item, p) in range.clone().zip(&self.items[range]) {
            hit.narrow(L::mask(true), p.crossing(ray), base + item as u32);
        }
    }

    fn blocked(&self, range: Range<usize>, ray: &Ray<L>, limit: L, wanted: L::Mask) -> L::Mask {
        let mut blocked = L::mask(false);
        for p in &self.items[range] {
            let t = p.crossing(ray);
            blocked = blocked | (t.gt(L::zero()) & t.lt(limit));
            if wanted_done::<L>(wanted, blocked) {
                break;
            }
        }
        blocked
    }

    fn surface(&self, item: usize, point: V3<L>) -> Surface<L> {
        let p = &self.items[item];
        let normal = V3::splat(p.normal);
        let above = point.dot(normal) - L::splat(p.offset);
        Surface { point: normal.mul_add(-above, point), normal, reach: L::splat(p.offset).abs() }
    }
}

/// The half-spaces behind the planes.
impl<L: Lanes> Spans<L> for Planes<L> {
    fn span(&self, item: usize, ray: &Ray<L>) -> Option<Span<L>> {
        let plane = &self.items[item];
        let normal = V3::splat(plane.normal);
        let speed = ray.direction.dot(normal);
        let height = ray.origin.dot(normal) - L::splat(plane.offset);
        let (all, none) = (L::of(L::MAX), L::of(-L::MAX));
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
