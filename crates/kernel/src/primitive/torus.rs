//! Tori. Rays are transformed into the space of a torus about the y axis. Its ring, the circle in
//! the middle of the tube, has radius 1, and its tube has radius r: (rho - 1)^2 + y^2 <= r^2, with
//! rho^2 = x^2 + z^2.
//!
//! A line meets the torus where the height h = (rho - 1)^2 + y^2 - r^2 is 0, at most four times.
//! Newton's method finds these zeros of h inside brackets. Let s be the distance along the line
//! from its point closest to the centre. Half the derivative of h is s - rho'(s). The graph of
//! rho(s) is a hyperbola, and rho'' exceeds 1 only between two known positions. These divide the
//! line into three pieces, on each of which h' is monotone. In total, h' has one or three zeros,
//! which bracket the zeros of h (after Yuksel 2022, *High-Performance Polynomial Root Finding for
//! Graphics*).
//!
//! The coefficients of the quartic polynomial with the same zeros are not used, because their terms
//! would cancel for thin tubes.

use crate::bvh::Ray;
use crate::lanes::{Float, Mask, SimdFloat, Vec3};
use crate::primitive::bounding::BoundingSphere;
use crate::primitive::canonical::{
    Bounds, CanonicalShape, Projection, box_distance, frobenius_norm, normals_of_solid, rows,
    similarity,
};
use crate::primitive::compiled::{AnalyticPrimitive, SurfacePoint, TexCoord};
use crate::primitive::csg::{SolidPrimitive, Span};
use crate::primitive::unit_space::{UnitLine, UnitSpace, rounded_rows, times};
use glam::{DAffine3, DVec3};
use std::f64::consts::TAU;

/// Image of a torus about the y axis under an invertible affine map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TorusForm {
    /// Map to the scene from the space of the torus, in which its centre is the origin.
    pub scene_from_torus: DAffine3,
    /// Radius of the ring, greater than 0.
    pub ring: f64,
    /// Radius of the tube, greater than 0, at most `ring`.
    pub tube: f64,
}

impl TorusForm {
    pub(super) fn transformed(self, map: &DAffine3) -> Self {
        Self { scene_from_torus: *map * self.scene_from_torus, ..self }
    }

    /// Returns the map to the scene from the space in which the ring has radius 1.
    fn scene_from_unit(&self) -> DAffine3 {
        self.scene_from_torus * DAffine3::from_scale(DVec3::splat(self.ring))
    }

    /// Returns the distance of `point`, in the space of the torus, from the ring, and the unit
    /// vector from the ring to `point`.
    fn ring_distance(&self, point: DVec3) -> (f64, DVec3) {
        let outward = DVec3::new(point.x, 0.0, point.z).normalize_or(DVec3::X);
        let across = point - outward * self.ring;
        (across.length(), across.normalize_or(outward))
    }
}

impl CanonicalShape for TorusForm {
    fn bounds(&self) -> Option<Bounds> {
        // The torus is the Minkowski sum of its ring and of a ball with the radius of the tube. Its
        // box is the sum of their boxes.
        let m = &self.scene_from_torus;
        let half = |row: DVec3| self.ring * row.x.hypot(row.z) + self.tube * row.length();
        let half = DVec3::from(rows(&m.matrix3).map(half));
        Some((m.translation - half, m.translation + half))
    }

    fn bounding_sphere(&self) -> BoundingSphere {
        match similarity(&self.scene_from_torus.matrix3) {
            Some(scale) => BoundingSphere {
                center: self.scene_from_torus.translation,
                radius: (self.ring + self.tube) * scale,
            },
            None => BoundingSphere::around_box(self.bounds()),
        }
    }

    fn oriented_box(&self) -> Option<(DAffine3, Bounds)> {
        let outer = self.ring + self.tube;
        let half = DVec3::new(outer, self.tube, outer);
        Some((self.scene_from_torus, (-half, half)))
    }

    /// Returns the smallest distance between opposite faces of the parallelepiped that is the image
    /// of a cube around a ball with the radius of the tube.
    fn thickness(&self) -> f64 {
        let rows = rows(&self.scene_from_torus.matrix3.inverse());
        2.0 * self.tube / rows.map(DVec3::length).into_iter().fold(0.0, f64::max)
    }

    /// Returns the exact distance if the map to the scene is a similarity. Otherwise returns the
    /// larger of two lower bounds: the distance from the bounding box, and the distance in the
    /// space of the torus times a lower bound of the factor by which the map scales lengths.
    fn clearance(&self, point: DVec3) -> Option<f64> {
        let inverse = self.scene_from_torus.inverse();
        let (distance, _) = self.ring_distance(inverse.transform_point3(point));
        let distance = (distance - self.tube).abs();
        if let Some(scale) = similarity(&self.scene_from_torus.matrix3) {
            return Some(distance * scale);
        }
        let shrinks = frobenius_norm(&inverse.matrix3).recip();
        Some(box_distance(self.bounds()?, point).max(distance * shrinks))
    }

    fn normals_at(&self, point: DVec3, slack: f64) -> Vec<Vec<DVec3>> {
        let inverse = self.scene_from_torus.inverse();
        let (distance, outward) = self.ring_distance(inverse.transform_point3(point));
        let steepness = inverse.matrix3.transpose() * outward;
        let height = (distance - self.tube) / steepness.length();
        normals_of_solid(vec![(height, steepness.normalize())], slack)
    }

    /// Returns the torus's own coordinates: u is the angle around the ring, v the angle around the
    /// tube, both from 0 to 1.
    fn default_mapping(&self) -> Projection {
        Projection::Uv
    }
}

/// Torus compiled for ray intersection. Matrices are stored by rows.
#[derive(Clone, Copy)]
pub struct Torus<S> {
    /// Space in which the ring has radius 1.
    unit_space: UnitSpace<S>,
    scene_from_unit: [[S; 3]; 3],
    /// Radius of the tube in the space in which the ring has radius 1.
    tube: S,
    inverse_ring: S,
    reach: S,
}

impl<S: Float> Torus<S> {
    pub fn new(form: &TorusForm) -> Self {
        let DAffine3 { matrix3, translation } = form.scene_from_unit();
        Self {
            unit_space: UnitSpace::new(translation, matrix3),
            scene_from_unit: rounded_rows(matrix3),
            tube: S::from_f64(form.tube / form.ring),
            inverse_ring: S::from_f64(form.ring.recip()),
            reach: S::from_f64(form.max_coordinate()),
        }
    }
}

/// Margin by which the search region for intersections is larger than the torus, in the space in
/// which the ring has radius 1. The unit is the machine epsilon.
const ROOM: f64 = 64.0;

/// Largest number of steps of the search for a zero. Bisection needs 54 in double precision.
const MAX_STEPS: usize = 64;

/// Line of a ray in the space in which the ring has radius 1.
#[derive(Clone, Copy)]
struct TorusLine<L: SimdFloat> {
    unit: UnitLine<L>,
    /// Squared length of the part of the direction perpendicular to the axis.
    across2: L,
    tube: L,
    /// Position at which the line enters the region of the torus.
    low: L,
    /// Position at which the line leaves the region of the torus.
    high: L,
    /// Lanes whose line crosses the region of the torus: the part of its bounding sphere between
    /// the two planes that touch the tube from below and above, with the margin [`ROOM`].
    near: L::Mask,
}

/// Position on a line, described relative to the torus.
struct Place<L> {
    /// Distance rho from the axis, minus 1.
    beyond: L,
    /// Height above the plane of the ring.
    y: L,
    /// Derivative of rho with respect to the position.
    speed: L,
    /// Reciprocal of rho.
    inward: L,
}

/// Positions on a line that separate its intersections with the torus, in ascending order.
struct Separators<L: SimdFloat> {
    places: [L; 5],
    /// Lanes in which each position is inside the torus.
    inside: [L::Mask; 5],
}

impl<L: SimdFloat> TorusLine<L> {
    /// Prepares the line of each ray. Returns `None` if no line crosses the region of the torus.
    #[inline(always)]
    fn new(torus: &Torus<L::Scalar>, ray: &Ray<L>) -> Option<Self> {
        let unit = torus.unit_space.line(ray);
        let UnitLine { point: p, direction: d, .. } = unit;
        let tube = L::splat(torus.tube);
        let room = L::from_f64(ROOM * L::EPSILON);
        let reach = L::one() + tube + room;
        let chord2 = reach * reach - p.length_squared();
        let near = chord2.gt(L::zero());
        if near.none() {
            return None;
        }
        let chord = chord2.max(L::zero()).sqrt();
        let inverse = L::one() / d.y.abs().max(L::from_f64(1e-30)).copysign(d.y);
        let half = tube + room;
        let (y0, y1) = ((-half - p.y) * inverse, (half - p.y) * inverse);
        let (low, high) = (y0.min(y1).max(-chord), y0.max(y1).min(chord));
        let near = near & low.lt(high);
        if near.none() {
            return None;
        }
        let across2 = d.x.mul_add(d.x, d.z * d.z);
        Some(Self { unit, across2, tube, low, high, near })
    }

    #[inline(always)]
    fn place(&self, s: L) -> Place<L> {
        let UnitLine { point, direction: d, .. } = self.unit;
        let p = d.mul_add(s, point);
        let rho = p.x.mul_add(p.x, p.z * p.z).sqrt();
        let inward = L::one() / rho.max(L::from_f64(1e-30));
        let limit = self.across2.sqrt();
        let speed = p.x.mul_add(d.x, p.z * d.z) * inward;
        Place { beyond: rho - L::one(), y: p.y, speed: speed.max(-limit).min(limit), inward }
    }

    /// Returns the height h of the [module](self) at position `s` of the line, and its derivative.
    #[inline(always)]
    fn height(&self, s: L) -> (L, L) {
        let Place { beyond, y, speed, .. } = self.place(s);
        let height = beyond.mul_add(beyond, (y - self.tube) * (y + self.tube));
        let slope = beyond.mul_add(speed, y * self.unit.direction.y);
        (height, slope + slope)
    }

    /// Returns half of the derivative of h at position `s` of the line, and the slope of this half.
    #[inline(always)]
    fn slope(&self, s: L) -> (L, L) {
        let Place { beyond, y, speed, inward } = self.place(s);
        let slope = beyond.mul_add(speed, y * self.unit.direction.y);
        (slope, L::one() - (self.across2 - speed * speed) * inward)
    }

    #[inline(always)]
    fn inside(&self, s: L) -> L::Mask {
        self.height(s).0.le(L::zero())
    }

    /// Returns the positions of the extremes of h along the line: minimum, maximum, minimum. A
    /// single extreme is repeated three times.
    #[inline(always)]
    fn extremes(&self) -> [L; 3] {
        let (zero, one) = (L::zero(), L::one());
        let tiny = L::from_f64(1e-30);
        let a2 = self.across2.max(tiny);
        let a = a2.sqrt();
        let UnitLine { point: p, direction: d, .. } = self.unit;
        // Point nearest to the axis, and its distance from the axis.
        let middle = -(p.x.mul_add(d.x, p.z * d.z)) / a2;
        let least = (p.x.mul_add(d.z, -(p.z * d.x)) / a).abs();
        // rho'' > 1 where rho^3 < (a least)^2. The cube root y of x = (a least)^2 is computed by
        // iteration of y <- (y x)^(1/4).
        let bends = a2.gt(least);
        let cube = a2 * least * least;
        let mut root = one;
        for _ in 0..10 {
            root = (root * cube).sqrt().sqrt();
        }
        let half2 = (root * root - least * least) / a2;
        let half = half2.max(zero).sqrt().max(L::from_f64(8.0 * L::EPSILON));
        let left = L::select(bends, (middle - half).max(-a).min(a), a);
        let right = L::select(bends, (middle + half).max(-a).min(a), a);
        let (rises, falls) = (self.slope(left).0.gt(zero), self.slope(right).0.lt(zero));
        let early = rises | !bends;
        let three = bends & rises & falls;
        let first = self.root(
            L::select(early, -a, right),
            L::select(early, left, a),
            one,
            self.near,
            Self::slope,
        );
        let several = three & self.near;
        if several.none() {
            return [first; 3];
        }
        let second = self.root(left, right, -one, several, Self::slope);
        let third = self.root(right, a, one, several, Self::slope);
        [first, L::select(three, second, first), L::select(three, third, first)]
    }

    /// Returns the zero of `function` between `low` and `high` in the lanes of `open`. `function`
    /// returns a value and its derivative. `sign` times the value must be negative at `low` and
    /// positive at `high`. The search bisects where Newton's step leaves the bracket or is slow.
    /// The steps of a lane do not depend on other lanes.
    #[inline(always)]
    fn root(
        &self,
        mut low: L,
        mut high: L,
        sign: L,
        mut open: L::Mask,
        function: impl Fn(&Self, L) -> (L, L),
    ) -> L {
        let half = L::from_f64(0.5);
        let mut place = half * low + half * high;
        let mut step_before = (high - low).abs();
        for _ in 0..MAX_STEPS {
            let (value, slope) = function(self, place);
            let (value, slope) = (value * sign, slope * sign);
            let below = value.lt(L::zero());
            low = L::select(below, place, low);
            high = L::select(below, high, place);
            let newton = place - value / slope;
            let slow = (value + value).abs().gt((step_before * slope).abs());
            let sound = newton.gt(low) & newton.lt(high) & !slow;
            let next = L::select(sound, newton, half * low + half * high);
            let step = (next - place).abs();
            place = L::select(open, next, place);
            step_before = step;
            open = open & step.gt(L::from_f64(2.0 * L::EPSILON));
            if open.none() {
                break;
            }
        }
        place
    }

    /// Returns positions that separate the intersections of each line after the position `start`.
    #[inline(always)]
    fn separators(&self, start: L) -> Separators<L> {
        let within = |s: L| s.max(self.low).min(self.high).max(start);
        let [first, second, third] = self.extremes().map(within);
        let places = [self.low.max(start), first, second, third, self.high.max(start)];
        // The last position is outside the torus. The first one is outside, too, unless it is
        // `start` and `start` is inside.
        let inside = [
            start.gt(self.low) & self.inside(places[0]),
            self.inside(first),
            self.inside(second),
            self.inside(third),
            L::mask(false),
        ];
        Separators { places, inside }
    }

    #[inline(always)]
    fn distance(&self, s: L) -> L {
        (s - self.unit.start) * self.unit.scale
    }
}

impl<L: SimdFloat> AnalyticPrimitive<L> for Torus<L::Scalar> {
    #[inline(never)]
    fn intersect(&self, ray: &Ray<L>) -> Option<(L, L::Mask)> {
        let line = TorusLine::new(self, ray)?;
        let ahead = line.near & line.unit.start.lt(line.high);
        if ahead.none() {
            return None;
        }
        let Separators { places, inside } = line.separators(line.unit.start);
        // The first bracket that has one end inside the torus and the other end outside.
        let (mut low, mut high, mut sign) = (places[0], places[4], L::one());
        let mut open = ahead;
        for i in 0..4 {
            let (before, after) = (inside[i], inside[i + 1]);
            let crosses = open & (before.and_not(after) | after.and_not(before));
            low = L::select(crosses, places[i], low);
            high = L::select(crosses, places[i + 1], high);
            sign = L::select(crosses & after, -L::one(), sign);
            open = open.and_not(crosses);
        }
        let hits = ahead.and_not(open);
        if hits.none() {
            return None;
        }
        let root = line.root(low, high, sign, hits, TorusLine::height);
        Some((line.distance(root), hits))
    }

    #[inline(always)]
    fn surface(&self, point: Vec3<L>) -> SurfacePoint<L> {
        let p = self.unit_space.point(point);
        let rho = p.x.mul_add(p.x, p.z * p.z).sqrt();
        let on_axis = rho.le(L::zero());
        let inverse = L::one() / L::select(on_axis, L::one(), rho);
        let ring = Vec3::new(L::select(on_axis, L::one(), p.x * inverse), L::zero(), p.z * inverse);
        let outward = (p - ring).normalize();
        let on_surface = outward.mul_add(L::splat(self.tube), ring);
        SurfacePoint {
            point: times(&self.scene_from_unit, on_surface) + Vec3::splat(self.unit_space.center),
            normal: self.unit_space.scene_normal(outward).normalize(),
            max_coordinate: L::splat(self.reach),
        }
    }

    fn uv(&self, point: Vec3<L>) -> Option<TexCoord<L>> {
        let p = self.unit_space.point(point);
        let rho2 = p.x.mul_add(p.x, p.z * p.z).max(L::from_f64(1e-12));
        let rho = rho2.sqrt();
        let beyond = rho - L::one();
        let (turn, half) = (L::from_f64(1.0 / TAU), L::from_f64(0.5));
        let per = L::splat(self.inverse_ring) * turn;
        let around_ring = per / rho2;
        let across2 = beyond.mul_add(beyond, p.y * p.y);
        let around_tube = per / across2.max(L::from_f64(1e-30));
        let inward = -(p.y * around_tube) / rho;
        Some(TexCoord {
            u: p.x.atan2(p.z).mul_add(turn, half),
            v: p.y.atan2(beyond).mul_add(turn, half),
            grad_u: Vec3::new(p.z * around_ring, L::zero(), -(p.x * around_ring)),
            grad_v: Vec3::new(p.x * inward, beyond * around_tube, p.z * inward),
        })
    }
}

impl<L: SimdFloat> SolidPrimitive<L> for Torus<L::Scalar> {
    type Spans = std::iter::Flatten<std::option::IntoIter<[Span<L>; 2]>>;

    fn spans(&self, ray: &Ray<L>, _wanted: L::Mask) -> Self::Spans {
        spans(self, ray).into_iter().flatten()
    }
}

/// Returns the spans of each line; the second one or both may be empty.
#[inline(never)]
fn spans<L: SimdFloat>(torus: &Torus<L::Scalar>, ray: &Ray<L>) -> Option<[Span<L>; 2]> {
    let line = TorusLine::new(torus, ray)?;
    let Separators { places, inside } = line.separators(line.low);
    let near = line.near;
    let one = L::one();
    let whole = inside[1] & inside[2] & inside[3];
    let (first, second) = (near & inside[1], (near & inside[3]).and_not(whole));
    let root = |i: usize, sign: L, open: L::Mask| {
        if open.none() {
            return places[i];
        }
        line.root(places[i], places[i + 1], sign, open, TorusLine::height)
    };
    let enter_first = root(0, -one, first);
    let leave_first = root(1, one, first.and_not(whole));
    let enter_second = root(2, -one, second);
    let leave_last = root(3, one, second | (first & whole));
    let cosine = |t: L| torus.surface(ray.at(t)).normal.dot(ray.direction).abs();
    let span = |enter: L, leave: L, meets: L::Mask| {
        let (enter, leave) = (line.distance(enter), line.distance(leave));
        let (enter_cosine, leave_cosine) = (cosine(enter), cosine(leave));
        Span { enter, leave, enter_cosine, leave_cosine, meets }
    };
    Some([
        span(enter_first, L::select(whole, leave_last, leave_first), first),
        span(enter_second, leave_last, second),
    ])
}
