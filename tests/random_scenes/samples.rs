//! Adaptive and uniform pictures of random scenes, against a reference of other seeds with more
//! samples. The means must be equal, and the true errors must equal the reported ones. For the same
//! error, adaptive pictures must take at most 1.5 times the rays of uniform ones.

use crate::harness::*;
use crate::random_scenes::driver::{Verdict, compare, many};
use crate::random_scenes::layouts::Layout;
use crate::random_scenes::scene::seeds_of;
use crate::random_scenes::statistics::{BLOCK, Worst, blocks, mean_and_error, mean_of};

/// Number of seeds of the first comparison of a scene, which a second one may follow.
const SEEDS: u64 = 8;
/// Samples per pixel of the uniform pictures, in both replicates together.
const SAMPLES: u32 = 32;
const REFERENCE_PICTURES: u64 = 8;
/// Samples per pixel of each picture of the reference, in the first comparison of a scene.
const REFERENCE: u32 = 128;
/// Ratio of the second comparison to the first, in the number of seeds and in the sample count of
/// the reference. A scene that differs in the first comparison is compared a second time with other
/// seeds, and only this result counts. The first is unreliable, because the standard error of eight
/// numbers with a skewed distribution is often far too small: if one of 20 pictures contains a rare
/// bright sample, eight pictures without it agree.
const REPETITION: u32 = 8;
/// Allowed range of the true error, divided by the reported one.
const HONEST: [f64; 2] = [0.9, 1.15];
/// Largest allowed squared error of the reference, relative to that of the uniform pictures. The
/// expected value is 1/32, because a uniform picture of the first comparison has a 32nd of the
/// reference's samples. The constant also limits the relative change of the uniform pictures'
/// squared error if half of the reference is left out.
const MAX_REFERENCE_ERROR: f64 = 0.125;
/// Largest allowed number of rays of an adaptive picture, divided by that of a uniform one with the
/// same true error.
const MAX_RAY_RATIO: f64 = 1.5;
/// Limit on the rays of a picture with a noise target, divided by the mean number of rays of the
/// uniform pictures.
const STOP_FACTOR: u64 = 4;
/// Largest amount by which a measurement may exceed its limit in the second comparison, in standard
/// errors. For ratios of errors, a value of Student's t is first converted to the equally probable
/// value of a normal distribution.
const MAX_DEVIATION: f64 = 5.0;
/// Smallest amount by which a measurement must exceed its limit in the first comparison, in
/// standard errors, for a second comparison to follow.
const SUSPICIOUS: f64 = 1.0;

/// Picture of one seed, with the error that the program reports for it. `ended` is `false` if the
/// render was stopped at a limit on its rays.
struct Shot {
    picture: Vec<[f64; 3]>,
    /// Number of samples of each pixel.
    counts: Vec<f64>,
    rays: f64,
    /// Reported mean squared error of the picture, in squared 8-bit levels.
    reported: f64,
    /// Number of effective pixels of the reported error: the number of equally noisy pixels that
    /// would give an error of the same uncertainty.
    effective_pixels: f64,
    ended: bool,
}

fn counts(rendering: &RenderState) -> Vec<f64> {
    let film = &rendering.film;
    let tile = |x: usize, y: usize| y / TILE * film.tile_columns() + x / TILE;
    let count_of = |i: usize| {
        let tile = film.tile(tile(i % film.header.width, i / film.header.width));
        tile.map_or(0, |t| t.counts.iter().sum::<u32>())
    };
    (0..film.header.width * film.header.height).map(|i| f64::from(count_of(i))).collect()
}

/// Renders a picture until the schedule ends or more than `max_rays` rays are traced.
fn shot(scene: &Scene, seed: u64, adaptive: bool, stop: Stop, max_rays: u64) -> Shot {
    let mut rendering = begin(scene, seed, Precision::Auto);
    let (mut schedule, pool) = (rendering.schedule(settings(adaptive, 0, stop)), pool(1));
    let ended = loop {
        match schedule.next(0.0) {
            Step::Finished(_) => break true,
            Step::Trace(_) if schedule.rays > max_rays => break false,
            Step::Trace(wave) => {
                let report = trace(&mut rendering, &wave, &pool);
                schedule.complete(&wave, &report);
            }
        }
    };
    let noise = rendering.film.noise(&rendering.weights, &Display::default());
    Shot {
        picture: picture(&rendering, Replicates::Both),
        counts: counts(&rendering),
        rays: schedule.rays as f64,
        reported: noise.map_or(0.0, |n| n.rmse.levels.powi(2)),
        effective_pixels: noise.map_or(0.0, |n| n.effective_pixels.levels),
        ended,
    }
}

/// Reference: mean of several pictures with equal sample counts.
struct Reference {
    pictures: Vec<Vec<[f64; 3]>>,
    /// Number of samples per pixel of each picture of the reference.
    samples: u32,
    levels: Vec<[f64; 3]>,
    /// Displayed mean of the first half of the pictures, and that of the second half.
    half_levels: [Vec<[f64; 3]>; 2],
    /// Mean squared error of the reference, in squared 8-bit levels.
    error: f64,
}

/// Returns the mean of `pictures` as displayed, in 8-bit levels.
fn mean_levels(pictures: &[Vec<[f64; 3]>]) -> Vec<[f64; 3]> {
    let mean = |i: usize| {
        [0, 1, 2].map(|c| pictures.iter().map(|p| p[i][c]).sum::<f64>() / pictures.len() as f64)
    };
    (0..pictures[0].len()).map(|i| Display::default().levels(mean(i))).collect()
}

/// Returns the mean squared difference between a picture as displayed and the values `wanted`, in
/// squared 8-bit levels.
fn square(picture: &[[f64; 3]], wanted: &[[f64; 3]]) -> f64 {
    let display = Display::default();
    let squares = picture.iter().zip(wanted).flat_map(|(p, wanted)| {
        let levels = display.levels(*p);
        [0, 1, 2].map(|c| (levels[c] - wanted[c]).powi(2))
    });
    squares.sum::<f64>() / (3 * picture.len()) as f64
}

impl Reference {
    /// Renders a reference: several pictures with `samples` samples per pixel each.
    fn new(scene: &Scene, first_seed: u64, samples: u32) -> Self {
        let render = |seed| {
            let rendering = rendered(scene, seed, Precision::Auto, samples / 2);
            picture(&rendering, Replicates::Both)
        };
        let seeds = first_seed..first_seed + REFERENCE_PICTURES;
        let pictures: Vec<_> = seeds.map(render).collect();
        let display = Display::default();
        let pixels = pictures[0].len();
        let variance = |i: usize, c: usize| {
            let levels: Vec<_> = pictures.iter().map(|p| display.levels(p[i])[c]).collect();
            mean_and_error(&levels).1.powi(2)
        };
        let error = (0..pixels).flat_map(|i| [0, 1, 2].map(|c| variance(i, c))).sum::<f64>()
            / (3 * pixels) as f64;
        let (first, second) = pictures.split_at(pictures.len() / 2);
        let half_levels = [first, second].map(mean_levels);
        let levels = mean_levels(&pictures);
        Self { pictures, samples, levels, half_levels, error }
    }

    /// Returns the mean squared difference between a picture and this reference, minus the error of
    /// the reference, in squared 8-bit levels.
    fn error_of(&self, picture: &[[f64; 3]]) -> f64 {
        square(picture, &self.levels) - self.error
    }

    /// Returns `true` if the reference is good enough to measure the error of the pictures `shots`.
    /// The error of the reference must be small, and the measured error must not change much when
    /// half of the reference is left out. The second condition finds bright samples that are rare
    /// even in the reference; they make the error of the reference look too small.
    fn is_sufficient(&self, shots: &[Shot]) -> bool {
        let mean =
            |of: &dyn Fn(&Shot) -> f64| mean_and_error(&shots.iter().map(of).collect::<Vec<_>>()).0;
        let truth = mean(&|s| self.error_of(&s.picture));
        let from_half =
            |half: &Vec<[f64; 3]>| mean(&|s| square(&s.picture, half)) - 2.0 * self.error;
        let allowed = MAX_REFERENCE_ERROR * truth.max(0.0) + 1e-9;
        self.error <= allowed
            && self.half_levels.iter().all(|half| (from_half(half) - truth).abs() <= allowed)
    }

    /// Returns a text with the largest difference of block means between pictures and reference, if
    /// it is significant. The variance of a single sample is estimated from the pictures and from
    /// the reference. The larger estimate is used, because pictures without a rare bright sample
    /// underestimate the variance.
    fn differs(&self, name: &str, shots: &[Shot], size: [u32; 2]) -> Option<String> {
        let blocks = blocks(size);
        let seeds = shots.len().min(self.pictures.len());
        let mut worst = Worst::new(3 * blocks.len(), seeds - 1);
        for (i, pixels) in blocks.iter().enumerate() {
            let reference_means: Vec<_> =
                self.pictures.iter().map(|p| mean_of(p, pixels)).collect();
            let shot_means: Vec<_> = shots.iter().map(|s| mean_of(&s.picture, pixels)).collect();
            // A block is treated as if all its pixels had the smallest sample count among them.
            let per_pixel = |s: &Shot| pixels.iter().map(|p| s.counts[*p]).fold(f64::MAX, f64::min);
            let count = shots.iter().map(per_pixel).sum::<f64>() / shots.len() as f64;
            for c in 0..3 {
                let channel =
                    |v: &[[f64; 3]]| mean_and_error(&v.iter().map(|m| m[c]).collect::<Vec<_>>());
                let ((wanted, error), (found, shot_error)) =
                    (channel(&reference_means), channel(&shot_means));
                // The error of the reference is scaled to the number and to the sample count of the
                // compared pictures.
                let spread = error * (self.pictures.len() as f64 / shots.len() as f64).sqrt();
                let expected = spread * (f64::from(self.samples) / count).sqrt();
                let chance = (error.powi(2) + shot_error.max(expected).powi(2)).sqrt();
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

/// Mean squared errors of pictures, true and reported.
struct Errors {
    truths: Vec<f64>,
    reports: Vec<f64>,
    /// Sum over all pixels of the squared contribution to the reported error. It is computed as the
    /// sum over pictures of the squared reported error, divided by the number of effective pixels.
    squares: f64,
    /// Mean squared error of the reference.
    reference: f64,
}

impl Errors {
    fn new(reference: &Reference, shots: &[Shot]) -> Self {
        let squares = |s: &Shot| s.reported.powi(2) / s.effective_pixels.max(1.0);
        Self {
            truths: shots.iter().map(|s| reference.error_of(&s.picture)).collect(),
            reports: shots.iter().map(|s| s.reported).collect(),
            squares: shots.iter().map(squares).sum(),
            reference: reference.error,
        }
    }

    fn means(&self) -> [f64; 2] {
        [&self.truths, &self.reports].map(|values| mean_and_error(values).0)
    }

    /// Returns the mean true squared error minus `factor` times the mean reported one, and the
    /// uncertainty of this difference.
    ///
    /// The uncertainty is the larger one of two estimates, combined with the uncertainty of the
    /// reference. The first is the standard error over the pictures. It is too small if a few
    /// pixels contribute most of the reported error: one such pixel more or less would change the
    /// sum much.
    ///
    /// The second estimate therefore counts pixels. The sum R of the reported squared errors
    /// consists of independent contributions r of pixels. Its variance is at most the expectation
    /// of Q, the sum of r^2. T is the sum of the true squared errors. If T / factor exceeds R,
    /// contributions of the same sizes are assumed to be missing from R. With them the variance is
    /// Q T / (factor R).
    fn excess(&self, factor: f64) -> (f64, f64) {
        let differences: Vec<f64> =
            self.truths.iter().zip(&self.reports).map(|(t, r)| t - factor * r).collect();
        let (mean, spread) = mean_and_error(&differences);
        let [truth, reported] = self.means();
        let count = self.truths.len() as f64;
        let growth = if reported > 0.0 { (truth / (factor * reported)).max(1.0) } else { 1.0 };
        let of_pixels = factor * (self.squares * growth).sqrt() / count;
        // The reference's squared error is uncertain by about a quarter. Twice this uncertainty is
        // added.
        (mean, spread.max(of_pixels).hypot(0.5 * self.reference) + 1e-6)
    }

    /// Returns the mean true squared error divided by the mean reported one, and the relative
    /// uncertainty of this ratio.
    fn ratio(&self) -> (f64, f64) {
        let [truth, reported] = self.means();
        let ratio = truth.max(0.0) / reported;
        (ratio, self.excess(ratio).1 / truth)
    }
}

/// Returns a text with the true and the reported error if their ratio is significantly out of
/// range.
///
/// A picture that stops at a noise target stops when its noise estimate is low by chance. The
/// reported error is therefore too small even for uniform pictures. `usual` contains the errors of
/// uniform pictures with the same target. If the ratio of true to reported error of these pictures
/// is out of range, this ratio replaces the limit for the adaptive pictures.
fn dishonest(
    name: &str,
    errors: &Errors,
    usual: Option<&Errors>,
    max_deviation: f64,
) -> Option<String> {
    let (usual, usual_error) = usual.map_or((1.0, 0.0), Errors::ratio);
    let [low, high] = HONEST.map(|r| r * r);
    let [low, high] = [low.min(usual), high.max(usual)];
    let [truth, reported] = errors.means();
    let deviation = |factor: f64| {
        let (excess, error) = errors.excess(factor);
        let t = excess / error.hypot(factor * reported * usual_error);
        t.signum() * z_of_t(t, errors.truths.len() as f64 - 1.0)
    };
    let wrong = deviation(high) >= max_deviation || deviation(low) <= -max_deviation;
    wrong.then(|| {
        let [truth, reported] = [truth, reported].map(|square| square.max(0.0).sqrt());
        format!(
            "{name}: a true error of {truth:.3} 8-bit levels, reported {reported:.3}: {:.2}",
            truth / reported
        )
    })
}

/// Renders pictures with each of `seeds` and compares them with a reference, the mean of several
/// pictures of `reference_samples` samples per pixel. Returns a text for each difference, or the
/// reason for which there is no comparison. A measurement beyond its limit counts as a difference
/// if it exceeds the limit by at least `max_deviation` standard errors.
fn differences(
    scene: &Scene,
    seeds: Range<u64>,
    reference_samples: u32,
    max_deviation: f64,
) -> Result<Vec<String>, &'static str> {
    let reference = Reference::new(scene, 1000 + seeds.start, reference_samples);
    let all = |adaptive, stop, max_rays| -> Vec<Shot> {
        seeds.clone().map(|seed| shot(scene, seed, adaptive, stop, max_rays)).collect()
    };
    let stop = spp_stop(SAMPLES);
    let [uniform, adaptive] = [false, true].map(|adaptive| all(adaptive, stop, u64::MAX));
    if !reference.is_sufficient(&uniform) {
        return Err("the reference is too noisy");
    }
    let mut wrong = Vec::new();
    for (name, shots) in [("uniform", &uniform), ("adaptive", &adaptive)] {
        wrong.extend(reference.differs(name, shots, scene.film.size));
        wrong.extend(dishonest(name, &Errors::new(&reference, shots), None, max_deviation));
    }
    let cost = |s: &Shot| s.rays * reference.error_of(&s.picture);
    let more: Vec<f64> =
        adaptive.iter().zip(&uniform).map(|(a, u)| cost(a) - MAX_RAY_RATIO * cost(u)).collect();
    let (more, error) = mean_and_error(&more);
    let count = uniform.len() as f64;
    let rays = uniform.iter().map(|s| s.rays).sum::<f64>() / count;
    if more > max_deviation * (error + 0.5 * reference.error * rays) + 1e-6 * rays {
        let sum = |shots: &[Shot]| shots.iter().map(cost).sum::<f64>();
        wrong.push(format!(
            "adaptive needs {:.2} times the rays of uniform for the same error",
            sum(&adaptive) / sum(&uniform)
        ));
    }
    let reported = uniform.iter().map(|s| s.reported).sum::<f64>() / count;
    for factor in [1.0, 2.0].into_iter().filter(|_| reported > 0.0) {
        let noise = factor * reported.sqrt();
        let stop = noise_stop(noise);
        let [uniform, adaptive] =
            [false, true].map(|adaptive| all(adaptive, stop, STOP_FACTOR * rays as u64));
        wrong.extend(unfinished(noise, &adaptive, &uniform, max_deviation));
        let [usual, errors] = [&uniform, &adaptive].map(|shots| Errors::new(&reference, shots));
        wrong.extend(dishonest(
            &format!("adaptive to a noise of {noise:.3}"),
            &errors,
            Some(&usual),
            max_deviation,
        ));
    }
    Ok(wrong)
}

/// Compares two numbers of seeds: those for which only the adaptive picture fails to reach a noise
/// target, and those for which only the uniform one fails. Returns a text with both numbers if the
/// first is significantly larger by a sign test (McNemar 1947). Some failures are normal: a picture
/// with a rare bright sample reports more noise than the mean picture does.
fn unfinished(
    noise: f64,
    adaptive: &[Shot],
    uniform: &[Shot],
    max_deviation: f64,
) -> Option<String> {
    let only = |these: &[Shot], others: &[Shot]| {
        these.iter().zip(others).filter(|(this, other)| !this.ended && other.ended).count() as f64
    };
    let (more, fewer) = (only(adaptive, uniform), only(uniform, adaptive));
    (more > fewer && more - fewer >= max_deviation * (more + fewer).sqrt()).then(|| {
        format!(
            "only the adaptive picture has not reached a noise of {noise:.3} with {STOP_FACTOR} times the rays of uniform \
             ones with this noise, for {more} of {} seeds; only the uniform one for {fewer}",
            adaptive.len()
        )
    })
}

/// Compares the pictures of a scene. If they differ, or if the reference is too noisy, compares
/// them a second time with other seeds.
fn matches_reference(scene: &Scene) -> Verdict {
    let outcome = match differences(scene, 0..SEEDS, REFERENCE, SUSPICIOUS) {
        Ok(wrong) if wrong.is_empty() => return Verdict::Same,
        _ => {
            let fresh = SEEDS..SEEDS * (1 + u64::from(REPETITION));
            differences(scene, fresh, REPETITION * REFERENCE, MAX_DEVIATION)
        }
    };
    match outcome {
        Err(why) => Verdict::Skipped(why),
        Ok(wrong) if wrong.is_empty() => Verdict::Same,
        Ok(wrong) => Verdict::Different(wrong.join("; ")),
    }
}

// Compares scenes of four layouts. None of them needs a second comparison, which takes 64 times as
// long as the first.
scene_tests!(samples, 16..20, many_samples, many(), matches_reference);

// Compares scenes whose pictures are mostly empty. None of them needs a second comparison.
scene_tests!(
    sparse_samples,
    seeds_of(Layout::Sparse, 5..6),
    many_sparse_samples,
    seeds_of(Layout::Sparse, many()),
    matches_reference
);
