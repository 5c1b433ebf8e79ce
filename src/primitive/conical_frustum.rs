//! Tapered cylinders: cylinders, cones and what lies between, under any affine map. The ray goes back
//! to the canonical solid's space, with the origin in the middle of its axis:
//!   x^2 + y^2 <= (middle + slope z)^2, |z| <= 1/2

use crate::bvh::Ray;
use crate::lanes::{Float, Mask, SimdFloat, Vec3};
use crate::primitive::batch::{Primitive, SurfacePoint, max_coordinate};
use crate::primitive::ellipsoid::{rows, times};
use crate::primitive::form::Form;
use crate::primitive::solid::{SolidPrimitive, Span};
use glam::DVec3;

/// One solid. Matrices by rows.
#[derive(Clone, Copy)]
pub struct ConicalFrustum<S> {
    /// Image of the middle of the axis.
    center: [S; 3],
    unit_from_scene: [[S; 3]; 3],
    /// Change of the radius along z, from -1 (a cone) to 0 (a cylinder).
    slope: S,
    /// Radius at the middle of the axis.
    mid_radius: S,
    /// Unit normal of the plane z = 1/2, outward.
    cap_normal: [S; 3],
    /// Distance of the planes of both ends.
    height: S,
    reach: S,
}

/// Squared radius of the ball about the middle of the axis that holds the canonical solid, and a
/// little more: what is cut off by rounding must not be cut off for good.
const AROUND2: f64 = 1.26;

impl<S: Float> ConicalFrustum<S> {
    /// `None`: the form is another.
    pub fn new(form: &Form) -> Option<Self> {
        let Form::ConicalFrustum { scene_from_unit: m, top_radius } = form else { return None };
        let inverse = m.matrix3.inverse();
        let up = inverse.transpose() * DVec3::Z;
        let center = m.transform_point3(DVec3::new(0.0, 0.0, 0.5));
        Some(Self {
            center: center.to_array().map(S::from_f64),
            unit_from_scene: rows(inverse),
            slope: S::from_f64(top_radius - 1.0),
            mid_radius: S::from_f64(0.5 * (1.0 + top_radius)),
            cap_normal: up.normalize().to_array().map(S::from_f64),
            height: S::from_f64(up.length().recip()),
            reach: S::from_f64(max_coordinate(form)),
        })
    }
}

/// Where a line crosses a solid.
struct Chord<L: SimdFloat> {
    /// The point of the line nearest to the middle of the axis, and its direction, of unit length in
    /// the canonical space.
    point: Vec3<L>,
    direction: Vec3<L>,
    /// The scene's distance of `point`, and of a step of length 1.
    start: L,
    scale: L,
    /// Steps from `point` to both ends.
    enter: L,
    leave: L,
    /// Where an end lies on the side, not on a flat end.
    enters_side: L::Mask,
    leaves_side: L::Mask,
    meets: L::Mask,
}

impl<L: SimdFloat> Chord<L> {
    fn distances(&self) -> (L, L) {
        let distance = |t: L| self.start + t * self.scale;
        (distance(self.enter), distance(self.leave))
    }
}

/// The line's steps are counted from its point nearest to the solid's middle, so that a distant origin
/// costs no digits. With p the point, d the direction, r the radius at p and k the slope, the side is
/// crossed where a t^2 + 2 b t + c = 0. Its discriminant is formed as |r d' - k d_z p'|^2 - (p' x d')^2
/// (primes: without z), which for a cylinder compares the radius with the line's distance from the axis
/// and does not cancel as b^2 - a c does; its roots as q / a and c / q, so that a = 0, a line parallel
/// to a generator, leaves one of them finite.
#[inline(always)]
fn interval<L: SimdFloat>(s: &ConicalFrustum<L::Scalar>, ray: &Ray<L>) -> Option<Chord<L>> {
    let (zero, half) = (L::zero(), L::from_f64(0.5));
    let f = times(&s.unit_from_scene, ray.origin - Vec3::splat(s.center));
    let d = times(&s.unit_from_scene, ray.direction);
    let scale = L::one() / d.length_squared().sqrt();
    let d = d * scale;
    // Twice: what the first step rounds off along the direction, the second takes away.
    let back = -f.dot(d);
    let p = d.mul_add(back, f);
    let again = -p.dot(d);
    let p = d.mul_add(again, p);
    let near = p.length_squared().le(L::from_f64(AROUND2));
    if near.none() {
        return None;
    }
    let k = L::splat(s.slope);
    let r = k.mul_add(p.z, L::splat(s.mid_radius));
    let (kd, kr) = (k * d.z, k * d.z * r);
    let a = d.x.mul_add(d.x, d.y.mul_add(d.y, -(kd * kd)));
    let b = p.x.mul_add(d.x, p.y.mul_add(d.y, -kr));
    let c = p.x.mul_add(p.x, p.y.mul_add(p.y, -(r * r)));
    let ex = r.mul_add(d.x, -(kd * p.x));
    let ey = r.mul_add(d.y, -(kd * p.y));
    let cross = p.x.mul_add(d.y, -(p.y * d.x));
    let discriminant = ex.mul_add(ex, ey.mul_add(ey, -(cross * cross)));
    // Steeper than the side: the line crosses both nappes of the cone, for certain.
    let steep = a.lt(zero);
    let root = discriminant.max(zero).sqrt();
    let q = -(b + root.copysign(b));
    let turns = q.abs().gt(zero);
    let t0 = L::select(turns, q / a, zero);
    let t1 = L::select(turns, c / q, zero);
    let (low, high) = (t0.min(t1), t0.max(t1));
    // A line along a generator or the axis that touches nothing: inside everywhere or nowhere.
    let level = L::mask(true).and_not(turns) & a.abs().le(zero);
    let (all, none) = (L::from_f64(L::MAX), L::from_f64(-L::MAX));
    // Of the two nappes the one where the radius is positive, on which the line ends or begins.
    let widens = kd.gt(zero);
    let enter_side = L::select(steep, L::select(widens, high, none), low);
    let leave_side = L::select(steep, L::select(widens, all, low), high);
    let enter_side = L::select(level, none, enter_side);
    let leave_side = L::select(level, all, leave_side);
    let crosses = (steep | discriminant.ge(zero)).and_not(level) | (level & c.le(zero));
    // Between the planes of the ends; a parallel line is within or without by its height.
    let tiny = L::from_f64(1e-30);
    let inverse = L::one() / d.z.abs().max(tiny).copysign(d.z);
    let (z0, z1) = ((-half - p.z) * inverse, (half - p.z) * inverse);
    let (enter_ends, leave_ends) = (z0.min(z1), z0.max(z1));
    let (enter, leave) = (enter_side.max(enter_ends), leave_side.min(leave_ends));
    Some(Chord {
        point: p,
        direction: d,
        start: (back + again) * scale,
        scale,
        enter,
        leave,
        enters_side: enter_side.ge(enter_ends),
        leaves_side: leave_side.le(leave_ends),
        meets: near & crosses & enter.le(leave),
    })
}

/// The side's outward normal at the canonical point (x, y, z), in the scene's space, not normalised.
#[inline(always)]
fn side_normal<L: SimdFloat>(s: &ConicalFrustum<L::Scalar>, x: L, y: L) -> (Vec3<L>, L) {
    let rho = x.mul_add(x, y * y).sqrt();
    // At the apex the axis stands for the normals that meet there.
    let inverse = L::select(rho.gt(L::zero()), L::one() / rho, L::zero());
    let (nx, ny, nz) = (x * inverse, y * inverse, -L::splat(s.slope));
    // The inverse transpose times the normal: columns of the inverse.
    let m = &s.unit_from_scene;
    (Vec3::splat(m[0]) * nx + Vec3::splat(m[1]) * ny + Vec3::splat(m[2]) * nz, rho)
}

impl<L: SimdFloat> Primitive<L> for ConicalFrustum<L::Scalar> {
    #[inline(always)]
    fn intersect(&self, ray: &Ray<L>) -> Option<(L, L::Mask)> {
        let interval = interval(self, ray)?;
        let (enter, leave) = interval.distances();
        Some((L::select(enter.gt(L::zero()), enter, leave), interval.meets))
    }

    /// Side, base or cap: the one that is nearest, outside by most or inside by least.
    #[inline(always)]
    fn surface(&self, point: Vec3<L>) -> SurfacePoint<L> {
        let s = self;
        let p = times(&s.unit_from_scene, point - Vec3::splat(s.center));
        let (side, rho) = side_normal(s, p.x, p.y);
        let steepness = L::one() / side.length_squared().sqrt();
        let radius = L::splat(s.slope).mul_add(p.z, L::splat(s.mid_radius));
        let beside = (rho - radius) * steepness;
        let above = (p.z.abs() - L::from_f64(0.5)) * L::splat(s.height);
        let cap = Vec3::splat(s.cap_normal);
        let cap = Vec3::select(p.z.lt(L::zero()), -cap, cap);
        let on_side = beside.ge(above);
        let normal = Vec3::select(on_side, side * steepness, cap);
        let outside = L::select(on_side, beside, above);
        SurfacePoint {
            point: normal.mul_add(-outside, point),
            normal,
            max_coordinate: L::splat(s.reach),
        }
    }
}

impl<L: SimdFloat> SolidPrimitive<L> for ConicalFrustum<L::Scalar> {
    fn span(&self, ray: &Ray<L>) -> Option<Span<L>> {
        let s = self;
        let interval = interval(s, ray)?;
        let (enter, leave) = interval.distances();
        let cap = Vec3::splat(s.cap_normal).dot(ray.direction).abs();
        let cosine = |on_side: L::Mask, t: L| {
            let at = interval.direction.mul_add(t, interval.point);
            let (normal, _) = side_normal(s, at.x, at.y);
            let side = (normal.dot(ray.direction) / normal.length_squared().sqrt()).abs();
            L::select(on_side, side, cap)
        };
        Some(Span {
            enter,
            leave,
            enter_cosine: cosine(interval.enters_side, interval.enter),
            leave_cosine: cosine(interval.leaves_side, interval.leave),
            meets: interval.meets,
        })
    }
}
