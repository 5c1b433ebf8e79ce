//! Acceleration structures on random scenes. The films of a scene with all structures must be
//! identical byte for byte.

use crate::harness::*;
use crate::random_scenes::driver::{Verdict, compare, many};

/// Number of samples per pixel in each replicate. It is not a multiple of the packet width.
const SAMPLES: u32 = 3;

fn same_bytes(scene: &Scene) -> Verdict {
    for precision in [Precision::Single, Precision::Double] {
        let film = |acceleration| accelerated(scene, acceleration, precision, SAMPLES);
        let wanted = film(Acceleration::None);
        for acceleration in Acceleration::ALL.into_iter().filter(|a| *a != Acceleration::None) {
            let found = film(acceleration);
            if found.film.bytes() == wanted.film.bytes() {
                continue;
            }
            let [wanted, found] = [&wanted, &found].map(|r| picture(r, Replicates::Both));
            let differ: Vec<usize> =
                (0..wanted.len()).filter(|i| wanted[*i] != found[*i]).collect();
            let width = scene.film.size[0] as usize;
            let first = differ.first().map(|i| ([i % width, i / width], wanted[*i], found[*i]));
            return Verdict::Different(format!(
                "{precision:?}: {} differs from none in {} of {} pixels; the first, none, {0}: \
                 {first:?}",
                acceleration.name(),
                differ.len(),
                wanted.len(),
            ));
        }
    }
    Verdict::Same
}

scene_tests!(accelerations, 0..16, many_accelerations, many(), same_bytes);
