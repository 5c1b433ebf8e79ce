//! Adaptive and uniform pictures against a reference of other seeds with more samples: the same means, errors as
//! large as reported, and no more rays for the same error.

use crate::driver::{Verdict, compare, compare_many, many};
use crate::layouts::Layout;
use crate::scene::of;
use crate::statistics::{BLOCK, Worst, blocks, mean_and_error, mean_of};
use crate::support::{begin, picture, pool, rendered, settings, trace};
use zerkalo::film::{Display, Replicates, TILE};
use zerkalo::render::RenderState;
use zerkalo::render::schedule::{Step, Stop};
use zerkalo::scene::Scene;
use zerkalo::world::Precision;

const SEEDS: u64 = 8;
/// Samples of a pixel, both replicates together.
const SAMPLES: u32 = 32;
/// Samples of a pixel of the reference, for each of its seeds.
const REFERENCE: u32 = 128;
/// True error over the reported one, and the other way round.
const HONEST: [f64; 2] = [0.9, 1.15];
/// The most that the squared error of the reference may be, beside that of the uniform pictures, which have a 32nd of
/// its samples.
const TOLD: f64 = 0.125;
/// Rays of an adaptive picture for those of a uniform one with the same true error.
const RAYS: f64 = 1.5;
/// Where an adaptive rendering that has not come to its noise is given up, beside the rays of the uniform one.
const GIVEN_UP: u64 = 4;
/// Standard errors beyond which a number is not what it should be.
const ERRORS: f64 = 5.0;

/// A picture of one seed and what is reported of it.
struct Shot {
    picture: Vec<[f64; 3]>,
    /// Samples of every pixel.
    counts: Vec<f64>,
    rays: f64,
    /// Reported mean squared error, in codes.
    reported: f64,
    ended: bool,
}

fn counts(rendering: &RenderState) -> Vec<f64> {
    let film = &rendering.film;
    let tile = |x: usize, y: usize| y / TILE * film.tile_columns() + x / TILE;
    let of = |i: usize| {
        let tile = film.tile(tile(i % film.width(), i / film.width()));
        tile.map_or(0, |t| t.counts().iter().sum::<u32>())
    };
    (0..film.width() * film.height()).map(|i| f64::from(of(i))).collect()
}

/// Follows the schedule to its end, or until it has taken more rays than `most`.
fn shot(scene: &Scene, seed: u64, adaptive: bool, stop: Stop, most: u64) -> Shot {
    let mut rendering = begin(scene, seed, Precision::Auto);
    let (mut schedule, pool) = (rendering.schedule(settings(adaptive, 0, stop)), pool(1));
    let ended = loop {
        match schedule.next(0.0) {
            Step::Finished(_) => break true,
            Step::Trace(_) if schedule.rays() > most => break false,
            Step::Trace(wave) => {
                let report = trace(&mut rendering, &wave, &pool);
                schedule.complete(&wave, &report);
            }
        }
    };
    let noise = rendering.film.noise(&rendering.mix, &Display::default());
    Shot {
        picture: picture(&rendering, Replicates::Both),
        counts: counts(&rendering),
        rays: schedule.rays() as f64,
        reported: noise.map_or(0.0, |n| n.rmse_codes.powi(2)),
        ended,
    }
}

/// The mean of some pictures of equally many samples.
struct Reference {
    pictures: Vec<Vec<[f64; 3]>>,
    codes: Vec<[f64; 3]>,
    /// Mean squared error, in codes.
    error: f64,
}

impl Reference {
    fn new(scene: &Scene) -> Self {
        let render = |seed| {
            let rendering = rendered(scene, seed, Precision::Auto, REFERENCE / 2);
            picture(&rendering, Replicates::Both)
        };
        let pictures: Vec<_> = (1000..1000 + SEEDS).map(render).collect();
        let display = Display::default();
        let (mut codes, mut error) = (Vec::new(), 0.0);
        for i in 0..pictures[0].len() {
            let mean = [0, 1, 2]
                .map(|c| mean_and_error(&pictures.iter().map(|p| p[i][c]).collect::<Vec<_>>()).0);
            let code = display.codes(mean);
            for c in 0..3 {
                let of = |p: &Vec<[f64; 3]>| display.codes(p[i])[c];
                error += mean_and_error(&pictures.iter().map(of).collect::<Vec<_>>()).1.powi(2);
            }
            codes.push(code);
        }
        error /= (3 * codes.len()) as f64;
        Self { pictures, codes, error }
    }

    /// The mean squared error of a picture, in codes.
    fn error_of(&self, picture: &[[f64; 3]]) -> f64 {
        let display = Display::default();
        let squares = picture.iter().zip(&self.codes).flat_map(|(p, wanted)| {
            let codes = display.codes(*p);
            [0, 1, 2].map(|c| (codes[c] - wanted[c]).powi(2))
        });
        squares.sum::<f64>() / (3 * picture.len()) as f64 - self.error
    }

    /// What the means of the blocks differ by, beyond chance. How much single samples differ is taken from the
    /// pictures or from the reference, whichever has more: who has not met a rare event knows nothing of it.
    fn differs(&self, name: &str, shots: &[Shot], size: [u32; 2]) -> Option<String> {
        let blocks = blocks(size);
        let mut worst = Worst::new(3 * blocks.len(), SEEDS as usize - 1);
        for (i, pixels) in blocks.iter().enumerate() {
            let theirs: Vec<_> = self.pictures.iter().map(|p| mean_of(p, pixels)).collect();
            let ours: Vec<_> = shots.iter().map(|s| mean_of(&s.picture, pixels)).collect();
            // Of the whole picture the fewest samples count.
            let per_pixel = |s: &Shot| pixels.iter().map(|p| s.counts[*p]).fold(f64::MAX, f64::min);
            let count = shots.iter().map(per_pixel).sum::<f64>() / SEEDS as f64;
            for c in 0..3 {
                let of =
                    |v: &[[f64; 3]]| mean_and_error(&v.iter().map(|m| m[c]).collect::<Vec<_>>());
                let ((wanted, error), (found, own)) = (of(&theirs), of(&ours));
                let expected = error * (f64::from(REFERENCE) / count).sqrt();
                let chance = (error.powi(2) + own.max(expected).powi(2)).sqrt();
                let floor = 1e-6 * (wanted.abs() + 1e-3);
                worst.note(found - wanted, floor, chance, || {
                    format!(
                        "{name}: block {i} of {} ({BLOCK} pixels; the last is the picture), channel {c}: \
                         {found:.6} instead of {wanted:.6}",
                        blocks.len()
                    )
                });
            }
        }
        worst.beyond_chance()
    }
}

/// The true error over the reported one, beyond doubt too small or too large.
fn dishonest(name: &str, reference: &Reference, shots: &[Shot]) -> Option<String> {
    let [low, high] = HONEST.map(|r| r * r);
    let against = |factor: f64| {
        let beyond = |s: &Shot| reference.error_of(&s.picture) - factor * s.reported;
        let (mean, error) = mean_and_error(&shots.iter().map(beyond).collect::<Vec<_>>());
        // The reference's own error is known to a quarter or so.
        (mean, error.hypot(0.5 * reference.error) + 1e-6)
    };
    let ((above, above_error), (below, below_error)) = (against(high), against(low));
    let wrong = above > ERRORS * above_error || below < -ERRORS * below_error;
    let mean = |of: &dyn Fn(&Shot) -> f64| shots.iter().map(of).sum::<f64>() / shots.len() as f64;
    wrong.then(|| {
        let truth = mean(&|s| reference.error_of(&s.picture)).max(0.0).sqrt();
        let told = mean(&|s| s.reported).sqrt();
        format!("{name}: a true error of {truth:.3} codes, reported {told:.3}: {:.2}", truth / told)
    })
}

fn as_the_reference(scene: &Scene) -> Verdict {
    let reference = Reference::new(scene);
    let all = |adaptive| -> Vec<Shot> {
        let stop = Stop { spp: Some(SAMPLES), ..Stop::default() };
        (0..SEEDS).map(|seed| shot(scene, seed, adaptive, stop, u64::MAX)).collect()
    };
    let (uniform, adaptive) = (all(false), all(true));
    let truth = uniform.iter().map(|s| reference.error_of(&s.picture)).sum::<f64>() / SEEDS as f64;
    if reference.error > TOLD * truth.max(0.0) + 1e-9 {
        return Verdict::Skipped("of what so few samples meet the reference knows too little");
    }
    let mut wrong = Vec::new();
    for (name, shots) in [("uniform", &uniform), ("adaptive", &adaptive)] {
        wrong.extend(reference.differs(name, shots, scene.film.size));
        wrong.extend(dishonest(name, &reference, shots));
    }
    let cost = |s: &Shot| s.rays * reference.error_of(&s.picture);
    let more: Vec<f64> =
        adaptive.iter().zip(&uniform).map(|(a, u)| cost(a) - RAYS * cost(u)).collect();
    let (more, error) = mean_and_error(&more);
    let rays = uniform.iter().map(|s| s.rays).sum::<f64>() / SEEDS as f64;
    if more > ERRORS * (error + 0.5 * reference.error * rays) + 1e-6 * rays {
        let sum = |shots: &[Shot]| shots.iter().map(cost).sum::<f64>();
        wrong.push(format!(
            "adaptive needs {:.2} times the rays of uniform for the same error",
            sum(&adaptive) / sum(&uniform)
        ));
    }
    let reported = uniform.iter().map(|s| s.reported).sum::<f64>() / SEEDS as f64;
    for factor in [1.0, 2.0].into_iter().filter(|_| reported > 0.0) {
        let noise = factor * reported.sqrt();
        let stop = Stop { noise_codes: Some(noise), ..Stop::default() };
        let to_noise = |seed| shot(scene, seed, true, stop, GIVEN_UP * rays as u64);
        let shots: Vec<Shot> = (0..SEEDS).map(to_noise).collect();
        let left = shots.iter().filter(|s| !s.ended).count();
        if left > 0 {
            wrong.push(format!(
                "adaptive has not come to a noise of {noise:.3} with {GIVEN_UP} times the rays with which \
                 uniform has {:.3}, for {left} of {SEEDS} seeds",
                reported.sqrt()
            ));
        }
        wrong.extend(dishonest(&format!("adaptive to a noise of {noise:.3}"), &reference, &shots));
    }
    match wrong.is_empty() {
        true => Verdict::Same,
        false => Verdict::Different(wrong.join("; ")),
    }
}

#[test]
fn samples() {
    compare("samples", 0..8, as_the_reference);
}

#[test]
#[ignore = "as many scenes as the environment asks for"]
fn many_samples() {
    compare_many("samples", as_the_reference);
}

/// Only scenes whose pictures are mostly empty.
#[test]
fn sparse_samples() {
    compare("samples", of(Layout::Sparse, 0..5), as_the_reference);
}

#[test]
#[ignore = "as many scenes as the environment asks for"]
fn many_sparse_samples() {
    compare("samples", of(Layout::Sparse, many()), as_the_reference);
}
