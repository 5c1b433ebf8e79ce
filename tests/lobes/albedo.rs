//! Albedo of Cook-Torrance in a white furnace (the tests named `extreme_23_*`).

use crate::harness::*;
use crate::lobes::setup::*;

const DEGREES: [f64; 5] = [0.0, 45.0, 75.0, 85.0, 89.0];

/// Known albedos of Beckmann microfacets with the Fresnel reflectance F = 1. Each row contains a
/// masking, an alpha, and the albedos at the angles [`DEGREES`]. They come from a numerical
/// quadrature of the closed formula, independent of this program.
const KNOWN: [(Masking, f64, [f64; 5]); 7] = [
    (Masking::VCavity, 0.2, [1.000, 0.992, 0.928, 0.960, 0.991]),
    (Masking::VCavity, 0.4, [0.964, 0.912, 0.932, 0.975, 0.995]),
    (Masking::VCavity, 0.7, [0.698, 0.782, 0.930, 0.977, 0.995]),
    (Masking::VCavity, 1.0, [0.453, 0.640, 0.906, 0.970, 0.994]),
    (Masking::Smith, 0.4, [0.990, 0.920, 0.903, 0.955, 0.990]),
    (Masking::Smith, 0.7, [0.749, 0.792, 0.903, 0.963, 0.992]),
    (Masking::Smith, 1.0, [0.462, 0.651, 0.881, 0.959, 0.991]),
];

fn albedo<L: SimdFloat>(lobe: Lobe, masking: Masking, alpha: f64, degrees: f64, count: u32) -> f64 {
    let n = tilted_normal();
    let incident = combine(&[(-1.0, at_angle(n, degrees.to_radians(), 1.0))]);
    let mut material = reflector(lobe, masking, 0.0);
    material.alpha = Some(alpha);
    let mut sum = 0.0;
    each_reflection::<L>(&material, (incident, n), true, Draws::sobol(9), count, |_, w| {
        // With sampling of visible normals, the weight of a sample is at most 1.
        assert!((0.0..=1.0).contains(&w[0]) && w[0] == w[1] && w[1] == w[2], "{w:?}");
        sum += w[0];
    });
    sum / f64::from(count)
}

fn compare<L: SimdFloat>() {
    let mut worst = 0f64;
    for (masking, alpha, known) in KNOWN {
        for (degrees, known) in DEGREES.into_iter().zip(known) {
            let found = albedo::<L>(Lobe::Beckmann, masking, alpha, degrees, 1 << 16);
            let name = format!("{} {masking:?} {alpha} at {degrees}", L::NAME);
            assert!((found - known).abs() <= 0.003, "{name}: {found} for {known}");
            worst = worst.max((found - known).abs());
        }
    }
    report(23, precision::<L>(), &format!("table {worst:.4} off at most"));
}

#[test]
fn extreme_23_furnace_of_cook_torrance() {
    compare::<Double>();
    compare::<Single>();
}

#[test]
fn extreme_23_microfacets_never_return_more_than_they_get() {
    let mut most = [0f64; 2];
    for (lobe, masking) in every_lobe().into_iter().filter(|(l, _)| has_facets(*l)) {
        for alpha in [1e-8, 1e-3, 0.01, 0.05, 0.2, 0.4, 0.7, 1.0, 2.0, 10.0, 1e6] {
            for degrees in
                [0.0, 10.0, 30.0, 45.0, 60.0, 75.0, 80.0, 85.0, 89.0, 89.9, 89.99, 89.999_999]
            {
                let found = albedo::<Double>(lobe, masking, alpha, degrees, 1 << 14);
                assert!(found <= 1.001, "{lobe:?} {masking:?} {alpha} at {degrees}: {found}");
                most[0] = most[0].max(found);
                let found = albedo::<Single>(lobe, masking, alpha, degrees, 1 << 14);
                assert!(
                    found <= 1.001,
                    "single {lobe:?} {masking:?} {alpha} at {degrees}: {found}"
                );
                most[1] = most[1].max(found);
            }
        }
    }
    report(23, "double", &format!("at most {:.5} comes back", most[0]));
    report(23, "single", &format!("at most {:.5} comes back", most[1]));
}
