//! Render of the samples of one shard, in steps between which the film can be saved.

use crate::film::file::{FilmFileHeader, FilmReader, estimate_record, tile_record};
use crate::film::{Header, TILE, TILE_PIXELS};
use crate::plan::share_report::{CUTS_TAG, REPORT_TAG};
use crate::plan::{Plan, PlannedTile, Share, ShareReport, TileReport};
use crate::schedule::{Interval, SAMPLE_ALIGNMENT, Spp};
use crate::session::{Report, State};
use crate::wave::{Job, Wave};
use crate::{RenderState, threads};
use std::io::Read;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

/// Target duration in seconds of a step.
const STEP_SECONDS: f64 = 0.25;
/// Target duration in seconds of a job. Jobs are short, so that all threads have work until the end
/// of a step.
const JOB_SECONDS: f64 = 0.01;
/// Largest number of samples per pixel of a job.
const LONGEST_JOB: u32 = 1 << 20;
/// Number of samples, over all pixels, of the first step, which measures the speed.
const FIRST_STEP_SAMPLES: u64 = 1 << 18;

/// Render of the samples of one shard. After each step, both replicates of every tile hold equally
/// many samples: the first ones of the shard's range. A film that was saved between two steps can
/// therefore be continued.
pub struct ShardRender {
    /// State with the film of the shard's rows.
    pub state: RenderState,
    share: Share,
    /// Planned tiles of the share.
    planned: Vec<PlannedTile>,
    report: ShareReport,
    /// Properties of the film of the whole picture.
    picture: Header,
    /// Number of the film's first tile in the picture.
    offset: usize,
    pool: rayon::ThreadPool,
    /// Jobs that remain to be traced, in both replicates.
    remaining: Vec<Job>,
    /// Number of samples of the complete shard, in the film so far, and in the base, over all pixels
    /// and replicates.
    samples: [u64; 3],
    /// Number of samples traced in all steps so far, and the seconds that they took.
    measured: (u64, f64),
}

impl ShardRender {
    /// Creates the render of `share`, whose film replaces that of `state`. Without
    /// [`Self::take_base`] or [`Self::resume`] it begins at the first sample. Fails if a thread
    /// cannot be started, or without memory.
    pub fn new(
        state: RenderState,
        plan: &Plan,
        share: Share,
        threads: usize,
    ) -> Result<Self, String> {
        let pool = threads::pool(threads).map_err(|error| error.to_string())?;
        let [width, height] = plan.settings.size;
        let columns = width.div_ceil(TILE as u32);
        let last = (share.first + share.ranges.len()).max(1) - 1;
        let [first, last] = [share.first.min(last), last].map(|tile| tile as u32 / columns);
        let tile = TILE as u32;
        let state = state.into_band(first * tile..height.min((last + 1) * tile))?;
        let picture = Header { height: height as usize, ..state.film.header.clone() };
        let tiles = share.first..share.first + share.ranges.len();
        let mut render = Self {
            state,
            planned: plan.tiles[tiles].to_vec(),
            report: ShareReport {
                first: share.first,
                tiles: vec![TileReport::default(); share.ranges.len()],
            },
            share,
            picture,
            offset: (first * columns) as usize,
            pool,
            remaining: Vec::new(),
            samples: [0; 3],
            measured: (0, 0.0),
        };
        render.find_remaining()?;
        Ok(render)
    }

    /// Continues the part of an earlier run of the same shard. Fails if its sample counts cannot
    /// come from one.
    pub fn resume<R: Read>(&mut self, part: FilmReader<R>) -> Result<(), String> {
        let report = ShareReport::of_header(&part.header);
        let fits = |report: &ShareReport| {
            report.first == self.report.first && report.tiles.len() == self.report.tiles.len()
        };
        self.report = report.filter(fits).ok_or("it has no report of its tiles")?;
        part.add_tiles(&mut self.state.film, |_| true).map_err(|error| error.to_string())?;
        self.find_remaining()
    }

    /// Takes the base from parts of the round before. Tiles that these lack are traced from the
    /// first sample.
    pub fn take_base<R: Read>(&mut self, parts: impl Iterator<Item = FilmReader<R>>) {
        let mut bases = vec![0; self.state.film.tile_count()];
        for (i, planned) in self.planned.iter().enumerate() {
            let held = if self.share.ranges[i].start == 0 { planned.base } else { 0 };
            bases[self.share.first + i - self.offset] = held;
        }
        for part in parts {
            // Tiles of a damaged part have other counts than the base, and are discarded below.
            let _ = part.add_tiles(&mut self.state.film, |tile| bases[tile] > 0);
        }
        for (tile, base) in bases.iter().enumerate() {
            if self.state.film.counts(tile) != [*base; 2] {
                self.state.film.clear_tile(tile);
            }
        }
        // No tile has more samples than its base.
        let _ = self.find_remaining();
    }

    /// Lists the jobs that remain.
    fn find_remaining(&mut self) -> Result<(), String> {
        self.remaining.clear();
        self.samples = [0; 3];
        for (i, range) in self.share.ranges.iter().enumerate() {
            let tile = self.share.first + i - self.offset;
            let counts = self.state.film.counts(tile);
            let [done, total] = [counts[0], range.len() as u32];
            if counts[1] != done || done > total {
                let what = format!("{counts:?} samples in A and B of tile {}", tile + self.offset);
                return Err(format!("the film has {what}, which are not those of its shard"));
            }
            let base = if range.start == 0 { self.planned[i].base } else { 0 };
            let pixels = self.state.film.tile_pixels(tile);
            for (sum, count) in self.samples.iter_mut().zip([total, done, base]) {
                *sum += 2 * u64::from(count) * pixels;
            }
            if done < total {
                let (tile, first) = (tile as u32, range.start + done);
                self.remaining.push(Job { tile, first, count: total - done });
            }
        }
        Ok(())
    }

    /// Traces samples for about a quarter of a second. Returns `false` if there were none to trace.
    pub fn step(&mut self) -> bool {
        let speed = match self.measured {
            (samples, seconds) if seconds > 0.0 => samples as f64 / seconds,
            _ => FIRST_STEP_SAMPLES as f64 / STEP_SECONDS,
        };
        let threads = self.pool.current_num_threads() as f64;
        // A job is traced twice, once for each replicate.
        let longest = (0.5 * JOB_SECONDS * speed / threads / TILE_PIXELS as f64) as u32;
        let longest =
            longest.min(LONGEST_JOB).next_multiple_of(SAMPLE_ALIGNMENT).max(SAMPLE_ALIGNMENT);
        let all = Wave { replicate: 0, jobs: self.remaining.clone(), estimate: false };
        let mut wave = all.cut((0.5 * STEP_SECONDS * speed) as u64, longest);
        if wave.jobs.is_empty() {
            return false;
        }
        let base =
            |job: &Job| self.planned[job.tile as usize + self.offset - self.share.first].base;
        for job in &mut wave.jobs {
            // Rays of the base belong to another round.
            if (job.first..job.end()).contains(&base(job)) && job.first < base(job) {
                job.count = base(job) - job.first;
            }
        }
        let start = Instant::now();
        let mut traced = 0;
        for replicate in 0..2 {
            wave.replicate = replicate;
            let reports = self.state.trace_wave(&wave, &self.pool, &AtomicBool::new(false));
            for (job, report) in wave.jobs.iter().zip(reports.iter().flatten()) {
                let index = job.tile as usize + self.offset - self.share.first;
                let tile = &mut self.report.tiles[index];
                tile.glossy |= report.glossy;
                tile.rays += if job.first < self.planned[index].base { 0 } else { report.rays };
            }
        }
        // The rest of each cut job is traced next, while its tile is still in the cache.
        for (job, rest) in wave.jobs.iter().zip(&mut self.remaining) {
            rest.first += job.count;
            rest.count -= job.count;
            traced += 2 * u64::from(job.count) * self.state.film.tile_pixels(job.tile as usize);
        }
        self.samples[1] += traced;
        self.measured.0 += traced;
        self.measured.1 += start.elapsed().as_secs_f64();
        self.remaining.retain(|job| job.count > 0);
        true
    }

    /// Adds the report on the tiles to the header of the part, which becomes that of a film of the
    /// whole picture. If the part is `complete`, the report has the errors of its tiles and the sums
    /// of cut tiles.
    pub fn record(&self, header: &mut FilmFileHeader, complete: bool) {
        header.film = self.picture.clone();
        let first = self.share.first;
        let mut out = (first as u32).to_le_bytes().to_vec();
        let mut cuts = Vec::new();
        let tiles = (first..).zip(&self.share.ranges).zip(&self.planned).zip(&self.report.tiles);
        for (((number, range), planned), tile) in tiles {
            let is_whole = *range == (0..planned.end);
            let held = self.state.film.tile(number - self.offset);
            let estimator = self.state.estimator();
            let error = held.filter(|_| complete && is_whole).and_then(|t| estimator.tile(t));
            out.extend(tile.rays.to_le_bytes());
            out.extend([u8::from(tile.glossy), u8::from(error.is_some())]);
            error.iter().for_each(|error| estimate_record::encode(error, &mut out));
            if complete && !is_whole {
                cuts.extend((number as u32).to_le_bytes());
                tile_record::encode(held, &mut cuts);
            }
        }
        header.chunks.insert(REPORT_TAG, out);
        header.chunks.insert(CUTS_TAG, cuts);
    }

    /// Returns the reports on the tiles, without errors.
    pub fn reports(&self) -> &[TileReport] {
        &self.report.tiles
    }

    /// Returns the rays of the samples traced so far, without those of the base.
    pub fn rays(&self) -> u64 {
        self.report.tiles.iter().map(|tile| tile.rays).sum()
    }

    /// Returns the number of samples in the film and of the complete shard, over all pixels and
    /// replicates.
    pub fn samples(&self) -> [u64; 2] {
        [self.samples[1], self.samples[0]]
    }

    /// Returns the share of the shard's samples after the base that the film holds, 0..=1.
    pub fn progress(&self) -> f64 {
        let [total, done, base] = self.samples;
        if total == base { 1.0 } else { done.saturating_sub(base) as f64 / (total - base) as f64 }
    }

    pub fn report(&self) -> Report {
        let [total, done, _] = self.samples;
        let (traced, seconds) = self.measured;
        let speed = if seconds > 0.0 { traced as f64 / seconds } else { 0.0 };
        let left = (total - done) as f64 / speed.max(1.0);
        let film = &self.state.film;
        let pixels = (film.header.width * film.header.height) as f64;
        let spp = done as f64 / pixels;
        Report {
            state: State::Tracing,
            spp: Spp { min: 0, mean: spp, max: spp.ceil() as u32 },
            samples: traced,
            rays: self.rays(),
            seconds,
            eta_seconds: Some(Interval::exact(left)),
            progress: Some(self.progress()),
            recent_samples_per_second: speed,
            lanes: self.state.world.info().lanes,
            threads: self.pool.current_num_threads(),
            ..Report::default()
        }
    }
}
