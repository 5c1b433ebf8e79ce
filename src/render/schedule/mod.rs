//! Sample allocation: the next tiles, their numbers of samples, and the end of the work. The schedule is
//! pure logic: the clock is an argument, and the film is known through the reports of finished jobs.
//!
//! A decision gives each chosen tile the same sample indices in replicate A and then in replicate B. At
//! every decision a tile holds equally many samples of both, and its error is known. Decisions depend on
//! estimated errors and ray counts, never on time or threads; time only ends the work.

mod allocation;
mod convergence_fit;
mod retarget;
mod settings;
mod stop;
#[cfg(test)]
mod tests;
mod tile;

use crate::film::Noise;
use crate::render::wave::{Job, Wave, WaveReport};
use convergence_fit::ConvergenceFit;
pub use settings::{Criterion, Settings, Stop, StoppedBy};
use tile::{Tile, clamp_slope};

/// Samples per replicate that every tile gets before adaptive sampling and estimates begin. Estimates from
/// fewer samples are unreliable and cost as much as the samples. A value of 16 would spend a third of the
/// mirror room's samples, and two thirds of the reflecting tracks', on tiles without noise.
const MIN_SAMPLES: u32 = 4;
/// [`MIN_SAMPLES`] of a picture whose estimated error has fewer than [`FEW_PIXELS`] effective pixels: it is sparse or
/// clean, and its features are found by samples, not by estimates.
const SPARSE_MIN_SAMPLES: u32 = SAMPLE_ALIGNMENT;
/// Number of effective pixels below which an estimate is unreliable: with 16 its RMSE is uncertain by 18 % (1 / sqrt(2 k)).
const FEW_PIXELS: f64 = 16.0;
/// Alignment of sample counts from this count on: the width of the widest packets. A tile's last block may be shorter.
/// Narrower packets use the same alignment, because the samples of a picture must not depend on the processor.
pub const SAMPLE_ALIGNMENT: u32 = 16;
/// Samples per replicate at which a tile is full: the largest aligned count whose double, for both replicates, fits 32 bits.
const MAX_SAMPLES: u32 = (1 << 31) - SAMPLE_ALIGNMENT;

/// Number of samples that aligns `count`, if it is at least one packet: an earlier stop criterion may have ended
/// inside a packet.
fn to_packet(count: u32) -> u32 {
    if count < SAMPLE_ALIGNMENT { 0 } else { count.next_multiple_of(SAMPLE_ALIGNMENT) - count }
}

/// Next step of the work.
#[derive(Clone, Debug, PartialEq)]
pub enum Step {
    /// Trace this wave.
    Trace(Wave),
    /// The work is done.
    Finished(StoppedBy),
}

/// Samples per pixel over the picture, A and B together.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spp {
    /// The fewest.
    pub min: u32,
    /// The mean over pixels.
    pub mean: f64,
    /// The most.
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
    /// Samples per replicate when the noise was last estimated, in uniform phases.
    estimated_at: u32,
}

impl Schedule {
    /// Creates a schedule. `pixels` holds the number of pixels of each tile, row by row.
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
        }
    }

    /// Returns the next step, `seconds` after the start of the work. [`Schedule::complete`] takes the wave's
    /// report before the next call.
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

    /// Records the result of the wave of [`Schedule::next`], or of the part that [`Wave::cut`] left of it.
    /// Jobs that were cut off or cancelled are returned again.
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
            tile.record(report, count);
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
        self.noise = Noise::of_tiles(self.tiles.iter().map(|t| t.error.map(|(_, e)| e)));
        if let Some(noise) = self.noise {
            self.convergence.record(self.rays as f64, self.settings.criterion.of_picture(noise));
        }
    }

    /// Latest estimate of the whole picture's error.
    pub fn noise(&self) -> Option<Noise> {
        self.noise
    }

    /// Latest estimate of each tile's RMSE in 8-bit levels, row by row; 0 before the first.
    pub fn tile_noise_codes(&self) -> Vec<f32> {
        let codes = |t: &Tile| t.error.map_or(0.0, |(_, e)| e.of_all().codes.sqrt() as f32);
        self.tiles.iter().map(codes).collect()
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

    /// Largest number of samples per replicate of `tile`.
    fn cap(&self, tile: &Tile) -> u32 {
        match self.settings.rays_per_pixel {
            0 => MAX_SAMPLES,
            _ if !tile.glossy => MAX_SAMPLES,
            cap => (cap / 2).clamp(1, MAX_SAMPLES),
        }
    }

    /// Root of the mean squared error over the pixels of the tiles that `selects` selects.
    fn pooled(&self, criterion: Criterion, selects: impl Fn(&Tile) -> bool) -> f64 {
        let (sum, pixels) =
            self.tiles.iter().filter(|t| selects(t)).fold((0.0, 0u64), |(s, n), t| {
                (s + t.mse(criterion) * f64::from(t.pixels), n + u64::from(t.pixels))
            });
        (sum / pixels.max(1) as f64).sqrt()
    }

    /// Number of samples per replicate, over all pixels, until the mean count is reached.
    fn samples_left(&self) -> u64 {
        let Some(spp) = self.settings.stop.spp else { return u64::MAX };
        let done: u64 = self.tiles.iter().map(|t| u64::from(t.done) * u64::from(t.pixels)).sum();
        (u64::from(spp.div_ceil(2)) * self.pixels()).saturating_sub(done)
    }

    /// Decides the next jobs, none if nothing is left to do, and sets `estimate`.
    fn decide(&mut self) -> Vec<Job> {
        self.estimate = true;
        let common = self.common_count();
        if common < self.min_samples() || !self.settings.adaptive {
            self.uniform(common)
        } else {
            self.highest_gain()
        }
    }

    /// Samples per replicate that every tile gets before estimates count.
    fn min_samples(&self) -> u32 {
        let sparse = |noise: Noise| self.settings.criterion.effective_pixels(noise) < FEW_PIXELS;
        if self.noise.is_some_and(sparse) { SPARSE_MIN_SAMPLES } else { MIN_SAMPLES }
    }

    /// Least number of samples per replicate among the tiles below their cap; [`MAX_SAMPLES`] if there is none.
    fn common_count(&self) -> u32 {
        let open = self.tiles.iter().filter(|t| t.done < self.cap(t));
        open.map(|t| t.done).min().unwrap_or(MAX_SAMPLES)
    }

    /// Jobs with the same sample indices for every tile below its cap.
    fn uniform(&mut self, common: u32) -> Vec<Job> {
        let grown = match common {
            // To the next power of two; an earlier stop criterion may have ended between two of them.
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

    /// Number of samples by which a uniform picture with `done` samples per replicate grows: half of the way to
    /// the error target, at most `done`; an eighth of `done` without such a target, and at most an eighth with a
    /// time limit, which a larger wave would overshoot.
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

    /// Slope of the error over all glossy (or all other) tiles, from their latest doublings.
    fn pooled_slope(&self, glossy: bool) -> f64 {
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
        if before > 0.0 && after > 0.0 {
            clamp_slope(0.5 * (before / after).ln() / (growth / before))
        } else {
            0.5
        }
    }
}
