//! Pass: traces the jobs of one wave and adds their samples to the film. The pass returns when all
//! jobs are done or cancelled.

use crate::film::{Estimator, Film, SampleFault, TILE, TILE_PIXELS, Tile, TileHandle};
use crate::schedule::SAMPLE_ALIGNMENT;
use crate::wave::{Job, JobReport, Wave, WaveReport};
use rayon::prelude::*;
use std::ops::Range;
use std::sync::atomic::{AtomicBool, Ordering};
use zerkalo_kernel::lanes::{Mask, SimdFloat, Vec3};
use zerkalo_kernel::sampling::SampleSettings;
use zerkalo_world::{
    AnyWorld, CameraTracer, Counts, CulledTile, MAX_BLOCK_PIXELS, MAX_GROUPS, Radiance, TileTracer,
    World,
};

const _: () = assert!(TILE_PIXELS <= MAX_BLOCK_PIXELS);

/// Smallest number of samples, over all pixels, that an idle thread takes over from another: a
/// tenth of a millisecond in simple scenes.
const SHARED_SAMPLES: usize = 1024;

/// Inputs that all jobs of a pass share.
#[derive(Clone, Copy)]
pub struct PassContext<'a> {
    pub sampling: &'a SampleSettings,
    pub pool: &'a rayon::ThreadPool,
    /// Request to cancel the pass: once it is `true`, no further job starts.
    pub cancel: &'a AtomicBool,
}

/// Traces the jobs of `wave` and adds their samples to `film`. `estimator` computes the errors of
/// tiles if `wave.estimate` is set.
pub fn run(
    world: &AnyWorld,
    film: &mut Film,
    wave: &Wave,
    estimator: &Estimator,
    context: PassContext,
) -> WaveReport {
    match world {
        AnyWorld::Single(world) => run_typed(world, film, wave, estimator, context),
        AnyWorld::Double(world) => run_typed(world, film, wave, estimator, context),
    }
}

/// Traces the jobs of `wave` as [`run`] does, for one SIMD type.
pub fn run_typed<L: SimdFloat>(
    world: &World<L>,
    film: &mut Film,
    wave: &Wave,
    estimator: &Estimator,
    context: PassContext,
) -> WaveReport {
    let renderer = TileRenderer::new(world, &context);
    renderer.jobs(film, (wave.replicate, &wave.jobs), context, |tile, counts| {
        let error = if wave.estimate { estimator.tile(tile) } else { None };
        JobReport { rays: counts.rays, glossy: counts.glossy, error }
    })
}

/// Traces the samples of `jobs` in `replicate` and adds them to `film`, multiplied by `factor`.
/// Returns the work of each job; `None` if it was cancelled.
pub(super) fn run_scaled(
    world: &AnyWorld,
    film: &mut Film,
    jobs: (usize, &[Job]),
    factor: f64,
    context: PassContext,
) -> Vec<Option<Counts>> {
    fn typed<L: SimdFloat>(
        world: &World<L>,
        film: &mut Film,
        jobs: (usize, &[Job]),
        factor: f64,
        context: PassContext,
    ) -> Vec<Option<Counts>> {
        let mut renderer = TileRenderer::new(world, &context);
        renderer.scales.iter_mut().for_each(|scale| *scale *= factor);
        renderer.jobs(film, jobs, context, |_, counts| counts)
    }
    match world {
        AnyWorld::Single(world) => typed(world, film, jobs, factor, context),
        AnyWorld::Double(world) => typed(world, film, jobs, factor, context),
    }
}

/// Tracer and film limits, which all jobs of a pass share.
pub(super) struct TileRenderer<'a, L: SimdFloat> {
    pub(super) tracer: CameraTracer<'a, L>,
    /// Scale of each light group: integer steps of the film per unit of radiance.
    scales: Vec<f64>,
    /// Largest radiance of one sample that the film can hold, for each light group: 2^49 steps.
    limits: [L; MAX_GROUPS],
    /// Result of [`pixels_of`] for a tile that is entirely inside the picture.
    whole_tile: Vec<u8>,
    /// `true` if idle threads take over a part of a job.
    divides: bool,
}

/// Tile and samples of a job.
struct Site {
    culled: CulledTile,
    /// Column and row of the tile's upper left pixel in the picture.
    origin: [usize; 2],
    replicate: usize,
    /// Indices of the samples of each pixel.
    samples: Range<u32>,
}

impl<'a, L: SimdFloat> TileRenderer<'a, L> {
    pub(super) fn new(world: &'a World<L>, context: &PassContext) -> Self {
        let mut limits = [L::zero(); MAX_GROUPS];
        for (limit, scale) in limits.iter_mut().zip(&world.info.scales) {
            *limit = L::from_f64((49f64.exp2() / scale).min(L::MAX));
        }
        Self {
            tracer: world.camera_tracer(context.sampling),
            scales: world.info.scales.clone(),
            limits,
            whole_tile: pixels_of([TILE; 2]),
            divides: context.pool.current_num_threads() > 1,
        }
    }

    /// Traces `jobs` of one replicate, each for one tile of `film`. Returns what `report` makes of the
    /// tile and the work of each job; `None` if it was cancelled.
    fn jobs<R: Send>(
        &self,
        film: &mut Film,
        (replicate, jobs): (usize, &[Job]),
        PassContext { pool, cancel, .. }: PassContext,
        report: impl Fn(&Tile, Counts) -> R + Sync,
    ) -> Vec<Option<R>> {
        let tiles: Vec<usize> = jobs.iter().map(|job| job.tile as usize).collect();
        let slots = film.slots(&tiles);
        let trace = |(slot, job): (TileHandle, &Job)| {
            if cancel.load(Ordering::Relaxed) {
                return None;
            }
            let origin = slot.origin;
            let tile = slot.prepare();
            let counts = self.job(tile, origin, replicate, job);
            Some(report(tile, counts))
        };
        // If the pool has one thread and there is one job, the calling thread traces the job. This
        // avoids a switch of threads.
        if pool.current_num_threads() == 1 && slots.len() == 1 {
            slots.into_iter().zip(jobs).map(trace).collect()
        } else {
            pool.install(|| slots.into_par_iter().zip(jobs).with_max_len(1).map(trace).collect())
        }
    }

    /// Traces the samples of `job` and adds them to `tile`, whose first pixel is at `origin`.
    fn job(&self, tile: &mut Tile, origin: [usize; 2], replicate: usize, job: &Job) -> Counts {
        let partial_tile: Vec<u8>;
        let pixels = if tile.extent == [TILE; 2] {
            &self.whole_tile
        } else {
            partial_tile = pixels_of(tile.extent);
            &partial_tile
        };
        let counts = match self.tracer.tile(origin, tile.extent) {
            Some(culled) => {
                // The tile's sums are loaded into the cache while the first samples are traced.
                tile.prefetch(replicate);
                let samples = job.first..job.end();
                self.trace(tile, &Site { culled, origin, replicate, samples }, pixels)
            }
            None => Counts::default(),
        };
        tile.advance(replicate, job.count);
        counts
    }

    /// Traces the samples of `pixels` and adds them to `tile`. If a thread is idle, it traces the
    /// second half of the pixels into a tile of its own.
    fn trace(&self, tile: &mut Tile, site: &Site, pixels: &[u8]) -> Counts {
        let middle = (pixels.len() / 2).next_multiple_of(SAMPLE_ALIGNMENT as usize);
        if !self.divides || middle * site.samples.len() < SHARED_SAMPLES || middle >= pixels.len() {
            return self.trace_undivided(tile, site, pixels);
        }
        let (first, second) = pixels.split_at(middle);
        let extent = tile.extent;
        let (counts, taken) = rayon::join_context(
            |_| self.trace(tile, site, first),
            |context| {
                context.migrated().then(|| {
                    let mut own = Tile::blank(self.scales.len(), extent);
                    let counts = self.trace(&mut own, site, second);
                    (own, counts)
                })
            },
        );
        let others = match taken {
            Some((own, counts)) => {
                tile.add_tile(&own);
                counts
            }
            None => self.trace(tile, site, second),
        };
        counts.and(others)
    }

    /// Traces the samples of `pixels` and adds them to `tile`. A packet holds `WIDTH` samples of
    /// one pixel if its first sample index is a multiple of `WIDTH` and at least `WIDTH` samples
    /// remain. Otherwise it holds fewer samples of each of several pixels.
    fn trace_undivided(&self, tile: &mut Tile, site: &Site, pixels: &[u8]) -> Counts {
        let Site { culled, origin, replicate, samples } = site;
        let position = |pixel: &u8| {
            let pixel = usize::from(*pixel);
            ((origin[0] + pixel % TILE) as u32, (origin[1] + pixel / TILE) as u32)
        };
        let mut tracer = self.tracer.pixels(culled, *replicate, pixels.iter().map(position));
        let mut index = samples.start;
        while index < samples.end {
            let count = samples_per_packet(index, samples.end, L::WIDTH);
            match count {
                _ if count == L::WIDTH => tracer.radiance(index, |packet, radiance| {
                    self.replace_faults(radiance, |_, fault| tile.count_fault(fault));
                    let pixel = usize::from(pixels[packet.start]);
                    self.sum(radiance, |group, sums| {
                        tile.add_group(*replicate, pixel, group, sums);
                    });
                }),
                1 => self.trace_shared::<1>(tile, &mut tracer, *replicate, pixels, index),
                2 => self.trace_shared::<2>(tile, &mut tracer, *replicate, pixels, index),
                4 => self.trace_shared::<4>(tile, &mut tracer, *replicate, pixels, index),
                8 => self.trace_shared::<8>(tile, &mut tracer, *replicate, pixels, index),
                _ => unreachable!("packets are narrower than 32"),
            }
            index += count as u32;
        }
        tracer.counts()
    }

    /// Traces the samples `first..first + COUNT` of `pixels` in packets of several pixels.
    #[inline(never)]
    fn trace_shared<const COUNT: usize>(
        &self,
        tile: &mut Tile,
        tracer: &mut TileTracer<L>,
        replicate: usize,
        pixels: &[u8],
        first: u32,
    ) {
        tracer.radiance_shared::<COUNT>(first, |packet, radiance| {
            self.replace_faults(radiance, |_, fault| tile.count_fault(fault));
            let pixels = &pixels[packet];
            self.sum_by_pixel::<COUNT, _>(radiance, pixels, |pixel, group, sums| {
                tile.add_group(replicate, usize::from(*pixel), group, sums);
            });
        });
    }

    /// Sums the radiance of each light group over all lanes, in integer steps of the film. Calls
    /// `add(group, sums)` with red, green and blue.
    #[inline(always)]
    fn sum(&self, radiance: &Radiance<L>, mut add: impl FnMut(usize, [i64; 3])) {
        for (group, scale) in self.scales.iter().enumerate() {
            let value = radiance.groups[group];
            add(group, [value.x, value.y, value.z].map(|channel| channel.fixed_sum(*scale)));
        }
    }

    /// Sums the radiance of each light group over the `COUNT` consecutive lanes of each pixel, in
    /// integer steps of the film. Calls `add(pixel, group, sums)` with red, green and blue.
    #[inline(always)]
    pub(super) fn sum_by_pixel<const COUNT: usize, P>(
        &self,
        radiance: &Radiance<L>,
        pixels: &[P],
        mut add: impl FnMut(&P, usize, [i64; 3]),
    ) {
        for (group, scale) in self.scales.iter().enumerate() {
            let value = radiance.groups[group];
            let (x, y, z) = (value.x.fixed(*scale), value.y.fixed(*scale), value.z.fixed(*scale));
            let sums = x.chunks_exact(COUNT).zip(y.chunks_exact(COUNT)).zip(z.chunks_exact(COUNT));
            for (pixel, ((x, y), z)) in pixels.iter().zip(sums) {
                add(pixel, group, [x.iter().sum(), y.iter().sum(), z.iter().sum()]);
            }
        }
    }

    /// Replaces the samples that the film cannot hold. Calls `count(lane, fault)` for each of them.
    /// Valid samples cost only a comparison.
    #[inline(always)]
    pub(super) fn replace_faults(
        &self,
        radiance: &mut Radiance<L>,
        count: impl FnMut(usize, SampleFault),
    ) {
        let mut valid = L::mask(true);
        for (group, limit) in self.limits.iter().enumerate().take(self.scales.len()) {
            let v = radiance.groups[group];
            let (zero, limit) = (L::zero(), *limit);
            valid = valid
                & (v.x.ge(zero) & v.x.le(limit))
                & (v.y.ge(zero) & v.y.le(limit))
                & (v.z.ge(zero) & v.z.le(limit));
        }
        if !valid.all() {
            self.replace_found_faults(radiance, count);
        }
    }

    /// Implements [`Self::replace_faults`] for a packet with a fault. A light group in which a
    /// channel is NaN or negative becomes black. A channel above the limit, even an infinite one,
    /// is reduced to the limit.
    #[cold]
    fn replace_found_faults(
        &self,
        radiance: &mut Radiance<L>,
        mut count: impl FnMut(usize, SampleFault),
    ) {
        let (mut bad, mut saturated) = (L::mask(false), L::mask(false));
        for (group, limit) in radiance.groups.iter_mut().zip(self.limits).take(self.scales.len()) {
            let (v, zero) = (*group, L::zero());
            let valid = v.x.ge(zero) & v.y.ge(zero) & v.z.ge(zero);
            bad = bad | !valid;
            saturated = saturated | (valid & v.max_element().gt(limit));
            *group = Vec3::new(v.x.min(limit), v.y.min(limit), v.z.min(limit)).masked(valid);
        }
        for (lanes, fault) in [(bad, SampleFault::Invalid), (saturated, SampleFault::Saturated)] {
            (0..L::WIDTH).filter(|lane| lanes.lane(*lane)).for_each(|lane| count(lane, fault));
        }
    }
}

/// Returns the number of samples of one pixel in the next packet: the largest power of two, at most
/// `width`, that divides `first` and fits into `first..end`.
fn samples_per_packet(first: u32, end: u32, width: usize) -> usize {
    let aligned = first | width as u32;
    1 << aligned.trailing_zeros().min((end - first).ilog2())
}

/// Indices of a tile's pixels, counted row by row, in the order of a Morton curve. The pixels of a
/// packet form a block of 2 x 1, 2 x 2, 4 x 2 or 4 x 4.
const MORTON_ORDER: [u8; TILE_PIXELS] = {
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

/// Returns the pixels of a tile of the given size in [`MORTON_ORDER`].
fn pixels_of([width, height]: [usize; 2]) -> Vec<u8> {
    let inside = |p: &u8| usize::from(*p) % TILE < width && usize::from(*p) / TILE < height;
    MORTON_ORDER.into_iter().filter(inside).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::Header;
    use crate::film::testing::TestFilm;
    use zerkalo_kernel::lanes::{Float, Single};
    use zerkalo_kernel::sampling::SamplerKind;
    use zerkalo_world::Precision;

    /// Checks that invalid samples are counted and stored as black, and that samples above the
    /// largest value of the film are stored as this value. The sums of other light groups are not
    /// affected.
    #[test]
    fn extreme_30_a_bad_sample_is_counted_and_leaves_the_pixel_finite() {
        let scene = zerkalo_scene::Scene::parse(
            "light = [{ directional = { direction = [0.0, -1.0, 0.0] } }]\n\
             [background]\ncolor = [1.0, 1.0, 1.0]\n\
             [[object]]\nshape.sphere = { center = [0.0, 0.0, 0.0], radius = 1.0 }\n",
            "test",
        )
        .unwrap_or_else(|e| panic!("{e}"));
        let world = World::<Single>::new(&scene);
        assert_eq!(world.info.scales.len(), 2);
        let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
        let sampling = &SampleSettings { seed: 0, kind: SamplerKind::Sobol };
        let cancel = &AtomicBool::new(false);
        let renderer = TileRenderer::new(&world, &PassContext { sampling, pool: &pool, cancel });
        let limit = 49f64.exp2() / world.info.scales[0];
        for (value, stored) in [
            (f64::NAN, 0.0),
            (-1.0, 0.0),
            (f64::NEG_INFINITY, 0.0),
            (f64::INFINITY, limit),
            (1e30, limit),
        ] {
            let (scales, precision) = (world.info.scales.clone(), Precision::Single);
            let mut film = Film::new(Header { width: 8, height: 1, scales, seed: 0, precision });
            let tile = film.slots(&[0]).remove(0).prepare();
            let mut faults = Vec::new();
            let mut radiance = Radiance::<Single>::black();
            radiance.groups[0].x =
                Single::from_fn(|i| Float::from_f64(if i == 3 { value } else { 0.5 }));
            radiance.groups[1].y = Single::from_f64(0.25);
            renderer.replace_faults(&mut radiance, |lane, fault| faults.push((lane, fault)));
            let pixels = [0, 1, 2, 3, 4, 5, 6, 7];
            renderer.sum_by_pixel::<1, _>(&radiance, &pixels, |pixel, group, sums| {
                tile.add_group(0, *pixel, group, sums);
            });
            let fault = match stored {
                0.0 => SampleFault::Invalid,
                _ => SampleFault::Saturated,
            };
            assert_eq!(faults, [(3, fault)], "{value}");
            tile.count_fault(fault);
            tile.advance(0, 1);
            let only = |group| crate::film::testing::only(group, 2);
            assert_eq!(film.bad_samples() + film.saturated_samples(), 1);
            assert_eq!(film.pixel(3, 0, &only(0)), [stored, 0.0, 0.0], "{value}");
            assert_eq!(film.pixel(4, 0, &only(0)), [0.5, 0.0, 0.0], "{value}");
            assert_eq!(film.pixel(3, 0, &only(1)), [0.0, 0.25, 0.0], "{value}");
        }
        println!("extreme 30 | both | bad samples counted, pixels finite");
    }
}
