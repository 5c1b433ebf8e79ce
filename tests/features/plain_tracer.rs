//! Comparison of the program's pictures with those of the reference tracer of tests/agreement.

use crate::agreement::SAMPLES;
use crate::agreement::compare::{Picture, reference, small};
use crate::agreement::tracer::{Mutation, Tracer};
use crate::features::first_hits::RASTER;
use crate::features::row::Verdict;
use crate::harness::*;

/// Samples per pixel of each replicate in the picture of a mutation.
const MUTATION_SAMPLES: u32 = SAMPLES / 2;

/// Compares the program's picture of `tested` statistically with the reference tracer's picture of
/// `original`. The reference tracer traces `samples` samples per pixel. The picture of a mutation
/// has fewer samples than that of the original, because mutations deviate by many standard errors.
pub fn agrees(original: &Scene, tested: &Scene, samples: u32) -> Verdict {
    let reference = reference(&small(original.clone()), samples, Mutation::None);
    let reference = reference.expect("the plain tracer supports the scene");
    let of_picture = if tested == original { SAMPLES } else { MUTATION_SAMPLES };
    let verdict = Picture::new(&small(tested.clone()), of_picture).beside(&reference, samples);
    if verdict.agree() { Ok(()) } else { Err(verdict.to_string()) }
}

/// Returns the radiance of every pixel, with one ray through each pixel centre.
pub fn without_chance(scene: &Scene) -> Vec<DVec3> {
    let mut scene = sized(scene.clone(), RASTER);
    scene.film.filter = Filter::Point;
    let rendering = rendered(&scene, 1, Precision::Double, 1);
    picture(&rendering, Replicates::Both).into_iter().map(DVec3::from).collect()
}

/// Compares the program's picture of `tested` with the reference tracer's picture of `original`,
/// pixel by pixel. The pictures must not depend on random numbers.
pub fn agrees_exactly(original: &Scene, tested: &Scene) -> Verdict {
    let mut original = sized(original.clone(), RASTER);
    original.film.filter = Filter::Point;
    let tracer =
        Tracer::new(&original, Mutation::None).expect("the plain tracer supports the scene");
    let mut numbers = Numbers::new(1);
    let pixels = without_chance(tested);
    let mut wrong = Vec::new();
    for (i, pixel) in pixels.iter().enumerate() {
        let (x, y) = (i as u32 % RASTER[0], i as u32 / RASTER[0]);
        let expected = tracer.pixel(x, y, 2, &mut numbers).mean;
        // Allowed difference: the film rounds, and the two programs round differently.
        let difference = (*pixel - expected).abs().max_element();
        if difference > 1e-6 * (expected.abs().max_element() + 1e-3) {
            wrong.push(format!("pixel {x}, {y}: {pixel} instead of {expected}"));
        }
    }
    match wrong.first() {
        None => Ok(()),
        Some(first) => Err(format!("{} of {} pixels, {first}", wrong.len(), pixels.len())),
    }
}
