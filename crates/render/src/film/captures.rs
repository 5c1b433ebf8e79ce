//! Capture-recapture: the displayed error of pixels that rare bright samples have not hit yet.
//!
//! Until the first such sample, both replicates show the pixel dark, and their difference does not
//! contain its error. The later difference makes up for it in linear light, but not in levels, which
//! clip and compress bright values. The replicates are two
//! independent occasions on which such pixels are *captured*. From the numbers of pixels captured
//! once and twice follows the number that neither replicate has captured
//! (`docs/decisions/noise.md`).

use crate::film::TileNoise;
use std::collections::BTreeMap;

/// Least radiance of a captured pixel above its surroundings, by class, in units of white.
const LEAST_EXCESS: [f64; 3] = [1.0 / 16.0, 0.25, 1.0];
/// Share of the excess of the brighter replicate from which the darker one is bright as well, and a
/// neighbour is part of a bright area.
const STEADY: f64 = 0.25;
/// Exponent of the squared level of dark pixels as a function of radiance.
const SQUARED_LEVEL: f32 = 0.9;

/// Pixels that rare samples have made bright, by brightness.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Captures(pub [Class; LEAST_EXCESS.len()]);

/// Captured pixels of similar brightness.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Class {
    /// Number of pixels that are bright in one replicate only.
    pub once: f32,
    /// Number of pixels that are bright in both replicates.
    pub twice: f32,
    /// Sum, over these pixels, of radiance above that of the surroundings, in units of white.
    pub excess: f32,
    /// Sum, over the pixels captured once, of the squared difference in 8-bit levels between the
    /// picture and the darker replicate, summed over channels.
    pub contrast: f32,
}

impl Captures {
    /// Pixels below this value, in units of white, are not captured.
    pub(super) const DARKEST: f64 = LEAST_EXCESS[0];

    pub(super) fn add(&mut self, other: Self) {
        for (sum, class) in self.0.iter_mut().zip(other.0) {
            sum.once += class.once;
            sum.twice += class.twice;
            sum.excess += class.excess;
            sum.contrast += class.contrast;
        }
    }

    /// Records a pixel if it was captured: `low` and `high` are its values in the darker and the
    /// brighter replicate, `neighbours` those of its neighbours in their darker replicates, all in
    /// units of white. `contrast` is as in [`Class::contrast`].
    #[inline]
    pub(super) fn record(
        &mut self,
        [low, high]: [f64; 2],
        contrast: f64,
        neighbours: impl Iterator<Item = f64>,
    ) {
        let bright = low + STEADY * (high - low);
        let (mut dark, mut light) = (low, 0.0f64);
        for neighbour in neighbours {
            // Whatever the other neighbours are, `steady` is not above `bright`.
            if neighbour >= bright {
                return;
            }
            (dark, light) = (dark.min(neighbour), light.max(neighbour));
        }
        let steady = dark + STEADY * (high - dark);
        let Some(class) = LEAST_EXCESS.iter().rposition(|least| high - dark >= *least) else {
            return;
        };
        if light >= steady {
            return;
        }
        let class = &mut self.0[class];
        class.excess += (0.5 * (low + high) - dark) as f32;
        if low >= steady {
            class.twice += 1.0;
        } else {
            class.once += 1.0;
            class.contrast += contrast as f32;
        }
    }

    /// Estimates the squared error, in 8-bit levels and summed over channels, of the pixels that
    /// were not captured, as far as it exceeds the share of the captured pixels in the error that
    /// the difference of the replicates shows.
    fn missing(&self) -> f64 {
        self.0.iter().map(|class| f64::from(class.missing())).sum()
    }
}

impl Class {
    fn missing(&self) -> f32 {
        if self.once == 0.0 {
            return 0.0;
        }
        let missed = self.once * self.once / (4.0 * self.twice + 2.0);
        let captured = self.once + self.twice;
        let shown = |pixels: f32| (self.excess / pixels).min(1.0);
        let dimming = (shown(captured + missed) / shown(captured)).powf(SQUARED_LEVEL);
        (missed / self.once * dimming - 0.5).max(0.0) * self.contrast
    }
}

/// Tiles whose sample counts are in the same octave. Their pixels are captured with similar
/// probabilities.
#[derive(Default)]
pub(crate) struct Stratum {
    /// Captured black and white pixels.
    pub captures: [Captures; 2],
    pub pixels: f64,
}

impl Stratum {
    pub(super) fn add(&mut self, tile: &TileNoise) {
        self.captures.iter_mut().zip(tile.captures).for_each(|(sum, captures)| sum.add(captures));
        self.pixels += f64::from(tile.pixels);
    }

    /// Returns the strata of tiles, by the binary logarithm of their samples per pixel.
    pub fn of_tiles<'a>(tiles: impl Iterator<Item = &'a TileNoise>) -> BTreeMap<u32, Self> {
        let mut strata: BTreeMap<u32, Self> = BTreeMap::new();
        tiles.for_each(|tile| strata.entry(tile.samples.ilog2()).or_default().add(tile));
        strata
    }

    /// Returns the missing mean squared error that the black pixels (0) or the white ones (1) show.
    pub fn missing_of_half(&self, half: usize) -> f64 {
        2.0 * self.captures[half].missing() / (3.0 * self.pixels)
    }

    /// Returns the missing mean squared error that all pixels show.
    pub fn missing(&self) -> f64 {
        let [mut all, white] = self.captures;
        all.add(white);
        all.missing() / (3.0 * self.pixels)
    }
}
