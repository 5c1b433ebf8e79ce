//! Single against double precision, in random scenes for which the precision `auto` selects single.

use crate::harness::*;
use crate::random_scenes::driver::{Verdict, compare, many};
use crate::random_scenes::gaps::shows_coincident_opaque;
use crate::random_scenes::statistics::{Worst, blocks, mean_and_error, mean_of};

const SEEDS: u64 = 8;
/// Number of samples per pixel in each replicate.
const SAMPLES: u32 = 4;
/// Allowed error of single precision on average of a block of pixels, in 8-bit levels. At the most
/// unfavourable ratio of sizes for which `auto` still selects single precision, the error over a
/// whole picture is 0.12 (docs/accuracy.md).
const FLOOR: f64 = 0.5;

/// Returns the displayed values of every pixel, in 8-bit levels: one picture for each seed.
pub fn levels(scene: &Scene, precision: Precision, samples: u32) -> Vec<Vec<[f64; 3]>> {
    let display = Display::default();
    (0..SEEDS)
        .map(|seed| {
            let rendering = rendered(scene, seed, precision, samples);
            picture(&rendering, Replicates::Both)
                .into_iter()
                .map(|rgb| display.levels(rgb))
                .collect()
        })
        .collect()
}

/// Compares the block means of two sets of pictures, which have the same list of seeds. Two
/// pictures with the same seed have the same samples, so that most of their noise cancels in their
/// difference. The test therefore uses these differences.
pub fn paired(
    size: [u32; 2],
    names: [&str; 2],
    [a, b]: [&[Vec<[f64; 3]>]; 2],
    floor: f64,
) -> Verdict {
    let blocks = blocks(size);
    let mut worst = Worst::new(3 * blocks.len(), a.len() - 1);
    for (i, pixels) in blocks.iter().enumerate() {
        let means = |pictures: &[Vec<[f64; 3]>]| -> Vec<[f64; 3]> {
            pictures.iter().map(|p| mean_of(p, pixels)).collect()
        };
        let (a, b) = (means(a), means(b));
        for c in 0..3 {
            let differences: Vec<f64> = a.iter().zip(&b).map(|(a, b)| a[c] - b[c]).collect();
            let (mean, error) = mean_and_error(&differences);
            worst.note(mean, floor, error, || {
                let mean_of_channel =
                    |v: &[[f64; 3]]| v.iter().map(|m| m[c]).sum::<f64>() / v.len() as f64;
                let [first, second] = names;
                format!(
                    "block {i} of {}, channel {c}: {first} {:.2}, {second} {:.2} 8-bit levels",
                    blocks.len(),
                    mean_of_channel(&a),
                    mean_of_channel(&b)
                )
            });
        }
    }
    worst.beyond_chance().map_or(Verdict::Same, Verdict::Different)
}

fn single_is_double(scene: &Scene) -> Verdict {
    let mut scene = scene.clone();
    // With a point filter, the centre of a pixel could be exactly on an edge.
    scene.film.filter = Filter::Box;
    if let AnyWorld::Double(_) = AnyWorld::compile(&scene, &Options::default()) {
        return Verdict::Skipped("auto selects double precision");
    }
    let [single, double] =
        [Precision::Single, Precision::Double].map(|p| levels(&scene, p, SAMPLES));
    let verdict = paired(scene.film.size, ["single", "double"], [&single, &double], FLOOR);
    // Rounding decides which of two coincident opaque surfaces is visible. In seed 36 the cap of a
    // cylinder lies in a plane.
    if matches!(verdict, Verdict::Different(_)) && shows_coincident_opaque(&scene) {
        return Verdict::Skipped("two coincident opaque surfaces are visible");
    }
    verdict
}

scene_tests!(precisions, 0..16, many_precisions, many(), single_is_double);
