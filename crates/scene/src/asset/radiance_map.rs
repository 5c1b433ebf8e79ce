//! Images of radiance for environment lights: Radiance HDR, OpenEXR, PNG and JPEG.
//!
//! The images are equirectangular. All pixels of a row have the same polar angle. The upper edge is
//! the direction +y, the lower edge -y. The middle of the image is the direction -z. The direction
//! +x is to the right of the middle, at a quarter of the image's width.

use crate::asset::error::AssetError;
use crate::asset::exr::ExrFile;
use crate::asset::file::FileContents;
use crate::asset::hdr::HdrFile;
use crate::asset::image::{Image, ImageFormat, check_size};
use crate::asset::memory::ImageMemory;
use crate::value::Fnv1a64;
use glam::DVec3;
use std::f64::consts::{PI, TAU};
use zerkalo_kernel::lanes::{Float, MAX_WIDTH, Mask, SimdFloat, Vec3};
use zerkalo_kernel::sampling::PiecewiseLinear2D;

/// Largest number of pixels in a row or column of an environment image.
pub(super) const MAX_MAP_SIDE: u32 = 16_384;

/// Largest number of pixels of an environment image: 32 Mi, which take 740 MB.
pub(super) const MAX_MAP_PIXELS: u64 = 1 << 25;

/// Smallest density [1/sr] of a sample, so that its weight is finite.
const MIN_DENSITY: f64 = 1e-12;

/// Largest valid radiance of a pixel. That of the sun is about 2e7 W/(sr m^2).
const MAX_RADIANCE: f32 = 1e15;

/// Largest finite number of a half float, in which a brighter sun is infinite.
const LARGEST_HALF: f32 = 65504.0;

/// Radiance from all directions, for environment lights: linear, finite, at least 0.
#[derive(Clone, Debug, PartialEq)]
pub struct RadianceMap {
    size: [u32; 2],
    /// Radiance (red, green, blue) of the image's pixels, row by row from the top, and the density
    /// [1/sr] of samples at their centres times the sine of the polar angle.
    pixels: Vec<[f32; 4]>,
    distribution: PiecewiseLinear2D,
    /// Mean radiance over all directions, weighted by solid angle.
    pub mean: [f64; 3],
    /// Notes for the user about values of the file that were replaced: sentences without a period.
    pub notes: Vec<String>,
}

/// Directions sampled by [`RadianceMap::sample`].
#[derive(Clone, Copy, Debug)]
pub struct DirectionSample<L> {
    /// Unit vectors of the directions.
    pub direction: Vec3<L>,
    /// Radiance that arrives from the directions.
    pub radiance: Vec3<L>,
    /// Densities with which the directions are sampled [1/sr].
    pub density: L,
}

impl RadianceMap {
    /// Creates an image from its width and height and its pixels, row by row from the top.
    ///
    /// Samples follow the luminance above its mean, because the sampling of BSDFs finds the rest with
    /// less noise (Karlik et al. 2019, *MIS Compensation: Optimizing Sampling Techniques in Multiple
    /// Importance Sampling*). They must therefore be combined with samples of the BSDF.
    ///
    /// # Panics
    /// Panics if the number of pixels is not the product of the sides, or is 0.
    pub fn new(size: [u32; 2], pixels: &[[f32; 3]]) -> Self {
        let [columns, rows] = size.map(|n| n as usize);
        assert_eq!(pixels.len(), columns * rows);
        assert!(!pixels.is_empty());
        let angle = |row: f64| PI * row / rows as f64;
        let mut mean = [0.0; 3];
        for (row, pixels) in pixels.chunks(columns).enumerate() {
            let height = angle(row as f64).cos() - angle(row as f64 + 1.0).cos();
            let share = 0.5 * height / columns as f64;
            for pixel in pixels {
                mean = std::array::from_fn(|c| mean[c] + share * f64::from(pixel[c]));
            }
        }
        let threshold = luminance(mean);
        let above = |pixel: &[f32; 3]| (luminance(pixel.map(f64::from)) - threshold).max(0.0);
        // An image of one colour has rounding errors above its mean. It is sampled evenly.
        let is_uniform = pixels.iter().all(|pixel| above(pixel) <= 1e-6 * threshold);
        let sine = |row: usize| angle(row as f64 + 0.5).sin();
        let distribution = PiecewiseLinear2D::new([columns, rows], |column, row| {
            let above = if is_uniform { 1.0 } else { above(&pixels[row * columns + column]) };
            sine(row) * above
        });
        let per_area = (columns * rows) as f64 / (2.0 * PI * PI);
        let pixel = |(i, [r, g, b]): (usize, &[f32; 3])| {
            let density = per_area * distribution.density(i % columns, i / columns);
            [*r, *g, *b, density as f32]
        };
        let pixels = pixels.iter().enumerate().map(pixel).collect();
        Self { size, pixels, distribution, mean, notes: Vec::new() }
    }

    /// Decodes an environment image file. Values of PNG and JPEG files are sRGB levels. Values that
    /// are no radiances are replaced by [`repair`].
    pub(super) fn parse(source: &FileContents) -> Result<Self, AssetError> {
        let check = |size| check_size(source, size, MAX_MAP_SIDE, MAX_MAP_PIXELS);
        let (mut notes, mut matrix) = (Vec::new(), None);
        let (size, mut pixels) = match ImageFormat::of(&source.bytes) {
            Some(ImageFormat::Hdr) => {
                let file = HdrFile::parse(source)?;
                check(file.size)?;
                (file.size, file.pixels(source)?)
            }
            Some(ImageFormat::OpenExr) => {
                let file = ExrFile::parse(source)?;
                matrix = file.srgb_from_primaries;
                (file.size, file.pixels(source)?)
            }
            Some(ImageFormat::Png | ImageFormat::Jpeg) => {
                check(Image::memory(source)?.size)?;
                let image = Image::parse(source)?;
                let [width, height] = image.size();
                let row = |y| (0..width).map(move |x| (x, y));
                let pixels = (0..height).flat_map(row).map(|(x, y)| image.color(x, y)).collect();
                notes = image.notes;
                ([width, height], pixels)
            }
            None => return Err(source.fault("this is no image of a known format", EXPECTED)),
        };
        notes.extend(repair(&mut pixels, size[0] as usize));
        if let Some(srgb_from_primaries) = matrix {
            for pixel in &mut pixels {
                let color = srgb_from_primaries * DVec3::from(pixel.map(f64::from));
                *pixel = color.max(DVec3::ZERO).to_array().map(|x| x as f32);
            }
        }
        Ok(Self { notes, ..Self::new(size, &pixels) })
    }

    /// Returns the memory of the environment in a file that begins with `start`.
    pub(super) fn memory(start: &FileContents) -> Result<ImageMemory, AssetError> {
        let ([width, height], decoding) = match ImageFormat::of(&start.bytes) {
            Some(ImageFormat::Hdr) => (HdrFile::parse(start)?.size, 0),
            Some(ImageFormat::OpenExr) => {
                let file = ExrFile::parse(start)?;
                // A compressed block, the decoded one, and a copy of it in another order.
                (file.size, 3 * file.block_bytes)
            }
            Some(ImageFormat::Png | ImageFormat::Jpeg) | None => {
                let image = Image::memory(start)?;
                (image.size, image.kept + image.decoding)
            }
        };
        let size = [width, height];
        check_size(start, size, MAX_MAP_SIDE, MAX_MAP_PIXELS)?;
        let pixels = u64::from(width) * u64::from(height);
        // A pixel, and its entries in the sampling distribution. Until then, decoded pixels.
        let bytes = size_of::<[f32; 4]>() + size_of::<f32>() + size_of::<u16>();
        let decoding = decoding.max(pixels * size_of::<[f32; 3]>() as u64);
        Ok(ImageMemory { size, kept: pixels * bytes as u64, decoding })
    }

    /// Adds size and pixels to `hash`.
    pub fn hash_contents(&self, hash: &mut Fnv1a64) {
        self.size.iter().for_each(|n| hash.update(&n.to_le_bytes()));
        self.channels().for_each(|x| hash.update(&x.to_le_bytes()));
    }

    /// Returns the memory of the pixels and the sampling distribution in bytes.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.pixels[..]) + self.distribution.bytes()
    }

    /// Iterates over the values of all colour channels, pixel by pixel.
    fn channels(&self) -> impl Iterator<Item = f32> {
        self.pixels.iter().flat_map(|[r, g, b, _]| [*r, *g, *b])
    }

    /// Returns the largest value of a channel.
    pub fn max(&self) -> f64 {
        self.channels().fold(0.0, f32::max).into()
    }

    /// Returns the smallest positive value among all channels; `None` if the image is black.
    pub fn min(&self) -> Option<f64> {
        self.channels().filter(|x| *x > 0.0).reduce(f32::min).map(f64::from)
    }

    /// Returns the radiance from the unit vectors `direction`, interpolated between pixel centres,
    /// and the densities [1/sr] with which [`RadianceMap::sample`] draws them. Both are zero outside
    /// `lanes`.
    #[inline(always)]
    pub fn radiance<L: SimdFloat>(&self, direction: Vec3<L>, lanes: L::Mask) -> (Vec3<L>, L) {
        let [columns, rows] = self.size.map(f64::from);
        let Vec3 { x, y, z } = direction;
        let sine = x.mul_add(x, z * z).sqrt();
        let turn = (-x).atan2(z) * L::from_f64(columns / TAU);
        let left = turn + L::from_f64(columns);
        let turn = L::select(turn.lt(L::zero()), left, turn);
        self.at(turn, sine.atan2(y) * L::from_f64(rows / PI), sine, lanes)
    }

    /// Samples directions in `lanes`. `u` and `v` are uniform in [0, 1).
    #[inline(always)]
    pub fn sample<L: SimdFloat>(&self, (u, v): (L, L), lanes: L::Mask) -> DirectionSample<L> {
        let [columns, rows] = self.size.map(f64::from);
        let (x, y) = self.distribution.sample(u, v);
        let (sin, cos) = (y * L::from_f64(PI / rows)).sin_cos();
        let (sin_phi, cos_phi) = (x * L::from_f64(TAU / columns)).sin_cos();
        let (radiance, density) = self.at(x, y, sin, lanes);
        let density = density.max(L::from_f64(MIN_DENSITY));
        DirectionSample {
            direction: Vec3::new(-sin * sin_phi, cos, sin * cos_phi),
            radiance,
            density,
        }
    }

    /// Returns radiance and density at the position (`x`, `y`) in pixels from the left upper corner.
    /// `sine` is the sine of the polar angle.
    #[inline(always)]
    fn at<L: SimdFloat>(&self, x: L, y: L, sine: L, lanes: L::Mask) -> (Vec3<L>, L) {
        let [columns, rows] = self.size.map(|n| n as usize);
        let mut found = [[0.0; 4]; MAX_WIDTH];
        let mut remaining = lanes.bits();
        while remaining != 0 {
            let lane = remaining.trailing_zeros() as usize;
            remaining &= remaining - 1;
            let [x, y] = [x, y].map(|x| x.lane(lane).to_f64() - 0.5);
            let (column, row) = (x.floor(), y.floor());
            let (s, t) = (x - column, y - row);
            // The left and the right edge are adjacent. Beyond the centres of the first and last row
            // there is no interpolation between rows. The conversion to integers saturates.
            let left = if column < 0.0 { columns - 1 } else { (column as usize).min(columns - 1) };
            let right = if left + 1 < columns { left + 1 } else { 0 };
            let (above, below) = (row.max(0.0) as usize, (row + 1.0).max(0.0) as usize);
            let [above, below] = [above, below].map(|row| row.min(rows - 1) * columns);
            let mix = |a: [f32; 4], b: [f32; 4]| -> [f64; 4] {
                std::array::from_fn(|c| {
                    let (a, b) = (f64::from(a[c]), f64::from(b[c]));
                    a + s * (b - a)
                })
            };
            let above = mix(self.pixels[above + left], self.pixels[above + right]);
            let below = mix(self.pixels[below + left], self.pixels[below + right]);
            found[lane] = std::array::from_fn(|c| above[c] + t * (below[c] - above[c]));
        }
        let channel = |c: usize| L::from_fn(|lane| L::Scalar::from_f64(found[lane][c]));
        // The density falls to zero towards the upper and the lower edge, as the sine does.
        let (two, rows) = (L::from_f64(2.0), L::from_f64(rows as f64));
        let edge = (y.min(rows - y) * two).max(L::zero()).min(L::one());
        let density = channel(3) * edge / sine.max(L::from_f64(1e-30));
        (Vec3::new(channel(0), channel(1), channel(2)), density)
    }
}

/// Returns the luminance of a linear colour with the primaries of sRGB.
fn luminance([r, g, b]: [f64; 3]) -> f64 {
    0.2126 * r + 0.7152 * g + 0.0722 * b
}

const EXPECTED: &str = "a Radiance HDR, OpenEXR, PNG or JPEG image";

/// Replaces negative values and NaN by 0, and values that are infinite or above [`MAX_RADIANCE`] by
/// the largest other value, at least [`LARGEST_HALF`]. Returns notes with the numbers of pixels.
fn repair(pixels: &mut [[f32; 3]], columns: usize) -> Vec<String> {
    let valid = pixels.iter().flatten().copied().filter(|x| *x <= MAX_RADIANCE);
    let largest = valid.fold(LARGEST_HALF, f32::max);
    let note = |is_bad: fn(&f32) -> bool, what: String| {
        let mut bad = pixels.iter().enumerate().filter(|(_, pixel)| pixel.iter().any(is_bad));
        let (first, _) = bad.next()?;
        let (x, y, count) = (first % columns, first / columns, 1 + bad.count());
        Some(format!("{what}: {count}, the first one in column {x}, row {y}"))
    };
    let notes = [
        note(|x| x.is_nan(), "pixels that are no numbers (NaN), taken as 0".to_string()),
        note(
            |x| *x > MAX_RADIANCE,
            format!("pixels that are infinite or above 1e15, taken as {largest}"),
        ),
    ];
    pixels.iter_mut().flatten().for_each(|x| *x = x.max(0.0).min(largest));
    notes.into_iter().flatten().collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use exr::image::{AnyChannel, AnyChannels, Encoding, FlatSamples, Image as Picture, Layer};
    use exr::meta::attribute::IntegerBounds;
    use exr::meta::header::{ImageAttributes, LayerAttributes};
    use exr::prelude::traits::*;
    use png::{BitDepth, ColorType, Encoder};
    use std::io::Cursor;
    use std::path::PathBuf;

    fn source(bytes: Vec<u8>) -> FileContents {
        FileContents { path: PathBuf::from("sky.hdr"), bytes }
    }

    /// Returns the pixels of a test image of 9 x 5 pixels with values from 0 to 2048, which OpenEXR
    /// stores exactly.
    fn floats() -> Vec<[f32; 3]> {
        let row = |y| (0..9).map(move |x| [f32::exp2(x as f32 + 3.0), 0.5, y as f32]);
        (0..5).flat_map(row).collect()
    }

    /// Returns a layer of 9 x 5 pixels, whose left upper corner is at `position`.
    fn layer(
        names: [&'static str; 3],
        pixels: &[[f32; 3]],
        position: (i32, i32),
    ) -> Layer<AnyChannels<FlatSamples>> {
        let samples = |c: usize| FlatSamples::F32(pixels.iter().map(|pixel| pixel[c]).collect());
        let channels = [0, 1, 2].map(|c| AnyChannel::new(names[c], samples(c)));
        let channels = AnyChannels::sort(channels.into_iter().collect());
        let attributes =
            LayerAttributes { layer_position: position.into(), ..LayerAttributes::named(names[0]) };
        Layer::new((9, 5), attributes, Encoding::SMALL_LOSSLESS, channels)
    }

    fn exr(pixels: &[[f32; 3]]) -> Vec<u8> {
        let mut bytes = Cursor::new(Vec::new());
        let picture = Picture::from_layer(layer(["R", "G", "B"], pixels, (0, 0)));
        picture.write().to_buffered(&mut bytes).unwrap();
        bytes.into_inner()
    }

    /// Returns a Radiance file of 9 x 5 pixels. The pixels in column `x` have the value 2^x.
    fn hdr() -> Vec<u8> {
        let row = (0..9).flat_map(|x| [128, 128, 128, 129 + x]);
        let header = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 5 +X 9\n";
        header.iter().copied().chain((0..5).flat_map(|_| row.clone())).collect()
    }

    #[test]
    fn radiance_is_decoded_from_every_format() {
        let map = RadianceMap::parse(&source(exr(&floats()))).unwrap();
        assert_eq!(map.size, [9, 5]);
        let color = |map: &RadianceMap, i: usize| [0, 1, 2].map(|c| map.pixels[i][c]);
        assert_eq!(color(&map, 2 * 9 + 4), [128.0, 0.5, 2.0]);
        let map = RadianceMap::parse(&source(hdr())).unwrap();
        assert_eq!(color(&map, 9 + 8), [256.0; 3]);
        for first in [&b"#?RGBE"[..], b"#?", b"#?AUTOPANO"] {
            let map = RadianceMap::parse(&source([first, &hdr()[10..]].concat())).unwrap();
            assert_eq!(color(&map, 9 + 8), [256.0; 3]);
        }
        let bytes = [&hdr()[..11], b"EXPOSURE=4\n", &hdr()[11..]].concat();
        let map = RadianceMap::parse(&source(bytes)).unwrap();
        assert_eq!(color(&map, 9 + 8), [64.0; 3]);
        let mut png = Vec::new();
        let mut encoder = Encoder::new(&mut png, 3, 2);
        encoder.set_color(ColorType::Rgb);
        encoder.set_depth(BitDepth::Eight);
        encoder.write_header().unwrap().write_image_data(&[255, 0, 188].repeat(6)).unwrap();
        let map = RadianceMap::parse(&source(png)).unwrap();
        let [r, g, b, _] = map.pixels[5];
        assert!(r == 1.0 && g == 0.0 && (b - 0.503).abs() < 1e-3, "{b}");
    }

    #[test]
    fn values_that_are_no_radiance_are_replaced_and_counted() {
        let mut pixels = floats();
        pixels[2 * 9 + 3] = [-1.0, 0.25, 0.5];
        let map = RadianceMap::parse(&source(exr(&pixels))).unwrap();
        assert_eq!(
            (map.pixels[2 * 9 + 3][..3].to_vec(), map.notes),
            (vec![0.0, 0.25, 0.5], vec![])
        );
        let nan = "pixels that are no numbers (NaN), taken as 0";
        let large = "pixels that are infinite or above 1e15, taken as";
        for (bad, brightest, expected, note) in [
            (f32::NAN, 1.0, 0.0, nan.to_string()),
            (-f32::NAN, 1.0, 0.0, nan.to_string()),
            (f32::INFINITY, 1.0, 65504.0, format!("{large} 65504")),
            (2e15, 1e7, 1e7, format!("{large} 10000000")),
        ] {
            pixels[2 * 9 + 3] = [bad, bad, 0.5];
            pixels[3 * 9] = [0.0, bad, 0.0];
            pixels[0][1] = brightest;
            let map = RadianceMap::parse(&source(exr(&pixels))).unwrap();
            assert_eq!(map.pixels[2 * 9 + 3][..3], [expected, expected, 0.5]);
            assert_eq!(map.notes, [note + ": 2, the first one in column 3, row 2"]);
        }
        pixels[2 * 9 + 3] = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY];
        pixels[3 * 9] = [0.0; 3];
        let map = RadianceMap::parse(&source(exr(&pixels))).unwrap();
        assert_eq!((&map.pixels[2 * 9 + 3][..3], map.notes.len()), (&[0.0, 1e7, 0.0][..], 2));
    }

    #[test]
    fn first_exr_layer_with_colors_is_shown_in_its_window() {
        // The first layer has other channels. Of the second one, the window has the columns 0 to 6
        // and the rows 1 to 4, and two columns to the left of it.
        let other = layer(["X", "Y", "Z"], &floats(), (0, 0));
        let colored = layer(["R", "G", "B"], &floats(), (2, -1));
        let window = IntegerBounds::from_dimensions((9, 4));
        let picture = Picture::from_layers(ImageAttributes::new(window), vec![other, colored]);
        let mut bytes = Cursor::new(Vec::new());
        picture.write().to_buffered(&mut bytes).unwrap();
        let map = RadianceMap::parse(&source(bytes.into_inner())).unwrap();
        assert_eq!(map.size, [9, 4]);
        for (i, pixel) in map.pixels.iter().enumerate() {
            let (x, y) = (i % 9, i / 9);
            let expected = if x < 2 { [0.0; 3] } else { floats()[9 * (y + 1) + x - 2] };
            assert_eq!(pixel[..3], expected, "{x}, {y}");
        }
    }

    #[test]
    fn directions_have_their_pixels() {
        // 4 x 2 pixels with different colours.
        let pixels: Vec<_> = (0..8).map(|i| [i as f32, 0.0, 1.0]).collect();
        let map = RadianceMap::new([4, 2], &pixels);
        let at = |direction: [f64; 3]| map.radiance(Vec3::<f64>::of(direction), true);
        let red = |direction: [f64; 3]| at(direction).0.x;
        let (s, c) = (0.5f64.sqrt(), 0.5f64.sqrt());
        // Centres of the pixels in the upper row, whose polar angle is 45 degrees.
        assert!((red([-s * c, c, s * s])).abs() < 1e-12);
        assert!((red([-s * c, c, -s * s]) - 1.0).abs() < 1e-12);
        assert!((red([s * c, c, -s * s]) - 2.0).abs() < 1e-12);
        assert!((red([s * c, c, s * s]) - 3.0).abs() < 1e-12);
        // Directions on boundaries of pixels. The first one, straight ahead, is between four
        // pixels. The second one, backwards, is at the left and the right edge of the image. The
        // next ones point to the right and to the poles.
        assert!((red([0.0, 0.0, -1.0]) - 3.5).abs() < 1e-12);
        assert!((red([0.0, 0.0, 1.0]) - 3.5).abs() < 1e-12);
        assert!((red([1.0, 0.0, 0.0]) - 4.5).abs() < 1e-12);
        for pole in [[0.0, 1.0, 0.0], [-0.0, -1.0, -0.0], [0.0, 1.0, -0.0]] {
            assert!(red(pole).is_finite() && at(pole).1 >= 0.0);
        }
    }

    /// Checks radiance and density of samples against those of their directions, in both
    /// precisions; the integral of the density; and that no sample is darker than the mean.
    #[test]
    fn samples_have_the_radiance_and_density_of_their_direction() {
        let pixels: Vec<_> = (0..32 * 16).map(|i| [((i * 7919) % 31) as f32, 0.5, 0.0]).collect();
        for (map, is_uniform) in [
            (RadianceMap::new([32, 16], &pixels), false),
            (RadianceMap::new([32, 16], &[[0.3; 3]; 32 * 16]), true),
            (RadianceMap::new([1, 16], &[[0.0; 3]; 16]), true),
        ] {
            let n = 20_000u32;
            let mut inverse = 0.0;
            for i in 0..n {
                let u = (f64::from(i) + 0.5) / f64::from(n);
                let v = (f64::from(i.reverse_bits()) + 0.5) / f64::exp2(32.0);
                let DirectionSample { direction, radiance, density } = map.sample((u, v), true);
                assert!((direction.length_squared() - 1.0).abs() < 1e-12);
                let (expected, expected_density) = map.radiance(direction, true);
                assert!((density / expected_density - 1.0).abs() < 1e-9, "{i}: {density}");
                assert!((radiance.x - expected.x).abs() < 1e-9 && density > 0.0);
                inverse += 1.0 / (f64::from(n) * density);
                let single = Vec3::of(direction.lane(0));
                let (radiance, density) = map.radiance::<f32>(single, true);
                assert!((f64::from(radiance.x) - expected.x).abs() < 1e-3);
                assert!((f64::from(density) / expected_density - 1.0).abs() < 0.1, "{density}");
            }
            // The solid angle in which the density is positive.
            let solid_angle = inverse / (4.0 * PI);
            assert!(if is_uniform { (solid_angle - 1.0).abs() < 0.02 } else { solid_angle < 1.1 });
        }
    }

    #[test]
    fn hostile_files_are_rejected_before_allocation() {
        let found = |bytes: Vec<u8>| RadianceMap::parse(&source(bytes)).unwrap_err().found;
        let header = |size: &str| format!("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n{size}\n");
        for (size, words) in [
            ("-Y 60000 +X 60000", "60000 x 60000"),
            ("-Y 4294967295 +X 4294967295", "4294967295 x 4294967295"),
            ("-Y 8000 +X 4000", "more than its"),
            ("-Y 0 +X 4", "4 x 0"),
            ("-Y 4", "cannot be read"),
            ("", "cannot be read"),
        ] {
            let found = found(header(size).into_bytes());
            assert!(found.contains(words), "{size}: {found}");
        }
        for bytes in [hdr(), exr(&floats())] {
            for kept in [0, 1, 8, 12, 30, bytes.len() / 2, bytes.len() - 1] {
                assert!(!found(bytes[..kept].to_vec()).is_empty(), "{kept} bytes");
            }
        }
        // The next file declares a layer that is wider than the limit.
        let mut wide = exr(&floats());
        let window = b"dataWindow\0box2i\0\x10\0\0\0";
        let start = wide.windows(window.len()).position(|bytes| bytes == window).unwrap();
        let right = start + window.len() + 8;
        wide[right..right + 4].copy_from_slice(&((1i32 << 20) - 1).to_le_bytes());
        let found_in_wide = found(wide);
        assert!(found_in_wide.contains("1048576 x 5"), "{found_in_wide}");
        assert!(found(b"no image".to_vec()).contains("known format"));
    }
}
