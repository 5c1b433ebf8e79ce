//! Sampling of visible microfacet normals: maps from the unit square to directions in a local frame
//! whose z axis is the surface normal.

use crate::material::Masking;
use std::f64::consts::{FRAC_1_PI, PI};
use zerkalo_kernel::lanes::{Mask, SimdFloat, Vec3, polynomial};
use zerkalo_kernel::sampling::warp::disk;

/// Returns `(x, y, sine)`: the azimuth of the unit vector `view` as a unit vector (x, y), and the
/// sine of the angle between `view` and z. The azimuth of a view along z is the x axis.
#[inline(always)]
fn azimuth<L: SimdFloat>(view: Vec3<L>) -> (L, L, L) {
    let sin = view.x.mul_add(view.x, view.y * view.y).sqrt();
    let tilted = sin.gt(L::zero());
    let scale = L::one() / L::select(tilted, sin, L::one());
    (L::select(tilted, view.x * scale, L::one()), view.y * scale, sin)
}

/// Samples a microfacet normal h of the Beckmann distribution that is visible from `view` (unit
/// vector with a positive z). The density is G_1(view, h) D(h) view.h / view.z, with the G_1 of the
/// model `masking`.
///
/// First, the slopes of a microfacet along x and y are sampled, in units of `alpha`, whether the
/// microfacet is visible or not: independent normal deviates with the variance 1/2, from `u` and
/// `v`. Then the component of the slope along the azimuth of the view is replaced by the slope that
/// has the same quantile among the visible microfacets. For views near the normal this changes the
/// slope little, so that slopes along x and y stay as evenly distributed as `u` and `v`.
#[inline(always)]
pub fn beckmann_visible<L: SimdFloat>(
    u: L,
    v: L,
    alpha: L,
    view: Vec3<L>,
    masking: Masking,
) -> Vec3<L> {
    let (sx, sy) = (erf_inverse(u), erf_inverse(v));
    // Tangent of the angle between view and normal, in the stretched space where alpha is 1. The
    // tangent is the length r of the vector (rx, ry), which points along the azimuth of the view.
    let scale = alpha / view.z.max(L::from_f64(1e-30));
    let (rx, ry) = (view.x * scale, view.y * scale);
    let r2 = rx.mul_add(rx, ry * ry);
    let factor = small_r_shift(-sx.mul_add(rx, sy * ry), r2);
    let (mut slope_x, mut slope_y) = (rx.mul_add(factor, sx), ry.mul_add(factor, sy));
    let oblique = r2.gt(L::from_f64(SMALL_R * SMALL_R));
    if oblique.any() {
        let (ax, ay, sin) = azimuth(view);
        let away = -sx.mul_add(ax, sy * ay);
        let shift = away - visible_slope(away, (scale * sin).min(L::from_f64(1e6)), masking);
        slope_x = L::select(oblique, ax.mul_add(shift, sx), slope_x);
        slope_y = L::select(oblique, ay.mul_add(shift, sy), slope_y);
    }
    Vec3::new(alpha * slope_x, alpha * slope_y, L::one()).normalize()
}

/// Returns exp(x^2) erfc(x) for x >= 0, with a relative error of 5e-8.
///
/// A Chebyshev fit of degree 10 in (x - 2.5) / (x + 2.5) approximates the function times (1 + 1.5
/// x).
#[inline(always)]
fn scaled_erfc<L: SimdFloat>(x: L) -> L {
    const K: [f64; 11] = [
        1.001_330_225_750_710_4,
        -0.184_702_248_823_020_83,
        -0.011_339_850_366_306_782,
        0.086_974_266_751_289_34,
        -0.067_247_660_598_603_65,
        0.023_513_720_908_949_518,
        5.122_710_466_611_821e-5,
        -0.002_925_660_183_030_044_3,
        0.000_400_955_891_284_127_3,
        0.000_282_149_523_778_940_7,
        -5.271_354_693_263_676e-5,
    ];
    let at = (x - L::from_f64(2.5)) / (x + L::from_f64(2.5));
    polynomial(&K, at) / x.mul_add(L::from_f64(1.5), L::one())
}

/// Largest r = alpha tan(theta) for which [`small_r_shift`] computes the slope of a visible
/// microfacet; theta is the angle between view and surface normal.
const SMALL_R: f64 = 0.25;

/// Returns (t - x) / r for a slope t. Here x is the slope that has the same quantile among the
/// visible microfacets as t has among all microfacets. Both slopes are in units of alpha. `rt` is r
/// times t, and `r2` is r^2, for r up to [`SMALL_R`]. [`visible_slope`] computes x for larger r.
///
/// The polynomial is a fit for the smallest error of the quantile, which is 3e-6. The masked
/// microfacets, 1e-9 of all, are neglected.
#[inline(always)]
fn small_r_shift<L: SimdFloat>(rt: L, r2: L) -> L {
    let constant = polynomial(&[0.499_993, -0.083_186_5, 0.034_474], r2);
    let linear = polynomial(&[0.250_05, -0.155_808], r2);
    let square = polynomial(&[0.166_945, -0.231_177], r2);
    let higher = rt.mul_add(L::from_f64(0.104_431), L::from_f64(0.122_301));
    rt.mul_add(rt.mul_add(rt.mul_add(higher, square), linear), constant)
}

/// Returns the slope x that has the same quantile among the visible microfacets as `t` has among
/// all microfacets. The quantiles of x and t differ by 3e-5 at most.
///
/// Slopes are along the view's azimuth, away from the view, in units of alpha. `r` is at most 1e6;
/// values below [`SMALL_R`] count as [`SMALL_R`].
///
/// Among all microfacets, slopes have the density exp(-t^2) / sqrt(pi). Among the visible ones,
/// with Smith's masking, the density is in proportion to (1 - r x) exp(-x^2), for x < 1 / r (Heitz
/// and d'Eon 2014, *Importance Sampling Microfacet-Based BSDFs using the Distribution of Visible
/// Normals*). With V-cavities it is 2 exp(-x^2) instead for x < -1 / r, where the other side of the
/// groove is invisible.
///
/// The distribution function of visible slopes is erfc(-x) + r exp(-x^2) / sqrt(pi), up to
/// constants. Newton's method inverts it. Below the median, it is applied to the logarithm of the
/// function. Above the median, it is applied to the square root of the complement, because the
/// derivative of the function falls to 0 at x = 1 / r. The iteration starts at a value that is
/// exact to first order in r. It takes two steps for r <= 2, else three.
#[inline(always)]
fn visible_slope<L: SimdFloat>(t: L, r: L, masking: Masking) -> L {
    let (one, two) = (L::one(), L::from_f64(2.0));
    let r = r.max(L::from_f64(SMALL_R));
    let end = one / r;
    let r_root = r * L::from_f64(FRAC_1_PI.sqrt());
    let (scaled, gauss) = (scaled_erfc(end), (-(end * end)).exp());
    // `lambda2` is twice Smith's Lambda, and `erfc_end` is erfc(1 / r).
    let (lambda2, erfc_end) = ((gauss * (r_root - scaled)).max(L::zero()), gauss * scaled);
    let tail = scaled_erfc(t.abs()) * (-(t * t)).exp();
    let negative = t.lt(L::zero());
    // `low` is twice the quantile of `t`, and `high` is twice the complement of the quantile.
    let (low, high) =
        (L::select(negative, tail, two - tail), L::select(negative, two - tail, tail));
    let (wanted_below, wanted_above, least) = match masking {
        Masking::VCavity => (low + lambda2, high, -end),
        Masking::Smith => {
            let total = lambda2.mul_add(L::from_f64(0.5), one);
            (low * total, high * total, -end.max(L::from_f64(7.0)))
        }
    };
    let below_median = wanted_below.lt(wanted_above);
    let wanted_root = wanted_above.sqrt();
    let distance = end - t;
    let step = one / ((distance * distance + two).sqrt() + distance.abs());
    let mut x = L::select(distance.lt(L::zero()), end, t) - step;
    for least_r in [0.0, 0.0, 2.0] {
        let inexact = r.gt(L::from_f64(least_r));
        if inexact.none() {
            break;
        }
        let gauss = (-(x * x)).exp();
        let tail = scaled_erfc(x.abs()) * gauss;
        let negative = x.lt(L::zero());
        let rise = r_root * gauss;
        let below = L::select(negative, tail, two - tail) + rise;
        let above = (L::select(negative, two - tail, tail) - rise + lambda2).max(L::zero());
        let root = above.sqrt();
        let missing = L::select(
            below_median,
            below * (wanted_below / below).ln(),
            two * root * (root - wanted_root),
        );
        let slope = gauss * (one - r * x) * L::from_f64(2.0 * FRAC_1_PI.sqrt());
        let next = (x + missing / slope.max(L::from_f64(1e-30))).max(least).min(end);
        x = L::select(inexact, next, x);
    }
    if masking == Masking::VCavity {
        // For a large r the terms of the distribution function cancel. Where both sides of the
        // groove are visible, x is within 1 / r of 0, and exp(-x^2) is 1 with an error below 1 /
        // r^2. The density is therefore in proportion to 1 - r x, and is inverted in closed form.
        let linear = (high * r * L::from_f64(PI.sqrt())).sqrt();
        x = L::select(r.gt(L::from_f64(24.0)), (end * (one - linear)).max(-end), x);
        // Only one side of the groove is visible.
        let one_sided = low.lt(two * erfc_end);
        if one_sided.any() {
            x = L::select(one_sided, erf_inverse(low * L::from_f64(0.25)), x);
        }
    }
    x
}

/// Returns the inverse of the error function at 2 u - 1, for u in [0, 1). The relative error is at
/// most 4e-7 in single precision and 1.4e-7 in double precision. At u = 0, where the inverse is
/// infinite, the result is -4.7.
///
/// The form is that of Giles 2010, *Approximating the erfinv Function*, GPU Computing Gems, chapter
/// 10: (2 u - 1) times a function of `w = -ln(1 - (2 u - 1)^2)`. The polynomials were fitted for
/// the smallest relative error with w up to 23.
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
    // One of 300 uniform numbers is in a tail.
    if in_tail.any() {
        let root = w.max(L::zero()).sqrt();
        ratio = L::select(in_tail, polynomial(&TAILS, root - L::from_f64(3.5)), ratio);
    }
    ratio * (u + u - L::one())
}

/// Samples a microfacet normal h of the GGX distribution that is visible from `view`, a unit vector
/// with z >= 0. The density is G_1(view, h) D(h) view.h / view.z, with Smith's G_1.
///
/// The method is from Dupuy and Benyoub 2023, *Sampling Visible GGX Normals with Spherical Caps*.
/// The spherical cap is sampled by the concentric map of [`disk`].
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

/// Samples a microfacet normal of the GGX distribution in V-cavities that is visible from `view`, a
/// unit vector with a positive z. The density is as for [`beckmann_visible`], with the D of GGX.
///
/// A point (s, s') of the unit disk stands for the microfacet with the slopes (s, s') / sqrt(1 -
/// s^2 - s'^2), in units of alpha. The points of all microfacets, visible or not, are uniform in
/// the disk. The axis of s points away from the view, along the azimuth of the view; only s is
/// replaced. From here on, s is divided by half the chord of the disk at s', and is thus uniform in
/// \[-1, 1\] over all microfacets. Where both sides of the groove are visible, the visible
/// microfacets have the distribution function s + sqrt(1 - s^2) tan(theta), up to a constant; theta
/// is the angle between the stretched view and z. Where one side is visible, their distribution
/// function is twice that of all microfacets. Both functions have inverses in closed form: with s =
/// sin(a), the first is sin(a + theta) / cos(theta).
#[inline(always)]
pub fn ggx_visible_v_cavity<L: SimdFloat>(u: L, v: L, alpha: L, view: Vec3<L>) -> Vec3<L> {
    let stretched = Vec3::new(view.x * alpha, view.y * alpha, view.z).normalize();
    let (ax, ay, sin_theta) = azimuth(stretched);
    let (x, y, _) = disk(u, v);
    let (away, side) = (-x.mul_add(ax, y * ay), y.mul_add(ax, -(x * ay)));
    let chord = (L::one() - side * side).max(L::from_f64(1e-30)).sqrt();
    // Share of the chord on the far side of the point: 1 minus the quantile of the point.
    let above = ((L::one() - away / chord) * L::from_f64(0.5)).max(L::zero()).min(L::one());
    // sin(a + theta) = 1 - 2 m.
    let m = above * stretched.z;
    let (sin, cos) =
        (L::one() - (m + m), L::from_f64(2.0) * (m * (L::one() - m)).max(L::zero()).sqrt());
    let one_sided = above.gt(stretched.z);
    let sin_a = L::select(one_sided, -above, sin.mul_add(stretched.z, -(cos * sin_theta)));
    let cos_a = L::select(
        one_sided,
        (L::one() - above * above).max(L::zero()).sqrt(),
        cos.mul_add(stretched.z, sin * sin_theta).max(L::zero()),
    );
    let away = chord * sin_a;
    let (x, y) = (-away.mul_add(ax, side * ay), side.mul_add(ax, -(away * ay)));
    Vec3::new(x * alpha, y * alpha, chord * cos_a).normalize()
}

#[cfg(test)]
mod tests {
    use super::*;
    use zerkalo_kernel::lanes::{Double, Float, Single};

    /// Returns the complementary error function 1 - erf(x) for x >= 0, computed by its series or
    /// its continued fraction.
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

    /// Checks that `erf_inverse` inverts the error function at each of `numbers`, with a relative
    /// error below `max_error`.
    fn check_erf_inverse<L: SimdFloat>(numbers: &[f64], max_error: f64) {
        for u in numbers {
            let x: f64 = erf_inverse(L::from_f64(*u)).lane(0).to_f64();
            // Error of u, converted to an error of x by the slope of the error function.
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

    /// Checks that the sampled slope has the same quantile among the visible microfacets as `t` has
    /// among all microfacets.
    fn check_visible_slope<L: SimdFloat>(max_error: f64) {
        let full_erfc = |x: f64| if x < 0.0 { 2.0 - erfc(-x) } else { erfc(x) };
        let mut worst = 0f64;
        for r in
            [0.0, 1e-6, 1e-3, 0.05, 0.2, 0.21, 0.25, 0.5, 1.0, 2.0, 2.1, 10.0, 23.0, 25.0, 1e3, 1e6]
        {
            let end = 1.0 / f64::max(r, 1e-6);
            let smith = |x: f64| full_erfc(-x) + r * (-x * x).exp() / PI.sqrt();
            let v_cavity = |x: f64| {
                if x < -end {
                    return full_erfc(-x);
                }
                let below = full_erfc(end) + 0.5 * (full_erfc(-x) - full_erfc(end));
                below + 0.5 * r / PI.sqrt() * ((-x * x).exp() - (-end * end).exp())
            };
            for i in -400..=400 {
                let t = f64::from(i) / 100.0;
                let quantile = 0.5 * full_erfc(-t);
                let lanes = (L::from_f64(t), L::from_f64(r));
                let slope = |masking| {
                    let (t, r) = lanes;
                    let slope = match r.le(L::from_f64(SMALL_R)).any() {
                        true => t - r * small_r_shift(r * t, r * r),
                        false => visible_slope(t, r, masking),
                    };
                    slope.lane(0).to_f64()
                };
                let (a, b) = (slope(Masking::Smith), slope(Masking::VCavity));
                let beyond = (a - end).max(b - end);
                assert!(r <= SMALL_R || beyond <= 1e-6 * end, "{a} {b} {end}");
                let quantiles = [(smith(a) / smith(end), "Smith"), (v_cavity(b), "V-cavity")];
                for (found, name) in quantiles {
                    let error = (found - quantile).abs();
                    worst = worst.max(error);
                    assert!(error < max_error, "{}, {name}, r {r:?}, t {t}: {error:.1e}", L::NAME);
                }
            }
        }
        println!("{}: quantiles {worst:.1e} off at most", L::NAME);
    }

    #[test]
    fn visible_slope_keeps_quantiles() {
        check_visible_slope::<Single>(3e-5);
        check_visible_slope::<Double>(3e-5);
    }
}
