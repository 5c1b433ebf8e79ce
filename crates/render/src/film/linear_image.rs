//! Copy of a film's pixels that later samples do not change.

use crate::film::box_filter::{box_means, fill_gaps};
use crate::film::detail::Window;
use crate::film::light_weights::{LightWeights, Replicates};
use crate::film::store::Film;

/// Linear radiance of every pixel of a film at one moment.
#[derive(Clone, Debug, PartialEq)]
pub struct LinearImage {
    /// Number of columns and rows of pixels.
    pub size: [usize; 2],
    /// Pixels in linear radiance, `[row][column]`.
    pixels: Vec<[f32; 3]>,
}

impl LinearImage {
    /// Creates the image of `film` under `weights`. A pixel without samples gets the value of a
    /// near pixel, as a cell does in [`Thumbnail::of_film`](crate::film::Thumbnail::of_film).
    pub fn of_film(film: &Film, weights: &LightWeights) -> Self {
        let (width, height) = (film.header.width, film.header.height);
        let per_unit = weights.radiance_per_step(&film.header.scales);
        let mut pixels = vec![[0.0f32; 3]; width * height];
        let mut known = vec![false; width * height];
        for y in 0..height {
            let start = y * width;
            film.visit_row(y, 0..film.header.width, |x, sums| {
                pixels[start + x] = sums.mean(Replicates::Both, &per_unit).map(|c| c as f32);
                known[start + x] = sums.count(Replicates::Both) > 0;
            });
        }
        if known.contains(&false) {
            fill_gaps(pixels.as_flattened_mut(), &known, width, height, 3);
        }
        Self { size: [width, height], pixels }
    }

    /// Returns the mean over each of `cols` x `rows` equal cells of `window`, `[row][column]`.
    pub fn resampled(&self, window: Window, cols: usize, rows: usize) -> Vec<[f32; 3]> {
        let Window { origin: [x, y], size } = window.clipped(self.size);
        let index = |pixel: usize| (y + pixel / size[0]) * self.size[0] + x + pixel % size[0];
        let means = box_means(size, [cols, rows], |pixel| self.pixels[index(pixel)].map(f64::from));
        means.into_iter().map(|mean| mean.map(|c| c as f32)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::Thumbnail;
    use crate::film::testing::{TestFilm, each_tile, fill, film, white};

    fn pixel(image: &LinearImage, x: usize, y: usize) -> [f32; 3] {
        image.pixels[y * image.size[0] + x]
    }

    #[test]
    fn linear_image_resamples_like_the_film() {
        let mut film = film(37, 29, &[1024.0, 1.0]);
        fill(&mut film, 2, |x, y, r| {
            let v = (x * 7 + y * 13 + r * 5) as f64;
            vec![v, v % 11.0, 1.0, v % 3.0, 2.0, v % 17.0]
        });
        let mix = LightWeights { weights: vec![[1.0, 0.5, 2.0], [0.0, 1.0, 0.25]] };
        let image = LinearImage::of_film(&film, &mix);
        assert_eq!(image.size, [37, 29]);
        assert_eq!(pixel(&image, 36, 28), film.pixel(36, 28, &mix).map(|c| c as f32));
        for (cols, rows) in [(1, 1), (5, 4), (37, 29), (80, 45)] {
            let expected = Thumbnail::of_film(&film, cols, rows).mixed(&mix);
            let got = image.resampled(Window::whole(image.size), cols, rows);
            assert_eq!(got.len(), expected.len());
            for (got, expected) in got.as_flattened().iter().zip(expected.as_flattened()) {
                assert!((got - expected).abs() <= 1e-5 * expected.abs(), "{got} {expected}");
            }
        }
        assert!(image.resampled(Window::whole(image.size), 0, 3).is_empty());
    }

    #[test]
    fn linear_image_fills_the_gaps_of_a_first_lattice() {
        let mut film = film(16, 16, &[1.0]);
        each_tile(&mut film, |tile, _| {
            [0, 8, 128, 136].into_iter().for_each(|p| tile.add(0, p, &[p as i64; 3]));
            tile.set_lattice(8);
        });
        let image = LinearImage::of_film(&film, &white(1));
        let corners = [pixel(&image, 1, 2)[0], pixel(&image, 15, 1)[0], pixel(&image, 9, 9)[0]];
        assert_eq!(corners, [0.0, 8.0, 136.0]);
    }
}
