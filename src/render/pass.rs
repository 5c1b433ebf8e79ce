//! The synchronous core: traces the jobs of one wave into the film.

use crate::film::{Estimator, Film, InvalidSample, TILE, TILE_PIXELS, Tile, TileHandle};
use crate::lanes::{Float, Mask, SimdFloat, Vec3};
use crate::render::pixel_block::PixelBlock;
use crate::render::wave::{Job, JobReport, Wave, WaveReport};
use crate::sampling::{PacketSampler, SampleBlock, SampleSettings, Sampler};
use crate::world::{AnyWorld, Counts, MAX_GROUPS, Radiance, TileCandidates, World};
use rayon::prelude::*;
use std::ops::Range;
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
        AnyWorld::Single(w) => run_typed(w, film, wave, sampling, estimator, pool, cancel),
        AnyWorld::Double(w) => run_typed(w, film, wave, sampling, estimator, pool, cancel),
    }
}

/// The same for one lane type.
pub fn run_typed<L: SimdFloat>(
    world: &World<L>,
    film: &mut Film,
    wave: &Wave,
    sampling: &SampleSettings,
    estimator: &Estimator,
    pool: &rayon::ThreadPool,
    cancel: &AtomicBool,
) -> WaveReport {
    let tracer = TileRenderer::new(world, sampling);
    let tiles: Vec<usize> = wave.jobs.iter().map(|job| job.tile as usize).collect();
    let slots = film.slots(&tiles);
    let trace = |(slot, job): (TileHandle, &Job)| {
        if cancel.load(Ordering::Relaxed) {
            return None;
        }
        let origin = slot.origin;
        let tile = slot.prepare();
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
pub(super) struct TileRenderer<'a, L: SimdFloat> {
    pub(super) world: &'a World<L>,
    pub(super) sampler: Sampler<L>,
    /// The largest radiance that the film holds, per group: 2^49 steps.
    limits: [L; MAX_GROUPS],
    /// The pixels of a tile that lies inside the picture, see [`pixels_of`].
    whole: Vec<u8>,
}

impl<'a, L: SimdFloat> TileRenderer<'a, L> {
    pub(super) fn new(world: &'a World<L>, sampling: &SampleSettings) -> Self {
        let mut limits = [L::zero(); MAX_GROUPS];
        for (limit, scale) in limits.iter_mut().zip(world.scales()) {
            *limit = L::from_f64((49f64.exp2() / scale).min(L::MAX));
        }
        Self {
            world,
            sampler: Sampler::new(*sampling, world.jitter()),
            limits,
            whole: pixels_of([TILE; 2]),
        }
    }

    /// Samples of all pixels of a tile: packets of one pixel where enough aligned samples are asked
    /// for, of several pixels elsewhere.
    fn job(&self, tile: &mut Tile, origin: [usize; 2], replicate: usize, job: &Job) -> Counts {
        let candidates = self.world.candidates(origin, tile.extent());
        if candidates.as_ref().is_some_and(|candidates| self.world.is_black(candidates)) {
            tile.advance(replicate, job.count);
            return Counts::default();
        }
        // Asked for now, they are there once the first samples are traced.
        tile.prefetch(replicate);
        let mut work = PacketScratch::new(replicate, candidates);
        let part: Vec<u8>;
        let pixels = if tile.extent() == [TILE; 2] {
            &self.whole
        } else {
            part = pixels_of(tile.extent());
            &part
        };
        let place = |pixel: &u8| {
            let pixel = usize::from(*pixel);
            ((origin[0] + pixel % TILE) as u32, (origin[1] + pixel / TILE) as u32)
        };
        let sites = self.sites(replicate, pixels.iter().map(place));
        let (mut index, end) = (job.first, job.first + job.count);
        while index < end {
            let count = samples_per_packet(index, end, L::WIDTH);
            match count {
                _ if count == L::WIDTH => {
                    let points = self.sampler.block(index, count);
                    for (i, pixel) in pixels.iter().enumerate() {
                        self.pixel(&mut work, &points, &sites, i, index);
                        self.sum(&work.radiance, |group, sums| {
                            tile.add_group(replicate, usize::from(*pixel), group, sums);
                        });
                    }
                }
                1 => self.trace_shared::<1>(tile, &mut work, &sites, pixels, index),
                2 => self.trace_shared::<2>(tile, &mut work, &sites, pixels, index),
                4 => self.trace_shared::<4>(tile, &mut work, &sites, pixels, index),
                8 => self.trace_shared::<8>(tile, &mut work, &sites, pixels, index),
                _ => unreachable!("packets are narrower than 32"),
            }
            index += count as u32;
        }
        work.bad.into_iter().for_each(|bad| tile.record_bad(bad));
        tile.record_saturated(work.saturated.len() as u64);
        tile.advance(replicate, job.count);
        work.counts
    }

    /// The samples `first..first + COUNT` of all pixels of a tile, in packets that hold as many of several.
    #[inline(never)]
    fn trace_shared<const COUNT: usize>(
        &self,
        tile: &mut Tile,
        work: &mut PacketScratch<L>,
        sites: &PixelBlock<L::Scalar>,
        pixels: &[u8],
        first: u32,
    ) {
        let points = self.sampler.block(first, COUNT);
        for packet in sites.packets(L::WIDTH / COUNT) {
            let pixels = &pixels[packet.clone()];
            self.pixels::<COUNT>(work, &points, sites, packet, first);
            let replicate = work.replicate;
            self.sum_of_each::<COUNT, _>(&work.radiance, pixels, |pixel, group, sums| {
                tile.add_group(replicate, usize::from(*pixel), group, sums);
            });
        }
    }

    /// What the samples of some pixels start from.
    pub(super) fn sites(
        &self,
        replicate: usize,
        pixels: impl Iterator<Item = (u32, u32)>,
    ) -> PixelBlock<L::Scalar> {
        PixelBlock::new(self.world.view(), &self.sampler, replicate, pixels)
    }

    /// The samples `first ..` of the pixel `i` of `sites`, into `work.radiance`.
    #[inline(always)]
    fn pixel(
        &self,
        work: &mut PacketScratch<L>,
        points: &SampleBlock<'_, L>,
        sites: &PixelBlock<L::Scalar>,
        i: usize,
        first: u32,
    ) {
        let (key, toward) = sites.broadcast(i);
        let draws = points.for_pixel(key);
        let rays = self.world.view().rays(toward, self.jitter(&draws));
        work.trace(self.world, rays, &draws, L::mask(true));
        self.check(work, |lane| (sites.at(i), first + lane as u32));
    }

    /// The samples `first..first + COUNT` of each of those pixels of `sites` that share the packet `packet`,
    /// into `work.radiance`.
    #[inline(always)]
    pub(super) fn pixels<const COUNT: usize>(
        &self,
        work: &mut PacketScratch<L>,
        points: &SampleBlock<'_, L>,
        sites: &PixelBlock<L::Scalar>,
        packet: Range<usize>,
        first: u32,
    ) {
        let (keys, toward) = sites.gather::<L, COUNT>(packet.start);
        let draws = points.for_pixels(keys);
        let rays = self.world.view().rays(toward, self.jitter(&draws));
        work.trace(self.world, rays, &draws, first_lanes::<L>(packet.len() * COUNT));
        self.check(work, |lane| {
            (sites.at(packet.start + lane / COUNT), first + (lane % COUNT) as u32)
        });
    }

    /// Where in their pixels the samples lie.
    #[inline(always)]
    fn jitter(&self, draws: &PacketSampler<'_, L>) -> (L, L) {
        if self.world.jitter() { draws.pixel() } else { (L::from_f64(0.5), L::from_f64(0.5)) }
    }

    /// Gives the sums over the lanes to `put`, by group.
    #[inline(always)]
    fn sum(&self, radiance: &Radiance<L>, mut put: impl FnMut(usize, [i64; 3])) {
        for (group, scale) in self.world.scales().iter().enumerate() {
            let value = radiance.groups[group];
            put(group, [value.x, value.y, value.z].map(|channel| channel.fixed_sum(*scale)));
        }
    }

    /// Gives the sums over the COUNT lanes of each of `pixels` to `put`, by pixel and group.
    #[inline(always)]
    pub(super) fn sum_of_each<const COUNT: usize, P>(
        &self,
        radiance: &Radiance<L>,
        pixels: &[P],
        mut put: impl FnMut(&P, usize, [i64; 3]),
    ) {
        for (group, scale) in self.world.scales().iter().enumerate() {
            let value = radiance.groups[group];
            let (x, y, z) = (value.x.fixed(*scale), value.y.fixed(*scale), value.z.fixed(*scale));
            let sums = x.chunks_exact(COUNT).zip(y.chunks_exact(COUNT)).zip(z.chunks_exact(COUNT));
            for (pixel, ((x, y), z)) in pixels.iter().zip(sums) {
                put(pixel, group, [x.iter().sum(), y.iter().sum(), z.iter().sum()]);
            }
        }
    }

    /// Makes samples what the film can hold, and records those that it cannot; `which` gives pixel and index
    /// of a lane.
    #[inline(always)]
    fn check(&self, work: &mut PacketScratch<L>, which: impl Fn(usize) -> ((u32, u32), u32)) {
        let mut good = L::mask(true);
        for (g, limit) in self.limits.iter().enumerate().take(self.world.groups()) {
            let v = work.radiance.groups[g];
            let (zero, limit) = (L::zero(), *limit);
            good = good
                & (v.x.ge(zero) & v.x.le(limit))
                & (v.y.ge(zero) & v.y.le(limit))
                & (v.z.ge(zero) & v.z.le(limit));
        }
        if !good.all() {
            self.repair(work, which);
        }
    }

    /// In each group, blackens what is NaN or negative in some channel, and takes the largest value that the
    /// film holds for what is brighter or infinite.
    #[cold]
    fn repair(&self, work: &mut PacketScratch<L>, which: impl Fn(usize) -> ((u32, u32), u32)) {
        let (mut bad, mut saturated) = (L::mask(false), L::mask(false));
        for (group, limit) in
            work.radiance.groups.iter_mut().zip(self.limits).take(self.world.groups())
        {
            let (v, zero) = (*group, L::zero());
            let light = v.x.ge(zero) & v.y.ge(zero) & v.z.ge(zero);
            bad = bad | !light;
            saturated = saturated | (light & v.max_element().gt(limit));
            *group = Vec3::new(v.x.min(limit), v.y.min(limit), v.z.min(limit)).masked(light);
        }
        for lane in (0..L::WIDTH).filter(|lane| (bad | saturated).lane(*lane)) {
            let ((x, y), index) = which(lane);
            let sample = InvalidSample { index, replicate: work.replicate as u8, y, x };
            work.bad.extend(bad.lane(lane).then_some(sample));
            work.saturated.extend(saturated.lane(lane).then_some(sample));
        }
    }
}

/// What the packets of one job share and fill.
pub(super) struct PacketScratch<L: SimdFloat> {
    replicate: usize,
    candidates: Option<TileCandidates>,
    pub(super) radiance: Radiance<L>,
    pub(super) counts: Counts,
    /// Samples that were NaN or negative in some group.
    pub(super) bad: Vec<InvalidSample>,
    /// Samples that were brighter than the film holds in some group.
    pub(super) saturated: Vec<InvalidSample>,
}

impl<L: SimdFloat> PacketScratch<L> {
    pub(super) fn new(replicate: usize, candidates: Option<TileCandidates>) -> Self {
        Self {
            replicate,
            candidates,
            radiance: Radiance { groups: [Vec3::zero(); MAX_GROUPS] },
            counts: Counts::default(),
            bad: Vec::new(),
            saturated: Vec::new(),
        }
    }

    #[inline(always)]
    fn trace(
        &mut self,
        world: &World<L>,
        rays: (Vec3<L>, Vec3<L>),
        draws: &PacketSampler<'_, L>,
        active: L::Mask,
    ) {
        let cost = world.trace(rays, self.candidates.as_ref(), draws, active, &mut self.radiance);
        self.counts.rays += cost.rays;
        self.counts.glossy |= cost.glossy;
    }
}

/// How many of the samples `first..end` of a pixel come next in one packet: a power of two that divides `first`, at
/// most `width`.
fn samples_per_packet(first: u32, end: u32, width: usize) -> usize {
    let aligned = first | width as u32;
    1 << aligned.trailing_zeros().min((end - first).ilog2())
}

/// The first `count` lanes.
fn first_lanes<L: SimdFloat>(count: usize) -> L::Mask {
    if count == L::WIDTH {
        return L::mask(true);
    }
    let lanes = L::from_fn(|lane| L::Scalar::from_f64(if lane < count { 1.0 } else { 0.0 }));
    lanes.gt(L::zero())
}

/// The pixels of a tile (numbers count row by row) in Morton order: those that share a packet are neighbours in
/// the picture, 2 x 1, 2 x 2, 4 x 2 or 4 x 4 of them.
const ORDER: [u8; TILE_PIXELS] = {
    let mut order = [0; TILE_PIXELS];
    let mut i = 0;
    while i < order.len() {
        let (mut x, mut y, mut bit) = (0, 0, 0);
        while 1 << bit < TILE {
            x |= (i >> (2 * bit) & 1) << bit;
            y |= (i >> (2 * bit + 1) & 1) << bit;
            bit += 1;
        }
        order[i] = (y * TILE + x) as u8;
        i += 1;
    }
    order
};

/// The pixels of a tile of the given extent, in [`ORDER`].
fn pixels_of([width, height]: [usize; 2]) -> Vec<u8> {
    let inside = |p: &u8| usize::from(*p) % TILE < width && usize::from(*p) / TILE < height;
    ORDER.into_iter().filter(inside).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::{Header, LightWeights};
    use crate::lanes::{Float, Single};
    use crate::sampling::SamplerKind;

    /// Samples that are no light count, add nothing, and leave the pixel finite; those that are too much of it
    /// have the most that the film holds. Other groups keep what they have.
    #[test]
    fn extreme_30_a_bad_sample_is_counted_and_leaves_the_pixel_finite() {
        let scene = crate::scene::Scene::parse(
            "light = [{ directional = { direction = [0.0, -1.0, 0.0] } }]\n\
             [background]\ncolor = [1.0, 1.0, 1.0]\n\
             [[object]]\nshape.sphere = { center = [0.0, 0.0, 0.0], radius = 1.0 }\n",
            "test",
        )
        .unwrap_or_else(|e| panic!("{e}"));
        let world = World::<Single>::new(&scene);
        assert_eq!(world.groups(), 2);
        let tracer =
            TileRenderer::new(&world, &SampleSettings { seed: 0, kind: SamplerKind::Sobol });
        let most = 49f64.exp2() / world.scales()[0];
        for (odd, left) in [
            (f64::NAN, 0.0),
            (-1.0, 0.0),
            (f64::NEG_INFINITY, 0.0),
            (f64::INFINITY, most),
            (1e30, most),
        ] {
            let (scales, precision) = (world.scales().to_vec(), "single".to_string());
            let mut film = Film::new(Header { width: 8, height: 1, scales, seed: 0, precision });
            let tile = film.slots(&[0]).remove(0).prepare();
            let mut work = PacketScratch::<Single>::new(0, None);
            work.radiance.groups[0].x =
                Single::from_fn(|i| Float::from_f64(if i == 3 { odd } else { 0.5 }));
            work.radiance.groups[1].y = Single::from_f64(0.25);
            tracer.check(&mut work, |lane| ((lane as u32, 0), 0));
            let pixels = [0, 1, 2, 3, 4, 5, 6, 7];
            tracer.sum_of_each::<1, _>(&work.radiance, &pixels, |pixel, group, sums| {
                tile.add_group(0, *pixel, group, sums);
            });
            let here = [InvalidSample { index: 0, replicate: 0, y: 0, x: 3 }];
            let recorded = if left == 0.0 { (&here[..], &[][..]) } else { (&[][..], &here[..]) };
            assert_eq!((&work.bad[..], &work.saturated[..]), recorded, "{odd}");
            work.bad.into_iter().for_each(|bad| tile.record_bad(bad));
            tile.record_saturated(work.saturated.len() as u64);
            tile.advance(0, 1);
            let of = |group| LightWeights::only(group, 2);
            assert_eq!(film.bad_samples().count + film.saturated_samples(), 1);
            assert_eq!(film.pixel(3, 0, &of(0)), [left, 0.0, 0.0], "{odd}");
            assert_eq!(film.pixel(4, 0, &of(0)), [0.5, 0.0, 0.0], "{odd}");
            assert_eq!(film.pixel(3, 0, &of(1)), [0.0, 0.25, 0.0], "{odd}");
        }
        println!("extreme 30 | both | bad samples counted, pixels finite");
    }
}
