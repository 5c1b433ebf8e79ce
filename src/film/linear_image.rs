//! A whole picture in linear light, kept while the film goes on.

use crate::film::box_filter::{Coverage, coverage, fill_gaps};
use crate::film::film::Film;
use crate::film::light_weights::{LightWeights, Replicates};

/// A picture of the film's size in linear radiance, without the film.
#[derive(Clone, Debug, PartialEq)]
pub struct LinearImage {
    width: usize,
    height: usize,
    /// `[row][column]`.
    pixels: Vec<[f32; 3]>,
}

impl Film {
    /// The picture as it is. A pixel without samples looks like the nearest one of its row that has
    /// some, a row without samples like the nearest row.
    pub fn linear(&self, mix: &LightWeights) -> LinearImage {
        let (width, height) = (self.width(), self.height());
        let per_unit = mix.radiance_per_step(self.scales());
        let mut pixels = vec![[0.0f32; 3]; width * height];
        let mut known = vec![false; width * height];
        for y in 0..height {
            let start = y * width;
            self.visit_row(y, |x, sums| {
                pixels[start + x] = sums.mean(Replicates::Both, &per_unit).map(|c| c as f32);
                known[start + x] = sums.count(Replicates::Both) > 0;
            });
        }
        if !known.iter().all(|k| *k) {
            fill_gaps(pixels.as_flattened_mut(), &mut known, width, height, 3);
        }
        LinearImage { width, height, pixels }
    }
}

impl LinearImage {
    /// Columns and rows.
    pub fn size(&self) -> [usize; 2] {
        [self.width, self.height]
    }

    /// The radiance of the pixel in column `x`, row `y`.
    ///
    /// # Panics
    /// If there is no such pixel.
    pub fn pixel(&self, x: usize, y: usize) -> [f32; 3] {
        assert!(x < self.width, "column {x} of {}", self.width);
        self.pixels[y * self.width + x]
    }

    /// The means over `cols` x `rows` cells that together cover the picture, `[row][column]`,
    /// weighted by area as in [`Film::thumbnail`].
    pub fn resampled(&self, cols: usize, rows: usize) -> Vec<[f32; 3]> {
        let (xs, ys) = (coverage(self.width, cols), coverage(self.height, rows));
        let mut out = Vec::with_capacity(cols * rows);
        let mut sums = vec![[0.0f64; 3]; cols];
        for y in &ys {
            sums.fill([0.0; 3]);
            for (pixel, height) in (y.first..).zip(&y.parts) {
                let line = &self.pixels[pixel * self.width..][..self.width];
                for (sum, x) in sums.iter_mut().zip(&xs) {
                    let of_line = line_sum(line, x);
                    (0..3).for_each(|c| sum[c] += height * of_line[c]);
                }
            }
            let of = |cover: &Coverage| cover.parts.iter().sum::<f64>();
            let mean = |(sum, x): (&[f64; 3], &Coverage)| sum.map(|s| (s / (of(x) * of(y))) as f32);
            out.extend(sums.iter().zip(&xs).map(mean));
        }
        out
    }
}

fn line_sum(line: &[[f32; 3]], x: &Coverage) -> [f64; 3] {
    let mut sum = [0.0; 3];
    for (pixel, width) in line[x.first..].iter().zip(&x.parts) {
        (0..3).for_each(|c| sum[c] += width * f64::from(pixel[c]));
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::testing::{each_tile, fill, film, white};

    #[test]
    fn a_kept_picture_is_that_of_the_film_at_any_size() {
        let mut film = film(37, 29, &[1024.0, 1.0]);
        fill(&mut film, 2, |x, y, r| {
            let v = (x * 7 + y * 13 + r * 5) as f64;
            vec![v, v % 11.0, 1.0, v % 3.0, 2.0, v % 17.0]
        });
        let mix = LightWeights { weights: vec![[1.0, 0.5, 2.0], [0.0, 1.0, 0.25]] };
        let kept = film.linear(&mix);
        assert_eq!(kept.size(), [37, 29]);
        assert_eq!(kept.pixel(36, 28), film.pixel(36, 28, &mix).map(|c| c as f32));
        for (cols, rows) in [(1, 1), (5, 4), (37, 29), (80, 45)] {
            let expected = film.resampled(cols, rows, &mix);
            let got = kept.resampled(cols, rows);
            assert_eq!(got.len(), expected.len());
            for (got, expected) in got.as_flattened().iter().zip(expected.as_flattened()) {
                assert!((got - expected).abs() <= 1e-5 * expected.abs(), "{got} {expected}");
            }
        }
        assert!(kept.resampled(0, 3).is_empty());
    }

    #[test]
    fn gaps_of_a_first_lattice_are_filled() {
        let mut film = film(16, 16, &[1.0]);
        each_tile(&mut film, |tile, _| {
            [0, 8, 128, 136].into_iter().for_each(|p| tile.add(0, p, &[p as i64; 3]));
            tile.set_lattice(8);
        });
        let kept = film.linear(&white(1));
        let corners = [kept.pixel(1, 2)[0], kept.pixel(15, 1)[0], kept.pixel(9, 9)[0]];
        assert_eq!(corners, [0.0, 8.0, 136.0]);
    }
}
