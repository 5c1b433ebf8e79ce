//! Roughness mix: a render that begins with the picture of a smaller roughness.
//!
//! The lobe of a material that becomes rougher is the former lobe, with the share `a` of its
//! directions, and the rest. A picture in which no path is reflected by the material more than M
//! times is a^M times the former picture, the *base*, plus 1 - a^M times a picture that is traced
//! with samples of order M (`zerkalo_world`, `integrator/turned_material.rs`). M is counted for each
//! tile. Its first samples have order M. Each counts twice, together with twice the base, until they
//! count as much as the base did. Further samples have the whole lobe.
//!
//! A tile in which no path has met the material keeps the samples of the base; further samples follow
//! them. A tile whose M grows is traced again from its first sample. M is counted after each
//! [`SAMPLE_ALIGNMENT`] samples, so that neither sums nor rays depend on the sizes of the jobs. Beyond
//! [`MAX_ORDER`] a tile does not use the base.

use crate::film::{Film, TILE};
use crate::pass::{self, PassContext};
use crate::schedule::{MIN_SAMPLES, SAMPLE_ALIGNMENT, Schedule};
use crate::wave::{Job, JobReport, Wave, WaveReport};
use crate::{Options, RenderState};
use rayon::prelude::*;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use zerkalo_scene::Scene;
use zerkalo_scene::material::Highlight;
use zerkalo_world::{Counts, MAX_ORDER};

/// Weight of a sample of the rest of the lobe, with the base.
const WEIGHT: u32 = 2;

/// Base of a render, and what is known of each tile.
pub struct RoughnessMix {
    base: Render,
    /// Share of the base's lobe.
    share: f64,
    tiles: Vec<MixedTile>,
}

#[derive(Clone, Copy)]
struct MixedTile {
    /// Largest number of reflections of a path at the material, at most [`MAX_ORDER`] + 1.
    meetings: u8,
    /// Number of samples of the rest of the lobe, or in their place, in each replicate.
    ends: [u32; 2],
    /// Number of these and of the samples of the whole lobe that follow them, in each replicate.
    done: [u32; 2],
    /// Samples of the base in each replicate.
    base: [u32; 2],
    /// `true` if the tile continues the base.
    continues: bool,
}

impl MixedTile {
    /// Returns the order of the samples of the rest of the lobe.
    fn order(&self) -> usize {
        usize::from(self.meetings).max(1)
    }

    /// Returns the samples of the rest of the lobe that follow sample `first` of a job which ends at
    /// `end`, up to the next multiple of [`SAMPLE_ALIGNMENT`]; 0 if there are none.
    fn rest_count(&self, first: u32, end: u32) -> u32 {
        if self.order() > MAX_ORDER || self.continues {
            return 0;
        }
        let aligned = (first + 1).next_multiple_of(SAMPLE_ALIGNMENT);
        aligned.min(end).min(self.rest_end()).saturating_sub(first)
    }

    /// Returns the number of samples that are traced with the rest of the lobe.
    fn rest_end(&self) -> u32 {
        let mean = self.base[0].midpoint(self.base[1]);
        (mean / WEIGHT).next_multiple_of(SAMPLE_ALIGNMENT)
    }

    /// Returns the index of the first sample: that after the base, so that both together are
    /// successive samples.
    fn offset(&self) -> u32 {
        if self.continues {
            return 0;
        }
        self.base[0].max(self.base[1]).next_multiple_of(SAMPLE_ALIGNMENT)
    }
}

/// Returns `true` if `scene` differs from `base` in the roughness of one material only, which is
/// larger, and on which no highlight depends.
fn is_rougher(base: &Scene, scene: &Scene) -> bool {
    let names = base.materials.keys().eq(scene.materials.keys());
    let mut changed = base.materials.iter().zip(scene.materials.values());
    let Some(((name, old), new)) = changed.find(|((_, old), new)| old != new) else { return false };
    let mut equal = base.clone();
    equal.materials.insert(name.clone(), new.clone());
    let mut material = old.clone();
    (material.roughness, material.alpha) = (new.roughness, new.alpha);
    let highlight = new.specular > 0.0
        && new.highlight == Highlight::CookTorrance
        && new.microfacet_alpha() != old.microfacet_alpha();
    let rougher = new.roughness > old.roughness || new.microfacet_alpha() > old.microfacet_alpha();
    names && equal == *scene && material == *new && rougher && !highlight
}

/// State and schedule of a render.
pub type Render = (RenderState, Schedule);

/// Returns `true` if all tiles have the samples of a first noise estimate. With fewer samples, a tile
/// of a mix may still show its base.
fn has_estimates(schedule: &Schedule) -> bool {
    schedule.spp().min >= 2 * MIN_SAMPLES
}

/// Largest number of bases below one another.
const MAX_BASES: usize = 3;
/// Largest noise of a picture that becomes a base, in units of the noise of its own base.
const SETTLED: f64 = 1.5;

impl RenderState {
    /// Iterates over the bases of this render's mix, from the latest one.
    fn bases(&self) -> impl Iterator<Item = &Self> {
        let mut next = Some(self);
        std::iter::from_fn(move || {
            next = next?.mix.as_ref().map(|mix| &mix.base.0);
            next
        })
    }

    /// Shows `scene` with the samples of this render, whose schedule is `schedule`, or of a base of its
    /// mix. Fails with one of these renders if `scene` needs other samples.
    pub fn turn(
        mut self,
        scene: &Arc<Scene>,
        options: &Options,
        mut schedule: Schedule,
    ) -> Result<Render, Box<Render>> {
        let settings = schedule.settings;
        let shows = |state: &Self| state.lighting.weights(scene).is_some();
        if self.bases().any(shows) {
            while !shows(&self)
                && let Some(mix) = self.mix.take()
            {
                (self, schedule) = mix.base;
            }
            self.try_reuse(scene);
            self.set_display(options.display);
            schedule.settings = settings;
            return Ok((self, schedule));
        }
        let levels = |schedule: &Schedule| schedule.noise.map_or(f64::MAX, |n| n.rmse.levels);
        let deep = self.bases().count() >= MAX_BASES;
        let noise = levels(&schedule);
        let noisy = |base: &Schedule| !has_estimates(&schedule) || noise > SETTLED * levels(base);
        if let Some(mix) = self.mix.take_if(|mix| deep || noisy(&mix.base.1)) {
            (self, schedule) = mix.base;
        }
        let state = Self::mixed(scene, options, (self, schedule))?;
        let schedule = state.schedule(settings);
        Ok((state, schedule))
    }

    /// Compiles `scene` for a render that reuses the samples of `base`. Fails with `base` if it needs
    /// other samples or too much memory.
    fn mixed(scene: &Arc<Scene>, options: &Options, base: Render) -> Result<Self, Box<Render>> {
        let film = &base.0.film;
        let counts: Vec<_> = (0..film.tile_count()).map(|i| film.counts(i)).collect();
        if !has_estimates(&base.1) || !is_rougher(base.0.scene(), scene) {
            return Err(Box::new(base));
        }
        let mut options = options.clone();
        options.world.precision = film.header.precision;
        let state = Self::new(scene, &options, None).ok().and_then(|mut state| {
            let share = state.world.turn(&base.0.world)?;
            (state.film.header == film.header).then_some((state, share))
        });
        let Some((mut state, share)) = state else { return Err(Box::new(base)) };
        let tile = |base: [u32; 2]| {
            let meetings = u8::from(base[0] != base[1]);
            MixedTile { meetings, ends: [0; 2], done: [0; 2], base, continues: false }
        };
        let tiles = counts.into_iter().map(tile).collect();
        (0..film.tile_count()).for_each(|i| state.film.copy_tile(i, film));
        state.mix = Some(Box::new(RoughnessMix { base, share, tiles }));
        Ok(state)
    }
}

/// State and threads that trace the jobs of a wave.
struct Tracer<'a> {
    state: &'a mut RenderState,
    pool: &'a rayon::ThreadPool,
}

impl Tracer<'_> {
    /// Traces `jobs` with the whole lobe, or with its rest, whose samples have the weight `rest`.
    fn trace(
        &mut self,
        jobs: (usize, &[Job]),
        (order, weight): (usize, f64),
        cancel: &AtomicBool,
    ) -> Vec<Option<Counts>> {
        self.state.world.set_order(order);
        let sampling = *self.state.sampling();
        let RenderState { world, film, .. } = &mut *self.state;
        let context = PassContext { sampling: &sampling, pool: self.pool, cancel };
        let counts = pass::run_scaled(world, film, jobs, weight, context);
        self.state.world.set_order(0);
        counts
    }
}

impl RoughnessMix {
    /// Traces `wave` and adds its samples to the film of `state`, as `RenderState::trace_wave` does.
    pub fn trace_wave(
        &mut self,
        state: &mut RenderState,
        wave: &Wave,
        pool: &rayon::ThreadPool,
        cancel: &AtomicBool,
    ) -> WaveReport {
        let mut tracer = Tracer { state, pool };
        let mut work = vec![None; wave.jobs.len()];
        while self.trace_rest(&mut tracer, wave, cancel, &mut work) {}
        self.trace_whole(&mut tracer, wave, cancel, &mut work);
        for job in &wave.jobs {
            let tile = &mut self.tiles[job.tile as usize];
            let probed = tile.ends[0].min(tile.ends[1]) >= MIN_SAMPLES;
            tile.continues |= tile.meetings == 0 && probed;
        }
        let (film, estimator) = (&state.film, state.estimator());
        let report = |(counts, job): (&Option<Counts>, &Job)| {
            let Counts { rays, glossy, .. } = (*counts)?;
            let tile = film.tile(job.tile as usize).filter(|_| wave.estimate);
            Some(JobReport { rays, glossy, error: tile.and_then(|tile| estimator.tile(tile)) })
        };
        pool.install(|| work.par_iter().zip(&wave.jobs).map(report).collect())
    }

    /// Lets `schedule` continue the tiles that keep the samples of the base.
    pub fn continue_tiles(&self, wave: &Wave, schedule: &mut Schedule) {
        for job in wave.jobs.iter().filter(|_| wave.replicate == 1) {
            let tile = &self.tiles[job.tile as usize];
            if tile.continues && job.end() <= tile.ends[1] {
                schedule.continue_tile(job.tile as usize, &self.base.1);
            }
        }
    }

    /// Returns the first sample of `job`, of replicate `r`, that is not traced; `is_begun` is `true` if
    /// a part of the job is.
    fn next_sample(&self, job: &Job, r: usize, is_begun: bool) -> u32 {
        if is_begun { self.tiles[job.tile as usize].ends[r] } else { job.first }
    }

    /// Traces the next samples of the jobs, at most [`SAMPLE_ALIGNMENT`], that have the rest of the
    /// lobe. Returns `false` if no job has more of them.
    fn trace_rest(
        &mut self,
        tracer: &mut Tracer,
        wave: &Wave,
        cancel: &AtomicBool,
        work: &mut [Option<Counts>],
    ) -> bool {
        let r = wave.replicate;
        let is_first = work.iter().all(Option::is_none);
        let never = AtomicBool::new(false);
        let cancel = if is_first { cancel } else { &never };
        let part = |(i, job): (usize, &Job)| {
            let tile = &self.tiles[job.tile as usize];
            let first = self.next_sample(job, r, work[i].is_some());
            let count = tile.rest_count(first, job.end());
            let part = Job { first: first + tile.offset(), count, ..*job };
            (count > 0 && work[i].is_some() != is_first).then_some((tile.order(), i, part))
        };
        let parts: Vec<_> = wave.jobs.iter().enumerate().filter_map(part).collect();
        let mut again = Vec::new();
        for order in 1..=MAX_ORDER {
            // A tile that changes its order in this loop is not traced twice.
            let chosen: Vec<_> = parts.iter().filter(|part| part.0 == order).collect();
            let jobs: Vec<Job> = chosen.iter().map(|part| part.2).collect();
            for job in &jobs {
                let tile = &self.tiles[job.tile as usize];
                if tile.meetings == 0 || tile.ends == [0; 2] {
                    tracer.state.film.clear_tile(job.tile as usize);
                }
            }
            let counts = tracer.trace((r, &jobs), self.rest(order), cancel);
            for ((_, i, job), counts) in chosen.into_iter().zip(counts) {
                let index = job.tile as usize;
                let tile = &mut self.tiles[index];
                let film = &mut tracer.state.film;
                let Some(counts) = counts else {
                    if tile.meetings == 0 || tile.ends == [0; 2] {
                        film.copy_tile(index, &self.base.0.film);
                    }
                    continue;
                };
                work[*i] = Some(work[*i].map_or(counts, |sum| sum.and(counts)));
                let before = *tile;
                tile.ends[r] = job.first - tile.offset() + job.count;
                tile.done[r] = tile.ends[r];
                tile.meetings = tile.meetings.max(counts.meetings);
                let grows = tile.order() > order || before.meetings == 0 && before.ends != [0; 2];
                match tile.meetings {
                    0 => film.copy_tile(index, &self.base.0.film),
                    _ if grows => again.push((*i, index)),
                    _ => self.add_base(film, index, r, job.count),
                }
            }
        }
        while !again.is_empty() {
            again = self.trace_again(tracer, &again, work);
        }
        !parts.is_empty() && work.iter().any(Option::is_some)
    }

    /// Traces tiles again from their first samples. `again` has their jobs and numbers. Returns those
    /// whose order has grown.
    fn trace_again(
        &mut self,
        tracer: &mut Tracer,
        again: &[(usize, usize)],
        work: &mut [Option<Counts>],
    ) -> Vec<(usize, usize)> {
        again.iter().for_each(|(_, index)| tracer.state.film.clear_tile(*index));
        let orders: Vec<usize> =
            again.iter().map(|(_, index)| self.tiles[*index].order()).collect();
        let mut grown = Vec::new();
        for (order, r) in (1..=MAX_ORDER + 1).flat_map(|order| [(order, 0), (order, 1)]) {
            let of_order = again.iter().zip(&orders).filter(|(_, o)| **o == order);
            let chosen: Vec<(usize, usize)> = of_order
                .map(|(pair, _)| *pair)
                .filter(|(_, index)| self.tiles[*index].ends[r] > 0)
                .collect();
            let job = |(_, index): &(usize, usize)| {
                let tile = &self.tiles[*index];
                Job { tile: *index as u32, first: tile.offset(), count: tile.ends[r] }
            };
            let jobs: Vec<Job> = chosen.iter().map(job).collect();
            let counts = tracer.trace((r, &jobs), self.rest(order), &AtomicBool::new(false));
            for (((i, index), job), counts) in chosen.into_iter().zip(&jobs).zip(counts) {
                if order <= MAX_ORDER {
                    self.add_base(&mut tracer.state.film, index, r, job.count);
                }
                let tile = &mut self.tiles[index];
                tile.meetings = tile.meetings.max(counts.map_or(0, |counts| counts.meetings));
                if tile.order() > order && !grown.contains(&(i, index)) {
                    grown.push((i, index));
                }
                work[i] = work[i].zip(counts).map(|(sum, counts)| sum.and(counts));
            }
        }
        for r in [0, 1] {
            let follows = |(i, index): &(usize, usize)| {
                let tile = &self.tiles[*index];
                tile.done[r] > tile.ends[r] && !grown.contains(&(*i, *index))
            };
            let chosen: Vec<(usize, usize)> = again.iter().copied().filter(follows).collect();
            let job = |(_, index): &(usize, usize)| {
                let MixedTile { ends, done, .. } = self.tiles[*index];
                let first = ends[r] + self.tiles[*index].offset();
                Job { tile: *index as u32, first, count: done[r] - ends[r] }
            };
            let jobs: Vec<Job> = chosen.iter().map(job).collect();
            let counts = tracer.trace((r, &jobs), self.rest(0), &AtomicBool::new(false));
            for ((i, _), counts) in chosen.into_iter().zip(counts) {
                work[i] = work[i].zip(counts).map(|(sum, counts)| sum.and(counts));
            }
        }
        grown
    }

    /// Traces the parts of the jobs that have the whole lobe.
    fn trace_whole(
        &mut self,
        tracer: &mut Tracer,
        wave: &Wave,
        cancel: &AtomicBool,
        work: &mut [Option<Counts>],
    ) {
        let never = AtomicBool::new(false);
        // The second part of a job is not cancelled after the first.
        for (begun, cancel) in [(true, &never), (false, cancel)] {
            let selects = |i: &usize| {
                let (job, tile) = (&wave.jobs[*i], &self.tiles[wave.jobs[*i].tile as usize]);
                let first = self.next_sample(job, wave.replicate, begun);
                let is_rest = tile.rest_count(first, job.end()) > 0;
                work[*i].is_some() == begun && !is_rest && first < job.end()
            };
            let chosen: Vec<usize> = (0..wave.jobs.len()).filter(selects).collect();
            let part = |i: &usize| {
                let (job, tile) = (wave.jobs[*i], &self.tiles[wave.jobs[*i].tile as usize]);
                let first = self.next_sample(&job, wave.replicate, begun);
                Job { first: first + tile.offset(), count: job.end() - first, ..job }
            };
            let jobs: Vec<Job> = chosen.iter().map(part).collect();
            let counts = tracer.trace((wave.replicate, &jobs), (0, 1.0), cancel);
            for (i, counts) in chosen.into_iter().zip(counts) {
                let Some(counts) = counts else { continue };
                let job = wave.jobs[i];
                self.tiles[job.tile as usize].done[wave.replicate] = job.end();
                work[i] = Some(work[i].map_or(counts, |sum| sum.and(counts)));
            }
        }
    }

    /// Returns the order of samples, and their weight; those of the whole lobe if it is too large.
    fn rest(&self, order: usize) -> (usize, f64) {
        match order {
            1..=MAX_ORDER => (order, f64::from(WEIGHT) * (1.0 - self.share.powi(order as i32))),
            _ => (0, 1.0),
        }
    }

    /// Adds the base to tile `index` for `count` samples of the rest of the lobe in replicate `r`.
    fn add_base(&self, film: &mut Film, index: usize, r: usize, count: u32) {
        let Some(base) = self.base.0.film.tile(index) else { return };
        let tile = film.slots(&[index]).remove(0).prepare();
        let factor = f64::from(WEIGHT) * self.share.powi(self.tiles[index].order() as i32)
            / f64::from(base.counts[r]);
        let [width, height] = base.extent;
        for pixel in (0..height).flat_map(|y| (0..width).map(move |x| y * TILE + x)) {
            let values: Vec<i64> = base
                .pixel(r, pixel)
                .iter()
                .map(|sum| (*sum as f64 * factor).round() as i64 * i64::from(count))
                .collect();
            tile.add(r, pixel, &values);
        }
        tile.advance(r, count * (WEIGHT - 1));
    }
}
