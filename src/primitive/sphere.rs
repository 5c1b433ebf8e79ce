//! Spheres.

use crate::bvh::Ray;
use crate::lanes::{Float, Mask, SimdFloat, Vec3};
use crate::primitive::batch::{Primitive, SurfacePoint, max_coordinate};
use crate::primitive::form::Form;
use crate::primitive::solid::{SolidPrimitive, Span};

/// One sphere, rounded to the precision of the kernel.
#[derive(Clone, Copy)]
pub struct Sphere<S> {
    center: [S; 3],
    radius: S,
    radius2: S,
    reach: S,
}

impl<S: Float> Sphere<S> {
    /// `None`: the form is another.
    pub fn new(form: &Form) -> Option<Self> {
        let Form::Sphere { center, radius } = form else { return None };
        Some(Self {
            center: center.to_array().map(S::from_f64),
            radius: S::from_f64(*radius),
            radius2: S::from_f64(radius * radius),
            reach: S::from_f64(max_coordinate(form)),
        })
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
    // q = 0 only for a line that starts at the centre of its own touching point: both ends are 0.
    let other = c / q;
    let other = L::select(q.abs().gt(L::zero()), other, L::zero());
    let behind = b.lt(L::zero());
    Some((L::select(behind, q, other), L::select(behind, other, q), meets))
}

impl<L: SimdFloat> Primitive<L> for Sphere<L::Scalar> {
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
    fn span(&self, ray: &Ray<L>) -> Option<Span<L>> {
        let f = ray.origin - Vec3::splat(self.center);
        let (enter, leave, meets) = intersections(f, ray.direction, L::splat(self.radius2))?;
        // Half the chord over the radius.
        let cosine = (leave - enter) * (L::from_f64(0.5) / L::splat(self.radius));
        Some(Span { enter, leave, enter_cosine: cosine, leave_cosine: cosine, meets })
    }
}
