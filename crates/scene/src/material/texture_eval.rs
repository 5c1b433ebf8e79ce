//! Compiled textures: evaluation of colours and of height gradients at texture coordinates.

use crate::asset::Image;
use crate::material::texture::{Bump, Texture, TextureFilter, Wrap};
use std::sync::Arc;
use zerkalo_kernel::lanes::{Float, MAX_WIDTH, SimdFloat, Vec3, array_from_fn};

/// Texture compiled for the kernels.
#[derive(Clone, Debug)]
pub enum CompiledTexture<S> {
    /// Checkerboard with two by two squares per repetition: the colour of the square that begins at
    /// u = v = 0, and the colour of its neighbours.
    Checker([[S; 3]; 2]),
    /// Image from a file.
    Image {
        /// Pixels.
        image: Arc<Image>,
        /// Continuation beyond the edges.
        wrap: Wrap,
        /// Interpolation between the centres of pixels.
        filter: TextureFilter,
    },
}

/// Bump map compiled for the kernels.
#[derive(Clone, Debug)]
pub struct BumpMap {
    image: Arc<Image>,
    wrap: Wrap,
    /// Height of white pixels above black ones [scene units], before the object's transform.
    height: f64,
}

/// Returns the index of the last pixel, along an axis of `size` pixels, whose centre is at or before
/// the texture coordinate `x`, and the distance of `x` from this centre in pixels, from 0 to 1. The
/// index may be out of range.
#[inline(always)]
fn pixel_position(x: f64, size: u32, wrap: Wrap) -> (i32, f64) {
    let size = f64::from(size);
    let x = match wrap {
        // The texture coordinates of a triangle without area are not finite. They count as 0.
        _ if !x.is_finite() => 0.0,
        Wrap::Repeat => x - x.floor(),
        Wrap::Clamp => x.clamp(-1.0, 2.0),
    };
    let x = x * size - 0.5;
    (x.floor() as i32, x - x.floor())
}

/// Maps the index `i`, which may be out of range, to one of `size` pixels.
#[inline(always)]
fn wrapped(i: i32, size: u32, wrap: Wrap) -> u32 {
    match wrap {
        Wrap::Repeat => i.rem_euclid(size as i32) as u32,
        Wrap::Clamp => i.clamp(0, size as i32 - 1) as u32,
    }
}

/// Returns the colour of the image, in linear light, at the texture coordinates (u, v). v points
/// up; rows of pixels are stored downwards.
#[inline(always)]
fn color_at(image: &Image, wrap: Wrap, filter: TextureFilter, u: f64, v: f64) -> [f64; 3] {
    let [width, height] = image.size();
    let ((x, fx), (y, fy)) =
        (pixel_position(u, width, wrap), pixel_position(1.0 - v, height, wrap));
    let pixel = |x, y| image.color(wrapped(x, width, wrap), wrapped(y, height, wrap));
    if filter == TextureFilter::Nearest {
        let up = |f: f64| i32::from(f >= 0.5);
        return pixel(x + up(fx), y + up(fy)).map(f64::from);
    }
    let [a, b, c, d] = [pixel(x, y), pixel(x + 1, y), pixel(x, y + 1), pixel(x + 1, y + 1)];
    array_from_fn(|i| {
        let lerp = |a: f32, b: f32, f: f64| f64::from(a) + f * (f64::from(b) - f64::from(a));
        let (above, below) = (lerp(a[i], b[i], fx), lerp(c[i], d[i], fx));
        above + fy * (below - above)
    })
}

/// Returns the results of `f(lane)` for the lanes whose bits are set; other lanes are zero.
#[inline(always)]
fn gathered<L: SimdFloat>(bits: u32, mut f: impl FnMut(usize) -> [f64; 3]) -> Vec3<L> {
    let mut all = [[0.0; 3]; MAX_WIDTH];
    let mut left = bits;
    while left != 0 {
        let lane = left.trailing_zeros() as usize;
        left &= left - 1;
        all[lane] = f(lane);
    }
    Vec3::from_fn(|lane| all[lane].map(L::Scalar::from_f64))
}

impl<S: Float> CompiledTexture<S> {
    /// Compiles a texture; returns `None` if it is an image without a readable file.
    pub fn new(texture: &Texture) -> Option<Self> {
        match texture {
            Texture::Checker(checker) => {
                Some(Self::Checker([checker.even, checker.odd].map(|c| c.0.map(S::from_f64))))
            }
            Texture::Image(texture) => Some(Self::Image {
                image: texture.content.content()?.clone(),
                wrap: texture.wrap,
                filter: texture.filter,
            }),
        }
    }

    /// Returns `true` if the colour jumps at edges.
    pub fn has_edges(&self) -> bool {
        match self {
            Self::Checker(_) => true,
            Self::Image { filter, .. } => *filter == TextureFilter::Nearest,
        }
    }

    /// Returns the texture's colours at (u, v) in the lanes whose bits are set in `bits`.
    pub fn eval<L: SimdFloat<Scalar = S>>(&self, (u, v): (L, L), bits: u32) -> Vec3<L> {
        let coordinates = |lane| (u.lane(lane).to_f64(), v.lane(lane).to_f64());
        match self {
            Self::Checker(colors) => gathered(bits, |lane| {
                let (u, v) = coordinates(lane);
                let squares = ((2.0 * u).floor() as i64).wrapping_add((2.0 * v).floor() as i64);
                colors[(squares & 1) as usize].map(S::to_f64)
            }),
            Self::Image { image, wrap, filter } => gathered(bits, |lane| {
                let (u, v) = coordinates(lane);
                color_at(image, *wrap, *filter, u, v)
            }),
        }
    }
}

impl BumpMap {
    /// Compiles a bump map; returns `None` if it does not perturb normals.
    pub fn new(bump: &Bump) -> Option<Self> {
        let Bump::Image(source) = bump;
        bump.has_effect().then_some(())?;
        Some(Self {
            image: source.content.content()?.clone(),
            wrap: source.wrap,
            height: source.height,
        })
    }

    /// Returns the derivatives of the height with respect to u and v, in scene units per repetition,
    /// in the lanes whose bits are set.
    ///
    /// Central differences of the heights at the pixels are interpolated bilinearly, so that the
    /// result is continuous. The exact derivatives of bilinearly interpolated heights would jump at
    /// pixel boundaries.
    pub fn gradient<L: SimdFloat>(&self, (u, v): (L, L), bits: u32) -> (L, L) {
        let slopes: Vec3<L> = gathered(bits, |lane| {
            let [du, dv] = self.gradient_at(u.lane(lane).to_f64(), v.lane(lane).to_f64());
            [du, dv, 0.0]
        });
        (slopes.x, slopes.y)
    }

    /// Returns [`BumpMap::gradient`] at one pair of texture coordinates: the derivatives of the
    /// height with respect to u and v.
    fn gradient_at(&self, u: f64, v: f64) -> [f64; 2] {
        let [width, height] = self.image.size();
        let wrap = self.wrap;
        let (x, fx) = pixel_position(u, width, wrap);
        let (y, fy) = pixel_position(1.0 - v, height, wrap);
        let columns: [u32; 4] = array_from_fn(|i| wrapped(x + i as i32 - 1, width, wrap));
        let rows: [u32; 4] = array_from_fn(|i| wrapped(y + i as i32 - 1, height, wrap));
        let height_at = |i: usize, j: usize| f64::from(self.image.height(columns[i], rows[j]));
        let lerp = |f: f64, a: f64, b: f64| a + f * (b - a);
        // Central differences to the right and downwards: twice the slopes per pixel.
        let right = |i: usize, j: usize| height_at(i + 1, j) - height_at(i - 1, j);
        let down = |i: usize, j: usize| height_at(i, j + 1) - height_at(i, j - 1);
        let du = lerp(fy, lerp(fx, right(1, 1), right(2, 1)), lerp(fx, right(1, 2), right(2, 2)));
        let dv = lerp(fy, lerp(fx, down(1, 1), down(2, 1)), lerp(fx, down(1, 2), down(2, 2)));
        let half = 0.5 * self.height;
        [half * f64::from(width) * du, -half * f64::from(height) * dv]
    }
}
