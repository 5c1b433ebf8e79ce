//! Tracing of camera samples for the pixels of a tile. The renderer gets radiance only from these
//! functions.

use crate::culling::tile::TileCandidates;
use crate::integrator::path::{Counts, Path, Radiance};
use crate::light_groups::MAX_GROUPS;
use crate::pixel_block::PixelBlock;
use crate::world::World;
use std::ops::Range;
use zerkalo_kernel::bvh::Ray;
use zerkalo_kernel::lanes::{Float, SimdFloat, Vec3};
use zerkalo_kernel::sampling::warp::disk;
use zerkalo_kernel::sampling::{PacketSampler, SampleSettings, Sampler};

/// Compiled scene and sample sequence of a picture, from which [`TileTracer`]s are created.
pub struct CameraTracer<'a, L: SimdFloat> {
    world: &'a World<L>,
    sampler: Sampler<L>,
}

impl<'a, L: SimdFloat> CameraTracer<'a, L> {
    pub(super) fn new(world: &'a World<L>, sampling: &SampleSettings) -> Self {
        Self { world, sampler: Sampler::new(*sampling, world.camera_dimensions()) }
    }

    /// Creates the tracer of `pixels`. `replicate` is 0 for replicate A, 1 for replicate B; each
    /// has half of the samples. `pixels` has at most
    /// [`MAX_BLOCK_PIXELS`](crate::MAX_BLOCK_PIXELS) pairs of column and row. All pixels
    /// must be in the rectangle of the raster with the upper left corner `origin` and the size
    /// `extent`, because culling uses this rectangle. Returns `None` if all samples in the
    /// rectangle are black: no camera ray can hit a primitive, no light with a size and no
    /// environment is visible, and the background is black.
    pub fn tile(
        &self,
        replicate: usize,
        (origin, extent): ([usize; 2], [usize; 2]),
        pixels: impl Iterator<Item = (u32, u32)>,
    ) -> Option<TileTracer<'_, L>> {
        let candidates = self.world.candidates(origin, extent);
        if candidates.as_ref().is_some_and(|candidates| self.world.is_black(candidates)) {
            return None;
        }
        Some(TileTracer { candidates, ..self.scattered(replicate, pixels) })
    }

    /// Creates the tracer of `pixels` at any positions in the picture, without culling. `replicate`
    /// is 0 for replicate A, 1 for replicate B; each has half of the samples.
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
            radiance: Radiance { groups: [Vec3::zero(); MAX_GROUPS] },
            counts: Counts::default(),
        }
    }
}

/// Tracer of the samples of up to [`MAX_BLOCK_PIXELS`](crate::MAX_BLOCK_PIXELS) pixels in
/// one replicate (half of the samples). It tests rays against the candidate primitives of the tile.
pub struct TileTracer<'a, L: SimdFloat> {
    world: &'a World<L>,
    sampler: &'a Sampler<L>,
    candidates: Option<TileCandidates>,
    pixels: PixelBlock<L::Scalar>,
    radiance: Radiance<L>,
    counts: Counts,
}

impl<L: SimdFloat> TileTracer<'_, L> {
    /// Traces the samples `first..first + WIDTH` of every pixel and passes the radiance of each
    /// packet to `sink`. A packet holds samples of one pixel. `first` must be a multiple of
    /// `WIDTH`.
    #[inline(always)]
    pub fn radiance(
        &mut self,
        first: u32,
        mut sink: impl FnMut(TracedPacket<'_, L::Scalar>, &mut Radiance<L>),
    ) {
        let block = self.sampler.block(first, L::WIDTH);
        for i in 0..self.pixels.len() {
            let (key, corner_direction) = self.pixels.broadcast(i);
            self.trace(corner_direction, &block.for_pixel(key), L::mask(true));
            let packet = TracedPacket {
                block: &self.pixels,
                pixels: i..i + 1,
                first,
                samples_per_pixel: L::WIDTH,
            };
            sink(packet, &mut self.radiance);
        }
    }

    /// Traces the samples `first..first + COUNT` of every pixel and passes the radiance of each
    /// packet to `sink`. A packet holds samples of `WIDTH / COUNT` pixels; its pixel `i` occupies
    /// the `COUNT` lanes from `i * COUNT` on. `COUNT` must be a power of two below `WIDTH`, and
    /// `first` a multiple of `COUNT`.
    #[inline(always)]
    pub fn radiance_shared<const COUNT: usize>(
        &mut self,
        first: u32,
        mut sink: impl FnMut(TracedPacket<'_, L::Scalar>, &mut Radiance<L>),
    ) {
        let block = self.sampler.block(first, COUNT);
        for pixels in self.pixels.packets(L::WIDTH / COUNT) {
            let (keys, corner_directions) = self.pixels.gather::<L, COUNT>(pixels.start);
            let active = first_lanes::<L>(pixels.len() * COUNT);
            self.trace(corner_directions, &block.for_pixels(keys), active);
            let packet =
                TracedPacket { block: &self.pixels, pixels, first, samples_per_pixel: COUNT };
            sink(packet, &mut self.radiance);
        }
    }

    /// Returns two values: the number of rays traced so far, and a flag that is `true` if a path
    /// has made a random choice (see [`Counts`]).
    pub fn counts(&self) -> Counts {
        self.counts
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
        let offset = if world.jitter() { sampler.pixel() } else { (center, center) };
        let camera = world.camera();
        let (origin, direction) = camera.rays(corner_directions, offset);
        let mut path = Path::new(Ray { origin, direction });
        if let Some(lens) = camera.lens() {
            let (u, v) = sampler.lens();
            let (x, y, _) = disk(u, v);
            let (origin, direction) = camera.lens_rays(lens, corner_directions, offset, (x, y));
            path.ray = Ray { origin, direction };
        }
        let candidates = self.candidates.as_ref();
        let counts = world.trace(&mut path, candidates, sampler, active, &mut self.radiance);
        self.counts.rays += counts.rays;
        self.counts.glossy |= counts.glossy;
    }
}

/// Traced packet: the pixel and the sample index of each of its lanes.
pub struct TracedPacket<'a, S> {
    block: &'a PixelBlock<S>,
    /// Range of the packet's pixels in the list of the tracer's pixels.
    pub pixels: Range<usize>,
    first: u32,
    samples_per_pixel: usize,
}

impl<S: Float> TracedPacket<'_, S> {
    /// Returns the pixel (column and row) and the sample index that were traced in a lane.
    pub fn sample(&self, lane: usize) -> ((u32, u32), u32) {
        let pixel = self.pixels.start + lane / self.samples_per_pixel;
        (self.block.pixel(pixel), self.first + (lane % self.samples_per_pixel) as u32)
    }
}

/// Returns the mask of the first `count` lanes.
fn first_lanes<L: SimdFloat>(count: usize) -> L::Mask {
    if count == L::WIDTH {
        return L::mask(true);
    }
    let lanes = L::from_fn(|lane| L::Scalar::from_f64(if lane < count { 1.0 } else { 0.0 }));
    lanes.gt(L::zero())
}
