//! The film at another resolution, for displays: box averages of whatever samples exist.

use super::mix::{Mix, Part};
use super::storage::Film;

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
    /// Radiance, `[row][column]`.
    pub fn mixed(&self, mix: &Mix) -> Vec<[f32; 3]> {
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
struct Cover {
    /// First pixel.
    first: usize,
    /// Covered part of each pixel, from `first` on; 0..=1.
    parts: Vec<f64>,
}

/// Divides `pixels` into `cells` of equal width.
fn covers(pixels: usize, cells: usize) -> Vec<Cover> {
    let edge = |cell: usize| cell as f64 * pixels as f64 / cells as f64;
    let cover = |cell: usize| {
        let (from, to) = (edge(cell), edge(cell + 1));
        let first = (from as usize).min(pixels - 1);
        let last = (to.ceil() as usize).clamp(first + 1, pixels);
        let part = |p: usize| (to.min((p + 1) as f64) - from.max(p as f64)).max(0.0);
        Cover { first, parts: (first..last).map(part).collect() }
    };
    (0..cells).map(cover).collect()
}

impl Film {
    /// The picture averaged over `cols` x `rows` cells, `[row][column]`, radiance; see
    /// [`Film::thumbnail`].
    pub fn resampled(&self, cols: usize, rows: usize, mix: &Mix) -> Vec<[f32; 3]> {
        self.thumbnail(cols, rows).mixed(mix)
    }

    /// The film averaged over `cols` x `rows` cells that together cover it: in each cell the mean of
    /// its sampled pixels, weighted by the area that the cell covers of them. A cell without samples
    /// looks like the nearest one of its row that has some, a row without samples like the nearest
    /// row; a film without samples is black.
    pub fn thumbnail(&self, cols: usize, rows: usize) -> Thumbnail {
        let stride = 3 * self.groups();
        let mut means = vec![0.0f32; cols * rows * stride];
        let mut known = vec![false; cols * rows];
        if cols > 0 && rows > 0 {
            self.average(
                &covers(self.width(), cols),
                &covers(self.height(), rows),
                &mut means,
                &mut known,
            );
            spread(&mut means, &mut known, cols, rows, stride);
        }
        Thumbnail { cols, rows, means, groups: self.groups() }
    }

    fn average(&self, xs: &[Cover], ys: &[Cover], means: &mut [f32], known: &mut [bool]) {
        let stride = 3 * self.groups();
        let inverse: Vec<f64> = self.scales().iter().flat_map(|s| [1.0 / s; 3]).collect();
        // One row of pixels: means, and 1 for pixels with samples. Reused while cells share it.
        let mut line = vec![0.0; self.width() * stride];
        let mut has = vec![0.0; self.width()];
        let mut loaded = usize::MAX;
        let mut sums = vec![0.0; xs.len() * stride];
        let mut areas = vec![0.0; xs.len()];
        for (row, cover) in ys.iter().enumerate() {
            sums.fill(0.0);
            areas.fill(0.0);
            for (y, height) in (cover.first..).zip(&cover.parts) {
                if loaded != y {
                    self.load_row(y, &inverse, &mut line, &mut has);
                    loaded = y;
                }
                for (col, cover) in xs.iter().enumerate() {
                    let sum = &mut sums[col * stride..][..stride];
                    for (x, width) in (cover.first..).zip(&cover.parts) {
                        let area = width * height * has[x];
                        areas[col] += area;
                        for (sum, mean) in sum.iter_mut().zip(&line[x * stride..]) {
                            *sum += area * mean;
                        }
                    }
                }
            }
            for col in 0..xs.len() {
                let cell = row * xs.len() + col;
                known[cell] = areas[col] > 0.0;
                if known[cell] {
                    for i in 0..stride {
                        means[cell * stride + i] = (sums[col * stride + i] / areas[col]) as f32;
                    }
                }
            }
        }
    }

    fn load_row(&self, y: usize, inverse: &[f64], line: &mut [f64], has: &mut [f64]) {
        line.fill(0.0);
        has.fill(0.0);
        let stride = inverse.len();
        self.visit_row(y, |x, sums| {
            let count = sums.count(Part::Both);
            if count > 0 {
                has[x] = 1.0;
                let per_sample = 1.0 / f64::from(count);
                for (i, mean) in line[x * stride..][..stride].iter_mut().enumerate() {
                    *mean = sums.value(Part::Both, i) * inverse[i] * per_sample;
                }
            }
        });
    }
}

/// Gives cells without samples the means of the nearest known cell of their row, then rows without
/// any the means of the nearest row.
fn spread(means: &mut [f32], known: &mut [bool], cols: usize, rows: usize, stride: usize) {
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
fn nearest(known: &[bool]) -> Vec<usize> {
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
