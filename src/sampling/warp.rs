//! Sample warps from the unit square to directions: lobes of reflected rays and microfacet normals,
//! with their densities.
//!
//! Directions are in the frame of the lobe. Its z axis is the mirror direction for cone and square,
//! the surface normal for microfacets.

use crate::lanes::{Mask, SimdFloat, Vec3};
use std::f64::consts::{FRAC_1_PI, FRAC_PI_4, TAU};

/// Uniform point of the unit disk, and its squared distance from the centre. Concentric squares
/// become circles, so that neighbours stay neighbours. An edge across the disk costs as many
/// samples as one across the square, and fewer if it is parallel to an axis.
///
/// Shirley and Chiu 1997, *A Low Distortion Map Between Disk and Square*.
#[inline(always)]
pub fn disk<L: SimdFloat>(u: L, v: L) -> (L, L, L) {
    let centred = |x: L| x + x - L::one();
    let (a, b) = (centred(u), centred(v));
    let wide = a.abs().gt(b.abs());
    let (far, near) = (L::select(wide, a, b), L::select(wide, b, a));
    // In the centre the angle is arbitrary.
    let (s, c) = sin_cos_eighth(near / far.abs().max(L::from_f64(1e-30)).copysign(far));
    (far * L::select(wide, c, s), far * L::select(wide, s, c), far * far)
}

/// Coefficients by powers of x^2 of the series of the sine (`first` is 1) or cosine (0) of x
/// eighths of a turn.
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

/// Sine and cosine of `x` eighths of a turn, for x in [-1, 1]: the first eight terms of their
/// series, with an error of 1e-15.
#[inline(always)]
fn sin_cos_eighth<L: SimdFloat>(x: L) -> (L, L) {
    const SINE: [f64; 8] = series(1);
    const COSINE: [f64; 8] = series(0);
    let x2 = x * x;
    (x * polynomial(&SINE, x2), polynomial(&COSINE, x2))
}

/// Polynomial `k[0] + k[1] x + k[2] x^2 + ...`.
#[inline(always)]
fn polynomial<L: SimdFloat>(k: &[f64], x: L) -> L {
    k.iter().rev().fold(L::zero(), |sum, k| sum.mul_add(x, L::from_f64(*k)))
}

/// Uniform direction in the cone of half-angle theta about z.
///
/// `one_minus_cos` is 1 - cos(theta), best computed as 2 sin^2(theta / 2); its range is [0, 1].
#[inline(always)]
pub fn cone<L: SimdFloat>(u: L, v: L, one_minus_cos: L) -> Vec3<L> {
    let (x, y, r2) = disk(u, v);
    let drop = r2 * one_minus_cos;
    // Areas on the sphere are proportional to areas on the disk; sin = r scale.
    let scale = (one_minus_cos * (L::from_f64(2.0) - drop)).max(L::zero()).sqrt();
    Vec3::new(x * scale, y * scale, L::one() - drop)
}

/// Density of [`cone`] [1/sr]: constant inside, 0 outside.
pub fn cone_pdf(direction_z: f64, one_minus_cos: f64) -> f64 {
    if 1.0 - direction_z <= one_minus_cos { 1.0 / (TAU * one_minus_cos) } else { 0.0 }
}

/// Direction through a uniform point of the square with sides `side` at unit distance,
/// perpendicular to z and centred on it.
#[inline(always)]
pub fn square<L: SimdFloat>(u: L, v: L, side: L) -> Vec3<L> {
    let half = L::from_f64(0.5);
    Vec3::new((u - half) * side, (v - half) * side, L::one()).normalize()
}

/// Density of [`square`] [1/sr]: 1 / (side^2 cos^3) inside, 0 outside.
pub fn square_pdf(direction: [f64; 3], side: f64) -> f64 {
    let [x, y, z] = direction;
    let inside = z > 0.0 && x.abs().max(y.abs()) <= 0.5 * side * z;
    if inside { 1.0 / (side * side * z * z * z) } else { 0.0 }
}

/// Microfacet normal with density D(h) cos(h), Beckmann distribution of slope `alpha`. The slopes
/// along x and y are independent normal deviates with variance alpha^2 / 2, one from each number,
/// so that reflections of edges along the mirror's axes depend almost entirely on one number.
///
/// Walter et al. 2007, *Microfacet Models for Refraction through Rough Surfaces*, eq. 28, has the
/// same density by radius and angle.
#[inline(always)]
pub fn beckmann<L: SimdFloat>(u: L, v: L, alpha: L) -> Vec3<L> {
    Vec3::new(alpha * erf_inverse(u), alpha * erf_inverse(v), L::one()).normalize()
}

/// Inverse of the error function at 2 u - 1, for u in [0, 1), to 4e-7 of its value (in double
/// precision to 1.4e-7); at 0, where it is infinite, -4.7.
///
/// Form of Giles 2010, *Approximating the erfinv Function*, GPU Computing Gems, chapter 10:
/// (2 u - 1) times a function of `w = -ln(1 - (2 u - 1)^2)`. The polynomials are fitted for the
/// least relative error with w up to 23.
#[inline(always)]
fn erf_inverse<L: SimdFloat>(u: L) -> L {
    const MIDDLE: [f64; 10] = [
        1.501_409_359_28,
        0.246_640_286_155,
        -0.004_177_386_780_6,
        -0.001_252_741_882_56,
        0.000_218_344_439_104,
        -4.963_345_362_93e-6,
        -3.462_704_696_08e-6,
        4.661_701_105_86e-7,
        2.323_264_106_85e-8,
        -8.791_015_793_82e-9,
    ];
    const TAILS: [f64; 10] = [
        3.335_485_338_14,
        1.007_370_799_04,
        0.003_289_021_993_91,
        -0.002_081_886_401_21,
        0.001_032_552_759_7,
        -0.000_627_658_024_685,
        0.000_535_544_490_635,
        -0.000_288_715_265_037,
        7.554_361_036_64e-6,
        3.185_092_156_69e-5,
    ];
    let positive = u.max(L::from_f64(2e-11));
    let w = -(L::from_f64(4.0) * positive * (L::one() - positive)).ln();
    let mut ratio = polynomial(&MIDDLE, w - L::from_f64(2.5));
    let in_tail = w.gt(L::from_f64(5.0));
    // Probability 1 / 300.
    if in_tail.any() {
        let root = w.max(L::zero()).sqrt();
        ratio = L::select(in_tail, polynomial(&TAILS, root - L::from_f64(3.5)), ratio);
    }
    ratio * (u + u - L::one())
}

/// Microfacet normal with density D_v(h): the GGX normals visible from `view` (unit, z >= 0).
///
/// Dupuy and Benyoub 2023, *Sampling Visible GGX Normals with Spherical Caps*. The cap is the image
/// of a disk.
#[inline(always)]
pub fn ggx_visible<L: SimdFloat>(u: L, v: L, alpha: L, view: Vec3<L>) -> Vec3<L> {
    let stretched = Vec3::new(view.x * alpha, view.y * alpha, view.z).normalize();
    let (x, y, r2) = disk(u, v);
    let height = L::one() + stretched.z;
    let drop = r2 * height;
    let scale = (height * (L::from_f64(2.0) - drop)).max(L::zero()).sqrt();
    let h = Vec3::new(x.mul_add(scale, stretched.x), y.mul_add(scale, stretched.y), height - drop);
    Vec3::new(h.x * alpha, h.y * alpha, h.z.max(L::zero())).normalize()
}

/// Beckmann distribution D [1/sr] of microfacet normals at squared tangent `tan2` from the surface
/// normal: exp(-tan2 / alpha^2) / (pi alpha^2 cos^4), with 1 / cos^2 = 1 + tan2.
#[inline(always)]
pub fn beckmann_d<L: SimdFloat>(tan2: L, inverse_alpha2: L) -> L {
    let secant2 = tan2 + L::one();
    (-(tan2 * inverse_alpha2)).exp()
        * (secant2 * secant2)
        * (inverse_alpha2 * L::from_f64(FRAC_1_PI))
}

/// GGX distribution D [1/sr]: 1 / (pi alpha^2 cos^4 (1 + tan2 / alpha^2)^2).
#[inline(always)]
pub fn ggx_d<L: SimdFloat>(tan2: L, inverse_alpha2: L) -> L {
    let ratio = (tan2 + L::one()) / (tan2 * inverse_alpha2 + L::one());
    ratio * ratio * (inverse_alpha2 * L::from_f64(FRAC_1_PI))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lanes::{Double, Float, Single};
    use std::f64::consts::PI;

    /// Complementary error function 1 - erf(x) for x >= 0, by its continued fraction or series.
    fn erfc(x: f64) -> f64 {
        let two_over_root_pi = 2.0 / PI.sqrt();
        if x < 2.0 {
            let mut term = x;
            let mut sum = x;
            for n in 1..200 {
                term *= -x * x / f64::from(n);
                sum += term / f64::from(2 * n + 1);
            }
            return 1.0 - two_over_root_pi * sum;
        }
        let fraction = (1..200).rev().fold(x, |below, n| x + 0.5 * f64::from(n) / below);
        0.5 * two_over_root_pi * (-x * x).exp() / fraction
    }

    /// Checks that the error function inverts `erf_inverse`, from the middle to the last number in
    /// the tails.
    fn check_erf_inverse<L: SimdFloat>(numbers: &[f64], max_error: f64) {
        for u in numbers {
            let x: f64 = erf_inverse(L::from_f64(*u)).lane(0).to_f64();
            // Error of u, converted to an error of x by the slope.
            let tail = u.min(1.0 - u);
            let u_error = 0.5 * erfc(x.abs()) - tail;
            let per_x = (-x * x).exp() / PI.sqrt();
            let relative = (u_error / per_x / x.abs().max(1e-3)).abs();
            assert!(
                relative < max_error,
                "{}: u = {u}, erf_inverse {x}, off by {relative}",
                L::NAME
            );
            assert_eq!(x < 0.0, *u < 0.5, "u = {u}");
        }
    }

    #[test]
    fn erf_inverse_is_the_inverse_of_erf() {
        let step = |n: u32| 1.0 / f64::from(n);
        let mut numbers: Vec<f64> =
            (1..2048).filter(|i| *i != 1024).map(|i| f64::from(i) * step(2048)).collect();
        let tails: Vec<f64> = (9..24).map(|bits| f64::from(-bits).exp2()).collect();
        numbers.extend(tails.iter().flat_map(|tail| [*tail, 1.0 - tail]));
        check_erf_inverse::<Single>(&numbers, 2e-6);
        numbers.extend((24..=32).map(|bits| f64::from(-bits).exp2()));
        check_erf_inverse::<Double>(&numbers, 2e-7);
        ends::<Single>();
        ends::<Double>();
    }

    fn ends<L: SimdFloat>() {
        let inverse = |u: f64| erf_inverse(L::from_f64(u)).lane(0).to_f64();
        assert_eq!(inverse(0.5), 0.0);
        assert!((-5.0..-4.5).contains(&inverse(0.0)), "{}", inverse(0.0));
    }

    /// Checks that concentric squares become circles and that equal areas stay equal.
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
            // Quadrants in the order right, up, left, down.
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
