//! Soundness of random scenes: no panic, no invalid sample, finite noise. In scenes without random
//! choices both replicates must be equal.

use crate::harness::*;
use crate::random_scenes::driver::{Verdict, compare, many};
use crate::random_scenes::layouts::Layout;
use crate::random_scenes::scene::seeds_of;

const SAMPLES: u32 = 4;

/// Returns the precisions to be tested: double precision, and `auto` if it selects single
/// precision.
fn precisions(scene: &Scene) -> impl Iterator<Item = Precision> {
    let is_double =
        matches!(AnyWorld::compile(scene, &world::Options::default()), AnyWorld::Double(_));
    let auto = (!is_double).then_some(Precision::Auto);
    auto.into_iter().chain([Precision::Double])
}

fn sound(scene: &Scene) -> Verdict {
    for precision in precisions(scene) {
        let mut rendering = rendered(scene, 1, precision, SAMPLES);
        // `rendered` traces few samples of each pixel, in packets of many pixels. These eight
        // samples of a pixel are traced in packets of one pixel.
        uniform(&mut rendering, 8, 8, &pool(2));
        let bad = rendering.film.bad_samples();
        if bad > 0 {
            return Verdict::Different(format!("{precision:?}: {bad} bad samples"));
        }
        let parts =
            [Replicates::A, Replicates::B, Replicates::Both].map(|part| picture(&rendering, part));
        let is_valid = |p: &[f64; 3]| p.iter().all(|c| c.is_finite() && *c >= 0.0);
        if let Some(i) = parts.iter().flatten().position(|p| !is_valid(p)) {
            return Verdict::Different(format!(
                "{precision:?}: pixel {i} is not finite or negative"
            ));
        }
        let noise = rendering.film.noise(&rendering.weights, &Display::default());
        let values = noise.map(|n| [n.rmse.linear, n.rmse.levels, n.p95_levels]);
        if !values.is_some_and(|values| values.iter().all(|x| x.is_finite() && *x >= 0.0)) {
            return Verdict::Different(format!("{precision:?}: a noise of {noise:?}"));
        }
    }
    Verdict::Same
}

fn replicates_are_equal(scene: &Scene) -> Verdict {
    let mut scene = scene.clone();
    without_chance(&mut scene);
    for precision in precisions(&scene) {
        let rendering = rendered(&scene, 1, precision, SAMPLES);
        let [a, b] = [Replicates::A, Replicates::B].map(|part| picture(&rendering, part));
        if let Some(i) = (0..a.len()).find(|i| a[*i] != b[*i]) {
            return Verdict::Different(format!(
                "{precision:?}: without chance pixel {i} is {:?} and {:?}",
                a[i], b[i]
            ));
        }
    }
    Verdict::Same
}

scene_tests!(soundness, 0..16, many_soundness, many(), sound);

/// Checks scenes whose objects have positions and sizes from 1e-6 to 1e6.
#[test]
fn wild_soundness() {
    compare("soundness", seeds_of(Layout::Wild, 20..60), sound);
}

scene_tests!(replicates, 0..16, many_replicates, many(), replicates_are_equal);

#[test]
fn wild_replicates() {
    compare("replicates", seeds_of(Layout::Wild, 12..87), replicates_are_equal);
}

#[test]
fn light_close_to_floor_has_no_bad_sample() {
    let scene = parsed(
        "[film]\nsize = [16, 16]\n[camera]\neye = [0.0, 1e-4, 1e-4]\ntarget = [0.0, 0.0, 0.0]\n\
         [[light]]\npoint = { position = [0.0, 1e-5, 0.0] }\nfalloff = \"inverse-square\"\n\
         [[object]]\nshape.platform = { center = [0.0, 0.0, 0.0], size = [10.0, 10.0] }\n",
    );
    for precision in [Precision::Auto, Precision::Double] {
        let rendering = rendered(&scene, 2, precision, 16);
        assert_eq!(rendering.film.bad_samples(), 0);
        let brightest =
            picture(&rendering, Replicates::Both).iter().map(|p| p[0]).fold(0.0, f64::max);
        assert!(brightest > 1e8, "{brightest}");
    }
}
