//! Schedule: chooses the next tiles and their numbers of samples, and ends the render. It does no
//! input or output. It gets the time as an argument, and learns about the film from the reports of
//! finished jobs.
//!
//! The samples of each pixel are divided into two independent halves, the replicates A and B.
//! Samples are allocated in rounds. A round gives each chosen tile the same sample indices in
//! replicate A and then in replicate B. Between two rounds, a tile therefore holds equally many
//! samples of both, and their difference is an estimate of its error. A round depends on estimated
//! errors and ray counts, never on time or threads. Time can only end the render.

mod allocation;
mod convergence_fit;
mod prediction;
mod retarget;
mod settings;
mod state;
mod stop;
#[cfg(test)]
mod tests;
mod tile;

use crate::film::{Noise, TileNoise};
use crate::wave::{Job, Wave, WaveReport};
use convergence_fit::ConvergenceFit;
pub use prediction::{Prediction, TilePrediction, TileSamples, USUAL_SLOPE};
pub use settings::{Criterion, Settings, Stop, StoppedBy};
use tile::{Tile, clamp_slope};

/// Samples per pixel that every tile gets in each replicate (half of the samples) before adaptive
/// sampling and noise estimates start. Estimates from fewer samples would be unreliable, and their
/// computation would take as long as the tracing of the samples. With a minimum of 16, tiles
/// without noise would get a third of all samples of the mirror room scene, and two thirds of those
/// of the reflecting tracks scene.
const MIN_SAMPLES: u32 = 4;
/// Value that replaces [`MIN_SAMPLES`] if the estimated error is concentrated in fewer than
/// [`FEW_PIXELS`] effective pixels (see [`Noise::effective_pixels`]). Such a picture has either no
/// noise, or a few noisy pixels; more samples are needed to find them.
const SPARSE_MIN_SAMPLES: u32 = SAMPLE_ALIGNMENT;
/// Number of effective pixels (Kish's effective sample size, see [`Noise::effective_pixels`]) below
/// which a noise estimate is unreliable. With k effective pixels the relative uncertainty of the
/// RMSE is 1 / sqrt(2 k): 18 % for 16.
const FEW_PIXELS: f64 = 16.0;
/// Alignment of the sample counts of tiles. The number of samples per pixel in each of the two
/// replicates (halves of the samples) is a multiple of this number. Exceptions are smaller counts,
/// and the count after the last block of a tile. The alignment is the number of lanes of the widest
/// SIMD packets of rays. It is the same for narrower packets, because the samples of a picture must
/// not depend on the processor.
pub const SAMPLE_ALIGNMENT: u32 = 16;
/// Samples per pixel in each replicate (half of the samples) at which a tile of the film is full.
/// It is the largest multiple of [`SAMPLE_ALIGNMENT`] for which the sum over both replicates fits
/// 32 bits.
pub const MAX_SAMPLES: u32 = (1 << 31) - SAMPLE_ALIGNMENT;

/// Returns the number of samples from `count` to the next multiple of [`SAMPLE_ALIGNMENT`]. Returns
/// 0 if `count` is such a multiple, or is smaller than [`SAMPLE_ALIGNMENT`]. A larger count is no
/// multiple only if an earlier stop criterion or limit ([`Settings::rays_per_pixel`]) ended there.
fn to_packet(count: u32) -> u32 {
    if count < SAMPLE_ALIGNMENT { 0 } else { count.next_multiple_of(SAMPLE_ALIGNMENT) - count }
}

/// Next step of a render, chosen by its schedule.
#[derive(Clone, Debug, PartialEq)]
pub enum Step {
    /// Wave to trace next: a set of jobs that run concurrently.
    Trace(Wave),
    /// End of the render, with its reason.
    Finished(StoppedBy),
}

/// Numbers of samples per pixel in the picture, summed over both replicates (halves of the
/// samples).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Spp {
    /// Smallest number of samples in any pixel.
    pub min: u32,
    /// Mean number of samples over all pixels.
    pub mean: f64,
    /// Largest number of samples in any pixel.
    pub max: u32,
}

/// Schedule of one render: sample counts and noise estimates of its tiles, and the jobs to trace
/// next.
#[derive(Clone, Debug)]
pub struct Schedule {
    settings: Settings,
    tiles: Vec<Tile>,
    /// Jobs of the current allocation round (one decision on the next samples of all tiles). Each
    /// job is traced twice, once in replicate A and once in replicate B (halves of the samples).
    round: Vec<Job>,
    estimate: bool,
    replicate: usize,
    /// Jobs of the current allocation round (one decision on the next samples of all tiles) that
    /// are not traced yet in the current replicate (half of the samples).
    remaining: Vec<Job>,
    convergence: ConvergenceFit,
    /// Number of samples traced, over all pixels and both replicates (halves of the samples).
    samples: u64,
    rays: u64,
    noise: Option<Noise>,
    /// Samples per pixel in each of the two replicates (halves of the samples) after the latest
    /// uniform allocation round that ended with a noise estimate. A uniform round gives all tiles
    /// equally many samples.
    estimated_at: u32,
    /// Light period: the number of samples of a pixel that together trace a shadow ray to each
    /// light once; see [`Schedule::with_light_period`].
    light_period: u32,
}

impl Schedule {
    /// Creates a schedule. `pixels` holds the number of pixels of each tile; tiles are in row
    /// order.
    pub fn new(pixels: &[u32], settings: Settings) -> Self {
        Self {
            settings,
            tiles: pixels.iter().map(|p| Tile::new(*p)).collect(),
            round: Vec::new(),
            estimate: false,
            replicate: 1,
            remaining: Vec::new(),
            convergence: ConvergenceFit::default(),
            samples: 0,
            rays: 0,
            noise: None,
            estimated_at: 0,
            light_period: 1,
        }
    }

    /// Returns the schedule with the light period `light_period`. So many samples of a pixel in a
    /// replicate (half of the samples) together trace a shadow ray to each light once; see
    /// [`AnyWorld::light_period`](zerkalo_world::AnyWorld::light_period).
    ///
    /// The error falls steeply at this count. An error estimated from fewer samples does not
    /// predict the error after more samples. As soon as a tile has an estimate from `light_period`
    /// samples, its estimates from fewer samples are therefore discarded.
    pub fn with_light_period(self, light_period: u32) -> Self {
        Self { light_period, ..self }
    }

    /// Returns the next step of the render. `seconds` is the time since the start of the render.
    /// The caller reports the result of a wave (a set of concurrent jobs) to [`Schedule::complete`]
    /// before the next call.
    pub fn next(&mut self, seconds: f64) -> Step {
        if self.remaining.is_empty() {
            if self.replicate == 0 {
                self.replicate = 1;
            } else {
                if let Some(reason) = self.reason_to_stop(seconds) {
                    return Step::Finished(reason);
                }
                self.round = self.next_round();
                if self.round.is_empty() {
                    return Step::Finished(self.reason_without_work());
                }
                self.replicate = 0;
            }
            self.remaining.clone_from(&self.round);
        }
        Step::Trace(Wave {
            replicate: self.replicate,
            jobs: self.remaining.clone(),
            estimate: self.estimate && self.replicate == 1,
        })
    }

    /// Records the report of a wave (a set of jobs that run concurrently). `wave` is the one that
    /// [`Schedule::next`] returned, or the part of it that [`Wave::cut`] left. Jobs that were cut
    /// off or cancelled are part of a later wave.
    pub fn complete(&mut self, wave: &Wave, report: &WaveReport) {
        let mut reports = wave.jobs.iter().zip(&report.reports).peekable();
        let mut partial = Vec::new();
        let remaining = std::mem::take(&mut self.remaining);
        for whole in remaining {
            let traced = reports.next_if(|(job, _)| job.tile == whole.tile);
            let Some((job, Some(report))) = traced else {
                self.remaining.push(whole);
                continue;
            };
            let tile = &mut self.tiles[job.tile as usize];
            self.samples += u64::from(job.count) * u64::from(tile.pixels);
            self.rays += report.rays;
            let count = job.first + job.count;
            tile.record(report, self.light_period);
            if wave.replicate == 1 {
                tile.done = count;
            }
            if job.count < whole.count {
                partial.push(Job { first: count, count: whole.count - job.count, ..whole });
            }
        }
        // The rests of partially traced jobs follow the jobs that were not traced at all.
        self.remaining.append(&mut partial);
        if self.remaining.is_empty() && wave.estimate {
            self.update_noise();
        }
    }

    /// Computes the error of the picture from the estimates of its tiles, and adds it to the
    /// convergence fit.
    fn update_noise(&mut self) {
        self.noise = Noise::of_tiles(self.tiles.iter().map(|t| t.error));
        if let Some(noise) = self.noise {
            self.convergence.record(self.rays as f64, self.settings.criterion.of_picture(noise));
        }
    }

    /// Returns the latest estimate of the error of the whole picture. Returns `None` before the
    /// first estimate.
    pub fn noise(&self) -> Option<Noise> {
        self.noise
    }

    /// Returns the latest estimate of each tile's RMSE as displayed, in 8-bit levels, in row order;
    /// 0 before the first estimate.
    pub fn tile_noise_levels(&self) -> Vec<f32> {
        let levels = |t: &Tile| t.error.map_or(0.0, |e| e.of_all().levels.sqrt() as f32);
        self.tiles.iter().map(levels).collect()
    }

    /// Returns the latest estimate of each tile's error, in row order; `None` before the first
    /// estimate.
    pub(super) fn tile_estimates(&self) -> impl Iterator<Item = Option<TileNoise>> {
        self.tiles.iter().map(|tile| tile.error)
    }

    /// Returns the number of samples traced so far, over all pixels and both replicates (halves of
    /// the samples).
    pub fn samples(&self) -> u64 {
        self.samples
    }

    /// Returns the number of rays traced so far.
    pub fn rays(&self) -> u64 {
        self.rays
    }

    /// Returns the numbers of samples per pixel in the picture, over both replicates (halves of the
    /// samples).
    pub fn spp(&self) -> Spp {
        let counts = || self.tiles.iter().map(|t| 2 * t.done);
        let (pixels, samples) = self.tiles.iter().fold((0u64, 0u64), |(pixels, samples), t| {
            (pixels + u64::from(t.pixels), samples + 2 * u64::from(t.done) * u64::from(t.pixels))
        });
        Spp {
            min: counts().min().unwrap_or(0),
            mean: samples as f64 / pixels.max(1) as f64,
            max: counts().max().unwrap_or(0),
        }
    }

    fn pixels(&self) -> u64 {
        self.tiles.iter().map(|t| u64::from(t.pixels)).sum()
    }

    /// Returns the largest number of samples per pixel that `tile` may have in each replicate (one
    /// of two independent halves of the samples) at the end of the render. If a path in the tile
    /// has made a random choice (such as a direction of a glossy lobe), it is half of
    /// [`Settings::rays_per_pixel`], at least 1. For other tiles, or if that setting is 0, it is
    /// [`MAX_SAMPLES`].
    fn cap(&self, tile: &Tile) -> u32 {
        match self.settings.rays_per_pixel {
            0 => MAX_SAMPLES,
            _ if !tile.glossy => MAX_SAMPLES,
            cap => (cap / 2).clamp(1, MAX_SAMPLES),
        }
    }

    /// Returns the root mean square error, in the unit of `criterion`, over all pixels of the tiles
    /// for which `selects` is true.
    fn pooled(&self, criterion: Criterion, selects: impl Fn(&Tile) -> bool) -> f64 {
        let (sum, pixels) =
            self.tiles.iter().filter(|t| selects(t)).fold((0.0, 0u64), |(s, n), t| {
                (s + t.mse(criterion) * f64::from(t.pixels), n + u64::from(t.pixels))
            });
        (sum / pixels.max(1) as f64).sqrt()
    }

    /// Returns the number of samples that each replicate (half of the samples) still needs, over
    /// all pixels, until the picture has the requested mean number of samples per pixel. Returns
    /// `u64::MAX` if no number is requested.
    fn samples_left(&self) -> u64 {
        let Some(spp) = self.settings.stop.spp else { return u64::MAX };
        let done: u64 = self.tiles.iter().map(|t| u64::from(t.done) * u64::from(t.pixels)).sum();
        (u64::from(spp.div_ceil(2)) * self.pixels()).saturating_sub(done)
    }

    /// Returns the jobs of the next allocation round, one decision on the next samples of all
    /// tiles. Sets `self.estimate` to `true` if the round ends with noise estimates, otherwise to
    /// `false`. Returns no jobs if nothing is left to trace.
    fn next_round(&mut self) -> Vec<Job> {
        self.estimate = true;
        let common = self.common_count();
        if common < self.min_samples() || !self.settings.adaptive {
            self.uniform(common)
        } else {
            self.highest_gain()
        }
    }

    /// Returns the number of samples per pixel that every tile gets in each replicate (half of the
    /// samples) before noise estimates are used.
    fn min_samples(&self) -> u32 {
        let sparse = |noise: Noise| self.settings.criterion.of(noise.effective_pixels) < FEW_PIXELS;
        if self.noise.is_some_and(sparse) { SPARSE_MIN_SAMPLES } else { MIN_SAMPLES }
    }

    /// Returns the smallest number of samples per pixel in each of the two replicates (halves of
    /// the samples) among the tiles below their cap (see [`Schedule::cap`]); [`MAX_SAMPLES`] if all
    /// tiles have reached their cap.
    fn common_count(&self) -> u32 {
        let open = self.tiles.iter().filter(|t| t.done < self.cap(t));
        open.map(|t| t.done).min().unwrap_or(MAX_SAMPLES)
    }

    /// Returns jobs that raise the sample counts of all tiles to the same number, or to the cap of
    /// a tile (see [`Schedule::cap`]) if that is lower. `common` is the smallest number of samples
    /// per pixel in each of the two replicates (halves of the samples) among the tiles below their
    /// cap.
    fn uniform(&mut self, common: u32) -> Vec<Job> {
        let grown = match common {
            // The count grows to the next power of two. It is between two powers if an earlier stop
            // criterion has ended the render there.
            n if n < SAMPLE_ALIGNMENT => (n + 1).next_power_of_two() - n,
            n => {
                (self.uniform_growth(n) / SAMPLE_ALIGNMENT * SAMPLE_ALIGNMENT).max(SAMPLE_ALIGNMENT)
                    + to_packet(n)
            }
        };
        let limit =
            self.settings.stop.spp.map_or(MAX_SAMPLES, |spp| spp.div_ceil(2)).min(MAX_SAMPLES);
        let count = grown.min(limit.saturating_sub(common));
        let after = common + count;
        let last = after == limit;
        let has_target = self.target().is_some() || self.settings.stop.seconds.is_some();
        let due =
            if has_target { after >= MIN_SAMPLES } else { after / 2 >= self.estimated_at.max(2) };
        self.estimate = due || last;
        if self.estimate {
            self.estimated_at = after;
        }
        let samples = |t: &Tile| after.min(self.cap(t)).saturating_sub(t.done);
        self.jobs(samples)
    }

    /// Returns the number of samples, not yet rounded to [`SAMPLE_ALIGNMENT`], that each pixel gets
    /// next in each of the two replicates (halves of the samples). `done` is the number of samples
    /// of a pixel in each replicate so far. With an error target the result is half of the
    /// estimated remaining samples, at most `done`. Without an error target it is an eighth of
    /// `done`. With a time limit it is at most an eighth of `done`, because a larger step could
    /// exceed the limit by much.
    fn uniform_growth(&self, done: u32) -> u32 {
        let eighth = done / 8;
        let Some((criterion, target)) = self.target() else { return eighth };
        let noise = self.pooled(criterion, |_| true);
        let factor = (noise / target).powf(1.0 / self.convergence.slope());
        let half_way = (0.5 * f64::from(done) * (factor - 1.0).clamp(0.0, 2.0)) as u32;
        if self.settings.stop.seconds.is_some() { half_way.min(eighth) } else { half_way }
    }

    fn jobs(&self, count: impl Fn(&Tile) -> u32) -> Vec<Job> {
        let tiles = self.tiles.iter().zip(0..);
        tiles
            .map(|(t, tile)| Job { tile, first: t.done, count: count(t) })
            .filter(|job| job.count > 0)
            .collect()
    }

    /// Returns the convergence slope p, RMSE ~ n^-p for n samples, of all tiles in which a path has
    /// made a random choice if `glossy` is `true`, otherwise of all other tiles. It is fitted to
    /// the latest doubling of the sample count of each of these tiles. Returns 0.5 if none of them
    /// has doubled its count, or their errors are 0.
    fn pooled_slope(&self, glossy: bool) -> f64 {
        self.fitted_slope(glossy).unwrap_or(0.5)
    }

    /// Returns [`Schedule::pooled_slope`]. Returns `None` if no such tile has doubled its sample
    /// count, or their errors are 0.
    fn fitted_slope(&self, glossy: bool) -> Option<f64> {
        let criterion = self.settings.criterion;
        let selected = self.tiles.iter().filter(|t| t.glossy == glossy);
        let doublings =
            selected.filter_map(|t| Some((f64::from(t.pixels), t.last_doubling(criterion)?)));
        let [mut before, mut after, mut growth] = [0.0; 3];
        for (pixels, [(n0, e0), (n1, e1)]) in doublings {
            before += pixels * e0;
            after += pixels * e1;
            growth += pixels * e0 * (n1 / n0).ln();
        }
        (before > 0.0 && after > 0.0)
            .then(|| clamp_slope(0.5 * (before / after).ln() / (growth / before)))
    }
}
