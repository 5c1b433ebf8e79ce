//! Textures, compiled: colours and slopes at given coordinates.

use crate::asset::Image;
use crate::lanes::{Float, MAX_WIDTH, SimdFloat, Vec3};
use crate::material::texture::{Bump, Texture, TextureFilter, Wrap};
use std::sync::Arc;

/// What multiplies a colour, by coordinates in repeats.
#[derive(Clone, Debug)]
pub enum CompiledTexture<S> {
    /// Squares, two by two a repeat: the colour of the first and of its neighbours.
    Checker([[S; 3]; 2]),
    /// An image.
    Image {
        /// Its pixels.
        image: Arc<Image>,
        /// What lies beyond its edges.
        wrap: Wrap,
        /// What lies between its pixels.
        filter: TextureFilter,
    },
}

/// Heights, by coordinates in repeats.
#[derive(Clone, Debug)]
pub struct BumpMap {
    image: Arc<Image>,
    wrap: Wrap,
    /// Of white above black.
    height: f64,
}

/// Two neighbours in a row or column of `size` pixels: numbers that may lie beyond the ends, and how
/// far between their middles the coordinate `x` in repeats lies, from 0 to 1.
#[inline(always)]
fn between(x: f64, size: u32, wrap: Wrap) -> (i32, f64) {
    let size = f64::from(size);
    let x = match wrap {
        // A triangle without area has no coordinates.
        _ if !x.is_finite() => 0.0,
        Wrap::Repeat => x - x.floor(),
        Wrap::Clamp => x.clamp(-1.0, 2.0),
    };
    let x = x * size - 0.5;
    (x.floor() as i32, x - x.floor())
}

/// The pixel of a row or column of `size` that stands for the number `i`.
#[inline(always)]
fn wrapped(i: i32, size: u32, wrap: Wrap) -> u32 {
    match wrap {
        Wrap::Repeat => i.rem_euclid(size as i32) as u32,
        Wrap::Clamp => i.clamp(0, size as i32 - 1) as u32,
    }
}

/// Linear light at (u, v): v points up, rows go down.
#[inline(always)]
fn color_at(image: &Image, wrap: Wrap, filter: TextureFilter, u: f64, v: f64) -> [f64; 3] {
    let [width, height] = image.size();
    let ((x, fx), (y, fy)) = (between(u, width, wrap), between(1.0 - v, height, wrap));
    let pixel = |x, y| image.color(wrapped(x, width, wrap), wrapped(y, height, wrap));
    if filter == TextureFilter::Nearest {
        let up = |f: f64| i32::from(f >= 0.5);
        return pixel(x + up(fx), y + up(fy)).map(f64::from);
    }
    let [a, b, c, d] = [pixel(x, y), pixel(x + 1, y), pixel(x, y + 1), pixel(x + 1, y + 1)];
    std::array::from_fn(|i| {
        let mix = |a: f32, b: f32, f: f64| f64::from(a) + f * (f64::from(b) - f64::from(a));
        let (above, below) = (mix(a[i], b[i], fx), mix(c[i], d[i], fx));
        above + fy * (below - above)
    })
}

/// The lanes of `bits`, each with what `f` gives for it; the others are zero.
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
    /// Of a texture; `None`: it shows nothing.
    pub fn new(texture: &Texture) -> Option<Self> {
        match texture {
            Texture::Checker(checker) => {
                Some(Self::Checker([checker.even, checker.odd].map(|c| c.0.map(S::from_f64))))
            }
            Texture::Image(texture) => Some(Self::Image {
                image: texture.image()?.clone(),
                wrap: texture.wrap,
                filter: texture.filter,
            }),
        }
    }

    /// The colours at (u, v) in the lanes of `bits`.
    pub fn eval<L: SimdFloat<Scalar = S>>(&self, (u, v): (L, L), bits: u32) -> Vec3<L> {
        let at = |lane| (u.lane(lane).to_f64(), v.lane(lane).to_f64());
        match self {
            Self::Checker(colors) => gathered(bits, |lane| {
                let (u, v) = at(lane);
                let squares = ((2.0 * u).floor() as i64).wrapping_add((2.0 * v).floor() as i64);
                colors[(squares & 1) as usize].map(S::to_f64)
            }),
            Self::Image { image, wrap, filter } => gathered(bits, |lane| {
                let (u, v) = at(lane);
                color_at(image, *wrap, *filter, u, v)
            }),
        }
    }
}

impl BumpMap {
    /// Of a bump; `None`: it turns nothing.
    pub fn new(bump: &Bump) -> Option<Self> {
        let Bump::Image(of) = bump;
        bump.has_effect().then_some(())?;
        Some(Self { image: of.image()?.clone(), wrap: of.wrap, height: of.height })
    }

    /// How heights grow with u and with v, in lengths a repeat, in the lanes of `bits`.
    ///
    /// The differences of the pixels on both sides of each pixel, bilinear between pixels: so slopes
    /// change evenly, where those of bilinear heights would jump from pixel to pixel.
    pub fn gradient<L: SimdFloat>(&self, (u, v): (L, L), bits: u32) -> (L, L) {
        let slopes: Vec3<L> = gathered(bits, |lane| {
            let [du, dv] = self.slope_at(u.lane(lane).to_f64(), v.lane(lane).to_f64());
            [du, dv, 0.0]
        });
        (slopes.x, slopes.y)
    }

    fn slope_at(&self, u: f64, v: f64) -> [f64; 2] {
        let [width, height] = self.image.size();
        let wrap = self.wrap;
        let (x, fx) = between(u, width, wrap);
        let (y, fy) = between(1.0 - v, height, wrap);
        let columns: [u32; 4] = std::array::from_fn(|i| wrapped(x + i as i32 - 1, width, wrap));
        let rows: [u32; 4] = std::array::from_fn(|i| wrapped(y + i as i32 - 1, height, wrap));
        let at = |i: usize, j: usize| f64::from(self.image.height(columns[i], rows[j]));
        let mix = |f: f64, a: f64, b: f64| a + f * (b - a);
        // Twice the slope a pixel to the right, and a pixel down, at the four pixels around.
        let right = |i: usize, j: usize| at(i + 1, j) - at(i - 1, j);
        let down = |i: usize, j: usize| at(i, j + 1) - at(i, j - 1);
        let du = mix(fy, mix(fx, right(1, 1), right(2, 1)), mix(fx, right(1, 2), right(2, 2)));
        let dv = mix(fy, mix(fx, down(1, 1), down(2, 1)), mix(fx, down(1, 2), down(2, 2)));
        let half = 0.5 * self.height;
        [half * f64::from(width) * du, -half * f64::from(height) * dv]
    }
}
