//! Light weights, which convert the film's integer sums to radiance.

use crate::film::tile::Tile;

/// Weight of each light group in a picture: colour times intensity. The film's sums are for weights
/// of 1.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LightWeights {
    /// Red, green and blue weight of each light group, at least 0.
    pub weights: Vec<[f64; 3]>,
}

impl LightWeights {
    /// Returns the factors, `[group][channel]`, that convert integer sums to sums of radiance under
    /// these weights. `scales` are the scales of the film's light groups.
    pub fn radiance_per_step(&self, scales: &[f64]) -> Vec<f64> {
        assert_eq!(self.weights.len(), scales.len(), "weights for the groups of the film");
        self.weights.iter().zip(scales).flat_map(|(w, scale)| w.map(|w| w / scale)).collect()
    }
}

/// Replicates over which a mean is computed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Replicates {
    /// Both: their mean is the picture.
    Both,
    A,
    B,
}

/// Integer sums and sample counts of one pixel of a film.
#[derive(Clone, Copy)]
pub struct Sums<'a> {
    /// Integer sums of the replicates A and B, each `[group][channel]`.
    pub values: [&'a [i64]; 2],
    /// Number of samples in each of the replicates A and B.
    pub counts: [u32; 2],
}

impl Sums<'_> {
    /// Returns the number of samples in `replicates`.
    pub fn count(&self, replicates: Replicates) -> u32 {
        match replicates {
            Replicates::Both => self.counts[0].saturating_add(self.counts[1]),
            Replicates::A => self.counts[0],
            Replicates::B => self.counts[1],
        }
    }

    /// Returns integer sum `i` over `replicates`. The order is `[group][channel]`.
    #[inline(always)]
    pub fn value(&self, replicates: Replicates, i: usize) -> f64 {
        match replicates {
            Replicates::Both => self.values[0][i] as f64 + self.values[1][i] as f64,
            Replicates::A => self.values[0][i] as f64,
            Replicates::B => self.values[1][i] as f64,
        }
    }

    /// Returns the mean radiance of the samples in `replicates`; black without samples. `per_unit`
    /// is the result of [`LightWeights::radiance_per_step`].
    #[inline(always)]
    pub fn mean(&self, replicates: Replicates, per_unit: &[f64]) -> [f64; 3] {
        let count = self.count(replicates);
        if count == 0 {
            return [0.0; 3];
        }
        let mut sum = [0.0; 3];
        for (group, factors) in per_unit.chunks_exact(3).enumerate() {
            for c in 0..3 {
                sum[c] += self.value(replicates, 3 * group + c) * factors[c];
            }
        }
        sum.map(|s| s / f64::from(count))
    }
}

impl Tile {
    #[inline(always)]
    pub(crate) fn sums(&self, pixel: usize) -> Sums<'_> {
        let values = [self.pixel(0, pixel), self.pixel(1, pixel)];
        Sums { values, counts: self.counts_of(pixel) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::testing::{TestFilm, each_tile, fill, film, only, white};

    #[test]
    fn pixel_is_the_weighted_mean_of_both_replicates() {
        let mut film = film(20, 18, &[2f64.powi(20), 2f64.powi(-3)]);
        fill(&mut film, 4, |x, y, r| {
            let (x, y, r) = (x as f64, y as f64, r as f64);
            vec![x, y, 1.0 + r, 64.0 * x, 128.0, 64.0 * r]
        });
        let mix = LightWeights { weights: vec![[1.0, 2.0, 3.0], [0.5, 0.0, 1.0]] };
        // Each replicate has 4 samples. In red and green, A and B have equal sums. In blue, the
        // sums of the first group are 1 and 2, those of the second 0 and 64.
        let expected = |x: f64, y: f64| [x / 4.0 + 8.0 * x, 2.0 * y / 4.0, 9.0 / 8.0 + 8.0];
        for (x, y) in [(0, 0), (19, 17), (16, 15), (3, 16)] {
            assert_eq!(film.pixel(x, y, &mix), expected(x as f64, y as f64), "{x} {y}");
        }
        let row = film.row(17, Replicates::Both, &mix);
        assert_eq!(row.len(), 20);
        assert_eq!(row[19], expected(19.0, 17.0));
        let row = film.row(17, Replicates::B, &only(0, 2));
        assert_eq!(row[5], [5.0 / 4.0, 17.0 / 4.0, 0.5]);
    }

    #[test]
    fn replicates_are_weighted_by_their_counts() {
        let mut film = film(1, 1, &[1.0]);
        each_tile(&mut film, |tile, _| {
            tile.add(0, 0, &[30, 30, 30]);
            tile.advance(0, 3);
            tile.add(1, 0, &[6, 0, 2]);
            tile.advance(1, 1);
        });
        assert_eq!(film.pixel(0, 0, &white(1)), [9.0, 7.5, 8.0]);
    }

    #[test]
    fn film_without_samples_is_black() {
        let mut film = film(3, 3, &[1.0]);
        assert_eq!(film.pixel(2, 2, &white(1)), [0.0; 3]);
        fill(&mut film, 1, |_, _, _| vec![1.0; 3]);
        assert_eq!(film.pixel(2, 2, &white(1)), [1.0; 3]);
        film.restart();
        assert_eq!(film.pixel(2, 2, &white(1)), [0.0; 3]);
    }
}
