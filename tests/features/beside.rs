//! The program's picture beside that of the plain tracer of tests/agreement.

use crate::common::Numbers;
use crate::compare::{Picture, reference, small};
use crate::row::Verdict;
use crate::sight::RASTER;
use crate::support::{picture, rendered, sized};
use crate::tracer::{Mutation, Tracer};
use glam::DVec3;
use zerkalo::film::Replicates;
use zerkalo::scene::{Filter, Scene};
use zerkalo::world::Precision;

/// Samples of the program for one pixel and replicate.
const OWN: u32 = 256;

/// Whether the program's picture of `shown` is, as far as noise can tell, the picture that the plain
/// tracer makes of `meant` with `samples` samples a pixel.
pub fn agrees(meant: &Scene, shown: &Scene, samples: u32) -> Verdict {
    let reference = reference(&small(meant.clone()), samples, Mutation::None);
    let reference = reference.expect("the plain tracer knows everything in it");
    let verdict = Picture::new(&small(shown.clone()), OWN).beside(&reference, samples);
    if verdict.agree() { Ok(()) } else { Err(verdict.to_string()) }
}

/// Every pixel of a picture without chance: one ray through each centre.
pub fn without_chance(scene: &Scene) -> Vec<DVec3> {
    let mut scene = sized(scene.clone(), RASTER);
    scene.film.filter = Filter::Point;
    let rendering = rendered(&scene, 1, Precision::Double, 1);
    picture(&rendering, Replicates::Both).into_iter().map(DVec3::from).collect()
}

/// Whether both programs agree on every pixel of scenes in which nothing is left to chance.
pub fn exactly(meant: &Scene, shown: &Scene) -> Verdict {
    let mut meant = sized(meant.clone(), RASTER);
    meant.film.filter = Filter::Point;
    let tracer =
        Tracer::new(&meant, Mutation::None).expect("the plain tracer knows everything in it");
    let mut numbers = Numbers::new(1);
    let own = without_chance(shown);
    let mut wrong = Vec::new();
    for (i, own) in own.iter().enumerate() {
        let (x, y) = (i as u32 % RASTER[0], i as u32 / RASTER[0]);
        let plain = tracer.pixel(x, y, 2, &mut numbers).mean;
        // Roundings of the film, and of two ways to compute the same thing.
        let apart = (*own - plain).abs().max_element();
        if apart > 1e-6 * (plain.abs().max_element() + 1e-3) {
            wrong.push(format!("pixel {x}, {y}: {own} for {plain}"));
        }
    }
    match wrong.first() {
        None => Ok(()),
        Some(first) => Err(format!("{} of {} pixels, {first}", wrong.len(), own.len())),
    }
}
