//! End of a render by its stop criteria, and the estimated time until the end.

use crate::film::Noise;
use crate::schedule::tile::{DOUBLINGS, Tile};
use crate::schedule::{Criterion, Interval, MAX_SAMPLES, Schedule, StoppedBy};

/// Number of effective pixels below which one noise estimate is not enough to end a render.
///
/// An estimate that is too low by chance would end a render too early. The ratio of true to
/// reported RMSE at the end of simulated renders is 2.2 with 3 effective pixels, 1.49 with 6, and
/// 1.22 with 12. If the estimates before the latest three doublings must meet the target as well,
/// the ratios are 1.56, 1.23 and 1.11.
const FEW_PIXELS_TO_STOP: f64 = 64.0;
/// Largest error of a picture, as a share of the target, that is due to one pixel at the edge of a
/// lamp in which no sample has hit the lamp.
const SLIVER_ERROR: f64 = 0.25;
/// Samples per pixel and replicate up to which a render waits for a sample that hits the lamp. Only one
/// in 2048 pixels at an edge has a smaller share of the lamp. A lamp a million times as bright as white
/// would otherwise need millions of samples.
const SLIVER_SAMPLES: u32 = 1024;

impl Schedule {
    /// Estimates the seconds left until the first stop criterion is reached, after `seconds` seconds
    /// of rendering. Returns `None` if no criterion can be extrapolated.
    pub fn eta_seconds(&self, seconds: f64) -> Option<Interval> {
        let by_noise = self.target().and_then(|(_, target)| self.seconds_to_error(target, seconds));
        let by_spp = self.settings.stop.spp.filter(|_| self.samples > 0).map(|spp| {
            let total = 2.0 * f64::from(spp.div_ceil(2)) * self.pixels() as f64;
            Interval::exact((total / self.samples as f64 - 1.0).max(0.0) * seconds)
        });
        let by_time =
            self.settings.stop.seconds.map(|end| Interval::exact((end - seconds).max(0.0)));
        let first =
            |a: Interval, b: Interval| Interval { low: a.low.min(b.low), high: a.high.min(b.high) };
        [by_noise, by_spp, by_time].into_iter().flatten().reduce(first)
    }

    /// Estimates the seconds left until the displayed RMSE falls to `levels` 8-bit levels, whatever
    /// the stop criteria are. Returns `None` before the first estimate of the noise.
    pub fn seconds_to_noise(&self, levels: f64, seconds: f64) -> Option<Interval> {
        let noise = self.noise?;
        if noise.rmse.levels <= levels {
            return Some(Interval::exact(0.0));
        }
        let target = match self.settings.criterion {
            Criterion::Levels => levels,
            Criterion::Linear => levels * noise.rmse.linear / noise.rmse.levels,
        };
        self.seconds_to_error(target, seconds)
    }

    /// Estimates the seconds left until the error falls to `target`, in the unit of the criterion.
    /// Returns `None` before the first estimate of the error.
    fn seconds_to_error(&self, target: f64, seconds: f64) -> Option<Interval> {
        let needed = self.convergence.rays_needed(target)?;
        let per_ray = seconds / self.rays.max(1) as f64;
        Some(needed.map(|rays| (rays - self.rays as f64).max(0.0) * per_ray))
    }

    /// Returns the share of the render that is done, 0..=1: elapsed time over expected total time.
    /// Returns `None` if the total cannot be estimated.
    pub fn progress(&self, seconds: f64) -> Option<f64> {
        let seconds_left = self.eta_seconds(seconds)?.mean();
        Some(if seconds > 0.0 { seconds / (seconds + seconds_left) } else { 0.0 })
    }

    /// Returns the error target with its measure. If both measures have targets, returns the one
    /// that adaptive sampling minimises.
    pub(super) fn target(&self) -> Option<(Criterion, f64)> {
        let stop = &self.settings.stop;
        let levels = stop.noise_levels.or_else(|| stop.error.map(|e| self.noise_target(e)));
        let levels = levels.map(|t| (Criterion::Levels, t));
        let linear = self.settings.stop.rmse_linear.map(|t| (Criterion::Linear, t));
        match self.settings.criterion {
            Criterion::Levels => levels.or(linear),
            Criterion::Linear => linear.or(levels),
        }
    }

    /// Returns the criterion of error, cap or time that ends the render; `None` if it continues.
    pub(super) fn reason_to_stop(&self, seconds: f64) -> Option<StoppedBy> {
        let stop = &self.settings.stop;
        if let Some(noise) = self.largest_recent_noise().filter(|_| self.has_enough_samples()) {
            let is_whole = !self.tiles.iter().any(|tile| tile.rests);
            if is_whole && stop.noise_levels.is_some_and(|t| noise.rmse.levels <= t) {
                return Some(StoppedBy::Noise);
            }
            if is_whole && stop.rmse_linear.is_some_and(|t| noise.rmse.linear <= t) {
                return Some(StoppedBy::Rmse);
            }
            let is_met = |error| noise.rmse.levels <= self.noise_target(error);
            if is_whole && self.is_probed() && stop.error.is_some_and(is_met) {
                return Some(StoppedBy::Error);
            }
            if self.capped_at_target() {
                return Some(StoppedBy::RaysPerPixel);
            }
        }
        // A picture has at least one sample of each replicate.
        let started = self.samples > 0;
        stop.seconds.filter(|limit| started && seconds >= *limit).map(|_| StoppedBy::Time)
    }

    /// Returns the noise estimate on which the end of the render depends: the latest one. With
    /// fewer effective pixels than [`FEW_PIXELS_TO_STOP`], its RMSE is raised to the largest RMSE
    /// before each of the latest three doublings, scaled to the present counts. Estimates before
    /// and after a doubling are nearly independent. Returns `None` before the first estimate.
    pub(super) fn largest_recent_noise(&self) -> Option<Noise> {
        let latest = self.noise?;
        if self.settings.criterion.of(latest.effective_pixels) >= FEW_PIXELS_TO_STOP {
            return Some(latest);
        }
        let earlier = |doublings: u32| {
            let tiles = self.tiles.iter();
            Noise::of_tiles(tiles.map(|tile| tile.earlier_estimate(doublings as usize)))
        };
        Some((0..=DOUBLINGS).filter_map(earlier).fold(latest, Noise::larger))
    }

    /// Returns `true` if there are tiles at their cap, and the pooled error of the other tiles
    /// meets the target.
    fn capped_at_target(&self) -> bool {
        let Some((criterion, target)) = self.target() else { return false };
        let is_open = |t: &Tile| t.done < self.cap(t);
        self.tiles.iter().any(|t| !is_open(t)) && self.pooled(criterion, is_open) <= target
    }

    /// Returns the reason for the end of a render that has no job left.
    pub(super) fn reason_without_work(&self) -> StoppedBy {
        let open = || self.tiles.iter().filter(|t| t.done < self.cap(t));
        if self.tiles.iter().all(|t| t.done == MAX_SAMPLES) {
            StoppedBy::Full
        } else if self.settings.stop.spp.is_some() && open().next().is_some() {
            StoppedBy::Spp
        } else {
            StoppedBy::RaysPerPixel
        }
    }

    /// Returns `true` if every tile has enough samples for the estimated error to end the render.
    fn has_enough_samples(&self) -> bool {
        let min_samples = self.min_samples();
        let has_enough = |tile: &Tile| tile.done >= min_samples.min(self.cap(tile));
        self.tiles.iter().all(has_enough) && self.tiles_with_slivers().next().is_none()
    }

    /// Returns the numbers of the tiles below their cap whose
    /// [`TileNoise::sliver`](crate::film::TileNoise::sliver) is above [`SLIVER_ERROR`]. There are none
    /// with [`SLIVER_SAMPLES`], in uniform pictures, and without an error target in levels.
    pub(super) fn tiles_with_slivers(&self) -> impl Iterator<Item = usize> {
        let is_counted = |criterion| self.settings.adaptive && criterion == Criterion::Levels;
        let target = self.target().filter(|(criterion, _)| is_counted(*criterion));
        let rmse = target.map_or(f64::INFINITY, |(_, target)| SLIVER_ERROR * target);
        let largest = 3.0 * self.pixels() as f64 * rmse * rmse;
        let has_sliver = move |tile: &Tile| {
            tile.error.is_some_and(|error| f64::from(error.sliver) > largest)
                && tile.done < self.cap(tile).min(SLIVER_SAMPLES)
        };
        (0..self.tiles.len()).filter(move |tile| has_sliver(&self.tiles[*tile]))
    }
}
