//! When the work is done, and how long it will take.

use crate::render::schedule::tile::Tile;
use crate::render::schedule::{Criterion, MAX_SAMPLES, Schedule, StoppedBy};

impl Schedule {
    /// A lower and an upper guess of the seconds left until the first of the targets, `seconds` after
    /// the work began.
    pub fn eta_seconds(&self, seconds: f64) -> Option<(f64, f64)> {
        let by_noise = self.target().and_then(|(_, target)| self.seconds_to_error(target, seconds));
        let by_spp = self.settings.stop.spp.filter(|_| self.samples > 0).map(|spp| {
            let total = 2.0 * f64::from(spp.div_ceil(2)) * self.pixels() as f64;
            let left = (total / self.samples as f64 - 1.0).max(0.0) * seconds;
            (left, left)
        });
        let by_time =
            self.settings.stop.seconds.map(|s| ((s - seconds).max(0.0), (s - seconds).max(0.0)));
        [by_noise, by_spp, by_time]
            .into_iter()
            .flatten()
            .reduce(|(low, high), (l, h)| (low.min(l), high.min(h)))
    }

    /// A lower and an upper guess of the seconds left until the noise as displayed has fallen to `codes`,
    /// whatever the targets are, `seconds` after the work began. `None` before an error is known.
    pub fn seconds_to_noise(&self, codes: f64, seconds: f64) -> Option<(f64, f64)> {
        let noise = self.noise?;
        if noise.rmse_codes <= codes {
            return Some((0.0, 0.0));
        }
        let target = match self.settings.criterion {
            Criterion::Codes => codes,
            Criterion::Linear => codes * noise.rmse_linear / noise.rmse_codes,
        };
        self.seconds_to_error(target, seconds)
    }

    /// The same for an error in the unit of the criterion.
    fn seconds_to_error(&self, target: f64, seconds: f64) -> Option<(f64, f64)> {
        let (low, high) = self.trend.rays_needed(target)?;
        let per_ray = seconds / self.rays.max(1) as f64;
        let left = |rays: f64| (rays - self.rays as f64).max(0.0) * per_ray;
        Some((left(low), left(high)))
    }

    /// How far the work is on its way to the nearest target, 0..1: the share of the work, as far as it
    /// can be told.
    pub fn progress(&self, seconds: f64) -> Option<f64> {
        let (low, high) = self.eta_seconds(seconds)?;
        let left = 0.5 * (low + high);
        Some(if seconds > 0.0 { seconds / (seconds + left) } else { 0.0 })
    }

    /// The error that the work aims at: which one, and how large. With both set, that of the
    /// criterion.
    pub(super) fn target(&self) -> Option<(Criterion, f64)> {
        let codes = self.settings.stop.noise_codes.map(|t| (Criterion::Codes, t));
        let linear = self.settings.stop.rmse_linear.map(|t| (Criterion::Linear, t));
        match self.settings.criterion {
            Criterion::Codes => codes.or(linear),
            Criterion::Linear => linear.or(codes),
        }
    }

    pub(super) fn reason_to_stop(&self, seconds: f64) -> Option<StoppedBy> {
        let stop = &self.settings.stop;
        if let Some(noise) = self.noise.filter(|_| self.floors_reached()) {
            if stop.noise_codes.is_some_and(|t| noise.rmse_codes <= t) {
                return Some(StoppedBy::Noise);
            }
            if stop.rmse_linear.is_some_and(|t| noise.rmse_linear <= t) {
                return Some(StoppedBy::Rmse);
            }
            if self.capped_at_target() {
                return Some(StoppedBy::RaysPerPixel);
            }
        }
        // The first samples are always traced: a picture has at least one of each replicate.
        let begun = self.samples > 0;
        stop.seconds.filter(|limit| begun && seconds >= *limit).map(|_| StoppedBy::Time)
    }

    /// Whether the cap on glossy tiles is all that keeps the picture from its target.
    fn capped_at_target(&self) -> bool {
        let Some((criterion, target)) = self.target() else { return false };
        let free = |t: &Tile| t.done < self.cap(t);
        self.tiles.iter().any(|t| !free(t)) && self.pooled(criterion, free) <= target
    }

    /// Why there is nothing left to give out.
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

    /// Whether every tile has had its floor, so that the pooled error is to be believed.
    fn floors_reached(&self) -> bool {
        let floor = self.floor();
        self.tiles.iter().all(|t| t.done >= floor.min(self.cap(t)))
    }
}
