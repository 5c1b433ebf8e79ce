//! Piecewise-constant 2D distribution of directions, in proportion to the luminance of an
//! equirectangular image.
//!
//! The density per solid angle is constant inside each pixel. One random number selects a row, a
//! second one selects a column of this row. Both are mapped by inverse cumulative distributions, so
//! that stratified numbers give stratified directions (Pharr, Jakob, Humphreys, *Physically Based
//! Rendering*, 4th ed., A.5.6).

use std::f64::consts::{PI, TAU};

/// Luminance added to every pixel, as a fraction of the mean. The density of every direction is
/// thus at least 1/17 of the uniform one, which limits the variance where the bright part of the
/// image is occluded.
const FLOOR: f64 = 1.0 / 16.0;

/// Sampling distribution of directions over the pixels of an equirectangular image.
#[derive(Clone, Debug, PartialEq)]
pub struct PiecewiseConstant2D {
    columns: usize,
    /// Cosines of the polar angles at the boundaries of the image's rows, from 1 to -1.
    cosines: Vec<f64>,
    /// Cumulative distribution of the rows: one number more than rows, from 0 to 1.
    rows: Vec<f64>,
    /// Cumulative distribution of the columns of each row: `columns` + 1 numbers, from 0 to 1.
    columns_of_rows: Vec<f32>,
}

/// Direction sampled from the distribution.
pub struct PixelSample {
    /// Horizontal position in the image, 0..=1.
    pub x: f64,
    /// Cosine of the polar angle.
    pub cos: f64,
    /// Density of the direction [1/sr].
    pub density: f64,
}

impl PiecewiseConstant2D {
    /// Creates the distribution over an image.
    pub fn new([columns, rows]: [usize; 2], pixels: &[[f32; 3]]) -> Self {
        let cosine = |row: usize| (PI * row as f64 / rows as f64).cos();
        let cosines: Vec<f64> = (0..=rows).map(cosine).collect();
        // Luminance of a linear colour with the primaries of sRGB.
        let luminance = |p: &[f32; 3]| {
            0.2126 * f64::from(p[0]) + 0.7152 * f64::from(p[1]) + 0.0722 * f64::from(p[2])
        };
        // Mean, over the middle one of three neighbouring pixels, of the linear interpolation
        // between the centres of the three.
        let smoothed =
            |before: f64, middle: f64, after: f64| 0.125 * before + 0.75 * middle + 0.125 * after;
        let along_row = |row: usize| -> Vec<f64> {
            let row: Vec<f64> =
                pixels[row * columns..(row + 1) * columns].iter().map(luminance).collect();
            let at = |i: usize| row[i % columns];
            (0..columns).map(|i| smoothed(at(i + columns - 1), at(i), at(i + 1))).collect()
        };
        let mut out = Self {
            columns,
            cosines,
            rows: Vec::with_capacity(rows + 1),
            columns_of_rows: Vec::with_capacity(rows * (columns + 1)),
        };
        // Mean luminance, weighted by solid angle.
        let solid_angle = |row: usize| 0.5 * (out.cosines[row] - out.cosines[row + 1]);
        let row_mean = |row: usize| {
            let sum: f64 = pixels[row * columns..(row + 1) * columns].iter().map(luminance).sum();
            sum / columns as f64
        };
        let mean: f64 = (0..rows).map(|row| solid_angle(row) * row_mean(row)).sum();
        let floor = if mean > 0.0 { FLOOR * mean } else { 1.0 };
        let mut row_weights = Vec::with_capacity(rows);
        let (mut above, mut here) = (along_row(0), along_row(0));
        for row in 0..rows {
            let below = along_row((row + 1).min(rows - 1));
            let weights: Vec<f64> =
                (0..columns).map(|i| smoothed(above[i], here[i], below[i]) + floor).collect();
            let total: f64 = weights.iter().sum();
            row_weights.push(total * (out.cosines[row] - out.cosines[row + 1]));
            out.columns_of_rows.extend(cumulative(&weights, total).map(|x| x as f32));
            (above, here) = (here, below);
        }
        let total = row_weights.iter().sum();
        out.rows.extend(cumulative(&row_weights, total));
        out
    }

    /// Returns the mean of `pixels` over all directions, weighted by solid angle.
    pub fn mean(&self, pixels: &[[f32; 3]]) -> [f64; 3] {
        let mut sum = [0.0; 3];
        for (row, pixels) in pixels.chunks(self.columns).enumerate() {
            let share = 0.5 * (self.cosines[row] - self.cosines[row + 1]) / self.columns as f64;
            for pixel in pixels {
                sum = std::array::from_fn(|c| sum[c] + share * f64::from(pixel[c]));
            }
        }
        sum
    }

    /// Returns the memory of the distribution in bytes.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.rows[..]) + size_of_val(&self.columns_of_rows[..])
    }

    /// Samples a direction from the distribution. `u` and `v` are uniform in [0, 1); `u` selects
    /// the column and `v` the row.
    pub fn sample(&self, u: f64, v: f64) -> PixelSample {
        let row = interval(&self.rows, |x| *x <= v);
        let t = (v - self.rows[row]) / (self.rows[row + 1] - self.rows[row]);
        let columns = self.columns_of_row(row);
        let column = interval(columns, |x| f64::from(*x) <= u);
        let [low, high] = [columns[column], columns[column + 1]].map(f64::from);
        let s = (u - low) / (high - low);
        let cos =
            self.cosines[row] + t.clamp(0.0, 1.0) * (self.cosines[row + 1] - self.cosines[row]);
        let x = (column as f64 + s.clamp(0.0, 1.0)) / self.columns as f64;
        PixelSample { x, cos, density: self.density_in(row, column) }
    }

    /// Returns the density [1/sr] of the direction at the position `[x, y]` in the image, 0..=1.
    pub fn density(&self, [x, y]: [f64; 2]) -> f64 {
        let rows = self.rows.len() - 1;
        // The conversion to integers saturates.
        let row = ((y * rows as f64) as usize).min(rows - 1);
        let column = ((x * self.columns as f64) as usize).min(self.columns - 1);
        self.density_in(row, column)
    }

    /// Returns the probability of a pixel divided by its solid angle.
    fn density_in(&self, row: usize, column: usize) -> f64 {
        let columns = self.columns_of_row(row);
        let share = f64::from(columns[column + 1]) - f64::from(columns[column]);
        let solid_angle = TAU * (self.cosines[row] - self.cosines[row + 1]) / self.columns as f64;
        (self.rows[row + 1] - self.rows[row]) * share / solid_angle
    }

    fn columns_of_row(&self, row: usize) -> &[f32] {
        let first = row * (self.columns + 1);
        &self.columns_of_rows[first..=first + self.columns]
    }
}

/// Returns the cumulative sums of `weights`, from 0 to 1. `total` is their sum.
fn cumulative(weights: &[f64], total: f64) -> impl Iterator<Item = f64> {
    let mut sum = 0.0;
    let last = weights.len() - 1;
    let partial = move |(i, weight): (usize, &f64)| {
        sum += weight;
        if i == last { 1.0 } else { (sum / total).min(1.0) }
    };
    std::iter::once(0.0).chain(weights.iter().enumerate().map(partial))
}

/// Returns the index of the last one of the ascending `numbers` for which `is_below` is `true`,
/// clamped to the range from 0 to the second-last index.
fn interval<T>(numbers: &[T], is_below: impl Fn(&T) -> bool) -> usize {
    numbers.partition_point(is_below).clamp(1, numbers.len() - 1) - 1
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: [usize; 2] = [24, 12];

    fn image(bright: f32) -> Vec<[f32; 3]> {
        let mut pixels: Vec<_> = (0..SIZE[0] * SIZE[1])
            .map(|i| [0.1 + (i % 7) as f32, 0.5, ((i * i) % 11) as f32])
            .collect();
        pixels[5 * SIZE[0] + 9] = [bright; 3];
        pixels
    }

    fn pixels() -> impl Iterator<Item = (usize, usize)> {
        (0..SIZE[1]).flat_map(|row| (0..SIZE[0]).map(move |column| (row, column)))
    }

    fn center(row: usize, column: usize) -> [f64; 2] {
        [(column as f64 + 0.5) / SIZE[0] as f64, (row as f64 + 0.5) / SIZE[1] as f64]
    }

    #[test]
    fn density_integrates_to_one() {
        for pixels_of_image in [image(1.0), image(1e9), vec![[0.0; 3]; SIZE[0] * SIZE[1]]] {
            let distribution = PiecewiseConstant2D::new(SIZE, &pixels_of_image);
            let mass = |(row, column): (usize, usize)| {
                let height = distribution.cosines[row] - distribution.cosines[row + 1];
                distribution.density(center(row, column)) * height * TAU / SIZE[0] as f64
            };
            let sum: f64 = pixels().map(mass).sum();
            assert!((sum - 1.0).abs() < 1e-6, "{sum}");
            assert!(pixels().all(|pixel| mass(pixel) > 0.0));
        }
    }

    /// Checks that a regular grid of 256 x 256 points (u, v) gives stratified directions. The
    /// number of directions in a row of pixels must differ from its expectation by at most 256,
    /// which is one row of the grid. The number in a pixel that covers r x c points of the grid
    /// must differ from r c by at most r + c + 1.
    #[test]
    fn grid_of_numbers_gives_stratified_directions() {
        let n = 256;
        for bright in [1.0, 300.0, 1e6] {
            let distribution = PiecewiseConstant2D::new(SIZE, &image(bright));
            let mut counts = vec![[0u32; SIZE[0]]; SIZE[1]];
            for i in 0..n * n {
                let number = |k: usize| (k as f64 + 0.5) / n as f64;
                let PixelSample { x, cos, density } =
                    distribution.sample(number(i % n), number(i / n));
                let row = distribution.cosines.partition_point(|c| *c >= cos).max(1) - 1;
                let column = (x * SIZE[0] as f64) as usize;
                counts[row][column] += 1;
                assert_eq!(density, distribution.density_in(row, column));
            }
            for (row, column) in pixels() {
                let of_row = distribution.rows[row + 1] - distribution.rows[row];
                let columns = distribution.columns_of_row(row);
                let share = f64::from(columns[column + 1]) - f64::from(columns[column]);
                let (rows, columns) = (n as f64 * of_row, n as f64 * share);
                let limit = rows + columns + 1.0;
                let difference = f64::from(counts[row][column]) - rows * columns;
                assert!(difference.abs() <= limit, "{row}, {column}: {difference}, {limit}");
                let row_count: u32 = counts[row].iter().sum();
                assert!((f64::from(row_count) / n as f64 - rows).abs() <= 1.0);
            }
        }
    }

    /// Checks by Pearson's chi-square test that pseudo-random samples follow the density. The limit
    /// is the 99.9 % quantile, in the approximation by Wilson and Hilferty.
    #[test]
    fn samples_follow_the_density() {
        for bright in [1.0, 1e3] {
            let distribution = PiecewiseConstant2D::new(SIZE, &image(bright));
            let mut counts = vec![0.0; SIZE[0] * SIZE[1]];
            let mut state = 1u64;
            let mut unit = || {
                state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
                (state >> 11) as f64 / (1u64 << 53) as f64
            };
            let n = 400_000;
            for _ in 0..n {
                let PixelSample { x, cos, .. } = distribution.sample(unit(), unit());
                let row = distribution.cosines.partition_point(|c| *c >= cos).max(1) - 1;
                counts[row * SIZE[0] + (x * SIZE[0] as f64) as usize] += 1.0;
            }
            let (mut statistic, mut cells) = (0.0, 0.0);
            for (row, column) in pixels() {
                let height = distribution.cosines[row] - distribution.cosines[row + 1];
                let density = distribution.density(center(row, column));
                let expected = f64::from(n) * density * height * TAU / SIZE[0] as f64;
                if expected >= 5.0 {
                    statistic += (counts[row * SIZE[0] + column] - expected).powi(2) / expected;
                    cells += 1.0;
                }
            }
            let k: f64 = cells - 1.0;
            let spread = 2.0 / (9.0 * k);
            let quantile = k * (1.0 - spread + 3.09 * spread.sqrt()).powi(3);
            assert!(cells > 100.0 && statistic < quantile, "{statistic} of {quantile}, {cells}");
        }
    }
}
