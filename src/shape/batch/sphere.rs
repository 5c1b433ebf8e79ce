//! Spheres.

use super::span::{Span, Spans};
use super::{Batch, Hit, Ray, Surface, reach};
use crate::lanes::{Lanes, Mask, Real, V3};
use crate::shape::form::Form;
use std::ops::Range;

/// One sphere, rounded to the precision of the kernel.
#[derive(Clone, Copy)]
struct Sphere<S> {
    center: [S; 3],
    radius: S,
    radius2: S,
    reach: S,
}

/// All spheres of a scene.
pub struct Spheres<L: Lanes> {
    items: Vec<Sphere<L::Scalar>>,
}

impl<L: Lanes> Spheres<L> {
    /// From forms that are all spheres.
    pub fn new(forms: &[Form]) -> Self {
        let items = forms
            .iter()
            .filter_map(|form| match form {
                Form::Sphere { center, radius } => Some(Sphere {
                    center: center.to_array().map(L::Scalar::of),
                    radius: L::Scalar::of(*radius),
                    radius2: L::Scalar::of(radius * radius),
                    reach: L::Scalar::of(reach(form)),
                }),
                _ => None,
            })
            .collect();
        Self { items }
    }
}

/// Distances at which a line enters and leaves a sphere about the origin of `f`, and where it does.
///
/// `f` is the line's origin seen from the centre, `d` its unit direction. The discriminant is formed
/// from the vector f - (f.d) d, whose length is the line's distance from the centre, and the root
/// nearer to the origin from the product of both, so that neither cancels for small or distant
/// spheres (Haines, Günther, Akenine-Möller 2019, *Precision Improvements for Ray/Sphere
/// Intersection*, Ray Tracing Gems, chapter 7).
#[inline(always)]
pub fn crossings<L: Lanes>(f: V3<L>, d: V3<L>, radius2: L) -> Option<(L, L, L::Mask)> {
    let b = -f.dot(d);
    let across = d.mul_add(b, f);
    let discriminant = radius2 - across.length2();
    let meets = discriminant.ge(L::zero());
    if meets.none() {
        return None;
    }
    let root = discriminant.max(L::zero()).sqrt();
    let q = b + root.copysign(b);
    let c = f.length2() - radius2;
    // q = 0 only for a line that starts at the centre of its own touching point: both ends are 0.
    let other = c / q;
    let other = L::select(q.abs().gt(L::zero()), other, L::zero());
    let behind = b.lt(L::zero());
    Some((L::select(behind, q, other), L::select(behind, other, q), meets))
}

impl<L: Lanes> Batch<L> for Spheres<L> {
    fn closest(&self, range: Range<usize>, base: u32, ray: &Ray<L>, hit: &mut Hit<L>) {
        for (item, s) in range.clone().zip(&self.items[range]) {
            let f = ray.origin - V3::splat(s.center);
            if let Some((near, far, meets)) = crossings(f, ray.direction, L::splat(s.radius2)) {
                let t = L::select(near.gt(L::zero()), near, far);
                hit.narrow(meets, t, base + item as u32);
            }
        }
    }

    fn blocked(&self, range: Range<usize>, ray: &Ray<L>, limit: L, wanted: L::Mask) -> L::Mask {
        let mut blocked = L::mask(false);
        for s in &self.items[range] {
            let f = ray.origin - V3::splat(s.center);
            if let Some((near, far, meets)) = crossings(f, ray.direction, L::splat(s.radius2)) {
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
        let s = &self.items[item];
        let center = V3::splat(s.center);
        let normal = (point - center).normalize();
        let point = normal.mul_add(L::splat(s.radius), center);
        Surface { point, normal, reach: L::splat(s.reach) }
    }
}

impl<L: Lanes> Spans<L> for Spheres<L> {
    fn span(&self, item: usize, ray: &Ray<L>) -> Option<Span<L>> {
        let s = &self.items[item];
        let f = ray.origin - V3::splat(s.center);
        let (enter, leave, meets) = crossings(f, ray.direction, L::splat(s.radius2))?;
        // Half the chord over the radius.
        let cosine = (leave - enter) * (L::of(0.5) / L::splat(s.radius));
        Some(Span { enter, leave, enter_cosine: cosine, leave_cosine: cosine, meets })
    }
}

/// No lane of `wanted` is left open.
#[inline(always)]
pub fn wanted_done<L: Lanes>(wanted: L::Mask, blocked: L::Mask) -> bool {
    wanted.and_not(blocked).none()
}
