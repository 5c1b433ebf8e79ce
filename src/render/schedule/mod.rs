//! Schedule: chooses the next tiles and their numbers of samples, and ends the render. The schedule
//! is pure logic. It gets the time as an argument, and learns about the film from the reports of
//! finished jobs.
//!
//! A decision gives each chosen tile the same sample indices in replicate A and then in replicate
//! B. At every decision, a tile therefore holds equally many samples of both, and an estimate of
//! its error. Decisions depend on estimated errors and ray counts, never on time or threads. Time
//! can only end the render.

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
use crate::render::wave::{Job, Wave, WaveReport};
use convergence_fit::ConvergenceFit;
pub use prediction::{Prediction, TilePrediction, TileSamples, USUAL_SLOPE};
pub use settings::{Criterion, Settings, Stop, StoppedBy};
use tile::{Tile, clamp_slope};

/// Samples per replicate that every tile gets before adaptive sampling and noise estimates start.
/// Estimates from fewer samples are unreliable and take as long as the samples. With a value of 16,
/// tiles without noise would get a third of all samples of the mirror room scene, and two thirds of
/// those of the reflecting tracks scene.
const MIN_SAMPLES: u32 = 4;
/// Replacement of [`MIN_SAMPLES`] for pictures whose estimated error is concentrated in fewer than
/// [`FEW_PIXELS`] effective pixels (see [`Noise::effective_pixels`]). Such a picture is sparse or
/// clean: more samples find its features, estimates from few samples do not.
const SPARSE_MIN_SAMPLES: u32 = SAMPLE_ALIGNMENT;
/// Number of effective pixels below which an estimate is unreliable. With k effective pixels the
/// relative uncertainty of the RMSE is 1 / sqrt(2 k): 18 % for 16.
const FEW_PIXELS: f64 = 16.0;
/// Alignment of sample counts, for counts of at least this value. It is the width of the widest
/// packets. Narrower packets use the same alignment, because the samples of a picture must not
/// depend on the processor. The last block of a tile may be shorter.
pub const SAMPLE_ALIGNMENT: u32 = 16;
/// Samples per replicate at which a tile is full: the largest aligned count for which the sum over
/// both replicates fits 32 bits.
pub const MAX_SAMPLES: u32 = (1 << 31) - SAMPLE_ALIGNMENT;

/// Returns the number of samples from `count` to the next packet boundary; 0 for counts below one
/// packet. A count is unaligned if an earlier stop criterion ended inside a packet.
fn to_packet(count: u32) -> u32 {
    if count < SAMPLE_ALIGNMENT { 0 } else { count.next_multiple_of(SAMPLE_ALIGNMENT) - count }
}

/// Next step of a render.
#[derive(Clone, Debug, PartialEq)]
pub enum Step {
    /// Trace this wave.
    Trace(Wave),
    /// The render is finished, for this reason.
    Finished(StoppedBy),
}

/// Numbers of samples per pixel in the picture, A and B together.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spp {
    /// Smallest number in any pixel.
    pub min: u32,
    /// Mean over all pixels.
    pub mean: f64,
    /// Largest number in any pixel.
    pub max: u32,
}

/// Schedule of one render.
#[derive(Clone, Debug)]
pub struct Schedule {
    settings: Settings,
    tiles: Vec<Tile>,
    /// Jobs of the latest decision, for both replicates.
    decided: Vec<Job>,
    estimate: bool,
    replicate: usize,
    /// Jobs of `decided` that the current replicate still needs.
    remaining: Vec<Job>,
    convergence: ConvergenceFit,
    /// Number of samples traced, all pixels and both replicates.
    samples: u64,
    rays: u64,
    noise: Option<Noise>,
    /// Samples per replicate at the latest noise estimate, in phases with equal counts in all
    /// tiles.
    estimated_at: u32,
    /// See [`Schedule::with_light_period`].
    light_period: u32,
}

impl Schedule {
    /// Creates a schedule. `pixels` holds the number of pixels of each tile; tiles are in row
    /// order.
    pub fn new(pixels: &[u32], settings: Settings) -> Self {
        Self {
            settings,
            tiles: pixels.iter().map(|p| Tile::new(*p)).collect(),
            decided: Vec::new(),
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

    /// Returns the schedule of a world in which `light_period` samples of a replicate ask each
    /// light once; see [`AnyWorld::light_period`](crate::world::AnyWorld::light_period). The error
    /// falls steeply at this count, and estimates from fewer samples do not show what is left. They
    /// are discarded as soon as a tile has an estimate from `light_period` samples.
    pub fn with_light_period(self, light_period: u32) -> Self {
        Self { light_period, ..self }
    }

    /// Returns the next step. `seconds` is the time since the start of the render. The caller
    /// reports the result of a wave to [`Schedule::complete`] before the next call.
    pub fn next(&mut self, seconds: f64) -> Step {
        if self.remaining.is_empty() {
            if self.replicate == 0 {
                self.replicate = 1;
            } else {
                if let Some(reason) = self.reason_to_stop(seconds) {
                    return Step::Finished(reason);
                }
                self.decided = self.decide();
                if self.decided.is_empty() {
                    return Step::Finished(self.reason_without_work());
                }
                self.replicate = 0;
            }
            self.remaining.clone_from(&self.decided);
        }
        Step::Trace(Wave {
            replicate: self.replicate,
            jobs: self.remaining.clone(),
            estimate: self.estimate && self.replicate == 1,
        })
    }

    /// Records the report of the wave that [`Schedule::next`] returned, or of the part that
    /// [`Wave::cut`] left of it. Jobs that were cut off or cancelled are part of a later wave.
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
        // Partially traced jobs come last.
        self.remaining.append(&mut partial);
        if self.remaining.is_empty() && wave.estimate {
            self.update_noise();
        }
    }

    /// Computes the picture's noise from that of its tiles.
    fn update_noise(&mut self) {
        self.noise = Noise::of_tiles(self.tiles.iter().map(|t| t.error));
        if let Some(noise) = self.noise {
            self.convergence.record(self.rays as f64, self.settings.criterion.of_picture(noise));
        }
    }

    /// Latest estimate of the error of the whole picture.
    pub fn noise(&self) -> Option<Noise> {
        self.noise
    }

    /// Latest estimate of each tile's RMSE in 8-bit levels, in row order; 0 before the first
    /// estimate.
    pub fn tile_noise_codes(&self) -> Vec<f32> {
        let codes = |t: &Tile| t.error.map_or(0.0, |e| e.of_all().codes.sqrt() as f32);
        self.tiles.iter().map(codes).collect()
    }

    /// Latest estimate of each tile's error, in row order; `None` before the first estimate.
    pub(super) fn tile_estimates(&self) -> impl Iterator<Item = Option<TileNoise>> {
        self.tiles.iter().map(|tile| tile.error)
    }

    /// Number of samples traced so far, over all pixels.
    pub fn samples(&self) -> u64 {
        self.samples
    }

    /// Number of rays traced so far.
    pub fn rays(&self) -> u64 {
        self.rays
    }

    /// Samples per pixel that both replicates hold.
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

    /// Largest number of samples per replicate that `tile` may get.
    fn cap(&self, tile: &Tile) -> u32 {
        match self.settings.rays_per_pixel {
            0 => MAX_SAMPLES,
            _ if !tile.glossy => MAX_SAMPLES,
            cap => (cap / 2).clamp(1, MAX_SAMPLES),
        }
    }

    /// Returns the root mean square error over the pixels of the tiles for which `selects` is true.
    fn pooled(&self, criterion: Criterion, selects: impl Fn(&Tile) -> bool) -> f64 {
        let (sum, pixels) =
            self.tiles.iter().filter(|t| selects(t)).fold((0.0, 0u64), |(s, n), t| {
                (s + t.mse(criterion) * f64::from(t.pixels), n + u64::from(t.pixels))
            });
        (sum / pixels.max(1) as f64).sqrt()
    }

    /// Returns the number of samples per replicate, over all pixels, that are left until the
    /// requested mean count.
    fn samples_left(&self) -> u64 {
        let Some(spp) = self.settings.stop.spp else { return u64::MAX };
        let done: u64 = self.tiles.iter().map(|t| u64::from(t.done) * u64::from(t.pixels)).sum();
        (u64::from(spp.div_ceil(2)) * self.pixels()).saturating_sub(done)
    }

    /// Decides on the next jobs and sets `estimate`. Returns no jobs if nothing is left to trace.
    fn decide(&mut self) -> Vec<Job> {
        self.estimate = true;
        let common = self.common_count();
        if common < self.min_samples() || !self.settings.adaptive {
            self.uniform(common)
        } else {
            self.highest_gain()
        }
    }

    /// Samples per replicate that every tile gets before estimates are used.
    fn min_samples(&self) -> u32 {
        let sparse = |noise: Noise| self.settings.criterion.effective_pixels(noise) < FEW_PIXELS;
        if self.noise.is_some_and(sparse) { SPARSE_MIN_SAMPLES } else { MIN_SAMPLES }
    }

    /// Smallest number of samples per replicate among the tiles below their cap; [`MAX_SAMPLES`] if
    /// all tiles have reached it.
    fn common_count(&self) -> u32 {
        let open = self.tiles.iter().filter(|t| t.done < self.cap(t));
        open.map(|t| t.done).min().unwrap_or(MAX_SAMPLES)
    }

    /// Returns jobs with the same sample indices for every tile below its cap.
    fn uniform(&mut self, common: u32) -> Vec<Job> {
        let grown = match common {
            // To the next power of two. An earlier stop criterion may have ended between two
            // powers.
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

    /// Returns the number of samples by which a picture with `done` samples per replicate in all
    /// tiles grows. With an error target it is half of the estimated remaining samples, at most
    /// `done`. Without an error target it is `done / 8`. With a time limit it is at most
    /// `done / 8`, because a larger wave would exceed the limit.
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

    /// Returns the slope of the error over all glossy tiles (or over all other tiles), from their
    /// latest doublings; 0.5 before the first one.
    fn pooled_slope(&self, glossy: bool) -> f64 {
        self.fitted_slope(glossy).unwrap_or(0.5)
    }

    /// Returns [`Schedule::pooled_slope`] if it follows from doublings.
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
