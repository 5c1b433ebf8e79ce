//! Schedule: chooses the next tiles and their numbers of samples, and ends the render. It does no
//! input or output. It gets the time as an argument, and learns about the film from the reports of
//! finished jobs.
//!
//! A round gives each chosen tile the same sample indices in replicate A and then in replicate B.
//! Between two rounds, a tile therefore holds equally many samples of both, and their difference is
//! an estimate of its error. A round depends on estimated errors and ray counts, never on time or
//! threads. Time can only end the render.
//!
//! A tile is *glossy* if a path in it has made a random choice. Slopes are exponents p of the error
//! after n samples, RMSE ~ n^-p.

mod allocation;
mod convergence_fit;
mod prediction;
mod probing;
mod settings;
mod state;
mod stop;
#[cfg(test)]
mod tests;
mod tile;

use crate::error_probe::ProbeSums;
use crate::film::{Noise, TileNoise};
use crate::wave::{Job, JobReport, Wave};
use convergence_fit::ConvergenceFit;
pub use convergence_fit::Interval;
pub use prediction::{Goal, PlannedTile, Prediction, RoundEstimate, USUAL_SLOPE};
pub use probing::Measurable;
pub use settings::{Criterion, Settings, Stop, StoppedBy};
use tile::{FLATTEST, Tile, clamp_slope};

/// Samples per pixel and replicate before adaptive sampling and noise estimates start. Estimates
/// from fewer samples are unreliable and take as long as tracing. With 16, tiles without noise
/// would get a third of all samples in the scene of the mirror room, and two thirds in the scene of
/// the reflecting tracks.
pub(crate) const MIN_SAMPLES: u32 = 4;
/// Value that replaces [`MIN_SAMPLES`] if there are fewer than [`FEW_PIXELS`] effective pixels.
/// Such a picture has no noise, or a few noisy pixels, which more samples find.
const SPARSE_MIN_SAMPLES: u32 = SAMPLE_ALIGNMENT;
/// Number of [`Noise::effective_pixels`] below which a noise estimate is unreliable. With k
/// effective pixels the relative uncertainty of the RMSE is 1 / sqrt(2 k): 18 % for 16.
const FEW_PIXELS: f64 = 16.0;
/// Number by which all sample counts per pixel and replicate can be divided, except smaller counts
/// and those after the last block of a tile. It is the width of the widest packets on every
/// processor, because the samples of a picture must not depend on the processor.
pub const SAMPLE_ALIGNMENT: u32 = 16;
/// Samples per pixel and replicate at which a tile is full: the largest multiple of
/// [`SAMPLE_ALIGNMENT`] whose double fits 32 bits.
pub const MAX_SAMPLES: u32 = (1 << 31) - SAMPLE_ALIGNMENT;

/// Returns the number of samples from `count` to the next multiple of [`SAMPLE_ALIGNMENT`]; 0 if
/// `count` is smaller. A larger `count` is a multiple, unless a stop criterion or a cap has ended
/// there.
fn to_packet(count: u32) -> u32 {
    if count < SAMPLE_ALIGNMENT { 0 } else { count.next_multiple_of(SAMPLE_ALIGNMENT) - count }
}

/// Next step of a render.
#[derive(Clone, Debug, PartialEq)]
pub enum Step {
    Trace(Wave),
    Finished(StoppedBy),
}

/// Numbers of samples per pixel over both replicates.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Spp {
    pub min: u32,
    pub mean: f64,
    pub max: u32,
}

/// Sample counts and noise estimates of the tiles of a render, and the jobs to trace next.
#[derive(Clone, Debug, Default)]
pub struct Schedule {
    /// Settings of the render. New stop criteria that are not reached resume a finished render.
    pub settings: Settings,
    tiles: Vec<Tile>,
    /// Jobs of the current round, each for both replicates.
    round: Vec<Job>,
    /// `true` if the current round ends with noise estimates.
    estimate: bool,
    replicate: usize,
    /// Jobs of the round that are not traced yet in the current replicate.
    remaining: Vec<Job>,
    convergence: ConvergenceFit,
    /// Number of samples traced, over all pixels and both replicates.
    pub samples: u64,
    pub rays: u64,
    /// Latest estimate of the picture's error. `None` before the first.
    pub noise: Option<Noise>,
    /// Samples per pixel and replicate after the latest uniform round that ended with an estimate.
    estimated_at: u32,
    /// State of the render without [`Stop::spp`], which has cut off its current round.
    interrupted: Option<Box<Schedule>>,
    /// Light period: the number of samples of a pixel that together trace a shadow ray to each
    /// light once; see [`WorldInfo::light_period`](zerkalo_world::WorldInfo::light_period).
    ///
    /// The error falls steeply at this number of samples. Estimates from fewer samples do not
    /// predict the fall. They are discarded once a tile has an estimate from at least this number.
    pub light_period: u32,
    /// Parts of the error that probes measure.
    pub measurable: Measurable,
    /// Results of all probes so far.
    probe: ProbeSums,
    /// Number of samples at the latest probe.
    probed_at: u64,
}

impl Schedule {
    /// Creates a schedule of tiles with the given numbers of `pixels`, in row order.
    pub fn new(pixels: &[u32], settings: Settings) -> Self {
        Self {
            settings,
            tiles: pixels.iter().map(|p| Tile { pixels: *p, ..Tile::default() }).collect(),
            replicate: 1,
            light_period: 1,
            ..Self::default()
        }
    }

    /// Returns the next step after `seconds` seconds of rendering. The caller reports the result of
    /// a wave to [`Schedule::complete`] before the next call.
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

    /// Records the report of a wave that [`Schedule::next`] returned, or of the part of it that
    /// [`Wave::cut`] kept. Jobs that were cut off or cancelled are part of a later wave.
    pub fn complete(&mut self, wave: &Wave, reports: &[Option<JobReport>]) {
        let mut reports = wave.jobs.iter().zip(reports).peekable();
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
        // The rests of cut jobs follow the jobs that were not traced at all.
        self.remaining.append(&mut partial);
        if self.remaining.is_empty() && wave.estimate {
            self.update_noise();
        }
    }

    /// Lets tile `index` continue where it was in `earlier`, with its present noise estimate.
    pub(super) fn continue_tile(&mut self, index: usize, earlier: &Self) {
        let Tile { error, rests, .. } = self.tiles[index];
        self.tiles[index] = Tile { rests, ..earlier.tiles[index].clone() };
        self.tiles[index].set_estimate(error);
    }

    /// Discards all noise estimates after a change of light weights or display transform. The
    /// samples stay valid; the noise is unknown until [`Schedule::set_estimates`].
    pub fn forget_estimates(&mut self) {
        self.tiles.iter_mut().for_each(Tile::forget_estimates);
        self.noise = None;
        (self.probe, self.probed_at) = Default::default();
        self.interrupted = None;
        self.convergence = ConvergenceFit::default();
    }

    /// Sets the noise estimates of all tiles, in row order, between two waves. `None` means that a
    /// tile has too few samples.
    pub fn set_estimates(&mut self, estimates: &[Option<TileNoise>]) {
        for (tile, estimate) in self.tiles.iter_mut().zip(estimates) {
            tile.set_estimate(*estimate);
        }
        self.interrupted = None;
        // The current round may have begun before the first estimates, without `estimate`.
        self.estimate |= self.tiles.iter().all(|t| t.error.is_some());
        self.update_noise();
    }

    fn update_noise(&mut self) {
        self.noise = Noise::of_tiles(self.tiles.iter().map(|t| t.error));
        if let Some(noise) = self.noise {
            let error = self.error_to_lower(noise);
            self.convergence.record(self.rays as f64, error);
        }
    }

    /// Returns the error that samples lower: that of the tiles which do not rest if others do, or else
    /// `noise`, that of the picture.
    fn error_to_lower(&self, noise: Noise) -> f64 {
        let criterion = self.settings.criterion;
        match self.tiles.iter().any(|tile| tile.rests) {
            true => self.pooled(criterion, |tile| !tile.rests),
            false => criterion.of(noise.rmse),
        }
    }

    /// Sets which tiles, by number, rest: they get only the samples that the first noise estimate
    /// needs. The render ends when the error of the others meets the target.
    pub fn set_resting(&mut self, rests: impl Fn(usize) -> bool) {
        let mut has_changed = false;
        for (number, tile) in self.tiles.iter_mut().enumerate() {
            let before = std::mem::replace(&mut tile.rests, rests(number));
            has_changed |= before != tile.rests;
        }
        if has_changed {
            self.interrupted = None;
            self.convergence = ConvergenceFit::default();
        }
    }

    /// Returns the latest error estimate of each tile, in row order; `None` before its first.
    pub(super) fn tile_estimates(&self) -> impl Iterator<Item = Option<TileNoise>> {
        self.tiles.iter().map(|tile| tile.error)
    }

    pub fn spp(&self) -> Spp {
        let counts = || self.tiles.iter().map(|t| 2 * t.done);
        Spp {
            min: counts().min().unwrap_or(0),
            mean: 2.0 * self.done() as f64 / self.pixels().max(1) as f64,
            max: counts().max().unwrap_or(0),
        }
    }

    /// Returns the number of samples in replicate B, over all pixels.
    fn done(&self) -> u64 {
        self.tiles.iter().map(|t| u64::from(t.done) * u64::from(t.pixels)).sum()
    }

    fn pixels(&self) -> u64 {
        self.tiles.iter().map(|t| u64::from(t.pixels)).sum()
    }

    /// Returns the cap of `tile`: its largest number of samples per pixel and replicate. For glossy
    /// tiles it is half of [`Settings::rays_per_pixel`], at least 1. For other tiles, and if that
    /// setting is 0, it is [`MAX_SAMPLES`]. Tiles that rest keep their samples.
    fn cap(&self, tile: &Tile) -> u32 {
        match self.settings.rays_per_pixel {
            _ if tile.rests => tile.done.max(self.min_samples()),
            0 => MAX_SAMPLES,
            _ if !tile.glossy => MAX_SAMPLES,
            cap => (cap / 2).clamp(1, MAX_SAMPLES),
        }
    }

    /// Returns the RMSE over all pixels of the tiles for which `selects` is true.
    fn pooled(&self, criterion: Criterion, selects: impl Fn(&Tile) -> bool) -> f64 {
        let (sum, pixels) =
            self.tiles.iter().filter(|t| selects(t)).fold((0.0, 0u64), |(s, n), t| {
                (s + t.mse(criterion) * f64::from(t.pixels), n + u64::from(t.pixels))
            });
        (sum / pixels.max(1) as f64).sqrt()
    }

    /// Returns the number of samples per replicate, over all pixels, that are missing to the
    /// requested mean number of samples per pixel; `u64::MAX` if none is requested.
    fn samples_left(&self) -> u64 {
        self.samples_to(self.settings.stop.spp)
    }

    fn samples_to(&self, spp: Option<u32>) -> u64 {
        let Some(spp) = spp else { return u64::MAX };
        (u64::from(spp.div_ceil(2)) * self.pixels()).saturating_sub(self.done())
    }

    /// Returns the jobs of the next round, and stores in `estimate` if the round ends with noise
    /// estimates. Returns no jobs if nothing is left to trace.
    ///
    /// The round is that of a render without [`Stop::spp`]. If this criterion cuts it off, the state
    /// of that render is kept, and a resumed render continues from it.
    fn next_round(&mut self) -> Vec<Job> {
        let original = self.settings.stop.spp.map(|_| self.clone());
        let rest = self.rest_of_interrupted();
        let estimated_at = self.estimated_at;
        let whole = if rest.is_empty() { self.planned(None) } else { rest.clone() };
        let Some(original) = original else { return whole };
        let before = self.clone();
        let mut round = rest;
        if round.is_empty() {
            self.estimated_at = estimated_at;
            round = self.planned(self.settings.stop.spp);
        }
        let mut left = self.samples_left();
        // In a uniform picture, no tile has more samples than the mean.
        let most = if self.settings.adaptive { None } else { self.settings.stop.spp };
        let most = most.map_or(MAX_SAMPLES, |spp| spp.div_ceil(2));
        let mut ends: Vec<u32> = self.tiles.iter().map(|tile| tile.done).collect();
        whole.iter().for_each(|job| ends[job.tile as usize] = job.end());
        for job in &mut round {
            let tile = job.tile as usize;
            let pixels = u64::from(self.tiles[tile].pixels);
            let affordable = u32::try_from(left / pixels).unwrap_or(MAX_SAMPLES);
            let end = ends[tile].min(most);
            job.count = job.count.min(end.saturating_sub(job.first)).min(affordable);
            left -= u64::from(job.count) * pixels;
        }
        round.retain(|job| job.count > 0);
        self.estimate |= round != whole || left == 0;
        if round.is_empty() {
            *self = original;
        } else if round != whole || self.estimate != before.estimate {
            self.interrupted = Some(Box::new(Self { round: whole, ..before }));
        }
        round
    }

    /// Replaces the state that [`Stop::spp`] has ended inside a round by that of the render without
    /// this criterion. Returns the jobs that are left of the round; none if other settings have
    /// changed.
    fn rest_of_interrupted(&mut self) -> Vec<Job> {
        let settings = self.settings;
        let Some(whole) = self.interrupted.take() else { return Vec::new() };
        let stop = Stop { spp: settings.stop.spp, ..whole.settings.stop };
        if (Settings { stop, ..whole.settings }) != settings {
            return Vec::new();
        }
        let ended = std::mem::replace(self, Self { settings, ..*whole });
        (self.samples, self.rays) = (ended.samples, ended.rays);
        let mut ends: Vec<u32> = ended.tiles.iter().map(|tile| tile.done).collect();
        for job in std::mem::take(&mut self.round) {
            let (tile, ended) = (job.tile as usize, &ended.tiles[job.tile as usize]);
            ends[tile] = job.end();
            let error = ended.error.filter(|_| self.estimate && ended.done == job.end());
            let rays = ended.rays.saturating_sub(self.tiles[tile].rays);
            self.tiles[tile].done = ended.done;
            let report = JobReport { rays, glossy: ended.glossy, error };
            self.tiles[tile].record(&report, self.light_period);
        }
        let rest = self.jobs_to(ends.into_iter());
        if rest.is_empty() && self.estimate {
            self.update_noise();
        }
        rest
    }

    /// Returns the jobs of the next round of a render to a mean number of samples per pixel `spp`,
    /// if there is one.
    fn planned(&mut self, spp: Option<u32>) -> Vec<Job> {
        self.estimate = true;
        let common = self.common_count();
        if common < self.min_samples() || !self.settings.adaptive {
            self.uniform(common, spp)
        } else {
            self.highest_gain(spp)
        }
    }

    fn min_samples(&self) -> u32 {
        let sparse = |noise: Noise| self.settings.criterion.of(noise.effective_pixels) < FEW_PIXELS;
        if self.noise.is_some_and(sparse) { SPARSE_MIN_SAMPLES } else { MIN_SAMPLES }
    }

    /// Returns the smallest number of samples per pixel and replicate among the tiles below their
    /// cap; [`MAX_SAMPLES`] if there are none.
    fn common_count(&self) -> u32 {
        let open = self.tiles.iter().filter(|t| t.done < self.cap(t));
        open.map(|t| t.done).min().unwrap_or(MAX_SAMPLES)
    }

    /// Returns jobs that raise all tiles to the same number of samples, or to their caps. `common`
    /// is the result of [`Schedule::common_count`].
    fn uniform(&mut self, common: u32, spp: Option<u32>) -> Vec<Job> {
        let grown = match common {
            // The count is between two powers of two if an earlier stop criterion has ended the
            // render there.
            n if n < SAMPLE_ALIGNMENT => (n + 1).next_power_of_two() - n,
            n => {
                (self.uniform_growth(n) / SAMPLE_ALIGNMENT * SAMPLE_ALIGNMENT).max(SAMPLE_ALIGNMENT)
                    + to_packet(n)
            }
        };
        let limit = spp.map_or(MAX_SAMPLES, |spp| spp.div_ceil(2)).min(MAX_SAMPLES);
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
        self.jobs_to(self.tiles.iter().map(|t| after.min(self.cap(t))))
    }

    /// Returns the number of samples by which a uniform round raises `done` samples per pixel and
    /// replicate, before it is rounded to [`SAMPLE_ALIGNMENT`]. Without an error target it is an
    /// eighth of `done`. With an error target it is half of the estimated remaining samples, at
    /// most `done`; if there is also a time limit, at most an eighth of `done`.
    fn uniform_growth(&self, done: u32) -> u32 {
        let eighth = done / 8;
        let Some((criterion, target)) = self.target() else { return eighth };
        let noise = self.pooled(criterion, |_| true);
        let factor =
            (noise / target).powf(1.0 / self.convergence.fitted_slope().unwrap_or(FLATTEST));
        let half_way = (0.5 * f64::from(done) * (factor - 1.0).clamp(0.0, 2.0)) as u32;
        if self.settings.stop.seconds.is_some() { half_way.min(eighth) } else { half_way }
    }

    /// Returns jobs that raise the tiles to `counts` samples per pixel and replicate, in row order.
    fn jobs_to(&self, counts: impl Iterator<Item = u32>) -> Vec<Job> {
        let tiles = self.tiles.iter().zip(counts).zip(0..);
        tiles
            .map(|((t, count), tile)| Job {
                tile,
                first: t.done,
                count: count.saturating_sub(t.done),
            })
            .filter(|job| job.count > 0)
            .collect()
    }

    /// Returns the slope over the latest doubling of the samples of all glossy tiles, or of all
    /// other tiles. Returns `None` if none of them has doubled its count, or their errors are 0.
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
