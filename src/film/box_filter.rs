//! The film at another resolution, for displays: box averages of whatever samples exist.

use crate::film::downsample::{DirtyTile, IncrementalDownsample};
use crate::film::film::Film;
use crate::film::light_weights::LightWeights;

/// Means of the film over the cells of a raster, for each light group by itself, so that lights can
/// be mixed anew without the film.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Thumbnail {
    /// Cells in a row.
    pub cols: usize,
    /// Rows of cells.
    pub rows: usize,
    /// `[row][column][group][channel]`, radiance of unit light.
    means: Vec<f32>,
    groups: usize,
}

impl Thumbnail {
    /// From means in `[row][column][group][channel]`.
    pub(super) fn new([cols, rows]: [usize; 2], means: Vec<f32>, groups: usize) -> Self {
        Self { cols, rows, means, groups }
    }

    /// Number of light groups: what a [`LightWeights`] for it needs weights for.
    pub fn groups(&self) -> usize {
        self.groups
    }

    /// Radiance, `[row][column]`.
    pub fn mixed(&self, mix: &LightWeights) -> Vec<[f32; 3]> {
        assert_eq!(mix.weights.len(), self.groups, "weights for the groups of the film");
        let weights: Vec<_> = mix.weights.iter().map(|w| w.map(|w| w as f32)).collect();
        let cell = |means: &[f32]| {
            let mut sum = [0.0; 3];
            for (mean, weight) in means.chunks_exact(3).zip(&weights) {
                (0..3).for_each(|c| sum[c] += mean[c] * weight[c]);
            }
            sum
        };
        self.means.chunks_exact(3 * self.groups).map(cell).collect()
    }
}

/// Which pixels a cell covers in one direction, and how much of each.
pub(super) struct Coverage {
    /// First pixel.
    pub first: usize,
    /// Covered part of each pixel, from `first` on; 0..=1.
    pub parts: Vec<f64>,
}

/// Divides `pixels` into `cells` of equal width.
pub(super) fn coverage(pixels: usize, cells: usize) -> Vec<Coverage> {
    let edge = |cell: usize| cell as f64 * pixels as f64 / cells as f64;
    let cover = |cell: usize| {
        let (from, to) = (edge(cell), edge(cell + 1));
        let first = (from as usize).min(pixels - 1);
        let last = (to.ceil() as usize).clamp(first + 1, pixels);
        let part = |p: usize| (to.min((p + 1) as f64) - from.max(p as f64)).max(0.0);
        Coverage { first, parts: (first..last).map(part).collect() }
    };
    (0..cells).map(cover).collect()
}

impl Film {
    /// The picture averaged over `cols` x `rows` cells, `[row][column]`, radiance; see
    /// [`Film::thumbnail`].
    pub fn resampled(&self, cols: usize, rows: usize, mix: &LightWeights) -> Vec<[f32; 3]> {
        self.thumbnail(cols, rows).mixed(mix)
    }

    /// The film averaged over `cols` x `rows` cells that together cover it: in each cell the mean of
    /// its sampled pixels, weighted by the area that the cell covers of them. A cell without samples
    /// looks like the nearest one of its row that has some, a row without samples like the nearest
    /// row; a film without samples is black.
    pub fn thumbnail(&self, cols: usize, rows: usize) -> Thumbnail {
        let mut raster = IncrementalDownsample::new(self, cols, rows);
        raster.stale(self).into_iter().for_each(DirtyTile::refresh);
        raster.thumbnail()
    }
}

/// Gives cells without samples the means of the nearest known cell of their row, then rows without
/// any the means of the nearest row.
pub(super) fn fill_gaps(
    means: &mut [f32],
    known: &mut [bool],
    cols: usize,
    rows: usize,
    stride: usize,
) {
    let mut row_known = vec![false; rows];
    for row in 0..rows {
        let known = &known[row * cols..][..cols];
        row_known[row] = known.iter().any(|k| *k);
        let means = &mut means[row * cols * stride..][..cols * stride];
        for (to, from) in nearest(known).into_iter().enumerate() {
            means.copy_within(from * stride..(from + 1) * stride, to * stride);
        }
    }
    let width = cols * stride;
    for (to, from) in nearest(&row_known).into_iter().enumerate() {
        means.copy_within(from * width..(from + 1) * width, to * width);
    }
}

/// For each place the nearest known one (the lower of two); itself if none is known.
pub(super) fn nearest(known: &[bool]) -> Vec<usize> {
    let mut below: Vec<Option<usize>> = Vec::with_capacity(known.len());
    for (i, k) in known.iter().enumerate() {
        below.push(if *k { Some(i) } else { below.last().copied().flatten() });
    }
    let mut above = None;
    let mut out: Vec<usize> = (0..known.len()).collect();
    for i in (0..known.len()).rev() {
        if known[i] {
            above = Some(i);
        }
        out[i] = match (below[i], above) {
            (Some(b), Some(a)) => {
                if i - b <= a - i {
                    b
                } else {
                    a
                }
            }
            (b, a) => b.or(a).unwrap_or(i),
        };
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::TILE;
    use crate::film::testing::{each_tile, fill, film, white};
    use crate::film::tile::lattice_pixels;
    use proptest::prelude::*;

    /// By its definition: every pixel against every cell.
    fn by_definition(film: &Film, cols: usize, rows: usize, mix: &LightWeights) -> Vec<[f64; 3]> {
        let overlap = |cell: usize, cells: usize, pixel: usize, pixels: usize| {
            let edge = |c: usize| c as f64 * pixels as f64 / cells as f64;
            (edge(cell + 1).min((pixel + 1) as f64) - edge(cell).max(pixel as f64)).max(0.0)
        };
        let cell = |col, row| {
            let (mut sum, mut area) = ([0.0; 3], 0.0);
            for (x, y) in (0..film.height()).flat_map(|y| (0..film.width()).map(move |x| (x, y))) {
                let part =
                    overlap(col, cols, x, film.width()) * overlap(row, rows, y, film.height());
                let value = film.pixel(x, y, mix);
                (0..3).for_each(|c| sum[c] += part * value[c]);
                area += part;
            }
            sum.map(|s| s / area)
        };
        (0..rows)
            .flat_map(|row| (0..cols).map(move |col| (col, row)))
            .map(|(c, r)| cell(c, r))
            .collect()
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        #[test]
        fn cells_hold_area_weighted_means(
            width in 1usize..40, height in 1usize..40, cols in 1usize..50, rows in 1usize..50,
        ) {
            let mut film = film(width, height, &[1024.0, 1.0]);
            fill(&mut film, 2, |x, y, r| {
                let v = (x * 7 + y * 13 + r * 5) as f64;
                vec![v, v % 11.0, 1.0, v % 3.0, 2.0, v % 17.0]
            });
            let mix = LightWeights { weights: vec![[1.0, 0.5, 2.0], [0.0, 1.0, 0.25]] };
            let got = film.resampled(cols, rows, &mix);
            let expected = by_definition(&film, cols, rows, &mix);
            prop_assert_eq!(got.len(), expected.len());
            for (got, expected) in got.iter().zip(&expected) {
                for c in 0..3 {
                    let (got, expected) = (f64::from(got[c]), expected[c]);
                    prop_assert!((got - expected).abs() <= 1e-6 * expected.abs() + 1e-6);
                }
            }
        }
    }

    /// One sample of value x + 100 y in every lattice pixel.
    fn first_samples(film: &mut Film, before_px: usize, step_px: usize) {
        each_tile(film, |tile, [x0, y0]| {
            let [width, height] = tile.extent();
            for pixel in lattice_pixels(before_px, step_px) {
                let (x, y) = (pixel % TILE, pixel / TILE);
                if x < width && y < height {
                    tile.add(0, pixel, &[((x0 + x) + 100 * (y0 + y)) as i64; 3]);
                }
            }
            tile.set_lattice(step_px);
        });
    }

    #[test]
    fn a_first_lattice_is_a_whole_picture() {
        let mut film = film(32, 24, &[1.0]);
        let value = |film: &Film, cols: usize, rows: usize, col: usize, row: usize| {
            film.resampled(cols, rows, &white(1))[row * cols + col][0]
        };
        assert_eq!(value(&film, 8, 6, 7, 5), 0.0);
        first_samples(&mut film, 0, 8);
        assert_eq!(film.samples(), 12);
        // Cells of 4x4 pixels: every second one has a sample, the others look like a neighbour.
        for (col, row) in (0..6).flat_map(|row| (0..8).map(move |col| (col, row))) {
            let expected = (col / 2 * 8 + 100 * (row / 2 * 8)) as f32;
            assert_eq!(value(&film, 8, 6, col, row), expected, "{col} {row}");
        }
        // One cell for all: the mean of the samples that there are.
        assert_eq!(value(&film, 1, 1, 0, 0), 12.0 + 800.0);
        first_samples(&mut film, 8, 2);
        assert_eq!(value(&film, 8, 6, 1, 1), 5.0 + 500.0);
        first_samples(&mut film, 2, 1);
        assert_eq!(film.samples(), 32 * 24);
        assert_eq!(value(&film, 32, 24, 31, 23), 31.0 + 2300.0);
    }

    #[test]
    fn gaps_take_the_nearest() {
        assert_eq!(nearest(&[false, true, false, false, false, true]), [1, 1, 1, 1, 5, 5]);
        assert_eq!(nearest(&[false, false]), [0, 1]);
        // The upper half of the film has samples, the lower none: it looks like the last row.
        let mut film = film(32, 32, &[1.0]);
        for slot in film.slots(&[1, 0]) {
            let value = slot.index as i64 + 3;
            let tile = slot.prepare();
            (0..256).for_each(|p| tile.add(0, p, &[value; 3]));
            tile.advance(0, 1);
        }
        let picture = film.resampled(4, 4, &white(1));
        for row in picture.chunks(4) {
            assert_eq!(row, [[3.0; 3], [3.0; 3], [4.0; 3], [4.0; 3]]);
        }
    }

    #[test]
    fn no_cells_no_picture() {
        assert!(film(4, 4, &[1.0]).resampled(0, 5, &white(1)).is_empty());
    }
}
