//! Emissive triangles: the choice of a triangle for each receiver, and the sampling of its points.

use crate::light::emitter::{PointSample, Sides};
use crate::light::form::doubled_normal;
use crate::light::solid_angle::{SphericalTriangle, density_of_area};
use glam::DVec3;
use zerkalo_kernel::lanes::{Float, MAX_WIDTH, Mask, SimdFloat, Vec3};

/// Largest number of triangles that are chosen in proportion to their solid angles, which are
/// computed for each receiver.
pub(super) const MAX_FACES: usize = 32;

#[derive(Clone, Copy, Debug)]
pub(super) struct Triangle<S> {
    corner: [S; 3],
    /// Vectors from the first corner of the triangle to the two others.
    edges: [[S; 3]; 2],
    normal: [S; 3],
    area: S,
    /// Start of the range of random numbers in [0, 1) for which this triangle is chosen by area;
    /// `end` is the end of the range. Its length is the triangle's share of the total area.
    start: S,
    end: S,
}

impl<S: Float> Triangle<S> {
    /// Compiles triangles with the given corners. Their ranges follow one another in this order.
    pub fn list(all: &[[DVec3; 3]]) -> Vec<Self> {
        let vector = |v: DVec3| v.to_array().map(S::from_f64);
        let area_of = |corners: &[DVec3; 3]| 0.5 * doubled_normal(corners).length();
        let area = all.iter().map(area_of).sum::<f64>();
        let mut end = 0.0;
        let compile = |corners: &[DVec3; 3]| {
            let own_area = area_of(corners);
            let start = end;
            end += own_area / area;
            let [a, b, c] = *corners;
            Self {
                corner: vector(a),
                edges: [b - a, c - a].map(vector),
                normal: vector(doubled_normal(corners).normalize_or(DVec3::Z)),
                area: S::from_f64(own_area),
                start: S::from_f64(start),
                end: S::from_f64(end),
            }
        };
        all.iter().map(compile).collect()
    }

    /// Returns the index of the triangle whose range contains `u`; their number if none does.
    pub fn index_of(triangles: &[Self], u: S) -> usize {
        triangles.partition_point(|triangle| triangle.end <= u)
    }

    /// Samples a point of a triangle that is chosen in proportion to its area.
    #[inline(always)]
    pub fn sample_by_area<L: SimdFloat<Scalar = S>>(
        triangles: &[Self],
        sides: &Sides<S>,
        origin: Vec3<L>,
        (u, v): (L, L),
    ) -> PointSample<L> {
        let index = lanes_of::<L>(|lane| Self::index_of(triangles, u.lane(lane)));
        let triangle = PacketTriangle::gather(triangles, &index, origin);
        let u = ((u - triangle.start) / triangle.share).max(L::zero()).min(L::one());
        triangle.sample(sides, L::mask(sides.both), (u, v))
    }

    /// Returns the density [1/sr] with which [`Self::sample_by_area`] draws the direction of a ray
    /// that hits `triangle`, encoded by [`SimdFloat::from_id`], at `distance`.
    #[inline(always)]
    pub fn density_by_area<L: SimdFloat<Scalar = S>>(
        triangles: &[Self],
        sides: &Sides<S>,
        origin: Vec3<L>,
        (distance, triangle): (L, L),
    ) -> L {
        let index = lanes_of::<L>(|lane| triangle.id_lane(lane) as usize);
        let triangle = PacketTriangle::gather(triangles, &index, origin);
        let seen = triangle.seen(sides, L::mask(sides.both));
        triangle.density(&seen, distance)
    }
}

/// Up to [`MAX_FACES`] triangles as seen from each receiver.
pub(super) struct FacesSeen<'a, L: SimdFloat> {
    triangles: &'a [Triangle<L::Scalar>],
    sides: &'a Sides<L::Scalar>,
    origin: Vec3<L>,
    /// Solid angle of each triangle that emits light to the receiver; 0 for the others.
    angles: [L; MAX_FACES],
    total: L,
    /// Lanes in which backs of triangles may emit light to the receiver: never from a convex solid
    /// to a receiver outside it.
    backs: L::Mask,
}

impl<'a, L: SimdFloat> FacesSeen<'a, L> {
    /// Computes what receivers at `origin` see. `convex` is `true` for triangles of a convex solid.
    #[inline(always)]
    pub fn new(
        triangles: &'a [Triangle<L::Scalar>],
        convex: bool,
        sides: &'a Sides<L::Scalar>,
        origin: Vec3<L>,
    ) -> Self {
        let mut backs = L::mask(sides.both);
        if convex {
            for triangle in triangles {
                let to_corner = Vec3::splat(triangle.corner) - origin;
                let height = Vec3::splat(triangle.normal).dot(to_corner);
                backs = backs.and_not(height.lt(L::zero()));
            }
        }
        let (mut angles, mut total) = ([L::zero(); MAX_FACES], L::zero());
        for (triangle, angle) in triangles.iter().zip(&mut angles) {
            let seen = PacketTriangle::splat(triangle, origin).seen(sides, backs);
            *angle = seen.spherical.solid_angle.masked(seen.height.lt(L::zero()));
            total += *angle;
        }
        Self { triangles, sides, origin, angles, total, backs }
    }

    /// Samples a point of a triangle that is chosen in proportion to its solid angle.
    #[inline(always)]
    pub fn sample(&self, (u, v): (L, L)) -> PointSample<L> {
        let target = u * self.total;
        let (mut before, mut start, mut angle) = (L::zero(), L::zero(), L::one());
        let (mut chosen, mut done) = (L::from_id(0), L::mask(false));
        for (i, own) in (0..).zip(&self.angles[..self.triangles.len()]) {
            let taken = own.gt(L::zero()).and_not(done);
            chosen = L::select(taken, L::from_id(i), chosen);
            (start, angle) = (L::select(taken, before, start), L::select(taken, *own, angle));
            before += *own;
            done = done | (taken & before.gt(target));
        }
        let index = lanes_of::<L>(|lane| chosen.id_lane(lane) as usize);
        let mut triangle = PacketTriangle::gather(self.triangles, &index, self.origin);
        triangle.share = angle / self.total;
        let u = ((target - start) / angle).max(L::zero()).min(L::one());
        let point = triangle.sample(self.sides, self.backs, (u, v));
        // A receiver gets no light if no triangle emits towards it.
        let seen = self.total.gt(L::zero());
        PointSample { density: self.density(), pdf: point.pdf.masked(seen), ..point }
    }

    /// Returns the density [1/sr] with which [`Self::sample`] draws a direction that hits a
    /// triangle.
    #[inline(always)]
    pub fn density(&self) -> L {
        (L::one() / self.total).masked(self.total.gt(L::zero()))
    }
}

#[inline(always)]
fn lanes_of<L: SimdFloat>(f: impl Fn(usize) -> usize) -> [usize; MAX_WIDTH] {
    let mut out = [0; MAX_WIDTH];
    for (lane, out) in out.iter_mut().enumerate().take(L::WIDTH) {
        *out = f(lane);
    }
    out
}

/// Triangle in each lane, with the receiver of light at the origin.
struct PacketTriangle<L> {
    corners: [Vec3<L>; 3],
    normal: Vec3<L>,
    /// Start of the range of random numbers in [0, 1) for which the triangle is chosen.
    start: L,
    /// Probability with which the triangle is chosen among all triangles.
    share: L,
    area: L,
}

/// Lifted triangle as seen from the receiver.
struct SeenTriangle<L: SimdFloat> {
    spherical: SphericalTriangle<L>,
    corners: [Vec3<L>; 3],
    /// Coordinate of the triangle's plane relative to the receiver, along the normal of the side to
    /// which the triangle is lifted. Negative in lanes whose receiver gets light.
    height: L,
}

impl<L: SimdFloat> PacketTriangle<L> {
    /// Returns the same triangle in all lanes.
    #[inline(always)]
    fn splat(triangle: &Triangle<L::Scalar>, origin: Vec3<L>) -> Self {
        let corner = Vec3::splat(triangle.corner) - origin;
        let [u, v] = triangle.edges.map(Vec3::splat);
        let start = L::splat(triangle.start);
        Self {
            corners: [corner, corner + u, corner + v],
            normal: Vec3::splat(triangle.normal),
            start,
            share: L::splat(triangle.end) - start,
            area: L::splat(triangle.area),
        }
    }

    /// Gathers the triangle with the given index in each lane. An index past the end counts as the
    /// last triangle.
    #[inline(always)]
    fn gather(
        triangles: &[Triangle<L::Scalar>],
        index: &[usize; MAX_WIDTH],
        origin: Vec3<L>,
    ) -> Self {
        let of_lane = |lane: usize| &triangles[index[lane].min(triangles.len() - 1)];
        let corner = Vec3::from_fn(|lane| of_lane(lane).corner) - origin;
        let edge = |k: usize| Vec3::from_fn(|lane| of_lane(lane).edges[k]);
        let start = L::from_fn(|lane| of_lane(lane).start);
        Self {
            corners: [corner, corner + edge(0), corner + edge(1)],
            normal: Vec3::from_fn(|lane| of_lane(lane).normal),
            start,
            share: L::from_fn(|lane| of_lane(lane).end) - start,
            area: L::from_fn(|lane| of_lane(lane).area),
        }
    }

    /// Lifts the triangle along its normal: to the back in lanes of `backs` whose receiver is behind
    /// it, otherwise to the front.
    #[inline(always)]
    fn seen(&self, sides: &Sides<L::Scalar>, backs: L::Mask) -> SeenTriangle<L> {
        let height = self.normal.dot(self.corners[0]);
        let ([_, _, height], behind) = sides.lifted([L::zero(), L::zero(), height], backs);
        let lift = L::splat(sides.lift);
        let lift = self.normal * L::select(behind, -lift, lift);
        let corners = self.corners.map(|corner| corner + lift);
        SeenTriangle {
            spherical: SphericalTriangle::new(corners, height, self.area),
            corners,
            height,
        }
    }

    /// Samples a point by `u` and `v`, which are uniform in [0, 1). `backs` are the lanes in which
    /// the back emits light.
    #[inline(always)]
    fn sample(&self, sides: &Sides<L::Scalar>, backs: L::Mask, (u, v): (L, L)) -> PointSample<L> {
        let seen = self.seen(sides, backs);
        let spherical = &seen.spherical;
        // Uniform barycentric coordinates.
        let root = u.sqrt();
        let [a, b, c] = seen.corners;
        let point = a * (L::one() - root) + b * (root * (L::one() - v)) + c * (root * v);
        let mut distance = point.length_squared().sqrt();
        let mut wi = point * (L::one() / distance);
        if spherical.by_angle.any() {
            wi = Vec3::select(spherical.by_angle, spherical.sample(u, v), wi);
            let to_plane = seen.height.abs() / self.normal.dot(wi).abs();
            distance = L::select(spherical.by_angle, to_plane, distance);
        }
        let density = self.density(&seen, distance);
        PointSample { wi, distance, density, pdf: density }
    }

    /// Returns the density [1/sr] of a direction in which the triangle is hit at `distance`: the
    /// probability that the triangle is chosen, times the density of the direction within it.
    #[inline(always)]
    fn density(&self, seen: &SeenTriangle<L>, distance: L) -> L {
        let by_area = density_of_area(self.area / self.share, distance, seen.height);
        let SphericalTriangle { by_angle, solid_angle, .. } = seen.spherical;
        let density = L::select(by_angle, self.share / solid_angle, by_area);
        density.min(L::from_f64(L::MAX)).masked(seen.height.lt(L::zero()))
    }
}
