//! Conical frusta: tapered cylinders, including cylinders and cones. Rays are transformed into the
//! space of the canonical solid x^2 + y^2 <= (m + k z)^2, |z| <= 1/2. Its origin is the middle of
//! the axis, m is the radius there, and k is the slope.

use crate::bvh::Ray;
use crate::lanes::{Float, Mask, SimdFloat, Vec3};
use crate::primitive::canonical::{
    Bounds, CanonicalShape, Projection, bounds_of_points, box_distance, normals_of_solid, rows,
    segment_distance,
};
use crate::primitive::compiled::{AnalyticPrimitive, SurfacePoint};
use crate::primitive::csg::{SolidPrimitive, Span};
use crate::primitive::form::Form;
use crate::primitive::unit_space::{UnitLine, UnitSpace};
use glam::{DAffine3, DMat3, DVec3};
use std::f64::consts::TAU;

/// Image of the solid x^2 + y^2 <= (1 + (top_radius - 1) z)^2, 0 <= z <= 1 under an invertible
/// affine map. [`Form::conical_frustum`] also accepts a top that is wider than the base.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ConicalFrustumForm {
    /// Map from the space of this solid to the scene.
    pub scene_from_unit: DAffine3,
    /// Radius at z = 1 divided by the radius at z = 0: from 0 (a cone) to 1 (a cylinder).
    pub top_radius: f64,
}

impl Form {
    /// Creates the image of the solid x^2 + y^2 <= (1 + (s - 1) z)^2, 0 <= z <= 1 under
    /// `scene_from_canonical`. `s` is the radius at z = 1, at least 0; the radius at z = 0 is 1.
    pub fn conical_frustum(scene_from_canonical: DAffine3, s: f64) -> Self {
        let (scene_from_unit, top_radius) = if s <= 1.0 {
            (scene_from_canonical, s)
        } else {
            // The frustum is rotated upside down: the wider end is the base.
            let linear = DMat3::from_diagonal(DVec3::new(s, s, -1.0));
            let flip = DAffine3::from_mat3_translation(linear, DVec3::Z);
            (scene_from_canonical * flip, 1.0 / s)
        };
        ConicalFrustumForm { scene_from_unit, top_radius }.into()
    }
}

/// Number of normals that approximate the circle of normals at the tip of a cone.
pub const AROUND_TIP: u32 = 64;

impl ConicalFrustumForm {
    pub(super) fn transformed(self, map: &DAffine3) -> Self {
        Self { scene_from_unit: *map * self.scene_from_unit, ..self }
    }
}

impl CanonicalShape for ConicalFrustumForm {
    fn bounds(&self) -> Option<Bounds> {
        // The first two columns of the matrix map the unit disc to the base. The lengths of their
        // rows are the half-widths of the base's bounding box.
        let m = &self.scene_from_unit;
        let half = DVec3::from(rows(&m.matrix3).map(|row| row.truncate().length()));
        let (base, cap) = (m.translation, m.translation + m.matrix3.z_axis);
        let narrow = half * self.top_radius;
        bounds_of_points(&[base - half, base + half, cap - narrow, cap + narrow])
    }

    fn oriented_box(&self) -> Option<(DAffine3, Bounds)> {
        Some((self.scene_from_unit, (DVec3::new(-1.0, -1.0, 0.0), DVec3::ONE)))
    }

    fn thickness(&self) -> f64 {
        // Smallest distance in the scene between opposite faces of the box around the canonical
        // solid. In canonical space the box has the size 2 by 2 by 1.
        let [x, y, z] = rows(&self.scene_from_unit.matrix3.inverse()).map(DVec3::length);
        (2.0 / x.max(y)).min(z.recip())
    }

    fn clearance(&self, point: DVec3) -> Option<f64> {
        let away = box_distance(self.bounds()?, point);
        let inside = || surface_distance(&self.scene_from_unit, self.top_radius, point);
        Some(if away > 0.0 { away } else { inside() })
    }

    fn normals_at(&self, point: DVec3, slack: f64) -> Vec<Vec<DVec3>> {
        let top = self.top_radius;
        let unit_from_scene = self.scene_from_unit.inverse();
        let normal_of = |n: DVec3| unit_from_scene.matrix3.transpose() * n;
        let p = unit_from_scene.transform_point3(point);
        let (rho, slope) = (p.x.hypot(p.y), top - 1.0);
        let up = normal_of(DVec3::Z);
        let (height, up) = (up.length().recip(), up.normalize());
        let mut sides = vec![(-p.z * height, -up)];
        if top > 0.0 {
            sides.push(((p.z - 1.0) * height, up));
        }
        let mut side = |out: DVec3| {
            let normal = normal_of(DVec3::new(out.x, out.y, -slope));
            let beside = (rho - (1.0 + slope * p.z)) / normal.length();
            sides.push((beside, normal.normalize()));
        };
        let across = normal_of(DVec3::new(p.x, p.y, 0.0) / rho).length();
        if rho > 2.0 * slack * across {
            side(DVec3::new(p.x / rho, p.y / rho, 0.0));
        } else {
            for i in 0..AROUND_TIP {
                let (sin, cos) = (TAU * f64::from(i) / f64::from(AROUND_TIP)).sin_cos();
                side(DVec3::new(cos, sin, 0.0));
            }
        }
        normals_of_solid(sides, slack)
    }

    fn default_mapping(&self) -> Projection {
        Projection::Cylindrical
    }
}

/// Returns the distance between `point` and the surface of a conical frustum. `top` is the radius
/// of the cap. In each half-plane through the axis, the outline of the surface has three segments:
/// from the middle of the base to its rim, on to the rim of the cap, and to the middle of the cap.
fn surface_distance(scene_from_unit: &DAffine3, top: f64, point: DVec3) -> f64 {
    const ANGLES: usize = 64;
    let place = |x, y, z| scene_from_unit.transform_point3(DVec3::new(x, y, z));
    let (base, cap) = (place(0.0, 0.0, 0.0), place(0.0, 0.0, 1.0));
    let outline_distance = |angle: f64| {
        let (sin, cos) = angle.sin_cos();
        let (low, high) = (place(cos, sin, 0.0), place(top * cos, top * sin, 1.0));
        let sides = [[base, low], [low, high], [high, cap]];
        sides.map(|side| segment_distance(side, point)).into_iter().fold(f64::INFINITY, f64::min)
    };
    let step = TAU / ANGLES as f64;
    let sampled: Vec<f64> = (0..ANGLES).map(|i| outline_distance(i as f64 * step)).collect();
    let mut least = f64::INFINITY;
    for i in 0..ANGLES {
        let beside = sampled[(i + 1) % ANGLES].min(sampled[(i + ANGLES - 1) % ANGLES]);
        if sampled[i] > beside {
            continue;
        }
        // The minimum is between the angles of the neighbouring samples.
        let (mut low, mut high) = ((i as f64 - 1.0) * step, (i as f64 + 1.0) * step);
        for _ in 0..80 {
            let (a, b) = (low + (high - low) / 3.0, high - (high - low) / 3.0);
            if outline_distance(a) < outline_distance(b) { high = b } else { low = a }
        }
        least = least.min(sampled[i]).min(outline_distance(0.5 * (low + high)));
    }
    least
}

/// Conical frustum compiled for ray intersection.
#[derive(Clone, Copy)]
pub struct ConicalFrustum<S> {
    /// Canonical space, whose origin is the middle of the axis.
    unit_space: UnitSpace<S>,
    /// Slope k, from -1 (a cone) to 0 (a cylinder).
    slope: S,
    /// Radius m at the middle of the axis.
    mid_radius: S,
    /// Outward unit normal, in the scene, of the cap at z = 1/2.
    cap_normal: [S; 3],
    /// Distance in the scene between the planes of the base and the cap.
    height: S,
    reach: S,
}

/// Squared radius, in canonical space, of a sphere around the middle of the axis that contains the
/// frustum: 1 + 1/4 for a rim of radius 1 at the height 1/2, with a margin for rounding errors.
const AROUND2: f64 = 1.26;

impl<S: Float> ConicalFrustum<S> {
    pub fn new(form: &ConicalFrustumForm) -> Self {
        let ConicalFrustumForm { scene_from_unit: m, top_radius } = form;
        let up = m.matrix3.inverse().transpose() * DVec3::Z;
        let center = m.transform_point3(DVec3::new(0.0, 0.0, 0.5));
        Self {
            unit_space: UnitSpace::new(center, m.matrix3),
            slope: S::from_f64(top_radius - 1.0),
            mid_radius: S::from_f64(0.5 * (1.0 + top_radius)),
            cap_normal: up.normalize().to_array().map(S::from_f64),
            height: S::from_f64(up.length().recip()),
            reach: S::from_f64(form.max_coordinate()),
        }
    }
}

/// Segment of a ray's line inside a frustum.
struct Chord<L: SimdFloat> {
    line: UnitLine<L>,
    /// Position of the entry on the line.
    enter: L,
    /// Position of the exit on the line.
    leave: L,
    /// Lanes whose ray enters through the lateral surface, not through base or cap.
    enters_side: L::Mask,
    leaves_side: L::Mask,
    meets: L::Mask,
}

impl<L: SimdFloat> Chord<L> {
    /// Returns the distances of entry and exit in the scene.
    fn distances(&self) -> (L, L) {
        let UnitLine { start, scale, .. } = self.line;
        let distance = |t: L| t * scale - start * scale;
        (distance(self.enter), distance(self.leave))
    }
}

/// Returns the chord of each ray's line; `None` if no line hits the frustum.
#[inline(always)]
fn chord<L: SimdFloat>(s: &ConicalFrustum<L::Scalar>, ray: &Ray<L>) -> Option<Chord<L>> {
    let half = L::from_f64(0.5);
    let line = s.unit_space.line(ray);
    let UnitLine { point: p, direction: d, .. } = line;
    let near = p.length_squared().le(L::from_f64(AROUND2));
    if near.none() {
        return None;
    }
    let side = side_crossings(s, p, d);
    // Interval between the planes of the base and the cap. If a line parallel to these planes is
    // between them, the interval is practically unbounded. If the line is not between them, the
    // interval is too far away to overlap the solid.
    let tiny = L::from_f64(1e-30);
    let inverse = L::one() / d.z.abs().max(tiny).copysign(d.z);
    let (z0, z1) = ((-half - p.z) * inverse, (half - p.z) * inverse);
    let (enter_ends, leave_ends) = (z0.min(z1), z0.max(z1));
    let (enter, leave) = (side.enter.max(enter_ends), side.leave.min(leave_ends));
    Some(Chord {
        line,
        enter,
        leave,
        enters_side: side.enter.ge(enter_ends),
        leaves_side: side.leave.le(leave_ends),
        meets: near & side.crosses & enter.le(leave),
    })
}

/// Interval in which a line is inside the infinite cone or cylinder of the lateral surface.
struct SideCrossings<L: SimdFloat> {
    enter: L,
    leave: L,
    crosses: L::Mask,
}

/// Returns the crossings of the line p + t d with the lateral surface, in canonical space.
///
/// Let r be the frustum's radius at the height of p, and k the slope; p' and d' are p and d without
/// their z coordinates. The line crosses the surface where a t^2 + 2 b t + c = 0. The discriminant
/// b^2 - a c is computed as |r d' - k d_z p'|^2 - (p' x d')^2, which does not cancel; for a
/// cylinder it compares the radius with the line's distance from the axis. The roots are q / a and
/// c / q with q = -(b + sign(b) D), where D is the root of the discriminant. For a line parallel to
/// a generator (a straight line on the lateral surface), a is 0; c / q stays finite.
#[inline(always)]
fn side_crossings<L: SimdFloat>(
    s: &ConicalFrustum<L::Scalar>,
    p: Vec3<L>,
    d: Vec3<L>,
) -> SideCrossings<L> {
    let zero = L::zero();
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
    // Lines steeper than the lateral surface always cross both nappes of the cone.
    let steep = a.lt(zero);
    let root = discriminant.max(zero).sqrt();
    let q = -(b + root.copysign(b));
    let has_roots = q.abs().gt(zero);
    let t0 = L::select(has_roots, q / a, zero);
    let t1 = L::select(has_roots, c / q, zero);
    let (low, high) = (t0.min(t1), t0.max(t1));
    // A line that is parallel to a generator or to the axis and does not cross the lateral surface
    // is inside it everywhere or nowhere.
    let level = L::mask(true).and_not(has_roots) & a.abs().le(zero);
    let (all, none) = (L::from_f64(L::MAX), L::from_f64(-L::MAX));
    // Only the nappe with a positive radius belongs to the solid. A steep line crosses this nappe
    // once: it enters if the radius grows along the line, and leaves otherwise.
    let widens = kd.gt(zero);
    let enter = L::select(steep, L::select(widens, high, none), low);
    let leave = L::select(steep, L::select(widens, all, low), high);
    SideCrossings {
        enter: L::select(level, none, enter),
        leave: L::select(level, all, leave),
        crosses: (steep | discriminant.ge(zero)).and_not(level) | (level & c.le(zero)),
    }
}

/// Returns the outward normal in scene space, not normalised, at the point of the lateral surface
/// with the canonical coordinates `x` and `y`, and the point's canonical distance from the axis.
#[inline(always)]
fn side_normal<L: SimdFloat>(s: &ConicalFrustum<L::Scalar>, x: L, y: L) -> (Vec3<L>, L) {
    let rho = x.mul_add(x, y * y).sqrt();
    // The tip of a cone has no normal; the direction of the axis is used there.
    let inverse = L::select(rho.gt(L::zero()), L::one() / rho, L::zero());
    let normal = Vec3::new(x * inverse, y * inverse, -L::splat(s.slope));
    (s.unit_space.scene_normal(normal), rho)
}

impl<L: SimdFloat> AnalyticPrimitive<L> for ConicalFrustum<L::Scalar> {
    #[inline(always)]
    fn intersect(&self, ray: &Ray<L>) -> Option<(L, L::Mask)> {
        let chord = chord(self, ray)?;
        let (enter, leave) = chord.distances();
        Some((L::select(enter.gt(L::zero()), enter, leave), chord.meets))
    }

    /// Projects `point` onto the face with the largest signed distance to it, positive outside. The
    /// faces are the lateral surface, the base and the cap.
    #[inline(always)]
    fn surface(&self, point: Vec3<L>) -> SurfacePoint<L> {
        let s = self;
        let p = s.unit_space.point(point);
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
    type Spans = Option<Span<L>>;

    fn spans(&self, ray: &Ray<L>, wanted: L::Mask) -> Option<Span<L>> {
        let s = self;
        let chord = chord(s, ray)?;
        if (chord.meets & wanted).none() {
            return None;
        }
        let (enter, leave) = chord.distances();
        let cap = Vec3::splat(s.cap_normal).dot(ray.direction).abs();
        let cosine = |on_side: L::Mask, t: L| {
            let end_point = chord.line.direction.mul_add(t, chord.line.point);
            let (normal, _) = side_normal(s, end_point.x, end_point.y);
            let side = (normal.dot(ray.direction) / normal.length_squared().sqrt()).abs();
            L::select(on_side, side, cap)
        };
        Some(Span {
            enter,
            leave,
            enter_cosine: cosine(chord.enters_side, chord.enter),
            leave_cosine: cosine(chord.leaves_side, chord.leave),
            meets: chord.meets,
        })
    }
}
