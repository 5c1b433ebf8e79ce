//! Windows of the film, and their pixels as displayed.

use crate::film::TILE;
use crate::film::display::Display;
use crate::film::downsample::IncrementalDownsample;
use crate::film::light_weights::{LightWeights, Replicates};
use crate::film::store::Film;
use rayon::prelude::*;

/// Rectangle of film pixels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Window {
    /// Column and row of the upper left pixel.
    pub origin: [usize; 2],
    /// Width and height in pixels.
    pub size: [usize; 2],
}

impl Window {
    /// Returns the window of the whole film.
    pub fn whole(size: [usize; 2]) -> Self {
        Self { origin: [0; 2], size }
    }

    /// Returns the part inside a film of `size` pixels, at least one pixel.
    pub fn clipped(self, size: [usize; 2]) -> Self {
        let origin = [0, 1].map(|i| self.origin[i].min(size[i].saturating_sub(1)));
        Self { origin, size: [0, 1].map(|i| self.size[i].clamp(1, (size[i] - origin[i]).max(1))) }
    }

    /// Returns the film pixel along `axis` at the centre of cell `at` of `cells` across the window.
    pub fn pixel(&self, axis: usize, at: usize, cells: usize) -> usize {
        self.origin[axis] + (2 * at + 1) * self.size[axis] / (2 * cells)
    }

    /// Returns `true` if the window has the pixel (column, row).
    pub fn contains(&self, pixel: [usize; 2]) -> bool {
        (0..2).all(|i| pixel[i].wrapping_sub(self.origin[i]) < self.size[i])
    }
}

/// Pixels of a window of the film, as displayed.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Detail {
    pub window: Window,
    /// Columns and rows of `pixels`, at most those of the window.
    pub size: [usize; 2],
    /// Pixels in 8-bit sRGB, row by row: those of an exported image, or means of linear light if
    /// there are fewer.
    pub pixels: Vec<[u8; 3]>,
    pub display: Display,
    pub weights: LightWeights,
    /// Mean number of samples per pixel of the film.
    pub spp: f64,
    /// Generation of the scene in its session.
    pub generation: u64,
}

impl Detail {
    /// Returns `true` if every pixel of `film` has a sample.
    pub fn is_possible(film: &Film) -> bool {
        let tiles = (0..film.tile_count()).map(|index| film.tile(index));
        tiles.into_iter().all(|tile| tile.is_some_and(|t| t.counts != [0; 2] || t.lattice_px == 1))
    }

    /// Displays `window` of `film`, whose pixels must all have samples, in `size` (columns, rows).
    pub fn of_film(
        film: &Film,
        (weights, display): (&LightWeights, &Display),
        window: Window,
        size: [usize; 2],
        pool: &rayon::ThreadPool,
    ) -> Self {
        let window = window.clipped([film.header.width, film.header.height]);
        let size = [0, 1].map(|i| size[i].clamp(1, window.size[i]));
        let per_unit = weights.radiance_per_step(&film.header.scales);
        let ([x0, y0], [width, height]) = (window.origin, window.size);
        let radiance = |i: usize| {
            let (x, y) = (x0 + i % width, y0 + i / width);
            let tile = film.tile(y / TILE * film.tile_columns() + x / TILE);
            tile.map_or([0.0; 3], |tile| {
                tile.sums(y % TILE * TILE + x % TILE).mean(Replicates::Both, &per_unit)
            })
        };
        let to_8 = display.to_8();
        let pixels = if size == window.size {
            let all = (0..width * height).into_par_iter().with_min_len(512);
            pool.install(|| all.map(|i| to_8(radiance(i))).collect())
        } else {
            let mut downsample = IncrementalDownsample::new(film, window, size[0], size[1]);
            downsample.update(film, Some(pool));
            let means = downsample.thumbnail().mixed(weights);
            means.into_iter().map(|mean| to_8(mean.map(f64::from))).collect()
        };
        let weights = weights.clone();
        Self { window, size, pixels, display: *display, weights, spp: 0.0, generation: 0 }
    }
}
