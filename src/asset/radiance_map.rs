//! Images of radiance for environment lights: Radiance HDR, OpenEXR, PNG and JPEG.
//!
//! The images are equirectangular. All pixels of a row have the same polar angle. The upper edge is
//! the direction +y, the lower edge -y. The middle of the image is the direction -z. The direction
//! +x is to the right of the middle, at a quarter of the image's width.

use crate::asset::error::{AssetError, FileLocation};
use crate::asset::file::FileContents;
use crate::asset::image::{Image, check_size};
use crate::asset::radiance_distribution::RadianceDistribution;
use crate::value::Fnv1a64;
use exr::io::Tracking;
use exr::meta::MetaData;
use image::codecs::hdr::HdrDecoder;
use image::codecs::openexr::OpenExrDecoder;
use image::{ImageDecoder, ImageError, ImageFormat};
use std::f64::consts::{PI, TAU};
use std::io::Cursor;

/// Largest number of pixels in a row or column of an environment image.
const MAX_MAP_SIDE: u32 = 16_384;

/// Largest number of pixels of an environment image: 32 Mi, such as 8192 x 4096. The pixels of such
/// an image take 403 MB.
const MAX_MAP_PIXELS: u64 = 1 << 25;

/// Largest valid radiance of a pixel in an environment image. For comparison: the radiance of the
/// sun is about 2e7 W/(sr m^2).
const MAX_RADIANCE: f32 = 1e15;

/// Decoded image of radiance from all directions, for environment lights. Its values are linear,
/// finite and at least 0.
#[derive(Clone, Debug, PartialEq)]
pub struct RadianceMap {
    size: [u32; 2],
    /// Radiance (red, green, blue) of the image's pixels, row by row from the top.
    pixels: Vec<[f32; 3]>,
    distribution: RadianceDistribution,
    mean: [f64; 3],
}

impl RadianceMap {
    /// Creates the image with the given pixels, row by row from the top.
    ///
    /// # Panics
    /// Panics if the number of pixels is not the product of the sides, or is 0.
    pub fn new(size: [u32; 2], pixels: Vec<[f32; 3]>) -> Self {
        assert_eq!(pixels.len(), size[0] as usize * size[1] as usize);
        assert!(!pixels.is_empty());
        let distribution = RadianceDistribution::new(size.map(|n| n as usize), &pixels);
        let mean = distribution.mean(&pixels);
        Self { size, pixels, distribution, mean }
    }

    /// Decodes an environment image file in memory. The format is determined by the first bytes of
    /// the file. Values of a Radiance HDR file are divided by the product of its `EXPOSURE` lines;
    /// values of PNG and JPEG files are sRGB levels. Negative values are replaced by 0.
    ///
    /// # Errors
    /// Fails if the file is not a valid image.
    pub(super) fn parse(source: &FileContents) -> Result<Self, AssetError> {
        let reader = Cursor::new(&source.bytes[..]);
        match image::guess_format(&source.bytes) {
            Ok(ImageFormat::Hdr) => {
                let decoder = HdrDecoder::new(reader).map_err(|e| decode_error(source, &e))?;
                let exposure = decoder.metadata().exposure.unwrap_or(1.0);
                if !(exposure.is_finite() && exposure > 0.0) {
                    let found = format!("the exposure of the image is {exposure}");
                    return Err(source.fault(found, "an exposure above 0"));
                }
                decode(source, decoder, 1.0 / exposure)
            }
            Ok(ImageFormat::OpenExr) => {
                check_layers(source)?;
                let decoder = OpenExrDecoder::with_alpha_preference(reader, Some(false));
                decode(source, decoder.map_err(|e| decode_error(source, &e))?, 1.0)
            }
            Ok(ImageFormat::Png | ImageFormat::Jpeg) => {
                let image = Image::parse(source)?;
                check_size(source, image.size(), MAX_MAP_SIDE, MAX_MAP_PIXELS)?;
                let [width, height] = image.size();
                let row = |y| (0..width).map(move |x| (x, y));
                let pixels = (0..height).flat_map(row).map(|(x, y)| image.color(x, y)).collect();
                Ok(Self::new(image.size(), pixels))
            }
            _ => Err(source.fault("this is no image of a known format", EXPECTED)),
        }
    }

    /// Adds the size and the pixels of the image to `hash`.
    pub fn hash_contents(&self, hash: &mut Fnv1a64) {
        self.size.iter().for_each(|n| hash.update(&n.to_le_bytes()));
        self.pixels.iter().flatten().for_each(|x| hash.update(&x.to_le_bytes()));
    }

    /// Returns the memory of the pixels and the sampling distribution in bytes.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.pixels[..]) + self.distribution.bytes()
    }

    /// Returns the mean radiance of the image over all directions, weighted by solid angle.
    pub fn mean(&self) -> [f64; 3] {
        self.mean
    }

    /// Returns the largest value of a channel (R, G or B) over all pixels of the image.
    pub fn max(&self) -> f64 {
        self.pixels.iter().flatten().copied().fold(0.0, f32::max).into()
    }

    /// Returns the smallest positive value of a channel (R, G or B) over all pixels of the image.
    /// Returns `None` if the image is black.
    pub fn min(&self) -> Option<f64> {
        let channels = self.pixels.iter().flatten().copied().filter(|x| *x > 0.0);
        channels.reduce(f32::min).map(f64::from)
    }

    /// Returns the radiance in the direction of the unit vector `direction`, interpolated between
    /// the centres of the pixels.
    pub fn radiance(&self, direction: [f64; 3]) -> [f64; 3] {
        let [columns, rows] = self.size.map(|n| n as usize);
        let [x, y] = position(direction);
        let (x, y) = (x * columns as f64 - 0.5, y * rows as f64 - 0.5);
        let (column, row) = (x.floor(), y.floor());
        let (s, t) = (x - column, y - row);
        // The left and the right edge of the image are adjacent. There is no row above the top row
        // or below the bottom row. Beyond the pixel centres of these two rows, their values are
        // used without interpolation between rows.
        let left = if column < 0.0 { columns - 1 } else { (column as usize).min(columns - 1) };
        let right = if left + 1 < columns { left + 1 } else { 0 };
        let (above, below) = (row.max(0.0) as usize, (row + 1.0) as usize);
        let [above, below] = [above, below].map(|row| row.min(rows - 1) * columns);
        let mix = |a: [f32; 3], b: [f32; 3]| -> [f64; 3] {
            std::array::from_fn(|c| {
                let (a, b) = (f64::from(a[c]), f64::from(b[c]));
                a + s * (b - a)
            })
        };
        let above = mix(self.pixels[above + left], self.pixels[above + right]);
        let below = mix(self.pixels[below + left], self.pixels[below + right]);
        std::array::from_fn(|c| above[c] + t * (below[c] - above[c]))
    }

    /// Samples a direction with a density that follows the luminance of the image. `u` and `v` are
    /// uniform in [0, 1). Returns two values: the unit vector of the direction, and the density
    /// \[1/sr\] with which it is sampled.
    pub fn sample(&self, u: f64, v: f64) -> ([f64; 3], f64) {
        let (x, cos, density) = self.distribution.sample(u, v);
        let (sin_phi, cos_phi) = (TAU * x).sin_cos();
        let sin = (1.0 - cos * cos).max(0.0).sqrt();
        ([-sin * sin_phi, cos, sin * cos_phi], density)
    }

    /// Returns the density \[1/sr\] with which [`RadianceMap::sample`] draws the unit vector
    /// `direction`.
    pub fn density(&self, direction: [f64; 3]) -> f64 {
        self.distribution.density(position(direction))
    }
}

/// Returns the position of a direction in the image: 0 to 1 from left to right, and 0 to 1 from top
/// to bottom.
fn position([x, y, z]: [f64; 3]) -> [f64; 2] {
    let turns = (-x).atan2(z) / TAU;
    let column = if turns < 0.0 { turns + 1.0 } else { turns };
    [column, x.hypot(z).atan2(y) / PI]
}

const EXPECTED: &str = "a Radiance HDR, OpenEXR, PNG or JPEG image";

/// Decodes a floating-point image file and multiplies its values by `factor`. The size is checked
/// before memory for the pixels is allocated.
fn decode(
    source: &FileContents,
    decoder: impl ImageDecoder,
    factor: f32,
) -> Result<RadianceMap, AssetError> {
    let (width, height) = decoder.dimensions();
    check_size(source, [width, height], MAX_MAP_SIDE, MAX_MAP_PIXELS)?;
    let mut bytes = vec![0; decoder.total_bytes() as usize];
    decoder.read_image(&mut bytes).map_err(|e| decode_error(source, &e))?;
    let float = |b: &[u8]| f32::from_ne_bytes([b[0], b[1], b[2], b[3]]);
    let channel = |b: &[u8]| float(b) * factor;
    let pixel = |b: &[u8]| [channel(b), channel(&b[4..]), channel(&b[8..])];
    let mut pixels: Vec<[f32; 3]> = bytes.chunks_exact(12).map(pixel).collect();
    for (i, pixel) in pixels.iter_mut().enumerate() {
        if let Some(x) = pixel.iter().find(|x| x.is_nan() || **x > MAX_RADIANCE) {
            let (column, row) = (i % width as usize, i / width as usize);
            let place = FileLocation::Part(format!("pixel {column}, {row}"));
            let found = format!("a channel is {x}");
            return Err(source.error(place, found, "finite numbers up to 1e15"));
        }
        *pixel = pixel.map(|x| x.max(0.0));
    }
    Ok(RadianceMap::new([width, height], pixels))
}

/// Checks the size of all layers of an OpenEXR file. A wrong size could make the decoder run out of
/// memory, because it allocates a block of rows of a layer before it reads the block.
fn check_layers(source: &FileContents) -> Result<(), AssetError> {
    // The type of the reader is that of the decoder, so that its functions are not compiled twice.
    let reader = Tracking::new(Cursor::new(&source.bytes[..]));
    let data = MetaData::read_from_buffered(reader, false)
        .map_err(|error| source.fault(format!("the header cannot be read: {error}"), EXPECTED))?;
    let side = |n: usize| u32::try_from(n).unwrap_or(u32::MAX);
    data.headers.iter().try_for_each(|header| {
        let size = [side(header.layer_size.0), side(header.layer_size.1)];
        check_size(source, size, MAX_MAP_SIDE, MAX_MAP_PIXELS)
    })
}

fn decode_error(source: &FileContents, error: &ImageError) -> AssetError {
    source.fault(format!("the image cannot be read: {error}"), EXPECTED)
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::codecs::hdr::HdrEncoder;
    use image::{DynamicImage, Rgb, Rgb32FImage};
    use std::path::PathBuf;

    fn source(bytes: Vec<u8>) -> FileContents {
        FileContents { path: PathBuf::from("sky.hdr"), bytes }
    }

    /// Returns a test image of 9 x 5 pixels with values from 0 to 2048, which OpenEXR stores
    /// exactly.
    fn floats() -> Rgb32FImage {
        Rgb32FImage::from_fn(9, 5, |x, y| Rgb([f32::exp2(x as f32 + 3.0), 0.5, y as f32]))
    }

    fn hdr(image: &Rgb32FImage) -> Vec<u8> {
        let pixels: Vec<_> = image.pixels().copied().collect();
        let mut bytes = Vec::new();
        let encoder = HdrEncoder::new(&mut bytes);
        encoder.encode(&pixels, image.width() as usize, image.height() as usize).unwrap();
        bytes
    }

    fn encoded(image: DynamicImage, format: ImageFormat) -> Vec<u8> {
        let mut bytes = Cursor::new(Vec::new());
        image.write_to(&mut bytes, format).unwrap();
        bytes.into_inner()
    }

    #[test]
    fn radiance_is_decoded_from_every_format() {
        let exr = encoded(floats().into(), ImageFormat::OpenExr);
        let map = RadianceMap::parse(&source(exr)).unwrap();
        assert_eq!(map.size, [9, 5]);
        assert_eq!(map.pixels[2 * 9 + 4], [128.0, 0.5, 2.0]);
        // The channels of a pixel in a Radiance file share an exponent. Only channels of similar
        // magnitude are therefore stored exactly.
        let simple = Rgb32FImage::from_fn(9, 5, |x, _| Rgb([f32::exp2(x as f32); 3]));
        let map = RadianceMap::parse(&source(hdr(&simple))).unwrap();
        assert_eq!(map.pixels[9 + 8], [256.0; 3]);
        let exposed = String::from_utf8_lossy(&hdr(&simple)[..11]).replace('\n', "\nEXPOSURE=4\n");
        let bytes = [exposed.as_bytes(), &hdr(&simple)[11..]].concat();
        let map = RadianceMap::parse(&source(bytes)).unwrap();
        assert_eq!(map.pixels[9 + 8], [64.0; 3]);
        let levels = image::RgbImage::from_pixel(3, 2, image::Rgb([255, 0, 188]));
        let map = RadianceMap::parse(&source(encoded(levels.into(), ImageFormat::Png))).unwrap();
        let [r, g, b] = map.pixels[5];
        assert!(r == 1.0 && g == 0.0 && (b - 0.503).abs() < 1e-3, "{b}");
    }

    #[test]
    fn negative_radiance_is_black_and_infinite_radiance_an_error() {
        let mut image = floats();
        image.put_pixel(3, 2, Rgb([-1.0, 0.25, 0.5]));
        let file =
            |image: &Rgb32FImage| source(encoded(image.clone().into(), ImageFormat::OpenExr));
        let map = RadianceMap::parse(&file(&image)).unwrap();
        assert_eq!(map.pixels[2 * 9 + 3], [0.0, 0.25, 0.5]);
        for bad in [f32::NAN, f32::INFINITY, 2e15] {
            image.put_pixel(3, 2, Rgb([0.0, bad, 0.0]));
            let error = RadianceMap::parse(&file(&image)).unwrap_err().to_string();
            assert!(error.contains("pixel 3, 2"), "{error}");
        }
    }

    #[test]
    fn directions_have_their_pixels() {
        // 4 x 2 pixels with different colours.
        let pixels = (0..8).map(|i| [i as f32, 0.0, 1.0]).collect();
        let map = RadianceMap::new([4, 2], pixels);
        let red = |direction: [f64; 3]| map.radiance(direction)[0];
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
            assert!(red(pole).is_finite() && map.density(pole) > 0.0);
        }
    }

    #[test]
    fn samples_have_their_density_and_their_direction() {
        let pixels = (0..32 * 16).map(|i| [((i * 7919) % 31) as f32, 0.5, (i % 5) as f32]);
        let map = RadianceMap::new([32, 16], pixels.collect());
        for i in 0..2000u32 {
            let u = (f64::from(i) + 0.5) / 2000.0;
            let v = (f64::from(i.reverse_bits()) + 0.5) / f64::from(u32::MAX);
            let (direction, density) = map.sample(u, v);
            let length: f64 = direction.iter().map(|x| x * x).sum();
            assert!((length - 1.0).abs() < 1e-12);
            let expected = map.density(direction);
            assert!((density / expected - 1.0).abs() < 1e-9, "{i}: {density}, {expected}");
        }
    }

    #[test]
    fn hostile_files_are_rejected_before_allocation() {
        let found = |bytes: Vec<u8>| RadianceMap::parse(&source(bytes)).unwrap_err().found;
        let header = |size: &str| format!("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n{size}\n");
        for (size, words) in [
            ("-Y 60000 +X 60000", "60000 x 60000"),
            ("-Y 4294967295 +X 4294967295", "cannot be read"),
            ("-Y 8000 +X 4000", "more than its"),
            ("-Y 0 +X 4", "4 x 0"),
            ("-Y 4", "cannot be read"),
            ("", "cannot be read"),
        ] {
            let found = found(header(size).into_bytes());
            assert!(found.contains(words), "{size}: {found}");
        }
        let whole = [hdr(&floats()), encoded(floats().into(), ImageFormat::OpenExr)];
        for bytes in whole {
            for kept in [0, 1, 8, 12, 30, bytes.len() / 2, bytes.len() - 1] {
                assert!(!found(bytes[..kept].to_vec()).is_empty(), "{kept} bytes");
            }
        }
        // The next file declares a layer that is wider than the limit.
        let mut wide = encoded(floats().into(), ImageFormat::OpenExr);
        let window = b"dataWindow\0box2i\0\x10\0\0\0";
        let start = wide.windows(window.len()).position(|bytes| bytes == window).unwrap();
        let right = start + window.len() + 8;
        wide[right..right + 4].copy_from_slice(&((1i32 << 20) - 1).to_le_bytes());
        let found_in_wide = found(wide);
        assert!(found_in_wide.contains("1048576 x 5"), "{found_in_wide}");
        assert!(found(b"no image".to_vec()).contains("known format"));
    }
}
