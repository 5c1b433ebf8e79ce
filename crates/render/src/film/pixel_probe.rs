//! Pixel probe: what the dashboard shows of a single pixel.

use crate::film::TILE;
use crate::film::display::Display;
use crate::film::light_weights::{LightWeights, Replicates};
use crate::film::noise::Estimator;
use crate::film::store::Film;

/// Samples, value and error of one pixel under given light weights and display transform.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PixelProbe {
    /// Column and row of the pixel in the film.
    pub pixel: [usize; 2],
    /// Number of samples in the replicates A and B.
    pub samples: [u32; 2],
    /// Linear radiance of the pixel; black without samples.
    pub radiance: [f64; 3],
    /// Displayed value in unrounded 8-bit levels, 0..=255.
    pub levels: [f64; 3],
    /// Half the absolute difference of the replicates' radiance, which estimates the error within a
    /// factor of two or three. `None` if A or B has no samples.
    pub difference: Option<[f64; 3]>,
    /// Estimated RMSE of the pixel's tile, in 8-bit levels. `None` without an estimate.
    pub tile_rmse_levels: Option<f64>,
    /// Share of each light group in the squared error of the pixel's tile in linear radiance; empty
    /// without an estimate or without error.
    pub error_shares: Vec<f64>,
    /// Pixels of the film in the pixel's tile, each with the squared difference of the replicates.
    pub tile_errors: Vec<([usize; 2], f64)>,
}

impl PixelProbe {
    /// Probes the pixel in column `x` and row `y` of `film`; `None` outside the film.
    pub fn of_film(
        film: &Film,
        [x, y]: [usize; 2],
        weights: &LightWeights,
        display: &Display,
    ) -> Option<Self> {
        if x >= film.header.width || y >= film.header.height {
            return None;
        }
        let levels = display.levels([0.0; 3]);
        let mut probe = Self { pixel: [x, y], levels, ..Self::default() };
        let Some(tile) = film.tile(y / TILE * film.tile_columns() + x / TILE) else {
            return Some(probe);
        };
        let per_unit = weights.radiance_per_step(&film.header.scales);
        let sums = tile.sums(y % TILE * TILE + x % TILE);
        probe.samples = sums.counts;
        probe.radiance = sums.mean(Replicates::Both, &per_unit);
        probe.levels = display.levels(probe.radiance);
        if !sums.counts.contains(&0) {
            let [a, b] =
                [Replicates::A, Replicates::B].map(|replicates| sums.mean(replicates, &per_unit));
            probe.difference = Some([0, 1, 2].map(|c| 0.5 * (a[c] - b[c]).abs()));
        }
        let noise = Estimator::new(&film.header.scales, weights, display).tile_so_far(tile);
        probe.tile_rmse_levels = noise.map(|noise| noise.of_all().levels.sqrt());
        let square = |group: usize| {
            let mut alone = LightWeights { weights: vec![[0.0; 3]; weights.weights.len()] };
            alone.weights[group] = weights.weights[group];
            let noise = Estimator::new(&film.header.scales, &alone, display).tile_so_far(tile);
            noise.map_or(0.0, |noise| noise.of_all().linear)
        };
        let squares: Vec<f64> = (0..weights.weights.len()).map(square).collect();
        let sum: f64 = squares.iter().sum();
        if sum > 0.0 {
            probe.error_shares = squares.into_iter().map(|square| square / sum).collect();
        }
        let [left, top] = [x, y].map(|at| at / TILE * TILE);
        let pixels = (0..TILE * TILE).map(|i| [left + i % TILE, top + i / TILE]);
        let errors = pixels.enumerate().filter_map(|(i, [x, y])| {
            let sums = tile.sums(i);
            let is_inside = x < film.header.width && y < film.header.height;
            let [a, b] =
                [Replicates::A, Replicates::B].map(|replicates| sums.mean(replicates, &per_unit));
            let square = (0..3).map(|c| (a[c] - b[c]).powi(2)).sum();
            (is_inside && !sums.counts.contains(&0)).then_some(([x, y], square))
        });
        probe.tile_errors = errors.collect();
        Some(probe)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::testing::{each_tile, fill, film};

    #[test]
    fn probe_reports_samples_value_and_error() {
        let mut film = film(20, 18, &[8.0, 4.0]);
        let mix = LightWeights { weights: vec![[1.0, 2.0, 0.0], [0.0, 0.0, 3.0]] };
        let display = Display { exposure_ev: -3.0, ..Display::default() };
        let probe = |film: &Film, pixel| PixelProbe::of_film(film, pixel, &mix, &display);
        let empty = probe(&film, [19, 17]).unwrap();
        assert_eq!((empty.samples, empty.radiance, empty.difference), ([0; 2], [0.0; 3], None));
        assert_eq!(empty.tile_rmse_levels, None);
        assert_eq!([probe(&film, [20, 0]), probe(&film, [0, 18])], [None, None]);
        fill(&mut film, 2, |x, y, r| {
            let v = if [x, y] == [19, 17] { [2.0, 6.0][r] } else { 2.0 };
            vec![v, v, v, v, v, 4.0]
        });
        let full = probe(&film, [19, 17]).unwrap();
        assert_eq!((full.pixel, full.samples), ([19, 17], [2, 2]));
        assert_eq!(full.radiance, [2.0, 4.0, 6.0]);
        assert_eq!(full.levels, display.levels([2.0, 4.0, 6.0]));
        assert_eq!(full.difference, Some([1.0, 2.0, 0.0]));
        // The corner tile has 4 x 2 pixels. One of them has an error of 1 in red and 2 in green.
        let estimator = Estimator::new(&film.header.scales, &mix, &display);
        let noise = estimator.tile_so_far(film.tile(3).unwrap()).unwrap().of_all();
        assert!((noise.linear - 5.0 / 24.0).abs() < 1e-12, "{noise:?}");
        assert_eq!(full.tile_rmse_levels, Some(noise.levels.sqrt()));
        assert!(noise.levels > 0.0);
        assert_eq!(full.error_shares, [1.0, 0.0], "the second light has no error");
        let errors = full.tile_errors;
        assert!(errors.len() == 8 && errors[7] == ([19, 17], 20.0) && errors[0].1 == 0.0);
        film.restart();
        each_tile(&mut film, |tile, _| tile.set_lattice(8));
        assert_eq!(probe(&film, [16, 16]).unwrap().samples, [1, 0]);
        assert_eq!(probe(&film, [17, 16]).unwrap().samples, [0, 0]);
    }
}
