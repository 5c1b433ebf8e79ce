//! Surfaces as seen from a receiver point: cones, rectangles and triangles that are sampled by solid
//! angle.

use std::f64::consts::TAU;
use zerkalo_kernel::lanes::{Mask, SimdFloat, Vec3};

/// Smallest solid angle at which a rectangle or triangle is sampled by solid angle, not by area.
/// The unit is the machine epsilon of the number type \[sr\]. At this solid angle, rounding moves
/// sampled points by 1e-5 of the surface's size.
const MIN_SOLID_ANGLE: f64 = 2e5;

/// Returns the density [1/sr] of the directions to a flat surface on which points are sampled
/// uniformly: distance^2 / (area cos(angle to the normal)). `height` is the coordinate of the
/// surface along its normal, relative to the receiver. It is negative for receivers in front of the
/// surface; for others, the density is zero.
#[inline(always)]
pub(super) fn density_of_area<L: SimdFloat>(area: L, distance: L, height: L) -> L {
    let density = distance * distance * distance / (area * -height);
    density.min(L::from_f64(L::MAX)).masked(height.lt(L::zero()))
}

/// Cone of the directions from a receiver to a sphere; all directions from inside the sphere.
pub(super) struct Cone<L: SimdFloat> {
    pub axis: Vec3<L>,
    pub one_minus_cos: L,
    /// Squared distance from the receiver to the centre of the sphere.
    pub distance2: L,
    /// Lanes whose receiver is inside the sphere.
    pub inside: L::Mask,
}

impl<L: SimdFloat> Cone<L> {
    /// Creates the cone to a sphere; `to_center` leads from the receiver to its centre.
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

    /// Returns the density [1/sr] of uniform directions in the cone.
    #[inline(always)]
    pub fn density(&self) -> L {
        (L::one() / (self.one_minus_cos * L::from_f64(TAU))).min(L::from_f64(L::MAX))
    }
}

/// Rectangle as seen from a receiver point, sampled by solid angle.
///
/// Ureña, Fajardo, King 2013, *An Area-Preserving Parametrization for Spherical Rectangles*.
pub(super) struct SphericalRectangle<L: SimdFloat> {
    /// Interval of the coordinate across (`x`) and of the one up (`y`), relative to the receiver.
    x: [L; 2],
    y: [L; 2],
    /// Coordinate of the plane along the normal, relative to the receiver; negative if the receiver
    /// is in front.
    height: L,
    area: L,
    solid_angle: L,
    /// Lanes in which the rectangle is large enough to be sampled by solid angle.
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

    /// Samples a point by `u` and `v`, which are uniform in [0, 1). Returns its coordinates across
    /// and up, relative to the receiver.
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
        // The angles on the left side have the cosines `p` and `q`. The azimuth is `u` times the
        // solid angle, less these angles: by theorems of addition, without arc functions.
        let (p, q) = (-(b1 * left), -(left * b0));
        let [sin_p, sin_q] = [p, q].map(|cos| (one - cos * cos).max(L::zero()).sqrt());
        let (cos_k, sin_k) = (p * q - sin_p * sin_q, -(sin_p * q + p * sin_q));
        let (sin_u, cos_u) = (u * self.solid_angle).sin_cos();
        let (sin, cos) = (sin_u * cos_k + cos_u * sin_k, cos_u * cos_k - sin_u * sin_k);
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

    /// Returns the density [1/sr] with which [`Self::sample`] draws a direction that hits the
    /// rectangle at `distance`.
    #[inline(always)]
    pub fn density(&self, distance: L) -> L {
        let by_area = density_of_area(self.area, distance, self.height);
        let in_front = self.height.lt(L::zero());
        L::select(self.by_angle, (L::one() / self.solid_angle).masked(in_front), by_area)
    }
}

/// Returns the solid angle of a rectangle as the sum of two triangles. The formula of Van Oosterom
/// and Strackee (1983) for half of a triangle's is an arc tangent, which has no cancellation at small
/// angles. The halves are at most pi together, so that one arc tangent has their sum. The parameters
/// are fields of [`SphericalRectangle`]; `z` is its `height`.
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
        (volume * third.1, below)
    };
    let ((above_b, below_b), (above_d, below_d)) = (triangle(b), triangle(d));
    // Rounding may make the sine of pi negative.
    let sine = (above_b * below_d + below_b * above_d).abs();
    let half = sine.atan2(below_b * below_d - above_b * above_d);
    half + half
}

/// Triangle as seen from a receiver point, sampled by solid angle.
///
/// Arvo 1995, *Stratified Sampling of Spherical Triangles*.
pub(super) struct SphericalTriangle<L: SimdFloat> {
    /// Unit vectors from the receiver point to the triangle's corners.
    corners: [Vec3<L>; 3],
    /// Volume of the parallelepiped that the three unit vectors span.
    volume: L,
    pub solid_angle: L,
    /// Lanes in which the triangle is large enough to be sampled by solid angle.
    pub by_angle: L::Mask,
}

impl<L: SimdFloat> SphericalTriangle<L> {
    /// Creates the spherical triangle. `corners` are those of the triangle relative to the
    /// receiver. `height` is the coordinate of the triangle's plane along its normal, also relative
    /// to the receiver. `area` is the triangle's area.
    #[inline(always)]
    pub fn new(corners: [Vec3<L>; 3], height: L, area: L) -> Self {
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
    pub fn sample(&self, u: L, v: L) -> Vec3<L> {
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
