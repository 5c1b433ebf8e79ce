//! The synchronous core: traces the jobs of one wave into the film.

use super::wave::{Job, JobReport, Wave, WaveReport};
use crate::film::{BadSample, Estimator, Film, Slot, TILE, Tile};
use crate::lanes::{Lanes, MAX_WIDTH, Mask, Real, V3};
use crate::sampling::{Draws, Points, SampleSettings, Sampler};
use crate::world::{AnyWorld, Counts, MAX_GROUPS, Outlook, Radiance, World};
use rayon::prelude::*;
use std::sync::atomic::{AtomicBool, Ordering};

/// Traces the jobs of `wave` into `film`, on `pool`. A job that has not begun when `cancel` is raised
/// is left out and says so.
pub fn run(
    world: &AnyWorld,
    film: &mut Film,
    wave: &Wave,
    sampling: &SampleSettings,
    estimator: &Estimator,
    pool: &rayon::ThreadPool,
    cancel: &AtomicBool,
) -> WaveReport {
    match world {
        AnyWorld::Single(w) => run_in(w, film, wave, sampling, estimator, pool, cancel),
        AnyWorld::Double(w) => run_in(w, film, wave, sampling, estimator, pool, cancel),
    }
}

/// The same for one lane type.
pub fn run_in<L: Lanes>(
    world: &World<L>,
    film: &mut Film,
    wave: &Wave,
    sampling: &SampleSettings,
    estimator: &Estimator,
    pool: &rayon::ThreadPool,
    cancel: &AtomicBool,
) -> WaveReport {
    let tracer = Tracer::new(world, sampling);
    let tiles: Vec<usize> = wave.jobs.iter().map(|job| job.tile as usize).collect();
    let slots = film.slots(&tiles);
    let trace = |(slot, job): (Slot, &Job)| {
        if cancel.load(Ordering::Relaxed) {
            return None;
        }
        let origin = slot.origin;
        let tile = slot.open();
        let counts = tracer.job(tile, origin, wave.replicate, job);
        let error = if wave.estimate { estimator.tile(tile) } else { None };
        Some(JobReport { rays: counts.rays, glossy: counts.glossy, error })
    };
    // Without a pool's hand-over, one thread traces where it stands.
    let reports = if pool.current_num_threads() == 1 && slots.len() == 1 {
        slots.into_iter().zip(&wave.jobs).map(trace).collect()
    } else {
        pool.install(|| slots.into_par_iter().zip(&wave.jobs).with_max_len(1).map(trace).collect())
    };
    WaveReport { reports }
}

/// A world with the sample sequence and what else all jobs share.
pub(super) struct Tracer<'a, L: Lanes> {
    pub(super) world: &'a World<L>,
    pub(super) sampler: Sampler<L>,
    /// Radiance beyond this cannot be told from a fault, per group: 2^49 steps of the film.
    limits: [L; MAX_GROUPS],
    /// The pixels of a tile that lies inside the picture, see [`blocks`].
    whole: Vec<(usize, usize)>,
}

impl<'a, L: Lanes> Tracer<'a, L> {
    pub(super) fn new(world: &'a World<L>, sampling: &SampleSettings) -> Self {
        let mut limits = [L::zero(); MAX_GROUPS];
        for (limit, scale) in limits.iter_mut().zip(world.scales()) {
            *limit = L::of((49f64.exp2() / scale).min(L::MAX));
        }
        Self {
            world,
            sampler: Sampler::new(*sampling, world.jitter()),
            limits,
            whole: blocks([TILE; 2]),
        }
    }

    /// Samples of all pixels of a tile: packets of one pixel where enough aligned samples are asked
    /// for, of several pixels at one index elsewhere.
    fn job(&self, tile: &mut Tile, origin: [usize; 2], replicate: usize, job: &Job) -> Counts {
        let outlook = self.world.outlook(origin, tile.extent());
        if outlook.as_ref().is_some_and(|outlook| self.world.is_black(outlook)) {
            tile.advance(replicate, job.count);
            return Counts::default();
        }
        let mut work = Work::new(replicate, outlook);
        let width = L::WIDTH as u32;
        let end = job.first + job.count;
        let part: Vec<(usize, usize)>;
        let pixels = if tile.extent() == [TILE; 2] {
            &self.whole
        } else {
            part = blocks(tile.extent());
            &part
        };
        let place = |(x, y): (usize, usize)| ((origin[0] + x) as u32, (origin[1] + y) as u32);
        let mut index = job.first;
        while index < end {
            if index.is_multiple_of(width) && end - index >= width {
                let points = self.sampler.aligned(index);
                for (x, y) in pixels {
                    self.pixel(&mut work, &points, place((*x, *y)), index);
                    self.sum(&work.radiance, |group, sums| {
                        tile.add_group(replicate, y * TILE + x, group, sums);
                    });
                }
                index += width;
            } else {
                let points = self.sampler.at(index);
                for packet in pixels.chunks(L::WIDTH) {
                    let at = |lane: usize| place(packet[lane.min(packet.len() - 1)]);
                    self.pixels(&mut work, &points, packet.len(), at, index);
                    self.scatter(&work.radiance, packet.len(), |lane, group, values| {
                        let (x, y) = packet[lane];
                        tile.add_group(replicate, y * TILE + x, group, values);
                    });
                }
                index += 1;
            }
        }
        work.bad.into_iter().for_each(|bad| tile.record_bad(bad));
        tile.advance(replicate, job.count);
        work.counts
    }

    /// The samples `first ..` of one pixel, into `work.radiance`.
    #[inline(always)]
    fn pixel(&self, work: &mut Work<L>, points: &Points<'_, L>, at: (u32, u32), first: u32) {
        let draws = points.of_pixel(at, work.replicate);
        let rays = self.world.view().rays_of(at, self.jitter(&draws));
        work.trace(self.world, rays, &draws, L::mask(true));
        self.take_out_bad(work, |lane| (at, first + lane as u32));
    }

    /// Sample `index` of the first `count` pixels that `at` names, into `work.radiance`.
    #[inline(always)]
    pub(super) fn pixels(
        &self,
        work: &mut Work<L>,
        points: &Points<'_, L>,
        count: usize,
        at: impl Fn(usize) -> (u32, u32),
        index: u32,
    ) {
        let draws = points.of_pixels(&at, work.replicate);
        let rays = self.world.view().rays(&at, self.jitter(&draws));
        let lanes = L::from_fn(|lane| L::Scalar::of(if lane < count { 1.0 } else { 0.0 }));
        work.trace(self.world, rays, &draws, lanes.gt(L::zero()));
        self.take_out_bad(work, |lane| (at(lane), index));
    }

    /// Where in their pixels the samples lie.
    #[inline(always)]
    fn jitter(&self, draws: &Draws<'_, L>) -> (L, L) {
        if self.world.jitter() { draws.pixel() } else { (L::of(0.5), L::of(0.5)) }
    }

    /// Gives the sums over the lanes to `put`, by group.
    #[inline(always)]
    fn sum(&self, radiance: &Radiance<L>, mut put: impl FnMut(usize, [i64; 3])) {
        for (group, scale) in self.world.scales().iter().enumerate() {
            let value = radiance.groups[group];
            put(group, [value.x, value.y, value.z].map(|channel| channel.fixed_sum(*scale)));
        }
    }

    /// Gives the samples of the first `count` lanes to `put`, by lane and group.
    #[inline(always)]
    pub(super) fn scatter(
        &self,
        radiance: &Radiance<L>,
        count: usize,
        mut put: impl FnMut(usize, usize, [i64; 3]),
    ) {
        for (group, scale) in self.world.scales().iter().enumerate() {
            let value = radiance.groups[group];
            let mut channels = [[0; MAX_WIDTH]; 3];
            value.x.fixed(*scale, &mut channels[0]);
            value.y.fixed(*scale, &mut channels[1]);
            value.z.fixed(*scale, &mut channels[2]);
            (0..count).for_each(|lane| put(lane, group, channels.map(|channel| channel[lane])));
        }
    }

    /// Blackens samples that are NaN, infinite, negative or beyond what the film holds, and records
    /// them; `which` gives pixel and index of a lane.
    #[inline(always)]
    fn take_out_bad(&self, work: &mut Work<L>, which: impl Fn(usize) -> ((u32, u32), u32)) {
        let radiance = &mut work.radiance;
        let mut good = L::mask(true);
        for (g, limit) in self.limits.iter().enumerate().take(self.world.groups()) {
            let v = radiance.groups[g];
            let (zero, limit) = (L::zero(), *limit);
            good = good
                & (v.x.ge(zero) & v.x.le(limit))
                & (v.y.ge(zero) & v.y.le(limit))
                & (v.z.ge(zero) & v.z.le(limit));
        }
        if good.all() {
            return;
        }
        for group in &mut radiance.groups[..self.world.groups()] {
            *group = group.only(good);
        }
        for lane in (0..L::WIDTH).filter(|lane| !good.lane(*lane)) {
            let ((x, y), index) = which(lane);
            work.bad.push(BadSample { index, replicate: work.replicate as u8, y, x });
        }
    }
}

/// What the packets of one job share and fill.
pub(super) struct Work<L: Lanes> {
    replicate: usize,
    outlook: Option<Outlook>,
    pub(super) radiance: Radiance<L>,
    pub(super) counts: Counts,
    pub(super) bad: Vec<BadSample>,
}

impl<L: Lanes> Work<L> {
    pub(super) fn new(replicate: usize, outlook: Option<Outlook>) -> Self {
        let radiance = Radiance { groups: [V3::zero(); MAX_GROUPS] };
        Self { replicate, outlook, radiance, counts: Counts::default(), bad: Vec::new() }
    }

    #[inline(always)]
    fn trace(
        &mut self,
        world: &World<L>,
        rays: (V3<L>, V3<L>),
        draws: &Draws<'_, L>,
        active: L::Mask,
    ) {
        let cost = world.trace(rays, self.outlook.as_ref(), draws, active, &mut self.radiance);
        self.counts.rays += cost.rays;
        self.counts.glossy |= cost.glossy;
    }
}

/// The pixels of a tile in an order in which neighbours in the list are neighbours in the picture:
/// blocks of 4 x 2.
const ORDER: [(u8, u8); TILE * TILE] = {
    let mut order = [(0, 0); TILE * TILE];
    let mut i = 0;
    while i < order.len() {
        let (block, within) = (i / 8, i % 8);
        let (x, y) = (4 * (block % 4) + within % 4, 2 * (block / 4) + within / 4);
        order[i] = (x as u8, y as u8);
        i += 1;
    }
    order
};

/// The pixels of a tile of the given extent, in [`ORDER`].
fn blocks([width, height]: [usize; 2]) -> Vec<(usize, usize)> {
    let pixels = ORDER.iter().map(|(x, y)| (usize::from(*x), usize::from(*y)));
    pixels.filter(|(x, y)| *x < width && *y < height).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::{Header, Mix};
    use crate::lanes::{Real, Single};
    use crate::sampling::SamplerKind;
    use crate::scene::built_in;

    /// Samples that are no light count, add nothing, and leave the pixel finite.
    #[test]
    fn extreme_30_a_bad_sample_is_counted_and_leaves_the_pixel_finite() {
        let world = World::<Single>::new(&built_in());
        let tracer = Tracer::new(&world, &SampleSettings { seed: 0, kind: SamplerKind::Sobol });
        for bad in [f64::NAN, f64::INFINITY, -1.0, 1e30] {
            let (scales, precision) = (world.scales().to_vec(), Single::NAME.to_string());
            let mut film = Film::new(Header { width: 8, height: 1, scales, seed: 0, precision });
            let tile = film.slots(&[0]).remove(0).open();
            let mut work = Work::<Single>::new(0, None);
            work.radiance.groups[0].x =
                Single::from_fn(|i| Real::of(if i == 3 { bad } else { 0.5 }));
            tracer.take_out_bad(&mut work, |lane| ((lane as u32, 0), 0));
            let put = |lane, group, values| tile.add_group(0, lane, group, values);
            tracer.scatter(&work.radiance, 8, put);
            assert_eq!(work.bad, [BadSample { index: 0, replicate: 0, y: 0, x: 3 }], "{bad}");
            work.bad.into_iter().for_each(|bad| tile.record_bad(bad));
            tile.advance(0, 1);
            let mix = Mix::only(0, film.groups());
            assert_eq!(film.bad_samples().count, 1);
            assert_eq!(film.pixel(3, 0, &mix), [0.0; 3], "{bad}");
            assert_eq!(film.pixel(4, 0, &mix), [0.5, 0.0, 0.0], "{bad}");
        }
        println!("extreme 30 | both | bad samples counted, pixels finite");
    }
}
