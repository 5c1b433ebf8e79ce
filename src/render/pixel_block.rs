//! Pixels, and what all their samples start from.

use crate::camera::PinholeCamera;
use crate::film::TILE_PIXELS;
use crate::lanes::{Float, SimdFloat, SimdU32, Vec3};
use crate::sampling::Sampler;
use std::ops::Range;

/// At most as many pixels as a tile has, in the order in which they share packets.
pub(super) struct PixelBlock<S> {
    count: usize,
    /// Columns and rows, in pixels of the picture. Here and below a last packet is filled up with copies of the
    /// last pixel.
    x: [u32; TILE_PIXELS],
    y: [u32; TILE_PIXELS],
    /// Keys of their random numbers.
    keys: [u32; TILE_PIXELS],
    /// From the eye to their corners, on the plane at unit distance, axis by axis.
    corner_direction: [[S; TILE_PIXELS]; 3],
}

impl<S: Float> PixelBlock<S> {
    /// Of `pixels`, in one replicate.
    pub fn new<L: SimdFloat<Scalar = S>>(
        view: &PinholeCamera,
        sampler: &Sampler<L>,
        replicate: usize,
        mut pixels: impl Iterator<Item = (u32, u32)>,
    ) -> Self {
        let mut out = Self {
            count: 0,
            x: [0; TILE_PIXELS],
            y: [0; TILE_PIXELS],
            keys: [0; TILE_PIXELS],
            corner_direction: [[S::default(); TILE_PIXELS]; 3],
        };
        for ((x, y), at) in out.x.iter_mut().zip(&mut out.y).zip(pixels.by_ref()) {
            (*x, *y) = at;
            out.count += 1;
        }
        debug_assert!(pixels.next().is_none(), "more than {TILE_PIXELS} pixels");
        let Some(last) = out.count.checked_sub(1) else { return out };
        let full = out.count.next_multiple_of(L::WIDTH);
        let (x, y) = (out.x[last], out.y[last]);
        out.x[last..full].fill(x);
        out.y[last..full].fill(y);
        let at = || out.x[..full].iter().copied().zip(out.y[..full].iter().copied());
        for (key, at) in out.keys.iter_mut().zip(at()) {
            *key = sampler.key(at, replicate);
        }
        let [x, y, z] = &mut out.corner_direction;
        for (((x, y), z), at) in x.iter_mut().zip(y).zip(z).zip(at()) {
            [*x, *y, *z] = view.pixel_corner_direction(at);
        }
        out
    }

    /// Column and row of pixel `i`.
    pub fn at(&self, i: usize) -> (u32, u32) {
        (self.x[i], self.y[i])
    }

    /// The key of pixel `i`, and from the eye to its corner, in all lanes.
    #[inline(always)]
    pub fn broadcast<L: SimdFloat<Scalar = S>>(&self, i: usize) -> (u32, Vec3<L>) {
        (self.keys[i], Vec3::splat(self.corner_direction.each_ref().map(|axis| axis[i])))
    }

    /// The same for the pixels `first ..`, each in COUNT lanes side by side; COUNT is a power of two, and
    /// `first` a multiple of WIDTH / COUNT.
    #[inline(always)]
    pub fn gather<L: SimdFloat<Scalar = S>, const COUNT: usize>(
        &self,
        first: usize,
    ) -> (L::SimdU32, Vec3<L>) {
        let those = first..first + L::WIDTH / COUNT;
        let keys = &self.keys[those.clone()];
        let [x, y, z] = self.corner_direction.each_ref().map(|axis| {
            let axis = &axis[those.clone()];
            L::from_fn(|lane| axis[lane / COUNT])
        });
        (L::SimdU32::from_fn(|lane| keys[lane / COUNT]), Vec3::new(x, y, z))
    }

    /// The pixels in packets that hold `each` of them.
    pub fn packets(&self, each: usize) -> impl Iterator<Item = Range<usize>> {
        let count = self.count;
        (0..count).step_by(each).map(move |first| first..count.min(first + each))
    }
}
