//! Accuracy of the noise estimate for changed light weights.

use super::{finish, scene};
use crate::harness::*;

/// Returns the picture of a session in 8-bit levels, not rounded, and the estimated noise of this
/// picture.
fn levels(session: &Session) -> (Vec<[f64; 3]>, f64) {
    let read = |r: &RenderState| {
        let mut all = Vec::new();
        for y in 0..r.film.header.height {
            let row = r.film.row(y, Replicates::Both, &r.weights);
            all.extend(row.iter().map(|x| Display::default().levels(*x)));
        }
        all
    };
    let noise =
        |r: &RenderState| r.film.noise(&r.weights, &Display::default()).unwrap().rmse.levels;
    session.with(move |r, _| (read(r), noise(r))).unwrap()
}

/// Checks the noise estimate after lights are dimmed and brightened in a finished adaptive render.
/// The true error is the difference from a fresh render with another seed. On average over several
/// seeds the estimated error must equal the true one, both for the new light weights and for a
/// fresh render with the new lights.
#[test]
fn noise_estimate_after_light_change_is_accurate() {
    let mut bright = scene();
    bright.lights[0].intensity = 2.5;
    bright.lights[1].intensity = 0.05;
    bright.ambient.color = Color([0.2, 0.1, 0.0]);
    let mut other = new_session(2, 1000, spp_stop(4096), false);
    finish(&mut other, &bright);
    let (reference, own) = levels(&other);
    let error = |picture: &[[f64; 3]]| {
        let square =
            |(a, b): (&[f64; 3], &[f64; 3])| (0..3).map(|c| (a[c] - b[c]).powi(2)).sum::<f64>();
        let sum: f64 = picture.iter().zip(&reference).map(square).sum();
        (sum / (3 * picture.len()) as f64 - own * own).sqrt()
    };
    let (mut mixed, mut fresh) = (Vec::new(), Vec::new());
    for seed in 0..8 {
        let mut session = new_session(2, seed, spp_stop(256), true);
        finish(&mut session, &scene());
        let report = finish(&mut session, &bright).report;
        assert_eq!(report.spp.mean.round(), 256.0);
        let (picture, told) = levels(&session);
        mixed.push(error(&picture) / told);
        let mut anew = new_session(2, seed, spp_stop(256), true);
        finish(&mut anew, &bright);
        let (picture, told) = levels(&anew);
        fresh.push(error(&picture) / told);
    }
    let mean = |v: &[f64]| v.iter().sum::<f64>() / v.len() as f64;
    println!("true / told: mixed anew {mixed:.3?}, fresh {fresh:.3?}, reference {own:.4}");
    assert!((0.9..1.1).contains(&mean(&mixed)), "{mixed:?}");
    assert!((0.9..1.1).contains(&mean(&fresh)), "{fresh:?}");
}
