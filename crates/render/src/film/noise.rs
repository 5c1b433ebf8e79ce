//! Noise estimates: the error of tiles and pictures, estimated from the difference of the two
//! replicates.
//!
//! The replicates A and B are independent, and equally distributed if their sample counts are
//! equal. The half difference d = (A - B) / 2 then has the variance of the picture M = (A + B) / 2.
//! For any sampler, the mean of d^2 is therefore an unbiased estimate of the picture's mean square
//! error in linear light.
//!
//! The displayed error is level(M) - level(truth), where level is the display transform to 8-bit
//! levels. Its square is estimated by the mean of (level(M) - level(M + d))^2 and (level(M) -
//! level(M - d))^2, where M + d is A and M - d is B. Both displace M by d, which is as large as the
//! error of M. A curved or clipped tone curve therefore changes the estimate as much as the error.
//! The hardest case of the tests is a dark pixel with 16 samples in each of A and B, only a few of
//! which receive light. There the true RMSE is 1.13 times the estimate. Two simpler estimates are
//! worse in this test: 1.20 times with half the displayed difference of A and B, 1.52 times with d
//! times the slope of the curve at M.
//!
//! The estimate of a single pixel has one degree of freedom and is meaningless. The estimate of a
//! tile has an uncertainty of about 7 % if its pixels are alike; that of a whole picture is far
//! smaller.
//!
//! Adaptive sampling prefers the tiles with the largest estimates, and neglects tiles whose
//! estimates are low by chance. If the picture's error were estimated from the same numbers, its
//! RMSE would be too low: by 2 % after 32 samples per pixel, by 5 % after 8. Each tile therefore
//! has two estimates, from the black and the white pixels of a checkerboard. The samples of black
//! and white pixels are independent. The black pixels give the *allocation estimate*, which
//! adaptive sampling uses. The white pixels give the *validation estimate*, which is not biased by
//! the choice of tiles. In a small picture, half of the pixels may give a worse estimate than all
//! pixels do. The reported error is therefore the larger of two estimates: that from the white
//! pixels, and that from all pixels. If all tiles have the same number of samples, no tile was
//! preferred, and the estimate from all pixels is reported. The larger of both estimates would be
//! too high in this case, by up to 30 % in pictures whose error is in a few pixels.
//!
//! Pixels that rare bright samples have not hit have no difference between A and B.
//! [`Captures`] estimates their error from the pixels that such samples have hit.
//!
//! The error of a sparse picture (stars, hairlines) is concentrated in few pixels. With k effective
//! pixels (see [`Noise::effective_pixels`]) the relative uncertainty of the estimated RMSE is 1 /
//! sqrt(2 k). The true error of the picture varies by the same ratio between random seeds.

use crate::film::display::{Display, toned};
use crate::film::light_weights::LightWeights;
use crate::film::srgb_table::{SRGB_TABLE, SrgbTable};
use crate::film::tile::Tile;
use crate::film::{Captures, Stratum, TILE, TILE_PIXELS};
use std::collections::BTreeMap;
use zerkalo_scene::Tone;

/// Least radiance, in units of white, of a pixel that shows a lamp.
const LEAST_LAMP: f64 = 1.0;

/// Pair of numbers, one for each of the two measures of error.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ByMeasure {
    /// Number for the error of linear radiance.
    pub linear: f64,
    /// Number for the error of the displayed picture, in 8-bit levels.
    pub levels: f64,
}

impl ByMeasure {
    /// Smallest positive [`TileNoise::squares`], for tests: [`Noise::effective_pixels`] divides by
    /// it, so that the error counts as spread over very many pixels.
    #[cfg(test)]
    pub const SPREAD: Self = Self { linear: f64::MIN_POSITIVE, levels: f64::MIN_POSITIVE };

    fn add(&mut self, weight: f64, other: Self) {
        *self = self.zip(other, |sum, value| sum + weight * value);
    }

    /// Combines the numbers of `self` and `other` by `f`, separately for each measure.
    pub(crate) fn zip(self, other: Self, f: impl Fn(f64, f64) -> f64) -> Self {
        Self { linear: f(self.linear, other.linear), levels: f(self.levels, other.levels) }
    }
}

/// Estimated error of one tile.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TileNoise {
    /// Validation estimate of the mean square error over pixels and channels, from the white pixels
    /// of the checkerboard.
    pub reported: ByMeasure,
    /// Allocation estimate of the same, from the black pixels of the checkerboard.
    pub allocation: ByMeasure,
    /// Sum of e^2 over the pixels, where e is the squared error of a pixel, summed over its
    /// channels.
    pub squares: ByMeasure,
    /// Pixels that rare bright samples have hit, black and white.
    pub captures: [Captures; 2],
    /// Squared error, in 8-bit levels and summed over channels, of a pixel at the edge of a lamp in
    /// which no sample has hit the lamp; the largest of the tile, 0 if there is none.
    pub sliver: f32,
    /// Number of pixels of the tile that are inside the picture.
    pub pixels: u32,
    /// Mean of the numbers of samples per pixel in A and in B.
    pub samples: u32,
}

/// Estimator of tile errors under the given light weights and display transform.
pub struct Estimator {
    /// Result of [`LightWeights::radiance_per_step`].
    per_unit: Vec<f64>,
    exposure: f64,
    tone: Tone,
    curve: &'static SrgbTable,
}

impl Estimator {
    /// Creates an estimator for the tiles of a film with `scales`.
    pub fn new(scales: &[f64], weights: &LightWeights, display: &Display) -> Self {
        Self {
            per_unit: weights.radiance_per_step(scales),
            exposure: display.exposure_factor(),
            tone: display.tone,
            curve: &SRGB_TABLE,
        }
    }

    /// Estimates the error of a tile. Returns `None` if the tile has no samples, or unequal numbers
    /// of samples in A and B.
    pub fn tile(&self, tile: &Tile) -> Option<TileNoise> {
        let [count, count_b] = tile.counts;
        if count == count_b { self.tile_so_far(tile) } else { None }
    }

    /// Estimates the error of a tile, even if replicate B has fewer samples than A. Returns `None`
    /// if A or B has no samples, or during the first pass.
    ///
    /// Let A be the mean of n samples and B that of m, each sample with variance v. (A - B)^2 then
    /// has the mean v (n + m) / nm. The picture (nA + mB) / (n + m) has the variance v / (n + m).
    /// The half difference is therefore replaced by d = (A - B) sqrt(nm) / (n + m). This is exact
    /// for independent samples. With stratified samples, the variance of a mean of n samples may
    /// fall faster than v / n. The estimate is then too high, by at most a quarter if B has at
    /// least half as many samples as A.
    pub fn tile_so_far(&self, tile: &Tile) -> Option<TileNoise> {
        let counts = tile.counts;
        if counts.contains(&0) || tile.lattice_px != 0 {
            return None;
        }
        let [n, m] = counts.map(f64::from);
        let per_sum = [n, m].map(|count| -> Vec<f64> {
            self.per_unit.iter().map(|factor| factor * (1.0 / count)).collect()
        });
        let mut means = [[[0.0; 3]; 2]; TILE_PIXELS];
        let [width, height] = tile.extent;
        let pixels = || (0..height).flat_map(|y| (0..width).map(move |x| [x, y]));
        for [x, y] in pixels() {
            let pixel = y * TILE + x;
            means[pixel] = [0, 1].map(|r| weighted(tile.pixel(r, pixel), &per_sum[r]));
        }
        let (mut halves, mut squares) = ([ByMeasure::default(); 2], ByMeasure::default());
        let (mut captures, mut sliver) = ([Captures::default(); 2], 0.0);
        for [x, y] in pixels() {
            let [a, b] = means[y * TILE + x];
            let (error, contrast) =
                if a == b { Default::default() } else { self.error_of_pixel([a, b], [n, m]) };
            halves[(x + y) % 2].add(1.0, error);
            squares.add(1.0, error.zip(error, |e, _| e * e));
            if let Some((channel, values)) = self.bright_channel(a, b) {
                let dark = neighbours([x, y], tile.extent).map(|pixel| {
                    let [a, b] = means[pixel];
                    a[channel].min(b[channel]) * self.exposure
                });
                captures[(x + y) % 2].record(values, contrast, dark);
                if values[0] >= LEAST_LAMP {
                    let beside = neighbours([x, y], tile.extent).map(|pixel| means[pixel]);
                    sliver = self.sliver([a, b], channel, beside, [n, m]).max(sliver);
                }
            }
        }
        let pixels = width * height;
        let mean_over =
            |sums: ByMeasure, pixels: usize| sums.zip(sums, |sum, _| sum / (3 * pixels) as f64);
        // In a tile with a single pixel, both estimates come from this pixel.
        let black = mean_over(halves[0], pixels.div_ceil(2));
        let white = if pixels > 1 { mean_over(halves[1], pixels / 2) } else { black };
        Some(TileNoise {
            reported: white,
            allocation: black,
            squares,
            captures,
            sliver: sliver as f32,
            pixels: pixels as u32,
            samples: counts[0].midpoint(counts[1]),
        })
    }

    /// Returns the squared error of a pixel whose means in A and B are `a` and `b`, of `n` and `m`
    /// samples, summed over channels; also the squared displayed difference between the picture and
    /// the darker replicate.
    #[inline(always)]
    fn error_of_pixel(&self, [a, b]: [[f64; 3]; 2], [n, m]: [f64; 2]) -> (ByMeasure, f64) {
        let (share_a, spread) = (n / (n + m), (n * m).sqrt() / (n + m));
        let d = [0, 1, 2].map(|c| spread * (a[c] - b[c]));
        let linear = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
        let mean = [0, 1, 2].map(|c| b[c] + share_a * (a[c] - b[c]));
        let (a, b) = if n == m {
            (a, b)
        } else {
            let displaced = |sign: f64| [0, 1, 2].map(|c| (mean[c] + sign * d[c]).max(0.0));
            (displaced(1.0), displaced(-1.0))
        };
        let (mean, a, b) = (self.levels(mean), self.levels(a), self.levels(b));
        let (mut levels, mut contrast) = (0.0, 0.0);
        for c in 0..3 {
            let (to_a, to_b) = (a[c] - mean[c], b[c] - mean[c]);
            levels += 0.5 * (to_a * to_a + to_b * to_b);
            let to_dark = to_a.min(to_b);
            contrast += to_dark * to_dark;
        }
        (ByMeasure { linear, levels }, contrast)
    }

    /// Returns [`TileNoise::sliver`] of the pixels `beside` a pixel that shows a lamp. The means in A
    /// and B of that pixel are `lamp`, of `n` and `m` samples; its brightest channel is `channel`.
    #[inline(never)]
    fn sliver(
        &self,
        lamp: [[f64; 3]; 2],
        channel: usize,
        beside: impl Iterator<Item = [[f64; 3]; 2]>,
        [n, m]: [f64; 2],
    ) -> f64 {
        let samples = n + m;
        let lamp = [0, 1, 2].map(|c| lamp[0][c].min(lamp[1][c]));
        let hit = 0.5 * lamp[channel] / n.max(m);
        let is_missed = |[a, b]: &[[f64; 3]; 2]| a[channel].min(b[channel]) < hit;
        let square = |[a, b]: [[f64; 3]; 2]| -> f64 {
            let dark = [0, 1, 2].map(|c| a[c].min(b[c]));
            let sliver = self.levels([0, 1, 2].map(|c| dark[c] + lamp[c] / samples));
            let dark = self.levels(dark);
            (0..3).map(|c| (sliver[c] - dark[c]).powi(2)).sum()
        };
        beside.filter(is_missed).map(square).fold(0.0, f64::max)
    }

    /// Returns the brightest channel of a pixel whose means in A and B are `a` and `b`, with its
    /// smaller and its larger value in units of white. Returns `None` if the pixel is dark.
    #[inline(always)]
    fn bright_channel(&self, a: [f64; 3], b: [f64; 3]) -> Option<(usize, [f64; 2])> {
        let high = [0, 1, 2].map(|c| a[c].max(b[c]));
        let blue = usize::from(high[2] > high[1]);
        let c = if high[0] >= high[1 + blue] { 0 } else { 1 + blue };
        let values = [a[c].min(b[c]), high[c]].map(|value| value * self.exposure);
        (values[1] >= Captures::DARKEST).then_some((c, values))
    }

    #[inline(always)]
    fn levels(&self, radiance: [f64; 3]) -> [f64; 3] {
        toned(self.tone, radiance.map(|c| c * self.exposure)).map(|c| self.curve.level(c))
    }
}

/// Iterates over the pixels of a tile beside the pixel in column `x` and row `y`.
fn neighbours([x, y]: [usize; 2], [width, height]: [usize; 2]) -> impl Iterator<Item = usize> {
    let pixel = y * TILE + x;
    let beside = [
        (x > 0).then(|| pixel - 1),
        (x + 1 < width).then_some(pixel + 1),
        (y > 0).then(|| pixel - TILE),
        (y + 1 < height).then_some(pixel + TILE),
    ];
    beside.into_iter().flatten()
}

#[inline(always)]
fn weighted(sums: &[i64], per_sum: &[f64]) -> [f64; 3] {
    let mut rgb = [0.0; 3];
    for (sum, factor) in sums.chunks_exact(3).zip(per_sum.chunks_exact(3)) {
        for c in 0..3 {
            rgb[c] += sum[c] as f64 * factor[c];
        }
    }
    rgb
}

impl TileNoise {
    /// Returns the estimate from all pixels, black and white.
    pub fn of_all(&self) -> ByMeasure {
        let [black, white] = [self.pixels.div_ceil(2), self.pixels / 2].map(f64::from);
        self.allocation.zip(self.reported, |black_mse, white_mse| {
            (black * black_mse + white * white_mse) / (black + white).max(1.0)
        })
    }
}

/// Estimated error of a picture: root mean square errors (RMSE) over pixels and channels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Noise {
    /// RMSE in linear radiance, and of the displayed picture in 8-bit levels.
    pub rmse: ByMeasure,
    /// 95th percentile, over the tiles, of the RMSE of a displayed tile, in 8-bit levels.
    pub p95_levels: f64,
    /// Number of effective pixels (Kish's effective sample size): (sum of e)^2 / (sum of e^2),
    /// where e is the squared error of a pixel. `linear` has the number for radiance, `levels` for
    /// the displayed picture; both are 0 without error.
    pub effective_pixels: ByMeasure,
}

impl Noise {
    /// Returns this estimate with each RMSE raised to that of `other` if that is larger.
    pub(crate) fn larger(self, other: Self) -> Self {
        Self { rmse: self.rmse.zip(other.rmse, f64::max), ..self }
    }

    /// Combines the estimates of all tiles. Returns `None` if there are no tiles or an estimate is
    /// missing.
    pub fn of_tiles(tiles: impl IntoIterator<Item = Option<TileNoise>>) -> Option<Self> {
        let mut sums = NoiseSums::default();
        tiles.into_iter().for_each(|tile| sums.add(tile));
        sums.noise()
    }
}

/// Sums of the estimates of tiles.
#[derive(Default)]
pub(crate) struct NoiseSums {
    reported: ByMeasure,
    all: ByMeasure,
    squares: ByMeasure,
    pixels: f64,
    /// Mean square error of each tile, in squared 8-bit levels.
    tile_errors: Vec<f64>,
    /// Least and largest number of samples per pixel.
    samples: Option<[u32; 2]>,
    strata: BTreeMap<u32, Stratum>,
    /// `true` if a tile has no estimate.
    incomplete: bool,
}

impl NoiseSums {
    pub fn add(&mut self, tile: Option<TileNoise>) {
        let Some(tile) = tile else {
            self.incomplete = true;
            return;
        };
        let weight = f64::from(tile.pixels);
        self.reported.add(weight, tile.reported);
        self.all.add(weight, tile.of_all());
        self.squares.add(1.0, tile.squares);
        self.pixels += weight;
        self.tile_errors.push(tile.of_all().levels);
        let [least, most] = self.samples.unwrap_or([tile.samples; 2]);
        self.samples = Some([least.min(tile.samples), most.max(tile.samples)]);
        self.strata.entry(tile.samples.ilog2()).or_default().add(&tile);
    }

    /// Returns the estimate of the picture; `None` if there are no tiles or an estimate is missing.
    pub fn noise(mut self) -> Option<Noise> {
        let [least, most] = self.samples.filter(|_| !self.incomplete)?;
        // Smallest value that at least 95 % of the tiles do not exceed.
        let rank = (self.tile_errors.len() * 19).div_ceil(20).checked_sub(1)?;
        let (_, p95, _) = self.tile_errors.select_nth_unstable_by(rank, f64::total_cmp);
        let p95_levels = p95.sqrt();
        // `sum` adds means over three channels; `squares` adds squares of sums over channels.
        let effective_pixels = self.all.zip(self.squares, |sum, squares| {
            let sum = 3.0 * sum;
            if squares > 0.0 { sum * sum / squares } else { 0.0 }
        });
        for stratum in self.strata.values() {
            self.reported.levels += stratum.pixels * stratum.missing_of_half(1);
            self.all.levels += stratum.pixels * stratum.missing();
        }
        let rmse = self.reported.zip(self.all, |white, all| {
            let sum = if least == most { all } else { white.max(all) };
            (sum / self.pixels).sqrt()
        });
        Some(Noise { rmse, p95_levels, effective_pixels })
    }
}
