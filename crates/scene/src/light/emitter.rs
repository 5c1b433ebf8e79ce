//! Compiled lights with a size (emitters): ray intersection, sampling by solid angle or area,
//! densities.

use crate::light::area::EmitterSurface;
use crate::light::{Light, LightUnit};
use glam::DVec3;
use std::f64::consts::{PI, TAU};
use zerkalo_kernel::lanes::{Float, Frame, Mask, SimdFloat, Vec3};
use zerkalo_kernel::sampling::warp;

/// Smallest solid angle \[sr\] at which a rectangle or triangle is sampled by solid angle, as a
/// multiple of the rounding error (epsilon) of the number type. Surfaces of smaller solid angle are
/// sampled by area. At this solid angle, rounding moves the sampled points by 1e-5 of the surface's
/// size.
pub(super) const MIN_SOLID_ANGLE: f64 = 2e5;

/// Surface of a compiled light with a size.
#[derive(Clone, Copy, Debug)]
enum Surface<S> {
    Sphere {
        radius: S,
    },
    /// Rectangle with three axes: across, up, and the normal of the side that emits light.
    Rectangle {
        axes: [[S; 3]; 3],
        size: [S; 2],
    },
    Disk {
        axes: [[S; 3]; 3],
        radius: S,
    },
}

/// Emitter: a light of finite size, compiled for the kernels. It emits white light of intensity 1.
/// Colour and intensity are applied later, by the weights of its light group (the lights that share
/// sums in the film).
#[derive(Clone, Copy, Debug)]
pub struct Emitter<S> {
    surface: Surface<S>,
    center: [S; 3],
    /// Area of the surface that emits light \[scene units²\].
    area: S,
    /// Radiance of the emitter for white colour and intensity 1, the same at every point and in
    /// every direction.
    pub radiance: S,
}

/// Light that arrives at surface points from sampled points of an emitter, one point per lane.
#[derive(Clone, Copy, Debug)]
pub struct EmitterSample<L> {
    /// Unit vector from the surface point towards the sampled point.
    pub wi: Vec3<L>,
    /// Distance from the surface point to the sampled point.
    pub distance: L,
    /// Probability density \[1/sr\] with which the direction `wi` is sampled; zero if no light
    /// arrives.
    pub density: L,
    /// Estimate of the irradiance from one sample: the radiance of the emitter divided by
    /// `density`. Zero if no light arrives.
    pub irradiance: L,
}

impl<S: Float> Emitter<S> {
    /// Compiles `light`. Positions become relative to `origin`, the scene's centre. Returns `None`
    /// if the light has no size or no direction.
    ///
    /// Rounding could hide an emitter that touches an object. The surface is therefore lifted by
    /// `lift`. A flat emitter moves in the direction that its emitting side faces. A sphere grows
    /// and keeps its power.
    pub fn new(light: &Light, origin: DVec3, lift: f64) -> Option<Self> {
        let surface = light.surface()?;
        let frame = surface.frame()?;
        let vector = |v: DVec3| v.to_array().map(S::from_f64);
        let mut radiance = match light.unit {
            LightUnit::Radiance => 1.0,
            LightUnit::Power => 1.0 / (PI * surface.area()),
        };
        let mut area = surface.area();
        let mut center = surface.center() - origin;
        let axes = frame.map(vector);
        let surface = match surface {
            EmitterSurface::Sphere(sphere) => {
                let radius = sphere.radius + lift;
                let growth = (radius / sphere.radius).powi(2);
                (area, radiance) = (area * growth, radiance / growth);
                Surface::Sphere { radius: S::from_f64(radius) }
            }
            EmitterSurface::Rectangle(rectangle) => {
                center += frame[2] * lift;
                Surface::Rectangle { axes, size: rectangle.size.map(S::from_f64) }
            }
            EmitterSurface::Disk(disk) => {
                center += frame[2] * lift;
                Surface::Disk { axes, radius: S::from_f64(disk.radius) }
            }
        };
        Some(Self {
            surface,
            center: vector(center),
            area: S::from_f64(area),
            radiance: S::from_f64(radiance),
        })
    }

    /// Returns the centre of the surface, relative to the scene's centre.
    pub fn center(&self) -> DVec3 {
        DVec3::from(self.center.map(S::to_f64))
    }

    /// Returns the radius of a sphere around the centre that contains the surface.
    pub fn radius(&self) -> f64 {
        match &self.surface {
            Surface::Sphere { radius } | Surface::Disk { radius, .. } => radius.to_f64(),
            Surface::Rectangle { size: [width, height], .. } => {
                0.5 * width.to_f64().hypot(height.to_f64())
            }
        }
    }

    /// Returns the area that emits light \[scene units²\].
    pub fn area(&self) -> f64 {
        self.area.to_f64()
    }

    /// Returns the distance at which each ray hits the side that emits light; the largest finite
    /// number for rays that miss it. `direction` must be of unit length.
    #[inline(always)]
    pub fn hit<L: SimdFloat<Scalar = S>>(&self, origin: Vec3<L>, direction: Vec3<L>) -> L {
        let to_center = Vec3::splat(self.center) - origin;
        let missed = L::from_f64(L::MAX);
        match &self.surface {
            Surface::Sphere { radius } => {
                let radius2 = L::splat(*radius) * L::splat(*radius);
                let along = to_center.dot(direction);
                let across = to_center - direction * along;
                let root2 = radius2 - across.length_squared();
                let root = root2.max(L::zero()).sqrt();
                // Power of the ray's origin with respect to the sphere: squared distance to the
                // centre minus squared radius. It is positive outside of the sphere.
                let power = to_center.length_squared() - radius2;
                let outside = power.gt(L::zero());
                let t = L::select(outside, power / (along + root), along + root);
                let hits = root2.ge(L::zero()) & (!outside | along.gt(L::zero()));
                L::select(hits & t.ge(L::zero()), t, missed)
            }
            Surface::Rectangle { axes, size } => {
                let (t, [x, y]) = plane_hit(axes, to_center, direction);
                let half = L::from_f64(0.5);
                let inside = x.abs().le(L::splat(size[0]) * half)
                    & y.abs().le(L::splat(size[1]) * half)
                    & t.ge(L::zero());
                L::select(inside, t, missed)
            }
            Surface::Disk { axes, radius } => {
                let (t, [x, y]) = plane_hit(axes, to_center, direction);
                let radius = L::splat(*radius);
                let inside = (x * x + y * y).le(radius * radius) & t.ge(L::zero());
                L::select(inside, t, missed)
            }
        }
    }

    /// Samples a point of the emitter for each of the surface points `origin`. `u` and `v` are
    /// uniform in [0, 1). A sphere is sampled uniformly in the cone of directions that it subtends.
    /// A rectangle is sampled by solid angle, or by area if its solid angle is tiny. A disk is
    /// sampled by area.
    #[inline(always)]
    pub fn sample<L: SimdFloat<Scalar = S>>(
        &self,
        origin: Vec3<L>,
        (u, v): (L, L),
    ) -> EmitterSample<L> {
        let to_center = Vec3::splat(self.center) - origin;
        match &self.surface {
            Surface::Sphere { radius } => {
                let radius = L::splat(*radius);
                let cone = Cone::new(to_center, radius);
                let local = warp::cone(u, v, cone.one_minus_cos);
                let wi = Frame::around(cone.axis).to_world(local).renormalize();
                let sin2 = local.x * local.x + local.y * local.y;
                let root2 = radius * radius - cone.distance2 * sin2;
                let near = cone.distance2.sqrt() * local.z - root2.max(L::zero()).sqrt();
                let distance = if cone.inside.any() {
                    let along = to_center.dot(wi);
                    let root2 = along * along + radius * radius - cone.distance2;
                    L::select(cone.inside, along + root2.max(L::zero()).sqrt(), near)
                } else {
                    near
                };
                self.with_density(wi, distance, cone.density())
            }
            Surface::Rectangle { axes, size } => {
                let size = size.map(L::splat);
                let rectangle = SphericalRectangle::new(size, local_of(axes, to_center));
                let [x, y] = rectangle.sample(u, v);
                let (wi, distance) = towards(axes, [x, y, rectangle.height]);
                let density = rectangle.density(distance);
                self.with_density(wi, distance, density)
            }
            Surface::Disk { axes, radius } => {
                let local = local_of(axes, to_center);
                let (x, y, _) = warp::disk(u, v);
                let radius = L::splat(*radius);
                let (x, y) = (x.mul_add(radius, local[0]), y.mul_add(radius, local[1]));
                let (wi, distance) = towards(axes, [x, y, local[2]]);
                let density = density_of_area(L::splat(self.area), distance, local[2]);
                self.with_density(wi, distance, density)
            }
        }
    }

    /// Returns the density \[1/sr\] with which [`Emitter::sample`] draws the direction of a ray
    /// that hits the emitter at `distance`.
    #[inline(always)]
    pub fn density<L: SimdFloat<Scalar = S>>(&self, origin: Vec3<L>, distance: L) -> L {
        let to_center = Vec3::splat(self.center) - origin;
        match &self.surface {
            Surface::Sphere { radius } => Cone::new(to_center, L::splat(*radius)).density(),
            Surface::Rectangle { axes, size } => {
                let local = local_of(axes, to_center);
                SphericalRectangle::new(size.map(L::splat), local).density(distance)
            }
            Surface::Disk { axes, .. } => {
                let [_, _, height] = local_of(axes, to_center);
                density_of_area(L::splat(self.area), distance, height)
            }
        }
    }

    /// Creates the sample of direction `wi` with the given density. The irradiance of the sample is
    /// the emitter's radiance divided by `density`. It is limited to the largest finite number,
    /// because an infinite irradiance times a black reflectance would be NaN.
    #[inline(always)]
    fn with_density<L: SimdFloat<Scalar = S>>(
        &self,
        wi: Vec3<L>,
        distance: L,
        density: L,
    ) -> EmitterSample<L> {
        let arrives = density.gt(L::zero());
        let irradiance = (L::splat(self.radiance) / density).min(L::from_f64(L::MAX));
        EmitterSample { wi, distance, density, irradiance: irradiance.masked(arrives) }
    }
}

/// Returns the components of `v` along the three unit vectors `axes`.
#[inline(always)]
pub(super) fn local_of<L: SimdFloat>(axes: &[[L::Scalar; 3]; 3], v: Vec3<L>) -> [L; 3] {
    axes.map(|axis| Vec3::splat(axis).dot(v))
}

/// Returns two values: the unit vector in the direction of the vector with the components [x, y, z]
/// along `axes`, and the length of this vector.
#[inline(always)]
pub(super) fn towards<L: SimdFloat>(axes: &[[L::Scalar; 3]; 3], [x, y, z]: [L; 3]) -> (Vec3<L>, L) {
    let distance = (x * x + y * y + z * z).sqrt();
    let [across, up, normal] = axes.map(Vec3::splat);
    let inverse = L::one() / distance;
    ((across * x + up * y + normal * z) * inverse, distance)
}

/// Returns two values: the distance at which each ray hits the plane of a flat emitter, and the
/// local coordinates (across, up) of the hit point. `to_center` is the vector from the rays' origin
/// to the emitter's centre. The distance is negative for rays that do not hit the front.
#[inline(always)]
fn plane_hit<L: SimdFloat>(
    axes: &[[L::Scalar; 3]; 3],
    to_center: Vec3<L>,
    direction: Vec3<L>,
) -> (L, [L; 2]) {
    let [center_x, center_y, height] = local_of(axes, to_center);
    let [x, y, slope] = local_of(axes, direction);
    let meets_front = slope.lt(L::zero()) & height.lt(L::zero());
    let t = L::select(meets_front, height / slope, -L::one());
    (t, [x.mul_add(t, -center_x), y.mul_add(t, -center_y)])
}

/// Returns the density \[1/sr\] of the directions to a flat surface on which points are sampled
/// uniformly: distance^2 / (area cos(angle to the normal)). `distance` is the distance of the
/// surface in the sampled direction. `height` is the coordinate of the surface along its normal,
/// relative to the receiver. It is negative if the receiver is in front of the surface. Otherwise
/// the density is zero.
#[inline(always)]
pub(super) fn density_of_area<L: SimdFloat>(area: L, distance: L, height: L) -> L {
    let density = distance * distance * distance / (area * -height);
    density.min(L::from_f64(L::MAX)).masked(height.lt(L::zero()))
}

/// Cone of the directions from a receiver point to a spherical emitter. From a point inside of the
/// sphere it contains all directions.
pub(super) struct Cone<L: SimdFloat> {
    pub axis: Vec3<L>,
    pub one_minus_cos: L,
    /// Squared distance from the receiver point to the centre of the sphere.
    pub distance2: L,
    /// Lanes whose receiver point is inside of the sphere.
    pub inside: L::Mask,
}

impl<L: SimdFloat> Cone<L> {
    #[inline(always)]
    pub fn new(to_center: Vec3<L>, radius: L) -> Self {
        let distance2 = to_center.length_squared();
        let sin2 = radius * radius / distance2;
        let inside = sin2.ge(L::one()) | !distance2.gt(L::zero());
        // Form of 1 - cos without cancellation at small angles.
        let drop = sin2 / ((L::one() - sin2).max(L::zero()).sqrt() + L::one());
        let z = Vec3::of([0.0, 0.0, 1.0]);
        Self {
            axis: Vec3::select(inside, z, to_center * (L::one() / distance2.sqrt())),
            one_minus_cos: L::select(inside, L::from_f64(2.0), drop),
            distance2,
            inside,
        }
    }

    /// Returns the density \[1/sr\] of uniform directions in the cone.
    #[inline(always)]
    pub fn density(&self) -> L {
        (L::one() / (self.one_minus_cos * L::from_f64(TAU))).min(L::from_f64(L::MAX))
    }
}

/// Rectangle as seen from a receiver point, sampled by solid angle.
///
/// Ureña, Fajardo, King 2013, *An Area-Preserving Parametrization for Spherical Rectangles*.
pub(super) struct SphericalRectangle<L: SimdFloat> {
    /// Interval of the rectangle's coordinates along its width, relative to the receiver point.
    x: [L; 2],
    y: [L; 2],
    /// Coordinate of the rectangle's plane along its normal, relative to the receiver point;
    /// negative if the point is in front of the rectangle.
    height: L,
    area: L,
    solid_angle: L,
    /// Lanes in which the rectangle is sampled by solid angle; in the others it is too small and is
    /// sampled by area.
    by_angle: L::Mask,
}

impl<L: SimdFloat> SphericalRectangle<L> {
    /// Creates the rectangle with the given width and height. [center_x, center_y, z] is its centre
    /// relative to the receiver point, in the rectangle's frame: across, up and along the normal.
    #[inline(always)]
    pub fn new([width, height]: [L; 2], [center_x, center_y, z]: [L; 3]) -> Self {
        let half = L::from_f64(0.5);
        let (a, b) = (width * half, height * half);
        let (x, y) = ([center_x - a, center_x + a], [center_y - b, center_y + b]);
        let area = width * height;
        let solid_angle = solid_angle(x, y, z, area);
        let by_angle = solid_angle.ge(L::from_f64(MIN_SOLID_ANGLE * L::EPSILON));
        Self { x, y, height: z, area, solid_angle, by_angle }
    }

    /// Samples a point of the rectangle. Returns its coordinates across and up, relative to the
    /// receiver point. `u` and `v` are uniform in [0, 1).
    #[inline(always)]
    pub fn sample(&self, u: L, v: L) -> [L; 2] {
        let ([x0, x1], [y0, y1]) = (self.x, self.y);
        let by_area = [u.mul_add(x1 - x0, x0), v.mul_add(y1 - y0, y0)];
        if self.by_angle.none() {
            return by_area;
        }
        let one = L::one();
        let h2 = self.height * self.height;
        // Each side of the rectangle spans a plane with the receiver point. These are the
        // components of the planes' unit normals along the rectangle's normal: `b0` and `b1` for
        // the lower and the upper side, `left` for the left side.
        let b0 = -y0 / (h2 + y0 * y0).sqrt();
        let b1 = y1 / (h2 + y1 * y1).sqrt();
        let left = -x0 / (h2 + x0 * x0).sqrt();
        let angle = |cos: L| (one - cos * cos).max(L::zero()).sqrt().atan2(cos);
        let k = L::from_f64(TAU) - angle(-(b1 * left)) - angle(-(left * b0));
        let (sin, cos) = u.mul_add(self.solid_angle, k).sin_cos();
        let f = (cos * b0 - b1) / sin;
        let c2 = one / (f * f + b0 * b0);
        // Lower bound of the divisors 1 - c2 and 1 - s^2. It prevents a division by zero.
        let tiny = L::from_f64(L::EPSILON * L::EPSILON);
        let x = (c2 * h2 / (one - c2).max(tiny)).sqrt().copysign(f).max(x0).min(x1);
        let d2 = x * x + h2;
        let [s0, s1] = [y0, y1].map(|y| y / (d2 + y * y).sqrt());
        let s = v.mul_add(s1 - s0, s0);
        let y = (s * (d2 / (one - s * s).max(tiny)).sqrt()).max(y0).min(y1);
        [L::select(self.by_angle, x, by_area[0]), L::select(self.by_angle, y, by_area[1])]
    }

    /// Returns the density \[1/sr\] with which [`Self::sample`] draws a direction that hits the
    /// rectangle at `distance`.
    #[inline(always)]
    pub fn density(&self, distance: L) -> L {
        let by_area = density_of_area(self.area, distance, self.height);
        let in_front = self.height.lt(L::zero());
        L::select(self.by_angle, (L::one() / self.solid_angle).masked(in_front), by_area)
    }
}

/// Returns the solid angle of a rectangle as the sum of the solid angles of two triangles. The
/// formula of Van Oosterom and Strackee (1983) for a triangle is an arc tangent, which has no
/// cancellation at small angles. `[x0, x1]` and `[y0, y1]` are the intervals of the rectangle's
/// coordinates relative to the receiver point, and `z` is the coordinate of its plane.
#[inline(always)]
fn solid_angle<L: SimdFloat>([x0, x1]: [L; 2], [y0, y1]: [L; 2], z: L, area: L) -> L {
    let corner = |x: L, y: L| {
        let inverse = L::one() / (x * x + y * y + z * z).sqrt();
        (Vec3::new(x, y, z) * inverse, inverse)
    };
    let [a, b, c, d] = [corner(x0, y0), corner(x1, y0), corner(x1, y1), corner(x0, y1)];
    let diagonal = a.0.dot(c.0);
    let volume = z.abs() * area * a.1 * c.1;
    let triangle = |third: (Vec3<L>, L)| {
        let below = L::one() + diagonal + a.0.dot(third.0) + c.0.dot(third.0);
        let half = (volume * third.1).atan2(below);
        half + half
    };
    triangle(b) + triangle(d)
}
