//! Phong highlights, from wide ones to those as small as a pixel.

use crate::harness::*;
use crate::lobes::setup::{across, combine, dot, tilted_normal, unit};

/// Returns a material that has only a Phong highlight.
fn shiny(exponent: f64) -> Material {
    Material { diffuse: 0.0, specular: 0.7, exponent, ..Material::default() }
}

/// Returns `v`, normalised in the precision of `L`, and the same rounded numbers in double
/// precision.
fn rounded<L: SimdFloat>(v: [f64; 3]) -> (Vec3<L>, [f64; 3]) {
    let v = Vec3::<L>::of(v).normalize();
    (v, v.lane(0).map(Float::to_f64))
}

/// Returns (R.V)^alpha for the mirror direction R and the view direction V. It is computed from the
/// tangent of the angle between R and V, which keeps full precision at small angles.
fn power(n: [f64; 3], view: [f64; 3], light: [f64; 3], alpha: f64) -> f64 {
    let n = unit(n);
    let r = combine(&[(2.0 * dot(light, n), n), (-1.0, light)]);
    let along = dot(r, view);
    let cross = [
        r[1] * view[2] - r[2] * view[1],
        r[2] * view[0] - r[0] * view[2],
        r[0] * view[1] - r[1] * view[0],
    ];
    let tan2 = dot(cross, cross) / (along * along);
    if along > 0.0 { (-0.5 * alpha * tan2.ln_1p()).exp() } else { 0.0 }
}

/// Checks highlights near the mirror direction for exponents from 1 to 1e9. Their values must equal
/// those of a computation in double precision within rounding, and must not exceed k_s / pi.
fn check<L: SimdFloat>(rounding: f64) {
    let most = L::from_f64(0.7) * L::from_f64(std::f64::consts::FRAC_1_PI);
    let most = most.lane(0).to_f64();
    for tenth in 0..=90 {
        let alpha = 10f64.powf(f64::from(tenth) / 10.0);
        let finish = Bsdf::<L::Scalar>::new(&shiny(alpha), false);
        let mut worst = 0f64;
        for step in 0..600 {
            let (theta, turn) = (f64::from(step % 30) * 0.05, f64::from(step) * 0.7);
            let n = tilted_normal();
            let [t, b] = across(n);
            // Distance of the view from the mirror direction: up to four times the highlight's
            // width.
            let off = f64::from(step % 20) * 0.2 * alpha.recip().sqrt();
            let plane = combine(&[(turn.cos(), t), (turn.sin(), b)]);
            let light = combine(&[(theta.cos(), n), (theta.sin(), plane)]);
            let mirrored = combine(&[(2.0 * dot(light, n), n), (-1.0, light)]);
            let [side, _] = across(mirrored);
            let view = unit(combine(&[(1.0, mirrored), (off, side)]));
            let ((n, n64), (view, view64)) = (rounded::<L>(n), rounded::<L>(view));
            let (light, light64) = rounded::<L>(light);
            let query = BsdfQuery { incident: -view, normal: n, fold: true };
            let value = finish.highlight(&query, light).x.lane(0).to_f64();
            assert!(value <= most, "{}: {value} for {alpha:e}", L::NAME);
            let expected = most * power(n64, view64, light64, alpha);
            worst = worst.max((value - expected).abs() / most);
        }
        // Up to the exponent 1024, the error is the rounding of the cosine times the exponent. For
        // larger exponents it is the rounding of the angle, divided by the highlight's width.
        let allowed = rounding * (4.0 * alpha.min(1024.0) + 8.0 * alpha.sqrt());
        assert!(worst <= allowed, "{}: {worst:e} off for {alpha:e}, {allowed:e} allowed", L::NAME);
    }
}

#[test]
fn phong_highlight_is_at_most_k_s() {
    check::<Single>(f64::from(f32::EPSILON));
    check::<Double>(f64::EPSILON.max(1e-13));
}
