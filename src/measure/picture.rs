//! Pictures beside a reference.

use crate::film::{Display, Film, Mix, Part};

/// Radiance below which relative errors do not count as larger: relMSE = mean((x - r)^2 / (r^2 + 0.01)).
const RELATIVE_FLOOR: f64 = 0.01;

/// A picture that others are compared with, and its own error.
pub struct Reference {
    size: [usize; 2],
    pixels: Vec<[f64; 3]>,
    codes: Vec<[f64; 3]>,
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

/// How far a picture is from the truth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Errors {
    /// Root mean square error in linear radiance.
    pub rmse_linear: f64,
    /// Root mean square error as displayed, in unrounded 8-bit codes.
    pub rmse_codes: f64,
    /// Mean of (x - r)^2 / (r^2 + 0.01).
    pub rel_mse: f64,
}

/// Mean squares of half the difference of two replicates, and the variance of their mean's mean: what
/// their mean is wrong by. As displayed, the distance of the mean's codes from those of the
/// replicates.
fn own_error(a: &[[f64; 3]], b: &[[f64; 3]], display: &Display) -> (Squares, f64) {
    let mut own = Squares::default();
    let mut mean_variance = 0.0;
    for (a, b) in a.iter().zip(b) {
        let mean = std::array::from_fn(|c| 0.5 * (a[c] + b[c]));
        let [code_a, code_b, code] = [*a, *b, mean].map(|x| display.codes(x));
        let mut half_sum = 0.0;
        for c in 0..3 {
            let half = 0.5 * (a[c] - b[c]);
            half_sum += half;
            own.linear += half * half;
            own.relative += half * half / (mean[c] * mean[c] + RELATIVE_FLOOR);
            own.codes += 0.5 * ((code_a[c] - code[c]).powi(2) + (code_b[c] - code[c]).powi(2));
        }
        mean_variance += half_sum * half_sum;
    }
    let values = (3 * a.len()) as f64;
    let own = Squares {
        linear: own.linear / values,
        codes: own.codes / values,
        relative: own.relative / values,
    };
    (own, mean_variance / (values * values))
}

/// Both replicates, row by row.
fn replicates(film: &Film, mix: &Mix) -> [Vec<[f64; 3]>; 2] {
    [Part::A, Part::B].map(|part| {
        let mut all = Vec::with_capacity(film.width() * film.height());
        let mut row = Vec::new();
        for y in 0..film.height() {
            film.row(y, part, mix, &mut row);
            all.extend_from_slice(&row);
        }
        all
    })
}

impl Reference {
    /// The film's picture, whose own error is known from its replicates, which hold equally many
    /// samples.
    pub fn of_film(film: &Film, mix: &Mix, display: &Display) -> Self {
        let [a, b] = replicates(film, mix);
        Self::of_replicates([film.width(), film.height()], &a, &b, display)
    }

    /// The mean of two independent pictures, row by row.
    pub fn of_replicates(
        size: [usize; 2],
        a: &[[f64; 3]],
        b: &[[f64; 3]],
        display: &Display,
    ) -> Self {
        let (own, mean_variance) = own_error(a, b, display);
        let mean = |(a, b): (&[f64; 3], &[f64; 3])| std::array::from_fn(|c| 0.5 * (a[c] + b[c]));
        Self::new(size, a.iter().zip(b).map(mean).collect(), own, mean_variance, *display)
    }

    /// A picture from elsewhere, which is taken for the truth.
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
        Self { size, pixels, codes, own, mean_variance, display }
    }

    /// Width and height in pixels.
    pub fn size(&self) -> [usize; 2] {
        self.size
    }

    /// Its own root mean square error, in codes.
    pub fn noise_codes(&self) -> f64 {
        self.own.codes.sqrt()
    }

    /// Its own root mean square error, in linear radiance.
    pub fn noise_linear(&self) -> f64 {
        self.own.linear.sqrt()
    }

    /// The film's errors: its distance from the reference, less what the reference is wrong by itself.
    pub fn errors(&self, film: &Film, mix: &Mix) -> Errors {
        let mut sum = Squares::default();
        let mut row = Vec::new();
        for y in 0..self.size[1] {
            film.row(y, Part::Both, mix, &mut row);
            let at = y * self.size[0]..(y + 1) * self.size[0];
            for ((x, r), code_r) in row.iter().zip(&self.pixels[at.clone()]).zip(&self.codes[at]) {
                let code_x = self.display.codes(*x);
                for c in 0..3 {
                    let d = x[c] - r[c];
                    sum.linear += d * d;
                    sum.codes += (code_x[c] - code_r[c]).powi(2);
                    sum.relative += d * d / (r[c] * r[c] + RELATIVE_FLOOR);
                }
            }
        }
        let values = (3 * self.pixels.len()) as f64;
        let left = |sum: f64, own: f64| (sum / values - own).max(0.0);
        Errors {
            rmse_linear: left(sum.linear, self.own.linear).sqrt(),
            rmse_codes: left(sum.codes, self.own.codes).sqrt(),
            rel_mse: left(sum.relative, self.own.relative),
        }
    }

    /// How far the film's expectation is from the reference's: the difference of the pictures' means
    /// in standard errors, and the root mean square of the pixels' differences that noise does not
    /// explain in codes.
    pub fn bias(&self, film: &Film, mix: &Mix) -> (f64, f64) {
        let [a, b] = replicates(film, mix);
        let (own, mean_variance) = own_error(&a, &b, &self.display);
        let of = |(r, (a, b)): (&[f64; 3], (&[f64; 3], &[f64; 3]))| {
            (0..3).map(|c| 0.5 * (a[c] + b[c]) - r[c]).sum::<f64>()
        };
        let sum: f64 = self.pixels.iter().zip(a.iter().zip(&b)).map(of).sum();
        let mean = sum / (3 * self.pixels.len()) as f64;
        let deviation = (mean_variance + self.mean_variance).sqrt();
        let codes = (self.errors(film, mix).rmse_codes.powi(2) - own.codes).max(0.0).sqrt();
        // Two pictures without noise differ, or they do not.
        let z = if mean == 0.0 { 0.0 } else { mean / deviation };
        (z, codes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Noise of standard deviation s in both replicates: their mean is wrong by s / sqrt 2.
    #[test]
    fn the_own_error_is_that_of_the_mean() {
        let mut state = 1u64;
        let mut noise = || {
            // Twelve uniform numbers make a normal one, nearly.
            let mut sum = -6.0;
            for _ in 0..12 {
                state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
                sum += (state >> 11) as f64 / (1u64 << 53) as f64;
            }
            sum
        };
        let mut pixels = || (0..10_000).map(|_| [0; 3].map(|_| 0.5 + 0.01 * noise())).collect();
        let [a, b]: [Vec<[f64; 3]>; 2] = [pixels(), pixels()];
        let reference = Reference::of_replicates([100, 100], &a, &b, &Display::default());
        let expected = 0.01 / 2f64.sqrt();
        assert!((reference.noise_linear() / expected - 1.0).abs() < 0.02);
        // The sRGB curve's slope at 0.5 is 1.055 / 2.4 x 0.5^(1/2.4 - 1).
        let slope = 255.0 * 1.055 / 2.4 * 0.5f64.powf(1.0 / 2.4 - 1.0);
        assert!((reference.noise_codes() / (slope * expected) - 1.0).abs() < 0.02);
    }
}
