//! Errors of pictures against a reference.

use crate::film::{Display, Film, LightWeights, Replicates};

/// Radiance below which relative errors do not count as larger: relMSE = mean((x - r)^2 / (r^2 + 0.01)).
const RELATIVE_FLOOR: f64 = 0.01;

/// Reference picture and its own error.
pub struct Reference {
    size: [usize; 2],
    pixels: Vec<[f64; 3]>,
    codes: Vec<[f64; 3]>,
    /// Half the difference of the replicates in 8-bit levels: as large as its error, and independent of
    /// it. Empty if the picture counts as exact.
    halves: Vec<[f64; 3]>,
    own: Squares,
    /// Variance of the mean of all pixels and channels.
    mean_variance: f64,
    display: Display,
}

/// Mean squares over pixels and channels.
#[derive(Clone, Copy, Debug, Default)]
struct Squares {
    linear: f64,
    codes: f64,
    relative: f64,
}

/// Errors of a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Errors {
    /// Root mean square error in linear radiance.
    pub rmse_linear: f64,
    /// Root mean square error as displayed, in unrounded 8-bit levels.
    pub rmse_codes: f64,
    /// Mean of (x - r)^2 / (r^2 + 0.01).
    pub rel_mse: f64,
    /// Relative standard error of `rmse_codes` against another reference as noisy as this one, at most
    /// 1: the uncertainty that remains after subtraction of the reference's own error.
    pub spread: f64,
}

/// Difference of a picture's expectation from the reference's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bias {
    /// Difference of the pictures' means in standard errors.
    pub z: f64,
    /// Root mean square of the pixels' differences that noise does not explain, in 8-bit levels.
    pub codes: f64,
    /// The least `codes` that can be distinguished from noise, at two standard errors.
    pub least_codes: f64,
}

impl Bias {
    /// Returns `true` if there is more than noise explains.
    pub fn is_seen(&self) -> bool {
        self.codes > self.least_codes || self.z.abs() > 4.0
    }
}

/// Mean squared error of the mean of two replicates, and the variance of its mean over the picture. Linear
/// errors are half the difference of the replicates; displayed errors are the distance of the mean's
/// 8-bit levels from those of the replicates.
fn own_error(a: &[[f64; 3]], b: &[[f64; 3]], display: &Display) -> (Squares, f64) {
    let mut squares = Squares::default();
    let mut mean_variance = 0.0;
    for (a, b) in a.iter().zip(b) {
        let mean = std::array::from_fn(|c| 0.5 * (a[c] + b[c]));
        let [code_a, code_b, code] = [*a, *b, mean].map(|x| display.codes(x));
        let mut half_sum = 0.0;
        for c in 0..3 {
            let half = 0.5 * (a[c] - b[c]);
            half_sum += half;
            squares.linear += half * half;
            squares.relative += half * half / (mean[c] * mean[c] + RELATIVE_FLOOR);
            squares.codes += 0.5 * ((code_a[c] - code[c]).powi(2) + (code_b[c] - code[c]).powi(2));
        }
        mean_variance += half_sum * half_sum;
    }
    let values = (3 * a.len()) as f64;
    let own = Squares {
        linear: squares.linear / values,
        codes: squares.codes / values,
        relative: squares.relative / values,
    };
    (own, mean_variance / (values * values))
}

/// Both replicates, row by row.
fn replicates(film: &Film, mix: &LightWeights) -> [Vec<[f64; 3]>; 2] {
    [Replicates::A, Replicates::B].map(|replicates| {
        let mut all = Vec::with_capacity(film.width() * film.height());
        let mut row = Vec::new();
        for y in 0..film.height() {
            film.row(y, replicates, mix, &mut row);
            all.extend_from_slice(&row);
        }
        all
    })
}

impl Reference {
    /// Reference from the picture of `film`, whose replicates hold equally many samples and determine its
    /// own error.
    pub fn of_film(film: &Film, mix: &LightWeights, display: &Display) -> Self {
        let [a, b] = replicates(film, mix);
        Self::of_replicates([film.width(), film.height()], &a, &b, display)
    }

    /// Reference from the mean of two independent pictures, `[row][column]`.
    pub fn of_replicates(
        size: [usize; 2],
        a: &[[f64; 3]],
        b: &[[f64; 3]],
        display: &Display,
    ) -> Self {
        let (own, mean_variance) = own_error(a, b, display);
        let mean = |(a, b): (&[f64; 3], &[f64; 3])| std::array::from_fn(|c| 0.5 * (a[c] + b[c]));
        let pixels = a.iter().zip(b).map(mean).collect();
        let halves = a.iter().zip(b).map(|(a, b)| half(a, b, display)).collect();
        Self { halves, ..Self::new(size, pixels, own, mean_variance, *display) }
    }

    /// Reference from a picture that counts as exact.
    pub fn of_pixels(size: [usize; 2], pixels: Vec<[f64; 3]>, display: &Display) -> Self {
        Self::new(size, pixels, Squares::default(), 0.0, *display)
    }

    fn new(
        size: [usize; 2],
        pixels: Vec<[f64; 3]>,
        own: Squares,
        mean_variance: f64,
        display: Display,
    ) -> Self {
        let codes = pixels.iter().map(|x| display.codes(*x)).collect();
        Self { size, pixels, codes, halves: Vec::new(), own, mean_variance, display }
    }

    /// Width and height in pixels.
    pub fn size(&self) -> [usize; 2] {
        self.size
    }

    /// Root mean square error of the reference itself, in 8-bit levels.
    pub fn noise_codes(&self) -> f64 {
        self.own.codes.sqrt()
    }

    /// Root mean square error of the reference itself, in linear radiance.
    pub fn noise_linear(&self) -> f64 {
        self.own.linear.sqrt()
    }

    /// Errors of `film`: its distance from the reference, less the reference's own error.
    pub fn errors(&self, film: &Film, mix: &LightWeights) -> Errors {
        self.errors_of(&mut |y, row| film.row(y, Replicates::Both, mix, row))
    }

    /// Errors of the picture whose rows `fill` writes.
    fn errors_of(&self, fill: &mut dyn FnMut(usize, &mut Vec<[f64; 3]>)) -> Errors {
        let mut sum = Squares::default();
        let mut crossed = 0.0;
        let mut row = Vec::new();
        for y in 0..self.size[1] {
            fill(y, &mut row);
            for (x, i) in row.iter().zip(y * self.size[0]..) {
                let (r, code_r, code_x) = (self.pixels[i], self.codes[i], self.display.codes(*x));
                let apart: [f64; 3] = std::array::from_fn(|c| code_x[c] - code_r[c]);
                for c in 0..3 {
                    let d = x[c] - r[c];
                    sum.linear += d * d;
                    sum.codes += apart[c] * apart[c];
                    sum.relative += d * d / (r[c] * r[c] + RELATIVE_FLOOR);
                }
                crossed += self.halves.get(i).map_or(0.0, |half| dot(&apart, half).powi(2));
            }
        }
        let values = (3 * self.pixels.len()) as f64;
        let remaining = |sum: f64, own: f64| (sum / values - own).max(0.0);
        let codes = remaining(sum.codes, self.own.codes);
        // The error of the sum of squares is twice this; its root halves it.
        let spread = crossed.sqrt() / values;
        Errors {
            rmse_linear: remaining(sum.linear, self.own.linear).sqrt(),
            rmse_codes: codes.sqrt(),
            rel_mse: remaining(sum.relative, self.own.relative),
            spread: if spread < codes { spread / codes } else { f64::from(spread > 0.0) },
        }
    }

    /// Bias of the expectation of `film` against the reference's.
    pub fn bias(&self, film: &Film, mix: &LightWeights) -> Bias {
        let [a, b] = replicates(film, mix);
        let (own, mean_variance) = own_error(&a, &b, &self.display);
        let (mut sum, mut squares, mut crossed) = (0.0, 0.0, 0.0);
        for (i, (a, b)) in a.iter().zip(&b).enumerate() {
            let mean = std::array::from_fn(|c| 0.5 * (a[c] + b[c]));
            sum += (0..3).map(|c| mean[c] - self.pixels[i][c]).sum::<f64>();
            let code = self.display.codes(mean);
            let apart = std::array::from_fn(|c| code[c] - self.codes[i][c]);
            squares += dot(&apart, &apart);
            crossed += dot(&apart, &half(a, b, &self.display)).powi(2);
            crossed += self.halves.get(i).map_or(0.0, |half| dot(&apart, half).powi(2));
        }
        let values = (3 * self.pixels.len()) as f64;
        let mean = sum / values;
        let deviation = (mean_variance + self.mean_variance).sqrt();
        Bias {
            // Without noise z is 0 or infinite.
            z: if mean == 0.0 { 0.0 } else { mean / deviation },
            codes: (squares / values - own.codes - self.own.codes).max(0.0).sqrt(),
            least_codes: (2.0 * 2.0 * crossed.sqrt() / values).sqrt(),
        }
    }
}

fn dot(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Half the difference of two replicates of a pixel as displayed, in 8-bit levels.
fn half(a: &[f64; 3], b: &[f64; 3], display: &Display) -> [f64; 3] {
    let [a, b] = [*a, *b].map(|x| display.codes(x));
    std::array::from_fn(|c| 0.5 * (a[c] - b[c]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::testing::Rng;

    /// Grey pixels of standard deviation `s` about 0.5, plus a third of that in each channel.
    fn noisy_pixels(rng: &mut Rng, count: usize, s: f64) -> Vec<[f64; 3]> {
        let pixel = |_| {
            let common = rng.normal();
            [0; 3].map(|_| 0.5 + s * (common + rng.normal() / 3.0))
        };
        (0..count).map(pixel).collect()
    }

    /// Replicates with noise of standard deviation s have a mean whose error is s / sqrt 2.
    #[test]
    fn own_error_is_that_of_the_mean() {
        let mut rng = Rng(1);
        let [a, b] = [0; 2].map(|_| noisy_pixels(&mut rng, 10_000, 0.01));
        let reference = Reference::of_replicates([100, 100], &a, &b, &Display::default());
        let expected = 0.01 * (1.0f64 + 1.0 / 9.0).sqrt() / 2f64.sqrt();
        assert!((reference.noise_linear() / expected - 1.0).abs() < 0.02);
        // The sRGB curve's slope at 0.5 is 1.055 / 2.4 x 0.5^(1/2.4 - 1).
        let slope = 255.0 * 1.055 / 2.4 * 0.5f64.powf(1.0 / 2.4 - 1.0);
        assert!((reference.noise_codes() / (slope * expected) - 1.0).abs() < 0.02);
    }

    /// Errors of one picture against many references of the same noise differ by the predicted spread.
    #[test]
    fn spread_is_that_between_references() {
        let mut rng = Rng(2);
        let size = [40, 30];
        for (own, theirs) in [(0.01, 0.003), (0.01, 0.01), (0.004, 0.01)] {
            let picture = noisy_pixels(&mut rng, 1200, own);
            let errors: Vec<Errors> = (0..200)
                .map(|_| {
                    let [a, b] = [0; 2].map(|_| noisy_pixels(&mut rng, 1200, theirs * 2f64.sqrt()));
                    let reference = Reference::of_replicates(size, &a, &b, &Display::default());
                    reference.errors_of(&mut |y, row| {
                        row.clear();
                        row.extend_from_slice(&picture[y * size[0]..(y + 1) * size[0]]);
                    })
                })
                .collect();
            let n = errors.len() as f64;
            let mean = errors.iter().map(|e| e.rmse_codes).sum::<f64>() / n;
            let variance = errors.iter().map(|e| (e.rmse_codes - mean).powi(2)).sum::<f64>() / n;
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
        let pixels = noisy_pixels(&mut rng, 1200, 0.01);
        let same = |row: &mut Vec<[f64; 3]>, y: usize| {
            row.clear();
            row.extend_from_slice(&pixels[y * 40..(y + 1) * 40]);
        };
        let truth = Reference::of_pixels([40, 30], pixels.clone(), &Display::default());
        let errors = truth.errors_of(&mut |y, row| same(row, y));
        assert_eq!((errors.rmse_codes, errors.spread), (0.0, 0.0));
        let off = truth.errors_of(&mut |y, row| {
            same(row, y);
            row.iter_mut().for_each(|p| p[1] += 0.02);
        });
        assert!(off.rmse_codes > 1.0 && off.spread == 0.0, "{off:?}");
    }
}
