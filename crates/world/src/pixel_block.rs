//! Block of pixels: values that are the same for all samples of a pixel, computed once per tile.
//! They are the key of the pixel's random numbers, and the vector from the eye to the pixel's upper
//! left corner.

use std::ops::Range;
use zerkalo_kernel::lanes::{Float, SimdFloat, SimdU32, Vec3};
use zerkalo_kernel::sampling::Sampler;
use zerkalo_scene::camera::CompiledCamera;

/// Largest number of pixels in a block that is traced together; a multiple of every packet width.
pub const MAX_BLOCK_PIXELS: usize = 256;

/// Block of pixels. Adjacent pixels share a packet; the last packet is filled with copies of the
/// last pixel.
pub(super) struct PixelBlock<S> {
    count: usize,
    /// Key of each pixel's random numbers, computed by [`Sampler::key`].
    keys: [u32; MAX_BLOCK_PIXELS],
    /// Vectors from the eye to the pixels' upper left corners on the plane at unit distance: all x,
    /// then y, then z.
    corner_directions: [[S; MAX_BLOCK_PIXELS]; 3],
}

impl<S: Float> PixelBlock<S> {
    /// Creates a block of at most [`MAX_BLOCK_PIXELS`] `pixels`, pairs of column and row.
    pub fn new<L: SimdFloat<Scalar = S>>(
        camera: &CompiledCamera,
        sampler: &Sampler<L>,
        replicate: usize,
        mut pixels: impl Iterator<Item = (u32, u32)>,
    ) -> Self {
        let (mut xs, mut ys) = ([0; MAX_BLOCK_PIXELS], [0; MAX_BLOCK_PIXELS]);
        let mut out = Self {
            count: 0,
            keys: [0; MAX_BLOCK_PIXELS],
            corner_directions: [[S::default(); MAX_BLOCK_PIXELS]; 3],
        };
        for ((x, y), pixel) in xs.iter_mut().zip(&mut ys).zip(pixels.by_ref()) {
            (*x, *y) = pixel;
            out.count += 1;
        }
        debug_assert!(pixels.next().is_none(), "more than {MAX_BLOCK_PIXELS} pixels");
        let Some(last) = out.count.checked_sub(1) else { return out };
        let padded = out.count.next_multiple_of(L::WIDTH);
        let (x, y) = (xs[last], ys[last]);
        xs[last..padded].fill(x);
        ys[last..padded].fill(y);
        let pixels = || xs[..padded].iter().copied().zip(ys[..padded].iter().copied());
        for (key, pixel) in out.keys.iter_mut().zip(pixels()) {
            *key = sampler.key(pixel, replicate);
        }
        let [x, y, z] = &mut out.corner_directions;
        for (((x, y), z), pixel) in x.iter_mut().zip(y).zip(z).zip(pixels()) {
            [*x, *y, *z] = camera.pixel_corner_direction(pixel);
        }
        out
    }

    pub fn len(&self) -> usize {
        self.count
    }

    /// Returns the key of pixel `i` and the vector to its corner, the same in all lanes.
    #[inline(always)]
    pub fn broadcast<L: SimdFloat<Scalar = S>>(&self, i: usize) -> (u32, Vec3<L>) {
        (self.keys[i], Vec3::splat(self.corner_directions.each_ref().map(|axis| axis[i])))
    }

    /// Returns the keys of the `WIDTH / COUNT` pixels from `first` on and the vectors to their
    /// corners. Each pixel occupies `COUNT` adjacent lanes. `COUNT` must be a power of two, and
    /// `first` a multiple of `WIDTH / COUNT`.
    #[inline(always)]
    pub fn gather<L: SimdFloat<Scalar = S>, const COUNT: usize>(
        &self,
        first: usize,
    ) -> (L::SimdU32, Vec3<L>) {
        let pixels = first..first + L::WIDTH / COUNT;
        let keys = &self.keys[pixels.clone()];
        let [x, y, z] = self.corner_directions.each_ref().map(|axis| {
            let axis = &axis[pixels.clone()];
            L::from_fn(|lane| axis[lane / COUNT])
        });
        (L::SimdU32::from_fn(|lane| keys[lane / COUNT]), Vec3::new(x, y, z))
    }

    /// Iterates over the pixels of the block in ranges of `packet_pixels` each; the last range may
    /// be shorter.
    pub fn packets(
        &self,
        packet_pixels: usize,
    ) -> impl Iterator<Item = Range<usize>> + Clone + use<S> {
        let count = self.count;
        (0..count).step_by(packet_pixels).map(move |first| first..count.min(first + packet_pixels))
    }
}
