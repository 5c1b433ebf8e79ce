//! Sample warps: maps from the unit square to directions in a local frame, with their densities.
//! The z axis is the axis of the lobe. Warps to microfacet normals are in `zerkalo-scene`.

use crate::lanes::{SimdFloat, Vec3, polynomial};
use std::f64::consts::{FRAC_PI_4, TAU};

/// Maps the unit square to the unit disk with uniform density. Returns `(x, y, x^2 + y^2)`.
///
/// Concentric squares become concentric circles, so that neighbouring points stay neighbours.
/// Shirley and Chiu 1997, *A Low Distortion Map Between Disk and Square*.
#[inline(always)]
pub fn disk<L: SimdFloat>(u: L, v: L) -> (L, L, L) {
    let centred = |x: L| x + x - L::one();
    let (a, b) = (centred(u), centred(v));
    let wide = a.abs().gt(b.abs());
    let (far, near) = (L::select(wide, a, b), L::select(wide, b, a));
    // At the centre the angle is arbitrary; the lower limit of the divisor avoids 0 / 0.
    let (s, c) = sin_cos_eighth(near / far.abs().max(L::from_f64(1e-30)).copysign(far));
    (far * L::select(wide, c, s), far * L::select(wide, s, c), far * far)
}

/// Returns the coefficients of a power series in x^2: of sin(pi x / 4) / x if `first` is 1, of
/// cos(pi x / 4) if `first` is 0.
const fn series(first: u32) -> [f64; 8] {
    let mut terms = [0.0; 8];
    let (mut k, mut n, mut term) = (0, 0, 1.0);
    while k < 8 {
        while n < 2 * k as u32 + first {
            n += 1;
            term *= FRAC_PI_4 / n as f64;
        }
        terms[k] = if k % 2 == 0 { term } else { -term };
        k += 1;
    }
    terms
}

/// Returns `(sin(pi x / 4), cos(pi x / 4))` for x in [-1, 1]. The series of eight terms has an
/// error of 1e-15.
#[inline(always)]
fn sin_cos_eighth<L: SimdFloat>(x: L) -> (L, L) {
    const SINE: [f64; 8] = series(1);
    const COSINE: [f64; 8] = series(0);
    let x2 = x * x;
    (x * polynomial(&SINE, x2), polynomial(&COSINE, x2))
}

/// Maps the unit square with uniform density to the part of it outside a concentric square that has
/// the share `inner` of its area. The other warps turn both squares into concentric shapes.
#[inline(always)]
pub fn outside<L: SimdFloat>(u: L, v: L, inner: L) -> (L, L) {
    let half = L::from_f64(0.5);
    let (a, b) = (u - half, v - half);
    // Half of the side of the concentric square through the point.
    let far = a.abs().max(b.abs()).max(L::from_f64(1e-20));
    let wanted = (far * far).mul_add(L::one() - inner, inner * L::from_f64(0.25)).sqrt();
    let scale = wanted / far;
    (a.mul_add(scale, half), b.mul_add(scale, half))
}

/// Samples a direction uniformly in the cone with half-angle theta around z. `one_minus_cos` is 1 -
/// cos(theta), in [0, 2].
#[inline(always)]
pub fn cone<L: SimdFloat>(u: L, v: L, one_minus_cos: L) -> Vec3<L> {
    let (x, y, r2) = disk(u, v);
    let drop = r2 * one_minus_cos;
    // The map from disk to sphere preserves ratios of areas. The sine of the angle to z is `scale`
    // times the radius of the point in the disk.
    let scale = (one_minus_cos * (L::from_f64(2.0) - drop)).max(L::zero()).sqrt();
    Vec3::new(x * scale, y * scale, L::one() - drop)
}

/// Samples a direction in the hemisphere around z with the density cos(theta) / pi [1/sr], where
/// theta is the angle to z. Malley's method: a uniform point of the disk, lifted to the hemisphere.
#[inline(always)]
pub fn cosine_hemisphere<L: SimdFloat>(u: L, v: L) -> Vec3<L> {
    let (x, y, r2) = disk(u, v);
    Vec3::new(x, y, (L::one() - r2).max(L::zero()).sqrt())
}

/// Returns the density [1/sr] of [`cone`] around the unit vector `axis` at `direction`: constant
/// inside the cone, 0 outside. `direction` is inside if |direction - axis|^2 <= 2 `one_minus_cos`.
/// In narrow cones this comparison is more exact than one of cosines.
#[inline(always)]
pub fn cone_pdf<L: SimdFloat>(axis: Vec3<L>, direction: Vec3<L>, one_minus_cos: L) -> L {
    let drop = (direction - axis).length_squared() * L::from_f64(0.5);
    (L::one() / (one_minus_cos * L::from_f64(TAU))).masked(drop.le(one_minus_cos))
}

/// Samples the direction through a uniform point of a square with the side `side`. The square is
/// perpendicular to z at unit distance, and centred on z.
#[inline(always)]
pub fn square<L: SimdFloat>(u: L, v: L, side: L) -> Vec3<L> {
    let half = L::from_f64(0.5);
    Vec3::new((u - half) * side, (v - half) * side, L::one()).normalize()
}

/// Returns the density [1/sr] of [`square`] at `direction`: 1 / (side^2 cos^3(theta)) inside the
/// square, 0 outside. Here theta is the angle between `direction` and z.
#[inline(always)]
pub fn square_pdf<L: SimdFloat>(direction: Vec3<L>, side: L) -> L {
    let Vec3 { x, y, z } = direction;
    let inside = z.gt(L::zero()) & x.abs().max(y.abs()).le(side * z * L::from_f64(0.5));
    (L::one() / (side * side * z * z * z)).masked(inside)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lanes::{Double, Float, Single};
    use std::f64::consts::PI;

    /// Checks that the concentric map turns squares around the centre into circles, and that areas
    /// keep their ratios.
    fn check_disk<L: SimdFloat>(max_error: f64) {
        let point = |u: f64, v: f64| {
            let (x, y, r2) = disk(L::from_f64(u), L::from_f64(v));
            [x, y, r2].map(|x| x.lane(0).to_f64())
        };
        assert_eq!(point(0.5, 0.5), [0.0; 3]);
        let n = 64;
        for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
            let [u, v] = [i, j].map(|i| (f64::from(i) + 0.5) / f64::from(n));
            let [x, y, r2] = point(u, v);
            let side = (2.0 * u - 1.0).abs().max((2.0 * v - 1.0).abs());
            assert!((r2 - side * side).abs() < max_error && (x * x + y * y - r2).abs() < max_error);
            let angle = y.atan2(x);
            // The expected angle is in eighths of a turn: 0 is right, 2 up, 4 left, 6 down.
            let (a, b) = (2.0 * u - 1.0, 2.0 * v - 1.0);
            let (eighths, ahead) = if a.abs() > b.abs() { (b / a, a) } else { (2.0 - a / b, b) };
            let eighth = if ahead > 0.0 { eighths } else { eighths + 4.0 };
            let off = (angle - FRAC_PI_4 * eighth).rem_euclid(2.0 * PI);
            assert!(off.min(2.0 * PI - off) < max_error / side, "{u}, {v}: {angle}");
        }
    }

    #[test]
    fn disk_maps_squares_to_circles_and_preserves_areas() {
        check_disk::<Single>(1e-6);
        check_disk::<Double>(1e-14);
    }
}
