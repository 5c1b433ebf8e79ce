//! Emitters: surfaces that emit light, compiled for the kernels. A light with a size is an emissive
//! surface without a body; an emissive object is one with a body.
//!
//! A point that is sampled on an object is lifted off its surface, to the side of the receiver (the
//! point that it lights), so that the object does not occlude it. The lift is along the normal and
//! larger than the rounding errors of the surface. It therefore suffices for rays at any angle.

use crate::light::solid_angle::{Cone, SphericalRectangle, density_of_area};
use crate::light::triangles::{FacesSeen, MAX_FACES, Triangle};
use crate::light::{EmissiveSurface, LightSample, LightUnit};
use glam::DVec3;
use std::f64::consts::{PI, TAU};
use zerkalo_kernel::lanes::{Float, Frame, SimdFloat, Vec3};
use zerkalo_kernel::sampling::warp;

/// Radius of a sphere around all points of every scene.
const EVERYWHERE: f64 = 1e30;

/// Distance that is reported for a distant disk, as a fraction of the largest finite number, which
/// is the distance of rays that hit nothing.
const DISTANT: f64 = 0.5;

/// Surface that emits light of intensity 1, white and the same at every point and in every
/// direction.
#[derive(Clone, Debug)]
pub struct Emitter<S> {
    pub(super) surface: Surface<S>,
    pub(super) sides: Sides<S>,
    pub radiance: S,
    /// Centre of a bounding sphere of all sampled points, relative to the scene's centre.
    pub center: DVec3,
    /// Radius of the bounding sphere around `center`.
    pub radius: f64,
    pub area: f64,
}

#[derive(Clone, Debug)]
pub(super) enum Surface<S> {
    Sphere {
        center: [S; 3],
        radius: S,
    },
    Rectangle {
        center: [S; 3],
        axes: [[S; 3]; 3],
        size: [S; 2],
    },
    Disk {
        center: [S; 3],
        axes: [[S; 3]; 3],
        radius: S,
    },
    /// Up to [`MAX_FACES`] triangles, chosen in proportion to their solid angles.
    Faces {
        triangles: Vec<Triangle<S>>,
        /// `true` if the triangles enclose a convex solid; no triangle then occludes another.
        convex: bool,
    },
    /// Disk at an infinite distance: a cone of directions.
    DistantDisk {
        axis: [S; 3],
        /// 1 - cos(angular radius).
        one_minus_cos: S,
    },
    /// More than [`MAX_FACES`] triangles, chosen in proportion to their areas.
    Mesh(Vec<Triangle<S>>),
}

/// Sides of a surface that emit light, and the height above them at which points are sampled.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sides<S> {
    pub lift: S,
    /// `true` if the back emits light, too. The back is the other side of a flat surface, or the
    /// inner side of the surface of a solid.
    pub both: bool,
}

impl<S: Float> Sides<S> {
    /// Lifts a point of a flat surface to the side of the receiver. [x, y, height] are the point's
    /// coordinates across, up and along the normal, relative to the receiver. Returns the
    /// coordinates of the lifted point, and the lanes of `backs` whose receiver is behind the
    /// surface. In these lanes the sign of the height is reversed, so that it is negative in all
    /// lanes whose receiver gets light.
    #[inline(always)]
    pub fn lifted<L: SimdFloat<Scalar = S>>(
        &self,
        [x, y, height]: [L; 3],
        backs: L::Mask,
    ) -> ([L; 3], L::Mask) {
        lifted([x, y, height], (L::splat(self.lift), backs))
    }

    /// Returns the lift, and the lanes whose back emits light: the same in all lanes.
    #[inline(always)]
    fn lanes<L: SimdFloat<Scalar = S>>(&self) -> LaneSides<L> {
        (L::splat(self.lift), L::mask(self.both))
    }

    /// Returns the density [1/sr] of directions that are sampled uniformly in the cone that a
    /// sphere subtends. It is zero for receivers inside a sphere that emits outwards only.
    #[inline(always)]
    fn cone_density<L: SimdFloat<Scalar = S>>(&self, cone: &Cone<L>) -> L {
        let density = cone.density();
        if self.both { density } else { density.masked(!cone.inside) }
    }
}

/// Lift of each lane's surface, and the lanes whose backs emit light; see [`Sides`].
pub(super) type LaneSides<L> = (L, <L as SimdFloat>::Mask);

/// Result of [`Sides::lifted`] for the surface of each lane.
#[inline(always)]
fn lifted<L: SimdFloat>([x, y, height]: [L; 3], (lift, backs): LaneSides<L>) -> ([L; 3], L::Mask) {
    let behind = backs & height.gt(L::zero());
    let height = L::select(behind, -height, height) + lift;
    ([x, y, height], behind)
}

/// Sampled point of an emitter, as seen from the receiver.
pub(super) struct PointSample<L: SimdFloat> {
    pub wi: Vec3<L>,
    pub distance: L,
    /// Density [1/sr] of this direction over all triangles, for multiple importance sampling.
    pub density: L,
    /// Density [1/sr] by which the radiance is divided; zero if no light arrives.
    pub pdf: L,
}

impl<L: SimdFloat> PointSample<L> {
    /// Returns samples without light.
    #[inline(always)]
    pub fn nothing() -> Self {
        let wi = Vec3::of([0.0, 0.0, 1.0]);
        Self { wi, distance: L::one(), density: L::zero(), pdf: L::zero() }
    }

    /// Returns the light of the sampled points, whose radiance is `radiance`.
    #[inline(always)]
    pub fn with_radiance(self, radiance: L) -> LightSample<L> {
        let Self { wi, distance, density, pdf } = self;
        let arrives = pdf.gt(L::zero());
        // The irradiance is kept finite, because infinity times a black reflectance would be NaN.
        let irradiance = (radiance / pdf).min(L::from_f64(L::MAX));
        LightSample { wi, distance, irradiance: Vec3::gray(irradiance.masked(arrives)), density }
    }
}

/// Samples a point of each lane's sphere by the cone that the sphere subtends.
#[inline(always)]
pub(super) fn sample_sphere<L: SimdFloat>(
    to_center: Vec3<L>,
    radius: L,
    (lift, both): LaneSides<L>,
    (u, v): (L, L),
) -> PointSample<L> {
    let cone = Cone::new(to_center, radius);
    let local = warp::cone(u, v, cone.one_minus_cos);
    let wi = Frame::around(cone.axis).to_world(local).renormalize();
    // Distance to the lifted point in the sampled direction. The lifted point is on a concentric
    // sphere, which is larger by the lift if the receiver is outside, and smaller by the lift if
    // the receiver is inside.
    let sin2 = local.x * local.x + local.y * local.y;
    let outer = radius + lift;
    let root2 = outer * outer - cone.distance2 * sin2;
    let near = cone.distance2.sqrt() * local.z - root2.max(L::zero()).sqrt();
    let (along, inner) = (to_center.dot(wi), radius - lift);
    let root2 = along * along + inner * inner - cone.distance2;
    let far = along + root2.max(L::zero()).sqrt();
    let distance = L::select(cone.inside, far, near).max(L::zero());
    let density = cone.density().masked(both | !cone.inside);
    PointSample { wi, distance, density, pdf: density }
}

/// Samples a point of each lane's rectangle by solid angle. `axis` returns the axis with a number; one
/// that is the same in all lanes is built at each use, because nine vectors do not stay in registers.
#[inline(always)]
pub(super) fn sample_rectangle<L: SimdFloat>(
    to_center: Vec3<L>,
    axis: impl Fn(usize) -> Vec3<L>,
    size: [L; 2],
    sides: LaneSides<L>,
    (u, v): (L, L),
) -> PointSample<L> {
    let ([x, y, height], behind) = lifted(local_of(&axis, to_center), sides);
    let rectangle = SphericalRectangle::new(size, [x, y, height]);
    let [x, y] = rectangle.sample(u, v);
    let height = L::select(behind, -height, height);
    let (wi, distance) = towards(&axis, [x, y, height]);
    let density = rectangle.density(distance);
    PointSample { wi, distance, density, pdf: density }
}

/// Samples a point of each lane's disk by area. `axis` is as in [`sample_rectangle`].
#[inline(always)]
pub(super) fn sample_disk<L: SimdFloat>(
    to_center: Vec3<L>,
    axis: impl Fn(usize) -> Vec3<L>,
    radius: L,
    area: L,
    (u, v): (L, L),
) -> PointSample<L> {
    let local = local_of(&axis, to_center);
    let (x, y, _) = warp::disk(u, v);
    let (x, y) = (x.mul_add(radius, local[0]), y.mul_add(radius, local[1]));
    let (wi, distance) = towards(&axis, [x, y, local[2]]);
    let density = density_of_area(area, distance, local[2]);
    PointSample { wi, distance, density, pdf: density }
}

impl<S: Float> Emitter<S> {
    /// Compiles the surface of a light, in coordinates relative to `origin`, the scene's centre.
    ///
    /// Rounding could hide a surface that touches an object. It is therefore lifted by `lift`. A
    /// flat surface moves to its front. A sphere grows and keeps its power. Returns `None` if the
    /// surface has no area.
    pub fn without_body(
        mut surface: EmissiveSurface,
        unit: LightUnit,
        origin: DVec3,
        lift: f64,
    ) -> Option<Self> {
        let mut area = surface.area();
        let mut radiance = match unit {
            LightUnit::Radiance => 1.0,
            LightUnit::Power => 1.0 / (PI * area),
        };
        let rounded = |x: f64| S::from_f64(x).to_f64();
        let mut both_sides = false;
        match &mut surface {
            EmissiveSurface::Sphere { center, radius } => {
                let lifted = *radius + lift;
                let growth = (lifted / *radius).powi(2);
                (area, radiance) = (area * growth, radiance / growth);
                (*center, *radius) = ((*center - origin).map(rounded), rounded(lifted));
                both_sides = true;
            }
            EmissiveSurface::Rectangle { center, axes, size } => {
                *center = (*center - origin + axes[2] * lift).map(rounded);
                *size = size.map(rounded);
            }
            EmissiveSurface::Disk { center, axes, radius } => {
                *center = (*center - origin + axes[2] * lift).map(rounded);
                *radius = rounded(*radius);
            }
            EmissiveSurface::Triangles(triangles) | EmissiveSurface::ConvexTriangles(triangles) => {
                triangles.iter_mut().flatten().for_each(|corner| *corner -= origin);
            }
        }
        Some(Self {
            radiance: S::from_f64(radiance),
            area: rounded(area),
            ..Self::of_object(&surface, both_sides, 0.0)?
        })
    }

    /// Compiles the surface of an emissive object of radiance 1, in coordinates relative to the
    /// scene's centre. Its back emits light, too, if `both_sides` is `true`. `lift` is the height
    /// of sampled points above the surface; it is limited to 1e-4 of the surface's thickness.
    /// Returns `None` if the surface has no area.
    pub fn of_object(surface: &EmissiveSurface, both_sides: bool, lift: f64) -> Option<Self> {
        let (area, radius) = (surface.area(), surface.radius());
        if !(area > 0.0 && area.is_finite() && radius.is_finite()) {
            return None;
        }
        let lift = lift.min(1e-4 * surface.thickness());
        Some(Self {
            surface: Surface::new(surface),
            sides: Sides { lift: S::from_f64(lift), both: both_sides },
            radiance: S::from_f64(1.0),
            center: surface.center(),
            radius: radius + lift,
            area,
        })
    }

    /// Creates a disk at an infinite distance around the direction `wi`, with the angular radius
    /// `radius` in radians. The irradiance on a surface that faces it is pi.
    pub fn distant_disk(wi: DVec3, radius: f64) -> Self {
        let one_minus_cos = S::from_f64(2.0 * (0.5 * radius).sin().powi(2));
        let axis = wi.to_array().map(S::from_f64);
        Self {
            surface: Surface::DistantDisk { axis, one_minus_cos },
            sides: Sides { lift: S::default(), both: false },
            radiance: S::from_f64(radius.sin().powi(-2)),
            center: DVec3::ZERO,
            radius: EVERYWHERE,
            area: f64::INFINITY,
        }
    }

    /// Returns the normal of the only side of a flat surface that emits light; `None` if there are
    /// several or if the surface is not flat.
    pub fn normal(&self) -> Option<DVec3> {
        match &self.surface {
            Surface::Rectangle { axes, .. } | Surface::Disk { axes, .. } => {
                (!self.sides.both).then(|| DVec3::from(axes[2].map(S::to_f64)))
            }
            Surface::Sphere { .. }
            | Surface::DistantDisk { .. }
            | Surface::Faces { .. }
            | Surface::Mesh(_) => None,
        }
    }

    pub fn is_distant(&self) -> bool {
        matches!(self.surface, Surface::DistantDisk { .. })
    }

    /// Returns the distance at which each ray hits the front of a surface without a body; the
    /// largest finite number for a miss. `direction` must be of unit length. Rays miss triangles
    /// here, because these are part of the geometry.
    #[inline(always)]
    pub fn hit<L: SimdFloat<Scalar = S>>(&self, origin: Vec3<L>, direction: Vec3<L>) -> L {
        let missed = L::from_f64(L::MAX);
        match &self.surface {
            Surface::Sphere { center, radius } => {
                let to_center = Vec3::splat(*center) - origin;
                let radius2 = L::splat(*radius) * L::splat(*radius);
                let along = to_center.dot(direction);
                let across = to_center - direction * along;
                let root2 = radius2 - across.length_squared();
                let root = root2.max(L::zero()).sqrt();
                // Power of the ray's origin with respect to the sphere: squared distance to the
                // centre minus squared radius. It is positive outside the sphere.
                let power = to_center.length_squared() - radius2;
                let outside = power.gt(L::zero());
                let t = L::select(outside, power / (along + root), along + root);
                let hits = root2.ge(L::zero()) & (!outside | along.gt(L::zero()));
                L::select(hits & t.ge(L::zero()), t, missed)
            }
            Surface::Rectangle { center, axes, size } => {
                let (t, [x, y]) = plane_hit(axes, Vec3::splat(*center) - origin, direction);
                let half = L::from_f64(0.5);
                let inside = x.abs().le(L::splat(size[0]) * half)
                    & y.abs().le(L::splat(size[1]) * half)
                    & t.ge(L::zero());
                L::select(inside, t, missed)
            }
            Surface::Disk { center, axes, radius } => {
                let (t, [x, y]) = plane_hit(axes, Vec3::splat(*center) - origin, direction);
                let radius = L::splat(*radius);
                let inside = (x * x + y * y).le(radius * radius) & t.ge(L::zero());
                L::select(inside, t, missed)
            }
            Surface::DistantDisk { axis, one_minus_cos } => {
                let inside =
                    warp::cone_pdf(Vec3::splat(*axis), direction, L::splat(*one_minus_cos));
                L::select(inside.gt(L::zero()), L::from_f64(DISTANT * L::MAX), missed)
            }
            Surface::Faces { .. } | Surface::Mesh(_) => missed,
        }
    }

    /// Samples a point of the surface for each of the receivers at `origin`. `u` and `v` are uniform
    /// in [0, 1).
    ///
    /// A sphere or distant disk is sampled by the cone that it subtends, a rectangle by solid
    /// angle, a disk by area. One triangle is chosen: in proportion to its solid angle if there are
    /// at most 32, to its area if there are more. The chosen triangle is sampled by solid angle.
    /// Rectangles and triangles whose solid angle is too small for this are sampled by area.
    #[inline(never)]
    pub fn sample<L: SimdFloat<Scalar = S>>(
        &self,
        origin: Vec3<L>,
        (u, v): (L, L),
    ) -> LightSample<L> {
        let point = match &self.surface {
            Surface::Sphere { center, radius } => {
                let to_center = Vec3::splat(*center) - origin;
                sample_sphere(to_center, L::splat(*radius), self.sides.lanes(), (u, v))
            }
            Surface::Rectangle { center, axes, size } => {
                let (to_center, size) = (Vec3::splat(*center) - origin, size.map(L::splat));
                let axis = |i: usize| Vec3::splat(axes[i]);
                sample_rectangle(to_center, axis, size, self.sides.lanes(), (u, v))
            }
            Surface::Disk { center, axes, radius } => {
                let to_center = Vec3::splat(*center) - origin;
                let (radius, area) = (L::splat(*radius), L::from_f64(self.area));
                sample_disk(to_center, |i| Vec3::splat(axes[i]), radius, area, (u, v))
            }
            Surface::DistantDisk { axis, one_minus_cos } => {
                let local = warp::cone(u, v, L::splat(*one_minus_cos));
                let wi = Frame::around(Vec3::splat(*axis)).to_world(local).renormalize();
                let distance = L::from_f64(DISTANT * L::MAX);
                let density = density_of_cone(L::splat(*one_minus_cos));
                PointSample { wi, distance, density, pdf: density }
            }
            Surface::Faces { triangles, convex } => {
                FacesSeen::new(triangles, *convex, &self.sides, origin).sample((u, v))
            }
            Surface::Mesh(triangles) => {
                Triangle::sample_by_area(triangles, &self.sides, origin, (u, v))
            }
        };
        point.with_radiance(L::splat(self.radiance))
    }

    /// Returns the density [1/sr] with which [`Emitter::sample`] draws the direction of a ray from
    /// `origin` that hits the surface at `distance`. If the surface is a mesh, `triangle` is the
    /// index of the hit triangle, encoded by [`SimdFloat::from_id`].
    #[inline(never)]
    pub fn density<L: SimdFloat<Scalar = S>>(
        &self,
        origin: Vec3<L>,
        distance: L,
        triangle: L,
    ) -> L {
        match &self.surface {
            Surface::Sphere { center, radius } => {
                let to_center = Vec3::splat(*center) - origin;
                self.sides.cone_density(&Cone::new(to_center, L::splat(*radius)))
            }
            Surface::Rectangle { center, axes, size } => {
                let to_center = Vec3::splat(*center) - origin;
                let local = local_of(&|i| Vec3::splat(axes[i]), to_center);
                let (local, _) = self.sides.lifted(local, L::mask(self.sides.both));
                SphericalRectangle::new(size.map(L::splat), local).density(distance)
            }
            Surface::Disk { center, axes, .. } => {
                let to_center = Vec3::splat(*center) - origin;
                let [_, _, height] = local_of(&|i| Vec3::splat(axes[i]), to_center);
                density_of_area(L::from_f64(self.area), distance, height)
            }
            Surface::DistantDisk { one_minus_cos, .. } => density_of_cone(L::splat(*one_minus_cos)),
            Surface::Faces { triangles, convex } => {
                FacesSeen::new(triangles, *convex, &self.sides, origin).density()
            }
            Surface::Mesh(triangles) => {
                Triangle::density_by_area(triangles, &self.sides, origin, (distance, triangle))
            }
        }
    }
}

impl<S: Float> Surface<S> {
    fn new(surface: &EmissiveSurface) -> Self {
        let vector = |v: DVec3| v.to_array().map(S::from_f64);
        match surface {
            EmissiveSurface::Sphere { center, radius } => {
                Self::Sphere { center: vector(*center), radius: S::from_f64(*radius) }
            }
            EmissiveSurface::Rectangle { center, axes, size } => Self::Rectangle {
                center: vector(*center),
                axes: axes.map(vector),
                size: size.map(S::from_f64),
            },
            EmissiveSurface::Disk { center, axes, radius } => Self::Disk {
                center: vector(*center),
                axes: axes.map(vector),
                radius: S::from_f64(*radius),
            },
            EmissiveSurface::Triangles(corners) | EmissiveSurface::ConvexTriangles(corners) => {
                let triangles = Triangle::list(corners);
                let convex = matches!(surface, EmissiveSurface::ConvexTriangles(_));
                match triangles.len() <= MAX_FACES {
                    true => Self::Faces { triangles, convex },
                    false => Self::Mesh(triangles),
                }
            }
        }
    }
}

/// Returns the density [1/sr] of uniform directions in a cone with the half-angle theta, where
/// `one_minus_cos` is 1 - cos(theta).
#[inline(always)]
fn density_of_cone<L: SimdFloat>(one_minus_cos: L) -> L {
    L::one() / (one_minus_cos * L::from_f64(TAU))
}

#[inline(always)]
fn local_of<L: SimdFloat>(axis: &impl Fn(usize) -> Vec3<L>, v: Vec3<L>) -> [L; 3] {
    [axis(0).dot(v), axis(1).dot(v), axis(2).dot(v)]
}

/// Returns the direction and the length of the vector with the components [x, y, z] along the axes.
#[inline(always)]
fn towards<L: SimdFloat>(axis: &impl Fn(usize) -> Vec3<L>, [x, y, z]: [L; 3]) -> (Vec3<L>, L) {
    let distance = (x * x + y * y + z * z).sqrt();
    let inverse = L::one() / distance;
    ((axis(0) * x + axis(1) * y + axis(2) * z) * inverse, distance)
}

/// Returns where each ray meets the plane of a flat emitter: the distance, negative for rays that
/// do not meet its front, and the coordinates across and up. `to_center` is the vector from the
/// rays' origin to the emitter's centre.
#[inline(always)]
fn plane_hit<L: SimdFloat>(
    axes: &[[L::Scalar; 3]; 3],
    to_center: Vec3<L>,
    direction: Vec3<L>,
) -> (L, [L; 2]) {
    let axis = |i: usize| Vec3::splat(axes[i]);
    let [center_x, center_y, height] = local_of(&axis, to_center);
    let [x, y, slope] = local_of(&axis, direction);
    let meets_front = slope.lt(L::zero()) & height.lt(L::zero());
    let t = L::select(meets_front, height / slope, -L::one());
    (t, [x.mul_add(t, -center_x), y.mul_add(t, -center_y)])
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIFT: f64 = 1e-10;

    /// Returns spheres, rectangles and triangles that emit light. The points of [`points`] are in
    /// front of, behind, beside and inside these surfaces.
    fn surfaces() -> Vec<EmissiveSurface> {
        let tetrahedron = [
            DVec3::new(0.0, 0.0, 0.0),
            DVec3::new(1.0, 0.1, 0.0),
            DVec3::new(0.2, 0.9, 0.1),
            DVec3::new(0.3, 0.2, 1.1),
        ];
        let faces = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
        let [x, y, z] = DVec3::AXES;
        vec![
            EmissiveSurface::Sphere { center: DVec3::ZERO, radius: 0.6 },
            EmissiveSurface::Rectangle { center: DVec3::ZERO, axes: [x, y, z], size: [1.0, 0.4] },
            EmissiveSurface::Triangles(vec![[x, y, -x - y]]),
            EmissiveSurface::ConvexTriangles(faces.map(|face| face.map(|i| tetrahedron[i])).into()),
            EmissiveSurface::Triangles(grid()),
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
            let emitter = Emitter::<f64>::of_object(&surface, true, LIFT).unwrap();
            for point in points() {
                let origin = Vec3::<f64>::of(point.to_array());
                for i in 0..200 {
                    let (u, v) = numbers(i);
                    let sample = emitter.sample(origin, (u, v));
                    let triangle = match &emitter.surface {
                        Surface::Mesh(triangles) => Triangle::index_of(triangles, u),
                        _ => 0,
                    };
                    let triangle = f64::from_id(triangle as u32);
                    let found = emitter.density(origin, sample.distance, triangle);
                    assert!(
                        (found - sample.density).abs() <= 1e-6 * sample.density,
                        "{surface:?} from {point}, sample {i}: {found}, sampled {}",
                        sample.density
                    );
                    assert!((sample.density * sample.irradiance.x - 1.0).abs() < 1e-9);
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
                EmissiveSurface::Triangles(triangles) => (triangles, false),
                EmissiveSurface::ConvexTriangles(triangles) => (triangles, true),
                _ => continue,
            };
            let emitter = Emitter::<f64>::of_object(&surface, true, LIFT).unwrap();
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
                    (0..count).map(|i| emitter.sample(origin, numbers(i)).irradiance.x).sum();
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
            let emitter = Emitter::<f64>::of_object(surface, false, LIFT).unwrap();
            let irradiance = |point: DVec3| {
                emitter.sample(Vec3::<f64>::of(point.to_array()), (0.3, 0.6)).irradiance.x
            };
            assert!(irradiance(front) > 0.0 && irradiance(back) == 0.0, "{surface:?}");
        }
        let ball = Emitter::<f64>::of_object(&surfaces()[0], false, LIFT).unwrap();
        let irradiance =
            |x: f64| ball.sample(Vec3::<f64>::of([x, 0.0, 0.0]), (0.3, 0.6)).irradiance.x;
        assert!(irradiance(0.7) > 0.0 && irradiance(0.5) == 0.0);
    }

    #[test]
    fn surfaces_without_area_are_no_emitters() {
        let point = EmissiveSurface::Triangles(vec![[DVec3::X; 3]]);
        assert!(Emitter::<f32>::of_object(&point, true, LIFT).is_none());
        assert!(
            Emitter::<f32>::of_object(&EmissiveSurface::Triangles(vec![]), true, LIFT).is_none()
        );
    }
}
