//! End of a render by its stop criteria, and the estimated time until the end.

use crate::film::Noise;
use crate::schedule::tile::{DOUBLINGS, Tile};
use crate::schedule::{Criterion, MAX_SAMPLES, Schedule, StoppedBy};

/// Number of effective pixels (see [`Noise::effective_pixels`]) below which a single noise estimate
/// does not end a render.
///
/// A render that ends with the first estimate below its target ends too early, and reports too
/// small an error, if this estimate is too low by chance. Ratio of true to reported RMSE at the end
/// of simulated renders whose estimates are exact but for chance: 2.2 with 3 effective pixels, 1.49
/// with 6, 1.22 with 12. If the estimates before the latest three doublings of the samples must be
/// below the target as well, the ratio is 1.56, 1.23 and 1.11.
const FEW_PIXELS_TO_STOP: f64 = 64.0;

impl Schedule {
    /// Returns a lower and an upper estimate of the seconds left until the first stop criterion is
    /// reached. `seconds` is the time since the start of the render. Returns `None` if no stop
    /// criterion is set or none can be extrapolated yet.
    pub fn eta_seconds(&self, seconds: f64) -> Option<(f64, f64)> {
        let by_noise = self.target().and_then(|(_, target)| self.seconds_to_error(target, seconds));
        let by_spp = self.settings.stop.spp.filter(|_| self.samples > 0).map(|spp| {
            let total = 2.0 * f64::from(spp.div_ceil(2)) * self.pixels() as f64;
            let seconds_left = (total / self.samples as f64 - 1.0).max(0.0) * seconds;
            (seconds_left, seconds_left)
        });
        let by_time =
            self.settings.stop.seconds.map(|s| ((s - seconds).max(0.0), (s - seconds).max(0.0)));
        [by_noise, by_spp, by_time]
            .into_iter()
            .flatten()
            .reduce(|(low, high), (l, h)| (low.min(l), high.min(h)))
    }

    /// Returns a lower and an upper estimate of the seconds left until the RMSE of the displayed
    /// picture falls to `levels` 8-bit levels, whatever the stop criteria are. `seconds` is the time
    /// since the start of the render. Returns `None` before the first noise estimate.
    pub fn seconds_to_noise(&self, levels: f64, seconds: f64) -> Option<(f64, f64)> {
        let noise = self.noise?;
        if noise.rmse_levels <= levels {
            return Some((0.0, 0.0));
        }
        let target = match self.settings.criterion {
            Criterion::Levels => levels,
            Criterion::Linear => levels * noise.rmse_linear / noise.rmse_levels,
        };
        self.seconds_to_error(target, seconds)
    }

    /// Returns a lower and an upper estimate of the seconds left until the error of the picture
    /// falls to `target`. The error is measured by the criterion of adaptive sampling. `seconds` is
    /// the time since the start of the render. Returns `None` before the first noise estimate.
    fn seconds_to_error(&self, target: f64, seconds: f64) -> Option<(f64, f64)> {
        let (low, high) = self.convergence.rays_needed(target)?;
        let per_ray = seconds / self.rays.max(1) as f64;
        let seconds_until = |rays: f64| (rays - self.rays as f64).max(0.0) * per_ray;
        Some((seconds_until(low), seconds_until(high)))
    }

    /// Returns the estimated share of the render that is done, 0..=1. It is the elapsed time
    /// divided by the expected total time (see [`Schedule::eta_seconds`]). `seconds` is the time
    /// since the start of the render. Returns `None` if the total time cannot be estimated.
    pub fn progress(&self, seconds: f64) -> Option<f64> {
        let (low, high) = self.eta_seconds(seconds)?;
        let seconds_left = 0.5 * (low + high);
        Some(if seconds > 0.0 { seconds / (seconds + seconds_left) } else { 0.0 })
    }

    /// Returns the error target of the render as `(measure of the error, target)`. If there is a
    /// target for each of the two measures, returns the one for the measure that adaptive sampling
    /// minimises. Returns `None` if the render has no error target.
    pub(super) fn target(&self) -> Option<(Criterion, f64)> {
        let levels = self.settings.stop.noise_levels.map(|t| (Criterion::Levels, t));
        let linear = self.settings.stop.rmse_linear.map(|t| (Criterion::Linear, t));
        match self.settings.criterion {
            Criterion::Levels => levels.or(linear),
            Criterion::Linear => linear.or(levels),
        }
    }

    pub(super) fn reason_to_stop(&self, seconds: f64) -> Option<StoppedBy> {
        let stop = &self.settings.stop;
        if let Some(noise) = self.largest_recent_noise().filter(|_| self.min_samples_reached()) {
            if stop.noise_levels.is_some_and(|t| noise.rmse_levels <= t) {
                return Some(StoppedBy::Noise);
            }
            if stop.rmse_linear.is_some_and(|t| noise.rmse_linear <= t) {
                return Some(StoppedBy::Rmse);
            }
            if self.capped_at_target() {
                return Some(StoppedBy::RaysPerPixel);
            }
        }
        // The first samples are always traced, so that a picture has at least one sample of each
        // replicate.
        let started = self.samples > 0;
        stop.seconds.filter(|limit| started && seconds >= *limit).map(|_| StoppedBy::Time)
    }

    /// Returns the estimate of the picture's error on which the end of the render depends. With
    /// many effective pixels it is the latest estimate. With fewer than [`FEW_PIXELS_TO_STOP`] it
    /// is the largest of the latest estimate and of the estimates before each of the latest three
    /// doublings of the sample counts, scaled to the present counts. Estimates on both sides of a
    /// doubling are nearly independent of each other. Returns `None` before the first estimate.
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

    /// Returns `true` if the error target is met except in tiles that have reached their largest
    /// number of samples. This requires that there is at least one such tile, and that the pooled
    /// error of the other tiles meets the target. The largest number
    /// ([`Settings::rays_per_pixel`](crate::schedule::Settings::rays_per_pixel)) is the
    /// same for all tiles that it limits.
    fn capped_at_target(&self) -> bool {
        let Some((criterion, target)) = self.target() else { return false };
        let is_open = |t: &Tile| t.done < self.cap(t);
        self.tiles.iter().any(|t| !is_open(t)) && self.pooled(criterion, is_open) <= target
    }

    /// Returns the reason for the end of a render that has no job left to trace.
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

    /// Returns `true` if every tile has the minimum number of samples, or its cap if that is lower.
    /// Only then may the estimated error of the picture end the render.
    fn min_samples_reached(&self) -> bool {
        let min_samples = self.min_samples();
        self.tiles.iter().all(|t| t.done >= min_samples.min(self.cap(t)))
    }
}
