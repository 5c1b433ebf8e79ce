//! Emissive objects as lights: sampling of points on their surfaces by solid angle or area, and the
//! densities of the sampled directions. The emission that a ray finds when it hits such an object
//! is not computed here.
//!
//! A sampled point is lifted off the surface to the side of the receiver, so that the object does
//! not occlude its own points. The lift is along the normal and larger than the rounding errors of
//! the surface. It therefore suffices for rays at any angle.

use crate::light::EmitterSample;
use crate::light::emitter::{
    Cone, MIN_SOLID_ANGLE, SphericalRectangle, density_of_area, local_of, towards,
};
use glam::DVec3;
use std::f64::consts::PI;
use zerkalo_kernel::lanes::{Float, Frame, MAX_WIDTH, Mask, SimdFloat, Vec3};
use zerkalo_kernel::sampling::warp;

/// Largest number of triangles of an emissive object up to which the triangle to sample is chosen
/// in proportion to its solid angle. For this choice, the solid angles of all triangles are
/// computed for each receiver.
const MAX_FACES: usize = 32;

/// Surface of an emissive object from which light can be sampled.
#[derive(Clone, Debug, PartialEq)]
pub enum ObjectSurface {
    /// Light-emitting sphere.
    Sphere {
        /// Centre of the sphere, relative to the scene's centre.
        center: DVec3,
        /// Radius of the sphere.
        radius: f64,
    },
    /// Light-emitting rectangle.
    Rectangle {
        /// Centre of the rectangle, relative to the scene's centre.
        center: DVec3,
        /// Unit vectors across and up the rectangle, and along the normal of its front.
        axes: [DVec3; 3],
        /// Width and height of the rectangle.
        size: [f64; 2],
    },
    /// Triangles with areas greater than 0, counter-clockwise as seen from the front.
    Triangles(Vec<[DVec3; 3]>),
    /// Triangles that enclose a convex solid, counter-clockwise as seen from outside.
    ConvexTriangles(Vec<[DVec3; 3]>),
}

/// Emissive object, compiled as a light. All results are for white light of radiance 1; callers
/// multiply them by the emission.
#[derive(Clone, Debug)]
pub struct ObjectEmitter<S> {
    surface: CompiledSurface<S>,
    /// Centre of a bounding sphere of all sampled points, including their lift off the surface.
    pub center: DVec3,
    /// Radius, around `center`, of a bounding sphere of all sampled points, including their lift
    /// off the surface.
    pub radius: f64,
    /// Height of sampled points above the surface.
    lift: S,
    /// `true` if the back emits light, too. The back is the other side of a flat surface, or the
    /// inner side of the surface of a solid.
    two_sided: bool,
}

#[derive(Clone, Debug)]
enum CompiledSurface<S> {
    Sphere {
        center: [S; 3],
        radius: S,
    },
    Rectangle {
        center: [S; 3],
        axes: [[S; 3]; 3],
        size: [S; 2],
    },
    /// Up to [`MAX_FACES`] triangles. The triangle to sample is chosen in proportion to its solid
    /// angle.
    Faces {
        triangles: Vec<Triangle<S>>,
        /// `true` if the triangles enclose a convex solid; no triangle then occludes another.
        convex: bool,
    },
    /// More than [`MAX_FACES`] triangles. The triangle to sample is chosen in proportion to its
    /// area: a random number selects the triangle whose range it is in. The triangles are sorted by
    /// the ends of these ranges.
    Mesh(Vec<Triangle<S>>),
}

#[derive(Clone, Copy, Debug)]
struct Triangle<S> {
    corner: [S; 3],
    /// Edges from the first corner of the triangle to the two others.
    edges: [[S; 3]; 2],
    /// Unit normal of the triangle's front.
    normal: [S; 3],
    area: S,
    /// Start of the range of random numbers in [0, 1) for which this triangle is chosen; `end` is
    /// the end of the range. The length of the range is the triangle's share of the total area.
    start: S,
    end: S,
}

impl<S: Float> ObjectEmitter<S> {
    /// Compiles the surface of an emissive object. Its back emits light, too, if `two_sided` is
    /// `true`. `lift` is the height of sampled points above the surface; larger heights than 1e-4
    /// of the surface's size are reduced to this limit. The size is the radius of a sphere, the
    /// shorter side of a rectangle, or the square root of the total area of triangles. Returns
    /// `None` if the surface has no area.
    pub fn new(surface: &ObjectSurface, two_sided: bool, lift: f64) -> Option<Self> {
        let vector = |v: DVec3| v.to_array().map(S::from_f64);
        let (compiled, center, radius, area, size);
        match surface {
            ObjectSurface::Sphere { center: middle, radius: r } => {
                (center, radius, area, size) = (*middle, *r, 4.0 * PI * r * r, *r);
                compiled =
                    CompiledSurface::Sphere { center: vector(*middle), radius: S::from_f64(*r) };
            }
            ObjectSurface::Rectangle { center: middle, axes, size: [width, height] } => {
                (center, radius) = (*middle, 0.5 * width.hypot(*height));
                (area, size) = (width * height, width.min(*height));
                compiled = CompiledSurface::Rectangle {
                    center: vector(*middle),
                    axes: axes.map(vector),
                    size: [*width, *height].map(S::from_f64),
                };
            }
            ObjectSurface::Triangles(triangles) | ObjectSurface::ConvexTriangles(triangles) => {
                let corners = || triangles.iter().flatten().copied();
                let low = corners().fold(DVec3::INFINITY, DVec3::min);
                let high = corners().fold(DVec3::NEG_INFINITY, DVec3::max);
                center = 0.5 * (low + high);
                radius = corners().map(|corner| corner.distance(center)).fold(0.0, f64::max);
                let normal = |[a, b, c]: &[DVec3; 3]| (b - a).cross(c - a);
                let areas = || triangles.iter().map(|corners| 0.5 * normal(corners).length());
                area = areas().sum::<f64>();
                size = area.sqrt();
                let mut end = 0.0;
                let compile = |(corners, own_area): (&[DVec3; 3], f64)| {
                    let start = end;
                    end += own_area / area;
                    let [a, b, c] = *corners;
                    Triangle {
                        corner: vector(a),
                        edges: [b - a, c - a].map(vector),
                        normal: vector(normal(corners).normalize_or(DVec3::Z)),
                        area: S::from_f64(own_area),
                        start: S::from_f64(start),
                        end: S::from_f64(end),
                    }
                };
                let triangles: Vec<_> = triangles.iter().zip(areas()).map(compile).collect();
                let convex = matches!(surface, ObjectSurface::ConvexTriangles(_));
                compiled = if triangles.len() <= MAX_FACES {
                    CompiledSurface::Faces { triangles, convex }
                } else {
                    CompiledSurface::Mesh(triangles)
                };
            }
        }
        let lift = lift.min(1e-4 * size);
        let exists = area > 0.0 && area.is_finite() && radius.is_finite();
        exists.then(|| Self {
            surface: compiled,
            center,
            radius: radius + lift,
            lift: S::from_f64(lift),
            two_sided,
        })
    }

    /// Samples a point of the emissive surface for each of the receivers at `origin`. `u` and `v`
    /// are uniform in [0, 1).
    ///
    /// A sphere is sampled by the cone that it subtends, a rectangle by solid angle. Of at most 32
    /// triangles, one is chosen in proportion to its solid angle. Of more triangles, one is chosen
    /// in proportion to its area. The chosen triangle is sampled by solid angle, or by area if its
    /// solid angle is too small for this.
    #[inline(never)]
    pub fn sample<L: SimdFloat<Scalar = S>>(
        &self,
        origin: Vec3<L>,
        (u, v): (L, L),
    ) -> EmitterSample<L> {
        let (wi, distance, density, pdf) = match &self.surface {
            CompiledSurface::Sphere { center, radius } => {
                let to_center = Vec3::splat(*center) - origin;
                let (lift, radius) = (L::splat(self.lift), L::splat(*radius));
                let cone = Cone::new(to_center, radius);
                let local = warp::cone(u, v, cone.one_minus_cos);
                let wi = Frame::around(cone.axis).to_world(local).renormalize();
                // Distance to the lifted point in the sampled direction. The lifted point is on a
                // concentric sphere. The radius of this sphere is larger by the lift if the
                // receiver is outside, and smaller by the lift if the receiver is inside.
                let sin2 = local.x * local.x + local.y * local.y;
                let outer = radius + lift;
                let root2 = outer * outer - cone.distance2 * sin2;
                let near = cone.distance2.sqrt() * local.z - root2.max(L::zero()).sqrt();
                let (along, inner) = (to_center.dot(wi), radius - lift);
                let root2 = along * along + inner * inner - cone.distance2;
                let far = along + root2.max(L::zero()).sqrt();
                let distance = L::select(cone.inside, far, near).max(L::zero());
                let density = self.cone_density(&cone);
                (wi, distance, density, density)
            }
            CompiledSurface::Rectangle { center, axes, size } => {
                let to_center = Vec3::splat(*center) - origin;
                let backs = L::mask(self.two_sided);
                let ([x, y, height], behind) = self.lifted(local_of(axes, to_center), backs);
                let rectangle = SphericalRectangle::new(size.map(L::splat), [x, y, height]);
                let [x, y] = rectangle.sample(u, v);
                let height = L::select(behind, -height, height);
                let (wi, distance) = towards(axes, [x, y, height]);
                let density = rectangle.density(distance);
                (wi, distance, density, density)
            }
            CompiledSurface::Faces { triangles, convex } => {
                let (angles, total, backs) = self.solid_angles(triangles, *convex, origin);
                let target = u * total;
                let (mut before, mut start, mut angle) = (L::zero(), L::zero(), L::one());
                let (mut chosen, mut done) = (L::from_id(0), L::mask(false));
                for (i, own) in (0..).zip(&angles[..triangles.len()]) {
                    let taken = own.gt(L::zero()).and_not(done);
                    chosen = L::select(taken, L::from_id(i), chosen);
                    (start, angle) =
                        (L::select(taken, before, start), L::select(taken, *own, angle));
                    before += *own;
                    done = done | (taken & before.gt(target));
                }
                let index = lanes_of::<L>(|lane| chosen.id_lane(lane) as usize);
                let mut triangle = PacketTriangle::gather(triangles, &index, origin);
                triangle.share = angle / total;
                let u = ((target - start) / angle).max(L::zero()).min(L::one());
                let (wi, distance, pdf) = self.sample_triangle(&triangle, backs, (u, v));
                // A receiver gets no light if no triangle emits towards it.
                let seen = total.gt(L::zero());
                (wi, distance, (L::one() / total).masked(seen), pdf.masked(seen))
            }
            CompiledSurface::Mesh(triangles) => {
                let index_of = |u: S| triangles.partition_point(|triangle| triangle.end <= u);
                let index = lanes_of::<L>(|lane| index_of(u.lane(lane)));
                let triangle = PacketTriangle::gather(triangles, &index, origin);
                let u = ((u - triangle.start) / triangle.share).max(L::zero()).min(L::one());
                let backs = L::mask(self.two_sided);
                let (wi, distance, pdf) = self.sample_triangle(&triangle, backs, (u, v));
                (wi, distance, pdf, pdf)
            }
        };
        let arrives = pdf.gt(L::zero());
        let irradiance = (L::one() / pdf).min(L::from_f64(L::MAX)).masked(arrives);
        EmitterSample { wi, distance, density, irradiance }
    }

    /// Returns the density \[1/sr\] with which [`ObjectEmitter::sample`] draws the direction of a
    /// ray from `origin` that hits the object at `distance`. If the object is a mesh, `triangle` is
    /// the index of the hit triangle, encoded by [`SimdFloat::from_id`].
    #[inline(never)]
    pub fn density<L: SimdFloat<Scalar = S>>(
        &self,
        origin: Vec3<L>,
        distance: L,
        triangle: L,
    ) -> L {
        match &self.surface {
            CompiledSurface::Sphere { center, radius } => {
                let to_center = Vec3::splat(*center) - origin;
                self.cone_density(&Cone::new(to_center, L::splat(*radius)))
            }
            CompiledSurface::Rectangle { center, axes, size } => {
                let to_center = Vec3::splat(*center) - origin;
                let backs = L::mask(self.two_sided);
                let (local, _) = self.lifted(local_of(axes, to_center), backs);
                SphericalRectangle::new(size.map(L::splat), local).density(distance)
            }
            CompiledSurface::Faces { triangles, convex } => {
                let (_, total, _) = self.solid_angles(triangles, *convex, origin);
                (L::one() / total).masked(total.gt(L::zero()))
            }
            CompiledSurface::Mesh(triangles) => {
                let index = lanes_of::<L>(|lane| triangle.id_lane(lane) as usize);
                let triangle = PacketTriangle::gather(triangles, &index, origin);
                let (seen, _, height) = self.seen_triangle(&triangle, L::mask(self.two_sided));
                triangle.density(&seen, height, distance)
            }
        }
    }

    /// Returns three values for the receivers at `origin`: the solid angle of each triangle that
    /// emits light to the receiver (0 for others), their sum, and the lanes in which backs of
    /// triangles may emit light to the receiver. Backs emit only if the object is two-sided, and
    /// never from a convex object to a receiver outside of it.
    #[inline(always)]
    fn solid_angles<L: SimdFloat<Scalar = S>>(
        &self,
        triangles: &[Triangle<S>],
        convex: bool,
        origin: Vec3<L>,
    ) -> ([L; MAX_FACES], L, L::Mask) {
        let mut backs = L::mask(self.two_sided);
        if convex {
            for triangle in triangles {
                let to_corner = Vec3::splat(triangle.corner) - origin;
                let height = Vec3::splat(triangle.normal).dot(to_corner);
                backs = backs.and_not(height.lt(L::zero()));
            }
        }
        let (mut angles, mut total) = ([L::zero(); MAX_FACES], L::zero());
        for (triangle, angle) in triangles.iter().zip(&mut angles) {
            let triangle = PacketTriangle::splat(triangle, origin);
            let (seen, _, height) = self.seen_triangle(&triangle, backs);
            *angle = seen.solid_angle.masked(height.lt(L::zero()));
            total += *angle;
        }
        (angles, total, backs)
    }

    /// Samples a point of each lane's triangle by `u` and `v`, which are uniform in [0, 1). Returns
    /// three values, seen from the receiver: the direction of the point, its distance, and the
    /// density \[1/sr\] of the direction. `backs` selects the lanes in which the back emits light.
    #[inline(always)]
    fn sample_triangle<L: SimdFloat<Scalar = S>>(
        &self,
        triangle: &PacketTriangle<L>,
        backs: L::Mask,
        (u, v): (L, L),
    ) -> (Vec3<L>, L, L) {
        let (seen, lifted, height) = self.seen_triangle(triangle, backs);
        // Uniform barycentric coordinates.
        let root = u.sqrt();
        let [a, b, c] = lifted;
        let point = a * (L::one() - root) + b * (root * (L::one() - v)) + c * (root * v);
        let mut distance = point.length_squared().sqrt();
        let mut wi = point * (L::one() / distance);
        if seen.by_angle.any() {
            wi = Vec3::select(seen.by_angle, seen.sample(u, v), wi);
            let to_plane = height.abs() / triangle.normal.dot(wi).abs();
            distance = L::select(seen.by_angle, to_plane, distance);
        }
        (wi, distance, triangle.density(&seen, height, distance))
    }

    /// Lifts each lane's triangle along its normal: to the back in lanes of `backs` whose receiver
    /// is behind the triangle, otherwise to the front. Returns three values: the lifted triangle as
    /// seen from the receiver, its corners relative to the receiver, and the coordinate of its
    /// plane relative to the receiver. The coordinate is measured along the normal of the side to
    /// which the triangle is lifted. It is negative in lanes whose receiver gets light.
    #[inline(always)]
    fn seen_triangle<L: SimdFloat<Scalar = S>>(
        &self,
        triangle: &PacketTriangle<L>,
        backs: L::Mask,
    ) -> (SphericalTriangle<L>, [Vec3<L>; 3], L) {
        let height = triangle.normal.dot(triangle.corners[0]);
        let ([_, _, height], behind) = self.lifted([L::zero(), L::zero(), height], backs);
        let lift = L::splat(self.lift);
        let lift = triangle.normal * L::select(behind, -lift, lift);
        let corners = triangle.corners.map(|corner| corner + lift);
        (SphericalTriangle::new(corners, height, triangle.area), corners, height)
    }

    /// Returns the density \[1/sr\] of directions that are sampled uniformly in `cone`, the cone
    /// that a sphere subtends. It is zero for receivers inside of a sphere that emits outwards
    /// only.
    #[inline(always)]
    fn cone_density<L: SimdFloat<Scalar = S>>(&self, cone: &Cone<L>) -> L {
        let density = cone.density();
        if self.two_sided { density } else { density.masked(!cone.inside) }
    }

    /// Lifts a point of a flat surface to the side of the receiver. [x, y, height] are the point's
    /// coordinates across, up and along the normal, relative to the receiver. Returns two values:
    /// the coordinates of the lifted point, and the lanes of `backs` whose receiver is behind the
    /// surface. In these lanes the sign of the third coordinate is reversed, so that this
    /// coordinate is negative in all lanes whose receiver gets light.
    #[inline(always)]
    fn lifted<L: SimdFloat<Scalar = S>>(
        &self,
        [x, y, height]: [L; 3],
        backs: L::Mask,
    ) -> ([L; 3], L::Mask) {
        let behind = backs & height.gt(L::zero());
        let height = L::select(behind, -height, height) + L::splat(self.lift);
        ([x, y, height], behind)
    }
}

/// Returns an array with the value of `f` for each lane number.
#[inline(always)]
fn lanes_of<L: SimdFloat>(f: impl Fn(usize) -> usize) -> [usize; MAX_WIDTH] {
    let mut out = [0; MAX_WIDTH];
    for (lane, out) in out.iter_mut().enumerate().take(L::WIDTH) {
        *out = f(lane);
    }
    out
}

/// Triangle of an emissive mesh in each lane, with the receiver of light at the origin.
struct PacketTriangle<L> {
    /// Corners of the triangle relative to the receiver.
    corners: [Vec3<L>; 3],
    /// Unit normal of the triangle's front.
    normal: Vec3<L>,
    /// Start of the range of random numbers in [0, 1) for which the triangle is chosen.
    start: L,
    /// Probability with which the triangle is chosen among those of the mesh.
    share: L,
    area: L,
}

impl<L: SimdFloat> PacketTriangle<L> {
    /// Returns the same triangle in all lanes, relative to the receivers at `origin`.
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

    /// Gathers the triangles with the given index in each lane, relative to the receivers at
    /// `origin`. An index past the end counts as the last triangle.
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

    /// Returns the density \[1/sr\] of a direction in which the triangle is hit at `distance`: the
    /// probability that the triangle is chosen, times the density of the direction within the
    /// triangle. `height` is the coordinate of the triangle's plane along its normal, relative to
    /// the receiver.
    #[inline(always)]
    fn density(&self, seen: &SphericalTriangle<L>, height: L, distance: L) -> L {
        let by_area = density_of_area(self.area / self.share, distance, height);
        let density = L::select(seen.by_angle, self.share / seen.solid_angle, by_area);
        density.min(L::from_f64(L::MAX)).masked(height.lt(L::zero()))
    }
}

/// Triangle as seen from a receiver point, sampled by solid angle.
///
/// Arvo 1995, *Stratified Sampling of Spherical Triangles*.
struct SphericalTriangle<L: SimdFloat> {
    /// Unit vectors from the receiver point to the triangle's corners.
    corners: [Vec3<L>; 3],
    /// Volume of the parallelepiped that the three unit vectors span.
    volume: L,
    solid_angle: L,
    /// Lanes in which the triangle is sampled by solid angle; in the others it is too small and is
    /// sampled by area.
    by_angle: L::Mask,
}

impl<L: SimdFloat> SphericalTriangle<L> {
    /// Creates the spherical triangle. `corners` are those of the triangle relative to the
    /// receiver. `height` is the coordinate of the triangle's plane along its normal, also relative
    /// to the receiver. `area` is the triangle's area.
    #[inline(always)]
    fn new(corners: [Vec3<L>; 3], height: L, area: L) -> Self {
        let inverse = corners.map(|corner| L::one() / corner.length_squared().sqrt());
        let [a, b, c] = [0, 1, 2].map(|k| corners[k] * inverse[k]);
        // Solid angle by the formula of Van Oosterom and Strackee (1983), which has no cancellation
        // at small angles.
        let inverse = inverse[0] * inverse[1] * inverse[2];
        let volume = height.abs() * (area + area) * inverse;
        let below = L::one() + a.dot(b) + b.dot(c) + c.dot(a);
        let half = volume.atan2(below);
        let solid_angle = half + half;
        let by_angle = solid_angle.ge(L::from_f64(MIN_SOLID_ANGLE * L::EPSILON));
        Self { corners: [a, b, c], volume, solid_angle, by_angle }
    }

    /// Samples a unit vector, uniformly over the solid angle of the triangle. `u` and `v` are in
    /// [0, 1).
    #[inline(always)]
    fn sample(&self, u: L, v: L) -> Vec3<L> {
        let [a, b, c] = self.corners;
        let one = L::one();
        let unit = |v: Vec3<L>| {
            let tiny = L::from_f64(L::EPSILON * L::EPSILON);
            v * (one / v.length_squared().max(tiny).sqrt())
        };
        // Angle of the triangle at the corner a.
        let cos_c = a.dot(b);
        let cross = a.cross(b).dot(a.cross(c));
        let alpha = self.volume.atan2(cross);
        let (sin_alpha, cos_alpha) = alpha.sin_cos();
        // `end` is a point of the edge from a to c. The arc from b to `end` cuts off the share `u`
        // of the triangle's area, on the side of a. q is the cosine of the angle between a and
        // `end`.
        let (s, t) = u.mul_add(self.solid_angle, -alpha).sin_cos();
        let p = t - cos_alpha;
        let r = sin_alpha.mul_add(cos_c, s);
        let above = (r * t - p * s) * cos_alpha - r;
        let q = (above / ((r * s + p * t) * sin_alpha)).min(one).max(-one);
        let across = unit(c - a * c.dot(a));
        let end = a * q + across * (one - q * q).max(L::zero()).sqrt();
        // A point of the arc from b to `end`.
        let cos_end = end.dot(b);
        let z = one - v * (one - cos_end);
        let along = unit(end - b * cos_end);
        (b * z + along * (one - z * z).max(L::zero()).sqrt()).renormalize()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIFT: f64 = 1e-10;

    /// Returns one light-emitting surface of every kind. The points of [`points`] are in front of,
    /// behind, beside and inside of these surfaces.
    fn surfaces() -> Vec<ObjectSurface> {
        let tetrahedron = [
            DVec3::new(0.0, 0.0, 0.0),
            DVec3::new(1.0, 0.1, 0.0),
            DVec3::new(0.2, 0.9, 0.1),
            DVec3::new(0.3, 0.2, 1.1),
        ];
        let faces = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
        let [x, y, z] = DVec3::AXES;
        vec![
            ObjectSurface::Sphere { center: DVec3::ZERO, radius: 0.6 },
            ObjectSurface::Rectangle { center: DVec3::ZERO, axes: [x, y, z], size: [1.0, 0.4] },
            ObjectSurface::Triangles(vec![[x, y, -x - y]]),
            ObjectSurface::ConvexTriangles(faces.map(|face| face.map(|i| tetrahedron[i])).into()),
            ObjectSurface::Triangles(grid()),
        ]
    }

    /// Returns a bent sheet of more than [`MAX_FACES`] triangles.
    fn grid() -> Vec<[DVec3; 3]> {
        let corner = |i: usize, j: usize| {
            let (x, y) = (0.2 * i as f64 - 0.5, 0.3 * j as f64 - 0.6);
            DVec3::new(x, y, 0.4 * x * y - 0.1)
        };
        let squares = (0..5).flat_map(|i| (0..4).map(move |j| (i, j)));
        let halves = squares.flat_map(|(i, j)| {
            let [a, b, c, d] =
                [corner(i, j), corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1)];
            [[a, b, c], [a, c, d]]
        });
        halves.collect()
    }

    /// Returns the receiver points for which the tests sample the surfaces of [`surfaces`].
    fn points() -> Vec<DVec3> {
        let points = [[0.1, 0.2, 1.5], [0.3, -0.1, -0.8], [2.0, 0.1, 0.2], [0.25, 0.2, 0.05]];
        [points.map(DVec3::from).into(), vec![DVec3::new(40.0, 30.0, 20.0)]].concat()
    }

    fn numbers(i: u32) -> (f64, f64) {
        let unit = |x: f64| x - x.floor();
        // R2 sequence of Roberts (2018): points that cover the unit square evenly.
        (
            unit(0.5 + f64::from(i) * 0.754_877_666_246_69),
            unit(0.5 + f64::from(i) * 0.569_840_290_998_05),
        )
    }

    #[test]
    fn density_of_a_hit_is_that_of_the_sample() {
        for surface in surfaces() {
            let emitter = ObjectEmitter::<f64>::new(&surface, true, LIFT).unwrap();
            for point in points() {
                let origin = Vec3::<f64>::of(point.to_array());
                for i in 0..200 {
                    let (u, v) = numbers(i);
                    let sample = emitter.sample(origin, (u, v));
                    let triangle = match &emitter.surface {
                        CompiledSurface::Mesh(triangles) => {
                            triangles.partition_point(|triangle| triangle.end <= u)
                        }
                        _ => 0,
                    };
                    let triangle = f64::from_id(triangle as u32);
                    let found = emitter.density(origin, sample.distance, triangle);
                    assert!(
                        (found - sample.density).abs() <= 1e-6 * sample.density,
                        "{surface:?} from {point}, sample {i}: {found}, sampled {}",
                        sample.density
                    );
                    assert!((sample.density * sample.irradiance - 1.0).abs() < 1e-9);
                }
            }
        }
    }

    /// Checks the mean of 1 / density over the sampled directions. It must be the sum of the solid
    /// angles of all triangles, because both sides emit light. For a convex solid seen from outside
    /// it must be half of this sum, because only the fronts emit to the receiver.
    #[test]
    fn samples_of_triangles_cover_their_solid_angle() {
        for surface in surfaces() {
            let (triangles, convex) = match &surface {
                ObjectSurface::Triangles(triangles) => (triangles, false),
                ObjectSurface::ConvexTriangles(triangles) => (triangles, true),
                _ => continue,
            };
            let emitter = ObjectEmitter::<f64>::new(&surface, true, LIFT).unwrap();
            for point in points() {
                let origin = Vec3::<f64>::of(point.to_array());
                let solid_angle = |corners: &[DVec3; 3]| {
                    let [a, b, c] = corners.map(|corner| (corner - point).normalize());
                    let below = 1.0 + a.dot(b) + b.dot(c) + c.dot(a);
                    2.0 * a.cross(b).dot(c).abs().atan2(below)
                };
                let mut expected: f64 = triangles.iter().map(solid_angle).sum();
                let in_front = |[a, b, c]: &[DVec3; 3]| (b - a).cross(c - a).dot(point - a) > 0.0;
                if convex && triangles.iter().any(in_front) {
                    expected *= 0.5;
                }
                let count = 20_000;
                let sum: f64 =
                    (0..count).map(|i| emitter.sample(origin, numbers(i)).irradiance).sum();
                let mean = sum / f64::from(count);
                let limit = if triangles.len() > MAX_FACES { 1e-2 } else { 1e-9 };
                assert!(
                    (mean - expected).abs() < limit * expected,
                    "{surface:?} from {point}: {mean}, expected {expected}"
                );
            }
        }
    }

    #[test]
    fn one_sided_surfaces_are_dark_from_behind() {
        let [front, back] = [DVec3::new(0.1, 0.2, 1.5), DVec3::new(0.1, 0.2, -1.5)];
        for surface in &surfaces()[1..3] {
            let emitter = ObjectEmitter::<f64>::new(surface, false, LIFT).unwrap();
            let irradiance = |point: DVec3| {
                emitter.sample(Vec3::<f64>::of(point.to_array()), (0.3, 0.6)).irradiance
            };
            assert!(irradiance(front) > 0.0 && irradiance(back) == 0.0, "{surface:?}");
        }
        let ball = ObjectEmitter::<f64>::new(&surfaces()[0], false, LIFT).unwrap();
        let irradiance =
            |x: f64| ball.sample(Vec3::<f64>::of([x, 0.0, 0.0]), (0.3, 0.6)).irradiance;
        assert!(irradiance(0.7) > 0.0 && irradiance(0.5) == 0.0);
    }

    #[test]
    fn surfaces_without_area_are_no_emitters() {
        let point = ObjectSurface::Triangles(vec![[DVec3::X; 3]]);
        assert!(ObjectEmitter::<f32>::new(&point, true, LIFT).is_none());
        assert!(ObjectEmitter::<f32>::new(&ObjectSurface::Triangles(vec![]), true, LIFT).is_none());
    }
}
