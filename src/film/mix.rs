//! From sums to radiance: the colour and strength of each light are put in here.

use super::TILE;
use super::storage::Film;
use super::tile::Tile;

/// Colour times intensity of the lights whose unit-light sums the film holds.
#[derive(Clone, Debug, PartialEq)]
pub struct Mix {
    /// For each light group: red, green, blue, at least 0.
    pub weights: Vec<[f64; 3]>,
}

impl Mix {
    /// One group of a film of `groups` groups, in unit light.
    pub fn only(group: usize, groups: usize) -> Self {
        Self { weights: (0..groups).map(|g| [f64::from(u8::from(g == group)); 3]).collect() }
    }

    /// The factors that turn sums into radiance times count.
    pub(super) fn per_unit(&self, scales: &[f64]) -> Vec<f64> {
        assert_eq!(self.weights.len(), scales.len(), "weights for the groups of the film");
        self.weights.iter().zip(scales).flat_map(|(w, scale)| w.map(|w| w / scale)).collect()
    }
}

/// Which samples are looked at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// All of them: the picture.
    Both,
    /// Replicate A.
    A,
    /// Replicate B.
    B,
}

/// The sums and counts of one pixel.
#[derive(Clone, Copy)]
pub(super) struct Sums<'a> {
    /// `[group][channel]`, replicates A and B.
    pub values: [&'a [i64]; 2],
    /// Samples of A and B.
    pub counts: [u32; 2],
}

impl Sums<'_> {
    /// Samples that count in `part`.
    pub fn count(&self, part: Part) -> u32 {
        match part {
            Part::Both => self.counts[0].saturating_add(self.counts[1]),
            Part::A => self.counts[0],
            Part::B => self.counts[1],
        }
    }

    /// Sum `i` of `[group][channel]`, as far as it counts in `part`.
    #[inline(always)]
    pub fn value(&self, part: Part, i: usize) -> f64 {
        match part {
            Part::Both => self.values[0][i] as f64 + self.values[1][i] as f64,
            Part::A => self.values[0][i] as f64,
            Part::B => self.values[1][i] as f64,
        }
    }

    /// Radiance, or black without samples; `per_unit` from [`Mix::per_unit`].
    pub fn mean(&self, part: Part, per_unit: &[f64]) -> [f64; 3] {
        let count = self.count(part);
        if count == 0 {
            return [0.0; 3];
        }
        let mut sum = [0.0; 3];
        for (i, factor) in per_unit.iter().enumerate() {
            sum[i % 3] += self.value(part, i) * factor;
        }
        sum.map(|s| s / f64::from(count))
    }
}

impl Tile {
    #[inline(always)]
    pub(super) fn sums(&self, pixel: usize) -> Sums<'_> {
        let values = [self.pixel(0, pixel), self.pixel(1, pixel)];
        Sums { values, counts: self.counts_of(pixel) }
    }
}

impl Film {
    /// Radiance of the pixel in column `x`, row `y`: the mean over all its samples of both
    /// replicates; black without samples.
    pub fn pixel(&self, x: usize, y: usize, mix: &Mix) -> [f64; 3] {
        assert!(x < self.width() && y < self.height(), "pixel ({x}, {y}) of the film");
        let index = y / TILE * self.tile_columns() + x / TILE;
        let pixel = y % TILE * TILE + x % TILE;
        let per_unit = mix.per_unit(self.scales());
        self.tile(index).map_or([0.0; 3], |tile| tile.sums(pixel).mean(Part::Both, &per_unit))
    }

    /// Row `y` of the picture, radiance; `row` is resized to the film's width.
    pub fn row(&self, y: usize, part: Part, mix: &Mix, row: &mut Vec<[f64; 3]>) {
        row.clear();
        row.resize(self.width(), [0.0; 3]);
        let per_unit = mix.per_unit(self.scales());
        self.visit_row(y, |x, sums| row[x] = sums.mean(part, &per_unit));
    }

    /// Calls `f` with the column and the sums of each pixel of row `y` in touched tiles.
    pub(super) fn visit_row(&self, y: usize, mut f: impl FnMut(usize, Sums)) {
        let columns = self.tile_columns();
        for column in 0..columns {
            let Some(tile) = self.tile(y / TILE * columns + column) else { continue };
            for x in 0..tile.extent()[0] {
                f(column * TILE + x, tile.sums(y % TILE * TILE + x));
            }
        }
    }
}
