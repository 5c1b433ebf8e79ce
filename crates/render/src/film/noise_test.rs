//! Tests of the noise estimate: pictures with a known error.

use crate::film::noise::*;
use crate::film::testing::{Rng, TestFilm, each_tile, fill, film, only, white};
use crate::film::{Replicates, quantised_8, *};
use zerkalo_scene::Tone;

/// Pixel of known mean in a simulated picture. If `normal` is `false`, a sample is `dark + LIGHT`
/// with probability `chance`, otherwise `dark`. If `normal` is `true`, sums of samples are normally
/// distributed with the same mean.
#[derive(Clone, Copy)]
struct Pixel {
    chance: f64,
    normal: bool,
    dark: [f64; 3],
}

const GLOOM: [f64; 3] = [0.02, 0.05, 0.04];
const LIGHT: [f64; 3] = [0.2, 0.7, 0.3];

impl Pixel {
    fn mean(self) -> [f64; 3] {
        [0, 1, 2].map(|c| self.dark[c] + self.chance * LIGHT[c])
    }

    /// Returns the sum of `n` samples of the pixel in each channel. Sample i uses a random number
    /// in [i/n, (i + 1)/n) if `stratified` is `true`, otherwise in [0, 1).
    fn sum(self, n: u32, stratified: bool, rng: &mut Rng) -> [f64; 3] {
        let count = f64::from(n);
        let hits = if self.normal {
            (count * self.chance + 0.3 * count.sqrt() * rng.normal()).max(0.0)
        } else {
            let is_hit = |_: &u32| rng.unit() < self.chance;
            match stratified {
                // All random numbers below the stratum that contains `chance` are hits.
                true => (count * self.chance + rng.unit()).floor(),
                false => (0..n).filter(is_hit).count() as f64,
            }
        };
        [0, 1, 2].map(|c| count * self.dark[c] + hits * LIGHT[c])
    }
}

/// Returns the pixels of a simulated picture of 64 x 48 pixels. The probability `chance` of a lit
/// sample is random in [0, 1) for each pixel. `normal` and `dark` are the same for all pixels.
fn scene(normal: bool, dark: [f64; 3], rng: &mut Rng) -> Vec<Pixel> {
    (0..64 * 48).map(|_| Pixel { chance: rng.unit(), normal, dark }).collect()
}

struct Outcome {
    linear: Vec<f64>,
    levels: Vec<f64>,
    /// Relative standard deviation of a tile's estimated RMSE between random seeds, as the mean
    /// over all tiles.
    tile_spread: f64,
}

/// Simulates 20 films with different random seeds and `n` samples per pixel in each replicate.
/// Returns the ratio of the true to the estimated RMSE of each film, for linear radiance and for
/// 8-bit levels, and the spread of the tiles' estimates. The other parameters are those of
/// [`Pixel`] and [`Pixel::sum`].
fn ratios(n: u32, normal: bool, stratified: bool, dark: [f64; 3]) -> Outcome {
    let pixels = scene(normal, dark, &mut Rng(11));
    let (mix, display) = (white(1), Display::default());
    let mut outcome = Outcome { linear: vec![], levels: vec![], tile_spread: 0.0 };
    let mut tiles: Vec<Vec<f64>> = vec![vec![]; 12];
    for seed in 0..20 {
        let mut rng = Rng(1000 + seed);
        let mut film = film(64, 48, &[2f64.powi(28)]);
        fill(&mut film, n, |x, y, _| pixels[y * 64 + x].sum(n, stratified, &mut rng).to_vec());
        let picture: Vec<[f64; 3]> = (0..48).flat_map(|y| film.pixels_of_row(y, &mix)).collect();
        let (mut linear, mut levels) = (0.0, 0.0);
        for (i, pixel) in pixels.iter().enumerate() {
            let (got, truth) = (picture[i], pixel.mean());
            let (got_levels, true_levels) = (display.levels(got), display.levels(truth));
            for c in 0..3 {
                linear += (got[c] - truth[c]).powi(2) / (3.0 * 64.0 * 48.0);
                levels += (got_levels[c] - true_levels[c]).powi(2) / (3.0 * 64.0 * 48.0);
            }
        }
        let noise = film.noise(&mix, &display).unwrap();
        outcome.linear.push(linear.sqrt() / noise.rmse.linear);
        outcome.levels.push(levels.sqrt() / noise.rmse.levels);
        let estimator = Estimator::new(&film.header.scales, &mix, &display);
        for (index, tile) in film.touched() {
            tiles[index].push(estimator.tile(tile).unwrap().reported.levels.sqrt());
        }
    }
    let spreads: Vec<_> = tiles
        .iter()
        .map(|tile| {
            let deviations: Vec<_> = tile.iter().map(|t| (t / mean(tile) - 1.0).powi(2)).collect();
            mean(&deviations).sqrt()
        })
        .collect();
    outcome.tile_spread = mean(&spreads);
    outcome
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

#[test]
fn estimates_equal_true_errors_in_the_mean() {
    for n in [16, 64] {
        for (normal, stratified, dark) in [
            (true, false, GLOOM),
            (false, false, GLOOM),
            (false, true, GLOOM),
            (false, false, [0.0; 3]),
            (false, true, [0.0; 3]),
        ] {
            let outcome = ratios(n, normal, stratified, dark);
            let (linear, levels) = (mean(&outcome.linear), mean(&outcome.levels));
            let case = format!(
                "n {n}, normal {normal}, stratified {stratified}, dark {dark:?}: linear {linear:.3}, \
                 levels {levels:.3}, spread {:.3}",
                outcome.tile_spread
            );
            println!("{case}");
            assert!((0.95..1.05).contains(&linear), "{case}");
            assert!((0.9..1.1).contains(&levels), "{case}");
            assert!(outcome.tile_spread <= 0.2, "{case}");
        }
    }
}

/// Checks the noise estimate for dark pixels, few of whose samples receive light. The sRGB encoding
/// is steep and curved at dark values. The estimate must be better than two simpler ones: half the
/// displayed difference of the replicates A and B, and the half difference in radiance times the
/// slope of the encoding.
#[test]
fn rare_light_is_estimated_better_than_by_half_differences_or_slopes() {
    let (n, mut rng) = (16u32, Rng(5));
    let display = Display::default();
    let curve = |x: f64| display.levels([x; 3])[0];
    let mut sum = [0.0; 4];
    for _ in 0..20_000 {
        let chance = 10f64.powf(-2.5 * rng.unit());
        let mut hits =
            || (0..n).filter(|i| (f64::from(*i) + rng.unit()) / 16.0 < chance).count() as f64;
        let (a, b) = (0.7 * hits() / 16.0, 0.7 * hits() / 16.0);
        let mut film = film(1, 1, &[2f64.powi(28)]);
        fill(&mut film, n, |_, _, r| vec![16.0 * [a, b][r]; 3]);
        let picture = 0.5 * (a + b);
        let slope = (curve(picture + 1e-7) - curve((picture - 1e-7).max(0.0))) / 2e-7;
        sum[0] += (curve(picture) - curve(0.7 * chance)).powi(2);
        sum[1] += film.noise(&white(1), &display).unwrap().rmse.levels.powi(2);
        sum[2] += (0.5 * (curve(a) - curve(b))).powi(2);
        sum[3] += (0.5 * (a - b) * slope).powi(2);
    }
    let [ours, half, slope] = [1, 2, 3].map(|i| (sum[0] / sum[i]).sqrt());
    println!("true / estimate: {ours:.3}, half difference {half:.3}, slope {slope:.3}");
    assert!((ours - 1.0).abs() < 0.16 && half > ours + 0.05 && slope > ours + 0.3);
}

#[test]
fn estimate_of_one_pixel_matches_the_formula() {
    let mut film = film(1, 1, &[1024.0, 2.0]);
    fill(&mut film, 2, |_, _, r| vec![[0.25, 0.5][r], 1.0, 0.5, 0.0, 0.0, [2.0, 0.0][r]]);
    let mix = LightWeights { weights: vec![[1.0; 3], [0.0, 0.0, 0.25]] };
    let display = Display { exposure_ev: 1.0, tone: Tone::Clip };
    let tile =
        Estimator::new(&film.header.scales, &mix, &display).tile(film.tile(0).unwrap()).unwrap();
    // A and B differ in red (0.125 and 0.25) and, summed over both groups, in blue (0.5 and 0.25).
    // The error is half of each difference.
    let expected = (0.0625f64.powi(2) + 0.125f64.powi(2)) / 3.0;
    assert!((tile.reported.linear - expected).abs() < 1e-15, "{tile:?}");
    let level = |x: f64| display.levels([x; 3])[0];
    let apart = |a: f64, b: f64| {
        let m = level(0.5 * (a + b));
        0.5 * ((level(a) - m).powi(2) + (level(b) - m).powi(2))
    };
    let expected = (apart(0.125, 0.25) + apart(0.5, 0.25)) / 3.0;
    assert!((tile.reported.levels / expected - 1.0).abs() < 1e-4, "{tile:?} {expected}");
    assert_eq!((tile.pixels, tile.allocation), (1, tile.reported));
    // Far above white the displayed difference is 0, because A and B are both clipped.
    let bright = Display { exposure_ev: 9.0, tone: Tone::Clip };
    let noise = film.noise(&only(0, 2), &bright).unwrap();
    assert_eq!((noise.rmse.levels, quantised_8(bright.levels([0.125; 3])[0])), (0.0, 255));
    assert!(noise.rmse.linear > 0.0);
}

#[test]
fn both_tone_curves_are_estimated_as_displayed() {
    for tone in Tone::ALL {
        let name = tone.name();
        let display = Display { exposure_ev: -0.5, tone };
        let (mut film, mut rng) = (film(16, 16, &[2f64.powi(20)]), Rng(3));
        fill(&mut film, 1, |_, _, _| (0..3).map(|_| 2.0 * rng.unit()).collect());
        // The validation estimate comes from the white pixels of the checkerboard.
        let mut mse = 0.0;
        for y in 0..16 {
            let [m, a, b] = [Replicates::Both, Replicates::A, Replicates::B]
                .map(|replicates| film.row(y, replicates, &white(1)));
            for ((m, a), b) in m.iter().zip(&a).zip(&b).skip((y + 1) % 2).step_by(2) {
                let [m, a, b] = [m, a, b].map(|radiance| display.levels(*radiance));
                for c in 0..3 {
                    mse += ((a[c] - m[c]).powi(2) + (b[c] - m[c]).powi(2)) / (2.0 * 384.0);
                }
            }
        }
        let estimator = Estimator::new(&film.header.scales, &white(1), &display);
        let noise = estimator.tile(film.tile(0).unwrap()).unwrap();
        assert!((noise.reported.levels / mse - 1.0).abs() < 2e-5, "{name}: {noise:?} {mse}");
    }
}

#[test]
fn unequal_counts_have_no_noise() {
    let mut film = film(32, 16, &[1.0]);
    let noise = |film: &Film| film.noise(&white(1), &Display::default());
    assert_eq!(noise(&film), None);
    fill(&mut film, 3, |_, _, _| vec![1.0; 3]);
    let zero = Noise {
        rmse: ByMeasure::default(),
        p95_levels: 0.0,
        effective_pixels: ByMeasure::default(),
    };
    assert_eq!(noise(&film), Some(zero));
    film.slots(&[1]).remove(0).prepare().advance(0, 1);
    assert_eq!(noise(&film), None);
    film.slots(&[1]).remove(0).prepare().advance(1, 1);
    assert!(noise(&film).is_some());
    film.restart();
    each_tile(&mut film, |tile, _| tile.set_lattice(8));
    assert_eq!(noise(&film), None);
}

/// Checks the noise estimate of tiles whose replicate B (second half of the samples) has fewer
/// samples than A. Over 200 random tiles, the estimated and the true RMSE must agree within 2 %.
#[test]
fn replicate_with_fewer_samples_still_has_an_estimate() {
    let display = Display { exposure_ev: -2.0, tone: Tone::Clip };
    let (n, m) = (12u32, 8u32);
    let (mut rng, mut estimates, mut levels, mut errors) = (Rng(9), 0.0, 0.0, [0.0; 2]);
    for _ in 0..200 {
        let mut film = film(16, 16, &[2f64.powi(20)]);
        each_tile(&mut film, |tile, _| {
            for (replicate, count) in [(0, n), (1, m)] {
                for pixel in 0..256 {
                    let sum: f64 = (0..count).map(|_| rng.unit()).sum();
                    tile.add(replicate, pixel, &[(sum * 2f64.powi(20)) as i64; 3]);
                }
                tile.advance(replicate, count);
            }
        });
        let estimator = Estimator::new(&film.header.scales, &white(1), &display);
        let tile = film.tile(0).unwrap();
        assert_eq!(estimator.tile(tile), None);
        let noise = estimator.tile_so_far(tile).unwrap();
        estimates += noise.reported.linear;
        levels += noise.reported.levels;
        let truth = display.levels([0.5; 3])[0];
        for pixel in 0..256 {
            let value = film.pixel(pixel % 16, pixel / 16, &white(1));
            errors[0] += (value[0] - 0.5).powi(2) / 256.0;
            errors[1] += (display.levels(value)[0] - truth).powi(2) / 256.0;
        }
    }
    let ratios = [(errors[0] / estimates).sqrt(), (errors[1] / levels).sqrt()];
    assert!(ratios.iter().all(|r| (0.98..1.02).contains(r)), "{ratios:?}");
}

/// Checks the error of a pixel beside a lamp that no sample has hit, and of one that both replicates
/// have hit.
#[test]
fn sliver_of_a_lamp_is_counted_until_it_is_hit() {
    let mut film = film(16, 16, &[1.0]);
    let estimator = Estimator::new(&film.header.scales, &white(1), &Display::default());
    let mut sliver = |beside: f64| {
        film.restart();
        fill(&mut film, 8, |x, y, _| vec![if [x, y] == [3, 5] { 32.0 } else { 8.0 * beside }; 3]);
        estimator.tile(film.tile(0).unwrap()).unwrap().sliver
    };
    // One of 16 samples.
    let level = Display::default().levels([0.25; 3])[0];
    assert!((f64::from(sliver(0.0)) / (3.0 * level * level) - 1.0).abs() < 1e-6);
    assert_eq!(sliver(0.5), 0.0);
}

#[test]
fn noise_combines_the_tiles() {
    let tile = |levels: f64, pixels| {
        let mse = ByMeasure { linear: 0.01, levels: levels * levels };
        Some(TileNoise {
            reported: mse,
            allocation: mse,
            squares: ByMeasure::SPREAD,
            captures: Default::default(),
            sliver: 0.0,
            pixels,
            samples: 4,
        })
    };
    let tiles = (1..=20).map(|i| tile(f64::from(i), 256)).chain([tile(7.0, 0)]);
    let noise = Noise::of_tiles(tiles).unwrap();
    assert!((noise.rmse.linear - 0.1).abs() < 1e-14);
    assert!((noise.rmse.levels - 143.5f64.sqrt()).abs() < 1e-12);
    assert_eq!(noise.p95_levels, 19.0);
    // If the tiles have different numbers of samples, the larger of two estimates is reported: that
    // from the white half of the pixels, and that from all pixels. If the numbers are equal, the
    // estimate from all pixels is reported.
    let rmse = |reported: f64, allocation: f64, samples: [u32; 2]| {
        let mse = |x: f64| ByMeasure { linear: x, levels: x };
        let tile = |samples| {
            Some(TileNoise {
                reported: mse(reported),
                allocation: mse(allocation),
                squares: ByMeasure::SPREAD,
                captures: Default::default(),
                sliver: 0.0,
                pixels: 256,
                samples,
            })
        };
        Noise::of_tiles(samples.map(tile)).unwrap().rmse.levels
    };
    assert_eq!((rmse(4.0, 2.0, [4, 8]), rmse(2.0, 6.0, [4, 8])), (2.0, 2.0));
    assert_eq!((rmse(6.0, 2.0, [8, 8]), rmse(2.0, 6.0, [8, 8])), (2.0, 2.0));
    assert_eq!(Noise::of_tiles([tile(1.0, 256), None]), None);
    assert_eq!(Noise::of_tiles([]), None);
}

/// Checks the noise estimate of stars: a tenth of the pixels are white, but only 3 % of their
/// samples receive light, 30 times as bright as white. After 4 samples in each of A and B, most
/// stars have received none. Without capture-recapture, the true error was 2.6 times the reported
/// one.
#[test]
fn stars_without_light_are_in_the_reported_error() {
    let (n, mut rng, display) = (4, Rng(7), Display::default());
    let is_star = |x: usize, y: usize| x % 4 == 1 && y % 3 == 1;
    for (chance, low, high) in [(0.03, 0.9, 1.15), (0.01, 0.95, 1.4)] {
        let (mut truth, mut reported) = (0.0, 0.0);
        for _ in 0..20 {
            let mut film = film(64, 48, &[2f64.powi(28)]);
            fill(&mut film, n, |x, y, _| {
                let hits = (0..n).filter(|_| is_star(x, y) && rng.unit() < chance).count() as f64;
                vec![hits * 0.9 / chance; 3]
            });
            let error = |(i, got): (usize, [f64; 3])| {
                let value = if is_star(i % 64, i / 64) { 0.9 } else { 0.0 };
                (display.levels(got)[0] - display.levels([value; 3])[0]).powi(2) / (64.0 * 48.0)
            };
            let rows = (0..48).flat_map(|y| film.pixels_of_row(y, &white(1)));
            truth += rows.enumerate().map(error).sum::<f64>();
            reported += film.noise(&white(1), &display).unwrap().rmse.levels.powi(2);
        }
        let ratio = (truth / reported).sqrt();
        println!("chance {chance}: true/reported {ratio:.3}");
        assert!((low..high).contains(&ratio), "chance {chance}: true/reported {ratio}");
    }
}
