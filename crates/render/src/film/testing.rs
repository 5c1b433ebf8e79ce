//! Helpers for the tests of all crates: films with known contents, films as bytes, random numbers.

use crate::film::file::FilmFileHeader;
use crate::film::{Display, Film, Header, LightWeights, Replicates, TILE, Tile};
use zerkalo_world::Precision;

/// Returns an empty film of `width` x `height` pixels with a light group for each of `scales`.
pub fn film(width: usize, height: usize, scales: &[f64]) -> Film {
    let scales = scales.to_vec();
    Film::new(Header { width, height, scales, seed: 1, precision: Precision::Single })
}

/// Returns light weights of 1 for each of `groups` groups.
pub fn white(groups: usize) -> LightWeights {
    LightWeights { weights: vec![[1.0; 3]; groups] }
}

/// Returns a header of the file of `film`, with light weights of 1 and without metadata.
pub fn header(film: &Film) -> FilmFileHeader {
    FilmFileHeader {
        film: film.header.clone(),
        weights: white(film.groups()),
        group_names: vec![String::new(); film.groups()],
        display: Display::default(),
        metadata: Vec::new(),
        chunks: Default::default(),
    }
}

/// Returns light weights of 1 for the group `group` and 0 for the others of `groups`.
pub fn only(group: usize, groups: usize) -> LightWeights {
    LightWeights { weights: (0..groups).map(|g| [f64::from(u8::from(g == group)); 3]).collect() }
}

/// Calls `f` with every tile, and with the column and row of its upper left pixel.
pub fn each_tile(film: &mut Film, mut f: impl FnMut(&mut Tile, [usize; 2])) {
    let all: Vec<_> = (0..film.tile_count()).collect();
    for slot in film.slots(&all) {
        let origin = slot.origin;
        f(slot.prepare(), origin);
    }
}

/// Adds `count` samples per pixel to both replicates. `sums(x, y, replicate)` returns the sums of a
/// pixel's samples in radiance, `[group][channel]`. Each sum is multiplied by the scale of its
/// group and rounded.
pub fn fill(film: &mut Film, count: u32, mut sums: impl FnMut(usize, usize, usize) -> Vec<f64>) {
    let scales = film.header.scales.to_vec();
    each_tile(film, |tile, [x0, y0]| {
        let [width, height] = tile.extent;
        for replicate in 0..2 {
            for pixel in (0..height).flat_map(|y| (0..width).map(move |x| y * TILE + x)) {
                let sums = sums(x0 + pixel % TILE, y0 + pixel / TILE, replicate);
                let fixed: Vec<_> = sums
                    .iter()
                    .enumerate()
                    .map(|(i, sum)| (sum * scales[i / 3]).round() as i64)
                    .collect();
                tile.add(replicate, pixel, &fixed);
            }
            tile.advance(replicate, count);
        }
    });
}

/// Film whose contents a test examines.
pub trait TestFilm {
    /// Returns the radiance of the pixel in column `x` and row `y`: the mean over its samples in
    /// both replicates, or black without samples.
    fn pixel(&self, x: usize, y: usize, weights: &LightWeights) -> [f64; 3];

    /// Returns the radiance of each pixel of the row `y`, as [`Self::pixel`] does.
    fn pixels_of_row(&self, y: usize, weights: &LightWeights) -> Vec<[f64; 3]>;

    /// Adds the samples of another film or band of a film, which hold another range of sample
    /// indices. Fails if the headers differ.
    fn add(&mut self, other: &Film) -> Result<(), String>;

    /// Returns the film as bytes. Films with equal samples have equal bytes, in whatever order the
    /// samples were added.
    ///
    /// All numbers are little-endian. The parts are, in this order:
    ///
    /// - Header: width, height and number of light groups (u32 each), a scale for each group (f64), the
    ///   seed (u64), and the name of the floating-point precision as length in bytes (u32) and text.
    /// - Number of invalid samples (u64).
    /// - Tiles, row by row: sample counts of A and B (u32 each), and [`Tile::lattice_px`] (u8). If
    ///   the tile has samples, the sums of the pixels inside the picture follow,
    ///   `[replicate][row][column][group][channel]` (i64).
    /// - Number of samples above the largest value that the film can store (u64). It is omitted if it
    ///   is 0.
    fn bytes(&self) -> Vec<u8>;
}

impl TestFilm for Film {
    fn pixel(&self, x: usize, y: usize, weights: &LightWeights) -> [f64; 3] {
        self.pixels_of_row(y, weights)[x]
    }

    fn pixels_of_row(&self, y: usize, weights: &LightWeights) -> Vec<[f64; 3]> {
        self.row(y, Replicates::Both, weights)
    }

    fn add(&mut self, other: &Film) -> Result<(), String> {
        // A band is as wide as its picture.
        let is_band = other.first_row + other.header.height < self.header.height;
        let height =
            if is_band || other.first_row > 0 { self.header.height } else { other.header.height };
        self.check_header(&Header { height, ..other.header.clone() })?;
        let first = other.first_row / TILE * other.tile_columns();
        for (index, theirs) in other.touched() {
            self.slots(&[first + index]).remove(0).prepare().add_tile(theirs);
        }
        Ok(())
    }

    fn bytes(&self) -> Vec<u8> {
        let mut out = Vec::new();
        let header = &self.header;
        for n in [header.width, header.height, header.scales.len()] {
            out.extend(u32_bytes(n));
        }
        header.scales.iter().for_each(|scale| out.extend(scale.to_le_bytes()));
        out.extend(header.seed.to_le_bytes());
        out.extend(u32_bytes(header.precision.name().len()));
        out.extend(header.precision.name().as_bytes());
        out.extend(self.bad_samples().to_le_bytes());
        (0..self.tile_count()).for_each(|index| add_tile(self.tile(index), &mut out));
        match self.saturated_samples() {
            0 => {}
            count => out.extend(count.to_le_bytes()),
        }
        out
    }
}

fn u32_bytes(n: usize) -> [u8; 4] {
    u32::try_from(n).expect("a size below 2^32").to_le_bytes()
}

fn add_tile(tile: Option<&Tile>, out: &mut Vec<u8>) {
    let Some(tile) = tile.filter(|tile| tile.any_sampled()) else {
        return out.extend([0; 9]);
    };
    tile.counts.iter().for_each(|count| out.extend(count.to_le_bytes()));
    out.push(tile.lattice_px as u8);
    let [width, height] = tile.extent;
    for replicate in 0..2 {
        for pixel in (0..height).flat_map(|y| (0..width).map(move |x| y * TILE + x)) {
            tile.pixel(replicate, pixel).iter().for_each(|sum| out.extend(sum.to_le_bytes()));
        }
    }
}

/// Random number generator for tests (SplitMix64). The field is its state.
pub struct Rng(pub u64);

impl Rng {
    /// Returns the next 64 random bits.
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Returns a number from the uniform distribution on [0, 1).
    pub fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Returns a number from the normal distribution with mean 0 and variance 1.
    pub fn normal(&mut self) -> f64 {
        let radius = (-2.0 * (1.0 - self.unit()).ln()).sqrt();
        radius * (std::f64::consts::TAU * self.unit()).cos()
    }
}
