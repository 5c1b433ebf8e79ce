//! Tracing of camera samples for the pixels of a tile. The renderer gets radiance only from these
//! functions.

use crate::culling::tile::TileCandidates;
use crate::integrator::bounce_queue::{BounceQueue, first_lanes};
use crate::integrator::path::{Counts, Path, Radiance};
use crate::pixel_block::PixelBlock;
use crate::world::World;
use std::ops::Range;
use zerkalo_kernel::lanes::{SimdFloat, Vec3};
use zerkalo_kernel::sampling::warp::disk;
use zerkalo_kernel::sampling::{PacketSampler, SampleSettings, Sampler};

/// Compiled scene and sample sequence of a picture, from which [`TileTracer`]s are created.
pub struct CameraTracer<'a, L: SimdFloat> {
    world: &'a World<L>,
    sampler: Sampler<L>,
}

impl<L: SimdFloat> World<L> {
    /// Creates the tracer of camera samples. `sampling` has the seed and the sample sequence.
    pub fn camera_tracer(&self, sampling: &SampleSettings) -> CameraTracer<'_, L> {
        CameraTracer { world: self, sampler: Sampler::new(*sampling, self.camera_dimensions()) }
    }
}

impl<L: SimdFloat> CameraTracer<'_, L> {
    /// Returns the culled rectangle of the raster with the upper left corner `origin` and the size
    /// `extent`. Returns `None` if all samples in it are black.
    pub fn tile(&self, origin: [usize; 2], extent: [usize; 2]) -> Option<CulledTile> {
        let World { culling, geometry, camera, .. } = self.world;
        let candidates = culling.candidates(geometry, camera, origin, extent);
        match &candidates {
            Some(candidates) if self.world.is_black(candidates) => None,
            _ => Some(CulledTile { candidates }),
        }
    }

    /// Creates the tracer of at most [`MAX_BLOCK_PIXELS`](crate::MAX_BLOCK_PIXELS) `pixels`, pairs
    /// of column and row, in `replicate` 0 (A) or 1 (B). `tile` must contain the pixels.
    pub fn pixels<'a>(
        &'a self,
        tile: &'a CulledTile,
        replicate: usize,
        pixels: impl Iterator<Item = (u32, u32)>,
    ) -> TileTracer<'a, L> {
        TileTracer { candidates: tile.candidates.as_ref(), ..self.scattered(replicate, pixels) }
    }

    /// Creates the tracer of `pixels` at any positions in the picture, without culling.
    pub fn scattered(
        &self,
        replicate: usize,
        pixels: impl Iterator<Item = (u32, u32)>,
    ) -> TileTracer<'_, L> {
        TileTracer {
            world: self.world,
            sampler: &self.sampler,
            candidates: None,
            pixels: PixelBlock::new(&self.world.camera, &self.sampler, replicate, pixels),
            radiance: Radiance::black(),
            queue: self.world.walks().then(|| BounceQueue::new(self.world)),
        }
    }
}

/// Rectangle of the raster with the primitives that its paths must be tested against.
pub struct CulledTile {
    /// `None` if all primitives are candidates.
    candidates: Option<TileCandidates>,
}

/// Tracer of the samples of up to [`MAX_BLOCK_PIXELS`](crate::MAX_BLOCK_PIXELS) pixels in
/// one replicate. It tests rays against the candidate primitives of the tile.
pub struct TileTracer<'a, L: SimdFloat> {
    world: &'a World<L>,
    sampler: &'a Sampler<L>,
    candidates: Option<&'a TileCandidates>,
    pixels: PixelBlock<L::Scalar>,
    radiance: Radiance<L>,
    /// Paths of diffuse bounces, if packets wait for them.
    queue: Option<BounceQueue<L>>,
}

impl<L: SimdFloat> TileTracer<'_, L> {
    /// Traces the samples `first..first + WIDTH` of every pixel and passes the radiance of each
    /// packet to `sink`, with the range of its pixels in the list of all pixels. A packet holds
    /// samples of one pixel. `first` must be a multiple of `WIDTH`.
    #[inline(always)]
    pub fn radiance(&mut self, first: u32, mut sink: impl FnMut(Range<usize>, &mut Radiance<L>)) {
        let block = self.sampler.block(first, L::WIDTH);
        for i in 0..self.pixels.len() {
            let (key, corner_direction) = self.pixels.broadcast(i);
            self.trace(corner_direction, &block.for_pixel(key), L::mask(true));
            let done = self.finished(i + 1 == self.pixels.len());
            for (number, i) in (i + 1 - done..=i).enumerate() {
                self.restore(number);
                sink(i..i + 1, &mut self.radiance);
            }
        }
    }

    /// Traces the samples `first..first + COUNT` of every pixel and passes the radiance of each
    /// packet to `sink`, with the range of its pixels in the list of all pixels. A packet holds
    /// samples of `WIDTH / COUNT` pixels; its pixel `i` occupies the `COUNT` lanes from `i * COUNT`
    /// on. `COUNT` must be a power of two below `WIDTH`, and `first` a multiple of `COUNT`.
    #[inline(always)]
    pub fn radiance_shared<const COUNT: usize>(
        &mut self,
        first: u32,
        mut sink: impl FnMut(Range<usize>, &mut Radiance<L>),
    ) {
        let block = self.sampler.block(first, COUNT);
        let packets = self.pixels.packets(L::WIDTH / COUNT);
        for (i, pixels) in packets.clone().enumerate() {
            let (keys, corner_directions) = self.pixels.gather::<L, COUNT>(pixels.start);
            let active = first_lanes::<L>(pixels.len() * COUNT);
            self.trace(corner_directions, &block.for_pixels(keys), active);
            let done = self.finished(pixels.end == self.pixels.len());
            for (number, pixels) in packets.clone().skip(i + 1 - done).take(done).enumerate() {
                self.restore(number);
                sink(pixels, &mut self.radiance);
            }
        }
    }

    /// Returns the number of packets that are complete: the last one that was traced, or the last ones
    /// if they waited for their paths in the queue. `is_last` is `true` at the last packet.
    #[inline(always)]
    fn finished(&mut self, is_last: bool) -> usize {
        let Some(queue) = &mut self.queue else { return 1 };
        queue.finished(self.world, self.sampler, is_last, &mut self.radiance)
    }

    /// Restores the radiance of packet number `number` among those that are complete.
    #[inline(always)]
    fn restore(&mut self, number: usize) {
        if let Some(queue) = &self.queue {
            queue.restore(number, self.world.info.scales.len(), &mut self.radiance);
        }
    }

    /// Returns the work of all packets that were traced so far.
    pub fn counts(&self) -> Counts {
        self.radiance.counts
    }

    #[inline(always)]
    fn trace(
        &mut self,
        corner_directions: Vec3<L>,
        sampler: &PacketSampler<'_, L>,
        active: L::Mask,
    ) {
        let world = self.world;
        let center = L::from_f64(0.5);
        let offset = if world.jitter { sampler.pixel() } else { (center, center) };
        let camera = &world.camera;
        let mut path = Path::new(camera.rays(corner_directions, offset));
        if let Some(lens) = &camera.lens {
            let (u, v) = sampler.lens();
            let (x, y, _) = disk(u, v);
            path.ray = camera.lens_rays(lens, corner_directions, offset, (x, y));
        }
        let out = &mut self.radiance;
        world.trace(&mut path, self.candidates, sampler, active, out, self.queue.as_mut());
    }
}
