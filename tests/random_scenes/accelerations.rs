//! Every way of acceleration gives the same film, byte by byte.

use crate::driver::{Verdict, compare, compare_many};
use crate::support::{accelerated, picture};
use zerkalo::film::Replicates;
use zerkalo::scene::{Acceleration, Scene};
use zerkalo::world::Precision;

/// Samples of a pixel and replicate: not a multiple of a packet.
const SAMPLES: u32 = 3;

fn same_bytes(scene: &Scene) -> Verdict {
    for precision in [Precision::Single, Precision::Double] {
        let film = |by| accelerated(scene, by, precision, SAMPLES);
        let wanted = film(Acceleration::None);
        for by in Acceleration::ALL {
            let found = film(by);
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
                by.name(),
                differ.len(),
                wanted.len(),
            ));
        }
    }
    Verdict::Same
}

#[test]
fn accelerations() {
    compare("accelerations", 0..96, same_bytes);
}

#[test]
#[ignore = "as many scenes as the environment asks for"]
fn many_accelerations() {
    compare_many("accelerations", same_bytes);
}
