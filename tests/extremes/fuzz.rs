//! Random scenes of any proportions: none panics, none has a sample that is no light, and where nothing
//! is left to chance both replicates are the same.

use crate::random::{self, Contents};
use crate::support::{begin, parsed, picture, pool, rendered, uniform};
use proptest::prelude::*;
use std::sync::atomic::{AtomicU32, Ordering};
use zerkalo::film::Part;
use zerkalo::scene::Scene;
use zerkalo::world::Precision;

const SAMPLES: u32 = 4;

/// Scenes that were read, and those that were refused with a message.
#[derive(Default)]
struct Count {
    taken: AtomicU32,
    refused: AtomicU32,
    /// Those whose picture shows anything.
    shown: AtomicU32,
}

/// The pictures of both replicates.
type Replicates = [Vec<[f64; 3]>; 2];

/// Renders a random scene, unless its text is refused; gives both replicates of each precision.
fn rendered_twice(
    text: &str,
    count: &Count,
) -> Result<Vec<(Precision, Replicates)>, TestCaseError> {
    let Ok(scene) = Scene::parse(text, "test") else {
        count.refused.fetch_add(1, Ordering::Relaxed);
        return Ok(Vec::new());
    };
    count.taken.fetch_add(1, Ordering::Relaxed);
    let pool = pool(1);
    let mut out = Vec::new();
    for precision in [Precision::Single, Precision::Double] {
        let mut rendering = begin(&scene, 1, precision);
        // Packets of several pixels, and of one.
        uniform(&mut rendering, 0, SAMPLES, &pool);
        uniform(&mut rendering, 8, 8, &pool);
        let bad = rendering.film.bad_samples();
        prop_assert_eq!(bad.count, 0, "{:?}: {:?} in\n{}", precision, bad.first, text);
        let parts = [Part::A, Part::B].map(|part| picture(&rendering, part));
        let good = |p: &[f64; 3]| p.iter().all(|c| c.is_finite() && *c >= 0.0);
        prop_assert!(parts.iter().flatten().all(good), "{:?} in\n{}", precision, text);
        out.push((precision, parts));
    }
    Ok(out)
}

/// The generator makes scenes, and most of them are legal.
fn mostly_taken(count: &Count, cases: u32) {
    let (taken, refused) =
        (count.taken.load(Ordering::Relaxed), count.refused.load(Ordering::Relaxed));
    println!("{taken} scenes rendered, {refused} refused");
    assert!(taken > cases * 3 / 5, "only {taken} rendered, {refused} refused");
}

const CASES: u32 = 600;

#[test]
fn random_scenes_have_no_bad_sample() {
    let count = Count::default();
    let config = ProptestConfig { cases: CASES, failure_persistence: None, ..Default::default() };
    proptest!(config, |(seed in any::<u64>(), objects in 1..7usize)| {
        let text = random::scene(seed, objects, Contents::Anything);
        for (_, [a, _]) in rendered_twice(&text, &count)? {
            count.shown.fetch_add(u32::from(a.iter().any(|p| *p != a[0])), Ordering::Relaxed);
        }
    });
    mostly_taken(&count, CASES);
    let shown = count.shown.into_inner();
    println!("{shown} pictures are not of one colour");
    assert!(shown > CASES / 2, "only {shown} pictures show anything");
}

#[test]
fn random_scenes_without_chance_have_equal_replicates() {
    let count = Count::default();
    let config = ProptestConfig { cases: CASES, failure_persistence: None, ..Default::default() };
    proptest!(config, |(seed in any::<u64>(), objects in 1..7usize)| {
        let text = random::scene(seed, objects, Contents::Determined);
        for (precision, [a, b]) in rendered_twice(&text, &count)? {
            prop_assert!(a == b, "{:?}: replicates differ in\n{}", precision, text);
        }
    });
    mostly_taken(&count, CASES);
}

/// A lamp a few millionths of the scene above the floor is bright there, not wrong.
#[test]
fn a_lamp_close_to_the_floor_has_no_bad_sample() {
    let scene = parsed(
        "[film]\nsize = [16, 16]\n[camera]\neye = [0.0, 1e-4, 1e-4]\ntarget = [0.0, 0.0, 0.0]\n\
         [[light]]\npoint = { position = [0.0, 1e-5, 0.0] }\nfalloff = \"inverse-square\"\n\
         [[object]]\nshape.platform = { center = [0.0, 0.0, 0.0], size = [10.0, 10.0] }\n",
    );
    for precision in [Precision::Auto, Precision::Double] {
        let rendering = rendered(&scene, 2, precision, 16);
        assert_eq!(rendering.film.bad_samples().count, 0);
        let brightest = picture(&rendering, Part::Both).iter().map(|p| p[0]).fold(0.0, f64::max);
        assert!(brightest > 1e8, "{brightest}");
    }
}
