//! Errors of pictures against a reference picture.

use zerkalo_render::film::{Display, Film, LightWeights, Replicates};

/// Reference picture, with an estimate of its own error.
pub struct Reference {
    /// Samples per pixel of its render; 0 if it was read from a file.
    pub spp: f64,
    /// Seconds of its render; 0 if it was read from a file.
    pub seconds: f64,
    /// Pixels in linear radiance, `[row][column]`.
    pixels: Vec<[f64; 3]>,
    /// Pixels as displayed, in unrounded 8-bit levels.
    levels: Vec<[f64; 3]>,
    /// Half the difference between the replicates in each pixel, in 8-bit levels. Empty if the
    /// reference counts as exact.
    halves: Vec<[f64; 3]>,
    /// Estimated errors of the reference itself; 0 if it counts as exact.
    own: Squares,
    display: Display,
}

/// Mean squared errors over pixels and channels: `linear` in linear radiance, `levels` in 8-bit
/// levels. `mean` is the variance of the mean linear radiance over all pixels and channels.
#[derive(Clone, Copy, Debug, Default)]
struct Squares {
    linear: f64,
    levels: f64,
    mean: f64,
}

/// Errors of a picture against a reference, over pixels and channels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Errors {
    /// RMSE in linear radiance.
    pub rmse_linear: f64,
    /// RMSE of the displayed picture, in unrounded 8-bit levels.
    pub rmse_levels: f64,
    /// Relative standard deviation of `rmse_levels`, 0..=1, between references rendered with
    /// different seeds.
    pub spread: f64,
}

/// Estimated bias: the difference between the expectations of a picture and of the reference.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bias {
    /// Difference between the mean radiances of the two pictures, divided by its standard error.
    pub z: f64,
    /// RMS difference between the pixels, in 8-bit levels, after the mean squared noise of both
    /// pictures is subtracted from the mean squared difference.
    pub levels: f64,
    /// Smallest significant value of [`Self::levels`]. Its square is two standard errors of the
    /// mean squared difference.
    pub least_levels: f64,
}

impl Bias {
    /// Returns `true` if the pictures differ by more than noise can explain: in mean radiance by
    /// more than four standard errors, or in the pixels by more than [`Self::least_levels`].
    pub fn is_seen(&self) -> bool {
        self.levels > self.least_levels || self.z.abs() > 4.0
    }
}

/// Estimates the errors of the mean of two independent pictures. The linear error of a pixel is
/// half the difference between the pictures. Its squared error in levels is the mean of the squared
/// distances from the displayed mean to the two displayed pictures.
fn own_error(a: &[[f64; 3]], b: &[[f64; 3]], display: &Display) -> Squares {
    let mut squares = Squares::default();
    for (a, b) in a.iter().zip(b) {
        let mean = mean(a, b);
        let [level_a, level_b, level] = [*a, *b, mean].map(|x| display.levels(x));
        let mut half_sum = 0.0;
        for c in 0..3 {
            let half = 0.5 * (a[c] - b[c]);
            half_sum += half;
            squares.linear += half * half;
            squares.levels +=
                0.5 * ((level_a[c] - level[c]).powi(2) + (level_b[c] - level[c]).powi(2));
        }
        squares.mean += half_sum * half_sum;
    }
    let values = (3 * a.len()) as f64;
    Squares {
        linear: squares.linear / values,
        levels: squares.levels / values,
        mean: squares.mean / (values * values),
    }
}

/// Returns the pixels of the picture of `film`, `[row][column]`.
fn pixels(film: &Film, replicates: Replicates, weights: &LightWeights) -> Vec<[f64; 3]> {
    (0..film.header.height).flat_map(|y| film.row(y, replicates, weights)).collect()
}

impl Reference {
    /// Creates a reference from the picture of `film`, whose replicates must hold equal numbers of
    /// samples.
    pub fn of_film(film: &Film, weights: &LightWeights, display: &Display) -> Self {
        let [a, b] = [Replicates::A, Replicates::B].map(|r| pixels(film, r, weights));
        Self::of_replicates(&a, &b, display)
    }

    /// Creates a reference from the mean of two independent pictures.
    pub fn of_replicates(a: &[[f64; 3]], b: &[[f64; 3]], display: &Display) -> Self {
        let pairs = || a.iter().zip(b);
        let own = own_error(a, b, display);
        let halves = pairs().map(|(a, b)| half(a, b, display)).collect();
        let pixels = pairs().map(|(a, b)| mean(a, b)).collect();
        Self { own, halves, ..Self::of_pixels(pixels, display) }
    }

    /// Creates a reference that counts as exact.
    pub fn of_pixels(pixels: Vec<[f64; 3]>, display: &Display) -> Self {
        let levels = pixels.iter().map(|x| display.levels(*x)).collect();
        let own = Squares::default();
        let halves = Vec::new();
        Self { spp: 0.0, seconds: 0.0, pixels, levels, halves, own, display: *display }
    }

    /// Returns the RMSE of the reference itself in 8-bit levels, estimated from its replicates.
    pub fn noise_levels(&self) -> f64 {
        self.own.levels.sqrt()
    }

    /// Returns the RMSE of the reference itself in linear radiance.
    pub fn noise_linear(&self) -> f64 {
        self.own.linear.sqrt()
    }

    /// Returns the errors of `film`. The mean squared error of the reference itself is subtracted
    /// from the mean squared difference before the root is taken.
    pub fn errors(&self, film: &Film, weights: &LightWeights) -> Errors {
        self.errors_of(&pixels(film, Replicates::Both, weights))
    }

    fn errors_of(&self, pixels: &[[f64; 3]]) -> Errors {
        let mut sum = Squares::default();
        let mut crossed = 0.0;
        for (i, (x, r)) in pixels.iter().zip(&self.pixels).enumerate() {
            let level = self.display.levels(*x);
            let difference = std::array::from_fn(|c| level[c] - self.levels[i][c]);
            sum.levels += dot(&difference, &difference);
            sum.linear += (0..3).map(|c| (x[c] - r[c]).powi(2)).sum::<f64>();
            crossed += self.halves.get(i).map_or(0.0, |half| dot(&difference, half).powi(2));
        }
        let values = (3 * self.pixels.len()) as f64;
        let remaining = |sum: f64, own: f64| (sum / values - own).max(0.0);
        let levels = remaining(sum.levels, self.own.levels);
        // The standard error of the sum of squares is twice `crossed.sqrt()`; the relative error of
        // its root is half of that of the sum.
        let spread = crossed.sqrt() / values;
        Errors {
            rmse_linear: remaining(sum.linear, self.own.linear).sqrt(),
            rmse_levels: levels.sqrt(),
            spread: if spread < levels { spread / levels } else { f64::from(spread > 0.0) },
        }
    }

    /// Returns the estimated bias of `film`.
    pub fn bias(&self, film: &Film, weights: &LightWeights) -> Bias {
        let [a, b] = [Replicates::A, Replicates::B].map(|r| pixels(film, r, weights));
        let own = own_error(&a, &b, &self.display);
        let (mut sum, mut squares, mut crossed) = (0.0, 0.0, 0.0);
        for (i, (a, b)) in a.iter().zip(&b).enumerate() {
            let mean = mean(a, b);
            sum += (0..3).map(|c| mean[c] - self.pixels[i][c]).sum::<f64>();
            let level = self.display.levels(mean);
            let difference = std::array::from_fn(|c| level[c] - self.levels[i][c]);
            squares += dot(&difference, &difference);
            crossed += dot(&difference, &half(a, b, &self.display)).powi(2);
            crossed += self.halves.get(i).map_or(0.0, |half| dot(&difference, half).powi(2));
        }
        let values = (3 * self.pixels.len()) as f64;
        let mean = sum / values;
        let deviation = (own.mean + self.own.mean).sqrt();
        Bias {
            // If both pictures are without noise, `z` is 0 or infinite.
            z: if mean == 0.0 { 0.0 } else { mean / deviation },
            levels: (squares / values - own.levels - self.own.levels).max(0.0).sqrt(),
            least_levels: (2.0 * 2.0 * crossed.sqrt() / values).sqrt(),
        }
    }
}

fn dot(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn mean(a: &[f64; 3], b: &[f64; 3]) -> [f64; 3] {
    std::array::from_fn(|c| 0.5 * (a[c] + b[c]))
}

/// Returns half the difference between two displayed colours, in 8-bit levels.
fn half(a: &[f64; 3], b: &[f64; 3], display: &Display) -> [f64; 3] {
    let [a, b] = [*a, *b].map(|x| display.levels(x));
    std::array::from_fn(|c| 0.5 * (a[c] - b[c]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use zerkalo_render::film::testing::Rng;

    /// Returns random pixels with mean 0.5 and two kinds of noise: grey noise with the standard
    /// deviation `s`, and independent noise in each channel with a third of this standard
    /// deviation.
    fn noisy_pixels(rng: &mut Rng, count: usize, s: f64) -> Vec<[f64; 3]> {
        let pixel = |_| {
            let common = rng.normal();
            [0; 3].map(|_| 0.5 + s * (common + rng.normal() / 3.0))
        };
        (0..count).map(pixel).collect()
    }

    /// Checks the estimated error of a reference. Its two replicates have noise of standard
    /// deviation s, so that their mean has the error s / sqrt 2.
    #[test]
    fn own_error_is_that_of_the_mean() {
        let mut rng = Rng(1);
        let [a, b] = [0; 2].map(|_| noisy_pixels(&mut rng, 10_000, 0.01));
        let reference = Reference::of_replicates(&a, &b, &Display::default());
        let expected = 0.01 * (1.0f64 + 1.0 / 9.0).sqrt() / 2f64.sqrt();
        assert!((reference.noise_linear() / expected - 1.0).abs() < 0.02);
        // The slope of the sRGB curve at 0.5 is 1.055 / 2.4 x 0.5^(1/2.4 - 1).
        let slope = 255.0 * 1.055 / 2.4 * 0.5f64.powf(1.0 / 2.4 - 1.0);
        assert!((reference.noise_levels() / (slope * expected) - 1.0).abs() < 0.02);
    }

    /// Checks that the predicted uncertainty of a picture's error agrees with the standard
    /// deviation of this error over many references of equal noise.
    #[test]
    fn spread_is_that_between_references() {
        let mut rng = Rng(2);
        for (own, theirs) in [(0.01, 0.003), (0.01, 0.01), (0.004, 0.01)] {
            let picture = noisy_pixels(&mut rng, 1200, own);
            let errors: Vec<Errors> = (0..200)
                .map(|_| {
                    let [a, b] = [0; 2].map(|_| noisy_pixels(&mut rng, 1200, theirs * 2f64.sqrt()));
                    let reference = Reference::of_replicates(&a, &b, &Display::default());
                    reference.errors_of(&picture)
                })
                .collect();
            let n = errors.len() as f64;
            let mean = errors.iter().map(|e| e.rmse_levels).sum::<f64>() / n;
            let variance = errors.iter().map(|e| (e.rmse_levels - mean).powi(2)).sum::<f64>() / n;
            let (observed, predicted) =
                (variance.sqrt() / mean, errors.iter().map(|e| e.spread).sum::<f64>() / n);
            assert!(
                (predicted / observed - 1.0).abs() < 0.2,
                "{own} {theirs}: {predicted} predicted, {observed} observed"
            );
        }
    }

    #[test]
    fn exact_reference_has_no_spread_and_equal_pictures_no_error() {
        let mut rng = Rng(3);
        let mut pixels = noisy_pixels(&mut rng, 1200, 0.01);
        let truth = Reference::of_pixels(pixels.clone(), &Display::default());
        let errors = truth.errors_of(&pixels);
        assert_eq!((errors.rmse_levels, errors.spread), (0.0, 0.0));
        pixels.iter_mut().for_each(|p| p[1] += 0.02);
        let off = truth.errors_of(&pixels);
        assert!(off.rmse_levels > 1.0 && off.spread == 0.0, "{off:?}");
    }
}
